//! How strength grows, and falls, with plastic strain in the laws that are a product (`multiplicative`).
//!
//! Both are a strength that hardens with strain times a softening factor; rate multiplies either (`rate`):
//!
//! * Johnson and Cook (1983): (A + B ε̄ⁿ) S(T), S = 1 − T*ᵐ;
//! * Sima and Özel (2010), the "tanh" law for titanium, which softens with strain as well:
//!
//!   (A + B ε̄ⁿ exp(−ε̄ᵃ)) S(T) \[D + (1 − D) tanhˢ(1/(ε̄ + p)ᶜ)\],  D = 1 − (T/T_melt)ᵈ,  p = (T/T_melt)ᵇ,
//!
//!   with both temperatures absolute.
//!
//! Sima and Özel, Int. J. Mach. Tools Manuf. 50 (2010) 943–960, doi:10.1016/j.ijmachtools.2010.08.004, give
//! several variants; this is the one with exponents a, b, c, d and s, in the form read in mfree_iwf (ETH
//! Zurich; class `johnson_cook_Sima_2010`, used by Afrasiabi et al. 2019,
//! doi:10.1016/j.ijmecsci.2019.06.045). Below the reference rate the factor of the rate is 1 here, as in the
//! other law; mfree_iwf has (1 + ε̄̇/ε̇₀)^C there.

use super::effects::ThermalEffect;
use super::flow_law::least;
use crate::scene::Constants;
use crate::simd::math::{exp, ln, pow};
use crate::simd::{Real, Vector};

/// Strength without rate, taken apart as the radial return needs it.
#[derive(Clone, Copy, Debug)]
pub struct Strength<V> {
    /// Strength without softening (Pa).
    pub hardened: V,
    /// Derivative of the strength with respect to plastic strain, over the softening factor (Pa).
    pub slope: V,
    /// The second derivative (Pa).
    pub curvature: V,
    /// Softening factor (-); the strength is `hardened * softening`.
    pub softening: V,
    /// Derivative of that factor with respect to temperature (1/K).
    pub softening_slope: V,
    /// The second derivative (1/K²).
    pub softening_curvature: V,
}

/// A law of strength over plastic strain and temperature.
pub trait Hardening<R: Real>: Clone + Send + Sync + 'static {
    /// Whether `strength` gives second derivatives; else they are 0.
    const CURVES: bool;

    /// The law with a material's constants.
    fn new(constants: &Constants) -> Self;

    /// A (Pa).
    fn yield_stress(&self) -> R;

    /// Strength without rate (Pa).
    ///
    /// * `plastic_strain`: ε̄ (-), at least 0
    /// * `temperature`: T (K)
    /// * `softening`: S(T) (-)
    fn at_rest(&self, plastic_strain: R, temperature: f64, softening: R) -> R;

    /// About the plastic strain (-) at which hardening alone carries the trial stress: a first guess from
    /// above of where a return ends whose strain grows by a multiple.
    ///
    /// * `plastic_strain`: ε̄ (-) at the start
    /// * `at_rest`: strength without rate there (Pa), above 0
    /// * `trial`: equivalent stress if nothing yielded (Pa)
    fn carrying<V: Vector<Scalar = R>>(&self, plastic_strain: V, at_rest: V, trial: V) -> V;

    /// Strength without rate of points `lane..` at a plastic strain (-), above 0, when their temperature
    /// rises by `rise` (K).
    fn strength<V: Vector<Scalar = R>, T: ThermalEffect<R>>(
        &self,
        strain: V,
        thermal: &T,
        state: &T::State,
        lane: usize,
        rise: V,
    ) -> Strength<V>;
}

/// A + B ε̄ⁿ.
#[derive(Clone, Copy, Debug)]
pub struct PowerLaw<R> {
    /// A (Pa).
    yield_stress: R,
    /// B (Pa).
    modulus: R,
    /// n (-).
    exponent: R,
}

