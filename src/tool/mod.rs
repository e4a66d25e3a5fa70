//! The rigid tool: where it is, how it moves, and its cross-section.
//!
//! [`profile`] is the exact shape; contact laws, heat and pictures take the tool from here and change nothing
//! in it.

pub mod profile;

use profile::ToolShape;

/// The tool's shape, place and motion.
#[derive(Clone, Debug)]
pub struct RigidTool {
    /// Cross-section; its origin is the tool's lowest point.
    pub shape: ToolShape,
    /// Position of the lowest point from the workpiece's lower left corner (m).
    pub position: [f64; 2],
    /// Velocity (m/s).
    pub velocity: [f64; 2],
    /// Coulomb coefficient (-).
    pub friction: f64,
}

impl RigidTool {
    /// Moves the tool through a substep (s).
    pub fn advance(&mut self, dt: f64) {
        for axis in 0..2 {
            self.position[axis] += dt * self.velocity[axis];
        }
    }

    /// Corners of the box around the tool (m).
    pub fn bounds(&self) -> ([f64; 2], [f64; 2]) {
        let (low, high) = self.shape.bounds();
        let moved = |corner: [f64; 2]| [corner[0] + self.position[0], corner[1] + self.position[1]];
        (moved(low), moved(high))
    }
}
