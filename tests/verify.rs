//! Is the mathematics right: derivatives, invariants, patch tests, closed forms, well-posedness.
#![allow(non_snake_case)]

#[path = "verify/background.rs"]
mod background;
#[path = "verify/bench.rs"]
mod bench;
#[path = "verify/common.rs"]
mod common;
#[path = "verify/compare.rs"]
mod compare;
#[path = "verify/contact.rs"]
mod contact;
#[path = "verify/declared.rs"]
mod declared;
#[path = "verify/derivatives.rs"]
mod derivatives;
#[path = "verify/elimination.rs"]
mod elimination;
#[path = "verify/embedding.rs"]
mod embedding;
#[path = "verify/golden.rs"]
mod golden;
#[path = "verify/head.rs"]
mod head;
#[path = "verify/invariants.rs"]
mod invariants;
#[path = "verify/iterative.rs"]
mod iterative;
#[path = "verify/linear_map.rs"]
mod linear_map;
#[path = "verify/loads.rs"]
mod loads;
#[path = "verify/locking.rs"]
mod locking;
#[path = "verify/mms.rs"]
mod mms;
#[path = "verify/modal.rs"]
mod modal;
#[path = "verify/patch.rs"]
mod patch;
#[path = "verify/rigid.rs"]
mod rigid;
#[path = "verify/scenes.rs"]
mod scenes;
#[path = "verify/sensitivity.rs"]
mod sensitivity;
#[path = "verify/soundness.rs"]
mod soundness;
#[path = "verify/sphere.rs"]
mod sphere;
#[path = "verify/study.rs"]
mod study;
#[path = "verify/threads.rs"]
mod threads;
#[path = "verify/time.rs"]
mod time;
#[path = "verify/tissue.rs"]
mod tissue;
#[path = "verify/tunable.rs"]
mod tunable;
#[path = "verify/viscous.rs"]
mod viscous;
#[path = "verify/watch.rs"]
mod watch;
