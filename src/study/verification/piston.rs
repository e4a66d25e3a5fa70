//! Piston shock: a rigid piston at the tool's speed drives a steel bar in uniaxial strain.
//!
//! An elastic front runs ahead of a plastic one. Both are shocks, as the law below stiffens in compression.
//! Across a front of material speed U, mass and momentum demand (Lagrangian form, uniaxial stretch J, nominal
//! stress P = τ_xx/J)
//!
//! \[v\] = −U \[J\],  \[P\] = −ρ₀ U \[v\].
//!
//! The law implemented (`j2_plasticity`), loaded in uniaxial strain and perfectly plastic: τ_xx = s + κ/2 (J²
//! − 1) with s = 4/3 μ ln J until −s = 2/3 Y (midpoint increments add up to ln J), and s = −2/3 Y from there
//! on. Unknown is only J behind the plastic front: the speeds of both fronts follow, and the material's there
//! must be the piston's.
//!
//! Source of the jump conditions: Davison (2008), Fundamentals of Shock Wave Propagation in Solids, chapter
//! 2.

use super::Report;
use super::report::{line, panel};
use crate::dimension::PlaneStrain;
use crate::grid::FixedNodes;
use crate::grid::shape_function::Gimp;
use crate::material::ConstitutiveModel;
use crate::scene::Constants;
use crate::simulation::{PointView, Solver, ToolMotion};
use crate::study::body_setup::{
    self, BodySetup, Contact, Seed, lattice, perfectly_plastic, points, steel, steel_4340, total,
};
use crate::tool::RigidTool;

/// Speed of the piston: the reference cut's tool (m/s).
pub const SPEED: f64 = 50.0;

/// Stresses and fronts of the exact solution.
#[derive(Clone, Copy, Debug)]
pub struct Exact {
    /// Volume ratio behind the elastic front (-).
    pub elastic_ratio: f64,
    /// Volume ratio behind the plastic front (-).
    pub plastic_ratio: f64,
    /// Nominal compressive stress τ_xx/J behind the elastic front (Pa).
    pub elastic_stress: f64,
    /// The same behind the plastic front (Pa).
    pub plateau: f64,
    /// Material speed of the elastic front (m/s).
    pub elastic_front: f64,
    /// Material speed of the plastic front (m/s).
    pub plastic_front: f64,
    /// Velocity of the material between the fronts (m/s).
    pub elastic_velocity: f64,
}

/// Nominal stress τ_xx/J in uniaxial strain (Pa), negative in compression.
fn nominal_stress(c: &Constants, j: f64) -> f64 {
    let bulk = c.youngs_modulus / (3.0 * (1.0 - 2.0 * c.poissons_ratio));
    let shear = c.youngs_modulus / (2.0 * (1.0 + c.poissons_ratio));
    let deviator = (4.0 / 3.0 * shear * j.ln()).max(-2.0 / 3.0 * c.yield_stress);
    (deviator + 0.5 * bulk * (j * j - 1.0)) / j
}

/// Who moves. Both are the same problem in another frame, but not on the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Piston {
    /// The piston moves into a bar at rest, across the grid's nodes.
    Moving,
    /// The bar flies into the piston, whose face stays on a line of nodes.
    AtRest,
}

/// Solves the jump conditions for a piston of `speed` (m/s) that yields the material.
pub fn exact(c: &Constants, speed: f64) -> Exact {
    let shear = c.youngs_modulus / (2.0 * (1.0 + c.poissons_ratio));
    let elastic_ratio = (-c.yield_stress / (2.0 * shear)).exp();
    let elastic_stress = -nominal_stress(c, elastic_ratio);
    let front = |stress: f64, from: f64, to: f64| (stress / (c.density * (from - to))).sqrt();
    let elastic_front = front(elastic_stress, 1.0, elastic_ratio);
    let elastic_velocity = elastic_front * (1.0 - elastic_ratio);
    let behind = |j: f64| {
        let plateau = -nominal_stress(c, j);
        let plastic_front = front(plateau - elastic_stress, elastic_ratio, j);
        (plateau, plastic_front, elastic_velocity + plastic_front * (elastic_ratio - j))
    };
    // The velocity behind the front grows as J falls.
    let (mut low, mut high) = (0.5, elastic_ratio);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if behind(middle).2 > speed { low = middle } else { high = middle }
    }
    let plastic_ratio = 0.5 * (low + high);
    let (plateau, plastic_front, _) = behind(plastic_ratio);
    Exact {
        elastic_ratio,
        plastic_ratio,
        elastic_stress,
        plateau,
        elastic_front,
        plastic_front,
        elastic_velocity,
    }
}

