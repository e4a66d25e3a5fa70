//! Artificial bulk viscosity around another model: it spreads shocks over a few cells, so that they do not
//! ring.
//!
//! Where material closes in, at a rate e = −tr d > 0, a pressure
//!
//! p = ρ L e (b₁ c + b₂² L e)
//!
//! is added: the linear term of Landshoff (1955, LA-1930), which damps ringing behind the front, and the
//! quadratic one of von Neumann and Richtmyer (1950, doi:10.1063/1.1699639), which keeps a strong front from
//! collapsing to less than a cell. b₁ = 0.06 and b₂ = 1.2 are the usual constants of explicit finite-element
//! codes. L is the cell length, c the speed of sound at rest. Kirchhoff's J p needs no present density: J ρ =
//! ρ₀.
//!
//! A type parameter, because its pressure is kept per point: the forces of the next substep, also after a
//! sort, are made of it. Time step: with Q = b₁ c + b₂² L e the fastest signal is Q + √(Q² + c²); L e is
//! bounded by twice the speed of the fastest point. Its work, with the mean pressure of a substep as
//! everywhere in the ledger, is `StepSums::viscous_work` and heats nothing.

use super::{ConstitutiveModel, PointReport, StepSums};
use crate::dimension::Dimension;
use crate::points::{BLOCK, Column, PointState};
use crate::simd::{Real, Vector, inlined};
use std::marker::PhantomData;

/// A model with artificial viscosity.
#[derive(Clone, Copy, Debug)]
pub struct Viscous<R, M> {
    model: M,
    /// b₁ (-).
    linear: f64,
    /// b₂ (-).
    quadratic: f64,
    /// L (m).
    length: f64,
    precision: PhantomData<R>,
}

impl<R: Real, M> Viscous<R, M> {
    /// * `linear`, `quadratic`: b₁ and b₂ (-)
    /// * `length`: cell length (m)
    pub fn new(model: M, linear: f64, quadratic: f64, length: f64) -> Self {
        Viscous { model, linear, quadratic, length, precision: PhantomData }
    }
}

/// State of a block of points.
#[derive(Clone, Debug)]
pub struct State<R: Real, S> {
    /// The model's.
    pub inner: S,
    /// J p, at least 0 (Pa).
    pub pressure: Column<R>,
}

impl<R: Real, S: PointState<R>> PointState<R> for State<R, S> {
    const COLUMNS: usize = S::COLUMNS + 1;

    fn zeroed() -> Self {
        State { inner: S::zeroed(), pressure: [R::ZERO; BLOCK] }
    }

    fn column(&self, k: usize) -> &Column<R> {
        if k < S::COLUMNS { self.inner.column(k) } else { &self.pressure }
    }

    fn column_mut(&mut self, k: usize) -> &mut Column<R> {
        if k < S::COLUMNS { self.inner.column_mut(k) } else { &mut self.pressure }
    }
}

/// τ − J p I; the first three components of a symmetric tensor are its diagonal.
#[inline(always)]
fn pressed<D: Dimension, V: Vector>(stress: &D::Symmetric<V>, pressure: V) -> D::Symmetric<V> {
    inlined!(D::symmetric, |component| if component < 3 {
        stress[component] - pressure
    } else {
        stress[component]
    })
}

impl<R: Real, D: Dimension, M: ConstitutiveModel<R, D>> ConstitutiveModel<R, D> for Viscous<R, M> {
    type State = State<R, M::State>;

    fn density(&self) -> f64 {
        self.model.density()
    }

    fn set_density(&mut self, density: f64) {
        self.model.set_density(density);
    }

    fn sound_speed(&self, volume_ratio: f64) -> f64 {
        self.model.sound_speed(volume_ratio)
    }

    fn signal_speed(&self, volume_ratio: f64, fastest: f64) -> f64 {
        let c = self.model.sound_speed(volume_ratio);
        let q = self.linear * c + self.quadratic * self.quadratic * 2.0 * fastest;
        q + q.hypot(c)
    }

    fn yield_volume_strain(&self) -> f64 {
        self.model.yield_volume_strain()
    }

    fn yield_speed(&self) -> f64 {
        self.model.yield_speed()
    }

    fn flow_stress(&self, state: &Self::State, lane: usize) -> f64 {
        self.model.flow_stress(&state.inner, lane)
    }

    fn place(&self, state: &mut Self::State, lane: usize, temperature: f64) {
        self.model.place(&mut state.inner, lane, temperature);
        state.pressure[lane] = R::ZERO;
    }

    #[inline(always)]
    fn stress<V: Vector<Scalar = R>>(&self, state: &Self::State, lane: usize) -> D::Symmetric<V> {
        pressed::<D, V>(&self.model.stress::<V>(&state.inner, lane), V::load(&state.pressure[lane..]))
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
        let stress = self.model.update(&mut state.inner, lane, h, dt, volume, totals);
        let zero = V::constant(0.0);
        let mut closing = zero;
        for axis in 0..D::AXES {
            closing -= h[axis][axis];
        }
        // ρ₀ L b₁ c/Δt and ρ₀ (b₂ L/Δt)².
        let (density, dt) = (self.model.density(), dt.to_f64());
        let per_step = self.length / dt;
        let linear = density * per_step * self.linear * self.model.sound_speed(1.0);
        let quadratic = density * (self.quadratic * per_step) * (self.quadratic * per_step);
        let strain = closing.max(zero);
        let pressure = strain * V::constant(quadratic).mul_add(strain, V::constant(linear));
        let mean = V::constant(0.5) * (pressure + V::load(&state.pressure[lane..]));
        totals.viscous_work = (volume * mean).mul_add(closing, totals.viscous_work);
        pressure.store(&mut state.pressure[lane..]);
        pressed::<D, V>(&stress, pressure)
    }

    fn volume_ratio(&self, state: &Self::State, lane: usize) -> f64 {
        self.model.volume_ratio(&state.inner, lane)
    }

    fn set_volume_ratio(&self, state: &mut Self::State, lane: usize, volume_ratio: f64) -> f64 {
        self.model.set_volume_ratio(&mut state.inner, lane, volume_ratio)
    }

    fn temperature(&self, state: &Self::State, lane: usize) -> f64 {
        self.model.temperature(&state.inner, lane)
    }

    fn present_volume_ratio(&self, state: &Self::State, lane: usize) -> f64 {
        self.model.present_volume_ratio(&state.inner, lane)
    }

    fn expands(&self) -> bool {
        self.model.expands()
    }

    fn set_temperature(&self, state: &mut Self::State, lane: usize, temperature: f64) -> f64 {
        self.model.set_temperature(&mut state.inner, lane, temperature)
    }

    /// What the material is known by; its stress without the viscous pressure.
    fn report(&self, state: &Self::State, lane: usize) -> PointReport {
        self.model.report(&state.inner, lane)
    }
}
