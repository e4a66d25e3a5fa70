//! Whether a communication step may be made: from where, how far, and what the inputs become on the way.

use super::refusal::Refusal;
use super::saved::Header;
use crate::scene::Inputs;
use crate::session::Session;
use crate::variables::{self, time_text};

/// Steps and stop times may differ from the instance's own clock by this share, as masters add up rounded
/// steps (-).
const TIME_TOLERANCE: f64 = 1e-9;

/// The time a step leads to (s), if it starts at the instance's clock, goes forward and ends before the stop
/// time.
pub(super) fn check_step(header: &Header, time: f64, step: f64) -> Result<f64, Refusal> {
    let now = header.time;
    let refuse =
        |text: String| Err(Refusal::BadArgument(format!("{text}; the instance stays at {}", time_text(now))));
    if !(time.is_finite() && step.is_finite()) {
        return refuse(format!("a step from {} by {} is not finite", time_text(time), time_text(step)));
    }
    if step <= 0.0 {
        return refuse(format!("a step of {} does not go forward", time_text(step)));
    }
    // Never more than a small part of the step, however late it is.
    let tolerance = (TIME_TOLERANCE * now.abs().max(step)).min(0.01 * step);
    if (time - now).abs() > tolerance.max(4.0 * f64::EPSILON * now.abs()) {
        return refuse(format!(
            "a step from {} does not start at the last communication point",
            time_text(time)
        ));
    }
    let target = time + step;
    if !(target.is_finite() && target > now) {
        let [step, now] = [step, now].map(time_text);
        return refuse(format!("a step of {step} is too short to move a clock at {now}"));
    }
    match header.stop {
        Some(stop) if target - stop > TIME_TOLERANCE * stop.abs().max(step) => {
            refuse(format!("a step to {} passes the stop time {}", time_text(target), time_text(stop)))
        }
        _ => Ok(target),
    }
}

/// Inputs that slope out of their range within the step would break the solver's assumptions in the middle of
/// it.
pub(super) fn check_sloped_inputs(header: &Header, session: &Session, target: f64) -> Result<(), Refusal> {
    let span = target - header.time;
    let (values, slopes) = (header.scene.inputs, header.slopes);
    let ends = [
        ("tool_velocity", values.tool_velocity + slopes.tool_velocity * span),
        ("feed", values.feed + slopes.feed * span),
        ("friction", values.friction + slopes.friction * span),
    ];
    for (name, value) in ends {
        if let Some(variables::Kind::Real(real)) = variables::by_name(name).map(|variable| &variable.kind) {
            real.check(&format!("{name} (value and slope at the end of the step)"), value)?;
        }
    }
    // The deepest and the highest feed of the step are at its ends.
    session.check_inputs(&values)?;
    Ok(session.check_inputs(&Inputs { feed: ends[1].1, ..values })?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fmi::saved::Model;

    fn header(time: f64, stop: Option<f64>) -> Header {
        Header { time, stop, ..Model::default().header }
    }

    /// Masters that add up steps or multiply them both pass; a gap of a hundredth of a step does not.
    #[test]
    fn steps_must_start_at_the_clock_within_rounding() {
        let (mut sum, step) = (0.0, 1e-6);
        for index in 0..1000 {
            let product = f64::from(index) * step;
            assert!(check_step(&header(sum, None), product, step).is_ok(), "{product} against {sum}");
            sum += step;
        }
        assert!(check_step(&header(1e-5, None), 1.01e-5, step).is_err());
        assert!(check_step(&header(1e-5, None), 0.0, step).is_err());
        assert!(check_step(&header(1e6, None), 1e6, 1e-3).is_ok());
        assert!(check_step(&header(1e6, None), 1e6 + 1e-3, 1e-3).is_err());
    }

    /// Wrong lengths, and steps that floating point cannot make.
    #[test]
    fn steps_must_go_forward_and_end_before_the_stop_time() {
        for step in [0.0, -1e-6, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(check_step(&header(0.0, None), 0.0, step).is_err(), "{step}");
        }
        assert!(check_step(&header(0.0, None), f64::NAN, 1e-6).is_err());
        assert!(check_step(&header(1.0, None), 1.0, 1e-20).is_err());
        assert!(check_step(&header(f64::MAX, None), f64::MAX, f64::MAX).is_err());
        assert!(check_step(&header(3.9e-5, Some(4e-5)), 3.9e-5, 1e-6).is_ok());
        let refusal = check_step(&header(3.95e-5, Some(4e-5)), 3.95e-5, 1e-6).unwrap_err();
        assert!(
            refusal
                .to_string()
                .contains("a step to 40.5 µs passes the stop time 40 µs; the instance stays at 39.5 µs"),
            "{refusal}"
        );
    }
}
