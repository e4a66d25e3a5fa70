//! Affine particle-in-cell transfer (APIC): points that carry a linear velocity field.
//!
//! FLIP adds the grid's increments to the points' velocities, APIC takes the grid's velocity itself and keeps
//! its first moments beside it, so that nothing of a linear velocity field is filtered:
//!
//! v = Σ w_i v_i,  B = Σ w_i v_i ⊗ (x_i − x)        from the grid's new velocities, m_i v_i = Σ w_i m (v + B
//! D⁻¹ (x_i − x)),  D = Σ w_i (x_i − x) ⊗ (x_i − x)    to the grid at the new positions.
//!
//! Weights are products over the axes, so D is diagonal, and both sums follow from what a pass adds up anyway
//! (`transfer/moments.rs`). Momentum is conserved, and angular momentum with the points' own share m (B_yx −
//! B_xy), by each transfer, to rounding (tests/apic.rs). Energy of the affine part is no part of the points'
//! kinetic energy; the ledger counts what goes there as damping.
//!
//! Form of the effect: a type parameter. A model in `Affine` keeps B as columns of its state, and the points
//! pass has the further sums for such states only.
//!
//! Source: Jiang, Schroeder, Selle, Teran and Stomakhin (2015), doi:10.1145/2766996.

use crate::dimension::{Dimension, PlaneStrain};
use crate::material::{ConstitutiveModel, PointReport, StepSums};
use crate::points::{BLOCK, Column, PointState};
use crate::simd::{Real, Vector};

/// A constitutive model whose points carry an affine velocity field; in plane strain.
#[derive(Clone)]
pub struct Affine<M>(pub M);

/// A model's state and B.
#[derive(Clone)]
pub struct AffineState<R, S> {
    /// The model's own.
    model: S,
    /// B row by row: Σ w v_row (k − d)_column (m/s, times cells).
    moments: [Column<R>; 4],
}

impl<R: Real, S: PointState<R>> PointState<R> for AffineState<R, S> {
    const COLUMNS: usize = S::COLUMNS + 4;
    const IS_AFFINE: bool = true;

    fn zeroed() -> Self {
        AffineState { model: S::zeroed(), moments: [[R::ZERO; BLOCK]; 4] }
    }

    fn column(&self, k: usize) -> &Column<R> {
        if k < S::COLUMNS { self.model.column(k) } else { &self.moments[k - S::COLUMNS] }
    }

    fn column_mut(&mut self, k: usize) -> &mut Column<R> {
        if k < S::COLUMNS { self.model.column_mut(k) } else { &mut self.moments[k - S::COLUMNS] }
    }

    #[inline(always)]
    fn moments(&self) -> &[Column<R>; 4] {
        &self.moments
    }

    #[inline(always)]
    fn moments_mut(&mut self) -> &mut [Column<R>; 4] {
        &mut self.moments
    }
}

impl<R: Real, M: ConstitutiveModel<R, PlaneStrain>> ConstitutiveModel<R, PlaneStrain> for Affine<M> {
    type State = AffineState<R, M::State>;

    fn density(&self) -> f64 {
        self.0.density()
    }

    fn set_density(&mut self, density: f64) {
        self.0.set_density(density);
    }

    fn sound_speed(&self, volume_ratio: f64) -> f64 {
        self.0.sound_speed(volume_ratio)
    }

    fn yield_volume_strain(&self) -> f64 {
        self.0.yield_volume_strain()
    }

    fn yield_speed(&self) -> f64 {
        self.0.yield_speed()
    }

    fn flow_stress(&self, state: &Self::State, lane: usize) -> f64 {
        self.0.flow_stress(&state.model, lane)
    }

    fn place(&self, state: &mut Self::State, lane: usize, temperature: f64) {
        self.0.place(&mut state.model, lane, temperature);
        for column in &mut state.moments {
            column[lane] = R::ZERO;
        }
    }

    #[inline(always)]
    fn stress<V: Vector<Scalar = R>>(
        &self,
        state: &Self::State,
        lane: usize,
    ) -> <PlaneStrain as Dimension>::Symmetric<V> {
        self.0.stress(&state.model, lane)
    }

    #[inline(always)]
    fn update<V: Vector<Scalar = R>>(
        &self,
        state: &mut Self::State,
        lane: usize,
        h: &<PlaneStrain as Dimension>::Matrix<V>,
        dt: R,
        volume: V,
        totals: &mut StepSums<V>,
    ) -> <PlaneStrain as Dimension>::Symmetric<V> {
        self.0.update(&mut state.model, lane, h, dt, volume, totals)
    }

    fn volume_ratio(&self, state: &Self::State, lane: usize) -> f64 {
        self.0.volume_ratio(&state.model, lane)
    }

    fn set_volume_ratio(&self, state: &mut Self::State, lane: usize, volume_ratio: f64) -> f64 {
        self.0.set_volume_ratio(&mut state.model, lane, volume_ratio)
    }

    fn report(&self, state: &Self::State, lane: usize) -> PointReport {
        self.0.report(&state.model, lane)
    }
}
