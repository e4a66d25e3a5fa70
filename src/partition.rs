//! All points of a scene, sorted by their nearest node and divided into chunks.
//!
//! Sorting is a stable counting sort by the node's place in memory, so that neighbours in space are neighbours in
//! memory and a chunk's nodes are one run. The order is part of the state: it fixes the order of every sum.

use crate::chunk::Chunk;
use crate::dimension::Dimension;
use crate::error::Error;
use crate::grid::{FixedNodes, Layout};
use crate::points::{BLOCK, Block, PointState};
use crate::simd::Real;
use crate::transfer::NodeRun;
use serde::{Deserialize, Serialize};

/// Points per chunk below which a chunk is not worth its overlap, and most chunks of a scene.
const POINTS_PER_CHUNK: usize = 2048;
const MOST_CHUNKS: usize = 16;

/// The bulk of a solver's state, as numbers in a fixed order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bulk {
    /// Every block's columns, then the deposits.
    pub floats: Vec<f64>,
    /// Every block's nodes and numbers, then the layout.
    pub integers: Vec<i64>,
}

/// The points, their chunks, and the two sets of deposits between which a substep goes to and fro.
#[derive(Clone)]
pub struct Partition<R: Real, D: Dimension, S> {
    /// Arrangement of the grid's nodes.
    pub layout: Layout,
    /// Runs of points.
    pub chunks: Vec<Chunk<R, D, S>>,
    /// What the last substep deposited, by chunk.
    pub incoming: Vec<NodeRun<R>>,
    /// Where the present substep deposits, by chunk.
    pub outgoing: Vec<NodeRun<R>>,
    /// Fixed nodes.
    pub fixed: Vec<FixedNodes>,
    /// Lowest and highest pencil of each chunk's points when they were sorted; (1, 0) for a chunk without points.
    ends: Vec<(usize, usize)>,
}

impl<R: Real, D: Dimension, S: PointState<R>> Partition<R, D, S> {
    /// Divides `blocks`, whose points may stand in any order, into chunks.
    pub fn new(layout: Layout, fixed: Vec<FixedNodes>, blocks: Vec<Block<R, D, S>>) -> Self {
        let points = blocks.len() * BLOCK;
        let count = (points / POINTS_PER_CHUNK).clamp(1, MOST_CHUNKS);
        let mut chunks: Vec<Chunk<R, D, S>> = (0..count).map(|_| Chunk::default()).collect();
        chunks[0].blocks = blocks;
        let mut partition = Partition {
            layout,
            chunks,
            incoming: vec![NodeRun::default(); count],
            outgoing: vec![NodeRun::default(); count],
            fixed,
            ends: vec![(1, 0); count],
        };
        partition.sort(|_, _| {});
        partition
    }

    /// Every point, in memory order, with its block and lane.
    pub fn points(&self) -> impl Iterator<Item = (&Block<R, D, S>, usize)> {
        let blocks = self.chunks.iter().flat_map(|chunk| chunk.blocks.iter());
        blocks
            .flat_map(|block| (0..BLOCK).filter(|&lane| block.is_point(lane)).map(move |lane| (block, lane)))
    }

    /// Sorts the points and arranges the grid around them. A point that stands at the domain's rim leaves it: it is
    /// shown to `retire` and is gone.
    pub fn sort(&mut self, mut retire: impl FnMut(&Block<R, D, S>, usize)) {
        let mut staying: Vec<(&Block<R, D, S>, usize)> = Vec::new();
        for (block, lane) in self.points() {
            if self.layout.contains::<D>(D::vector(|axis| block.node[axis][lane])) {
                staying.push((block, lane));
            } else {
                retire(block, lane);
            }
        }
        let mut layout = self.layout.clone();
        layout.arrange::<D>(staying.iter().map(|(block, lane)| D::vector(|axis| block.node[axis][*lane])));
        let key = |block: &Block<R, D, S>, lane: usize| {
            let node = D::vector(|axis| block.node[axis][lane]);
            (layout.offset[layout.pencil::<D>(node) as usize] + Layout::along::<D>(node)) as usize
        };
        let mut place = vec![0_u32; layout.nodes() + 1];
        for &(block, lane) in &staying {
            place[key(block, lane) + 1] += 1;
        }
        for k in 1..place.len() {
            place[k] += place[k - 1];
        }
        let count = staying.len().div_ceil(BLOCK).max(1);
        let mut blocks = vec![Block::<R, D, S>::empty(); count];
        for &(block, lane) in &staying {
            let slot = &mut place[key(block, lane)];
            blocks[*slot as usize / BLOCK].copy_point(*slot as usize % BLOCK, block, lane);
            *slot += 1;
        }
        let points = staying.len();
        fill_empty_places(&mut blocks, points);
        self.layout = layout;
        self.divide(blocks);
    }

    /// Gives sorted blocks to the chunks, in equal numbers, and their nodes.
    fn divide(&mut self, blocks: Vec<Block<R, D, S>>) {
        self.share_out(blocks);
        let layout = &self.layout;
        let pencil = |block: &Block<R, D, S>, lane: usize| {
            layout.pencil::<D>(D::vector(|axis| block.node[axis][lane])) as usize
        };
        for (chunk, ends) in self.chunks.iter().zip(&mut self.ends) {
            *ends = match (chunk.blocks.first(), chunk.blocks.last()) {
                (Some(first), Some(last)) => (pencil(first, 0), pencil(last, BLOCK - 1)),
                _ => (1, 0),
            };
        }
        self.arrange_chunks();
    }

