//! FMU states at full size: how large they are. What saving, restoring and serialising cost is measured by
//! `cargo xtask bench --kernels state`.

// Apple on ARM passes variable arguments on the stack, where the tests' logger does not look for them.
#![cfg(not(all(target_vendor = "apple", target_arch = "aarch64")))]

mod importer;

use importer::{Slave, Status};

/// Masters with rollback and optimisers keep a state of every step, so one of the reference cut's 30,000
/// points must stay below 200 bytes a point (6 MB), at the start and after going back to it.
#[test]
fn a_state_of_30_000_points_is_small() {
    let slave = Slave::new(false);
    slave.initialize();
    assert_eq!(slave.step(0.0, 1e-7), Status::Ok, "{}", slave.log());
    let points = slave.get_integer("numerics.active_points");
    assert!(points >= 30_000, "{points} points");
    let bytes = slave.serialize(slave.state());
    println!("{} bytes of {points} points", bytes.len());
    let most = 200 * points as usize;
    assert!(bytes.len() < most, "{} bytes of {points} points", bytes.len());
    let (status, state) = slave.deserialize(&bytes);
    assert_eq!(status, Status::Ok, "{}", slave.log());
    assert_eq!(slave.restore(state), Status::Ok, "{}", slave.log());
    assert_eq!(slave.step(1e-7, 1e-7), Status::Ok, "{}", slave.log());
    let later = slave.serialize(slave.state());
    assert!(later.len() < most, "{} bytes of {points} points", later.len());
}
