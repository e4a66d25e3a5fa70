//! The embedded master.
fn main() {}
