//! Mean dilatation: the points of a cell share their rate of volume change and the pressure that does work on
//! it.
//!
//! Plastic flow keeps its volume. With as many points as a cell has, each by itself, there are more such
//! conditions than the cell's nodes can meet: full integration locks. Here the points of a cell (those that
//! stood in one when they were sorted, a group g) have its mean rate. With n = 2 in the plane and 3 in space,
//!
//! L̃_p = L_p + (θ̄_g − θ_p)/n I,    θ = tr L,    θ̄_g = Σ_g V θ / Σ_g V,
//!
//! V the volumes at the start; and the same operator, which is its own adjoint with these as weights, is
//! applied to the stress that stands in the nodal forces f_i = −Σ V τ̃_p ∇N_ip. So the stress power Σ V τ :
//! L̃ is the work of the nodal forces, and the energy closes. A point's own stress is not overwritten.
//!
//! Source: mean dilatation of finite elements, Hughes (1980), doi:10.1002/nme.1620150914; here over the points
//! of a cell.
//!
//! Form of the effect: two short passes over a block's scratch where `Layout::means_dilatation` is set; the
//! points of a cell stand in one block then, and are sorted by cells.

use super::scratch::{Rows, Scratch};
use crate::dimension::Dimension;
use crate::points::{BLOCK, Column};
use crate::simd::{Kernel, Real, Simd};
use std::marker::PhantomData;

/// After stage 2: the points of a cell get one rate of volume change.
pub(super) struct ShareRate<'a, R, D> {
    volume: &'a Column<R>,
    group: &'a Column<u8>,
    scratch: &'a mut Scratch<R>,
    dimension: PhantomData<D>,
}

/// After stage 3: their parts in the nodal forces get one pressure.
pub(super) struct SharePressure<'a, R, D> {
    volume: &'a Column<R>,
    group: &'a Column<u8>,
    scratch: &'a mut Scratch<R>,
    dimension: PhantomData<D>,
}

impl<'a, R, D> ShareRate<'a, R, D> {
    /// Of a block's points, with the gradients of their velocities in the scratch.
    #[inline(always)]
    pub(super) fn of(volume: &'a Column<R>, group: &'a Column<u8>, scratch: &'a mut Scratch<R>) -> Self {
        ShareRate { volume, group, scratch, dimension: PhantomData }
    }
}

impl<'a, R, D> SharePressure<'a, R, D> {
    /// Of a block's points, with their forces in the scratch.
    #[inline(always)]
    pub(super) fn of(volume: &'a Column<R>, group: &'a Column<u8>, scratch: &'a mut Scratch<R>) -> Self {
        SharePressure { volume, group, scratch, dimension: PhantomData }
    }
}

impl<R: Real, D: Dimension> Kernel<R> for ShareRate<'_, R, D> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) {
        Groups::of(self.volume, self.group).share_rate::<D>(&mut self.scratch.gradients);
    }
}

impl<R: Real, D: Dimension> Kernel<R> for SharePressure<'_, R, D> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) {
        // In the plane force follows momentum in the same record.
        let first = if D::QUADS == 1 { 2 } else { 0 };
        Groups::of(self.volume, self.group).share_pressure::<D>(&mut self.scratch.gradients, first);
    }
}

/// The cells of a block's points.
struct Groups<'a, R> {
    volume: &'a Column<R>,
    group: &'a Column<u8>,
    /// By group: one over the volume of its points (1/m3).
    inverse: Column<R>,
}

impl<'a, R: Real> Groups<'a, R> {
    /// Of points of these volumes (m3) in these groups.
    #[inline(always)]
    fn of(volume: &'a Column<R>, group: &'a Column<u8>) -> Self {
        let mut inverse = [R::ZERO; BLOCK];
        for lane in 0..BLOCK {
            inverse[place(group, lane)] += volume[lane];
        }
        for sum in &mut inverse {
            // A group without points, or of places that stay empty, is asked for by none.
            *sum = if *sum > R::ZERO { R::ONE / *sum } else { R::ZERO };
        }
        Groups { volume, group, inverse }
    }

    /// Gives each point's velocity gradient the mean trace of its group.
    ///
    /// * `rows`: by axis and point, derivatives of the velocity's components along the axis
    #[inline(always)]
    fn share_rate<D: Dimension>(&self, rows: &mut [Rows<R>; 3]) {
        let mut mean = [R::ZERO; BLOCK];
        for lane in 0..BLOCK {
            mean[place(self.group, lane)] += self.volume[lane] * trace::<R, D>(rows, lane, 0);
        }
        for (mean, &inverse) in mean.iter_mut().zip(&self.inverse) {
            *mean *= inverse;
        }
        let share = R::ONE / R::from_f64(D::AXES as f64);
        for lane in 0..BLOCK {
            let shift = share * (mean[place(self.group, lane)] - trace::<R, D>(rows, lane, 0));
            shift_diagonal::<R, D>(rows, lane, 0, shift);
        }
    }

