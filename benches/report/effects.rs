//! What each effect costs and what it changes: the table behind `cargo xtask effects`.
//!
//! An effect is one line of `EFFECTS`: the reference cut without it, and what to set for it. Instructions are
//! counted under callgrind between two places of a coarse cut; forces, strain and temperature come from the
//! cut itself.

use crate::cuts::{Numbers, Plan};
use serde_json::{Value, json};
use swarf::scene::{Heat, Law, Scene, TransferChoice};
use swarf::session::Session;
use swarf::simd::InstructionSet;

/// An effect: what it is called, what the reference cut has beneath it, and what calls for it.
pub struct Effect {
    /// Name in the table.
    pub name: &'static str,
    without: fn(&mut Scene),
    with: fn(&mut Scene),
}

/// The reference cut as it is: rate, adiabatic heat with softening, friction 0.2, locking control.
fn reference(_: &mut Scene) {}

fn conducting(scene: &mut Scene) {
    scene.effects.heat = Heat::Conduction;
}

/// The only material that has constants of both laws.
fn titanium(scene: &mut Scene) {
    scene.material.name = "Ti-6Al-4V".into();
}

/// All effects; one that this version does not have, or not with the others, is shown as refused.
pub const EFFECTS: [Effect; 12] = [
    Effect {
        name: "heat",
        without: |s| {
            s.effects.heat = Heat::None;
            s.effects.thermal_softening = false;
        },
        with: reference,
    },
    Effect { name: "rate", without: |s| s.effects.rate = false, with: reference },
    Effect { name: "friction", without: |s| s.inputs.friction = 0.0, with: reference },
    Effect { name: "conduction", without: reference, with: conducting },
    Effect {
        name: "tool-heat",
        without: conducting,
        with: |s| {
            conducting(s);
            s.effects.tool_heat = true;
        },
    },
    Effect { name: "expansion", without: reference, with: |s| s.effects.thermal_expansion = true },
    Effect { name: "damage", without: reference, with: |s| s.effects.damage = true },
    Effect {
        name: "tanh-law",
        without: titanium,
        with: |s| {
            titanium(s);
            s.material.law = Law::JohnsonCookTanh;
        },
    },
    Effect { name: "sticking", without: reference, with: |s| s.effects.sticking = true },
    Effect { name: "viscosity", without: reference, with: |s| s.effects.artificial_viscosity = true },
    Effect {
        name: "locking-control",
        without: |s| s.effects.volumetric_locking_control = false,
        with: |s| s.effects.volumetric_locking_control = true,
    },
    Effect { name: "apic", without: reference, with: |s| s.numerics.transfer = TransferChoice::Apic },
];

/// Distance of points for instruction counts (m): 1,875 points; and for the cut itself: 30,000.
const FINE: f64 = 1e-5;
/// Coarsening at which instructions are counted.
pub const COARSE: f64 = 4.0;

/// Finds an effect.
pub fn find(name: &str) -> Option<&'static Effect> {
    EFFECTS.iter().find(|effect| effect.name == name)
}

impl Effect {
    fn scene(&self, has_effect: bool, spacing: f64) -> Scene {
        let mut scene = Scene::default();
        scene.numerics.point_spacing = spacing;
        scene.numerics.threads = 1;
        if has_effect {
            (self.with)(&mut scene);
        } else {
            (self.without)(&mut scene);
        }
        scene
    }

    /// Runs a cut to a place (mm of travel) for callgrind; prints its points, substeps and instruction set.
    ///
    /// * `coarsening`: distance of points over the reference's; `COARSE` for the table
    ///
    /// # Errors
    /// What the program says against the scene.
    pub fn count(&self, has_effect: bool, millimetres: f64, coarsening: f64) -> Result<(), String> {
        let scene = self.scene(has_effect, FINE * coarsening);
        let mut session = Session::new(&scene, 0.0).map_err(|e| e.to_string())?;
        let end = 1e-3 * millimetres / scene.inputs.tool_velocity;
        session.advance_to(end, &mut |_| true).map_err(|e| e.to_string())?;
        let outputs = session.outputs();
        let set = InstructionSet::detect().name();
        println!("points {} substeps {} instructions {set}", outputs.active_points, outputs.substeps);
        Ok(())
    }

    /// Runs the cut with and without the effect.
    pub fn compare(&self, coarsening: f64) -> Value {
        let run = |has_effect: bool| -> Result<(Numbers, usize), String> {
            let scene = self.scene(has_effect, FINE * coarsening);
            let bytes = Session::new(&scene, 0.0).map_err(|e| e.to_string())?.bytes_per_point();
            Ok((Plan { scene, travel: 1.6e-3, settled: 1e-3 }.run()?, bytes))
        };
        match (run(false), run(true)) {
            (Ok((without, bytes)), Ok((with, more))) => json!({
                "effect": self.name,
                "bytes_per_point": [bytes, more],
                "without": without.to_json("without", &without),
                "with": with.to_json("with", &without),
            }),
            (Err(text), _) | (_, Err(text)) => json!({"effect": self.name, "refused": text}),
        }
    }
}
