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
mod windows;
mod wine;

use std::path::PathBuf;
use std::process::ExitCode;

const USAGE: &str = "\
cargo xtask COMMAND

  cut [--paper | --quick] [--set NAME=VALUE]... [--stop S] [--step S] [--out DIR] [--estimate]
            package swarf.fmu and run a cut through it: tables, plots and pictures in target/cut
            --paper   120,000 points, as the paper          --quick   about 1,900 points, a first look
            --set     any parameter or input of the FMU, e.g. --set friction=0 --set feed=0.5mm --set tool.rake_angle=10deg
            --stop    end (s); otherwise 2 mm of travel     --step    communication step (s)
            --estimate    only tell the CPU time that the run would take, and the error band of its force
  verify [--out DIR]
            run the problems with exact solutions: table and plots in target/verify (some minutes)
  accuracy [--quick] [--threads N] [--report] [--out DIR]
            error over CPU time for every method, convergence, price list: tables and plots in target/accuracy; a study
            that was ended goes on where it was, and says at its start how long the rest takes
            --quick   seconds, figures without meaning       --report  tables from the runs that are there
  validate [--quick] [--threads N] [--report] [--out DIR]
            measured cuts of AISI 1045 and the shear plane: tables in target/validate, resumed in the same way
  hard-cases [--short] [CASE]...
            the hard cases (or those of these numbers or names), and two thousand random scenes: table in target/hard-cases
            --short   as in the tests, seconds each
  test      formatting, clippy, unit, integration and FMU tests, pytest with FMPy; leaves their own build as target/swarf.fmu, with
            symbols: `package` makes the one to give away
  package [--portable] [--windows] [--with OTHER.fmu]...
            build target/swarf.fmu; for a release always with --portable --windows
            --portable   the library needs glibc 2.17 at most (zig and cargo-zigbuild from PyPI, 100 MB)
            --windows    a library for Windows as well, built on Linux (zig as above; Rust's standard library from
                         rustup, or from Debian's packages, 131 MB, unpacked into .tools)
            --with       take over the libraries of an FMU packaged on another platform
  wine [--tests]
            load and run the Windows library under Wine, and compare with the Linux one
            --tests      the unit tests and those of the interface there, too
  fuzz [--minutes N] [--address-sanitizer]
            coverage-guided random calls on the C functions (15 minutes; needs a C++ compiler)
  bench [--quick | --full]
            the machine's peak, speed of whole cuts, time by phase, also in target/bench/bench.json
            --quick   under a minute          --full   long warm-ups, and the whole cut with the paper's 120,000 points
  bench --row NAME [--full]
            one measurement, also in target/bench/NAME.json; --rows lists them, --all-rows [--full] [--resume] runs them
  bench --kernels [FILTER]
            single kernels under Criterion
  bench --instructions [--write]
            instructions of each kernel against tests/data/instruction_counts.toml, or write that file (valgrind)
  effects [--full] [--build] [--effect NAME]
            what each effect costs and changes on the reference cut, as a table in target/effects/effects.md
            --full    at 30,000 points       --build   the library's build time, too
  valgrind  load, run and free the packaged FMU under memcheck
  describe [--check]   write modelDescription/modelDescription.xml, or fail where it is stale
  book [--check | --pictures]
            write the generated tables of README and book, and build the book into target/book (mdBook is fetched, 5 MB)
            --check      fail where a table is stale, a link broken, a figure without a result file
            --pictures   take over the pictures of the last `cargo xtask cut`
  verify, accuracy, validate, hard-cases, effects --full, bench --quick, bench --row NAME --full
            with --record: what was measured goes into results/, with command, commit, processor and date
  setup     the Python environment alone
  env       shell lines that let plain `cargo` build the master: eval \"$(cargo xtask env)\"
";

/// What a command gives: nothing, or a text that says what failed and what to do.
type Outcome<T = ()> = Result<T, String>;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let records = words.contains(&"--record");
    words.retain(|word| *word != "--record");
    let outcome = if records { record::around(&words, || dispatch(&words)) } else { dispatch(&words) };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(text) => {
            eprintln!("xtask: {text}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the command that the words name.
fn dispatch(words: &[&str]) -> Outcome {
    match words {
        ["cut", rest @ ..] => cut(rest),
        ["test"] => test::run(),
        ["package", rest @ ..] => packaged(rest),
        ["bench", rest @ ..] => bench::run(rest),
        ["effects", rest @ ..] => effects::run(rest),
        ["fuzz", rest @ ..] => fuzz::run(rest),
        ["valgrind"] => valgrind::run(),
        ["wine", rest @ ..] => wine::run(rest),
        ["verify", rest @ ..] => verify::run(rest),
        ["accuracy", rest @ ..] => verify::study("accuracy", rest),
        ["validate", rest @ ..] => verify::study("validate", rest),
        ["hard-cases", rest @ ..] => hard_cases::run(rest),
        ["describe"] => describe::description(false),
        ["describe", "--check"] => describe::description(true),
        ["book", rest @ ..] => book::run(rest),
        ["setup"] => setup::prepare().map(|_| ()),
        ["env"] => setup::prepare().map(|tools| print!("{}", tools.shell_lines())),
        [] | ["help" | "--help" | "-h"] => {
            print!("{USAGE}");
            Ok(())
        }
        other => Err(format!("unknown command '{}'\n\n{USAGE}", other.join(" "))),
    }
}

/// Packages the FMU as the arguments ask for.
fn packaged(arguments: &[&str]) -> Outcome {
    let (mut is_portable, mut for_windows, mut others) = (false, false, Vec::new());
    let mut words = arguments.iter();
    while let Some(word) = words.next() {
        match *word {
            "--portable" => is_portable = true,
            "--windows" => for_windows = true,
            "--with" => others.push(*words.next().ok_or("--with needs the path of an FMU")?),
            other => return Err(format!("package: unknown argument '{other}'\n\n{USAGE}")),
        }
    }
    let zig = if is_portable { Some(setup::prepare_zig()?) } else { None };
    let windows = if for_windows { Some(windows::Windows::prepare(setup::prepare_zig()?)?) } else { None };
    let mut kinds = vec![zig.as_ref().map_or(package::Kind::Plain, package::Kind::Portable)];
    kinds.extend(windows.as_ref().map(package::Kind::Windows));
    package::build_with(&kinds, &others).map(|_| ())
}

/// Packages the FMU and runs it through the embedded master.
fn cut(arguments: &[&str]) -> Outcome {
    let (fmu, master) = fmu_and_master()?;
    let mut command = std::process::Command::new(master);
    command.arg(fmu).args(arguments);
    if !arguments.contains(&"--out") {
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
