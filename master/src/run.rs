//! The run itself: parameters in, communication steps, a line of the history after each.

use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;
use indicatif::{ProgressBar, ProgressStyle};
use swarf::output::results::history_head;

use crate::fmu::{Fmu, Instance, Step, output_variables};
use crate::history::History;
use crate::messages;
use crate::options::Options;
use crate::units::time_text;

/// Travel of the paper's cut (m).
const TRAVEL: f64 = 2e-3;
/// Feeds before the workpiece's left side, which is held, at which a cut ends: nearer, the force rises.
const FEEDS_LEFT: f64 = 2.0;
/// Travel between two frames of the fields (m).
pub(crate) const FRAME_TRAVEL: f64 = 1e-4;

/// What a run gave.
pub struct Cut {
    /// Its table.
    pub history: History,
    /// All parameters and inputs as the FMU had them.
    pub parameters: Vec<(String, String)>,
    /// The same with their units, as they stand in the heads of files.
    pub heads: Vec<(String, String)>,
    /// How it ended.
    pub ending: Ending,
    /// Processor time of all threads (s).
    pub cpu_seconds: f64,
    /// Time on the clock (s).
    pub wall_seconds: f64,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Ending {
    /// At the time asked for.
    Complete,
    /// By Ctrl-C.
    Interrupted,
    /// The FMU could not go on.
    Failed(String),
}

/// Tells what the run would cost, without making it or writing a file.
///
/// # Errors
/// What the FMU refuses.
pub fn estimate(options: &Options) -> Result<(), String> {
    let fmu = Fmu::load(&options.fmu)?;
    let mut instance = fmu.instantiate(messages::INSTANCE)?;
    for (name, value) in &options.set {
        instance.set_text(name, value)?;
    }
    let stop = stop_time(options, &fmu)?;
    let begin = Instant::now();
    instance.initialize(0.0, stop)?;
    let took = begin.elapsed().as_secs_f64();
    let cpu_seconds = instance.get("numerics.estimated_cpu_time")?;
    let band = 100.0 * instance.get("numerics.force_error_band")?;
    let stop = time_text(stop);
    println!(
        "to {stop}: about {cpu_seconds:.1} s of CPU time by numerics.point_rate; cutting force within ±{band:.1} % by the price list"
    );
    println!("({} points; built and estimated in {took:.2} s)", instance.get("numerics.active_points")?);
    instance_terminate(&mut instance);
    Ok(())
}

/// End of the run (s): as asked for, or after the paper's travel, sooner where the workpiece is too short for
/// it.
fn stop_time(options: &Options, fmu: &Fmu) -> Result<f64, String> {
    if let Some(stop) = options.stop {
        return Ok(stop);
    }
    let velocity = start_value(options, fmu, "tool_velocity")?;
    if velocity <= 0.0 {
        return Ok(fmu.description.stop_time);
    }
    if start_text(options, fmu, "workpiece.endless")
        .is_some_and(|text| ["true", "1"].contains(&text.as_str()))
    {
        return Ok(TRAVEL / velocity);
    }
    let number = |name: &str| start_value(options, fmu, name);
    let [length, gap, feed] = [number("workpiece.length")?, number("tool.initial_gap")?, number("feed")?];
    let is_free = start_text(options, fmu, "workpiece.held_side")
        .is_some_and(|text| ["false", "0"].contains(&text.as_str()));
    if is_free {
        // The tool leaves there, and goes on for one feed.
        return Ok(TRAVEL.min(gap + length + feed) / velocity);
    }
    let travel = usual_travel(length, gap, feed.max(0.0))?;
    if travel < TRAVEL {
        eprintln!(
            "swarf-master: to {:.3} mm of travel, {FEEDS_LEFT} feeds before the workpiece's held side \
             ({} mm in a longer one; --stop sets another end)",
            1e3 * travel,
            1e3 * TRAVEL
        );
    }
    Ok(travel / velocity)
}

/// Travel of a cut whose end is not set (m).
///
/// * `length`: of the workpiece along the cut (m)
/// * `gap`: from the tool's edge to the workpiece at the start (m)
/// * `feed`: (m)
///
/// # Errors
/// When the workpiece ends before the cut begins.
fn usual_travel(length: f64, gap: f64, feed: f64) -> Result<f64, String> {
    let left = FEEDS_LEFT * feed;
    if length <= left {
        let [length, left] = [1e3 * length, 1e3 * left];
        return Err(format!(
            "workpiece.length = {length:.3} mm leaves nothing to cut: a run ends {FEEDS_LEFT} feeds \
             ({left:.3} mm) before the held side; --stop sets another end"
        ));
    }
    Ok(TRAVEL.min(gap + length - left))
}

/// Runs the cut.
///
/// # Errors
/// When it cannot begin, or a file cannot be written.
pub fn run(options: &Options) -> Result<Cut, String> {
    go(options, &watch_for_interrupt())
}

/// Runs the cut, and where it is asked for and the cut came to its end a twin at twice the spacing, whose files
/// go into a folder `twin` of their own.
///
/// # Errors
/// When one cannot begin, or a file cannot be written.
pub fn run_with_twin(options: &Options) -> Result<(Cut, Option<Cut>), String> {
    let stop_asked = watch_for_interrupt();
    let cut = go(options, &stop_asked)?;
    if !options.band || cut.ending != Ending::Complete {
        return Ok((cut, None));
    }
    let spacing = cut.parameters.iter().find(|(name, _)| name == "numerics.point_spacing");
    let spacing: f64 = spacing.and_then(|(_, text)| text.parse().ok()).ok_or("the FMU tells no spacing")?;
    let mut twin = Options { out: options.out.join("twin"), ..options.clone() };
    twin.set.push(("numerics.point_spacing".into(), format!("{:e}", 2.0 * spacing)));
    eprintln!("swarf-master: a second cut with points {:.3} µm apart, for the bands", 2e6 * spacing);
    let twin = go(&twin, &stop_asked)?;
    match &twin.ending {
        Ending::Failed(text) => eprintln!("swarf-master: no bands: the second cut failed ({text})"),
        Ending::Interrupted => eprintln!("swarf-master: no bands: the second cut was stopped"),
        Ending::Complete => return Ok((cut, Some(twin))),
    }
    Ok((cut, None))
}

fn go(options: &Options, stop_asked: &AtomicBool) -> Result<Cut, String> {
    let out =
        std::path::absolute(&options.out).map_err(|e| format!("--out '{}': {e}", options.out.display()))?;
    std::fs::create_dir_all(&out).map_err(|e| format!("cannot make '{}': {e}", out.display()))?;
    let fmu = Fmu::load(&options.fmu)?;
    let mut instance = fmu.instantiate(messages::INSTANCE)?;
    for (name, value) in &options.set {
        instance.set_text(name, value)?;
    }
    let velocity = start_value(options, &fmu, "tool_velocity")?;
    if options.set_value("results.directory").is_none() {
        instance.set_text("results.directory", &out.join("fields").display().to_string())?;
        if velocity > 0.0 && options.set_value("results.interval").is_none() {
            instance.set_text("results.interval", &format!("{:e}", FRAME_TRAVEL / velocity))?;
        }
    }
    let stop = stop_time(options, &fmu)?;
    // Four steps a cell resolve the force; the solver's own clock does not care.
    let step = options.step.unwrap_or(fmu.description.step_size.min(stop / 400.0));
    instance.initialize(0.0, stop)?;

    let parameters = instance.parameters()?;
    let heads = fmu.description.with_units(&parameters);
    messages::into_file(&out.join("messages.log"), &history_head(&heads))?;
    let names: Vec<String> = output_variables(&fmu.description).iter().map(|v| v.name.clone()).collect();
    let mut history = History::begin(&out.join("history.csv"), &heads, &names)?;
    let (cpu, wall) = (ProcessTime::now(), Instant::now());
    let ending = steps(&mut instance, &mut history, stop, step, stop_asked)?;
    let (cpu_seconds, wall_seconds) = (cpu.elapsed().as_secs_f64(), wall.elapsed().as_secs_f64());
    if ending == Ending::Complete {
        instance_terminate(&mut instance);
    } else {
        let (lines, path, travel) = (history.len(), history.path.display(), 1e3 * history.last("travel"));
        eprintln!(
            "swarf-master: ended at {travel:.3} mm of travel; '{path}' is complete up to there ({lines} \
             lines)"
        );
    }
    Ok(Cut { history, parameters, heads, ending, cpu_seconds, wall_seconds })
}

/// A variable's value at the start as text: what was set, or the description's start value.
///
/// An FMU gives no value before it is initialized.
fn start_text(options: &Options, fmu: &Fmu, name: &str) -> Option<String> {
    let in_settings = |text| swarf::variables::settings::text_of(text, name);
    let set = options.set_value(name).or_else(|| options.set_value("settings").and_then(in_settings));
    set.map(String::from).or_else(|| fmu.description.variable(name).ok()?.start.clone())
}

/// A quantity's value at the start, in SI.
fn start_value(options: &Options, fmu: &Fmu, name: &str) -> Result<f64, String> {
    let text = start_text(options, fmu, name).unwrap_or_default();
    let number = swarf::variables::real_from_text(name, &text).map_err(|e| e.to_string())?;
    number.ok_or_else(|| format!("{name} = '{text}': a number is needed"))
}

/// Steps to the end; a line of the history at every communication point.
fn steps(
    instance: &mut Instance,
    history: &mut History,
    stop: f64,
    step: f64,
    stop_asked: &AtomicBool,
) -> Result<Ending, String> {
    let start_position = instance.get("tool_position_x")?;
    let mut line = |instance: &mut Instance, time: f64| -> Result<f64, String> {
        let travel = start_position - instance.get("tool_position_x")?;
        let mut row = vec![time, travel];
        row.extend(instance.outputs()?);
        history.add(row)?;
        Ok(travel)
    };
    line(instance, 0.0)?;
    // A last step shorter than a thousandth is rounding.
    let count = (stop / step - 1e-3).ceil().max(1.0) as u64;
    let bar = progress_bar(count);
    let mut ending = Ending::Complete;
    let mut time = 0.0;
    'run: for number in 1..=count {
        // Multiples of the step, not sums of it: no rounding piles up.
        let goal = if number == count { stop } else { number as f64 * step };
        while time < goal {
            if stop_asked.load(Ordering::Relaxed) {
                ending = Ending::Interrupted;
                break 'run;
            }
            match instance.step(time, goal - time) {
                Ok(Step::Done) => time = goal,
                Ok(Step::StoppedAt(reached)) => time = reached,
                Err(text) => {
                    ending = Ending::Failed(text);
                    break 'run;
                }
            }
        }
        let travel = line(instance, time)?;
        bar.advance(number, travel);
    }
    bar.end();
    Ok(ending)
}

