//! A block and a disk on an inclined plane with Coulomb friction.
//!
//! The plane is the rake face of a rigid tool, turned against the grid by any angle, and gravity g is turned
//! with it: the same problem for every grid angle. On a slope θ with friction μ,
//!
//! * a block slides with g (sin θ − μ cos θ), or stays where tan θ ≤ μ;
//! * a disk rolls with 2/3 g sin θ where μ ≥ tan θ/3, and otherwise slides as the block does.
//!
//! Gravity grows over `RAMP`: an elastic body that is loaded at once vibrates, and loses its hold whenever it
//! is light.

use super::Report;
use super::report::{line, panel};
use crate::dimension::PlaneStrain;
use crate::grid::shape_function::Gimp;
use crate::scene::Constants;
use crate::simulation::{PointView, Solver, ToolMotion};
use crate::study::body_setup::{
    BodySetup, Contact, Seed, lattice, never_yielding, points, steel, steel_4340, total,
};
use crate::tool::RigidTool;
use crate::tool::profile::ToolShape;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Acceleration of gravity (m/s2).
pub const GRAVITY: f64 = 9.81;
/// Time that a body slides or rolls (s).
pub const END: f64 = 1.0;
/// Time in which gravity grows to its full size (s): fourteen periods of the block's vibration.
pub const RAMP: f64 = 0.2;

/// What moves down the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Body {
    /// 0.8 m along the plane, 0.4 m high.
    Block,
    /// Radius 0.4 m.
    Disk,
}

/// A problem.
#[derive(Clone, Copy, Debug)]
pub struct Incline {
    /// What moves.
    pub body: Body,
    /// Slope θ (rad).
    pub slope: f64,
    /// Coulomb coefficient μ (-).
    pub friction: f64,
    /// Angle of the plane's normal to the grid's −x axis (rad), within ±60 degrees.
    pub grid_angle: f64,
    /// Cell length (m).
    pub cell: f64,
    /// The contact law.
    pub contact: Contact,
}

/// What a run gives.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Way of the centre of mass along the plane (m).
    pub travel: f64,
    /// The exact way (m).
    pub exact: f64,
    /// Way since gravity is at its full size (m).
    pub creep: f64,
    /// Way over time: (s, m).
    pub history: Vec<(f64, f64)>,
}

impl Incline {
    /// Acceleration along the plane (m/s2).
    pub fn exact_acceleration(&self) -> f64 {
        let slides = (self.slope.sin() - self.friction * self.slope.cos()).max(0.0) * GRAVITY;
        let rolls = 2.0 / 3.0 * GRAVITY * self.slope.sin();
        if self.body == Body::Disk && self.friction >= self.slope.tan() / 3.0 { rolls } else { slides }
    }

    /// Unit vectors down the plane and away from it.
    fn directions(&self) -> ([f64; 2], [f64; 2]) {
        let (sin, cos) = self.grid_angle.sin_cos();
        ([-sin, -cos], [-cos, sin])
    }

    /// The body's points, its lower side at a `gap` (m) from the plane through the origin.
    fn seeds(&self, gap: f64) -> Vec<Seed> {
        let (down, up) = self.directions();
        let spacing = 0.5 * self.cell;
        let size = if self.body == Body::Block { [0.8, 0.4] } else { [0.8, 0.8] };
        let count = size.map(|length: f64| (length / spacing).round() as usize);
        let mut local = match self.body {
            Body::Block => lattice([0.0; 3], [count[0], count[1], 1], spacing, 2),
            Body::Disk => rings(0.4, spacing),
        };
        for seed in &mut local {
            let [along, off] = [seed.position[0] - 0.4, seed.position[1] + gap];
            seed.position = [along * down[0] + off * up[0], along * down[1] + off * up[1], 0.0];
        }
        local
    }

    /// The plane, from `before` (m) down the plane from the origin to `behind` (m) up from it.
    fn plane(&self, before: f64, behind: f64) -> RigidTool {
        let (down, _) = self.directions();
        let height = (before + behind) * self.grid_angle.cos();
        let length = ((before + behind) * self.grid_angle.sin()).max(0.0) + 1.0;
        // The back lies behind the plane everywhere: the flank runs straight away from the lowest point.
        let shape = ToolShape::new(self.grid_angle, 0.0, 0.0, length, height).expect("a wedge");
        let position = [before * down[0], before * down[1]];
        RigidTool { shape, position, velocity: [0.0; 2], friction: self.friction }
    }

