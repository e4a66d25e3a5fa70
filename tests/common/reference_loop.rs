//! The plain material point method: one array per quantity, one loop per equation, scalars, the C library's
//! functions.
//!
//! It is the oracle of the fast kernels (`tests/reference_loop.rs`) and the yardstick of the benchmark:
//! written from the equations, for plane strain, uniform GIMP with two points per cell edge, Johnson–Cook
//! with rate and adiabatic heat, and contact of nodes inside the exact tool. Of the solver it uses only the
//! description of the scene and the tool's signed distance, which has its own oracle in
//! `src/tool_shape/tests.rs`. Equation numbers: Ambati et al. (2011).

use crate::common::{Lattice, ROOM};
use swarf::scene::Constants;
use swarf::simulation::ToolMotion;
use swarf::tool::RigidTool;

/// Material points, one array per quantity.
#[derive(Clone, Default)]
pub struct Points {
    /// Position from the workpiece's lower left corner (m).
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    /// Velocity (m/s).
    pub vx: Vec<f64>,
    pub vy: Vec<f64>,
    /// Volume at the start (m3).
    pub volume: Vec<f64>,
    /// Volume ratio det F (-).
    pub jacobian: Vec<f64>,
    /// Deviator of the Kirchhoff stress (Pa); zz = −xx − yy.
    pub sxx: Vec<f64>,
    pub syy: Vec<f64>,
    pub sxy: Vec<f64>,
    /// Equivalent plastic strain (-).
    pub plastic_strain: Vec<f64>,
    /// Flow stress at rest (Pa).
    pub strength: Vec<f64>,
    /// Temperature (K).
    pub temperature: Vec<f64>,
    /// h = Δt ∇v of the present substep (-), rows one after another.
    gradient: Vec<[f64; 4]>,
}

/// Every node of the domain, column by column.
#[derive(Clone, Default)]
struct Grid {
    rows: usize,
    mass: Vec<f64>,
    /// Momentum (kg m/s), then velocity after the substep (m/s).
    vx: Vec<f64>,
    vy: Vec<f64>,
    /// Force (N), then the velocity's increment (m/s).
    fx: Vec<f64>,
    fy: Vec<f64>,
    /// Which components stay zero.
    fixed: Vec<[bool; 2]>,
}

/// The loop and its state.
#[derive(Clone)]
pub struct ReferenceLoop {
    pub points: Points,
    grid: Grid,
    material: Constants,
    tool: RigidTool,
    /// Box around the tool's shape (m).
    bounds: ([f64; 2], [f64; 2]),
    cell: f64,
    /// Node at the origin of positions.
    corner: [i32; 2],
    courant: f64,
    /// Nodes lighter than this (kg) stay at rest.
    lightest: f64,
    /// Speed of the fastest point along an axis (m/s), and the largest volume ratio (-), in the last substep.
    fastest: f64,
    volume_ratio: f64,
    /// Impulse of the tool on the workpiece (N s).
    pub tool_impulse: [f64; 2],
    /// Plastic work (J).
    pub plastic_work: f64,
    /// Points that yielded in the last substep.
    pub yielding: usize,
    /// Time (s).
    pub clock: f64,
}

/// Φ(r) for a point of half a cell's width (eq. 14).
fn weight(r: f64) -> f64 {
    let r = r.abs();
    if r <= 0.25 {
        (7.0 - 16.0 * r * r) / 8.0
    } else if r <= 0.75 {
        1.0 - r
    } else if r <= 1.25 {
        (5.0 - 4.0 * r).powi(2) / 16.0
    } else {
        0.0
    }
}

/// dΦ/dr.
fn slope(r: f64) -> f64 {
    let size = r.abs();
    let of_size = if size <= 0.25 {
        -4.0 * size
    } else if size <= 0.75 {
        -1.0
    } else if size <= 1.25 {
        -(5.0 - 4.0 * size) / 2.0
    } else {
        0.0
    };
    of_size * r.signum()
}

