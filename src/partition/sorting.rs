//! Sorting: points stand in memory as they do in space, and are divided into chunks.
//!
//! It is a stable counting sort by the node's place in memory, so that neighbours in space are
//! neighbours in memory and a chunk's nodes are one run. The order is part of the state: it fixes the order
//! of every sum.
//!
//! ```text
//!   where points stand    block 7 │…abcdefgh…│        most neighbours stay neighbours,
//!   where they go         block 7 │…abc│i│defgh…│     so whole runs of them are copied at once
//! ```
//!
//! Sorted points go to a second set of blocks, which then changes places with the first: after the first
//! sorts no memory is asked for.
//!
//! Where points of a cell are averaged (`transfer::cell_average`) they are sorted by cells, those of a
//! cell stay in one block, and the places left over at its end have no point.

use crate::dimension::Dimension;
use crate::grid::{Layout, MARGIN, PencilRanges};
use crate::parallel::take_turns;
use crate::partition::chunk::Chunk;
use crate::partition::tiles::Tiles;
use crate::partition::{MOST_CHUNKS, Partition};
use crate::points::{BLOCK, Block, PointState};
use crate::simd::Real;

/// Marks a place in memory without a point that stays.
const GONE: u32 = u32::MAX;

/// What sorting needs again and again. It is no part of the state: a copy starts with none.
pub(super) struct Workspace<R: Real, D: Dimension, S> {
    /// By chunk: blocks for the sorted points.
    spare: Vec<Vec<Block<R, D, S>>>,
    /// By place in memory: the point's node, or `GONE`.
    keys: Vec<u32>,
    /// By node: where its next point goes.
    place: Vec<u32>,
    /// By place in the sorted order: where the point stands.
    sources: Vec<u32>,
    /// Number of blocks before each chunk.
    firsts: Vec<usize>,
    ranges: PencilRanges,
    /// Order of the cells, where points of a cell are averaged.
    tiles: Tiles,
}

impl<R: Real, D: Dimension, S> Default for Workspace<R, D, S> {
    fn default() -> Self {
        Workspace {
            spare: Vec::new(),
            keys: Vec::new(),
            place: Vec::new(),
            sources: Vec::new(),
            firsts: Vec::new(),
            ranges: PencilRanges::default(),
            tiles: Tiles::default(),
        }
    }
}

impl<R: Real, D: Dimension, S> Clone for Workspace<R, D, S> {
    fn clone(&self) -> Self {
        Workspace::default()
    }
}

impl<R: Real, D: Dimension, S: PointState<R>> Partition<R, D, S> {
    /// Sorts the points and arranges the grid around them. A point that stands at the domain's rim leaves it:
    /// it is shown to `retire` and is gone. `parallel` spreads the copying over the threads of the current
    /// pool.
    pub fn sort(&mut self, mut retire: impl FnMut(&Block<R, D, S>, usize), parallel: bool) {
        self.key_points(&mut retire);
        self.order_points();
        self.gather_points(parallel);
        for (chunk, spare) in self.chunks.iter_mut().zip(&mut self.workspace.spare) {
            std::mem::swap(&mut chunk.blocks, spare);
        }
        let layout = &self.layout;
        for (chunk, ends) in self.chunks.iter().zip(&mut self.ends) {
            *ends = match (chunk.blocks.first(), chunk.blocks.last()) {
                // Where points are sorted by cells, those of a cell have nodes on either side.
                (Some(_), Some(_)) if layout.averages_cells || layout.second.exists() => {
                    let blocks =
                        chunk.blocks.iter().flat_map(|block| (0..BLOCK).map(move |lane| (block, lane)));
                    let pencils = blocks.map(|(block, lane)| pencils_of(layout, block, lane));
                    pencils.fold((usize::MAX, 0), |(low, high), at| (low.min(at.0), high.max(at.1)))
                }
                (Some(first), Some(last)) => {
                    (pencils_of(layout, first, 0).0, pencils_of(layout, last, BLOCK - 1).1)
                }
                _ => (1, 0),
            };
        }
        if self.layout.second.exists() {
            self.cover_second_field();
        }
        self.arrange_chunks();
    }

