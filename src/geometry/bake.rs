//! From a head CT to a mesh of the face: region, surfaces, bones, tetrahedra, slit, layers, and what to beware of.

use super::anatomy::{Check, Hints};
use super::assemble::{Assembled, Bone, Kind, Naming, assemble, bridges};
use super::bones::{BONES, bone_map};
use super::clean::{one_body, outer_air, soften_islands, solid_bones};
use super::domain::{beside, deep, part_of, reached, resampled, skin_part, split_bones, volume_of};
use super::face::{empty, mouth, nose_tip, region};
use super::found::Found;
use super::label::{LayerShare, Layers};
use super::labels::usable;
use super::mesher::{Detail, Effort, Plan, fill, part as part_along, polish, split_edges};
use super::resolution::{Places, Resolution, level};
use super::sampled::{Sampled, cubic};
use super::slit::Slit;
use super::stuffing::{Side, Wall};
use super::warning::{Under, Warning, thin};
use super::{Cuboid, Distance, Field, Labels, MeshReport, MeshingError, Nearest, Surface, Volume, unsigned};
use crate::math::Vec3;
use crate::mesh::{SKIN, TetMesh};

/// Rim of the region left out of the distances reported, m: there the lattice meets the cut planes.
const RIM: f64 = 0.005;
/// Spacing of the fields that the mesher follows, m.
const SPACING: f64 = 1e-3;
/// Cells of the lattice: the coarsest, the finest, the finest in thin tissue, the coarsest at a surface, m.
const COARSEST: f64 = 16e-3;
const FINEST: f64 = 2e-3;
const THIN: f64 = 0.5e-3;
const CAP: f64 = 4e-3;
/// Thin tissue is resolved where it lies this near to the outer skin, m.
const NEAR_SKIN: f64 = 4e-3;
/// Where the mouth is, below and behind the tip of the nose, m, if the jaws do not say.
const MOUTH: [f64; 3] = [0.0, 0.015, -0.032];
/// Bone nearer than this to a second bone holds nothing: the joint's capsule, m.
const JOINT: f64 = 6e-3;
/// Hounsfield units below which tissue under the skin is fat.
const FAT_HU: f64 = -10.0;
/// Polish before the mesh is parted, after it was, and after edges between bones were split.
const FIRST: Effort = Effort { rounds: 3, all: 1, swaps: 0, rescue: 1, fit: 0 };
const PARTED: Effort = Effort { rounds: 1, all: 0, swaps: 2, rescue: 1, fit: 0 };
const SPLIT: Effort = Effort { rounds: 1, all: 0, swaps: 0, rescue: 6, fit: 0 };
/// Where the foremost skin is further than this from the tip of the nose, the head is turned, m.
const TURNED: f64 = 0.02;
/// Search reach for a second bone, m: beyond the crowns of the teeth and the joint's capsule.
const NEAR: f64 = 0.013;

/// How to bake.
#[derive(Debug, Clone, PartialEq)]
pub struct BakeOptions {
    /// Threshold of the skin, HU.
    pub skin_hu: f64,
    /// Threshold of bone, HU.
    pub bone_hu: f64,
    /// Region of interest, corners in LPS metres; without one the face is found from the nose tip.
    pub roi: Option<[Vec3; 2]>,
    /// How fine the mesh is.
    pub resolution: Resolution,
    /// How far from the outer skin the mesh reaches, m, measured round the bones: without the brain behind them.
    pub depth: f64,
    /// Tissue layers by depth.
    pub layers: Layers,
    /// Whether Hounsfield units tell fat from muscle below the dermis.
    pub fat_by_hu: bool,
    /// Whether to cut the closed mouth along the oral slit.
    pub slit: bool,
    /// Box in which the slit may run, corners in LPS metres; without one it is found from the teeth.
    pub mouth: Option<[Vec3; 2]>,
    /// What is known of the anatomy.
    pub hints: Hints,
    /// Whether bones or a hinge that fail a check are refused, not only told.
    pub strict: bool,
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self {
            skin_hu: -300.0,
            bone_hu: 250.0,
            roi: None,
            resolution: Resolution::default(),
            depth: 0.05,
            layers: Layers::default(),
            fat_by_hu: true,
            slit: true,
            mouth: None,
            hints: Hints::default(),
            strict: false,
        }
    }
}

/// A mesh of the face at one resolution.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// The mesh: node sets by bone; face sets `skin`, each bone, `cut`, `free`; regions by depth.
    pub mesh: TetMesh,
    /// What it is worth.
    pub report: MeshReport,
    /// Share of the volume of each layer.
    pub layers: Vec<LayerShare>,
    /// Nodes doubled along the oral slit.
    pub slit_nodes: usize,
    /// Bone nodes released because a second bone is near.
    pub released_nodes: usize,
}

