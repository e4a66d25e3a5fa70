//! The library's file as it stands (`resources/materials.toml`), and the entries that it gives.

use serde::Deserialize;

use super::Entry;
use crate::scene::{Constants, Law, Scene, ZerilliArmstrong};

/// The file as it stands.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Library {
    pub material: Vec<Record>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Record {
    name: String,
    elastic: Elastic,
    flow: Flow,
    thermal: Thermal,
    damage: Damage,
    tanh: Option<Tanh>,
    zerilli_armstrong: Option<ZerilliArmstrongRecord>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Elastic {
    density: f64,
    youngs_modulus: f64,
    poissons_ratio: f64,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Flow {
    yield_stress: f64,
    hardening_modulus: f64,
    hardening_exponent: f64,
    rate_coefficient: f64,
    reference_rate: f64,
    thermal_exponent: f64,
    melting_temperature: f64,
    reference_temperature: f64,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Thermal {
    specific_heat: f64,
    conductivity: f64,
    thermal_expansion: f64,
    taylor_quinney: f64,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Damage {
    d1: f64,
    d2: f64,
    d3: f64,
    d4: f64,
    d5: f64,
    fracture_energy: f64,
    source: String,
}

/// What Sima and Özel's law needs beside `Flow`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Tanh {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
    s: f64,
    source: String,
}

/// Zerilli and Armstrong's constants.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ZerilliArmstrongRecord {
    c0: f64,
    c1: f64,
    c3: f64,
    c4: f64,
    c5: f64,
    n: f64,
    source: String,
}

impl From<Record> for Entry {
    fn from(record: Record) -> Self {
        let Record { name, elastic, flow, thermal, damage, tanh, zerilli_armstrong } = record;
        let mut laws = vec![Law::JohnsonCook];
        laws.extend(tanh.is_some().then_some(Law::JohnsonCookTanh));
        laws.extend(zerilli_armstrong.is_some().then_some(Law::ZerilliArmstrong));
        // A material without a law's constants refuses the law; the start values stand for nothing.
        let starts = Scene::default().material.constants;
        let further = |law: &str, source: Option<&String>| {
            source.map_or(String::new(), |source| format!(" {law}: {source}."))
        };
        Entry {
            name,
            constants: Constants {
                density: elastic.density,
                youngs_modulus: elastic.youngs_modulus,
                poissons_ratio: elastic.poissons_ratio,
                yield_stress: flow.yield_stress,
                hardening_modulus: flow.hardening_modulus,
                hardening_exponent: flow.hardening_exponent,
                rate_coefficient: flow.rate_coefficient,
                reference_rate: flow.reference_rate,
                thermal_exponent: flow.thermal_exponent,
                melting_temperature: flow.melting_temperature,
                reference_temperature: flow.reference_temperature,
                specific_heat: thermal.specific_heat,
                conductivity: thermal.conductivity,
                thermal_expansion: thermal.thermal_expansion,
                taylor_quinney: thermal.taylor_quinney,
                damage: [damage.d1, damage.d2, damage.d3, damage.d4, damage.d5],
                fracture_energy: damage.fracture_energy,
                tanh: tanh.as_ref().map_or(starts.tanh, |t| [t.a, t.b, t.c, t.d, t.s]),
                zerilli_armstrong: zerilli_armstrong.as_ref().map_or(starts.zerilli_armstrong, |z| {
                    ZerilliArmstrong { c0: z.c0, c1: z.c1, c3: z.c3, c4: z.c4, c5: z.c5, n: z.n }
                }),
            },
            laws,
            source: format!(
                "elastic: {}. flow stress: {}. thermal: {}. damage: {}.{}{}",
                elastic.source,
                flow.source,
                thermal.source,
                damage.source,
                further("johnson_cook_tanh", tanh.as_ref().map(|t| &t.source)),
                further("zerilli_armstrong", zerilli_armstrong.as_ref().map(|z| &z.source)),
            ),
        }
    }
}