    /// A domain around everything the body may reach on `way` (m) down the plane.
    fn setup(&self, way: f64) -> BodySetup {
        let (down, up) = self.directions();
        let corners = [[-1.2, -0.3], [-1.2, 1.5], [way + 1.2, -0.3], [way + 1.2, 1.5]];
        let axis = |axis: usize| corners.map(|[along, off]| along * down[axis] + off * up[axis]);
        let (x, y) = (axis(0), axis(1));
        let low = [x.into_iter().fold(f64::MAX, f64::min), y.into_iter().fold(f64::MAX, f64::min)];
        let high = [x.into_iter().fold(f64::MIN, f64::max), y.into_iter().fold(f64::MIN, f64::max)];
        // Nothing about the grid fits the plane.
        BodySetup::around([low[0] - 0.37 * self.cell, low[1] - 0.21 * self.cell], high, self.cell)
    }

    /// Lets the body go from rest, touching the plane.
    ///
    /// # Panics
    /// When the run becomes unstable.
    pub fn run(&self) -> Outcome {
        // Twice integrated, the ramp r = s² (3 − 2 s) gives 3/20 at its end, and 1/2 once.
        let rest = END - RAMP;
        let exact = self.exact_acceleration() * (0.15 * RAMP * RAMP + 0.5 * RAMP * rest + 0.5 * rest * rest);
        let (down, up) = self.directions();
        let setup = self.setup(exact);
        let mut solver = setup.simulation::<PlaneStrain, _, _>(
            (Gimp::new(2), steel(&rubber())),
            self.plane(exact + 2.0, 2.0),
            &self.seeds(0.0),
            |_, _, _| {},
        );
        let (sin, cos) = self.slope.sin_cos();
        let pull = [0, 1].map(|axis| GRAVITY * (sin * down[axis] - cos * up[axis]));
        solver.body_force = Some(Arc::new(move |_, time: f64| {
            let s = (time / RAMP).min(1.0);
            let share = s * s * (3.0 - 2.0 * s);
            [share * pull[0], share * pull[1], 0.0]
        }));
        let centre = |now: &[PointView], direction: [f64; 2]| {
            let part = |p: &PointView| p.position[0] * direction[0] + p.position[1] * direction[1];
            total(now, |p| p.mass * part(p)) / total(now, |p| p.mass)
        };
        let start = points(&solver);
        let motion = ToolMotion { velocity: [0.0; 2], friction: self.friction };
        let mut outcome = Outcome { exact, ..Outcome::default() };
        let mut next = 0.0;
        solver.contact = self.contact.law();
        while solver.progress().clock < END {
            solver.step(&motion, false).expect("a stable step");
            let time = solver.progress().clock;
            if time >= next {
                next += END / 100.0;
                let now = points(&solver);
                outcome.history.push((time, centre(&now, down) - centre(&start, down)));
            }
        }
        let now = points(&solver);
        let speed = total(&now, |p| p.mass * (p.velocity[0] * down[0] + p.velocity[1] * down[1]))
            / total(&now, |p| p.mass);
        // The last substep ends a little late.
        outcome.travel = centre(&now, down) - centre(&start, down) - speed * (solver.progress().clock - END);
        let loaded = outcome.history.iter().find(|entry| entry.0 >= RAMP).map_or(0.0, |entry| entry.1);
        outcome.creep = outcome.travel - loaded;
        outcome
    }

    /// Lets the body fly at the plane and gives the gap at first contact, in cells: distance of the nearest
    /// point to the plane, less half a point's width.
    ///
    /// # Panics
    /// When the run becomes unstable or never touches.
    pub fn first_contact(&self) -> f64 {
        const SPEED: f64 = 1.0;
        let (_, up) = self.directions();
        let mut seeds = self.seeds(2.5 * self.cell);
        seeds.iter_mut().for_each(|seed| seed.velocity = [-SPEED * up[0], -SPEED * up[1], 0.0]);
        let mut solver = self.setup(0.0).simulation::<PlaneStrain, _, _>(
            (Gimp::new(2), steel(&rubber())),
            self.plane(2.0, 2.0),
            &seeds,
            |_, _, _| {},
        );
        let motion = ToolMotion { velocity: [0.0; 2], friction: self.friction };
        solver.contact = self.contact.law();
        for _ in 0..1_000_000 {
            let gap = points(&solver)
                .iter()
                .map(|p| p.position[0] * up[0] + p.position[1] * up[1])
                .fold(f64::MAX, f64::min);
            solver.step(&motion, false).expect("a stable step");
            let [x, y] = solver.progress().ledger.tool_impulse;
            if x.hypot(y) > 0.0 {
                return gap / self.cell - 0.25;
            }
        }
        panic!("no contact with the plane")
    }
}

