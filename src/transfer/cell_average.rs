//! Averages over cells: the points of a cell share their velocity gradient and the stress that does work on it.
//!
//! Plastic flow keeps its volume. With as many points as a cell has, each by itself, there are more such
//! conditions than the cell's nodes can meet: full integration locks, and points of a cell take part in modes
//! that its nodes cannot resist. Here the points of a cell (those that stood in one when they were sorted, a
//! group g) share the average gradient, but for a part α of what each has of its own in shape. With n = 2 in
//! the plane and 3 in space,
//!
//! L̃_p = L̄_g + α (dev L_p − dev L̄_g),    L̄_g = Σ_g V L / Σ_g V,    dev L = L − (tr L)/n I,
//!
//! V the volumes at the start; and the same operator, which is its own adjoint with these as weights, is
//! applied to the stress that stands in the nodal forces f_i = −Σ V τ̃_p ∇N_ip. So the stress power Σ V τ :
//! L̃ is the work of the nodal forces, and the energy closes. A point's own stress is not overwritten.
//!
//! Sources: averaged volume changes are the mean dilatation of finite elements, Hughes (1980),
//! doi:10.1002/nme.1620150914; averages of all of the gradient with a part left against modes without
//! resistance are uniform-strain elements, Flanagan and Belytschko (1981), doi:10.1002/nme.1620170504; here
//! over the points of a cell.
//!
//! Form of the effect: two short passes over a block's scratch where `Layout::averages_cells` is set; the
//! points of a cell stand in one block then, and are sorted by cells.

use super::scratch::{Rows, Scratch};
use crate::dimension::Dimension;
use crate::points::{BLOCK, Column};
use crate::simd::{Kernel, Real, Simd, Vector};
use std::marker::PhantomData;

/// Part of its own shape change that each point keeps (-): enough that no mode of a cell's points is without
/// resistance.
const OWN: f64 = 0.1;

/// After stage 2: the points of a cell share their velocity gradient.
pub(super) struct ShareRate<'a, R, D> {
    volume: &'a Column<R>,
    group: &'a Column<u8>,
    scratch: &'a mut Scratch<R>,
    dimension: PhantomData<D>,
}

/// After stage 3: they share the stress of the nodal forces.
pub(super) struct ShareStress<'a, R, D> {
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

impl<'a, R, D> ShareStress<'a, R, D> {
    /// Of a block's points, with their forces in the scratch.
    #[inline(always)]
    pub(super) fn of(volume: &'a Column<R>, group: &'a Column<u8>, scratch: &'a mut Scratch<R>) -> Self {
        ShareStress { volume, group, scratch, dimension: PhantomData }
    }
}

impl<R: Real, D: Dimension> Kernel<R> for ShareRate<'_, R, D> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) {
        Groups::of(self.volume, self.group).share::<S, D, false>(&mut self.scratch.gradients, 0);
    }
}

