//! Running other programs, with errors that name the command.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::{Outcome, root};

/// A cargo command in the repository's folder.
pub fn cargo(arguments: &[&str]) -> Command {
    let mut command =
        in_repository(Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())));
    command.args(arguments);
    command
}

/// Lets a command that is cargo, or runs it, work in the repository's folder.
pub fn in_repository(mut command: Command) -> Command {
    command.current_dir(root());
    // Set for this program by `cargo run`; other packages must not see them.
    for name in ["CARGO_MANIFEST_DIR", "CARGO_MANIFEST_PATH", "CARGO_PKG_NAME", "CARGO_PKG_VERSION"] {
        command.env_remove(name);
    }
    command
}

/// Runs a command to its end, its output on the terminal.
pub fn run(command: &mut Command) -> Outcome {
    let status = command.status().map_err(|e| format!("cannot start '{}': {e}", shown(command)))?;
    if status.success() { Ok(()) } else { Err(format!("'{}' failed ({status})", shown(command))) }
}

/// Runs a command and gives what it printed; its messages go to the terminal.
pub fn output(command: &mut Command) -> Outcome<String> {
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .map_err(|e| format!("cannot start '{}': {e}", shown(command)))?;
    if !output.status.success() {
        return Err(format!("'{}' failed ({})", shown(command), output.status));
    }
    String::from_utf8(output.stdout).map_err(|_| format!("'{}' printed no text", shown(command)))
}

/// Runs a command with its output kept, and gives it only in case of failure.
pub fn run_quietly(command: &mut Command) -> Outcome {
    let output = command.output().map_err(|e| format!("cannot start '{}': {e}", shown(command)))?;
    if output.status.success() {
        return Ok(());
    }
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8_lossy(&text);
    let lines: Vec<&str> = text.lines().rev().take(12).collect();
    let tail: Vec<&str> = lines.into_iter().rev().collect();
    Err(format!("'{}' failed ({}):\n{}", shown(command), output.status, tail.join("\n")))
}

/// Ends this program by becoming another, so that Ctrl-C reaches that one alone.
#[cfg(unix)]
pub fn become_it(mut command: Command) -> Outcome {
    use std::os::unix::process::CommandExt;
    let error = command.exec();
    Err(format!("cannot start '{}': {error}", shown(&command)))
}

/// Runs another program to its end.
#[cfg(not(unix))]
pub fn become_it(mut command: Command) -> Outcome {
    run(&mut command)
}

/// Reads a text file, or says which one is missing.
pub fn read(path: &Path) -> Outcome<String> {
    std::fs::read_to_string(path).map_err(|e| format!("cannot read '{}': {e}", path.display()))
}

/// Writes a file, and the folders above it.
pub fn write(path: &Path, bytes: &[u8]) -> Outcome {
    let folder = path.parent().map_or(Ok(()), std::fs::create_dir_all);
    folder
        .and_then(|()| std::fs::write(path, bytes))
        .map_err(|e| format!("cannot write '{}': {e}", path.display()))
}

/// Lets a file be started.
pub fn make_executable(path: &Path) -> Outcome {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let permissions = std::fs::Permissions::from_mode(0o755);
        let done = std::fs::set_permissions(path, permissions);
        done.map_err(|e| format!("cannot make '{}' executable: {e}", path.display()))?;
    }
    #[cfg(not(unix))]
    let _ = path;
    Ok(())
}

fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}
