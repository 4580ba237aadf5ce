//! What to beware of in a baked mesh: thin tissue, a jaw that hangs on, pieces left out.

use std::fmt;

use super::anatomy::Check;
use super::label::LayerShare;
use super::{Cuboid, Distance, Field, Nearest, Surface, doubled_area};
use crate::math::Vec3;

/// Something the user should know about a mesh that was made.
#[derive(Debug, Clone, PartialEq)]
pub enum Warning {
    /// Tissue thinner than the finest cells of the lattice: it may be missing from the mesh.
    Thin {
        /// Thinnest place, LPS, m.
        place: Vec3,
        /// Thickness there, m.
        thickness: f64,
        /// Skin area over such tissue, m2.
        area: f64,
        /// The finest cells, m.
        finest: f64,
    },
    /// Skull and mandible hang together: the jaw cannot move.
    JawNotFound,
    /// A figure of the bones that none of a head's can have.
    Bones {
        /// What fails.
        check: Check,
        /// Whether the bones are those of labels or seeds that were given.
        given: bool,
    },
    /// The bite is not seen.
    Bite {
        /// What fails.
        check: Check,
    },
    /// The corners of the mouth are not seen.
    Mouth {
        /// What fails.
        check: Check,
    },
    /// A figure of the jaw's hinge that none of a head's can have.
    Hinge {
        /// What fails.
        check: Check,
    },
    /// No slit was cut.
    NoSlit,
    /// Loose pieces that were left out.
    Dropped {
        /// How many.
        pieces: usize,
        /// Their volume, m3.
        volume: f64,
    },
    /// A layer that the mesh is too coarse for.
    Layer(LayerShare),
    /// A bone that the labels do not have.
    NoLabel {
        /// The bone and its number.
        bone: &'static str,
        /// Its number.
        wanted: u8,
        /// Numbers found, as a list.
        found: String,
    },
    /// Labels of a part of the region only.
    LabelsCropped {
        /// Corners of the labels, LPS, m.
        labels: [Vec3; 2],
    },
    /// Labels of bone where there is none.
    LabelsOffBone {
        /// Share of the voxels labelled as bone that are at or above the threshold of bone.
        share: f64,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Thin { place, thickness, area, finest } => {
                let p = place * 1e3;
                write!(
                    f,
                    "{:.1} cm2 of skin cover tissue thinner than the finest cells ({:.1} mm), which may be missing: \
                     {:.2} mm at ({:.1}, {:.1}, {:.1}) mm LPS at the thinnest",
                    area * 1e4,
                    finest * 1e3,
                    thickness * 1e3,
                    p.x,
                    p.y,
                    p.z
                )
            }
            Self::JawNotFound => write!(
                f,
                "skull and mandible could not be told apart: all bone is `skull`, the jaw cannot move; give --labels, or \
                 show places of the bones with --seed, the line through the condyles with --hinge, the bite with --occlusal"
            ),
            Self::Bones { check, given: false } => {
                write!(f, "the bones that were found are not to be trusted: {check}")
            }
            Self::Bones { check, given: true } => write!(f, "do the labels or seeds fit this head? {check}"),
            Self::Bite { check } => write!(
                f,
                "where the teeth meet is not seen: {check}; their crowns may belong to the wrong jaw: look at them, or give \
                 --occlusal"
            ),
            Self::Mouth { check } => write!(
                f,
                "the corners of the mouth are not seen: {check}; taken at 25 mm from the median plane: give --commissures"
            ),
            Self::Hinge { check } => {
                write!(f, "the hinge of the jaw is not told: {check}; give the two condyles with --hinge")
            }
            Self::NoSlit => write!(
                f,
                "no oral slit was cut: no faces between the jaws in the mouth's box; give the box of the mouth"
            ),
            Self::Dropped { pieces, volume } => write!(f, "{pieces} loose piece(s) of {:.2} mL left out", volume * 1e6),
            Self::NoLabel { bone, wanted, found } => write!(
                f,
                "the labels have no {bone}: found the numbers {found}, wanted {wanted} (other numbers: --labels-map)"
            ),
            Self::LabelsCropped { labels: [low, high] } => {
                let (p, q) = (low * 1e3, high * 1e3);
                write!(
                    f,
                    "the labels reach from ({:.1}, {:.1}, {:.1}) to ({:.1}, {:.1}, {:.1}) mm LPS, the region goes beyond: \
                     bone out there belongs to the labelled bone that it hangs on, else to the skull",
                    p.x, p.y, p.z, q.x, q.y, q.z
                )
            }
            Self::LabelsOffBone { share } => write!(
                f,
                "{:.0} % of what the labels call bone is bone by its density: are they the labels of this scan?",
                100.0 * share
            ),
            Self::Layer(s) => write!(
                f,
                "layer `{}` takes {:.1} % of the volume, by depth it should take {:.1} %: choose a shorter edge",
                s.name,
                s.reached * 100.0,
                s.wanted * 100.0
            ),
        }
    }
}

/// What the thickness of tissue under the outer skin is measured to.
pub(super) struct Under<'a> {
    pub to_bone: &'a Distance,
    /// Skin that faces inner air, and a finder of its nearest triangle.
    pub inner: &'a Surface,
    pub bins: Nearest<'a>,
}

impl Under<'_> {
    /// Thickness under the middle of a skin triangle, to bone or to air; infinite beyond `reach`.
    fn thickness(&self, corners: [Vec3; 3], reach: f64) -> f64 {
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let bone = self.to_bone.at(&middle).max(0.0);
        let air = self.bins.distance(&middle, reach).filter(|(_, t)| {
            // Opposite walls of a sheet, not the rim where outer and inner skin meet.
            let (a, b) = (doubled_area(corners), doubled_area(self.inner.corners(*t)));
            a.dot(&b) < -0.5 * a.norm() * b.norm()
        });
        air.map_or(bone, |(air, _)| air.min(bone))
    }
}

/// Tissue under the outer skin that is thinner than the finest cells of the lattice.
pub(super) fn thin(skin: &Surface, under: &Under, finest: f64, within: &Cuboid) -> Option<Warning> {
    let (mut all, mut thinnest) = (0.0, (f64::INFINITY, Vec3::zeros()));
    for t in 0..skin.triangles.len() {
        let corners = skin.corners(t);
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        if within.at(&middle) > 0.0 {
            continue;
        }
        let found = under.thickness(corners, finest);
        if found < finest {
            all += doubled_area(corners).norm() / 2.0;
            if found < thinnest.0 {
                thinnest = (found, middle);
            }
        }
    }
    let (thickness, place) = thinnest;
    (all > 0.0).then_some(Warning::Thin { place, thickness, area: all, finest })
}
