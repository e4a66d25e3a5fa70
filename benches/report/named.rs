//! Measurements that can be run one by one: `cargo xtask bench --row NAME`.
//!
//! Whole cuts take minutes: without `--full` they run with points four times as far apart, to see that they
//! run.

use crate::cuts::{Plan, compare, compare_means};
use crate::flatness::flatness;
use crate::peak::TwoThreads;
use crate::phases::median;
use cpu_time::ProcessTime;
use serde_json::{Value, json};
use std::time::Instant;
use swarf::scene::{ContactChoice, Numerics, Precision, Scene, Speed};
use swarf::session::Session;

/// One measurement.
pub struct Named {
    /// What `--row` takes.
    pub name: &'static str,
    /// What it measures.
    pub about: &'static str,
    /// Measures and prints; the factor on the distance of points is 1 in full.
    pub run: fn(coarsening: f64) -> Value,
}

/// All measurements.
pub const NAMED: [Named; 9] = [
    Named {
        name: "step-rate",
        about: "the first microsecond of the paper's cut, 120,000 points: point-steps per CPU second, two \
            threads over one",
        run: step_rate,
    },
    Named {
        name: "paper-cut",
        about: "the paper's cut, 120,000 points, 2 mm, at each level of speed",
        run: paper_cut,
    },
    Named {
        name: "flatness",
        about: "what a point costs from 7,500 to 1,200,000 points, one thread, a block in which the same \
            share yields at every size",
        run: flatness,
    },
    Named {
        name: "levels",
        about: "what the levels change by friction, feed and rake, 30,000 points, 1.6 mm, means of three \
            runs",
        run: levels,
    },
    Named {
        name: "smoothing",
        about: "what smoothed increments save and change by friction, feed and rake, 30,000 points, 1.6 mm, \
            means of three runs",
        run: smoothing,
    },
    Named {
        name: "steel-1045",
        about: "AISI 1045 at 3.33 m/s, without automatic mass scaling, with it, and at fast with plain \
            increments, five shifted starts each",
        run: steel_1045,
    },
    Named {
        name: "steel-1045-speedups",
        about: "the same cut with each speed-up by itself, and with fixed mass scalings",
        run: steel_1045_speedups,
    },
    Named {
        name: "contact-laws",
        about: "the reference cut under each contact law, 7,500 points with three shifted starts, and \
            30,000; gap at first contact",
        run: contact_laws,
    },
    Named {
        name: "titanium",
        about: "1 mm of Ti-6Al-4V at 70 m/min, 150,000 points, mass scaled automatically and by less",
        run: titanium,
    },
];

/// Distance of the paper's 120,000 points (m).
const PAPER: f64 = 5e-6;

/// Length of the step-rate measurement (s), and how often it is repeated.
const FIRST: f64 = 1e-6;
const REPEATS: usize = 5;

fn step_rate(coarsening: f64) -> Value {
    let mut lines = Vec::new();
    for (name, precision) in [("double", Precision::Double), ("single", Precision::Single)] {
        match RatePair::samples(PAPER * coarsening, precision) {
            Ok(pairs) => lines.push(rates(name, &pairs)),
            Err(text) => {
                println!("  {name}: refused: {text}");
                lines.push(json!({"precision": name, "refused": text}));
            }
        }
    }
    json!(lines)
}

/// One thread and two, one right after the other: a machine that slows down slows both.
struct RatePair {
    /// Point-steps per CPU second on one thread.
    rate: f64,
    /// Two threads over one by wall time, and what the machine's own were just before.
    two_over_one: f64,
    machine: TwoThreads,
}

impl RatePair {
    fn samples(spacing: f64, precision: Precision) -> Result<Vec<Self>, String> {
        let sample = |_| {
            let machine = TwoThreads::measure();
            let run = |threads| {
                let mut scene = at_level(spacing, Speed::Exact);
                scene.numerics.precision = precision;
                scene.numerics.threads = threads;
                first_microsecond(&scene)
            };
            let (one, two) = (run(1)?, run(2)?);
            Ok(RatePair { rate: one.rate, two_over_one: one.wall / two.wall, machine })
        };
        (0..REPEATS).map(sample).collect()
    }
}

