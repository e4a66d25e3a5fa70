//! `cargo xtask valgrind`: a whole load–run–free cycle of the packaged FMU under valgrind's memcheck.

use std::process::Command;

use crate::{Outcome, fmu_and_master, process, target};

/// Runs a cut of about 500 points for 50 ns; memcheck is some fifty times slower than the processor.
///
/// # Errors
/// When valgrind is missing, or finds a wrong access or a definite leak.
pub fn run() -> Outcome {
    let (fmu, master) = fmu_and_master()?;
    let mut command = Command::new("valgrind");
    // The library's addresses must keep their names after it is unloaded.
    command.args(["--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=definite,indirect"]);
    command.args(["--errors-for-leak-kinds=definite,indirect", "--keep-debuginfo=yes", "--num-callers=25"]);
    command.arg(master).arg(fmu).args(["--set", "numerics.point_spacing=5e-5"]);
    command.args(["--stop", "5e-8", "--step", "1e-8", "--out"]).arg(target().join("valgrind"));
    process::run(&mut command).map_err(|text| {
        format!("{text}\nis valgrind installed (Debian or Ubuntu: apt-get install valgrind)?")
    })
}
