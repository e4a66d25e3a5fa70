//! What an importer hears: categories that can be switched, and news from a long step.

// Apple on ARM passes variable arguments on the stack, where the tests' logger does not look for them.
#![cfg(not(all(target_vendor = "apple", target_arch = "aarch64")))]

mod importer;

use importer::{Slave, Status};
use std::ffi::CString;
use swarf::fmi::abi::*;

/// Switches categories by name.
fn switch(slave: &Slave, is_on: bool, names: &[&str]) {
    let texts: Vec<CString> = names.iter().map(|name| CString::new(*name).unwrap()).collect();
    let pointers: Vec<_> = texts.iter().map(|text| text.as_ptr()).collect();
    // SAFETY: the component is alive; the array holds as many texts as said, each ending with a zero.
    let status =
        unsafe { fmi2SetDebugLogging(slave.component, i32::from(is_on), pointers.len(), pointers.as_ptr()) };
    assert_eq!(status, Status::Ok, "{names:?}: {}", slave.log());
}

/// Brings about a message of each category that a running instance can speak in, and gives the categories
/// heard.
fn heard(slave: &Slave, time: &mut f64) -> Vec<&'static str> {
    slave.log();
    // SAFETY: the component is alive, the places are ours.
    unsafe {
        assert_eq!(slave.step(*time, 1e-7), Status::Ok);
        *time += 1e-7;
        assert_eq!(fmi2GetStatus(slave.component, 0, &mut 0), Status::Discard);
        assert_eq!(fmi2GetReal(slave.component, &4711, 1, &mut 0.0), Status::Error);
        assert_eq!(fmi2Terminate(slave.component), Status::Ok);
    }
    let log = slave.log();
    let live = ["solver", "logStatusDiscard", "logStatusError", "logEvents"];
    live.into_iter().filter(|name| log.contains(&format!("slave {} {name} ", number(name)))).collect()
}

/// Status that goes with messages of a category, by the standard's numbers.
fn number(category: &str) -> i32 {
    match category {
        "logStatusDiscard" => 2,
        "logStatusError" => 3,
        _ => 0,
    }
}

/// An importer that filters by category must be able to have each one alone, and to silence each one alone.
/// (Warnings come before an instance can be spoken to; that their switch works is tested in `fmi::instance`.)
#[test]
fn each_category_can_be_had_alone_and_left_out_alone() {
    let all = ["solver", "logStatusDiscard", "logStatusError", "logEvents"];
    for one in all {
        for is_on in [true, false] {
            let slave = Slave::ready(&[]);
            if !is_on {
                switch(&slave, true, &["logAll"]);
            }
            switch(&slave, is_on, &[one]);
            let expected: Vec<_> = all.into_iter().filter(|name| (*name == one) == is_on).collect();
            assert_eq!(heard(&slave, &mut 0.0), expected, "{one} switched {is_on}");
        }
    }
}

/// Without being asked, an instance explains what it refused or cut short, and nothing else.
#[test]
fn at_first_only_refusals_and_discards_are_told() {
    let slave = Slave::ready(&[]);
    assert_eq!(heard(&slave, &mut 0.0), ["logStatusDiscard", "logStatusError"]);
}

/// Who asks for `solver` learns which effects run, and what each step took.
#[test]
fn the_solver_tells_its_effects_and_what_a_step_took() {
    let slave = Slave::new(false);
    switch(&slave, true, &["solver"]);
    slave.set("numerics.point_spacing", 5e-5);
    slave.initialize();
    let effects = slave.log();
    assert!(effects.contains("slave 0 solver effects: plasticity (AISI 4340)"), "{effects}");
    assert_eq!(slave.step(0.0, 1e-6), Status::Ok);
    let (log, substeps) = (slave.log(), slave.get_integer("numerics.substeps"));
    assert!(substeps > 0 && log.contains(&format!(" {substeps} substeps, the last of ")), "{log}");
    assert!(log.contains("0 retired in this step") && log.contains("smallest volume ratio"), "{log}");
}

/// Nobody should wonder whether a long step still runs: messages with the time reached and the time left, the
/// first long before the step ends, and nearly a second apart by the program's own clock, which a busy
/// machine cannot bring nearer together.
#[test]
fn a_long_step_gives_news() {
    const LIMIT: f64 = 3.5;
    // What the FMU waits, a little less than a second, less the rounding of two times in the messages.
    const SHORTEST: f64 = 0.85 - 0.1;
    let slave = Slave::new(false);
    switch(&slave, true, &["solver"]);
    // 30,000 points would run for a quarter of a minute; the wall time limit ends the step before.
    assert_eq!(slave.set("numerics.wall_time_limit", LIMIT), Status::Ok);
    slave.initialize();
    slave.log();
    assert_eq!(slave.step(0.0, 4e-5), Status::Discard);
    let log = slave.log();
    let news: Vec<&str> = log.lines().filter(|line| line.contains(" reached after ")).collect();
    let mut times = vec![0.0];
    for line in &news {
        assert!(line.starts_with("slave 0 solver step to "), "{line}");
        let (_, rest) = line.split_once(" reached after ").unwrap_or_else(|| panic!("{line}"));
        let (time, rest) = rest.split_once(" s, ").unwrap_or_else(|| panic!("{line}"));
        assert!(rest.contains(" left, about "), "{line}");
        times.push(time.parse::<f64>().unwrap_or_else(|_| panic!("{line}")));
    }
    println!("news after {times:?} s");
    assert!(!news.is_empty(), "no news in {LIMIT} s: {log}");
    let shortest = times.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    assert!(shortest >= SHORTEST, "{shortest} s between two messages, times {times:?}");
}
