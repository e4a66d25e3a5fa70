//! `target/swarf.fmu`: the library, the model description, resources, documentation, picture and licences in
//! one zip.
//!
//! The library is built in a folder of its own, with the paths of this machine mapped to neutral names,
//! stripped, and searched for those paths and for symbols beyond the standard's afterwards. Files are packed
//! in a fixed order with a fixed date. Libraries of other platforms are taken over from FMUs that were
//! packaged there.

use std::collections::BTreeMap;
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;

use crate::setup::{self, Zig};
use crate::windows::{self, Windows};
use crate::{Outcome, documentation, portable, process, root, target, test};

/// What `cargo xtask package` can be told.
#[derive(clap::Args)]
pub struct Arguments {
    /// The library needs glibc 2.17 at most (zig and cargo-zigbuild from PyPI, 100 MB)
    #[arg(long)]
    portable: bool,
    /// A library for Windows as well, built on Linux (zig as above; Rust's standard library from rustup, or
    /// from Debian's packages, 131 MB, unpacked into .tools)
    #[arg(long)]
    windows: bool,
    /// Take over the libraries of an FMU packaged on another platform
    #[arg(long, value_name = "OTHER.fmu")]
    with: Vec<PathBuf>,
}

/// Packages the FMU as the arguments ask for.
pub fn run(arguments: &Arguments) -> Outcome {
    let zig = if arguments.portable { Some(setup::prepare_zig()?) } else { None };
    let windows = if arguments.windows { Some(Windows::prepare(setup::prepare_zig()?)?) } else { None };
    let mut kinds = vec![zig.as_ref().map_or(Kind::Plain, Kind::Portable)];
    kinds.extend(windows.as_ref().map(Kind::Windows));
    build_with(&kinds, &arguments.with).map(|_| ())
}

/// How a library is built.
pub enum Kind<'a> {
    /// For this machine as it is.
    Plain,
    /// Taken from the build that the tests run on, which saves one of two builds of all kernels: for tests,
    /// not to be given away. The linker leaves out nearly all of what feature `study` adds; the symbols stay.
    Tested,
    /// For Linux with an older C library, too.
    Portable(&'a Zig),
    /// For Windows, from Linux.
    Windows(&'a Windows),
}

/// Builds the FMU for this machine as it is and gives its path.
pub fn build() -> Outcome<PathBuf> {
    build_with(&[Kind::Plain], &[])
}

/// Packages the library that the tests have been built with, and gives the FMU's path.
pub fn build_tested() -> Outcome<PathBuf> {
    build_with(&[Kind::Tested], &[])
}

/// Builds the FMU and gives its path.
///
/// * `kinds`: libraries that are built here
/// * `others`: FMUs of the same interface, packaged on other platforms, whose libraries are taken over
pub fn build_with(kinds: &[Kind], others: &[PathBuf]) -> Outcome<PathBuf> {
    let folder = root().join("modelDescription");
    let mut files: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    let description = folder.join("modelDescription.xml");
    if !description.is_file() {
        return Err(format!("'{}' is missing: run `cargo xtask describe` first", description.display()));
    }
    files.insert("modelDescription.xml".into(), bytes(&description)?);
    files.insert("model.png".into(), bytes(&folder.join("model.png"))?);
    add_folder(&mut files, &folder.join("documentation"), "documentation")?;
    let page = documentation::complete(&process::read(&folder.join("documentation/index.html"))?)?;
    files.insert("documentation/index.html".into(), page.into_bytes());
    // Kept once, where the book shows it, too.
    let picture = "reference_cut.png";
    files.insert(format!("documentation/{picture}"), bytes(&root().join("book/src/pictures").join(picture))?);
    add_folder(&mut files, &root().join("resources"), "resources")?;
    for name in ["LICENSE-MIT", "LICENSE-APACHE"] {
        files.insert(format!("documentation/licenses/{name}.txt"), bytes(&root().join(name))?);
    }
    files.insert("documentation/licenses/THIRD-PARTY.txt".into(), third_party_licences()?.into_bytes());
    for kind in kinds {
        let (place, suffix) = kind.platform()?;
        files.insert(format!("binaries/{place}/swarf{suffix}"), library(kind, suffix)?);
    }
    for other in others {
        take_over(&mut files, other)?;
    }

    let fmu = root().join("target/swarf.fmu");
    let packed = pack(&files).map_err(|e| format!("cannot pack '{}': {e}", fmu.display()))?;
    // Moved into place: a simulation that runs from the old file keeps it.
    let beside = fmu.with_extension("fmu.part");
    process::write(&beside, &packed)?;
    std::fs::rename(&beside, &fmu).map_err(|e| format!("cannot write '{}': {e}", fmu.display()))?;
    println!("xtask: packed {} ({} files, {} kB)", fmu.display(), files.len(), packed.len() / 1024);
    Ok(fmu)
}

impl Kind<'_> {
    /// The folder in `binaries` and the ending of a library, by FMI 2.0 section 2.3.
    fn platform(&self) -> Outcome<(&'static str, &'static str)> {
        let os = if matches!(self, Kind::Windows(_)) { "windows" } else { std::env::consts::OS };
        match (os, std::env::consts::ARCH) {
            ("linux", "x86_64") => Ok(("linux64", ".so")),
            ("windows", "x86_64") => Ok(("win64", ".dll")),
            ("macos", "x86_64") => Ok(("darwin64", ".dylib")),
            (os, arch) => Err(format!("FMI 2.0 has no folder for {arch} on {os}")),
        }
    }

    /// Its build folder, a cargo command unless it is built already, and where below the folder the library
    /// ends up.
    fn cargo(&self, arguments: &[&str]) -> (PathBuf, Option<std::process::Command>, PathBuf) {
        let (name, command, place) = match self {
            Kind::Tested => return (test::folder(), None, PathBuf::from("release/deps")),
            Kind::Plain => ("fmu", process::cargo(arguments), PathBuf::from("release")),
            Kind::Portable(zig) => {
                ("fmu-portable", zig.cargo(arguments), Path::new(portable::TARGET).join("release"))
            }
            Kind::Windows(windows) => {
                ("fmu-windows", windows.cargo(arguments), Path::new(windows::TARGET).join("release"))
            }
        };
        (target().join(name), Some(command), place)
    }
}

