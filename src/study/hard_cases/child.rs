//! What hard cases let another process do: `swarf hard-cases --child …`.

use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Stdio};

/// The command that does `words` in another process.
pub fn command<const N: usize>(program: &Path, words: [OsString; N]) -> Command {
    let mut command = Command::new(program);
    command.args(["hard-cases", "--child"]).args(words).stdin(Stdio::null());
    command
}
