//! A compressible neo-Hookean solid: the material of the manufactured solutions.
//!
//! First Piola–Kirchhoff stress P = λ ln J F⁻ᵀ + μ (F − F⁻ᵀ), hence Kirchhoff stress τ = λ ln J I + μ (F Fᵀ −
//! I), with the energy W = μ/2 (F : F − 3 − 2 ln J) + λ/2 (ln J)² per volume at the start. Each point keeps
//! F, and F ← (I + Δt ∇v) F is exact for a motion x ← x + Δt v.
//!
//! It shares no code with the Johnson–Cook law: that the solver runs it proves the seam `ConstitutiveModel`.

use crate::dimension::Dimension;
use crate::material::{ConstitutiveModel, PointReport, StepSums};
use crate::points::{BLOCK, Column, PointState};
use crate::simd::math::ln;
use crate::simd::{Real, Vector};

/// Elastic constants.
#[derive(Clone, Copy, Debug)]
pub struct NeoHookean {
    /// Density at the start ρ (kg/m3).
    pub density: f64,
    /// Lamé's first constant λ (Pa).
    pub lambda: f64,
    /// Shear modulus μ (Pa).
    pub mu: f64,
    /// No point is stretched beyond this factor in any direction (-), at least 1: it stiffens the material,
    /// and the substep must follow.
    pub largest_stretch: f64,
}

impl NeoHookean {
    /// From Young's modulus (Pa), Poisson's ratio (-) and density (kg/m3).
    pub fn new(youngs_modulus: f64, poissons_ratio: f64, density: f64) -> Self {
        let mu = youngs_modulus / (2.0 * (1.0 + poissons_ratio));
        let lambda = 2.0 * mu * poissons_ratio / (1.0 - 2.0 * poissons_ratio);
        NeoHookean { density, lambda, mu, largest_stretch: 1.0 }
    }
}

/// Deformation gradient of a block of points.
#[derive(Clone, Debug)]
pub struct Gradient<R: Real, D: Dimension>(pub D::Matrix<Column<R>>);

impl<R: Real, D: Dimension> PointState<R> for Gradient<R, D> {
    const COLUMNS: usize = D::AXES * D::AXES;

    fn zeroed() -> Self {
        Gradient(D::matrix(|i, j| [if i == j { R::ONE } else { R::ZERO }; BLOCK]))
    }

    fn column(&self, k: usize) -> &Column<R> {
        &self.0[k / D::AXES][k % D::AXES]
    }

    fn column_mut(&mut self, k: usize) -> &mut Column<R> {
        &mut self.0[k / D::AXES][k % D::AXES]
    }
}

impl<R: Real, D: Dimension> Gradient<R, D> {
    /// Writes the deformation gradient of the point at `lane`.
    pub fn set(&mut self, lane: usize, gradient: [[f64; 3]; 3]) {
        for row in 0..D::AXES {
            for column in 0..D::AXES {
                self.0[row][column][lane] = R::from_f64(gradient[row][column]);
            }
        }
    }

    /// The deformation gradient of the point at `lane`, with 1 across the plane.
    fn full(&self, lane: usize) -> [[f64; 3]; 3] {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if i < D::AXES && j < D::AXES {
                    self.0[i][j][lane].to_f64()
                } else {
                    f64::from(u8::from(i == j))
                }
            })
        })
    }
}

/// det F.
#[inline(always)]
fn determinant<D: Dimension, V: Vector>(f: &D::Matrix<V>) -> V {
    let minor = |i: usize, j: usize, k: usize, l: usize| f[i][k] * f[j][l] - f[i][l] * f[j][k];
    if D::AXES == 2 {
        minor(0, 1, 0, 1)
    } else {
        f[0][0] * minor(1, 2, 1, 2) - f[0][1] * minor(1, 2, 0, 2) + f[0][2] * minor(1, 2, 0, 1)
    }
}

impl NeoHookean {
    /// τ = λ ln J I + μ (F Fᵀ − I).
    #[inline(always)]
    fn kirchhoff<D: Dimension, V: Vector>(&self, f: &D::Matrix<V>) -> D::Symmetric<V> {
        let pressure = V::constant(self.lambda) * ln(determinant::<D, V>(f));
        let mu = V::constant(self.mu);
        let product = |i: usize, j: usize| {
            let mut sum = f[i][0] * f[j][0];
            for k in 1..D::AXES {
                sum = f[i][k].mul_add(f[j][k], sum);
            }
            sum
        };
        D::symmetric(|k| {
            if k < D::AXES {
                mu.mul_add(product(k, k) - V::constant(1.0), pressure)
            } else if k < 3 {
                // Across the plane nothing is stretched.
                pressure
            } else {
                let pairs: &[(usize, usize)] =
                    if D::AXES == 2 { &[(0, 1)] } else { &[(1, 2), (0, 2), (0, 1)] };
                mu * product(pairs[k - 3].0, pairs[k - 3].1)
            }
        })
    }
}

impl<R: Real, D: Dimension> ConstitutiveModel<R, D> for NeoHookean {
    type State = Gradient<R, D>;

    fn density(&self) -> f64 {
        self.density
    }

    fn set_density(&mut self, density: f64) {
        self.density = density;
    }

