//! The background grid: which nodes exist, fixed nodes, and the momentum equation on a chunk's nodes.
//!
//! Nodes stand in pencils, the lines along the last axis; pencil (i) in the plane and (i, j) in space. A
//! pencil holds only the nodes from its lowest to its highest point, and two more on each side:
//!
//! ```text
//!    y │   ┌┐ chip                nodes of pencil 0, then of pencil 1, … without gaps,
//!      │  ┌┘└┐                    at index offset[pencil] + j
//!      │┌─┴──┴───────┐ workpiece
//!      └┴┴┴┴┴┴┴┴┴┴┴┴┴┴──── x
//! ```
//!
//! so the grid costs memory and time only where there is material, and the domain may be large. The
//! arrangement holds until points are sorted again, before any has moved by more than a cell.
//!
//! What may be touched: a shape function is a type in `shape_function` that implements `ShapeFunction`
//! (weights and slopes of three nodes); `setup` names it, and `setup::courant_limit` finds its stable
//! substep.

pub mod shape_function;
pub(crate) mod body_force;
mod fixed_nodes;
mod places;
mod second_field;

pub use fixed_nodes::FixedNodes;
pub use second_field::SecondField;

use crate::dimension::Dimension;
use crate::simd::{Real, each};

/// Four numbers of a node: in the plane all of it, in space half of it. What they mean depends on the phase
/// of the step: momentum and force while points are gathered, then velocity and its increment.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Record<R>(pub [R; 4]);

/// Nodes that a point may reach before the next sort, on each side: one of the stencil, one of motion.
pub const MARGIN: i32 = 2;

/// Which nodes exist and where they stand in memory.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    /// Number of nodes of the domain along each axis (1 for a missing axis).
    pub counts: [i32; 3],
    /// Cell length (m).
    pub cell: f64,
    /// Position of node (0, 0, 0) (m).
    pub origin: [f64; 3],
    /// Where it stood at the start (m): a grid that moves with the tool stays within a cell of it, and points
    /// that no substep moves are kept from there.
    pub home: [f64; 3],
    /// Columns of the second velocity field, if there is one.
    pub second: SecondField,
    /// Row of nodes that the edge stands on, where the grid moves with it; its column is `second.edge`.
    pub row: i32,
    /// First node index along the last axis, by pencil.
    pub low: Vec<i32>,
    /// Index in memory of the node (pencil, 0); only nodes from `low` on exist.
    pub offset: Vec<i32>,
    /// Nodes before each pencil, and one more entry with all nodes.
    pub start: Vec<usize>,
    /// Whether nodes keep the masses that they share with their neighbours (`partition::smoothing`).
    pub shares_masses: bool,
    /// Whether the points of a cell share their rate of volume change (`transfer::cell_average`).
    pub averages_cells: bool,
}

impl Layout {
    /// A domain of `counts` nodes without any node in memory yet.
    pub fn new(counts: [i32; 3], cell: f64, origin: [f64; 3]) -> Self {
        Layout { counts, cell, origin, home: origin, ..Layout::default() }
    }

    /// Number of pencils in a plane of constant first index.
    pub fn pencils_per_plane<D: Dimension>(&self) -> i32 {
        if D::AXES == 2 { 1 } else { self.counts[1] }
    }

    /// The pencil of a node.
    #[inline(always)]
    pub fn pencil<D: Dimension>(&self, node: D::Vector<i32>) -> i32 {
        if D::AXES == 2 { node[0] } else { node[0] * self.counts[1] + node[1] }
    }

    /// Index of a node along the last axis.
    #[inline(always)]
    pub fn along<D: Dimension>(node: D::Vector<i32>) -> i32 {
        node[D::AXES - 1]
    }

    /// Number of nodes in memory.
    pub fn nodes(&self) -> usize {
        self.start.last().copied().unwrap_or(0)
    }

