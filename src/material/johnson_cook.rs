//! Finite-deformation J2 plasticity with the Johnson–Cook flow stress.
//!
//! Elasticity: Kirchhoff stress τ = s + κ/2 (J² − 1) I. The pressure follows from the volume ratio J, so it neither
//! drifts nor needs a logarithm, and has the energy κ/2 ((J² − 1)/2 − ln J) (Simo and Hughes 1998, eq. 9.2.7). The
//! deviator s turns with the material and grows by 2μ dev Δε (`Dimension::increment`).
//!
//! Plasticity: the equivalent stress q = √(3/2 s:s) stays below the flow stress (eq. 24 of Ambati et al. 2011)
//!
//! σ_y = (A + B ε̄ⁿ) R(ε̄̇) S(T),
//!
//! with R = 1 or S = 1 where the scene names no such effect. Radial return: find the increment x of ε̄ with
//!
//! f(x) = q_trial − 3μ x − σ_y(ε̄ + x, x/Δt, T(x)) = 0.
//!
//! f falls from f(0) > 0 to f(q_trial/3μ) ≤ 0, so a bracket holds the root from first yield on, where the slopes of
//! ε̄ⁿ and of ln ε̄̇ are without bound and plain Newton steps can miss it.
//!
//! A point keeps the flow stress at rest, (A + B ε̄ⁿ) S(T), so that elastic points only compare with it. Yield and
//! plastic work are those of the Kirchhoff stress; J differs from one by the elastic change of volume alone.

use super::effects::{RateEffect, ThermalEffect};
use super::{ConstitutiveModel, PointReport, Totals};
use crate::dimension::Dimension;
use crate::points::{BLOCK, Column, PointState};
use crate::simd::math::pow;
use crate::simd::{Mask, Real, Vector};

/// Elastic constants and hardening, as the kernel takes them.
#[derive(Clone, Copy, Debug)]
pub struct JohnsonCook<R, Q, T> {
    density: f64,
    bulk_modulus: R,
    shear_modulus: R,
    yield_stress: R,
    hardening_modulus: R,
    hardening_exponent: R,
    rate: Q,
    thermal: T,
}

impl<R: Real, Q: RateEffect<R>, T: ThermalEffect<R>> JohnsonCook<R, Q, T> {
    /// The model of a material's constants with the effects a scene names.
    pub fn new(constants: &crate::scene::Constants, rate: Q, thermal: T) -> Self {
        let (e, nu) = (constants.youngs_modulus, constants.poissons_ratio);
        JohnsonCook {
            density: constants.density,
            bulk_modulus: R::from_f64(e / (3.0 * (1.0 - 2.0 * nu))),
            shear_modulus: R::from_f64(e / (2.0 * (1.0 + nu))),
            yield_stress: R::from_f64(constants.yield_stress),
            hardening_modulus: R::from_f64(constants.hardening_modulus),
            hardening_exponent: R::from_f64(constants.hardening_exponent),
            rate,
            thermal,
        }
    }
}

/// State of a block of points.
#[derive(Clone, Debug)]
pub struct State<R: Real, D: Dimension, T> {
    /// Volume ratio det F (-).
    pub jacobian: Column<R>,
    /// Deviator of the Kirchhoff stress (Pa).
    pub deviator: D::Deviator<Column<R>>,
    /// Equivalent plastic strain ε̄ (-).
    pub plastic_strain: Column<R>,
    /// Flow stress at rest, (A + B ε̄ⁿ) S(T) (Pa).
    pub yield_stress: Column<R>,
    /// What the thermal effect keeps.
    pub thermal: T,
}

impl<R: Real, D: Dimension, T: PointState<R>> PointState<R> for State<R, D, T> {
    const COLUMNS: usize = 3 + D::DEVIATOR + T::COLUMNS;

    fn zeroed() -> Self {
        State {
            jacobian: [R::ONE; BLOCK],
            deviator: D::deviator(|_| [R::ZERO; BLOCK]),
            plastic_strain: [R::ZERO; BLOCK],
            yield_stress: [R::ONE; BLOCK],
            thermal: T::zeroed(),
        }
    }

    fn column(&self, k: usize) -> &Column<R> {
        match k {
            0 => &self.jacobian,
            1 => &self.plastic_strain,
            2 => &self.yield_stress,
            k if k < 3 + D::DEVIATOR => &self.deviator[k - 3],
            k => self.thermal.column(k - 3 - D::DEVIATOR),
        }
    }

    fn column_mut(&mut self, k: usize) -> &mut Column<R> {
        match k {
            0 => &mut self.jacobian,
            1 => &mut self.plastic_strain,
            2 => &mut self.yield_stress,
            k if k < 3 + D::DEVIATOR => &mut self.deviator[k - 3],
            k => self.thermal.column_mut(k - 3 - D::DEVIATOR),
        }
    }
}

/// Most evaluations of one return; Newton takes three to five, bisection alone would take 40.
const MAX_EVALUATIONS: usize = 60;

