//! The embedded master: runs swarf.fmu through the `fmi` crate and reports what came out.

pub mod arguments;
pub mod description;
pub mod fmu;
pub mod history;
pub mod messages;
pub mod options;
pub mod report;
pub mod run;
pub mod units;

pub use fmu::{Fmu, Instance, Step};
