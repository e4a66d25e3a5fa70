//! Outputs of a run: what the table of `variables::outputs` says of each, read from the solver.
//!
//! * outputs of the state (energies, chip, extremes) are read from the points and totals at the solver's
//!   clock;
//! * outputs of a step (means, extremes of the filtered force) are those since the last communication point.
//!   A mean is the difference of running totals over the time between; where no substep ends in between it is
//!   the last substep's own, as the difference would be one of rounding.
//!
//! To touch for a new output: its entry in the table, and what it reads here if that is not here yet.

use super::run_state::{RunState, RunTotals, tool_lag};
use crate::energy::ledger::Ledger;
use crate::error::Error;
use crate::heat::HeatTotals;
use crate::output::survey::{Face, Survey, shear_angle};
use crate::scene::{Heat, Scene, presets};
use crate::simulation::{Progress, Solver, Touches};
use crate::tool::RigidTool;
use crate::variables::{ChipState, Outputs, outputs, time_text};

/// What outputs of the state are read from.
struct Readings<'a> {
    scene: &'a Scene,
    tool: &'a RigidTool,
    progress: &'a Progress,
    ledger: &'a Ledger,
    heat: &'a HeatTotals,
    /// Points that substeps move.
    points: usize,
    /// Depth of the tool's lowest point below the workpiece's top (m).
    feed: f64,
    /// Feed asked for less feed reached (m).
    tool_lag: f64,
    /// Sums over the points.
    survey: Survey,
}

impl<'a> Readings<'a> {
    /// Of the solver's present state.
    ///
    /// * `asked`: the feed asked for at the solver's clock (m)
    fn of(scene: &'a Scene, solver: &'a dyn Solver, asked: f64) -> Self {
        let (progress, tool) = (solver.progress(), solver.tool());
        let feed = (scene.workpiece.height - tool.position[1]).max(0.0);
        let constants = &scene.material.constants;
        let softens = scene.effects.thermal_softening && scene.effects.heat != Heat::None;
        let melting = if softens { constants.melting_temperature } else { f64::INFINITY };
        let mut survey = Survey::new(Face { layer: scene.numerics.cell(), melting });
        solver.visit_points(&mut |point| survey.count(point, tool, feed));
        let (ledger, heat) = (&progress.ledger, &progress.heat);
        let tool_lag = tool_lag(scene, tool, asked);
        Readings { scene, tool, progress, ledger, heat, points: solver.points(), feed, tool_lag, survey }
    }

    /// Mean chip thickness normal to the rake face (m).
    fn chip_thickness(&self) -> f64 {
        self.survey.chip_thickness(self.feed, self.scene.workpiece.width)
    }

    /// Mean temperature of the chip (K); the initial one before there is a chip.
    fn chip_temperature(&self) -> f64 {
        self.survey.chip_temperature().unwrap_or(self.scene.workpiece.initial_temperature)
    }

    /// Largest rise of temperature in the tool (K).
    fn hottest_of_tool(&self) -> f64 {
        self.heat.tool.iter().fold(0.0, |most: f64, &rise| most.max(rise))
    }

    /// Unaccounted energy over the tool's work; before the tool has worked, over what a feed × feed × width
    /// block holds elastically at yield (-).
    fn balance_error(&self) -> f64 {
        let constants = &self.scene.material.constants;
        let yield_energy = constants.yield_stress.powi(2) / (2.0 * constants.youngs_modulus);
        let block = self.feed * self.feed * self.scene.workpiece.width * yield_energy;
        let scale = self.ledger.tool_work.abs().max(block);
        let imbalance = self.ledger.imbalance(self.survey.kinetic, self.survey.elastic);
        if scale > 0.0 { imbalance / scale } else { 0.0 }
    }

    /// Share of the cutting force that it may be off by (-); 1 over a molten face, of which the list knows
    /// nothing.
    fn force_error_band(&self) -> f64 {
        if self.survey.is_face_molten() { 1.0 } else { presets::force_error_band(self.scene, self.feed) }
    }

    /// How far the cut has come.
    fn chip_state(&self) -> ChipState {
        // A substep without a touch is not the end: points come and go by ones. A point's width without any
        // is.
        let spacing = self.scene.numerics.point_spacing;
        let has_chip = self.survey.chip_temperature().is_some();
        match self.progress.touches {
            Touches { ever: false, .. } => ChipState::Approaching,
            _ if self.progress.distance_since_contact > spacing => ChipState::Left,
            _ if has_chip && self.progress.cut_length > self.feed => ChipState::Cutting,
            _ => ChipState::Entering,
        }
    }
}

/// What outputs of a communication step are read from.
struct StepReadings {
    /// Mean force of the workpiece on the tool (N): along the cut, and normal to it.
    force: [f64; 2],
    /// Mean work rate of the tool (W).
    power: f64,
    /// Mean share of the area of contact that sticks (-).
    sticking_share: f64,
    /// Extremes of the filtered cutting force (N).
    force_range: [f64; 2],
    /// Substeps made.
    substeps: u64,
    /// Volume that the tool removes in a second (m3/s), if there is a chip.
    removal: Option<f64>,
}

