//! One instance of the FMU: its life from instantiation to termination, without a pointer.
//!
//! Every function checks the call order first and changes nothing when it refuses. Reading and setting
//! variables is in `values`, FMU states are in `states`.

use super::calls::{self, Call};
use super::description::guid;
use super::logging::{Categories, Category, Log, Status};
use super::progress::{Progress, advance_and_tell, summary};
use super::refusal::Refusal;
use super::saved::{Model, NO_SLOPES, Saved};
use super::state::State;
use super::steps::{check_sloped_inputs, check_step};
use crate::scene::Scene;
use crate::session::cost_estimate::Estimate;
use crate::session::{Advance, Session};
use crate::setup::checks;
use crate::variables::{self, format_real, settings, time_text};
use std::collections::HashMap;
use std::ffi::CString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::Instant;

/// A status, or why the call was refused.
pub type Reply = Result<Status, Refusal>;

/// Duration of the default experiment (s), for which the cost is estimated when the importer fixes no end.
const USUAL_DURATION: f64 = 4e-5;

/// One instance.
pub struct Instance {
    pub(super) model: Model,
    pub(super) saved: HashMap<usize, Box<Saved>>,
    /// Texts handed out by `get_string`; kept until the next such call.
    pub(super) texts: Vec<CString>,
    log: Box<dyn Log>,
    categories: Categories,
    resources: Option<PathBuf>,
    /// When the importer was last reported how far a step is; kept over steps, so that many short ones are
    /// reported of as well.
    reported: Instant,
}

/// The question of `fmi2GetXStatus`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StatusKind {
    /// How an asynchronous step stands.
    DoStep,
    /// Why a step is pending.
    Pending,
    /// How far the last step came.
    LastSuccessfulTime,
    /// Whether the FMU wants to end the simulation.
    Terminated,
}

impl StatusKind {
    /// From its number in the standard.
    ///
    /// # Errors
    /// `Refusal::BadArgument` for any number but 0 to 3.
    pub fn from_number(number: i32) -> Result<Self, Refusal> {
        let all = [Self::DoStep, Self::Pending, Self::LastSuccessfulTime, Self::Terminated];
        let found = usize::try_from(number).ok().and_then(|index| all.get(index).copied());
        found.ok_or_else(|| Refusal::BadArgument(format!("status kind {number} is none of 0 to 3")))
    }
}

impl Instance {
    /// A new instance.
    ///
    /// * `identity`: the GUID that the importer read from modelDescription.xml
    /// * `resources`: folder of the unpacked FMU's resources, if given; not needed, as the material library
    ///   is built in
    ///
    /// # Errors
    /// A GUID of another version of the interface.
    pub fn new(
        identity: &str,
        resources: Option<PathBuf>,
        logging_on: bool,
        log: Box<dyn Log>,
    ) -> Result<Self, Refusal> {
        if identity != guid() {
            let text = format!("GUID {identity} belongs to another version; this library has {}", guid());
            log.log(Status::Error, Category::Error, &format!("fmi2Instantiate: {text}"));
            return Err(Refusal::BadArgument(text));
        }
        let instance = Instance {
            model: Model::default(),
            saved: HashMap::new(),
            texts: Vec::new(),
            log,
            categories: Categories::at_start(logging_on),
            resources,
            reported: Instant::now(),
        };
        let place =
            instance.resources.as_ref().map_or("none given".into(), |path| path.display().to_string());
        let text = format!("swarf {} instantiated; resources: {place}", crate::version::VERSION);
        instance.message(Status::Ok, Category::Events, &text);
        Ok(instance)
    }

    /// Runs one call: an error goes to the log, and a panic becomes an error that spoils this instance alone.
    pub fn run(&mut self, call: &Call, body: impl FnOnce(&mut Self) -> Reply) -> Status {
        match catch_unwind(AssertUnwindSafe(|| body(self))) {
            Ok(Ok(status)) => status,
            Ok(Err(refusal)) => {
                self.message(Status::Error, Category::Error, &format!("{}: {refusal}", call.name));
                Status::Error
            }
            Err(panic) => {
                self.model.header.state = State::Spoiled;
                let text = panic_text(panic.as_ref());
                let text = format!(
                    "{}: internal error: {text}; please report it. This instance is spoiled until it is \
                     reset, restored or freed; others are not touched",
                    call.name
                );
                self.message(Status::Error, Category::Error, &text);
                Status::Error
            }
        }
    }

