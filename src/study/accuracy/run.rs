//! One run of a study: what is run, and what it measured.

use crate::dimension::PlaneStrain;
use crate::grid::shape_function::{Gimp, Linear};
use crate::scene::{Accuracy, Scene, Speed};
use crate::session::cost_estimate::Clock;
use crate::session::{Advance, Outputs, Session};
use crate::setup::checks;
use crate::study::verification::{manufactured, piston};
use crate::variables::set_by_name;
use std::time::Instant;

/// Names and values set in a scene, as a user types them.
pub type Settings = Vec<(String, String)>;

/// Communication steps within the span over which outputs are averaged.
const LOOKS: usize = 12;
/// A run is stopped when the clock has gone this many times its estimated CPU time, and at least
/// `LEAST_LIMIT` (s): on a machine with much other work a sound run has needed eight times as long.
const LIMIT: f64 = 40.0;
/// See `LIMIT`.
const LEAST_LIMIT: f64 = 60.0;

/// What is run.
#[derive(Clone, Debug, PartialEq)]
pub enum Problem {
    /// A cut: the reference cut with settings, its outputs averaged over a span of travel (m).
    Cut {
        /// What is set beside the reference cut.
        settings: Settings,
        /// Travel at which averaging begins and the run ends (m).
        span: [f64; 2],
    },
    /// The axis-aligned manufactured solution at amplitude 0.001; its error is that of the displacement over
    /// the amplitude.
    AxisAligned {
        /// Linear shape functions in the place of GIMP.
        linear: bool,
        /// Cells along an edge.
        cells: i32,
    },
    /// The piston shock, the face crossing nodes; its error is that of the plateau.
    Piston {
        /// Whether the points touch, or the nodes.
        points_touch: bool,
        /// Cells along the bar.
        cells: i32,
        /// Courant number.
        courant: f64,
    },
}

/// What a run measured; zeros for what its problem does not have.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    /// CPU time (s).
    pub cpu_seconds: f64,
    /// CPU time that was estimated right after the start (s).
    pub estimated: f64,
    /// Substeps made, and estimated.
    pub substeps: [f64; 2],
    /// Material points at the start.
    pub points: f64,
    /// Cutting force and thrust (N), chip thickness (m), chip temperature above the start (K), 99.9th
    /// percentile of the plastic strain (-): means over the span.
    pub outputs: [f64; 5],
    /// Largest ledger error over the run (-).
    pub balance_error: f64,
    /// Error against the exact solution, where there is one (-).
    pub error: f64,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Ending {
    /// As planned.
    Done(Measured),
    /// It could not go on; the text says why. What it had measured comes along.
    Failed(String, Measured),
    /// This version does not have what it asks for: not kept, so that a later version runs it.
    Refused(String),
}

impl Ending {
    /// What was measured by a run that went as planned.
    pub fn measured(&self) -> Option<&Measured> {
        match self {
            Ending::Done(measured) => Some(measured),
            _ => None,
        }
    }
}

/// A setting.
pub fn set(name: &str, value: impl ToString) -> (String, String) {
    (name.to_owned(), value.to_string())
}

/// The reference cut with settings, on one thread.
///
/// # Errors
/// A name or value that this version does not have.
pub fn scene_of(settings: &[(String, String)]) -> Result<Scene, crate::Error> {
    let mut scene = Scene::default();
    for (name, value) in settings {
        set_by_name(&mut scene, name, value)?;
    }
    scene.numerics.threads = 1;
    Ok(scene)
}

impl Problem {
    /// A text that is equal for equal runs: a cut's is made of all values in use, so that a preset and the
    /// same values set one by one are one run.
    pub fn identity(&self) -> String {
        match self {
            Problem::Cut { settings, span } => {
                let scene = scene_of(settings).and_then(|scene| checks::check(&scene));
                let Ok(mut scene) = scene else { return format!("cut {settings:?} {span:?}") };
                (scene.numerics.speed, scene.numerics.accuracy) = (Speed::Exact, Accuracy::Custom);
                let bytes =
                    postcard::to_stdvec(&(scene, span)).expect("plain data always serialises to memory");
                format!("cut {:08x}{:08x}", crc32fast::hash(&bytes), {
                    let turned: Vec<u8> = bytes.iter().rev().copied().collect();
                    crc32fast::hash(&turned)
                })
            }
            Problem::AxisAligned { linear, cells } => format!("axis-aligned linear={linear} cells={cells}"),
            Problem::Piston { points_touch, cells, courant } => {
                format!("piston points_touch={points_touch} cells={cells} courant={courant}")
            }
        }
    }

