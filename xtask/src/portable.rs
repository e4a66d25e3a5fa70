//! Libraries that load on systems older than this one: built for glibc 2.17 (2012), which every distribution
//! in support has.
//!
//! A library linked on a new system asks for the newest version of each C function it calls, and an older
//! system then refuses to load it. `cargo-zigbuild` links against the symbol list of a chosen glibc instead;
//! both it and zig come from PyPI. The result is read back with objdump, since a wrong library would fail on
//! other people's machines only.

use std::path::Path;
use std::process::Command;

use crate::{Outcome, process};

/// Rust's name of the platform.
pub const TARGET: &str = "x86_64-unknown-linux-gnu";
/// The newest glibc that a portable library may need.
pub const GLIBC: [u32; 2] = [2, 17];
/// Functions of FMI 2.0 that every co-simulation FMU exports.
pub const FUNCTIONS: [&str; 34] = [
    "fmi2CancelStep",
    "fmi2DeSerializeFMUstate",
    "fmi2DoStep",
    "fmi2EnterInitializationMode",
    "fmi2ExitInitializationMode",
    "fmi2FreeFMUstate",
    "fmi2FreeInstance",
    "fmi2GetBoolean",
    "fmi2GetBooleanStatus",
    "fmi2GetDirectionalDerivative",
    "fmi2GetFMUstate",
    "fmi2GetInteger",
    "fmi2GetIntegerStatus",
    "fmi2GetReal",
    "fmi2GetRealOutputDerivatives",
    "fmi2GetRealStatus",
    "fmi2GetStatus",
    "fmi2GetString",
    "fmi2GetStringStatus",
    "fmi2GetTypesPlatform",
    "fmi2GetVersion",
    "fmi2Instantiate",
    "fmi2Reset",
    "fmi2SerializeFMUstate",
    "fmi2SerializedFMUstateSize",
    "fmi2SetBoolean",
    "fmi2SetDebugLogging",
    "fmi2SetFMUstate",
    "fmi2SetInteger",
    "fmi2SetReal",
    "fmi2SetRealInputDerivatives",
    "fmi2SetString",
    "fmi2SetupExperiment",
    "fmi2Terminate",
];

/// Checks that a library exports the standard's functions and nothing else, and needs no newer glibc than
/// `newest`.
///
/// # Errors
/// Names the symbols at fault.
pub fn check_symbols(library: &Path, newest: Option<[u32; 2]>) -> Outcome {
    let listing = process::output(Command::new("objdump").arg("-T").arg(library))
        .map_err(|text| format!("{text}\nobjdump is needed (Debian or Ubuntu: apt-get install binutils)"))?;
    let symbols = Symbols::read(&listing);
    check_exports(&symbols.exported)?;
    let too_new: Vec<String> = symbols
        .needed
        .iter()
        .filter(|(_, version)| newest.is_some_and(|newest| *version > newest))
        .map(|(name, [major, minor])| format!("{name} of glibc {major}.{minor}"))
        .collect();
    if !too_new.is_empty() {
        return Err(format!("the library needs a newer C library than promised: {}", too_new.join(", ")));
    }
    let [major, minor] = symbols.needed.iter().map(|needed| needed.1).max().unwrap_or([0, 0]);
    let count = FUNCTIONS.len();
    println!("xtask: swarf.so exports {count} fmi2 functions alone and needs glibc {major}.{minor}");
    Ok(())
}

/// Checks that a library exports the standard's functions, all of them and nothing else.
///
/// # Errors
/// Names those missing and those too many.
pub fn check_exports(exported: &[&str]) -> Outcome {
    let missing: Vec<&str> = FUNCTIONS.into_iter().filter(|name| !exported.contains(name)).collect();
    let foreign: Vec<&str> = exported.iter().copied().filter(|name| !FUNCTIONS.contains(name)).collect();
    if missing.is_empty() && foreign.is_empty() {
        return Ok(());
    }
    Err(format!(
        "the library must export the standard's {} functions and nothing else; missing: [{}]; too many: [{}]",
        FUNCTIONS.len(),
        missing.join(", "),
        foreign.join(", ")
    ))
}

/// The dynamic symbols of a library.
struct Symbols<'a> {
    exported: Vec<&'a str>,
    /// With the version of glibc that brought them.
    needed: Vec<(&'a str, [u32; 2])>,
}

impl<'a> Symbols<'a> {
    /// From what `objdump -T` prints: address, flags, section, size, version (if any), name.
    fn read(listing: &'a str) -> Self {
        let (mut exported, mut needed) = (Vec::new(), Vec::new());
        for line in listing.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let (Some(name), true) = (words.last(), words.len() >= 5) else { continue };
            if !words[0].bytes().all(|b| b.is_ascii_hexdigit()) {
                continue;
            }
            if words.contains(&"*UND*") {
                let version = words.iter().find_map(|word| {
                    let text = word.trim_matches(['(', ')']).strip_prefix("GLIBC_")?;
                    let mut parts = text.split('.').map(|part| part.parse().unwrap_or(u32::MAX));
                    Some([parts.next()?, parts.next().unwrap_or(0)])
                });
                needed.extend(version.map(|version| (*name, version)));
            } else {
                exported.push(*name);
            }
        }
        Symbols { exported, needed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The three kinds of lines that a library's list has.
    #[test]
    fn exported_and_needed_symbols_are_told_apart() {
        let listing = "
swarf.so:     file format elf64-x86-64

DYNAMIC SYMBOL TABLE:
0000000000000000      DF *UND*\t0000000000000000 (GLIBC_2.34) pthread_create
0000000000000000  w   D  *UND*\t0000000000000000  Base        __gmon_start__
0000000000000000      DF *UND*\t0000000000000000  GLIBC_2.2.5 memcpy
0000000000031a40 g    DF .text\t00000000000000a3  Base        fmi2DoStep
";
        let symbols = Symbols::read(listing);
        assert_eq!(symbols.exported, ["fmi2DoStep"]);
        assert_eq!(symbols.needed, [("pthread_create", [2, 34]), ("memcpy", [2, 2])]);
    }

    /// A function too few makes importers refuse the library, a symbol too many can clash with another FMU's.
    #[test]
    fn missing_and_foreign_exports_are_named() {
        assert!(check_exports(&FUNCTIONS).is_ok());
        let text = check_exports(&FUNCTIONS[1..]).unwrap_err();
        assert!(text.contains("missing: [fmi2CancelStep]; too many: []"), "{text}");
        let text = check_exports(&[FUNCTIONS.as_slice(), &["malloc"]].concat()).unwrap_err();
        assert!(text.contains("missing: []; too many: [malloc]"), "{text}");
    }
}
