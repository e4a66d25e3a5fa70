//! Contact of nodes that lie inside the tool and move into it: the oldest law here.
//!
//! It is kept as one that a plain loop over nodes can be held against, and that has no sweeps to end; no
//! scene has it. It acts as soon as a node behind the tool's surface has mass, up to 1.25 cells before a
//! point is there.
//!
//! Form of the effect: an optional pass as the other laws, on one thread; nothing of it is part of the state.

use crate::checkpoint::{BulkReader, StateBytes};
use crate::contact::contact_law::{BoxedLaw, ContactCost, ContactLaw, ContactStep};
use crate::contact::coulomb::TrialNode;
use crate::contact::nodes::assemble;
use crate::dimension::Dimension;
use crate::error::Error;
use crate::grid::shape_function::ShapeFunction;
use crate::partition::Partition;
use crate::partition::nodes::NodalImpulses;
use crate::points::PointState;
use crate::simd::Real;
use crate::tool::RigidTool;
use crate::tool::profile::Closest;

/// Contact of nodes inside the tool.
#[derive(Clone, Debug, Default)]
pub struct NodesInside {
    touched: NodalImpulses,
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>> ContactLaw<R, D, F, S> for NodesInside {
    fn solve(&mut self, partition: &Partition<R, D, S>, _: &F, contact: &ContactStep<'_, S>) {
        self.touched.clear();
        let (layout, tool) = (&partition.layout, contact.tool);
        // Only nodes within the tool's box can be inside it.
        let (low, high) = tool.bounds();
        let index = |axis: usize, x: f64| (x - layout.origin[axis]) / layout.cell;
        let first = index(0, low[0]).ceil().max(0.0) as usize;
        let end = (index(0, high[0]).floor() + 1.0).max(0.0) as usize;
        let plane = layout.pencils_per_plane::<D>() as usize;
        for pencil in first * plane..(end * plane).min(layout.low.len()) {
            for node in layout.start[pencil]..layout.start[pencil + 1] {
                let along = layout.low[pencil] + (node - layout.start[pencil]) as i32;
                let [x, y, _] = layout.position::<D>(pencil, along);
                if !(low[1]..=high[1]).contains(&y) {
                    continue;
                }
                let Some(closest) = inside(tool, [x, y]) else { continue };
                let (a, b) = ((pencil / plane) as i32, (pencil % plane) as i32);
                let at = if D::AXES == 2 { [a, along, 0] } else { [a, b, along] };
                let start = assemble::<R, D, S>(partition, contact.step, node, at);
                if start.is_there {
                    TrialNode { start, closest }.exchange::<D>(tool, contact.wants_heat, &mut self.touched);
                }
            }
        }
    }

    fn touched(&self) -> &NodalImpulses {
        &self.touched
    }

    fn cost(&self) -> ContactCost {
        ContactCost { touching: self.touched.nodes.len(), sweeps: 0 }
    }

    fn note_motion(&mut self, _: f64) {}

    fn note_sort(&mut self) {}

    fn save(&self, _: &mut StateBytes) {}

    fn restore(&mut self, _: &mut BulkReader<'_>) -> Result<(), Error> {
        Ok(())
    }

    fn fork(&self) -> BoxedLaw<R, D, F, S> {
        Box::new(self.clone())
    }
}

/// Where the tool is closest to a node at `position` (m) inside it; `None` for one outside.
fn inside(tool: &RigidTool, position: [f64; 2]) -> Option<Closest> {
    let closest = tool.shape.closest([position[0] - tool.position[0], position[1] - tool.position[1]]);
    (closest.distance < 0.0).then_some(closest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tool::profile::ToolShape;

    /// A micrometre on either side of the rake face, half way up, decides.
    #[test]
    fn nothing_outside_is_touched() {
        let shape = ToolShape::new(0.1, 0.0873, 0.0, 5e-4, 1e-3).expect("a plain wedge");
        let tool = RigidTool { shape, position: [1e-3, 7e-4], velocity: [-50.0, 0.0], friction: 0.2 };
        let face = 1e-3 + 5e-4 * 0.1_f64.tan();
        assert!(inside(&tool, [face - 1e-6, 1.2e-3]).is_none());
        assert!(inside(&tool, [face + 1e-6, 1.2e-3]).is_some());
    }
}