    /// Gives each point's part in the nodal forces the mean pressure of its group.
    ///
    /// * `rows`: by column of the stress and point, −V/h times the stress from entry `first` on
    #[inline(always)]
    fn share_pressure<D: Dimension>(&self, rows: &mut [Rows<R>; 3], first: usize) {
        let mut mean = [R::ZERO; BLOCK];
        for lane in 0..BLOCK {
            mean[place(self.group, lane)] += trace::<R, D>(rows, lane, first);
        }
        for (mean, &inverse) in mean.iter_mut().zip(&self.inverse) {
            *mean *= inverse;
        }
        let share = R::ONE / R::from_f64(D::AXES as f64);
        for lane in 0..BLOCK {
            let of_group = self.volume[lane] * mean[place(self.group, lane)];
            let shift = share * (of_group - trace::<R, D>(rows, lane, first));
            shift_diagonal::<R, D>(rows, lane, first, shift);
        }
    }
}

/// A point's group; the remainder is the group itself and spares a check.
#[inline(always)]
fn place(group: &Column<u8>, lane: usize) -> usize {
    usize::from(group[lane]) % BLOCK
}

/// Sum of the diagonal of a point's matrix, whose columns are entries of `rows` from `first` on.
#[inline(always)]
fn trace<R: Real, D: Dimension>(rows: &[Rows<R>; 3], lane: usize, first: usize) -> R {
    let mut sum = R::ZERO;
    for axis in 0..D::AXES {
        sum += rows[axis][lane][first + axis];
    }
    sum
}

/// Adds to the diagonal of a point's matrix.
#[inline(always)]
fn shift_diagonal<R: Real, D: Dimension>(rows: &mut [Rows<R>; 3], lane: usize, first: usize, shift: R) {
    for axis in 0..D::AXES {
        rows[axis][lane][first + axis] += shift;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::{PlaneStrain, ThreeDimensional};

    /// Numbers that look random, in [−1, 1).
    fn noise(k: usize) -> f64 {
        ((k as f64 * 12.9898).sin() * 43_758.545_3).fract()
    }

    /// Stress power with the shared rate is the power of the shared stress with the points' own rates: what
    /// makes the energy close. Points of a group have one trace afterwards, and what is not volumetric stays.
    fn check<D: Dimension>(first: usize) {
        let group: Column<u8> = std::array::from_fn(|lane| (7 * lane % 19) as u8);
        // Every ninth place has no point.
        let volume: Column<f64> =
            std::array::from_fn(|lane| if lane % 9 == 8 { 0.0 } else { 1.5 + noise(lane) });
        let groups = Groups::of(&volume, &group);
        let (mut rates, mut forces) = (Scratch::<f64>::new().gradients, Scratch::<f64>::new().gradients);
        for axis in 0..D::AXES {
            for lane in 0..BLOCK {
                for k in 0..D::AXES {
                    rates[axis][lane][k] = noise(100 * lane + 10 * axis + k);
                    forces[axis][lane][first + k] = volume[lane] * noise(7000 + 100 * lane + 10 * axis + k);
                }
            }
        }
        let (own_rates, own_forces) = (rates, forces);
        groups.share_rate::<D>(&mut rates);
        groups.share_pressure::<D>(&mut forces, first);
        let power = |rates: &[Rows<f64>; 3], forces: &[Rows<f64>; 3]| -> f64 {
            let mut sum = 0.0;
            for axis in 0..D::AXES {
                for lane in 0..BLOCK {
                    for k in 0..D::AXES {
                        sum += rates[axis][lane][k] * forces[axis][lane][first + k];
                    }
                }
            }
            sum
        };
        let (shared_rate, shared_force) = (power(&rates, &own_forces), power(&own_rates, &forces));
        // Some hundred products of size one.
        assert!((shared_rate - shared_force).abs() < 1e-12 * 600.0, "{shared_rate} and {shared_force}");
        assert!((shared_rate - power(&own_rates, &own_forces)).abs() > 1e-3, "nothing was shared");
        for lane in (0..BLOCK).filter(|&lane| volume[lane] > 0.0) {
            let other = (0..BLOCK).find(|&other| group[other] == group[lane] && volume[other] > 0.0);
            let other = other.expect("the point itself at least");
            let (a, b) = (trace::<f64, D>(&rates, lane, 0), trace::<f64, D>(&rates, other, 0));
            assert!((a - b).abs() < 1e-14 * 10.0, "traces {a} and {b} in one group");
            let difference = rates[0][lane][0] - rates[1][lane][1];
            let before = own_rates[0][lane][0] - own_rates[1][lane][1];
            assert!((difference - before).abs() < 1e-14 * 10.0, "{difference} was {before}");
        }
    }

    /// See `check`; in the plane forces stand behind momentum in a record.
    #[test]
    fn rates_and_pressures_are_shared_by_one_self_adjoint_operator() {
        check::<PlaneStrain>(2);
        check::<ThreeDimensional>(0);
    }
}
