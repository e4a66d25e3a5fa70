//! What a run will cost, told before it is paid.
//!
//! What is returned is made of counts and of a rate that is a parameter, `numerics.point_rate`: two equal
//! runs return the same. What the log tells besides is measured: a copy of the solver at its start makes
//! substeps for a moment under the thread's CPU clock, the tool at rest: nothing moves or yields, so that
//! each of them costs the same. What such a substep does not show is added by a formula:
//!
//! CPU time = n ⟨a(s) (c + κ c₀) + (λ w(s) + ζ x) c₀⟩,  n = T / Δt (1 + ε),  mean over the way s
//!
//! | | |
//! |---|---|
//! | c | CPU time of a substep at rest (s): points over the rate, or measured |
//! | c₀ | the same with FLIP: what another transfer costs beyond it is in c if that is measured, and nothing else of a run gets dearer by it |
//! | n | substeps over the time T, from the first one's length Δt; ε as compressed metal carries sound faster |
//! | a(s) | integrated area after the way s over that at the start: the active window and the chip fill |
//! | w(s) | area of the integrated chip over the area at the start: points that have yielded and do so again |
//! | x | feed times spacing over the area at the start: points that touch the tool, over all |
//! | κ | sorting, locking control, what yields before the tool |
//!
//! The constants ε, κ, λ and ζ are fitted to 33 cuts: eleven kinds (transfer, precision, contact, Courant
//! number, feed, friction, heat) at 40, 20 and 10 µm (book/src/evidence/accuracy.md); they hold what else a
//! run has and a substep at rest has not.

use crate::error::Error;
use crate::scene::{Inputs, Scene, TransferChoice};
use crate::setup;
use crate::simulation::{Solver, ToolMotion};
use std::time::Duration;

/// Substeps beyond those of the first one's length (-).
const MORE_SUBSTEPS: f64 = 0.01;
/// Sorting, locking control and first yield over a substep without them (-): κ.
const UPKEEP: f64 = 0.03;
/// Cost of a chip's point above that of one at rest (-): λ.
const YIELDING: f64 = 4.3;
/// Cost of contact for a feed of points, over that of these points at rest (-): ζ.
const CONTACT: f64 = 132.0;
/// Longest CPU time of a calibration (s); there are two at most, and larger scenes are calibrated on a
/// coarser copy.
const CALIBRATION: f64 = 0.08;
/// Share of a run that its calibration may take (-), so that hundreds of small ones are not held up by their
/// estimates.
const CALIBRATION_SHARE: f64 = 0.01;
/// Substeps that are timed together: the cheapest batch counts, as the others were disturbed by what else the
/// machine does.
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
    /// CPU time of all threads (s) of a machine that has the scene's `numerics.point_rate`.
    pub cpu_seconds: f64,
}

/// Estimates a run of `duration` (s) from the state of `solver`, with the inputs kept.
///
/// # Errors
/// `Error::NotAvailable` for a process that this version does not have, and what building a coarser copy of a
/// large scene refuses.
pub fn of_run(solver: &dyn Solver, scene: &Scene, inputs: &Inputs, duration: f64) -> Result<Estimate, Error> {
    let mut copy = small_copy(solver, scene)?;
    let substeps = substeps(copy.as_mut(), scene, inputs, duration);
    let cost = 1.0 / scene.numerics.point_rate;
    let load = load(scene, inputs, duration, [cost, cost])?;
    Ok(Estimate { substeps, cpu_seconds: solver.points() as f64 * substeps * load })
}

/// The same run's CPU time (s) on this machine under its present load, which no output may hang on.
///
/// # Errors
/// As `of_run`, and when the copy becomes unstable, as the run then would.
pub fn on_this_machine(
    solver: &dyn Solver,
    scene: &Scene,
    inputs: &Inputs,
    duration: f64,
) -> Result<f64, Error> {
    let mut copy = small_copy(solver, scene)?;
    let substeps = substeps(copy.as_mut(), scene, inputs, duration);
    let cost = cost_at_rest(copy.as_mut(), substeps)?;
    let plain = if scene.numerics.transfer == TransferChoice::Flip {
        cost
    } else {
        let mut plain = scene.clone();
        plain.numerics.transfer = TransferChoice::Flip;
        cost_at_rest(coarser(&plain)?.as_mut(), substeps)?
    };
    Ok(solver.points() as f64 * substeps * load(scene, inputs, duration, [cost, plain])?)
}

/// Substeps of a run, from the first one's length.
fn substeps(copy: &mut dyn Solver, scene: &Scene, inputs: &Inputs, duration: f64) -> f64 {
    let speed = inputs.tool_velocity;
    let motion = ToolMotion { velocity: [-speed, 0.0], friction: inputs.friction };
    copy.scale_mass(speed.abs());
    // A coarser copy has longer substeps, in proportion to its cells.
    duration / (copy.time_step(&motion) / coarseness(scene)) * (1.0 + MORE_SUBSTEPS)
}

/// CPU time of a substep for each point at the start (s), mean over a run of `duration` (s).
///
/// * `cost`, `plain`: CPU time of a substep at rest for each point (s), with the scene's transfer and with
///   FLIP
fn load(scene: &Scene, inputs: &Inputs, duration: f64, [cost, plain]: [f64; 2]) -> Result<f64, Error> {
    let process = setup::process_of(scene.kind)?;
    let start_area = process.integrated_area(scene, inputs, 0.0).all.max(f64::MIN_POSITIVE);
    let mut load = plain * CONTACT * inputs.feed.max(0.0) * scene.numerics.point_spacing;
    for k in 0..STATIONS {
        let distance = (k as f64 + 0.5) / STATIONS as f64 * inputs.tool_velocity.max(0.0) * duration;
        let area = process.integrated_area(scene, inputs, distance);
        load += (area.all * (cost + UPKEEP * plain) + YIELDING * area.yielding * plain) / STATIONS as f64;
    }
    Ok(load / start_area)
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
    if coarseness(scene) == 1.0 { Ok(solver.fork()) } else { coarser(scene) }
}

/// A solver of the scene, as coarse as a calibration wants it.
fn coarser(scene: &Scene) -> Result<Box<dyn Solver>, Error> {
    let mut coarse = scene.clone();
    coarse.numerics.point_spacing *= coarseness(scene);
    setup::build(&coarse)
}

/// CPU time of a substep at rest for each point (s), for a run of so many substeps.
fn cost_at_rest(solver: &mut dyn Solver, substeps: f64) -> Result<f64, Error> {
    let motion = ToolMotion { velocity: [0.0; 2], friction: 0.0 };
    // The first brings the copy into the cache.
    solver.step(&motion, false)?;
    let begin = Clock::now();
    let mut cheapest = f64::MAX;
    loop {
        let before = begin.elapsed();
        for _ in 0..BATCH {
            solver.step(&motion, false)?;
        }
        let after = begin.elapsed();
        cheapest = cheapest.min((after - before) / BATCH as f64);
        if after > CALIBRATION.min(CALIBRATION_SHARE * substeps * cheapest) {
            return Ok(cheapest / solver.points() as f64);
        }
    }
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
