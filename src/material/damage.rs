//! Damage of Johnson and Cook (1985) and separation by fracture energy, with a twin that does nothing.
//!
//! Initiation: plastic strain increments use up the failure strain of the present triaxiality η = σ_m/q, rate
//! and temperature, and damage begins where the sum ω reaches one:
//!
//! ω = Σ Δε̄/ε_f,  ε_f = (d1 + d2 exp(d3 η)) (1 + d4 ln(ε̄̇/ε̇₀)) (1 + d5 T*),
//!
//! with the logarithm at least 0 and ε_f at least 1e-3. (Johnson and Cook count η positive in tension, d3
//! negative.)
//!
//! Evolution: strain that follows takes D from 0 to 1 by the work of the undamaged flow stress over a length
//! L,
//!
//! dD = σ_y L dε̄ / (2 G_f),  hence  ∫ (1 − D) σ_y L dε̄ = G_f ∫ 2 (1 − D) dD = G_f
//!
//! for any hardening, rate and temperature on the way: a band as wide as L dissipates the fracture energy G_f
//! (J/m2) per area whatever the grid (Hillerborg et al. 1976, doi:10.1016/0008-8846(76)90007-7). At constant
//! σ_y this is the usual law D = L ε̄/u_f with the displacement at failure u_f = 2 G_f/σ_y. L is the edge of
//! a cell: the grid knows no narrower band (tests/damage.rs,
//! `the_energy_of_a_shear_band_does_not_hang_on_the_cells`).
//!
//! What is carried: stress and flow stress are those of the undamaged material times 1 − D (strain
//! equivalence, Lemaitre), except pressure, J < 1, which stays whole: surfaces that close press on each
//! other. A point with D = 1 has failed: it keeps mass, momentum and pressure, has no deviator and no
//! tension, and remembers how far it is open, up to a volume ratio of 2.
//!
//! Energy: work past initiation, and the elastic energy that growing damage releases, are
//! `StepSums::damage_work`. The first heats as all plastic work does.

use super::StepSums;
use super::elasticity::Elasticity;
use crate::points::{BLOCK, Column, PointState};
use crate::scene::Constants;
use crate::simd::math::{exp, ln};
use crate::simd::{Mask, Real, Vector};

/// What a return to the yield surface tells the damage.
#[derive(Clone, Copy, Debug)]
pub struct Yielding<V: Vector> {
    /// Increment of the plastic strain (-); 0 where nothing yields.
    pub increment: V,
    /// Plastic work of the undamaged material per volume at the start (J/m3); 0 where nothing yields.
    pub work: V,
    /// Flow stress of the undamaged material (Pa).
    pub flow: V,
    /// Volume ratio (-).
    pub jacobian: V,
    /// Temperature before the work of this substep (K).
    pub temperature: V,
    /// Substep (s).
    pub dt: V::Scalar,
    /// Volume at the start (m3).
    pub volume: V,
}

/// Damage of the points and what it leaves of their stress.
pub trait DamageEffect<R: Real>: Clone + Send + Sync + 'static {
    /// What it keeps per point.
    type State: PointState<R>;

    /// Undamages a point.
    fn place(&self, state: &mut Self::State, lane: usize);

    /// D of a point (-).
    fn report(&self, state: &Self::State, lane: usize) -> f64;

    /// What points `lane..` carry of a stress or work of the undamaged material: 1 − D of it.
    fn carried<V: Vector<Scalar = R>>(&self, state: &Self::State, lane: usize, whole: V) -> V;

    /// What they carry of a mean stress (Pa): pressure stays.
    fn carried_mean<V: Vector<Scalar = R>>(&self, state: &Self::State, lane: usize, mean: V) -> V;

    /// The number, and 0 for points that have failed: their deviator is forgotten.
    fn unless_failed<V: Vector<Scalar = R>>(&self, state: &Self::State, lane: usize, value: V) -> V;

    /// The volume ratio (-) that a point keeps, and the one that tells its stiffness.
    fn opened<V: Vector<Scalar = R>>(&self, state: &Self::State, lane: usize, jacobian: V) -> (V, V);

    /// Lets the damage of yielding points grow and adds their work to `totals`; returns the work that heats
    /// (J/m3).
    fn grow<V: Vector<Scalar = R>>(
        &self,
        state: &mut Self::State,
        lane: usize,
        yielding: &Yielding<V>,
        elasticity: &Elasticity<R>,
        totals: &mut StepSums<V>,
    ) -> V;
}

