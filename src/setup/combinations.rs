//! Which values go together: the table `resources/combinations.toml`, from which refusals and the book's
//! table are both made.
//!
//! A rule is for some values of one variable and names the values that others must have. The scene that is
//! held against it is the one in use, after presets and speed levels.

use std::sync::LazyLock;

use serde::Deserialize;

use crate::error::Error;
use crate::scene::Scene;
use crate::variables::values_in_use;

const EMBEDDED: &str = include_str!("../../resources/combinations.toml");

/// A variable and values of it.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Condition {
    variable: String,
    values: Vec<String>,
    /// Why, if there is more to say; empty otherwise.
    reason: String,
}

/// What goes with what.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Rule {
    of: Condition,
    needs: Vec<Condition>,
}

/// Refuses a scene in use whose values do not go together.
///
/// # Errors
/// `Error::Inconsistent` naming what was asked, what goes with it, and what the scene has instead.
pub(super) fn check(scene: &Scene) -> Result<(), Error> {
    let values = values_in_use(scene);
    let value_of = |condition: &Condition| {
        let found = values.iter().find(|(name, ..)| *name == condition.variable);
        found.map_or("", |(_, value, _)| value.as_str())
    };
    let holds = |condition: &Condition| condition.values.iter().any(|value| value == value_of(condition));
    for rule in RULES.iter().filter(|rule| holds(&rule.of)) {
        if let Some(need) = rule.needs.iter().find(|need| !holds(need)) {
            let Condition { variable, values, reason } = need;
            let reason = if reason.is_empty() { String::new() } else { format!(" ({reason})") };
            return Err(Error::Inconsistent(format!(
                "{} = {} goes with {variable} = {} only{reason}; {variable} is {} here",
                rule.of.variable,
                value_of(&rule.of),
                values.join(" or "),
                value_of(need)
            )));
        }
    }
    Ok(())
}

static RULES: LazyLock<Vec<Rule>> =
    LazyLock::new(|| parse(EMBEDDED).expect("the table compiled in is read by this module's tests"));

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    rule: Vec<Record>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    of: String,
    needs: Vec<String>,
}

fn parse(text: &str) -> Result<Vec<Rule>, String> {
    let file: File = toml::from_str(text).map_err(|error| error.to_string())?;
    file.rule
        .into_iter()
        .map(|Record { of, needs }| {
            let needs = needs.iter().map(|need| condition(need)).collect::<Result<_, _>>()?;
            Ok(Rule { of: condition(&of)?, needs })
        })
        .collect()
}

fn condition(text: &str) -> Result<Condition, String> {
    let (what, reason) = text.split_once(": ").unwrap_or((text, ""));
    let (variable, values) = what.split_once(" = ").ok_or_else(|| format!("'{text}' has no ' = '"))?;
    Ok(Condition {
        variable: variable.into(),
        values: values.split(" | ").map(String::from).collect(),
        reason: reason.into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ContactChoice, Heat, Law, Precision, TransferChoice};
    use crate::variables::set_by_name;

    /// A misspelt name or value would be a rule that never holds: each can be set.
    #[test]
    fn every_condition_names_a_variable_and_values_of_it() {
        assert!(RULES.len() > 5, "{} rules", RULES.len());
        for condition in RULES.iter().flat_map(|rule| std::iter::once(&rule.of).chain(&rule.needs)) {
            for value in &condition.values {
                let mut scene = Scene::default();
                set_by_name(&mut scene, &condition.variable, value).unwrap();
                let in_use = values_in_use(&scene);
                let found = in_use.iter().find(|(name, ..)| *name == condition.variable);
                assert_eq!(found.map(|(_, shown, _)| shown), Some(value), "{condition:?}");
            }
        }
        assert!(parse("[[rule]]\nof = \"a\"\nneeds = []\n").is_err());
    }

    /// What people try is refused with both names and what there is instead; the reference cut goes.
    #[test]
    fn combinations_that_are_left_out_are_refused_by_name() {
        type Change = fn(&mut Scene);
        let cases: [(Change, &str); 8] = [
            (
                |s| (s.effects.damage, s.effects.artificial_viscosity) = (true, true),
                "effects.artificial_viscosity = true goes with effects.damage = false only; effects.damage is true here",
            ),
            (
                |s| (s.effects.damage, s.effects.thermal_expansion) = (true, true),
                "effects.damage = true goes with effects.thermal_expansion = false only",
            ),
            (
                |s| (s.numerics.transfer, s.numerics.precision) = (TransferChoice::Apic, Precision::Single),
                "numerics.transfer = apic goes with numerics.precision = double only (numerics.speed = exact has it); \
                 numerics.precision is single here",
            ),
            (
                |s| (s.effects.tool_heat, s.effects.heat) = (true, Heat::Adiabatic),
                "effects.tool_heat = true goes with effects.heat = conduction only",
            ),
            (
                |s| (s.effects.thermal_expansion, s.effects.heat) = (true, Heat::None),
                "effects.heat = adiabatic or conduction only",
            ),
            (
                |s| (s.numerics.contact, s.effects.sticking) = (ContactChoice::Velocity, true),
                "numerics.contact = velocity goes with effects.sticking = false only",
            ),
            (
                |s| (s.material.law, s.effects.damage) = (Law::ZerilliArmstrong, true),
                "material.law = zerilli_armstrong goes with effects.damage = false only",
            ),
            (
                |s| (s.material.law, s.effects.thermal_softening) = (Law::JohnsonCookTanh, false),
                "effects.thermal_softening = true only (the law softens with temperature)",
            ),
        ];
        assert_eq!(check(&Scene::default()), Ok(()));
        for (change, expected) in cases {
            let mut scene = Scene::default();
            change(&mut scene);
            let text = check(&scene).unwrap_err().to_string();
            assert!(text.contains(expected), "{text}");
        }
    }
}
