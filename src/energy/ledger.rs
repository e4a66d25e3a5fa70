//! The energy ledger: where the tool's work went.
//!
//! tool work + mass scaling = kinetic + elastic + plastic + friction + damping + contact + retired
//!                          + thermoelastic + damage + viscous
//!
//! Each term is computed from what it names and none as a remainder, so the balance is a test of the solver:
//!
//! * kinetic and elastic: from the points' velocities and stresses;
//! * plastic: flow stress times strain increment at each return;
//! * damage: plastic work of points past the initiation of damage, and the elastic energy that damage
//!   releases;
//! * viscous: work of the artificial viscosity, which heats nothing;
//! * friction: friction impulse times slip;
//! * contact: ½ m |Δv|² of nodes brought to the tool's or a wall's velocity in one substep (inelastic impact;
//!   at points that touch, half the contact impulse times the change of their velocity, which is contact's
//!   share of the same sum), and the work of contact impulses on what approach is left (`contact::surface`);
//! * damping: what the scheme itself dissipates. A substep changes the points' kinetic energy by the work of
//!   all forces at the new grid velocity less Σ_nodes m |Δv|² − ½ Σ_points m |Δv|², and their stored and
//!   plastic energy by the stress power with the mean stress, ½ Σ V₀ Δτ : h more than the grid's forces give.
//!   So damping = Σ_nodes m |Δv|² − ½ Σ_points m |Δv|² − ½ Σ V₀ Δτ : h − contact. Half of the first term is
//!   FLIP's filter (at least 0 by Jensen's inequality); the rest oscillates about zero in elastic waves, and
//!   is lost where a node has so little mass that its points do not take over its velocity; With smoothed
//!   increments (`partition::smoothing`) the points' strain and their velocities follow different increments:
//!   the first term is Σ_nodes m Δv·P′Δv there, and what impulses J of the tool do on the difference, Σ J·(Δv
//!   − P′Δv), is damping too; With APIC (`transfer::apic`), whose points take the grid's velocity, their
//!   kinetic energy changes by what it changes: the work of all forces, Σ_nodes m Δv·v, less the gain of ½
//!   Σ_points m |v|² takes the place of the first two terms, and damping holds what goes into the points'
//!   affine fields and comes back from there;
//! * mass scaling: kinetic energy that changes of the mass factor bring in, at constant velocity;
//! * thermoelastic: elastic energy that heat took, or gave where it is negative (expansion of material under
//!   pressure); the heat itself is not lessened by it, which is a part of some 3 α T₀ κ/(ρ c) of pressure
//!   changes, and small;
//! * retired: kinetic and elastic energy of points that left the domain.

use crate::partition::nodes::NodeSums;
use crate::transfer::PassSums;
use serde::{Deserialize, Serialize};

/// Running totals since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Work of the tool on the workpiece (J).
    pub tool_work: f64,
    /// Plastic work (J).
    pub plastic_work: f64,
    /// Work of separation (J).
    pub damage_work: f64,
    /// Work of artificial viscosity (J).
    pub viscous_work: f64,
    /// Friction work (J).
    pub friction_work: f64,
    /// Elastic energy that heat took by expanding the material (J).
    pub thermoelastic: f64,
    /// Dissipated by the scheme: transfer between grid and points, and time integration (J).
    pub damping: f64,
    /// Dissipated by inelastic contact (J).
    pub contact_loss: f64,
    /// Impulse of the tool on the workpiece (N s).
    pub tool_impulse: [f64; 2],
    /// Points that left the domain.
    pub retired_points: u32,
    /// Their mass (kg).
    pub retired_mass: f64,
    /// Their kinetic and elastic energy (J).
    pub retired_energy: f64,
    /// Heat stored in them (J).
    pub retired_heat: f64,
    /// Kinetic energy brought in by changes of the mass factor (J).
    pub mass_scaling: f64,
    /// Kinetic energy at the start (J).
    pub initial_energy: f64,
}

impl Ledger {
    /// Adds the sums of a substep over the nodes that a chunk owns and over its points, in the order of the
    /// chunks.
    pub fn add(&mut self, nodes: &NodeSums, points: &PassSums) {
        self.tool_work += nodes.tool_work;
        self.friction_work += nodes.friction_work;
        self.contact_loss += nodes.contact_loss - nodes.approach_work;
        self.damping +=
            2.0 * nodes.increment_energy - points.increment_energy - points.stress_lag - nodes.contact_loss;
        self.plastic_work += points.plastic_work;
        self.thermoelastic += points.thermoelastic;
        self.damage_work += points.damage_work;
        self.viscous_work += points.viscous_work;
        self.tool_impulse[0] += nodes.tool_impulse[0];
        self.tool_impulse[1] += nodes.tool_impulse[1];
    }

    /// Whether every term is a finite number.
    pub fn is_finite(&self) -> bool {
        self.imbalance(0.0, 0.0).is_finite()
    }

    /// Unaccounted energy (J), given the present kinetic and elastic energy (J).
    pub fn imbalance(&self, kinetic: f64, elastic: f64) -> f64 {
        self.tool_work + self.mass_scaling + self.initial_energy
            - kinetic
            - elastic
            - self.plastic_work
            - self.damage_work
            - self.viscous_work
            - self.friction_work
            - self.thermoelastic
            - self.damping
            - self.contact_loss
            - self.retired_energy
    }
}
