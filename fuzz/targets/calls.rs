//! Fuzz target: sequences of calls, and states forged so that their checksums are right.
//!
//! The first byte chooses. Sequences are those of the random test and must keep the same promises. A forged
//! state, which no accident makes, may lead to a refused call or a caught internal error, but never out of
//! memory or past an array.
#![no_main]

#[path = "../../tests/importer/mod.rs"]
mod importer;

use importer::sequence::{Draw, perform};
use importer::{Slave, Status};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// A state in the middle of a coarse cut, as bytes.
///
/// A forged velocity of 1e8 m/s is no fault, only a run of tiny substeps: the wall time limit ends it, as for
/// any user.
static STATE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let values = [("numerics.point_spacing", 1e-4), ("numerics.wall_time_limit", 1.0)];
    let slave = Slave::ready(&values);
    assert_eq!(slave.step(0.0, 2e-6), Status::Ok);
    slave.serialize(slave.state())
});

/// Whether a forged state runs: its caught internal errors are expected, by the hundred, and need no text.
static IS_FORGED: AtomicBool = AtomicBool::new(false);

fuzz_target!(
    init: {
        // libFuzzer's own hook ends the process at any panic, also at one that the library catches.
        let _ = std::panic::take_hook();
        let print = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !IS_FORGED.load(Ordering::Relaxed) {
                print(panic);
            }
        }));
    },
    |data: &[u8]| {
        let Some((choice, rest)) = data.split_first() else { return };
        let is_forged = choice % 4 == 0;
        IS_FORGED.store(is_forged, Ordering::Relaxed);
        let run = || if is_forged { forge(rest) } else { perform(Draw(rest)) };
        if std::panic::catch_unwind(run).is_err() {
            std::process::abort();
        }
    }
);

/// Puts bytes into a state behind its scene, mends the checksum, and goes on from it.
fn forge(mut data: &[u8]) {
    let mut bytes = STATE.clone();
    // Front of the envelope, see `checkpoint`, and the header's length; then the header, and the session.
    let number =
        |bytes: &[u8], at: usize| bytes[at..at + 8].iter().rev().fold(0, |n, b| n << 8 | usize::from(*b));
    let body = 44 + number(&bytes, 36);
    let end = bytes.len() - 4;
    // The scene stands first; a forged one would only be a scene that is slow.
    let from = body + 2000;
    while let Some((head, rest)) = data.split_first_chunk::<4>() {
        let at = from + usize::from(u16::from_le_bytes([head[0], head[1]])) * 7 % (end - from);
        bytes[at] = head[2];
        if head[3] & 1 == 1 {
            // Near the end, where deposits and layout stand.
            bytes[end - 1 - usize::from(head[3]) * 16] ^= head[2];
        }
        data = rest;
    }
    let checksum = crc32fast::hash(&bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&checksum);
    let slave = Slave::new(false);
    let (status, state) = slave.deserialize(&bytes);
    if status == Status::Ok && slave.restore(state) == Status::Ok {
        slave.step(2e-6, 2e-7);
        slave.step(2.2e-6, 1e-7);
    }
}
