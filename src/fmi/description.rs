//! modelDescription.xml of FMI 2.0.4, written from the variable table.
//!
//! The GUID is a hash of everything else in the file, so it changes with the interface and with nothing else;
//! the date is a constant of the version, so that equal sources give equal files. The structs below repeat
//! the order of elements and attributes of the standard's schema (section 2.2).

use crate::scene::Scene;
use crate::variables::units::{self, Unit};
use crate::variables::{self, Access, Causality, Kind, Variable, enumerations, format_real};
use serde::Serialize;
use std::sync::OnceLock;

use super::logging::Category;

/// Name that the platform's library has in the FMU, without ending.
pub const MODEL_IDENTIFIER: &str = "swarf";

/// The whole file.
pub fn xml() -> String {
    render(guid())
}

/// The GUID that `fmi2Instantiate` expects.
pub fn guid() -> &'static str {
    // Computed once per process from constants, so all instances agree.
    static GUID: OnceLock<String> = OnceLock::new();
    GUID.get_or_init(|| {
        let h = format!("{:032x}", u128::from_be_bytes(interface_hash()));
        format!("{{{}-{}-{}-{}-{}}}", &h[..8], &h[8..12], &h[12..16], &h[16..20], &h[20..])
    })
}

/// Hash of the description without its GUID.
pub fn interface_hash() -> [u8; 16] {
    static HASH: OnceLock<[u8; 16]> = OnceLock::new();
    *HASH.get_or_init(|| fnv1a_128(render("").as_bytes()).to_be_bytes())
}

/// FNV-1a with 128 bit: not secure, but the same for ever, which the standard library's hashes do not
/// promise.
fn fnv1a_128(bytes: &[u8]) -> u128 {
    const OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;
    bytes.iter().fold(OFFSET, |hash, byte| (hash ^ u128::from(*byte)).wrapping_mul(PRIME))
}

fn render(guid: &str) -> String {
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let mut serializer = quick_xml::se::Serializer::new(&mut text);
    serializer.indent(' ', 2);
    let written = description(guid).serialize(serializer);
    debug_assert!(written.is_ok(), "the description's structs fit XML: {written:?}");
    text.push('\n');
    text
}

#[derive(Serialize)]
#[serde(rename = "fmiModelDescription")]
struct Description {
    #[serde(rename = "@fmiVersion")]
    fmi_version: &'static str,
    #[serde(rename = "@modelName")]
    model_name: &'static str,
    #[serde(rename = "@guid")]
    guid: String,
    #[serde(rename = "@description")]
    description: &'static str,
    #[serde(rename = "@author")]
    author: &'static str,
    #[serde(rename = "@version")]
    version: &'static str,
    #[serde(rename = "@copyright")]
    copyright: &'static str,
    #[serde(rename = "@license")]
    license: &'static str,
    #[serde(rename = "@generationTool")]
    generation_tool: String,
    #[serde(rename = "@generationDateAndTime")]
    generation_date: &'static str,
    #[serde(rename = "@variableNamingConvention")]
    naming: &'static str,
    #[serde(rename = "CoSimulation")]
    co_simulation: CoSimulation,
    #[serde(rename = "UnitDefinitions")]
    units: List<UnitElement>,
    #[serde(rename = "TypeDefinitions")]
    types: List<TypeElement>,
    #[serde(rename = "LogCategories")]
    categories: List<CategoryElement>,
    #[serde(rename = "DefaultExperiment")]
    experiment: Experiment,
    #[serde(rename = "ModelVariables")]
    variables: List<VariableElement>,
    #[serde(rename = "ModelStructure")]
    structure: Structure,
}

#[derive(Serialize)]
struct List<T> {
    #[serde(rename = "$value")]
    items: Vec<T>,
}

