//! Set-up and the project's commands: `cargo xtask cut`, `cargo xtask test` and their parts.
//!
//! Every command fetches and builds what it needs into the repository's own folders (`.venv`, `target`).

mod aarch64;
mod bench;
mod book;
mod describe;
mod documentation;
mod effects;
mod fuzz;
mod hard_cases;
mod package;
mod papers;
mod portable;
mod process;
mod record;
mod setup;
mod tables;
mod test;
mod valgrind;
mod verify;
mod wheel;
mod windows;
mod wine;

/// The options of a cut, as the embedded master reads them.
#[path = "../../master/src/arguments.rs"]
mod cut_arguments;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use cut_arguments::Arguments as CutArguments;

/// Set-up and the project's commands
#[derive(Parser)]
#[command(name = "xtask", bin_name = "cargo xtask")]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
    /// Write what verify, accuracy, validate, hard-cases, effects --full, bench --quick or bench --row NAME
    /// --full measures into results/, with command, commit, processor and date
    #[arg(long, global = true)]
    record: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Package swarf.fmu and run a cut through it: tables, plots and pictures in target/cut
    Cut(CutArguments),
    /// Formatting, clippy, unit, integration and FMU tests, pytest with FMPy
    ///
    /// Leaves the tests' own build as target/swarf.fmu, with symbols: `package` makes the one to give away.
    Test,
    /// Build target/swarf.fmu; for a release always with --portable --windows
    Package(package::Arguments),
    /// Build the Python package as a wheel that carries the FMU, into python/dist
    Wheel(wheel::Arguments),
    /// Measure: the machine's peak, speed of whole cuts, time by phase, also in target/bench/bench.json
    Bench(bench::Arguments),
    /// What each effect costs and changes on the reference cut, as a table in target/effects/effects.md
    Effects(effects::Arguments),
    /// Coverage-guided random calls on the C functions (needs a C++ compiler)
    Fuzz(fuzz::Arguments),
    /// Load, run and free the packaged FMU under memcheck
    Valgrind,
    /// Load and run the Windows library under Wine, and compare with the Linux one
    Wine(wine::Arguments),
    /// Run the problems with exact solutions: table and plots in target/verify (some minutes)
    Verify(verify::Arguments),
    /// Error over CPU time for every method, convergence, price list: tables and plots in target/accuracy
    ///
    /// A study that was ended goes on where it was, and says at its start how long the rest takes.
    Accuracy(verify::Study),
    /// Measured cuts of AISI 1045 and the shear plane: tables in target/validate, resumed as those of
    /// accuracy
    Validate(verify::Study),
    /// The hard cases, and two thousand random scenes: table in target/hard-cases
    HardCases(hard_cases::Arguments),
    /// Write modelDescription/modelDescription.xml, or check that it is not stale
    Describe(describe::Arguments),
    /// Write the generated tables of README and book, and build the book into target/book (mdBook is fetched,
    /// 5 MB)
    Book(book::Arguments),
    /// Make the Python environment alone
    Setup,
    /// Print shell lines that let plain `cargo` build the master: eval "$(cargo xtask env)"
    Env,
}

/// What a command gives: nothing, or a text that says what failed and what to do.
type Outcome<T = ()> = Result<T, String>;

fn main() -> ExitCode {
    let CommandLine { command, record } = CommandLine::parse();
    let outcome = if record {
        let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--record").collect();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        record::around(&words, || run(command))
    } else {
        run(command)
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(text) => {
            eprintln!("xtask: {text}");
            ExitCode::FAILURE
        }
    }
}

/// Runs a command.
fn run(command: Command) -> Outcome {
    match command {
        // Passed on as they were written.
        Command::Cut(arguments) => cut(&arguments, std::env::args_os().skip(2)),
        Command::Test => test::run(),
        Command::Package(arguments) => package::run(&arguments),
        Command::Wheel(arguments) => wheel::run(&arguments),
        Command::Bench(arguments) => bench::run(&arguments),
        Command::Effects(arguments) => effects::run(&arguments),
        Command::Fuzz(arguments) => fuzz::run(&arguments),
        Command::Valgrind => valgrind::run(),
        Command::Wine(arguments) => wine::run(&arguments),
        Command::Verify(arguments) => verify::run(&arguments),
        Command::Accuracy(study) => verify::study("accuracy", &study),
        Command::Validate(study) => verify::study("validate", &study),
        Command::HardCases(arguments) => hard_cases::run(&arguments),
        Command::Describe(arguments) => describe::description(arguments.check),
        Command::Book(arguments) => book::run(&arguments),
        Command::Setup => setup::prepare().map(|_| ()),
        Command::Env => setup::prepare().map(|tools| print!("{}", tools.shell_lines())),
    }
}