    /// ρ c² = λ (1 − ln J) + μ (1 + s²) along a direction stretched by s; J is close to 1 or above in these
    /// problems.
    fn sound_speed(&self, _volume_ratio: f64) -> f64 {
        let stretch = self.largest_stretch;
        ((self.lambda + self.mu * (1.0 + stretch * stretch)) / self.density).sqrt()
    }

    fn place(&self, state: &mut Self::State, lane: usize, _temperature: f64) {
        state.set(lane, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }

    #[inline(always)]
    fn stress<V: Vector<Scalar = R>>(&self, state: &Self::State, lane: usize) -> D::Symmetric<V> {
        self.kirchhoff::<D, V>(&D::matrix(|i, j| V::load(&state.0[i][j][lane..])))
    }

    #[inline(always)]
    fn update<V: Vector<Scalar = R>>(
        &self,
        state: &mut Self::State,
        lane: usize,
        h: &D::Matrix<V>,
        _dt: R,
        _volume: V,
        totals: &mut StepSums<V>,
    ) -> D::Symmetric<V> {
        let old: D::Matrix<V> = D::matrix(|i, j| V::load(&state.0[i][j][lane..]));
        let new = D::matrix(|i, j| {
            let mut sum = old[i][j];
            for k in 0..D::AXES {
                sum = h[i][k].mul_add(old[k][j], sum);
            }
            sum
        });
        for i in 0..D::AXES {
            for j in 0..D::AXES {
                new[i][j].store(&mut state.0[i][j][lane..]);
            }
        }
        totals.volume_ratio = totals.volume_ratio.max(determinant::<D, V>(&new));
        self.kirchhoff::<D, V>(&new)
    }

    fn volume_ratio(&self, state: &Self::State, lane: usize) -> f64 {
        let f = state.full(lane);
        let minor = |a: usize, b: usize| f[1][a] * f[2][b] - f[1][b] * f[2][a];
        f[0][0] * minor(1, 2) - f[0][1] * minor(0, 2) + f[0][2] * minor(0, 1)
    }

    fn set_volume_ratio(&self, state: &mut Self::State, lane: usize, volume_ratio: f64) -> f64 {
        let energy =
            |state: &Self::State| ConstitutiveModel::<R, D>::report(self, state, lane).elastic_energy;
        let before = energy(state);
        let old = ConstitutiveModel::<R, D>::volume_ratio(self, state, lane);
        let factor = (volume_ratio / old).powf(1.0 / D::AXES as f64);
        for i in 0..D::AXES {
            for j in 0..D::AXES {
                state.0[i][j][lane] *= R::from_f64(factor);
            }
        }
        before - energy(state)
    }

    fn report(&self, state: &Self::State, lane: usize) -> PointReport {
        let f = state.full(lane);
        let j = ConstitutiveModel::<R, D>::volume_ratio(self, state, lane);
        let product = |a: usize, b: usize| (0..3).map(|k| f[a][k] * f[b][k]).sum::<f64>();
        let mean = self.lambda * j.ln();
        let normal = |a: usize| (mean + self.mu * (product(a, a) - 1.0)) / j;
        let shear = |a: usize, b: usize| self.mu * product(a, b) / j;
        let square: f64 = (0..3).map(|a| product(a, a)).sum();
        PointReport {
            jacobian: j,
            stress: [normal(0), normal(1), normal(2), shear(1, 2), shear(0, 2), shear(0, 1)],
            elastic_energy: 0.5 * self.mu * (square - 3.0 - 2.0 * j.ln()) + 0.5 * mean * j.ln(),
            ..PointReport::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::{PlaneStrain, ThreeDimensional};
    use crate::simd::testing::Double as V;

    /// τ : ∇v is the rate of the stored energy: the kernel's stress against central differences of the
    /// reported energy.
    fn check<D: Dimension>() {
        let model = NeoHookean::new(1e4, 0.3, 1.0);
        let start = [[1.2, 0.3, -0.1], [-0.2, 0.9, 0.15], [0.05, -0.1, 1.1]];
        let energy = |row: usize, column: usize, step: f64| {
            let mut state = Gradient::<f64, D>::zeroed();
            let mut f = start;
            // (I + h) F with h of one entry.
            for k in 0..3 {
                f[row][k] += step * if k < D::AXES && column < D::AXES { start[column][k] } else { 0.0 };
            }
            state.set(0, f);
            ConstitutiveModel::<f64, D>::report(&model, &state, 0).elastic_energy
        };
        let mut state = Gradient::<f64, D>::zeroed();
        state.set(0, start);
        let stress = ConstitutiveModel::<f64, D>::stress::<V>(&model, &state, 0);
        for row in 0..D::AXES {
            for column in 0..D::AXES {
                let mut lanes = [0.0; 8];
                D::component(&stress, row, column).store(&mut lanes);
                let step = 1e-5;
                let slope = (energy(row, column, step) - energy(row, column, -step)) / (2.0 * step);
                // Truncation of 1e-10 times moduli of 1e4, and rounding of energies of 1e3 over 1e-5.
                assert!(
                    (slope - lanes[0]).abs() < 1e-5 * 1e4,
                    "τ({row}, {column}) = {} Pa, the energy's slope is {slope} Pa",
                    lanes[0]
                );
            }
        }
    }

    /// See `check`.
    #[test]
    fn stress_is_the_slope_of_the_energy() {
        check::<PlaneStrain>();
        check::<ThreeDimensional>();
    }
}
