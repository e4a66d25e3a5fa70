//! What ties the program to a processor stays where the module list says it is.

use std::path::{Path, PathBuf};

/// All Rust files below a folder.
fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder of sources").flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Files of `src` with a line of code that holds one of `words`, as paths with slashes.
fn files_with(words: &[&str]) -> Vec<String> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut all = Vec::new();
    files(&source, &mut all);
    assert!(all.len() > 40, "only {} files below '{}'", all.len(), source.display());
    let mut holding: Vec<String> = all
        .into_iter()
        .filter(|path| {
            let text = std::fs::read_to_string(path).expect("a readable source");
            let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
            code.into_iter().any(|line| words.iter().any(|word| line.contains(word)))
        })
        .map(|path| {
            let inside = path.strip_prefix(&source).expect("a file of src");
            inside.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
        })
        .collect();
    holding.sort();
    holding
}

/// Any other processor compiles everything but one file, so that the portable path is the whole program
/// there.
#[test]
fn intrinsics_are_in_the_avx2_file_alone() {
    assert_eq!(files_with(&["std::arch", "core::arch", "_mm256"]), ["simd/avx2.rs"]);
}

/// The choice between instruction sets is the SIMD floor's; the FMI boundary asks for the platform's calling
/// convention.
#[test]
fn processors_are_told_apart_in_the_simd_floor_and_at_the_fmi_boundary_alone() {
    let files = files_with(&["target_arch", "target_feature", "is_x86_feature_detected"]);
    assert_eq!(files, ["fmi/abi/mod.rs", "simd/avx2.rs", "simd/mod.rs", "simd/portable.rs"]);
}
