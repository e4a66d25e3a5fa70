//! What a run warns of on the way, once each: a tool that lags behind its feed, and one that comes to the
//! held side.

use super::run_state::{RunState, tool_lag};
use crate::error::Error;
use crate::setup;
use crate::setup::process::{FEEDS_TO_STOP, FEEDS_TO_WARN};
use crate::simulation::Solver;
use crate::variables::{length_text, time_text};

impl RunState {
    /// Adds what there is to say after a substep.
    ///
    /// # Errors
    /// `Error::NotAvailable` for a process that this version does not have.
    pub(super) fn warn(&mut self, solver: &dyn Solver, warnings: &mut Vec<String>) -> Result<(), Error> {
        let (scene, tool) = (&self.scene, solver.tool());
        let time = || shown(time_text, self.start + solver.progress().clock);
        if !self.warned.lag {
            let asked = self.inputs_now(solver).feed;
            let lag = tool_lag(scene, tool, asked);
            if lag.abs() > scene.numerics.point_spacing {
                self.warned.lag = true;
                warnings.push(format!(
                    "at {} the tool lags {} behind the feed asked for, {}: it follows a jump \
                     at no more than tool.feed_rate_limit = {} m/s (an input derivative exactly); output tool_lag tells \
                     how far it lags; this is said once",
                    time(),
                    shown(length_text, lag.abs()),
                    shown(length_text, asked),
                    scene.tool.feed_rate_limit
                ));
            }
        }
        if self.warned.stopped {
            return Ok(());
        }
        let left = setup::process_of(scene.kind)?.feeds_left(scene, tool);
        if left < FEEDS_TO_WARN && !self.warned.near {
            self.warned.near = true;
            warnings.push(format!(
                "at {} less than {FEEDS_TO_WARN} feeds are left between the tool and the workpiece's left side, \
                 which is held: the forces are the fixture's as well from here on, and the tool will stop at \
                 {FEEDS_TO_STOP} feed; a longer workpiece (workpiece.length) or a free side (workpiece.held_side = false) \
                 lets it go on",
                time()
            ));
        }
        if left < FEEDS_TO_STOP {
            self.warned.stopped = true;
            warnings.push(format!(
                "at {} the tool stopped {FEEDS_TO_STOP} feed before the workpiece's left side, which is held: \
                 it goes neither further nor deeper, whatever tool_velocity and feed are, and forces from here on are \
                 those on a tool at rest; it can go back or be lifted; a longer workpiece (workpiece.length) or a free \
                 side (workpiece.held_side = false) lets it go on",
                time()
            ));
        }
        Ok(())
    }
}

/// A quantity with five digits, as people write it.
fn shown(text: fn(f64) -> String, value: f64) -> String {
    text(format!("{value:.4e}").parse().unwrap_or(value))
}