impl Points {
    fn push(&mut self, x: f64, y: f64, volume: f64, strength: f64) {
        for (column, value) in [
            (&mut self.x, x),
            (&mut self.y, y),
            (&mut self.vx, 0.0),
            (&mut self.vy, 0.0),
            (&mut self.volume, volume),
            (&mut self.jacobian, 1.0),
            (&mut self.sxx, 0.0),
            (&mut self.syy, 0.0),
            (&mut self.sxy, 0.0),
            (&mut self.plastic_strain, 0.0),
            (&mut self.strength, strength),
            (&mut self.temperature, ROOM),
        ] {
            column.push(value);
        }
        self.gradient.push([0.0; 4]);
    }

    /// Number of points.
    pub fn count(&self) -> usize {
        self.x.len()
    }
}

impl ReferenceLoop {
    /// The block of a lattice at rest, numbered as `Lattice::build` numbers it.
    pub fn new(lattice: &Lattice, constants: &Constants, tool: RigidTool) -> Self {
        assert_eq!(lattice.per_edge, 2, "the weights are those of two points per cell edge");
        let [columns, rows, _] = lattice.domain.map(|nodes| nodes as usize);
        let spacing = lattice.cell / 2.0;
        let mut points = Points::default();
        for i in 0..2 * lattice.cells[0] {
            for j in 0..2 * lattice.cells[1] {
                let (x, y) = ((f64::from(i) + 0.5) * spacing, (f64::from(j) + 0.5) * spacing);
                points.push(x, y, spacing * spacing, constants.yield_stress);
            }
        }
        let fixed_axes = |node: usize| {
            let at = [(node / rows) as i32, (node % rows) as i32];
            let mut axes = [false; 2];
            for wall in &lattice.fixed {
                let inside = (0..2).all(|k| wall.low[k] <= at[k] && at[k] <= wall.high[k]);
                axes = std::array::from_fn(|k| axes[k] || (inside && wall.axes[k]));
            }
            axes
        };
        let zeros = || vec![0.0; columns * rows];
        let fixed = (0..columns * rows).map(fixed_axes).collect();
        let grid = Grid { rows, mass: zeros(), vx: zeros(), vy: zeros(), fx: zeros(), fy: zeros(), fixed };
        ReferenceLoop {
            lightest: 1e-24 * constants.density * spacing * spacing,
            points,
            grid,
            material: constants.clone(),
            bounds: tool.shape.bounds(),
            tool,
            cell: lattice.cell,
            corner: [lattice.corner[0], lattice.corner[1]],
            courant: lattice.courant,
            fastest: 0.0,
            volume_ratio: 1.0,
            tool_impulse: [0.0; 2],
            plastic_work: 0.0,
            yielding: 0,
            clock: 0.0,
        }
    }

    /// One substep.
    pub fn step(&mut self, motion: &ToolMotion) {
        self.tool.velocity = motion.velocity;
        self.tool.friction = motion.friction;
        let dt = self.time_step();
        self.points_to_grid();
        self.solve_momentum(dt);
        self.hold_walls();
        self.touch_tool();
        self.grid_to_points(dt);
        self.update_stress(dt);
        for axis in 0..2 {
            self.tool.position[axis] += dt * self.tool.velocity[axis];
        }
        self.clock += dt;
    }

    /// Courant number times cell over the speed of the fastest wave, seen from the grid (s).
    fn time_step(&self) -> f64 {
        let (bulk, shear) = self.moduli();
        // d(κ/2 (J² − 1))/d ln J = κ J², and the wave runs in the present density ρ₀/J.
        let stiffness = bulk * (self.volume_ratio * self.volume_ratio + 1.0) / 2.0 + 4.0 * shear / 3.0;
        let wave = (stiffness / self.material.density).sqrt();
        let tool = self.tool.velocity[0].hypot(self.tool.velocity[1]);
        self.courant * self.cell / (wave + self.fastest.max(tool))
    }

