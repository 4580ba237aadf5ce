//! What runs leave behind: a table of ports, a ParaView series, a picture.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use cutis::io::{Data, Growing, IoError, remove_files, write_pvd, write_vtp, write_vtu};
use cutis::math::Vec3;
use cutis::mesh::{FaceSet, SKIN, TetMesh};
use cutis::port::{Causality, Port, Type};
use cutis::sim::{Contact, Model, Sim};
use cutis::view::{Camera, Image, Rgb, Surface, draw, heat};

/// A table of ports as CSV: time and every varying port but the skin's. Each row is in the file before the next step begins,
/// so what was reached is there whatever ends the run.
pub struct Table {
    file: Growing,
    line: String,
}

fn columns(sim: &Sim) -> impl Iterator<Item = (usize, &Port)> {
    let wanted = |p: &Port| p.is_continuous() && p.causality != Causality::Independent && !p.name.starts_with("skin.");
    sim.model().ports().iter().enumerate().filter(move |(_, p)| wanted(p))
}

/// Name of a value of a port: by row and coordinate where they have names, `marker.position.chin.x`, else counted from 1,
/// `bone.jaw.displacement.17.x`.
pub fn column(port: &Port, k: usize) -> String {
    let row = |r: usize| port.rows.get(r).cloned().unwrap_or_else(|| (r + 1).to_string());
    let coordinate = |c: usize, width: usize| match width {
        3 => ["x", "y", "z"][c].to_owned(),
        _ => (c + 1).to_string(),
    };
    match port.shape.as_slice() {
        [] => port.name.clone(),
        [3] if port.rows.is_empty() => format!("{}.{}", port.name, coordinate(k, 3)),
        [_] => format!("{}.{}", port.name, row(k)),
        [_, width, ..] => format!("{}.{}.{}", port.name, row(k / width), coordinate(k % width, *width)),
    }
}

impl Table {
    /// Begins the file with its header line.
    pub fn new(path: &Path, sim: &Sim) -> Result<Table, IoError> {
        let names = columns(sim).flat_map(|(_, p)| (0..p.len()).map(|k| format!(",{}", column(p, k))));
        let line = format!("time{}\n", names.collect::<String>());
        let mut file = Growing::new(path)?;
        file.append(&line)?;
        Ok(Table { file, line })
    }

    /// Appends the values at time `t`; floats are written so that they read back to the same bits.
    pub fn row(&mut self, t: f64, sim: &Sim) -> Result<(), IoError> {
        self.line.clear();
        write!(self.line, "{t}").expect("writing to memory");
        for (k, port) in columns(sim) {
            let values: Vec<String> = match port.ty {
                Type::Float64 => {
                    let mut out = vec![0.0; port.len()];
                    sim.get_f64(k, 0, &mut out).expect("a port of the model");
                    out.iter().map(f64::to_string).collect()
                }
                Type::Int32 => {
                    let mut out = vec![0; port.len()];
                    sim.get_i32(k, 0, &mut out).expect("a port of the model");
                    out.iter().map(i32::to_string).collect()
                }
                Type::Boolean => {
                    let mut out = vec![false; port.len()];
                    sim.get_bool(k, 0, &mut out).expect("a port of the model");
                    out.iter().map(|b| u8::from(*b).to_string()).collect()
                }
            };
            write!(self.line, ",{}", values.join(",")).expect("writing to memory");
        }
        self.line.push('\n');
        self.file.append(&self.line)
    }
}

/// A ParaView time series of the whole mesh and of what touches it. Its index is brought up to date with each frame.
pub struct Series {
    folder: PathBuf,
    n_frames: usize,
    files: Vec<(f64, usize, String)>,
}

impl Series {
    /// Begins one, and takes what an older one left in the folder away.
    pub fn new(folder: &Path) -> Result<Series, IoError> {
        let is_frame = |name: &str| {
            let stem = name.strip_suffix(".vtu").and_then(|s| s.strip_prefix("step"));
            let tail = name.strip_suffix(".vtp").map(|s| s.trim_start_matches(|c: char| !c.is_ascii_digit()));
            [stem, tail].into_iter().flatten().any(|s| s.len() >= 4 && s.bytes().all(|c| c.is_ascii_digit()))
        };
        remove_files(folder, is_frame)?;
        Ok(Series { folder: folder.into(), n_frames: 0, files: Vec::new() })
    }

    /// The index that ParaView opens.
    pub fn index(&self) -> PathBuf {
        self.folder.join("series.pvd")
    }

