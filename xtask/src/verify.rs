//! `cargo xtask verify`: the problems with exact solutions in full, with a table and plots.

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
    let mut command = process::cargo(&["run", "--release", "--package", "swarf", "--bin", "swarf"]);
    // Linked quickly: the kernels are compiled whole in any case.
    command.args(["--features", "study", "--config", "profile.release.lto=\"off\""]);
    command.args(["--config", "profile.release.codegen-units=16", "--", "verify", "--out"]);
    process::run(command.arg(std::path::absolute(out).map_err(|e| e.to_string())?))
}
