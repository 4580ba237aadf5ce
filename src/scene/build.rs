//! What a scene means: names become sets, keys become terms, and a [`Model`] comes out.

use super::SceneError;
use super::check::Text;
use super::file::{BoneSpec, LoadSpec, MuscleSpec, PressureSpec, SceneFile, TissueSpec, ViscousSpec};
use super::keys::find;
use super::place::{area_shares, nearest_point, patch, volume_shares};
use super::programme::{Programme, Track};
use crate::effect::{self, Branches, DeadLoad, Elements, Gravity, Inertia, Law, Muscle, Pressure, lumped_masses, nearest_on_path};
use crate::energy::Lame;
use crate::fem::{Term, add_midsides};
use crate::math::Vec3;
use crate::mesh::{SKIN, TetMesh};
use crate::port::{Causality, Port, Slot};
use crate::sim::{self, Bone, Drive, Layout, Marker, Model, ModelParts};
use crate::solve::Strategy;

/// Above this Poisson's ratio linear tetrahedra lock visibly.
const LOCKING_NU: f64 = 0.45;
/// Pairs that the quasi-Newton method remembers.
const MEMORY: usize = 8;
/// Iterations after which the quasi-Newton method factors anew.
const REFRESH_AFTER: u32 = 20;

/// The model and programme of a scene `text` on its mesh.
///
/// # Errors
/// [`SceneError`] with line and column.
pub fn build(text: &str, file: &SceneFile, mesh: TetMesh) -> Result<(Model, Programme), SceneError> {
    Builder { text: Text(text) }.build(file, mesh)
}

/// What the materials of a scene come to.
struct Tissue {
    terms: Vec<Box<dyn Term>>,
    /// By region, kg/m3.
    density: Vec<f64>,
    n_history: usize,
}

struct Builder<'a> {
    text: Text<'a>,
}

