//! What the category `solver` tells of a step: how far a long one has come and what is left, and what it took
//! in the end.

use crate::Error;
use crate::session::{Advance, Outputs, Session};
use crate::variables::time_text;
use std::panic::resume_unwind;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

/// Wall time between two messages; the solver looks up every 0.1 s, so that they come at least every second.
const PERIOD: Duration = Duration::from_millis(850);

/// Tells from time to time how far a step has come.
pub(super) struct Progress<'a> {
    /// Where the step begins (s).
    pub from: f64,
    /// Where it leads to (s).
    pub target: f64,
    /// When it began.
    pub begun: Instant,
    /// When the last message was made, be it in an earlier step.
    pub reported: &'a mut Instant,
}

/// Advances the session in a thread of its own and passes its messages on from here.
///
/// The solver may look up from any of its threads, but many importers can only take a message in the thread
/// that called `fmi2DoStep`. Where no thread can be started the step runs here, without messages.
///
/// # Errors
/// Those of `Session::advance_to`.
pub(super) fn advance_and_tell(
    session: &mut Session,
    mut progress: Progress,
    tell: impl Fn(String),
) -> Result<Advance, Error> {
    let target = progress.target;
    let (sender, receiver) = mpsc::channel();
    let reported = thread::scope(|scope| {
        let session = &mut *session;
        let run = move || {
            session.advance_to(target, &mut |clock| {
                if let Some(text) = progress.due(clock) {
                    // The receiver outlives this thread.
                    let _ = sender.send(text);
                }
                true
            })
        };
        let solver = thread::Builder::new().name("swarf".into()).spawn_scoped(scope, run).ok()?;
        // Ends when the thread drops its sender.
        receiver.iter().for_each(tell);
        Some(solver.join().unwrap_or_else(|panic| resume_unwind(panic)))
    });
    reported.unwrap_or_else(|| session.advance_to(target, &mut |_| true))
}

impl Progress<'_> {
    /// A message, if the last one is long enough ago.
    fn due(&mut self, clock: f64) -> Option<String> {
        if self.reported.elapsed() < PERIOD {
            return None;
        }
        *self.reported = Instant::now();
        Some(self.text(clock, self.begun.elapsed().as_secs_f64()))
    }

    fn text(&self, clock: f64, wall: f64) -> String {
        let left = (self.target - clock).max(0.0);
        let done = clock - self.from;
        // Without progress there is no rate to go by.
        let wall_left = if done > 0.0 {
            format!("about {:.1} s of wall time", wall * left / done)
        } else {
            "wall time unknown yet".to_owned()
        };
        let [target, clock, left] = [self.target, clock, left].map(short);
        format!("step to {target}: {clock} reached after {wall:.1} s, {left} left, {wall_left}")
    }
}

/// What a step took: substeps, and what guards the run (points left over, retired and squeezed, energy).
///
/// * `reached`: where it ended (s)
/// * `wall`: wall time it took (s)
/// * `before`: outputs when it began
pub(super) fn summary(reached: f64, wall: f64, before: &Outputs, outputs: &Outputs) -> String {
    let Outputs { substeps, time_step, active_points, min_jacobian, balance_error, .. } = outputs;
    let text = format!(
        "at {} after {wall:.3} s of wall time: {substeps} substeps, the last of {}; {active_points} points, {} \
         retired in this step; smallest volume ratio {min_jacobian:.3}; energy unaccounted for {:.3} %",
        short(reached),
        short(*time_step),
        outputs.retired_points - before.retired_points,
        100.0 * balance_error
    );
    let text = match outputs.stray_velocities - before.stray_velocities {
        0 => text,
        strays => format!("{text}; {strays} velocities that the grid could not see were brought back"),
    };
    match outputs.retries - before.retries {
        0 => text,
        retries => format!(
            "{text}; {retries} times a substep was solved again at half its length, because a point would \
             have moved too far or changed its volume too much"
        ),
    }
}

/// A time with six digits, for reading.
fn short(time: f64) -> String {
    time_text(format!("{time:.5e}").parse().unwrap_or(time))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter done in 2 s leaves three quarters for 6 s.
    #[test]
    fn progress_names_time_reached_and_time_left() {
        let mut reported = Instant::now();
        let progress = Progress { from: 0.0, target: 4e-6, begun: reported, reported: &mut reported };
        let text = progress.text(1e-6, 2.0);
        assert_eq!(text, "step to 4 µs: 1 µs reached after 2.0 s, 3 µs left, about 6.0 s of wall time");
    }

    /// What a user looks for after a step that took long or went wrong.
    #[test]
    fn the_summary_names_substeps_and_guards() {
        let before = Outputs { retired_points: 1, retries: 5, ..Outputs::default() };
        let mut outputs = Outputs {
            substeps: 412,
            time_step: 2.4e-9,
            active_points: 29_997,
            retired_points: 3,
            min_jacobian: 0.931,
            balance_error: -4e-4,
            retries: 5,
            ..Outputs::default()
        };
        assert_eq!(
            summary(1e-6, 0.5, &before, &outputs),
            "at 1 µs after 0.500 s of wall time: 412 substeps, the last of 2.4 ns; 29997 points, 2 retired in this \
             step; smallest volume ratio 0.931; energy unaccounted for -0.040 %"
        );
        outputs.stray_velocities = 12;
        outputs.retries = 7;
        let text = summary(1e-6, 0.5, &before, &outputs);
        assert!(text.contains("; 12 velocities that the grid could not see"), "{text}");
        assert!(text.contains("; 2 times a substep was solved again at half its length"), "{text}");
    }

    /// The first message waits for the period, and so does the next.
    #[test]
    fn messages_keep_their_distance() {
        let mut reported = Instant::now();
        let mut progress = Progress { from: 0.0, target: 4e-6, begun: reported, reported: &mut reported };
        assert_eq!(progress.due(1e-6), None);
        if let Some(earlier) = Instant::now().checked_sub(PERIOD) {
            *progress.reported = earlier;
            assert!(progress.due(1e-6).is_some());
            assert_eq!(progress.due(1e-6), None);
        }
    }
}