/// Meshes of a face and what is known about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Baked {
    /// The mesh that was asked for.
    pub finest: Level,
    /// Coarser meshes of the same domain, the finest first.
    pub coarser: Vec<Level>,
    /// What to beware of.
    pub warnings: Vec<Warning>,
    /// Labels of the bones: those given, or those found. Found ones whose checks fail were not used.
    pub labels: Option<Labels>,
    /// Figures that bones and hinge were judged by.
    pub checks: Vec<Check>,
    /// Heads of the right and the left condyle, LPS, m: the jaw opens about the line through them. None where they are not
    /// in the scan or their checks fail.
    pub condyles: Option<[Vec3; 2]>,
    /// Box in which the lips were parted, corners in LPS metres.
    pub mouth: Option<[Vec3; 2]>,
}

/// Bakes the soft tissue of a face: inside the skin, outside the bones, inside the region of interest. `progress` is told
/// each stage and the share of the work done.
///
/// # Errors
/// [`MeshingError::EmptyIsosurface`] when a threshold is never passed, [`MeshingError::NoTissue`],
/// [`MeshingError::Region`] when the region misses the volume, [`MeshingError::Mesh`] and the lattice's.
pub fn bake(
    volume: &Volume,
    labels: Option<&Labels>,
    options: &BakeOptions,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Baked, MeshingError> {
    progress("region", 0.0);
    if options.skin_hu >= options.bone_hu {
        return Err(MeshingError::Thresholds { skin: options.skin_hu, bone: options.bone_hu });
    }
    options.resolution.checked()?;
    let volume = &*volume.upright();
    let foremost = nose_tip(volume, options)?;
    progress("anatomy", 0.01);
    let found = Found::of(volume, labels, options)?;
    let nose = found.nose.filter(|n| (n - foremost).norm() > TURNED).unwrap_or(foremost);
    let region = region(volume, options, &nose)?;
    let mut warnings = match labels {
        Some(labels) => usable(labels, volume, options.bone_hu, &region)?,
        None => Vec::new(),
    };
    warnings.extend(found.warnings);
    let mut part = part_of(volume, &region);
    progress("surfaces", 0.1);
    one_body(&mut part, options.skin_hu);
    soften_islands(&mut part, options.bone_hu);
    let first = Distance::to_isosurface(&part, options.bone_hu);
    if first.surface.triangles.is_empty() {
        return Err(empty("bone", options.bone_hu, &part));
    }
    solid_bones(&mut part, options.bone_hu, &first);
    let to_bone = Distance::to_isosurface(&part, options.bone_hu);
    let to_skin = Distance::to_isosurface(&part, options.skin_hu);
    if to_skin.surface.triangles.is_empty() {
        return Err(empty("skin", options.skin_hu, &part));
    }
    let outer = outer_air(&part, options.skin_hu, &to_skin);
    let outer_skin = skin_part(&to_skin.surface, &part, &outer, true);
    let under = unsigned(&part.grid, &outer_skin);
    progress("bones", 0.45);
    let (map, told) = bone_map(&part, options.bone_hu, found.labels.as_ref().filter(|_| found.trusted));
    let deep = deep(&mut part, options, &outer, &to_bone);
    let part = part;
    let to_bone = Distance::to_isosurface(&part, options.bone_hu);
    let under = |p: &Vec3| part.grid.sample(&under, p);
    let deep = |p: &Vec3| part.grid.sample(&deep, p);
    let bone_surfaces = split_bones(&part, &to_bone.surface, &map);
    let bins: Vec<Nearest> = bone_surfaces.iter().map(|s| Nearest::new(s, 4e-3)).collect();
    // Names only ask whether a second bone is nearer than the joint's capsule, or than the crowns of the teeth.
    let near: Vec<_> = bins.iter().map(|b| move |p: &Vec3| b.distance(p, NEAR).map_or(NEAR, |d| d.0)).collect();
    let mouth = mouth(options, &bone_surfaces, &nose, found.commissures, told);
    progress("tetrahedra", 0.5);
    let grid = cubic(region.low - Vec3::repeat(SPACING), region.high + Vec3::repeat(SPACING), SPACING);
    let skin = resampled(&grid, &part, options.skin_hu, &to_skin);
    let bone = resampled(&grid, &part, options.bone_hu, &to_bone);
    let deep = Sampled::of(&grid, &deep);
    let walls = [
        Wall { name: SKIN, field: &skin, side: Side::Inside },
        Wall { name: "bone", field: &bone, side: Side::Outside },
        Wall { name: "deep", field: &deep, side: Side::Inside },
    ];
    let places = Places {
        mouth: mouth.map_or(nose + Vec3::from(MOUTH), |m| 0.5 * (m.lips.low + m.lips.high)),
        under: Sampled::of(&grid, &under),
        growth: options.resolution.growth,
    };
    let fine = options.resolution.fineness();
    let detail = Detail {
        tolerance: options.resolution.lattice_errors(),
        cap: CAP * fine,
        scale: &|p| places.scale(p),
        floor: FINEST * fine,
        thin: &|p| if places.under.at(p) < NEAR_SKIN { THIN * fine } else { f64::INFINITY },
    };
    let mut meshed = fill(&Plan::new(region, COARSEST, THIN * fine)?, &walls, &detail);
    if meshed.mesh.tets.is_empty() {
        return Err(MeshingError::NoTissue { walls: "skin, bone, deep".into(), edge: THIN * fine });
    }
    let repair = meshed.repair;
    progress("shape", 0.6);
    polish(&mut meshed, &walls, None, FIRST);
    let slit = mouth.map(|m| Slit::new(&m, &bone_surfaces[0], &bone_surfaces[1], &under));
    let sheet = slit.as_ref().map(Slit::sheet);
    if let Some(sheet) = &sheet {
        part_along(&mut meshed, &walls, sheet);
        polish(&mut meshed, &walls, Some(sheet), PARTED);
    }
    let apart = |p: &Vec3| mouth.map_or(JOINT, |m| m.apart(p, JOINT));
    let present: Vec<usize> = (0..BONES.len()).filter(|&k| !bone_surfaces[k].triangles.is_empty()).collect();
    let bones: Vec<Bone> = present.iter().map(|&k| Bone { name: BONES[k], field: &near[k] }).collect();
    let naming = Naming {
        kinds: &[Kind::Skin, Kind::Bone, Kind::Cut],
        bones: &bones,
        apart: &apart,
        is_outer: &|p| outer[part.grid.index(part.grid.nearest(p))],
    };
    // Skin is what faces the outer air: the airways have no dermis.
    let depth = |p: &Vec3| (under(p), to_bone.at(p));
    let fatty = |p: &Vec3| options.fat_by_hu.then(|| part.sample(p) < FAT_HU);
    let reached = reached(&part, options, &outer, &region, &deep);
    let wanted_volume = volume_of(&part, &reached, &region);
    let inner = Cuboid { low: region.low + Vec3::repeat(RIM), high: region.high - Vec3::repeat(RIM) };
    let wanted: Vec<(usize, Surface)> =
        present.iter().map(|&k| (k, beside(&bone_surfaces[k], &part, &reached))).collect();
    let mut levels = Vec::new();
    let count = options.resolution.levels;
    for number in 0..count {
        progress("resolution", 0.65 + 0.3 * number as f64 / count as f64);
        level(&mut meshed, &walls, sheet, &places, &options.resolution, number);
        let mut tissue = meshed.clone();
        let joined = bridges(&tissue.mesh, &naming);
        split_edges(&mut tissue.mesh, &mut tissue.faces, joined);
        polish(&mut tissue, &walls, sheet.as_ref(), SPLIT);
        let Assembled { mut mesh, slit_nodes, released_nodes } = assemble(tissue.mesh, &tissue.faces, &naming);
        let layers = options.layers.label(&mut mesh, &depth, &fatty);
        let mesh = mesh.checked()?;
        let mut report = MeshReport::of(&mesh, slit_nodes);
        report.wanted_volume = Some(wanted_volume);
        report.measure_surface(&mesh, SKIN, &outer_skin, &inner);
        for (k, surface) in wanted.iter().filter(|(k, _)| mesh.face_set(BONES[*k]).is_some()) {
            report.measure_surface(&mesh, BONES[*k], surface, &inner);
        }
        levels.push(Level { mesh, report, layers, slit_nodes, released_nodes });
    }
    progress("report", 0.95);
    let inner_skin = skin_part(&to_skin.surface, &part, &outer, false);
    let under = Under { to_bone: &to_bone, inner: &inner_skin, bins: Nearest::new(&inner_skin, COARSEST / 4.0) };
    warnings.extend(thin(&outer_skin, &under, THIN * fine, &inner));
    if !told {
        warnings.push(Warning::JawNotFound);
    }
    if options.slit && levels.iter().any(|l| l.slit_nodes == 0) {
        warnings.push(Warning::NoSlit);
    }
    if repair.dropped_components > 0 {
        warnings.push(Warning::Dropped { pieces: repair.dropped_components, volume: repair.dropped_volume });
    }
    let coarse = |s: &&LayerShare| (s.reached - s.wanted).abs() > 0.1 * s.wanted;
    warnings.extend(levels[0].layers.iter().filter(coarse).cloned().map(Warning::Layer));
    progress("done", 1.0);
    let mouth = mouth.map(|m| [m.lips.low, m.lips.high]);
    let finest = levels.remove(0);
    let Found { labels, checks, condyles, .. } = found;
    Ok(Baked { finest, coarser: levels, warnings, labels, checks, condyles, mouth })
}
