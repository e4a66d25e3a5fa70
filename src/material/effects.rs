//! Temperature in the flow stress, with twins that do less.
//!
//! A type parameter of the flow law: what a scene does not name costs no array and no power.

use crate::points::{BLOCK, Column, PointState};
use crate::scene::Constants;
use crate::simd::math::pow;
use crate::simd::{Real, Vector};

/// Temperature of the points and its effect on the flow stress.
pub trait ThermalEffect<R: Real>: Clone + Send + Sync + 'static {
    /// What it keeps per point.
    type State: PointState<R>;

    /// Sets a point's temperature (K).
    fn place(&self, state: &mut Self::State, lane: usize, temperature: f64);

    /// Temperature (K) of a point.
    fn temperature(&self, state: &Self::State, lane: usize) -> f64 {
        self.report(state, lane).0
    }

    /// Temperature (K) of a point, and heat stored since the start per volume at the start (J/m3).
    fn report(&self, state: &Self::State, lane: usize) -> (f64, f64);

    /// Rise of temperature (K) by plastic work per volume at the start (J/m3).
    fn rise<V: Vector<Scalar = R>>(&self, work: V) -> V;

    /// Temperature (K) of points `lane..` after a rise of `rise` (K).
    fn temperature_after<V: Vector<Scalar = R>>(&self, state: &Self::State, lane: usize, rise: V) -> V;

    /// Whether the flow stress feels a rise of temperature.
    const SOFTENS: bool;

    /// Factor on the flow stress (-) when the temperature rises by `rise` (K), and its first two derivatives
    /// (1/K, 1/K²).
    fn factor<V: Vector<Scalar = R>>(&self, state: &Self::State, lane: usize, rise: V) -> [V; 3];

    /// Factor on the flow stress at the start temperature of a point (-).
    fn static_factor(&self, temperature: f64) -> f64;

    /// Whether heat makes the material expand.
    fn expands(&self) -> bool {
        false
    }

    /// Factor on the elastic volume ratio (-) when the temperature of points `lane..` rises by `rise` (K):
    /// what heat stretches is taken off the elastic part.
    fn contraction<V: Vector<Scalar = R>>(&self, _state: &Self::State, _lane: usize, _rise: V) -> V {
        V::constant(1.0)
    }

    /// Volume ratio (-) that heat alone would give a point of a temperature (K).
    fn thermal_volume_ratio(&self, _temperature: f64) -> f64 {
        1.0
    }

    /// Adds `rise` (K) to the points' temperature.
    fn heat<V: Vector<Scalar = R>>(&self, state: &mut Self::State, lane: usize, rise: V);
}

/// Constants of Johnson and Cook's thermal softening S = 1 − T*ᵐ, T* = (T − T_ref)/(T_melt − T_ref) within
/// \[0, 1\].
///
/// Below the reference temperature S = 1; at and above melting S = 0: no shear strength and no plastic work,
/// hence no further heating, while the pressure stays elastic.
#[derive(Clone, Copy, Debug)]
pub struct Softening {
    /// m (-); 0 for no softening.
    pub exponent: f64,
    /// T_ref (K).
    pub reference: f64,
    /// T_melt (K).
    pub melting: f64,
}

impl Softening {
    /// A material's.
    pub fn of(constants: &Constants) -> Self {
        Softening {
            exponent: constants.thermal_exponent,
            reference: constants.reference_temperature,
            melting: constants.melting_temperature,
        }
    }

    /// S at a temperature (K).
    pub fn factor(&self, temperature: f64) -> f64 {
        let homologous = ((temperature - self.reference) / (self.melting - self.reference)).clamp(0.0, 1.0);
        1.0 - homologous.powf(self.exponent)
    }
}

/// One temperature for good: softening, if any, is a constant factor and no temperature is kept.
#[derive(Clone, Copy, Debug)]
pub struct Isothermal {
    /// The temperature (K).
    pub temperature: f64,
    /// Softening at that temperature, if the scene names it.
    pub softening: Option<Softening>,
}

impl<R: Real> PointState<R> for () {
    const COLUMNS: usize = 0;
    fn zeroed() -> Self {}
    fn column(&self, k: usize) -> &Column<R> {
        unreachable!("column {k} of an empty state")
    }
    fn column_mut(&mut self, k: usize) -> &mut Column<R> {
        unreachable!("column {k} of an empty state")
    }
}

impl<R: Real> ThermalEffect<R> for Isothermal {
    type State = ();
    const SOFTENS: bool = false;

    fn place(&self, _state: &mut (), _lane: usize, _temperature: f64) {}

    fn report(&self, _state: &(), _lane: usize) -> (f64, f64) {
        (self.temperature, 0.0)
    }

