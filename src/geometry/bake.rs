//! From a head CT to a mesh of the face: region, surfaces, bones, tetrahedra, slit, layers, and what to beware of.

use super::anatomy::{About, Anatomy, Check, Hints, anatomy};
use super::assemble::{Assembled, Bone, Kind, Naming, assemble};
use super::bones::{BONES, bone_map};
use super::clean::{crop, flood, one_body, outer_air, soften_islands, solid_bones};
use super::distance::{travel, unsigned};
use super::face::{empty, mouth, nose_tip, region};
use super::label::{LayerShare, Layers};
use super::labels::usable;
use super::stuffing::{Side, Wall};
use super::warning::{Under, Warning, thin};
use super::{
    Cuboid, Distance, Field, Isosurface, Labels, Lattice, MeshReport, MeshingError, Nearest, Sizing, Surface, Volume,
    stuff,
};
use crate::math::Vec3;
use crate::mesh::{SKIN, TetMesh};

/// What is read round the region of interest, m, so that distances at its rim are right.
const MARGIN: f64 = 0.010;
/// Rim of the region left out of the distances reported, m: there the lattice meets the cut planes.
const RIM: f64 = 0.005;
/// Thickened tissue is this many edges thick: a lattice breaks through thinner layers.
const THICK: f64 = 1.7;
/// Hounsfield units below which tissue under the skin is fat.
const FAT_HU: f64 = -10.0;
/// Ways into the depth pass bone at this distance at least, m: not through the thin roof of an orbit into the brain.
const PASSAGE: f64 = 3e-3;
/// Search reach for the nearest bone, m.
const REACH: f64 = 0.06;

/// Where the foremost skin is further than this from the tip of the nose, the head is turned, m.
const TURNED: f64 = 0.02;
/// Search reach for a second bone, m: beyond the crowns of the teeth.
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
    /// Lattice edge, m.
    pub edge: f64,
    /// How far from the outer skin the mesh reaches, m, measured round the bones: without the brain behind them.
    pub depth: f64,
    /// Whether tissue too thin for the lattice is thickened into the bone under it, so that the skin stays whole.
    pub thicken: bool,
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
            edge: 4e-3,
            depth: 0.05,
            thicken: true,
            layers: Layers::default(),
            fat_by_hu: true,
            slit: true,
            mouth: None,
            hints: Hints::default(),
            strict: false,
        }
    }
}