impl<R: Real> PowerLaw<R> {
    /// B ε̄ⁿ (Pa) at rest, in double precision: 0ⁿ is 1 for n = 0 and 0 for n > 0.
    fn growth(&self, plastic_strain: R) -> R {
        self.modulus * R::from_f64(plastic_strain.to_f64().powf(self.exponent.to_f64()))
    }
}

impl<R: Real> Hardening<R> for PowerLaw<R> {
    const CURVES: bool = true;

    fn new(constants: &Constants) -> Self {
        PowerLaw {
            yield_stress: R::from_f64(constants.yield_stress),
            modulus: R::from_f64(constants.hardening_modulus),
            exponent: R::from_f64(constants.hardening_exponent),
        }
    }

    fn yield_stress(&self) -> R {
        self.yield_stress
    }

    fn at_rest(&self, plastic_strain: R, _temperature: f64, softening: R) -> R {
        (self.yield_stress + self.growth(plastic_strain)) * softening
    }

    /// Softening is taken to stay as it was.
    #[inline(always)]
    fn carrying<V: Vector<Scalar = R>>(&self, plastic_strain: V, at_rest: V, trial: V) -> V {
        if self.modulus <= R::ZERO || self.exponent <= R::ZERO {
            return V::constant(f64::from(f32::MAX));
        }
        let first = V::splat(self.yield_stress);
        let before = V::splat(self.modulus) * pow(plastic_strain, V::splat(self.exponent));
        // Softening is what the strength of the start is short of the law's without it.
        let growth = before + (first + before) * ((trial - at_rest) / at_rest);
        pow(growth.max(V::constant(0.0)) / V::splat(self.modulus), V::splat(R::ONE / self.exponent))
    }

    #[inline(always)]
    fn strength<V: Vector<Scalar = R>, T: ThermalEffect<R>>(
        &self,
        strain: V,
        thermal: &T,
        state: &T::State,
        lane: usize,
        rise: V,
    ) -> Strength<V> {
        let n = V::splat(self.exponent);
        let power = V::splat(self.modulus) * pow(strain, n);
        let [softening, softening_slope, softening_curvature] = thermal.factor(state, lane, rise);
        let per_strain = V::constant(1.0) / strain.max(least());
        let slope = n * power * per_strain;
        Strength {
            hardened: V::splat(self.yield_stress) + power,
            slope,
            curvature: (n - V::constant(1.0)) * slope * per_strain,
            softening,
            softening_slope,
            softening_curvature,
        }
    }
}

/// Least tanh that is divided by (-).
const TINY: f64 = 1e-30;

/// Least T/T_melt, whose logarithm is taken (-).
const COLDEST: f64 = 1e-3;

/// Sima and Özel's law.
#[derive(Clone, Copy, Debug)]
pub struct TanhLaw<R> {
    power: PowerLaw<R>,
    /// a (-).
    decay: R,
    /// b (-).
    shift: R,
    /// c (-).
    reach: R,
    /// d (-).
    onset: R,
    /// s (-).
    sharpness: R,
    /// One over T_melt (1/K).
    inverse_melting: R,
}

impl<R: Real> Hardening<R> for TanhLaw<R> {
    const CURVES: bool = false;

    fn new(constants: &Constants) -> Self {
        let [decay, shift, reach, onset, sharpness] = constants.tanh.map(R::from_f64);
        TanhLaw {
            power: PowerLaw::new(constants),
            decay,
            shift,
            reach,
            onset,
            sharpness,
            inverse_melting: R::from_f64(1.0 / constants.melting_temperature),
        }
    }

    fn yield_stress(&self) -> R {
        self.power.yield_stress
    }

    fn at_rest(&self, plastic_strain: R, temperature: f64, softening: R) -> R {
        let [a, b, c, d, s] = [self.decay, self.shift, self.reach, self.onset, self.sharpness].map(R::to_f64);
        let strain = plastic_strain.to_f64();
        let relative = (temperature * self.inverse_melting.to_f64()).clamp(COLDEST, 1.0);
        let loss = relative.powf(d);
        let tanh = (strain + relative.powf(b)).powf(-c).tanh();
        let factor = 1.0 - loss * (1.0 - tanh.powf(s));
        let growth = self.power.growth(plastic_strain) * R::from_f64((-strain.powf(a)).exp());
        (self.power.yield_stress + growth) * softening * R::from_f64(factor)
    }

