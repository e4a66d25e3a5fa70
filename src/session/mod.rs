//! A run as a co-simulation master sees it: inputs with slopes, communication points, outputs, saved states.
//!
//! The solver keeps its own clock. It runs ahead of the communication point by less than one substep; an input
//! counts from the first substep that starts at or after its communication point; means over a communication step
//! take the fraction of the last substep's impulse that belongs to it. So the state after a span of time does not
//! depend on how the span is cut into communication steps.

pub mod run_state;
pub mod cost_estimate;

use crate::checkpoint::StateBytes;
use crate::error::Error;
pub use crate::output::point_fields::{Outputs, PointFields};
use crate::output::results::ResultsWriter;
use crate::output::survey::{Survey, shear_angle};
use crate::parallel::in_pool;
use crate::scene::presets;
use crate::scene::{Inputs, Scene};
use crate::session::cost_estimate::Estimate;
use crate::session::run_state::{RunState, RunTotals};
use crate::setup;
use crate::setup::checks;
use crate::simulation::{Progress, Solver, Touches};
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// Time constant of the first-order filter behind `cutting_force_min` and `cutting_force_max` (s).
pub const FORCE_FILTER: f64 = 5e-8;
/// Points per thread below which a further thread costs more than it brings: two are 1.6 times one with 7,500 points, which have three
/// chunks, 1.3 times with 4,800, which have two, and with one chunk not at all.
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
}

impl Clone for Session {
    fn clone(&self) -> Self {
        Session { run: self.run.clone(), solver: self.solver.fork() }
    }
}