/// What a run gives beside the exact solution.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Exact solution.
    pub exact: Exact,
    /// Mean nominal compressive stress of the plateau (Pa).
    pub plateau: f64,
    /// Material speeds of the elastic and the plastic front (m/s).
    pub fronts: [f64; 2],
    /// Force of the piston over that of the exact plateau, means over a fiftieth of the run, over the
    /// piston's travel in cells.
    pub force: Vec<(f64, f64)>,
    /// |Σ m v − impulse of the piston| over the impulse.
    pub momentum_error: f64,
    /// Energy that the ledger misses, and work of artificial viscosity, over the plastic work.
    pub imbalance: f64,
    /// See `imbalance`.
    pub viscous_work: f64,
    /// Distance from the bar's left end at the start (m), velocity (m/s) and compressive nominal stress (Pa)
    /// over the bar's length, layer by layer.
    pub profile: Vec<[f64; 3]>,
}

/// Runs a bar of `cells` cells and 10 mm until the elastic front has crossed 85 % of it.
///
/// # Panics
/// When the run becomes unstable.
pub fn run(piston: Piston, points_touch: bool, cells: i32, courant: f64) -> Outcome {
    run_with(piston, points_touch, cells, courant, |constants, _| steel(constants))
}

/// The same with a model of one's own of the constants and the cell length (m).
///
/// # Panics
/// When the run becomes unstable.
pub fn run_with<M: ConstitutiveModel<f64, PlaneStrain>>(
    piston: Piston,
    points_touch: bool,
    cells: i32,
    courant: f64,
    model: impl Fn(&Constants, f64) -> M,
) -> Outcome {
    const LENGTH: f64 = 0.01;
    /// Cells across the bar.
    const ACROSS: i32 = 2;
    let constants = perfectly_plastic(steel_4340());
    let exact = exact(&constants, SPEED);
    let cell = LENGTH / f64::from(cells);
    let height = f64::from(ACROSS) * cell;
    let mut setup = BodySetup::around([0.0, 0.0], [LENGTH * 1.2, height], cell);
    setup.courant = courant;
    // Nodes of the bar's lower and upper side and all beyond slide along it: uniaxial strain.
    let everything = i32::MAX / 2;
    for (low, high) in [(-everything, setup.node(1, 0.0)), (setup.node(1, height), everything)] {
        setup.fixed.push(FixedNodes {
            low: [-everything, low, 0],
            high: [everything, high, 0],
            axes: [false, true, false],
        });
    }
    let count = [2 * cells as usize, 2 * ACROSS as usize, 1];
    let mut seeds: Vec<Seed> = lattice([0.0; 3], count, cell / 2.0, 2);
    // Velocities are compared in the frame of the bar.
    let flight = if piston == Piston::AtRest { SPEED } else { 0.0 };
    seeds.iter_mut().for_each(|seed| seed.velocity[0] = flight);
    // The tool cuts towards −x: the bar lies to its left and is pushed at its right end.
    let tool = RigidTool {
        shape: body_setup::upright_block(LENGTH, 40.0 * height),
        // A node exactly on the face counts as inside for any rounding.
        position: [LENGTH * (1.0 - 1e-12), -20.0 * height],
        velocity: [0.0; 2],
        friction: 0.0,
    };
    let mut bar = setup.simulation::<PlaneStrain, _, _>(
        (Gimp::new(2), model(&constants, cell)),
        tool,
        &seeds,
        |_, _, _| {},
    );
    let motion = ToolMotion { velocity: [flight - SPEED, 0.0], friction: 0.0 };
    let end = 0.85 * LENGTH / exact.elastic_front;
    let (mut force, mut last) = (Vec::new(), (0.0, 0.0));
    bar.contact = if points_touch { Contact::Surface } else { Contact::NodesInside }.law();
    while bar.progress().clock < end {
        bar.step(&motion, false).expect("a stable step");
        let (time, impulse) = (bar.progress().clock, bar.progress().ledger.tool_impulse[0]);
        if time - last.0 > end / 100.0 {
            let mean = (last.1 - impulse) / (time - last.0) / height;
            force.push((0.5 * (time + last.0) * SPEED / cell, mean / exact.plateau));
            last = (time, impulse);
        }
    }
    let time = bar.progress().clock;
    let now = points(&bar);
    let impulse = bar.progress().ledger.tool_impulse[0];
    let momentum = total(&now, |p| p.mass * (p.velocity[0] - flight));
    let profile = layers(&now, &seeds, LENGTH, count);
    let ledger = &bar.progress().ledger;
    let kinetic = total(&now, |p| body_setup::kinetic(p, [0.0; 3]));
    let imbalance = ledger.imbalance(kinetic, total(&now, body_setup::elastic)) / ledger.plastic_work;
    let viscous_work = ledger.viscous_work / ledger.plastic_work;
    let fronts = fronts(&profile, &exact);
    // The plateau is what lies between the contact's first cells and the plastic front's width.
    let depth = fronts[1];
    let inside: Vec<f64> = profile
        .iter()
        .filter(|layer| (0.15 * depth..0.85 * depth).contains(&layer[0]))
        .map(|layer| layer[2])
        .collect();
    Outcome {
        exact,
        plateau: inside.iter().sum::<f64>() / inside.len() as f64,
        fronts: fronts.map(|depth| depth / time),
        force,
        imbalance,
        viscous_work,
        momentum_error: ((momentum - impulse) / impulse).abs(),
        profile,
    }
}

