//! Material points in blocks of 64, each block an array of every quantity.
//!
//! ```text
//!  chunk ─┬─ block 0 ─┬─ node[x]: 64 numbers │ node[y] │ offset[x] │ … │ model state …
//!         ├─ block 1  └─ one point is one column through all of these
//!         └─ …
//! ```
//!
//! A block's arrays lie one after another (array of structures of arrays), so that a kernel streams through
//! memory and its scratch for 64 points stays in the first-level cache. A position is the nearest grid node
//! and the offset from it in cells, so that its precision is the same everywhere in the domain.
//!
//! What may be touched: a column of `Block` is counted in `columns`, `column` and `column_mut`, or it is not
//! saved; a model's own columns stand in its `PointState`. `inactive` holds points that are set aside.

pub(crate) mod inactive;

use crate::dimension::Dimension;
use crate::simd::Real;

/// Points in a block.
pub const BLOCK: usize = 64;

/// One quantity of a block's points.
pub type Column<R> = [R; BLOCK];

/// What a constitutive model keeps for a block of points.
pub trait PointState<R: Real>: Clone + Send + Sync {
    /// Number of its columns.
    const COLUMNS: usize;

    /// All columns zero.
    fn zeroed() -> Self;

    /// Column `k`, below `COLUMNS`; the order is part of the serialised state.
    fn column(&self, k: usize) -> &Column<R>;

    /// Column `k`, to write.
    fn column_mut(&mut self, k: usize) -> &mut Column<R>;

    /// Whether points carry an affine velocity field (`transfer::apic`).
    const IS_AFFINE: bool = false;

    /// First moments of the velocity around each point, where it carries them.
    fn moments(&self) -> &[Column<R>; 4] {
        unreachable!("points without an affine velocity field")
    }

    /// The same, to write.
    fn moments_mut(&mut self) -> &mut [Column<R>; 4] {
        unreachable!("points without an affine velocity field")
    }
}

/// 64 material points.
#[repr(C, align(64))]
#[derive(Clone)]
pub struct Block<R: Real, D: Dimension, S> {
    /// Nearest grid node along each axis.
    pub node: D::Vector<Column<i32>>,
    /// Offset from that node over the cell length (-), in [−½, ½].
    pub offset: D::Vector<Column<R>>,
    /// Velocity (m/s).
    pub velocity: D::Vector<Column<R>>,
    /// Volume at the start (m3); 0 marks a place without a point.
    pub volume: Column<R>,
    /// The point's number at the start.
    pub id: Column<u32>,
    /// Which points of the block are averaged with one another: those that stood in one cell when they were
    /// sorted.
    pub group: Column<u8>,
    /// On which side of the edge's path the point is.
    pub side: Column<Side>,
    /// The constitutive model's state.
    pub state: S,
}

/// On which side of the edge's path a point is (`chip_separation`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Side {
    /// The edge has not come near it.
    #[default]
    Uncut,
    /// It stays on the workpiece.
    Work,
    /// It goes up the chip.
    Chip,
}

impl Side {
    /// The side with this number, if there is one.
    pub fn from_number(number: u8) -> Option<Side> {
        [Side::Uncut, Side::Work, Side::Chip].into_iter().find(|side| *side as u8 == number)
    }
}

/// What a block tells of its points without their material: passes that need no more are compiled once for
/// all models.
#[derive(Clone, Copy)]
pub struct Places<'a, R: Real, D: Dimension> {
    /// Nearest grid node along each axis.
    pub node: &'a D::Vector<Column<i32>>,
    /// Offset from that node over the cell length (-).
    pub offset: &'a D::Vector<Column<R>>,
    /// Volume at the start (m3); 0 marks a place without a point.
    pub volume: &'a Column<R>,
}

