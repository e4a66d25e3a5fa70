//! Threads of one instance, and how they share work.

use std::sync::Mutex;

/// Runs `work` in a pool of threads that have ended when this returns.
///
/// # Errors
/// Where no thread can be started.
///
/// rayon's own `build_scoped` only waits until its threads have no more work; on their way out they still run code of this
/// library, which the importer may unload.
pub fn in_pool<T: Send>(
    threads: usize,
    work: impl FnOnce() -> T + Send,
) -> Result<T, rayon::ThreadPoolBuildError> {
    std::thread::scope(|scope| {
        let mut handles = Vec::new();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).spawn_handler(|thread| {
            handles.push(std::thread::Builder::new().spawn_scoped(scope, || thread.run())?);
            Ok(())
        });
        let result = pool.build().map(|pool| pool.install(work));
        // A thread's own panic has been passed on by `install`.
        handles.into_iter().for_each(|handle| drop(handle.join()));
        result
    })
}

/// Runs `work` on each item, on the threads of the current pool: each takes the next item when it is done with one.
///
/// What takes longest should stand first, so that the threads end together.
pub fn take_turns<T>(items: impl Iterator<Item = T> + Send, work: impl Fn(T) + Sync) {
    let items = Mutex::new(items);
    let take = || {
        loop {
            let item = items.lock().expect("taking an item does not panic").next();
            let Some(item) = item else { break };
            work(item);
        }
    };
    on_each(rayon::current_num_threads(), &take);
}

/// Runs `work` on each item, on the threads of the current pool or on this one.
pub fn for_each<T>(items: impl Iterator<Item = T> + Send, parallel: bool, work: impl Fn(T) + Sync) {
    if parallel { take_turns(items, work) } else { items.for_each(work) }
}

/// Runs `work` on so many threads of the current pool, as far as they are free.
fn on_each(threads: usize, work: &(impl Fn() + Sync)) {
    if threads <= 1 {
        return work();
    }
    rayon::join(|| on_each(threads / 2, work), || on_each(threads - threads / 2, work));
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

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