impl Builder<'_> {
    fn build(&self, file: &SceneFile, mut mesh: TetMesh) -> Result<(Model, Programme), SceneError> {
        // Exhaustive, so that a new table cannot be forgotten here.
        let SceneFile {
            name,
            mesh: mesh_spec,
            tissue: _,
            bone,
            muscle,
            load,
            pressure,
            marker,
            gravity,
            inertia,
            attachment,
            solver,
            run,
            keyframe: _,
        } = file;
        let mut warnings = Vec::new();
        let order = mesh_spec.get_ref().order.as_ref();
        let midsides = match order.map_or(1, |o| *o.get_ref()) {
            1 => Vec::new(),
            2 => add_midsides(&mut mesh),
            found => {
                let at = order.map_or(0, |o| o.span().start);
                return Err(self.text.at(at, format!("`order` of [mesh] is {found}; wanted 1 or 2")));
            }
        };
        let Tissue { mut terms, density, n_history } = self.tissue(file, &mesh, &midsides, &mut warnings)?;
        let rings = attachment.as_ref().and_then(|a| a.free_rings.as_ref()).map_or(0, |r| *r.get_ref());
        let mut bones = self.bones(bone, &mesh, rings)?;
        if rings > 0 {
            free_rings(&mesh, &mut bones, rings, &mut warnings);
        }
        let counts: Vec<(Drive, usize)> = bones.iter().map(|b| (b.drive, b.nodes.len())).collect();
        let layout = Layout::new(&counts, muscle.len(), load.len(), pressure.len(), gravity.is_some());
        let mut start = vec![0.0; layout.len()];
        self.bone_starts(bone, &bones, &mesh, &layout, &mut start)?;

        let muscles = self.text.names("muscle", muscle.iter().map(|m| &m.name))?;
        for (k, spec) in muscle.iter().enumerate() {
            let input = layout.first(Slot::MuscleActivation).expect("a scene with muscles has their port") + k;
            terms.push(self.muscle(spec, &mesh, &midsides, input)?);
            start[input] = self.text.number("muscle", "activation", &spec.activation)?.unwrap_or(0.0);
        }
        let loads = self.text.names("load", load.iter().map(|l| &l.name))?;
        for (k, spec) in load.iter().enumerate() {
            let input = layout.first(Slot::LoadForce).expect("a scene with loads has their port") + 3 * k;
            terms.push(Box::new(self.load(spec, &mesh, input)?));
            start[input..input + 3]
                .copy_from_slice(&self.text.triple("load", "force", &spec.force)?.unwrap_or_default());
        }
        let pressures = self.text.names("pressure", pressure.iter().map(|p| &p.name))?;
        for (k, spec) in pressure.iter().enumerate() {
            let input = layout.first(Slot::LoadPressure).expect("a scene with pressures has their port") + k;
            terms.push(Box::new(self.pressure(spec, &mesh, input)?));
            start[input] = self.text.number("pressure", "pressure", &spec.pressure)?.unwrap_or(0.0);
        }
        let masses = || lumped_masses(&mesh, &midsides, &density);
        if let Some(spec) = gravity {
            let input = layout.first(Slot::Gravity).expect("a scene with gravity has its port");
            let g = self.text.triple("gravity", "acceleration", &spec.acceleration)?.unwrap_or([0.0, 0.0, -9.80665]);
            start[input..input + 3].copy_from_slice(&g);
            terms.push(Box::new(Gravity { m: masses(), input }));
        }
        let inertia = match inertia {
            Some(spec) => {
                terms.push(Box::new(Inertia { m: masses() }));
                let start = self.text.choice("inertia", "start", &spec.start)?.unwrap_or("equilibrium");
                Some(sim::Inertia { m: masses(), start_at_rest: start == "rest" })
            }
            None => None,
        };
        let triangles = mesh.face_set(SKIN).map_or(&[][..], |s| &s.triangles);
        self.text.names("marker", marker.iter().map(|m| &m.name))?;
        let mut markers = Vec::new();
        for m in marker {
            let at = self.text.vector("marker", "at", &m.at)?;
            let (nodes, weights) = nearest_point(&mesh, triangles, &at).ok_or_else(|| self.text.no_skin(&m.name))?;
            markers.push(Marker { name: m.name.get_ref().clone(), nodes, weights });
        }
        let spec = solver.as_ref();
        let newton =
            spec.map(|s| self.text.choice("solver", "method", &s.method)).transpose()?.flatten() == Some("newton");
        let tolerance = spec.map(|s| self.text.number("solver", "tolerance", &s.tolerance)).transpose()?.flatten();
        let max_iterations = match spec.and_then(|s| s.max_iterations.as_ref()) {
            Some(n) if *n.get_ref() < 1 => {
                return Err(self.text.out_of_range("solver", "max_iterations", n, n.get_ref()));
            }
            Some(n) => *n.get_ref(),
            None => 200,
        };
        let strategy = Strategy {
            memory: if newton { 0 } else { MEMORY },
            refresh_after: if newton { 1 } else { REFRESH_AFTER },
            tolerance: tolerance.unwrap_or(1e-7),
            max_iterations,
        };
        let model = Model::new(ModelParts {
            name: name.clone().unwrap_or_else(|| "scene".into()),
            mesh,
            midsides,
            bones,
            muscles,
            loads,
            pressures,
            markers,
            terms,
            n_history,
            inertia,
            layout,
            start,
            strategy,
            identity: without_mesh_table(self.text.0),
            warnings,
        })?;
        let (dt, end) = match run {
            Some(run) => (self.text.number("run", "dt", &run.dt)?, self.text.number("run", "end", &run.end)?),
            None => (None, None),
        };
        let tracks = self.tracks(file, model.ports())?;
        Ok((model, Programme { dt: dt.unwrap_or(0.1), end: end.unwrap_or(1.0), tracks }))
    }

    /// One term for each material, its overstress if it has one, and the density of each region.
    fn tissue(
        &self,
        file: &SceneFile,
        mesh: &TetMesh,
        midsides: &[[u32; 6]],
        warnings: &mut Vec<String>,
    ) -> Result<Tissue, SceneError> {
        let mut material = vec![usize::MAX; mesh.region_names.len()];
        for (k, spec) in file.tissue.iter().enumerate() {
            let Some(regions) = &spec.regions else {
                material.iter_mut().filter(|m| **m == usize::MAX).for_each(|m| *m = k);
                continue;
            };
            for name in regions {
                let r = mesh.region_names.iter().position(|r| r == name.get_ref());
                let r =
                    r.ok_or_else(|| self.text.unknown("region", name, mesh.region_names.iter().map(String::as_str)))?;
                if material[r] == usize::MAX {
                    material[r] = k;
                }
            }
        }
        if let Some(r) = material.iter().position(|&m| m == usize::MAX) {
            let message = format!(
                "region `{}` of the mesh has no material: name it in a [[tissue]], or give one [[tissue]] without `regions`",
                mesh.region_names[r]
            );
            return Err(self.text.at(file.mesh.span().start, message));
        }
        let (mut terms, mut n_history) = (Vec::new(), 0);
        let mut density = vec![0.0; mesh.region_names.len()];
        for (k, spec) in file.tissue.iter().enumerate() {
            let (law, constants) = self.law(spec)?;
            let Lame { mu, lambda } = (law.moduli)(&constants);
            let nu = lambda / (2.0 * (lambda + mu));
            let rho = self.text.number("tissue", "density", &spec.density)?.unwrap_or(1000.0);
            if nu > LOCKING_NU && midsides.is_empty() {
                warnings.push(format!(
                    "Poisson's ratio {nu:.4} on linear tetrahedra: above {LOCKING_NU} they lock, so motions come out too \
                     small and forces too large; [mesh] order = 2 does not"
                ));
            }
            let mine = |r: u32| material[r as usize] == k;
            density.iter_mut().enumerate().filter(|(r, _)| mine(*r as u32)).for_each(|(_, d)| *d = rho);
            let elements: Vec<usize> = (0..mesh.tets.len()).filter(|&e| mine(mesh.region[e])).collect();
            if !elements.is_empty() {
                let tets: Vec<[u32; 4]> = elements.iter().map(|&e| mesh.tets[e]).collect();
                let midsides: Vec<[u32; 6]> = elements.iter().filter_map(|&e| midsides.get(e).copied()).collect();
                let elements = Elements { X: &mesh.nodes, tets: &tets, midsides: &midsides };
                terms.push((law.term)(&constants, elements));
                if let Some(spec) = &spec.viscous {
                    let branches = Branches { series: self.series(spec)?, first: n_history };
                    n_history += branches.memory(&elements);
                    terms.push((law.viscous)(&constants, branches, elements));
                }
            }
        }
        Ok(Tissue { terms, density, n_history })
    }

    /// Pairs (g, tau) of a Prony series.
    fn series(&self, spec: &ViscousSpec) -> Result<Vec<(f64, f64)>, SceneError> {
        for (key, list) in [("g", &spec.g), ("tau", &spec.tau)] {
            if let Some(bad) = list.get_ref().iter().find(|v| !find("tissue.viscous", key).range.holds(**v)) {
                return Err(self.text.out_of_range("tissue.viscous", key, list, bad));
            }
        }
        let (g, tau) = (spec.g.get_ref(), spec.tau.get_ref());
        if g.is_empty() || g.len() != tau.len() {
            let message =
                format!("a Prony series takes as many `g` as `tau`, at least one; found {} and {}", g.len(), tau.len());
            return Err(self.text.at(spec.g.span().start, message));
        }
        Ok(g.iter().copied().zip(tau.iter().copied()).collect())
    }

    /// The law of a material and its constants, in the law's order.
    fn law(&self, spec: &TissueSpec) -> Result<(&'static Law, Vec<Vec<f64>>), SceneError> {
        let name = self.text.choice("tissue", "energy", &spec.energy)?.unwrap_or("stable-neo-hookean");
        let law = effect::law(name).expect("keys list the catalogue's laws");
        let wants = || law.keys.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(", ");
        let mut constants: Vec<Vec<f64>> = vec![Vec::new(); law.keys.len()];
        for (key, value) in spec.constants() {
            let Some(value) = value else { continue };
            let Some(k) = law.keys.iter().position(|wanted| *wanted == key) else {
                return Err(self
                    .text
                    .at(value.span().start, format!("`{key}` is no constant of `{name}`, which takes {}", wants())));
            };
            let values = value.get_ref().values();
            if let Some(bad) = values.iter().find(|v| !find("tissue", key).range.holds(**v)) {
                return Err(self.text.out_of_range("tissue", key, value, bad));
            }
            if values.is_empty() || (values.len() > 1 && name != "ogden") {
                return Err(self
                    .text
                    .at(value.span().start, format!("`{key}` of `{name}` is {} numbers; wanted one", values.len())));
            }
            constants[k] = values;
        }
        let place = spec.energy.as_ref().map_or(0, |e| e.span().start);
        if let Some(k) = constants.iter().position(Vec::is_empty) {
            let message = format!("`{name}` takes {}; `{}` is missing", wants(), law.keys[k]);
            return Err(self.text.at(place, message));
        }
        if name == "ogden"
            && (constants[0].len() != constants[1].len()
                || constants[1].contains(&0.0)
                || constants[0].iter().sum::<f64>() <= 0.0)
        {
            let message =
                "`ogden` takes as many `mu` as `alpha`, no `alpha` of zero, and `mu` whose sum is positive".to_owned();
            return Err(self.text.at(place, message));
        }
        Ok((law, constants))
    }

    /// Bones and their nodes. With `rings` > 0 a node that two bones claim belongs to neither.
    fn bones(&self, specs: &[BoneSpec], mesh: &TetMesh, rings: u32) -> Result<Vec<Bone>, SceneError> {
        self.text.names("bone", specs.iter().map(|b| &b.name))?;
        let mut owner: Vec<Option<&str>> = vec![None; mesh.nodes.len()];
        let mut shared = vec![false; mesh.nodes.len()];
        let mut bones = Vec::new();
        for spec in specs {
            let wanted = spec.nodes.as_ref().unwrap_or(&spec.name);
            let set = mesh
                .node_set(wanted.get_ref())
                .ok_or_else(|| self.text.unknown("node set", wanted, mesh.node_sets.iter().map(|s| s.name.as_str())))?;
            for &a in &set.nodes {
                let Some(other) = owner[a as usize].replace(spec.name.get_ref()) else { continue };
                shared[a as usize] = true;
                if rings == 0 {
                    let message = format!(
                        "bones `{other}` and `{}` both claim node {a}; a node can stick to one bone only: name other \
                         sets, or let [attachment] free_rings = 1 set such nodes free",
                        spec.name.get_ref()
                    );
                    return Err(self.text.at(wanted.span().start, message));
                }
            }
            let drive = match self.text.choice("bone", "drive", &spec.drive)?.unwrap_or("pose") {
                "held" => Drive::Held,
                "force" => Drive::Force,
                "displacement" => Drive::Displacement,
                _ => Drive::Pose,
            };
            bones.push(Bone { name: spec.name.get_ref().clone(), nodes: set.nodes.clone(), drive });
        }
        bones.iter_mut().for_each(|b| b.nodes.retain(|a| !shared[*a as usize]));
        Ok(bones)
    }

    fn bone_starts(
        &self,
        specs: &[BoneSpec],
        bones: &[Bone],
        mesh: &TetMesh,
        layout: &Layout,
        start: &mut [f64],
    ) -> Result<(), SceneError> {
        for (b, (spec, bone)) in specs.iter().zip(bones).enumerate() {
            let mut put = |slot: Slot, value: Option<[f64; 3]>| match (layout.first(slot), value) {
                (Some(first), Some(value)) => start[first + 3 * b..first + 3 * b + 3].copy_from_slice(&value),
                _ => {}
            };
            let centroid =
                bone.nodes.iter().map(|&a| mesh.nodes[a as usize]).sum::<Vec3>() / bone.nodes.len().max(1) as f64;
            put(Slot::BonePivot, Some(self.text.triple("bone", "pivot", &spec.pivot)?.unwrap_or(centroid.into())));
            for (slot, key, value, drive) in [
                (Slot::BoneTranslation, "translation", &spec.translation, Drive::Pose),
                (Slot::BoneRotation, "rotation", &spec.rotation, Drive::Pose),
                (Slot::BoneForce, "force", &spec.force, Drive::Force),
                (Slot::BoneTorque, "torque", &spec.torque, Drive::Force),
            ] {
                if let Some(v) = value.as_ref().filter(|_| bone.drive != drive) {
                    return Err(self.text.at(
                        v.span().start,
                        format!("`{key}` is for a {drive} bone; `{}` is {}", bone.name, bone.drive),
                    ));
                }
                put(slot, self.text.triple("bone", key, value)?);
            }
        }
        Ok(())
    }

    fn muscle(
        &self,
        spec: &MuscleSpec,
        mesh: &TetMesh,
        midsides: &[[u32; 6]],
        input: usize,
    ) -> Result<Box<dyn Term>, SceneError> {
        let path: Vec<Vec3> = spec.path.get_ref().iter().map(|p| Vec3::from(*p)).collect();
        let sound = path.len() >= 2
            && path.iter().all(|p| p.iter().all(|c| c.is_finite()))
            && path.windows(2).all(|s| s[0] != s[1]);
        if !sound {
            let message = "`path` takes at least two finite points, each other than the one before".to_owned();
            return Err(self.text.at(spec.path.span().start, message));
        }
        let radius = self.text.checked("muscle", "radius", &spec.radius)?;
        let mut fibre = Vec::new();
        let (mut tets, mut mids) = (Vec::new(), Vec::new());
        for (e, tet) in mesh.tets.iter().enumerate() {
            let centre = tet.iter().map(|&a| mesh.nodes[a as usize]).sum::<Vec3>() / 4.0;
            let (along, distance) = nearest_on_path(&path, &centre);
            if distance <= radius {
                tets.push(*tet);
                mids.extend(midsides.get(e));
                fibre.extend(std::iter::repeat_n(along, if midsides.is_empty() { 1 } else { 4 }));
            }
        }
        if tets.is_empty() {
            let message = format!(
                "muscle `{}` holds no tetrahedron: no centre lies within {radius} m of its path; make `radius` larger or \
                 the mesh finer",
                spec.name.get_ref()
            );
            return Err(self.text.at(spec.name.span().start, message));
        }
        let muscle = Muscle {
            fibre,
            T0: self.text.number("muscle", "stress", &spec.stress)?.unwrap_or(100e3),
            width: self.text.number("muscle", "width", &spec.width)?,
            input,
        };
        Ok(Elements { X: &mesh.nodes, tets: &tets, midsides: &mids }.of(muscle))
    }

    fn load(&self, spec: &LoadSpec, mesh: &TetMesh, input: usize) -> Result<DeadLoad, SceneError> {
        let radius = self.text.number("load", "radius", &spec.radius)?;
        let shares = match (&spec.at, &spec.region) {
            (Some(at), None) => {
                let p = self.text.vector("load", "at", at)?;
                let skin = mesh.face_set(SKIN).map_or(&[][..], |s| &s.triangles);
                match radius {
                    Some(r) => {
                        let faces = patch(mesh, skin, &p, r);
                        if faces.is_empty() {
                            return Err(self
                                .text
                                .at(at.span().start, format!("no skin triangle lies within {r} m of this place")));
                        }
                        area_shares(mesh, &faces)
                    }
                    None => {
                        let distance = |a: &u32| (mesh.nodes[*a as usize] - p).norm_squared();
                        let nearest = mesh.skin_nodes().into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
                        vec![(nearest.ok_or_else(|| self.text.no_skin(&spec.name))?, 1.0)]
                    }
                }
            }
            (None, Some(region)) => {
                let r = mesh.region_names.iter().position(|r| r == region.get_ref());
                let r =
                    r.ok_or_else(|| self.text.unknown("region", region, mesh.region_names.iter().map(String::as_str)))?;
                volume_shares(mesh, r as u32)
            }
            _ => {
                let message =
                    format!("load `{}` needs either `at` (with or without `radius`) or `region`", spec.name.get_ref());
                return Err(self.text.at(spec.name.span().start, message));
            }
        };
        Ok(DeadLoad { shares, input })
    }

    fn pressure(&self, spec: &PressureSpec, mesh: &TetMesh, input: usize) -> Result<Pressure, SceneError> {
        let name = spec.faces.as_ref().map_or(SKIN, |f| f.get_ref());
        let set = mesh.face_set(name).ok_or_else(|| {
            let wanted = spec.faces.as_ref().unwrap_or(&spec.name);
            self.text.unknown("face set", wanted, mesh.face_sets.iter().map(|s| s.name.as_str()))
        })?;
        let radius = self.text.number("pressure", "radius", &spec.radius)?;
        let triangles = match (&spec.at, radius) {
            (Some(at), Some(r)) => patch(mesh, &set.triangles, &self.text.vector("pressure", "at", at)?, r),
            (None, None) => set.triangles.clone(),
            _ => {
                return Err(self
                    .text
                    .at(spec.name.span().start, "a patch of pressure needs both `at` and `radius`".into()));
            }
        };
        if triangles.is_empty() {
            return Err(self.text.at(
                spec.name.span().start,
                format!("pressure `{}` acts on no triangle of `{name}`", spec.name.get_ref()),
            ));
        }
        Ok(Pressure { triangles, input })
    }

    fn tracks(&self, file: &SceneFile, ports: &[Port]) -> Result<Vec<Track>, SceneError> {
        let mut tracks: Vec<Track> = Vec::new();
        for frame in &file.keyframe {
            let inputs = || ports.iter().filter(|p| p.causality == Causality::Input);
            let wanted = frame.port.get_ref();
            let (port, p) = ports
                .iter()
                .enumerate()
                .find(|(_, p)| p.name == *wanted && p.causality == Causality::Input)
                .ok_or_else(|| self.text.unknown("input", &frame.port, inputs().map(|p| p.name.as_str())))?;
            let (offset, len) = match &frame.row {
                None => (0, p.len()),
                Some(row) => {
                    let width = p.len() / p.shape[0];
                    let k = p.rows.iter().position(|r| r == row.get_ref());
                    let k = k.ok_or_else(|| self.text.unknown("row", row, p.rows.iter().map(String::as_str)))?;
                    (k * width, width)
                }
            };
            let values = numbers(frame.value.get_ref()).filter(|v| v.len() == len && v.iter().all(|c| c.is_finite()));
            let values = values.ok_or_else(|| {
                self.text.at(frame.value.span().start, format!("`value` must be {len} finite number(s) for `{wanted}`"))
            })?;
            let t = self.text.checked("keyframe", "t", &frame.t)?;
            let same =
                |track: &&mut Track| track.port == port && track.offset == offset && track.frames[0].1.len() == len;
            match tracks.iter_mut().find(same) {
                Some(track) => track.insert(t, values),
                None => {
                    let mut track = Track::new(port, offset, len, p);
                    track.insert(t, values);
                    tracks.push(track);
                }
            }
        }
        Ok(tracks)
    }
}

