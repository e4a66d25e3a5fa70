//! Coulomb's law at a node, as an exchange of momentum with the tool.
//!
//! The part of a node's velocity that enters the tool is taken away, and of the sliding part as much as
//! Coulomb friction allows. The impulse m (v − v_trial) is the force on the workpiece times the substep.

use crate::contact::nodes::NodePredictor;
use crate::dimension::Dimension;
use crate::partition::nodes::{NodalImpulses, NodeSums, VelocityChange};
use crate::tool::RigidTool;
use crate::tool::profile::Closest;

/// What contact makes of a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Correction<D: Dimension> {
    /// The node's velocity after contact (m/s).
    pub(super) velocity: D::Vector<f64>,
    /// Sliding velocity relative to the tool after contact (m/s).
    pub(super) slip: D::Vector<f64>,
    /// Unit normal out of the tool.
    normal: [f64; 2],
}

impl<D: Dimension> Correction<D> {
    /// Square of the velocity change along the directions that contact prescribes: the normal, and all when
    /// the node sticks.
    fn prescribed_square(&self, change: &D::Vector<f64>) -> f64 {
        if self.slip.as_ref().iter().all(|&component| component == 0.0) {
            change.as_ref().iter().map(|component| component * component).sum()
        } else {
            (change[0] * self.normal[0] + change[1] * self.normal[1]).powi(2)
        }
    }
}

/// A node that the tool may touch.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrialNode {
    /// What it does without contact.
    pub(super) start: NodePredictor,
    /// Where the tool is closest to it.
    pub(super) closest: Closest,
}

impl TrialNode {
    /// Exchanges momentum with the tool, if the node approaches it; returns whether it does.
    ///
    /// Notes in `touched` the node's change of velocity, what it adds to the sums and, if that is wanted, its
    /// friction heat.
    pub(super) fn exchange<D: Dimension>(
        &self,
        tool: &RigidTool,
        wants_heat: bool,
        touched: &mut NodalImpulses,
    ) -> bool {
        let NodePredictor { index, free, inverse_mass, .. } = self.start;
        // A node that is fixed along all axes cannot be pushed.
        let largest = inverse_mass.into_iter().fold(0.0, f64::max);
        if largest == 0.0 {
            return false;
        }
        let trial = D::vector(|axis| free[axis]);
        let Some(mut contact) = coulomb::<D>(tool, self.closest.normal, &trial) else { return false };
        for axis in (0..D::AXES).filter(|&axis| inverse_mass[axis] == 0.0) {
            contact.velocity[axis] = free[axis];
        }
        let friction = self.count(&mut touched.sums, tool, 1.0 / largest, &contact);
        if wants_heat && friction > 0.0 {
            touched.friction_heat.push((index, friction));
        }
        let mut change = [0.0; 3];
        for axis in 0..D::AXES {
            change[axis] = contact.velocity[axis] - free[axis];
        }
        touched.nodes.push(VelocityChange { node: index, change });
        true
    }

    /// Counts the contact of the node, of `mass` (kg); returns its friction work (J).
    fn count<D: Dimension>(
        &self,
        sums: &mut NodeSums,
        tool: &RigidTool,
        mass: f64,
        contact: &Correction<D>,
    ) -> f64 {
        let NodePredictor { free, old, .. } = self.start;
        let change = D::vector(|axis| contact.velocity[axis] - old[axis]);
        let impulse = D::vector(|axis| mass * (contact.velocity[axis] - free[axis]));
        let tool_work = impulse[0] * tool.velocity[0] + impulse[1] * tool.velocity[1];
        // The friction impulse is the tangential part; only it works on the slip.
        let friction = -(0..D::AXES).map(|axis| impulse[axis] * contact.slip[axis]).sum::<f64>();
        sums.tool_impulse[0] += impulse[0];
        sums.tool_impulse[1] += impulse[1];
        sums.tool_work += tool_work;
        sums.friction_work += friction;
        sums.contact_loss += 0.5 * mass * contact.prescribed_square(&change);
        sums.contact_reach = sums.contact_reach.max(self.closest.along);
        sums.touches = true;
        friction
    }
}

/// Takes away the approach to a surface of unit `normal` and the sliding that friction stops.
#[inline(always)]
pub(super) fn coulomb<D: Dimension>(
    tool: &RigidTool,
    normal: [f64; 2],
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
    Some(Correction { velocity: D::vector(|axis| of_tool(axis) + slip[axis]), slip, normal })
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

    /// What contact with the tool's nearest face makes of a node.
    fn correct<D: Dimension>(
        tool: &RigidTool,
        position: [f64; 2],
        velocity: &D::Vector<f64>,
    ) -> Option<Correction<D>> {
        let from_tool = [0, 1].map(|axis| position[axis] - tool.position[axis]);
        coulomb::<D>(tool, tool.shape.closest(from_tool).normal, velocity)
    }

    /// A node 1 µm behind the rake face, half way up.
    const INSIDE: [f64; 2] = [1e-3 + 5e-4 * 0.100_334_672_085_450_5 + 1e-6, 1.2e-3];

    /// The impulse of contact lies in the cone of friction: it pushes, sliding ends on the cone's side, and
    /// what sticks stays within. Afterwards nothing enters the tool.
    #[test]
    fn contact_impulse_lies_in_the_cone_of_friction() {
        for friction in [0.0, 0.2, 1.0] {
            for velocity in [[0.0, 0.0], [10.0, 30.0], [-30.0, -40.0], [-49.0, 3.0], [200.0, -7.0]] {
                let tool = tool(friction);
                let contact = correct::<PlaneStrain>(&tool, INSIDE, &velocity);
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

    /// A node that moves away from the tool is left alone: contact does not pull.
    #[test]
    fn nothing_departing_is_touched() {
        assert!(correct::<PlaneStrain>(&tool(0.2), INSIDE, &[-60.0, 0.0]).is_none());
    }

    /// In space friction acts along the whole sliding velocity, also across the cut.
    #[test]
    fn sideways_sliding_is_braked_in_its_own_direction() {
        let tool = tool(0.2);
        let velocity = [0.0, 0.0, 20.0];
        let contact = correct::<ThreeDimensional>(&tool, INSIDE, &velocity).expect("contact");
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
