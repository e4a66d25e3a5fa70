//! Rate as a factor on the flow stress, with a twin that does nothing, and the return to the yield surface
//! solved for it.
//!
//! A type parameter of `multiplicative`: what a scene does not name costs no logarithm.

use crate::scene::Constants;
use crate::simd::math::ln;
use crate::simd::{Mask, Real, Vector};

/// A return to the yield surface with what is known of the strength at rest: q − 3μ y − σ(y) R(y/Δt) = 0.
#[derive(Clone, Copy, Debug)]
pub struct KnownReturn<V, K> {
    /// Equivalent stress if nothing yielded, q (Pa).
    pub trial: V,
    /// 3μ (Pa).
    pub three_mu: V,
    /// What is known of σ.
    pub strength: K,
    /// Least steepness 3μ + (σ R)' to divide by (Pa): a law that softens faster has no root that the slope
    /// tells of.
    pub least: V,
}

/// What is known of the strength at rest.
pub trait KnownStrength<V>: Copy {
    /// Most logarithms of one `RateDependent::solve`: one or two from a good start, one for each factor of
    /// ten from a bad one.
    const MOST_LOGARITHMS: usize;

    /// Strength at rest (Pa) at the increment y (-) and its first two derivatives (Pa), none where it is
    /// taken as constant.
    fn at(&self, y: V) -> (V, Option<[V; 2]>);
}

/// A strength (Pa) that stays as it is.
#[derive(Clone, Copy, Debug)]
pub struct QuasiStatic<V>(pub V);

impl<V: Vector> KnownStrength<V> for QuasiStatic<V> {
    const MOST_LOGARITHMS: usize = 24;

    #[inline(always)]
    fn at(&self, _y: V) -> (V, Option<[V; 2]>) {
        (self.0, None)
    }
}

/// A strength H(y) S(T(y)) of which all three are parabolas about an increment x.
#[derive(Clone, Copy, Debug)]
pub struct Nearby<V> {
    /// The increment x (-).
    pub about: V,
    /// Strength without softening, H (Pa), its derivative with respect to the increment, and half the second.
    pub hardened: [V; 3],
    /// Softening S (-), its derivative with respect to temperature (1/K), and half the second (1/K²).
    pub softening: [V; 3],
    /// Rise of temperature with the increment at x (K), and half its second derivative (K).
    pub heating: [V; 2],
}

impl<V: Vector> KnownStrength<V> for Nearby<V> {
    /// The strength is not known far from where a return stands: better to look there.
    const MOST_LOGARITHMS: usize = 8;

    #[inline(always)]
    fn at(&self, y: V) -> (V, Option<[V; 2]>) {
        let way = y - self.about;
        let [hardened, hardening, hardening_bend] = parabola(self.hardened, way);
        let [heating, bend] = self.heating;
        let bent = bend * way;
        let heats = heating + bent + bent;
        let [softening, per_kelvin, softening_bend] = parabola(self.softening, (heating + bent) * way);
        let softens = per_kelvin * heats;
        let slope = hardened.mul_add(softens, hardening * softening);
        // Half the second derivative of the softening along the way.
        let half = per_kelvin.mul_add(bend, V::constant(0.5) * softening_bend * heats * heats);
        let twice = hardened.mul_add(half, hardening * softens);
        (hardened * softening, Some([slope, hardening_bend.mul_add(softening, twice + twice)]))
    }
}

/// Longest step over the increment (-) that the series of a step may correct.
const SERIES: f64 = 0.3;

impl<V: Vector, K: KnownStrength<V>> KnownReturn<V, K> {
    /// The way from y to the root of the residual f, from f and three derivatives at y: Newton's step d =
    /// −f/f′ if it is long, else the inverted series d − a d² + (2a² − b) d³ with a = f″/2f′ and b = f‴/6f′,
    /// whose error is of fourth order in d/y.
    ///
    /// * `y`: the increment and one over it (-)
    /// * `rate`: the rate's factor R at y (-) and its derivative R′; the next ones are −R′/y and 2R′/y²
    #[inline(always)]
    fn step(&self, [y, inverse]: [V; 2], [factor, derivative]: [V; 2]) -> V {
        let (strength, slopes) = self.strength.at(y);
        let residual = self.trial - self.three_mu * y - strength * factor;
        let steepness = strength.mul_add(derivative, self.three_mu);
        let over = strength * inverse;
        let two_thirds = V::constant(2.0 / 3.0);
        // −f′, −f″ and −f‴/3.
        let [first, second, third] = match slopes {
            None => [steepness, -(derivative * over), derivative * inverse * two_thirds * over],
            Some([slope, bend]) => [
                slope.mul_add(factor, steepness).max(self.least),
                bend.mul_add(factor, derivative * (slope + slope - over)),
                derivative * (bend - inverse * (slope - two_thirds * over)),
            ],
        };
        let half = V::constant(0.5) / first;
        let newton = residual * (half + half);
        let (a, b) = (second * half * newton, third * half * newton * newton);
        let series = newton.mul_add((a + a).mul_add(a, -(a + b)), newton);
        V::select(newton.abs().le(V::constant(SERIES) * y), series, newton)
    }
}

