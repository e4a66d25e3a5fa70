//! The step loop asks for no memory: a global allocator that counts, hence a test program of its own.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};
use swarf::scene::{Formulation, Scene};
use swarf::simulation::ToolMotion;
use swarf::{setup, setup::checks};

struct Counting;

static CALLS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every request goes to the system's allocator as it came; counting touches no memory of the
// caller's.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: our caller keeps the contract of `alloc`, which is the system allocator's.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: `pointer` came from `System` through `alloc` or `realloc` above.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        CALLS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: `pointer` came from `System`, and our caller keeps the contract of `realloc`.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Calls of the allocator in substeps of each kind.
#[derive(Debug, Default)]
struct Calls {
    /// Ordinary substeps, and the calls in them.
    ordinary: [usize; 2],
    /// Substeps that sort the points.
    sorting: [usize; 2],
    /// Substeps in which the locking control looks at the points, but no sort.
    controlling: [usize; 2],
}

/// Counts over `substeps` substeps of the reference cut with 12,500 points, with plain or smoothed
/// increments, once `warm_up` substeps are over.
fn count(
    warm_up: usize,
    substeps: usize,
    parallel: bool,
    (formulation, smoothed): (Formulation, bool),
) -> Calls {
    let mut scene = Scene::default();
    scene.workpiece.length = 5e-3;
    scene.numerics.point_spacing = 2e-5;
    scene.numerics.formulation = formulation;
    scene.numerics.smoothed_increments = smoothed;
    let scene = checks::check(&scene).expect("a good scene");
    let mut solver = setup::build(&scene).expect("a good scene");
    let motion = ToolMotion { velocity: [-200.0, 0.0], friction: 0.2 };
    let mut calls = Calls::default();
    for k in 0..warm_up + substeps {
        let travel = (solver.progress().travel, solver.progress().travel_uncontrolled);
        let before = CALLS.load(Ordering::Relaxed);
        solver.step(&motion, parallel).expect("a stable run");
        let called = CALLS.load(Ordering::Relaxed) - before;
        let kind = if solver.progress().travel < travel.0 {
            &mut calls.sorting
        } else if solver.progress().travel_uncontrolled < travel.1 {
            &mut calls.controlling
        } else {
            &mut calls.ordinary
        };
        if k >= warm_up {
            kind[0] += 1;
            kind[1] += called;
        }
    }
    calls
}

/// One test, since the counter belongs to the whole program and tests run side by side.
///
/// Ordinary substeps ask for nothing, on one thread and on two. Sorts and the locking control keep what they
/// once had and ask for more only where the chip has grown beyond it: fewer calls than substeps of that kind
/// (before the buffers were kept it was some fifty calls for each sort).
#[test]
fn substeps_allocate_nothing() {
    let (plain, separated) = (Formulation::Plain, Formulation::Separated);
    let serial = count(300, 900, false, (plain, false));
    println!("one thread: {serial:?}");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("two threads");
    let parallel = pool.install(|| count(300, 900, true, (plain, false)));
    let smoothed = count(300, 900, false, (plain, true));
    let parted = count(300, 900, false, (separated, false));
    println!("chip and work parted: {parted:?}");
    println!("smoothed increments: {smoothed:?}");
    println!("two threads: {parallel:?}");
    for calls in [&serial, &parallel, &smoothed] {
        assert!(calls.ordinary[0] > 500 && calls.sorting[0] >= 5 && calls.controlling[0] >= 20, "{calls:?}");
        assert!(calls.sorting[1] <= calls.sorting[0], "{calls:?}");
        assert!(calls.controlling[1] <= calls.controlling[0], "{calls:?}");
    }
    // The grid moves under all points, so there are more sorts; nothing controls locking.
    assert!(parted.ordinary[0] > 500 && parted.sorting[0] >= 5, "{parted:?}");
    assert!(parted.sorting[1] <= parted.sorting[0], "{parted:?}");
    assert_eq!(parted.ordinary[1], 0, "{parted:?}");
    assert_eq!(serial.ordinary[1], 0, "{serial:?}");
    assert_eq!(parallel.ordinary[1], 0, "{parallel:?}");
    assert_eq!(smoothed.ordinary[1], 0, "{smoothed:?}");
}
