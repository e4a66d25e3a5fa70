//! The studies of `swarf` with feature `study`: `cargo xtask verify`, `accuracy` and `validate`.

use std::path::Path;

use crate::{Outcome, process, target};

/// Runs `swarf verify` into `target/verify`, or the folder after `--out`.
///
/// # Errors
/// A failed build, or files that cannot be written. A criterion that is not met is no error: it stands in the table.
pub fn run(arguments: &[&str]) -> Outcome {
    let out = match arguments {
        [] => target().join("verify"),
        ["--out", folder] => folder.into(),
        other => return Err(format!("verify: unknown arguments '{}'; it takes --out DIR", other.join(" "))),
    };
    swarf("verify", &out, &[])
}

/// Runs a study into `target/NAME`, or the folder after `--out`; a study that was ended goes on where it was.
///
/// # Errors
/// A failed build, or files that cannot be written. A run that fails is no error: it stands in the table.
pub fn study(name: &str, arguments: &[&str]) -> Outcome {
    let (mut out, mut rest) = (target().join(name), Vec::new());
    if arguments.contains(&"--quick") {
        out = target().join(format!("{name}-quick"));
    }
    let mut words = arguments.iter();
    while let Some(word) = words.next() {
        match *word {
            "--out" => out = words.next().ok_or("--out needs a folder")?.into(),
            other => rest.push(other),
        }
    }
    swarf(name, &out, &rest)
}

/// Runs a command of `swarf` with feature `study`, its files in a folder.
///
/// # Errors
/// A failed build or command.
pub fn swarf(name: &str, out: &Path, rest: &[&str]) -> Outcome {
    let mut command = process::cargo(&["run", "--release", "--package", "swarf", "--bin", "swarf"]);
    // The kernels as they are shipped: what a run costs is part of what the studies tell.
    command.args(["--features", "study", "--", name, "--out"]);
    command.arg(std::path::absolute(out).map_err(|e| e.to_string())?).args(rest);
    process::run(&mut command)
}