/// Packages the FMU and runs it through the embedded master, which reads the same words.
fn cut(arguments: &CutArguments, words: impl Iterator<Item = OsString>) -> Outcome {
    let (fmu, master) = fmu_and_master()?;
    let mut command = std::process::Command::new(master);
    command.arg(fmu).args(words);
    if arguments.out.is_none() {
        command.arg("--out").arg(root().join("target/cut"));
    }
    process::become_it(command)
}

/// Packages the FMU and builds the embedded master.
fn fmu_and_master() -> Outcome<(PathBuf, PathBuf)> {
    let tools = setup::prepare()?;
    let fmu = package::build()?;
    println!("xtask: building the master");
    let mut build = process::cargo(&["build", "--release", "--package", "swarf-master"]);
    process::run(tools.apply(&mut build))?;
    let master = target().join("release").join(format!("swarf-master{}", std::env::consts::EXE_SUFFIX));
    Ok((fmu, master))
}

/// The repository's folder.
fn root() -> PathBuf {
    let manifest =
        std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
    let folder = PathBuf::from(manifest);
    folder.parent().map(PathBuf::from).unwrap_or(folder)
}

/// Cargo's folder for what it builds.
fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), |path| root().join(path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn refusal(line: &str) -> String {
        let words = std::iter::once("cargo xtask").chain(line.split_whitespace());
        CommandLine::try_parse_from(words).err().map(|e| e.to_string()).unwrap_or_default()
    }

    /// What clap finds wrong with a definition it says only when the program runs.
    #[test]
    fn the_command_line_is_consistent() {
        CommandLine::command().debug_assert();
    }

    /// Scripts, documents and hands know these lines.
    #[test]
    fn every_command_takes_its_options() {
        let good = [
            "cut --paper --set friction=0 --set feed=0.5mm --stop 40us --step 0.5us --out there --estimate",
            "cut --quick --set tool.rake_angle=-5deg",
            "verify --out there",
            "accuracy --quick --threads 2 --report --out there",
            "validate --threads 1",
            "hard-cases --short 3 jammed-tool",
            "hard-cases --record",
            "test",
            "package --portable --windows --with one.fmu --with other.fmu",
            "wheel --portable --windows --test",
            "wheel --packaged",
            "wine --tests",
            "fuzz --minutes 0.5 --address-sanitizer",
            "bench",
            "bench --quick",
            "bench --full",
            "bench --row paper-cut --full",
            "bench --rows",
            "bench --all-rows --full --resume",
            "bench --kernels",
            "bench --kernels substep -- --save-baseline before",
            "bench --instructions --write",
            "effects --full --build --effect conduction",
            "valgrind",
            "describe --check",
            "book --check",
            "book --pictures",
            "setup",
            "env",
        ];
        for line in good {
            assert_eq!(refusal(line), "", "{line}");
        }
    }

    /// A slip is answered before anything is built, by the usage of its command alone.
    #[test]
    fn slips_are_refused_shortly() {
        let slips = [
            ("cutt", "'cut'"),
            ("cut --papre", "'--paper'"),
            ("cut --paper --quick", "cannot be used with"),
            ("cut --set friction", "NAME=VALUE is needed"),
            ("cut --stop soon", "like 40us"),
            ("cut --step -1us", "above 0"),
            ("book --check --pictures", "cannot be used with"),
            ("bench --quick --full", "cannot be used with"),
            ("bench --row", "a value is required"),
            ("bench --rows --full", "cannot be used with"),
            ("bench --write", "--instructions"),
            ("bench --resume", "--all-rows"),
            ("bench substep", "--kernels"),
            ("package --with", "a value is required"),
            ("wheel --packaged --portable", "cannot be used with"),
            ("accuracy --threads 0", "--threads"),
            ("fuzz --minutes soon", "--minutes"),
            ("describe --chekc", "'--check'"),
        ];
        for (line, expected) in slips {
            let text = refusal(line);
            assert!(text.starts_with("error: ") && text.contains(expected), "'{line}' gave: {text}");
            assert!(text.lines().count() <= 9, "'{line}' gave a manual: {text}");
        }
    }
}
