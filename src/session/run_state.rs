//! What a session keeps beside its solver: inputs and their slopes, and the totals between which means are taken.

use crate::output::point_fields::Outputs;
use crate::output::results::ResultsWriter;
use crate::scene::{Inputs, Scene};
use crate::simulation::solver::{Progress, Solver, ToolMotion};
use serde::{Deserialize, Serialize};

/// RunTotals at one time, between which means are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RunTotals {
    pub(crate) time: f64,
    pub(crate) impulse: [f64; 2],
    pub(crate) work: f64,
    pub(crate) contact_areas: [f64; 2],
    pub(crate) substeps: u64,
}

impl RunTotals {
    pub(crate) fn of(progress: &Progress) -> Self {
        let ledger = &progress.ledger;
        RunTotals {
            time: progress.clock,
            impulse: ledger.tool_impulse,
            work: ledger.tool_work,
            contact_areas: [progress.contact_areas.all, progress.contact_areas.sticking],
            substeps: progress.substeps,
        }
    }

    /// RunTotals at `time` (s) within the last substep, during which they grew evenly.
    pub(crate) fn between(before: &RunTotals, after: &RunTotals, time: f64) -> RunTotals {
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

/// What a session keeps beside its solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RunState {
    /// The scene as built.
    pub(crate) scene: Scene,
    /// Time at which the solver's clock was zero (s).
    pub(crate) start: f64,
    /// Last communication point, since the start (s).
    pub(crate) time: f64,
    pub(crate) inputs: Inputs,
    pub(crate) slopes: Inputs,
    /// Time since the start at which the inputs were given (s).
    pub(crate) inputs_time: f64,
    /// RunTotals at the last communication point, and before the last substep.
    pub(crate) at_point: RunTotals,
    pub(crate) before_substep: RunTotals,
    /// Cutting force behind the filter (N), now and its extremes in this communication step.
    pub(crate) filtered_force: f64,
    pub(crate) force_range: Option<[f64; 2]>,
    pub(crate) outputs: Outputs,
    pub(crate) results: Option<ResultsWriter>,
}

impl RunState {
    /// Cutting speed (m/s) in the substep that starts now.
    pub(crate) fn speed(&self, solver: &dyn Solver) -> f64 {
        let since = solver.progress().clock - self.inputs_time;
        self.inputs.tool_velocity + self.slopes.tool_velocity * since
    }

    /// The tool's motion in the substep that starts now.
    ///
    /// Vertically the tool follows the slope of the feed exactly, and makes up a jump no faster than
    /// `tool.feed_rate_limit`.
    pub(crate) fn drive(&self, solver: &dyn Solver) -> ToolMotion {
        let since = solver.progress().clock - self.inputs_time;
        let at = |value: f64, slope: f64| value + slope * since;
        let speed = self.speed(solver);
        let feed = at(self.inputs.feed, self.slopes.feed);
        let friction = at(self.inputs.friction, self.slopes.friction).max(0.0);
        let limit = self.scene.tool.feed_rate_limit;
        let deviation = self.scene.workpiece.height - feed - solver.tool().position[1];
        let trial = ToolMotion { velocity: [-speed, limit], friction };
        let catch_up = (deviation / solver.time_step(&trial)).clamp(-limit, limit);
        ToolMotion { velocity: [-speed, catch_up - self.slopes.feed], friction }
    }

    /// Feed that the last substep cut at (m).
    pub(crate) fn outputs_feed(&self) -> f64 {
        (self.scene.workpiece.height - self.outputs.tool_position_y).max(0.0)
    }
}
