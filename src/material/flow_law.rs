//! What the return to the yield surface asks of a flow law.
//!
//! A flow law gives the flow stress σ_y(ε̄, ε̄̇, T) of points side by side, and from it where a return
//! probably ends. Most laws need no more than `Slopes`: the stress and its derivatives with respect to
//! strain, rate and temperature, with which this module takes Newton's steps. A law that knows more of itself
//! gives a `LocalFlow` of its own: `multiplicative`, whose factors part, solves its rate apart from the rest.

use super::effects::ThermalEffect;
use crate::simd::{Real, Vector};

/// A return that looks for its increment: what stays the same over all tries.
#[derive(Clone, Copy, Debug)]
pub struct Trial<V: Vector> {
    /// ε̄ before the substep (-).
    pub strain: V,
    /// Flow stress at rest there (Pa).
    pub at_rest: V,
    /// Equivalent stress if nothing yielded, q (Pa).
    pub stress: V,
    /// 3μ (Pa).
    pub three_mu: V,
    /// Least steepness to divide by (Pa): where the law softens faster, its slope tells of no root.
    pub least: V,
    /// Substep (s).
    pub dt: V::Scalar,
    /// Points that yield.
    pub yields: V::Mask,
}

/// One try of it.
#[derive(Clone, Copy, Debug)]
pub struct Tried<V> {
    /// The increment x of ε̄ (-).
    pub increment: V,
    /// q − 3μ x − σ_y (Pa).
    pub residual: V,
    /// Rise of temperature with the increment (K), and half its second derivative (K).
    pub heating: [V; 2],
}

/// A law of the flow stress over plastic strain, its rate and temperature.
pub trait FlowLaw<R: Real>: Clone + Send + Sync + 'static {
    /// How it keeps the points' temperatures.
    type Thermal: ThermalEffect<R>;
    /// What it knows of the flow stress at one increment.
    type Local<V: Vector<Scalar = R>>: LocalFlow<V>;

    /// The part that keeps temperatures.
    fn thermal(&self) -> &Self::Thermal;

    /// Flow stress of virgin material at rest (Pa), a scale for guards and estimates.
    fn yield_stress(&self) -> R;

    /// Flow stress at rest (Pa), which points that do not yield are compared with.
    ///
    /// * `plastic_strain`: ε̄ (-), at least 0
    /// * `temperature`: T (K)
    fn at_rest(&self, plastic_strain: R, temperature: f64) -> R;

    /// Where to begin (-), above 0 and at most `high`.
    ///
    /// * `guess`: the whole strain increment, as in steady flow, or the excess over the flow stress at rest
    ///   where that is less (-)
    /// * `high`: the largest increment that there can be (-)
    fn first_guess<V: Vector<Scalar = R>>(&self, trial: &Trial<V>, guess: V, high: V) -> V;

    /// The flow stress of points `lane..` at an increment (-), above 0, when their temperature rises by
    /// `rise` (K).
    fn local<V: Vector<Scalar = R>>(
        &self,
        trial: &Trial<V>,
        increment: V,
        state: &<Self::Thermal as ThermalEffect<R>>::State,
        lane: usize,
        rise: V,
    ) -> Self::Local<V>;
}

/// The flow stress at one increment, and what is known of it nearby.
pub trait LocalFlow<V: Vector>: Copy {
    /// Where it leads.
    type Ahead: Ahead<V>;

    /// σ_y (Pa).
    fn stress(&self) -> V;

    /// The same at rest (Pa).
    fn at_rest(&self) -> V;

    /// Where the return ends, as far as it can be told from here.
    fn ahead(&self, trial: &Trial<V>, tried: &Tried<V>) -> Self::Ahead;
}

/// Where a return probably ends.
pub trait Ahead<V: Vector>: Copy {
    /// The increment there (-); it may lie outside the bracket.
    fn increment(&self) -> V;

    /// Leaves of `points` those whose flow stress is as good as known after a step (-) in the increment: no
    /// second look is needed there. In place, since a mask that is given back is packed into an integer where
    /// vectors are arrays.
    fn keep_known(&self, step: V, points: &mut V::Mask);

    /// Flow stress at rest (Pa) at an increment (-) nearby.
    fn at_rest(&self, increment: V) -> V;
}

/// Least strain that is divided by (-): far below any increment, as the return's last step trusts the slope.
#[inline(always)]
pub(super) fn least<V: Vector>() -> V {
    V::constant(if V::Scalar::IS_SINGLE { 1e-37 } else { 1e-300 })
}

/// A step over the increment (-) so short that it arrives whatever the law.
#[inline(always)]
pub(super) fn tiny<V: Vector>() -> V {
    V::constant(if V::Scalar::IS_SINGLE { 3e-4 } else { 1e-7 })
}

/// A stress and its slopes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Branch<V> {
    /// The stress (Pa).
    pub stress: V,
    /// Its derivative with respect to plastic strain (Pa).
    pub per_strain: V,
    /// Its derivative with respect to temperature (Pa/K).
    pub per_kelvin: V,
}

impl<V: Vector> Branch<V> {
    /// Its derivative with respect to plastic strain (Pa) when that heats by so much (K).
    #[inline(always)]
    fn along(&self, heating: V) -> V {
        heating.mul_add(self.per_kelvin, self.per_strain)
    }
}

