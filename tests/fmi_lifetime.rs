//! What instances leave behind in their process (nothing), and odd processes they live in.

// Apple on ARM passes variable arguments on the stack, where the tests' logger does not look for them.
#![cfg(not(all(target_vendor = "apple", target_arch = "aarch64")))]

mod importer;

use importer::{Messages, Slave, Status, callbacks};
use std::ffi::{CString, c_char};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use swarf::fmi::abi::*;
use swarf::fmi::description::guid;

/// Memory and threads are those of the whole process, so these tests run one after another.
fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Resident memory (kB) and threads of this process.
#[cfg(target_os = "linux")]
fn process() -> (u64, u64) {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let number = |name: &str| {
        let line = status.lines().find(|line| line.starts_with(name)).unwrap();
        line.split_whitespace().nth(1).unwrap().parse().unwrap()
    };
    (number("VmRSS:"), number("Threads:"))
}

/// Whether this process comes down to a number of threads; one that has ended is counted until the system has
/// buried it.
#[cfg(target_os = "linux")]
fn comes_down_to(threads: u64) -> bool {
    let moment = std::time::Duration::from_millis(1);
    (0..1000).any(|_| {
        process().1 <= threads || {
            thread::sleep(moment);
            false
        }
    })
}

/// A life with a step, a saved state and a serialised one.
fn life(values: &[(&str, f64)]) -> Vec<u64> {
    let slave = Slave::ready(values);
    assert_eq!(slave.step(0.0, 1e-7), Status::Ok, "{}", slave.log());
    let state = slave.state();
    let bytes = slave.serialize(state);
    assert_eq!(slave.step(1e-7, 1e-7), Status::Ok);
    assert_eq!(slave.deserialize(&bytes).0, Status::Ok);
    slave.outputs()
}

/// Studies make thousands of instances in one process: memory must stay flat and no thread may stay.
#[test]
#[cfg(target_os = "linux")]
fn a_thousand_lives_leave_no_memory_and_no_thread() {
    let _alone = alone();
    let lives = |count| (0..count).for_each(|_| drop(life(&[])));
    // The allocator's own pools and the process-wide tables grow once.
    lives(100);
    let (memory, threads) = process();
    lives(1000);
    let (memory_after, threads_after) = process();
    println!(
        "resident memory {memory} kB and then {memory_after} kB, threads {threads} and then {threads_after}"
    );
    // One life takes some 400 kB, so a leak of a thousandth of each would show.
    assert!(memory_after < memory + 400, "resident memory grew from {memory} to {memory_after} kB");
    assert!(comes_down_to(threads));
}

/// Threads of a step end with it, so that nothing of ours computes between calls.
#[test]
#[cfg(target_os = "linux")]
fn threads_of_a_step_end_with_it() {
    let _alone = alone();
    let slave = Slave::new(false);
    // Enough points for several threads.
    assert_eq!(slave.set("numerics.point_spacing", 1.5e-5), Status::Ok);
    slave.initialize();
    let before = process().1;
    for index in 0..5 {
        assert_eq!(slave.step(f64::from(index) * 1e-8, 1e-8), Status::Ok, "{}", slave.log());
        assert!(comes_down_to(before), "a thread of step {index} has stayed");
    }
}

/// More threads than processors, each with lives of its own.
#[test]
fn many_instances_on_many_threads_agree() {
    let _alone = alone();
    let expected = life(&[]);
    thread::scope(|scope| {
        for _ in 0..32 {
            scope.spawn(|| (0..8).for_each(|_| assert_eq!(life(&[]), expected)));
        }
    });
}

/// Importers run FMUs on threads of their own, some with a small stack: 128 kB hold a whole life.
#[test]
fn a_small_stack_is_enough() {
    let _alone = alone();
    let expected = life(&[]);
    let small = thread::Builder::new().stack_size(128 << 10).spawn(|| life(&[])).unwrap();
    assert_eq!(small.join().unwrap(), expected);
}

