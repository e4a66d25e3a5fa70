//! Zerilli and Armstrong's law for bcc metals, in which rate and temperature act together:
//!
//! σ_y = M(T) (C₀ + C₁ exp(−C₃ T + C₄ T ln ε̄̇) + C₅ ε̄ⁿ),  T absolute, ε̄̇ over 1/s.
//!
//! F. J. Zerilli and R. W. Armstrong, J. Appl. Phys. 61 (1987) 1816–1825, doi:10.1063/1.338024, without M.
//! The heat of activation is stress at 0 K, C₁, times what heat leaves of it, and heat leaves more the faster
//! the material flows.
//!
//! Where the formula is silent or would mislead, this is done:
//!
//! * Rates below 1/s count as 1/s, as Johnson and Cook's below their reference: flow stress at rest is that
//!   at 1/s.
//! * C₄ ln ε̄̇ counts up to C₃, where the middle term is C₁: no rate makes the metal stronger than at 0 K.
//! * Hardening C₅ ε̄ⁿ does not soften, so the formula leaves most of the strength to a melt. M(T) ends it: 1
//!   up to [`MELTING_RANGE`] (K) below the melting temperature, from there to 0 at melting on a straight
//!   line. Above there is no shear strength and no plastic work, while the pressure stays elastic, as with
//!   Johnson and Cook.
//! * Cold is not limited: below room temperature the metal is stronger, as the formula has it.

use super::effects::{Adiabatic, ThermalEffect};
use super::flow_law::{Branch, FlowLaw, Slopes, Trial, least};
use crate::scene::Constants;
use crate::simd::math::{exp, ln, pow};
use crate::simd::{Mask, Real, Vector, each};

/// Width of the range below the melting temperature in which strength ends (K): between solidus and liquidus
/// of a carbon steel lie some tens of kelvin (assumed).
pub const MELTING_RANGE: f64 = 50.0;

/// Least strength that guards may count on (Pa): the lower end of what `material.yield_stress` may be.
const WEAKEST: f64 = 1e4;

/// The law with its constants.
#[derive(Clone, Copy, Debug)]
pub struct ZerilliArmstrong<R> {
    /// C₀ (Pa).
    athermal: R,
    /// C₁ (Pa).
    thermal_stress: R,
    /// C₃ (1/K).
    softening: R,
    /// C₄ (1/K).
    rate_softening: R,
    /// C₅ (Pa).
    hardening: R,
    /// n (-).
    exponent: R,
    /// T_melt (K).
    melting: R,
    /// T_ref (K), at which `yield_stress` is told.
    reference: f64,
    /// Keeps temperatures; the law softens by itself.
    heat: Adiabatic<R, false>,
}

impl<R: Real> ZerilliArmstrong<R> {
    /// The law of a material's constants.
    pub fn new(constants: &Constants, heat: Adiabatic<R, false>) -> Self {
        let c = &constants.zerilli_armstrong;
        ZerilliArmstrong {
            athermal: R::from_f64(c.c0),
            thermal_stress: R::from_f64(c.c1),
            softening: R::from_f64(c.c3),
            rate_softening: R::from_f64(c.c4),
            hardening: R::from_f64(c.c5),
            exponent: R::from_f64(c.n),
            melting: R::from_f64(constants.melting_temperature),
            reference: constants.reference_temperature,
            heat,
        }
    }

    /// The same with heat that stays where it arises.
    ///
    /// * `initial`: temperature at the start (K)
    pub fn full(constants: &Constants, initial: f64) -> Self {
        Self::new(constants, Adiabatic::of(constants, initial))
    }
}

/// Points further off a kink than a thousandth of a scale.
#[inline(always)]
fn is_off<V: Vector>(distance: V, scale: V) -> V::Mask {
    distance.abs().gt(V::constant(1e-3) * scale)
}

impl<R: Real> FlowLaw<R> for ZerilliArmstrong<R> {
    type Thermal = Adiabatic<R, false>;
    type Local<V: Vector<Scalar = R>> = Slopes<V>;

    #[inline(always)]
    fn thermal(&self) -> &Adiabatic<R, false> {
        &self.heat
    }

    /// At the reference temperature.
    fn yield_stress(&self) -> R {
        self.at_rest(R::ZERO, self.reference).max(R::from_f64(WEAKEST))
    }

    fn at_rest(&self, plastic_strain: R, temperature: f64) -> R {
        let thermal = self.thermal_stress.to_f64() * (-self.softening.to_f64() * temperature).exp();
        // In double precision 0ⁿ is 1 for n = 0 and 0 for n > 0.
        let power = plastic_strain.to_f64().powf(self.exponent.to_f64());
        let solid = ((self.melting.to_f64() - temperature) / MELTING_RANGE).clamp(0.0, 1.0);
        R::from_f64(solid * (self.athermal.to_f64() + thermal + self.hardening.to_f64() * power))
    }

