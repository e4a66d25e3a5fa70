//! Smoothed increments: the material is strained by velocities that the points can follow, and substeps may
//! be twice as long.
//!
//! FLIP gives the nodes' increments Δv to the points, and what comes back to the nodes is P Δv, with
//!
//! P_ij = m_ij/m_i,  m_ij = Σ_p m_p w_ip w_jp,
//!
//! the consistent mass matrix over the lumped one: next to nothing of the shortest waves, and of a node at a
//! surface that holds next to no mass whatever its neighbours do. Points are moved and strained by v + Δv all
//! the same, and at such nodes it is this that limits the substep (`setup::courant_limit`). Here they are
//! moved and strained by v + P′Δv instead,
//!
//! (P′Δv)_i = Δv_i − Σ_j m_ij (Δv_i − Δv_j)/m_i
//!
//! over the up to eight nodes j a cell away. With all j it would be P; leaving out those that are two cells
//! away saves two thirds of the work and keeps P′ between P and 1:
//!
//! * P′ takes nothing from uniform motion and keeps momentum: m_ij = m_ji.
//! * Between P and 1 a substep takes energy out of short waves and gives none while points stay where they
//!   are in their cells. (With m_ij guessed from the nodes' masses P′ falls below P here and there, and waves
//!   grow.)
//! * The limit of the Courant number is 1.12 for steel where that of plain increments is 0.55.
//!
//! What it takes away is what damps: points that pass from cell to cell feed waves, and with plain increments
//! the part 1 − P of each increment is lost to the waves again. An elastic bar in flight stays quiet at 50
//! m/s and not at 100 (book/src/evidence/hard-cases.md), and a chip of 120,000 points takes more plastic
//! strain (book/src/evidence/performance.md). So smoothing is for `fast`, and for whoever asks for it.
//!
//! Points gain Δv as ever, so momentum, contact and its impulses do not change. What the stress does not do
//! on Δv − P′Δv, nor impulses J of contact, is an entry of the ledger's damping: Σ m Δv·P′Δv in the place of
//! Σ m |Δv|², and Σ J·(Δv − P′Δv).
//!
//! That straining by the velocities which points give back is stable in longer steps is known (Sulsky, Zhou
//! and Schreyer, 1995, doi:10.1016/0010-4655(94)00170-7, who go over the points twice for it); that near
//! neighbours suffice is this project's.
//!
//! Form of the effect: the pass over the points adds shared masses (`transfer`), and a pass over the nodes
//! follows contact.

use crate::dimension::PlaneStrain;
use crate::grid::{Layout, Record};
use crate::simd::{InstructionSet, Kernel, Real, Simd, Vector, dispatch};
use crate::transfer::NodeRun;
use std::ops::Range;

/// By how much smoothed increments differ from plain ones, on the nodes of one chunk.
#[derive(Clone, Debug, Default)]
pub struct Smoothing<R> {
    /// By node, in the last two entries: P′Δv − Δv (m/s).
    changes: Vec<Record<R>>,
}

impl<R: Real> Smoothing<R> {
    /// Finds the differences, on the nodes of some pencils; those lighter than `lightest` (kg) have none.
    pub fn find(
        &mut self,
        (nodes, layout, pencils): (&NodeRun<R>, &Layout, Range<usize>),
        lightest: R,
        instructions: InstructionSet,
    ) {
        let count = nodes.count::<PlaneStrain>();
        self.changes.clear();
        self.changes.resize(count, Record::default());
        let changes = &mut self.changes;
        dispatch(instructions, SmoothingPass { nodes, layout, pencils, lightest, changes });
    }

    /// Leaves a node as it is along some axes.
    pub fn leave(&mut self, node: usize, axes: [bool; 3]) {
        let change = &mut self.changes[node].0;
        (0..2).filter(|&axis| axes[axis]).for_each(|axis| change[2 + axis] = R::ZERO);
    }

    /// ½ Σ m Δv·(P′Δv − Δv) over nodes of a range, less ½ Σ J·(P′Δv − Δv) over those that contact has
    /// `touched` (J): what the ledger takes beside ½ Σ m |Δv|².
    ///
    /// * `touched`: node and change of velocity, J/m (m/s)
    pub fn half_work(
        &self,
        nodes: &NodeRun<R>,
        owned: Range<usize>,
        touched: impl Iterator<Item = (usize, [f64; 3])>,
    ) -> f64 {
        // Four running sums: the compiler keeps them side by side.
        let mut sums = [R::ZERO; 4];
        let records = nodes.records[owned.clone()].iter().zip(&self.changes[owned.clone()]);
        for ((Record(record), Record(change)), &mass) in records.zip(&nodes.mass[owned]) {
            for (sum, (&gain, &change)) in sums.iter_mut().zip(record.iter().zip(change)) {
                *sum += mass * gain * change;
            }
        }
        let by_contact = |(node, gain): (usize, [f64; 3])| {
            let [.., x, y] = self.changes[node].0;
            nodes.mass[node].to_f64() * (gain[0] * x.to_f64() + gain[1] * y.to_f64())
        };
        0.5 * (sums[2].to_f64() + sums[3].to_f64() - touched.map(by_contact).sum::<f64>())
    }

