//! A scene's text with some things done otherwise.

use std::path::Path;

use toml::{Table, Value};

use super::plan::{Element, Level, Solver, Variant};
use crate::error::Error;
use crate::load;
use crate::scene::SmallStrain;

/// Cells of a block's levels, in units of the scene's own.
const CELLS: [f64; 4] = [0.5, 1.0, 1.5, 2.0];
/// Edges of the head's levels, m; the scene's own joins them.
const EDGES: [f64; 4] = [0.0119, 0.0095, 0.0078, 0.006];
/// Constants of laws; those of another law are dropped.
const CONSTANTS: [&str; 12] = ["E", "nu", "mu", "alpha", "b", "c1", "c2", "c10", "c01", "c20", "c30", "kappa"];
/// What stands on a law, and springs do not have.
const ON_LAWS: [&str; 8] = ["preset", "level", "pressure", "viscous", "fibre", "damage", "grade", "limit"];

/// The tissue tables of a scene.
pub(super) fn tissues(scene: &Table) -> impl Iterator<Item = &Table> {
    scene.get("tissue").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_table)
}

/// Meshes of the ladder from coarse to fine, and which of them is the scene's own.
pub(super) fn levels(given: &Table, meshes: &[String], folder: Option<&Path>) -> Result<(Vec<Level>, usize), Error> {
    let table = |key: &str| given.get(key).and_then(Value::as_table);
    if let Some(block) = table("block") {
        let cells: Vec<f64> = block
            .get("cells")
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
            .filter_map(Value::as_integer)
            .map(|c| c as f64)
            .collect();
        let level = |factor: f64| {
            let cells = cells.iter().map(|c| Value::Integer((c * factor).round().max(1.0) as i64)).collect::<Vec<_>>();
            let name = cells.iter().map(|c| c.to_string()).collect::<Vec<_>>().join(" x ");
            let mut block = block.clone();
            block.insert("cells".into(), Value::Array(cells));
            Level { name: format!("{name} cells"), mesh: with(given, "block", Value::Table(block)) }
        };
        return Ok(choose(CELLS.map(level).into(), level(1.0)));
    }
    if let Some(head) = table("head") {
        let own = head.get("edge").and_then(Value::as_float);
        let level = |edge: f64| {
            let table = Table::from_iter([("edge".to_owned(), Value::Float(edge))]);
            Level { name: format!("edge {} mm", 1e3 * edge), mesh: with(given, "head", Value::Table(table)) }
        };
        let own = own.unwrap_or(0.0078);
        let mut edges = EDGES.to_vec();
        if !edges.contains(&own) {
            edges.push(own);
        }
        edges.sort_by(|a, b| b.total_cmp(a));
        return Ok(choose(edges.into_iter().map(level).collect(), level(own)));
    }
    let level = |name: &str| Level { name: name.to_owned(), mesh: with(given, "file", Value::String(name.to_owned())) };
    let own = given.get("file").and_then(Value::as_str).unwrap_or_default();
    let mut sized = Vec::new();
    for name in meshes.iter().map(String::as_str).chain([own]) {
        sized.push((load::mesh_file(folder, name)?.nodes.len(), level(name)));
    }
    sized.sort_by_key(|(nodes, _)| *nodes);
    Ok(choose(sized.into_iter().map(|(_, level)| level).collect(), level(own)))
}

/// Drops repetitions and finds the scene's own.
fn choose(mut levels: Vec<Level>, own: Level) -> (Vec<Level>, usize) {
    levels.dedup();
    let place = levels.iter().position(|l| *l == own).unwrap_or(0);
    (levels, place)
}

fn with(table: &Table, key: &str, value: Value) -> Table {
    let mut table = table.clone();
    table.insert(key.to_owned(), value);
    table
}

/// The text of a variant.
pub(super) fn apply(scene: &Table, level: &Level, small_strain: &[SmallStrain], v: &Variant) -> String {
    let mut scene = scene.clone();
    let mut mesh = level.mesh.clone();
    mesh.insert("order".into(), Value::Integer(if v.element == Element::Quadratic { 2 } else { 1 }));
    if v.element != Element::Quadratic {
        mesh.remove("curved");
    }
    scene.insert("mesh".into(), Value::Table(mesh));
    scene.remove("skin");
    for (tissue, constants) in tissues_mut(&mut scene).zip(small_strain) {
        if let Some(law) = v.law {
            take_law(tissue, law, constants);
        }
        tissue.remove("pressure");
        if v.element == Element::NodalPressure {
            tissue.insert("pressure".into(), Value::String("nodal".into()));
        }
    }
    let solver = table_mut(&mut scene, "solver");
    match v.solver {
        Solver::Own => {}
        Solver::Single | Solver::Double => {
            let precision = if v.solver == Solver::Single { "single" } else { "double" };
            solver.insert("method".into(), Value::String("quasi-newton".into()));
            solver.insert("precision".into(), Value::String(precision.into()));
        }
        Solver::Newton => {
            solver.insert("method".into(), Value::String("newton".into()));
            solver.remove("precision");
        }
    }
    if let Some(tolerance) = v.tolerance {
        solver.insert("tolerance".into(), Value::Float(tolerance));
    }
    if let Some(scheme) = v.scheme {
        let inertia = table_mut(&mut scene, "inertia");
        inertia.insert("scheme".into(), Value::String(scheme.into()));
        inertia.remove("accuracy");
        if scheme != "generalised-alpha" {
            inertia.remove("rho");
        }
    }
    if let Some(effect) = v.without {
        scene.remove(effect);
        tissues_mut(&mut scene).for_each(|tissue| drop(tissue.remove(effect)));
    }
    toml::to_string(&scene).unwrap_or_default()
}

fn take_law(tissue: &mut Table, law: &str, constants: &SmallStrain) {
    CONSTANTS.iter().for_each(|key| drop(tissue.remove(*key)));
    tissue.insert("energy".into(), Value::String(law.into()));
    tissue.insert("E".into(), Value::Float(constants.E));
    if law == "mass-spring" {
        ON_LAWS.iter().chain(&["tension"]).for_each(|key| drop(tissue.remove(*key)));
        tissue.insert("density".into(), Value::Float(constants.density));
    } else {
        tissue.insert("nu".into(), Value::Float(constants.nu));
    }
}

fn table_mut<'a>(scene: &'a mut Table, key: &str) -> &'a mut Table {
    let value = scene.entry(key).or_insert_with(|| Value::Table(Table::new()));
    value.as_table_mut().expect("the scene was accepted, so this is a table")
}

fn tissues_mut(scene: &mut Table) -> impl Iterator<Item = &mut Table> {
    scene.get_mut("tissue").and_then(Value::as_array_mut).into_iter().flatten().filter_map(Value::as_table_mut)
}
