//! Heat conduction against exact solutions: a cosine mode, a jump of the surface temperature, a constant
//! flux, a slab.
//!
//! Strips of cells along x, at rest, on which only the conduction pass runs, as long a pass as in a scene.
//! The half-spaces end at six diffusion lengths √(κt), where their exact temperature is below 3e-5 of the
//! surface's; the slab, which is symmetric, at its middle or where the heat of its face has reached, so that
//! as many cells cover what changes.

use super::Report;
use super::report::{line, panel};
use crate::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use crate::grid::FixedNodes;
use crate::grid::shape_function::Gimp;
use crate::heat::sources;
use crate::heat::{FixedTemperature, HeatConduction, HeatTotals, NodeHeat};
use crate::material::ConstitutiveModel;
use crate::simulation::Solver;
use crate::study::body_setup::{
    BodySetup, ROOM, Seed, Steel, distant_tool, lattice, never_yielding, steel, steel_4340,
};
use std::f64::consts::PI;

/// Amplitude of the prescribed temperatures (K).
pub const AMPLITUDE: f64 = 100.0;
/// Flux into the half-space (W/m2).
pub const FLUX: f64 = 1e9;
/// Length of the mode and of the slab (m).
pub const LENGTH: f64 = 1e-3;
/// Rows of cells across the strip.
const ROWS: i32 = 3;

/// What is conducted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Case {
    /// cos(πx/L) between insulated ends.
    Cosine,
    /// A half-space whose surface jumps by the amplitude.
    Jump,
    /// A half-space under a constant flux.
    Flux,
    /// A slab whose faces fall by the amplitude.
    Slab,
}

impl Case {
    /// The case by its name in tests/data/heat_reference.csv.
    pub fn named(name: &str) -> Option<Case> {
        Some(match name {
            "cosine_mode_L1mm_amp100" => Case::Cosine,
            "step_surface_100C_semiinf" => Case::Jump,
            "const_flux_1e9_semiinf" => Case::Flux,
            "slab_1mm_faces_T0_initial_100" => Case::Slab,
            _ => return None,
        })
    }

    /// Exact rise of temperature (K) at `x` (m) and time `t` (s), `t` above 0 but for the cosine.
    pub fn exact(self, x: f64, t: f64) -> f64 {
        let kappa = conduction().diffusivity();
        let conductivity = steel_4340().conductivity;
        let mode = |k: f64| (-kappa * (k * PI / LENGTH).powi(2) * t).exp();
        let root = (kappa * t).sqrt();
        match self {
            Case::Cosine => AMPLITUDE * (PI * x / LENGTH).cos() * mode(1.0),
            Case::Jump => AMPLITUDE * erfc(x / (2.0 * root)),
            Case::Flux => {
                let gauss = 2.0 * root / PI.sqrt() * (-x * x / (4.0 * kappa * t)).exp();
                FLUX / conductivity * (gauss - x * erfc(x / (2.0 * root)))
            }
            Case::Slab => (0..2000)
                .map(|m| f64::from(2 * m + 1))
                .map(|k| 4.0 * AMPLITUDE / (PI * k) * (k * PI * x / LENGTH).sin() * mode(k))
                .sum(),
        }
    }

    /// Largest rise of the case at `t` (s): what errors are compared with (K).
    pub fn amplitude(self, t: f64) -> f64 {
        if self == Case::Flux { self.exact(0.0, t) } else { AMPLITUDE }
    }

    /// Length of the strip (m).
    fn length(self, t: f64) -> f64 {
        let half_space = 6.0 * (conduction().diffusivity() * t).sqrt();
        match self {
            Case::Cosine => LENGTH,
            Case::Slab => half_space.min(0.5 * LENGTH),
            Case::Jump | Case::Flux => half_space,
        }
    }
}

