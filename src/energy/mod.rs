//! Where the energy goes, and the watch that stops a run which makes some.
//!
//! [`ledger`] books every term from what it names, none as a remainder; what is left over is the error of the
//! balance. [`watch`] looks at the energy of all points now and then. A new way to lose or gain energy gets
//! an entry of its own in `Ledger`, and a term in `Ledger::imbalance`.

pub mod ledger;
pub mod watch;
