//! Radial return to the yield surface, with rate, heat and damage.
//!
//! Find the increment x of ε̄ with
//!
//! f(x) = q_trial − 3μ x − σ_y(ε̄ + x, x/Δt, T(x)) = 0.
//!
//! f(0) > 0 because the point yields, f(q_trial/3μ) ≤ 0 because a flow stress is not negative, and f is continuous:
//! a bracket holds a root from first yield on, where the slopes of ε̄ⁿ and of ln ε̄̇ are without bound and plain
//! Newton steps can miss it. That f falls is not needed: a law that softens with strain faster than 3μ gives several
//! roots, of which the bracket keeps one (tests/material_point.rs, `softening_returns_end_on_the_yield_surface`).

use super::Totals;
use super::damage::{DamageEffect, Yielding};
use super::effects::{RateEffect, ThermalEffect};
use super::hardening::Hardening;
use super::johnson_cook::{JohnsonCook, State};
use crate::dimension::Dimension;
use crate::simd::{Mask, Real, Vector};

/// Most evaluations of one return. Newton takes two to four; a law steeper than 3μ, whose slope says little, up to 100.
const MAX_EVALUATIONS: usize = 120;

impl<R: Real, Q: RateEffect<R>, T: ThermalEffect<R>, H: Hardening<R>, G: DamageEffect<R>>
    JohnsonCook<R, Q, T, H, G>
{
    /// Radial return of points `lane..` that yield; updates their state and returns the factor on the deviator.
    ///
    /// * `squares`: q² at the start and q²_trial (Pa²)
    /// * `strain_square`: Δe : Δe of the substep (-), for the first guess of the rate
    #[inline(always)]
    #[allow(clippy::too_many_arguments)] // A kernel takes each array as its own argument.
    pub(super) fn return_to_yield<D: Dimension, V: Vector<Scalar = R>>(
        &self,
        state: &mut State<R, D, T::State, G::State>,
        lane: usize,
        yields: V::Mask,
        squares: [V; 2],
        strain_square: V,
        dt: R,
        volume: V,
        totals: &mut Totals<V>,
    ) -> V {
        let zero = V::constant(0.0);
        let one = V::constant(1.0);
        let three_mu = V::splat(self.elasticity.shear_modulus) * V::constant(3.0);
        let old_strain = V::load(&state.plastic_strain[lane..]);
        let at_rest = V::load(&state.yield_stress[lane..]);
        // Lanes that do not yield solve a harmless problem of their own and are left out at the end.
        let q = V::select(yields, squares[1].sqrt(), at_rest.max(one));
        let (mut low, mut high) = (zero, q / three_mu);

        // First guess: the whole strain increment, as in steady flow, or the excess over the strength at rest where that is less.
        let excess = (q - at_rest) / three_mu;
        let whole = (strain_square * V::constant(2.0 / 3.0)).sqrt();
        let mut x = whole.min(excess).max(high * V::constant(1e-9));

        let tolerance = V::constant(if R::IS_SINGLE { 1e-6 } else { 1e-12 }) * q;
        let near = V::constant(if R::IS_SINGLE { 3e-4 } else { 1e-7 });
        let mut flow = q;
        let mut still = one;
        let mut last = V::constant(f64::MAX);
        for _ in 0..MAX_EVALUATIONS {
            let (rate_factor, rate_slope) = self.rate.factor(x, dt);
            let stress = q - three_mu * x;
            let rise = self.thermal.rise(self.damage.carried(&state.damage, lane, stress * x));
            let strength = self.hardening.strength(old_strain + x, &self.thermal, &state.thermal, lane, rise);
            let (hardened, softening) = (strength.hardened, strength.softening);
            still = hardened * softening;
            flow = still * rate_factor;
            let residual = stress - flow;
            let closed = residual.abs().le(tolerance) | (high - low).le(V::splat(R::EPSILON) * high);
            if (closed | !yields).all() {
                break;
            }
            let too_small = residual.gt(zero);
            low = V::select(too_small, x, low);
            high = V::select(too_small, high, x);
            let rest_slope = strength.slope * softening
                + hardened
                    * strength.softening_slope
                    * self.thermal.rise(self.damage.carried(&state.damage, lane, stress - three_mu * x));
            let slope = rest_slope * rate_factor + still * rate_slope;
            let (steepness, least) = (three_mu + slope, three_mu * V::constant(0.1));
            let newton = x + residual / steepness.max(least);
            // Outside the bracket, or where Newton steps go to and fro (across the kink at the reference rate): the
            // geometric mean, because the root may lie many orders below the upper end.
            let stalls = residual.abs().gt(V::constant(0.5) * last);
            last = residual.abs();
            let mean = (low / high).max(V::constant(1e-9)).sqrt() * high;
            let inside = newton.gt(low) & newton.lt(high) & !stalls;
            let next = V::select(closed, x, V::select(inside, newton, mean));
            let step = next - x;
            x = next;
            // What a step this short leaves is of second order if the slope is the true one: within the tolerance, and not
            // looked at again.
            let arrives = inside & step.abs().le(near * x) & steepness.gt(least);
            if (closed | arrives | !yields).all() {
                still = V::select(closed, still, step.mul_add(rest_slope, still));
                flow = V::select(closed, flow, q - three_mu * x);
                break;
            }
        }
        // Plastic work by the trapezoidal rule. A point that was already yielding started at its own stress; one that
        // was elastic crossed the flow stress at rest.
        let start = squares[0].sqrt().max(at_rest);
        let work = V::constant(0.5) * (start + flow) * x;
        let x = V::select(yields, x, zero);
        let work = V::select(yields, work.max(zero), zero);
        (old_strain + x).store(&mut state.plastic_strain[lane..]);
        V::select(yields, still, at_rest).store(&mut state.yield_stress[lane..]);
        let yielding = Yielding {
            increment: x,
            work,
            flow,
            jacobian: V::load(&state.jacobian[lane..]),
            temperature: self.thermal.temperature_after(&state.thermal, lane, zero),
            dt,
            volume,
        };
        let work = self.damage.grow(&mut state.damage, lane, &yielding, &self.elasticity, totals);
        let rise = self.thermal.rise(work);
        if self.thermal.expands() {
            let before = V::load(&state.jacobian[lane..]);
            let contraction = self.thermal.contraction(&state.thermal, lane, rise);
            let after = before * contraction;
            after.store(&mut state.jacobian[lane..]);
            // The energy's derivative by ln J is the mean stress.
            let sum = self.elasticity.mean_stress(before) + self.elasticity.mean_stress(after);
            let stress = V::constant(0.5) * sum;
            totals.thermoelastic = (volume * stress).mul_add(one - contraction, totals.thermoelastic);
        }
        self.thermal.heat(&mut state.thermal, lane, rise);
        V::select(yields, flow / q, one)
    }
}
