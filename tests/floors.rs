//! The plan of the house: `src/lib.rs` lists the rooms from ground floor to top, and each uses only those
//! listed above it.
//!
//! Read from the sources themselves: what stands behind `crate::` in code, be it a `use` or a path in a line.
//! Unit tests at a file's end may look anywhere.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Circles between files of one room that are meant, each with its reason; none at present.
const ALLOWED: [(&str, &str, &str); 0] = [];

/// One import: who, whom, and the file.
type Import = (String, String);

/// The program's own text: no comments, and no unit tests at the end.
fn code(text: &str) -> String {
    let end = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    let lines = text[..end].lines().map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// The rooms in the order of `lib.rs`.
fn rooms(lib: &str) -> Vec<String> {
    code(lib)
        .lines()
        .filter_map(|line| line.trim().strip_suffix(';')?.rsplit_once("mod "))
        .map(|(_, name)| name.to_string())
        .collect()
}

/// Paths that a text names behind `crate::`, with every branch of a braced import.
fn paths(text: &str) -> Vec<Vec<String>> {
    text.match_indices("crate::")
        .filter(|(at, _)| !text[..*at].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
        .flat_map(|(at, word)| branches(&text[at + word.len()..]))
        .collect()
}

/// The paths that begin here: `a::{b, c::d}` has two.
fn branches(text: &str) -> Vec<Vec<String>> {
    let text = text.trim_start();
    if let Some(rest) = text.strip_prefix('{') {
        let (mut depth, mut begin, mut found) = (0, 0, Vec::new());
        for (at, c) in rest.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth > 0 => depth -= 1,
                ',' | '}' if depth == 0 => {
                    found.extend(branches(&rest[begin..at]));
                    begin = at + 1;
                    if c == '}' {
                        break;
                    }
                }
                _ => (),
            }
        }
        return found;
    }
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len());
    if end == 0 {
        return Vec::new();
    }
    let name = text[..end].to_string();
    match text[end..].strip_prefix("::") {
        Some(rest) => {
            let deeper = branches(rest);
            if deeper.is_empty() {
                return vec![vec![name]];
            }
            deeper.into_iter().map(|path| [vec![name.clone()], path].concat()).collect()
        }
        None => vec![vec![name]],
    }
}

/// Names at the crate's root that stand for what a room holds.
fn room_of(name: &str) -> &str {
    match name {
        "Error" => "error",
        "Scene" => "scene",
        "Session" => "session",
        "VERSION" => "version",
        other => other,
    }
}

/// Imports that run upwards in the order of `rooms`, as lines that name both ends.
fn upward(rooms: &[String], files: &BTreeMap<String, String>) -> Vec<String> {
    let floor = |name: &str| rooms.iter().position(|room| room == name);
    let mut faults = Vec::new();
    for (file, text) in files {
        let Some(own) = floor(module(file).split("::").next().unwrap_or_default()) else { continue };
        for path in paths(&code(text)) {
            if let Some(other) = floor(room_of(&path[0])).filter(|&other| other > own) {
                faults.push(format!(
                    "{file} uses `crate::{}`: {} stands above {}",
                    path.join("::"),
                    rooms[other],
                    rooms[own]
                ));
            }
        }
    }
    faults
}

/// A file's module: `src/contact/mod.rs` is `contact`.
fn module(file: &str) -> String {
    let name = file.trim_start_matches("src/").trim_end_matches(".rs").trim_end_matches("/mod");
    name.replace('/', "::")
}

/// The imports between files, by module; a room's own file lists its parts, which is no import.
fn imports(files: &BTreeMap<String, String>) -> BTreeSet<Import> {
    let modules: BTreeSet<String> = files.keys().map(|file| module(file)).collect();
    let mut found = BTreeSet::new();
    for (file, text) in files {
        let own = module(file);
        let mut text = code(text);
        // `super` is the folder's module for a file, and the folder's parent for its `mod.rs`.
        if let Some((parent, _)) = own.rsplit_once("::") {
            text = text.replace("use super::", &format!("use crate::{parent}::"));
        }
        for path in paths(&text) {
            let known =
                (1..=path.len()).rev().map(|n| path[..n].join("::")).find(|name| modules.contains(name));
            let Some(other) = known.filter(|other| *other != own) else { continue };
            let is_family = own.starts_with(&format!("{other}::")) || other.starts_with(&format!("{own}::"));
            if !is_family {
                found.insert((own.clone(), other));
            }
        }
    }
    found
}

