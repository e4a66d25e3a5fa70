//! Running other programs, with errors that name the command.

use std::io::IsTerminal;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

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

/// Time between two lines of a build that takes long.
const NEWS: Duration = Duration::from_secs(30);

/// Runs a command that may compile the kernels, which takes minutes: tells on the way that it still does.
pub fn compile(command: &mut Command) -> Outcome {
    let (running, ended) = channel::<()>();
    let begin = Instant::now();
    std::thread::scope(|scope| {
        let news = scope.spawn(move || tell_until(&ended, NEWS, || say(&still_compiling(begin.elapsed()))));
        let outcome = run(command);
        drop(running);
        // It can only have ended.
        let _ = news.join();
        outcome
    })
}

/// Tells something after every period, until the other end of the channel is dropped.
fn tell_until(ended: &Receiver<()>, period: Duration, mut tell: impl FnMut()) {
    while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(period) {
        tell();
    }
}

/// The news of a build.
fn still_compiling(gone: Duration) -> String {
    let seconds = gone.as_secs();
    let gone = if seconds < 60 {
        format!("{seconds} s")
    } else {
        format!("{} min {} s", seconds / 60, seconds % 60)
    };
    format!("xtask: still compiling, {gone} so far; the solver's kernels take minutes where they are new")
}

/// A line on the terminal, in place of the bar that cargo may have there.
fn say(line: &str) {
    let clear = if std::io::stderr().is_terminal() { "\r\x1b[K" } else { "" };
    eprintln!("{clear}{line}");
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A build of minutes shows that it lives, and is silent once it has ended, however often it spoke
    /// before.
    #[test]
    fn a_long_command_tells_that_it_goes_on() {
        let (running, ended) = channel::<()>();
        let mut lines = 0;
        let mut running = Some(running);
        tell_until(&ended, Duration::from_millis(1), || {
            lines += 1;
            if lines == 3 {
                running = None;
            }
        });
        assert_eq!(lines, 3);
        let text = still_compiling(Duration::from_secs(90));
        assert!(text.contains("1 min 30 s so far") && text.len() <= 110, "{text}");
        assert!(still_compiling(Duration::from_secs(30)).contains(" 30 s so far"));
    }

    /// News do not change how a command ends.
    #[test]
    fn a_compilation_that_fails_is_told_as_such() {
        assert!(compile(Command::new("rustc").arg("--version").stdout(Stdio::null())).is_ok());
        let error = compile(&mut Command::new("no-such-compiler")).unwrap_err();
        assert!(error.contains("no-such-compiler"), "{error}");
    }
}