    /// By the power alone, of which the other factors leave almost everything where strain is small.
    #[inline(always)]
    fn carrying<V: Vector<Scalar = R>>(&self, plastic_strain: V, at_rest: V, trial: V) -> V {
        self.power.carrying(plastic_strain, at_rest, trial)
    }

    #[inline(always)]
    fn strength<V: Vector<Scalar = R>, T: ThermalEffect<R>>(
        &self,
        strain: V,
        thermal: &T,
        state: &T::State,
        lane: usize,
        rise: V,
    ) -> Strength<V> {
        let one = V::constant(1.0);
        let (n, a) = (V::splat(self.power.exponent), V::splat(self.decay));
        let (b, c) = (V::splat(self.shift), V::splat(self.reach));
        let (d, s) = (V::splat(self.onset), V::splat(self.sharpness));
        // Of zero it is finite, and its powers are nothing: next to first yield any least strain would count.
        let log_strain = ln(strain);
        let exponent = exp(a * log_strain);
        let growth = V::splat(self.power.modulus) * exp(n * log_strain - exponent);
        let hardened = V::splat(self.power.yield_stress) + growth;

        let temperature = thermal.temperature_after(state, lane, rise);
        let relative = (temperature * V::splat(self.inverse_melting)).max(V::constant(COLDEST)).min(one);
        let log_relative = ln(relative);
        // 1 − D and p.
        let loss = exp(d * log_relative);
        let p = exp(b * log_relative);
        let shifted = strain + p;
        let y = exp(-(c * ln(shifted)));
        let (tanh, rest) = tanh(y);
        let power = exp(s * ln(tanh.max(V::constant(TINY))));
        // ∂(tanhˢ y)/∂ε̄, with y = (ε̄ + p)⁻ᶜ and 1 − tanh² = `rest`.
        let power_slope = -(s * c) * power * rest * y / (tanh.max(V::constant(TINY)) * shifted);
        let factor = one - loss * (one - power);
        let factor_per_strain = loss * power_slope;
        let per_kelvin = V::splat(self.inverse_melting) / relative;
        let factor_per_kelvin = loss * per_kelvin * (b * p * power_slope - d * (one - power));

        let [thermal_factor, thermal_slope, _] = thermal.factor(state, lane, rise);
        Strength {
            hardened,
            slope: growth * (n - a * exponent) / strain.max(least())
                + hardened * factor_per_strain / factor.max(V::constant(COLDEST)),
            curvature: V::constant(0.0),
            softening: thermal_factor * factor,
            softening_slope: thermal_slope * factor + thermal_factor * factor_per_kelvin,
            softening_curvature: V::constant(0.0),
        }
    }
}

/// tanh y and 1 − tanh² y for y ≥ 0.
///
/// From e = exp(−2 y), which loses digits of a small y: there a series up to y⁵, below ε of the precision at
/// hand.
#[inline(always)]
fn tanh<V: Vector>(y: V) -> (V, V) {
    let one = V::constant(1.0);
    let e = exp(V::constant(-2.0) * y);
    let sum = one + e;
    let y2 = y * y;
    let series = y * (one - y2 * (V::constant(1.0 / 3.0) - y2 * V::constant(2.0 / 15.0)));
    let small = y.lt(V::constant(if V::Scalar::IS_SINGLE { 0.08 } else { 2e-3 }));
    let tanh = V::select(small, series, (one - e) / sum);
    (tanh, V::constant(4.0) * e / (sum * sum))
}

#[cfg(test)]
mod tests {
    use super::super::effects::{Adiabatic, Isothermal, Softening, Temperature};
    use super::*;
    use crate::points::PointState;
    use crate::simd::testing::{Double, Single, first};

    fn titanium() -> Constants {
        super::super::library::find("Ti-6Al-4V").expect("in the library").constants.clone()
    }

