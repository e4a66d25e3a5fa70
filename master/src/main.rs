//! `swarf-master FMU [options]`: one cut through the packaged FMU.

use std::process::ExitCode;

use clap::Parser;
use swarf_master::options::{CommandLine, Options};
use swarf_master::run::{Ending, estimate, run_with_twin};
use swarf_master::{messages, report};

fn main() -> ExitCode {
    let line = CommandLine::parse();
    messages::install();
    let outcome = Options::of(line).and_then(|options| {
        if options.estimate {
            return estimate(&options).map(|()| ExitCode::SUCCESS);
        }
        let (cut, twin) = run_with_twin(&options)?;
        report::write(&options, &cut, twin.as_ref())?;
        match cut.ending {
            Ending::Complete => Ok(ExitCode::SUCCESS),
            // What a shell gives a program that Ctrl-C ended.
            Ending::Interrupted => Ok(ExitCode::from(130)),
            Ending::Failed(text) => Err(text),
        }
    });
    outcome.unwrap_or_else(|text| {
        eprintln!("swarf-master: {text}");
        ExitCode::FAILURE
    })
}
