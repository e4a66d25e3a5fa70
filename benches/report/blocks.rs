//! Blocks of steel with a band that shears and yields from the first substep on: the same state at every
//! size, for what is measured without a whole cut.

use crate::common::{BlockIn, Lattice, StateIn, steel_4340};
use crate::plain::ReferenceLoop;
use swarf::dimension::Dimension;
use swarf::grid::shape_function::Gimp;
use swarf::simd::Real;
use swarf::simulation::ToolMotion;
use swarf::tool::RigidTool;
use swarf::tool::profile::ToolShape;

/// Share of the block that yields at first (-): that of a cut.
pub const BAND: f64 = 0.07;
/// Shear rate in the band (1/s), as in a chip's shear zone at 50 m/s.
const RATE: f64 = 2e5;
/// The tool cuts at 50 m/s.
pub const MOTION: ToolMotion = ToolMotion { velocity: [-50.0, 0.0], friction: 0.2 };

/// A block of some cells, a millimetre high, in an empty domain, and a tool at its right side.
pub fn scene(cells: [i32; 3]) -> (Lattice, RigidTool) {
    let cell = 1e-3 / f64::from(cells[1]);
    let rim = 12;
    let lattice = Lattice {
        domain: [cells[0] + 2 * rim, cells[1] + 2 * rim, cells[2] + 2 * rim],
        corner: [rim; 3],
        cells,
        per_edge: 2,
        cell,
        fixed: vec![],
        courant: 0.5,
    };
    let shape = ToolShape::new(0.0, 0.0873, 0.0, 5e-4, 1e-3).expect("a plain wedge");
    let position = [f64::from(cells[0]) * cell, 7e-4];
    (lattice, RigidTool { shape, position, velocity: [0.0; 2], friction: 0.2 })
}

/// Vertical velocity (m/s) and shear stress (Pa) at `x` (m): the stress is the shear yield stress everywhere,
/// hence balanced, and only the band in the middle, that share of the length, shears on.
fn state_at(x: f64, length: f64, band: f64) -> (f64, f64) {
    let into_band = (x - 0.5 * (1.0 - band) * length).clamp(0.0, band * length);
    (RATE * into_band, steel_4340().yield_stress / 3.0_f64.sqrt())
}

/// The block as a simulation.
pub fn sheared<R: Real, D: Dimension>(cells: [i32; 3]) -> BlockIn<R, D, Gimp<R>> {
    block(cells, 1.0, BAND)
}

/// The block with some share of the sheared one's velocity and stress, and a band that takes so much of its
/// length; with no share it rests and nothing yields.
pub fn block<R: Real, D: Dimension>(cells: [i32; 3], share: f64, band: f64) -> BlockIn<R, D, Gimp<R>> {
    let (mut lattice, tool) = scene(cells);
    if D::AXES == 2 {
        lattice.domain[2] = 1;
    }
    let length = f64::from(cells[0]) * lattice.cell;
    lattice.build_in(&steel_4340(), Gimp::new(2), tool, |x, state: &mut StateIn<R, D>, lane| {
        let (velocity, shear) = state_at(x[0], length, band);
        state.deviator[D::DEVIATOR - 1][lane] = R::from_f64(share * shear);
        [0.0, share * velocity, 0.0]
    })
}

/// The block as the plain loop.
pub fn sheared_plain(cells: [i32; 3]) -> ReferenceLoop {
    let (lattice, tool) = scene(cells);
    let length = f64::from(cells[0]) * lattice.cell;
    let mut plain = ReferenceLoop::new(&lattice, &steel_4340(), tool);
    for p in 0..plain.points.count() {
        let (velocity, shear) = state_at(plain.points.x[p], length, BAND);
        plain.points.vy[p] = velocity;
        plain.points.sxy[p] = shear;
    }
    plain
}
