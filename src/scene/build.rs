//! What a scene means: names become sets, keys become terms, and a [`Model`] comes out.

use super::SceneError;
use super::bones::free_rings;
use super::check::Text;
use super::file::{InertiaSpec, SceneFile};
use super::materials::{Tissue, stand_in};
use super::place::nearest_point;
use super::programme::Programme;
use super::tables::identity;
use crate::effect::{Gravity, Inertia, lumped_masses};
use crate::fem::{Curving, Embedding, add_midsides, curve_midsides};
use crate::math::Vec3;
use crate::mesh::{SKIN, TetMesh};
use crate::port::Slot;
use crate::sim::{self, Drive, Layout, Marker, Model, ModelParts, Scheme};
use crate::solve::{LinearSystems, Precision, Strategy};

/// Pairs that the quasi-Newton method remembers.
const MEMORY: usize = 8;
/// Iterations after which the quasi-Newton method factors anew.
const REFRESH_AFTER: u32 = 20;
/// Largest nodal motion of the last correction, m.
const TOLERANCE: f64 = 1e-7;
/// Round-off of the solver that the estimate of an error in time can bear, in units of its accuracy.
const NOISE: f64 = 0.1;

/// The model and programme of a scene `text` on its mesh.
///
/// # Errors
/// [`SceneError`] with line and column.
pub fn build(text: &str, file: &SceneFile, mesh: TetMesh) -> Result<(Model, Programme), SceneError> {
    Builder { text: Text(text) }.build(file, mesh)
}

/// Gives a scene its meaning; what belongs to materials, bones, loads and programme stands in files of those names.
pub(super) struct Builder<'a> {
    pub text: Text<'a>,
}