/// Adds the libraries of an FMU packaged elsewhere, if it describes the same variables.
fn take_over(files: &mut BTreeMap<String, Vec<u8>>, other: &Path) -> Outcome {
    let fault = |text: String| format!("cannot take over the libraries of '{}': {text}", other.display());
    let archive = zip::ZipArchive::new(Cursor::new(bytes(other)?));
    let mut archive = archive.map_err(|e| fault(e.to_string()))?;
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index).map_err(|e| fault(e.to_string()))?;
        let (name, mut content) = (entry.name().to_string(), Vec::new());
        entry.read_to_end(&mut content).map_err(|e| fault(e.to_string()))?;
        if name == "modelDescription.xml" && files.get(&name) != Some(&content) {
            return Err(fault("its model description is another; package the same version there".into()));
        }
        // What was built here counts.
        if name.starts_with("binaries/") && !name.ends_with('/') && !files.contains_key(&name) {
            println!("xtask: took over {name} from {}", other.display());
            files.insert(name, content);
        }
    }
    Ok(())
}

/// Builds the library, unless the tests have, and gives its bytes, free of this machine's paths.
fn library(kind: &Kind, suffix: &str) -> Outcome<Vec<u8>> {
    // `cargo rustc --crate-type` builds the library alone: beside an rlib, cargo would leave out link-time
    // optimisation.
    let arguments = ["rustc", "--release", "--package", "swarf", "--lib", "--crate-type", "cdylib"];
    let (build_folder, command, place) = kind.cargo(&arguments);
    if let Some(mut command) = command {
        println!("xtask: building the FMU's library for {}", kind.platform()?.0);
        command
            .arg("--target-dir")
            .arg(&build_folder)
            .args(["--config", "profile.release.strip=\"symbols\""]);
        map_paths(&mut command)?;
        if let Kind::Windows(_) = kind {
            let exports = windows::write_exports(&build_folder)?;
            command.arg("--").arg(format!("-Clink-arg={}", exports.display()));
        }
        process::compile(&mut command)?;
    }
    let prefix = if suffix == ".dll" { "" } else { "lib" };
    let path = build_folder.join(place).join(format!("{prefix}swarf{suffix}"));
    let library = bytes(&path)?;
    match kind {
        Kind::Plain | Kind::Tested if cfg!(target_os = "linux") => portable::check_symbols(&path, None)?,
        Kind::Plain | Kind::Tested => {}
        Kind::Portable(_) => portable::check_symbols(&path, Some(portable::GLIBC))?,
        Kind::Windows(_) => windows::check_library(&path)?,
    }
    for (path, _) in &machine_paths()? {
        let text = path.display().to_string();
        if let Some(at) = find(&library, text.as_bytes()) {
            let rest = &library[at..library.len().min(at + 120)];
            let shown: String =
                rest.iter().take_while(|b| b.is_ascii_graphic()).map(|&b| b as char).collect();
            return Err(format!("the library names a path of this machine: {shown}"));
        }
    }
    Ok(library)
}