    /// Strength (Pa), its slope in strain (Pa) and in temperature (Pa/K) as the kernel has them.
    fn kernel<V: Vector>(c: &Constants, strain: f64, temperature: f64) -> [f64; 3] {
        let softening = Softening {
            exponent: c.thermal_exponent,
            reference: c.reference_temperature,
            melting: c.melting_temperature,
        };
        let thermal = Adiabatic::<V::Scalar, true>::new(0.9, 2.5e6, 298.15, softening);
        let mut state = Temperature::zeroed();
        (0..8).for_each(|lane| thermal.place(&mut state, lane, temperature));
        let zero = V::constant(0.0);
        let at = TanhLaw::<V::Scalar>::new(c).strength(V::constant(strain), &thermal, &state, 0, zero);
        let [hardened, slope, factor, factor_slope] =
            [at.hardened, at.slope, at.softening, at.softening_slope].map(first);
        [hardened * factor, slope * factor, hardened * factor_slope]
    }

    /// The law written down once more, as its source has it.
    fn law(c: &Constants, strain: f64, temperature: f64) -> f64 {
        let [a, b, power, d, s] = c.tanh;
        let (t, melt, room) = (temperature, c.melting_temperature, c.reference_temperature);
        let hardened =
            c.yield_stress + c.hardening_modulus * strain.powf(c.hardening_exponent) / strain.powf(a).exp();
        let share = 1.0 - (t / melt).powf(d);
        let p = (t / melt).powf(b);
        let tanh = (1.0 / (strain + p).powf(power)).tanh();
        let softening = 1.0 - ((t - room) / (melt - room)).clamp(0.0, 1.0).powf(c.thermal_exponent);
        hardened * softening * (share + (1.0 - share) * tanh.powf(s))
    }

    const STRAINS: [f64; 9] = [1e-6, 1e-3, 0.05, 0.3, 0.7, 1.5, 3.0, 10.0, 40.0];
    const TEMPERATURES: [f64; 5] = [298.15, 400.0, 900.0, 1500.0, 1870.0];

    /// Vector kernel and scalar function are the law, to the rounding of its powers.
    #[test]
    fn both_forms_are_the_published_law() {
        // In mild and in strong forms: the published exponent s = 0.05 hardly shows errors of the hyperbolic
        // tangent.
        for tanh in [titanium().tanh, [1.3, 2.0, 1.0, 0.5, 2.0]] {
            let c = Constants { tanh, ..titanium() };
            for (strain, temperature) in STRAINS.iter().flat_map(|&e| TEMPERATURES.map(|t| (e, t))) {
                let exact = law(&c, strain, temperature);
                let at_rest =
                    |softening: f64| TanhLaw::<f64>::new(&c).at_rest(strain, temperature, softening);
                let room = c.reference_temperature;
                let softening = 1.0 - (temperature - room) / (c.melting_temperature - room);
                // Softening is rounded against one, hence the strength against the cold one.
                let cold = law(&c, strain, room);
                let errors = [
                    (kernel::<Double>(&c, strain, temperature)[0], 1e-13),
                    (at_rest(softening), 1e-13),
                    (kernel::<Single>(&c, strain, temperature)[0], 1e-5),
                ];
                for (value, bound) in errors {
                    assert!(
                        (value - exact).abs() < bound * cold,
                        "{value:e} Pa at strain {strain}, {temperature} K, exact {exact:e} Pa"
                    );
                }
            }
        }
    }

    /// Newton's slopes are the derivatives of the strength.
    #[test]
    fn slopes_match_central_differences() {
        for tanh in [titanium().tanh, [1.3, 2.0, 1.0, 0.5, 2.0]] {
            let c = Constants { tanh, ..titanium() };
            for (strain, temperature) in STRAINS.iter().flat_map(|&e| TEMPERATURES.map(|t| (e, t + 0.5))) {
                let [_, per_strain, per_kelvin] = kernel::<Double>(&c, strain, temperature);
                let (de, dt) = (1e-5 * strain, 1e-3);
                let exact = [
                    (law(&c, strain + de, temperature) - law(&c, strain - de, temperature)) / (2.0 * de),
                    (law(&c, strain, temperature + dt) - law(&c, strain, temperature - dt)) / (2.0 * dt),
                ];
                // Truncation 1e-10, and rounding of a strength of 1e9 over the differences.
                let bounds = [1e-6 * exact[0].abs() + 1e-6 / de, 1e-6 * exact[1].abs() + 1e-3];
                for ((value, exact), bound) in [per_strain, per_kelvin].into_iter().zip(exact).zip(bounds) {
                    assert!(
                        (value - exact).abs() < bound,
                        "slope {value:e} at strain {strain}, {temperature} K, by differences {exact:e}"
                    );
                }
            }
        }
    }