    /// Adds the differences to the velocities; the increments, which points gain, stay.
    pub fn apply(&self, nodes: &mut NodeRun<R>) {
        for (Record(record), Record(change)) in nodes.records.iter_mut().zip(&self.changes) {
            record[0] += change[2];
            record[1] += change[3];
        }
    }

    /// Takes them away again.
    pub fn take_back(&self, nodes: &mut NodeRun<R>) {
        for (Record(record), Record(change)) in nodes.records.iter_mut().zip(&self.changes) {
            record[0] -= change[2];
            record[1] -= change[3];
        }
    }
}

/// The differences from velocities and increments, masses and shared masses.
struct SmoothingPass<'a, R> {
    nodes: &'a NodeRun<R>,
    layout: &'a Layout,
    pencils: Range<usize>,
    lightest: R,
    /// All 0 to begin with.
    changes: &'a mut [Record<R>],
}

impl<R: Real> Kernel<R> for SmoothingPass<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) {
        let SmoothingPass { nodes, layout, pencils, lightest, changes } = self;
        let bounds = |pencil: usize| {
            let low = layout.low[pencil];
            (low, low + (layout.start[pencil + 1] - layout.start[pencil]) as i32)
        };
        let place = |pencil: usize, along: i32| (layout.offset[pencil] + along) as usize - nodes.first;
        for pencil in pencils.clone() {
            let (low, high) = bounds(pencil);
            if low == high {
                continue;
            }
            let begin = place(pencil, low);
            exchange_along::<S>(nodes, changes, begin..begin + (high - low) as usize);
            if pencil + 1 == pencils.end {
                continue;
            }
            // Nodes that both pencils have; no point reaches others of both.
            let next = bounds(pencil + 1);
            let (low, high) = (low.max(next.0), high.min(next.1));
            if low < high {
                let firsts = [place(pencil, low), place(pencil + 1, low)];
                exchange_across::<S>(nodes, changes, firsts, (high - low) as usize);
            }
        }
        let count = changes.len();
        for (Record(change), &mass) in changes.iter_mut().zip(&nodes.mass[..count]) {
            let inverse = if mass > lightest { R::ONE / mass } else { R::ZERO };
            change.iter_mut().for_each(|entry| *entry *= inverse);
        }
    }
}

/// What the nodes of a pencil give each other.
#[inline(always)]
fn exchange_along<S: Simd>(
    nodes: &NodeRun<S::Scalar>,
    changes: &mut [Record<S::Scalar>],
    pencil: Range<usize>,
) {
    let shared = &nodes.shared[1][pencil.clone()];
    let (records, changes) = (&nodes.records[pencil.clone()], &mut changes[pencil]);
    let mut here = S::Quad::load(&records[0].0);
    let mut sum = S::Quad::load(&changes[0].0);
    for k in 1..records.len() {
        let next = S::Quad::load(&records[k].0);
        let given = S::Quad::splat(shared[k - 1]) * (next - here);
        (sum + given).store(&mut changes[k - 1].0);
        sum = S::Quad::load(&changes[k].0) - given;
        here = next;
    }
    let last = records.len() - 1;
    sum.store(&mut changes[last].0);
}