/// Modules that can be reached from one another, as lines.
fn circles(imports: &BTreeSet<Import>) -> Vec<String> {
    let reach = |from: &str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from.to_string()]);
        while let Some(at) = open.pop() {
            for (_, to) in imports.iter().filter(|(own, _)| *own == at) {
                if seen.insert(to.clone()) {
                    open.push(to.clone());
                }
            }
        }
        seen
    };
    let is_allowed =
        |a: &str, b: &str| ALLOWED.iter().any(|(x, y, _)| (*x, *y) == (a, b) || (*x, *y) == (b, a));
    let direct = imports.iter().filter(|(a, b)| reach(b).contains(a) && !is_allowed(a, b));
    direct.map(|(a, b)| format!("{a} uses {b}, which comes back to it")).collect()
}

/// The sources below `src`, by their path from the repository's folder.
fn sources() -> BTreeMap<String, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut files, mut folders) = (BTreeMap::new(), vec![PathBuf::from("src")]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(root.join(&folder)).expect("the sources") {
            let name = folder.join(entry.expect("an entry").file_name());
            if root.join(&name).is_dir() {
                folders.push(name);
            } else if name.extension().is_some_and(|e| e == "rs") && !name.ends_with("tests.rs") {
                let text = fs::read_to_string(root.join(&name)).expect("a source file");
                files.insert(name.to_str().expect("a plain name").replace('\\', "/"), text);
            }
        }
    }
    files
}

/// A reader who has come to a room knows all that it stands on; a change has its effects above it alone.
#[test]
fn no_room_uses_one_above_it() {
    let files = sources();
    let rooms = rooms(&files["src/lib.rs"]);
    assert!(rooms.len() > 15, "rooms read from lib.rs: {rooms:?}");
    let faults = upward(&rooms, &files);
    assert!(faults.is_empty(), "imports that run upwards:\n{}", faults.join("\n"));
}

/// Two files that need each other are one subject in two places, or hold a third.
#[test]
fn no_files_go_in_a_circle() {
    let found = imports(&sources());
    assert!(found.len() > 100, "imports read: {}", found.len());
    let faults = circles(&found);
    assert!(faults.is_empty(), "imports that go in a circle:\n{}", faults.join("\n"));
}

/// The two tests above see an import that is put in: alone, in braces, in the middle of a line, and as a
/// circle.
#[test]
fn an_upward_import_and_a_circle_are_seen() {
    let rooms = rooms("pub mod low;\nmod high;\n");
    for line in [
        "use crate::high::Roof;",
        "use crate::{low::A, high::{B, C}};",
        "fn f() -> crate::high::Roof { todo() }",
    ] {
        let files = BTreeMap::from([("src/low/mod.rs".to_string(), line.to_string())]);
        let faults = upward(&rooms, &files);
        assert!(!faults.is_empty() && faults[0].contains("high stands above low"), "{line}: {faults:?}");
    }
    let ignored = "// crate::high\n#[cfg(test)]\nmod tests {\n use crate::high::A;\n}";
    let files = BTreeMap::from([("src/low.rs".to_string(), ignored.to_string())]);
    assert!(upward(&rooms, &files).is_empty());
    let files = BTreeMap::from([
        ("src/low/a.rs".to_string(), "use super::b::B;".to_string()),
        ("src/low/b.rs".to_string(), "use crate::low::c;".to_string()),
        ("src/low/c.rs".to_string(), "use crate::low::a::{self, A};".to_string()),
        ("src/low/mod.rs".to_string(), "mod a; mod b; mod c; use a::A;".to_string()),
    ]);
    assert_eq!(circles(&imports(&files)).len(), 3);
}