    /// Whether a point may stand at a node: far enough from the domain's rim that its stencil fits until the
    /// next sort.
    pub fn contains<D: Dimension>(&self, node: D::Vector<i32>) -> bool {
        let inside = |index: i32, count: i32| index > MARGIN && index < count - 1 - MARGIN;
        inside(self.second.column(node[0]), self.second.columns(self.counts[0]))
            && (1..D::AXES).all(|axis| inside(node[axis], self.counts[axis]))
    }

    /// Arranges the nodes around points at `nodes`; `ranges` is working memory.
    pub fn arrange<D: Dimension>(
        &mut self,
        nodes: impl Iterator<Item = D::Vector<i32>>,
        ranges: &mut PencilRanges,
    ) {
        let plane = self.pencils_per_plane::<D>();
        let pencils = (self.counts[0] * plane) as usize;
        let PencilRanges { range, narrow } = ranges;
        range.clear();
        range.resize(pencils, (i32::MAX, i32::MIN));
        for node in nodes {
            let along = Self::along::<D>(node);
            let entry = &mut range[self.pencil::<D>(node) as usize];
            *entry = (entry.0.min(along), entry.1.max(along));
        }
        widen(range, plane as usize, narrow);
        if D::AXES == 3 {
            for row in range.chunks_mut(plane as usize) {
                widen(row, 1, narrow);
            }
        }
        let shared = self.second.shared_columns();
        let pencils_of = |column: i32| (column * plane) as usize..((column + 1) * plane) as usize;
        for (own, other) in shared.clone() {
            for (pencil, alias) in pencils_of(own).zip(pencils_of(other)) {
                let (low, high) = std::mem::replace(&mut range[alias], (i32::MAX, i32::MIN));
                range[pencil] = (range[pencil].0.min(low), range[pencil].1.max(high));
            }
        }
        self.low.clear();
        self.offset.clear();
        self.start.clear();
        let mut total = 0_usize;
        for &(low, high) in range.iter() {
            self.start.push(total);
            if low > high {
                self.low.push(0);
                self.offset.push(0);
            } else {
                let low = low - MARGIN;
                self.low.push(low);
                self.offset.push(total as i32 - low);
                total += (high + MARGIN - low + 1) as usize;
            }
        }
        self.start.push(total);
        self.share_columns::<D>();
    }

    /// Lets the second field's pencils before the edge stand for those of the first.
    fn share_columns<D: Dimension>(&mut self) {
        let plane = self.pencils_per_plane::<D>();
        for (own, other) in self.second.shared_columns() {
            for k in 0..plane {
                let (pencil, alias) = ((own * plane + k) as usize, (other * plane + k) as usize);
                self.low[alias] = self.low[pencil];
                self.offset[alias] = self.offset[pencil];
            }
        }
    }

    /// Offsets again from `start` and `low`.
    pub fn restore_offsets<D: Dimension>(&mut self) {
        self.offset.clear();
        for (pencil, &low) in self.low.iter().enumerate() {
            let exists = self.start[pencil + 1] > self.start[pencil];
            self.offset.push(if exists { self.start[pencil] as i32 - low } else { 0 });
        }
        self.share_columns::<D>();
    }

    /// Position (m) of the node `along` a pencil; z is 0 in the plane.
    pub fn position<D: Dimension>(&self, pencil: usize, along: i32) -> [f64; 3] {
        let plane = self.pencils_per_plane::<D>();
        let (first, second) = (self.second.column(pencil as i32 / plane), pencil as i32 % plane);
        let index = if D::AXES == 2 { [first, along, 0] } else { [first, second, along] };
        std::array::from_fn(|axis| self.origin[axis] + self.cell * f64::from(index[axis]))
    }
}

/// Working memory of `Layout::arrange`: lowest and highest node of each pencil, and a copy.
#[derive(Debug, Default)]
pub struct PencilRanges {
    range: Vec<(i32, i32)>,
    narrow: Vec<(i32, i32)>,
}