    /// Where the strain grows by a multiple, hardening alone says about where it leads.
    #[inline(always)]
    fn first_guess<V: Vector<Scalar = R>>(&self, trial: &Trial<V>, guess: V, high: V) -> V {
        let grows = guess.gt(trial.strain);
        let hardens = self.hardening > R::ZERO && self.exponent > R::ZERO;
        if !hardens || !(trial.yields & grows).any() {
            return guess.min(high);
        }
        let (c5, n) = (V::splat(self.hardening), V::splat(self.exponent));
        let growth = pow(trial.strain, n) + (trial.stress - trial.at_rest) / c5;
        let end = pow(growth.max(V::constant(0.0)), V::splat(R::ONE / self.exponent));
        let most = V::select(grows, (end - trial.strain).max(least()).min(high), high);
        guess.min(most)
    }

    #[inline(always)]
    fn local<V: Vector<Scalar = R>>(
        &self,
        trial: &Trial<V>,
        increment: V,
        state: &<Self::Thermal as ThermalEffect<R>>::State,
        lane: usize,
        rise: V,
    ) -> Slopes<V> {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let (c1, c3, c4) =
            (V::splat(self.thermal_stress), V::splat(self.softening), V::splat(self.rate_softening));
        let strain = trial.strain + increment;
        let temperature = self.heat.temperature_after(state, lane, rise);
        let rate = increment / V::splat(trial.dt);

        // The exponent over the temperature, −C₃ + C₄ ln ε̄̇ ≤ 0.
        let open = c4.mul_add(ln(rate.max(one)), -c3);
        let per_kelvin = open.min(zero);
        let thermal = c1 * exp(per_kelvin * temperature);
        let thermal_at_rest = c1 * exp(-(c3 * temperature));
        let n = V::splat(self.exponent);
        let hardened = V::splat(self.hardening) * pow(strain, n);
        let hardening = n * hardened / strain.max(least());
        let athermal = V::splat(self.athermal) + hardened;

        // M(T), whose slope counts between the kinks.
        let inverse = V::constant(1.0 / MELTING_RANGE);
        let left = (V::splat(self.melting) - temperature) * inverse;
        let solid = left.max(zero).min(one);
        let melts = V::select(left.gt(zero) & left.lt(one), -inverse, zero);
        let (heated, per_kelvin) = ([thermal, thermal_at_rest], [per_kelvin, -c3]);
        let [flow, at_rest]: [Branch<V>; 2] = each!(k < 2 => Branch {
            stress: solid * (athermal + heated[k]),
            per_strain: solid * hardening,
            per_kelvin: solid * (heated[k] * per_kelvin[k]) + melts * (athermal + heated[k]),
        });

        let rate_counts = rate.gt(one) & open.lt(zero);
        Slopes {
            flow,
            per_log_rate: V::select(rate_counts, solid * thermal * c4 * temperature, zero),
            at_rest,
            is_smooth: is_off(rate - one, one)
                & (is_off(open, c3) | c3.le(zero))
                & is_off(left, one)
                & is_off(left - one, one),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::flow_law::testing::{At, match_differences, slopes};
    use super::super::library;
    use super::*;
    use crate::simd::testing::{Double, Single, first};

    fn steel() -> Constants {
        library::find("AISI 1045").expect("in the library").constants.clone()
    }

    /// The law as it is published, in MPa and plain numbers of AISI 1045.
    fn published(at: At) -> f64 {
        let thermal = 1533.7 * (at.temperature * (-0.00609 + 0.000189 * at.rate.ln())).exp();
        1e6 * (159.2 + thermal + 742.6 * at.strain.powf(0.171))
    }

    fn grid() -> impl Iterator<Item = At> {
        let strains = [1e-6, 1e-3, 0.05, 0.3, 1.0, 4.0];
        let rates = [1.5, 1e2, 7.5e3, 1e6, 1e8];
        let temperatures = [77.0, 298.15, 600.0, 1100.0, 1600.0];
        strains.into_iter().flat_map(move |strain| {
            rates.into_iter().flat_map(move |rate| {
                temperatures.into_iter().map(move |temperature| At { strain, rate, temperature })
            })
        })
    }

    /// Vector kernel in both precisions and scalar function are the law, with the constants of its source.
    #[test]
    fn both_forms_are_the_published_law() {
        let (double, single) = (
            ZerilliArmstrong::<f64>::full(&steel(), 298.15),
            ZerilliArmstrong::<f32>::full(&steel(), 298.15),
        );
        for at in grid() {
            let exact = published(at);
            let value = first(slopes::<Double, _>(&double, at).flow.stress);
            let rounded = first(slopes::<Single, _>(&single, at).flow.stress);
            assert!((value / exact - 1.0).abs() < 1e-13, "{value:e} Pa at {at:?}, exact {exact:e} Pa");
            // ε of single precision times the exponent of a few, and the subtraction that the strain comes
            // from.
            assert!((rounded / exact - 1.0).abs() < 5e-6, "{rounded:e} Pa at {at:?}, exact {exact:e} Pa");
            let still = At { rate: 1.0, ..at };
            let (value, kernel) =
                (double.at_rest(at.strain, at.temperature), slopes::<Double, _>(&double, at).at_rest.stress);
            let exact = published(still);
            assert!((value / exact - 1.0).abs() < 1e-14, "{value:e} Pa at rest, exact {exact:e} Pa, {at:?}");
            assert!((first(kernel) / exact - 1.0).abs() < 1e-13, "at rest {kernel:?} Pa, exact {exact:e} Pa");
        }
    }

    /// Newton's slopes are the derivatives of the stress, also where the metal melts and below 1/s.
    #[test]
    fn slopes_match_central_differences() {
        let law = ZerilliArmstrong::<f64>::full(&steel(), 298.15);
        let melting = steel().melting_temperature;
        grid().for_each(|at| match_differences(&law, at));
        for (rate, temperature) in [(0.1, 300.0), (1e4, melting - 20.0), (1e4, melting + 1.0)] {
            match_differences(&law, At { strain: 0.3, rate, temperature });
        }
        let wild = Constants {
            zerilli_armstrong: crate::scene::ZerilliArmstrong { c4: 1e-3, ..steel().zerilli_armstrong },
            ..steel()
        };
        // ln ε̄̇ = 9.2 > C₃/C₄: as strong as at 0 K.
        let law = ZerilliArmstrong::<f64>::full(&wild, 298.15);
        let fast = At { strain: 0.3, rate: 1e4, temperature: 900.0 };
        match_differences(&law, fast);
        let (stress, coldest) = (first(slopes::<Double, _>(&law, fast).flow.stress), law.at_rest(0.3, 0.0));
        assert!((stress / coldest - 1.0).abs() < 1e-14, "{stress:e} Pa, at 0 K {coldest:e} Pa");
    }

    /// Rates below 1/s count as 1/s, and strength ends on a line to the melting temperature.
    #[test]
    fn rest_and_melting_are_where_they_are_said_to_be() {
        let law = ZerilliArmstrong::<f64>::full(&steel(), 298.15);
        let melting = steel().melting_temperature;
        let stress = |rate, temperature| {
            first(slopes::<Double, _>(&law, At { strain: 0.3, rate, temperature }).flow.stress)
        };
        assert_eq!(stress(1e-6, 400.0), stress(1.0, 400.0));
        let solid = published(At { strain: 0.3, rate: 1e4, temperature: melting - 0.5 * MELTING_RANGE });
        let half = stress(1e4, melting - 0.5 * MELTING_RANGE);
        assert!((half / solid - 0.5).abs() < 1e-12, "{half:e} of {solid:e} Pa half way to melting");
        assert_eq!(
            (stress(1e4, melting), stress(1e4, melting + 500.0), law.at_rest(0.3, melting)),
            (0.0, 0.0, 0.0)
        );
    }

    /// The set is of the same tests as the library's Johnson–Cook set of the material (Jaspers and
    /// Dautzenberg), so in the range of these both laws must tell about the same stress: within 1 % slow and
    /// cold, where both were fitted to one curve, within 20 % in the split Hopkinson bars. A slip of a digit
    /// would not.
    #[test]
    fn both_laws_of_one_source_agree_in_the_range_of_its_tests() {
        let c = steel();
        let law = ZerilliArmstrong::<f64>::full(&c, 298.15);
        for strain in [0.05, 0.1, 0.2, 0.3_f64] {
            for (rate, temperature) in [(1.0, 298.15), (7.5e3, 298.15), (7.5e3, 573.15), (7.5e3, 873.15)] {
                let homologous = (temperature - c.reference_temperature)
                    / (c.melting_temperature - c.reference_temperature);
                let other = (c.yield_stress + c.hardening_modulus * strain.powf(c.hardening_exponent))
                    * (1.0 + c.rate_coefficient * f64::ln(rate / c.reference_rate))
                    * (1.0 - homologous.powf(c.thermal_exponent));
                let stress = first(slopes::<Double, _>(&law, At { strain, rate, temperature }).flow.stress);
                assert!(
                    (stress / other - 1.0).abs() < if rate == 1.0 { 0.01 } else { 0.2 },
                    "{stress:e} Pa at strain {strain}, {rate} 1/s, {temperature} K; Johnson and Cook \
                     {other:e} Pa"
                );
            }
        }
    }
}
