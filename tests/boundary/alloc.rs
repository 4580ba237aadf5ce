//! Setting and getting copies numbers: no allocation, through Rust, the C library and FMI alike.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

use cutis::ffi::{capi, fmi3};
use cutis::port::{Causality, Type};
use cutis::sim::Sim;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: everything is passed on to the system's allocator; counting touches no memory but a thread's own cell.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(body: impl FnOnce()) -> u64 {
    let before = COUNT.get();
    body();
    COUNT.get() - before
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| drop(std::hint::black_box(Box::new(7)))), 1);
}

#[test]
fn set_and_get_allocate_nothing() {
    let fine_skin = super::util::root().join("tests/scenes/skin.toml");
    copies_freely(cutis::load::embedded().unwrap().model);
    copies_freely(cutis::load::from_file(&fine_skin).unwrap().model);
    copies_freely(cutis::load::from_file(&super::util::root().join("tests/scenes/contact.toml")).unwrap().model);
}

fn copies_freely(model: cutis::sim::Model) {
    let model = Arc::new(model);
    let mut sim = Sim::new(model.clone()).unwrap();
    sim.initialise().unwrap();
    for (k, port) in model.ports().iter().enumerate().filter(|(_, p)| p.ty == Type::Float64 && !p.is_empty()) {
        let mut values = vec![0.0; port.len()];
        assert_eq!(allocations(|| sim.get_f64(k, 0, &mut values).unwrap()), 0, "get {}", port.name);
        if port.causality == Causality::Input {
            assert_eq!(allocations(|| sim.set_f64(k, 0, &values).unwrap()), 0, "set {}", port.name);
        }
    }
}

#[test]
fn a_step_in_modes_after_the_first_allocates_nothing() {
    let scene = super::util::root().join("tests/scenes/inertia_modes.toml");
    let mut sim = Sim::new(Arc::new(cutis::load::from_file(&scene).unwrap().model)).unwrap();
    let translation = sim.model().ports().iter().position(|p| p.name == "bone.translation").unwrap();
    sim.initialise().unwrap();
    for k in 1..=4 {
        sim.set_f64(translation, 0, &[1e-3 * f64::from(k), 0.0, 0.0]).unwrap();
        let counted = allocations(|| drop(sim.step(0.02).unwrap()));
        assert!(k == 1 || counted == 0, "step {k}: {counted} allocations");
    }
}

#[test]
fn a_step_after_the_first_allocates_nothing() {
    let mut sim = Sim::new(Arc::new(cutis::load::embedded().unwrap().model)).unwrap();
    let rotation = sim.model().ports().iter().position(|p| p.name == "bone.rotation").unwrap();
    sim.initialise().unwrap();
    for k in 1..=4 {
        sim.set_f64(rotation, 3, &[0.01 * f64::from(k), 0.0, 0.0]).unwrap();
        let mut factorisations = 0;
        let counted = allocations(|| factorisations = sim.step(0.1).unwrap().factorisations);
        assert!(
            k == 1 || factorisations == 0 && counted == 0,
            "step {k}: {counted} allocations, {factorisations} factors"
        );
    }
}

#[test]
fn a_step_that_touches_allocates_nothing_without_a_new_factor() {
    ["contact.toml", "contact_friction.toml"].into_iter().for_each(touches_freely);
}

fn touches_freely(name: &str) {
    let scene = super::util::root().join("tests/scenes").join(name);
    let mut sim = Sim::new(Arc::new(cutis::load::from_file(&scene).unwrap().model)).unwrap();
    let translation = sim.model().ports().iter().position(|p| p.name == "bone.translation").unwrap();
    sim.initialise().unwrap();
    let mut clean = 0;
    for k in 1..=20 {
        sim.set_f64(translation, 3, &[0.0, 0.0, -1e-4 * f64::from(k)]).unwrap();
        let mut factorisations = 0;
        let counted = allocations(|| factorisations = sim.step(0.1).unwrap().factorisations);
        assert!(factorisations > 0 || counted == 0, "step {k}: {counted} allocations");
        clean += u32::from(factorisations == 0);
    }
    assert!(clean >= 10, "{name}: {clean} steps of 20 without a factor");
}