/// Lets a cargo command write neutral names for this machine's paths into what it builds.
pub fn map_paths(command: &mut std::process::Command) -> Outcome {
    let mut flags: Vec<String> = (machine_paths()?.iter())
        .map(|(path, neutral)| format!("--remap-path-prefix={}={neutral}", path.display()))
        .collect();
    if let Ok(own) = std::env::var("RUSTFLAGS") {
        flags.extend(own.split_whitespace().map(String::from));
    }
    command.env_remove("RUSTFLAGS").env("CARGO_ENCODED_RUSTFLAGS", flags.join("\x1f"));
    Ok(())
}

/// Folders of this machine that a build may leave in a library, the longest last (the last match counts for
/// rustc).
fn machine_paths() -> Outcome<Vec<(PathBuf, &'static str)>> {
    let home = std::env::var_os("HOME").map(PathBuf::from);
    let below_home = |variable: &str, name: &str| {
        std::env::var_os(variable).map(PathBuf::from).or_else(|| home.as_ref().map(|home| home.join(name)))
    };
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let sysroot = process::output(std::process::Command::new(rustc).args(["--print", "sysroot"]))?;
    let candidates = [
        (Some(root()), "/swarf"),
        (Some(target()), "/swarf/target"),
        (Some(windows::folder()), "/rust"),
        (below_home("CARGO_HOME", ".cargo"), "/cargo"),
        (below_home("RUSTUP_HOME", ".rustup"), "/rustup"),
        (Some(PathBuf::from(sysroot.trim())), "/rust"),
    ];
    let mut paths: Vec<(PathBuf, &'static str)> = Vec::new();
    for (path, neutral) in candidates {
        let Some(path) = path.filter(|path| path.components().count() > 1) else { continue };
        // The same folder by its real name, too: tools resolve links.
        let real = std::fs::canonicalize(&path).ok().filter(|real| *real != path);
        paths.extend([Some(path), real].into_iter().flatten().map(|path| (path, neutral)));
    }
    paths.sort_by_key(|(path, _)| path.as_os_str().len());
    paths.dedup();
    Ok(paths)
}

/// Names, versions and licence texts of the crates linked into the library.
fn third_party_licences() -> Outcome<String> {
    let arguments =
        ["tree", "--package", "swarf", "--edges", "normal", "--prefix", "none", "--format", "{p}\t{l}\t{r}"];
    let list = process::output(&mut process::cargo(&arguments))?;
    let cargo_home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = cargo_home.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cargo")));
    let registries = home.and_then(|home| std::fs::read_dir(home.join("registry/src")).ok());
    let registries: Vec<PathBuf> =
        registries.into_iter().flatten().filter_map(|e| Some(e.ok()?.path())).collect();
    let mut out = String::from("Crates linked into the library, with their licences and licence texts.\n");
    let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let lines: std::collections::BTreeSet<&str> =
        list.lines().filter(|line| !line.starts_with("swarf v")).collect();
    for line in lines {
        let mut parts = line.split('\t');
        let package = parts.next().unwrap_or_default().replace(" (*)", "").replace(" (proc-macro)", "");
        let licence = parts.next().unwrap_or_default();
        let source = parts.next().unwrap_or_default().replace(" (*)", "");
        let Some((name, version)) = package.split_once(" v") else { continue };
        let entry = format!("\n{name} {version}: {licence}, {source}");
        if out.contains(&entry) {
            continue;
        }
        out.push_str(&entry);
        let folder =
            registries.iter().map(|r| r.join(format!("{name}-{version}"))).find(|path| path.is_dir());
        for file in folder.and_then(|path| std::fs::read_dir(path).ok()).into_iter().flatten().flatten() {
            let title = file.file_name().to_string_lossy().to_uppercase();
            let is_licence =
                ["LICENSE", "LICENCE", "COPYING", "NOTICE", "COPYRIGHT"].iter().any(|w| title.starts_with(w));
            if let (true, Ok(text)) = (is_licence, std::fs::read_to_string(file.path())) {
                texts.entry(text.trim().to_string()).or_default().push(format!("{name} {version}"));
            }
        }
    }
    for (text, packages) in texts {
        out.push_str(&format!("\n\n{}\n{}:\n\n{text}\n", "=".repeat(100), packages.join(", ")));
    }
    Ok(out)
}

/// Adds every file below a folder under a name in the archive.
fn add_folder(files: &mut BTreeMap<String, Vec<u8>>, folder: &Path, name: &str) -> Outcome {
    let entries =
        std::fs::read_dir(folder).map_err(|e| format!("cannot read '{}': {e}", folder.display()))?;
    for entry in entries {
        let entry = entry.map_err(|e| e.to_string())?;
        let (path, inside) = (entry.path(), format!("{name}/{}", entry.file_name().to_string_lossy()));
        if path.is_dir() {
            add_folder(files, &path, &inside)?;
        } else {
            files.insert(inside, bytes(&path)?);
        }
    }
    Ok(())
}

fn pack(files: &BTreeMap<String, Vec<u8>>) -> zip::result::ZipResult<Vec<u8>> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    // The zip format's first day: the same files give the same archive.
    let options = SimpleFileOptions::default().last_modified_time(zip::DateTime::default());
    // The description first: importers that stream the archive find it at once.
    let (first, rest): (Vec<_>, Vec<_>) = files.iter().partition(|(name, _)| *name == "modelDescription.xml");
    for (name, content) in first.into_iter().chain(rest) {
        let mode = if name.starts_with("binaries/") { 0o755 } else { 0o644 };
        archive.start_file(name.as_str(), options.unix_permissions(mode))?;
        archive.write_all(content)?;
    }
    Ok(archive.finish()?.into_inner())
}

fn bytes(path: &Path) -> Outcome<Vec<u8>> {
    std::fs::read(path).map_err(|e| format!("cannot read '{}': {e}", path.display()))
}

fn find(haystack: &[u8], needle: &[u8]) -> Option<usize> {
    haystack.windows(needle.len()).position(|window| window == needle)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two builds of the same files are told apart by nothing, so the FMU can be compared byte by byte.
    #[test]
    fn the_same_files_give_the_same_archive() {
        let files = BTreeMap::from([
            ("b".to_string(), vec![1; 100]),
            ("modelDescription.xml".to_string(), vec![2; 9]),
        ]);
        let (one, other) = (pack(&files).unwrap(), pack(&files).unwrap());
        assert!(one == other, "{} and {} bytes", one.len(), other.len());
        assert!(
            find(&one, b"modelDescription.xml") < find(&one, &[b'b', 0x63]),
            "the description comes first"
        );
    }

    /// The search for this machine's paths finds one wherever it stands.
    #[test]
    fn a_path_is_found_in_bytes() {
        assert_eq!(find(b"\0\0/root/.cargo/x", b"/root/.cargo"), Some(2));
        assert_eq!(find(b"/cargo/x", b"/root/.cargo"), None);
    }
}