    #[inline(always)]
    fn rise<V: Vector<Scalar = R>>(&self, _work: V) -> V {
        V::constant(0.0)
    }

    #[inline(always)]
    fn temperature_after<V: Vector<Scalar = R>>(&self, _state: &(), _lane: usize, _rise: V) -> V {
        V::constant(self.temperature)
    }

    #[inline(always)]
    fn factor<V: Vector<Scalar = R>>(&self, _state: &(), _lane: usize, _rise: V) -> [V; 3] {
        let zero = V::constant(0.0);
        [V::constant(ThermalEffect::<R>::static_factor(self, self.temperature)), zero, zero]
    }

    fn static_factor(&self, _temperature: f64) -> f64 {
        self.softening.map_or(1.0, |softening| softening.factor(self.temperature))
    }

    #[inline(always)]
    fn heat<V: Vector<Scalar = R>>(&self, _state: &mut (), _lane: usize, _rise: V) {}
}

/// The points' temperatures (K).
#[derive(Clone, Debug)]
pub struct Temperature<R>(pub Column<R>);

impl<R: Real> PointState<R> for Temperature<R> {
    const COLUMNS: usize = 1;
    fn zeroed() -> Self {
        Temperature([R::ZERO; BLOCK])
    }
    fn column(&self, _k: usize) -> &Column<R> {
        &self.0
    }
    fn column_mut(&mut self, _k: usize) -> &mut Column<R> {
        &mut self.0
    }
}

/// Plastic work heats each point (eq. 25 of Ambati et al. 2011) and nothing flows; `SOFTENS` says whether the
/// flow stress feels it.
#[derive(Clone, Copy, Debug)]
pub struct Adiabatic<R, const SOFTENS: bool> {
    /// β/(ρ₀ c): rise of temperature per plastic work (K m3/J).
    rise_per_work: R,
    /// ρ₀ c (J/(m3 K)).
    heat_capacity: f64,
    /// Temperature at the start (K).
    initial: f64,
    exponent: R,
    reference: R,
    inverse_range: R,
    softening: Softening,
    /// α (1/K), 0 for no expansion, and the start temperature it counts from (K).
    expansion: R,
    unstretched: R,
}

impl<R: Real, const SOFTENS: bool> Adiabatic<R, SOFTENS> {
    /// * `taylor_quinney`: β (-)
    /// * `heat_capacity`: ρ₀ c (J/(m3 K))
    /// * `initial`: temperature at the start (K), from which stored heat counts
    pub fn new(taylor_quinney: f64, heat_capacity: f64, initial: f64, softening: Softening) -> Self {
        Adiabatic {
            rise_per_work: R::from_f64(taylor_quinney / heat_capacity),
            heat_capacity,
            initial,
            exponent: R::from_f64(softening.exponent),
            reference: R::from_f64(softening.reference),
            inverse_range: R::from_f64(1.0 / (softening.melting - softening.reference)),
            softening,
            expansion: R::ZERO,
            unstretched: R::from_f64(initial),
        }
    }

    /// A material that does not expand; `initial` is its temperature at the start (K).
    pub fn of(c: &Constants, initial: f64) -> Self {
        Self::new(c.taylor_quinney, c.density * c.specific_heat, initial, Softening::of(c))
    }

    /// The same with linear thermal expansion: every length grows by 1 + α (T − T₀) from the temperature at
    /// the start.
    ///
    /// * `expansion`: α (1/K)
    pub fn with_expansion(self, expansion: f64) -> Self {
        Adiabatic { expansion: R::from_f64(expansion), ..self }
    }
}

impl<R: Real, const SOFTENS: bool> ThermalEffect<R> for Adiabatic<R, SOFTENS> {
    type State = Temperature<R>;
    const SOFTENS: bool = SOFTENS;

    fn place(&self, state: &mut Temperature<R>, lane: usize, temperature: f64) {
        state.0[lane] = R::from_f64(temperature);
    }

    fn report(&self, state: &Temperature<R>, lane: usize) -> (f64, f64) {
        let temperature = state.0[lane].to_f64();
        (temperature, self.heat_capacity * (temperature - self.initial))
    }

    #[inline(always)]
    fn rise<V: Vector<Scalar = R>>(&self, work: V) -> V {
        V::splat(self.rise_per_work) * work
    }

    #[inline(always)]
    fn temperature_after<V: Vector<Scalar = R>>(&self, state: &Temperature<R>, lane: usize, rise: V) -> V {
        V::load(&state.0[lane..]) + rise
    }

