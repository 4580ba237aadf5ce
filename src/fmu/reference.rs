//! A short run of the scene's own programme, packed beside the component so that an importer can check itself.
//!
//! ```text
//! extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml    what the files are
//!                                   cutis_in.csv           time, inputs and tunable parameters: set, then stepped to
//!                                   cutis_out.csv          time and outputs, the skin left out
//! ```
//!
//! One column a variable, elements of arrays separated by blanks. Numbers read back to the same bits.

use std::sync::Arc;

use super::description::{document, empty};
use crate::port::{Port, Slot, Type};
use crate::scene::Programme;
use crate::sim::{Model, Sim, SimError};

/// Steps of the programme that the run takes at most: a large scene needs a second for each.
const STEPS: usize = 8;
/// Version of the layered standard that the manifest follows.
const STANDARD: &str = "1.0.0-alpha.1";
/// Where the files lie in an archive.
pub(super) const FOLDER: &str = "extra/org.fmi-standard.fmi-ls-ref";

/// Inputs and outputs of the run as CSV.
pub(super) struct Run {
    pub inputs: String,
    pub outputs: String,
}

/// Runs the first steps of `programme`.
///
/// # Errors
/// Those of [`Sim::new`], [`Sim::initialise`] and [`Sim::step`].
pub(super) fn run(model: Arc<Model>, programme: &Programme) -> Result<Run, SimError> {
    let mut sim = Sim::new(model)?;
    let set = |p: &Port| p.ty == Type::Float64 && p.is_settable() && p.is_continuous();
    let told = |p: &Port| {
        let skin = matches!(p.slot, Slot::SkinPosition | Slot::SkinVelocity);
        p.ty == Type::Float64 && p.is_continuous() && !p.is_settable() && p.slot != Slot::Time && !skin
    };
    let mut run = Run { inputs: header(&sim, set), outputs: header(&sim, told) };
    for k in 0..=STEPS.min(programme.steps()) {
        let t = if k == 0 { 0.0 } else { programme.time(k) };
        for s in programme.settings(t) {
            sim.set_f64(s.port, s.offset, &s.values)?;
        }
        if k == 0 {
            sim.initialise()?;
        } else {
            sim.step(programme.step(k))?;
        }
        run.inputs += &row(&sim, set)?;
        run.outputs += &row(&sim, told)?;
    }
    Ok(run)
}

fn header(sim: &Sim, wanted: impl Fn(&Port) -> bool) -> String {
    let names = sim.model().ports().iter().filter(|p| wanted(p)).map(|p| format!(",\"{}\"", p.name));
    format!("\"time\"{}\n", names.collect::<String>())
}

fn row(sim: &Sim, wanted: impl Fn(&Port) -> bool) -> Result<String, SimError> {
    let mut line = format!("{:?}", sim.time());
    for (k, port) in sim.model().ports().iter().enumerate().filter(|(_, p)| wanted(p)) {
        let mut values = vec![0.0; port.len()];
        sim.get_f64(k, 0, &mut values)?;
        line += ",";
        line += &values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(" ");
    }
    Ok(line + "\n")
}

/// The manifest of the layered standard for related files.
pub(super) fn manifest() -> String {
    let attributes = vec![
        ("xmlns:fmi-ls", "http://fmi-standard.org/fmi-ls-manifest".to_owned()),
        ("fmi-ls:fmi-ls-name", "org.fmi-standard.fmi-ls-ref".to_owned()),
        ("fmi-ls:fmi-ls-version", STANDARD.to_owned()),
        (
            "fmi-ls:fmi-ls-description",
            "Layered Standard providing information on related files included in an FMU.".to_owned(),
        ),
    ];
    document("fmiReferences", attributes, |xml| {
        for (file, role, what) in [
            (
                "cutis_in.csv",
                "testcase",
                "Inputs of a short run: each row is set before the step that ends at its time",
            ),
            ("cutis_out.csv", "result", "Outputs of that run; the first row is the initial equilibrium"),
            ("../../resources/scene.toml", "model", "The scene that the component simulates"),
        ] {
            let kind = if file.ends_with("csv") { "text/csv" } else { "application/toml" };
            let attributes = vec![
                ("type", kind.to_owned()),
                ("source", file.to_owned()),
                ("role", role.to_owned()),
                ("description", what.to_owned()),
            ];
            empty(xml, "Related", attributes);
        }
    })
}