#[derive(Serialize)]
struct CoSimulation {
    #[serde(rename = "@modelIdentifier")]
    identifier: &'static str,
    #[serde(rename = "@needsExecutionTool")]
    needs_execution_tool: bool,
    #[serde(rename = "@canHandleVariableCommunicationStepSize")]
    variable_step: bool,
    #[serde(rename = "@canInterpolateInputs")]
    interpolates_inputs: bool,
    #[serde(rename = "@maxOutputDerivativeOrder")]
    output_derivatives: u32,
    #[serde(rename = "@canRunAsynchronuously")]
    asynchronous: bool,
    #[serde(rename = "@canBeInstantiatedOnlyOncePerProcess")]
    only_once: bool,
    #[serde(rename = "@canNotUseMemoryManagementFunctions")]
    own_memory: bool,
    #[serde(rename = "@canGetAndSetFMUstate")]
    state: bool,
    #[serde(rename = "@canSerializeFMUstate")]
    serialized_state: bool,
    #[serde(rename = "@providesDirectionalDerivative")]
    directional_derivative: bool,
}

#[derive(Serialize)]
#[serde(rename = "Unit")]
struct UnitElement {
    #[serde(rename = "@name")]
    name: &'static str,
    #[serde(rename = "BaseUnit")]
    base: BaseUnit,
    #[serde(rename = "DisplayUnit")]
    displays: Vec<DisplayUnit>,
}

