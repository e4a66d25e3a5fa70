//! A run as a co-simulation master sees it: inputs with slopes, communication points, outputs, saved states.
//!
//! The solver keeps its own clock. It runs ahead of the communication point by less than one substep; an
//! input counts from the first substep that starts at or after its communication point; means over a
//! communication step take the fraction of the last substep's impulse that belongs to it. So the state after
//! a span of time does not depend on how the span is cut into communication steps.
//!
//! * this file: `Session`, its checks, how it advances, its bytes;
//! * `outputs`: what is shown at a communication point, by the table of `variables::outputs`;
//! * `run_state`: what a session keeps beside its solver, all of it part of a saved state;
//! * `warnings`: what a run says on the way, once each;
//! * `cost_estimate`: what a run will cost.
//!
//! What may be touched: a new field of `RunState` changes the bytes of a state and needs a new format number
//! below and a check in `RunState::check`; substeps read nothing but `RunState` and the solver, or a saved
//! state would go another way.

pub mod cost_estimate;
mod outputs;
mod run_state;
mod warnings;

use crate::checkpoint::{Envelope, StateBytes};
use crate::error::Error;
pub use crate::output::point_fields::PointFields;
use crate::output::results::ResultsWriter;
use crate::parallel::in_pool;
use crate::scene::{Inputs, Scene};
use crate::setup;
use crate::setup::checks;
use crate::simulation::{Progress, Solver};
use crate::variables;
pub use crate::variables::Outputs;
use cost_estimate::Estimate;
use run_state::{RunState, RunTotals, Warned};
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// Time constant of the first-order filter behind `cutting_force_min` and `cutting_force_max` (s).
const FORCE_FILTER: f64 = 5e-8;
/// Points per thread below which a further thread costs more than it brings: two are 1.6 times one with 7,500
/// points, which have three chunks, 1.3 times with 4,800, which have two, and with one chunk not at all.
const POINTS_PER_THREAD: usize = 3000;
/// Longest wall time between two calls of the watcher.
const WATCH_INTERVAL: Duration = Duration::from_millis(100);

/// How far `advance_to` came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Advance {
    /// The time asked for was reached.
    Reached,
    /// The wall time limit or the watcher stopped it at this time (s); it can go on.
    StoppedAt(f64),
}

/// One run of one scene.
pub struct Session {
    run: RunState,
    solver: Box<dyn Solver>,
    /// Warnings that nobody has taken yet; no part of a saved state.
    warnings: Vec<String>,
    /// Substeps that passed without a look at a point, since this session was made; no part of it either.
    passed: u64,
}

impl Clone for Session {
    fn clone(&self) -> Self {
        let warnings = self.warnings.clone();
        Session { run: self.run.clone(), solver: self.solver.fork(), warnings, passed: self.passed }
    }
}

impl Session {
    /// Checks the scene and builds its points, grid and tool at rest, at `start_time` (s).
    ///
    /// # Errors
    /// A value out of range or not finite, values that do not go together, an effect that this version does
    /// not have, or a results directory that cannot be used.
    pub fn new(scene: &Scene, start_time: f64) -> Result<Self, Error> {
        Self::with_parameters(scene, start_time, &[])
    }

    /// The same; `parameters` (names and values in use) are written into every results file.
    ///
    /// # Errors
    /// As `new`.
    pub fn with_parameters(
        scene: &Scene,
        start_time: f64,
        parameters: &[(String, String)],
    ) -> Result<Self, Error> {
        if !start_time.is_finite() {
            return Err(Error::Inconsistent(format!("start time {start_time} s is not a finite number")));
        }
        let scene = checked(scene)?;
        let warnings = checks::warnings(&scene);
        let solver = setup::build(&scene)?;
        let cut_block = setup::process_of(scene.kind)?.cut_block(&scene);
        let results = ResultsWriter::new(&scene, cut_block, parameters)?;
        let run = RunState {
            start: start_time,
            time: 0.0,
            inputs: scene.inputs,
            slopes: NO_SLOPES,
            inputs_time: 0.0,
            at_point: RunTotals::default(),
            before_substep: RunTotals::default(),
            filtered_force: 0.0,
            force_range: None,
            warned: Warned::default(),
            outputs: Outputs::default(),
            results,
            scene,
        };
        let mut session = Session { run, solver, warnings, passed: 0 };
        session.run.survey(session.solver.as_ref());
        Ok(session)
    }

    /// The scene as built (a library material's constants filled in).
    pub fn scene(&self) -> &Scene {
        &self.run.scene
    }