/// Complementary error function (-) for x ≥ 0: its series below 2, beyond it the continued fraction of
/// Laplace.
pub fn erfc(x: f64) -> f64 {
    if x < 2.0 {
        let (mut term, mut sum) = (x, x);
        for n in 1..60 {
            term *= -x * x / f64::from(n);
            sum += term / f64::from(2 * n + 1);
        }
        1.0 - 2.0 / PI.sqrt() * sum
    } else {
        let fraction = (1..100).rev().fold(x, |below, k| x + 0.5 * f64::from(k) / below);
        (-x * x).exp() / (PI.sqrt() * fraction)
    }
}

/// The pass for AISI 4340.
pub fn conduction() -> HeatConduction {
    let c = steel_4340();
    HeatConduction::new(c.conductivity, c.density * c.specific_heat, ROOM)
}

/// What a run gives.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Place (m) and rise of temperature (K), by column of points.
    pub profile: Vec<(f64, f64)>,
    /// Heat gained over heat put in, less one; or lost over that of a rise by the amplitude everywhere (-).
    pub imbalance: f64,
    /// Passes.
    pub passes: usize,
}

impl Outcome {
    /// Rise of temperature at `x` (m): the parabola through the three nearest columns; that of the last
    /// beyond them.
    pub fn at(&self, x: f64) -> f64 {
        let x = x.min(self.profile[self.profile.len() - 1].0);
        let nearest = self.profile.partition_point(|point| point.0 < x);
        let first = nearest.saturating_sub(1).min(self.profile.len() - 3);
        let three = &self.profile[first..first + 3];
        (0..3)
            .map(|k| {
                let others = (0..3).filter(|&j| j != k);
                let factors = others.map(|j| (x - three[j].0) / (three[k].0 - three[j].0));
                three[k].1 * factors.product::<f64>()
            })
            .sum()
    }

    /// Largest error over the points (K).
    pub fn largest_error(&self, case: Case, t: f64) -> f64 {
        self.profile.iter().map(|&(x, rise)| (rise - case.exact(x, t)).abs()).fold(0.0, f64::max)
    }
}

/// A case on `cells` cells up to the time `t` (s).
///
/// # Panics
/// Never for the cases above: nothing moves.
pub fn run<D: Dimension>(case: Case, cells: i32, t: f64) -> Outcome {
    let cell = case.length(t) / f64::from(cells);
    let mut setup = BodySetup::around([0.0; 2], [case.length(t), f64::from(ROWS) * cell], cell);
    if D::AXES == 3 {
        setup.nodes[2] = setup.nodes[1];
        setup.origin[2] = setup.origin[1];
    }
    let depth = if D::AXES == 3 { 2 * ROWS as usize } else { 1 };
    let places: Vec<Seed> =
        lattice([0.0; 3], [2 * cells as usize, 2 * ROWS as usize, depth], cell / 2.0, D::AXES);
    let model = steel(&never_yielding(steel_4340()));
    let start = |x: f64| match case {
        Case::Cosine => case.exact(x, 0.0),
        Case::Slab => AMPLITUDE,
        _ => 0.0,
    };
    let mut solver = setup.simulation::<D, _, Steel>(
        (Gimp::new(2), model),
        distant_tool(),
        &places,
        |state, lane, number| {
            ConstitutiveModel::<f64, D>::set_temperature(
                &model,
                state,
                lane,
                ROOM + start(places[number].position[0]),
            );
        },
    );
    let mut pass = conduction();
    let everywhere = i32::MAX / 2;
    let mut hold = |from: i32, to: i32, rise: f64| {
        let nodes = FixedNodes {
            low: [from, -everywhere, -everywhere],
            high: [to, everywhere, everywhere],
            axes: [false; 3],
        };
        pass.fixed.push(FixedTemperature { nodes, temperature: ROOM + rise });
    };
    let left = setup.node(0, 0.0);
    match case {
        Case::Jump => hold(0, left, AMPLITUDE),
        Case::Slab => hold(0, left, 0.0),
        _ => {}
    }
    let passes = (t / (0.25 * pass.limit::<D>(&solver.partition.layout))).ceil() as usize;
    let dt = t / passes as f64;
    let sources = if case == Case::Flux { surface_sources(&solver.partition.layout, dt) } else { vec![] };
    let capacity = steel_4340().density * steel_4340().specific_heat;
    let heat = |solver: &dyn Solver| {
        let mut sum = 0.0;
        solver.visit_points(&mut |point| sum += point.volume * point.report.heat);
        sum
    };
    let before = heat(&solver);
    let mut totals = HeatTotals::default();
    for _ in 0..passes {
        pass.conduct(&mut solver.partition, &solver.shape, &solver.model, dt, &mut totals);
        let (partition, parts) = (&mut solver.partition, (&solver.shape, &solver.model));
        sources::deposit(partition, parts, &sources, capacity, &mut totals);
    }
    let put_in = totals.boundary + passes as f64 * sources.iter().map(|source| source.1).sum::<f64>();
    let volume: f64 = places.iter().map(|seed| seed.volume).sum();
    let imbalance = (heat(&solver) + totals.carry - before - put_in) / (capacity * volume * AMPLITUDE);
    let mut profile = vec![(0.0, 0.0); 2 * cells as usize];
    let column = profile.len() as f64 / places.len() as f64;
    solver.visit_points(&mut |point| {
        let place = (2.0 * point.position[0] / cell) as usize;
        profile[place].0 = point.position[0];
        profile[place].1 += column * (point.report.temperature - ROOM);
    });
    Outcome { profile, imbalance, passes }
}