    /// Refuses a call that the present state does not allow.
    pub(super) fn require(&self, call: &Call) -> Result<(), Refusal> {
        call.check(self.model.header.state)
    }

    /// Sends a message if its category is on.
    pub(super) fn message(&self, status: Status, category: Category, text: &str) {
        if self.categories.is_on(category) {
            self.log.log(status, category, text);
        }
    }

    /// Switches log categories.
    ///
    /// # Errors
    /// A category that does not exist; then none is switched.
    pub fn set_debug_logging(&mut self, logging_on: bool, names: &[&str]) -> Reply {
        self.require(&calls::SET_DEBUG_LOGGING)?;
        let mut named = Vec::new();
        for name in names {
            let category = Category::from_name(name).ok_or_else(|| {
                let known = Category::ALL.map(Category::name).join(", ");
                Refusal::BadArgument(format!(
                    "there is no log category '{name}', only {known}; none was switched"
                ))
            })?;
            named.push(category);
        }
        self.categories = self.categories.switched(logging_on, &named);
        Ok(Status::Ok)
    }

    /// Takes the times of the experiment (s); a tolerance means nothing to an explicit solver.
    ///
    /// # Errors
    /// Times that are not finite or not in order.
    pub fn setup_experiment(&mut self, tolerance: Option<f64>, start: f64, stop: Option<f64>) -> Reply {
        self.require(&calls::SETUP_EXPERIMENT)?;
        if !start.is_finite() {
            return Err(Refusal::BadArgument(format!(
                "start time {} is not a finite number",
                time_text(start)
            )));
        }
        if let Some(stop) = stop.filter(|stop| !(stop.is_finite() && *stop > start)) {
            let [stop, start] = [stop, start].map(time_text);
            let text = format!("stop time {stop} does not lie after the start time {start}");
            return Err(Refusal::BadArgument(text));
        }
        if let Some(tolerance) = tolerance.filter(|tolerance| !(tolerance.is_finite() && *tolerance > 0.0)) {
            return Err(Refusal::BadArgument(format!("tolerance {tolerance} is not a positive number")));
        }
        let header = &mut self.model.header;
        (header.start, header.stop, header.time) = (start, stop, start);
        Ok(Status::Ok)
    }

    /// Enters initialization mode.
    ///
    /// # Errors
    /// A wrong call order.
    pub fn enter_initialization_mode(&mut self) -> Reply {
        self.require(&calls::ENTER_INITIALIZATION_MODE)?;
        self.model.header.state = State::Initialization;
        Ok(Status::Ok)
    }

    /// Builds the model from the parameters and starts the run.
    ///
    /// # Errors
    /// What `Session::new` refuses; the instance then stays in initialization mode and values can be
    /// corrected.
    pub fn exit_initialization_mode(&mut self) -> Reply {
        self.require(&calls::EXIT_INITIALIZATION_MODE)?;
        let header = &mut self.model.header;
        let (scene, settings) = settings::take_over(&header.scene)?;
        let in_use = in_use(&checks::check(&scene)?);
        let mut session = Session::with_parameters(&scene, header.start, &in_use)?;
        header.scene = scene;
        // A scene that cannot even begin says so in its first step, where an importer expects it.
        let stop = header.stop.unwrap_or(header.start + USUAL_DURATION);
        let estimate = session.estimate(stop);
        header.time = header.start;
        header.state = State::StepComplete;
        if let Some(text) = settings::summary(&settings) {
            self.message(Status::Ok, Category::Events, &text);
        }
        self.message(Status::Ok, Category::Events, &values_text(&in_use));
        self.message(Status::Ok, Category::Solver, &session.effects_summary());
        if let Ok(Estimate { substeps, cpu_seconds }) = estimate {
            let band = 100.0 * session.outputs().force_error_band;
            let rate = format_real(session.scene().numerics.point_rate);
            // Measured for who listens alone.
            let measured = if self.categories.is_on(Category::Solver) {
                session.estimate_on_this_machine(stop).ok()
            } else {
                None
            };
            let here =
                measured.map_or(String::new(), |seconds| format!("; {seconds:.2} s as this machine is now"));
            let text = format!(
                "estimate: {substeps:.0} substeps, {cpu_seconds:.2} s of CPU time by numerics.point_rate = {rate} 1/s{here}; \
                 error band of the cutting force ±{band:.1} %"
            );
            self.message(Status::Ok, Category::Solver, &text);
        }
        // The status stays fmi2OK: there are masters that take any other for a failure.
        for text in session.take_warnings() {
            self.message(Status::Warning, Category::Warning, &format!("fmi2ExitInitializationMode: {text}"));
        }
        if let Some(notice) = session.results_notice() {
            self.message(Status::Ok, Category::Events, notice);
        }
        self.model.session = Some(session);
        Ok(Status::Ok)
    }

