//! Flow laws that are a product: strength over strain and temperature (`hardening`), rate (`rate`), softening
//! (`effects`).
//!
//! σ_y = (A + B ε̄ⁿ) R(ε̄̇) S(T) of Johnson and Cook (1983), with R = 1 or S = 1 where the scene names no
//! such effect, or that of another law of hardening.
//!
//! Hardening and softening, each with a power, are as good as parabolas over what a guess misses an increment
//! by; the rate's logarithm is not. So each step solves the return for the rate with those parabolas
//! (`RateEffect::solve`), at a logarithm a try and nothing else, and one evaluation of the strength is enough
//! for most returns of a cut.

use super::effects::{Adiabatic, ThermalEffect};
use super::flow_law::{Ahead, FlowLaw, LocalFlow, Trial, Tried, least, tiny};
use super::hardening::{Hardening, PowerLaw, Strength};
use super::rate::{KnownReturn, KnownStrength, Nearby, QuasiStatic, RateDependent, RateEffect};
use crate::scene::Constants;
use crate::simd::{Mask, Real, Vector};

/// How well the first guess solves for the rate (-): the strength at rest is not known better.
const ROUGHLY: f64 = 0.3;

/// Hardening × rate × softening.
#[derive(Clone, Copy, Debug)]
pub struct Multiplicative<H, Q, T> {
    hardening: H,
    rate: Q,
    thermal: T,
}

/// A hardening with rate and adiabatic heat that softens: the one kernel of all but plain Johnson and Cook in
/// the plane.
pub type WithRateAndHeat<R, H> = Multiplicative<H, RateDependent<R>, Adiabatic<R, true>>;

/// Johnson and Cook's law with all of its factors.
pub type JohnsonCook<R> = WithRateAndHeat<R, PowerLaw<R>>;

impl<H, Q, T> Multiplicative<H, Q, T> {
    /// The law of a material's constants with the effects a scene names.
    pub fn new<R: Real>(constants: &Constants, rate: Q, thermal: T) -> Self
    where
        H: Hardening<R>,
    {
        Multiplicative { hardening: H::new(constants), rate, thermal }
    }
}

impl<R: Real, H: Hardening<R>> WithRateAndHeat<R, H> {
    /// The law with all of its factors.
    ///
    /// * `initial`: temperature at the start (K)
    pub fn full(constants: &Constants, initial: f64) -> Self {
        Self::new(constants, RateDependent::of(constants), Adiabatic::of(constants, initial))
    }
}

impl<R: Real, H: Hardening<R>, Q: RateEffect<R>, T: ThermalEffect<R>> FlowLaw<R> for Multiplicative<H, Q, T> {
    type Thermal = T;
    type Local<V: Vector<Scalar = R>> = Factors<V, Q>;

    #[inline(always)]
    fn thermal(&self) -> &T {
        &self.thermal
    }

    fn yield_stress(&self) -> R {
        self.hardening.yield_stress()
    }

    fn at_rest(&self, plastic_strain: R, temperature: f64) -> R {
        let softening = R::from_f64(self.thermal.static_factor(temperature));
        self.hardening.at_rest(plastic_strain, temperature, softening)
    }

    /// What the rate makes of the strength as it stands.
    #[inline(always)]
    fn first_guess<V: Vector<Scalar = R>>(&self, trial: &Trial<V>, guess: V, high: V) -> V {
        let mut guess = guess;
        // Where the strain grows by a multiple, above all where a point yields for the first time, the slope
        // of hardening says little about where it leads; the power does.
        let mut most = high;
        let grows = guess.gt(trial.strain);
        if (trial.yields & grows).any() {
            let end = self.hardening.carrying(trial.strain, trial.at_rest, trial.stress);
            most = V::select(grows, (end - trial.strain).max(least()).min(high), high);
            guess = guess.min(most);
        }
        let strength = QuasiStatic(trial.at_rest);
        let standing =
            KnownReturn { trial: trial.stress, three_mu: trial.three_mu, strength, least: trial.least };
        let start = (guess, self.rate.factor(guess, trial.dt));
        let (x, _) = self.rate.solve(&standing, start, trial.dt, V::constant(ROUGHLY), trial.yields);
        x.max(least()).min(most)
    }

    #[inline(always)]
    fn local<V: Vector<Scalar = R>>(
        &self,
        trial: &Trial<V>,
        increment: V,
        state: &T::State,
        lane: usize,
        rise: V,
    ) -> Factors<V, Q> {
        let factor = self.rate.factor(increment, trial.dt);
        let strength = self.hardening.strength(trial.strain + increment, &self.thermal, state, lane, rise);
        let at_rest = strength.hardened * strength.softening;
        let (curves, softens) = (H::CURVES, T::SOFTENS);
        Factors { strength, at_rest, factor, rate: self.rate, curves, softens }
    }
}

