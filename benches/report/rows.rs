//! Speed of whole cuts at several sizes, through the same calls as an FMI master's.
//!
//! A cut is first run at four times its speed until a chip has formed or the row's point-steps for that are
//! spent, then for a while at its own; what is measured after that is stated with the share of points that
//! yield. CPU seconds are the process's. The critical thread is the one with most CPU time of the run; it
//! decides how long a quiet machine takes. On a busy machine it also takes over work from a thread that does
//! not get its turn, and looks worse than it is.

use crate::phases::median;
use cpu_time::ProcessTime;
use serde_json::{Value, json};
use std::collections::HashMap;
use std::time::Duration;
use swarf::scene::{DimensionChoice, Inputs, Precision, Scene};
use swarf::session::{Advance, Session};

/// Speed while the chip forms (m/s); and the cut's own.
const WARM_UP_SPEED: f64 = 200.0;
const SPEED: f64 = 50.0;

/// A scene and its threads.
pub struct Row {
    name: String,
    scene: Scene,
}

/// How much a row's measurement may take.
#[derive(Clone, Copy)]
pub struct Effort {
    /// Point-steps for the chip to form: a number that is the same for any threads.
    pub warm_up: f64,
    /// CPU seconds of the critical thread for each sample.
    pub sample: f64,
    /// Number of samples.
    pub samples: usize,
}

/// A row's result.
pub struct Measured {
    points: usize,
    /// Travel of the tool before the first sample (m).
    travel: f64,
    /// Share of the points that yield (-), mean over one substep after each sample.
    pub yielding: f64,
    substeps: u32,
    /// Point-steps per CPU second, and per CPU second of the critical thread: medians.
    pub rate: f64,
    pub critical_rate: f64,
    /// All samples of the first.
    rates: Vec<f64>,
}

impl Row {
    /// The reference cut at a point spacing (m).
    pub fn plane_strain(spacing: f64, precision: Precision, threads: i32) -> Self {
        let mut scene = Scene::default();
        scene.numerics.point_spacing = spacing;
        scene.numerics.precision = precision;
        scene.numerics.threads = threads;
        let bits = if precision == Precision::Single { "f32" } else { "f64" };
        Row { name: format!("plane strain {bits}"), scene }
    }

    /// A scene of 2,000 points.
    pub fn small(threads: i32) -> Self {
        let mut row = Row::plane_strain(2e-5, Precision::Double, threads);
        row.scene.workpiece.length = 1e-3;
        row.scene.workpiece.height = 8e-4;
        row
    }

    /// A cut in space, 151 × 76 × 16 = 183,616 points.
    pub fn three_dimensional(precision: Precision, threads: i32) -> Self {
        let mut row = Row::plane_strain(1e-5, precision, threads);
        row.scene.numerics.dimension = DimensionChoice::ThreeDimensional;
        row.scene.workpiece.length = 1.51e-3;
        row.scene.workpiece.height = 0.76e-3;
        row.scene.workpiece.width = 0.16e-3;
        row.name = row.name.replace("plane strain", "3D GIMP");
        row
    }

    /// Threads asked for.
    pub fn threads(&self) -> i32 {
        self.scene.numerics.threads
    }

    /// Whether the row is in single precision.
    pub fn is_single(&self) -> bool {
        self.scene.numerics.precision == Precision::Single
    }