    /// Adds the mesh with its nodes at `x`, and the shapes of contacts that move with these.
    pub fn add(&mut self, t: f64, mesh: &TetMesh, contacts: &[Contact], x: &[Vec3]) -> super::Done {
        let u: Vec<f64> = x.iter().zip(&mesh.nodes).flat_map(|(x, X)| <[f64; 3]>::from(x - X)).collect();
        let data = [Data { name: "displacement", components: 3, values: &u }];
        // What has no tetrahedra is a surface: the skin, as a host sees it.
        let name = if mesh.tets.is_empty() {
            let name = format!("step{:04}.vtp", self.n_frames);
            let triangles: Vec<[u32; 3]> =
                mesh.face_sets.iter().flat_map(|set| set.triangles.iter().copied()).collect();
            write_vtp(&self.folder.join(&name), x, &triangles, &data)?;
            name
        } else {
            let name = format!("step{:04}.vtu", self.n_frames);
            write_vtu(&self.folder.join(&name), mesh, x, &data, &[])?;
            name
        };
        self.files.push((t, 0, name));
        for (part, contact) in (1..).zip(contacts.iter().filter(|c| !c.surface.triangles.is_empty())) {
            let name = format!("{}{:04}.vtp", contact.name, self.n_frames);
            write_vtp(&self.folder.join(&name), &contact.placed(&mesh.nodes, x), &contact.surface.triangles, &[])?;
            self.files.push((t, part, name));
        }
        self.n_frames += 1;
        Ok(write_pvd(&self.index(), &self.files)?)
    }
}

/// Name of the face sets that show shapes of contacts.
const SHAPE: &str = "shape of a contact";

/// What a picture shows of a model at these positions: its mesh, a fine skin in place of the mesh's own, shapes of contacts.
pub fn shown<const N: usize>(model: &Model, x: [&[Vec3]; N]) -> (TetMesh, [Vec<Vec3>; N]) {
    let mut mesh = model.mesh().clone();
    let (nodes, at) = (&model.mesh().nodes, x);
    let fine = mesh.fine_skin.take();
    let mut x = x.map(<[Vec3]>::to_vec);
    let mut add = |name: &str, triangles: &[[u32; 3]], placed: &dyn Fn(&[Vec3]) -> Vec<Vec3>| {
        let first = mesh.nodes.len() as u32;
        mesh.nodes.extend(placed(nodes));
        x.iter_mut().zip(at).for_each(|(x, at)| x.extend(placed(at)));
        mesh.face_sets.retain(|set| set.name != SKIN || name != SKIN);
        let triangles = triangles.iter().map(|t| t.map(|a| first + a)).collect();
        mesh.face_sets.push(FaceSet { name: name.into(), triangles });
    };
    for contact in &model.parts().contacts {
        add(SHAPE, &contact.surface.triangles, &|x| contact.placed(nodes, x));
    }
    if let Some(fine) = fine {
        add(SKIN, &fine.triangles, &|x| model.skin().all(x));
    }
    (mesh, x)
}

const PANEL: (usize, usize) = (430, 560);
/// Shapes of contacts.
const STEEL: Rgb = [0.62, 0.66, 0.70];
const INK: Rgb = [0.15, 0.15, 0.18];

/// Panels side by side, coloured by displacement on one scale, with captions and the scale.
pub fn picture(mesh: &TetMesh, panels: &[(&str, &[Vec3])]) -> Image {
    let corners = |tissue: bool| {
        let sets = mesh.face_sets.iter().filter(move |set| !tissue || set.name != SHAPE);
        sets.flat_map(|set| set.triangles.as_flattened()).map(|&a| a as usize)
    };
    let all: Vec<Vec3> = panels.iter().flat_map(|(_, x)| corners(false).map(|a| x[a])).collect();
    let motion = |x: &[Vec3]| corners(true).map(|a| (x[a] - mesh.nodes[a]).norm()).fold(1e-9, f64::max);
    let largest = panels.iter().map(|(_, x)| motion(x)).fold(0.0, f64::max);
    // LPS axes: the face looks to -y, its left is +x, up is +z; seen from the front, a little from its left.
    let aspect = PANEL.0 as f64 / PANEL.1 as f64;
    let camera = Camera::around(&all, Vec3::new(0.55, -1.0, 0.10), Vec3::z(), aspect);
    let mut image = Image::new(PANEL.0 * panels.len(), PANEL.1 + 70, [1.0; 3]);
    for (k, (caption, x)) in panels.iter().enumerate() {
        let moved = |a: u32| heat((x[a as usize] - mesh.nodes[a as usize]).norm() / largest);
        let inner = |a: u32| moved(a).map(|c| 0.6 * c);
        let surfaces: Vec<Surface> = mesh
            .face_sets
            .iter()
            .map(|set| Surface {
                triangles: &set.triangles,
                colour: match set.name.as_str() {
                    SKIN => &moved,
                    SHAPE => &|_| STEEL,
                    _ => &inner,
                },
            })
            .collect();
        image.paste(&draw(x, &surfaces, &camera, PANEL.0, PANEL.1), k * PANEL.0, 0);
        let left = k * PANEL.0 + (PANEL.0.saturating_sub(Image::text_width(caption, 2))) / 2;
        image.text(caption, left, PANEL.1 + 6, 2, INK);
    }
    let (left, width, top) = (image.width / 2 - 200, 400, PANEL.1 + 36);
    for k in 0..width {
        image.fill(left + k, top, 1, 10, heat(k as f64 / (width - 1) as f64));
    }
    image.text("0", left - 20, top, 1, INK);
    image.text(&format!("{:.1} mm moved", 1e3 * largest), left + width + 10, top, 1, INK);
    image
}
