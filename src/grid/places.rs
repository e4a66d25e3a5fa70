//! Where the points of blocks stand in space, on a grid that may move and have a second velocity field.

use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::points::{Block, PointState};
use crate::simd::Real;

impl Layout {
    /// A point's position from node (0, 0, …) in cells, whichever field it belongs to.
    #[inline(always)]
    pub fn cells_of<R: Real, D: Dimension, S: PointState<R>>(
        &self,
        block: &Block<R, D, S>,
        lane: usize,
    ) -> D::Vector<f64> {
        let mut cells = block.grid_position(lane);
        if self.second.holds(block.node[0][lane]) {
            cells[0] = f64::from(self.second.column(block.node[0][lane])) + block.offset[0][lane].to_f64();
        }
        cells
    }

    /// Puts a point at a position in cells, in the field that it belongs to.
    pub fn put<R: Real, D: Dimension, S: PointState<R>>(
        &self,
        block: &mut Block<R, D, S>,
        lane: usize,
        cells: D::Vector<f64>,
    ) {
        let second = self.second.holds(block.node[0][lane]);
        block.set_grid_position(lane, cells);
        if second {
            block.node[0][lane] = self.second.moved_to(block.node[0][lane], true);
        }
    }

    /// A point's position in the plane (m).
    #[inline(always)]
    pub fn place<R: Real, D: Dimension, S: PointState<R>>(
        &self,
        block: &Block<R, D, S>,
        lane: usize,
    ) -> [f64; 2] {
        let cells = self.cells_of(block, lane);
        [0, 1].map(|axis| self.origin[axis] + self.cell * cells[axis])
    }

    /// Lets a point keep its place in space when it is counted from the grid's home instead of its present
    /// place, or the other way round.
    pub fn count_from<R: Real, D: Dimension, S: PointState<R>>(
        &self,
        (from, to): (&[f64; 3], &[f64; 3]),
        block: &mut Block<R, D, S>,
        lane: usize,
    ) {
        if from == to {
            return;
        }
        let cells = self.cells_of(block, lane);
        self.put(block, lane, D::vector(|axis| cells[axis] + (from[axis] - to[axis]) / self.cell));
    }
}