    /// Widens chunks so that each node is in the run of the chunk that owns it: nodes of the second field may
    /// be reached by points of chunks far before, and a chunk owns those up to where the next one's points
    /// begin.
    fn cover_second_field(&mut self) {
        // By chunk: lowest pencil of the points of all that follow it.
        let mut next = [usize::MAX; MOST_CHUNKS];
        for k in (1..self.ends.len()).rev() {
            let (first, last) = self.ends[k];
            next[k - 1] = if first <= last { next[k].min(first) } else { next[k] };
        }
        let mut highest = 0;
        for (own, next) in self.ends.iter_mut().zip(next).filter(|(own, _)| own.0 <= own.1) {
            highest = highest.max(own.1);
            own.1 = own.1.max(if next == usize::MAX { highest } else { highest.min(next.saturating_sub(1)) });
        }
    }

    /// Arranges the nodes around the points that stay, and notes by place in memory each point's node, as its
    /// index in the layout; `GONE` where there is no point.
    fn key_points(&mut self, retire: &mut impl FnMut(&Block<R, D, S>, usize)) {
        let Partition { layout, chunks, workspace, .. } = self;
        let Workspace { keys, ranges, tiles, .. } = workspace;
        keys.clear();
        for block in chunks.iter().flat_map(|chunk| &chunk.blocks) {
            for lane in 0..BLOCK {
                let stays = layout.contains::<D>(D::vector(|axis| block.node[axis][lane]));
                keys.push(if block.is_point(lane) && stays { 0 } else { GONE });
                if block.is_point(lane) && !stays {
                    retire(block, lane);
                }
            }
        }
        let blocks = chunks.iter().flat_map(|chunk| &chunk.blocks);
        let nodes =
            blocks.clone().flat_map(|block| (0..BLOCK).map(|lane| D::vector(|axis| block.node[axis][lane])));
        let staying = nodes.clone().zip(keys.iter()).filter(|(_, key)| **key != GONE).map(|(node, _)| node);
        layout.arrange::<D>(staying, ranges);
        if layout.averages_cells {
            tiles.arrange::<D>(layout);
            let cells = blocks.flat_map(|block| (0..BLOCK).map(|lane| cell_of(layout, block, lane)));
            for (cell, key) in cells.zip(keys).filter(|(_, key)| **key != GONE) {
                *key = tiles.place::<D>(layout, cell);
            }
        } else {
            for (node, key) in nodes.zip(keys).filter(|(_, key)| **key != GONE) {
                *key = place_of::<D>(layout, node) as u32;
            }
        }
    }

    /// For each place in the sorted blocks, where its point stands now, `GONE` for a place that stays empty:
    /// points of a cell that are averaged stand in one block.
    fn order_points(&mut self) {
        let Partition { layout, workspace, .. } = self;
        let Workspace { keys, place, sources, tiles, .. } = workspace;
        place.clear();
        place.resize(if layout.averages_cells { tiles.places() } else { layout.nodes() } + 1, 0);
        for &key in keys.iter().filter(|&&key| key != GONE) {
            place[key as usize + 1] += 1;
        }
        // From numbers to first places.
        if layout.averages_cells {
            keep_cells_whole(place);
        } else {
            for k in 1..place.len() {
                place[k] += place[k - 1];
            }
        }
        let end = place.last().copied().unwrap_or(0);
        sources.clear();
        sources.resize(end as usize, GONE);
        for (source, &key) in keys.iter().enumerate() {
            if key != GONE {
                let slot = &mut place[key as usize];
                sources[*slot as usize] = source as u32;
                *slot += 1;
            }
        }
    }

