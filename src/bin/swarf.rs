//! Command line of the project: prints what is generated from the variable table; runs the studies where they are built in.

use std::process::ExitCode;

const HELP: &str = "\
usage: swarf COMMAND

  describe    print modelDescription.xml
  variables   print the table of all variables in Markdown
  version     print the version
  verify --out DIR
              run the problems with exact solutions, write table and plots (with feature `study`)
  accuracy --out DIR [--quick] [--threads N] [--report]
              run the work-precision study, or what is left of it (with feature `study`)
  validate --out DIR [--quick] [--threads N] [--report]
              compare with measured cuts and with the shear plane (with feature `study`)
  hard-cases --out DIR [--short] [CASE]...
              run the hard cases, or those of these numbers or names, and write a table (with feature `study`)";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["describe"] => print!("{}", swarf::fmi::description::xml()),
        ["variables"] => print!("{}", swarf::variables::markdown_table()),
        ["version" | "--version"] => println!("swarf {}", swarf::VERSION),
        #[cfg(feature = "study")]
        ["verify", "--out", folder] => return verify(folder.as_ref()),
        #[cfg(feature = "study")]
        ["accuracy", "--out", folder, rest @ ..] => return accuracy(folder.as_ref(), rest),
        #[cfg(feature = "study")]
        ["validate", "--out", folder, rest @ ..] => return validate(folder.as_ref(), rest),
        #[cfg(feature = "study")]
        ["hard-cases", "--child", rest @ ..] => {
            return done(swarf::study::hard_cases::table::run_child(rest));
        }
        #[cfg(feature = "study")]
        ["hard-cases", "--out", folder, rest @ ..] => return hard_cases(folder.as_ref(), rest),
        ["help" | "--help" | "-h"] => println!("{HELP}"),
        [] => {
            eprintln!("{HELP}");
            return ExitCode::from(2);
        }
        [command, ..] => {
            eprintln!("swarf: '{command}' with these arguments is not a command\n\n{HELP}");
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}

/// Runs all problems with exact solutions, writes what they give into a folder and prints the table.
#[cfg(feature = "study")]
fn verify(folder: &std::path::Path) -> ExitCode {
    let report = swarf::study::verification::verify(|name, seconds| println!("{name}: {seconds:.1} s"));
    println!("\n{}", report.markdown());
    let unmet = report.findings.iter().filter(|finding| finding.is_met() == Some(false)).count();
    println!(
        "{unmet} of {} figures miss their criterion; files are in {}",
        report.findings.len(),
        folder.display()
    );
    match report.write(folder) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("swarf: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the work–precision study, two runs at a time unless told otherwise, and prints its tables.
#[cfg(feature = "study")]
fn accuracy(folder: &std::path::Path, words: &[&str]) -> ExitCode {
    match study_options(words) {
        Ok(options) => finish(swarf::study::accuracy::study(folder, options, &|text| println!("{text}"))),
        Err(code) => code,
    }
}

/// Compares with measured cuts, and prints the tables.
#[cfg(feature = "study")]
fn validate(folder: &std::path::Path, words: &[&str]) -> ExitCode {
    match study_options(words) {
        Ok(options) => {
            finish(swarf::study::accuracy::validation::study(folder, options, &|text| println!("{text}")))
        }
        Err(code) => code,
    }
}

/// Runs hard cases, writes their table into a folder and prints it.
#[cfg(feature = "study")]
fn hard_cases(folder: &std::path::Path, words: &[&str]) -> ExitCode {
    use swarf::study::hard_cases::{Form, Setting, table};
    let is_short = words.contains(&"--short");
    let keys: Vec<&str> = words.iter().copied().filter(|word| *word != "--short").collect();
    let form = if is_short { Form::Short } else { Form::Full };
    let outcome =
        std::env::current_exe().map_err(|e| format!("this program does not know where it is: {e}")).and_then(
            |program| table::run(&Setting { form, program }, &keys, folder, &|line| println!("{line}")),
        );
    done(outcome.map(|table| println!("\n{table}")))
}

/// Says what went wrong, if anything did.
#[cfg(feature = "study")]
fn done(outcome: Result<(), String>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(text) => {
            eprintln!("swarf: {text}");
            ExitCode::FAILURE
        }
    }
}

/// What stands behind a study's name.
#[cfg(feature = "study")]
fn study_options(words: &[&str]) -> Result<swarf::study::accuracy::Options, ExitCode> {
    let mut options = swarf::study::accuracy::Options { is_quick: false, threads: 2, runs: true };
    let mut words = words.iter();
    while let Some(word) = words.next() {
        let number = || words.clone().next().and_then(|text| text.parse().ok()).filter(|n| *n > 0);
        match (*word, number()) {
            ("--quick", _) => options.is_quick = true,
            ("--report", _) => options.runs = false,
            ("--threads", Some(threads)) => {
                options.threads = threads;
                words.next();
            }
            _ => {
                eprintln!("swarf: a study takes --quick, --threads N (from 1) and --report, not '{word}'");
                return Err(ExitCode::from(2));
            }
        }
    }
    Ok(options)
}

/// Prints a study's tables, or what went wrong.
#[cfg(feature = "study")]
fn finish(outcome: Result<String, swarf::Error>) -> ExitCode {
    match outcome {
        Ok(text) => {
            println!("\n{text}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("swarf: {error}");
            ExitCode::FAILURE
        }
    }
}