    /// Whether the row is in space.
    pub fn is_three_dimensional(&self) -> bool {
        self.scene.numerics.dimension == DimensionChoice::ThreeDimensional
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Runs it.
    ///
    /// # Errors
    /// What the program says against the scene, or of its end.
    pub fn measure(&self, effort: Effort) -> Result<Measured, String> {
        let mut session = Session::new(&self.scene, 0.0).map_err(|e| e.to_string())?;
        // One substep tells how long they are.
        session.advance_to(1e-12, &mut |_| true).map_err(|e| e.to_string())?;
        let points = session.outputs().active_points as usize;
        let most = effort.warm_up / points as f64 * session.outputs().time_step;
        let mut formed = 0.0;
        for (speed, travel, share) in [(WARM_UP_SPEED, 3e-4, 0.9), (SPEED, 2e-6, 0.1)] {
            let inputs = Inputs { tool_velocity: speed, ..self.scene.inputs };
            session
                .set_inputs(inputs, Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 })
                .map_err(|e| e.to_string())?;
            let span = f64::min(travel / speed, share * most);
            let end = session.time() + span;
            session.advance_to(end, &mut |_| true).map_err(|e| e.to_string())?;
            formed += span * speed;
        }
        let (mut rates, mut critical, mut substeps, mut yielding) = (vec![], vec![], 0, 0.0);
        for _ in 0..effort.samples {
            // Each sample starts from the same state: a small cut would be over after the first.
            let mut session = session.clone();
            let sample = run(&mut session, effort.sample)?;
            let steps = session.outputs().substeps;
            substeps += steps as u32;
            let point_steps = points as f64 * f64::from(steps);
            rates.push(point_steps / sample.process);
            critical.push(point_steps / sample.critical);
            yielding += yielding_share(&mut session)? / effort.samples as f64;
        }
        Ok(Measured {
            points,
            travel: formed,
            yielding,
            substeps,
            critical_rate: median(&mut critical),
            rate: median(&mut rates.clone()),
            rates,
        })
    }
}

impl Measured {
    /// One line of the table.
    pub fn line(&self, row: &Row, share_of_peak: f64, ratio: f64) -> String {
        format!(
            "{:<18} {:>9} {:>3} {:>9.2} {:>9.2} {:>7.1} {:>7.2} {:>7.1} {:>8.3}",
            row.name,
            self.points,
            row.threads(),
            self.rate / 1e6,
            self.critical_rate / 1e6,
            100.0 * share_of_peak,
            ratio,
            100.0 * self.yielding,
            self.travel * 1e3
        )
    }

    /// The same for the file.
    pub fn to_json(&self, row: &Row, share_of_peak: f64, ratio: f64) -> Value {
        json!({
            "name": row.name,
            "points": self.points,
            "threads": row.threads(),
            "point_steps_per_cpu_s": self.rate,
            "samples": self.rates,
            "point_steps_per_critical_cpu_s": self.critical_rate,
            "share_of_peak": share_of_peak,
            "ratio_to_plain_loop": ratio,
            "yielding_share": self.yielding,
            "tool_travel_before_m": self.travel,
            "substeps": self.substeps,
        })
    }
}

/// CPU seconds of a run.
struct Sample {
    process: f64,
    critical: f64,
}

/// Advances until the critical thread has used `seconds` of CPU time or the tool has travelled 0.3 mm.
fn run(session: &mut Session, seconds: f64) -> Result<Sample, String> {
    let (process, threads) = (ProcessTime::now(), thread_times());
    let mut sample = Sample { process: 0.0, critical: 0.0 };
    let mut take = || {
        sample.process = process.elapsed().as_secs_f64();
        let used = thread_times().into_iter();
        let used = used.map(|(thread, time)| time - threads.get(&thread).copied().unwrap_or_default());
        // Without the system's word on threads they are taken as one.
        sample.critical = used.max().map_or(sample.process, |time| time.as_secs_f64());
        sample.critical < seconds
    };
    // A second of cutting is never reached.
    let end = session.time() + 1.0;
    let cut = session.time() + 3e-4 / SPEED;
    match session.advance_to(end, &mut |clock| take() && clock < cut).map_err(|e| e.to_string())? {
        Advance::StoppedAt(_) => Ok(sample),
        Advance::Reached => Err("the cut ended before the measurement".into()),
    }
}

/// CPU time of each thread of this process, from Linux's scheduler; empty elsewhere.
fn thread_times() -> HashMap<u64, Duration> {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return HashMap::new() };
    let time = |task: std::fs::DirEntry| {
        let thread = task.file_name().to_str()?.parse().ok()?;
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        Some((thread, Duration::from_nanos(text.split_whitespace().next()?.parse().ok()?)))
    };
    tasks.flatten().filter_map(time).collect()
}

/// Share of the points whose plastic strain grows in one substep.
fn yielding_share(session: &mut Session) -> Result<f64, String> {
    let before = session.point_fields().plastic_strain;
    let end = session.time() + 0.5 * session.outputs().time_step;
    session.advance_to(end, &mut |_| true).map_err(|e| e.to_string())?;
    let now = session.point_fields().plastic_strain;
    let grown = now.iter().zip(&before).filter(|(now, before)| now > before).count();
    Ok(grown as f64 / now.len().max(1) as f64)
}