    #[inline(always)]
    fn factor<V: Vector<Scalar = R>>(&self, state: &Temperature<R>, lane: usize, rise: V) -> [V; 3] {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        if !SOFTENS {
            return [one, zero, zero];
        }
        let inverse_range = V::splat(self.inverse_range);
        let temperature = V::load(&state.0[lane..]) + rise;
        let homologous = ((temperature - V::splat(self.reference)) * inverse_range).max(zero).min(one);
        let m = V::splat(self.exponent);
        let power = pow(homologous, m);
        // d(T*ᵐ)/dT = m T*ᵐ/T*/(T_melt − T_ref). The return's last step is taken by it unseen, so the guard
        // against T* = 0 is far below any rise of temperature.
        let per_kelvin = inverse_range / homologous.max(V::constant(1e-30));
        let slope = m * power * per_kelvin;
        [one - power, -slope, (one - m) * slope * per_kelvin]
    }

    fn static_factor(&self, temperature: f64) -> f64 {
        if SOFTENS { self.softening.factor(temperature) } else { 1.0 }
    }

    #[inline(always)]
    fn expands(&self) -> bool {
        self.expansion != R::ZERO
    }

    #[inline(always)]
    fn contraction<V: Vector<Scalar = R>>(&self, state: &Temperature<R>, lane: usize, rise: V) -> V {
        let alpha = V::splat(self.expansion);
        let before = V::load(&state.0[lane..]) - V::splat(self.unstretched);
        let stretch = alpha.mul_add(before + rise, V::constant(1.0));
        // The ratio of the stretches, written so that small rises keep their digits.
        let ratio = V::constant(1.0) - alpha * rise / stretch;
        ratio * ratio * ratio
    }

    fn thermal_volume_ratio(&self, temperature: f64) -> f64 {
        (1.0 + self.expansion.to_f64() * (temperature - self.initial)).powi(3)
    }

    #[inline(always)]
    fn heat<V: Vector<Scalar = R>>(&self, state: &mut Temperature<R>, lane: usize, rise: V) {
        (V::load(&state.0[lane..]) + rise).store(&mut state.0[lane..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::testing::{Double as V, first};

    /// Softening runs from one at the reference temperature to zero at melting and stays there; nothing is
    /// stiffer when cold.
    #[test]
    fn softening_is_capped_below_and_above() {
        let softening = Softening { exponent: 1.03, reference: 298.15, melting: 1573.15 };
        for (temperature, factor) in [(77.0, 1.0), (298.15, 1.0), (1573.15, 0.0), (4000.0, 0.0)] {
            let effect = Adiabatic::<f64, true>::new(0.9, 3.76e6, temperature, softening);
            let mut state = Temperature::zeroed();
            for lane in 0..8 {
                effect.place(&mut state, lane, temperature);
            }
            let [kernel, ..] = effect.factor(&state, 0, V::constant(0.0));
            assert_eq!(
                (first(kernel), softening.factor(temperature)),
                (factor, factor),
                "at {temperature} K"
            );
        }
    }

    /// Both derivatives are those of the factor the same kernel gives.
    #[test]
    fn softening_slopes_match_central_differences() {
        let softening = Softening { exponent: 1.03, reference: 298.15, melting: 1573.15 };
        let effect = Adiabatic::<f64, true>::new(0.9, 3.76e6, 298.15, softening);
        for temperature in [300.0, 500.0, 1000.0, 1570.0] {
            let state = Temperature([temperature; BLOCK]);
            let at = |rise: f64| effect.factor(&state, 0, V::splat(rise)).map(first);
            let [below, here, above] = [-0.01, 0.0, 0.01].map(at);
            for (order, bound) in [(0, 1e-5), (1, 2e-5)] {
                let difference = (above[order] - below[order]) / 0.02;
                let slope = here[order + 1];
                // Step² times the second next derivative: 2e-7 and 9e-6 of the slope this close to the
                // reference temperature.
                assert!(
                    (slope - difference).abs() < bound * slope.abs(),
                    "derivative {} is {slope}, by differences {difference}, at {temperature} K",
                    order + 1
                );
            }
        }
    }

    /// Plastic work becomes heat by the Taylor–Quinney share, and the heat reported is what was put in.
    #[test]
    fn plastic_work_heats_by_its_share() {
        let softening = Softening { exponent: 1.0, reference: 298.15, melting: 1573.15 };
        let effect = Adiabatic::<f64, false>::new(0.9, 3.76e6, 300.0, softening);
        let mut state = Temperature([300.0; BLOCK]);
        let rise = effect.rise(V::constant(5e8));
        effect.heat(&mut state, 0, rise);
        let (temperature, heat) = effect.report(&state, 0);
        assert!((temperature - 300.0 - 0.9 * 5e8 / 3.76e6).abs() < 1e-10, "temperature {temperature} K");
        assert!((heat - 0.9 * 5e8).abs() < 1e-3, "heat {heat} J/m3");
    }
}