impl<R: Real, D: Dimension, Q: RateEffect<R>, T: ThermalEffect<R>> ConstitutiveModel<R, D>
    for JohnsonCook<R, Q, T>
{
    type State = State<R, D, T::State>;

    fn density(&self) -> f64 {
        self.density
    }

    /// c² = (κ/2 (J² + 1) + 4/3 μ)/ρ₀: spatial stiffness over spatial density of the law above.
    fn set_density(&mut self, density: f64) {
        self.density = density;
    }

    fn sound_speed(&self, volume_ratio: f64) -> f64 {
        let bulk = 0.5 * self.bulk_modulus.to_f64() * (volume_ratio * volume_ratio + 1.0);
        ((bulk + 4.0 / 3.0 * self.shear_modulus.to_f64()) / self.density).sqrt()
    }

    fn yield_volume_strain(&self) -> f64 {
        (self.yield_stress / self.bulk_modulus).to_f64()
    }

    fn place(&self, state: &mut Self::State, lane: usize, temperature: f64) {
        state.jacobian[lane] = R::ONE;
        state.plastic_strain[lane] = R::ZERO;
        for component in 0..D::DEVIATOR {
            state.deviator[component][lane] = R::ZERO;
        }
        // 0ⁿ is 1 for n = 0 and 0 for n > 0.
        let hardening = if self.hardening_exponent > R::ZERO { R::ZERO } else { self.hardening_modulus };
        state.yield_stress[lane] =
            (self.yield_stress + hardening) * R::from_f64(self.thermal.static_factor(temperature));
        self.thermal.place(&mut state.thermal, lane, temperature);
    }

    #[inline(always)]
    fn stress<V: Vector<Scalar = R>>(&self, state: &Self::State, lane: usize) -> D::Symmetric<V> {
        let s = D::deviator(|component| V::load(&state.deviator[component][lane..]));
        D::with_mean(&s, self.mean_stress(V::load(&state.jacobian[lane..])))
    }

    #[inline(always)]
    fn update<V: Vector<Scalar = R>>(
        &self,
        state: &mut Self::State,
        lane: usize,
        h: &D::Matrix<V>,
        dt: R,
        volume: V,
        totals: &mut Totals<V>,
    ) -> D::Symmetric<V> {
        let increment = D::increment(h);
        let jacobian = V::load(&state.jacobian[lane..]) * increment.volume_ratio;
        jacobian.store(&mut state.jacobian[lane..]);
        totals.volume_ratio = totals.volume_ratio.max(jacobian);

        let two_mu = V::splat(self.shear_modulus + self.shear_modulus);
        let old = D::deviator(|component| V::load(&state.deviator[component][lane..]));
        let turned = D::rotate(&increment.rotation, old);
        let mut s = D::deviator(|k| two_mu.mul_add(increment.deviatoric_strain[k], turned[k]));

        let square = V::constant(1.5) * D::double_contraction(&s);
        let strength = V::load(&state.yield_stress[lane..]);
        let yields = square.gt(strength * strength);
        if yields.any() {
            let strain = D::double_contraction(&increment.deviatoric_strain);
            let start = V::constant(1.5) * D::double_contraction(&turned);
            let factor =
                self.return_to_yield(state, lane, yields, [start, square], strain, dt, volume, totals);
            s = D::deviator(|component| s[component] * factor);
        }
        for component in 0..D::DEVIATOR {
            s[component].store(&mut state.deviator[component][lane..]);
        }
        D::with_mean(&s, self.mean_stress(jacobian))
    }

    fn volume_ratio(&self, state: &Self::State, lane: usize) -> f64 {
        state.jacobian[lane].to_f64()
    }

    fn set_volume_ratio(&self, state: &mut Self::State, lane: usize, volume_ratio: f64) -> f64 {
        let old = self.volume_energy(state.jacobian[lane].to_f64());
        state.jacobian[lane] = R::from_f64(volume_ratio);
        old - self.volume_energy(state.jacobian[lane].to_f64())
    }

    fn report(&self, state: &Self::State, lane: usize) -> PointReport {
        let j = state.jacobian[lane].to_f64();
        let s = D::deviator(|component| state.deviator[component][lane].to_f64());
        let (bulk, shear) = (self.bulk_modulus.to_f64(), self.shear_modulus.to_f64());
        let mean = 0.5 * bulk * (j * j - 1.0);
        let diagonal = [s[0], s[1], -s[0] - s[1]];
        let shears: &[f64] = &s.as_ref()[2..];
        let contraction =
            diagonal.iter().map(|x| x * x).sum::<f64>() + 2.0 * shears.iter().map(|x| x * x).sum::<f64>();
        let mut stress = [0.0; 6];
        for k in 0..3 {
            stress[k] = (diagonal[k] + mean) / j;
        }
        for (component, value) in stress[6 - shears.len()..].iter_mut().zip(shears) {
            *component = value / j;
        }
        let (temperature, heat) = self.thermal.report(&state.thermal, lane);
        PointReport {
            jacobian: j,
            stress,
            plastic_strain: state.plastic_strain[lane].to_f64(),
            temperature,
            elastic_energy: self.volume_energy(j) + contraction / (4.0 * shear),
            heat,
        }
    }
}