    /// Ends the run; results can still be read.
    ///
    /// # Errors
    /// A wrong call order.
    pub fn terminate(&mut self) -> Reply {
        self.require(&calls::TERMINATE)?;
        self.model.header.state = State::Terminated;
        if let Some(session) = &mut self.model.session {
            session.release_results();
        }
        let text = format!("terminated at {}", time_text(self.model.header.time));
        self.message(Status::Ok, Category::Events, &text);
        Ok(Status::Ok)
    }

    /// Makes the instance as new; log categories and saved states stay.
    ///
    /// # Errors
    /// None: every state allows it.
    pub fn reset(&mut self) -> Reply {
        self.require(&calls::RESET)?;
        self.model = Model::default();
        self.message(Status::Ok, Category::Events, "reset");
        Ok(Status::Ok)
    }

    /// Advances from the communication point `time` by `step` (both s).
    ///
    /// Values and slopes of the inputs count from `time` on. A step that was cut short is gone on with from
    /// the last successful time, under the inputs it started with. When the step is done each input holds the
    /// value it has reached, and slopes are zero until set again.
    ///
    /// # Errors
    /// A step that does not fit the clock, the stop time or the range of a sloped input is refused and
    /// changes nothing. When the solver cannot go on, the instance enters its error state.
    pub fn do_step(&mut self, time: f64, step: f64) -> Reply {
        self.require(&calls::DO_STEP)?;
        let target = check_step(&self.model.header, time, step)?;
        let Instance { model: Model { header, session: Some(session) }, log, categories, reported, .. } =
            self
        else {
            return Err(Refusal::BadArgument("the model is not built".into()));
        };
        let (from, slopes) = (header.time, header.slopes);
        let end = |value: f64, slope: f64, until: f64| value + slope * (until - from);
        check_sloped_inputs(header, session, target)?;
        if header.state == State::StepComplete {
            session.set_inputs(header.scene.inputs, slopes)?;
        }
        let tell = |text: String| log.log(Status::Ok, Category::Solver, &text);
        let (is_told, begun) = (categories.is_on(Category::Solver), Instant::now());
        let before = session.outputs().clone();
        let advance = if is_told {
            advance_and_tell(session, Progress { from, target, begun, reported }, tell)
        } else {
            session.advance_to(target, &mut |_| true)
        };
        if categories.is_on(Category::Warning) {
            for text in session.take_warnings() {
                log.log(Status::Warning, Category::Warning, &format!("fmi2DoStep: {text}"));
            }
        }
        let reached = match advance {
            Ok(Advance::Reached) => target,
            Ok(Advance::StoppedAt(clock)) => clock.clamp(from, target),
            Err(error) => {
                header.state = State::Failed;
                return Err(Refusal::StepFailed(error));
            }
        };
        if is_told {
            tell(summary(reached, begun.elapsed().as_secs_f64(), &before, session.outputs()));
        }
        let inputs = &mut header.scene.inputs;
        inputs.tool_velocity = end(inputs.tool_velocity, slopes.tool_velocity, reached);
        inputs.feed = end(inputs.feed, slopes.feed, reached);
        inputs.friction = end(inputs.friction, slopes.friction, reached);
        header.time = reached;
        if reached < target {
            header.state = State::StepDiscarded;
            let [reached, target] = [reached, target].map(time_text);
            let text = format!(
                "fmi2DoStep: stopped at {reached} on the way to {target} by numerics.wall_time_limit; call it again from \
                 there (fmi2LastSuccessfulTime has all digits) to go on"
            );
            self.message(Status::Discard, Category::Discard, &text);
            return Ok(Status::Discard);
        }
        header.slopes = NO_SLOPES;
        header.state = State::StepComplete;
        Ok(Status::Ok)
    }

    /// Ends a step in the background, of which there are none.
    ///
    /// # Errors
    /// Always.
    pub fn cancel_step(&mut self) -> Reply {
        self.require(&calls::CANCEL_STEP)?;
        Ok(Status::Error)
    }