impl Builder<'_> {
    fn build(&self, file: &SceneFile, mesh: TetMesh) -> Result<(Model, Programme), SceneError> {
        let Some(gravity) = &file.gravity else { return self.forward(file, mesh) };
        let scan = self.text.triple("gravity", "scan", &gravity.scan)?;
        match (self.text.choice("gravity", "rest", &gravity.rest)?, scan) {
            (Some("inverse"), Some(scan)) => self.unweighted(file, mesh, scan),
            (Some(_), None) => {
                let at = gravity.rest.as_ref().map_or(0, |r| r.span().start);
                Err(self.text.at(at, "`rest` of [gravity] needs `scan`, the gravity of the scan".to_owned()))
            }
            _ => self.forward(file, mesh),
        }
    }

    /// The model of a mesh as it is.
    pub(super) fn forward(&self, file: &SceneFile, mut mesh: TetMesh) -> Result<(Model, Programme), SceneError> {
        // Exhaustive, so that a new table cannot be forgotten here.
        let SceneFile {
            name,
            mesh: mesh_spec,
            skin,
            tissue: _,
            bone,
            muscle,
            load,
            pressure,
            contact: _,
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
        if let Some(curved) = mesh_spec.get_ref().curved.as_ref().filter(|c| *c.get_ref()) {
            if midsides.is_empty() {
                let message = "`curved` of [mesh] bends the edges of quadratic elements: it wants order = 2".to_owned();
                return Err(self.text.at(curved.span().start, message));
            }
            let Curving { curved, straightened } = curve_midsides(&mut mesh, &midsides);
            if straightened > 0 {
                let all = curved + straightened;
                warnings
                    .push(format!("{straightened} of {all} curved edges were left straight: an element would fold"));
            }
        }
        let embedding = match &mesh.fine_skin {
            Some(fine) => {
                let at = skin.as_ref().map_or(mesh_spec.span(), |s| s.span()).start;
                let made = Embedding::new(&mesh, &midsides, fine).map_err(|e| self.text.at(at, e.to_string()))?;
                if made.n_far > 0 {
                    warnings.push(format!(
                        "{} of {} vertices of the fine skin lie more than a quarter of an element outside the mesh, \
                         {:.2e} m at most: they move along with the nearest element",
                        made.n_far,
                        made.len(),
                        made.farthest
                    ));
                }
                Some(made)
            }
            None => None,
        };
        let Tissue { mut terms, density, mut n_history, tunable } =
            self.tissue(file, &mesh, &midsides, &mut warnings)?;
        let rings = attachment.as_ref().and_then(|a| a.free_rings.as_ref()).map_or(0, |r| *r.get_ref());
        let (mut bones, shared) = self.bones(bone, &mesh, rings)?;
        if rings > 0 {
            free_rings(&mesh, &mut bones, &shared, rings, &mut warnings);
        }
        self.can_be_pushed(bone, &bones, &mesh)?;
        let first_of_contacts = mesh.nodes.len() as u32;
        let mut contacts = Vec::new();
        for (name, bone, contact) in self.contacts(file, &mut mesh, &mut bones, &mut n_history, &mut warnings)? {
            let (reach, surface, axis) = (contact.shape.reach(), contact.shape.surface(), contact.shape.axis());
            contacts.push(sim::Contact { name, bone, frame: contact.frame, term: terms.len(), reach, surface, axis });
            terms.push(Box::new(contact));
        }
        let counts: Vec<(Drive, usize)> = bones.iter().map(|b| (b.drive, b.nodes.len())).collect();
        let layout = Layout::new(tunable.len(), &counts, muscle.len(), load.len(), pressure.len(), gravity.is_some());
        let mut start = vec![0.0; layout.len()];
        start.iter_mut().zip(&tunable).for_each(|(start, (_, E))| *start = *E);
        self.bone_starts(bone, &bones, first_of_contacts, &mesh, &layout, &mut start)?;

        if inertia.as_ref().and_then(|i| i.start.as_ref()).is_some_and(|start| start.get_ref() == "rest") {
            self.bones_at_rest(bone)?;
        }

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
            let differential = spec.rest.as_ref().is_none_or(|r| r.get_ref() == "differential");
            let scan = self.text.triple("gravity", "scan", &spec.scan)?.filter(|_| differential);
            terms.push(Box::new(Gravity { m: masses(), input, scan: scan.unwrap_or_default().into() }));
        }
        let tolerance = match solver {
            Some(s) => self.text.number("solver", "tolerance", &s.tolerance)?.unwrap_or(TOLERANCE),
            None => TOLERANCE,
        };
        let inertia = match inertia {
            Some(spec) => {
                terms.push(Box::new(Inertia { m: masses() }));
                let scheme = self.scheme(spec)?;
                if terms.iter().any(|t| !t.is_quadratic()) {
                    warnings.extend(sim::undamped(scheme));
                }
                let start = self.text.choice("inertia", "start", &spec.start)?.unwrap_or("equilibrium");
                let reduction = self.reduction(spec, file, &mesh, &bones, &terms, n_history)?;
                Some(sim::Inertia {
                    m: masses(),
                    start_at_rest: start == "rest",
                    scheme,
                    damping_mass: self.text.number("inertia", "damping_mass", &spec.damping_mass)?.unwrap_or(0.0),
                    accuracy: self.accuracy(spec, tolerance)?,
                    reduction,
                })
            }
            None => None,
        };
        let skin = match &mesh.fine_skin {
            Some(fine) => (&fine.vertices[..], &fine.triangles[..]),
            None => (&mesh.nodes[..], mesh.face_set(SKIN).map_or(&[][..], |s| &s.triangles)),
        };
        self.text.names("marker", marker.iter().map(|m| &m.name))?;
        let mut markers = Vec::new();
        for m in marker {
            let at = self.text.vector("marker", "at", &m.at)?;
            let (nodes, weights) = nearest_point(skin.0, skin.1, &at).ok_or_else(|| self.text.no_skin(&m.name))?;
            let found: Vec3 = nodes.iter().zip(weights).map(|(&a, w)| w * skin.0[a as usize]).sum();
            markers.push(Marker { name: m.name.get_ref().clone(), nodes, weights, off: (found - at).norm() });
        }
        let end = run.as_ref().map(|run| self.text.number("run", "end", &run.end)).transpose()?.flatten();
        let end = end.unwrap_or(1.0);
        warnings.extend(self.implausible(file, &mesh, &markers, end));
        let spec = solver.as_ref();
        let newton =
            spec.map(|s| self.text.choice("solver", "method", &s.method)).transpose()?.flatten() == Some("newton");
        let max_iterations = spec.and_then(|s| s.max_iterations.as_ref());
        let max_iterations = max_iterations.map(|n| self.text.count("solver", "max_iterations", n)).transpose()?;
        let max_iterations = max_iterations.unwrap_or(200);
        let most_solves = spec.and_then(|s| s.most_solves.as_ref());
        let most_solves = most_solves.map(|n| self.text.count("solver", "most_solves", n)).transpose()?;
        let usual_solves = sim::usual_solves(inertia.as_ref(), max_iterations);
        let threads = spec.and_then(|s| s.threads.as_ref());
        let threads = threads.map(|n| self.text.count("solver", "threads", n)).transpose()?.unwrap_or(1);
        let inversion = spec.map(|s| self.text.choice("solver", "inversion", &s.inversion)).transpose()?.flatten();
        let precision = spec.map(|s| self.text.choice("solver", "precision", &s.precision)).transpose()?.flatten();
        let single = precision.map_or(!newton, |p| p == "single");
        let linear = spec.map(|s| self.text.choice("solver", "linear", &s.linear)).transpose()?.flatten();
        let background = match spec.and_then(|s| s.background.as_ref()) {
            Some(background) if *background.get_ref() && (newton || linear == Some("iterative")) => {
                let message = "`background` of [solver] makes a kept factor anew: it wants the methods that keep one, \
                               `method = \"quasi-newton\"` and `linear = \"direct\"`";
                return Err(self.text.at(background.span().start, message.into()));
            }
            Some(background) => *background.get_ref(),
            None => false,
        };
        let strategy = Strategy {
            linear: match linear {
                Some("direct") => LinearSystems::Direct,
                Some("iterative") => LinearSystems::Iterative,
                _ => LinearSystems::Fitting,
            },
            precision: if single { Precision::Single } else { Precision::Double },
            threads: threads as usize,
            memory: if newton { 0 } else { MEMORY },
            refresh_after: if newton { 1 } else { REFRESH_AFTER },
            tolerance,
            max_iterations,
            without: None,
        };
        let model = Model::new(ModelParts {
            name: name.clone().unwrap_or_else(|| "scene".into()),
            mesh,
            midsides,
            embedding,
            bones,
            tunable: tunable.into_iter().map(|(name, _)| name).collect(),
            muscles,
            loads,
            pressures,
            contacts,
            markers,
            terms,
            stand_in,
            n_history,
            inertia,
            layout,
            start,
            may_invert: inversion == Some("allow"),
            strategy,
            most_solves: most_solves.unwrap_or(usual_solves),
            background,
            identity: identity(self.text.0)?,
            warnings,
        })?;
        let dt = run.as_ref().map(|run| self.text.number("run", "dt", &run.dt)).transpose()?.flatten();
        for p in model.ports() {
            let (low, high) = (p.min.unwrap_or(f64::NEG_INFINITY), p.max.unwrap_or(f64::INFINITY));
            if let Some(k) = p.start.iter().position(|v| !(low..=high).contains(v)) {
                let row =
                    p.rows.get(k * p.rows.len() / p.len().max(1)).map_or(String::new(), |row| format!(" of `{row}`"));
                let message =
                    format!("`{}`{row} starts at {} {}; it takes {low} to {high}", p.name, p.start[k], p.unit);
                return Err(self.text.at(0, message));
            }
        }
        let tracks = self.tracks(file, model.ports())?;
        Ok((model, Programme { dt: dt.unwrap_or(0.1), end, tracks }))
    }
}

