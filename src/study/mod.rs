//! Studies of the solver. Not part of the shipped library (feature `study`).

pub mod verification;
pub mod accuracy;
pub mod hard_cases;
