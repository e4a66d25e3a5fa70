//! Random sequences of calls, legal and not, on two instances side by side.

// Apple on ARM passes variable arguments on the stack, where the tests' logger does not look for them.
#![cfg(not(all(target_vendor = "apple", target_arch = "aarch64")))]

mod importer;

use importer::sequence::{Draw, perform, random_bytes};

/// Nobody can list all wrong orders of 31 functions and their values; a few thousand drawn ones find what a
/// list forgets. Each is reproduced by its seed.
#[test]
fn no_sequence_of_calls_breaks_an_instance() {
    for seed in 0..1500 {
        let bytes = random_bytes(seed, 600);
        if std::panic::catch_unwind(|| perform(Draw(&bytes))).is_err() {
            panic!("the sequence of seed {seed} broke a promise, see above");
        }
    }
}
