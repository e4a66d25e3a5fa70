//! What modelDescription.xml says of the variables: type, unit, start value, enumeration items, default
//! experiment.
//!
//! Read here with quick-xml, because `fmi-schema` leaves out units, strings' starts and enumeration items.

use std::collections::BTreeMap;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// Type of a variable.
#[derive(Clone, Debug, PartialEq)]
pub enum Type {
    /// A quantity, with its unit (empty for none).
    Real(String),
    /// A whole number.
    Integer,
    /// Yes or no.
    Boolean,
    /// A text.
    Text,
    /// One of these names, numbered from the given numbers.
    Enumeration(Vec<(String, i32)>),
}

/// One variable.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Structured name.
    pub name: String,
    /// Value reference.
    pub reference: u32,
    /// "parameter", "input" or "output".
    pub causality: String,
    /// Type.
    pub kind: Type,
    /// Start value as written.
    pub start: Option<String>,
}

/// The description.
#[derive(Clone, Debug, Default)]
pub struct Description {
    /// Variables in the file's order.
    pub variables: Vec<Variable>,
    /// End of the default experiment (s).
    pub stop_time: f64,
    /// Communication step of the default experiment (s).
    pub step_size: f64,
    /// Version of the model.
    pub version: String,
}

impl Description {
    /// Reads the text of modelDescription.xml.
    ///
    /// # Errors
    /// Says what is wrong with the XML.
    pub fn read(xml: &str) -> Result<Description, String> {
        let mut reader = Reader::from_str(xml);
        let mut found = Description { stop_time: 4e-5, step_size: 1e-6, ..Description::default() };
        let mut items: BTreeMap<String, Vec<(String, i32)>> = BTreeMap::new();
        let (mut type_name, mut current) = (String::new(), None);
        loop {
            let event = reader.read_event().map_err(|e| format!("modelDescription.xml: {e}"))?;
            let tag = match &event {
                Event::Start(tag) | Event::Empty(tag) => tag,
                Event::Eof => return Ok(found),
                _ => continue,
            };
            let attributes = attributes(tag)?;
            let text = |name: &str| attributes.get(name).cloned().unwrap_or_default();
            let number = |name: &str, default: f64| text(name).parse().unwrap_or(default);
            match tag.name().as_ref() {
                "fmiModelDescription" => found.version = text("version"),
                "DefaultExperiment" => {
                    found.stop_time = number("stopTime", found.stop_time);
                    found.step_size = number("stepSize", found.step_size);
                }
                "SimpleType" => type_name = text("name"),
                "Item" => {
                    let item = (text("name"), number("value", 0.0) as i32);
                    items.entry(type_name.clone()).or_default().push(item);
                }
                "ScalarVariable" => current = Some((text("name"), text("valueReference"), text("causality"))),
                element => {
                    let kind = match element {
                        "Real" => Type::Real(text("unit")),
                        "Integer" => Type::Integer,
                        "Boolean" => Type::Boolean,
                        "String" => Type::Text,
                        "Enumeration" => {
                            Type::Enumeration(items.get(&text("declaredType")).cloned().unwrap_or_default())
                        }
                        _ => continue,
                    };
                    // Elements of the type definitions have no variable around them.
                    let Some((name, reference, causality)) = current.take() else { continue };
                    let reference =
                        reference.parse().map_err(|_| format!("{name} has value reference '{reference}'"))?;
                    let start = attributes.get("start").cloned();
                    found.variables.push(Variable { name, reference, causality, kind, start });
                }
            }
        }
    }

    /// Values as text with their variables' units behind: what the heads of files say.
    pub fn with_units(&self, values: &[(String, String)]) -> Vec<(String, String)> {
        let unit = |name: &str| match self.variable(name).map(|variable| &variable.kind) {
            Ok(Type::Real(unit)) if !unit.is_empty() && unit != "1" => format!(" {unit}"),
            _ => String::new(),
        };
        values.iter().map(|(name, value)| (name.clone(), format!("{value}{}", unit(name)))).collect()
    }

