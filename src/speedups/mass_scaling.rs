//! Mass scaling: a heavier workpiece for larger substeps, with an error known beforehand.
//!
//! An explicit substep is as long as sound takes through part of a cell, so a factor s on the mass saves √s
//! of the substeps. What it costs is the momentum that the heavier chip carries away. Per width of cut the
//! force grows by
//!
//! ΔF = 1.2 (s − 1) ρ v² t
//!
//! with cutting speed v and feed t: measured at 50 m/s with s = 2, 4 and 8, and linear in s − 1 there. The
//! cutting force itself is at least that of the single shear plane of least work, F = u t with
//!
//! u = ∫₀^ε̂ σ_y dε̄,  ε̂ = 2 tan(π/4 − γ/2) / √3
//!
//! with the rake angle γ, without friction and without hardening by the strain rate: an underestimate.
//! Automatic scaling takes the largest s that keeps the share ΔF / F that follows under the one asked for. As
//! it falls with v², scaling is worth most at the speeds of machine shops.
//!
//! The share is no bound where it is small, since the heavier chip costs more than its momentum (work in
//! contact and in the scheme's own damping; book/src/evidence/performance.md). At shares of 3.6 % and more it
//! lies above what was measured; at 1 % the change is 1.1 to 1.3 times the share, and in AISI 1045 at 3.33
//! m/s without friction 1.8 times 0.5 % and 3 times 0.16 %.
//!
//! Heat capacity is not scaled: temperature follows the same work per volume. When the speed changes, so does
//! s; the kinetic energy that this moves is an entry of the ledger.
//!
//! Form of the effect: a coefficient (the density), looked at once per substep.

use crate::material::effects::Softening;
use crate::scene::{Constants, Heat, Scene};

/// Momentum of the chip over ρ v² t: chip and workpiece turn the material twice.
const CHIP_MOMENTUM: f64 = 1.2;
/// Largest factor that is taken automatically; reached at walking pace.
const LARGEST: f64 = 1e6;
/// Ratio of neighbouring factors: the factor follows the speed in steps, as each costs a sort of the points.
const STEP: f64 = 1.044_273_782_427_413_8;

/// How the mass is scaled, and by how much at present.
#[derive(Clone, Debug, PartialEq)]
pub struct MassScaling {
    rule: Rule,
    /// Density of the material (kg/m3).
    density: f64,
    /// Factor on it at present (-).
    factor: f64,
}

/// Where the factor comes from.
#[derive(Clone, Debug, PartialEq)]
enum Rule {
    /// Given.
    Fixed(f64),
    /// From the share of the cutting force (-) that may change, and the least work of cutting (J/m3).
    Automatic { share: f64, work: f64 },
}

impl MassScaling {
    /// What a scene asks for; `None` for no scaling.
    pub fn of(scene: &Scene) -> Option<Self> {
        let density = scene.material.constants.density;
        let rule = if scene.numerics.mass_scaling == 1.0 {
            return None;
        } else if scene.numerics.mass_scaling > 0.0 {
            Rule::Fixed(scene.numerics.mass_scaling)
        } else {
            Rule::Automatic { share: scene.numerics.inertia_error, work: least_work(scene) }
        };
        Some(MassScaling { rule, density, factor: 1.0 })
    }

    /// Density of the material (kg/m3), without the factor.
    pub fn density(&self) -> f64 {
        self.density
    }

    /// Factor at present (-).
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Factor that goes with a tool speed (m/s).
    pub fn wanted(&self, speed: f64) -> f64 {
        match self.rule {
            Rule::Fixed(factor) => factor,
            Rule::Automatic { share, work } => {
                let surplus = share * work / (CHIP_MOMENTUM * self.density * speed * speed);
                let steps = (1.0 + surplus).min(LARGEST).ln() / STEP.ln();
                STEP.powi(steps.floor() as i32)
            }
        }
    }

