//! How a simulation meets the tool: at the points, or at nodes under the paper's own laws.

use super::Simulation;
use crate::chunk::TouchedNodes;
use crate::contact::Contact;
use crate::contact_nodes::Conditions;
use crate::dimension::Dimension;
use crate::material::ConstitutiveModel;
use crate::shape::ShapeFunction;
use crate::simd::Real;
use crate::sticking::Strength;

impl<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>> Simulation<R, D, F, M> {
    /// Whether the contact law is one of the paper's own.
    pub(super) fn acts_on_nodes(&self) -> bool {
        matches!(self.options.contact, Contact::Distance | Contact::Velocity)
    }

    /// What contact changed in the last substep.
    pub fn touched(&self) -> &TouchedNodes {
        if self.acts_on_nodes() { self.nodal_contact.touched() } else { self.touching.touched() }
    }

    /// Solves the contact for a substep of `dt` (s), but for the law that chunks see to themselves.
    pub(super) fn solve_contact(&mut self, dt: f64) {
        let conditions = Conditions {
            tool: &self.tool,
            body_force: self.body_force.as_deref(),
            lightest: self.lightest,
            depth: self.options.depth,
            time: [self.progress.clock, dt],
            wants_heat: self.wants_friction_heat,
            instructions: self.options.instructions,
        };
        match self.options.contact {
            Contact::Surface => (),
            Contact::NodesInside => return,
            law @ (Contact::Distance | Contact::Velocity) => {
                return self.nodal_contact.solve(law, &self.partition, &self.shape, &conditions);
            }
        }
        // Yield in pure shear, by von Mises.
        let strength = |state: &M::State, lane: usize| self.model.flow_stress(state, lane) / 3_f64.sqrt();
        let strength: Option<&Strength<'_, M::State>> =
            if self.options.sticking { Some(&strength) } else { None };
        self.touching.solve(&self.partition, &self.shape, &conditions, strength);
    }
}
