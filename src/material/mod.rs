//! Materials: what a point of matter answers when it is strained.
//!
//! The solver sees [`ConstitutiveModel`] alone. `j2_plasticity` is the model: `elasticity`, a flow law
//! (`flow_law`), damage (`damage`), joined by the return to the yield surface (`return_mapping`); `viscosity`
//! wraps any model. Flow laws are `multiplicative` (Johnson–Cook and its tanh form: `hardening` × `rate` ×
//! `effects`) and `zerilli_armstrong`; `library` holds constants by name.
//!
//! To add a flow law: a file here that implements `FlowLaw`, most simply with `Slopes`, an item of
//! `scene::Law` with its constants, an arm of `setup::with_law`. `j2_plasticity`, `return_mapping` and the
//! other laws stay as they are; what the present laws compute does not change by a bit (book: *Develop*, "A
//! stranger's walk").

pub mod damage;
pub mod effects;
mod elasticity;
pub mod flow_law;
pub mod hardening;
pub mod j2_plasticity;
pub mod library;
pub mod multiplicative;
pub mod rate;
mod return_mapping;
pub mod viscosity;
pub mod zerilli_armstrong;

use crate::dimension::Dimension;
use crate::points::PointState;
use crate::simd::{Real, Vector};

/// What a model adds up over the points of one pass, side by side.
#[derive(Clone, Copy, Debug)]
pub struct StepSums<V> {
    /// Plastic work (J).
    pub plastic_work: V,
    /// Elastic energy that rising temperatures took, negative where they gave it (J).
    pub thermoelastic: V,
    /// Work of separation: plastic work past the initiation of damage, and elastic energy that damage
    /// releases (J).
    pub damage_work: V,
    /// Work of artificial viscosity (J).
    pub viscous_work: V,
    /// Largest elastic volume ratio (-).
    pub volume_ratio: V,
}

impl<V: Vector> StepSums<V> {
    /// Nothing yet.
    #[inline(always)]
    pub fn zero() -> Self {
        let zero = V::constant(0.0);
        StepSums {
            plastic_work: zero,
            thermoelastic: zero,
            damage_work: zero,
            viscous_work: zero,
            volume_ratio: zero,
        }
    }
}

/// What is known of one point's material, for outputs and files.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointReport {
    /// Volume ratio det F (-).
    pub jacobian: f64,
    /// Cauchy stress xx, yy, zz, yz, xz, xy (Pa).
    pub stress: [f64; 6],
    /// Equivalent plastic strain (-).
    pub plastic_strain: f64,
    /// Temperature (K).
    pub temperature: f64,
    /// Elastic energy per volume at the start (J/m3).
    pub elastic_energy: f64,
    /// Heat stored since the start per volume at the start (J/m3).
    pub heat: f64,
    /// Damage (-), 1 for a point that has failed.
    pub damage: f64,
}

/// A constitutive model: from the increment of the displacement gradient to stress.
///
/// Stress is Kirchhoff's, τ = J σ: with it the internal force −V₀ τ ∇N and the stress power V₀ τ : d need no
/// present volume.
pub trait ConstitutiveModel<R: Real, D: Dimension>: Clone + Send + Sync + 'static {
    /// What it keeps per point.
    type State: PointState<R>;

    /// Density at the start (kg/m3).
    fn density(&self) -> f64;

    /// Takes another density (kg/m3) for inertia; stress and heat are not concerned.
    fn set_density(&mut self, density: f64);

    /// Speed of the fastest wave (m/s) when no point's volume ratio exceeds `volume_ratio` (-).
    fn sound_speed(&self, volume_ratio: f64) -> f64;

    /// The same where points move at `fastest` (m/s) at most, for the time step: viscosity makes it appear
    /// faster.
    fn signal_speed(&self, volume_ratio: f64, fastest: f64) -> f64 {
        let _ = fastest;
        self.sound_speed(volume_ratio)
    }

    /// Volume strain (-) whose pressure equals the yield stress at the start; infinite for a material that
    /// never yields.
    fn yield_volume_strain(&self) -> f64 {
        f64::INFINITY
    }

    /// Speed (m/s) that stress at yield gives a free surface, σ_y/(ρ c); infinite for a material that never
    /// yields.
    fn yield_speed(&self) -> f64 {
        f64::INFINITY
    }

    /// Flow stress (Pa) of the point at `lane` as it is now; infinite for a material that never yields.
    fn flow_stress(&self, state: &Self::State, lane: usize) -> f64 {
        let _ = (state, lane);
        f64::INFINITY
    }

    /// Puts an unstressed point of a temperature (K) at `lane`.
    fn place(&self, state: &mut Self::State, lane: usize, temperature: f64);

    /// Kirchhoff stress (Pa) of the points `lane..lane + LANES`.
    fn stress<V: Vector<Scalar = R>>(&self, state: &Self::State, lane: usize) -> D::Symmetric<V>;

    /// Advances the points `lane..lane + LANES` and returns their Kirchhoff stress (Pa).
    ///
    /// * `h`: Δt ∂v_row/∂x_column (-)
    /// * `dt`: substep (s)
    /// * `volume`: volume at the start (m3), the weight of a point in `totals`
    fn update<V: Vector<Scalar = R>>(
        &self,
        state: &mut Self::State,
        lane: usize,
        h: &D::Matrix<V>,
        dt: R,
        volume: V,
        totals: &mut StepSums<V>,
    ) -> D::Symmetric<V>;

    /// Elastic volume ratio (-) of the point at `lane`: det F where heat does not expand the material.
    fn volume_ratio(&self, state: &Self::State, lane: usize) -> f64;

    /// Volume ratio det F (-) of the point at `lane`.
    fn present_volume_ratio(&self, state: &Self::State, lane: usize) -> f64 {
        self.volume_ratio(state, lane)
    }

    /// Gives the point at `lane` another elastic volume ratio (-); returns by how much its elastic energy
    /// falls per volume at the start (J/m3).
    fn set_volume_ratio(&self, state: &mut Self::State, lane: usize, volume_ratio: f64) -> f64;

    /// Temperature (K) of the point at `lane`.
    fn temperature(&self, state: &Self::State, lane: usize) -> f64 {
        self.report(state, lane).temperature
    }

    /// Whether heat makes the material expand, so that stresses follow temperatures.
    fn expands(&self) -> bool {
        false
    }

    /// Gives the point at `lane` another temperature (K), with the flow stress at rest and the elastic volume
    /// ratio that go with it at the same det F; returns by how much its elastic energy falls per volume at
    /// the start (J/m3).
    ///
    /// For models that keep a temperature only; a scene without one has no pass that would call it.
    fn set_temperature(&self, _state: &mut Self::State, lane: usize, temperature: f64) -> f64 {
        debug_assert!(false, "point {lane} keeps no temperature and was given {temperature} K");
        0.0
    }

    /// What is known of the point at `lane`.
    fn report(&self, state: &Self::State, lane: usize) -> PointReport;
}
