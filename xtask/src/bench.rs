//! `cargo xtask bench`: speeds (never asserted, since they depend on the machine and its other work) and
//! instruction counts (compared with committed ones, since they do not).
//!
//! The speeds come from `benches/report`, single kernels under Criterion from `benches/kernels.rs`. For the
//! counts, callgrind runs a kernel twice, a different number of times: the difference is the kernel's own.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use serde::Deserialize;

use crate::test::tests;
use crate::{Outcome, process, root, target};

/// How often each kernel runs in the first and in the second run.
const TIMES: [u32; 2] = [2, 22];

/// The committed counts.
#[derive(Deserialize)]
struct Committed {
    /// By how much a count may exceed its committed one (-), with another compiler and with the same one.
    tolerance: f64,
    tolerance_same_compiler: f64,
    /// The compiler that the counts belong to.
    rustc: String,
    /// Instructions per point and run of each kernel.
    instructions_per_point: BTreeMap<String, f64>,
}

/// What is measured, and how long.
#[derive(clap::Args)]
#[command(group = clap::ArgGroup::new("what"))]
pub struct Arguments {
    /// Under a minute
    #[arg(long, conflicts_with_all = ["what", "full"])]
    quick: bool,
    /// Long warm-ups, and the whole cut with the paper's 120,000 points; of a row, its own size
    #[arg(long, conflicts_with_all = ["rows", "kernels", "instructions"])]
    full: bool,
    /// One measurement, also in target/bench/NAME.json
    #[arg(long, value_name = "NAME", group = "what")]
    row: Option<String>,
    /// List the measurements of --row
    #[arg(long, group = "what")]
    rows: bool,
    /// All of them
    #[arg(long, group = "what")]
    all_rows: bool,
    /// Leave out those that have been measured
    #[arg(long, requires = "all_rows")]
    resume: bool,
    /// Single kernels under Criterion; Criterion's own options behind --
    #[arg(long, group = "what")]
    kernels: bool,
    /// Kernels whose names have this in them
    #[arg(value_name = "FILTER", requires = "kernels")]
    filter: Vec<String>,
    /// Instructions of each kernel against tests/data/instruction_counts.toml (needs valgrind)
    #[arg(long, group = "what")]
    instructions: bool,
    /// Write that file
    #[arg(long, requires = "instructions")]
    write: bool,
}

/// The command.
///
/// # Errors
/// A failed build or run, or counts above the committed ones.
pub fn run(arguments: &Arguments) -> Outcome {
    let size = if arguments.full { &["--full"][..] } else { &[] };
    if arguments.instructions {
        return check_instructions(arguments.write);
    }
    if arguments.kernels {
        let mut command = process::cargo(&["bench", "--package", "swarf", "--bench", "kernels"]);
        process::compile(command.arg("--no-run"))?;
        let mut command = process::cargo(&["bench", "--package", "swarf", "--bench", "kernels", "--"]);
        return process::run(command.args(&arguments.filter));
    }
    process::compile(report().arg("--no-run"))?;
    if arguments.rows {
        return process::run(report().args(["--", "--rows"]));
    }
    if let Some(name) = &arguments.row {
        return measure_row(name, size);
    }
    if arguments.all_rows {
        return all_rows(size, arguments.resume);
    }
    let out = target().join("bench/bench.json");
    std::fs::create_dir_all(target().join("bench"))
        .map_err(|e| format!("cannot make '{}': {e}", target().join("bench").display()))?;
    let mut command = report();
    command.arg("--").args(size);
    if arguments.quick {
        command.arg("--quick");
    }
    process::run(command.arg("--out").arg(out))
}

/// Measures one row and writes `target/bench/NAME.json`.
fn measure_row(name: &str, size: &[&str]) -> Outcome {
    let out = row_path(name);
    std::fs::create_dir_all(target().join("bench"))
        .map_err(|e| format!("cannot make '{}': {e}", target().join("bench").display()))?;
    process::run(report().args(["--", "--row", name]).args(size).arg("--out").arg(out))
}

/// Measures every row, or those that have no file yet.
fn all_rows(size: &[&str], resumes: bool) -> Outcome {
    let rows = process::output(report().args(["--quiet", "--", "--rows"]))?;
    for name in rows.lines().filter_map(|line| line.split_whitespace().next()) {
        if resumes && row_path(name).exists() {
            println!("{name}: measured before, see '{}'", row_path(name).display());
        } else {
            measure_row(name, size)?;
        }
    }
    Ok(())
}

fn row_path(name: &str) -> PathBuf {
    target().join(format!("bench/{name}.json"))
}

/// Why instructions cannot be counted here, if so.
pub fn cannot_count() -> Option<String> {
    let version =
        Command::new("valgrind").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    if !version.is_ok_and(|status| status.success()) {
        return Some("valgrind is missing (Debian or Ubuntu: apt-get install valgrind)".into());
    }
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        return None;
    }
    Some("the committed counts are those of AVX2, which this processor lacks".into())
}