    /// The last communication point (s).
    pub fn time(&self) -> f64 {
        self.run.start + self.run.time
    }

    /// Estimates what the run from here to `stop_time` (s) takes with the present inputs on a machine that
    /// has the scene's `numerics.point_rate`, and shows it as an output.
    ///
    /// # Errors
    /// What building a coarser copy of a large scene refuses.
    pub fn estimate(&mut self, stop_time: f64) -> Result<Estimate, Error> {
        let duration = self.time_to(stop_time);
        let run = &mut self.run;
        let estimate = cost_estimate::of_run(self.solver.as_ref(), &run.scene, &run.inputs, duration)?;
        run.outputs.estimated_cpu_time = estimate.cpu_seconds;
        Ok(estimate)
    }

    /// CPU time (s) of the same run on this machine under its present load; changes nothing.
    ///
    /// # Errors
    /// `Error::Unstable` when a copy of the solver cannot make its first substeps, as this one then could
    /// not.
    pub fn estimate_on_this_machine(&self, stop_time: f64) -> Result<f64, Error> {
        let (run, duration) = (&self.run, self.time_to(stop_time));
        cost_estimate::on_this_machine(self.solver.as_ref(), &run.scene, &run.inputs, duration)
    }

    /// Time from the solver's clock to `stop_time` (both s).
    fn time_to(&self, stop_time: f64) -> f64 {
        (stop_time - self.run.start - self.solver.progress().clock).max(0.0)
    }

    /// Checks values of the inputs against the table's ranges and the scene.
    ///
    /// # Errors
    /// `Error::OutOfRange` for a value out of range or not finite, for a feed that leaves less than two cells
    /// below the tool, and for one that lifts it by more than the workpiece height.
    pub fn check_inputs(&self, inputs: &Inputs) -> Result<(), Error> {
        variables::check_inputs(inputs)?;
        setup::process_of(self.run.scene.kind)?.check_inputs(&self.run.scene, inputs)
    }

    /// Inputs from the present communication point on; slopes (per second) are all zero unless given.
    ///
    /// # Errors
    /// What `check_inputs` refuses, and a slope that is not finite; the old inputs are kept then. Where
    /// slopes lead is the caller's to check, who knows how long they hold.
    pub fn set_inputs(&mut self, inputs: Inputs, slopes: Inputs) -> Result<(), Error> {
        self.check_inputs(&inputs)?;
        variables::check_slopes(&slopes)?;
        let run = &mut self.run;
        run.inputs = inputs;
        run.slopes = slopes;
        run.inputs_time = run.time;
        Ok(())
    }

    /// Runs the substeps up to the communication point `time` (s) and updates the outputs.
    ///
    /// `watch` is called between substeps with the solver's clock (s), at least every 0.1 s of wall time;
    /// when it returns false the run stops at a substep, with `Advance::StoppedAt`, and can go on by calling
    /// again.
    ///
    /// # Errors
    /// `Error::Unstable` when the solver cannot go on, `Error::File` when a result cannot be written.
    pub fn advance_to(
        &mut self,
        time: f64,
        watch: &mut (dyn FnMut(f64) -> bool + Send),
    ) -> Result<Advance, Error> {
        let end = time - self.run.start;
        if !self.is_behind(end) {
            self.run.communicate(self.solver.as_ref(), end)?;
            return Ok(Advance::Reached);
        }
        let threads = self.threads();
        let advance = if threads == 1 {
            self.run_to(end, false, watch)
        } else {
            match in_pool(threads, || self.run_to(end, true, watch)) {
                Ok(advance) => advance,
                // Without threads of our own (a sandbox, a limit on processes) the work is done on the
                // caller's.
                Err(_) => self.run_to(end, false, watch),
            }
        }?;
        let reached = match advance {
            Advance::Reached => end,
            Advance::StoppedAt(clock) => clock - self.run.start,
        };
        self.run.communicate(self.solver.as_ref(), reached)?;
        if advance == Advance::Reached {
            // After the outputs, so that its row of the history holds what they are at this communication
            // point.
            self.write_due_frame()?;
        }
        Ok(advance)
    }

    /// Whether the solver's clock has not reached `end`; a billionth of a substep is rounding.
    fn is_behind(&self, end: f64) -> bool {
        let progress = self.solver.progress();
        progress.clock < end - 1e-9 * progress.last_step
    }

