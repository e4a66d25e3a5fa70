//! Manufactured solutions: motions of a neo-Hookean solid that a known body force makes exact.
//!
//! Axis-aligned, in the unit square or cube: x_i = X_i + u_i, u_i = A sin(π X_i) sin(π (c t + φ_i)), c =
//! √(E/ρ). With F_ii = 1 + A π cos(π X_i) sin(π (c t + φ_i)) and K = ln det F,
//!
//! b_i = π² u_i \[μ/ρ − c² − (λ (K − 1) − μ)/(ρ F_ii²)\].
//!
//! The faces do not move along their normals and are free of shear: nodes there slide.
//!
//! Generalised vortex, in the ring ¾ < R < 5/4: every circle turns by a(R, t) = g(t) h(R), g = A sin(π t),
//! h = 1 − 32 (R − 1)² + 256 (R − 1)⁴. In the turned frame
//!
//! b_R = −R (g′h)² + (μ/ρ) R (g h′)²,  b_β = R g″ h − (μ/ρ) g (3 h′ + R h″).
//!
//! The ring's rims are at rest and free of traction.
//!
//! Source: Kamojjala, Brannon, Sadeghirad and Guilkey (2015), doi:10.1007/s00366-013-0342-x; formulas checked
//! against 15-digit samples (test `body_forces_match_the_samples`).

use super::Report;
use super::neo_hookean::NeoHookean;
use super::report::{line, logarithms, panel};
use crate::dimension::Dimension;
use crate::dimension::PlaneStrain;
use crate::grid::FixedNodes;
use crate::grid::shape_function::{Gimp, ShapeFunction};
use crate::simulation::Solver;
use crate::study::body_setup::{BodySetup, NO_MOTION, Seed, distant_tool, lattice, points};
use std::f64::consts::PI;
use std::sync::Arc;

/// The axis-aligned motion.
#[derive(Clone, Copy, Debug)]
pub struct AxisAligned {
    /// The material.
    pub model: NeoHookean,
    /// A (m).
    pub amplitude: f64,
    /// c = √(E/ρ) (m/s).
    speed: f64,
    /// Axes that move.
    axes: usize,
}

impl AxisAligned {
    /// The published material (E 1e4 Pa, ν 0.3, ρ 1 kg/m3) with an amplitude (m), along `axes` axes.
    pub fn new(amplitude: f64, axes: usize) -> Self {
        let model = NeoHookean::new(1e4, 0.3, 1.0);
        AxisAligned { model, amplitude, speed: (1e4_f64 / model.density).sqrt(), axes }
    }

    /// The factor sin(π (c t + φ_i)) and its time derivative (1/s).
    fn phase(&self, axis: usize, time: f64) -> (f64, f64) {
        let angle = PI * (self.speed * time + 2.0 / 3.0 * axis as f64);
        (angle.sin(), PI * self.speed * angle.cos())
    }

    /// u (m) at the place X (m) in the undeformed body.
    pub fn displacement(&self, place: [f64; 3], time: f64) -> [f64; 3] {
        self.along_axes(|axis| self.amplitude * (PI * place[axis]).sin() * self.phase(axis, time).0)
    }

    /// ∂u/∂t (m/s).
    pub fn velocity(&self, place: [f64; 3], time: f64) -> [f64; 3] {
        self.along_axes(|axis| self.amplitude * (PI * place[axis]).sin() * self.phase(axis, time).1)
    }

    /// Diagonal of F (-).
    pub fn stretches(&self, place: [f64; 3], time: f64) -> [f64; 3] {
        self.along_axes(|axis| self.amplitude * PI * (PI * place[axis]).cos() * self.phase(axis, time).0)
            .map(|e| 1.0 + e)
    }

