//! Which variants of a scene are compared.

use std::path::Path;

use toml::{Table, Value};

use super::edit;
use crate::error::Error;
use crate::load;
use crate::scene::SmallStrain;

/// How the displacement is interpolated, and the volume kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Element {
    /// Linear tetrahedra.
    Linear,
    /// Linear tetrahedra with averaged nodal pressure.
    NodalPressure,
    /// Quadratic tetrahedra.
    Quadratic,
}

/// How the equilibrium of a step is sought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// As the scene says.
    Own,
    /// Quasi-Newton, solves in single precision.
    Single,
    /// Quasi-Newton, solves in double precision.
    Double,
    /// Newton, a new factor in every iteration.
    Newton,
}

/// One mesh of the ladder.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// What tells it from the others.
    pub name: String,
    /// Its `[mesh]` table.
    pub mesh: Table,
}

/// A scene with some things done otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// Law of all tissues; the scene's own if `None`.
    pub law: Option<&'static str>,
    /// Element.
    pub element: Element,
    /// Mesh, by its place in [`Plan::levels`].
    pub level: usize,
    /// Solver.
    pub solver: Solver,
    /// Largest nodal motion of the last correction, m; the scene's own if `None`.
    pub tolerance: Option<f64>,
    /// Time integrator; the scene's own if `None`.
    pub scheme: Option<&'static str>,
    /// Steps for each step of the scene's programme.
    pub substeps: usize,
    /// An effect that is left out.
    pub without: Option<&'static str>,
}

/// Everything that a study runs.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The scene, parsed.
    scene: Table,
    /// Small-strain constants of its tissues, in order.
    small_strain: Vec<SmallStrain>,
    /// Meshes from coarse to fine.
    pub levels: Vec<Level>,
    /// Place of the scene's own mesh among them.
    pub own: usize,
    /// The converged answer, as far as the ladder can give one.
    pub reference: Variant,
    /// What is compared with it.
    pub variants: Vec<Variant>,
}

/// Laws of the ladder, from the least to the most.
const LAWS: [&str; 4] = ["mass-spring", "linear", "corotational", "stable-neo-hookean"];
/// The law of springs.
const SPRINGS: &str = "mass-spring";
/// Tolerances of the ladder, m.
const TOLERANCES: [f64; 5] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-8];
/// Tolerance of the reference, m.
const EXACT: f64 = 1e-8;
/// Time integrators of the ladder.
const SCHEMES: [&str; 4] = ["backward-euler", "bdf2", "generalised-alpha", "implicit-midpoint"];
/// Steps for each of the programme's, in the ladder of time.
const SUBSTEPS: [usize; 3] = [1, 2, 4];
/// The same of the reference, which is of second order.
const FINE_TIME: usize = 16;
/// Effects that can be left out, by the table that names them.
const EFFECTS: [&str; 8] = ["viscous", "fibre", "damage", "grade", "limit", "tension", "gravity", "inertia"];

impl Plan {
    /// The ladder of a scene; `folder` is where the files it names lie, `meshes` are further mesh files for scenes whose
    /// mesh is a file. With `quick` fewer meshes and no ladders of solver and time.
    ///
    /// # Errors
    /// [`Error`] if the scene is refused.
    pub fn new(text: &str, folder: Option<&Path>, meshes: &[String], quick: bool) -> Result<Plan, Error> {
        let small_strain = load::small_strain(text)?;
        // The text was accepted as a scene, so it is TOML.
        let scene: Table = text.parse().unwrap_or_default();
        let given = scene.get("mesh").and_then(Value::as_table).cloned().unwrap_or_default();
        let (mut levels, mut own) = edit::levels(&given, meshes, folder)?;
        if quick && levels.len() > 2 {
            let first = own.saturating_sub(1).min(levels.len() - 2);
            levels = levels.split_off(first);
            levels.truncate(2);
            own -= first;
        }
        let order = given.get("order").and_then(Value::as_integer).unwrap_or(1);
        let nodal = edit::tissues(&scene).any(|t| t.get("pressure").and_then(Value::as_str) == Some("nodal"));
        let element = match (order, nodal) {
            (2, _) => Element::Quadratic,
            (_, true) => Element::NodalPressure,
            _ => Element::Linear,
        };
        let base = Variant {
            law: None,
            element,
            level: own,
            solver: Solver::Own,
            tolerance: None,
            scheme: None,
            substeps: 1,
            without: None,
        };
        let in_time = scene.contains_key("inertia");
        let reference = Variant {
            element: Element::Quadratic,
            level: levels.len() - 1,
            tolerance: Some(EXACT),
            scheme: in_time.then_some("bdf2"),
            substeps: if in_time { FINE_TIME } else { 1 },
            ..base.clone()
        };
        let mut plan = Plan { scene, small_strain, levels, own, reference, variants: Vec::new() };
        plan.climb(&base, in_time, quick);
        Ok(plan)
    }