/// Half of a second derivative where it is known and the way is short, else zero.
#[inline(always)]
fn half_near<V: Vector>(second: V, is_near: V::Mask, is_known: bool) -> V {
    let zero = V::constant(0.0);
    if is_known { V::select(is_near, V::constant(0.5) * second, zero) } else { zero }
}

/// The factors at one increment.
#[derive(Clone, Copy, Debug)]
pub struct Factors<V, Q> {
    strength: Strength<V>,
    at_rest: V,
    factor: V,
    rate: Q,
    /// Whether second derivatives are known.
    curves: bool,
    /// Whether the temperature counts.
    softens: bool,
}

impl<V: Vector, Q: RateEffect<V::Scalar>> LocalFlow<V> for Factors<V, Q> {
    type Ahead = Root<V>;

    #[inline(always)]
    fn stress(&self) -> V {
        self.at_rest * self.factor
    }

    #[inline(always)]
    fn at_rest(&self) -> V {
        self.at_rest
    }

    #[inline(always)]
    fn ahead(&self, trial: &Trial<V>, tried: &Tried<V>) -> Root<V> {
        let Factors { strength, factor, rate, curves, softens, .. } = *self;
        let (hardened, softening) = (strength.hardened, strength.softening);
        let Tried { increment: x, residual, heating } = *tried;
        let slope = strength.slope * softening + hardened * strength.softening_slope * heating[0];
        let steepness = slope.mul_add(factor, trial.three_mu);
        let strain = trial.strain + x;
        // A parabola far from its guess may turn round: second derivatives only where the way is short.
        let miss = [residual.abs(), V::constant(0.01) * steepness.max(trial.least) * strain];
        let is_near = miss[0].le(miss[1]);
        let halves = [
            half_near(strength.curvature, is_near, curves),
            half_near(strength.softening_curvature, is_near, curves),
        ];
        let nearby = Nearby {
            about: x,
            hardened: [hardened, strength.slope, halves[0]],
            softening: [softening, strength.softening_slope, halves[1]],
            heating,
        };
        let known = KnownReturn {
            trial: trial.stress,
            three_mu: trial.three_mu,
            strength: nearby,
            least: trial.least,
        };
        // A step after which the rate, on known strength, is solved.
        let near_rate = V::constant(if V::Scalar::IS_SINGLE { 2e-2 } else { 1e-3 });
        let (root, is_exact) = rate.solve(&known, (x, factor), trial.dt, near_rate, trial.yields);
        let steepness = [steepness, trial.least];
        Root { root, is_exact, miss, steepness, strain, nearby, curves, softens }
    }
}

/// Where the factors lead.
#[derive(Clone, Copy, Debug)]
pub struct Root<V: Vector> {
    root: V,
    is_exact: V::Mask,
    /// What the return misses by (Pa), and up to where parabolas hold.
    miss: [V; 2],
    /// Steepness of the return, and the least that there must be (Pa).
    steepness: [V; 2],
    /// ε̄ (-) about which the strength is known.
    strain: V,
    nearby: Nearby<V>,
    curves: bool,
    softens: bool,
}

impl<V: Vector> Ahead<V> for Root<V> {
    #[inline(always)]
    fn increment(&self) -> V {
        self.root
    }

    #[inline(always)]
    fn keep_known(&self, step: V, points: &mut V::Mask) {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        // What parabolas, or lines for a law without second derivatives, miss is of the third, or second,
        // order in the step over the strain and over what has softened: below the tolerance with these.
        let near = V::constant(match (self.curves, V::Scalar::IS_SINGLE) {
            (true, false) => 5e-5,
            (false, false) => 7e-7,
            (true, true) => 5e-3,
            (false, true) => 7e-4,
        });
        // Softening begins and ends with a kink, which no derivative tells of.
        let [softening, softening_slope, _] = self.nearby.softening;
        let heating = self.nearby.heating;
        let most = near * softening.min(one - softening);
        let is_smooth = if self.softens { most.gt(zero) } else { one.gt(zero) };
        let softened = softening_slope * heating[1].mul_add(step, heating[0]) * step;
        let is_short = step.abs().le(near * self.strain) & softened.abs().le(most) & is_smooth;
        let is_tiny = step.abs().le(tiny::<V>() * self.nearby.about);
        let is_near = self.miss[0].le(self.miss[1]);
        let is_steep = self.steepness[0].gt(self.steepness[1]);
        *points = *points & self.is_exact & (is_near & is_short | is_tiny) & is_steep;
    }

    #[inline(always)]
    fn at_rest(&self, increment: V) -> V {
        self.nearby.at(increment).0
    }
}