    /// Gives sorted blocks to the chunks, in equal numbers.
    fn share_out(&mut self, blocks: Vec<Block<R, D, S>>) {
        let (total, count) = (blocks.len(), self.chunks.len());
        let mut blocks = blocks.into_iter();
        for (k, chunk) in self.chunks.iter_mut().enumerate() {
            let share = (k + 1) * total / count - k * total / count;
            chunk.blocks = blocks.by_ref().take(share).collect();
        }
    }

    /// Arranges every chunk's nodes for the present layout and ends.
    fn arrange_chunks(&mut self) {
        let mut owned_from = 0;
        for (k, chunk) in self.chunks.iter_mut().enumerate() {
            let next = self.ends[k + 1..].iter().find(|(first, last)| first <= last).map(|range| range.0);
            // A chunk without points (a scene that has lost most of them) stands where nothing is.
            let (first, last) = if self.ends[k].0 <= self.ends[k].1 { self.ends[k] } else { (0, 0) };
            let deposits = [&mut self.incoming[k], &mut self.outgoing[k]];
            owned_from = chunk.arrange(&self.layout, (first, last, next), owned_from, &self.fixed, deposits);
        }
    }
}

impl<R: Real, D: Dimension, S: PointState<R>> Partition<R, D, S> {
    /// What the present substep deposited becomes what the next one reads.
    pub fn exchange_deposits(&mut self) {
        std::mem::swap(&mut self.incoming, &mut self.outgoing);
    }

    /// Everything that changes, as numbers: points in order, then the deposits that the next substep reads.
    pub fn bulk(&self) -> Bulk {
        let mut bulk = Bulk { floats: Vec::new(), integers: Vec::new() };
        for block in self.chunks.iter().flat_map(|chunk| &chunk.blocks) {
            for k in 0..Block::<R, D, S>::columns() {
                bulk.floats.extend(block.column(k).iter().map(|x| x.to_f64()));
            }
            for axis in 0..D::AXES {
                bulk.integers.extend(block.node[axis].iter().map(|&node| i64::from(node)));
            }
            bulk.integers.extend(block.id.iter().map(|&id| i64::from(id)));
        }
        bulk.integers.extend(self.layout.low.iter().map(|&low| i64::from(low)));
        bulk.integers.extend(self.layout.start.iter().map(|&start| start as i64));
        bulk.integers.extend(self.ends.iter().flat_map(|&(first, last)| [first as i64, last as i64]));
        for run in &self.incoming {
            bulk.floats.extend(run.records.iter().flat_map(|record| record.0).map(Real::to_f64));
            bulk.floats.extend(run.mass.iter().map(|mass| mass.to_f64()));
        }
        bulk
    }

    /// Takes what `bulk` gave.
    ///
    /// # Errors
    /// `Error::DamagedState` when its length does not fit this scene.
    pub fn restore(&mut self, bulk: &Bulk) -> Result<(), Error> {
        let damaged = || Error::DamagedState("its points do not fit this scene".into());
        let mut floats = bulk.floats.iter().copied();
        let mut integers = bulk.integers.iter().copied();
        let pencils = self.layout.low.len();
        let columns = Block::<R, D, S>::columns();
        let per_block = BLOCK * (D::AXES + 1);
        let arrangement = 2 * pencils + 1 + 2 * self.chunks.len();
        let count = bulk.integers.len().checked_sub(arrangement).ok_or_else(damaged)? / per_block;
        if count * per_block + arrangement != bulk.integers.len()
            || bulk.floats.len() < count * BLOCK * columns
        {
            return Err(damaged());
        }
        let mut next_integer = || integers.next().ok_or_else(damaged);
        let mut next_float = || floats.next().map(R::from_f64).ok_or_else(damaged);
        let mut blocks = vec![Block::<R, D, S>::empty(); count];
        for block in &mut blocks {
            for k in 0..columns {
                for value in block.column_mut(k) {
                    *value = next_float()?;
                }
            }
            for axis in 0..D::AXES {
                for node in &mut block.node[axis] {
                    *node = i32::try_from(next_integer()?).map_err(|_| damaged())?;
                    if *node < 0 || *node >= self.layout.counts[axis] {
                        return Err(damaged());
                    }
                }
            }
            for id in &mut block.id {
                *id = u32::try_from(next_integer()?).map_err(|_| damaged())?;
            }
        }
        self.layout.low.clear();
        for _ in 0..pencils {
            self.layout.low.push(i32::try_from(next_integer()?).map_err(|_| damaged())?);
        }
        self.layout.start.clear();
        for _ in 0..=pencils {
            self.layout.start.push(usize::try_from(next_integer()?).map_err(|_| damaged())?);
        }
        for ends in &mut self.ends {
            let mut pencil =
                || usize::try_from(next_integer()?).ok().filter(|&k| k < pencils).ok_or_else(damaged);
            *ends = (pencil()?, pencil()?);
        }
        if !self.layout.start.is_sorted() {
            return Err(damaged());
        }
        self.layout.restore_offsets();
        self.share_out(blocks);
        self.arrange_chunks();
        for run in &mut self.incoming {
            for record in &mut run.records {
                for value in &mut record.0 {
                    *value = next_float()?;
                }
            }
            for mass in &mut run.mass {
                *mass = next_float()?;
            }
        }
        if next_float().is_ok() { Err(damaged()) } else { Ok(()) }
    }
}

/// Places without a point repeat the position of the last point with no volume, so that kernels need no mask.
fn fill_empty_places<R: Real, D: Dimension, S: PointState<R>>(blocks: &mut [Block<R, D, S>], points: usize) {
    let Some(last) = blocks.last_mut() else { return };
    let used = if points == 0 { 0 } else { (points - 1) % BLOCK + 1 };
    for lane in used..BLOCK {
        if used > 0 {
            let source = last.clone();
            last.copy_point(lane, &source, used - 1);
        }
        last.volume[lane] = R::ZERO;
        last.id[lane] = u32::MAX;
    }
}
