//! `cargo xtask package --windows`: the FMU's library for Windows on x86-64, built on Linux.
//!
//! The linker and the C library's stubs are zig's (PyPI), for Rust's target `x86_64-pc-windows-gnullvm`, so
//! neither mingw-w64 nor Visual Studio takes part. Rust's standard library for Windows is the toolchain's own
//! where rustup has added it. Elsewhere (rustup's server may be out of reach) it is compiled from the sources
//! that Debian ships for building Firefox, `rust-web-src`, with Debian's compiler of the same version,
//! `rustc-web`: both are fetched with apt, unpacked into `.tools/debian-rust` without being installed, and
//! touch nothing else on the machine.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::portable::{FUNCTIONS, check_exports};
use crate::setup::Zig;
use crate::{Outcome, process, root};

/// Rust's name of the platform.
pub const TARGET: &str = "x86_64-pc-windows-gnullvm";
/// Debian's compiler and the sources of its standard library.
const PACKAGES: [&str; 2] = ["rustc-web", "rust-web-src"];
/// What these name as well: a C toolchain, which every Rust developer has already.
const PRESENT: [&str; 5] = ["gcc", "libc-dev", "libc6-dev", "binutils", "libc6"];

/// A compiler with a standard library for Windows, or with its sources.
pub struct Windows {
    zig: Zig,
    /// Debian's compiler; `None` where the toolchain's own knows the target.
    debian: Option<PathBuf>,
}

impl Windows {
    /// Finds or fetches what is needed (131 MB, unpacked 844 MB, where it comes from Debian).
    ///
    /// # Errors
    /// On other systems than Linux on x86-64, and where neither rustup nor Debian has the standard library.
    pub fn prepare(zig: Zig) -> Outcome<Self> {
        if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
            return Err(
                "--windows is for Linux on x86-64; on Windows itself `cargo xtask package` does it".into()
            );
        }
        let debian = if is_known_to_rustc(TARGET)? { None } else { Some(debian_rust()?) };
        Ok(Windows { zig, debian })
    }

    /// A cargo command that builds for Windows.
    pub fn cargo(&self, arguments: &[&str]) -> Command {
        let mut command = self.zig.cargo_for(TARGET, arguments);
        if let Some(rustc) = &self.debian {
            // Compiling the standard library beside a crate is a feature that only nightly admits to having.
            let crates =
                if arguments.contains(&"test") { "std,panic_unwind,test" } else { "std,panic_unwind" };
            command.arg(format!("-Zbuild-std={crates}")).env("RUSTC_BOOTSTRAP", "1").env("RUSTC", rustc);
            command.env_remove("RUSTUP_TOOLCHAIN");
        }
        command
    }

    /// Compiles a C file of this repository for Windows; what the check under Wine needs.
    pub fn compile_c(&self, source: &Path, arguments: &[&str], output: &Path) -> Outcome {
        self.zig.compile_c("x86_64-windows-gnu", source, arguments, output)
    }
}

/// Where Debian's compiler is kept; a library must not name it.
pub fn folder() -> PathBuf {
    root().join(".tools/debian-rust")
}

/// A list of the functions to export. Without one, the linker exports parts of the standard library as well.
pub fn write_exports(folder: &Path) -> Outcome<PathBuf> {
    let path = folder.join("exports.def");
    let names: Vec<String> = FUNCTIONS.iter().map(|name| format!("    {name}\n")).collect();
    process::write(&path, format!("LIBRARY swarf.dll\nEXPORTS\n{}", names.concat()).as_bytes())?;
    Ok(path)
}

/// Checks that a library exports the standard's functions alone, and needs nothing that Windows 10 lacks.
///
/// # Errors
/// Names the functions or libraries at fault.
pub fn check_library(library: &Path) -> Outcome {
    let listing = process::output(Command::new("objdump").arg("-p").arg(library))
        .map_err(|text| format!("{text}\nobjdump is needed (Debian or Ubuntu: apt-get install binutils)"))?;
    let found = Listing::read(&listing);
    check_exports(&found.exported)?;
    let foreign: Vec<&str> = found.needed.iter().copied().filter(|name| !is_part_of_windows(name)).collect();
    if !foreign.is_empty() {
        return Err(format!("swarf.dll needs libraries that Windows does not bring: {}", foreign.join(", ")));
    }
    let (count, needed) = (FUNCTIONS.len(), found.needed.join(", "));
    println!("xtask: swarf.dll exports {count} fmi2 functions alone and needs {needed}");
    Ok(())
}

