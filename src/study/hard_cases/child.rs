//! What hard cases let another process do: `swarf hard-cases --child …`.

use super::{endurance, interrupted};
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Stdio};

/// The command that does `words` in another process.
pub fn command<const N: usize>(program: &Path, words: [OsString; N]) -> Command {
    let mut command = Command::new(program);
    command.args(["hard-cases", "--child"]).args(words).stdin(Stdio::null());
    command
}

/// Does what the words ask for, in the other process.
///
/// # Errors
/// What went wrong, as text.
pub fn run(words: &[&str]) -> Result<(), String> {
    let number = |text: &str| text.parse().map_err(|_| format!("'{text}' is no number of a step"));
    match *words {
        ["replay", state, from, to, out] => endurance::replay(state, number(from)?, number(to)?, out),
        ["instances", rounds] => endurance::hold_instances(
            rounds.parse().map_err(|_| format!("'{rounds}' is no number of turns"))?,
        ),
        ["cut", folder] => interrupted::write_cut(folder.as_ref(), 1e-5).map_err(|e| e.to_string()),
        _ => Err(format!("no such part of a hard case: '{}'", words.join(" "))),
    }
}
