//! What a point costs in scenes of few and of many points: a block of the same height at every size, in which
//! the same share of the points yields.
//!
//! In the same number of substeps, which are longer where cells are larger, yielding spreads from the band
//! over more of a small block than of a large one, and a return to yield takes five times the flop of the
//! rest of a point's substep. So each larger block's band is made as wide as it takes for the smallest one's
//! share, in the mean over a run. Each is measured right after the smallest one, so that a busy neighbour
//! meets both.

use crate::blocks::{BAND, MOTION, block};
use crate::phases::median;
use cpu_time::ThreadTime;
use serde_json::{Value, json};
use swarf::dimension::PlaneStrain;
use swarf::simd::Real;
use swarf::simulation::Solver;
use swarf::stabilization::volumetric_locking::LockingControl;

/// Cells of the blocks, four points in each: 7,500 to 1,199,536 points.
const SIZES: [[i32; 3]; 4] = [[75, 25, 1], [150, 50, 1], [300, 100, 1], [949, 316, 1]];
/// Runs of each size in a sample: those of small blocks are too short to be told from a busy neighbour's
/// noise one by one.
const RUNS: [usize; SIZES.len()] = [16, 8, 2, 1];
/// Substeps of a run, from the block's start on: in these the fastest points move by half a cell, which is
/// one sort.
const SUBSTEPS: usize = 150;
/// Looks in a run at how many points yield.
const LOOKS: usize = 5;
const ROUNDS: usize = 5;
/// By how much the share of the points that yield may differ from the smallest block's (-), and trials to get
/// there.
const CLOSE: f64 = 0.003;
const TRIALS: usize = 8;

/// Measures one thread in both precisions; `coarsening` divides the cells along each edge.
pub fn flatness(coarsening: f64) -> Value {
    let sizes = SIZES.map(|size| size.map(|cells| ((f64::from(cells) / coarsening).round() as i32).max(1)));
    let share = mean_yielding::<f64>(sizes[0], BAND);
    let bands = sizes.map(|cells| if cells == sizes[0] { BAND } else { band_for(cells, share) });
    json!([in_precision::<f64>("double", sizes, bands), in_precision::<f32>("single", sizes, bands)])
}

/// The block at its start.
fn start<R: Real>(cells: [i32; 3], band: f64) -> impl Solver {
    let mut solver = block::<R, PlaneStrain>(cells, 1.0, band);
    solver.locking_control = Some(LockingControl::default());
    solver
}

fn step(solver: &mut impl Solver) {
    solver.step(&MOTION, false).expect("a stable block");
}

/// Width of the band (share of the block's length) with which such a share of the points yields, by halving.
fn band_for(cells: [i32; 3], share: f64) -> f64 {
    let (mut low, mut high) = (0.5 * BAND, 8.0 * BAND);
    for _ in 0..TRIALS {
        let middle = 0.5 * (low + high);
        let above = mean_yielding::<f64>(cells, middle) - share;
        if above.abs() < CLOSE {
            break;
        }
        if above > 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// Share of the points that yield, in the mean over a run (-).
fn mean_yielding<R: Real>(cells: [i32; 3], band: f64) -> f64 {
    let mut solver = start::<R>(cells, band);
    let each = SUBSTEPS / LOOKS;
    let mut sum = 0.0;
    for _ in 0..LOOKS {
        (0..each / 2).for_each(|_| step(&mut solver));
        sum += yielding(&mut solver);
        (each / 2 + 1..each).for_each(|_| step(&mut solver));
    }
    sum / LOOKS as f64
}

/// Share of the points whose plastic strain grows in one substep (-).
fn yielding(solver: &mut impl Solver) -> f64 {
    let strains = |solver: &dyn Solver| {
        let mut strains = vec![0.0; solver.points()];
        solver.visit_points(&mut |point| strains[point.id as usize] = point.report.plastic_strain);
        strains
    };
    let before = strains(solver);
    step(solver);
    let now = strains(solver);
    now.iter().zip(&before).filter(|(now, before)| now > before).count() as f64 / now.len() as f64
}

/// CPU time per point and substep (s), in the mean over some runs.
fn cost<R: Real>(cells: [i32; 3], band: f64, runs: usize) -> f64 {
    let run = |_| {
        let mut solver = start::<R>(cells, band);
        let begin = ThreadTime::now();
        (0..SUBSTEPS).for_each(|_| step(&mut solver));
        begin.elapsed().as_secs_f64() / (solver.points() * SUBSTEPS) as f64
    };
    (0..runs).map(run).sum::<f64>() / runs as f64
}

fn in_precision<R: Real>(
    precision: &str,
    sizes: [[i32; 3]; SIZES.len()],
    bands: [f64; SIZES.len()],
) -> Value {
    let mut costs: [Vec<f64>; SIZES.len()] = Default::default();
    let mut ratios = costs.clone();
    for _ in 0..ROUNDS {
        for k in 0..sizes.len() {
            let smallest = cost::<R>(sizes[0], bands[0], RUNS[0]);
            let cost = if k == 0 { smallest } else { cost::<R>(sizes[k], bands[k], RUNS[k]) };
            costs[k].push(cost);
            ratios[k].push(cost / smallest);
        }
    }
    let mut lines = Vec::new();
    for (k, (costs, ratios)) in costs.iter_mut().zip(&mut ratios).enumerate() {
        let (cost, over_smallest) = (median(costs), median(ratios));
        let points = start::<R>(sizes[k], bands[k]).points();
        let yielding = mean_yielding::<R>(sizes[k], bands[k]);
        println!(
            "  {precision}: {points:9} points, {:5.1} ns per point and substep, {over_smallest:.2} times the \
             smallest block's ({:.2} to {:.2}); {:.1} % yield (band of {:.3})",
            1e9 * cost,
            ratios[0],
            ratios[ROUNDS - 1],
            100.0 * yielding,
            bands[k]
        );
        lines.push(json!({
            "points": points,
            "band": bands[k],
            "cpu_s_per_point_step": cost,
            "samples": costs,
            "over_smallest": over_smallest,
            "over_smallest_samples": ratios,
            "mean_yielding_share": yielding,
        }));
    }
    json!({"precision": precision, "sizes": lines})
}