/// Libraries of every Windows 10: the kernel's, the universal C runtime, and the source of random numbers.
fn is_part_of_windows(library: &str) -> bool {
    let name = library.to_ascii_lowercase();
    let is_named =
        ["kernel32.dll", "ntdll.dll", "bcryptprimitives.dll", "ucrtbase.dll"].contains(&name.as_str());
    is_named || name.starts_with("api-ms-win-crt-") || name.starts_with("api-ms-win-core-")
}

/// What `objdump -p` tells of a library for Windows.
#[derive(Debug, PartialEq)]
struct Listing<'a> {
    exported: Vec<&'a str>,
    needed: Vec<&'a str>,
}

impl<'a> Listing<'a> {
    /// Exported names are listed as `[index] name`, or with their number in between; needed libraries as `DLL
    /// Name: name`.
    fn read(listing: &'a str) -> Self {
        let needed = listing.lines().filter_map(|line| line.trim().strip_prefix("DLL Name: ")).collect();
        let table = listing.split_once("[Ordinal/Name Pointer] Table").map_or("", |(_, rest)| rest);
        let lines = table.lines().skip(1).take_while(|line| line.trim().starts_with('['));
        let exported = lines.filter_map(|line| line.split_whitespace().last()).collect();
        Listing { exported, needed }
    }
}

/// Whether rustup (or a distribution) has added Rust's standard library for a target.
pub fn is_known_to_rustc(target: &str) -> Outcome<bool> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let folder = process::output(Command::new(rustc).args(["--print", "target-libdir", "--target", target]))?;
    let entries = std::fs::read_dir(folder.trim()).into_iter().flatten().flatten();
    Ok(entries.map(|entry| entry.file_name()).any(|name| name.to_string_lossy().starts_with("libstd-")))
}

/// Debian's compiler, unpacked beside; gives a command that finds its libraries.
fn debian_rust() -> Outcome<PathBuf> {
    let folder = folder();
    let command = folder.join("rustc");
    let stamp = folder.join("complete.txt");
    if stamp.is_file() {
        return Ok(command);
    }
    eprintln!(
        "xtask: no standard library for {TARGET}; fetching Debian's compiler and its sources into '{}' \
         (once; 131 MB, unpacked 844 MB; nothing is installed)",
        folder.display()
    );
    let advice = format!(
        "Where rustup can reach its server, `rustup target add {TARGET}` is the shorter way; otherwise this \
         needs a Debian with apt-get, dpkg-deb and a `rustc-web` of at least Rust {}",
        env!("CARGO_PKG_RUST_VERSION")
    );
    let done = unpack_debian(&folder).and_then(|()| version_is_enough(&command));
    done.map_err(|text| format!("{text}\n{advice}"))?;
    process::write(&stamp, b"unpacked by cargo xtask package --windows\n")?;
    Ok(command)
}

/// Fetches the packages and those that they need and this machine lacks, and unpacks all of them.
fn unpack_debian(folder: &Path) -> Outcome {
    let (packages, unpacked) = (folder.join("packages"), folder.join("unpacked"));
    // Lists of its own: updating the system's takes an administrator, and old ones may name a compiler that
    // is too old.
    let lists = folder.join("apt");
    for path in [&packages, &unpacked, &lists.join("lists/partial"), &lists.join("cache/archives/partial")] {
        std::fs::create_dir_all(path).map_err(|e| format!("cannot make '{}': {e}", path.display()))?;
    }
    let apt = |words: &[&str]| {
        let mut command = Command::new("apt-get");
        command.current_dir(&packages);
        command.arg("-o").arg(format!("Dir::State::lists={}", lists.join("lists").display()));
        command.arg("-o").arg(format!("Dir::Cache={}", lists.join("cache").display()));
        command.args(["-o", "APT::Sandbox::User=root", "-q"]).args(words);
        process::run_quietly(&mut command)
    };
    apt(&["update"])?;
    let mut wanted: Vec<String> = PACKAGES.map(String::from).to_vec();
    let mut seen = BTreeSet::new();
    while let Some(package) = wanted.pop() {
        if !seen.insert(package.clone()) || PRESENT.contains(&package.as_str()) {
            continue;
        }
        let is_ours = package.starts_with("rust") || package.starts_with("libstd-rust");
        if !is_ours && is_installed(&package) {
            continue;
        }
        apt(&["download", &package])?;
        let file = downloaded(&packages, &package)?;
        process::run_quietly(Command::new("dpkg-deb").arg("-x").arg(&file).arg(&unpacked))?;
        let depends = process::output(Command::new("dpkg-deb").arg("-f").arg(&file).arg("Depends"))?;
        wanted.extend(names_of(&depends));
    }
    // What was fetched is unpacked now.
    for path in [packages, lists] {
        std::fs::remove_dir_all(&path).map_err(|e| format!("cannot remove '{}': {e}", path.display()))?;
    }
    write_command(folder, &unpacked)
}

