//! Elasticity of the Johnson–Cook family: pressure from the volume ratio, deviator in proportion to strain.
//!
//! Kirchhoff stress τ = s + κ/2 (J² − 1) I. The pressure follows from the volume ratio J, so it neither
//! drifts nor needs a logarithm, and has the energy κ/2 ((J² − 1)/2 − ln J) (Simo and Hughes 1998, eq.
//! 9.2.7). The deviator s turns with the material and grows by 2μ dev Δε (`Dimension::increment`); its energy
//! is s:s/(4μ).

use crate::scene::Constants;
use crate::simd::math::ln;
use crate::simd::{Real, Vector};

/// Isotropic stiffness.
#[derive(Clone, Copy, Debug)]
pub struct Elasticity<R> {
    /// κ (Pa).
    pub bulk_modulus: R,
    /// μ (Pa).
    pub shear_modulus: R,
}

impl<R: Real> Elasticity<R> {
    /// Stiffness of a material's Young's modulus and Poisson's ratio.
    pub fn new(constants: &Constants) -> Self {
        let (e, nu) = (constants.youngs_modulus, constants.poissons_ratio);
        Elasticity {
            bulk_modulus: R::from_f64(e / (3.0 * (1.0 - 2.0 * nu))),
            shear_modulus: R::from_f64(e / (2.0 * (1.0 + nu))),
        }
    }

    /// κ/2 (J² − 1) (Pa).
    #[inline(always)]
    pub fn mean_stress<V: Vector<Scalar = R>>(&self, jacobian: V) -> V {
        V::splat(self.bulk_modulus) * V::constant(0.5) * (jacobian * jacobian - V::constant(1.0))
    }

    /// κ/2 ((J² − 1)/2 − ln J) (J/m3).
    pub fn volume_energy(&self, j: f64) -> f64 {
        0.5 * self.bulk_modulus.to_f64() * (0.5 * (j * j - 1.0) - j.ln())
    }

    /// The same of points side by side, where they are stretched, J > 1, else 0 (J/m3).
    #[inline(always)]
    pub fn stretching_energy<V: Vector<Scalar = R>>(&self, jacobian: V) -> V {
        let one = V::constant(1.0);
        let j = jacobian.max(one);
        let half = V::constant(0.5);
        // Rounding may leave less than nothing next to J = 1.
        let energy = V::splat(self.bulk_modulus) * half * (half * (j * j - one) - ln(j));
        energy.max(V::constant(0.0))
    }

    /// c² = (κ/2 (J² + 1) + 4/3 μ)/ρ₀ (m/s): spatial stiffness over spatial density.
    pub fn sound_speed(&self, volume_ratio: f64, density: f64) -> f64 {
        let bulk = 0.5 * self.bulk_modulus.to_f64() * (volume_ratio * volume_ratio + 1.0);
        ((bulk + 4.0 / 3.0 * self.shear_modulus.to_f64()) / density).sqrt()
    }
}
