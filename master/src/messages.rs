//! The FMU's messages: on the terminal without breaking the progress bar, and in a file.

use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::ProgressBar;
use log::{Level, Log, Metadata, Record};

/// Name of the master's instance; the `fmi` crate passes an instance's messages on under its name.
pub const INSTANCE: &str = "cut";

struct Messages {
    bar: Mutex<Option<ProgressBar>>,
    /// Whether the run tells its own progress.
    is_running: AtomicBool,
    /// Lines that came before there was a file, or the file.
    file: Mutex<Result<File, String>>,
}

static MESSAGES: Messages = Messages {
    bar: Mutex::new(None),
    is_running: AtomicBool::new(false),
    file: Mutex::new(Err(String::new())),
};
/// Letters of a message on the terminal; the file has it whole.
const SHOWN: usize = 400;

/// Takes over the process's messages.
pub fn install() {
    if log::set_logger(&MESSAGES).is_ok() {
        log::set_max_level(log::LevelFilter::Trace);
    }
}

/// Writes the messages into a file, too: those that came before and those to come.
///
/// # Errors
/// When the file cannot be made.
pub fn into_file(path: &Path, head: &str) -> Result<(), String> {
    let refused = |e: std::io::Error| format!("cannot write '{}': {e}", path.display());
    let mut file = File::create(path).map_err(refused)?;
    file.write_all(head.as_bytes()).map_err(refused)?;
    if let Ok(mut place) = MESSAGES.file.lock() {
        if let Err(before) = &*place {
            file.write_all(before.as_bytes()).map_err(refused)?;
        }
        *place = Ok(file);
    }
    Ok(())
}

/// Says whether the run tells its own progress, and names the bar to be kept whole, if there is one.
pub fn around(is_running: bool, bar: Option<&ProgressBar>) {
    MESSAGES.is_running.store(is_running, Ordering::Relaxed);
    if let Ok(mut place) = MESSAGES.bar.lock() {
        *place = bar.cloned();
    }
}

impl Log for Messages {
    /// The FMU's own messages, and warnings of the libraries between.
    fn enabled(&self, metadata: &Metadata) -> bool {
        metadata.target() == INSTANCE || metadata.level() <= Level::Warn
    }

    fn log(&self, record: &Record) {
        if !self.enabled(record.metadata()) {
            return;
        }
        let label = match record.level() {
            Level::Error => "error: ",
            Level::Warn => "warning: ",
            _ => "",
        };
        let line = format!("fmu: {label}{}", record.args());
        if let Ok(mut place) = self.file.lock() {
            match &mut *place {
                // A full disk must not end the run.
                Ok(file) => _ = writeln!(file, "{line}"),
                Err(before) => *before += &format!("{line}\n"),
            }
        }
        let is_long = line.chars().count() > SHOWN && record.level() > Level::Warn;
        let line = if is_long {
            line.chars().take(SHOWN).chain(" ... (all in messages.log)".chars()).collect()
        } else {
            line
        };
        match self.bar.lock().ok().and_then(|bar| bar.clone()) {
            // The run tells how far it has come; the file has the solver's own account of it.
            _ if MESSAGES.is_running.load(Ordering::Relaxed) && record.level() > Level::Warn => {}
            Some(bar) => bar.suspend(|| eprintln!("{line}")),
            None => eprintln!("{line}"),
        }
    }

    fn flush(&self) {}
}
