//! A run of the grid's nodes: what a chunk of points reads from and gives to.

use crate::dimension::Dimension;
use crate::grid::{Layout, Record};
use crate::simd::Real;

/// Nodes of a chunk: a run of the grid's nodes, from index `first` on.
#[derive(Clone, Debug, Default)]
pub struct NodeRun<R> {
    /// Index of the first node in the layout.
    pub first: usize,
    /// `QUADS` records per node, and `SLACK` more.
    pub records: Vec<Record<R>>,
    /// Mass per node (kg), and `SLACK` more.
    pub mass: Vec<R>,
}

/// Entries behind the last node, so that whole vectors and stencils can be read and written there.
const SLACK: usize = 6;

impl<R: Real> NodeRun<R> {
    /// Number of nodes.
    pub fn count<D: Dimension>(&self) -> usize {
        self.records.len().saturating_sub(SLACK) / D::QUADS
    }

    /// Sets the run to `count` zero nodes from `first` on.
    pub fn reset<D: Dimension>(&mut self, first: usize, count: usize) {
        self.first = first;
        self.records.clear();
        self.records.resize(count * D::QUADS + SLACK, Record([R::ZERO; 4]));
        self.mass.clear();
        self.mass.resize(count + SLACK, R::ZERO);
    }

    /// Sets all nodes to zero.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.records.fill(Record([R::ZERO; 4]));
        self.mass.fill(R::ZERO);
    }
}

/// Index, within a run of nodes, of the first of the three nodes that a point touches on one of its pencils.
#[inline(always)]
pub fn first_node<D: Dimension>(
    layout: &Layout,
    first: usize,
    node: &D::Vector<i32>,
    pencil: usize,
) -> usize {
    let touched = if D::AXES == 2 {
        node[0] + pencil as i32 - 1
    } else {
        (node[0] + (pencil / 3) as i32 - 1) * layout.counts[1] + node[1] + (pencil % 3) as i32 - 1
    };
    (layout.offset[touched as usize] + node[D::AXES - 1] - 1 - first as i32) as usize
}
