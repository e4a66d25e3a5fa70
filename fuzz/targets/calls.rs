//! Fuzz target: sequences of calls, and states forged so that their checksums are right.
//!
//! The first byte chooses. Sequences are those of the random test and must keep the same promises. A forged state, which
//! no accident makes, may lead to a refused call or a caught internal error, but never out of memory or past an array.
#![no_main]

#[path = "../../tests/importer/mod.rs"]
mod importer;

use importer::sequence::{Draw, perform};
use importer::{Slave, Status};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

/// A state in the middle of a coarse cut, as bytes.
static STATE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let slave = Slave::ready(&[("numerics.point_spacing", 1e-4)]);
    assert_eq!(slave.step(0.0, 2e-6), Status::Ok);
    slave.serialize(slave.state())
});

fuzz_target!(
    // libFuzzer's own hook ends the process at any panic, also at one that the library catches.
    init: { let _ = std::panic::take_hook(); },
    |data: &[u8]| {
        let run = || match data.split_first() {
            Some((choice, rest)) if choice % 4 == 0 => forge(rest),
            Some((_, rest)) => perform(Draw(rest)),
            None => {}
        };
        if std::panic::catch_unwind(run).is_err() {
            std::process::abort();
        }
    }
);

/// Puts bytes into a state behind its scene, mends both checksums, and goes on from it.
fn forge(mut data: &[u8]) {
    let mut bytes = STATE.clone();
    // Front of the outer form, see `fmi::saved`; then the header, and the session with a head of 20 bytes.
    let number =
        |bytes: &[u8], at: usize| bytes[at..at + 8].iter().rev().fold(0, |n, b| n << 8 | usize::from(*b));
    let session = 44 + number(&bytes, 36);
    let body = session + 20;
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
    let inner = crc32fast::hash(&bytes[body..end]).to_le_bytes();
    bytes[session + 16..body].copy_from_slice(&inner);
    let outer = crc32fast::hash(&bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&outer);
    let slave = Slave::new(false);
    let (status, state) = slave.deserialize(&bytes);
    if status == Status::Ok && slave.restore(state) == Status::Ok {
        slave.step(2e-6, 2e-7);
        slave.step(2.2e-6, 1e-7);
    }
}
