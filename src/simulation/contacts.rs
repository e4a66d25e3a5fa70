//! How a simulation meets the tool: its contact law beside the first half of the pass over the nodes.

use super::Simulation;
use crate::contact::{ContactLaw, ContactStep, Parting};
use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::material::ConstitutiveModel;
use crate::parallel::for_each;
use crate::partition::nodes::{ChunkNodes, NodalImpulses};
use crate::simd::Real;
use std::iter;
use std::mem;

/// A part of the first half of a substep.
enum Part<'a, R, D, F, S> {
    Contact(&'a mut dyn ContactLaw<R, D, F, S>),
    Nodes(&'a mut ChunkNodes<R>),
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>> Simulation<R, D, F, M> {
    /// What contact changed in the last substep.
    pub fn touched(&self) -> &NodalImpulses {
        self.contact.touched()
    }

    /// Both halves of a substep of `dt` (s) on the nodes, with the contact beside the first.
    pub(super) fn move_nodes(&mut self, dt: f64, parallel: bool) {
        let step = self.step_context(dt);
        let Simulation { partition, shape, model, tool, contact, wants_friction_heat, options, .. } = self;
        // Nodes and contact read all of the partition but what they write.
        let mut nodes = mem::take(&mut partition.nodes);
        let around = &*partition;
        let (layout, incoming) = (&around.layout, &around.incoming);
        let solve = |law: &mut dyn ContactLaw<R, D, F, M::State>| {
            // Yield in pure shear, by von Mises.
            let strength = |state: &M::State, lane: usize| model.flow_stress(state, lane) / 3_f64.sqrt();
            let (depth, wants_heat) = (options.depth, *wants_friction_heat);
            let parting = options
                .separation
                .as_ref()
                .map(|separation| Parting { normal: separation.normal(tool), spacing: separation.spacing });
            law.solve(
                around,
                shape,
                &ContactStep { step: &step, tool, depth, parting, wants_heat, strength: &strength },
            );
        };
        // What takes longest comes first.
        let parts = iter::once(Part::Contact(contact.as_mut()));
        for_each(parts.chain(nodes.iter_mut().map(Part::Nodes)), parallel, |part| match part {
            Part::Contact(law) => solve(law),
            Part::Nodes(nodes) => nodes.update_nodes::<D>(layout, incoming, &step),
        });
        let touched = contact.touched();
        for_each(nodes.iter_mut(), parallel, |nodes| nodes.apply_contact::<D>(layout, touched, &step));
        partition.nodes = nodes;
    }
}