/// A mesh of the face and what is known about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Baked {
    /// The mesh: node sets by bone; face sets `skin`, each bone, `cut`, `free`; regions by depth.
    pub mesh: TetMesh,
    /// What it is worth.
    pub report: MeshReport,
    /// What to beware of.
    pub warnings: Vec<Warning>,
    /// Share of the volume of each layer.
    pub layers: Vec<LayerShare>,
    /// Labels of the bones: those given, or those found. Found ones whose checks fail were not used.
    pub labels: Option<Labels>,
    /// Figures that bones and hinge were judged by.
    pub checks: Vec<Check>,
    /// Heads of the right and the left condyle, LPS, m: the jaw opens about the line through them. None where they are not
    /// in the scan or their checks fail.
    pub condyles: Option<[Vec3; 2]>,
    /// Box in which the lips were parted, corners in LPS metres.
    pub mouth: Option<[Vec3; 2]>,
    /// Nodes doubled along the oral slit.
    pub slit_nodes: usize,
    /// Bone nodes released because a second bone is near.
    pub released_nodes: usize,
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
    let under = |p: &Vec3| part.grid.sample(&under, p);
    let deep = deep(&part, options, &outer, &to_bone);
    progress("bones", 0.45);
    let (map, told) = bone_map(&part, options.bone_hu, found.labels.as_ref().filter(|_| found.trusted));
    let bone_surfaces = split_bones(&part, &to_bone.surface, &map);
    let bins: Vec<Nearest> = bone_surfaces.iter().map(|s| Nearest::new(s, 4e-3)).collect();
    let within = |reach: f64| bins.iter().map(move |b| move |p: &Vec3| b.distance(p, reach).map_or(reach, |d| d.0));
    let to: Vec<_> = within(REACH).collect();
    // Names only ask whether a second bone is nearer than an edge, or than the crowns of the teeth.
    let near: Vec<_> = within(NEAR.max(2.0 * options.edge)).collect();
    progress("tetrahedra", 0.55);
    let skin = Isosurface { volume: &part, iso: options.skin_hu, distance: &to_skin };
    let bone = Isosurface { volume: &part, iso: options.bone_hu, distance: &to_bone };
    let receded = |p: &Vec3| {
        let d = bone.at(p);
        if options.thicken { d.max(THICK * options.edge - under(p)) } else { d }
    };
    let walls = [
        Wall { name: SKIN, field: &skin, side: Side::Inside },
        Wall { name: "bone", field: &receded, side: Side::Outside },
        Wall { name: "cut", field: &region, side: Side::Inside },
        Wall { name: "deep", field: &deep, side: Side::Inside },
    ];
    let lattice = Lattice::over(&region, &super::Uniform(options.edge) as &dyn Sizing)?;
    let stuffing = stuff(&walls, &lattice)?;
    let repair = stuffing.repair;
    progress("names", 0.7);
    let mouth = mouth(options, &bone_surfaces, &nose, found.commissures, told);
    let parts = |c: [Vec3; 3], a: Vec3, b: Vec3| {
        let side = |p: &Vec3| to[1](p) < to[0](p);
        let middle = (c[0] + c[1] + c[2]) / 3.0;
        mouth.is_some_and(|m| m.parts(&middle, [&to[0], &to[1]], &under)) && side(&a) != side(&b)
    };
    let apart = |p: &Vec3| mouth.map_or(options.edge, |m| m.apart(p, options.edge));
    let present: Vec<usize> = (0..BONES.len()).filter(|&k| !bone_surfaces[k].triangles.is_empty()).collect();
    let bones: Vec<Bone> = present.iter().map(|&k| Bone { name: BONES[k], field: &near[k] }).collect();
    let naming = Naming {
        walls: &walls,
        kinds: &[Kind::Skin, Kind::Bone, Kind::Cut, Kind::Cut],
        bones: &bones,
        edge: options.edge,
        apart: &apart,
        slit: mouth.is_some().then_some(&parts),
        is_outer: &|p| outer[part.grid.index(part.grid.nearest(p))],
    };
    let Assembled { mut mesh, slit_nodes, released_nodes } = assemble(stuffing.mesh, &naming);
    let depth = |p: &Vec3| (-to_skin.at(p), to_bone.at(p));
    let fatty = |p: &Vec3| options.fat_by_hu.then(|| part.sample(p) < FAT_HU);
    let layers = options.layers.label(&mut mesh, &depth, &fatty);
    let mesh = mesh.checked()?;
    progress("report", 0.8);
    let mut report = MeshReport::of(&mesh, slit_nodes);
    let reached = reached(&part, options, &outer, &region, &deep);
    report.wanted_volume = Some(volume_of(&part, &reached, &region));
    let inner = Cuboid { low: region.low + Vec3::repeat(RIM), high: region.high - Vec3::repeat(RIM) };
    report.measure_surface(&mesh, SKIN, &outer_skin, &inner);
    for &k in present.iter().filter(|&&k| mesh.face_set(BONES[k]).is_some()) {
        report.measure_surface(&mesh, BONES[k], &beside(&bone_surfaces[k], &part, &reached), &inner);
    }
    let inner_skin = skin_part(&to_skin.surface, &part, &outer, false);
    let under = Under { to_bone: &to_bone, inner: &inner_skin, bins: Nearest::new(&inner_skin, options.edge) };
    warnings.extend(thin(&outer_skin, &under, options.edge, options.thicken, &inner));
    if !told {
        warnings.push(Warning::JawNotFound);
    }
    if options.slit && slit_nodes == 0 {
        warnings.push(Warning::NoSlit);
    }
    if repair.dropped_components > 0 {
        warnings.push(Warning::Dropped { pieces: repair.dropped_components, volume: repair.dropped_volume });
    }
    let coarse = |s: &&LayerShare| (s.reached - s.wanted).abs() > 0.1 * s.wanted;
    warnings.extend(layers.iter().filter(coarse).cloned().map(Warning::Layer));
    progress("done", 1.0);
    let mouth = mouth.map(|m| [m.lips.low, m.lips.high]);
    let Found { labels, checks, condyles, .. } = found;
    Ok(Baked { mesh, report, warnings, layers, labels, checks, condyles, mouth, slit_nodes, released_nodes })
}

/// What is known of bones and hinge, and what is doubtful in it.
struct Found {
    labels: Option<Labels>,
    /// Whether the labels are to be used.
    trusted: bool,
    checks: Vec<Check>,
    condyles: Option<[Vec3; 2]>,
    /// Right and left corner of the mouth.
    commissures: Option<[Vec3; 2]>,
    nose: Option<Vec3>,
    warnings: Vec<Warning>,
}