    /// Copies the points in their new order to the spare blocks, in equal numbers for each chunk.
    fn gather_points(&mut self, parallel: bool) {
        let Partition { layout, chunks, workspace, .. } = self;
        let Workspace { spare, sources, firsts, .. } = workspace;
        firsts.clear();
        firsts.extend(chunks.iter().scan(0, |end, chunk| {
            *end += chunk.blocks.len();
            Some(*end - chunk.blocks.len())
        }));
        spare.resize_with(chunks.len(), Vec::new);
        let points = sources.len();
        let (total, count) = (points.div_ceil(BLOCK), chunks.len());
        let jobs = spare.iter_mut().enumerate().map(|(k, blocks)| {
            let share = share(k, total, count);
            let places = share.start * BLOCK..(share.end * BLOCK).min(points);
            blocks.resize_with(share.len(), Block::empty);
            (blocks, &sources[places])
        });
        let copy = |(blocks, sources): (&mut Vec<Block<R, D, S>>, &[u32])| {
            copy_in_order(blocks, sources, chunks, firsts, layout.averages_cells);
            if layout.averages_cells {
                blocks.iter_mut().for_each(|block| group_points(block, layout));
            }
        };
        if parallel { take_turns(jobs, copy) } else { jobs.for_each(copy) }
    }
}

/// Lowest corner of the cell that a point stands in, in the field whose nodes that cell has.
fn cell_of<R: Real, D: Dimension, S: PointState<R>>(
    layout: &Layout,
    block: &Block<R, D, S>,
    lane: usize,
) -> D::Vector<i32> {
    let mut cell = block.cell(lane);
    cell[0] = layout.second.own_column(cell[0]);
    cell
}

/// Lowest and highest pencil that a point may stand at until the next sort: more than its own beside the edge,
/// where it reaches nodes of both fields.
fn pencils_of<R: Real, D: Dimension, S: PointState<R>>(
    layout: &Layout,
    block: &Block<R, D, S>,
    lane: usize,
) -> (usize, usize) {
    let second = &layout.second;
    let pencil = |first: i32| {
        layout.pencil::<D>(D::vector(|axis| if axis == 0 { first } else { block.node[axis][lane] })) as usize
    };
    let first = block.node[0][lane];
    let own = pencil(second.own_column(first));
    if !second.holds(first) || (second.column(first) - second.edge).abs() > 2 * MARGIN {
        return (own, own);
    }
    (pencil(second.column(first)), pencil(first))
}

/// A node's place in memory.
#[inline]
fn place_of<D: Dimension>(layout: &Layout, node: D::Vector<i32>) -> i32 {
    layout.offset[layout.pencil::<D>(node) as usize] + Layout::along::<D>(node)
}

/// From numbers of points, each behind its cell's place, to first places, with the end last; a cell begins a
/// block where it would not fit into the rest of the one before.
fn keep_cells_whole(place: &mut [u32]) {
    let mut end = 0;
    for k in 0..place.len() - 1 {
        let (count, room) = (place[k + 1], BLOCK as u32 - end % BLOCK as u32);
        if count > room && count <= BLOCK as u32 {
            end += room;
        }
        place[k] = end;
        end += count;
    }
    place[place.len() - 1] = end;
}

/// The blocks of chunk `k` of `count` when there are `total`.
pub(super) fn share(k: usize, total: usize, count: usize) -> std::ops::Range<usize> {
    k * total / count..(k + 1) * total / count
}