    /// CPU time that it will take (s); 0 for a run that is refused.
    pub fn estimate(&self) -> f64 {
        match self {
            Problem::Cut { settings, span } => {
                let session = scene_of(settings).and_then(|scene| Session::new(&scene, 0.0));
                let Ok(session) = session else { return 0.0 };
                session.estimate_on_this_machine(end_time(&session, span[1])).unwrap_or(0.0)
            }
            // Measured once on one core: 64 cells take 6 s, 200 cells of the piston 3 s.
            Problem::AxisAligned { cells, .. } => 6.0 * (f64::from(*cells) / 64.0).powi(3),
            Problem::Piston { cells, courant, .. } => {
                3.0 * (f64::from(*cells) / 200.0).powi(2) * 0.5 / courant
            }
        }
    }

    /// Runs it on this thread.
    pub fn run(&self) -> Ending {
        let begin = Clock::now();
        match *self {
            Problem::Cut { ref settings, span } => cut(settings, span),
            Problem::AxisAligned { linear, cells } => {
                let (amplitude, end) = (1e-3, 0.02);
                let outcome = if linear {
                    manufactured::axis_aligned::<PlaneStrain, _>(Linear, cells, amplitude, end)
                } else {
                    manufactured::axis_aligned::<PlaneStrain, _>(Gimp::new(2), cells, amplitude, end)
                };
                let cpu_seconds = begin.elapsed();
                let points = f64::from(4 * cells * cells);
                let measured = Measured { cpu_seconds, points, error: outcome.error, ..Measured::default() };
                match outcome.stopped {
                    Some(time) => Ending::Failed(format!("became unstable at {time:.3e} s"), measured),
                    None => Ending::Done(measured),
                }
            }
            Problem::Piston { points_touch, cells, courant } => {
                let outcome = piston::run(piston::Piston::Moving, points_touch, cells, courant);
                let cpu_seconds = begin.elapsed();
                let error = (outcome.plateau / outcome.exact.plateau - 1.0).abs();
                Ending::Done(Measured { cpu_seconds, error, ..Measured::default() })
            }
        }
    }
}

/// Time at which the tool has come so far (m) at its start speed (s).
fn end_time(session: &Session, travel: f64) -> f64 {
    travel / session.scene().inputs.tool_velocity
}

fn cut(settings: &[(String, String)], span: [f64; 2]) -> Ending {
    let session = scene_of(settings).and_then(|scene| Session::new(&scene, 0.0));
    let mut session = match session {
        Ok(session) => session,
        Err(error) => return Ending::Refused(plain(&error.to_string())),
    };
    let times = span.map(|travel| end_time(&session, travel));
    let mut measured = Measured { points: f64::from(session.outputs().active_points), ..Measured::default() };
    measured.estimated = session.estimate_on_this_machine(times[1]).unwrap_or(0.0);
    if let Ok(estimate) = session.estimate(times[1]) {
        measured.substeps[1] = estimate.substeps;
    }
    // The watcher may be called from another thread, whose CPU clock is another.
    let (begin, started) = (Clock::now(), Instant::now());
    let limit = (LIMIT * measured.estimated).max(LEAST_LIMIT);
    let ends = (0..=LOOKS).map(|k| times[0] + (times[1] - times[0]) * k as f64 / LOOKS as f64);
    for (k, end) in ends.enumerate() {
        let advance = session.advance_to(end, &mut |_| started.elapsed().as_secs_f64() < limit);
        measured.cpu_seconds = begin.elapsed();
        let outputs = session.outputs();
        measured.substeps[0] += f64::from(outputs.substeps);
        measured.balance_error = measured.balance_error.max(outputs.balance_error.abs());
        match advance {
            Ok(Advance::Reached) => {}
            Ok(Advance::StoppedAt(time)) => {
                let text = format!("stopped at {time:.3e} s: more than {limit:.0} s on the clock");
                return Ending::Failed(text, measured);
            }
            Err(error) => return Ending::Failed(plain(&error.to_string()), measured),
        }
        // The first step leads up to the span.
        if k > 0 {
            add(&mut measured.outputs, outputs, session.scene());
        }
    }
    Ending::Done(measured)
}

/// Adds one look's share to the means.
fn add(means: &mut [f64; 5], outputs: &Outputs, scene: &Scene) {
    let now = [
        outputs.cutting_force,
        outputs.thrust_force,
        outputs.chip_thickness,
        outputs.chip_temperature - scene.workpiece.initial_temperature,
        outputs.peak_strain_p999,
    ];
    means.iter_mut().zip(now).for_each(|(mean, value)| *mean += value / LOOKS as f64);
}

/// A text without what would end a field of the table.
fn plain(text: &str) -> String {
    text.replace([',', '\n', '"', '|'], ";")
}
