//! Finite-deformation J2 plasticity with any flow law.
//!
//! Elasticity: `elasticity`. With thermal expansion its J is the elastic part, det F over the (1 + α (T −
//! T₀))³ that heat alone would give; it shrinks whenever the temperature rises, so that points whose
//! temperature stays take no notice.
//!
//! Plasticity: the equivalent stress q = √(3/2 s:s) stays below the flow stress σ_y(ε̄, ε̄̇, T) (`flow_law`;
//! eq. 24 of Ambati et al. 2011 for Johnson and Cook's). Radial return: `return_mapping`. Damage, where the
//! scene names it, takes its share of what the undamaged material would carry (`damage`): the state below is
//! that of the undamaged material.
//!
//! A point keeps the flow stress at rest, for Johnson and Cook (A + B ε̄ⁿ) S(T), so that elastic points only
//! compare with it. Yield and plastic work are those of the Kirchhoff stress; J differs from one by the
//! elastic change of volume alone.

use super::damage::{DamageEffect, Undamaged};
use super::effects::ThermalEffect;
use super::elasticity::Elasticity;
use super::flow_law::FlowLaw;
use super::return_mapping::Return;
use super::{ConstitutiveModel, PointReport, StepSums};
use crate::dimension::Dimension;
use crate::points::{BLOCK, Column, PointState};
use crate::scene::Constants;
use crate::simd::{Mask, Real, Vector, inlined};

/// Elastic constants, flow law and damage, as the kernel takes them.
#[derive(Clone, Copy, Debug)]
pub struct J2Plasticity<R, L, G = Undamaged> {
    density: f64,
    elasticity: Elasticity<R>,
    law: L,
    damage: G,
}

impl<R: Real, L: FlowLaw<R>> J2Plasticity<R, L> {
    /// The undamaged model of a material's elasticity and a flow law.
    pub fn new(constants: &Constants, law: L) -> Self {
        Self::with(constants, law, Undamaged)
    }
}

impl<R: Real, L: FlowLaw<R>, G: DamageEffect<R>> J2Plasticity<R, L, G> {
    /// The model of a material's elasticity, a flow law and a damage.
    pub fn with(constants: &Constants, law: L, damage: G) -> Self {
        J2Plasticity { density: constants.density, elasticity: Elasticity::new(constants), law, damage }
    }
}

/// What the thermal part of a law keeps of a block.
type ThermalState<L, R> = <<L as FlowLaw<R>>::Thermal as ThermalEffect<R>>::State;

/// State of a block of points.
#[derive(Clone, Debug)]
pub struct State<R: Real, D: Dimension, T, G = ()> {
    /// Elastic volume ratio J_e (-): det F over what heat alone would give.
    pub jacobian: Column<R>,
    /// Deviator of the Kirchhoff stress (Pa).
    pub deviator: D::Deviator<Column<R>>,
    /// Equivalent plastic strain ε̄ (-).
    pub plastic_strain: Column<R>,
    /// Flow stress at rest (Pa).
    pub yield_stress: Column<R>,
    /// What the thermal effect keeps.
    pub thermal: T,
    /// What the damage keeps.
    pub damage: G,
}

impl<R: Real, D: Dimension, T: PointState<R>, G: PointState<R>> PointState<R> for State<R, D, T, G> {
    const COLUMNS: usize = 3 + D::DEVIATOR + T::COLUMNS + G::COLUMNS;

    fn zeroed() -> Self {
        State {
            jacobian: [R::ONE; BLOCK],
            deviator: D::deviator(|_| [R::ZERO; BLOCK]),
            plastic_strain: [R::ZERO; BLOCK],
            yield_stress: [R::ONE; BLOCK],
            thermal: T::zeroed(),
            damage: G::zeroed(),
        }
    }

    fn column(&self, k: usize) -> &Column<R> {
        match k {
            0 => &self.jacobian,
            1 => &self.plastic_strain,
            2 => &self.yield_stress,
            k if k < 3 + D::DEVIATOR => &self.deviator[k - 3],
            k if k < 3 + D::DEVIATOR + T::COLUMNS => self.thermal.column(k - 3 - D::DEVIATOR),
            k => self.damage.column(k - 3 - D::DEVIATOR - T::COLUMNS),
        }
    }

    fn column_mut(&mut self, k: usize) -> &mut Column<R> {
        match k {
            0 => &mut self.jacobian,
            1 => &mut self.plastic_strain,
            2 => &mut self.yield_stress,
            k if k < 3 + D::DEVIATOR => &mut self.deviator[k - 3],
            k if k < 3 + D::DEVIATOR + T::COLUMNS => self.thermal.column_mut(k - 3 - D::DEVIATOR),
            k => self.damage.column_mut(k - 3 - D::DEVIATOR - T::COLUMNS),
        }
    }
}