/// A life with a resource URI; gives what the log says of it.
fn instantiate_with(uri: &[u8]) -> String {
    assert_eq!(uri.last(), Some(&0));
    let messages = Messages::default();
    let callbacks = callbacks(&messages);
    let guid = CString::new(guid()).unwrap();
    // SAFETY: all texts end with a zero; the callbacks outlive the instance, which is used by this thread
    // alone.
    unsafe {
        let uri = uri.as_ptr().cast::<c_char>();
        let made = fmi2Instantiate(c"a".as_ptr(), 1, guid.as_ptr(), uri, &raw const callbacks, 0, 1);
        assert!(!made.is_null());
        let spacing = importer::reference("numerics.point_spacing");
        assert_eq!(fmi2SetReal(made, &spacing, 1, &5e-5), Status::Ok);
        assert_eq!(fmi2EnterInitializationMode(made), Status::Ok);
        assert_eq!(fmi2ExitInitializationMode(made), Status::Ok);
        assert_eq!(fmi2DoStep(made, 0.0, 1e-8, 1), Status::Ok);
        fmi2FreeInstance(made);
    }
    messages.into_inner().unwrap().join("\n")
}

/// A file URI as a careful importer writes it.
fn uri_of(folder: &Path) -> Vec<u8> {
    let mut uri = b"file://".to_vec();
    for byte in folder.to_str().unwrap().bytes() {
        match byte {
            b'/' | b'-' | b'_' | b'.' => uri.push(byte),
            _ if byte.is_ascii_alphanumeric() => uri.push(byte),
            _ => uri.extend(format!("%{byte:02X}").bytes()),
        }
    }
    uri.push(0);
    uri
}

/// The material library is built in, so an instance runs whatever has become of its resources.
#[test]
fn resources_may_be_odd_missing_read_only_or_damaged() {
    let base = std::env::temp_dir().join(format!("swarf 100% Späne {}", std::process::id()));
    let folder = base.join("resources");
    std::fs::create_dir_all(&folder).unwrap();
    let there = instantiate_with(&uri_of(&folder));
    assert!(there.contains(&format!("resources: {}", folder.display())), "{there}");

    std::fs::write(folder.join("materials.toml"), b"\xff\0 no TOML [[[").unwrap();
    instantiate_with(&uri_of(&folder));
    let mut permissions = std::fs::metadata(&folder).unwrap().permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&folder, permissions.clone()).unwrap();
    instantiate_with(&uri_of(&folder));
    #[allow(clippy::permissions_set_readonly_false)] // Only so that it can be removed.
    permissions.set_readonly(false);
    std::fs::set_permissions(&folder, permissions).unwrap();
    std::fs::remove_dir_all(&base).unwrap();
    instantiate_with(&uri_of(&folder));

    for odd in [b"\xff\xfe\0".as_slice(), b"\0", b"file:///a%zz\0", b"http://host/a\0"] {
        let log = instantiate_with(odd);
        assert!(log.contains("no readable file URI; going on without it"), "{log}");
    }
}

/// A message with text that is not UTF-8 or looks like a format goes through the logger unharmed.
#[test]
fn odd_texts_are_refused_by_name() {
    let slave = Slave::new(false);
    let bad = [0xff_u8 as c_char, 0];
    // SAFETY: the component is alive, the arrays have one entry each, texts end with a zero.
    unsafe {
        let categories = [bad.as_ptr()];
        assert_eq!(fmi2SetDebugLogging(slave.component, 1, 1, categories.as_ptr()), Status::Error);
        let name = importer::reference("material.name");
        assert_eq!(fmi2SetString(slave.component, &name, 1, &c"%s%n%d".as_ptr()), Status::Ok);
        assert_eq!(fmi2EnterInitializationMode(slave.component), Status::Ok);
        assert_eq!(fmi2ExitInitializationMode(slave.component), Status::Error);
    }
    let log = slave.log();
    assert!(log.contains("argument categories is not UTF-8 text"), "{log}");
    assert!(log.contains("%s%n%d"), "{log}");
}
