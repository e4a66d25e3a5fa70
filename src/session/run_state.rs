//! What a session keeps beside its solver: inputs and their slopes, and the totals between which means are
//! taken.

use crate::error::Error;
use crate::output::results::ResultsWriter;
use crate::scene::{Inputs, Scene};
use crate::setup;
use crate::setup::process::InputsNow;
use crate::simulation::solver::{Progress, Solver, ToolMotion};
use crate::tool::RigidTool;
use crate::variables::{COLUMNS, Outputs};
use serde::{Deserialize, Serialize};

/// RunTotals at one time, between which means are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct RunTotals {
    pub(super) time: f64,
    pub(super) impulse: [f64; 2],
    pub(super) work: f64,
    pub(super) contact_areas: [f64; 2],
    pub(super) substeps: u64,
}

impl RunTotals {
    pub(super) fn of(progress: &Progress) -> Self {
        let ledger = &progress.ledger;
        RunTotals {
            time: progress.clock,
            impulse: ledger.tool_impulse,
            work: ledger.tool_work,
            contact_areas: [progress.contact_areas.all, progress.contact_areas.sticking],
            substeps: progress.substeps,
        }
    }

    /// Finite only where every number is.
    fn sum(&self) -> f64 {
        let pairs = self.impulse.iter().chain(&self.contact_areas).sum::<f64>();
        self.time + self.work + pairs
    }

    /// RunTotals at `time` (s) within the last substep, during which they grew evenly.
    pub(super) fn between(before: &RunTotals, after: &RunTotals, time: f64) -> RunTotals {
        let length = after.time - before.time;
        let share = if length > 0.0 { ((time - before.time) / length).clamp(0.0, 1.0) } else { 1.0 };
        let mix = |a: f64, b: f64| a + share * (b - a);
        let pair = |a: [f64; 2], b: [f64; 2]| [mix(a[0], b[0]), mix(a[1], b[1])];
        RunTotals {
            time,
            impulse: pair(before.impulse, after.impulse),
            work: mix(before.work, after.work),
            contact_areas: pair(before.contact_areas, after.contact_areas),
            substeps: after.substeps,
        }
    }
}

/// What has been said; part of a saved state, so that a run says it once whatever it is cut into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Warned {
    /// The tool lags.
    pub(super) lag: bool,
    /// The held side is near.
    pub(super) near: bool,
    /// The tool stands still before it.
    pub(super) stopped: bool,
}

/// What a session keeps beside its solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct RunState {
    /// The scene as built.
    pub(super) scene: Scene,
    /// Time at which the solver's clock was zero (s).
    pub(super) start: f64,
    /// Last communication point, since the start (s).
    pub(super) time: f64,
    pub(super) inputs: Inputs,
    pub(super) slopes: Inputs,
    /// Time since the start at which the inputs were given (s).
    pub(super) inputs_time: f64,
    /// RunTotals at the last communication point, and before the last substep.
    pub(super) at_point: RunTotals,
    pub(super) before_substep: RunTotals,
    /// Cutting force behind the filter (N), now and its extremes in this communication step.
    pub(super) filtered_force: f64,
    pub(super) force_range: Option<[f64; 2]>,
    /// What has been warned of, which is not said again.
    pub(super) warned: Warned,
    pub(super) outputs: Outputs,
    pub(super) results: Option<ResultsWriter>,
}

impl RunState {
    /// Cutting speed (m/s) in the substep that starts now.
    pub(super) fn speed(&self, solver: &dyn Solver) -> f64 {
        let since = solver.progress().clock - self.inputs_time;
        self.inputs.tool_velocity + self.slopes.tool_velocity * since
    }

    /// The inputs at the solver's clock, their slopes taken in.
    pub(super) fn inputs_now(&self, solver: &dyn Solver) -> Inputs {
        let since = solver.progress().clock - self.inputs_time;
        let at = |value: f64, slope: f64| value + slope * since;
        Inputs {
            tool_velocity: self.speed(solver),
            feed: at(self.inputs.feed, self.slopes.feed),
            friction: at(self.inputs.friction, self.slopes.friction).max(0.0),
        }
    }

