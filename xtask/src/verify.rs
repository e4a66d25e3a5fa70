//! The studies of `swarf` with feature `study`: `cargo xtask verify`, `accuracy` and `validate`.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use crate::{Outcome, process, target};

/// What `cargo xtask verify` can be told.
#[derive(clap::Args)]
pub struct Arguments {
    /// Folder for everything written [default: target/verify]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// What a study can be told.
#[derive(clap::Args)]
pub struct Study {
    /// Seconds, figures without meaning
    #[arg(long)]
    quick: bool,
    /// Runs at a time [default: 2]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Only the tables, from the runs that are there
    #[arg(long)]
    report: bool,
    /// Folder for everything written [default: target/NAME, or NAME-quick]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs `swarf verify` into `target/verify`, or the folder named.
///
/// # Errors
/// A failed build, or files that cannot be written. A criterion that is not met is no error: it stands in the
/// table.
pub fn run(arguments: &Arguments) -> Outcome {
    let out = arguments.out.clone().unwrap_or_else(|| target().join("verify"));
    swarf("verify", &out, &[])
}

/// Runs a study into `target/NAME`, or the folder named; a study that was ended goes on where it was.
///
/// # Errors
/// A failed build, or files that cannot be written. A run that fails is no error: it stands in the table.
pub fn study(name: &str, study: &Study) -> Outcome {
    let folder = if study.quick { format!("{name}-quick") } else { name.into() };
    let out = study.out.clone().unwrap_or_else(|| target().join(folder));
    let flags = [("--quick", study.quick), ("--report", study.report)];
    let mut words: Vec<&str> = flags.into_iter().filter(|flag| flag.1).map(|flag| flag.0).collect();
    let threads = study.threads.map(|threads| threads.to_string());
    words.extend(threads.iter().flat_map(|threads| ["--threads", threads]));
    swarf(name, &out, &words)
}

/// Runs a command of `swarf` with feature `study`, its files in a folder.
///
/// # Errors
/// A failed build or command.
pub fn swarf(name: &str, out: &Path, rest: &[&str]) -> Outcome {
    // The kernels as they are shipped: what a run costs is part of what the studies tell.
    let program = ["--release", "--package", "swarf", "--bin", "swarf", "--features", "study"];
    process::compile(process::cargo(&["build"]).args(program))?;
    let mut command = process::cargo(&["run", "--quiet"]);
    command.args(program).args(["--", name, "--out"]);
    command.arg(std::path::absolute(out).map_err(|e| e.to_string())?).args(rest);
    process::run(&mut command)
}
