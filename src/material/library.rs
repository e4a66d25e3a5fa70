//! Library of materials: constants by name, each group with its source, and the rule that joins them with a
//! scene.
//!
//! The file `resources/materials.toml` is compiled in; the FMU carries the same file in its resources. A
//! material has four groups of constants (elastic, flow, thermal, damage), each with a `source`, may have one
//! more for each of the laws `johnson_cook_tanh` (`tanh`) and `zerilli_armstrong`, and no other keys.
//!
//! An importer may write every start value back before it initialises the FMU, so a scene that names a
//! material of the library holds either the start values of the constants or what the user set. The rule of
//! [`resolve`]: with a name of the library, each constant must be its start or the library's value, and the
//! library's values are used.

mod file;

use std::fmt::Write;
use std::sync::LazyLock;

use crate::error::Error;
use crate::scene::{Constants, Law, Material, Scene, ZerilliArmstrong};
use file::Library;

/// Name of the material whose constants are taken from the scene.
pub const CUSTOM: &str = "custom";

/// Two values count as equal within this share of the larger: a change of unit and back costs a few
/// roundings.
const SAME: f64 = 1e-12;

const EMBEDDED: &str = include_str!("../../resources/materials.toml");

/// A material of the library.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// What `material.name` must say.
    pub name: String,
    /// The constants, in SI units.
    pub constants: Constants,
    /// Laws that it has the constants of; A, B, n, C and m are the same for Johnson and Cook's and its tanh
    /// form.
    pub laws: Vec<Law>,
    /// Where the constants come from, group by group.
    pub source: String,
}

/// The material of that name, if the library has it; case, spaces, underscores and hyphens do not count.
pub fn find(name: &str) -> Option<&'static Entry> {
    entries().iter().find(|entry| is_same_name(&entry.name, name))
}

/// The name as the library writes it; any other as it is.
pub fn known_name(name: &str) -> &str {
    if is_same_name(CUSTOM, name) { CUSTOM } else { find(name).map_or(name, |entry| &entry.name) }
}

/// Whether two names mean one material: some importers take no spaces, and nobody remembers the hyphens.
fn is_same_name(a: &str, b: &str) -> bool {
    let letters = |name: &str| {
        let kept = name.chars().filter(|letter| !matches!(letter, ' ' | '_' | '-'));
        kept.flat_map(char::to_lowercase).collect::<String>()
    };
    letters(a) == letters(b)
}

/// Names of all materials, in the file's order.
pub fn names() -> impl Iterator<Item = &'static str> {
    entries().iter().map(|entry| entry.name.as_str())
}

/// The constants a scene's material stands for.
///
/// `custom` takes the scene's constants. A name of the library takes the library's, and refuses a constant
/// set to anything but its start ([`Scene::default`]) or the library's value. Ranges are checked elsewhere.
pub fn resolve(material: &Material) -> Result<Constants, Error> {
    if known_name(&material.name) == CUSTOM {
        return Ok(material.constants.clone());
    }
    let Some(entry) = find(&material.name) else {
        let allowed = names().chain([CUSTOM]).collect::<Vec<_>>().join(", ");
        return Err(Error::NotAvailable {
            name: "material.name".into(),
            asked: material.name.clone(),
            allowed,
        });
    };
    if !entry.laws.contains(&material.law) {
        let having = entries().iter().filter(|entry| entry.laws.contains(&material.law));
        let having = having.map(|entry| entry.name.as_str());
        return Err(Error::Inconsistent(format!(
            "material.law = {} has no constants for material.name = {}; allowed: {}",
            material.law.name(),
            entry.name,
            having.chain([CUSTOM]).collect::<Vec<_>>().join(", ")
        )));
    }
    let starts = values(&Scene::default().material.constants);
    let library = values(&entry.constants);
    for (((name, unit, asked), start), from_library) in
        values(&material.constants).into_iter().zip(starts).zip(library)
    {
        let (start, from_library) = (start.2, from_library.2);
        if !is_same(asked, start) && !is_same(asked, from_library) {
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let mut allowed = format!("{from_library}{unit} (the library's value)");
            if !is_same(start, from_library) {
                // Writing to a String cannot fail.
                let _ = write!(allowed, " or {start}{unit} (the start value, which stands for it)");
            }
            return Err(Error::Inconsistent(format!(
                "material.{name} = {asked}{unit} does not go with material.name = {}; allowed: {allowed}; \
                 constants of your own need material.name = {CUSTOM}",
                entry.name
            )));
        }
    }
    Ok(entry.constants.clone())
}

