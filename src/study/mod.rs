//! Studies of the solver. Not part of the shipped library (feature `study`).

pub mod body_setup;
pub mod verification;
pub mod accuracy;
pub mod hard_cases;
