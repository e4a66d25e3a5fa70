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
//!
//! Hardening and softening, each with a power, are as good as parabolas over what a guess misses x by; the rate's logarithm is
//! not. So each step solves the return for the rate with those parabolas (`RateEffect::solve`), at a logarithm a
//! try and nothing else, and one evaluation of the strength is enough for most returns of a cut.

use super::StepSums;
use super::damage::{DamageEffect, Yielding};
use super::effects::ThermalEffect;
use super::hardening::{Hardening, least};
use super::j2_plasticity::J2Plasticity;
use super::rate::{KnownReturn, KnownStrength, Nearby, QuasiStatic, RateEffect};
use crate::points::Column;
use crate::simd::{Kernel, Mask, Real, Simd, Vector};

/// Most evaluations of the strength in one return. One or two suffice; a law steeper than 3μ, whose slope says little, takes up
/// to 100.
const MAX_EVALUATIONS: usize = 120;

/// How well the first guess solves for the rate (-): the strength at rest is not known better.
const ROUGHLY: f64 = 0.3;

/// A radial return of points `lane..`: their state, and what yields. A kernel of its own, as neither dimension nor shape function
/// matters to it; it gives the factor on the deviator.
pub(super) struct Return<'a, V: Vector, Q, T: ThermalEffect<V::Scalar>, H, G: DamageEffect<V::Scalar>> {
    pub law: &'a J2Plasticity<V::Scalar, Q, T, H, G>,
    pub lane: usize,
    pub plastic_strain: &'a mut Column<V::Scalar>,
    pub yield_stress: &'a mut Column<V::Scalar>,
    pub jacobian: &'a mut Column<V::Scalar>,
    pub thermal: &'a mut T::State,
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

