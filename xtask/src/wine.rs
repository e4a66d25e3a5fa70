//! `cargo xtask wine`: the Windows library of `target/swarf.fmu`, loaded and run under Wine, beside the Linux
//! one.
//!
//! `xtask/wine/life.c` leads instances through their lives as an importer written in C does. It is compiled
//! for both systems, and what the two libraries compute is compared. With `--tests` the Rust tests of the
//! interface and all unit tests are compiled for Windows and run as well. Wine is not Windows; it is what can
//! be had on Linux.

use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{Outcome, portable, process, root, setup, target, windows::Windows};

/// Largest difference of an output between the two systems, as a share of it: their C libraries may round a
/// sine or a logarithm of the set-up differently, which some hundred substeps carry on.
const TOLERANCE: f64 = 1e-6;

/// Tests that need nothing of Linux.
const TESTS: [&str; 7] = ["--lib", "--test", "fmi_abi", "--test", "fmi_calls", "--test", "fmi_logging"];

/// What is run under Wine.
#[derive(clap::Args)]
pub struct Arguments {
    /// The unit tests and those of the interface there, too
    #[arg(long)]
    tests: bool,
}

/// Runs both libraries and compares.
///
/// # Errors
/// When Wine or the Windows library is missing, when a promise is broken, or when the outputs differ.
pub fn run(arguments: &Arguments) -> Outcome {
    let wine = wine()?;
    let tools = Windows::prepare(setup::prepare_zig()?)?;
    let folder = target().join("wine");
    let fmu = root().join("target/swarf.fmu");
    let guid = unpack(&fmu, &folder)?;
    let sources = root().join("xtask/wine");
    println!("xtask: compiling the importer in C");
    tools.compile_c(&sources.join("life.c"), &[], &folder.join("life.exe"))?;
    tools.compile_c(
        &sources.join("bcryptprimitives.c"),
        &["-shared", "-ladvapi32"],
        &folder.join("bcryptprimitives.dll"),
    )?;
    let [major, minor] = portable::GLIBC;
    let linux = format!("x86_64-linux-gnu.{major}.{minor}");
    setup::prepare_zig()?.compile_c(&linux, &sources.join("life.c"), &["-ldl"], &folder.join("life"))?;

    let mut here = Command::new(folder.join("life"));
    let here = process::output(here.current_dir(&folder).args(["./swarf.so", &guid]))?;
    let mut there = Command::new(&wine);
    let there = in_wine(there.current_dir(&folder), &folder);
    let there = process::output(there.args(["life.exe", "swarf.dll", &guid]))?;
    println!("\n{:<30}{:>24}{:>24}", "output", "Linux", "Windows, under Wine");
    compare(&here, &there)?;
    if arguments.tests {
        let mut tests = tools.cargo(&["test", "--package", "swarf", "--no-fail-fast"]);
        tests.args(TESTS).args(["--release", "--target-dir"]).arg(target().join("wine-tests"));
        tests.env("CARGO_TARGET_X86_64_PC_WINDOWS_GNULLVM_RUNNER", &wine);
        process::run(in_wine(&mut tests, &folder))?;
    }
    Ok(())
}

/// Gives a command Wine's own folder and silence, so that a user's Wine stays untouched, and the libraries
/// built beside.
fn in_wine<'a>(command: &'a mut Command, folder: &Path) -> &'a mut Command {
    // Wine shows the whole file system as drive Z.
    let path = format!("Z:{}", folder.display().to_string().replace('/', "\\"));
    command.env("WINEPREFIX", folder.join("prefix")).env("WINEDEBUG", "-all").env("WINEPATH", path)
}

/// Prints both lists side by side and compares them.
fn compare(here: &str, there: &str) -> Outcome {
    let (here, there) = (values(here)?, values(there)?);
    if here.is_empty() || here.len() != there.len() {
        return Err(format!("{} outputs on Linux, {} under Wine", here.len(), there.len()));
    }
    for ((name, one), (_, other)) in here.iter().zip(&there) {
        println!("{name:<30}{one:>24e}{other:>24e}");
        // Written so that NaN fails.
        let is_equal = (one - other).abs() <= TOLERANCE * one.abs();
        if !is_equal {
            return Err(format!("{name} is {one:e} on Linux and {other:e} under Wine"));
        }
    }
    Ok(())
}

/// Lines of a name and a number.
fn values(text: &str) -> Outcome<Vec<(&str, f64)>> {
    let pair = |line: &'_ str| -> Option<(usize, f64)> {
        let (name, value) = line.trim().split_once(' ')?;
        Some((name.len(), value.parse().ok()?))
    };
    let lines = text.lines().map(|line| {
        let (end, value) = pair(line).ok_or_else(|| format!("the importer printed '{line}'"))?;
        Ok((&line[..end], value))
    });
    lines.collect()
}

/// Puts both libraries of the FMU into a folder and gives its GUID.
fn unpack(fmu: &Path, folder: &Path) -> Outcome<String> {
    let advice = "run `cargo xtask package --portable --windows` first";
    let packed = std::fs::read(fmu).map_err(|e| format!("cannot read '{}': {e}; {advice}", fmu.display()))?;
    let mut archive =
        zip::ZipArchive::new(Cursor::new(packed)).map_err(|e| format!("{}: {e}", fmu.display()))?;
    let mut content = |name: &str| -> Outcome<Vec<u8>> {
        let mut bytes = Vec::new();
        let entry = archive.by_name(name);
        let mut entry = entry.map_err(|_| format!("'{}' has no {name}; {advice}", fmu.display()))?;
        entry.read_to_end(&mut bytes).map_err(|e| format!("cannot unpack {name}: {e}"))?;
        Ok(bytes)
    };
    for name in ["win64/swarf.dll", "linux64/swarf.so"] {
        let file = Path::new(name).file_name().unwrap_or_default();
        process::write(&folder.join(file), &content(&format!("binaries/{name}"))?)?;
    }
    let description = String::from_utf8_lossy(&content("modelDescription.xml")?).into_owned();
    let guid = description.split_once("guid=\"").and_then(|(_, rest)| rest.split('"').next());
    guid.map(String::from).ok_or_else(|| "modelDescription.xml has no GUID".into())
}

/// Wine's command for 64-bit programs; Debian keeps it out of the path.
fn wine() -> Outcome<PathBuf> {
    let candidates = ["wine64", "wine", "/usr/lib/wine/wine64"].map(PathBuf::from);
    let runs =
        |path: &PathBuf| Command::new(path).arg("--version").output().is_ok_and(|o| o.status.success());
    candidates.into_iter().find(runs).ok_or_else(|| {
        "Wine is missing (Debian or Ubuntu: apt-get install --no-install-recommends wine64)".into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Equal within rounding passes; a wrong, missing or unreadable value does not.
    #[test]
    fn different_outputs_are_told() {
        assert!(compare("force 1.0\r\nstrain 2\n", "force 1.0000000001\nstrain 2\n").is_ok());
        assert!(compare("force 1.0\n", "force 1.1\n").is_err());
        assert!(compare("force 1.0\n", "").is_err());
        assert!(compare("", "").is_err());
        assert!(compare("force NaN\n", "force 1\n").is_err());
        assert!(values("broken: the library is loaded").is_err());
    }
}