/// c₀ + c₁ x + c₂ x² and its two derivatives.
#[inline(always)]
fn parabola<V: Vector>([c0, c1, c2]: [V; 3], x: V) -> [V; 3] {
    let bent = c2 * x;
    [(c1 + bent).mul_add(x, c0), c1 + bent + bent, c2 + c2]
}

/// Dependence of the flow stress on the plastic strain rate.
pub trait RateEffect<R: Real>: Copy + Send + Sync + 'static {
    /// Factor on the flow stress (-).
    ///
    /// * `increment`: equivalent plastic strain of the substep (-), positive
    /// * `dt`: substep (s)
    fn factor<V: Vector<Scalar = R>>(&self, increment: V, dt: R) -> V;

    /// The increment y (-) that solves `law`, and the lanes where it is found to the last digits, if not far
    /// from the start.
    ///
    /// * `start`: where to begin (-), positive, with the factor there
    /// * `near`: last step over y (-) from which on the next one, of fourth order in it, is left out
    /// * `wanted`: lanes to solve
    fn solve<V: Vector<Scalar = R>, K: KnownStrength<V>>(
        &self,
        law: &KnownReturn<V, K>,
        start: (V, V),
        dt: R,
        near: V,
        wanted: V::Mask,
    ) -> (V, V::Mask);
}

/// No dependence.
#[derive(Clone, Copy, Debug)]
pub struct RateIndependent;

impl<R: Real> RateEffect<R> for RateIndependent {
    #[inline(always)]
    fn factor<V: Vector<Scalar = R>>(&self, _increment: V, _dt: R) -> V {
        V::constant(1.0)
    }

    #[inline(always)]
    fn solve<V: Vector<Scalar = R>, K: KnownStrength<V>>(
        &self,
        law: &KnownReturn<V, K>,
        (start, _factor): (V, V),
        _dt: R,
        _near: V,
        wanted: V::Mask,
    ) -> (V, V::Mask) {
        // Enough from a start as near as that of a return's last step; exact where the strength stays as it
        // is.
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        (start + law.step([start, zero], [one, zero]), wanted)
    }
}

/// Johnson and Cook's 1 + C ln(ε̄̇/ε̇₀), and 1 below the reference rate ε̇₀, where the logarithm would
/// soften.
#[derive(Clone, Copy, Debug)]
pub struct RateDependent<R> {
    /// C (-).
    pub coefficient: R,
    /// ε̇₀ (1/s).
    pub reference: R,
}

impl<R: Real> RateDependent<R> {
    /// With a material's constants.
    pub fn of(constants: &Constants) -> Self {
        RateDependent {
            coefficient: R::from_f64(constants.rate_coefficient),
            reference: R::from_f64(constants.reference_rate),
        }
    }
}

impl<R: Real> RateEffect<R> for RateDependent<R> {
    #[inline(always)]
    fn factor<V: Vector<Scalar = R>>(&self, increment: V, dt: R) -> V {
        let one = V::constant(1.0);
        let relative = increment / V::splat(dt * self.reference);
        V::splat(self.coefficient).mul_add(ln(relative.max(one)), one)
    }