    /// b (m/s2) at the place X (m) in the undeformed body.
    pub fn body_force(&self, place: [f64; 3], time: f64) -> [f64; 3] {
        let NeoHookean { density, lambda, mu, .. } = self.model;
        let (u, f) = (self.displacement(place, time), self.stretches(place, time));
        let k: f64 = f.iter().map(|stretch| stretch.ln()).sum();
        self.along_axes(|i| {
            let stiffness =
                mu / density - self.speed.powi(2) - (lambda * (k - 1.0) - mu) / (density * f[i] * f[i]);
            PI * PI * u[i] * stiffness
        })
    }

    /// X (m) of the point that is at x (m): Newton's method along each axis.
    fn place(&self, position: [f64; 3], time: f64) -> [f64; 3] {
        let mut place = position;
        for _ in 0..20 {
            let (u, f) = (self.displacement(place, time), self.stretches(place, time));
            let miss: [f64; 3] = std::array::from_fn(|k| place[k] + u[k] - position[k]);
            place = std::array::from_fn(|k| place[k] - miss[k] / f[k]);
            if miss.iter().all(|miss| miss.abs() < 1e-15) {
                break;
            }
        }
        place
    }

    fn along_axes(&self, f: impl Fn(usize) -> f64) -> [f64; 3] {
        std::array::from_fn(|axis| if axis < self.axes { f(axis) } else { 0.0 })
    }
}

/// The generalised vortex.
#[derive(Clone, Copy, Debug)]
pub struct Vortex {
    /// The material.
    pub model: NeoHookean,
    /// A: the largest angle (rad).
    pub amplitude: f64,
}

impl Vortex {
    /// The published material (E 1000 Pa, ν 0.3, ρ 1000 kg/m3) with an amplitude (rad).
    pub fn new(amplitude: f64) -> Self {
        let mut model = NeoHookean::new(1e3, 0.3, 1e3);
        // Shear R g h′ of at most 6.1 A stretches by γ/2 + √(1 + γ²/4).
        let shear = 6.1 * amplitude;
        model.largest_stretch = 0.5 * shear + (1.0 + 0.25 * shear * shear).sqrt();
        Vortex { model, amplitude }
    }

    /// g, g′, g″ (rad, rad/s, rad/s2).
    fn time_factor(&self, time: f64) -> [f64; 3] {
        let (sin, cos) = (PI * time).sin_cos();
        [self.amplitude * sin, self.amplitude * PI * cos, -self.amplitude * PI * PI * sin]
    }

    /// h, h′, h″ (-, 1/m, 1/m2). The polynomial goes on outside the ring, where nodes of its rims lie: their
    /// force stands for that on the points inside, and cut off there the order would fall to one.
    fn radial_factor(radius: f64) -> [f64; 3] {
        let d = radius - 1.0;
        let square = d * d;
        [
            1.0 - 32.0 * square + 256.0 * square * square,
            -64.0 * d + 1024.0 * square * d,
            -64.0 + 3072.0 * square,
        ]
    }

    /// x (m) and ∂x/∂t (m/s) of the point that started at X (m).
    pub fn motion(&self, place: [f64; 3], time: f64) -> ([f64; 3], [f64; 3]) {
        let radius = place[0].hypot(place[1]);
        let ([g, rate, _], [h, ..]) = (self.time_factor(time), Self::radial_factor(radius));
        let (sin, cos) = (g * h).sin_cos();
        let x = [place[0] * cos - place[1] * sin, place[0] * sin + place[1] * cos, 0.0];
        let turning = rate * h;
        (x, [-turning * x[1], turning * x[0], 0.0])
    }

    /// b (m/s2) at the place x (m) where the point is now: circles stay circles, so the place at the start is
    /// not needed.
    pub fn body_force(&self, position: [f64; 3], time: f64) -> [f64; 3] {
        let radius = position[0].hypot(position[1]);
        let stiffness = self.model.mu / self.model.density;
        let ([g, g1, g2], [h, h1, h2]) = (self.time_factor(time), Self::radial_factor(radius));
        let radial = radius * (stiffness * (g * h1).powi(2) - (g1 * h).powi(2));
        let around = radius * g2 * h - stiffness * g * (3.0 * h1 + radius * h2);
        let (cos, sin) = (position[0] / radius, position[1] / radius);
        [radial * cos - around * sin, radial * sin + around * cos, 0.0]
    }
}

