//! `swarf-master FMU [options]`: one cut through the packaged FMU.

use std::process::ExitCode;

use swarf_master::options::Options;
use swarf_master::run::{Ending, estimate, run};
use swarf_master::{messages, report};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    messages::install();
    let outcome = Options::read(&arguments).and_then(|options| {
        if options.estimate {
            return estimate(&options).map(|()| ExitCode::SUCCESS);
        }
        let cut = run(&options)?;
        if let Ending::Interrupted = cut.ending {
            return Ok(ExitCode::from(130));
        }
        report::write(&options, &cut)?;
        if let Ending::Failed(text) = &cut.ending {
            return Err(text.clone());
        }
        Ok(ExitCode::SUCCESS)
    });
    outcome.unwrap_or_else(|text| {
        eprintln!("swarf-master: {text}");
        ExitCode::FAILURE
    })
}
