//! Time that passes while nothing can happen: a body that nothing has touched, and a tool that cannot reach
//! it.
//!
//! A substep of a body without stress or motion changes nothing but the clock and the tool's place; so these
//! alone are moved, by the same substeps and the same sums, and the state is the one that the substeps would
//! have left, bit by bit. How far time may pass so hangs on the state alone: whether a run is cut into many
//! communication steps or few makes no difference.
//!
//! A tool cannot reach the body
//!
//! * while the boxes around both are further apart than `REACH`, or
//! * while it stands where a substep in full has found that it does nothing.
//!
//! A body that has been touched rings for ever, and is computed. So is one in which heat flows.

use super::Simulation;
use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::material::ConstitutiveModel;
use crate::simd::Real;
use crate::simulation::solver::{Solver, ToolMotion};

/// Distance (cells) from which on no contact law sees a body: points and the tool's own reach two cells each,
/// lists of what is near one more, a substep's motion less than another.
const REACH: f64 = 8.0;

/// What is known of a body at rest; found again when it is not kept, so it is no part of a state.
#[derive(Clone, Debug, Default)]
pub(super) struct Waiting {
    /// Corners of the box around the body's points (m), while nothing has touched it.
    body: Option<[[f64; 2]; 2]>,
    /// Where the tool stood still in a substep that changed nothing (m).
    harmless: Option<[f64; 2]>,
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>> Simulation<R, D, F, M> {
    /// Whether the body is as it was placed: at rest, without stress, and without heat that flows.
    fn is_untouched(&self) -> bool {
        let progress = &self.progress;
        let ledger = &progress.ledger;
        progress.substeps > 0
            && !progress.touches.ever
            && progress.fastest == 0.0
            && ledger.initial_energy == 0.0
            && ledger.tool_work == 0.0
            && self.body_force.is_none()
            && self.conduction.as_ref().is_none_or(|conduction| self.is_even(conduction))
    }

    /// Remembers whether a substep with the tool at rest has left the body as it was.
    pub(super) fn note_harmless_tool(&mut self) {
        let is_at_rest = self.tool.velocity == [0.0; 2];
        self.waiting.harmless = (is_at_rest && self.is_untouched()).then_some(self.tool.position);
    }

    /// Lets a substep pass in which nothing can happen; whether it was one.
    pub(super) fn pass_substep(&mut self, motion: &ToolMotion) -> bool {
        if !self.is_untouched() {
            self.waiting = Waiting::default();
            return false;
        }
        let stands_still = motion.velocity == [0.0; 2] && self.waiting.harmless == Some(self.tool.position);
        if !stands_still && !self.is_out_of_reach() {
            return false;
        }
        self.tool.velocity = motion.velocity;
        self.tool.friction = motion.friction;
        let dt = self.time_step(motion);
        let [x, y] = motion.velocity;
        let distance = dt * x.hypot(y);
        self.tool.advance(dt);
        let progress = &mut self.progress;
        progress.distance_since_contact += distance;
        progress.tool_position = self.tool.position;
        progress.clock += dt;
        progress.last_step = dt;
        progress.substeps += 1;
        if self.conduction.is_some() {
            progress.heat.last_pass = progress.clock;
        }
        self.contact.note_motion(distance / self.partition.layout.cell);
        true
    }

    /// Whether no contact law can see the body from where the tool stands.
    fn is_out_of_reach(&mut self) -> bool {
        let body = match self.waiting.body {
            Some(body) => body,
            None => {
                let mut body = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
                self.visit_points(&mut |point| {
                    for axis in 0..2 {
                        body[0][axis] = body[0][axis].min(point.position[axis]);
                        body[1][axis] = body[1][axis].max(point.position[axis]);
                    }
                });
                *self.waiting.body.insert(body)
            }
        };
        let reach = REACH * self.partition.layout.cell;
        let (low, high) = self.tool.bounds();
        (0..2).any(|axis| low[axis] - body[1][axis] > reach || body[0][axis] - high[axis] > reach)
    }
}