    /// At the reference rate the factor has a kink, across which Newton steps would go to and fro: each lane
    /// looks on one side of it. Above, the residual falls and is convex, so that Newton's steps from the left
    /// never pass the root, and series by no more than they miss; below, the factor is one. A step below that
    /// leads across goes on above from the kink; a step that leads from the kink to the left goes on below,
    /// from the start, where parabolas hold, and stays there.
    #[inline(always)]
    fn solve<V: Vector<Scalar = R>, K: KnownStrength<V>>(
        &self,
        law: &KnownReturn<V, K>,
        (start, factor): (V, V),
        dt: R,
        near: V,
        wanted: V::Mask,
    ) -> (V, V::Mask) {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let c = V::splat(self.coefficient);
        let kink = V::splat(dt * self.reference);
        let mut y = start;
        let mut factor = factor;
        let mut below = start.lt(kink);
        let mut may_rise = below;
        for _ in 0..K::MOST_LOGARITHMS {
            let inverse = one / y;
            let rate = [V::select(below, one, factor), V::select(below, zero, c * inverse)];
            let step = law.step([y, inverse], rate);
            let next = y + step;
            let rises = may_rise & below & next.gt(kink);
            let falls = !below & y.le(kink) & step.le(zero);
            // A step that the kink cuts short has not arrived, however short it is.
            let stays = V::select(below, kink - next, next - kink).ge(zero);
            let arrives = step.abs().le(near * y.abs()) & stays & !falls;
            // A step to the left above may pass zero where the root is far from there.
            let above = next.max(V::constant(0.1) * y).max(kink);
            y = V::select(falls, start, V::select(rises, kink, V::select(below, next, above)));
            if (arrives | !wanted).all() {
                return (y, arrives);
            }
            (below, may_rise) = ((below | falls) & !rises, may_rise & !rises);
            factor = self.factor(y, dt);
        }
        (y, zero.gt(one))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::testing::{Double as V, first};

    /// The logarithm hardens above the reference rate and would soften below it, where the factor is one by
    /// definition.
    #[test]
    fn rate_factor_is_the_logarithm_above_the_reference_rate_and_one_below() {
        let rate = RateDependent { coefficient: 0.014, reference: 2.0 };
        let dt = 1e-3;
        for exponent in -12..=12 {
            let speed = 3.0 * 10_f64.powi(exponent);
            let factor = first(rate.factor(V::splat(speed * dt), dt));
            let exact = 1.0 + 0.014 * (speed / 2.0).max(1.0).ln();
            assert!((factor - exact).abs() < 1e-14, "factor {factor} at {speed} 1/s, exact {exact}");
        }
    }

    /// What a step misses falls with the fourth power of its length or faster: all derivatives are right.
    #[test]
    fn a_step_is_of_fourth_order() {
        let (dt, about, root) = (1e-9, 1e-4, 1e-4);
        let rate = RateDependent { coefficient: 0.05, reference: 1.0 };
        let nearby = Nearby {
            about: V::constant(about),
            hardened: [1e9, 4e12, -2e16].map(V::constant),
            softening: [0.9, -8e-4, -2e-5].map(V::constant),
            heating: [3e5, -8e8].map(V::constant),
        };
        let factor = |y: f64| first(rate.factor(V::constant(y), dt));
        let strength = |y: f64| first(nearby.at(V::constant(y)).0);
        let three_mu = 2.4e11;
        let trial = three_mu * root + strength(root) * factor(root);
        let [trial, three_mu, least] = [trial, three_mu, 0.1 * three_mu].map(V::constant);
        let law = KnownReturn { trial, three_mu, strength: nearby, least };
        let missed = |start: f64| {
            let y = V::constant(start);
            let slope = V::constant(0.05 / start);
            let step = first(law.step([y, V::constant(1.0 / start)], [V::constant(factor(start)), slope]));
            ((start + step) / root - 1.0).abs()
        };
        for side in [-1.0, 1.0] {
            let [far, near] = [0.1, 0.05].map(|way| missed(root * (1.0 + side * way)));
            assert!(far / near > 11.0, "misses {far:e}, then {near:e} at half the way");
            assert!(far < 3e-4, "misses {far:e} from {side} tenth away");
        }
    }

    /// From any start, on either side of the reference rate, the root closes the equation of the parabolas.
    #[test]
    fn a_return_is_solved_from_any_start() {
        let (trial, three_mu) = (1.1e9, 2.4e11);
        let (dt, c) = (1e-9, 0.05);
        let mut below = 0;
        for reference in [1e-3, 1.0, 3e5, 1e6, 1e9] {
            let rate = RateDependent { coefficient: c, reference };
            for hardened in [1.0e9, 1.0999e9, 1.099_999_9e9] {
                for exponent in -12..=-3 {
                    let start = 4.0 * 10_f64.powi(exponent);
                    let about = 1e-4;
                    let nearby = Nearby {
                        about: V::constant(about),
                        hardened: [hardened, 2e8, -1e8].map(V::constant),
                        softening: [1.0, -8e-4, 1e-7].map(V::constant),
                        heating: [2e2, -1e5].map(V::constant),
                    };
                    let law = KnownReturn {
                        trial: V::constant(trial),
                        three_mu: V::constant(three_mu),
                        strength: nearby,
                        least: V::constant(0.1 * three_mu),
                    };
                    let every = V::constant(0.0).lt(V::constant(1.0));
                    let again = |from: V| {
                        rate.solve(&law, (from, rate.factor(from, dt)), dt, V::constant(1e-3), every)
                    };
                    let (mut root, mut is_exact) = again(V::constant(start));
                    for _ in 0..3 {
                        if !is_exact.all() {
                            (root, is_exact) = again(root);
                        }
                    }
                    let y = first(root);
                    let way = y - about;
                    let rise = (2e2 - 1e5 * way) * way;
                    let strength =
                        (hardened + (2e8 - 1e8 * way) * way) * (1.0 + (-8e-4 + 1e-7 * rise) * rise);
                    let factor = 1.0 + c * (y / (dt * reference)).max(1.0).ln();
                    let residual = trial - three_mu * y - strength * factor;
                    below += usize::from(y < dt * reference);
                    let context =
                        format!("reference {reference} 1/s, strength {hardened} Pa, from {start:e}: {y:e}");
                    assert!(is_exact.all() && y > 0.0, "not found; {context}");
                    assert!(residual.abs() < 1e-12 * trial, "residual {residual:e} Pa; {context}");
                }
            }
        }
        assert!((20..130).contains(&below), "{below} of 150 roots below the reference rate");
    }
}