impl<R: Real, Q: RateEffect<R>, T: ThermalEffect<R>> JohnsonCook<R, Q, T> {
    /// κ/2 ((J² − 1)/2 − ln J) (J/m3).
    fn volume_energy(&self, j: f64) -> f64 {
        0.5 * self.bulk_modulus.to_f64() * (0.5 * (j * j - 1.0) - j.ln())
    }

    /// κ/2 (J² − 1) (Pa).
    #[inline(always)]
    fn mean_stress<V: Vector<Scalar = R>>(&self, jacobian: V) -> V {
        V::splat(self.bulk_modulus) * V::constant(0.5) * (jacobian * jacobian - V::constant(1.0))
    }

    /// Radial return of points `lane..` that yield; updates their state and returns the factor on the deviator.
    ///
    /// * `squares`: q² at the start and q²_trial (Pa²)
    /// * `strain_square`: Δe : Δe of the substep (-), for the first guess of the rate
    #[inline(always)]
    #[allow(clippy::too_many_arguments)] // A kernel takes each array as its own argument.
    fn return_to_yield<D: Dimension, V: Vector<Scalar = R>>(
        &self,
        state: &mut State<R, D, T::State>,
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
        let tiny = V::constant(1e-30);
        let three_mu = V::splat(self.shear_modulus) * V::constant(3.0);
        let (a, b, n) = (
            V::splat(self.yield_stress),
            V::splat(self.hardening_modulus),
            V::splat(self.hardening_exponent),
        );
        let old_strain = V::load(&state.plastic_strain[lane..]);
        let at_rest = V::load(&state.yield_stress[lane..]);
        // Lanes that do not yield solve a harmless problem of their own and are left out at the end.
        let q = V::select(yields, squares[1].sqrt(), at_rest.max(one));
        let (mut low, mut high) = (zero, q / three_mu);

        // First guess: the rate of the whole strain increment; where that leaves nothing, a small part of the excess.
        let excess = (q - at_rest) / three_mu;
        let whole = (strain_square * V::constant(2.0 / 3.0)).sqrt().max(tiny);
        let (rate_factor, _) = self.rate.factor(whole, dt);
        let mut x = ((q - at_rest * rate_factor) / three_mu)
            .max(excess * V::constant(1e-2))
            .max(high * V::constant(1e-9));

        let tolerance = V::constant(if R::IS_SINGLE { 1e-6 } else { 1e-12 }) * q;
        let mut flow = q;
        let mut still = one;
        let mut last = V::constant(f64::MAX);
        for _ in 0..MAX_EVALUATIONS {
            let strain = old_strain + x;
            let power = b * pow(strain, n);
            let (rate_factor, rate_slope) = self.rate.factor(x, dt);
            let stress = q - three_mu * x;
            let rise = self.thermal.rise(stress * x);
            let (softening, softening_slope) = self.thermal.factor(&state.thermal, lane, rise);
            still = (a + power) * softening;
            flow = still * rate_factor;
            let residual = stress - flow;
            let closed = residual.abs().le(tolerance) | (high - low).le(V::splat(R::EPSILON) * high);
            if (closed | !yields).all() {
                break;
            }
            let too_small = residual.gt(zero);
            low = V::select(too_small, x, low);
            high = V::select(too_small, high, x);
            let slope = n * power / strain.max(tiny) * softening * rate_factor
                + still * rate_slope
                + (a + power) * rate_factor * softening_slope * self.thermal.rise(stress);
            let newton = x + residual / (three_mu + slope).max(three_mu * V::constant(0.1));
            // Outside the bracket, or where Newton steps go to and fro (across the kink at the reference rate): the
            // geometric mean, because the root may lie many orders below the upper end.
            let stalls = residual.abs().gt(V::constant(0.5) * last);
            last = residual.abs();
            let mean = (low / high).max(V::constant(1e-9)).sqrt() * high;
            let next = V::select(newton.gt(low) & newton.lt(high) & !stalls, newton, mean);
            x = V::select(closed, x, next);
        }
        // Plastic work by the trapezoidal rule. A point that was already yielding started at its own stress; one that
        // was elastic crossed the flow stress at rest.
        let start = squares[0].sqrt().max(at_rest);
        let work = V::constant(0.5) * (start + flow) * x;
        let x = V::select(yields, x, zero);
        let work = V::select(yields, work.max(zero), zero);
        (old_strain + x).store(&mut state.plastic_strain[lane..]);
        V::select(yields, still, at_rest).store(&mut state.yield_stress[lane..]);
        let rise = self.thermal.rise(work);
        self.thermal.heat(&mut state.thermal, lane, rise);
        totals.plastic_work = volume.mul_add(work, totals.plastic_work);
        V::select(yields, flow / q, one)
    }
}
