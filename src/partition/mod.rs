//! All points of a scene, sorted by their nearest node and divided into chunks.
//!
//! * `sorting`: the order of the points in memory, which is part of the state;
//! * `chunk`, `nodes`: a chunk's points, the nodes around them;
//! * `smoothing`, `step_bounds`, `velocity_outliers`: what is done to increments, and how a substep is
//!   judged.
//!
//! What may be touched: anything whose sums keep the order of chunks, owned nodes and points; that order
//! makes results the same on any number of threads (`tests/determinism.rs`).

pub(crate) mod chunk;
pub(crate) mod nodes;
mod moving_grid;
mod smoothing;
mod sorting;
pub(crate) mod step_bounds;
mod tiles;
pub(crate) mod velocity_outliers;

use crate::checkpoint::{BulkReader, StateBytes};
use crate::dimension::Dimension;
use crate::error::Error;
use crate::grid::{FixedNodes, Layout};
use crate::parallel::for_each;
use crate::partition::chunk::Chunk;
use crate::partition::nodes::{ChunkNodes, ChunkPencils};
use crate::points::{BLOCK, Block, PointState, Side};
use crate::simd::Real;
use crate::transfer::NodeRun;
use sorting::{Workspace, share};

/// Points per chunk below which a chunk is not worth its overlap.
const POINTS_PER_CHUNK: usize = 2048;
/// Most chunks of a scene.
pub const MOST_CHUNKS: usize = 16;

/// The points, their chunks, and the two sets of deposits between which a substep goes to and fro.
#[derive(Clone)]
pub struct Partition<R: Real, D: Dimension, S> {
    /// Arrangement of the grid's nodes.
    pub layout: Layout,
    /// Runs of points.
    pub chunks: Vec<Chunk<R, D, S>>,
    /// By chunk: the nodes around its points.
    pub nodes: Vec<ChunkNodes<R>>,
    /// What the last substep deposited, by chunk.
    pub incoming: Vec<NodeRun<R>>,
    /// Where the present substep deposits, by chunk.
    pub outgoing: Vec<NodeRun<R>>,
    /// Nodes that walls fix, on the grid at its home.
    pub walls: Vec<FixedNodes>,
    /// Nodes that are held beside them, on the grid where it stands.
    pub held: Vec<FixedNodes>,
    /// All fixed nodes, on the grid where it stands.
    pub fixed: Vec<FixedNodes>,
    /// The same before the grid moved last.
    last_fixed: Vec<FixedNodes>,
    /// Points outside the active window: in no chunk, and no substep moves them.
    pub frozen: Vec<Block<R, D, S>>,
    /// Points of the chip's tail: in no chunk either; `speedups::rigid_chip` moves them when points are
    /// sorted.
    pub tail: Vec<Block<R, D, S>>,
    /// Lowest and highest pencil of each chunk's points when they were sorted; (1, 0) for a chunk without
    /// points.
    ends: Vec<(usize, usize)>,
    workspace: Workspace<R, D, S>,
}

impl<R: Real, D: Dimension, S: PointState<R>> Partition<R, D, S> {
    /// Divides `blocks`, whose points may stand in any order, into chunks.
    pub fn new(layout: Layout, walls: Vec<FixedNodes>, blocks: Vec<Block<R, D, S>>) -> Self {
        let points = blocks.len() * BLOCK;
        let count = (points / POINTS_PER_CHUNK).clamp(1, MOST_CHUNKS);
        let mut chunks: Vec<Chunk<R, D, S>> = (0..count).map(|_| Chunk::default()).collect();
        chunks[0].blocks = blocks;
        let mut partition = Partition {
            layout,
            chunks,
            nodes: vec![ChunkNodes::default(); count],
            incoming: vec![NodeRun::default(); count],
            outgoing: vec![NodeRun::default(); count],
            fixed: walls.clone(),
            last_fixed: walls.clone(),
            walls,
            held: Vec::new(),
            frozen: Vec::new(),
            tail: Vec::new(),
            ends: vec![(1, 0); count],
            workspace: Workspace::default(),
        };
        partition.sort(|_, _| {}, false);
        partition
    }

    /// Every point that substeps move, in memory order, with its block and lane.
    pub fn points(&self) -> impl Iterator<Item = (&Block<R, D, S>, usize)> {
        places(self.chunks.iter().flat_map(|chunk| chunk.blocks.iter()))
    }