/// No damage.
#[derive(Clone, Copy, Debug)]
pub struct Undamaged;

impl<R: Real> DamageEffect<R> for Undamaged {
    type State = ();

    fn place(&self, _state: &mut (), _lane: usize) {}

    fn report(&self, _state: &(), _lane: usize) -> f64 {
        0.0
    }

    #[inline(always)]
    fn carried<V: Vector<Scalar = R>>(&self, _state: &(), _lane: usize, whole: V) -> V {
        whole
    }

    #[inline(always)]
    fn carried_mean<V: Vector<Scalar = R>>(&self, _state: &(), _lane: usize, mean: V) -> V {
        mean
    }

    #[inline(always)]
    fn unless_failed<V: Vector<Scalar = R>>(&self, _state: &(), _lane: usize, value: V) -> V {
        value
    }

    #[inline(always)]
    fn opened<V: Vector<Scalar = R>>(&self, _state: &(), _lane: usize, jacobian: V) -> (V, V) {
        (jacobian, jacobian)
    }

    #[inline(always)]
    fn grow<V: Vector<Scalar = R>>(
        &self,
        _state: &mut (),
        _lane: usize,
        yielding: &Yielding<V>,
        _elasticity: &Elasticity<R>,
        totals: &mut StepSums<V>,
    ) -> V {
        totals.plastic_work = yielding.volume.mul_add(yielding.work, totals.plastic_work);
        yielding.work
    }
}

/// ω of each point until damage begins at 1, from there on 1 + D (-).
#[derive(Clone, Debug)]
pub struct Progress<R>(pub Column<R>);

impl<R: Real> PointState<R> for Progress<R> {
    const COLUMNS: usize = 1;
    fn zeroed() -> Self {
        Progress([R::ZERO; BLOCK])
    }
    fn column(&self, _k: usize) -> &Column<R> {
        &self.0
    }
    fn column_mut(&mut self, _k: usize) -> &mut Column<R> {
        &mut self.0
    }
}

/// Least failure strain (-): sets of constants exist that give none, or less, in strong tension.
const LEAST_STRAIN: f64 = 1e-3;

/// Volume ratio up to which a failed point remembers its opening (-).
const WIDEST: f64 = 2.0;

/// Johnson and Cook's damage with separation by fracture energy.
#[derive(Clone, Copy, Debug)]
pub struct JohnsonCookDamage<R> {
    /// d1 to d5 (-).
    constants: [R; 5],
    /// ε̇₀ (1/s).
    reference_rate: R,
    /// T_ref (K).
    reference: R,
    /// 1/(T_melt − T_ref) (1/K).
    inverse_range: R,
    /// L/(2 G_f) (m3/J).
    growth: R,
}

impl<R: Real> JohnsonCookDamage<R> {
    /// * `length`: L (m)
    /// * `rate`, `temperature`: whether the scene's flow stress knows these; if not, their terms are one
    pub fn new(c: &Constants, length: f64, rate: bool, temperature: bool) -> Self {
        let [d1, d2, d3, d4, d5] = c.damage;
        let constants = [d1, d2, d3, if rate { d4 } else { 0.0 }, if temperature { d5 } else { 0.0 }];
        JohnsonCookDamage {
            constants: constants.map(R::from_f64),
            reference_rate: R::from_f64(c.reference_rate),
            reference: R::from_f64(c.reference_temperature),
            inverse_range: R::from_f64(1.0 / (c.melting_temperature - c.reference_temperature)),
            growth: R::from_f64(0.5 * length / c.fracture_energy),
        }
    }

    /// D (-) of a progress (-).
    #[inline(always)]
    fn damage<V: Vector<Scalar = R>>(progress: V) -> V {
        (progress - V::constant(1.0)).max(V::constant(0.0))
    }