/// Reads a library in the format of `resources/materials.toml`; unknown keys are refused.
pub fn parse(text: &str) -> Result<Vec<Entry>, Error> {
    let library: Library = toml::from_str(text).map_err(|error| {
        let line = error.span().map(|span| 1 + text[..span.start].matches('\n').count());
        let place = line.map_or(String::new(), |line| format!(", line {line}"));
        Error::Inconsistent(format!("the material library{place}: {}", error.message()))
    })?;
    let mut entries: Vec<Entry> = Vec::with_capacity(library.material.len());
    for record in library.material {
        let entry = Entry::from(record);
        let refuse = |text: String| Err(Error::Inconsistent(format!("the material library: {text}")));
        if entry.name.trim().is_empty() || is_same_name(&entry.name, CUSTOM) {
            return refuse(format!("a material cannot be called '{}'", entry.name));
        }
        if entries.iter().any(|other| is_same_name(&other.name, &entry.name)) {
            return refuse(format!("{} stands there twice", entry.name));
        }
        if let Some((name, _, value)) =
            values(&entry.constants).into_iter().find(|value| !value.2.is_finite())
        {
            return refuse(format!("{name} = {value} of {} is not a finite number", entry.name));
        }
        entries.push(entry);
    }
    Ok(entries)
}

/// A constant: its name after `material.`, its unit (empty for none) and its value.
type Value = (&'static str, &'static str, f64);

/// Every constant with the name and unit its user knows.
fn values(constants: &Constants) -> [Value; 32] {
    // Taken apart, so that a new constant cannot be forgotten here.
    let Constants {
        density,
        youngs_modulus,
        poissons_ratio,
        yield_stress,
        hardening_modulus,
        hardening_exponent,
        rate_coefficient,
        reference_rate,
        thermal_exponent,
        melting_temperature,
        reference_temperature,
        specific_heat,
        conductivity,
        thermal_expansion,
        taylor_quinney,
        damage: [d1, d2, d3, d4, d5],
        fracture_energy,
        tanh: [tanh_a, tanh_b, tanh_c, tanh_d, tanh_s],
        zerilli_armstrong: ZerilliArmstrong { c0, c1, c3, c4, c5, n },
    } = *constants;
    [
        ("density", "kg/m3", density),
        ("youngs_modulus", "Pa", youngs_modulus),
        ("poissons_ratio", "", poissons_ratio),
        ("yield_stress", "Pa", yield_stress),
        ("hardening_modulus", "Pa", hardening_modulus),
        ("hardening_exponent", "", hardening_exponent),
        ("rate_coefficient", "", rate_coefficient),
        ("reference_rate", "1/s", reference_rate),
        ("thermal_exponent", "", thermal_exponent),
        ("melting_temperature", "K", melting_temperature),
        ("reference_temperature", "K", reference_temperature),
        ("specific_heat", "J/(kg K)", specific_heat),
        ("conductivity", "W/(m K)", conductivity),
        ("thermal_expansion", "1/K", thermal_expansion),
        ("taylor_quinney", "", taylor_quinney),
        ("d1", "", d1),
        ("d2", "", d2),
        ("d3", "", d3),
        ("d4", "", d4),
        ("d5", "", d5),
        ("fracture_energy", "J/m2", fracture_energy),
        ("tanh_a", "", tanh_a),
        ("tanh_b", "", tanh_b),
        ("tanh_c", "", tanh_c),
        ("tanh_d", "", tanh_d),
        ("tanh_s", "", tanh_s),
        ("zerilli_armstrong_c0", "Pa", c0),
        ("zerilli_armstrong_c1", "Pa", c1),
        ("zerilli_armstrong_c3", "1/K", c3),
        ("zerilli_armstrong_c4", "1/K", c4),
        ("zerilli_armstrong_c5", "Pa", c5),
        ("zerilli_armstrong_n", "", n),
    ]
}

fn is_same(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs())
}

