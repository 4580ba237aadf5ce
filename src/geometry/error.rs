//! Why a shape could not be meshed.

use super::anatomy::Check;
use crate::mesh::MeshError;

/// Why a mesh was not made. Nothing was changed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshingError {
    /// A length or count that must be positive is not.
    #[error("{what} is {found}; it must be positive and finite")]
    NotPositive {
        /// What was given: "block size along y".
        what: String,
        /// The value found.
        found: f64,
    },
    /// A factor on errors and edges that would make them smaller.
    #[error("errors and edges may grow by a factor of 1 or more away from the mouth; found {found}")]
    Growth {
        /// The factor found.
        found: f64,
    },
    /// More elements than the 32-bit node numbers of a mesh can hold.
    #[error(
        "{what} would need {found} nodes, more than the {limit} that fit a mesh; choose fewer cells or a longer edge"
    )]
    TooLarge {
        /// What was asked for.
        what: String,
        /// Nodes it would need.
        found: u128,
        /// Most nodes possible.
        limit: u64,
    },
    /// Layer fractions that do not fill a block.
    #[error(
        "layer `{name}` brings the sum of the layer fractions to {sum}; each must be positive and the sum at most 1"
    )]
    Layers {
        /// Name of the first layer that does not fit.
        name: String,
        /// Sum of the fractions up to and with it.
        sum: f64,
    },
    /// Nothing lies between the surfaces, or all of it is thinner than the lattice sees.
    #[error("no tissue lies between the surfaces ({walls}) at lattice edge {:.2} mm; check the thresholds and the region, or choose a shorter edge", edge * 1e3)]
    NoTissue {
        /// Names of the surfaces.
        walls: String,
        /// Lattice edge, m.
        edge: f64,
    },
    /// A threshold that the volume never passes.
    #[error(
        "no {name} surface at {iso} HU: the samples range from {least} to {most}; check that the file is a CT in Hounsfield units (air -1000, water 0: an offset of 1024 is common) and the threshold"
    )]
    EmptyIsosurface {
        /// "skin" or "bone".
        name: &'static str,
        /// Threshold, HU.
        iso: f64,
        /// Smallest sample.
        least: f64,
        /// Largest sample.
        most: f64,
    },
    /// A region of interest that does not meet the volume.
    #[error(
        "the region of interest {region:.3?} m does not overlap the volume {volume:.3?} m by {:.0} mm; give it in LPS coordinates of the scan",
        least * 1e3
    )]
    Region {
        /// Least overlap along each axis, m.
        least: f64,
        /// Corners asked for, LPS, m.
        region: [[f64; 3]; 2],
        /// Corners of the volume, LPS, m.
        volume: [[f64; 3]; 2],
    },
    /// Thresholds the wrong way round.
    #[error("the skin threshold ({skin} HU) must lie below the bone threshold ({bone} HU); -300 and 250 are usual")]
    Thresholds {
        /// Skin threshold, HU.
        skin: f64,
        /// Bone threshold, HU.
        bone: f64,
    },
    /// Labels of another place.
    #[error(
        "the labels {labels:.3?} m do not overlap the region to mesh {region:.3?} m (LPS); give the labels of this scan"
    )]
    Labels {
        /// Corners of the region, LPS, m.
        region: [[f64; 3]; 2],
        /// Corners of the labels, LPS, m.
        labels: [[f64; 3]; 2],
    },
    /// Labels without any bone.
    #[error(
        "the labels hold the numbers {found} and no bone; wanted 2 (skull), 3 (mandible), 4 (spine) and 6 (hyoid): say what stands \
         for them, for example `--labels-map skull=5,mandible=1`"
    )]
    LabelNumbers {
        /// Numbers found, as a list.
        found: String,
    },
    /// A seed that shows no bone.
    #[error("the seed of `{bone}` at {place:.4?} m (LPS) does nothing: {why}")]
    Seed {
        /// Bone named.
        bone: String,
        /// Place, LPS, m.
        place: [f64; 3],
        /// What is wrong with it.
        why: &'static str,
    },
    /// Bones or a hinge that fail a check, where that is not allowed.
    #[error("the anatomy of the head is doubtful: {}; give --labels, or help with --seed, --hinge and --occlusal", doubts(.checks))]
    Doubtful {
        /// The checks that fail; none where there is no bone in the body.
        checks: Vec<Check>,
    },
    /// The finished mesh broke a rule every mesh keeps.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

fn doubts(checks: &[Check]) -> String {
    match checks {
        [] => "no bone lies in the body that the scan shows".into(),
        checks => checks.iter().map(Check::to_string).collect::<Vec<_>>().join("; "),
    }
}