/// Heat of the flux on the nodes of the left end over `dt` (s), in the plane.
fn surface_sources(layout: &crate::grid::Layout, dt: f64) -> NodeHeat {
    let node = |axis: usize| (-layout.origin[axis] / layout.cell).round() as i32;
    (0..=ROWS)
        .map(|row| {
            let width = if row == 0 || row == ROWS { 0.5 } else { 1.0 };
            let index = layout.offset[node(0) as usize] + node(1) + row;
            (index as usize, FLUX * dt * layout.cell * width)
        })
        .collect()
}

/// All cases at 50 cells, their order, and what is lost.
pub fn verify(report: &mut Report) {
    let cases = [
        (Case::Cosine, "cosine mode", 0.01),
        (Case::Jump, "surface temperature jumps", 4e-5),
        (Case::Flux, "constant flux", 4e-5),
        (Case::Slab, "slab", 1e-3),
    ];
    let (mut profiles, mut imbalance) = (Vec::new(), 0.0_f64);
    for (case, name, t) in cases {
        let runs = [25, 50, 100].map(|cells| run::<PlaneStrain>(case, cells, t));
        let errors = runs.each_ref().map(|outcome| outcome.largest_error(case, t) / case.amplitude(t));
        report.at_most(format!("{name}, 50 cells: error at any point"), 100.0 * errors[1], "%", 0.1, "");
        report.at_least(format!("{name}: order, 50 to 100 cells"), (errors[1] / errors[2]).log2(), 1.8, "");
        imbalance = runs.iter().map(|outcome| outcome.imbalance.abs()).fold(imbalance, f64::max);
        let scale = case.length(t);
        let scaled = runs[1].profile.iter().map(|&(x, rise)| (x / scale, rise / case.amplitude(t)));
        profiles.push(line(name, scaled.collect()));
    }
    let deep = run::<ThreeDimensional>(Case::Cosine, 50, 1e-3);
    report.at_most(
        "cosine mode in space, 50 cells: error at any point",
        deep.largest_error(Case::Cosine, 1e-3),
        "%",
        0.1,
        "",
    );
    imbalance = imbalance.max(deep.imbalance.abs());
    report.at_most("heat lost or gained, worst of all runs", imbalance, "", 1e-12, "");
    report.plot(
        "heat.png",
        "Conduction on 50 cells",
        "place over length of the strip",
        vec![panel("rise over its amplitude", profiles)],
    );
}