/// Copies points from where they stand now to `blocks`, in the order of `sources`; places that stay empty
/// repeat the point before them with no volume, so that kernels need no mask.
///
/// * `firsts`: by chunk, blocks before it
/// * `has_gaps`: whether any block may have empty places, not the last one alone
fn copy_in_order<R: Real, D: Dimension, S: PointState<R>>(
    blocks: &mut [Block<R, D, S>],
    sources: &[u32],
    chunks: &[Chunk<R, D, S>],
    firsts: &[usize],
    has_gaps: bool,
) {
    for (block, sources) in blocks.iter_mut().zip(sources.chunks(BLOCK)) {
        let gap = if has_gaps { sources.iter().position(|&source| source == GONE) } else { None };
        let used = gap.unwrap_or(sources.len());
        let mut lane = 0;
        while lane < used {
            let first = sources[lane] as usize;
            // A run ends with the block it stands in.
            let most = (used - lane).min(BLOCK - first % BLOCK);
            let follow = |step: &usize| sources[lane + step] as usize == first + step;
            let length = 1 + (1..most).take_while(follow).count();
            let chunk = firsts.partition_point(|&begin| begin <= first / BLOCK) - 1;
            let from = &chunks[chunk].blocks[first / BLOCK - firsts[chunk]];
            block.copy_points(lane, from, first % BLOCK, length);
            lane += length;
        }
        for lane in used..BLOCK {
            let last = sources[used - 1] as usize;
            let chunk = firsts.partition_point(|&begin| begin <= last / BLOCK) - 1;
            let from = &chunks[chunk].blocks[last / BLOCK - firsts[chunk]];
            block.copy_points(lane, from, last % BLOCK, 1);
            block.volume[lane] = R::ZERO;
            block.id[lane] = u32::MAX;
        }
    }
}