/// Exponents; the standard's default is 0, so these are left out.
#[derive(Serialize)]
struct BaseUnit {
    #[serde(rename = "@kg", skip_serializing_if = "is_zero")]
    kg: i32,
    #[serde(rename = "@m", skip_serializing_if = "is_zero")]
    m: i32,
    #[serde(rename = "@s", skip_serializing_if = "is_zero")]
    s: i32,
    #[serde(rename = "@K", skip_serializing_if = "is_zero")]
    k: i32,
    #[serde(rename = "@rad", skip_serializing_if = "is_zero")]
    rad: i32,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde asks for a reference.
fn is_zero(exponent: &i32) -> bool {
    *exponent == 0
}

#[derive(Serialize)]
struct DisplayUnit {
    #[serde(rename = "@name")]
    name: &'static str,
    #[serde(rename = "@factor")]
    factor: String,
    #[serde(rename = "@offset", skip_serializing_if = "Option::is_none")]
    offset: Option<String>,
}

#[derive(Serialize)]
#[serde(rename = "SimpleType")]
struct TypeElement {
    #[serde(rename = "@name")]
    name: &'static str,
    #[serde(rename = "@description")]
    description: &'static str,
    #[serde(rename = "Enumeration")]
    enumeration: List<Item>,
}

#[derive(Serialize)]
struct Item {
    #[serde(rename = "@name")]
    name: &'static str,
    #[serde(rename = "@value")]
    value: usize,
    #[serde(rename = "@description")]
    description: &'static str,
}

#[derive(Serialize)]
#[serde(rename = "Category")]
struct CategoryElement {
    #[serde(rename = "@name")]
    name: &'static str,
    #[serde(rename = "@description")]
    description: &'static str,
}

#[derive(Serialize)]
struct Experiment {
    #[serde(rename = "@startTime")]
    start: &'static str,
    #[serde(rename = "@stopTime")]
    stop: &'static str,
    #[serde(rename = "@stepSize")]
    step: &'static str,
}

#[derive(Serialize)]
#[serde(rename = "ScalarVariable")]
struct VariableElement {
    #[serde(rename = "@name")]
    name: &'static str,
    #[serde(rename = "@valueReference")]
    reference: u32,
    #[serde(rename = "@description")]
    description: &'static str,
    #[serde(rename = "@causality")]
    causality: &'static str,
    #[serde(rename = "@variability")]
    variability: &'static str,
    #[serde(rename = "@initial", skip_serializing_if = "Option::is_none")]
    initial: Option<&'static str>,
    #[serde(rename = "$value")]
    value: TypedValue,
}

#[derive(Serialize)]
enum TypedValue {
    Real(Attributes),
    Integer(Attributes),
    Boolean(Attributes),
    String(Attributes),
    Enumeration(Attributes),
}

/// The attributes of a variable's type element, in the schema's order; what is absent is not written.
#[derive(Serialize, Default)]
struct Attributes {
    #[serde(rename = "@declaredType", skip_serializing_if = "Option::is_none")]
    declared_type: Option<&'static str>,
    #[serde(rename = "@unit", skip_serializing_if = "Option::is_none")]
    unit: Option<&'static str>,
    #[serde(rename = "@displayUnit", skip_serializing_if = "Option::is_none")]
    display_unit: Option<&'static str>,
    #[serde(rename = "@min", skip_serializing_if = "Option::is_none")]
    min: Option<String>,
    #[serde(rename = "@max", skip_serializing_if = "Option::is_none")]
    max: Option<String>,
    #[serde(rename = "@nominal", skip_serializing_if = "Option::is_none")]
    nominal: Option<String>,
    #[serde(rename = "@start", skip_serializing_if = "Option::is_none")]
    start: Option<String>,
}

#[derive(Serialize)]
struct Structure {
    #[serde(rename = "Outputs")]
    outputs: List<Unknown>,
    #[serde(rename = "InitialUnknowns")]
    initial: List<Unknown>,
}

/// An output by its index in the list of variables, from 1; absent dependencies mean all.
#[derive(Serialize)]
#[serde(rename = "Unknown")]
struct Unknown {
    #[serde(rename = "@index")]
    index: usize,
    #[serde(rename = "@dependencies", skip_serializing_if = "Option::is_none")]
    dependencies: Option<String>,
}

fn description(guid: &str) -> Description {
    Description {
        fmi_version: "2.0",
        model_name: MODEL_IDENTIFIER,
        guid: guid.to_owned(),
        description: env!("CARGO_PKG_DESCRIPTION"),
        author: env!("CARGO_PKG_AUTHORS"),
        version: crate::version::VERSION,
        copyright: crate::version::COPYRIGHT,
        license: env!("CARGO_PKG_LICENSE"),
        generation_tool: format!("{MODEL_IDENTIFIER} {}", crate::version::VERSION),
        generation_date: crate::version::DATE,
        naming: "structured",
        co_simulation: CoSimulation {
            identifier: MODEL_IDENTIFIER,
            needs_execution_tool: false,
            variable_step: true,
            interpolates_inputs: true,
            output_derivatives: 0,
            asynchronous: false,
            only_once: false,
            own_memory: true,
            state: true,
            serialized_state: true,
            directional_derivative: false,
        },
        units: List { items: units::ALL.iter().map(|unit| unit_element(unit)).collect() },
        types: List { items: enumerations::ALL.iter().map(|of| type_element(of)).collect() },
        categories: List {
            items: Category::ALL.iter().map(|category| category_element(*category)).collect(),
        },
        experiment: Experiment { start: "0", stop: "4e-5", step: "1e-6" },
        variables: List { items: variables::all().map(variable_element).collect() },
        structure: structure(),
    }
}

fn unit_element(unit: &Unit) -> UnitElement {
    let e = unit.exponents;
    let displays = unit.displays.iter().map(|display| DisplayUnit {
        name: display.name,
        factor: format_real(display.factor),
        offset: (display.offset != 0.0).then(|| format_real(display.offset)),
    });
    UnitElement {
        name: unit.name,
        base: BaseUnit { kg: e.kg, m: e.m, s: e.s, k: e.k, rad: e.rad },
        displays: displays.collect(),
    }
}

fn type_element(of: &enumerations::Enumeration) -> TypeElement {
    let items = (of.items)().into_iter().zip(of.texts).enumerate();
    let items = items.map(|(index, (name, text))| Item { name, value: index + 1, description: text });
    TypeElement { name: of.name, description: of.description, enumeration: List { items: items.collect() } }
}

fn category_element(category: Category) -> CategoryElement {
    CategoryElement { name: category.name(), description: category.description() }
}

fn variable_element(variable: &'static Variable) -> VariableElement {
    let (causality, initial) = match variable.causality() {
        Causality::Parameter => ("parameter", Some("exact")),
        // The standard forbids `initial` for inputs.
        Causality::Input => ("input", None),
        Causality::Output => ("output", Some("calculated")),
    };
    VariableElement {
        name: variable.name,
        reference: variable.reference,
        description: variable.description,
        causality,
        variability: variable.variability(),
        initial,
        value: typed_value(variable),
    }
}

fn typed_value(variable: &Variable) -> TypedValue {
    fn start<T>(access: &Access<T>, write: impl Fn(T) -> String) -> Option<String> {
        access.start(&Scene::default()).map(write)
    }
    match &variable.kind {
        Kind::Real(real) => {
            let bound = |value: f64| value.is_finite().then(|| format_real(value));
            TypedValue::Real(Attributes {
                unit: Some(real.unit.name),
                display_unit: (!real.display.is_empty()).then_some(real.display),
                min: bound(real.min),
                max: bound(real.max),
                nominal: real.nominal.map(format_real),
                start: start(&real.access, format_real),
                ..Attributes::default()
            })
        }
        Kind::Integer(integer) => TypedValue::Integer(Attributes {
            min: Some(integer.min.to_string()),
            max: (integer.max < i32::MAX).then(|| integer.max.to_string()),
            start: start(&integer.access, |value| value.to_string()),
            ..Attributes::default()
        }),
        Kind::Boolean(access) => TypedValue::Boolean(Attributes {
            start: start(access, |value| value.to_string()),
            ..Attributes::default()
        }),
        Kind::Text(access) => {
            TypedValue::String(Attributes { start: start(access, |value| value), ..Attributes::default() })
        }
        Kind::Choice(choice) => TypedValue::Enumeration(Attributes {
            declared_type: Some(choice.of.name),
            min: Some("1".into()),
            max: Some(choice.of.texts.len().to_string()),
            start: start(&choice.access, |value| value.to_string()),
            ..Attributes::default()
        }),
    }
}

/// Outputs depend on all that is known; their start values on little or nothing.
fn structure() -> Structure {
    let outputs: Vec<_> = variables::all()
        .enumerate()
        .filter(|(_, variable)| variable.causality() == Causality::Output)
        .map(|(index, variable)| (index + 1, variable))
        .collect();
    let index_of = |name: &str| variables::all().position(|variable| variable.name == name);
    let initial = outputs.iter().map(|(index, variable)| {
        let causes = variables::start_dependencies(variable.name).iter();
        let numbers: Vec<_> = causes.filter_map(|name| index_of(name)).map(|i| (i + 1).to_string()).collect();
        Unknown { index: *index, dependencies: Some(numbers.join(" ")) }
    });
    Structure {
        initial: List { items: initial.collect() },
        outputs: List {
            items: outputs.iter().map(|(index, _)| Unknown { index: *index, dependencies: None }).collect(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Test vectors of the hash's authors.
    #[test]
    fn hash_gives_the_published_values() {
        assert_eq!(fnv1a_128(b""), 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d);
        assert_eq!(fnv1a_128(b"foobar"), 0x343e_1662_793c_64bf_6f0d_3597_ba44_6f18);
    }

    /// Importers show whose model this is; what they show says so, and a date of another form is refused by
    /// the schema's type.
    #[test]
    fn author_copyright_date_and_licence_are_there() {
        let text = xml();
        let head = text.split("<CoSimulation").next().unwrap();
        for name in ["author", "copyright", "license", "generationTool", "generationDateAndTime"] {
            let value = head.split(&format!(" {name}=\"")).nth(1).and_then(|rest| rest.split('"').next());
            assert!(value.is_some_and(|value| !value.is_empty()), "no {name} in {head}");
        }
        let licence = include_str!("../../LICENSE-MIT");
        assert!(licence.contains(crate::version::COPYRIGHT), "{}", crate::version::COPYRIGHT);
        let date: Vec<u8> =
            crate::version::DATE.bytes().map(|b| if b.is_ascii_digit() { b'0' } else { b }).collect();
        assert_eq!(date, b"0000-00-00T00:00:00Z");
    }

    /// A unit that no variable has is a question that nobody can answer.
    #[test]
    fn every_unit_is_used() {
        for unit in units::ALL {
            let is_used = variables::all().any(|v| matches!(&v.kind, Kind::Real(real) if real.unit == *unit));
            assert!(is_used, "{} is the unit of nothing", unit.name);
        }
    }

    /// Importers store the GUID; the file must name the one that instantiate checks, and only once.
    #[test]
    fn the_file_carries_the_guid_and_all_variables() {
        let text = xml();
        assert_eq!(text.matches(guid()).count(), 1);
        assert_eq!(guid().len(), 38);
        assert_eq!(text.matches("<ScalarVariable ").count(), variables::all().count());
        assert_eq!(text, xml());
    }
}