/// A command that shows Debian's compiler its own libraries, and only to it.
fn write_command(folder: &Path, unpacked: &Path) -> Outcome {
    let command = folder.join("rustc");
    let libraries = unpacked.join("usr/lib/x86_64-linux-gnu");
    let program = unpacked.join("usr/bin/rustc");
    let text =
        format!("#!/bin/sh\nLD_LIBRARY_PATH='{}' exec '{}' \"$@\"\n", libraries.display(), program.display());
    process::write(&command, text.as_bytes())?;
    process::make_executable(&command)
}

fn version_is_enough(rustc: &Path) -> Outcome {
    let text = process::output(Command::new(rustc).arg("--version"))?;
    let found = text.split_whitespace().nth(1).unwrap_or_default().to_string();
    let wanted = env!("CARGO_PKG_RUST_VERSION");
    let number = |version: &str| -> Vec<u32> {
        version.split(['.', '-']).map_while(|part| part.parse().ok()).collect()
    };
    if number(&found) >= number(wanted) {
        Ok(())
    } else {
        Err(format!("rustc-web is Rust {found}; {wanted} is needed"))
    }
}

fn is_installed(package: &str) -> bool {
    let output = Command::new("dpkg-query").args(["-W", "-f", "${db:Status-Status}", package]).output();
    output.is_ok_and(|output| output.status.success() && output.stdout.starts_with(b"installed"))
}

/// The file that `apt-get download` has left for a package: NAME_VERSION_ARCHITECTURE.deb.
fn downloaded(folder: &Path, package: &str) -> Outcome<PathBuf> {
    let start = format!("{package}_");
    let mut entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let entry = entries.find(|entry| entry.file_name().to_string_lossy().starts_with(&start));
    entry.map(|entry| entry.path()).ok_or_else(|| format!("apt-get download left no file of {package}"))
}

/// Names in a `Depends` line; of alternatives the first.
fn names_of(depends: &str) -> Vec<String> {
    let first = |group: &str| group.split(['|', '(']).next().map(|name| name.trim().to_string());
    let names = depends.split(',').filter_map(first);
    names
        .map(|name| name.split(':').next().unwrap_or_default().to_string())
        .filter(|name| !name.is_empty())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As binutils prints it, in the older and the newer form of the export table.
    #[test]
    fn exports_and_needed_libraries_are_read() {
        let listing = "
	DLL Name: KERNEL32.dll
	vma:  Hint/Ord Member-Name Bound-To
	DLL Name: api-ms-win-crt-heap-l1-1-0.dll

[Ordinal/Name Pointer] Table
	[   0] fmi2DoStep
	[   1] +base[   2]  0001 fmi2Terminate

The Function Table (interpreted .pdata section contents)
	[   7] nothing
";
        let found = Listing::read(listing);
        assert_eq!(found.exported, ["fmi2DoStep", "fmi2Terminate"]);
        assert_eq!(found.needed, ["KERNEL32.dll", "api-ms-win-crt-heap-l1-1-0.dll"]);
        assert!(found.needed.iter().all(|name| is_part_of_windows(name)));
        assert!(!is_part_of_windows("libgcc_s_seh-1.dll") && !is_part_of_windows("VCRUNTIME140.dll"));
    }

    /// Versions, alternatives and architectures are left out.
    #[test]
    fn names_of_packages_are_read() {
        let depends =
            "libc6 (>= 2.34), libstd-rust-web-1.96 (= 1.96.0+dfsg1-1), gcc | c-compiler, python3:any";
        assert_eq!(names_of(depends), ["libc6", "libstd-rust-web-1.96", "gcc", "python3"]);
        assert!(names_of("\n").is_empty());
    }
}
