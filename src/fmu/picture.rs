//! The skin at rest as a picture: icon of the archives, and figure of their documentation.

use crate::math::Vec3;
use crate::sim::Model;
use crate::view::{Camera, Rgb, Surface, draw};

/// Side of the icon, pixels.
pub(super) const SIDE: usize = 256;
/// Skin.
const COLOUR: Rgb = [0.87, 0.70, 0.60];
/// A face looks along -y (left, back, up): from the front and a little from its left.
const FROM: Vec3 = Vec3::new(0.55, -1.0, 0.15);

/// PNG of the skin at rest, square; `None` for scenes without skin.
pub(super) fn picture(model: &Model) -> Option<Vec<u8>> {
    let skin = model.skin();
    if skin.is_empty() {
        return None;
    }
    let x = match &model.mesh().fine_skin {
        Some(fine) => fine.vertices.clone(),
        None => skin.all(&model.mesh().nodes),
    };
    let corner = |t: &[i32]| [t[0] as u32, t[1] as u32, t[2] as u32];
    let triangles: Vec<[u32; 3]> = skin.triangles().chunks_exact(3).map(corner).collect();
    let camera = Camera::around(&x, FROM, Vec3::z(), 1.0);
    let surface = Surface { triangles: &triangles, colour: &|_| COLOUR };
    Some(draw(&x, &[surface], &camera, SIDE, SIDE).to_png())
}
