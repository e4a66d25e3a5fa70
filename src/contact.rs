//! The rigid tool in motion, and what its contact does to the grid's velocities.
//!
//! Contact acts on nodes as an exchange of momentum: the part of a node's velocity that enters the tool is taken
//! away, and of the sliding part as much as Coulomb friction allows. The impulse m (v − v_trial) is the force on the
//! workpiece times the substep.
//!
//! The grid sees the surface no sharper than a cell, so points may still enter the tool by part of one, where
//! they are crushed. `Obstacle` puts them back on its surface, with the same exchange of momentum.

use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::points::{BLOCK, Block};
use crate::simd::Real;
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

/// What pushing points out of the tool adds up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PushSums {
    /// Impulse of the tool on the workpiece (N s).
    pub impulse: [f64; 2],
    /// Work of that impulse at the tool's velocity (J).
    pub tool_work: f64,
    /// Friction work (J).
    pub friction_work: f64,
    /// Lost in the inelastic push (J).
    pub loss: f64,
}

/// The tool as an obstacle to single points.
pub struct Obstacle<'a> {
    tool: &'a RigidTool,
    density: f64,
    /// Nodes around the tool along x and y.
    low: [i32; 2],
    high: [i32; 2],
}

impl<'a> Obstacle<'a> {
    /// The tool among the nodes of a layout; `density` (kg/m3) gives a point's mass from its volume.
    pub fn new(tool: &'a RigidTool, layout: &Layout, density: f64) -> Self {
        let (low, high) = tool.bounds();
        let index = |axis: usize, x: f64| (x - layout.origin[axis]) / layout.cell;
        Obstacle {
            tool,
            density,
            low: [index(0, low[0]).floor() as i32, index(1, low[1]).floor() as i32],
            high: [index(0, high[0]).ceil() as i32, index(1, high[1]).ceil() as i32],
        }
    }

    /// Puts the points of a block that are inside the tool on its surface, and stops their approach.
    pub fn push_out<R: Real, D: Dimension, S>(
        &self,
        block: &mut Block<R, D, S>,
        layout: &Layout,
        sums: &mut PushSums,
    ) {
        for lane in 0..BLOCK {
            let near =
                (0..2).all(|axis| (self.low[axis]..=self.high[axis]).contains(&block.node[axis][lane]));
            if !near || block.volume[lane] <= R::ZERO {
                continue;
            }
            let position: [f64; 2] = std::array::from_fn(|axis| {
                let cells = f64::from(block.node[axis][lane]) + block.offset[axis][lane].to_f64();
                layout.origin[axis] + layout.cell * cells
            });
            let tool = self.tool;
            let closest =
                tool.shape.closest([position[0] - tool.position[0], position[1] - tool.position[1]]);
            if closest.distance >= 0.0 {
                continue;
            }
            for axis in 0..2 {
                let cells =
                    block.offset[axis][lane].to_f64() - closest.distance * closest.normal[axis] / layout.cell;
                let shift = cells.round();
                block.node[axis][lane] += shift as i32;
                block.offset[axis][lane] = R::from_f64(cells - shift);
            }
            let old = D::vector(|axis| block.velocity[axis][lane].to_f64());
            let Some(contact) = coulomb::<D>(tool, closest.normal, None, &old) else { continue };
            let mass = self.density * block.volume[lane].to_f64();
            let (mut work, mut tool_work, mut friction) = (0.0, 0.0, 0.0);
            for axis in 0..D::AXES {
                let impulse = mass * (contact.velocity[axis] - old[axis]);
                block.velocity[axis][lane] = R::from_f64(contact.velocity[axis]);
                work += impulse * 0.5 * (old[axis] + contact.velocity[axis]);
                friction -= impulse * contact.slip[axis];
                if axis < 2 {
                    sums.impulse[axis] += impulse;
                    tool_work += impulse * tool.velocity[axis];
                }
            }
            sums.tool_work += tool_work;
            sums.friction_work += friction;
            // What the tool put in and neither friction nor the body took.
            sums.loss += tool_work - friction - work;
        }
    }
}
