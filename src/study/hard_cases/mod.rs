//! The hard cases: what breaks codes of this kind, each with the figure that says whether it broke this one.
//!
//! Each case is a function that fills a sheet, in a short form for the tests and a full form for `cargo xtask
//! hard-cases`. A case that cannot be computed must end in an error that names its cause; that stands in the
//! sheet as well.

pub mod child;
pub mod cuts;
pub mod endurance;
pub mod interrupted;
pub mod lone_points;
pub mod long_vibration;
pub mod misuse;
pub mod entry_and_exit;
pub mod sheet;
pub mod sliding_bar;
pub mod steering;
pub mod stretching;
pub mod table;
pub mod temperatures;
pub mod tool_shapes;
pub mod monitor;

pub use sheet::{Figure, Sheet};

use std::path::PathBuf;

/// How much is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Some seconds for each case.
    Short,
    /// What the issue of the case asks for, in full.
    Full,
}

/// How the cases run.
#[derive(Clone, Debug)]
pub struct Setting {
    /// How much of them.
    pub form: Form,
    /// The program `swarf` of this build, for what needs a process of its own.
    pub program: PathBuf,
}

impl Setting {
    /// One of two values.
    pub fn pick<T>(&self, short: T, full: T) -> T {
        if self.form == Form::Short { short } else { full }
    }
}

/// A case of the table.
#[derive(Clone, Copy)]
pub struct Case {
    /// Its number; 0 for what belongs to no numbered case.
    pub number: u8,
    /// Its name.
    pub name: &'static str,
    fill: fn(&Setting, &mut Sheet),
}

impl Case {
    const fn new(number: u8, name: &'static str, fill: fn(&Setting, &mut Sheet)) -> Self {
        Case { number, name, fill }
    }

    /// Runs the case.
    pub fn run(&self, setting: &Setting) -> Sheet {
        let mut sheet = Sheet::new(self.number, self.name);
        (self.fill)(setting, &mut sheet);
        sheet
    }
}

/// All cases, in the order of the table.
pub const CASES: [Case; 15] = [
    Case::new(1, "the paper's cut", cuts::paper),
    Case::new(2, "tool speeds", cuts::speeds),
    Case::new(3, "friction and feed", cuts::friction_and_feed),
    Case::new(4, "edge, rake, clearance", tool_shapes::fill),
    Case::new(5, "temperatures", temperatures::fill),
    Case::new(6, "lone points", lone_points::fill),
    Case::new(7, "sliding bar", sliding_bar::fill),
    Case::new(8, "long vibration", long_vibration::fill),
    Case::new(9, "stretching", stretching::fill),
    Case::new(10, "inputs that jump", steering::fill),
    Case::new(11, "passages of the tool", entry_and_exit::fill),
    Case::new(12, "misuse", misuse::fill),
    Case::new(13, "endurance", endurance::fill),
    Case::new(0, "many instances", endurance::many_instances),
    Case::new(0, "killed processes", interrupted::fill),
];

/// The case of a number, or of a name.
pub fn case(key: &str) -> Option<Case> {
    let number: Option<u8> = key.parse().ok().filter(|number| *number > 0);
    CASES.into_iter().find(|case| case.name == key || Some(case.number) == number)
}