    fn climb(&mut self, base: &Variant, in_time: bool, quick: bool) {
        let mut variants = Vec::new();
        let own_law = |law: &str| {
            edit::tissues(&self.scene)
                .all(|t| !t.contains_key("preset") && t.get("energy").and_then(Value::as_str).unwrap_or(LAWS[3]) == law)
        };
        let laws = LAWS.into_iter().filter(|law| !own_law(law)).map(Some).chain([None]);
        for law in laws {
            let springs = law == Some(SPRINGS) || law.is_none() && own_law(SPRINGS);
            for element in [Element::Linear, Element::NodalPressure, Element::Quadratic] {
                for level in (0..self.levels.len()).filter(|_| !springs || element == Element::Linear) {
                    variants.push(Variant { law, element, level, ..base.clone() });
                }
            }
        }
        if !quick {
            variants.extend(TOLERANCES.map(|t| Variant { tolerance: Some(t), ..base.clone() }));
            variants.extend(
                [Solver::Single, Solver::Double, Solver::Newton].map(|solver| Variant { solver, ..base.clone() }),
            );
        }
        if in_time && !quick {
            for scheme in SCHEMES {
                variants.extend(SUBSTEPS.map(|substeps| Variant { scheme: Some(scheme), substeps, ..base.clone() }));
            }
        }
        let named = |effect: &&str| {
            self.scene.contains_key(*effect) || edit::tissues(&self.scene).any(|t| t.contains_key(*effect))
        };
        variants
            .extend(EFFECTS.into_iter().filter(named).map(|effect| Variant { without: Some(effect), ..base.clone() }));
        self.variants = variants;
    }

    /// Name of the scene.
    pub fn name(&self) -> &str {
        self.scene.get("name").and_then(Value::as_str).unwrap_or("scene")
    }

    /// Whether the meshes are made of one shape at several resolutions; mesh files may be of different shapes.
    pub fn is_of_one_shape(&self) -> bool {
        self.levels.iter().all(|level| !level.mesh.contains_key("file"))
    }

    /// The text of a variant's scene.
    pub fn text(&self, v: &Variant) -> String {
        edit::apply(&self.scene, &self.levels[v.level], &self.small_strain, v)
    }

    /// The variant with the reference's law and element on the next coarser mesh: how far it is off tells of the
    /// reference's own error.
    pub fn below_reference(&self) -> Option<Variant> {
        let level = self.reference.level.checked_sub(1)?;
        let of = |v: &&Variant| {
            v.law.is_none() && v.element == Element::Quadratic && v.level == level && v.without.is_none()
        };
        self.variants
            .iter()
            .find(|v| of(v) && v.tolerance.is_none() && v.solver == Solver::Own && v.scheme.is_none())
            .cloned()
    }
}

impl Element {
    /// Short name.
    pub fn name(self) -> &'static str {
        match self {
            Element::Linear => "tet4",
            Element::NodalPressure => "tet4 nodal pressure",
            Element::Quadratic => "tet10",
        }
    }
}

impl Variant {
    /// What it does, in words; unique within a plan.
    pub fn name(&self, levels: &[Level]) -> String {
        let mut name =
            format!("{}, {}, {}", self.law.unwrap_or("law of the scene"), self.element.name(), levels[self.level].name);
        let mut add = |text: String| {
            name += ", ";
            name += &text;
        };
        if let Some(t) = self.tolerance {
            add(format!("tolerance {t:e} m"));
        }
        match self.solver {
            Solver::Own => {}
            Solver::Single => add("single precision".into()),
            Solver::Double => add("double precision".into()),
            Solver::Newton => add("Newton".into()),
        }
        if let Some(scheme) = self.scheme {
            add(format!("{scheme}, {} steps for one", self.substeps));
        }
        if let Some(effect) = self.without {
            add(format!("without {effect}"));
        }
        name
    }
}
