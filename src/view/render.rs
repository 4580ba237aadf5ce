//! Triangles to pixels: orthographic camera, depth buffer, two lights, smooth normals.

use super::{Image, Rgb};
use crate::math::{Mat3, Vec3};

/// Side of a depth-buffer pixel against a picture pixel: four samples each.
const OVERSAMPLE: usize = 2;
/// Background.
const PAPER: Rgb = [1.0, 1.0, 1.0];

/// Triangles of one kind with a colour for each of their corners' nodes.
pub struct Surface<'a> {
    /// Corner nodes, wound outward.
    pub triangles: &'a [[u32; 3]],
    /// Colour of a node.
    pub colour: &'a dyn Fn(u32) -> Rgb,
}

/// An orthographic view.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    /// From the object to the eye.
    pub towards: Vec3,
    /// What is up in the picture.
    pub up: Vec3,
    /// Middle of the picture, m.
    pub centre: Vec3,
    /// Height of the picture, m.
    pub extent: f64,
}

impl Camera {
    /// A view of all points from `towards`, with a small margin.
    pub fn around(points: &[Vec3], towards: Vec3, up: Vec3, aspect: f64) -> Camera {
        let mut camera = Camera { towards, up, centre: Vec3::zeros(), extent: 1.0 };
        let axes = camera.axes();
        let seen = points.iter().map(|x| axes * x);
        let (low, high) = seen
            .fold((Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)), |(l, h), p| (l.inf(&p), h.sup(&p)));
        let size = high - low;
        camera.centre = axes.transpose() * (0.5 * (low + high));
        camera.extent = 1.08 * size.y.max(size.x / aspect);
        camera
    }

    /// Rows: right, up, towards the eye.
    fn axes(&self) -> Mat3 {
        let z = self.towards.normalize();
        let x = self.up.cross(&z).normalize();
        Mat3::from_rows(&[x.transpose(), z.cross(&x).transpose(), z.transpose()])
    }
}

/// Draws surfaces whose nodes lie at `x`.
pub fn draw(x: &[Vec3], surfaces: &[Surface], camera: &Camera, width: usize, height: usize) -> Image {
    let (w, h) = (OVERSAMPLE * width, OVERSAMPLE * height);
    let mut image = Image::new(w, h, PAPER);
    let mut depth = vec![f64::NEG_INFINITY; w * h];
    let axes = camera.axes();
    let scale = h as f64 / camera.extent;
    let seen: Vec<Vec3> = x.iter().map(|x| axes * (x - camera.centre)).collect();
    let to_pixel = |p: &Vec3| (0.5 * w as f64 + scale * p.x, 0.5 * h as f64 - scale * p.y);
    for surface in surfaces {
        let normals = smooth_normals(&seen, surface.triangles);
        for t in surface.triangles {
            let corners = t.map(|a| &seen[a as usize]);
            let p = corners.map(to_pixel);
            let shade = t.map(|a| lit((surface.colour)(a), &normals[a as usize]));
            let area = (p[1].0 - p[0].0) * (p[2].1 - p[0].1) - (p[2].0 - p[0].0) * (p[1].1 - p[0].1);
            if area == 0.0 || !area.is_finite() {
                continue;
            }
            let bounds = |of: [f64; 3], limit: usize| {
                let low = of.iter().copied().fold(f64::INFINITY, f64::min).floor().max(0.0) as usize;
                let high = of.iter().copied().fold(0.0, f64::max).ceil().min(limit as f64) as usize;
                low..high
            };
            for row in bounds(p.map(|p| p.1), h) {
                for column in bounds(p.map(|p| p.0), w) {
                    let at = (column as f64 + 0.5, row as f64 + 0.5);
                    let side = |i: usize, j: usize| {
                        ((p[j].0 - p[i].0) * (at.1 - p[i].1) - (at.0 - p[i].0) * (p[j].1 - p[i].1)) / area
                    };
                    let weights = [side(1, 2), side(2, 0), side(0, 1)];
                    if weights.iter().any(|w| *w < 0.0) {
                        continue;
                    }
                    let z: f64 = (0..3).map(|k| weights[k] * corners[k].z).sum();
                    let pixel = row * w + column;
                    if z > depth[pixel] {
                        depth[pixel] = z;
                        image.pixels[pixel] =
                            std::array::from_fn(|c| (0..3).map(|k| weights[k] as f32 * shade[k][c]).sum());
                    }
                }
            }
        }
    }
    image.halved()
}

fn smooth_normals(x: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::zeros(); x.len()];
    for t in triangles {
        let [a, b, c] = t.map(|a| x[a as usize]);
        let n = (b - a).cross(&(c - a));
        t.iter().for_each(|&a| normals[a as usize] += n);
    }
    normals.iter_mut().for_each(|n| *n = n.try_normalize(0.0).unwrap_or(Vec3::z()));
    normals
}

/// A key light from above, a fill light from the side, and some ambient; back faces are lit like front faces.
fn lit(colour: Rgb, normal: &Vec3) -> Rgb {
    let n = if normal.z < 0.0 { -normal } else { *normal };
    let key = n.dot(&Vec3::new(-0.35, 0.55, 0.76)).max(0.0);
    let fill = n.dot(&Vec3::new(0.80, 0.10, 0.59)).max(0.0);
    let light = (0.30 + 0.62 * key + 0.18 * fill) as f32;
    colour.map(|c| c * light)
}