impl StepReadings {
    /// Cutting power over removed volume rate (J/m3); 0 where nothing is removed.
    fn specific_energy(&self) -> f64 {
        self.removal.map_or(0.0, |removal| self.power / removal)
    }
}

/// A count as FMI's Integer.
fn count(number: impl TryInto<i32>) -> i32 {
    number.try_into().unwrap_or(i32::MAX)
}

/// Fills in an output, if its value comes from what is named first.
macro_rules! fill {
    (state $readings:ident $outputs:ident $place:ident state |$from:ident| $value:expr) => {
        let $from = $readings;
        $outputs.$place = $value;
    };
    (step $readings:ident $outputs:ident $place:ident step |$from:ident| $value:expr) => {
        let $from = $readings;
        $outputs.$place = $value;
    };
    ($kind:ident $readings:ident $outputs:ident $place:ident $($other:tt)*) => {};
}

/// The functions that fill in outputs, from the sources of the table.
macro_rules! functions {
    ($($place:ident {
        variable: $reference:literal $name:literal $kind:ident($($argument:expr),*),
        meaning: $meaning:literal,
        source: $source:ident $(|$from:ident| $value:expr)?,
    })+) => {
        /// Outputs of the state.
        fn fill_state(outputs: &mut Outputs, readings: &Readings) {
            $(fill! { state readings outputs $place $source $(|$from| $value)? })+
        }

        /// Outputs of a communication step.
        fn fill_step(outputs: &mut Outputs, readings: &StepReadings) {
            $(fill! { step readings outputs $place $source $(|$from| $value)? })+
        }
    };
}
outputs!(functions);

impl RunState {
    /// What is shown of the step from the last communication point on.
    ///
    /// * `outputs`: those of the state at the step's end
    /// * `after`: totals after the last substep
    /// * `now`: totals at the step's end, within the last substep
    fn step_readings(&self, outputs: &Outputs, after: &RunTotals, now: &RunTotals) -> StepReadings {
        let last = &self.at_point;
        // Between which totals means are taken. In a span within the last substep, during which all grow
        // evenly, those around the substep; without any span the means stay what they were.
        let is_within_substep = last.time >= self.before_substep.time;
        let (from, to) = if is_within_substep { (&self.before_substep, after) } else { (last, now) };
        let span = to.time - from.time;
        let (force, power, sticking_share) = if now.time > last.time && span > 0.0 {
            let [all, sticking] = [0, 1].map(|k| to.contact_areas[k] - from.contact_areas[k]);
            (
                // The tool pushes the workpiece; the workpiece pushes back.
                [0, 1].map(|k| (from.impulse[k] - to.impulse[k]) / span),
                (to.work - from.work) / span,
                if all > 0.0 { (sticking / all).clamp(0.0, 1.0) } else { 0.0 },
            )
        } else {
            ([outputs.cutting_force, outputs.thrust_force], outputs.cutting_power, outputs.sticking_share)
        };
        let workpiece = &self.scene.workpiece;
        let feed = (workpiece.height - outputs.tool_position_y).max(0.0);
        let removal = self.inputs.tool_velocity.abs() * feed * workpiece.width;
        StepReadings {
            force,
            power,
            sticking_share,
            force_range: self.force_range.unwrap_or([self.filtered_force; 2]),
            substeps: after.substeps - last.substeps,
            removal: (outputs.chip_thickness > 0.0 && removal > 0.0).then_some(removal),
        }
    }

    /// Brings the outputs of the state up to date.
    pub(super) fn survey(&mut self, solver: &dyn Solver) {
        let asked = self.inputs_now(solver).feed;
        fill_state(&mut self.outputs, &Readings::of(&self.scene, solver, asked));
    }

    /// Outputs at the communication point `end` (since the start, s), which is the last one from here on.
    ///
    /// # Errors
    /// `Error::Unstable` when the energy of the points is no finite number.
    pub(super) fn communicate(&mut self, solver: &dyn Solver, end: f64) -> Result<(), Error> {
        let after = RunTotals::of(solver.progress());
        if after.substeps > self.at_point.substeps {
            self.survey(solver);
            if !self.outputs.balance_error.is_finite() {
                return Err(Error::Unstable(format!(
                    "the run became unstable by t = {}: the energy of its points is no finite number",
                    time_text(end)
                )));
            }
        }
        let now = RunTotals::between(&self.before_substep, &after, end);
        let readings = self.step_readings(&self.outputs, &after, &now);
        fill_step(&mut self.outputs, &readings);
        self.force_range = None;
        self.at_point = now;
        self.time = end;
        Ok(())
    }

    /// Time (s) and outputs as the FMU would return them now, were the solver's clock a communication point;
    /// at a communication point these are that point's.
    pub(super) fn outputs_now(&self, solver: &dyn Solver) -> (f64, Outputs) {
        let after = RunTotals::of(solver.progress());
        let mut outputs = self.outputs.clone();
        if after.substeps == self.at_point.substeps {
            return (self.start + self.time, outputs);
        }
        let asked = self.inputs_now(solver).feed;
        fill_state(&mut outputs, &Readings::of(&self.scene, solver, asked));
        let now = RunTotals::between(&self.before_substep, &after, after.time);
        let readings = self.step_readings(&outputs, &after, &now);
        fill_step(&mut outputs, &readings);
        (self.start + after.time, outputs)
    }
}