    /// What the law is for: beyond a strain of about ½ it loses strength at constant temperature.
    #[test]
    fn titanium_softens_with_strain() {
        let c = titanium();
        let peak = law(&c, 0.48, 298.15);
        assert!(kernel::<Double>(&c, 0.1, 298.15)[1] > 0.0 && kernel::<Double>(&c, 0.6, 298.15)[1] < 0.0);
        let late = kernel::<Double>(&c, 2.0, 298.15)[0];
        assert!(late < 0.7 * peak, "{late:e} Pa at a strain of 2, {peak:e} Pa at 0.48");
    }

    /// Strength, slope and second derivative (Pa) of the power law at a strain, cold.
    fn power_law(c: &Constants, strain: f64) -> [f64; 3] {
        let thermal = Isothermal { temperature: 298.15, softening: None };
        let law = PowerLaw::<f64>::new(c);
        let at = law.strength(Double::splat(strain), &thermal, &(), 0, Double::splat(0.0));
        [at.hardened, at.slope, at.curvature].map(first)
    }

    /// The slopes of the power law, which the return's last step trusts, are its derivatives.
    #[test]
    fn power_laws_derivatives_match_central_differences() {
        let c = titanium();
        for strain in [1e-9, 1e-6, 1e-3, 0.05, 0.7, 3.0, 40.0] {
            let step = 1e-4 * strain;
            let [below, _, above] = [-step, 0.0, step].map(|by| power_law(&c, strain + by));
            let [_, slope, curvature] = power_law(&c, strain);
            let slope_by = (above[0] - below[0]) / (2.0 * step);
            let curvature_by = (above[1] - below[1]) / (2.0 * step);
            // Truncation: steps of 1e-4 squared; rounding of a strength of 1e9 Pa over the steps.
            assert!(
                (slope - slope_by).abs() < 1e-7 * slope + 1e-6 / step,
                "slope {slope:e} Pa at {strain}, by differences {slope_by:e}"
            );
            assert!(
                (curvature - curvature_by).abs() < 1e-7 * curvature.abs(),
                "second derivative {curvature:e} Pa at {strain}, by differences {curvature_by:e}"
            );
        }
    }

    /// A strain carries what the strength at it is, cold and softened, from first yield on; without hardening
    /// none does.
    #[test]
    fn hardening_carries_its_own_strength() {
        let c = titanium();
        let law = PowerLaw::<f64>::new(&c);
        for (before, after) in [(0.0, 1e-12), (0.0, 1e-3), (1e-9, 1e-7), (0.1, 0.3)] {
            for softening in [1.0, 0.3] {
                let [at_rest, trial] = [before, after].map(|strain| law.at_rest(strain, 298.15, softening));
                let strain =
                    first(law.carrying(Double::splat(before), Double::splat(at_rest), Double::splat(trial)));
                // What is left of the digits of a strength that hardly grows, to the power of 1/n.
                let error = 1e-14 * trial / (trial - at_rest) / c.hardening_exponent;
                assert!(
                    (strain / after - 1.0).abs() < error.max(1e-11),
                    "{strain:e} instead of {after:e}, softening {softening}"
                );
            }
        }
        let plain = PowerLaw::<f64>::new(&Constants { hardening_modulus: 0.0, ..c });
        let [strain, at_rest, trial] = [0.1, 1e9, 1.1e9].map(Double::splat);
        assert!(first(plain.carrying(strain, at_rest, trial)) > 1e30);
    }
}