    /// Threads that pay for this scene.
    fn threads(&self) -> usize {
        let available = std::thread::available_parallelism().map_or(1, usize::from);
        let asked = self.run.scene.numerics.threads;
        let most = if asked > 0 { asked as usize } else { available };
        most.min(self.solver.points() / POINTS_PER_THREAD).max(1)
    }

    /// Substeps until the clock reaches `end` or someone stops it.
    fn run_to(
        &mut self,
        end: f64,
        parallel: bool,
        watch: &mut (dyn FnMut(f64) -> bool + Send),
    ) -> Result<Advance, Error> {
        let started = Instant::now();
        let mut watched = started;
        let limit = self.run.scene.numerics.wall_time_limit;
        while self.is_behind(end) {
            self.write_due_frame()?;
            self.substep(parallel)?;
            let now = Instant::now();
            if limit > 0.0 && (now - started).as_secs_f64() > limit && self.is_behind(end) {
                return Ok(Advance::StoppedAt(self.run.start + self.solver.progress().clock));
            }
            if now - watched > WATCH_INTERVAL {
                watched = now;
                let clock = self.run.start + self.solver.progress().clock;
                if !watch(clock) && self.is_behind(end) {
                    return Ok(Advance::StoppedAt(clock));
                }
            }
        }
        Ok(Advance::Reached)
    }

    /// One substep with the inputs of its start, and the filtered force after it.
    fn substep(&mut self, parallel: bool) -> Result<(), Error> {
        let run = &mut self.run;
        let before = RunTotals::of(self.solver.progress());
        self.solver.scale_mass(run.speed(self.solver.as_ref()).abs());
        let motion = run.tool_motion(self.solver.as_ref())?;
        if self.solver.pass(&motion) {
            self.passed += 1;
        } else {
            self.solver.step(&motion, parallel)?;
        }
        let after = RunTotals::of(self.solver.progress());
        let dt = after.time - before.time;
        let force = (before.impulse[0] - after.impulse[0]) / dt;
        run.filtered_force += dt / (FORCE_FILTER + dt) * (force - run.filtered_force);
        let [low, high] = run.force_range.unwrap_or([run.filtered_force; 2]);
        run.force_range = Some([low.min(run.filtered_force), high.max(run.filtered_force)]);
        run.before_substep = before;
        run.warn(self.solver.as_ref(), &mut self.warnings)
    }