impl Session {
    /// Checks the scene and builds its points, grid and tool at rest, at `start_time` (s).
    ///
    /// # Errors
    /// A value out of range, values that do not go together, an effect that this version does not have, or a
    /// results directory that cannot be used.
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
        let scene = checks::check(scene)?;
        let solver = setup::build(&scene)?;
        let results = ResultsWriter::new(&scene, parameters)?;
        let run = RunState {
            start: start_time,
            time: 0.0,
            inputs: scene.inputs,
            slopes: Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 },
            inputs_time: 0.0,
            at_point: RunTotals::default(),
            before_substep: RunTotals::default(),
            filtered_force: 0.0,
            force_range: None,
            outputs: Outputs::default(),
            results,
            scene,
        };
        let mut session = Session { run, solver };
        session.survey();
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

    /// Estimates what the run from here to `stop_time` (s) takes with the present inputs, and shows it as an output.
    ///
    /// # Errors
    /// `Error::Unstable` when a copy of the solver cannot make its first substeps, as this one then could not.
    pub fn estimate(&mut self, stop_time: f64) -> Result<Estimate, Error> {
        let run = &mut self.run;
        let duration = (stop_time - run.start - self.solver.progress().clock).max(0.0);
        let estimate = cost_estimate::of_run(self.solver.as_ref(), &run.scene, &run.inputs, duration)?;
        run.outputs.estimated_cpu_time = estimate.cpu_seconds;
        Ok(estimate)
    }

    /// Checks inputs that depend on the scene.
    ///
    /// # Errors
    /// `Error::OutOfRange` for a feed that leaves less than two cells below the tool.
    pub fn check_inputs(&self, inputs: &Inputs) -> Result<(), Error> {
        setup::process_of(self.run.scene.kind)?.check_inputs(&self.run.scene, inputs)
    }

    /// Inputs from the present communication point on; slopes (per second) are all zero unless given.
    pub fn set_inputs(&mut self, inputs: Inputs, slopes: Inputs) {
        let run = &mut self.run;
        run.inputs = inputs;
        run.slopes = slopes;
        run.inputs_time = run.time;
    }

    /// Runs the substeps up to the communication point `time` (s) and updates the outputs.
    ///
    /// `watch` is called between substeps with the solver's clock (s), at least every 0.1 s of wall time; when it
    /// returns false the run stops at a substep, with `Advance::StoppedAt`, and can go on by calling again.
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
            return self.communicate(end, Advance::Reached);
        }
        let threads = self.threads();
        let advance = if threads == 1 {
            self.run_to(end, false, watch)
        } else {
            match in_pool(threads, || self.run_to(end, true, watch)) {
                Ok(advance) => advance,
                // Without threads of our own (a sandbox, a limit on processes) the work is done on the caller's.
                Err(_) => self.run_to(end, false, watch),
            }
        }?;
        let reached = match advance {
            Advance::Reached => end,
            Advance::StoppedAt(clock) => clock - self.run.start,
        };
        self.communicate(reached, advance)
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
        self.write_due_frame()?;
        Ok(Advance::Reached)
    }

    /// One substep with the inputs of its start, and the filtered force after it.
    fn substep(&mut self, parallel: bool) -> Result<(), Error> {
        let run = &mut self.run;
        let before = RunTotals::of(self.solver.progress());
        self.solver.scale_mass(run.speed(self.solver.as_ref()).abs());
        let drive = run.drive(self.solver.as_ref());
        self.solver.step(&drive, parallel)?;
        let after = RunTotals::of(self.solver.progress());
        let dt = after.time - before.time;
        let force = (before.impulse[0] - after.impulse[0]) / dt;
        run.filtered_force += dt / (FORCE_FILTER + dt) * (force - run.filtered_force);
        let [low, high] = run.force_range.unwrap_or([run.filtered_force; 2]);
        run.force_range = Some([low.min(run.filtered_force), high.max(run.filtered_force)]);
        run.before_substep = before;
        Ok(())
    }

    /// Outputs at the communication point `end` (since the start, s).
    fn communicate(&mut self, end: f64, advance: Advance) -> Result<Advance, Error> {
        let after = RunTotals::of(self.solver.progress());
        let ran = after.substeps > self.run.at_point.substeps;
        if ran {
            self.survey();
            if !self.run.outputs.balance_error.is_finite() {
                return Err(Error::Unstable(format!(
                    "the run became unstable by t = {end:.6e} s: the energy of its points is no finite number"
                )));
            }
        }
        let run = &mut self.run;
        let now = RunTotals::between(&run.before_substep, &after, end);
        let last = run.at_point;
        let outputs = &mut run.outputs;
        let span = now.time - last.time;
        if span > 0.0 {
            // The tool pushes the workpiece; the workpiece pushes back.
            outputs.cutting_force = (last.impulse[0] - now.impulse[0]) / span;
            outputs.thrust_force = (last.impulse[1] - now.impulse[1]) / span;
            outputs.cutting_power = (now.work - last.work) / span;
            let [all, sticking] = [0, 1].map(|k| now.contact_areas[k] - last.contact_areas[k]);
            outputs.sticking_share = if all > 0.0 { (sticking / all).clamp(0.0, 1.0) } else { 0.0 };
        }
        let [low, high] = run.force_range.take().unwrap_or([run.filtered_force; 2]);
        (outputs.cutting_force_min, outputs.cutting_force_max) = (low, high);
        outputs.substeps = i32::try_from(after.substeps - last.substeps).unwrap_or(i32::MAX);
        let removed = run.inputs.tool_velocity.abs() * run.outputs_feed() * run.scene.workpiece.width;
        let outputs = &mut run.outputs;
        outputs.specific_cutting_energy =
            if outputs.chip_thickness > 0.0 && removed > 0.0 { outputs.cutting_power / removed } else { 0.0 };
        run.at_point = now;
        run.time = end;
        Ok(advance)
    }

    /// Outputs that describe the state: energies, chip, extremes.
    fn survey(&mut self) {
        let progress = self.solver.progress();
        let tool = self.solver.tool();
        let run = &mut self.run;
        let workpiece = &run.scene.workpiece;
        let feed = (workpiece.height - tool.position[1]).max(0.0);
        let mut survey = Survey::new();
        self.solver.visit_points(&mut |point| survey.count(point, tool, feed));
        let ledger = &progress.ledger;
        let constants = &run.scene.material.constants;
        let outputs = &mut run.outputs;
        outputs.chip_temperature = survey.chip_temperature().unwrap_or(workpiece.initial_temperature);
        outputs.chip_temperature_peak = survey.peak_temperature;
        outputs.peak_strain = survey.peak_strain;
        outputs.peak_strain_p999 = survey.strain_p999();
        outputs.chip_thickness = survey.chip_thickness(feed, workpiece.width);
        outputs.shear_angle = shear_angle(feed, outputs.chip_thickness, run.scene.tool.rake_angle);
        outputs.contact_length = progress.contact_reach;
        outputs.cut_length = progress.cut_length;
        outputs.tool_work = ledger.tool_work;
        outputs.kinetic_energy = survey.kinetic;
        outputs.elastic_energy = survey.elastic;
        outputs.plastic_work = ledger.plastic_work;
        outputs.damage_work = ledger.damage_work;
        outputs.viscous_work = ledger.viscous_work;
        outputs.friction_work = ledger.friction_work;
        outputs.damping = ledger.damping;
        outputs.thermoelastic = ledger.thermoelastic;
        outputs.contact_loss = ledger.contact_loss;
        outputs.retired_energy = ledger.retired_energy;
        outputs.thermal_energy =
            survey.heat + ledger.retired_heat + progress.heat.carry + progress.heat.waits();
        outputs.tool_heat = progress.heat.friction_in_tool + progress.heat.contact;
        let hottest = progress.heat.tool.iter().fold(0.0, |most: f64, &rise| most.max(rise));
        outputs.tool_temperature_peak = workpiece.initial_temperature + hottest;
        // Before the tool has worked: what a feed × feed × width block holds elastically at yield.
        let yield_energy = constants.yield_stress.powi(2) / (2.0 * constants.youngs_modulus);
        let scale = ledger.tool_work.abs().max(feed * feed * workpiece.width * yield_energy);
        let imbalance = ledger.imbalance(survey.kinetic, survey.elastic);
        outputs.balance_error = if scale > 0.0 { imbalance / scale } else { 0.0 };
        outputs.time_step = progress.last_step;
        outputs.mass_factor = progress.mass_factor;
        outputs.surplus_kinetic_energy = survey.kinetic * (1.0 - 1.0 / progress.mass_factor);
        outputs.mass_scaling_energy = ledger.mass_scaling;
        outputs.retries = i32::try_from(progress.retries).unwrap_or(i32::MAX);
        outputs.stray_velocities = i32::try_from(progress.null_space_velocities).unwrap_or(i32::MAX);
        outputs.active_points = i32::try_from(self.solver.points()).unwrap_or(i32::MAX);
        outputs.retired_points = i32::try_from(ledger.retired_points).unwrap_or(i32::MAX);
        outputs.min_jacobian = survey.min_jacobian;
        outputs.force_error_band = presets::force_error_band(&run.scene, feed);
        [outputs.tool_position_x, outputs.tool_position_y] = tool.position;
        let has_chip = survey.chip_temperature().is_some();
        // A substep without a touch is not the end: points come and go by ones. A point's width without any is.
        let spacing = run.scene.numerics.point_spacing;
        outputs.chip_state = match progress.touches {
            Touches { ever: false, .. } => 1,
            _ if progress.distance_since_contact > spacing => 4,
            _ if has_chip && progress.cut_length > feed => 3,
            _ => 2,
        };
    }

    /// Outputs at the last communication point.
    pub fn outputs(&self) -> &Outputs {
        &self.run.outputs
    }

    /// Fastest motion of a point along an axis in the last substep (m/s).
    pub fn fastest_motion(&self) -> f64 {
        self.solver.progress().fastest
    }

    /// Memory of one point's state (bytes).
    pub fn bytes_per_point(&self) -> usize {
        self.solver.bytes_per_point()
    }

    /// The points' fields at the solver's clock.
    pub fn point_fields(&self) -> PointFields {
        let mut fields =
            PointFields { time: self.run.start + self.solver.progress().clock, ..Default::default() };
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
        }
        let tool = self.solver.tool();
        let outline = tool.shape.outline(16).into_iter();
        fields.tool_outline = outline.map(|[x, y]| [x + tool.position[0], y + tool.position[1]]).collect();
        fields.tool_velocity = tool.velocity;
        fields
    }

    fn write_due_frame(&mut self) -> Result<(), Error> {
        let time = self.run.start + self.solver.progress().clock;
        if self.run.results.as_ref().is_some_and(|results| results.due(time)) {
            self.survey();
            let fields = self.point_fields();
            if let Some(results) = &mut self.run.results {
                results.write_frame(&fields, &self.run.outputs)?;
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

    /// The whole state as bytes, with version, length and checksum.
    pub fn save(&self) -> Vec<u8> {
        let saved =
            SavedRef { run: &self.run, progress: self.solver.progress(), bulk: &self.solver.state_bytes() };
        let body = postcard::to_stdvec(&saved).expect("plain data always serialises to memory");
        let mut bytes = Vec::with_capacity(body.len() + HEAD);
        bytes.extend_from_slice(&MAGIC);
        bytes.extend_from_slice(&(body.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&crc32fast::hash(&body).to_le_bytes());
        bytes.extend_from_slice(&body);
        bytes
    }

    /// A session from `save`d bytes, of the same version of the program.
    ///
    /// # Errors
    /// `Error::DamagedState` when anything does not fit.
    pub fn restore(bytes: &[u8]) -> Result<Self, Error> {
        let damaged = |text: &str| Error::DamagedState(text.into());
        let (head, body) =
            bytes.split_at_checked(HEAD).ok_or_else(|| damaged("it is shorter than its head"))?;
        if head[..8] != MAGIC {
            return Err(damaged(&format!("it is not a state of swarf {}", crate::version::VERSION)));
        }
        let number = |range: std::ops::Range<usize>| {
            head[range].iter().rev().fold(0_u64, |sum, &byte| sum << 8 | u64::from(byte))
        };
        if number(8..16) != body.len() as u64 {
            return Err(damaged(&format!(
                "it has {} bytes where {} are announced",
                body.len(),
                number(8..16)
            )));
        }
        if number(16..20) != u64::from(crc32fast::hash(body)) {
            return Err(damaged("its checksum does not fit"));
        }
        let saved: Saved = postcard::from_bytes(body).map_err(|_| damaged("its content cannot be read"))?;
        let scene = checks::check(&saved.run.scene).map_err(|error| damaged(&error.to_string()))?;
        let mut solver = setup::build(&scene)?;
        solver.restore(&saved.bulk, &saved.progress)?;
        Ok(Session { run: saved.run, solver })
    }
}

/// First bytes of a serialised state: format 7.
const MAGIC: [u8; 8] = *b"swarfst7";
/// Bytes before the body: magic, length, checksum.
const HEAD: usize = 20;

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
