//! `cargo xtask bench`: the machine's peak, the speed of whole cuts, and where the time goes; and, for the
//! guard of instruction counts, runs of single kernels that callgrind looks at.

mod blocks;
#[path = "../../tests/common/mod.rs"]
mod common;
mod counts;
mod cuts;
mod effects;
mod flatness;
mod flops;
mod named;
mod peak;
mod phases;
#[path = "../../tests/common/reference_loop.rs"]
mod plain;
mod rows;

use flops::Flop;
use named::NAMED;
use peak::Peak;
use phases::{Comparison, Phases};
use rows::{Effort, Row};
use serde_json::{Value, json};
use std::process::ExitCode;
use swarf::dimension::{PlaneStrain, ThreeDimensional};
use swarf::scene::Precision::{Double, Single};

/// Spacings (m) of 7,500, 30,000, 120,000 and about 1,200,000 points.
const SPACINGS: [f64; 4] = [2e-5, 1e-5, 5e-6, 1.581e-6];

/// How much is measured.
#[derive(Clone, Copy, PartialEq)]
enum Extent {
    Quick,
    Usual,
    Full,
}

fn main() -> ExitCode {
    // Cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    if let ["count", kernel, substeps] = words[..] {
        return match substeps.parse().map_err(|_| substeps.to_string()).and_then(|n| counts::run(kernel, n)) {
            Ok(()) => ExitCode::SUCCESS,
            Err(text) => {
                eprintln!("report count: '{text}' is not known");
                ExitCode::FAILURE
            }
        };
    }
    if words == ["effects"] {
        effects::EFFECTS.iter().for_each(|effect| println!("{}", effect.name));
        return ExitCode::SUCCESS;
    }
    if let ["effect", name, rest @ ..] = &words[..] {
        return match effect(name, rest) {
            Ok(()) => ExitCode::SUCCESS,
            Err(text) => {
                eprintln!("report effect {name}: {text}");
                ExitCode::FAILURE
            }
        };
    }
    if words == ["--rows"] {
        NAMED.iter().for_each(|row| println!("{:<20} {}", row.name, row.about));
        return ExitCode::SUCCESS;
    }
    let (mut extent, mut out, mut row) = (Extent::Usual, None, None);
    let mut words = words.into_iter();
    while let Some(word) = words.next() {
        match word {
            "--quick" => extent = Extent::Quick,
            "--full" => extent = Extent::Full,
            "--out" => out = words.next(),
            "--row" => {
                let name = words.next().unwrap_or("");
                row = NAMED.iter().find(|row| row.name == name);
                if row.is_none() {
                    eprintln!("report: unknown row '{name}'; see --rows");
                    return ExitCode::FAILURE;
                }
            }
            other => {
                eprintln!("report: unknown argument '{other}'");
                return ExitCode::FAILURE;
            }
        }
    }
    let report = row.map_or_else(|| measure(extent), |row| measure_row(row, extent == Extent::Full));
    if let Some(path) = out {
        let text = format!("{report:#}\n");
        if let Err(e) = std::fs::write(path, text) {
            eprintln!("report: cannot write '{path}': {e}");
            return ExitCode::FAILURE;
        }
        println!("\nwritten to {path}");
    }
    ExitCode::SUCCESS
}

/// One effect: `count with|without MILLIMETRES [COARSENING]`, or `compare COARSENING`, which prints one line
/// of JSON.
fn effect(name: &str, words: &[&str]) -> Result<(), String> {
    let effect = effects::find(name).ok_or("no such effect")?;
    let number = |text: &str| text.parse::<f64>().map_err(|e| format!("'{text}': {e}"));
    match words {
        ["count", which @ ("with" | "without"), place, rest @ ..] if rest.len() < 2 => {
            let coarsening = rest.first().map_or(Ok(effects::COARSE), |text| number(text))?;
            effect.count(*which == "with", number(place)?, coarsening)
        }
        ["compare", coarsening] => {
            println!("{}", effect.compare(number(coarsening)?));
            Ok(())
        }
        other => Err(format!("unknown arguments '{}'", other.join(" "))),
    }
}

/// One measurement of `named`.
fn measure_row(row: &named::Named, is_full: bool) -> Value {
    let load = load();
    println!("{}: {}", row.name, row.about);
    let coarsening = if is_full { 1.0 } else { 4.0 };
    if !is_full {
        println!("  points {coarsening} times as far apart: no measurement; the row's own size with --full");
    }
    json!({
        "version": swarf::VERSION,
        "load_average_before": load,
        "row": row.name,
        "is_full": is_full,
        "measured": (row.run)(coarsening),
    })
}

