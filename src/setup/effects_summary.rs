//! The line of the log that says which effects run, and why.

use crate::scene::{ContactChoice, Heat, Law, Scene, TransferChoice, speed_levels};
use crate::speedups::mass_scaling::MassScaling;

/// One line on which effects run and why.
pub fn effects_summary(scene: &Scene) -> String {
    let constants = &scene.material.constants;
    let with = |does: bool| if does { "with" } else { "without" };
    let rate = if !scene.effects.rate {
        "rate off (effects.rate)"
    } else if constants.rate_coefficient == 0.0 {
        "rate off (its coefficient is 0)"
    } else {
        "rate on"
    };
    let heat = match (scene.effects.heat, scene.effects.thermal_softening) {
        (Heat::None, false) => "no temperature".into(),
        (Heat::None, true) => {
            format!("constant temperature {} K with its softening", scene.workpiece.initial_temperature)
        }
        (Heat::Adiabatic, softens) => format!("adiabatic heat {} softening", with(softens)),
        (Heat::Conduction, softens) => {
            let start = if constants.taylor_quinney > 0.0 {
                "from the first plastic work on"
            } else {
                "once there is friction (plastic work does not heat: material.taylor_quinney is 0)"
            };
            format!("heat conduction {start}, {} softening", with(softens))
        }
    };
    let expansion = if scene.effects.thermal_expansion { ", thermal expansion" } else { "" };
    let tool_heat = if scene.effects.tool_heat { ", heat flows into the tool" } else { "" };
    let locking = if scene.numerics.separates() {
        ", averages over cells, chip and work parted at the edge"
    } else if scene.effects.volumetric_locking_control {
        ", volumetric locking control"
    } else {
        ""
    };
    let friction = if scene.inputs.friction == 0.0 { "friction 0 at the start" } else { "friction" };
    let sticking = if scene.effects.sticking { " capped by the shear strength" } else { "" };
    let contact = match scene.numerics.contact {
        ContactChoice::Surface => "contact of the points at the exact tool surface",
        ContactChoice::Distance => {
            "contact on nodes shared with a tool made of points, within half a cell (distance law)"
        }
        ContactChoice::Velocity => "contact on nodes shared with a tool made of points (velocity law)",
    };
    let mass_factor = MassScaling::of(scene).map_or(1.0, |s| s.wanted(scene.inputs.tool_velocity.abs()));
    let speedups = speed_levels::summary(scene, mass_factor);
    let transfer = match scene.numerics.transfer {
        TransferChoice::Flip => "",
        TransferChoice::Apic => ", affine transfer (APIC)",
    };
    let law = match scene.material.law {
        Law::JohnsonCook => "",
        Law::JohnsonCookTanh => ", tanh law with strain softening",
        Law::ZerilliArmstrong => ", Zerilli-Armstrong law",
    };
    let damage = if scene.effects.damage {
        format!(", damage with {} J/m2 to separate", constants.fracture_energy)
    } else {
        String::new()
    };
    let viscosity = if scene.effects.artificial_viscosity { ", artificial viscosity" } else { "" };
    format!(
        "effects: plasticity ({}{law}), {rate}, {heat}{damage}{viscosity}, \
         {friction}{sticking}{expansion}{tool_heat}{locking}{transfer}; {contact}{}{speedups}",
        scene.material.name,
        if speedups.is_empty() { "" } else { "; " }
    )
}
