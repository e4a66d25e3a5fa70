//! The rigid tool in motion, the contact laws, and Coulomb's law at a node.
//!
//! `Surface` acts at the material points (`contact::surface`). The other laws act on nodes (`contact::nodal`, `partition::chunk`) as an exchange
//! of momentum: the part of a node's velocity that enters the tool is taken away, and of the sliding part as much as
//! Coulomb friction allows. The impulse m (v − v_trial) is the force on the workpiece times the substep.

pub mod nodes;
pub mod surface;
pub mod gauss_seidel;
pub mod sticking;
pub mod nodal;
pub mod tool_particles;

use crate::dimension::Dimension;
use crate::tool::RigidTool;
use crate::tool::profile::Face;

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

/// What a substep's contact acts on, and when. A choice outside the kernels: it compiles none more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// Points, where their edge meets the tool's exact surface.
    Surface,
    /// Nodes shared with a tool made of points that is no further than half a cell away: the paper's eqs. 19 to 23.
    Distance,
    /// Nodes shared with a tool made of points: eq. 18.
    Velocity,
    /// Nodes that lie inside the tool and move into it: the oldest law here, kept as the one that a plain loop over nodes
    /// can be held against. No scene has it.
    NodesInside,
}

impl Contact {
    /// The correction of a node at `position` (m) that would move with `velocity` (m/s), if it is in contact.
    pub fn correct<D: Dimension>(
        self,
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
pub fn coulomb<D: Dimension>(
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::{PlaneStrain, ThreeDimensional};
    use crate::tool::profile::ToolShape;

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
                let contact = Contact::NodesInside.correct::<PlaneStrain>(&tool, INSIDE, &velocity);
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
        assert!(Contact::NodesInside.correct::<PlaneStrain>(&tool, ahead, &[0.0, 0.0]).is_none());
        assert!(Contact::NodesInside.correct::<PlaneStrain>(&tool, INSIDE, &[-60.0, 0.0]).is_none());
    }

    /// In space friction acts along the whole sliding velocity, also across the cut.
    #[test]
    fn sideways_sliding_is_braked_in_its_own_direction() {
        let tool = tool(0.2);
        let velocity = [0.0, 0.0, 20.0];
        let contact =
            Contact::NodesInside.correct::<ThreeDimensional>(&tool, INSIDE, &velocity).expect("contact");
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
