//! A run of the grid's nodes: what a chunk of points reads from and gives to, and the pass between the two.

use crate::dimension::Dimension;
use crate::grid::{self, Layout, Record};
use crate::simd::{Kernel, Real, Simd};

/// Nodes of a chunk: a run of the grid's nodes, from index `first` on.
#[derive(Clone, Debug, Default)]
pub struct NodeRun<R> {
    /// Index of the first node in the layout.
    pub first: usize,
    /// `QUADS` records per node, and `SLACK` more.
    pub records: Vec<Record<R>>,
    /// Mass per node (kg), and `SLACK` more.
    pub mass: Vec<R>,
    /// Per node, and `SLACK` more: masses shared with the next node along x and along y, and along a diagonal
    /// between them (kg, `to_shared`); none where the layout keeps none.
    pub shared: [Vec<R>; 3],
}

/// Entries behind the last node, so that whole vectors and stencils can be read and written there.
const SLACK: usize = 6;

impl<R: Real> NodeRun<R> {
    /// Number of nodes.
    pub fn count<D: Dimension>(&self) -> usize {
        self.records.len().saturating_sub(SLACK) / D::QUADS
    }

    /// Sets the run to `count` zero nodes from `first` on, with shared masses or without.
    pub fn reset<D: Dimension>(&mut self, first: usize, count: usize, shares: bool) {
        self.first = first;
        self.records.clear();
        self.records.resize(count * D::QUADS + SLACK, Record([R::ZERO; 4]));
        self.mass.clear();
        self.mass.resize(count + SLACK, R::ZERO);
        for shared in &mut self.shared {
            shared.clear();
            shared.resize(if shares { count + SLACK } else { 0 }, R::ZERO);
        }
    }

    /// Sets all nodes to zero.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.records.fill(Record([R::ZERO; 4]));
        self.mass.fill(R::ZERO);
        self.shared.iter_mut().for_each(|shared| shared.fill(R::ZERO));
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

/// Adds up the deposits on a chunk's nodes and solves the momentum equation there.
pub struct NodesPass<'a, R, D> {
    /// What is added up; velocities and increments afterwards.
    pub nodes: &'a mut NodeRun<R>,
    /// What all chunks have deposited.
    pub incoming: &'a [NodeRun<R>],
    /// Nodes lighter than this (kg) stay at rest.
    pub lightest: R,
    /// Substep (s).
    pub dt: R,
    /// The dimension.
    pub dimension: std::marker::PhantomData<D>,
}

impl<R: Real, D: Dimension> Kernel<R> for NodesPass<'_, R, D> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) {
        let nodes = self.nodes;
        nodes.clear();
        let range = nodes.first..nodes.first + nodes.count::<D>();
        for run in self.incoming {
            let (first, end) = (run.first.max(range.start), (run.first + run.count::<D>()).min(range.end));
            if first >= end {
                continue;
            }
            let to = first - range.start..end - range.start;
            let from = first - run.first..end - run.first;
            let records = &run.records[from.start * D::QUADS..from.end * D::QUADS];
            for (sum, Record(add)) in
                nodes.records[to.start * D::QUADS..to.end * D::QUADS].iter_mut().zip(records)
            {
                for (sum, &add) in sum.0.iter_mut().zip(add) {
                    *sum += add;
                }
            }
            for (sum, &add) in nodes.mass[to.clone()].iter_mut().zip(&run.mass[from.clone()]) {
                *sum += add;
            }
            for (sums, shared) in nodes.shared.iter_mut().zip(&run.shared).filter(|(_, run)| !run.is_empty())
            {
                for (sum, &add) in sums[to.clone()].iter_mut().zip(&shared[from.clone()]) {
                    *sum += add;
                }
            }
        }
        let count = nodes.count::<D>();
        grid::momentum_to_velocity::<R, D>(&mut nodes.records, &nodes.mass[..count], self.lightest, self.dt);
    }
}
