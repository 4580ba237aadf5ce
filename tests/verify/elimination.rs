//! The order of elimination that a packed model carries: the same bits as without, and of no harm where it does not fit.

use std::path::Path;
use std::sync::Arc;

use cutis::load::{self, BAKED_NAME, Baked};
use cutis::mesh::TetMesh;
use cutis::sim::Sim;

use crate::common::{get, set};

fn sim(loaded: load::Loaded) -> Sim {
    Sim::new(Arc::new(loaded.model)).expect("a new simulation")
}

fn mesh(baked: &Baked) -> TetMesh {
    cutis::io::decode(&baked.mesh, Path::new(BAKED_NAME)).expect("sound bytes")
}

/// Entries of the factor once the packed order is replaced.
fn entries(baked: &Baked, change: impl FnOnce(&mut TetMesh)) -> usize {
    let mut mesh = mesh(baked);
    change(&mut mesh);
    let changed = Baked { scene: baked.scene.clone(), mesh: cutis::io::encode(&mesh), notes: Vec::new() };
    sim(changed.load().expect("a model")).factor_len()
}

#[test]
fn a_packed_order_is_that_of_the_scene_and_changes_no_bit() {
    let baked = load::baked_default().expect("the default scene");
    assert!(mesh(&baked).elimination.is_some());
    let run = |loaded| {
        let mut sim = sim(loaded);
        sim.initialise().expect("equilibrium");
        set(&mut sim, "bone.rotation", 3, &[0.05, 0.0, 0.0]);
        sim.step(0.1).expect("a step");
        get(&sim, "skin.position")
    };
    assert_eq!(run(baked.load().expect("a model")), run(load::embedded().expect("the default scene")));
}

#[test]
fn an_order_serves_its_own_pattern_only() {
    let baked = load::baked_default().expect("the default scene");
    let own = entries(&baked, |_| {});
    assert_eq!(entries(&baked, |mesh| mesh.elimination = None), own);
    // Found again in the file and taken as it is.
    let natural = entries(&baked, |mesh| mesh.elimination.as_mut().expect("an order").order.sort_unstable());
    assert!(natural > 2 * own, "{natural} entries in the order of the nodes, {own} in that of nested dissection");
    let foreign = entries(&baked, |mesh| {
        let elimination = mesh.elimination.as_mut().expect("an order");
        elimination.order.sort_unstable();
        elimination.pattern[0] ^= 1;
    });
    assert_eq!(foreign, own);
    for damage in [0, u32::MAX] {
        assert_eq!(entries(&baked, |mesh| mesh.elimination.as_mut().expect("an order").order[7] = damage), own);
    }
    assert_eq!(entries(&baked, |mesh| mesh.elimination.as_mut().expect("an order").order.truncate(9)), own);
}