fn entries() -> &'static [Entry] {
    static ENTRIES: LazyLock<Vec<Entry>> =
        LazyLock::new(|| parse(EMBEDDED).expect("the library compiled in is read by this module's tests"));
    &ENTRIES
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(name: &str) -> Material {
        Material { name: name.into(), ..Scene::default().material }
    }

    /// The five materials of the interface are there under their names, in its order.
    #[test]
    fn library_holds_the_five_materials_of_the_interface() {
        let expected = ["AISI 4340", "AISI 1045", "Ti-6Al-4V", "Al 2024-T351", "OFHC copper"];
        assert_eq!(names().collect::<Vec<_>>(), expected);
        for entry in entries() {
            for group in ["elastic: ", "flow stress: ", "thermal: ", "damage: "] {
                assert!(entry.source.contains(group), "no {group}in the source of {}", entry.name);
            }
        }
    }

    /// The reference cut is one material under two names: the scene's start values and the library's entry.
    #[test]
    fn aisi_4340_equals_the_start_values() {
        assert_eq!(find("AISI 4340").unwrap().constants, Scene::default().material.constants);
        assert_eq!(resolve(&Scene::default().material), Ok(Scene::default().material.constants));
    }

    /// What mechanics allows: positive stiffness, softening above the reference, ductility falling with
    /// tension.
    #[test]
    fn constants_lie_in_their_physical_ranges() {
        for Entry { name, constants: c, .. } in entries() {
            assert!(
                (1e3..2.5e4).contains(&c.density) && (5e10..3e11).contains(&c.youngs_modulus),
                "{name}: {c:?}"
            );
            assert!(
                (0.25..0.4).contains(&c.poissons_ratio) && (0.0..=1.0).contains(&c.taylor_quinney),
                "{name}: {c:?}"
            );
            assert!(
                (5e7..2e9).contains(&c.yield_stress) && (1e8..2e9).contains(&c.hardening_modulus),
                "{name}: {c:?}"
            );
            assert!(
                (0.1..1.0).contains(&c.hardening_exponent) && (0.0..0.1).contains(&c.rate_coefficient),
                "{name}: {c:?}"
            );
            assert!(
                c.melting_temperature > c.reference_temperature + 400.0 && c.reference_rate > 0.0,
                "{name}: {c:?}"
            );
            assert!(
                (300.0..1000.0).contains(&c.specific_heat) && (5.0..400.0).contains(&c.conductivity),
                "{name}: {c:?}"
            );
            assert!((5e-6..3e-5).contains(&c.thermal_expansion) && c.damage[2] < 0.0, "{name}: {c:?}");
        }
    }

    /// An importer that writes back all start values has asked for nothing but the name.
    #[test]
    fn start_values_or_the_librarys_give_the_librarys() {
        for entry in entries() {
            assert_eq!(resolve(&material(&entry.name)), Ok(entry.constants.clone()));
            let mut restated = material(&entry.name);
            restated.constants = entry.constants.clone();
            // As an importer shows it: in GPa and back.
            restated.constants.youngs_modulus = entry.constants.youngs_modulus / 1e9 * 1e9;
            assert_eq!(resolve(&restated), Ok(entry.constants.clone()));
        }
    }

    /// A constant of one's own beside a library name is a contradiction, told with name, value and what is
    /// allowed.
    #[test]
    fn other_constants_are_refused_by_name() {
        let mut asked = material("AISI 1045");
        asked.constants.density = 7000.0;
        let text = resolve(&asked).unwrap_err().to_string();
        for part in ["material.density = 7000 kg/m3", "AISI 1045", "7850 kg/m3", "7830 kg/m3", "custom"] {
            assert!(text.contains(part), "no '{part}' in: {text}");
        }
        let mut asked = material("AISI 4340");
        asked.constants.damage[3] = f64::NAN;
        let text = resolve(&asked).unwrap_err().to_string();
        assert!(text.contains("material.d4 = NaN") && !text.contains("start value"), "{text}");
    }

    /// Every constant is compared, not only some.
    #[test]
    fn each_constant_is_checked() {
        let changes: [fn(&mut Constants) -> &mut f64; 32] = [
            |c| &mut c.density,
            |c| &mut c.youngs_modulus,
            |c| &mut c.poissons_ratio,
            |c| &mut c.yield_stress,
            |c| &mut c.hardening_modulus,
            |c| &mut c.hardening_exponent,
            |c| &mut c.rate_coefficient,
            |c| &mut c.reference_rate,
            |c| &mut c.thermal_exponent,
            |c| &mut c.melting_temperature,
            |c| &mut c.reference_temperature,
            |c| &mut c.specific_heat,
            |c| &mut c.conductivity,
            |c| &mut c.thermal_expansion,
            |c| &mut c.taylor_quinney,
            |c| &mut c.damage[0],
            |c| &mut c.damage[1],
            |c| &mut c.damage[2],
            |c| &mut c.damage[3],
            |c| &mut c.damage[4],
            |c| &mut c.fracture_energy,
            |c| &mut c.tanh[0],
            |c| &mut c.tanh[1],
            |c| &mut c.tanh[2],
            |c| &mut c.tanh[3],
            |c| &mut c.tanh[4],
            |c| &mut c.zerilli_armstrong.c0,
            |c| &mut c.zerilli_armstrong.c1,
            |c| &mut c.zerilli_armstrong.c3,
            |c| &mut c.zerilli_armstrong.c4,
            |c| &mut c.zerilli_armstrong.c5,
            |c| &mut c.zerilli_armstrong.n,
        ];
        for (index, change) in changes.iter().enumerate() {
            let mut asked = material("OFHC copper");
            let name = values(&asked.constants)[index].0;
            *change(&mut asked.constants) *= 1.001;
            let text = resolve(&asked).expect_err(name).to_string();
            assert!(text.contains(&format!("material.{name} = ")), "{text}");
        }
    }

    /// With "custom" the constants are the scene's, whatever they are.
    #[test]
    fn custom_takes_the_constants_as_given() {
        let mut asked = material(CUSTOM);
        asked.constants.density = 1.0;
        assert_eq!(resolve(&asked), Ok(asked.constants.clone()));
    }

    /// Containers of FMUs take no spaces, and no two materials differ by case or by what joins words alone.
    #[test]
    fn names_are_found_however_they_are_joined() {
        for (asked, name) in [
            ("AISI_1045", "AISI 1045"),
            ("aisi1045", "AISI 1045"),
            ("ti6al4v", "Ti-6Al-4V"),
            ("TI 6AL 4V", "Ti-6Al-4V"),
            ("al_2024_t351", "Al 2024-T351"),
            ("ofhc-Copper", "OFHC copper"),
            ("Custom", CUSTOM),
            ("AISI 304", "AISI 304"),
        ] {
            assert_eq!(known_name(asked), name, "{asked}");
        }
        assert_eq!(resolve(&material("aisi-1045")), resolve(&material("AISI 1045")));
        for material in names() {
            assert_eq!(known_name(material), material);
        }
    }

    /// An unknown name is answered with the names there are.
    #[test]
    fn unknown_name_lists_the_names() {
        let text = resolve(&material("AISI 304")).unwrap_err().to_string();
        assert!(text.contains("material.name = AISI 304"), "{text}");
        for name in names().chain([CUSTOM]) {
            assert!(text.contains(name), "no '{name}' in: {text}");
        }
    }

    /// A misspelt key would silently lose a value, so it is refused with its line; so are doubles and
    /// reserved names.
    #[test]
    fn damaged_libraries_are_refused() {
        let cases = [
            (EMBEDDED.replace("poissons_ratio = 0.34", "poisson_ratio = 0.34"), "poisson"),
            (EMBEDDED.replacen("d5 = 0.61\n", "", 1), "d5"),
            (EMBEDDED.replacen("[material.thermal]", "hardness = 1\n[material.thermal]", 1), "hardness"),
            (EMBEDDED.replace("\"AISI 1045\"", "\"AISI 4340\""), "AISI 4340 stands there twice"),
            (EMBEDDED.replace("\"AISI 1045\"", "\"custom\""), "cannot be called 'custom'"),
            (EMBEDDED.replacen("density = 7830.0", "density = nan", 1), "density = NaN"),
        ];
        for (text, part) in cases {
            let error = parse(&text).unwrap_err().to_string();
            assert!(error.starts_with("the material library") && error.contains(part), "{error}");
        }
        let error = parse("[[material]]\nname = 3\n").unwrap_err().to_string();
        assert!(error.contains("line 2"), "{error}");
    }
}