impl Found {
    /// Labels given are kept, whatever the checks say of them; labels found are dropped if one fails.
    fn of(volume: &Volume, labels: Option<&Labels>, options: &BakeOptions) -> Result<Self, MeshingError> {
        seeds_on_bone(volume, labels.is_some(), options)?;
        let found = anatomy(volume, labels, [options.skin_hu, options.bone_hu], &options.hints);
        let failed = |about| found.iter().flat_map(move |a| a.doubts(about)).cloned();
        let doubts: Vec<Check> = failed(About::Bones).chain(failed(About::Hinge)).collect();
        if options.strict && !(found.is_some() && doubts.is_empty()) {
            return Err(MeshingError::Doubtful { checks: doubts });
        }
        let given = labels.is_some() || options.hints.part_jaws();
        let bones = failed(About::Bones).next().is_none();
        let hinge = (given || bones) && failed(About::Hinge).next().is_none();
        let mut warnings: Vec<Warning> = failed(About::Bones).map(|check| Warning::Bones { check, given }).collect();
        let found_condyles = match &found {
            Some(Anatomy { condyles: [Some(right), Some(left)], .. }) if hinge => Some([*right, *left]),
            _ => None,
        };
        let condyles = options.hints.hinge.or(found_condyles);
        if condyles.is_none() && found.is_some() && (given || bones) {
            warnings.extend(failed(About::Hinge).map(|check| Warning::Hinge { check }));
        }
        if bones {
            warnings.extend(failed(About::Bite).map(|check| Warning::Bite { check }));
        }
        let believed = found.as_ref().filter(|_| given || bones);
        let mouth_seen = failed(About::Mouth).next().is_none();
        let seen = believed.filter(|_| mouth_seen).map(|a| a.lips.commissures());
        let commissures = options.hints.commissures.or(seen);
        if commissures.is_none() && believed.is_some() && options.slit && options.mouth.is_none() {
            warnings.extend(failed(About::Mouth).map(|check| Warning::Mouth { check }));
        }
        let nose = believed.and_then(|a| a.nose);
        let checks = found.as_ref().map_or(Vec::new(), |a| a.checks.clone());
        let labels = labels.cloned().or(found.map(|a| a.labels));
        Ok(Self { labels, trusted: given || bones, checks, condyles, commissures, nose, warnings })
    }
}

/// Refuses seeds that would do nothing.
fn seeds_on_bone(volume: &Volume, labelled: bool, options: &BakeOptions) -> Result<(), MeshingError> {
    /// Bone is looked for this far from a seed, in steps of this, m.
    const REACH: (i32, f64) = (3, 1e-3);
    for (bone, place) in &options.hints.seeds {
        let steps = || (-REACH.0..=REACH.0).map(|k| f64::from(k) * REACH.1);
        let around = || steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| Vec3::new(x, y, z))));
        let [low, high] = volume.grid.bounds();
        let inside = (0..3).all(|a| (low[a]..=high[a]).contains(&place[a]));
        let on_bone = || around().any(|d| volume.sample(&(place + d)) >= options.bone_hu);
        let why = match () {
            () if !BONES.contains(&bone.as_str()) => "known are `skull`, `mandible`, `spine` and `hyoid`",
            () if labelled => "labels are given: mend them instead",
            () if !inside => "it lies outside of the scan",
            () if !on_bone() => "no bone is within 3 mm of it",
            () => continue,
        };
        return Err(MeshingError::Seed { bone: bone.clone(), place: (*place).into(), why });
    }
    Ok(())
}

/// The samples of a volume in and round a region.
fn part_of(volume: &Volume, region: &Cuboid) -> Volume {
    let grid = &volume.grid;
    let far = Vec3::repeat(f64::INFINITY);
    let (low, high) = (0..8).fold((far, -far), |(low, high), corner| {
        let p =
            Vec3::from_fn(|a, _| if corner >> a & 1 == 0 { region.low[a] - MARGIN } else { region.high[a] + MARGIN });
        let c = grid.coordinates(&p);
        (low.inf(&c), high.sup(&c))
    });
    let bound = |c: f64, a: usize| c.clamp(0.0, grid.dims[a] as f64 - 1.0) as usize;
    crop(volume, [0, 1, 2].map(|a| bound(low[a].floor(), a)), [0, 1, 2].map(|a| bound(high[a].ceil(), a)))
}

/// Where the mesh ends inside: the way from the outer skin round the bones, less how far it may be.
fn deep(part: &Volume, options: &BakeOptions, outer: &[bool], to_bone: &Distance) -> impl Field + use<> {
    let tissue = |hu: &f32| f64::from(*hu) >= options.skin_hu;
    let sources: Vec<bool> = outer.iter().zip(&part.samples).map(|(&o, hu)| o && !tissue(hu)).collect();
    let blocked: Vec<bool> = to_bone.values.iter().map(|&d| f64::from(d) < PASSAGE).collect();
    // A volume without air in front of it has no skin to start from: then nothing is too deep.
    let found = sources.contains(&true);
    let way = if found { travel(&part.grid, &sources, &blocked) } else { vec![0.0; part.grid.len()] };
    let most = options.depth as f32;
    let values: Vec<f32> = way.into_iter().map(|w| (w - most).clamp(-most, most)).collect();
    let grid = part.grid.clone();
    move |p: &Vec3| grid.sample(&values, p)
}