/// Depth below the piston's face at the start (m), velocity towards the left (m/s) and nominal compressive
/// stress (Pa) of each layer of points.
fn layers(now: &[PointView], seeds: &[Seed], length: f64, count: [usize; 3]) -> Vec<[f64; 3]> {
    let mut profile: Vec<[f64; 3]> = now
        .chunks_exact(count[1])
        .zip(seeds.chunks_exact(count[1]))
        .map(|(points, seeds)| {
            let mean = |f: fn(&PointView) -> f64| total(points, f) / points.len() as f64;
            // τ/J is Cauchy's stress.
            [
                length - seeds[0].position[0],
                seeds[0].velocity[0] - mean(|p| p.velocity[0]),
                -mean(|p| p.report.stress[0]),
            ]
        })
        .collect();
    profile.reverse();
    profile
}

/// Depths (m) of the elastic and the plastic front: where sharp fronts would carry the same momentum.
///
/// A level of velocity would follow the shape of the smeared front instead, which runs behind with the cube
/// root of time.
fn fronts(profile: &[[f64; 3]], exact: &Exact) -> [f64; 2] {
    let depth =
        |velocity: f64| profile.iter().rfind(|layer| layer[1] > velocity).map_or(0.0, |layer| layer[0]);
    // Half way between the fronts, and well behind the second.
    let split = 0.5 * (depth(0.5 * exact.elastic_velocity) + depth(0.5 * (exact.elastic_velocity + SPEED)));
    let behind = 0.5 * depth(0.5 * (exact.elastic_velocity + SPEED));
    let spacing = profile[1][0] - profile[0][0];
    let above = |from: f64, to: f64, level: f64| -> f64 {
        profile
            .iter()
            .filter(|layer| (from..to).contains(&layer[0]))
            .map(|layer| spacing * (layer[1] - level))
            .sum()
    };
    // Sums begin at the edge of the first layer's box.
    let edge = |x: f64| (x / spacing).ceil() * spacing;
    let (split, behind) = (edge(split), edge(behind));
    [
        split + above(split, f64::MAX, 0.0) / exact.elastic_velocity,
        behind + above(behind, split, exact.elastic_velocity) / (SPEED - exact.elastic_velocity),
    ]
}

