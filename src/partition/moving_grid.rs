//! A grid that moves with the tool, so that the edge always stands on a node.
//!
//! Points carry everything and the grid forgets all in each substep, so it may stand anywhere. Walls keep their
//! places in space, and so do points that no substep moves: those are counted from the grid's home. When
//! points are sorted, nodes are counted anew by whole cells, so that the grid stays where it was to half a
//! cell.

use crate::dimension::Dimension;
use crate::grid::{FixedNodes, SecondField};
use crate::partition::Partition;
use crate::points::{BLOCK, PointState};
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
        self.last_fixed.clone_from(&self.fixed);
        self.place_walls();
        if self.fixed != self.last_fixed {
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::PlaneStrain;
    use crate::grid::Layout;
    use crate::points::Block;

    /// Points and walls keep their places in space when the grid begins to follow an edge and when nodes are
    /// counted anew, and the edge stands on its node each time.
    #[test]
    fn only_the_grid_moves() {
        let mut block = Block::<f64, PlaneStrain, ()>::empty();
        for lane in 0..4 {
            block.set_grid_position(lane, [10.0 + 0.5 * lane as f64, 8.25]);
            block.volume[lane] = 1.0;
        }
        let cell = 2.0;
        let wall = FixedNodes { low: [3, 3, 0], high: [20, 5, 0], axes: [true; 3] };
        let mut partition =
            Partition::new(Layout::new([40, 30, 1], cell, [-8.0, -6.0, 0.0]), vec![wall], vec![block]);
        let places = |partition: &Partition<f64, PlaneStrain, ()>| -> Vec<[f64; 2]> {
            partition.points().map(|(block, lane)| partition.layout.place(block, lane)).collect()
        };
        let top = |partition: &Partition<f64, PlaneStrain, ()>| {
            partition.layout.origin[1] + cell * f64::from(partition.fixed[0].high[1])
        };
        let on_node = |partition: &Partition<f64, PlaneStrain, ()>| {
            let layout = &partition.layout;
            [0, 1].map(|axis| layout.origin[axis] + cell * f64::from([layout.second.edge, layout.row][axis]))
        };
        let (start, wall_top) = (places(&partition), top(&partition));
        let edge = [21.3, 9.7];
        partition.follow_edge(edge);
        let close = |a: &[[f64; 2]], b: &[[f64; 2]]| {
            // A few roundings of coordinates around 30.
            a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-13)
        };
        assert!(close(&places(&partition), &start), "{:?}", places(&partition));
        assert!(close(&[on_node(&partition)], &[edge]));
        // The wall's face is a plane in space: the last node at or below it is fixed.
        assert!((wall_top - top(&partition)) >= -1e-6 * cell && wall_top - top(&partition) < cell);
        // Points stand still while the grid moves: they move against it.
        let moved = [edge[0] - 3.1, edge[1] + 0.4];
        for block in partition.chunks.iter_mut().flat_map(|chunk| &mut chunk.blocks) {
            for lane in 0..4 {
                let cells = block.grid_position(lane);
                block.set_grid_position(lane, [cells[0] + 3.1 / cell, cells[1] - 0.4 / cell]);
            }
        }
        partition.move_grid(moved);
        assert!(close(&places(&partition), &start), "{:?}", places(&partition));
        partition.recount_nodes();
        assert!(close(&places(&partition), &start), "{:?}", places(&partition));
        assert!(close(&[on_node(&partition)], &[moved]));
        let layout = &partition.layout;
        assert!((0..2).all(|axis| (layout.origin[axis] - layout.home[axis]).abs() <= 0.5 * cell + 1e-12));
    }
}