impl<R: Real, D: Dimension> Places<'_, R, D> {
    /// The places of points.
    pub fn points(&self) -> impl Iterator<Item = usize> {
        (0..BLOCK).filter(|&lane| self.volume[lane] > R::ZERO)
    }

    /// Nearest node of a point.
    pub fn node_of(&self, lane: usize) -> D::Vector<i32> {
        D::vector(|axis| self.node[axis][lane])
    }

    /// Distance of a point from a node of its stencil along an axis (cells).
    pub fn from_node(&self, lane: usize, places: &[usize; 3], axis: usize) -> f64 {
        self.offset[axis][lane].to_f64() + 1.0 - places[axis] as f64
    }
}

impl<R: Real, D: Dimension, S> Block<R, D, S> {
    /// Where its points are.
    pub fn places(&self) -> Places<'_, R, D> {
        Places { node: &self.node, offset: &self.offset, volume: &self.volume }
    }
}

impl<R: Real, D: Dimension, S: PointState<R>> Block<R, D, S> {
    /// A block without points.
    pub fn empty() -> Self {
        Block {
            node: D::vector(|_| [0; BLOCK]),
            offset: D::vector(|_| [R::ZERO; BLOCK]),
            velocity: D::vector(|_| [R::ZERO; BLOCK]),
            volume: [R::ZERO; BLOCK],
            id: [u32::MAX; BLOCK],
            group: [0; BLOCK],
            side: [Side::Uncut; BLOCK],
            state: S::zeroed(),
        }
    }

    /// Number of floating-point columns.
    pub const fn columns() -> usize {
        2 * D::AXES + 1 + S::COLUMNS
    }

    /// Floating-point column `k`: offsets, velocities, volume, then the model's.
    pub fn column(&self, k: usize) -> &Column<R> {
        let axes = D::AXES;
        if k < axes {
            &self.offset[k]
        } else if k < 2 * axes {
            &self.velocity[k - axes]
        } else if k == 2 * axes {
            &self.volume
        } else {
            self.state.column(k - 2 * axes - 1)
        }
    }

    /// The same column, to write.
    pub fn column_mut(&mut self, k: usize) -> &mut Column<R> {
        let axes = D::AXES;
        if k < axes {
            &mut self.offset[k]
        } else if k < 2 * axes {
            &mut self.velocity[k - axes]
        } else if k == 2 * axes {
            &mut self.volume
        } else {
            self.state.column_mut(k - 2 * axes - 1)
        }
    }

    /// Copies the `count` points from `from_lane` on to `lane` on, their volumes included.
    pub fn copy_points(&mut self, lane: usize, from: &Self, from_lane: usize, count: usize) {
        let (to, source) = (lane..lane + count, from_lane..from_lane + count);
        for k in 0..Self::columns() {
            self.column_mut(k)[to.clone()].copy_from_slice(&from.column(k)[source.clone()]);
        }
        for axis in 0..D::AXES {
            self.node[axis][to.clone()].copy_from_slice(&from.node[axis][source.clone()]);
        }
        self.id[to.clone()].copy_from_slice(&from.id[source.clone()]);
        self.side[to].copy_from_slice(&from.side[source]);
    }

    /// Lowest corner of the cell that a point stands in.
    pub fn cell(&self, lane: usize) -> D::Vector<i32> {
        D::vector(|axis| self.node[axis][lane] - i32::from(self.offset[axis][lane] < R::ZERO))
    }

    /// Whether there is a point at `lane`.
    pub fn is_point(&self, lane: usize) -> bool {
        self.volume[lane] > R::ZERO
    }

    /// Position of a point from the grid's node (0, 0, …) in cells.
    pub fn grid_position(&self, lane: usize) -> D::Vector<f64> {
        D::vector(|axis| f64::from(self.node[axis][lane]) + self.offset[axis][lane].to_f64())
    }

    /// Puts a point at a grid position in cells.
    pub fn set_grid_position(&mut self, lane: usize, position: D::Vector<f64>) {
        for axis in 0..D::AXES {
            let nearest = position[axis].round();
            self.node[axis][lane] = nearest as i32;
            self.offset[axis][lane] = R::from_f64(position[axis] - nearest);
        }
    }
}
