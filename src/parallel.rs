//! Threads of one instance, and how they share work.
//!
//! A substep divides its work several times and does some of it, contact foremost, on one thread. A thread
//! that sleeps meanwhile is woken late (book/src/evidence/performance.md). So threads stay awake while one
//! instance's substeps run, and not between its communication steps.

use rayon::Yield;
use std::hint;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

/// Looks for work after which a waiting thread lets other programs have its processor between two of them.
const EAGER_LOOKS: u32 = 2000;

/// Runs `work` in a pool of threads that have ended when this returns.
///
/// # Errors
/// Where no thread can be started.
///
/// rayon's own `build_scoped` only waits until its threads have no more work; on their way out they still run
/// code of this library, which the importer may unload.
pub fn in_pool<T: Send>(
    threads: usize,
    work: impl FnOnce() -> T + Send,
) -> Result<T, rayon::ThreadPoolBuildError> {
    thread::scope(|scope| {
        let mut handles = Vec::new();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).spawn_handler(|member| {
            handles.push(thread::Builder::new().spawn_scoped(scope, || member.run())?);
            Ok(())
        });
        let result = pool.build().map(|pool| pool.install(|| with_others_awake(work)));
        // A thread's own panic has been passed on by `install`.
        handles.into_iter().for_each(|handle| drop(handle.join()));
        result
    })
}

/// Runs `work` while the other threads of the current pool stay awake.
fn with_others_awake<T>(work: impl FnOnce() -> T) -> T {
    let is_done = AtomicBool::new(false);
    let leader = rayon::current_thread_index();
    rayon::in_place_scope(|scope| {
        // Also when `work` panics: the scope waits for all that were told to stay awake.
        let _end = AtEnd(|| is_done.store(true, Ordering::Release));
        // What is broadcast each thread has to do itself, so the leader never takes another's part and waits
        // for its own end.
        scope.spawn_broadcast(|_, member| {
            if Some(member.index()) == leader {
                return;
            }
            let mut looks = 0;
            while !is_done.load(Ordering::Acquire) {
                match rayon::yield_now() {
                    Some(Yield::Executed) => looks = 0,
                    _ => wait_a_little(&mut looks),
                }
            }
        });
        work()
    })
}

/// Waits between two looks, eagerly at first.
fn wait_a_little(looks: &mut u32) {
    *looks += 1;
    if *looks < EAGER_LOOKS { hint::spin_loop() } else { thread::yield_now() }
}

/// Does what it holds when it goes, by a panic, too.
struct AtEnd<F: FnMut()>(F);

impl<F: FnMut()> Drop for AtEnd<F> {
    fn drop(&mut self) {
        (self.0)();
    }
}

/// Runs `work` on each item, on the threads of the current pool: each takes the next item when it is done
/// with one.
///
/// What takes longest should stand first, so that the threads end together.
pub fn take_turns<T>(items: impl Iterator<Item = T> + Send, work: impl Fn(T) + Sync) {
    let items = Mutex::new(items);
    let in_work = AtomicUsize::new(0);
    let next = || {
        let mut items = items.lock().expect("taking an item does not panic");
        items.next().inspect(|_| {
            in_work.fetch_add(1, Ordering::Relaxed);
        })
    };
    let take = || {
        while let Some(item) = next() {
            let _end = AtEnd(|| {
                in_work.fetch_sub(1, Ordering::Release);
            });
            work(item);
        }
        // Until the others are done, too: the pool would let this thread sleep for it.
        let mut looks = 0;
        while in_work.load(Ordering::Acquire) > 0 {
            wait_a_little(&mut looks);
        }
    };
    on_each(rayon::current_num_threads(), &take);
}

/// Runs `work` on each item, on the threads of the current pool or on this one.
pub fn for_each<T>(items: impl Iterator<Item = T> + Send, parallel: bool, work: impl Fn(T) + Sync) {
    if parallel { take_turns(items, work) } else { items.for_each(work) }
}

/// Runs `work` on so many threads of the current pool, as far as they are free. Of any work by one function:
/// each pass of each model would have its own copy of what hands work over.
fn on_each(threads: usize, work: &(dyn Fn() + Sync)) {
    if threads <= 1 {
        return work();
    }
    rayon::join(|| on_each(threads / 2, work), || on_each(threads - threads / 2, work));
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    /// Every item has its turn once, on any number of threads, also on more than there are items.
    #[test]
    fn every_item_has_one_turn() {
        for threads in [1, 2, 3, 7] {
            for count in [0, 1, 5, 16] {
                let mut turns = vec![0; count];
                in_pool(threads, || take_turns(turns.iter_mut(), |turn| *turn += 1)).expect("threads");
                assert_eq!(turns, vec![1; count], "{threads} threads");
            }
        }
    }

    /// A panic of the work or of an item comes out, and nobody waits for ever.
    #[test]
    fn a_panic_comes_out() {
        let panics = |work: fn()| std::panic::catch_unwind(|| in_pool(2, work)).is_err();
        assert!(panics(|| panic!("on purpose: the work")));
        assert!(panics(|| take_turns(0..5, |item| assert_ne!(item, 3, "on purpose: an item"))));
    }

    /// While one thread works alone the other does not go to sleep: it would be woken late.
    #[test]
    #[cfg(target_os = "linux")]
    fn threads_stay_awake_between_turns() {
        /// Times that the present thread has gone to sleep.
        fn sleeps() -> u32 {
            let status = std::fs::read_to_string("/proc/thread-self/status").expect("Linux has it");
            let line = status.lines().find(|line| line.starts_with("voluntary_ctxt_switches"));
            let count = line.and_then(|line| line.split_whitespace().last()).expect("a count");
            count.parse().expect("a number")
        }
        const ROUNDS: usize = 100;
        let counts = Mutex::new(Vec::new());
        let work = || {
            for _ in 0..ROUNDS {
                // Longer than the pool keeps a thread awake that finds no work.
                let begin = Instant::now();
                while begin.elapsed() < Duration::from_micros(500) {
                    hint::spin_loop();
                }
                let taken = AtomicUsize::new(0);
                take_turns(0..2, |_| {
                    taken.fetch_add(1, Ordering::SeqCst);
                    while taken.load(Ordering::SeqCst) < 2 {
                        thread::yield_now();
                    }
                    let entry = (rayon::current_thread_index(), sleeps());
                    counts.lock().expect("no panic").push(entry);
                });
            }
        };
        in_pool(2, work).expect("threads");
        let counts = counts.into_inner().expect("no panic");
        for thread in [Some(0), Some(1)] {
            let own = || counts.iter().filter(|entry| entry.0 == thread).map(|entry| entry.1);
            assert_eq!(own().count(), ROUNDS, "turns of thread {thread:?}");
            let slept = own().max().expect("turns") - own().min().expect("turns");
            // A few for a lock that the other one holds.
            assert!(slept < ROUNDS as u32 / 4, "thread {thread:?} slept {slept} times in {ROUNDS} rounds");
        }
    }

    /// Two threads work at the same time: each of two items waits until both have been taken.
    #[test]
    fn threads_take_turns_side_by_side() {
        let taken = AtomicUsize::new(0);
        let wait_for_both = |_| {
            taken.fetch_add(1, Ordering::SeqCst);
            while taken.load(Ordering::SeqCst) < 2 {
                std::thread::yield_now();
            }
        };
        in_pool(2, || take_turns(0..2, wait_for_both)).expect("threads");
        assert_eq!(taken.into_inner(), 2);
    }
}