    /// The points outside the active window.
    pub fn frozen_points(&self) -> impl Iterator<Item = (&Block<R, D, S>, usize)> {
        places(self.frozen.iter())
    }

    /// The points of the chip's tail, where they were when points were last sorted.
    pub fn tail_points(&self) -> impl Iterator<Item = (&Block<R, D, S>, usize)> {
        places(self.tail.iter())
    }

    /// Runs `work` on each chunk by number, with its deposits of the last substep, on the threads of the
    /// current pool or on this one; gives the sum of its results in the order of the chunks.
    pub fn sum_over_chunks(
        &mut self,
        parallel: bool,
        work: impl Fn(&Layout, usize, &mut Chunk<R, D, S>, &mut NodeRun<R>) -> f64 + Sync,
    ) -> f64 {
        let mut sums = [0.0; MOST_CHUNKS];
        let Partition { layout, chunks, incoming, .. } = self;
        let items = chunks.iter_mut().zip(incoming).zip(&mut sums).enumerate();
        for_each(items, parallel, |(number, ((chunk, deposits), sum))| {
            *sum = work(layout, number, chunk, deposits);
        });
        sums.iter().sum()
    }

    /// Gives sorted blocks to the chunks, in equal numbers.
    fn share_out(&mut self, blocks: Vec<Block<R, D, S>>) {
        let (total, count) = (blocks.len(), self.chunks.len());
        let mut blocks = blocks.into_iter();
        for (k, chunk) in self.chunks.iter_mut().enumerate() {
            chunk.blocks = blocks.by_ref().take(share(k, total, count).len()).collect();
        }
    }

    /// Whether every node is owned by one chunk.
    fn has_owners(&self) -> bool {
        let owned = self.nodes.iter().map(ChunkNodes::owned).filter(|owned| !owned.is_empty());
        let mut end = 0;
        for owned in owned {
            if owned.start != end {
                return false;
            }
            end = owned.end;
        }
        end == self.layout.nodes()
    }

    /// Arranges every chunk's nodes for the present layout and ends.
    fn arrange_chunks(&mut self) {
        let mut owned_from = 0;
        for (k, nodes) in self.nodes.iter_mut().enumerate() {
            let next = self.ends[k + 1..].iter().find(|(first, last)| first <= last).map(|range| range.0);
            // A chunk without points (a scene that has lost most of them) stands where nothing is.
            let (first, last) = if self.ends[k].0 <= self.ends[k].1 { self.ends[k] } else { (0, 0) };
            let deposits = [&mut self.incoming[k], &mut self.outgoing[k]];
            owned_from = nodes.arrange::<D>(
                &self.layout,
                ChunkPencils { first, last, next },
                owned_from,
                &self.fixed,
                deposits,
            );
        }
        debug_assert!(self.has_owners(), "nodes without an owner, or with two: chunks {:?}", self.ends);
    }
}

impl<R: Real, D: Dimension, S: PointState<R>> Partition<R, D, S> {
    /// What the present substep deposited becomes what the next one reads.
    pub fn exchange_deposits(&mut self) {
        std::mem::swap(&mut self.incoming, &mut self.outgoing);
    }

    /// Everything that changes, as numbers: points in order, the layout, then the deposits that the next
    /// substep reads.
    pub fn state_bytes(&self) -> StateBytes {
        let count: usize = self.chunks.iter().map(|chunk| chunk.blocks.len()).sum();
        let all = count + self.frozen.len() + self.tail.len();
        let deposits: usize = self.incoming.iter().map(|run| size_of_val(run.records.as_slice())).sum();
        // Deposits of single precision take twice their size; the rest is exact enough to spare most
        // reallocations.
        let mut bulk = StateBytes::with_capacity(all * Self::bytes_per_block() + 2 * deposits + (1 << 16));
        bulk.put_counts([count, self.frozen.len(), self.tail.len()]);
        let blocks = self.chunks.iter().flat_map(|chunk| &chunk.blocks);
        for block in blocks.chain(&self.frozen).chain(&self.tail) {
            for k in 0..Block::<R, D, S>::columns() {
                bulk.put_reals(block.column(k));
            }
            for axis in 0..D::AXES {
                bulk.put(block.node[axis].iter().map(|node| node.to_le_bytes()));
            }
            bulk.put(block.id.iter().map(|id| id.to_le_bytes()));
            bulk.put(block.group.iter().map(|group| [*group]));
            bulk.put(block.side.iter().map(|side| [*side as u8]));
        }
        bulk.put_reals(&self.layout.origin);
        bulk.put([self.layout.second.edge.to_le_bytes(), self.layout.row.to_le_bytes()].into_iter());
        bulk.put(self.layout.low.iter().map(|low| low.to_le_bytes()));
        bulk.put_counts(self.layout.start.iter().copied());
        bulk.put_counts(self.ends.iter().flat_map(|&(first, last)| [first, last]));
        for run in &self.incoming {
            bulk.put_reals(run.records.iter().flat_map(|record| &record.0));
            bulk.put_reals(&run.mass);
            bulk.put_reals(run.shared.iter().flatten());
        }
        bulk
    }