impl<R: Real, D: Dimension, L: FlowLaw<R>, G: DamageEffect<R>> ConstitutiveModel<R, D>
    for J2Plasticity<R, L, G>
{
    type State = State<R, D, ThermalState<L, R>, G::State>;

    fn density(&self) -> f64 {
        self.density
    }

    fn set_density(&mut self, density: f64) {
        self.density = density;
    }

    fn sound_speed(&self, volume_ratio: f64) -> f64 {
        self.elasticity.sound_speed(volume_ratio, self.density)
    }

    fn yield_volume_strain(&self) -> f64 {
        (self.law.yield_stress() / self.elasticity.bulk_modulus).to_f64()
    }

    fn yield_speed(&self) -> f64 {
        let impedance = self.density * self.elasticity.sound_speed(1.0, self.density);
        self.law.yield_stress().to_f64() / impedance
    }

    /// At rest, or the equivalent stress where that is higher: a point that yields stands at its flow stress,
    /// rate included.
    fn flow_stress(&self, state: &Self::State, lane: usize) -> f64 {
        let s = D::deviator(|component| state.deviator[component][lane].to_f64());
        let q = (1.5 * contraction::<D>(&s)).sqrt();
        let left = 1.0 - self.damage.report(&state.damage, lane);
        left * q.max(state.yield_stress[lane].to_f64())
            / ConstitutiveModel::<R, D>::present_volume_ratio(self, state, lane)
    }

    fn place(&self, state: &mut Self::State, lane: usize, temperature: f64) {
        state.jacobian[lane] = R::ONE;
        state.plastic_strain[lane] = R::ZERO;
        for component in 0..D::DEVIATOR {
            state.deviator[component][lane] = R::ZERO;
        }
        state.yield_stress[lane] = self.law.at_rest(R::ZERO, temperature);
        self.damage.place(&mut state.damage, lane);
        self.law.thermal().place(&mut state.thermal, lane, temperature);
    }

    #[inline(always)]
    fn stress<V: Vector<Scalar = R>>(&self, state: &Self::State, lane: usize) -> D::Symmetric<V> {
        let s = inlined!(D::deviator, |component| V::load(&state.deviator[component][lane..]));
        self.carried::<D, V>(state, lane, &s, V::load(&state.jacobian[lane..]))
    }

    #[inline(always)]
    fn update<V: Vector<Scalar = R>>(
        &self,
        state: &mut Self::State,
        lane: usize,
        h: &D::Matrix<V>,
        dt: R,
        volume: V,
        totals: &mut StepSums<V>,
    ) -> D::Symmetric<V> {
        let increment = D::increment(h);
        let jacobian = V::load(&state.jacobian[lane..]) * increment.volume_ratio;
        let (mut jacobian, stiff) = self.damage.opened(&state.damage, lane, jacobian);
        jacobian.store(&mut state.jacobian[lane..]);
        totals.volume_ratio = totals.volume_ratio.max(stiff);

        let two_mu = V::splat(self.elasticity.shear_modulus + self.elasticity.shear_modulus);
        let old = inlined!(D::deviator, |component| V::load(&state.deviator[component][lane..]));
        let turned = D::rotate(&increment.rotation, old);
        let mut s = inlined!(D::deviator, |k| two_mu.mul_add(increment.deviatoric_strain[k], turned[k]));

        let square = V::constant(1.5) * D::double_contraction(&s);
        let strength = V::load(&state.yield_stress[lane..]);
        let yields = square.gt(strength * strength);
        if yields.any() {
            let strain = D::double_contraction(&increment.deviatoric_strain);
            let start = V::constant(1.5) * D::double_contraction(&turned);
            let factor = V::outlined(Return {
                elasticity: &self.elasticity,
                law: &self.law,
                damage_law: &self.damage,
                lane,
                plastic_strain: &mut state.plastic_strain,
                yield_stress: &mut state.yield_stress,
                jacobian: &mut state.jacobian,
                thermal: &mut state.thermal,
                damage: &mut state.damage,
                yields,
                squares: [start, square],
                strain_square: strain,
                dt,
                volume,
                totals,
            });
            s = inlined!(D::deviator, |component| s[component] * factor);
            if self.law.thermal().expands() {
                jacobian = V::load(&state.jacobian[lane..]);
            }
        }
        for component in 0..D::DEVIATOR {
            s[component] = self.damage.unless_failed(&state.damage, lane, s[component]);
            s[component].store(&mut state.deviator[component][lane..]);
        }
        self.carried::<D, V>(state, lane, &s, jacobian)
    }

    fn volume_ratio(&self, state: &Self::State, lane: usize) -> f64 {
        let j = state.jacobian[lane].to_f64();
        if self.has_failed::<D>(state, lane) { j.min(1.0) } else { j }
    }

    fn set_volume_ratio(&self, state: &mut Self::State, lane: usize, volume_ratio: f64) -> f64 {
        if self.has_failed::<D>(state, lane) {
            return 0.0;
        }
        let old = self.volume_energy::<D>(state, lane);
        state.jacobian[lane] = R::from_f64(volume_ratio);
        old - self.volume_energy::<D>(state, lane)
    }

    fn temperature(&self, state: &Self::State, lane: usize) -> f64 {
        self.law.thermal().temperature(&state.thermal, lane)
    }

    fn present_volume_ratio(&self, state: &Self::State, lane: usize) -> f64 {
        let temperature = self.law.thermal().temperature(&state.thermal, lane);
        state.jacobian[lane].to_f64() * self.law.thermal().thermal_volume_ratio(temperature)
    }

    fn expands(&self) -> bool {
        self.law.thermal().expands()
    }

    fn set_temperature(&self, state: &mut Self::State, lane: usize, temperature: f64) -> f64 {
        let ratio = |state: &Self::State| {
            self.law.thermal().thermal_volume_ratio(self.law.thermal().temperature(&state.thermal, lane))
        };
        let old = ratio(state);
        self.law.thermal().place(&mut state.thermal, lane, temperature);
        state.yield_stress[lane] = self.law.at_rest(state.plastic_strain[lane], temperature);
        if !self.law.thermal().expands() {
            return 0.0;
        }
        let elastic = state.jacobian[lane].to_f64() * old / ratio(state);
        ConstitutiveModel::<R, D>::set_volume_ratio(self, state, lane, elastic)
    }

    fn report(&self, state: &Self::State, lane: usize) -> PointReport {
        let j = state.jacobian[lane].to_f64();
        let (temperature, heat) = self.law.thermal().report(&state.thermal, lane);
        let total = j * self.law.thermal().thermal_volume_ratio(temperature);
        let s = D::deviator(|component| state.deviator[component][lane].to_f64());
        let (bulk, shear) = (self.elasticity.bulk_modulus.to_f64(), self.elasticity.shear_modulus.to_f64());
        let damage = self.damage.report(&state.damage, lane);
        let left = 1.0 - damage;
        let mean = 0.5 * bulk * (j * j - 1.0) * if j > 1.0 { left } else { 1.0 };
        let diagonal = [s[0], s[1], -s[0] - s[1]];
        let shears: &[f64] = &s.as_ref()[2..];
        let contraction = contraction::<D>(&s);
        let mut stress = [0.0; 6];
        for k in 0..3 {
            stress[k] = (left * diagonal[k] + mean) / total;
        }
        for (component, value) in stress[6 - shears.len()..].iter_mut().zip(shears) {
            *component = left * value / total;
        }
        PointReport {
            jacobian: total,
            stress,
            plastic_strain: state.plastic_strain[lane].to_f64(),
            temperature,
            elastic_energy: self.volume_energy::<D>(state, lane) + left * contraction / (4.0 * shear),
            heat,
            damage,
        }
    }
}

