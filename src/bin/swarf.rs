//! Command line of the project: prints what is generated from the variable table; runs the studies where they
//! are built in.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
#[cfg(feature = "study")]
use std::path::{Path, PathBuf};

/// Texts that are generated from the variable table, and studies
#[derive(Parser)]
#[command(name = "swarf", version = swarf::VERSION, after_help = STUDIES)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

/// What help says of the studies.
const STUDIES: &str = if cfg!(feature = "study") {
    ""
} else {
    "verify, accuracy, validate and hard-cases are there where the program is built with feature `study`."
};

#[derive(Subcommand)]
enum Command {
    /// Print modelDescription.xml
    Describe,
    /// Print the version
    Version,
    /// Run the problems with exact solutions, write table and plots
    #[cfg(feature = "study")]
    Verify {
        /// Folder for everything written
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Run the work-precision study, or what is left of it
    #[cfg(feature = "study")]
    Accuracy(Study),
    /// Compare with measured cuts and with the shear plane
    #[cfg(feature = "study")]
    Validate(Study),
    /// Run the hard cases and write a table
    #[cfg(feature = "study")]
    HardCases(HardCases),
}

/// What a study can be told.
#[cfg(feature = "study")]
#[derive(clap::Args)]
struct Study {
    /// Folder for everything written; what is there from a run that was ended is not run again
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seconds, figures without meaning
    #[arg(long)]
    quick: bool,
    /// Runs at a time
    #[arg(long, value_name = "N", default_value = "2")]
    threads: std::num::NonZeroUsize,
    /// Only the tables, from the runs that are there
    #[arg(long)]
    report: bool,
}

/// Which hard cases are run, and how.
#[cfg(feature = "study")]
#[derive(clap::Args)]
struct HardCases {
    /// Cases by number or name; all if there is none
    #[arg(value_name = "CASE")]
    cases: Vec<String>,
    /// Folder for everything written
    #[arg(long, value_name = "DIR", required_unless_present = "child")]
    out: Option<PathBuf>,
    /// As in the tests, seconds each
    #[arg(long)]
    short: bool,
    /// What a case lets another process do.
    #[arg(long, hide = true, num_args = 0.., allow_hyphen_values = true, exclusive = true)]
    child: Option<Vec<String>>,
}

fn main() -> ExitCode {
    match CommandLine::parse().command {
        Command::Describe => print!("{}", swarf::fmi::description::xml()),
        Command::Version => println!("swarf {}", swarf::VERSION),
        #[cfg(feature = "study")]
        Command::Verify { out } => return verify(&out),
        #[cfg(feature = "study")]
        Command::Accuracy(study) => {
            let done = swarf::study::accuracy::study(&study.out, study.options(), &|text| println!("{text}"));
            return finish(done);
        }
        #[cfg(feature = "study")]
        Command::Validate(study) => {
            use swarf::study::accuracy::validation;
            return finish(validation::study(&study.out, study.options(), &|text| println!("{text}")));
        }
        #[cfg(feature = "study")]
        Command::HardCases(HardCases { child: Some(words), .. }) => {
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            return done(swarf::study::hard_cases::table::run_child(&words));
        }
        #[cfg(feature = "study")]
        Command::HardCases(HardCases { cases, out, short, .. }) => {
            return hard_cases(&out.unwrap_or_default(), short, &cases);
        }
    }
    ExitCode::SUCCESS
}

/// Runs all problems with exact solutions, writes what they give into a folder and prints the table.
#[cfg(feature = "study")]
fn verify(folder: &Path) -> ExitCode {
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

/// Runs hard cases, writes their table into a folder and prints it.
#[cfg(feature = "study")]
fn hard_cases(folder: &Path, is_short: bool, cases: &[String]) -> ExitCode {
    use swarf::study::hard_cases::{Form, Setting, table};
    let keys: Vec<&str> = cases.iter().map(String::as_str).collect();
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

#[cfg(feature = "study")]
impl Study {
    /// How the study is run.
    fn options(&self) -> swarf::study::accuracy::Options {
        let threads = self.threads.get();
        swarf::study::accuracy::Options { is_quick: self.quick, threads, runs: !self.report }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn refusal(line: &str) -> String {
        let words = std::iter::once("swarf").chain(line.split_whitespace());
        CommandLine::try_parse_from(words).err().map(|e| e.to_string()).unwrap_or_default()
    }

    /// What clap finds wrong with a definition it says only when the program runs.
    #[test]
    fn the_command_line_is_consistent() {
        CommandLine::command().debug_assert();
        for line in ["describe", "version"] {
            assert_eq!(refusal(line), "", "{line}");
        }
    }

    /// A slip is answered by the lines of its command, not by all of the manual.
    #[test]
    fn slips_are_refused_shortly() {
        for line in ["descibe", "describe --all", "version there"] {
            let text = refusal(line);
            assert!(text.starts_with("error: ") && text.lines().count() <= 8, "'{line}' gave: {text}");
        }
    }

    /// The studies' options keep their names, which scripts and the hard cases' own second processes use.
    #[cfg(feature = "study")]
    #[test]
    fn the_studies_take_their_options() {
        let good = [
            "verify --out there",
            "accuracy --out there --quick --threads 1 --report",
            "validate --out there",
            "hard-cases --out there --short 3 jammed-tool",
            "hard-cases --child",
            "hard-cases --child replay state 3 4 out",
        ];
        for line in good {
            assert_eq!(refusal(line), "", "{line}");
        }
        let child = CommandLine::try_parse_from(["swarf", "hard-cases", "--child", "cut", "-folder"]);
        let Ok(CommandLine { command: Command::HardCases(HardCases { child: Some(words), .. }) }) = child
        else {
            panic!("no words for the second process")
        };
        assert_eq!(words, ["cut", "-folder"]);
        for line in ["verify", "accuracy --out there --threads 0", "hard-cases --short"] {
            assert!(refusal(line).starts_with("error: "), "{line}");
        }
    }
}