    /// What there is to warn of since this was last asked: at the start of the scene's values, then of the
    /// run.
    pub fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }

    /// Outputs at the last communication point.
    pub fn outputs(&self) -> &Outputs {
        &self.run.outputs
    }

    /// Fastest motion of a point along an axis in the last substep (m/s).
    pub fn fastest_motion(&self) -> f64 {
        self.solver.progress().fastest
    }

    /// Substeps that cost nothing because nothing could happen in them: the tool had not reached a workpiece
    /// at rest. They count as all others; only this session knows of them, no state does.
    pub fn passed_substeps(&self) -> u64 {
        self.passed
    }

    /// Memory of one point's state (bytes).
    pub fn bytes_per_point(&self) -> usize {
        self.solver.bytes_per_point()
    }

    /// The points' fields at the solver's clock.
    pub fn point_fields(&self) -> PointFields {
        let (time, cell) = (self.run.start + self.solver.progress().clock, self.run.scene.numerics.cell());
        let mut fields = PointFields { time, cell, ..Default::default() };
        let mut points = Vec::with_capacity(self.solver.points());
        self.solver.visit_points(&mut |point| points.push(*point));
        points.sort_unstable_by_key(|point| point.id);
        for point in points {
            fields.id.push(point.id);
            fields.mass.push(point.mass);
            fields.position.push(point.position);
            fields.velocity.push(point.velocity);
            fields.stress.push(point.report.stress);
            fields.plastic_strain.push(point.report.plastic_strain);
            fields.temperature.push(point.report.temperature);
            fields.jacobian.push(point.report.jacobian);
            fields.damage.push(point.report.damage);
            fields.tail.push(point.is_tail);
        }
        let tool = self.solver.tool();
        let outline = tool.shape.outline(16).into_iter();
        fields.tool_outline = outline.map(|[x, y]| [x + tool.position[0], y + tool.position[1]]).collect();
        fields.tool_velocity = tool.velocity;
        fields
    }

    fn write_due_frame(&mut self) -> Result<(), Error> {
        let clock = self.run.start + self.solver.progress().clock;
        if self.run.results.as_ref().is_some_and(|results| results.due(clock)) {
            let fields = self.point_fields();
            let (time, outputs) = self.run.outputs_now(self.solver.as_ref());
            if let Some(results) = &mut self.run.results {
                results.write_frame(&fields, time, &outputs)?;
            }
        }
        Ok(())
    }

    /// One line that says which effects run and why.
    pub fn effects_summary(&self) -> String {
        setup::effects_summary(&self.run.scene)
    }

    /// What the results writer has to say at the start, if there is one.
    pub fn results_notice(&self) -> Option<&str> {
        self.run.results.as_ref().map(ResultsWriter::notice)
    }

    /// Lets another run write into `results.directory`; this one takes it up again with its next frame, if it
    /// is free then.
    pub fn release_results(&mut self) {
        if let Some(results) = &mut self.run.results {
            results.release();
        }
    }

    /// The whole state as bytes, with version, length and checksum.
    pub fn save(&self) -> Vec<u8> {
        ENVELOPE.seal(&[&self.to_bytes()])
    }

    /// A session from `save`d bytes, of the same version of the program.
    ///
    /// # Errors
    /// `Error::DamagedState` when anything does not fit.
    pub fn restore(bytes: &[u8]) -> Result<Self, Error> {
        let session = Session::from_bytes(ENVELOPE.open(bytes)?)?;
        session.check_run()?;
        Ok(session)
    }

    /// The whole state as bytes that go into an envelope.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let saved =
            SavedRef { run: &self.run, progress: self.solver.progress(), bulk: &self.solver.state_bytes() };
        postcard::to_stdvec(&saved).expect("plain data always serialises to memory")
    }

    /// A session from the bytes that `to_bytes` gave, every value of its scene checked; `check_run` checks
    /// the rest.
    ///
    /// # Errors
    /// `Error::DamagedState` when anything does not fit.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let unreadable = |_| damaged("its content cannot be read");
        let (saved, rest): (Saved, _) = postcard::take_from_bytes(bytes).map_err(unreadable)?;
        if !rest.is_empty() {
            return Err(damaged("there is more in it than a state"));
        }
        // What is saved is the scene as built, which its own check leaves as it is.
        let scene = checked(&saved.run.scene).map_err(|error| damaged(&error.to_string()))?;
        let mut solver = setup::build(&scene)?;
        solver.restore(&saved.bulk, &saved.progress)?;
        Ok(Session { run: saved.run, solver, warnings: Vec::new(), passed: 0 })
    }

    /// Checks every value of a run that was read from bytes and is to go on: totals, outputs, inputs, points.
    ///
    /// # Errors
    /// `Error::DamagedState` naming what is wrong.
    pub(crate) fn check_run(&self) -> Result<(), Error> {
        self.run.check(self.solver.progress()).map_err(|text| damaged(&text))?;
        self.check_inputs(&self.run.inputs).map_err(|error| damaged(&error.to_string()))?;
        self.check_points()
    }

    /// Refuses points that no run leaves behind.
    fn check_points(&self) -> Result<(), Error> {
        let mut wrong = None;
        self.solver.visit_points(&mut |point| {
            let report = &point.report;
            let numbers = point.position.iter().chain(&point.velocity).chain(&report.stress);
            let positive = [point.mass, point.volume, report.jacobian];
            let at_least_zero = [report.plastic_strain, report.temperature];
            let is_sound = numbers.copied().all(f64::is_finite)
                && positive.iter().all(|value| value.is_finite() && *value > 0.0)
                && at_least_zero.iter().all(|value| value.is_finite() && *value >= 0.0);
            if !is_sound {
                wrong = Some(point.id);
            }
        });
        match wrong {
            Some(id) => Err(damaged(&format!("the numbers of point {id} are none of a body"))),
            None => Ok(()),
        }
    }
}

fn damaged(text: &str) -> Error {
    Error::DamagedState(text.into())
}

/// Checks every value of a scene, by itself and with the others, and fills in what follows from them.
fn checked(scene: &Scene) -> Result<Scene, Error> {
    variables::check_ranges(scene)?;
    checks::check(scene)
}

/// Slopes of inputs that keep their values.
const NO_SLOPES: Inputs = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };

/// What stands around a serialised state: format 10.
const ENVELOPE: Envelope = Envelope { word: *b"SWARFRUN", format: 10, origin: &[], of: "swarf" };

#[derive(Serialize)]
struct SavedRef<'a> {
    run: &'a RunState,
    progress: &'a Progress,
    bulk: &'a StateBytes,
}

#[derive(Deserialize)]
struct Saved {
    run: RunState,
    progress: Progress,
    bulk: StateBytes,
}
