//! Studies of the solver. Not part of the shipped library (feature `study`).
//!
//! Problems with exact solutions (`verification`), the work-precision study and validation (`accuracy`),
//! hard cases (`hard_cases`) and the bodies they are made of (`body_setup`). Not part of the shipped
//! library.
//!
//! What may be touched: a problem is a file with its solution, its run and its findings, named in its room's
//! list; a criterion that is not met stays in the table with the figure reached and the reason.

pub mod body_setup;
pub mod verification;
pub mod accuracy;
pub mod hard_cases;
