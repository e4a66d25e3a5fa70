//! What a simulation is told beside its scene's bodies: numbers, and which optional passes run.

use crate::chip_separation::ChipSeparation;
use crate::simd::InstructionSet;
use crate::speedups::active_window::ActiveWindow;
use crate::speedups::mass_scaling::MassScaling;
use crate::speedups::rigid_chip::ChipTail;

/// Numbers and optional passes of a simulation.
#[derive(Clone, Debug)]
pub struct Options {
    /// Courant number (-).
    pub courant: f64,
    /// Instruction set of the kernels.
    pub instructions: InstructionSet,
    /// How deep the plane is that points' volumes are for (m); says nothing in space.
    pub depth: f64,
    /// Whether deviations of volume ratios are limited (`stabilization::volumetric_locking`).
    pub locking_control: bool,
    /// How chip and work part at the edge, if the scene has them part cleanly.
    pub separation: Option<ChipSeparation>,
    /// Mass scaling, if the scene names it.
    pub mass_scaling: Option<MassScaling>,
    /// Active window, if the scene names it.
    pub window: Option<ActiveWindow>,
    /// Where the chip's tail begins, if the scene names it.
    pub chip_tail: Option<ChipTail>,
}