/// Prints the medians of some pairs and gives them for the file.
fn rates(precision: &str, pairs: &[RatePair]) -> Value {
    let sorted = |of: &dyn Fn(&RatePair) -> f64| {
        let mut numbers: Vec<f64> = pairs.iter().map(of).collect();
        (median(&mut numbers), numbers)
    };
    let (rate, rates) = sorted(&|pair| pair.rate);
    let (two_over_one, ratios) = sorted(&|pair| pair.two_over_one);
    let (multiply_adds, _) = sorted(&|pair| pair.machine.multiply_adds);
    let (triad, _) = sorted(&|pair| pair.machine.triad);
    println!(
        "  {precision}: {:.2} million point-steps per CPU second on one thread ({:.2} to {:.2}); two threads \
         are {two_over_one:.3} times one by wall time ({:.3} to {:.3}), in multiply-adds alone \
         {multiply_adds:.3}, in the triad {triad:.3}",
        rate / 1e6,
        rates[0] / 1e6,
        rates[REPEATS - 1] / 1e6,
        ratios[0],
        ratios[REPEATS - 1],
    );
    json!({
        "precision": precision,
        "point_steps_per_cpu_s": rate,
        "samples": rates,
        "two_threads_over_one": two_over_one,
        "two_threads_over_one_samples": ratios,
        "two_threads_over_one_multiply_adds": multiply_adds,
        "two_threads_over_one_triad": triad,
    })
}

/// One run of the first microsecond.
struct Sample {
    /// Point-steps per CPU second.
    rate: f64,
    /// Wall time (s).
    wall: f64,
}

fn first_microsecond(scene: &Scene) -> Result<Sample, String> {
    let mut session = Session::new(scene, 0.0).map_err(|e| e.to_string())?;
    let (cpu, wall) = (ProcessTime::now(), Instant::now());
    session.advance_to(FIRST, &mut |_| true).map_err(|e| e.to_string())?;
    let (cpu, wall) = (cpu.elapsed().as_secs_f64(), wall.elapsed().as_secs_f64());
    let outputs = session.outputs();
    let point_steps = f64::from(outputs.active_points) * f64::from(outputs.substeps);
    Ok(Sample { rate: point_steps / cpu, wall })
}

/// The paper's scene at a level.
fn at_level(spacing: f64, speed: Speed) -> Scene {
    let mut scene = Scene::default();
    scene.numerics.point_spacing = spacing;
    scene.numerics.speed = speed;
    scene
}

fn paper_cut(coarsening: f64) -> Value {
    let spacing = PAPER * coarsening;
    let plans = Speed::ALL.iter().map(|&(level, speed)| {
        (level.to_string(), Plan { scene: at_level(spacing, speed), travel: 2e-3, settled: 1e-3 })
    });
    json!(compare(plans))
}

/// Frictions, feeds (m) and rake angles (rad) over which speed-ups are compared.
fn conditions() -> impl Iterator<Item = (f64, f64, f64)> {
    [0.0, 0.2]
        .into_iter()
        .flat_map(|friction| [(friction, 3e-4), (friction, 5e-4)])
        .flat_map(|(friction, feed)| [(friction, feed, 0.0), (friction, feed, 10_f64.to_radians())])
}

fn smoothing(coarsening: f64) -> Value {
    let mut all = Vec::new();
    for (friction, feed, rake) in conditions() {
        println!("friction {friction}, feed {:.1} mm, rake {:.0} degrees", feed * 1e3, rake.to_degrees());
        let cuts = [("plain, Courant 0.54", false, 0.54), ("smoothed, Courant 1.1", true, 1.1)];
        let cuts = compare_means(cuts.into_iter().map(|(name, smoothed, courant)| {
            let mut scene = at_level(1e-5 * coarsening, Speed::Exact);
            (scene.inputs.friction, scene.inputs.feed, scene.tool.rake_angle) = (friction, feed, rake);
            (scene.numerics.smoothed_increments, scene.numerics.courant) = (smoothed, courant);
            (name.to_string(), Plan { scene, travel: 1.6e-3, settled: 1e-3 })
        }));
        all.push(json!({"friction": friction, "feed_m": feed, "rake_rad": rake, "cuts": cuts}));
    }
    json!(all)
}

