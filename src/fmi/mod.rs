//! The FMI 2.0 co-simulation skin: description, safe instance with its state machine, and the C functions.

pub mod abi;
pub mod calls;
pub mod description;
pub mod instance;
pub mod logging;
mod progress;
pub mod refusal;
pub mod resources;
pub mod saved;
mod state;
mod states;
mod steps;
mod values;