impl Builder<'_> {
    fn accuracy(&self, spec: &InertiaSpec, tolerance: f64) -> Result<Option<f64>, SceneError> {
        let Some(at) = &spec.accuracy else { return Ok(None) };
        let accuracy = self.text.checked("inertia", "accuracy", at)?;
        if tolerance > NOISE * accuracy {
            let message = format!(
                "`accuracy` is {accuracy:e} m, but positions are solved to {tolerance:e} m only: make it at least ten \
                 times `tolerance` of [solver], or that smaller"
            );
            return Err(self.text.at(at.span().start, message));
        }
        Ok(Some(accuracy))
    }

    fn scheme(&self, spec: &InertiaSpec) -> Result<Scheme, SceneError> {
        let name = self.text.choice("inertia", "scheme", &spec.scheme)?;
        let rho = self.text.number("inertia", "rho", &spec.rho)?;
        if let (Some(rho), true) = (&spec.rho, name != Some("generalised-alpha")) {
            let message = "`rho` belongs to `scheme = \"generalised-alpha\"`".to_owned();
            return Err(self.text.at(rho.span().start, message));
        }
        Ok(match name {
            Some("bdf2") => Scheme::Bdf2,
            Some("generalised-alpha") => Scheme::GeneralisedAlpha { rho: rho.unwrap_or(0.8) },
            Some("implicit-midpoint") => Scheme::GeneralisedAlpha { rho: 1.0 },
            _ => Scheme::BackwardEuler,
        })
    }
}
