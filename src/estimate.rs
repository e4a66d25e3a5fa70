//! What a run will cost, told before it is paid.
//!
//! A copy of the solver at its start makes substeps for a moment under the thread's CPU clock. What the start does not show
//! is added by a formula:
//!
//! CPU time = c n ⟨a(s) (1 + κ) + λ w(s) + ζ x⟩,  n = T / Δt (1 + ε),  mean over the way s
//!
//! | | |
//! |---|---|
//! | c | CPU time of a substep at the start, when nothing yields (s) |
//! | n | substeps over the time T, from the first one's length Δt; ε as compressed metal carries sound faster |
//! | a(s) | integrated area after the way s over that at the start: the active window fills, and the chip is always active |
//! | w(s) | area of the chip over the area at the start: points that have yielded and do so again |
//! | x | feed times spacing over the area at the start: points that touch the tool, over all |
//! | κ | sorting, locking control, what yields before the tool |
//!
//! The constants ε, κ, λ and ζ are fitted to reference cuts over spacings and speed levels (docs/accuracy.md): λ and κ hold what
//! else a run has and its start has not, such as frozen points that are sorted along. A time of this machine under its present load
//! is no part of a state, and the only output that two equal runs may differ in.

use crate::composition;
use crate::error::Error;
use crate::scene::{Inputs, Scene};
use crate::simulation::{Drive, Solver};
use crate::window;
use std::time::Duration;

/// Substeps beyond those of the first one's length (-).
const MORE_SUBSTEPS: f64 = 0.01;
/// Sorting, locking control and first yield over a substep without them (-): κ.
const UPKEEP: f64 = 0.47;
/// Cost of a chip's point above that of one at rest (-): λ.
const YIELDING: f64 = 3.4;
/// Cost of contact for a feed of points, over that of these points at rest (-): ζ.
const CONTACT: f64 = 166.0;
/// CPU time of the calibration (s); larger scenes are calibrated on a coarser copy.
const CALIBRATION: f64 = 0.06;
/// Batches of the calibration at most (small scenes are known sooner), and substeps of each: the cheapest batch counts, as the
/// others were disturbed by what else the machine does.
const BATCHES: usize = 200;
/// See `BATCHES`.
const BATCH: usize = 4;
/// Most points of the calibration: a hundred thousand make 3 ms a substep, and no longer fit any cache.
const MOST_POINTS: f64 = 1.5e5;
/// Stations along the way at which the area is looked at.
const STATIONS: usize = 40;

/// What a run is expected to take.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Substeps.
    pub substeps: f64,
    /// CPU time of all threads (s).
    pub cpu_seconds: f64,
}

/// Estimates a run of `duration` (s) from the state of `solver`, with the inputs kept.
///
/// # Errors
/// When the copy becomes unstable, as the run then would.
pub fn of_run(solver: &dyn Solver, scene: &Scene, inputs: &Inputs, duration: f64) -> Result<Estimate, Error> {
    let speed = inputs.tool_velocity;
    let drive = Drive { velocity: [-speed, 0.0], friction: inputs.friction };
    let mut copy = small_copy(solver, scene)?;
    copy.scale_mass(speed.abs());
    let points = copy.points() as f64;
    let (cost, dt) = calibrate(copy.as_mut(), &drive)?;
    // A coarser copy has longer substeps, in proportion to its cells.
    let coarseness = coarseness(scene);
    let substeps = duration / (dt / coarseness) * (1.0 + MORE_SUBSTEPS);
    let per_point = cost / points;
    let start_area = window::integrated_area(scene, inputs.feed, 0.0).max(f64::MIN_POSITIVE);
    let mut load = 0.0;
    for k in 0..STATIONS {
        let way = (k as f64 + 0.5) / STATIONS as f64 * speed.max(0.0) * duration;
        let area = window::integrated_area(scene, inputs.feed, way);
        let chip = inputs.feed * (way - scene.tool.initial_gap).clamp(0.0, scene.workpiece.length);
        load += (area * (1.0 + UPKEEP) + YIELDING * chip) / STATIONS as f64;
    }
    load = (load + CONTACT * inputs.feed * scene.numerics.point_spacing) / start_area;
    let cpu_seconds = per_point * solver.points() as f64 * substeps * load;
    Ok(Estimate { substeps, cpu_seconds })
}

/// How much coarser than the scene its calibration runs (-).
fn coarseness(scene: &Scene) -> f64 {
    let numerics = &scene.numerics;
    let area = scene.workpiece.length * scene.workpiece.height;
    let axes = if numerics.dimension == crate::scene::DimensionChoice::ThreeDimensional { 3 } else { 2 };
    let depth = if axes == 3 { scene.workpiece.width / numerics.point_spacing } else { 1.0 };
    let points = area / numerics.point_spacing.powi(2) * depth;
    (points / MOST_POINTS).max(1.0).powf(1.0 / f64::from(axes))
}

/// The solver again, or a coarser one of the same scene when it is large.
fn small_copy(solver: &dyn Solver, scene: &Scene) -> Result<Box<dyn Solver>, Error> {
    let coarseness = coarseness(scene);
    if coarseness == 1.0 {
        return Ok(solver.fork());
    }
    let mut coarse = scene.clone();
    coarse.numerics.point_spacing *= coarseness;
    composition::build(&coarse)
}

/// CPU time of a substep (s) and the length of the first (s).
fn calibrate(solver: &mut dyn Solver, drive: &Drive) -> Result<(f64, f64), Error> {
    let dt = solver.time_step(drive);
    // The first brings the copy into the cache.
    solver.step(drive, false)?;
    let begin = Clock::now();
    let mut cheapest = f64::MAX;
    for batch in 0..BATCHES {
        if batch > 0 && begin.elapsed() > CALIBRATION {
            break;
        }
        let before = begin.elapsed();
        for _ in 0..BATCH {
            solver.step(drive, false)?;
        }
        cheapest = cheapest.min((begin.elapsed() - before) / BATCH as f64);
    }
    Ok((cheapest, dt))
}

/// CPU time of this thread; where the system has none fine enough, time on the clock.
#[derive(Clone, Copy, Debug)]
pub struct Clock(#[cfg(unix)] cpu_time::ThreadTime, #[cfg(not(unix))] std::time::Instant);

impl Clock {
    /// From here on.
    pub fn now() -> Self {
        #[cfg(unix)]
        return Clock(cpu_time::ThreadTime::now());
        #[cfg(not(unix))]
        return Clock(std::time::Instant::now());
    }

    /// Seconds since `now`.
    pub fn elapsed(&self) -> f64 {
        let elapsed: Duration = self.0.elapsed();
        elapsed.as_secs_f64()
    }
}
