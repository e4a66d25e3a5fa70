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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::{PlaneStrain, ThreeDimensional};

    fn tool(friction: f64) -> RigidTool {
        let shape = ToolShape::new(0.1, 0.0873, 0.0, 5e-4, 1e-3).expect("a plain wedge");
        RigidTool { shape, position: [1e-3, 7e-4], velocity: [-50.0, 0.0], friction }
    }

    /// A node 1 µm behind the rake face, half way up.
    const INSIDE: [f64; 2] = [1e-3 + 5e-4 * 0.100_334_672_085_450_5 + 1e-6, 1.2e-3];

    /// The impulse of contact lies in the cone of friction: it pushes, sliding ends on the cone's side, and what sticks
    /// stays within. Afterwards nothing enters the tool.
    #[test]
    fn contact_impulse_lies_in_the_cone_of_friction() {
        for friction in [0.0, 0.2, 1.0] {
            for velocity in [[0.0, 0.0], [10.0, 30.0], [-30.0, -40.0], [-49.0, 3.0], [200.0, -7.0]] {
                let tool = tool(friction);
                let contact = SurfaceContact.correct::<PlaneStrain>(&tool, INSIDE, &velocity);
                let contact = contact.unwrap_or_else(|| panic!("{velocity:?} m/s moves into the tool"));
                let impulse = [contact.velocity[0] - velocity[0], contact.velocity[1] - velocity[1]];
                let push = impulse[0] * contact.normal[0] + impulse[1] * contact.normal[1];
                let drag = impulse[0] * contact.normal[1] - impulse[1] * contact.normal[0];
                // A few roundings of velocities up to 250 m/s.
                let bound = 1e-12 * 250.0;
                assert!(
                    push > 0.0 && drag.abs() <= friction * push + bound,
                    "push {push}, drag {drag} at {velocity:?}"
                );
                let slides = contact.slip.iter().any(|&v| v.abs() > bound);
                assert!(
                    !slides || (drag.abs() - friction * push).abs() < bound,
                    "slides inside the cone: {push}, {drag}"
                );
                let enters = (contact.velocity[0] + 50.0) * contact.normal[0]
                    + contact.velocity[1] * contact.normal[1];
                assert!(enters.abs() < bound, "still approaches at {enters} m/s");
            }
        }
    }

    /// Outside the tool, and moving away from it, a node is left alone: contact does not pull.
    #[test]
    fn nothing_outside_or_departing_is_touched() {
        let tool = tool(0.2);
        let ahead = [INSIDE[0] - 3e-6, INSIDE[1]];
        assert!(SurfaceContact.correct::<PlaneStrain>(&tool, ahead, &[0.0, 0.0]).is_none());
        assert!(SurfaceContact.correct::<PlaneStrain>(&tool, INSIDE, &[-60.0, 0.0]).is_none());
    }

    /// In space friction acts along the whole sliding velocity, also across the cut.
    #[test]
    fn sideways_sliding_is_braked_in_its_own_direction() {
        let tool = tool(0.2);
        let velocity = [0.0, 0.0, 20.0];
        let contact = SurfaceContact.correct::<ThreeDimensional>(&tool, INSIDE, &velocity).expect("contact");
        // Sliding along the rake face, which leans by 0.1 rad, comes from the tool's own motion.
        let face = [-contact.normal[1], contact.normal[0]];
        let along = |v: &[f64; 3]| (v[0] - tool.velocity[0]) * face[0] + v[1] * face[1];
        let (before, after) = (along(&velocity), along(&contact.velocity));
        let kept = (after / before, contact.velocity[2] / velocity[2]);
        // A few roundings.
        assert!(
            (kept.0 - kept.1).abs() < 1e-14,
            "{} of the slip is kept along the cut, {} across",
            kept.0,
            kept.1
        );
        let push = 50.0 * contact.normal[0].abs();
        let braked = (before * before + 400.0).sqrt() * (1.0 - kept.0);
        assert!((braked - 0.2 * push).abs() < 1e-12 * push, "braked by {braked} m/s, pushed by {push} m/s");
    }
}
