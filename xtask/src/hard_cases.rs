//! `cargo xtask hard-cases`: the hard cases in full, and the random scenes.

use crate::test::tests;
use crate::{Outcome, process, setup, target, verify};

/// Random scenes of the full form.
const SCENES: &str = "2000";

/// Which cases are run, and how.
#[derive(clap::Args)]
pub struct Arguments {
    /// Cases by number or name, without the random scenes; all and the random scenes if there is none
    #[arg(value_name = "CASE")]
    cases: Vec<String>,
    /// As in the tests, seconds each
    #[arg(long)]
    short: bool,
}

/// Runs the cases into `target/hard-cases`, or `target/hard-cases-short`; those named, or all and the random
/// scenes.
///
/// # Errors
/// A failed build, random scenes that broke a promise, or files that cannot be written. A case that fails is
/// no error: it stands in the table.
pub fn run(arguments: &Arguments) -> Outcome {
    let is_short = arguments.short;
    let out = target().join(if is_short { "hard-cases-short" } else { "hard-cases" });
    let mut rest: Vec<&str> = arguments.cases.iter().map(String::as_str).collect();
    if is_short {
        rest.insert(0, "--short");
    }
    verify::swarf("hard-cases", &out, &rest)?;
    if arguments.cases.is_empty() {
        let tools = setup::prepare()?;
        process::compile(tools.apply(tests()?.args(["--test", "random_scenes", "--no-run"])))?;
        let mut command = tests()?;
        command.args(["--test", "random_scenes"]);
        if !is_short {
            command.env("PROPTEST_CASES", SCENES);
        }
        process::run(tools.apply(&mut command))?;
    }
    Ok(())
}
