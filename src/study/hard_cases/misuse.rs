//! Scenes that make no sense: refused by name, ended by a guard, or computed with a closed ledger, but never
//! passed over.
//!
//! Each is asked for twice: as an importer would, with the ranges of the variable table in front
//! (`variables`), and past them, where only the solver's own guards stand. Of those the ledger's bound is
//! what the watch stops a run at (`energy::watch`).

use super::monitor::{Watched, cut};
use super::{Setting, Sheet};
use crate::Error;
use crate::energy::watch::ENERGY_LIMIT;
use crate::scene::{Heat, Scene};
use crate::variables;
use rayon::prelude::*;

/// A scene with its name, and a word that a refusal by the interface must contain; none where the interface
/// lets it pass.
struct Misuse {
    name: &'static str,
    refused_for: Option<&'static str>,
    make: fn(&mut Scene),
}

const MISUSES: [Misuse; 15] = [
    Misuse {
        name: "Courant number 1.5",
        refused_for: Some("numerics.courant"),
        make: |s| s.numerics.courant = 1.5,
    },
    Misuse {
        name: "Courant number 0.7",
        refused_for: Some("numerics.courant"),
        make: |s| s.numerics.courant = 0.7,
    },
    Misuse {
        name: "conductivity times 1000",
        refused_for: Some("material.conductivity"),
        make: |s| {
            s.effects.heat = Heat::Conduction;
            s.material.constants.conductivity *= 1000.0;
        },
    },
    Misuse {
        name: "conductivity times 100",
        refused_for: None,
        make: |s| {
            s.effects.heat = Heat::Conduction;
            s.material.constants.conductivity *= 100.0;
        },
    },
    Misuse {
        name: "no hardening",
        refused_for: None,
        make: |s| s.material.constants.hardening_modulus = 0.0,
    },
    Misuse { name: "n = 0", refused_for: None, make: |s| s.material.constants.hardening_exponent = 0.0 },
    Misuse { name: "C = 0", refused_for: None, make: |s| s.material.constants.rate_coefficient = 0.0 },
    Misuse { name: "m = 0.1", refused_for: None, make: |s| s.material.constants.thermal_exponent = 0.1 },
    Misuse {
        name: "Poisson's ratio 0.499",
        refused_for: Some("material.poissons_ratio"),
        make: |s| s.material.constants.poissons_ratio = 0.499,
    },
    Misuse {
        name: "Poisson's ratio 0.495",
        refused_for: None,
        make: |s| s.material.constants.poissons_ratio = 0.495,
    },
    Misuse {
        name: "density over 1000",
        refused_for: Some("material.density"),
        make: |s| s.material.constants.density /= 1e3,
    },
    Misuse {
        name: "density times 1000",
        refused_for: Some("material.density"),
        make: |s| s.material.constants.density *= 1e3,
    },
    Misuse {
        name: "Young's modulus in GPa",
        refused_for: Some("material.youngs_modulus"),
        make: |s| s.material.constants.youngs_modulus /= 1e9,
    },
    Misuse {
        name: "melting below the reference temperature",
        refused_for: Some("material.melting_temperature"),
        make: |s| s.material.constants.melting_temperature = 290.0,
    },
    Misuse {
        name: "Poisson's ratio 0.5",
        refused_for: Some("material.poissons_ratio"),
        make: |s| s.material.constants.poissons_ratio = 0.5,
    },
];

/// Fills the sheet.
pub fn fill(setting: &Setting, sheet: &mut Sheet) {
    let runs: Vec<_> = MISUSES
        .par_iter()
        .with_max_len(1)
        .map(|misuse| {
            let mut scene = cut(setting.pick(4e-5, 2e-5));
            scene.material.name = "custom".into();
            (misuse.make)(&mut scene);
            let refusal = variables::check_ranges(&scene)
                .and_then(|()| crate::setup::checks::check(&scene).map(|_| ()));
            let mut run = Watched::new(&scene);
            run.run(8e-4 / scene.inputs.tool_velocity, 16);
            (misuse, refusal, run)
        })
        .collect();
    for (misuse, refusal, run) in runs {
        let name = misuse.name;
        if let Some(word) = misuse.refused_for {
            let text = refusal.as_ref().map_or_else(ToString::to_string, |()| "taken".into());
            let is_named = f64::from(u8::from(text.contains(word)));
            sheet.at_least(format!("{name}: refused by the interface"), is_named, "", 1.0).remarked(text);
        } else if let Err(error) = refusal {
            sheet.at_most(format!("{name}: taken"), f64::NAN, "", 0.0).remarked(error.to_string());
        }
        let bound = if misuse.refused_for.is_some() { 100.0 * ENERGY_LIMIT } else { 1.0 };
        let past = if misuse.refused_for.is_some() { " past the interface" } else { "" };
        let retries = run.outputs().retries;
        match &run.error {
            Some(error) => {
                let figure = sheet.at_least(
                    format!("{name}{past}: ends in an error that names its cause"),
                    f64::from(u8::from(names_a_cause(error))),
                    "",
                    1.0,
                );
                figure.retried(retries).remarked(error.to_string());
                let ledger = 100.0 * run.worst.ledger;
                sheet.show(format!("{name}{past}: ledger until then"), ledger, "%");
            }
            None => {
                let ledger = 100.0 * run.worst.ledger;
                sheet.at_most(format!("{name}{past}: runs, ledger"), ledger, "%", bound).retried(retries);
            }
        }
        if run.worst.not_finite > 0 {
            sheet.at_most(
                format!("{name}{past}: numbers that are none"),
                run.worst.not_finite as f64,
                "",
                0.0,
            );
        }
    }
}

/// Whether an error tells a user what to look at: a variable's name, or what became unstable when and why.
pub fn names_a_cause(error: &Error) -> bool {
    let text = error.to_string();
    let names_a_variable = variables::all().any(|variable| text.contains(variable.name));
    match error {
        Error::Unstable(_) => text.contains("t = "),
        Error::File { .. } => true,
        _ => names_a_variable,
    }
}