/// A bar on a terminal, a line every tenth elsewhere.
struct Progress {
    bar: Option<ProgressBar>,
    count: u64,
    begin: Instant,
}

fn progress_bar(count: u64) -> Progress {
    let bar = std::io::stderr().is_terminal().then(|| {
        let bar = ProgressBar::new(count);
        let style =
            ProgressStyle::with_template("{msg:>14} [{bar:40}] {percent:>3} %  {elapsed} gone, {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
        bar.enable_steady_tick(Duration::from_millis(500));
        bar
    });
    messages::around(true, bar.as_ref());
    Progress { bar, count, begin: Instant::now() }
}

impl Progress {
    fn advance(&self, number: u64, travel: f64) {
        let text = format!("{:.3} mm", 1e3 * travel);
        if let Some(bar) = &self.bar {
            bar.set_message(text);
            bar.set_position(number);
        } else if (10 * number) / self.count > (10 * (number - 1)) / self.count {
            let gone = self.begin.elapsed().as_secs_f64();
            let left = gone * (self.count - number) as f64 / number as f64;
            eprintln!("{text}, {:3} %, {gone:.0} s gone, {left:.0} s left", 100 * number / self.count);
        }
    }

    fn end(&self) {
        messages::around(false, None);
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// The first Ctrl-C asks for an end at the next communication point; the second ends at once.
fn watch_for_interrupt() -> Arc<AtomicBool> {
    let asked = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&asked);
    let watched = ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        eprintln!("\nswarf-master: stopping at the next communication point (Ctrl-C again: at once)");
    });
    if let Err(e) = watched {
        eprintln!("swarf-master: Ctrl-C will end the run at once ({e})");
    }
    asked
}

fn instance_terminate(instance: &mut Instance) {
    use fmi::fmi2::instance::Common;
    if let Err(e) = instance.raw.terminate() {
        eprintln!("swarf-master: the FMU did not end in order ({e})");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The reference cut goes the paper's 2 mm; where the held side is nearer, its fixture would be measured,
    /// not the cut.
    #[test]
    fn a_cut_ends_before_the_held_side() {
        assert_eq!(usual_travel(3e-3, 1e-5, 3e-4), Ok(TRAVEL));
        let short = usual_travel(1.5e-3, 1e-5, 3e-4).unwrap();
        // Three terms of 1e-3.
        assert!((short - 0.91e-3).abs() <= 4.0 * f64::EPSILON * 1e-3, "{short} m");
        let error = usual_travel(6e-4, 1e-5, 3e-4).unwrap_err();
        assert!(error.contains("workpiece.length = 0.600 mm") && error.contains("--stop"), "{error}");
    }
}
