//! Points that are set aside: in no order, and in no chunk.

use crate::dimension::Dimension;
use crate::points::{BLOCK, Block, PointState};
use crate::simd::Real;

/// Points in no order, in blocks filled from the front.
pub struct InactivePoints<R: Real, D: Dimension, S> {
    /// Full ones, and one that may be full in part.
    pub blocks: Vec<Block<R, D, S>>,
    /// Points in them.
    pub count: usize,
}

impl<R: Real, D: Dimension, S> Default for InactivePoints<R, D, S> {
    fn default() -> Self {
        InactivePoints { blocks: Vec::new(), count: 0 }
    }
}

impl<R: Real, D: Dimension, S: PointState<R>> InactivePoints<R, D, S> {
    /// The points of blocks that a heap has filled.
    pub fn of(blocks: Vec<Block<R, D, S>>) -> Self {
        let last = blocks.last().map_or(0, |block| (0..BLOCK).filter(|&lane| block.is_point(lane)).count());
        let count = blocks.len().saturating_sub(1) * BLOCK + last;
        InactivePoints { blocks, count }
    }

    /// Takes a copy of a point; gives its block and lane.
    pub fn push(&mut self, from: &Block<R, D, S>, lane: usize) -> (&mut Block<R, D, S>, usize) {
        if self.count == self.blocks.len() * BLOCK {
            self.blocks.push(Block::empty());
        }
        self.blocks[self.count / BLOCK].copy_points(self.count % BLOCK, from, lane, 1);
        self.count += 1;
        (&mut self.blocks[(self.count - 1) / BLOCK], (self.count - 1) % BLOCK)
    }

    /// Takes point `k` out; the last one takes its place.
    pub fn remove(&mut self, k: usize) {
        let last = self.count - 1;
        let from = self.blocks[last / BLOCK].clone();
        self.blocks[k / BLOCK].copy_points(k % BLOCK, &from, last % BLOCK, 1);
        self.blocks[last / BLOCK].volume[last % BLOCK] = R::ZERO;
        self.count = last;
        if last.is_multiple_of(BLOCK) {
            self.blocks.pop();
        }
    }
}