    /// Answer to `fmi2GetStatus`, `fmi2GetIntegerStatus` and `fmi2GetStringStatus`, which only speak of
    /// pending steps.
    ///
    /// # Errors
    /// A wrong call order. Otherwise the standard's answer to what the FMU cannot tell: discard.
    pub fn pending_status(&mut self, call: &Call, kind: StatusKind) -> Reply {
        self.require(call)?;
        self.no_such_status(call, kind);
        Ok(Status::Discard)
    }

    /// The last successful time (s), or nothing for other questions.
    ///
    /// # Errors
    /// A wrong call order.
    pub fn real_status(&mut self, kind: StatusKind) -> Result<Option<f64>, Refusal> {
        self.require(&calls::GET_REAL_STATUS)?;
        if kind == StatusKind::LastSuccessfulTime {
            return Ok(Some(self.model.header.time));
        }
        self.no_such_status(&calls::GET_REAL_STATUS, kind);
        Ok(None)
    }

    /// Whether the FMU wants to end the simulation (it never does), or nothing for other questions.
    ///
    /// # Errors
    /// A wrong call order.
    pub fn boolean_status(&mut self, kind: StatusKind) -> Result<Option<bool>, Refusal> {
        self.require(&calls::GET_BOOLEAN_STATUS)?;
        if kind == StatusKind::Terminated {
            return Ok(Some(false));
        }
        self.no_such_status(&calls::GET_BOOLEAN_STATUS, kind);
        Ok(None)
    }

    fn no_such_status(&self, call: &Call, kind: StatusKind) {
        let text = format!("{}: {kind:?} is not known here, as no step runs in the background", call.name);
        self.message(Status::Discard, Category::Discard, &text);
    }
}

/// Names and values in use, with units, of a scene whose library material is filled in.
fn in_use(scene: &Scene) -> Vec<(String, String)> {
    let values = variables::values_in_use(scene).into_iter();
    values
        .map(|(name, value, unit)| (name.to_owned(), format!("{value} {unit}").trim_end().to_owned()))
        .collect()
}

/// The version and all values in use as one message.
fn values_text(in_use: &[(String, String)]) -> String {
    let values: Vec<_> = in_use.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    format!("swarf {}, values in use: {}", crate::version::VERSION, values.join(", "))
}

/// What a panic said.
pub(super) fn panic_text(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};

    /// A log that others can look into.
    struct Heard(Arc<Mutex<Vec<String>>>);

    impl Log for Heard {
        fn log(&self, _status: Status, category: Category, message: &str) {
            self.0.lock().unwrap().push(format!("{}: {message}", category.name()));
        }
    }

    /// Every category can be had alone and can be left out alone, by the name that the description gives it.
    #[test]
    fn every_category_is_switched_by_its_name() {
        let heard = Arc::<Mutex<Vec<String>>>::default();
        let mut instance = Instance::new(guid(), None, false, Box::new(Heard(heard.clone()))).unwrap();
        let spoken = |instance: &Instance| {
            heard.lock().unwrap().clear();
            for category in Category::ALL {
                instance.message(Status::Ok, category, "said");
            }
            heard.lock().unwrap().iter().map(|line| line.replace(": said", "")).collect::<Vec<_>>()
        };
        let all: Vec<_> = Category::ALL.map(Category::name).to_vec();
        for one in all.iter().filter(|name| **name != "logAll") {
            assert_eq!(instance.set_debug_logging(true, &[one]), Ok(Status::Ok));
            assert_eq!(spoken(&instance), [*one], "only {one} is on");
            assert_eq!(instance.set_debug_logging(true, &["logAll"]), Ok(Status::Ok));
            assert_eq!(spoken(&instance), all);
            assert_eq!(instance.set_debug_logging(false, &[one]), Ok(Status::Ok));
            let others: Vec<_> = all.iter().copied().filter(|name| name != one).collect();
            assert_eq!(spoken(&instance), others, "only {one} is off");
        }
        assert_eq!(instance.set_debug_logging(false, &["logAll"]), Ok(Status::Ok));
        assert!(spoken(&instance).is_empty());
        // An unknown name switches nothing, not even the known one beside it.
        assert!(instance.set_debug_logging(true, &["solver", "gossip"]).is_err());
        assert!(spoken(&instance).is_empty());
    }
}
