//! FMU states at full size: what saving, restoring and serialising costs.

// Apple on ARM passes variable arguments on the stack, where the tests' logger does not look for them.
#![cfg(not(all(target_vendor = "apple", target_arch = "aarch64")))]

mod importer;

use importer::{Slave, Status};
use std::time::{Duration, Instant};

/// What each operation may take.
const LIMIT: Duration = Duration::from_millis(20);

/// Fastest of seven tries: the others were disturbed by what else the machine does. On a machine that is busy all the time
/// it goes on for up to a hundred, as one undisturbed try shows what the operation costs.
fn fastest<T>(mut work: impl FnMut() -> T) -> (Duration, T) {
    let mut timed = || {
        let begin = Instant::now();
        let value = work();
        (begin.elapsed(), value)
    };
    let mut best = timed();
    for count in 1..100 {
        if count >= 7 && best.0 < LIMIT {
            break;
        }
        let other = timed();
        if other.0 < best.0 {
            best = other;
        }
    }
    best
}

/// Masters with rollback and optimisers branch at every step, so a state of the reference cut's 30,000 points must
/// cost less than a few substeps: under 20 ms and 6 MB each way.
#[test]
fn a_state_of_30_000_points_is_cheap() {
    let slave = Slave::new(false);
    slave.initialize();
    assert_eq!(slave.step(0.0, 1e-7), Status::Ok, "{}", slave.log());
    assert!(slave.get_integer("numerics.active_points") >= 30_000);
    let (copying, state) = fastest(|| slave.state());
    let (going_back, status) = fastest(|| slave.restore(state));
    assert_eq!(status, Status::Ok, "{}", slave.log());
    let (writing, bytes) = fastest(|| slave.serialize(state));
    let (reading, (status, _)) = fastest(|| slave.deserialize(&bytes));
    assert_eq!(status, Status::Ok, "{}", slave.log());
    println!(
        "copy {copying:?}, go back {going_back:?}, serialise {writing:?}, deserialise {reading:?}, {} bytes",
        bytes.len()
    );
    assert!(bytes.len() < 6_000_000, "{} bytes", bytes.len());
    for (what, time) in [
        ("copying", copying),
        ("going back", going_back),
        ("serialising", writing),
        ("deserialising", reading),
    ] {
        assert!(time < LIMIT, "{what} took {time:?}");
    }
}
