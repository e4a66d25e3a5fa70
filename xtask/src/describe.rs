//! The model description, written from the one table of variables in the crate.

use std::process::Command;

use crate::{Outcome, process, root, test};

/// Whether a text is written or looked at.
#[derive(clap::Args)]
pub struct Arguments {
    /// Fail where it is stale, and write nothing
    #[arg(long)]
    pub check: bool,
}

/// Writes `modelDescription/modelDescription.xml`, or checks that it is what would be written.
pub fn description(check: bool) -> Outcome {
    description_by(swarf, check)
}

fn description_by(program: fn(&str) -> Outcome<String>, check: bool) -> Outcome {
    let path = root().join("modelDescription/modelDescription.xml");
    settle(&path, &program("describe")?, check, "describe")
}

/// Checks it by the program that the tests have just built.
pub fn check_built() -> Outcome {
    let built = |subcommand: &str| {
        process::output(Command::new(test::folder().join("release/swarf")).arg(subcommand))
    };
    description_by(built, true)
}

fn settle(path: &std::path::Path, text: &str, check: bool, command: &str) -> Outcome {
    let is_current = std::fs::read_to_string(path).is_ok_and(|old| old == text);
    match (is_current, check) {
        (true, _) => {
            println!("xtask: {} is up to date", path.display());
            Ok(())
        }
        (false, true) => {
            Err(format!("{} is stale: run `cargo xtask {command}` and commit it", path.display()))
        }
        (false, false) => {
            process::write(path, text.as_bytes())?;
            println!("xtask: wrote {}", path.display());
            Ok(())
        }
    }
}

/// What the program prints for a subcommand; built without the kernels, which say nothing of variables.
fn swarf(subcommand: &str) -> Outcome<String> {
    let program = ["run", "--quiet", "--package", "swarf", "--bin", "swarf"];
    let mut command = process::cargo(&program);
    process::output(command.args(["--no-default-features", "--features", "cli", "--", subcommand]))
}