    /// Takes the factor that goes with a tool speed (m/s); whether that changed it.
    ///
    /// A slower tool raises it only by two steps or more: a speed that hovers costs no sorts. A tool at rest
    /// leaves it.
    pub fn follow(&mut self, speed: f64) -> bool {
        if speed == 0.0 && matches!(self.rule, Rule::Automatic { .. }) {
            return false;
        }
        let wanted = self.wanted(speed);
        let is_new = self.factor == 1.0 && wanted != 1.0;
        let changes = is_new || wanted < self.factor || wanted > self.factor * STEP * 1.01;
        if changes {
            self.factor = wanted;
        }
        changes
    }

    /// Takes a factor (-) from a saved state.
    pub fn restore(&mut self, factor: f64) {
        self.factor = factor;
    }
}

/// Work of the single shear plane of least work per volume removed (J/m3), without friction and rate.
fn least_work(scene: &Scene) -> f64 {
    let c: &Constants = &scene.material.constants;
    let shear = 2.0 * (std::f64::consts::FRAC_PI_4 - 0.5 * scene.tool.rake_angle).tan();
    let softening = Softening::of(c);
    let heats = scene.effects.heat != Heat::None;
    let intervals = 200;
    let step = shear / 3.0_f64.sqrt() / f64::from(intervals);
    let (mut work, mut temperature) = (0.0, scene.workpiece.initial_temperature);
    for k in 0..intervals {
        let strain = (f64::from(k) + 0.5) * step;
        let factor = if scene.effects.thermal_softening { softening.factor(temperature) } else { 1.0 };
        let stress = (c.yield_stress + c.hardening_modulus * strain.powf(c.hardening_exponent)) * factor;
        work += stress * step;
        if heats {
            temperature += c.taylor_quinney * stress * step / (c.density * c.specific_heat);
        }
    }
    work
}

#[cfg(test)]
mod tests {
    use super::*;

    fn automatic(share: f64) -> MassScaling {
        let mut scene = Scene::default();
        (scene.numerics.mass_scaling, scene.numerics.inertia_error) = (0.0, share);
        MassScaling::of(&scene).expect("scaling is asked for")
    }

    /// The shear plane of the reference, which hardens by the rate too, needs 433 N/mm at 0.3 mm: 1443 MPa.
    /// Without the rate, 1 + 0.014 ln(1e6) at most, it must need less, but not less than that factor.
    #[test]
    fn least_work_lies_below_that_of_the_reference() {
        let work = least_work(&Scene::default());
        assert!(work < 1.443e9 && work > 1.443e9 / 1.2, "least work {work} J/m3");
    }

    /// The predicted share of the force never exceeds the one asked for, and the factor is the largest step
    /// under it.
    #[test]
    fn the_predicted_share_is_kept() {
        for share in [1e-3, 0.005, 0.05] {
            let scaling = automatic(share);
            let Rule::Automatic { work, .. } = scaling.rule else { panic!("a fixed rule") };
            for speed in [0.5, 1.17, 3.33, 10.0, 50.0, 200.0] {
                let predicted = |factor: f64| 1.2 * (factor - 1.0) * 7830.0 * speed * speed / work;
                let factor = scaling.wanted(speed);
                assert!(factor >= 1.0, "factor {factor} at {speed} m/s");
                assert!(
                    predicted(factor) <= share && predicted(factor * STEP * 1.001) > share,
                    "factor {factor} at {speed} m/s changes the force by {} of {share}",
                    predicted(factor)
                );
            }
        }
    }

    /// A faster tool lowers the factor at once; a slower one raises it; one at rest leaves it.
    #[test]
    fn the_factor_follows_the_speed() {
        let mut scaling = automatic(0.005);
        assert!(scaling.follow(3.0) && scaling.factor() > 50.0, "factor {}", scaling.factor());
        let slow = scaling.factor();
        assert!(!scaling.follow(0.0) && scaling.factor() == slow, "a tool at rest changed the factor");
        assert!(scaling.follow(30.0) && scaling.factor() < 2.0, "factor {}", scaling.factor());
        assert!(!scaling.follow(29.9), "a speed that hovers changed the factor");
        assert!(scaling.follow(3.0) && scaling.factor() == slow, "factor {}", scaling.factor());
    }
}
