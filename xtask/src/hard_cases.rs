//! `cargo xtask hard-cases`: the hard cases in full, and the random scenes.

use crate::test::tests;
use crate::{Outcome, process, setup, target, verify};

/// Random scenes of the full form.
const SCENES: &str = "2000";

/// Runs the cases into `target/hard-cases`, or `target/hard-cases-short`; those named, or all and the random scenes.
///
/// # Errors
/// A failed build, random scenes that broke a promise, or files that cannot be written. A case that fails is no error: it
/// stands in the table.
pub fn run(arguments: &[&str]) -> Outcome {
    let is_short = arguments.contains(&"--short");
    let cases: Vec<&str> = arguments.iter().copied().filter(|word| !word.starts_with("--")).collect();
    if let Some(other) = arguments.iter().find(|word| word.starts_with("--") && **word != "--short") {
        return Err(format!("hard-cases: unknown argument '{other}'; it takes --short and cases"));
    }
    let out = target().join(if is_short { "hard-cases-short" } else { "hard-cases" });
    let mut rest = cases.clone();
    if is_short {
        rest.insert(0, "--short");
    }
    verify::swarf("hard-cases", &out, &rest)?;
    if cases.is_empty() {
        let tools = setup::prepare()?;
        let mut command = tests()?;
        command.args(["--test", "random_scenes"]);
        if !is_short {
            command.env("PROPTEST_CASES", SCENES);
        }
        process::run(tools.apply(&mut command))?;
    }
    Ok(())
}