impl<R: Real, L: FlowLaw<R>, G: DamageEffect<R>> J2Plasticity<R, L, G> {
    /// Kirchhoff stress (Pa) that points `lane..` carry of the undamaged deviator `s` (Pa) at their volume
    /// ratio.
    #[inline(always)]
    fn carried<D: Dimension, V: Vector<Scalar = R>>(
        &self,
        state: &State<R, D, ThermalState<L, R>, G::State>,
        lane: usize,
        s: &D::Deviator<V>,
        jacobian: V,
    ) -> D::Symmetric<V> {
        let s = inlined!(D::deviator, |component| self.damage.carried(&state.damage, lane, s[component]));
        let mean = self.elasticity.mean_stress(jacobian);
        D::with_mean(&s, self.damage.carried_mean(&state.damage, lane, mean))
    }

    /// Elastic energy (J/m3) of a point's change of volume.
    fn volume_energy<D: Dimension>(
        &self,
        state: &State<R, D, ThermalState<L, R>, G::State>,
        lane: usize,
    ) -> f64 {
        let j = state.jacobian[lane].to_f64();
        let left = if j > 1.0 { 1.0 - self.damage.report(&state.damage, lane) } else { 1.0 };
        left * self.elasticity.volume_energy(j)
    }

    /// Whether a point carries nothing but pressure.
    fn has_failed<D: Dimension>(
        &self,
        state: &State<R, D, ThermalState<L, R>, G::State>,
        lane: usize,
    ) -> bool {
        self.damage.report(&state.damage, lane) >= 1.0
    }
}

/// s : s of a point's deviator.
fn contraction<D: Dimension>(s: &D::Deviator<f64>) -> f64 {
    let diagonal = [s[0], s[1], -s[0] - s[1]];
    let shears: &[f64] = &s.as_ref()[2..];
    diagonal.iter().map(|x| x * x).sum::<f64>() + 2.0 * shears.iter().map(|x| x * x).sum::<f64>()
}
