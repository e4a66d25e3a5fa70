//! Radial return to the yield surface, with rate, heat and damage, for any flow law (`flow_law`).
//!
//! Find the increment x of ε̄ with
//!
//! f(x) = q_trial − 3μ x − σ_y(ε̄ + x, x/Δt, T(x)) = 0.
//!
//! f(0) > 0 because the point yields, f(q_trial/3μ) ≤ 0 because a flow stress is not negative, and f is
//! continuous: a bracket holds a root from first yield on, where the slopes of ε̄ⁿ and of ln ε̄̇ are without
//! bound and plain Newton steps can miss it. That f falls is not needed: a law that softens with strain
//! faster than 3μ gives several roots, of which the bracket keeps one (tests/material_point.rs,
//! `softening_returns_end_on_the_yield_surface`).

use super::StepSums;
use super::damage::{DamageEffect, Yielding};
use super::effects::ThermalEffect;
use super::elasticity::Elasticity;
use super::flow_law::{Ahead, FlowLaw, LocalFlow, Trial, Tried, least};
use crate::points::Column;
use crate::simd::{Kernel, Mask, Real, Simd, Vector, each};

/// Most evaluations of the strength in one return. One or two suffice; a law steeper than 3μ, whose slope
/// says little, takes up to 100.
const MAX_EVALUATIONS: usize = 120;

/// State of the thermal part of a law.
type ThermalState<L, R> = <<L as FlowLaw<R>>::Thermal as ThermalEffect<R>>::State;

/// A radial return of points `lane..`: their material and state, and what yields. A kernel of its own, as
/// neither dimension nor shape function matters to it; it gives the factor on the deviator.
pub(super) struct Return<'a, V: Vector, L: FlowLaw<V::Scalar>, G: DamageEffect<V::Scalar>> {
    pub elasticity: &'a Elasticity<V::Scalar>,
    pub law: &'a L,
    pub damage_law: &'a G,
    pub lane: usize,
    pub plastic_strain: &'a mut Column<V::Scalar>,
    pub yield_stress: &'a mut Column<V::Scalar>,
    pub jacobian: &'a mut Column<V::Scalar>,
    pub thermal: &'a mut ThermalState<L, V::Scalar>,
    pub damage: &'a mut G::State,
    pub yields: V::Mask,
    /// q² at the start and q²_trial (Pa²).
    pub squares: [V; 2],
    /// Δe : Δe of the substep (-), for the first guess of the rate.
    pub strain_square: V,
    /// Substep (s).
    pub dt: V::Scalar,
    /// Volume at the start (m3).
    pub volume: V,
    pub totals: &'a mut StepSums<V>,
}

impl<V: Vector, L: FlowLaw<V::Scalar>, G: DamageEffect<V::Scalar>> Kernel<V::Scalar> for Return<'_, V, L, G> {
    type Output = V;
    // Away from most passes over the points.
    const UNIT: usize = if V::Scalar::IS_SINGLE { 3 } else { 2 };

    #[inline(always)]
    fn run<S: Simd<Scalar = V::Scalar>>(self) -> V {
        let Return { elasticity, law, damage_law, lane, plastic_strain, yield_stress, jacobian, .. } = self;
        let Return { thermal, damage, yields, squares, strain_square, dt, volume, totals, .. } = self;
        let heated = law.thermal();
        let zero = V::constant(0.0);
        let one = V::constant(1.0);
        let three_mu = V::splat(elasticity.shear_modulus) * V::constant(3.0);
        let old_strain = V::load(&plastic_strain[lane..]);
        let at_rest = V::load(&yield_stress[lane..]);
        // Lanes that do not yield solve a harmless problem of their own and are left out at the end.
        let q = V::select(yields, squares[1].sqrt(), at_rest.max(one));
        let steep = three_mu * V::constant(0.1);
        let trial = Trial { strain: old_strain, at_rest, stress: q, three_mu, least: steep, dt, yields };
        let (mut low, mut high) = (zero, q / three_mu);
        let excess = (q - at_rest) / three_mu;
        let whole = (strain_square * V::constant(2.0 / 3.0)).sqrt();
        let mut x = law.first_guess(&trial, whole.min(excess).max(least()), high);

        let tolerance = V::constant(if V::Scalar::IS_SINGLE { 1e-6 } else { 1e-12 }) * q;
        let mut flow = q;
        let mut quasi_static = one;
        let mut last = V::constant(f64::MAX);
        for _ in 0..MAX_EVALUATIONS {
            let stress = q - three_mu * x;
            let rise = heated.rise(damage_law.carried(damage, lane, stress * x));
            let local = law.local(&trial, x, thermal, lane, rise);
            quasi_static = local.at_rest();
            flow = local.stress();
            let residual = stress - flow;
            let closed = residual.abs().le(tolerance) | (high - low).le(V::splat(V::Scalar::EPSILON) * high);
            if (closed | !yields).all() {
                break;
            }
            let too_small = residual.gt(zero);
            low = V::select(too_small, x, low);
            high = V::select(too_small, high, x);
            let work = [stress - three_mu * x, -three_mu];
            let heating: [V; 2] = each!(k < 2 => heated.rise(damage_law.carried(damage, lane, work[k])));
            let ahead = local.ahead(&trial, &Tried { increment: x, residual, heating });
            let root = ahead.increment();
            // Outside the bracket, or where steps go to and fro: the geometric mean, because the root may lie
            // many orders below the upper end.
            let stalls = residual.abs().gt(V::constant(0.5) * last);
            last = residual.abs();
            let mean = (low / high).max(V::constant(1e-9)).sqrt() * high;
            let inside = root.gt(low) & root.lt(high) & !stalls;
            let next = V::select(closed, x, V::select(inside, root, mean));
            // No second look where the flow stress is as good as known at the end of a step.
            let mut arrives = inside;
            ahead.keep_known(next - x, &mut arrives);
            x = next;
            if (closed | arrives | !yields).all() {
                quasi_static = V::select(closed, quasi_static, ahead.at_rest(x));
                flow = V::select(closed, flow, q - three_mu * x);
                break;
            }
        }
        // Plastic work by the trapezoidal rule. A point that was already yielding started at its own stress;
        // one that was elastic crossed the flow stress at rest.
        let start = squares[0].sqrt().max(at_rest);
        let work = V::constant(0.5) * (start + flow) * x;
        let x = V::select(yields, x, zero);
        let work = V::select(yields, work.max(zero), zero);
        (old_strain + x).store(&mut plastic_strain[lane..]);
        V::select(yields, quasi_static, at_rest).store(&mut yield_stress[lane..]);
        let yielding = Yielding {
            increment: x,
            work,
            flow,
            jacobian: V::load(&jacobian[lane..]),
            temperature: heated.temperature_after(thermal, lane, zero),
            dt,
            volume,
        };
        let work = damage_law.grow(damage, lane, &yielding, elasticity, totals);
        let rise = heated.rise(work);
        if heated.expands() {
            let before = V::load(&jacobian[lane..]);
            let contraction = heated.contraction(thermal, lane, rise);
            let after = before * contraction;
            after.store(&mut jacobian[lane..]);
            // The energy's derivative by ln J is the mean stress.
            let sum = elasticity.mean_stress(before) + elasticity.mean_stress(after);
            let stress = V::constant(0.5) * sum;
            totals.thermoelastic = (volume * stress).mul_add(one - contraction, totals.thermoelastic);
        }
        heated.heat(thermal, lane, rise);
        V::select(yields, flow / q, one)
    }
}