    /// The variable of a name, or a message with the names most like it.
    ///
    /// # Errors
    /// When there is no such variable.
    pub fn variable(&self, name: &str) -> Result<&Variable, String> {
        self.variables.iter().find(|variable| variable.name == name).ok_or_else(|| {
            let mut near: Vec<(usize, &str)> =
                self.variables.iter().map(|v| (distance(name, &v.name), v.name.as_str())).collect();
            near.sort_unstable();
            let near: Vec<&str> = near.iter().take(3).map(|entry| entry.1).collect();
            format!("the FMU has no variable '{name}'; did you mean {}?", near.join(", "))
        })
    }
}

fn attributes(tag: &BytesStart) -> Result<BTreeMap<String, String>, String> {
    let mut found = BTreeMap::new();
    for attribute in tag.attributes() {
        let attribute = attribute.map_err(|e| format!("modelDescription.xml: {e}"))?;
        let name = attribute.key.as_ref().to_string();
        let value = quick_xml::escape::unescape(&attribute.value)
            .map_err(|e| format!("modelDescription.xml: {e}"))?
            .into_owned();
        found.insert(name, value);
    }
    Ok(found)
}

/// How many letters have to be changed, added or dropped to turn one word into the other (Levenshtein 1966).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut corner = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let change = corner + usize::from(x != *y);
            corner = row[j + 1];
            row[j + 1] = change.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = r#"<fmiModelDescription fmiVersion="2.0" version="0.1.0">
      <TypeDefinitions><SimpleType name="Heat"><Enumeration><Item name="none" value="1"/>
      <Item name="adiabatic" value="2"/></Enumeration></SimpleType></TypeDefinitions>
      <DefaultExperiment startTime="0" stopTime="4e-5" stepSize="1e-6"/>
      <ModelVariables>
      <ScalarVariable name="feed" valueReference="2" causality="input"><Real unit="m" start="3e-4"/></ScalarVariable>
      <ScalarVariable name="effects.heat" valueReference="1003" causality="parameter">
        <Enumeration declaredType="Heat" start="2"/></ScalarVariable>
      <ScalarVariable name="material.name" valueReference="1004" causality="parameter">
        <String start="a &amp; b"/></ScalarVariable>
      </ModelVariables></fmiModelDescription>"#;

    /// `--set` needs each variable's type, and an enumeration's names.
    #[test]
    fn types_starts_and_items_are_read() {
        let description = Description::read(SMALL).unwrap();
        assert_eq!(description.variable("feed").unwrap().kind, Type::Real("m".into()));
        let heat = description.variable("effects.heat").unwrap();
        assert_eq!(heat.kind, Type::Enumeration(vec![("none".into(), 1), ("adiabatic".into(), 2)]));
        assert_eq!(description.variable("material.name").unwrap().start.as_deref(), Some("a & b"));
        assert_eq!((description.stop_time, description.step_size), (4e-5, 1e-6));
    }

    /// A number in a file's head is not to be guessed at: metres, not millimetres.
    #[test]
    fn values_in_heads_have_units() {
        let description = Description::read(SMALL).unwrap();
        let values = [("feed", "0.0003"), ("effects.heat", "adiabatic"), ("other", "1")];
        let values = values.map(|(name, value)| (name.to_string(), value.to_string()));
        let texts: Vec<String> = description.with_units(&values).into_iter().map(|pair| pair.1).collect();
        assert_eq!(texts, ["0.0003 m", "adiabatic", "1"]);
    }

    /// A misspelt name is answered with the one meant.
    #[test]
    fn a_misspelt_name_is_answered_with_the_nearest() {
        let error = Description::read(SMALL).unwrap().variable("fed").unwrap_err();
        assert!(error.contains("did you mean feed"), "{error}");
    }
}
