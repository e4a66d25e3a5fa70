//! `cargo xtask fuzz`: coverage-guided random calls on the C functions, with LLVM's libFuzzer.
//!
//! The instrumentation is a pass of LLVM that the stable compiler has too, so neither nightly nor cargo-fuzz
//! is needed; libFuzzer itself is compiled by the `libfuzzer-sys` crate. The address sanitizer is nightly's
//! alone.

use crate::{Outcome, process, target};

/// As cargo-fuzz sets them: counters on every edge, comparisons traced, and the checks of a debug build.
const FLAGS: [&str; 8] = [
    "--cfg=fuzzing",
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "-Cdebug-assertions",
    "-Ccodegen-units=1",
];

/// How long and how.
#[derive(clap::Args)]
pub struct Arguments {
    /// How long
    #[arg(long, value_name = "N", default_value = "15")]
    minutes: f64,
    /// With LLVM's address sanitizer, which takes the nightly compiler
    #[arg(long)]
    address_sanitizer: bool,
}

/// Builds the target and runs it; inputs that reach new code, and findings, are kept in `target/fuzz` (or
/// `fuzz-asan`).
///
/// # Errors
/// A failed build, or a finding.
pub fn run(arguments: &Arguments) -> Outcome {
    let &Arguments { minutes, address_sanitizer: has_sanitizer } = arguments;
    let mut flags: Vec<&str> = FLAGS.to_vec();
    let mut build = if has_sanitizer {
        flags.push("-Zsanitizer=address");
        let mut cargo = std::process::Command::new("rustup");
        cargo.args(["run", "nightly", "cargo", "build"]);
        process::in_repository(cargo)
    } else {
        process::cargo(&["build"])
    };
    let folder = target().join(if has_sanitizer { "fuzz-asan" } else { "fuzz" });
    // A target named, so that build scripts and macros are not instrumented.
    build.args(["--release", "--manifest-path", "fuzz/Cargo.toml", "--target", "x86_64-unknown-linux-gnu"]);
    build.arg("--target-dir").arg(&folder).env("CARGO_ENCODED_RUSTFLAGS", flags.join("\x1f"));
    build.env_remove("RUSTFLAGS").env_remove("RUSTC").env_remove("RUSTUP_TOOLCHAIN");
    process::compile(&mut build)?;
    let (corpus, findings) = (folder.join("corpus"), folder.join("findings"));
    for path in [&corpus, &findings] {
        std::fs::create_dir_all(path).map_err(|e| format!("cannot make '{}': {e}", path.display()))?;
    }
    let mut command = std::process::Command::new(folder.join("x86_64-unknown-linux-gnu/release/calls"));
    command.arg(format!("-max_total_time={}", (60.0 * minutes) as u64));
    command.args(["-timeout=60", "-rss_limit_mb=4096", "-max_len=600", "-print_final_stats=1"]);
    command.arg(format!("-artifact_prefix={}/", findings.display())).arg(corpus);
    process::run(&mut command)
}