/// How busy the machine is (programs over the last minute): two threads tell something on a quiet one only.
fn load() -> Option<f64> {
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load = load.split_whitespace().next().and_then(|number| number.parse::<f64>().ok());
    if let Some(load) = load {
        println!("load average over the last minute: {load:.1} programs");
    }
    load
}

fn measure(extent: Extent) -> Value {
    let is_quick = extent == Extent::Quick;
    let load = load();
    let peak = Peak::measure(is_quick);
    peak.print();

    let flop = [Flop::count::<PlaneStrain>([150, 50, 1]), Flop::count::<ThreeDimensional>([24, 12, 8])];
    println!("\nflop per point and substep, counted (idle lanes of vectors included):");
    for (name, flop) in ["plane strain", "3D"].iter().zip(&flop) {
        let Flop { elastic, per_return } = flop;
        println!(
            "  {name:<13} {elastic:6.0} and {per_return:.0} for a return: {:.0} where 7 % yield",
            flop.at(0.07)
        );
    }

    println!();
    let comparison = Comparison::measure([150, 50, 1], if is_quick { 5 } else { 15 });
    comparison.print();

    println!();
    let phases = Phases::measure::<PlaneStrain>([300, 100, 1], if is_quick { 260 } else { 1000 });
    phases.print();

    println!("\nwhole cuts; M/s: million point-steps per CPU second, of all threads and of the critical one");
    println!(
        "{:<18} {:>9} {:>3} {:>9} {:>9} {:>7} {:>7} {:>7} {:>8}",
        "row", "points", "thr", "M/s", "crit M/s", "% peak", "x plain", "% yield", "cut mm"
    );
    let mut lines = Vec::new();
    let mut last: Option<(String, f64)> = None;
    for row in rows(extent) {
        let effort = match extent {
            Extent::Quick => Effort { warm_up: 2e7, sample: 0.3, samples: 3 },
            Extent::Usual => Effort { warm_up: 3e8, sample: 1.0, samples: 5 },
            Extent::Full => Effort { warm_up: 2e9, sample: 2.0, samples: 5 },
        };
        match row.measure(effort) {
            Ok(measured) => {
                let core = if row.is_single() { peak.single } else { peak.double };
                let flop = flop[usize::from(row.is_three_dimensional())].at(measured.yielding);
                let share = measured.rate * flop / core;
                let ratio = measured.rate / comparison.plain_rate();
                let mut line = measured.to_json(&row, share, ratio);
                println!("{}", measured.line(&row, share, ratio));
                // Rows come in pairs: one thread, then two.
                let name = format!("{} {}", row.name(), line["points"]);
                match last.take() {
                    Some((before, one)) if before == name && row.threads() == 2 => {
                        let efficiency = measured.critical_rate / one / 2.0;
                        println!("{:>32} two threads are {:.2} times one", "", 2.0 * efficiency);
                        line["thread_efficiency"] = json!(efficiency);
                    }
                    _ => last = Some((name, measured.critical_rate)),
                }
                lines.push(line);
            }
            Err(text) => {
                println!("{:<18} {} threads: refused: {text}", row.name(), row.threads());
                lines.push(json!({"name": row.name(), "threads": row.threads(), "refused": text}));
            }
        }
    }

    json!({
        "version": swarf::VERSION,
        "load_average_before": load,
        "peak_of_one_core": peak.to_json(),
        "flop_per_point_step_elastic_and_added_by_a_return": {
            "plane_strain": [flop[0].elastic, flop[0].per_return],
            "three_dimensional": [flop[1].elastic, flop[1].per_return],
        },
        "comparison_with_plain_loop": comparison.to_json(),
        "phases": phases.to_json(),
        "rows": lines,
    })
}

/// The rows of the table; each scene with one thread and, where it can pay, with two.
fn rows(extent: Extent) -> Vec<Row> {
    let mut rows = vec![Row::small(1), Row::small(2)];
    let spacings = if extent == Extent::Quick { &SPACINGS[..3] } else { &SPACINGS[..] };
    for precision in [Double, Single] {
        for &spacing in spacings {
            rows.extend([1, 2].map(|threads| Row::plane_strain(spacing, precision, threads)));
        }
        rows.extend([1, 2].map(|threads| Row::three_dimensional(precision, threads)));
    }
    rows
}