/// Gives each entry the widest range within `MARGIN` entries, `stride` apart; `narrow` is working memory.
fn widen(range: &mut [(i32, i32)], stride: usize, narrow: &mut Vec<(i32, i32)>) {
    narrow.clear();
    narrow.extend_from_slice(range);
    for (k, entry) in range.iter_mut().enumerate() {
        for step in 1..=MARGIN as usize {
            let neighbours = [k.checked_sub(step * stride), Some(k + step * stride)];
            for other in neighbours.into_iter().flatten().filter_map(|index| narrow.get(index)) {
                *entry = (entry.0.min(other.0), entry.1.max(other.1));
            }
        }
    }
}

/// Velocity components of a node's record.
#[inline(always)]
pub fn velocity<R: Real, D: Dimension>(record: &[Record<R>]) -> D::Vector<f64> {
    D::vector(|axis| record[0].0[axis].to_f64())
}

/// Velocity increments of a node's record.
#[inline(always)]
pub fn increment<R: Real, D: Dimension>(record: &[Record<R>]) -> D::Vector<f64> {
    D::vector(|axis| if D::QUADS == 1 { record[0].0[2 + axis].to_f64() } else { record[1].0[axis].to_f64() })
}

/// Writes velocity and increment of a node.
#[inline(always)]
pub fn set_node<R: Real, D: Dimension>(
    record: &mut [Record<R>],
    velocity: D::Vector<f64>,
    increment: D::Vector<f64>,
) {
    for axis in 0..D::AXES {
        record[0].0[axis] = R::from_f64(velocity[axis]);
        if D::QUADS == 1 {
            record[0].0[2 + axis] = R::from_f64(increment[axis]);
        } else {
            record[1].0[axis] = R::from_f64(increment[axis]);
        }
    }
}

/// Adds to the force of a node's record while it holds momentum and force (N).
pub fn add_force<R: Real, D: Dimension>(record: &mut [Record<R>], force: D::Vector<f64>) {
    for axis in 0..D::AXES {
        let component = if D::QUADS == 1 { &mut record[0].0[2 + axis] } else { &mut record[1].0[axis] };
        *component += R::from_f64(force[axis]);
    }
}

/// Adds to the momentum of such a record (kg m/s).
pub fn add_momentum<R: Real, D: Dimension>(record: &mut [Record<R>], momentum: D::Vector<f64>) {
    for axis in 0..D::AXES {
        record[0].0[axis] += R::from_f64(momentum[axis]);
    }
}

/// Momentum and force over mass: eqs. 6, 10 and 15 of Ambati et al. (2011) on every node of a slice.
///
/// * `records`: momentum (kg m/s) and force (N); becomes velocity after the step and its increment (m/s)
/// * `mass`: lumped mass (kg), eq. 7; a node lighter than `lightest` (kg) stays at rest
/// * `dt`: substep (s)
#[inline(always)]
pub fn momentum_to_velocity<R: Real, D: Dimension>(
    records: &mut [Record<R>],
    mass: &[R],
    lightest: R,
    dt: R,
) {
    for (node, &m) in records.chunks_exact_mut(D::QUADS).zip(mass) {
        let inverse = if m > lightest { R::ONE / m } else { R::ZERO };
        let impulse = inverse * dt;
        if D::QUADS == 1 {
            let [px, py, fx, fy] = node[0].0;
            let (ax, ay) = (fx * impulse, fy * impulse);
            node[0].0 = [px * inverse + ax, py * inverse + ay, ax, ay];
        } else {
            let (p, f) = (node[0].0, node[1].0);
            let a = each!(axis < 4 => f[axis] * impulse);
            node[0].0 = each!(axis < 4 => p[axis] * inverse + a[axis]);
            node[1].0 = a;
        }
    }
}

/// Kinetic energy of the velocity increments, ½ Σ m |Δv|² (J).
#[inline(always)]
pub fn increment_energy<R: Real, D: Dimension>(records: &[Record<R>], mass: &[R]) -> f64 {
    // Four running sums: the compiler keeps them side by side.
    let mut sums = [R::ZERO; 4];
    for (node, &m) in records.chunks_exact(D::QUADS).zip(mass) {
        let increments =
            if D::QUADS == 1 { [R::ZERO, R::ZERO, node[0].0[2], node[0].0[3]] } else { node[1].0 };
        for (sum, increment) in sums.iter_mut().zip(increments) {
            *sum += m * increment * increment;
        }
    }
    0.5 * sums.iter().map(|sum| sum.to_f64()).sum::<f64>()
}

