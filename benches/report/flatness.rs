//! What a point costs in scenes of few and of many points: the same block at every size. How many points yield after the same
//! number of substeps differs, and is stated.
//!
//! Sizes are measured in turn, so that a busy neighbour meets all of them.

use crate::blocks::{DRIVE, sheared};
use crate::phases::median;
use cpu_time::ThreadTime;
use serde_json::{Value, json};
use swarf::dimension::PlaneStrain;
use swarf::locking::LockingControl;
use swarf::simd::Real;
use swarf::simulation::Solver;

/// Cells of the blocks, four points in each: 7,500 to 1,199,536 points.
const SIZES: [[i32; 3]; 4] = [[75, 25, 1], [150, 50, 1], [300, 100, 1], [949, 316, 1]];
/// Substeps of a sample, from the block's start on: in these the fastest points move by half a cell, which is one sort.
const SUBSTEPS: usize = 150;
const ROUNDS: usize = 5;

/// Measures one thread in both precisions; `coarsening` divides the cells along each edge.
pub fn flatness(coarsening: f64) -> Value {
    json!([in_precision::<f64>("double", coarsening), in_precision::<f32>("single", coarsening)])
}

/// What a size showed.
#[derive(Default)]
struct Size {
    points: usize,
    /// CPU time per point and substep (s), by sample.
    samples: Vec<f64>,
    /// Share of the points that yield after a sample (-).
    yielding: f64,
}

fn in_precision<R: Real>(precision: &str, coarsening: f64) -> Value {
    let mut sizes: [Size; SIZES.len()] = Default::default();
    for _ in 0..ROUNDS {
        for (size, cells) in sizes.iter_mut().zip(SIZES) {
            let cells = cells.map(|cells| ((f64::from(cells) / coarsening).round() as i32).max(1));
            let mut solver = sheared::<R, PlaneStrain>(cells);
            solver.locking_control = Some(LockingControl::default());
            let begin = ThreadTime::now();
            (0..SUBSTEPS).for_each(|_| solver.step(&DRIVE, false).expect("a stable block"));
            size.points = solver.points();
            size.samples.push(begin.elapsed().as_secs_f64() / (size.points * SUBSTEPS) as f64);
            size.yielding = yielding(&mut solver);
        }
    }
    let mut first = None;
    let mut lines = Vec::new();
    for Size { points, mut samples, yielding } in sizes {
        let cost = median(&mut samples);
        let over_smallest = cost / *first.get_or_insert(cost);
        println!(
            "  {precision}: {points:9} points, {:5.1} ns per point and substep ({:.1} to {:.1}), {over_smallest:.2} times the \
             smallest block's; {:.1} % yield",
            1e9 * cost,
            1e9 * samples[0],
            1e9 * samples[ROUNDS - 1],
            100.0 * yielding
        );
        lines.push(json!({
            "points": points,
            "cpu_s_per_point_step": cost,
            "samples": samples,
            "over_smallest": over_smallest,
            "yielding_share": yielding,
        }));
    }
    json!({"precision": precision, "sizes": lines})
}

/// Share of the points whose plastic strain grows in one substep (-).
fn yielding(solver: &mut dyn Solver) -> f64 {
    let strains = |solver: &dyn Solver| {
        let mut strains = vec![0.0; solver.points()];
        solver.visit_points(&mut |point| strains[point.id as usize] = point.report.plastic_strain);
        strains
    };
    let before = strains(solver);
    solver.step(&DRIVE, false).expect("a stable block");
    let now = strains(solver);
    now.iter().zip(&before).filter(|(now, before)| now > before).count() as f64 / now.len() as f64
}