/// Numbers the cells of a block's points, and puts its points in the order of their nearest nodes, so that
/// neighbours share a stencil.
fn group_points<R: Real, D: Dimension, S: PointState<R>>(block: &mut Block<R, D, S>, layout: &Layout) {
    let mut group = 0;
    for lane in 0..BLOCK {
        let cell = |lane: usize| cell_of(layout, block, lane);
        if lane > 0 && cell(lane).as_ref() != cell(lane - 1).as_ref() {
            group += 1;
        }
        block.group[lane] = group;
    }
    let key =
        |block: &Block<R, D, S>, lane: usize| place_of::<D>(layout, D::vector(|axis| block.node[axis][lane]));
    let mut order: [(i32, u8); BLOCK] = std::array::from_fn(|lane| (key(block, lane), lane as u8));
    if order.is_sorted() {
        return;
    }
    order.sort_unstable();
    let from = block.clone();
    for (lane, &(_, source)) in order.iter().enumerate() {
        block.copy_points(lane, &from, source as usize, 1);
        block.group[lane] = from.group[source as usize];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::{PlaneStrain, ThreeDimensional};

    /// Points at random nodes, some on the domain's rim, moved about and sorted again and again: each time
    /// the order must be that of the standard library's stable sort of those that stay, with every quantity
    /// in its place.
    fn check<D: Dimension>(counts: [i32; 3]) {
        let mut seed = 1_u64;
        let mut random = |below: i32| {
            // Knuth's linear congruential generator; its upper bits are the good ones.
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((seed >> 33) % below as u64) as i32
        };
        // 45 full blocks and a bit, for more than one chunk and empty places.
        let total = 45 * BLOCK + 17;
        let mut blocks = vec![Block::<f64, D, ()>::empty(); total.div_ceil(BLOCK)];
        for number in 0..total {
            let (block, lane) = (&mut blocks[number / BLOCK], number % BLOCK);
            block.set_grid_position(lane, D::vector(|axis| f64::from(3 + random(counts[axis] - 6))));
            block.volume[lane] = 1.0 + number as f64;
            block.id[lane] = number as u32;
        }
        let mut partition = Partition::new(Layout::new(counts, 1.0, [0.0; 3]), vec![], blocks);
        for round in 0..4 {
            for block in partition.chunks.iter_mut().flat_map(|chunk| &mut chunk.blocks) {
                for lane in 0..BLOCK {
                    let axis = lane % D::AXES;
                    block.node[axis][lane] =
                        (block.node[axis][lane] + random(3) - 1).clamp(0, counts[axis] - 1);
                }
            }
            let node = |block: &Block<f64, D, ()>, lane: usize| D::vector(|axis| block.node[axis][lane]);
            let mut expected: Vec<(D::Vector<i32>, u32)> = partition
                .points()
                .map(|(block, lane)| (node(block, lane), block.id[lane]))
                .filter(|(node, _)| partition.layout.contains::<D>(*node))
                .collect();
            expected.sort_by(|a, b| a.0.as_ref().cmp(b.0.as_ref()));
            let mut retired = partition.points().count() - expected.len();
            partition.sort(|_, _| retired -= 1, false);
            assert_eq!(retired, 0, "round {round}: points at the rim and points retired");
            let sorted = partition
                .points()
                .map(|(block, lane)| (node(block, lane), block.id[lane], block.volume[lane]));
            let mut count = 0;
            for ((node, id, volume), (expected_node, expected_id)) in sorted.zip(&expected) {
                assert_eq!(
                    (node.as_ref(), id),
                    (expected_node.as_ref(), *expected_id),
                    "round {round}, place {count}"
                );
                assert_eq!(volume, 1.0 + f64::from(id));
                count += 1;
            }
            assert_eq!(count, expected.len());
        }
        assert!(partition.points().count() < total, "no point ever reached the rim");
    }

    /// Points of a cell stand in one block and have a number of their own there, however crowded cells are;
    /// in a block points are in the order of their nodes. No point is lost, and places without one have no
    /// volume.
    fn check_cells<D: Dimension>(counts: [i32; 3]) {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / f64::from(1_u32 << 31)
        };
        let total = 30 * BLOCK + 5;
        let mut blocks = vec![Block::<f64, D, ()>::empty(); total.div_ceil(BLOCK)];
        for number in 0..total {
            let (block, lane) = (&mut blocks[number / BLOCK], number % BLOCK);
            block.set_grid_position(lane, D::vector(|axis| 4.0 + random() * f64::from(counts[axis] - 9)));
            block.volume[lane] = 1.0;
            block.id[lane] = number as u32;
        }
        let layout = Layout { averages_cells: true, ..Layout::new(counts, 1.0, [0.0; 3]) };
        let partition = Partition::new(layout, vec![], blocks);
        let mut places = std::collections::BTreeMap::new();
        let mut seen = vec![false; total];
        for (number, block) in partition.chunks.iter().flat_map(|chunk| &chunk.blocks).enumerate() {
            let mut last = i32::MIN;
            for lane in (0..BLOCK).filter(|&lane| block.is_point(lane)) {
                let cell: Vec<i32> = block.cell(lane).as_ref().to_vec();
                let own = (number, block.group[lane]);
                assert_eq!(*places.entry(cell.clone()).or_insert(own), own, "cell {cell:?} is split");
                let node = D::vector(|axis| block.node[axis][lane]);
                let pencil = partition.layout.pencil::<D>(node) as usize;
                let place = partition.layout.offset[pencil] + Layout::along::<D>(node);
                assert!(place >= last, "block {number} is not in the order of its nodes");
                last = place;
                assert!(!std::mem::replace(&mut seen[block.id[lane] as usize], true), "a point stands twice");
            }
        }
        assert!(seen.iter().all(|&seen| seen), "points are lost");
        let mut owners: Vec<(usize, u8)> = places.values().copied().collect();
        owners.sort_unstable();
        owners.dedup();
        assert_eq!(owners.len(), places.len(), "two cells share a number");
    }

    /// See `check_cells`.
    #[test]
    fn points_of_a_cell_stay_together() {
        check_cells::<PlaneStrain>([40, 30, 1]);
        check_cells::<ThreeDimensional>([16, 14, 12]);
    }

    /// See `check`; nodes in memory lie in the order of their indices, so that of the nodes is the order of
    /// the keys.
    #[test]
    fn sorting_is_the_stable_sort_by_node() {
        check::<PlaneStrain>([30, 20, 1]);
        check::<ThreeDimensional>([14, 12, 10]);
    }
}