    /// The tool's motion in the substep that starts now.
    ///
    /// # Errors
    /// `Error::NotAvailable` for a process that this version does not have.
    pub(super) fn tool_motion(&self, solver: &dyn Solver) -> Result<ToolMotion, Error> {
        let inputs = self.inputs_now(solver);
        let now = InputsNow { inputs, feed_slope: self.slopes.feed };
        let process = setup::process_of(self.scene.kind)?;
        Ok(process.tool_motion(&self.scene, &now, solver.tool(), &|motion| solver.time_step(motion)))
    }

    /// Checks a state that was read from bytes against itself and what the solver has read; the text says
    /// what is wrong.
    ///
    /// The scene, the inputs' ranges and the points are checked by the session.
    pub(super) fn check(&self, progress: &Progress) -> Result<(), String> {
        let named = [
            ("start time", self.start),
            ("time", self.time),
            ("time of the inputs", self.inputs_time),
            ("filtered force", self.filtered_force),
            ("clock", progress.clock),
            ("time step", progress.last_step),
            ("mass factor", progress.mass_factor),
            ("energy ledger", progress.ledger.imbalance(0.0, 0.0)),
            ("tool's impulse", progress.ledger.tool_impulse.iter().sum()),
            ("retired heat", progress.ledger.retired_heat),
            ("tool's position", progress.tool_position.iter().sum()),
            ("fastest motion", progress.fastest),
            ("volume ratio", progress.volume_ratio),
            ("travel", progress.travel + progress.travel_unseen + progress.travel_uncontrolled),
            ("cut length", progress.cut_length + progress.distance_since_contact),
            (
                "contact",
                progress.contact_reach + progress.contact_areas.all + progress.contact_areas.sticking,
            ),
            ("heat", progress.heat.carry + progress.heat.waits() + progress.heat.friction_in_tool),
            ("tool's heat", progress.heat.contact + progress.heat.tool.iter().sum::<f64>()),
            ("slopes", self.slopes.tool_velocity + self.slopes.feed + self.slopes.friction),
            ("totals at the communication point", self.at_point.sum()),
            ("totals before the last substep", self.before_substep.sum()),
            ("range of forces", self.force_range.map_or(0.0, |range| range.iter().sum())),
        ];
        let outputs = COLUMNS.iter().map(|column| (column.name, (column.value)(&self.outputs)));
        if let Some((name, value)) = named.into_iter().chain(outputs).find(|(_, value)| !value.is_finite()) {
            return Err(format!("its {name} is {value}, which is not a finite number"));
        }
        let consistent = [
            (
                self.time >= 0.0 && progress.clock >= 0.0 && progress.last_step >= 0.0,
                "its times run backwards",
            ),
            (
                self.time <= progress.clock + progress.last_step,
                "its clock lies before its communication point",
            ),
            (self.inputs_time <= self.time, "its inputs are younger than it"),
            (self.at_point.time == self.time, "its totals are not those of its communication point"),
            (self.before_substep.time <= progress.clock, "its last substep ends before it begins"),
            (self.at_point.substeps <= progress.substeps, "it has made fewer substeps than it has counted"),
            (
                progress.mass_factor > 0.0 && progress.volume_ratio >= 0.0,
                "its masses or volumes are negative",
            ),
            (self.force_range.is_none_or(|[low, high]| low <= high), "its range of forces is empty"),
            (
                self.results.is_some() != self.scene.results.directory.is_empty(),
                "its results files are not those of its scene",
            ),
        ];
        match consistent.into_iter().find(|(holds, _)| !holds) {
            Some((_, text)) => Err(text.into()),
            None => Ok(()),
        }
    }
}

/// Feed asked for less the feed that the tool has reached (m).
///
/// Written as the tool's way to where it is to stand, which is exactly 0 for a tool that stands there.
pub(super) fn tool_lag(scene: &Scene, tool: &RigidTool, asked: f64) -> f64 {
    tool.position[1] - (scene.workpiece.height - asked)
}
