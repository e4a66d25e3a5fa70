//! Set-up and the project's commands.
fn main() {}