/// A disk of points in rings, so that its outline is round: a lattice would roll like a polygon. Its lowest
/// point is the origin's (`radius`, 0).
fn rings(radius: f64, spacing: f64) -> Vec<Seed> {
    let mut seeds = Vec::new();
    let count = (radius / spacing).round();
    let width = radius / count;
    for ring in 0..count as usize {
        let middle = (ring as f64 + 0.5) * width;
        let points = (TAU * middle / width).round();
        let volume = TAU * middle * width / points;
        for k in 0..points as usize {
            let (sin, cos) = (TAU * (k as f64 + 0.5) / points).sin_cos();
            let position = [radius + middle * sin, radius - middle * cos, 0.0];
            seeds.push(Seed { position, velocity: [0.0; 3], volume });
        }
    }
    seeds
}

/// Elastic, ρ 1000 kg/m3, E 1e7 Pa, ν 0.3: its own weight compresses the block by 2e-4.
fn rubber() -> Constants {
    never_yielding(Constants { density: 1000.0, youngs_modulus: 1e7, poissons_ratio: 0.3, ..steel_4340() })
}

/// Why bodies hover, creep and do not roll.
pub const HOVERS: &str =
    "contact acts on nodes inside the tool as soon as they have mass, before the points arrive";

/// Grid angles that are tried (degrees).
pub const GRID_ANGLES: [f64; 3] = [0.0, 17.0, 45.0];

/// Sliding, rolling, sticking and first contact at three grid angles, with both ways of contact.
pub fn verify(report: &mut Report) {
    let mut ways = Vec::new();
    let slope = 30_f64.to_radians();
    let cases = [
        (Body::Block, 0.0, "block slides without friction", 0.5),
        (Body::Block, 0.3, "block slides", 0.5),
        (Body::Disk, 0.1, "disk slides", 1.0),
        (Body::Disk, 0.6, "disk rolls", 1.0),
    ];
    for contact in [Contact::Surface, Contact::NodesInside] {
        let points_touch = contact == Contact::Surface;
        let way_of_contact = if points_touch { "points" } else { "nodes" };
        let note = if points_touch { "" } else { HOVERS };
        // The largest figure of all grid angles.
        let worst = |figure: &dyn Fn(f64) -> f64| {
            GRID_ANGLES
                .map(|degrees| figure(degrees.to_radians()))
                .into_iter()
                .fold(0.0_f64, |worst, x| if x.abs() > worst.abs() { x } else { worst })
        };
        let incline = |body, friction, grid_angle| Incline {
            body,
            slope,
            friction,
            grid_angle,
            // What rolls needs 16 cells along its radius: it goes as if thinner by an eighth of a cell.
            cell: if friction == 0.6 { 0.025 } else { 0.05 },
            contact,
        };
        for (body, friction, name, bound) in cases {
            let error = worst(&|angle| {
                let outcome = incline(body, friction, angle).run();
                outcome.travel / outcome.exact - 1.0
            });
            let text = format!("{way_of_contact} touch: {name}, μ = {friction}: way");
            report.at_most(
                text,
                100.0 * error,
                "%",
                bound,
                if error.abs() < 0.01 * bound { "" } else { note },
            );
            if points_touch {
                ways.push(line(name, incline(body, friction, GRID_ANGLES[1].to_radians()).run().history));
            }
        }
        let free = Incline { friction: 0.0, ..incline(Body::Block, 0.0, 0.0) }.exact_acceleration() * 0.406;
        let creep = worst(&|angle| incline(Body::Block, 0.7, angle).run().creep / free);
        let text =
            format!("{way_of_contact} touch: block sticks, μ = 0.7: creep over the way without friction");
        report.at_most(text, creep, "", 1e-4, "");
        let gap = worst(&|angle| incline(Body::Block, 0.0, angle).first_contact());
        report.at_most(format!("{way_of_contact} touch: gap at first contact"), gap, "cells", 0.1, note);
    }
    report.plot(
        "incline.png",
        "Bodies on a slope of 30°, grid at 17° to it",
        "time (s)",
        vec![panel("way of the centre of mass (m)", ways)],
    );
}
