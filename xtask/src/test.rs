//! `cargo xtask test`: every check of the project, all run even where one fails, with the time each took.

use std::path::PathBuf;
use std::process::Command;
use std::time::Instant;

use crate::setup::Tools;
use crate::{Outcome, aarch64, book, describe, package, process, root, setup, target};

/// Runs all stages.
///
/// # Errors
/// Names the stages that failed.
pub fn run() -> Outcome {
    let mut stages = Stages::default();
    stages.run("formatting", || process::run(&mut process::cargo(&["fmt", "--all", "--", "--check"])));
    let tools = stages.run("set-up", setup::prepare);
    stages.run("clippy", || {
        let arguments =
            ["clippy", "--workspace", "--all-targets", "--features", "swarf/plot", "--", "-D", "warnings"];
        process::run(ready(&tools)?.apply(&mut process::cargo(&arguments)))
    });
    stages.run("check for aarch64", aarch64::check);
    let built = stages.run("build", || process::compile(ready(&tools)?.apply(tests()?.arg("--no-run"))));
    let fmu = stages.run("package", || {
        built.ok_or("nothing was built")?;
        package::build_tested()
    });
    stages.run("unit and integration tests", || {
        fmu.as_ref().ok_or("no FMU was packaged")?;
        process::run(ready(&tools)?.apply(tests()?.arg("--no-fail-fast")))
    });
    // By the program that the tests have just built.
    stages.run("generated texts", || describe::check_built().and_then(|()| book::check()));
    stages.run("FMU through FMPy", || {
        fmu.as_ref().ok_or("no FMU was packaged")?;
        let mut command = Command::new(&ready(&tools)?.python);
        command.current_dir(root()).args([
            "-m",
            "pytest",
            "-p",
            "no:cacheprovider",
            "--durations=5",
            "fmpy_tests",
        ]);
        process::run(command.env("PYTHONDONTWRITEBYTECODE", "1"))
    });
    stages.report()
}

/// `cargo test` for all packages at once, since another choice of packages would build the library with all
/// its kernels anew; arguments can be added.
///
/// Optimised as what ships, so that the FMU of the tests is linked from the same build, in a folder of its
/// own: a library that was built otherwise would take the place of this one.
pub fn tests() -> Outcome<Command> {
    let mut command = process::cargo(&["test", "--release", "--features", "swarf/study"]);
    for package in ["swarf", "xtask", "swarf-master"] {
        command.args(["--package", package]);
    }
    command.arg("--target-dir").arg(folder());
    package::map_paths(&mut command)?;
    Ok(command)
}

/// What the tests are built in.
pub fn folder() -> PathBuf {
    target().join("tests")
}

fn ready(tools: &Option<Tools>) -> Outcome<&Tools> {
    tools.as_ref().ok_or_else(|| "the set-up failed".into())
}

/// What ran, for how long, and how it ended.
#[derive(Default)]
struct Stages(Vec<(&'static str, f64, Option<String>)>);

impl Stages {
    fn run<T>(&mut self, name: &'static str, work: impl FnOnce() -> Outcome<T>) -> Option<T> {
        println!("\n== {name}");
        let begin = Instant::now();
        let outcome = work();
        let seconds = begin.elapsed().as_secs_f64();
        let (value, failure) = match outcome {
            Ok(value) => (Some(value), None),
            Err(text) => {
                eprintln!("xtask: {text}");
                (None, Some(text))
            }
        };
        self.0.push((name, seconds, failure));
        value
    }

    fn report(&self) -> Outcome {
        println!("\n== stages");
        for (name, seconds, failure) in &self.0 {
            println!("{:<28} {seconds:7.1} s  {}", name, if failure.is_some() { "FAILED" } else { "ok" });
        }
        println!("{:<28} {:7.1} s", "all", self.0.iter().map(|stage| stage.1).sum::<f64>());
        let failed: Vec<&str> =
            self.0.iter().filter(|stage| stage.2.is_some()).map(|stage| stage.0).collect();
        if failed.is_empty() { Ok(()) } else { Err(format!("failed: {}", failed.join(", "))) }
    }
}
