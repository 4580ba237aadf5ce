//! A picture of a baked mesh: the skin, the bones under it, and a cut through the middle.

use cutis::math::Vec3;
use cutis::mesh::{FACES, SKIN, TetMesh};
use cutis::view::{Camera, Image, Rgb, Surface, draw};

const PANEL: (usize, usize) = (480, 560);
const INK: Rgb = [0.15, 0.15, 0.18];
const FLESH: Rgb = [0.86, 0.69, 0.60];
const INNER: Rgb = [0.72, 0.45, 0.42];
/// Bones in the order of their node sets, and layers in that of the regions.
const BONES: [Rgb; 4] = [[0.90, 0.87, 0.76], [0.58, 0.74, 0.88], [0.60, 0.80, 0.62], [0.86, 0.72, 0.88]];
const LAYERS: [Rgb; 4] = [[0.89, 0.72, 0.62], [0.95, 0.86, 0.55], [0.78, 0.42, 0.38], [0.70, 0.60, 0.75]];

/// Triangles and their colour.
type Parts<'a> = Vec<(&'a [[u32; 3]], Rgb)>;

/// Skin from the front and from below, bones from the front, and the left half cut along the median plane of the mesh.
pub fn of(mesh: &TetMesh) -> Image {
    let named = |name: &str| mesh.face_set(name).map_or(&[][..], |s| &s.triangles[..]);
    let bones = || mesh.node_sets.iter().enumerate().map(|(k, s)| (named(&s.name), BONES[k % BONES.len()]));
    let rest: Vec<&[[u32; 3]]> = mesh
        .face_sets
        .iter()
        .filter(|s| s.name != SKIN && mesh.node_set(&s.name).is_none())
        .map(|s| &s.triangles[..])
        .collect();
    let skin = || std::iter::once((named(SKIN), FLESH)).chain(rest.iter().map(|t| (*t, INNER)));
    let section = section(mesh);
    let cut = section.iter().enumerate().map(|(k, t)| (&t[..], LAYERS[k % LAYERS.len()]));
    let panels: [(&str, Vec3, Parts); 4] = [
        ("SKIN", Vec3::new(0.45, -1.0, 0.08), skin().chain(bones()).collect()),
        ("FROM BELOW", Vec3::new(0.25, -1.0, -0.55), skin().chain(bones()).collect()),
        ("BONES THAT HOLD", Vec3::new(0.45, -1.0, 0.08), bones().collect()),
        ("CUT, BY REGION", Vec3::new(-1.0, -0.35, 0.05), cut.collect()),
    ];
    let aspect = PANEL.0 as f64 / PANEL.1 as f64;
    let mut image = Image::new(PANEL.0 * panels.len(), PANEL.1 + 30, [1.0; 3]);
    for (k, (caption, towards, parts)) in panels.iter().enumerate() {
        let camera = Camera::around(&mesh.nodes, towards.normalize(), Vec3::z(), aspect);
        let colours: Vec<_> = parts.iter().map(|(_, colour)| move |_: u32| *colour).collect();
        let surfaces: Vec<Surface> =
            parts.iter().zip(&colours).map(|((triangles, _), colour)| Surface { triangles, colour }).collect();
        image.paste(&draw(&mesh.nodes, &surfaces, &camera, PANEL.0, PANEL.1), k * PANEL.0, 0);
        let left = k * PANEL.0 + PANEL.0.saturating_sub(Image::text_width(caption, 2)) / 2;
        image.text(caption, left, PANEL.1 + 6, 2, INK);
    }
    image
}

/// What bounds the tetrahedra on the patient's left of the mesh's middle, by region.
fn section(mesh: &TetMesh) -> Vec<Vec<[u32; 3]>> {
    let (low, high) = mesh.nodes.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x.x), h.max(x.x)));
    let middle = 0.5 * (low + high);
    let mut faces: Vec<([u32; 3], [u32; 3], u32)> = Vec::new();
    for (t, &region) in mesh.tets.iter().zip(&mesh.region) {
        if t.iter().map(|&a| mesh.nodes[a as usize].x).sum::<f64>() < 4.0 * middle {
            continue;
        }
        for f in FACES {
            let face = f.map(|k| t[k]);
            let mut key = face;
            key.sort_unstable();
            faces.push((key, face, region));
        }
    }
    faces.sort_unstable();
    let mut out = vec![Vec::new(); mesh.region_names.len()];
    for group in faces.chunk_by(|p, q| p.0 == q.0).filter(|g| g.len() == 1) {
        out[group[0].2 as usize].push(group[0].1);
    }
    out
}
