//! Where both velocity fields have nodes at the edge, chip and work do not move into each other.
//!
//! In the edge's column of nodes, those of the chip stand on those of the work where both have mass. Where the
//! chip's node moves down against the work's, both take their common velocity along y; across it they slide
//! freely. Behind that column the tool is between them.

use crate::contact::gauss_seidel::Node;
use crate::contact::nodes::{NOT_LISTED, NodePredictor, assemble};
use crate::dimension::Dimension;
use crate::partition::Partition;
use crate::partition::nodes::{NodeSums, StepContext};
use crate::points::PointState;
use crate::simd::Real;

/// Nodes of the two fields at one place, pressed together.
#[derive(Clone, Copy, Debug)]
pub(super) struct FieldPair {
    /// Places in the list of nodes: the chip's and the work's.
    nodes: [u32; 2],
    /// Impulse on the chip's along y (N s); the work's gets the opposite.
    impulse: f64,
}

impl FieldPair {
    /// Counts what the pair did once all contact is known: its impulse's share of inelastic impact, and its work
    /// on what approach is left.
    pub(super) fn count(&self, nodes: &[Node], starts: &[NodePredictor], sums: &mut NodeSums) {
        for (place, impulse) in self.nodes.into_iter().zip([self.impulse, -self.impulse]) {
            let (new, old) = (nodes[place as usize].velocity[1], starts[place as usize].old[1]);
            sums.contact_loss += 0.5 * impulse * (new - old);
            sums.approach_work += impulse * new;
        }
    }
}

/// Lists the nodes at the edge that both fields have, and exchanges the momentum of those that approach.
pub(super) fn meet_at_edge<R: Real, D: Dimension, S: PointState<R>>(
    partition: &Partition<R, D, S>,
    step: &StepContext,
    (nodes, starts): (&mut Vec<Node>, &mut Vec<NodePredictor>),
    (places, pairs): (&mut [u32], &mut Vec<FieldPair>),
) {
    pairs.clear();
    let layout = &partition.layout;
    let edge = layout.second.edge;
    if !layout.second.exists() || !(0..layout.second.columns(layout.counts[0])).contains(&edge) {
        return;
    }
    let plane = layout.pencils_per_plane::<D>();
    for row in 0..plane {
        let pencil = |first: i32| (first * plane + row) as usize;
        let columns = [layout.second.moved_to(edge, true), edge];
        let range = |first: i32| {
            let pencil = pencil(first);
            let low = layout.low[pencil];
            low..low + (layout.start[pencil + 1] - layout.start[pencil]) as i32
        };
        let (chip, work) = (range(columns[0]), range(columns[1]));
        for along in chip.start.max(work.start)..chip.end.min(work.end) {
            let both = columns.map(|first| {
                let index = (layout.offset[pencil(first)] + along) as usize;
                let at = if D::AXES == 2 { [first, along, 0] } else { [first, row, along] };
                assemble::<R, D, S>(partition, step, index, at)
            });
            if !both.iter().all(|node| node.is_there && node.inverse_mass[1] > 0.0) {
                continue;
            }
            let approach = both[0].free[1] - both[1].free[1];
            if approach >= 0.0 {
                continue;
            }
            let impulse = -approach / (both[0].inverse_mass[1] + both[1].inverse_mass[1]);
            let listed = [0, 1].map(|k| {
                let start = both[k];
                let mut node = start.for_sweeps();
                node.velocity[1] += [impulse, -impulse][k] * start.inverse_mass[1];
                debug_assert!(places[start.index] == NOT_LISTED, "a node is listed before its points are");
                places[start.index] = nodes.len() as u32;
                nodes.push(node);
                starts.push(start);
                nodes.len() as u32 - 1
            });
            pairs.push(FieldPair { nodes: listed, impulse });
        }
    }
}