/// What a run of a manufactured solution gives.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Largest root mean square over the points of |x − x_exact| up to the end, over A (-).
    pub error: f64,
    /// The same over time: (s, -).
    pub history: Vec<(f64, f64)>,
    /// Points that were in another cell than at the start at any of the times looked at.
    pub changed_cells: usize,
    /// Whether the run stopped with an error before the end, and when (s).
    pub stopped: Option<f64>,
}

/// Order of convergence between two errors when the cell is halved.
pub fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

/// Follows a run to `end` (s), looking at every point's distance from `exact` some `looks` times.
fn follow(
    solver: &mut dyn Solver,
    end: f64,
    looks: usize,
    cell: f64,
    exact: impl Fn(usize, f64) -> [f64; 3],
) -> Outcome {
    let mut outcome = Outcome::default();
    let in_cell = |x: [f64; 3]| x.map(|x| (x / cell).floor());
    let start: Vec<_> = points(solver).iter().map(|p| in_cell(p.position)).collect();
    let mut changed = vec![false; start.len()];
    let mut next = 0.0;
    while solver.progress().clock < end {
        if solver.step(&NO_MOTION, false).is_err() {
            outcome.stopped = Some(solver.progress().clock);
            break;
        }
        let time = solver.progress().clock;
        if time < next {
            continue;
        }
        next += end / looks as f64;
        let now = points(solver);
        let mut square = 0.0;
        for (k, point) in now.iter().enumerate() {
            let expected = exact(k, time);
            square += (0..3).map(|axis| (point.position[axis] - expected[axis]).powi(2)).sum::<f64>();
            changed[k] |= in_cell(point.position) != start[k];
        }
        let error = (square / now.len() as f64).sqrt();
        outcome.history.push((time, error));
        outcome.error = outcome.error.max(error);
    }
    outcome.changed_cells = changed.into_iter().filter(|&changed| changed).count();
    outcome
}

/// The axis-aligned motion with `cells` cells along an edge, two points per cell and axis, until `end` (s).
///
/// Velocities start half a substep early: a stored velocity belongs to the middle of a substep.
pub fn axis_aligned<D: Dimension, F: ShapeFunction<f64>>(
    shape: F,
    cells: i32,
    amplitude: f64,
    end: f64,
) -> Outcome {
    let solution = AxisAligned::new(amplitude, D::AXES);
    let cell = 1.0 / f64::from(cells);
    let mut setup = BodySetup::around([0.0; 2], [1.0; 2], cell);
    setup.courant = 0.2;
    if D::AXES == 3 {
        setup.nodes[2] = setup.nodes[0];
        setup.origin[2] = setup.origin[0];
    }
    let everything = i32::MAX / 2;
    for axis in 0..D::AXES {
        for (low, high) in [(-everything, setup.node(axis, 0.0)), (setup.node(axis, 1.0), everything)] {
            let mut face = FixedNodes { low: [-everything; 3], high: [everything; 3], axes: [false; 3] };
            (face.low[axis], face.high[axis], face.axes[axis]) = (low, high, true);
            setup.fixed.push(face);
        }
    }
    let count = std::array::from_fn(|axis| if axis < D::AXES { 2 * cells as usize } else { 1 });
    let places = lattice([0.0; 3], count, cell / 2.0, D::AXES);
    let fastest = amplitude * PI * solution.speed;
    let speed = crate::material::ConstitutiveModel::<f64, D>::sound_speed(&solution.model, 1.0) + fastest;
    let half_step = 0.5 * setup.courant * cell / speed;
    let seeds: Vec<Seed> = places
        .iter()
        .map(|seed| {
            let u = solution.displacement(seed.position, 0.0);
            Seed {
                position: std::array::from_fn(|k| seed.position[k] + u[k]),
                velocity: solution.velocity(seed.position, -half_step),
                volume: seed.volume,
            }
        })
        .collect();
    let mut body =
        setup.simulation::<D, F, _>((shape, solution.model), distant_tool(), &seeds, |state, lane, k| {
            let f = solution.stretches(places[k].position, 0.0);
            state.set(lane, [[f[0], 0.0, 0.0], [0.0, f[1], 0.0], [0.0, 0.0, f[2]]]);
        });
    body.body_force =
        Some(Arc::new(move |position, time| solution.body_force(solution.place(position, time), time)));
    let exact = |k: usize, time: f64| {
        let place: [f64; 3] = places[k].position;
        let u = solution.displacement(place, time);
        std::array::from_fn(|axis| place[axis] + u[axis])
    };
    relative(follow(&mut body, end, 40, cell, exact), amplitude)
}

