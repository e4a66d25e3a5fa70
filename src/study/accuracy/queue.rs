//! Runs side by side, each on one thread, with a word on progress and the time left.

use super::run::{Ending, Measured, Problem};
use super::store::Store;
use crate::Error;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::time::Instant;

/// A run with its name in the table.
#[derive(Clone, Debug)]
pub struct Task {
    /// What a reader sees.
    pub label: String,
    /// What is run.
    pub problem: Problem,
}

/// Runs all tasks that the table does not hold yet, `threads` at a time, the shortest first: a study that is
/// ended early has its coarse half.
///
/// # Errors
/// When a line of the table cannot be written; what is running then still ends.
pub fn run_all(
    tasks: &[Task],
    store: &mut Store,
    threads: usize,
    tell: &(dyn Fn(String) + Sync),
) -> Result<(), Error> {
    let mut open: Vec<(f64, String, &Task)> = Vec::new();
    let mut known = 0;
    for task in tasks {
        let identity = task.problem.identity();
        if store.get(&identity).is_some() {
            known += 1;
        } else if !open.iter().any(|entry| entry.1 == identity) {
            open.push((task.problem.estimate(), identity, task));
        }
    }
    open.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = open.iter().map(|entry| entry.0).sum();
    tell(format!(
        "{} runs to make, {known} known from before: about {:.1} minutes of CPU time, {:.1} minutes with \
         {threads} at a time",
        open.len(),
        total / 60.0,
        total / 60.0 / threads as f64
    ));
    let begin = Instant::now();
    let count = open.len();
    let next = Mutex::new(open.into_iter());
    let state = Mutex::new((store, 0.0, 0, Ok(())));
    std::thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            scope.spawn(|| {
                loop {
                    let entry = lock(&next).next();
                    let Some((estimate, identity, task)) = entry else { break };
                    let ending = catch_unwind(AssertUnwindSafe(|| task.problem.run())).unwrap_or_else(|_| {
                        Ending::Failed(
                            "a check of the problem failed; see the message above".into(),
                            Measured::default(),
                        )
                    });
                    let text = account(&ending);
                    let mut state = lock(&state);
                    let (store, done, number, outcome) = &mut *state;
                    (*done, *number) = (*done + estimate, *number + 1);
                    let gone = begin.elapsed().as_secs_f64();
                    let left = if *done > 0.0 { gone * (total - *done) / *done } else { 0.0 };
                    tell(format!(
                        "{number}/{count} {}: {text}; {gone:.0} s gone, {left:.0} s left",
                        task.label
                    ));
                    let put = store.put(&identity, &task.label, ending);
                    if put.is_err() {
                        *outcome = put;
                        break;
                    }
                }
            });
        }
    });
    state.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner).3
}

/// A panic of one run (a verification problem that became unstable) must not take the others along.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn account(ending: &Ending) -> String {
    match ending {
        Ending::Done(measured) => format!("{:.2} s of CPU time", measured.cpu_seconds),
        Ending::Failed(text, _) => format!("failed: {text}"),
        Ending::Refused(text) => format!("refused: {text}"),
    }
}