/// What `count` nodes of two neighbouring pencils give each other, straight and along the diagonals of the
/// cells between them; what the next nodes have to get waits in registers.
#[inline(always)]
fn exchange_across<S: Simd>(
    nodes: &NodeRun<S::Scalar>,
    changes: &mut [Record<S::Scalar>],
    [a, b]: [usize; 2],
    count: usize,
) {
    let [along_x, _, diagonal] = &nodes.shared;
    let (along_x, diagonal) = (&along_x[a..a + count], &diagonal[a..a + count]);
    let load = |records: &[Record<S::Scalar>], k: usize| S::Quad::load(&records[k].0);
    let (mut here, mut there) = (load(&nodes.records, a), load(&nodes.records, b));
    let (mut sum_a, mut sum_b) = (load(changes, a), load(changes, b));
    for k in 0..count - 1 {
        let (next_here, next_there) = (load(&nodes.records, a + k + 1), load(&nodes.records, b + k + 1));
        let straight = S::Quad::splat(along_x[k]) * (there - here);
        let both = S::Quad::splat(diagonal[k]);
        let (up, down) = (both * (next_there - here), both * (there - next_here));
        (sum_a + (straight + up)).store(&mut changes[a + k].0);
        (sum_b - (straight + down)).store(&mut changes[b + k].0);
        sum_a = load(changes, a + k + 1) + down;
        sum_b = load(changes, b + k + 1) - up;
        (here, there) = (next_here, next_there);
    }
    let straight = S::Quad::splat(along_x[count - 1]) * (there - here);
    (sum_a + straight).store(&mut changes[a + count - 1].0);
    (sum_b - straight).store(&mut changes[b + count - 1].0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::PencilRanges;

    /// Nodes of a ragged layout with random velocities, increments and shared masses; by node its indices
    /// along the axes.
    fn nodes() -> (Layout, NodeRun<f64>, Vec<[i32; 2]>) {
        let mut layout = Layout { shares_masses: true, ..Layout::new([20, 30, 1], 1.0, [0.0; 3]) };
        let points = [[5, 5], [5, 9], [6, 16], [9, 4], [13, 22], [14, 20]];
        layout.arrange::<PlaneStrain>(points.into_iter(), &mut PencilRanges::default());
        let mut noise = 1u64;
        let mut random = move || {
            // Knuth's linear congruence; its upper bits are random enough.
            noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (noise >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut run = NodeRun::default();
        run.reset::<PlaneStrain>(0, layout.nodes(), true);
        let mut places = Vec::new();
        for pencil in 0..20 {
            for k in 0..layout.start[pencil + 1] - layout.start[pencil] {
                places.push([pencil as i32, layout.low[pencil] + k as i32]);
            }
        }
        let exists = |place: [i32; 2]| places.contains(&place);
        for (node, &[x, y]) in places.iter().enumerate() {
            run.records[node] = Record([random(), random(), random() - 0.5, random() - 0.5]);
            run.mass[node] = 4.0 + random();
            let [right, above, corner] = [[x + 1, y], [x, y + 1], [x + 1, y + 1]].map(exists);
            run.shared[0][node] = if right { random() } else { 0.0 };
            run.shared[1][node] = if above { random() } else { 0.0 };
            run.shared[2][node] = if right && above && corner { random() } else { 0.0 };
        }
        (layout, run, places)
    }

    /// The mass that two nodes share.
    fn shared(run: &NodeRun<f64>, places: &[[i32; 2]], one: usize, other: usize) -> f64 {
        let [a, b] = [places[one], places[other]];
        let find = |place: [i32; 2]| places.iter().position(|&other| other == place);
        match [b[0] - a[0], b[1] - a[1]] {
            [1, 0] => run.shared[0][one],
            [0, 1] => run.shared[1][one],
            [1, 1] => run.shared[2][one],
            // The cell's record stands at its lower left node.
            [1, -1] => find([a[0], a[1] - 1]).map_or(0.0, |corner| run.shared[2][corner]),
            [-1, _] | [0, -1] => shared(run, places, other, one),
            _ => 0.0,
        }
    }

    /// (P′Δv)_i = Δv_i − Σ_j m_ij (Δv_i − Δv_j)/m_i over all pairs of nodes, one after another; and m_ij =
    /// m_ji keeps momentum.
    #[test]
    fn smoothed_increments_are_those_of_the_definition() {
        let (layout, run, places) = nodes();
        for instructions in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
            let mut smoothing = Smoothing::default();
            smoothing.find((&run, &layout, 0..20), 0.0, instructions);
            let mut momentum = [0.0; 2];
            let mut largest = 0.0_f64;
            for one in 0..places.len() {
                for axis in 0..2 {
                    let gain = |node: usize| run.records[node].0[2 + axis];
                    let given = |other: usize| {
                        if other == one {
                            0.0
                        } else {
                            shared(&run, &places, one, other) * (gain(other) - gain(one))
                        }
                    };
                    let expected = (0..places.len()).map(given).sum::<f64>() / run.mass[one];
                    let change = smoothing.changes[one].0[2 + axis];
                    assert!((change - expected).abs() < 1e-14, "node {one}: {change}, expected {expected}");
                    momentum[axis] += run.mass[one] * change;
                    largest = largest.max(expected.abs());
                }
            }
            assert!(largest > 0.1, "nothing was smoothed: {largest}");
            assert!(momentum.iter().all(|sum| sum.abs() < 1e-12), "momentum {momentum:?}");
        }
    }

    /// Applied and taken back, velocities are what they were but for rounding, increments exactly; uniform
    /// increments and axes that are left out do not change.
    #[test]
    fn velocities_take_the_difference_and_increments_stay() {
        let (layout, mut run, places) = nodes();
        let mut smoothing = Smoothing::default();
        smoothing.find((&run, &layout, 0..20), 0.0, InstructionSet::Portable);
        smoothing.leave(7, [true, false, true]);
        let before = run.records.clone();
        smoothing.apply(&mut run);
        let moved = |node: usize, axis: usize| run.records[node].0[axis] - before[node].0[axis];
        assert_eq!(moved(7, 0), 0.0);
        assert!((0..places.len()).filter(|&node| moved(node, 0) != 0.0).count() > places.len() / 2);
        assert!((0..places.len()).all(|node| run.records[node].0[2..] == before[node].0[2..]));
        smoothing.take_back(&mut run);
        let off = (0..places.len()).map(|node| (run.records[node].0[0] - before[node].0[0]).abs());
        assert!(off.fold(0.0, f64::max) < 1e-15);
        run.records.iter_mut().for_each(|Record(record)| (record[2], record[3]) = (0.3, -0.2));
        smoothing.find((&run, &layout, 0..20), 0.0, InstructionSet::Portable);
        assert!(smoothing.changes.iter().all(|Record(change)| change[2..] == [0.0; 2]));
    }
}