/// Half the work of all forces at the new velocities, ½ Σ m Δv·v (J): with an affine transfer in the place of
/// the increments' energy.
#[inline(always)]
pub fn half_work<R: Real, D: Dimension>(records: &[Record<R>], mass: &[R]) -> f64 {
    let nodes = records.chunks_exact(D::QUADS).zip(mass);
    let work = |(node, &m): (&[Record<R>], &R)| {
        let (velocity, change) = (velocity::<R, D>(node), increment::<R, D>(node));
        m.to_f64() * (0..D::AXES).map(|axis| change[axis] * velocity[axis]).sum::<f64>()
    };
    0.5 * nodes.map(work).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::{PlaneStrain, ThreeDimensional};

    /// Every node that a point reaches before the next sort exists, each at a place of its own, without gaps.
    fn check<D: Dimension>(counts: [i32; 3], nodes: &[D::Vector<i32>]) {
        let mut layout = Layout::new(counts, 1.0, [0.0; 3]);
        layout.arrange::<D>(nodes.iter().copied(), &mut PencilRanges::default());
        let place = |node: D::Vector<i32>| {
            let pencil = layout.pencil::<D>(node) as usize;
            let index = layout.offset[pencil] + Layout::along::<D>(node);
            let own = layout.start[pencil] as i32..layout.start[pencil + 1] as i32;
            assert!(own.contains(&index), "node {node:?} has index {index}, its pencil has {own:?}");
        };
        for node in nodes {
            assert!(layout.contains::<D>(*node), "{node:?} is too near the rim for this test");
            for shift in 0..5_i32.pow(D::AXES as u32) {
                place(D::vector(|axis| node[axis] + shift / 5_i32.pow(axis as u32) % 5 - MARGIN));
            }
        }
        let mut restored = layout.clone();
        restored.restore_offsets::<D>();
        assert_eq!(restored.offset, layout.offset);
    }

    /// See `check`; a chip beside the workpiece makes ragged pencils.
    #[test]
    fn every_node_in_reach_of_a_point_exists() {
        check::<PlaneStrain>([30, 40, 1], &[[5, 5], [5, 6], [6, 30], [12, 4], [24, 36]]);
        check::<ThreeDimensional>([20, 18, 16], &[[4, 4, 4], [5, 12, 9], [15, 3, 12], [15, 4, 3]]);
    }

    /// v = (p + f Δt)/m on every node, and a node without mass stays at rest.
    #[test]
    fn momentum_equation_gives_velocity_and_increment() {
        let mut flat = [Record([6.0, -4.0, 10.0, 20.0]), Record([0.0, 0.0, 7.0, 7.0])];
        momentum_to_velocity::<f64, PlaneStrain>(&mut flat, &[2.0, 0.0], 1e-30, 0.5);
        assert_eq!(flat, [Record([5.5, 3.0, 2.5, 5.0]), Record([0.0; 4])]);
        let mut deep = [Record([6.0, -4.0, 8.0, 0.0]), Record([10.0, 20.0, -4.0, 0.0])];
        momentum_to_velocity::<f64, ThreeDimensional>(&mut deep, &[2.0], 1e-30, 0.5);
        assert_eq!(deep, [Record([5.5, 3.0, 3.0, 0.0]), Record([2.5, 5.0, -1.0, 0.0])]);
        // ½ m |Δv|², all numbers exact.
        assert_eq!(increment_energy::<f64, PlaneStrain>(&flat, &[2.0, 0.0]), 31.25);
        assert_eq!(increment_energy::<f64, ThreeDimensional>(&deep, &[2.0]), 32.25);
    }
}