/// The generalised vortex on a grid of `cells` cells per metre until `end` (s).
pub fn vortex<F: ShapeFunction<f64>>(shape: F, cells: i32, amplitude: f64, end: f64) -> Outcome {
    let solution = Vortex::new(amplitude);
    let cell = 1.0 / f64::from(cells);
    let half = (1.25 / cell).ceil() * cell;
    let mut setup = BodySetup::around([-half; 2], [half; 2], cell);
    setup.courant = 0.4;
    let count = (4.0 * half / cell).round() as usize;
    let mut places = lattice([-half, -half, 0.0], [count, count, 1], cell / 2.0, 2);
    places.retain(|seed| (0.75..1.25).contains(&seed.position[0].hypot(seed.position[1])));
    setup.fixed = outside_ring(&setup);
    let speed = crate::material::ConstitutiveModel::<f64, PlaneStrain>::sound_speed(&solution.model, 1.0);
    let half_step = 0.5 * setup.courant * cell / (speed + 1.0 * PI * amplitude);
    let seeds: Vec<Seed> = places
        .iter()
        .map(|seed| Seed { velocity: solution.motion(seed.position, -half_step).1, ..*seed })
        .collect();
    let mut body =
        setup.simulation::<PlaneStrain, F, _>((shape, solution.model), distant_tool(), &seeds, |_, _, _| {});
    body.body_force = Some(Arc::new(move |position, time| solution.body_force(position, time)));
    let exact = |k: usize, time: f64| solution.motion(places[k].position, time).0;
    relative(follow(&mut body, end, 40, cell, exact), amplitude)
}

/// Nodes that do not lie in the ring, column by column: the rims are at rest.
fn outside_ring(setup: &BodySetup) -> Vec<FixedNodes> {
    let mut fixed: Vec<FixedNodes> = Vec::new();
    for column in 0..setup.nodes[0] {
        let x = setup.origin[0] + setup.cell * f64::from(column);
        let is_inside = |row: i32| {
            let radius = x.hypot(setup.origin[1] + setup.cell * f64::from(row));
            (radius - 1.0).abs() < 0.25 - 1e-9
        };
        let mut row = 0;
        while row < setup.nodes[1] {
            let first = row;
            while row < setup.nodes[1] && !is_inside(row) {
                row += 1;
            }
            if row > first {
                fixed.push(FixedNodes {
                    low: [column, first, 0],
                    high: [column, row - 1, 0],
                    axes: [true; 3],
                });
            }
            row += 1;
        }
    }
    fixed
}

/// Errors over the amplitude.
fn relative(mut outcome: Outcome, amplitude: f64) -> Outcome {
    outcome.error /= amplitude;
    outcome.history.iter_mut().for_each(|entry| entry.1 /= amplitude);
    outcome
}

/// Why the generalised vortex ends where it does.
const TORN: &str =
    "points keep their square while shear draws them apart by more than a cell: the body tears";

/// Both motions: orders where they hold, and where they end.
pub fn verify(report: &mut Report) {
    axis_aligned_findings(report);
    vortex_findings(report);
}

