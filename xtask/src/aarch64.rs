//! The portable path on another processor: `cargo check` for 64-bit ARM, where a standard library for it is
//! at hand.
//!
//! Nothing is linked, so no C compiler for that processor is needed. The standard library is the toolchain's
//! own where rustup has added it, or comes from the sources of Debian's compiler where `cargo xtask package
//! --windows` has unpacked that.

use crate::windows::{folder, is_known_to_rustc};
use crate::{Outcome, process, target};

/// Rust's name of the platform.
const TARGET: &str = "aarch64-unknown-linux-gnu";

/// Checks the library, or says loudly that it cannot.
///
/// # Errors
/// Where the library does not compile for the platform.
pub fn check() -> Outcome {
    let mut command = process::cargo(&["check", "--package", "swarf", "--lib", "--target", TARGET]);
    command.arg("--target-dir").arg(target().join("aarch64"));
    if is_known_to_rustc(TARGET)? {
        return process::run(&mut command);
    }
    let debian = folder().join("rustc");
    if folder().join("complete.txt").is_file() {
        command.args(["-Zbuild-std=std,panic_unwind"]).env("RUSTC_BOOTSTRAP", "1").env("RUSTC", debian);
        return process::run(command.env_remove("RUSTUP_TOOLCHAIN"));
    }
    println!(
        "SKIPPED: no standard library for {TARGET} here, so whether the portable path compiles for it is NOT \
         CHECKED (`rustup target add {TARGET}`, or `cargo xtask package --windows` once, which fetches one)"
    );
    Ok(())
}
