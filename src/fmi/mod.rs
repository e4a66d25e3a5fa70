//! The FMI 2.0 co-simulation skin: description, safe instance with its state machine, and the C functions.
//!
//! * `abi`: the exported functions; pointers and nothing else;
//! * `instance`: the life of an instance, `values`: its variables, `states`: its FMU states, `steps`: what a
//!   step may be;
//! * `calls`: which function may be called when, `state`: where in that order an instance stands,
//!   `refusal`: why not now;
//! * `saved`: the model of an instance and its bytes;
//! * `description`: modelDescription.xml, made from the table of `variables`, and its GUID;
//! * `logging`, `progress`, `resources`: messages, how far a long step is, the folder that came with the
//!   FMU.
//!
//! What may be touched: a variable is an entry in `variables` and appears nowhere here; a new field of
//! `saved::Header` needs a new format number there and a line in its check. Physics has no place here.

pub mod abi;
pub mod calls;
pub mod description;
mod instance;
pub mod logging;
mod progress;
mod refusal;
mod resources;
mod saved;
mod state;
mod states;
mod steps;
mod values;