#[test]
fn a_step_with_a_second_thread_allocates_nothing() {
    let scene = "[mesh.block]\nsize = [0.1, 0.1, 0.04]\ncells = [17, 17, 6]\n[[tissue]]\nE = 15e3\nnu = 0.45\n[[bone]]\n\
                 name = \"bone\"\nnodes = \"z_min\"\n[solver]\nthreads = 2\n";
    let mut sim = Sim::new(Arc::new(cutis::load::from_text(scene, None).unwrap().model)).unwrap();
    let rotation = sim.model().ports().iter().position(|p| p.name == "bone.rotation").unwrap();
    sim.initialise().unwrap();
    for k in 1..=4 {
        sim.set_f64(rotation, 0, &[0.01 * f64::from(k), 0.0, 0.0]).unwrap();
        let mut report = None;
        let counted = allocations(|| report = Some(sim.step(0.1).unwrap()));
        let report = report.unwrap();
        assert!(report.iterations > 0 && report.factorisations == 0, "solves with the kept factor");
        assert!(k == 1 || counted == 0, "step {k}: {counted} allocations");
    }
}

#[test]
fn a_dynamic_step_allocates_nothing_without_a_new_factor() {
    let scene = "[mesh.block]\nsize = [0.04, 0.02, 0.02]\ncells = [4, 2, 2]\n[[tissue]]\nE = 1e4\nnu = 0.4\n[[bone]]\n\
                 name = \"skull\"\nnodes = \"x_min\"\n[inertia]\nscheme = \"generalised-alpha\"\ndamping_mass = 1.0\n\
                 damping_stiffness = 1e-3\naccuracy = 1e-3\n";
    let mut sim = Sim::new(Arc::new(cutis::load::from_text(scene, None).unwrap().model)).unwrap();
    let translation = sim.model().ports().iter().position(|p| p.name == "bone.translation").unwrap();
    sim.initialise().unwrap();
    let mut clean = 0;
    for k in 1..=20 {
        sim.set_f64(translation, 0, &[1e-4 * f64::from(k), 0.0, 0.0]).unwrap();
        let mut factorisations = 0;
        let counted = allocations(|| factorisations = sim.step(0.01).unwrap().factorisations);
        assert!(factorisations > 0 || counted == 0, "step {k}: {counted} allocations");
        clean += u32::from(factorisations == 0);
    }
    assert!(clean >= 10, "{clean} steps of 20 without a factor");
}

#[test]
fn the_c_library_and_fmi_copy_without_allocation() {
    // SAFETY: handles and buffers of this test, used by one thread, lengths as asked.
    unsafe {
        let sim = capi::cutis_sim_new_default(std::ptr::null_mut(), 0);
        assert_eq!(capi::cutis_sim_initialise(sim), capi::CutisStatus::CUTIS_OK);
        let skin = capi::cutis_port_find(sim, c"skin.position".as_ptr());
        let bones = capi::cutis_port_find(sim, c"bone.translation".as_ptr());
        let mut x = vec![0.0; capi::cutis_port_len(sim, skin)];
        let d = vec![0.0; capi::cutis_port_len(sim, bones)];
        let counted = allocations(|| {
            assert_eq!(capi::cutis_sim_set_f64(sim, bones, d.as_ptr(), d.len()), capi::CutisStatus::CUTIS_OK);
            assert_eq!(capi::cutis_sim_get_f64(sim, skin, x.as_mut_ptr(), x.len()), capi::CutisStatus::CUTIS_OK);
        });
        assert_eq!(counted, 0);
        capi::cutis_sim_free(sim);

        let token = std::ffi::CString::new(cutis::load::embedded().unwrap().model.token()).unwrap();
        use std::ptr::null;
        #[rustfmt::skip]
        let instance = fmi3::fmi3InstantiateCoSimulation(
            c"a".as_ptr(), token.as_ptr(), null(), 0, 0, 0, 0, null(), 0, std::ptr::null_mut(), None, None,
        );
        assert!(!instance.is_null());
        fmi3::fmi3EnterInitializationMode(instance, 0, 0.0, 0.0, 0, 0.0);
        fmi3::fmi3ExitInitializationMode(instance);
        let (bones, skin) = (10_u32, 100_u32);
        let counted = allocations(|| {
            let set = fmi3::fmi3SetFloat64(instance, &raw const bones, 1, d.as_ptr(), d.len());
            let get = fmi3::fmi3GetFloat64(instance, &raw const skin, 1, x.as_mut_ptr(), x.len());
            assert_eq!((set as i32, get as i32), (0, 0));
        });
        assert_eq!(counted, 0);
        let start = std::time::Instant::now();
        for _ in 0..1000 {
            let get = fmi3::fmi3GetFloat64(instance, &raw const skin, 1, x.as_mut_ptr(), x.len());
            assert_eq!(get as i32, 0);
        }
        println!("fmi3GetFloat64 of skin.position ({} values): {:.2} us", x.len(), start.elapsed().as_secs_f64() * 1e3);
        fmi3::fmi3FreeInstance(instance);
    }
}