/// Counts and compares, or writes.
///
/// # Errors
/// Names the kernels that need more instructions than committed.
fn check_instructions(writes: bool) -> Outcome {
    if let Some(why) = cannot_count() {
        return Err(format!("no instruction counts: {why}"));
    }
    let path = committed_path();
    let text = process::read(&path)?;
    let committed: Committed = toml::from_str(&text).map_err(|e| format!("'{}': {e}", path.display()))?;
    let rustc = rustc_version()?;
    process::compile(counted()?.arg("--no-run"))?;
    let tolerance =
        if rustc == committed.rustc { committed.tolerance_same_compiler } else { committed.tolerance };
    let mut counted = BTreeMap::new();
    let mut exceeding = Vec::new();
    println!("{:<28} {:>14} {:>14}", "instructions per point", "counted", "committed");
    for (kernel, &bound) in &committed.instructions_per_point {
        let count = per_point(kernel)?;
        let change = 100.0 * (count / bound - 1.0);
        println!("{kernel:<28} {count:>14.2} {bound:>14.2}  {change:+.1} %");
        if count > bound * (1.0 + tolerance) {
            exceeding.push(format!("{kernel} {count:.2} instead of {bound:.2} ({change:+.1} %)"));
        } else if count < bound * (1.0 - tolerance) {
            println!("  fewer than committed: keep it with `cargo xtask bench --instructions --write`");
        }
        counted.insert(kernel.clone(), count);
    }
    if writes {
        let head: String =
            text.lines().take_while(|line| line.starts_with('#')).map(|l| format!("{l}\n")).collect();
        let lines: String =
            counted.iter().map(|(kernel, count)| format!("{kernel} = {count:.2}\n")).collect();
        let Committed { tolerance, tolerance_same_compiler, .. } = committed;
        let all = format!(
            "{head}tolerance = {tolerance}\ntolerance_same_compiler = {tolerance_same_compiler}\nrustc = \
             \"{rustc}\"\n\n[instructions_per_point]\n{lines}"
        );
        return process::write(&path, all.as_bytes());
    }
    if exceeding.is_empty() {
        return Ok(());
    }
    let compiler = if rustc == committed.rustc {
        String::new()
    } else {
        format!(" (the committed counts are those of rustc {}, this is {rustc})", committed.rustc)
    };
    Err(format!(
        "more instructions than '{}' allows{compiler}: {}; if the change is worth it, commit the new counts \
         with `cargo xtask bench --instructions --write`",
        path.display(),
        exceeding.join(", ")
    ))
}

/// Instructions per point of one run of a kernel.
fn per_point(kernel: &str) -> Outcome<f64> {
    let [few, many] = TIMES;
    let ((points, less), (_, more)) = (count(kernel, few)?, count(kernel, many)?);
    Ok((more - less) / (points * f64::from(many - few)))
}

/// Points of a kernel's scene, and instructions of the whole program.
fn count(kernel: &str, times: u32) -> Outcome<(f64, f64)> {
    let (printed, instructions) = under_callgrind(counted()?, &["count", kernel, &times.to_string()])?;
    let words: Vec<&str> = printed.split_whitespace().collect();
    let ["points", points, "instructions", set] = words[..] else {
        return Err(format!("'{kernel}' printed '{printed}' under callgrind"));
    };
    // Valgrind has its own idea of the processor; the counts must be those of the path that users run.
    let expected = if kernel.ends_with("_portable") { "portable" } else { "avx2" };
    if set != expected {
        return Err(format!("'{kernel}' ran with {set} instructions under callgrind, not {expected}"));
    }
    let points = points.parse::<f64>().map_err(|e| format!("'{points}': {e}"))?;
    Ok((points, instructions))
}

/// What a benchmark program prints under callgrind, and the instructions of the whole run.
///
/// # Errors
/// A failed run.
pub fn under_callgrind(mut command: Command, arguments: &[&str]) -> Outcome<(String, f64)> {
    let log = target().join("bench/callgrind.log");
    process::write(&log, b"")?;
    let runner = format!(
        "target.'cfg(all())'.runner=['valgrind', '--tool=callgrind', '--callgrind-out-file=/dev/null', \
         '--log-file={}']",
        log.display()
    );
    command.args(["--quiet", "--config", &runner, "--"]).args(arguments);
    let printed = process::output(&mut command)?;
    let log = process::read(&log)?;
    let collected = log.lines().find_map(|line| line.split_once("Collected :"));
    let (_, number) = collected.ok_or("callgrind collected nothing")?;
    let number = number.trim().parse::<f64>().map_err(|e| format!("callgrind's '{number}': {e}"))?;
    Ok((printed, number))
}

/// The benchmark program, as a command to which arguments can be added.
pub fn report() -> Command {
    process::cargo(&["bench", "--package", "swarf", "--bench", "report"])
}

/// The same program in the build of the tests: counts that guard need no build of their own.
fn counted() -> Outcome<Command> {
    let mut command = tests()?;
    command.args(["--bench", "report"]);
    Ok(command)
}

fn committed_path() -> PathBuf {
    root().join("tests/data/instruction_counts.toml")
}

/// The compiler's version number.
fn rustc_version() -> Outcome<String> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let text = process::output(process::in_repository(Command::new(rustc)).arg("--version"))?;
    Ok(text.split_whitespace().nth(1).unwrap_or("unknown").to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tolerance of more than a few percent would guard nothing, and a count of none compares with nothing.
    #[test]
    fn the_committed_counts_are_a_guard() {
        let text = process::read(&committed_path()).expect("the file is committed");
        let committed: Committed = toml::from_str(&text).expect("its three entries");
        assert!((0.0..=0.05).contains(&committed.tolerance), "tolerance {}", committed.tolerance);
        // What a scene does not name costs nothing: an effect that comes in may not be seen in the others'
        // counts.
        assert!((0.0..=0.002).contains(&committed.tolerance_same_compiler));
        assert!(committed.instructions_per_point.len() >= 5, "{:?}", committed.instructions_per_point);
        for (kernel, count) in &committed.instructions_per_point {
            assert!(*count > 1.0, "{kernel} = {count}");
        }
    }
}