/// Takes bone nodes within `rings` edges of another bone off their bone.
fn free_rings(mesh: &TetMesh, bones: &mut [Bone], rings: u32, warnings: &mut Vec<String>) {
    let mut freed = 0;
    for _ in 0..rings {
        let mut near: Vec<u32> = sim::osteotomy_edges(mesh, bones).into_iter().flat_map(|(a, b)| [a, b]).collect();
        near.sort_unstable();
        near.dedup();
        freed += near.len();
        for bone in bones.iter_mut() {
            bone.nodes.retain(|a| near.binary_search(a).is_err());
        }
    }
    if freed > 0 {
        warnings.push(format!("{freed} bone node(s) next to another bone were set free (free_rings = {rings})"));
    }
}

/// The scene without its `[mesh...]` tables: what identifies a model beside its mesh.
fn without_mesh_table(text: &str) -> String {
    let mut inside = false;
    let keep = |line: &&str| {
        if line.trim_start().starts_with('[') {
            inside = line.trim_start().trim_start_matches('[').trim_start().starts_with("mesh");
        }
        !inside
    };
    text.lines().filter(keep).collect::<Vec<_>>().join("\n")
}

fn numbers(value: &toml::Value) -> Option<Vec<f64>> {
    match value {
        toml::Value::Float(v) => Some(vec![*v]),
        toml::Value::Integer(v) => Some(vec![*v as f64]),
        toml::Value::Array(items) => items.iter().map(numbers).collect::<Option<Vec<_>>>().map(|v| v.concat()),
        _ => None,
    }
}
