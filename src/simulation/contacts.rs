//! How a simulation meets the tool: at the points, or at nodes under the paper's own laws; and what the other threads do meanwhile.

use super::Simulation;
use crate::contact::Contact;
use crate::contact::nodal::NodalContact;
use crate::contact::nodes::Conditions;
use crate::contact::sticking::Strength;
use crate::contact::surface::SurfaceContact;
use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::material::ConstitutiveModel;
use crate::parallel::for_each;
use crate::partition::nodes::{ChunkNodes, NodalImpulses};
use crate::simd::Real;
use std::iter;
use std::mem;

/// A part of the first half of a substep.
enum Part<'a, R> {
    Contact(&'a mut SurfaceContact, &'a mut NodalContact),
    Nodes(&'a mut ChunkNodes<R>),
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>> Simulation<R, D, F, M> {
    /// Whether the contact law is one of the paper's own.
    pub(super) fn acts_on_nodes(&self) -> bool {
        matches!(self.options.contact, Contact::Distance | Contact::Velocity)
    }

    /// What contact changed in the last substep.
    pub fn touched(&self) -> &NodalImpulses {
        self.touched_of(&self.surface_contact, &self.nodal_contact)
    }

    fn touched_of<'a>(
        &self,
        touching: &'a SurfaceContact,
        nodal_contact: &'a NodalContact,
    ) -> &'a NodalImpulses {
        if self.acts_on_nodes() { nodal_contact.touched() } else { touching.touched() }
    }

    /// Both halves of a substep of `dt` (s) on the nodes, with the contact beside the first.
    pub(super) fn move_nodes(&mut self, dt: f64, parallel: bool) {
        // Nodes and contact read all of the simulation but what they write.
        let mut nodes = mem::take(&mut self.partition.nodes);
        let mut touching = mem::take(&mut self.surface_contact);
        let mut nodal_contact = mem::take(&mut self.nodal_contact);
        let (incoming, step) = (&self.partition.incoming, self.nodes_step(dt));
        // What takes longest comes first.
        let parts = iter::once(Part::Contact(&mut touching, &mut nodal_contact));
        for_each(parts.chain(nodes.iter_mut().map(Part::Nodes)), parallel, |part| match part {
            Part::Contact(touching, nodal_contact) => self.solve_contact(touching, nodal_contact, dt),
            Part::Nodes(nodes) => nodes.update_nodes::<D>(incoming, &step),
        });
        let touched = self.touched_of(&touching, &nodal_contact);
        for_each(nodes.iter_mut(), parallel, |nodes| nodes.apply_contact::<D>(touched, &step));
        self.partition.nodes = nodes;
        (self.surface_contact, self.nodal_contact) = (touching, nodal_contact);
    }

    /// Solves the contact for a substep of `dt` (s), but for the law that chunks see to themselves.
    fn solve_contact(&self, touching: &mut SurfaceContact, nodal_contact: &mut NodalContact, dt: f64) {
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
                return nodal_contact.solve(law, &self.partition, &self.shape, &conditions);
            }
        }
        // Yield in pure shear, by von Mises.
        let strength = |state: &M::State, lane: usize| self.model.flow_stress(state, lane) / 3_f64.sqrt();
        let strength: Option<&Strength<'_, M::State>> =
            if self.options.sticking { Some(&strength) } else { None };
        touching.solve(&self.partition, &self.shape, &conditions, strength);
    }
}