impl<V, Q, T, H, G> Kernel<V::Scalar> for Return<'_, V, Q, T, H, G>
where
    V: Vector,
    Q: RateEffect<V::Scalar>,
    T: ThermalEffect<V::Scalar>,
    H: Hardening<V::Scalar>,
    G: DamageEffect<V::Scalar>,
{
    type Output = V;
    // Away from most passes over the points.
    const UNIT: usize = if V::Scalar::IS_SINGLE { 3 } else { 2 };

    #[inline(always)]
    fn run<S: Simd<Scalar = V::Scalar>>(self) -> V {
        let Return { law, lane, plastic_strain, yield_stress, jacobian, thermal, damage, .. } = self;
        let Return { yields, squares, strain_square, dt, volume, totals, .. } = self;
        let zero = V::constant(0.0);
        let one = V::constant(1.0);
        let three_mu = V::splat(law.elasticity.shear_modulus) * V::constant(3.0);
        let old_strain = V::load(&plastic_strain[lane..]);
        let at_rest = V::load(&yield_stress[lane..]);
        // Lanes that do not yield solve a harmless problem of their own and are left out at the end.
        let q = V::select(yields, squares[1].sqrt(), at_rest.max(one));
        let steep = three_mu * V::constant(0.1);
        let (mut low, mut high) = (zero, q / three_mu);
        let known = [old_strain, at_rest, q];
        let mut x = law.first_guess(known, high, steep, strain_square, dt, yields);

        let tolerance = V::constant(if V::Scalar::IS_SINGLE { 1e-6 } else { 1e-12 }) * q;
        // What parabolas, or lines for a law without second derivatives, miss is of the third, or second, order in the step
        // over the strain and over what has softened: below the tolerance with these.
        let near = match (H::CURVES, V::Scalar::IS_SINGLE) {
            (true, false) => 5e-5,
            (false, false) => 7e-7,
            (true, true) => 5e-3,
            (false, true) => 7e-4,
        };
        let near = V::constant(near);
        // A step over the increment so short that it arrives whatever the law; and one after which the rate, on known strength, is
        // solved.
        let (tiny, near_rate) = if V::Scalar::IS_SINGLE { (3e-4, 2e-2) } else { (1e-7, 1e-3) };
        let (tiny, near_rate) = (V::constant(tiny), V::constant(near_rate));
        let mut flow = q;
        let mut quasi_static = one;
        let mut last = V::constant(f64::MAX);
        for _ in 0..MAX_EVALUATIONS {
            let rate = law.rate.factor(x, dt);
            let stress = q - three_mu * x;
            let rise = law.thermal.rise(law.damage.carried(damage, lane, stress * x));
            let strength = law.hardening.strength(old_strain + x, &law.thermal, thermal, lane, rise);
            let (hardened, softening) = (strength.hardened, strength.softening);
            quasi_static = hardened * softening;
            flow = quasi_static * rate;
            let residual = stress - flow;
            let closed = residual.abs().le(tolerance) | (high - low).le(V::splat(V::Scalar::EPSILON) * high);
            if (closed | !yields).all() {
                break;
            }
            let too_small = residual.gt(zero);
            low = V::select(too_small, x, low);
            high = V::select(too_small, high, x);
            let heat = |work| law.thermal.rise(law.damage.carried(damage, lane, work));
            let slope = strength.slope * softening
                + hardened * strength.softening_slope * heat(stress - three_mu * x);
            let steepness = slope.mul_add(rate, three_mu);
            // A parabola far from its guess may turn round: second derivatives only where the way is short.
            let is_near = residual.abs().le(V::constant(0.01) * steepness.max(steep) * (old_strain + x));
            let half = |second: V| {
                if H::CURVES { V::select(is_near, V::constant(0.5) * second, zero) } else { zero }
            };
            let nearby = Nearby {
                about: x,
                hardened: [hardened, strength.slope, half(strength.curvature)],
                softening: [softening, strength.softening_slope, half(strength.softening_curvature)],
                heating: [heat(stress - three_mu * x), heat(-three_mu)],
            };
            let known = KnownReturn { trial: q, three_mu, strength: nearby, least: steep };
            let (root, is_exact) = law.rate.solve(&known, (x, rate), dt, near_rate, yields);
            // Outside the bracket, or where steps go to and fro: the geometric mean, because the root may lie many orders
            // below the upper end.
            let stalls = residual.abs().gt(V::constant(0.5) * last);
            last = residual.abs();
            let mean = (low / high).max(V::constant(1e-9)).sqrt() * high;
            let inside = root.gt(low) & root.lt(high) & !stalls;
            let next = V::select(closed, x, V::select(inside, root, mean));
            let step = next - x;
            // No second look where the strength is as good as known at the end of a step. Softening begins and ends with a
            // kink, which no derivative tells of.
            let most = near * softening.min(one - softening);
            let is_smooth = if T::SOFTENS { most.gt(zero) } else { one.gt(zero) };
            let softened =
                strength.softening_slope * nearby.heating[1].mul_add(step, nearby.heating[0]) * step;
            let is_short = step.abs().le(near * (old_strain + x)) & softened.abs().le(most) & is_smooth;
            let arrives =
                inside & is_exact & (is_near & is_short | step.abs().le(tiny * x)) & steepness.gt(steep);
            x = next;
            if (closed | arrives | !yields).all() {
                quasi_static = V::select(closed, quasi_static, nearby.at(x).0);
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
        (old_strain + x).store(&mut plastic_strain[lane..]);
        V::select(yields, quasi_static, at_rest).store(&mut yield_stress[lane..]);
        let yielding = Yielding {
            increment: x,
            work,
            flow,
            jacobian: V::load(&jacobian[lane..]),
            temperature: law.thermal.temperature_after(thermal, lane, zero),
            dt,
            volume,
        };
        let work = law.damage.grow(damage, lane, &yielding, &law.elasticity, totals);
        let rise = law.thermal.rise(work);
        if law.thermal.expands() {
            let before = V::load(&jacobian[lane..]);
            let contraction = law.thermal.contraction(thermal, lane, rise);
            let after = before * contraction;
            after.store(&mut jacobian[lane..]);
            // The energy's derivative by ln J is the mean stress.
            let sum = law.elasticity.mean_stress(before) + law.elasticity.mean_stress(after);
            let stress = V::constant(0.5) * sum;
            totals.thermoelastic = (volume * stress).mul_add(one - contraction, totals.thermoelastic);
        }
        law.thermal.heat(thermal, lane, rise);
        V::select(yields, flow / q, one)
    }
}

impl<R: Real, Q: RateEffect<R>, T: ThermalEffect<R>, H: Hardening<R>, G: DamageEffect<R>>
    J2Plasticity<R, Q, T, H, G>
{
    /// First guess of a return's increment (-): the whole strain increment, as in steady flow, or the excess over the strength at
    /// rest where that is less; then what the rate makes of the strength as it stands.
    ///
    /// * `known`: plastic strain so far (-), strength at rest and q_trial (Pa)
    /// * `high`: the largest increment that there can be (-)
    /// * `steep`: least steepness to divide by (Pa)
    #[inline(always)]
    fn first_guess<V: Vector<Scalar = R>>(
        &self,
        [old_strain, at_rest, q]: [V; 3],
        high: V,
        steep: V,
        strain_square: V,
        dt: R,
        yields: V::Mask,
    ) -> V {
        let three_mu = V::splat(self.elasticity.shear_modulus) * V::constant(3.0);
        let excess = (q - at_rest) / three_mu;
        let whole = (strain_square * V::constant(2.0 / 3.0)).sqrt();
        let mut guess = whole.min(excess).max(least());
        // Where the strain grows by a multiple, above all where a point yields for the first time, the slope of hardening says
        // little about where it leads; the power does.
        let mut most = high;
        let grows = guess.gt(old_strain);
        if (yields & grows).any() {
            let carrying = (self.hardening.carrying(old_strain, at_rest, q) - old_strain).max(least());
            most = V::select(grows, carrying.min(high), high);
            guess = guess.min(most);
        }
        let standing = KnownReturn { trial: q, three_mu, strength: QuasiStatic(at_rest), least: steep };
        let start = (guess, self.rate.factor(guess, dt));
        let (x, _) = self.rate.solve(&standing, start, dt, V::constant(ROUGHLY), yields);
        x.max(least()).min(most)
    }
}
