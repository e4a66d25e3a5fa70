//! What a simulation does about heat that flows: friction heat on its way to the points, conduction passes,
//! the tool.

use super::Simulation;
use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::heat::sources;
use crate::heat::tool::Opposite;
use crate::heat::{HeatConduction, NodeHeat};
use crate::material::ConstitutiveModel;
use crate::simd::Real;
use crate::simulation::solver::Progress;

impl<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>> Simulation<R, D, F, M> {
    /// Lets the friction work since `before` (J) wait as heat on the nodes where it arose.
    pub(super) fn note_friction_heat(&mut self, before: f64) {
        // Without friction what is left of its work is rounding.
        if self.conduction.is_none() || self.tool.friction == 0.0 {
            return;
        }
        let nodes = &self.contact.touched().friction_heat;
        let found: f64 = nodes.iter().map(|entry| entry.1).sum();
        let heat = &mut self.progress.heat;
        let work = self.progress.ledger.friction_work - before;
        heat.friction += work;
        heat.unplaced += work;
        if found > 0.0 {
            let factor = std::mem::take(&mut heat.unplaced) / found;
            nodes.iter().for_each(|&(node, work)| sources::add(&mut heat.waiting, node, factor * work));
        }
    }

    /// Gives the heat that waits on nodes to the points around them.
    pub(super) fn deposit_friction_heat(&mut self) {
        let Some(conduction) = &self.conduction else { return };
        let Progress { heat, ledger, .. } = &mut self.progress;
        if heat.waiting.is_empty() {
            return;
        }
        let mut sources = std::mem::take(&mut heat.waiting);
        let own = conduction.friction_share;
        let for_points: NodeHeat = sources.iter().map(|&(node, work)| (node, own * work)).collect();
        let parts = (&self.shape, &self.model);
        let left = sources::deposit(&mut self.partition, parts, &for_points, conduction.capacity(), heat);
        // What finds no place waits for the next node that does; the tool's share of it has been given
        // already.
        heat.unplaced += left;
        let for_tool = (1.0 - own) * sources.iter().map(|source| source.1).sum::<f64>();
        heat.friction_in_tool += for_tool;
        if let Some(body) = &self.tool_body {
            let places = (&self.partition.layout, &self.tool);
            let left = body.take_friction::<D>(places, &sources, 1.0 - own, &mut heat.tool);
            heat.friction_in_tool -= left;
            heat.unplaced += left;
        }
        // Its memory serves the next substeps.
        sources.clear();
        heat.waiting = sources;
        ledger.thermoelastic += std::mem::take(&mut heat.thermoelastic);
    }

    /// Lets heat flow through the contact and within the tool over `dt` (s), if it conducts.
    pub(super) fn conduct_in_tool(&mut self, dt: f64) {
        let (Some(body), Some(conduction)) = (&self.tool_body, &self.conduction) else { return };
        let Progress { heat, ledger, .. } = &mut self.progress;
        let opposite = Opposite { capacity: conduction.capacity(), reference: conduction.reference() };
        let points = (&mut self.partition, &self.model);
        body.exchange::<R, D, M>(points, &self.tool, opposite, dt, heat);
        body.conduct(&mut heat.tool, dt);
        let (stored, given) = (body.heat(&heat.tool), heat.friction_in_tool + heat.contact);
        let unresolved = body.unresolved_heat(conduction.reference());
        debug_assert!(
            (stored - given).abs() <= 1e-9 * given.abs() + unresolved,
            "the tool holds {stored} J and was given {given} J"
        );
        ledger.thermoelastic += std::mem::take(&mut heat.thermoelastic);
    }

    /// Whether nothing has heated the material yet, which starts at one temperature: no heat flows.
    pub(super) fn is_even(&self, conduction: &HeatConduction) -> bool {
        let Progress { heat, ledger, .. } = &self.progress;
        let plastic_heat = conduction.plastic_work_heats && ledger.plastic_work > 0.0;
        conduction.starts_even && !plastic_heat && heat.friction == 0.0
    }

    /// Conducts heat where the scene names it and a pass is due.
    pub(super) fn conduct_heat(&mut self, parallel: bool) {
        if self.conduction.as_ref().is_some_and(|conduction| self.is_even(conduction)) {
            self.progress.heat.last_pass = self.progress.clock;
            return;
        }
        let Some(conduction) = &mut self.conduction else { return };
        let Progress { clock, heat, ledger, .. } = &mut self.progress;
        let dt = *clock - heat.last_pass;
        let conducted =
            conduction.conduct_if_due(&mut self.partition, &self.shape, &self.model, *clock, heat);
        ledger.thermoelastic += std::mem::take(&mut heat.thermoelastic);
        if conducted {
            self.conduct_in_tool(dt);
            self.deposit_friction_heat();
            if self.model.expands() {
                // The forces that wait on the nodes are those of the stresses before.
                self.deposit(parallel);
            }
        }
    }
}
