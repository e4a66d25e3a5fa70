//! `cargo xtask effects`: what each effect costs and changes, as a table in Markdown
//! (`target/effects/effects.md`).
//!
//! The effects are the table of `benches/report/effects.rs`. Instructions are counted by callgrind between
//! two places of a coarse cut; everything else comes from the reference cut with and without the effect.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use serde_json::Value;

use crate::bench::{cannot_count, report, under_callgrind};
use crate::{Outcome, process, target};

/// Places of the tool between which instructions are counted (mm of travel): the chip forms, points yield.
const PLACES: [&str; 2] = ["0.25", "0.30"];

/// How the table is made.
#[derive(clap::Args)]
pub struct Arguments {
    /// At 30,000 points
    #[arg(long)]
    full: bool,
    /// The library's build time, too
    #[arg(long)]
    build: bool,
    /// This effect alone
    #[arg(long, value_name = "NAME")]
    effect: Option<String>,
}

/// The command.
///
/// # Errors
/// A failed build or run.
pub fn run(arguments: &Arguments) -> Outcome {
    let coarsening = if arguments.full { "1" } else { "4" };
    process::compile(report().arg("--no-run"))?;
    let uncounted = cannot_count();
    if let Some(why) = &uncounted {
        eprintln!("xtask: NO INSTRUCTION COUNTS: {why}");
    }
    let names = process::output(report().args(["--quiet", "--", "effects"]))?;
    let mut text = format!(
        "| effect | instructions per point-step | CPU time | bytes per point | force | thrust | chip \
         temperature | chip strain |\n{}\n",
        "|---|---|---|---|---|---|---|---|"
    );
    for name in names.lines().filter(|name| arguments.effect.as_ref().is_none_or(|only| only == name)) {
        let line = row(name, coarsening, uncounted.is_none())?;
        println!("{line}");
        writeln!(text, "{line}").map_err(|e| e.to_string())?;
    }
    if coarsening != "1" {
        text.push_str("\nWith points four times as far apart: no measurement of what the effects change.\n");
    }
    text.push_str(&library(arguments.build)?);
    let out = target().join("effects/effects.md");
    process::write(&out, text.as_bytes())?;
    println!("\n{text}\nwritten to {}", out.display());
    Ok(())
}

/// One line of the table.
fn row(name: &str, coarsening: &str, counts: bool) -> Outcome<String> {
    let printed = process::output(report().args(["--quiet", "--", "effect", name, "compare", coarsening]))?;
    let value: Value = serde_json::from_str(&printed).map_err(|e| format!("'{printed}': {e}"))?;
    if let Some(why) = value["refused"].as_str() {
        return Ok(format!("| {name} | refused: {why} | | | | | | |"));
    }
    let number = |path: &str| value.pointer(path).and_then(Value::as_f64).unwrap_or(f64::NAN);
    let change = |key: &str| {
        let (without, with) = (number(&format!("/without/{key}")), number(&format!("/with/{key}")));
        100.0 * (with / without - 1.0)
    };
    let instructions = if counts {
        let (without, with) = (per_point_step(name, "without")?, per_point_step(name, "with")?);
        format!("{without:.1} → {with:.1} ({:+.1} %)", 100.0 * (with / without - 1.0))
    } else {
        "not counted".into()
    };
    let rise = number("/with/mean_chip_temperature_k") - number("/without/mean_chip_temperature_k");
    let thrust = number("/with/thrust_force_n_per_m") - number("/without/thrust_force_n_per_m");
    Ok(format!(
        "| {name} | {instructions} | {:+.1} % | {:+.0} | {:+.2} % | {:+.1} N/mm | {rise:+.1} K | {:+.2} % |",
        change("cpu_ns_per_point_step"),
        number("/bytes_per_point/1") - number("/bytes_per_point/0"),
        change("cutting_force_n_per_m"),
        thrust * 1e-3,
        change("mean_chip_strain"),
    ))
}

/// Instructions per point and substep of a coarse cut with or without the effect.
fn per_point_step(name: &str, which: &str) -> Outcome<f64> {
    let [before, after] = PLACES.map(|place| {
        let (printed, instructions) = under_callgrind(report(), &["effect", name, "count", which, place])?;
        let words: Vec<&str> = printed.split_whitespace().collect();
        let ["points", points, "substeps", substeps, "instructions", _] = words[..] else {
            return Err(format!("'{name}' printed '{printed}' under callgrind"));
        };
        let number = |text: &str| text.parse::<f64>().map_err(|e| format!("'{text}': {e}"));
        Ok((number(points)? * number(substeps)?, instructions))
    });
    let (before, after) = (before?, after?);
    Ok((after.1 - before.1) / (after.0 - before.0))
}

/// Size of the library and number of its compiled kernels; with its build time where it is built anew for
/// that.
fn library(builds: bool) -> Outcome<String> {
    let folder = if builds { target().join("effects/build") } else { target().to_path_buf() };
    if builds && folder.exists() {
        std::fs::remove_dir_all(&folder).map_err(|e| format!("cannot remove '{}': {e}", folder.display()))?;
    }
    let begin = Instant::now();
    let mut build = process::cargo(&["build", "--release", "--package", "swarf", "--lib", "--target-dir"]);
    process::compile(build.arg(&folder))?;
    let seconds = begin.elapsed().as_secs_f64();
    let library = folder.join("release/libswarf.so");
    let symbols = process::output(Command::new("nm").arg(&library))?;
    // Each kernel is one copy of `run` in a unit of `simd::avx2`; its twin for every processor stands in
    // `simd::portable`.
    let kernels = symbols.lines().filter(|line| line.contains("4simd4avx26unit_")).count();
    let mut text =
        format!("\n{kernels} compiled kernels for AVX2; library {:.2} MB stripped", stripped(&library)?);
    if builds {
        write!(text, "; built in {seconds:.0} s from nothing").map_err(|e| e.to_string())?;
    }
    text.push('\n');
    Ok(text)
}

/// Size of a library without its symbols (MB).
fn stripped(library: &Path) -> Outcome<f64> {
    let copy = target().join("effects/stripped.so");
    process::write(&copy, b"")?;
    process::run(Command::new("strip").arg(library).arg("-o").arg(&copy))?;
    let size = std::fs::metadata(&copy).map_err(|e| format!("'{}': {e}", copy.display()))?.len();
    Ok(size as f64 / 1e6)
}