/// All that a law of any form need tell: Newton's steps do the rest.
#[derive(Clone, Copy, Debug)]
pub struct Slopes<V: Vector> {
    /// Flow stress.
    pub flow: Branch<V>,
    /// ∂σ_y/∂ln ε̄̇ (Pa).
    pub per_log_rate: V,
    /// Flow stress at rest.
    pub at_rest: Branch<V>,
    /// Points with no kink of the law within a thousandth of rate and temperature.
    pub is_smooth: V::Mask,
}

impl<V: Vector> LocalFlow<V> for Slopes<V> {
    type Ahead = NewtonStep<V>;

    #[inline(always)]
    fn stress(&self) -> V {
        self.flow.stress
    }

    #[inline(always)]
    fn at_rest(&self) -> V {
        self.at_rest.stress
    }

    /// A step that shortens the increment to less than a tenth says only that it is much shorter.
    #[inline(always)]
    fn ahead(&self, trial: &Trial<V>, tried: &Tried<V>) -> NewtonStep<V> {
        let x = tried.increment;
        let heating = tried.heating[0];
        let steepness = trial.three_mu + self.flow.along(heating) + self.per_log_rate / x;
        let step = tried.residual / steepness.max(trial.least);
        NewtonStep {
            from: x,
            to: (x + step).max(V::constant(0.1) * x),
            holds: self.is_smooth & steepness.gt(trial.least),
            at_rest: self.at_rest.stress,
            at_rest_slope: self.at_rest.along(heating),
        }
    }
}

/// A step of Newton's.
#[derive(Clone, Copy, Debug)]
pub struct NewtonStep<V: Vector> {
    from: V,
    to: V,
    holds: V::Mask,
    at_rest: V,
    at_rest_slope: V,
}

impl<V: Vector> Ahead<V> for NewtonStep<V> {
    #[inline(always)]
    fn increment(&self) -> V {
        self.to
    }

    #[inline(always)]
    fn keep_known(&self, step: V, points: &mut V::Mask) {
        *points = *points & self.holds & step.abs().le(tiny::<V>() * self.from);
    }

    #[inline(always)]
    fn at_rest(&self, increment: V) -> V {
        self.at_rest_slope.mul_add(increment - self.from, self.at_rest)
    }
}

#[cfg(test)]
pub(super) mod testing {
    //! Slopes of any law against its own differences.

    use super::*;
    use crate::points::PointState;
    use crate::simd::testing::{Double, first};

    /// State of a point for `slopes`.
    #[derive(Clone, Copy, Debug)]
    pub(crate) struct At {
        /// ε̄ (-).
        pub strain: f64,
        /// ε̄̇ (1/s).
        pub rate: f64,
        /// T (K).
        pub temperature: f64,
    }

    /// What a law whose `Local` is `Slopes` gives for vectors `V`.
    pub(crate) fn slopes<V: Vector, L>(law: &L, at: At) -> Slopes<V>
    where
        L: FlowLaw<V::Scalar, Local<V> = Slopes<V>>,
    {
        let zero = V::constant(0.0);
        let increment = V::constant(1e-6 * at.strain);
        let trial = Trial {
            strain: V::constant(at.strain) - increment,
            at_rest: zero,
            stress: zero,
            three_mu: zero,
            least: zero,
            dt: V::Scalar::from_f64(1e-6 * at.strain / at.rate),
            yields: zero.le(zero),
        };
        let mut state = <L::Thermal as ThermalEffect<V::Scalar>>::State::zeroed();
        (0..V::LANES).for_each(|lane| law.thermal().place(&mut state, lane, at.temperature));
        law.local(&trial, increment, &state, 0, zero)
    }

    /// Fails unless the slopes in strain, logarithm of the rate and temperature are central differences of
    /// the stress.
    pub(crate) fn match_differences<L: FlowLaw<f64, Local<Double> = Slopes<Double>>>(law: &L, at: At) {
        let stress = |at: At| first(slopes::<Double, L>(law, at).flow.stress);
        let here = slopes::<Double, L>(law, at);
        let (e, t, grow) = (1e-5 * at.strain, 1e-3, 1e-5_f64);
        let by_strain =
            stress(At { strain: at.strain + e, ..at }) - stress(At { strain: at.strain - e, ..at });
        let by_rate = stress(At { rate: at.rate * grow.exp(), ..at })
            - stress(At { rate: at.rate * (-grow).exp(), ..at });
        let by_kelvin = stress(At { temperature: at.temperature + t, ..at })
            - stress(At { temperature: at.temperature - t, ..at });
        let pairs = [
            ("strain", first(here.flow.per_strain), by_strain / (2.0 * e), e),
            ("ln rate", first(here.per_log_rate), by_rate / (2.0 * grow), grow),
            ("temperature", first(here.flow.per_kelvin), by_kelvin / (2.0 * t), t),
        ];
        for (name, slope, difference, step) in pairs {
            // Truncation 1e-10 of the slope's scale, and rounding of a stress of 1e9 Pa over the differences.
            let bound = 1e-6 * difference.abs() + 3e-6 / step;
            assert!(
                (slope - difference).abs() < bound,
                "slope {slope:e} in {name}, by differences {difference:e}, at {at:?}"
            );
        }
    }
}
