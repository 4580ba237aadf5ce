//! The effects a scene can name, one a file. Each becomes a term of the energy; a missing effect is a missing term.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod contact;
mod damage;
mod fibre;
mod graded;
mod gravity;
mod inertia;
mod limit;
mod load;
mod muscle;
mod nodal_pressure;
mod pressure;
mod prestress;
mod rayleigh;
mod shape;
mod springs;
mod tissue;
mod tuned;
mod viscous;

pub use contact::{Contact, Friction};
pub use damage::{Damaged, Softening};
pub use fibre::Fibre;
pub use graded::Graded;
pub use gravity::Gravity;
pub use inertia::{Inertia, lumped_masses};
pub use limit::Limits;
pub use load::DeadLoad;
pub use muscle::{Muscle, nearest_on_path};
pub use nodal_pressure::{NodalPressure, Volume};
pub use pressure::Pressure;
pub use prestress::{Balance, Prestress};
pub use rayleigh::{damping_memory, stiffness_damping};
pub use shape::{Distance, Shape};
pub use springs::{Spring, Springs, springs};
pub use tissue::{Branches, Elements, LAWS, Law, law};
pub use tuned::{Tuned, Tuning};
pub use viscous::{Measure, Viscous};

use crate::math::Vec3;

/// Three consecutive inputs as a vector.
fn input3(inputs: &[f64], first: usize) -> Vec3 {
    Vec3::new(inputs[first], inputs[first + 1], inputs[first + 2])
}
