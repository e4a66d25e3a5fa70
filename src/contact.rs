//! The rigid tool in motion, and what its contact does to the grid's velocities.
//!
//! Contact acts on nodes as an exchange of momentum: the part of a node's velocity that enters the tool is taken
//! away, and of the sliding part as much as Coulomb friction allows. The impulse m (v − v_trial) is the force on the
//! workpiece times the substep.

use crate::dimension::Dimension;
use crate::tool_shape::{Face, ToolShape};

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

/// What contact makes of a node.
#[derive(Clone, Copy, Debug)]
pub struct Correction<D: Dimension> {
    /// The node's velocity after contact (m/s).
    pub velocity: D::Vector<f64>,
    /// Sliding velocity relative to the tool after contact (m/s).
    pub slip: D::Vector<f64>,
    /// Unit normal out of the tool.
    pub normal: [f64; 2],
    /// Coordinate along the rake face (m), if the node faces it.
    pub rake_coordinate: Option<f64>,
}

/// A contact law between the tool and a node of the workpiece.
pub trait ContactLaw: Clone + Send + Sync + 'static {
    /// The correction of a node at `position` (m) that would move with `velocity` (m/s), if it is in contact.
    fn correct<D: Dimension>(
        &self,
        tool: &RigidTool,
        position: [f64; 2],
        velocity: &D::Vector<f64>,
    ) -> Option<Correction<D>>;
}

/// Contact at the exact surface: a node takes part when it lies inside the tool and moves into it.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceContact;

impl ContactLaw for SurfaceContact {
    #[inline(always)]
    fn correct<D: Dimension>(
        &self,
        tool: &RigidTool,
        position: [f64; 2],
        velocity: &D::Vector<f64>,
    ) -> Option<Correction<D>> {
        let closest = tool.shape.closest([position[0] - tool.position[0], position[1] - tool.position[1]]);
        if closest.distance >= 0.0 {
            return None;
        }
        let rake_coordinate = (closest.face == Face::Rake).then_some(closest.along);
        coulomb::<D>(tool, closest.normal, rake_coordinate, velocity)
    }
}

/// Takes away the approach to a surface of unit `normal` and the sliding that friction stops.
#[inline(always)]
fn coulomb<D: Dimension>(
    tool: &RigidTool,
    normal: [f64; 2],
    rake_coordinate: Option<f64>,
    velocity: &D::Vector<f64>,
) -> Option<Correction<D>> {
    let of_tool = |axis: usize| if axis < 2 { tool.velocity[axis] } else { 0.0 };
    let across = |axis: usize| if axis < 2 { normal[axis] } else { 0.0 };
    let relative = D::vector(|axis| velocity[axis] - of_tool(axis));
    let approach: f64 = (0..D::AXES).map(|axis| relative[axis] * across(axis)).sum();
    if approach >= 0.0 {
        return None;
    }
    let sliding = D::vector(|axis| relative[axis] - approach * across(axis));
    let speed = (0..D::AXES).map(|axis| sliding[axis] * sliding[axis]).sum::<f64>().sqrt();
    // Friction impulse ≤ μ times normal impulse; at most it stops the sliding.
    let kept = if speed > 0.0 { (1.0 + tool.friction * approach / speed).max(0.0) } else { 0.0 };
    let slip = D::vector(|axis| sliding[axis] * kept);
    Some(Correction { velocity: D::vector(|axis| of_tool(axis) + slip[axis]), slip, normal, rake_coordinate })
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