impl<R: Real, D: Dimension> Kernel<R> for ShareStress<'_, R, D> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) {
        // In the plane force follows momentum in the same record.
        let first = if D::QUADS == 1 { 2 } else { 0 };
        Groups::of(self.volume, self.group).share::<S, D, true>(&mut self.scratch.gradients, first);
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

    /// Gives each point the average of its group, but for the part `OWN` of its own shape.
    ///
    /// * `rows`: by axis and point, from entry `first` on a column of the point's matrix; velocity gradients,
    ///   or with `BY_VOLUME` stresses times volumes
    #[inline(always)]
    fn share<S: Simd<Scalar = R>, D: Dimension, const BY_VOLUME: bool>(
        &self,
        rows: &mut [Rows<R>; 3],
        first: usize,
    ) {
        let mut sums = [[[R::ZERO; 4]; BLOCK]; 3];
        for axis in 0..D::AXES {
            for lane in 0..BLOCK {
                let sum = &mut sums[axis][place(self.group, lane)];
                let row = S::Quad::load(&rows[axis][lane]);
                let row = if BY_VOLUME { row } else { row * S::Quad::splat(self.volume[lane]) };
                (S::Quad::load(sum) + row).store(sum);
            }
        }
        let own = R::from_f64(OWN);
        let share = own / R::from_f64(D::AXES as f64);
        for lane in 0..BLOCK {
            let group = place(self.group, lane);
            let weight = self.inverse[group] * if BY_VOLUME { self.volume[lane] } else { R::ONE };
            let mut change = R::ZERO;
            for axis in 0..D::AXES {
                change += weight * sums[axis][group][first + axis] - rows[axis][lane][first + axis];
            }
            for axis in 0..D::AXES {
                let of_group = S::Quad::load(&sums[axis][group]) * S::Quad::splat(weight);
                let row = S::Quad::load(&rows[axis][lane]);
                let mut mixed = [R::ZERO; 4];
                S::Quad::splat(own).mul_add(row - of_group, of_group).store(&mut mixed);
                mixed[first + axis] += share * change;
                for k in first..first + D::AXES {
                    rows[axis][lane][k] = mixed[k];
                }
            }
        }
    }
}

/// A point's group; the remainder is the group itself and spares a check.
#[inline(always)]
fn place(group: &Column<u8>, lane: usize) -> usize {
    usize::from(group[lane]) % BLOCK
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::{PlaneStrain, ThreeDimensional};
    use crate::simd::{InstructionSet, dispatch};

    /// Numbers that look random, in [−1, 1).
    fn noise(k: usize) -> f64 {
        ((k as f64 * 12.9898).sin() * 43_758.545_3).fract()
    }

    /// Stress power with the shared gradient is the power of the shared stress with the points' own gradients:
    /// what makes the energy close. Points of a group have one trace afterwards, and of what else they differ
    /// in a tenth.
    fn check<D: Dimension>(first: usize) {
        let group: Column<u8> = std::array::from_fn(|lane| (7 * lane % 19) as u8);
        // Every ninth place has no point.
        let volume: Column<f64> =
            std::array::from_fn(|lane| if lane % 9 == 8 { 0.0 } else { 1.5 + noise(lane) });
        let (mut rates, mut forces) = (Scratch::<f64>::new(), Scratch::<f64>::new());
        for axis in 0..D::AXES {
            for lane in 0..BLOCK {
                for k in 0..D::AXES {
                    rates.gradients[axis][lane][k] = noise(100 * lane + 10 * axis + k);
                    forces.gradients[axis][lane][first + k] =
                        volume[lane] * noise(7000 + 100 * lane + 10 * axis + k);
                }
            }
        }
        let (own_rates, own_forces) = (rates.gradients, forces.gradients);
        dispatch(InstructionSet::Portable, ShareRate::<f64, D>::of(&volume, &group, &mut rates));
        dispatch(InstructionSet::Portable, ShareStress::<f64, D>::of(&volume, &group, &mut forces));
        let (rates, forces) = (rates.gradients, forces.gradients);
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
            let trace = |lane: usize| (0..D::AXES).map(|axis| rates[axis][lane][axis]).sum::<f64>();
            let (a, b) = (trace(lane), trace(other));
            assert!((a - b).abs() < 1e-14 * 10.0, "traces {a} and {b} in one group");
            let apart = |rows: &[Rows<f64>; 3]| rows[0][lane][1] - rows[0][other][1];
            let (now, before) = (apart(&rates), OWN * apart(&own_rates));
            assert!((now - before).abs() < 1e-14 * 10.0, "{now}, {before} expected");
        }
    }

    /// See `check`; in the plane forces stand behind momentum in a record.
    #[test]
    fn rates_and_pressures_are_shared_by_one_self_adjoint_operator() {
        check::<PlaneStrain>(2);
        check::<ThreeDimensional>(0);
    }
}