fn axis_aligned_findings(report: &mut Report) {
    const CELLS: [i32; 4] = [8, 16, 32, 64];
    let mut lines = Vec::new();
    for amplitude in [1e-3, 1e-2, 5e-2] {
        let runs = CELLS.map(|cells| axis_aligned::<PlaneStrain, _>(Gimp::new(2), cells, amplitude, 0.02));
        let errors: Vec<f64> = runs.iter().map(|run| run.error).collect();
        let changed = runs[3].changed_cells;
        let least = order(errors[1], errors[2]).min(order(errors[2], errors[3]));
        if amplitude == 1e-3 {
            let text = format!(
                "axis-aligned, A = {amplitude}: least order over 16, 32, 64 cells, {changed} points changed \
                 cell"
            );
            report.at_least(text, least, 1.9, "valid for A ≤ 1e-3: strains to 0.3 %");
        } else {
            let text = format!("axis-aligned, A = {amplitude}: least order, {changed} points changed cell");
            report.show(
                text,
                least,
                "",
                "points keep their square: a share of about the strain is left over or missing",
            );
        }
        report.show(
            format!("axis-aligned, A = {amplitude}: error at 64 cells, of A"),
            100.0 * errors[3],
            "%",
            "",
        );
        let sizes = CELLS.map(|cells| 1.0 / f64::from(cells));
        lines.push(line(format!("A = {amplitude}"), logarithms(sizes.into_iter().zip(errors))));
    }
    let space = [8, 16, 32].map(|cells| {
        axis_aligned::<crate::dimension::ThreeDimensional, _>(Gimp::new(2), cells, 1e-3, 0.01).error
    });
    let text = "axis-aligned in space, A = 0.001: least order over 8, 16, 32 cells";
    report.at_least(text, order(space[0], space[1]).min(order(space[1], space[2])), 1.9, "");
    let second = [(-0.9, -0.9), (-1.8, -2.7)].to_vec();
    lines.push(line("order 2", second));
    let charts = vec![panel("log10 error over A", lines)];
    report.plot(
        "axis_aligned.png",
        "Axis-aligned manufactured solution, one period",
        "log10 of the cell (m)",
        charts,
    );
}

fn vortex_findings(report: &mut Report) {
    const CELLS: [i32; 4] = [16, 32, 64, 128];
    let (mut sizes, mut times) = (Vec::new(), Vec::new());
    for (amplitude, end) in [(1e-3, 1.0), (0.1, 1.0), (1.0, 0.1)] {
        let errors = CELLS.map(|cells| vortex(Gimp::new(2), cells, amplitude, end).error);
        let least = order(errors[1], errors[2]).min(order(errors[2], errors[3]));
        let text = format!("vortex, A = {amplitude}, to {end} s: least order over 32, 64, 128 cells");
        if amplitude == 0.1 {
            report.show(text, least, "", "saturates once points change cell");
        } else {
            report.at_least(text, least, 1.7, if end < 1.0 { "the shear has reached 1.9" } else { "" });
        }
        report.show(
            format!("vortex, A = {amplitude}, to {end} s: error at 128 cells, of A"),
            100.0 * errors[3],
            "%",
            "",
        );
        let cells = CELLS.map(|cells| 1.0 / f64::from(cells));
        sizes.push(line(format!("A = {amplitude}, to {end} s"), logarithms(cells.into_iter().zip(errors))));
    }
    for cells in [16, 32, 64] {
        let run = vortex(Gimp::new(2), cells, 1.0, 1.0);
        if cells == 64 {
            report.show("vortex, A = 1, to 1 s: error at 64 cells, of A", 100.0 * run.error, "%", TORN);
        }
        times.push(line(
            format!("A = 1, {cells} cells per m"),
            run.history.iter().map(|&(t, e)| (t, e.log10())).collect(),
        ));
    }
    report.plot(
        "vortex.png",
        "Generalised vortex",
        "log10 of the cell (m)",
        vec![panel("log10 largest error over A", sizes)],
    );
    report.plot(
        "vortex_torn.png",
        "Generalised vortex until it tears",
        "time (s)",
        vec![panel("log10 error over A", times)],
    );
}