    /// Bytes that `state_bytes` takes for a block: its floating-point columns, then nodes and numbers.
    const fn bytes_per_block() -> usize {
        BLOCK * (8 * Block::<R, D, S>::columns() + 4 * (D::AXES + 1) + 2)
    }

    /// Takes what `state_bytes` gave.
    ///
    /// # Errors
    /// `Error::DamagedState` when it does not fit this scene.
    pub fn restore(&mut self, reader: &mut BulkReader<'_>) -> Result<(), Error> {
        let damaged = BulkReader::damaged;
        let (count, frozen, tail) = (reader.count()?, reader.count()?, reader.count()?);
        // Checked before memory is asked for.
        let most = reader.left() / Self::bytes_per_block();
        let all = count.checked_add(frozen).and_then(|sum| sum.checked_add(tail));
        let all = all.filter(|&all| all <= most).ok_or_else(damaged)?;
        let mut blocks = vec![Block::<R, D, S>::empty(); all];
        for block in &mut blocks {
            for k in 0..Block::<R, D, S>::columns() {
                for value in block.column_mut(k) {
                    *value = reader.real()?;
                }
            }
            for axis in 0..D::AXES {
                for node in &mut block.node[axis] {
                    *node = i32::from_le_bytes(reader.take()?);
                    if *node < 0 || *node >= self.layout.counts[axis] {
                        return Err(damaged());
                    }
                }
            }
            for id in &mut block.id {
                *id = u32::from_le_bytes(reader.take()?);
            }
            for group in &mut block.group {
                [*group] = reader.take()?;
                if usize::from(*group) >= BLOCK {
                    return Err(damaged());
                }
            }
            for side in &mut block.side {
                let [number] = reader.take()?;
                *side = Side::from_number(number).ok_or_else(damaged)?;
            }
        }
        for axis in 0..3 {
            self.layout.origin[axis] = reader.real()?;
        }
        self.layout.second.edge = i32::from_le_bytes(reader.take()?);
        self.layout.row = i32::from_le_bytes(reader.take()?);
        self.place_walls();
        let pencils = self.layout.low.len();
        for low in &mut self.layout.low {
            *low = i32::from_le_bytes(reader.take()?);
        }
        for start in &mut self.layout.start {
            *start = reader.count()?;
        }
        for ends in &mut self.ends {
            let mut pencil = || reader.count().ok().filter(|&k| k < pencils).ok_or_else(damaged);
            *ends = (pencil()?, pencil()?);
        }
        // More nodes than the domain has would be asked for as memory.
        let most: usize = self.layout.counts.iter().map(|&nodes| nodes as usize).product();
        if !self.layout.start.is_sorted() || self.layout.nodes() > most {
            return Err(damaged());
        }
        self.layout.restore_offsets::<D>();
        self.tail = blocks.split_off(count + frozen);
        self.frozen = blocks.split_off(count);
        self.share_out(blocks);
        self.arrange_chunks();
        for run in &mut self.incoming {
            let records = run.records.iter_mut().flat_map(|record| &mut record.0);
            let shared = run.shared.iter_mut().flatten();
            for value in records.chain(&mut run.mass).chain(shared) {
                *value = reader.real()?;
            }
        }
        Ok(())
    }
}

/// The points of some blocks, each with its block and lane.
fn places<'a, R: Real, D: Dimension + 'a, S: PointState<R> + 'a>(
    blocks: impl Iterator<Item = &'a Block<R, D, S>>,
) -> impl Iterator<Item = (&'a Block<R, D, S>, usize)> {
    blocks.flat_map(|block| (0..BLOCK).filter(|&lane| block.is_point(lane)).map(move |lane| (block, lane)))
}
