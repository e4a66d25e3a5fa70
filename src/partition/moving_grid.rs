//! A grid that moves with the tool, so that the edge always stands on a node.
//!
//! Points carry everything and the grid forgets all in each substep, so it may stand anywhere. Walls keep their
//! places in space, and so do points that no substep moves: those are counted from the grid's home. When
//! points are sorted, nodes are counted anew by whole cells, so that the grid stays where it was to half a
//! cell.

use crate::dimension::Dimension;
use crate::grid::{FixedNodes, SecondField};
use crate::partition::Partition;
use crate::points::{BLOCK, Block, PointState};
use crate::simd::Real;

impl<R: Real, D: Dimension, S: PointState<R>> Partition<R, D, S> {
    /// Lets the grid move with an edge at `edge` (m) from now on, and gives it a second velocity field. Points
    /// keep their places; they must be sorted afterwards.
    pub fn follow_edge(&mut self, edge: [f64; 2]) {
        let layout = &mut self.layout;
        layout.second = SecondField::new(layout.counts[0]);
        layout.counts[0] *= 2;
        let index = |axis: usize| ((edge[axis] - layout.origin[axis]) / layout.cell).round() as i32;
        (layout.second.edge, layout.row) = (index(0), index(1));
        let before = layout.origin;
        self.move_grid(edge);
        let layout = &self.layout;
        for block in self.chunks.iter_mut().flat_map(|chunk| &mut chunk.blocks) {
            for lane in 0..BLOCK {
                layout.count_from((&before, &layout.origin), block, lane);
            }
        }
    }

    /// Puts the grid where the edge stands on its node; points have moved against it already.
    pub fn move_grid(&mut self, edge: [f64; 2]) {
        let layout = &mut self.layout;
        let node = [layout.second.edge, layout.row];
        for axis in 0..2 {
            layout.origin[axis] = edge[axis] - layout.cell * f64::from(node[axis]);
        }
        let last = self.fixed.clone();
        self.place_walls();
        if self.fixed != last {
            for nodes in &mut self.nodes {
                nodes.list_fixed::<D>(&self.layout, &self.fixed);
            }
        }
    }

    /// Fixed nodes for the grid where it stands.
    pub fn place_walls(&mut self) {
        let layout = &self.layout;
        let shift = std::array::from_fn(|axis| (layout.origin[axis] - layout.home[axis]) / layout.cell);
        self.fixed.clear();
        if shift == [0.0; 3] {
            self.fixed.extend_from_slice(&self.walls);
        } else {
            self.fixed.extend(self.walls.iter().map(|wall: &FixedNodes| wall.seen_from(shift)));
        }
        self.fixed.extend_from_slice(&self.held);
    }

    /// Counts nodes anew by whole cells, so that the grid's origin is as near its home as can be. The points
    /// must be sorted afterwards.
    pub fn recount_nodes(&mut self) {
        let layout = &mut self.layout;
        let cells: [i32; 3] = std::array::from_fn(|axis| {
            ((layout.origin[axis] - layout.home[axis]) / layout.cell).round() as i32
        });
        if cells == [0; 3] {
            return;
        }
        for axis in 0..3 {
            layout.origin[axis] -= layout.cell * f64::from(cells[axis]);
        }
        layout.second.edge += cells[0];
        layout.row += cells[1];
        for block in self.chunks.iter_mut().flat_map(|chunk| &mut chunk.blocks) {
            for axis in 0..D::AXES {
                for node in &mut block.node[axis] {
                    *node += cells[axis];
                }
            }
        }
        self.place_walls();
    }

    /// A copy of a point of the grid, counted from its home.
    pub fn keep_at_home(&self, block: &mut Block<R, D, S>, lane: usize) {
        self.layout.count_from((&self.layout.origin, &self.layout.home), block, lane);
    }
}
