//! Body force: gravity, or the force field of a manufactured solution.
//!
//! The momentum equation's ρ b (eq. 12 of Ambati et al. 2011, where it acts with a plus sign) is taken at the
//! nodes: mass is lumped there, so b Δt is an acceleration of each node, exact for uniform b and of second
//! order in the cell length for one that varies.
//!
//! Form of the effect: an optional pass, a loop of its own over the nodes; without it nothing is kept or
//! done. No scene of the FMU has one yet, and the energy ledger does not count its work.

/// An acceleration that depends on place and time.
pub trait BodyForce: Send + Sync {
    /// b (m/s2) at `position` (m) and `time` (s).
    fn acceleration(&self, position: [f64; 3], time: f64) -> [f64; 3];
}

impl<F: Fn([f64; 3], f64) -> [f64; 3] + Send + Sync> BodyForce for F {
    fn acceleration(&self, position: [f64; 3], time: f64) -> [f64; 3] {
        self(position, time)
    }
}
