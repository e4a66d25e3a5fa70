//! What the FMU tells the importer: statuses, log categories and which of them are on.

/// Status of a call, numbered as in fmi2FunctionTypes.h. `fmi2Fatal` is never returned: it condemns every
/// instance.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// All well.
    Ok = 0,
    /// Done, but look at the log.
    Warning = 1,
    /// Not done as asked; the instance can go on.
    Discard = 2,
    /// Refused or failed.
    Error = 3,
}

/// Where messages go.
pub trait Log {
    /// Takes one message.
    fn log(&self, status: Status, category: Category, message: &str);
}

/// A log that keeps nothing.
#[derive(Debug)]
pub struct NoLog;

impl Log for NoLog {
    fn log(&self, _status: Status, _category: Category, _message: &str) {}
}

/// Kind of a message, one bit each.
#[repr(u8)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Category {
    /// What happens to the instance.
    Events = 1,
    /// Warnings.
    Warning = 2,
    /// Steps that were not done as asked.
    Discard = 4,
    /// Refused and failed calls.
    Error = 8,
    /// Listed because the standard names it; nothing here is ever fatal.
    Fatal = 16,
    /// Listed because the standard names it; no call here is ever pending.
    Pending = 32,
    /// What the solver does.
    Solver = 64,
    /// All of them.
    All = 128,
}

impl Category {
    /// All categories, in the order of the description.
    pub const ALL: [Category; 8] = [
        Category::Events,
        Category::Warning,
        Category::Discard,
        Category::Error,
        Category::Fatal,
        Category::Pending,
        Category::All,
        Category::Solver,
    ];

    /// Name as the importer knows it.
    pub fn name(self) -> &'static str {
        match self {
            Category::Events => "logEvents",
            Category::Warning => "logStatusWarning",
            Category::Discard => "logStatusDiscard",
            Category::Error => "logStatusError",
            Category::Fatal => "logStatusFatal",
            Category::Pending => "logStatusPending",
            Category::All => "logAll",
            Category::Solver => "solver",
        }
    }

    /// What it holds.
    pub fn description(self) -> &'static str {
        match self {
            Category::Events => "life of the instance, and all values in use when the model is built",
            Category::Warning => "calls that were carried out with a reservation",
            Category::Discard => "steps that were cut short and can go on",
            Category::Error => "refused and failed calls, with variable and allowed range",
            Category::Fatal => "never used: no failure here condemns other instances",
            Category::Pending => "never used: no call here is asynchronous",
            Category::All => "all messages",
            Category::Solver => {
                "effects that run, what each step took, and progress of a long one every second of wall time"
            }
        }
    }

    /// The category with a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|category| category.name() == name)
    }
}

/// Which categories are on.
///
/// Errors, warnings and discarded steps are on from the start, so that no refused call goes unexplained;
/// `loggingOn` adds all others. `fmi2SetDebugLogging` then does what the standard says: on with names means
/// these only, on without names all; off with names switches these off, off without names goes back to the
/// start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Categories(u8);

impl Categories {
    /// As after `fmi2Instantiate`.
    pub fn at_start(logging_on: bool) -> Self {
        if logging_on {
            Categories(u8::MAX)
        } else {
            Categories(Category::Warning as u8 | Category::Discard as u8 | Category::Error as u8)
        }
    }

    /// After `fmi2SetDebugLogging`.
    pub fn switched(self, logging_on: bool, named: &[Category]) -> Self {
        let all = named.contains(&Category::All);
        let mask = if all { u8::MAX } else { named.iter().fold(0, |mask, category| mask | *category as u8) };
        match (logging_on, named.is_empty()) {
            (_, true) => Self::at_start(logging_on),
            (true, false) => Categories(mask),
            (false, false) => Categories(self.0 & !mask),
        }
    }

    /// Whether messages of a category go out.
    pub fn is_on(self, category: Category) -> bool {
        self.0 & category as u8 != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each category can be switched alone, in both directions.
    #[test]
    fn every_category_can_be_switched_alone() {
        for one in Category::ALL {
            assert_eq!(Category::from_name(one.name()), Some(one));
            if one == Category::All {
                continue;
            }
            let only = Categories::at_start(false).switched(true, &[one]);
            let without = Categories::at_start(true).switched(false, &[one]);
            for other in Category::ALL.into_iter().filter(|other| *other != Category::All) {
                assert_eq!(only.is_on(other), other == one, "{other:?} with only {one:?}");
                assert_eq!(without.is_on(other), other != one, "{other:?} without {one:?}");
            }
        }
    }

    /// A user who never touches logging still learns why a call was refused.
    #[test]
    fn errors_are_on_from_the_start_and_can_be_switched_off() {
        let start = Categories::at_start(false);
        assert!(start.is_on(Category::Error) && !start.is_on(Category::Solver));
        assert!(!start.switched(false, &[Category::All]).is_on(Category::Error));
        assert!(start.switched(true, &[]).is_on(Category::Solver));
        assert!(start.switched(false, &[]).is_on(Category::Error));
    }
}
