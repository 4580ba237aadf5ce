//! Small scenes that stand for the kinds there are, and their models.

use std::cell::RefCell;
use std::sync::Arc;

use cutis::sim::{Model, Sim};

const BLOCK: &str = "name = \"small\"\n[mesh.block]\nsize = [0.03, 0.02, 0.01]\ncells = [3, 2, 1]\n";
const BONES: &str = "[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n";

/// Linear, soft and loaded, loose bone, dynamic, with memory, with a muscle, averaged pressure, touched by a finger, in modes.
pub fn texts() -> Vec<String> {
    let soft = "[[tissue]]\nE = 15e3\nnu = 0.4\n";
    let load = "[[load]]\nname = \"push\"\nat = [0.015, 0.01, 0.01]\nradius = 0.008\n";
    vec![
        format!("{BLOCK}[[tissue]]\nenergy = \"linear\"\nE = 15e3\nnu = 0.4\n{BONES}{load}"),
        format!("{BLOCK}{soft}{BONES}{load}[[marker]]\nname = \"lip\"\nat = [0.015, 0.01, 0.01]\n"),
        format!("{BLOCK}{soft}{BONES}drive = \"force\"\n"),
        format!("{BLOCK}{soft}density = 1000\n{BONES}[inertia]\nscheme = \"generalised-alpha\"\naccuracy = 1e-3\n"),
        format!("{BLOCK}{soft}[tissue.viscous]\ng = [0.5]\ntau = [0.1]\n{BONES}"),
        format!(
            "{BLOCK}{soft}{BONES}[[muscle]]\nname = \"strand\"\npath = [[0.0, 0.01, 0.005], [0.03, 0.01, 0.005]]\n\
             radius = 0.01\nstress = 30e3\n"
        ),
        format!("{BLOCK}[[tissue]]\nenergy = \"neo-hookean\"\nE = 15e3\nnu = 0.49\npressure = \"nodal\"\n{BONES}"),
        format!(
            "{BLOCK}{soft}{BONES}[[bone]]\nname = \"finger\"\nnodes = \"none\"\n[[contact]]\nname = \"tip\"\nbone = \"finger\"\n\
             path = [[0.015, 0.01, 0.0195]]\nradius = 0.01\nfriction = 0.5\n[[contact]]\nname = \"plate\"\nbone = \"jaw\"\n\
             point = [0.0, 0.0, 0.011]\nnormal = [0, 0, -1]\n"
        ),
        format!(
            "{BLOCK}[[tissue]]\nenergy = \"linear\"\nE = 15e3\nnu = 0.4\n{BONES}[inertia]\nmodes = 6\nscheme = \"bdf2\"\n"
        ),
    ]
}

thread_local! {
    static MODELS: RefCell<Vec<Arc<Model>>> = const { RefCell::new(Vec::new()) };
}

/// The models of [`texts`], made once.
pub fn model(k: usize) -> Arc<Model> {
    MODELS.with_borrow_mut(|models| {
        if models.is_empty() {
            let load = |text: &String| Arc::new(cutis::load::from_text(text, None).expect("a valid scene").model);
            models.extend(texts().iter().map(load));
        }
        models[k % models.len()].clone()
    })
}

/// Takes a step or refuses it; what ports tell afterwards are numbers.
pub fn exercise(sim: &mut Sim, dt: f64) {
    let taken = sim.initialise().and_then(|_| sim.step(dt));
    let finite = sim.positions().iter().all(|x| x.iter().all(|c| c.is_finite()));
    assert!(finite, "positions that are not finite after {taken:?}");
}
