//! The study: errors are those they are said to be, and a study that was cut off goes on.

use cutis::mesh::FineSkin;
use cutis::study::{Answer, Element, Plan, Probe, Row, errors, measure, read_rows, write_rows};

const SCENE: &str = "name = \"small\"\n[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n[[tissue]]\n\
    energy = \"neo-hookean\"\nE = 15e3\nnu = 0.45\n[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n\
    [[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n[run]\ndt = 0.5\nend = 1.0\n[[keyframe]]\nt = 1.0\n\
    port = \"bone.translation\"\nrow = \"jaw\"\nvalue = [0.0, 0.004, 0.003]\n";

fn plan() -> (Plan, Probe) {
    let plan = Plan::new(SCENE, None, &[], true).expect("a plan");
    let finest = cutis::load::from_text(&plan.text(&plan.reference), None).expect("the reference").model;
    (plan, Probe { skin: FineSkin::of(finest.mesh()), most_unknowns: 100_000 })
}

#[test]
fn a_study_orders_methods_as_theory_does() {
    let (plan, probe) = plan();
    let reference = measure(&plan.text(&plan.reference), None, &plan.reference, &probe).expect("an answer");
    let rows: Vec<Row> = plan
        .variants
        .iter()
        .map(|v| Row::new(v.name(&plan.levels), measure(&plan.text(v), None, v, &probe), &reference))
        .collect();
    let rms = |wanted: &dyn Fn(&cutis::study::Variant) -> bool| {
        let k = plan.variants.iter().position(wanted).expect("a variant");
        let measured = rows[k].outcome.as_ref().unwrap_or_else(|e| panic!("{}: {e}", rows[k].name));
        measured.errors.rms
    };
    let own = |element: Element, level: usize| {
        rms(&|v| v.law.is_none() && v.element == element && v.level == level && v.without.is_none())
    };
    // On the same mesh quadratic elements beat linear ones, and finer meshes coarser ones.
    assert!(own(Element::Quadratic, 0) < 0.5 * own(Element::Linear, 0));
    assert!(own(Element::Linear, 1) < own(Element::Linear, 0));
    // The reference's own method on its own mesh differs by its tolerance alone.
    assert!(own(Element::Quadratic, 1) < 1e-7);
    let springs = rms(&|v| v.law == Some("mass-spring") && v.level == 1);
    assert!(springs > own(Element::Quadratic, 0), "springs have no volume");
    // All rows come back from the file, to the same bits but for the time's.
    let text = write_rows("this study", &rows);
    let back = read_rows("this study", &text);
    assert_eq!(write_rows("this study", &back), text);
    assert_eq!(back.len(), rows.len());
    assert!(read_rows("another study", &text).is_empty());
}

#[test]
fn errors_are_those_planted() {
    let still =
        Answer { u: vec![0.0; 600], reaction: vec![3.0, 0.0, 4.0, 0.0, 0.0, 0.0], instants: 2, ..Answer::default() };
    let mut moved = still.clone();
    // One of a hundred vertices is off by 5 mm at the second instant.
    (moved.u[300], moved.u[301]) = (3e-3, 4e-3);
    moved.reaction[3] = 1.0;
    let found = errors(&moved, &still);
    assert!((found.max - 5e-3).abs() < 1e-15 && (found.rms - 5e-4).abs() < 1e-15, "{found:?}");
    assert!(found.p95 == 0.0 && (found.force - 0.2).abs() < 1e-15, "{found:?}");
    let bytes = moved.to_bytes("this study");
    assert_eq!(Answer::from_bytes("this study", &bytes), Some(moved));
    assert_eq!(Answer::from_bytes("another", &bytes), None);
    assert_eq!(Answer::from_bytes("this study", &bytes[..bytes.len() - 3]), None);
}

#[test]
fn effects_and_time_have_rungs_where_a_scene_names_them() {
    let scene = format!("{SCENE}[gravity]\n[inertia]\n");
    let plan = Plan::new(&scene, None, &[], false).expect("a plan");
    let without: Vec<_> = plan.variants.iter().filter_map(|v| v.without).collect();
    assert_eq!(without, ["gravity", "inertia"]);
    assert!(plan.variants.iter().filter(|v| v.scheme.is_some()).count() >= 12);
    let mut names: Vec<String> = plan.variants.iter().map(|v| v.name(&plan.levels)).collect();
    names.sort();
    let all = names.len();
    names.dedup();
    assert_eq!(names.len(), all, "every variant has a name of its own");
    for v in &plan.variants {
        cutis::load::from_text(&plan.text(v), None).unwrap_or_else(|e| panic!("{}: {e}", v.name(&plan.levels)));
    }
    assert!(Plan::new("[mesh]\n", None, &[], false).is_err());
}