fn levels(coarsening: f64) -> Value {
    let mut all = Vec::new();
    for (friction, feed, rake) in conditions() {
        println!("friction {friction}, feed {:.1} mm, rake {:.0} degrees", feed * 1e3, rake.to_degrees());
        let cuts = compare_means(Speed::ALL.iter().map(|&(level, speed)| {
            let mut scene = at_level(1e-5 * coarsening, speed);
            (scene.inputs.friction, scene.inputs.feed, scene.tool.rake_angle) = (friction, feed, rake);
            (level.to_string(), Plan { scene, travel: 1.6e-3, settled: 1e-3 })
        }));
        all.push(json!({"friction": friction, "feed_m": feed, "rake_rad": rake, "levels": cuts}));
    }
    json!(all)
}

/// The 1045 cut, 8,360 points, where the tool meets the workpiece some fifths of a cell further on in the
/// grid: the workpiece is longer by as much. (A longer way through air would begin the same run later, and
/// show no scatter.)
fn ordinary(coarsening: f64, fifths: i32) -> Plan {
    let mut scene = at_level(1.58e-5 * coarsening, Speed::Balanced);
    scene.material.name = "AISI 1045".into();
    let cell = scene.numerics.point_spacing * f64::from(scene.numerics.points_per_cell_edge);
    (scene.workpiece.length, scene.workpiece.height) = (2.4e-3 + 0.2 * f64::from(fifths) * cell, 0.875e-3);
    scene.tool.rake_angle = 5_f64.to_radians();
    (scene.inputs.tool_velocity, scene.inputs.feed, scene.inputs.friction) = (200.0 / 60.0, 3e-4, 0.6);
    Plan { scene, travel: 1.2e-3, settled: 0.8e-3 }
}