    /// ε_f (-).
    #[inline(always)]
    fn failure_strain<V: Vector<Scalar = R>>(&self, y: &Yielding<V>, mean: V) -> V {
        let one = V::constant(1.0);
        let zero = V::constant(0.0);
        let [d1, d2, d3, d4, d5] = self.constants;
        // One by one: a closure given to `map` need not be inlined.
        let (d1, d2, d3, d4, d5) = (V::splat(d1), V::splat(d2), V::splat(d3), V::splat(d4), V::splat(d5));
        let triaxiality = mean / y.flow.max(one);
        let relative = y.increment / V::splat(y.dt * self.reference_rate);
        let homologous =
            ((y.temperature - V::splat(self.reference)) * V::splat(self.inverse_range)).max(zero).min(one);
        let strain = d2.mul_add(exp(d3 * triaxiality), d1)
            * d4.mul_add(ln(relative.max(one)), one)
            * d5.mul_add(homologous, one);
        strain.max(V::constant(LEAST_STRAIN))
    }
}

impl<R: Real> DamageEffect<R> for JohnsonCookDamage<R> {
    type State = Progress<R>;

    fn place(&self, state: &mut Progress<R>, lane: usize) {
        state.0[lane] = R::ZERO;
    }

    fn report(&self, state: &Progress<R>, lane: usize) -> f64 {
        (state.0[lane].to_f64() - 1.0).max(0.0)
    }

    #[inline(always)]
    fn carried<V: Vector<Scalar = R>>(&self, state: &Progress<R>, lane: usize, whole: V) -> V {
        whole * (V::constant(1.0) - Self::damage(V::load(&state.0[lane..])))
    }

    #[inline(always)]
    fn carried_mean<V: Vector<Scalar = R>>(&self, state: &Progress<R>, lane: usize, mean: V) -> V {
        V::select(mean.gt(V::constant(0.0)), self.carried(state, lane, mean), mean)
    }

    #[inline(always)]
    fn unless_failed<V: Vector<Scalar = R>>(&self, state: &Progress<R>, lane: usize, value: V) -> V {
        let failed = V::load(&state.0[lane..]).ge(V::constant(2.0));
        V::select(failed, V::constant(0.0), value)
    }

    #[inline(always)]
    fn opened<V: Vector<Scalar = R>>(&self, state: &Progress<R>, lane: usize, jacobian: V) -> (V, V) {
        let failed = V::load(&state.0[lane..]).ge(V::constant(2.0));
        let kept = V::select(failed, jacobian.min(V::constant(WIDEST)), jacobian);
        (kept, V::select(failed, jacobian.min(V::constant(1.0)), jacobian))
    }

    #[inline(always)]
    fn grow<V: Vector<Scalar = R>>(
        &self,
        state: &mut Progress<R>,
        lane: usize,
        y: &Yielding<V>,
        elasticity: &Elasticity<R>,
        totals: &mut StepSums<V>,
    ) -> V {
        let one = V::constant(1.0);
        let zero = V::constant(0.0);
        let half = V::constant(0.5);
        let old = V::load(&state.0[lane..]);
        let step = y.increment / self.failure_strain(y, elasticity.mean_stress(y.jacobian));
        let sum = old + step;
        let started = sum.gt(one) & step.gt(zero);
        let before = Self::damage(old);
        if !started.any() {
            V::select(old.lt(one), sum, old).store(&mut state.0[lane..]);
            totals.plastic_work = y.volume.mul_add(y.work, totals.plastic_work);
            return y.work;
        }
        // The part of this return that follows initiation.
        let part = V::select(started, ((sum - one) / step).min(one), zero);
        let after = (V::splat(self.growth) * part).mul_add(y.work, before).min(one);
        V::select(started, one + after, sum).store(&mut state.0[lane..]);
        let plastic = y.work * (one - part);
        // ∫ (1 − D) σ_y dε̄ over dD = σ_y dε̄ L/(2 G_f).
        let fracture = (after - before) * (one - half * (before + after)) / V::splat(self.growth);
        let distortion = y.flow * y.flow / V::splat(elasticity.shear_modulus * R::from_f64(6.0));
        let released = (after - before) * (distortion + elasticity.stretching_energy(y.jacobian));
        totals.plastic_work = y.volume.mul_add(plastic, totals.plastic_work);
        totals.damage_work = y.volume.mul_add(fracture + released, totals.damage_work);
        plastic + fracture
    }
}
