//! A watch on the energy: a scheme that feeds itself shows in the ledger long before it shows in the force.
//!
//! Every `INTERVAL` substeps, and after 64, 128, 256 and 512, the kinetic and elastic energy of all points is
//! added up and held against the ledger. Form of the effect: a pass over the points that costs a few
//! thousandths of the substeps between two of them.

use crate::energy::ledger::Ledger;
use crate::error::Error;
use crate::material::PointReport;
use crate::variables::time_text;

/// Substeps between two looks at the energy.
pub const INTERVAL: u64 = 1024;
/// Substeps before the first look: a coarse scene is over after some hundred.
const FIRST: u64 = 64;
/// Energy out of nowhere that stops the run, over all energy that went through it (-).
pub const ENERGY_LIMIT: f64 = 0.1;

/// Whether to look after this many substeps since the start.
pub fn is_due(substeps: u64) -> bool {
    substeps.is_multiple_of(INTERVAL) || (FIRST..INTERVAL).contains(&substeps) && substeps.is_power_of_two()
}

/// What the watch adds up over the points.
#[derive(Clone, Copy, Debug)]
pub struct Watch {
    kinetic: f64,
    elastic: f64,
    smallest_ratio: f64,
    coldest: f64,
    hottest: f64,
}

impl Default for Watch {
    fn default() -> Self {
        Watch { kinetic: 0.0, elastic: 0.0, smallest_ratio: 1.0, coldest: f64::MAX, hottest: 0.0 }
    }
}

impl Watch {
    /// Counts a point of kinetic energy `kinetic` (J) and volume `volume` (m3) at the start.
    pub fn count(&mut self, kinetic: f64, volume: f64, report: &PointReport) {
        self.kinetic += kinetic;
        self.elastic += volume * report.elastic_energy;
        self.smallest_ratio = self.smallest_ratio.min(report.jacobian);
        self.coldest = self.coldest.min(report.temperature);
        self.hottest = self.hottest.max(report.temperature);
    }

    /// Judges the state at `clock` (s) against the ledger; `starts` while the tool has only just touched: the
    /// first waves carry most of the energy then, and damping swings about zero by a part of it.
    ///
    /// # Errors
    /// `Error::Unstable` naming what is wrong: energy that nothing accounts for, energy that the scheme
    /// itself brought in, a point turned inside out, a temperature below zero.
    pub fn judge(&self, clock: f64, ledger: &Ledger, starts: bool) -> Result<(), Error> {
        let Watch { kinetic, elastic, smallest_ratio, coldest, hottest } = *self;
        let unstable = |text: String| {
            Err(Error::Unstable(format!("the run became unstable at t = {}: {text}", time_text(clock))))
        };
        if !(kinetic + elastic + hottest).is_finite() {
            return unstable("a point's velocity, stress or temperature is no finite number".into());
        }
        if smallest_ratio <= 0.0 {
            return unstable(format!(
                "a point has the volume ratio {smallest_ratio:.3}; material cannot be turned inside out"
            ));
        }
        if coldest < 0.0 {
            return unstable(format!("a point is at {coldest:.1} K, below absolute zero"));
        }
        let through = ledger.tool_work.abs()
            + ledger.initial_energy
            + ledger.mass_scaling.abs()
            + ledger.thermoelastic.abs()
            + kinetic
            + elastic;
        let imbalance = ledger.imbalance(kinetic, elastic);
        if !imbalance.is_finite() {
            return unstable("a term of the energy ledger is no finite number".into());
        }
        if imbalance.abs() > ENERGY_LIMIT * through {
            return unstable(format!(
                "{imbalance:.3e} J of {through:.3e} J are unaccounted for (energy.balance_error; at most \
                 {:.0} % are allowed): the scheme feeds itself; lower numerics.courant",
                100.0 * ENERGY_LIMIT
            ));
        }
        if !starts && -ledger.damping > ENERGY_LIMIT * through {
            return unstable(format!(
                "the scheme brought in {:.3e} J of its own beside {through:.3e} J (energy.damping is \
                 negative; at most {:.0} % are allowed); lower numerics.courant",
                -ledger.damping,
                100.0 * ENERGY_LIMIT
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn watch(kinetic: f64, elastic: f64) -> Watch {
        Watch { kinetic, elastic, smallest_ratio: 0.9, coldest: 290.0, hottest: 900.0 }
    }

    /// Looks come in twos at first, then evenly.
    #[test]
    fn looks_begin_early() {
        let due: Vec<u64> = (1..4096).filter(|&substeps| is_due(substeps)).collect();
        assert_eq!(due, [64, 128, 256, 512, 1024, 2048, 3072]);
    }

    /// A ledger that closes passes; one that misses a seventh of the energy does not, nor one whose damping
    /// feeds the run.
    #[test]
    fn energy_out_of_nowhere_is_named() {
        let mut ledger = Ledger { tool_work: 10.0, plastic_work: 6.0, damping: 1.0, ..Ledger::default() };
        assert_eq!(watch(2.0, 1.0).judge(1e-6, &ledger, false), Ok(()));
        let error = watch(4.0, 1.0).judge(1e-6, &ledger, false).unwrap_err().to_string();
        assert!(error.contains("energy.balance_error"), "{error}");
        ledger.plastic_work = 10.0;
        ledger.damping = -3.0;
        let error = watch(2.0, 1.0).judge(1e-6, &ledger, false).unwrap_err().to_string();
        assert!(error.contains("energy.damping"), "{error}");
        assert_eq!(watch(2.0, 1.0).judge(1e-6, &ledger, true), Ok(()), "the first waves swing");
    }

    /// A point turned inside out, a negative temperature and a value that is no number are named each.
    #[test]
    fn impossible_points_are_named() {
        let ledger = Ledger { tool_work: 3.0, ..Ledger::default() };
        let text = |watch: Watch| watch.judge(0.0, &ledger, false).unwrap_err().to_string();
        assert!(text(Watch { smallest_ratio: -0.1, ..watch(2.0, 1.0) }).contains("inside out"));
        assert!(text(Watch { coldest: -1.0, ..watch(2.0, 1.0) }).contains("absolute zero"));
        assert!(text(watch(f64::NAN, 1.0)).contains("no finite number"));
    }
}