/// The triangles of each bone, by the bone of the nearest bone sample.
fn split_bones(part: &Volume, surface: &Surface, map: &[u8]) -> [Surface; BONES.len()] {
    let grid = &part.grid;
    let bone_at = |t: usize| {
        let corners = surface.corners(t);
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let ([i, j, k], _) = grid.cell(&middle);
        let around = (0..8).map(|c| grid.index([i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1)]));
        let distance = |at: usize| {
            let [nx, ny, _] = grid.dims;
            let p = grid.world(&Vec3::new((at % nx) as f64, (at / nx % ny) as f64, (at / (nx * ny)) as f64));
            (p - middle).norm_squared()
        };
        let nearest = around.filter(|&at| map[at] != 0).min_by(|&p, &q| distance(p).total_cmp(&distance(q)));
        nearest.map_or(0, |at| usize::from(map[at]) - 1)
    };
    let mut parts: [Surface; BONES.len()] = std::array::from_fn(|_| Surface::default());
    for t in 0..surface.triangles.len() {
        parts[bone_at(t)].triangles.push(surface.triangles[t]);
    }
    parts.map(|p| compacted(surface, p.triangles))
}

/// A part of a surface with only the vertices it uses.
fn compacted(surface: &Surface, mut triangles: Vec<[u32; 3]>) -> Surface {
    let mut new = vec![u32::MAX; surface.vertices.len()];
    let mut vertices = Vec::new();
    for a in triangles.iter_mut().flatten() {
        let n = &mut new[*a as usize];
        if *n == u32::MAX {
            *n = vertices.len() as u32;
            vertices.push(surface.vertices[*a as usize]);
        }
        *a = *n;
    }
    Surface { vertices, triangles }
}

/// The part of the skin that faces outer air, or that which does not.
fn skin_part(surface: &Surface, part: &Volume, outer: &[bool], wanted: bool) -> Surface {
    let is_outer = |t: &[u32; 3]| outer[part.grid.index(part.grid.nearest(&surface.vertices[t[0] as usize]))];
    compacted(surface, surface.triangles.iter().filter(|t| is_outer(t) == wanted).copied().collect())
}

/// Samples of tissue that hang together with the outer skin, inside the region and not too deep.
fn reached(part: &Volume, options: &BakeOptions, outer: &[bool], region: &Cuboid, deep: &dyn Field) -> Vec<bool> {
    let grid = &part.grid;
    let [nx, ny, _] = grid.dims;
    let place = |at: usize| grid.world(&Vec3::new((at % nx) as f64, (at / nx % ny) as f64, (at / (nx * ny)) as f64));
    let tissue = |at: usize| (options.skin_hu..options.bone_hu).contains(&f64::from(part.samples[at]));
    let inside = |at: usize| {
        let p = place(at);
        tissue(at) && region.at(&p) <= 0.0 && deep.at(&p) <= 0.0
    };
    let seeds = (0..grid.len()).filter(|&at| outer[at]);
    let reached = flood(grid, seeds, inside);
    if reached.contains(&true) { reached } else { (0..grid.len()).map(inside).collect() }
}

/// Volume of samples inside a region, m3; those at its rim count with what lies inside.
fn volume_of(part: &Volume, reached: &[bool], region: &Cuboid) -> f64 {
    let grid = &part.grid;
    let [nx, ny, _] = grid.dims;
    // Half the extent of a voxel along the world axes.
    let half = grid.direction.map(f64::abs) * grid.spacing / 2.0;
    let share = |at: usize| {
        let p = grid.world(&Vec3::new((at % nx) as f64, (at / nx % ny) as f64, (at / (nx * ny)) as f64));
        let overlap = (p + half).inf(&region.high) - (p - half).sup(&region.low);
        overlap.sup(&Vec3::zeros()).component_div(&(2.0 * half)).product()
    };
    (0..reached.len()).filter(|&at| reached[at]).map(share).sum::<f64>() * grid.spacing.product()
}

/// The part of a surface with tissue of the region beside it.
fn beside(surface: &Surface, part: &Volume, reached: &[bool]) -> Surface {
    let grid = &part.grid;
    let near = |t: &&[u32; 3]| {
        let ([i, j, k], _) = grid.cell(&surface.vertices[t[0] as usize]);
        (0..8).any(|c| reached[grid.index([i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1)])])
    };
    compacted(surface, surface.triangles.iter().filter(near).copied().collect())
}
