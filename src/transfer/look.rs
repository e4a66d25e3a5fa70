//! Points whose velocity differs from the one with which they move: candidates of the guard on outlier
//! velocities (`outliers`).
//!
//! Here, because a pass over the points has both at hand and a pass of its own would have to gather the
//! second anew.

use super::scratch::Rows;
use crate::dimension::Dimension;
use crate::points::{BLOCK, Column};
use crate::simd::{Kernel, Mask, Real, Simd, Vector};

/// A point to look at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// Its block in the chunk.
    pub block: usize,
    /// Its place in the block.
    pub lane: usize,
}

/// A look at all points' velocities.
pub struct OutlierScan<'a> {
    /// Difference along an axis (m/s) that makes a candidate.
    pub bound: f64,
    /// Those found, in the points' order.
    pub candidates: &'a mut Vec<Candidate>,
}

impl OutlierScan<'_> {
    /// Notes the points of a block whose velocities are `apart` (m/s) by more than the bound.
    pub(super) fn note<R: Real>(&mut self, block: usize, apart: &Column<R>, volume: &Column<R>) {
        let bound = R::from_f64(self.bound);
        let lanes = (0..BLOCK).filter(|&lane| apart[lane] > bound && volume[lane] > R::ZERO);
        self.candidates.extend(lanes.map(|lane| Candidate { block, lane }));
    }
}

/// Largest difference along an axis (m/s) of each of a block's points, if any is beyond `bound`.
pub(super) struct Differences<'a, R: Real, D: Dimension> {
    /// Records whose first entries are the velocities with which the points move (m/s).
    pub values: &'a Rows<R>,
    /// Their own velocities (m/s).
    pub velocity: &'a D::Vector<Column<R>>,
    /// m/s
    pub bound: R,
}

impl<R: Real, D: Dimension> Kernel<R> for Differences<'_, R, D> {
    type Output = Option<Column<R>>;

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) -> Option<Column<R>> {
        let zero = S::Lanes::constant(0.0);
        let mut apart = [R::ZERO; BLOCK];
        let mut most = zero;
        for lane in (0..BLOCK).step_by(S::Lanes::LANES) {
            let moving = S::load_transposed(&self.values.as_flattened()[4 * lane..]);
            let mut largest = zero;
            for axis in 0..D::AXES {
                let own = S::Lanes::load(&self.velocity[axis][lane..]);
                largest = largest.max((own - moving[axis]).abs());
            }
            largest.store(&mut apart[lane..]);
            most = most.max(largest);
        }
        most.gt(S::Lanes::splat(self.bound)).any().then_some(apart)
    }
}