    /// StateBytes and shear modulus (Pa).
    fn moduli(&self) -> (f64, f64) {
        let (e, nu) = (self.material.youngs_modulus, self.material.poissons_ratio);
        (e / (3.0 * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)))
    }

    /// Calls `visit` with each node around point `p`: index, weight, and derivatives of the weight (1/m).
    #[inline(always)]
    fn nodes_around(&self, p: usize, mut visit: impl FnMut(usize, f64, f64, f64)) {
        let (x, y) = (self.points.x[p] / self.cell, self.points.y[p] / self.cell);
        let (i, j) = (x.round(), y.round());
        let along = |r: f64| [-1.0, 0.0, 1.0].map(|step| (weight(r - step), slope(r - step) / self.cell));
        let (in_x, in_y) = (along(x - i), along(y - j));
        let first = [i as i32 + self.corner[0] - 1, j as i32 + self.corner[1] - 1].map(|node| node as usize);
        for (k, (wx, gx)) in in_x.into_iter().enumerate() {
            for (l, (wy, gy)) in in_y.into_iter().enumerate() {
                visit((first[0] + k) * self.grid.rows + first[1] + l, wx * wy, gx * wy, wx * gy);
            }
        }
    }

    /// Mass, momentum and internal force −V₀ τ ∇N of each node (eqs. 6, 7, 11).
    fn points_to_grid(&mut self) {
        let bulk = self.moduli().0;
        let mut grid = std::mem::take(&mut self.grid);
        for column in [&mut grid.mass, &mut grid.vx, &mut grid.vy, &mut grid.fx, &mut grid.fy] {
            column.fill(0.0);
        }
        self.grid.rows = grid.rows;
        for p in 0..self.points.count() {
            let q = &self.points;
            let mass = self.material.density * q.volume[p];
            let mean = bulk / 2.0 * (q.jacobian[p].powi(2) - 1.0);
            let (xx, yy, xy) = (q.sxx[p] + mean, q.syy[p] + mean, q.sxy[p]);
            let (volume, vx, vy) = (q.volume[p], q.vx[p], q.vy[p]);
            self.nodes_around(p, |node, w, gx, gy| {
                grid.mass[node] += w * mass;
                grid.vx[node] += w * mass * vx;
                grid.vy[node] += w * mass * vy;
                grid.fx[node] -= volume * (xx * gx + xy * gy);
                grid.fy[node] -= volume * (xy * gx + yy * gy);
            });
        }
        self.grid = grid;
    }

    /// Velocity after the substep and its increment (eqs. 10, 15).
    fn solve_momentum(&mut self, dt: f64) {
        let grid = &mut self.grid;
        for node in 0..grid.mass.len() {
            let mass = grid.mass[node];
            let is_there = mass > self.lightest;
            for (v, f) in [(&mut grid.vx[node], &mut grid.fx[node]), (&mut grid.vy[node], &mut grid.fy[node])]
            {
                *f = if is_there { *f / mass * dt } else { 0.0 };
                *v = if is_there { *v / mass + *f } else { 0.0 };
            }
        }
    }

    /// Gives a node another velocity after the substep.
    fn set_velocity(&mut self, node: usize, velocity: [f64; 2]) {
        let grid = &mut self.grid;
        grid.fx[node] += velocity[0] - grid.vx[node];
        grid.fy[node] += velocity[1] - grid.vy[node];
        (grid.vx[node], grid.vy[node]) = (velocity[0], velocity[1]);
    }

    fn hold_walls(&mut self) {
        for node in 0..self.grid.fixed.len() {
            let [x, y] = self.grid.fixed[node];
            let (vx, vy) = (self.grid.vx[node], self.grid.vy[node]);
            self.set_velocity(node, [if x { 0.0 } else { vx }, if y { 0.0 } else { vy }]);
        }
    }

    /// What Coulomb friction leaves of a velocity at a surface of unit `normal`; `None` where nothing
    /// approaches it.
    fn after_contact(&self, normal: [f64; 2], velocity: [f64; 2]) -> Option<[f64; 2]> {
        let of_tool = self.tool.velocity;
        let tangent = [-normal[1], normal[0]];
        let relative = [velocity[0] - of_tool[0], velocity[1] - of_tool[1]];
        let approach = relative[0] * normal[0] + relative[1] * normal[1];
        let slip = relative[0] * tangent[0] + relative[1] * tangent[1];
        // The friction impulse is at most μ times the normal one, and stops the slip at most.
        let kept = slip.signum() * (slip.abs() + self.tool.friction * approach).max(0.0);
        (approach < 0.0).then(|| [of_tool[0] + kept * tangent[0], of_tool[1] + kept * tangent[1]])
    }

    /// The tool's normal and signed distance (m) at a position (m), where that is inside it.
    fn inside_tool(&self, position: [f64; 2]) -> Option<([f64; 2], f64)> {
        let relative = [position[0] - self.tool.position[0], position[1] - self.tool.position[1]];
        let (low, high) = self.bounds;
        if (0..2).any(|axis| relative[axis] < low[axis] || relative[axis] > high[axis]) {
            return None;
        }
        let closest = self.tool.shape.closest(relative);
        (closest.distance < 0.0).then_some((closest.normal, closest.distance))
    }

    /// Contact of the nodes strictly inside the tool, as an exchange of momentum.
    fn touch_tool(&mut self) {
        for node in 0..self.grid.mass.len() {
            let mass = self.grid.mass[node];
            if mass <= self.lightest {
                continue;
            }
            let (column, row) = ((node / self.grid.rows) as i32, (node % self.grid.rows) as i32);
            let position = [column - self.corner[0], row - self.corner[1]].map(|k| f64::from(k) * self.cell);
            let Some((normal, _)) = self.inside_tool(position) else { continue };
            let old = [self.grid.vx[node], self.grid.vy[node]];
            let Some(new) = self.after_contact(normal, old) else { continue };
            self.set_velocity(node, new);
            for axis in 0..2 {
                self.tool_impulse[axis] += mass * (new[axis] - old[axis]);
            }
        }
    }

    /// FLIP velocity, position and displacement gradient of each point (eqs. 16, 17).
    fn grid_to_points(&mut self, dt: f64) {
        self.fastest = 0.0;
        for p in 0..self.points.count() {
            let (mut v, mut dv, mut h) = ([0.0; 2], [0.0; 2], [0.0; 4]);
            let grid = &self.grid;
            self.nodes_around(p, |node, w, gx, gy| {
                let (vx, vy) = (grid.vx[node], grid.vy[node]);
                v = [v[0] + w * vx, v[1] + w * vy];
                dv = [dv[0] + w * grid.fx[node], dv[1] + w * grid.fy[node]];
                h = [h[0] + vx * gx, h[1] + vx * gy, h[2] + vy * gx, h[3] + vy * gy];
            });
            let q = &mut self.points;
            q.vx[p] += dv[0];
            q.vy[p] += dv[1];
            q.x[p] += dt * v[0];
            q.y[p] += dt * v[1];
            q.gradient[p] = h.map(|entry| dt * entry);
            self.fastest = self.fastest.max(v[0].abs()).max(v[1].abs());
        }
    }

    /// Strain and rotation of Hughes and Winget (1980), elastic trial stress, radial return.
    fn update_stress(&mut self, dt: f64) {
        let shear = self.moduli().1;
        self.volume_ratio = 0.0;
        self.yielding = 0;
        for p in 0..self.points.count() {
            let [xx, xy, yx, yy] = self.points.gradient[p];
            self.points.jacobian[p] *= (1.0 + xx) * (1.0 + yy) - xy * yx;
            self.volume_ratio = self.volume_ratio.max(self.points.jacobian[p]);
            // g = h (I + h/2)⁻¹
            let (a, b, c, d) = (1.0 + xx / 2.0, xy / 2.0, yx / 2.0, 1.0 + yy / 2.0);
            let det = a * d - b * c;
            let g = [
                (xx * d - xy * c) / det,
                (xy * a - xx * b) / det,
                (yx * d - yy * c) / det,
                (yy * a - yx * b) / det,
            ];
            let (exx, eyy, exy) = (g[0], g[3], (g[1] + g[2]) / 2.0);
            let third = (exx + eyy) / 3.0;
            // Q = (I − ω/2)⁻¹ (I + ω/2): a rotation by twice the angle whose tangent is half the spin.
            let t = (g[2] - g[1]) / 4.0;
            let (sin, cos) = (2.0 * t / (1.0 + t * t), (1.0 - t * t) / (1.0 + t * t));
            let (sxx, syy, sxy) = (self.points.sxx[p], self.points.syy[p], self.points.sxy[p]);
            let turned = [
                cos * cos * sxx - 2.0 * cos * sin * sxy + sin * sin * syy,
                sin * sin * sxx + 2.0 * cos * sin * sxy + cos * cos * syy,
                cos * sin * (sxx - syy) + (cos * cos - sin * sin) * sxy,
            ];
            let mut s = [
                turned[0] + 2.0 * shear * (exx - third),
                turned[1] + 2.0 * shear * (eyy - third),
                turned[2] + 2.0 * shear * exy,
            ];
            let trial = equivalent(s);
            if trial > self.points.strength[p] {
                self.yielding += 1;
                let factor = self.return_to_yield(p, equivalent(turned), trial, dt);
                s = s.map(|component| component * factor);
            }
            (self.points.sxx[p], self.points.syy[p], self.points.sxy[p]) = (s[0], s[1], s[2]);
        }
    }

    /// Solves q − 3μ x = σ_y(ε̄ + x, x/Δt, T(x)) (eqs. 24, 25) and returns the factor on the deviator.
    fn return_to_yield(&mut self, p: usize, start: f64, trial: f64, dt: f64) -> f64 {
        let c = &self.material;
        let three_mu = 3.0 * self.moduli().1;
        let per_work = c.taylor_quinney / (c.density * c.specific_heat);
        let range = c.melting_temperature - c.reference_temperature;
        let (old_strain, temperature) = (self.points.plastic_strain[p], self.points.temperature[p]);
        // Flow stress, flow stress at rest, and slope of the flow stress after an increment x.
        let flow_stress = |x: f64| {
            let strain = old_strain + x;
            let power = c.hardening_modulus * strain.powf(c.hardening_exponent);
            let relative = x / (dt * c.reference_rate);
            let is_fast = relative > 1.0;
            let rate = if is_fast { 1.0 + c.rate_coefficient * relative.ln() } else { 1.0 };
            let rate_slope = if is_fast { c.rate_coefficient / x } else { 0.0 };
            let rise = per_work * (trial - three_mu * x) * x;
            let homologous = ((temperature + rise - c.reference_temperature) / range).clamp(0.0, 1.0);
            let softening = 1.0 - homologous.powf(c.thermal_exponent);
            let at_rest = (c.yield_stress + power) * softening;
            // Newton's slope may leave out the heat: the bracket has the last word.
            let slope = c.hardening_exponent * power / strain * softening * rate + at_rest * rate_slope;
            (at_rest * rate, at_rest, slope)
        };
        let (mut low, mut high) = (0.0, trial / three_mu);
        let mut x = (trial - self.points.strength[p]) / three_mu;
        let (mut flow, mut at_rest) = (trial, self.points.strength[p]);
        for _ in 0..200 {
            let slope;
            (flow, at_rest, slope) = flow_stress(x);
            let residual = trial - three_mu * x - flow;
            if residual.abs() <= 1e-13 * trial || high - low <= f64::EPSILON * high {
                break;
            }
            (low, high) = if residual > 0.0 { (x, high) } else { (low, x) };
            let newton = x + residual / (three_mu + slope);
            x = if low < newton && newton < high { newton } else { (low + high) / 2.0 };
        }
        // Work by the trapezoidal rule; a point that was elastic crossed the flow stress at rest.
        let work = (start.max(self.points.strength[p]) + flow) / 2.0 * x;
        self.points.plastic_strain[p] += x;
        self.points.strength[p] = at_rest;
        self.points.temperature[p] += per_work * work;
        self.plastic_work += self.points.volume[p] * work;
        flow / trial
    }
}

/// √(3/2 s:s) of a deviator xx, yy, xy (Pa).
fn equivalent([xx, yy, xy]: [f64; 3]) -> f64 {
    let zz = -xx - yy;
    (1.5 * (xx * xx + yy * yy + zz * zz + 2.0 * xy * xy)).sqrt()
}