fn steel_1045(coarsening: f64) -> Value {
    type Change<'a> = &'a dyn Fn(&mut Numerics);
    let scaled = |share: f64| {
        move |numerics: &mut Numerics| (numerics.mass_scaling, numerics.inertia_error) = (0.0, share)
    };
    // At this friction `fast` keeps the force with plain increments only, which it has where the Courant
    // number is set by hand.
    let plain = |numerics: &mut Numerics| (numerics.speed, numerics.courant) = (Speed::Fast, 0.54);
    let ways: [(&str, Change<'_>); 4] = [
        ("unscaled", &|_| ()),
        ("scaled for 0.5 %", &scaled(0.005)),
        ("scaled for 0.2 %", &scaled(0.002)),
        ("fast, plain increments", &plain),
    ];
    json!(compare(ways.into_iter().flat_map(|(name, change)| {
        (0..5).map(move |fifths| {
            let mut plan = ordinary(coarsening, fifths);
            change(&mut plan.scene.numerics);
            (format!("{name}, start {fifths}/5"), plan)
        })
    })))
}

fn steel_1045_speedups(coarsening: f64) -> Value {
    let with = |name: &str, change: &dyn Fn(&mut Scene)| {
        let mut plan = ordinary(coarsening, 0);
        plan.scene.numerics.speed = Speed::Exact;
        change(&mut plan.scene);
        (name.to_string(), plan)
    };
    let scaled =
        |factor: f64| with(&format!("exact, mass x {factor}"), &|scene| scene.numerics.mass_scaling = factor);
    json!(compare([
        with("exact", &|_| ()),
        with("single precision", &|scene| scene.numerics.precision = Precision::Single),
        with("window of 3 feeds", &|scene| scene.numerics.active_window = 3.0),
        with("Courant number 0.25", &|scene| scene.numerics.courant = 0.25),
        with("no rate effect", &|scene| scene.effects.rate = false),
        with("no rate, mass x 49", &|scene| {
            scene.effects.rate = false;
            scene.numerics.mass_scaling = 49.0;
        }),
        with("Courant 0.07, mass x 49", &|scene| {
            // Substeps as long as without scaling.
            (scene.numerics.courant, scene.numerics.mass_scaling) = (0.5 / 7.0, 49.0);
        }),
        scaled(4.0),
        scaled(12.0),
        scaled(49.0),
        scaled(200.0),
    ]))
}

/// Of the published cut only material, speed, feed, friction, rake and number of points are known; the
/// workpiece is 2 mm by 0.3 mm, its points 2 µm apart, fifty over the feed.
fn titanium(coarsening: f64) -> Value {
    json!(compare([("automatic", 1.0), ("a quarter of the error", 0.25)].map(|(name, share)| {
        let mut scene = at_level(2e-6 * coarsening, Speed::Fast);
        scene.material.name = "Ti-6Al-4V".into();
        (scene.workpiece.length, scene.workpiece.height) = (2e-3, 3e-4);
        scene.tool.rake_angle = 0.0;
        (scene.inputs.tool_velocity, scene.inputs.feed, scene.inputs.friction) = (70.0 / 60.0, 1e-4, 0.35);
        (scene.numerics.mass_scaling, scene.numerics.inertia_error) = (0.0, 0.01 * share);
        (name.to_string(), Plan { scene, travel: 1e-3, settled: 5e-4 })
    })))
}

fn contact_laws(coarsening: f64) -> Value {
    let cut = |law: ContactChoice, spacing: f64, fifths: i32| {
        let mut scene = at_level(spacing * coarsening, Speed::Exact);
        scene.numerics.contact = law;
        scene.tool.initial_gap += 0.4 * f64::from(fifths) * spacing * coarsening;
        Plan { scene, travel: 1.6e-3, settled: 1e-3 }
    };
    let gap = |&(name, law): &(&str, ContactChoice)| {
        let gap = first_contact(cut(law, 2e-5, 0).scene);
        match &gap {
            Ok(gap) => println!("  {name:<26} first contact {gap:.3} cells ahead of the workpiece"),
            Err(text) => println!("  {name:<26} refused: {text}"),
        }
        json!({"law": name, "gap_in_cells": gap.ok()})
    };
    let gaps: Vec<Value> = ContactChoice::ALL.iter().map(gap).collect();
    let mut cuts = Vec::new();
    for (spacing, starts) in [(2e-5, &[0, 2, 4][..]), (1e-5, &[0][..])] {
        let at = |law: ContactChoice, name: &str, fifths: i32| {
            (
                format!("{name}, {:.0} µm, start {fifths}/5", 1e6 * spacing * coarsening),
                cut(law, spacing, fifths),
            )
        };
        let laws = ContactChoice::ALL.iter();
        let plans = laws.flat_map(|&(name, law)| starts.iter().map(move |&fifths| at(law, name, fifths)));
        cuts.extend(compare(plans));
    }
    json!({"first_contact": gaps, "cuts": cuts})
}

/// Lets the tool come from four cells away, and gives the gap to the workpiece's right side at first contact
/// (cells).
fn first_contact(mut scene: Scene) -> Result<f64, String> {
    let cell = scene.numerics.point_spacing * f64::from(scene.numerics.points_per_cell_edge);
    scene.tool.initial_gap = 4.0 * cell;
    let speed = scene.inputs.tool_velocity;
    let mut session = Session::new(&scene, 0.0).map_err(|e| e.to_string())?;
    // A hundredth of a cell at a time: a substep or less.
    for step in 1..=500 {
        let travel = 0.01 * cell * f64::from(step);
        session.advance_to(travel / speed, &mut |_| true).map_err(|e| e.to_string())?;
        if session.outputs().cut_length > 0.0 {
            return Ok((scene.tool.initial_gap - travel) / cell);
        }
    }
    Err("no contact".into())
}
