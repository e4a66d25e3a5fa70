//! `cargo xtask wheel`: the Python package in `python/` as a wheel that carries the packaged FMU.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{Outcome, package, process, root, setup};

/// What `cargo xtask wheel` can be told.
#[derive(clap::Args)]
#[group(skip)] // both are called Arguments
pub struct Arguments {
    #[command(flatten)]
    package: package::Arguments,
    /// Take target/swarf.fmu as it is, without building it
    #[arg(long, conflicts_with_all = ["portable", "windows", "with"])]
    packaged: bool,
    /// Install the wheel with all its extras into an environment of its own, and run its tests there
    #[arg(long)]
    test: bool,
}

/// Packages the FMU, builds the wheel into `python/dist`, and tests it where that is asked for.
///
/// # Errors
/// What the package's build or its tests say.
pub fn run(arguments: &Arguments) -> Outcome {
    if !arguments.packaged {
        package::run(&arguments.package)?;
    }
    let python = setup::prepare()?.python;
    let dist = root().join("python/dist");
    let before = wheels(&dist);
    for old in &before {
        std::fs::remove_file(old).map_err(|e| format!("cannot remove '{}': {e}", old.display()))?;
    }
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps", "--wheel-dir"]);
    pip.arg(&dist).arg(root().join("python")).env("SWARF_FMU", root().join("target/swarf.fmu"));
    process::run_quietly(&mut pip)?;
    let built = wheels(&dist);
    let [wheel] = built.as_slice() else {
        return Err(format!("'{}' should hold one wheel, not {}", dist.display(), built.len()));
    };
    println!("xtask: built {}", wheel.display());
    if arguments.test { test(&python, wheel) } else { Ok(()) }
}

/// Installs a wheel into an empty environment and runs the package's tests with it, outside of the sources.
fn test(python: &PathBuf, wheel: &Path) -> Outcome {
    let environment = root().join("target/wheel-test");
    let run = |program: &PathBuf, words: &[&str]| {
        process::run(Command::new(program).args(words).current_dir(root().join("python/tests")))
    };
    let place = environment.display().to_string();
    run(python, &["-m", "venv", "--clear", &place])?;
    let inside = if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" };
    let inside = environment.join(inside);
    let asked = format!("swarf[all,test] @ file://{}", wheel.display());
    run(&inside, &["-m", "pip", "install", "--quiet", "--disable-pip-version-check", &asked])?;
    run(&inside, &["-m", "pytest", "-p", "no:cacheprovider", "--durations=5", "."])
}

fn wheels(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    entries.filter(|path| path.extension().is_some_and(|ending| ending == "whl")).collect()
}