/// Why a piston that crosses nodes does not hold its pressure.
pub const CROSSING: &str = "contact acts on nodes inside the tool only: as the face nears the next line of \
                            nodes, those behind it lose touch with the material, and the force falls until \
                            it is reached";

/// Why the plastic front lags a little behind a piston that moves.
pub const STARTING: &str = "the force is low by one percent until the face has crossed its first cell";

/// Both pistons at two resolutions.
pub fn verify(report: &mut Report) {
    let (mut stresses, mut forces) = (Vec::new(), Vec::new());
    let cases: [(Piston, bool, &[i32], &str); 4] = [
        (Piston::AtRest, true, &[200, 400], "points touch, face on nodes"),
        (Piston::Moving, true, &[200, 400, 800], "points touch, face crossing nodes"),
        (Piston::AtRest, false, &[200, 400], "nodes touch, face on nodes"),
        (Piston::Moving, false, &[200, 400], "nodes touch, face crossing nodes"),
    ];
    let mut momentum_error = 0.0_f64;
    for (piston, points_touch, resolutions, name) in cases {
        for &cells in resolutions {
            let bound = if cells == 200 { 1.0 } else { 0.5 };
            let outcome = run(piston, points_touch, cells, 0.5);
            momentum_error = momentum_error.max(outcome.momentum_error);
            let exact = outcome.exact;
            let note = match (piston, points_touch) {
                (Piston::Moving, true) => STARTING,
                (Piston::Moving, false) => CROSSING,
                _ => "",
            };
            let errors = [
                ("plateau", outcome.plateau / exact.plateau),
                ("elastic front", outcome.fronts[0] / exact.elastic_front),
                ("plastic front", outcome.fronts[1] / exact.plastic_front),
            ];
            for (what, ratio) in errors {
                let error = 100.0 * (ratio - 1.0);
                let note = if error.abs() > bound { note } else { "" };
                report.at_most(format!("{name}, {cells} cells: {what}"), error, "%", bound, note);
            }
            if cells == 400 {
                let profile = outcome.profile.iter().map(|layer| (1e3 * layer[0], 1e-9 * layer[2]));
                stresses.push(line(name, profile.collect()));
                forces.push(line(name, outcome.force.clone()));
                if stresses.len() == 1 {
                    let time = outcome.force.last().map_or(0.0, |last| last.0) * 0.01 / 400.0 / SPEED;
                    let [elastic, plastic] =
                        [exact.elastic_front, exact.plastic_front].map(|u| 1e3 * u * time);
                    let (low, high) = (1e-9 * exact.elastic_stress, 1e-9 * exact.plateau);
                    let corners = vec![
                        (0.0, high),
                        (plastic, high),
                        (plastic, low),
                        (elastic, low),
                        (elastic, 0.0),
                        (10.0, 0.0),
                    ];
                    stresses.insert(0, line("exact", corners));
                }
            }
        }
    }
    report.at_most("momentum less impulse, worst of all runs", momentum_error, "", 1e-10, "");
    report.plot(
        "piston_shock.png",
        "Piston shock at 50 m/s, 400 cells",
        "depth below the piston (mm)",
        vec![panel("compressive stress (GPa)", stresses)],
    );
    report.plot(
        "piston_force.png",
        "Piston shock at 50 m/s, 400 cells: force on the piston",
        "travel of the piston (cells)",
        vec![panel("force over the exact one", forces)],
    );
}
