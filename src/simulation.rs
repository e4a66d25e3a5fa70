//! The main loop: one explicit substep of the material point method on the solver's own clock.

use crate::body_force::BodyForce;
use crate::chunk::{Chunk, ChunkSums, NodeSums, Substep, TouchedNodes};
use crate::contact::{ContactLaw, RigidTool};
use crate::dimension::Dimension;
use crate::error::Error;
use crate::inertia::MassScaling;
use crate::ledger::Ledger;
use crate::locking::{self, LockingControl};
use crate::material::{ConstitutiveModel, PointReport};
use crate::partition::{Bulk, Partition};
use crate::shape::ShapeFunction;
use crate::simd::{InstructionSet, Real};
use crate::touching::{self, Conditions};
use crate::transfer::{NodeRun, TRAVEL_LIMIT};
use crate::window::{ActiveWindow, Edges};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Points are sorted again before any can have moved further than this along an axis (cells); together with one
/// substep's `TRAVEL_LIMIT` it stays within the cell of margin that the grid keeps for motion.
const SORT_TRAVEL: f64 = 0.5;

/// Speed over that of sound beyond which a point is lost to an instability (-).
const FASTEST: f64 = 5.0;

/// What the clock, the tool and the time step need to go on, and the running totals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// The solver's clock: time at the end of the last substep (s).
    pub clock: f64,
    /// Length of the last substep (s).
    pub last_step: f64,
    /// Substeps since the start.
    pub substeps: u64,
    /// Position of the tool's lowest point (m).
    pub tool_position: [f64; 2],
    /// Speed of the fastest point in the last substep (m/s).
    pub fastest: f64,
    /// Largest volume ratio in the last substep (-).
    pub volume_ratio: f64,
    /// Motion since the points were sorted (cells).
    pub travel: f64,
    /// Motion since the locking control last looked at the points (cells).
    pub travel_uncontrolled: f64,
    /// Distance the tool has moved while it touched the workpiece (m).
    pub cut_length: f64,
    /// Furthest contact along the rake face in the last substep (m).
    pub contact_reach: f64,
    /// Whether the tool touched the workpiece in the last substep, and ever.
    pub touches: [bool; 2],
    /// Where the active window stands, if there is one.
    pub window: Option<Edges>,
    /// Factor on the mass (-).
    pub mass_factor: f64,
    /// Running totals.
    pub ledger: Ledger,
}

/// The tool's motion and friction over the next substep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Velocity of the tool (m/s).
    pub velocity: [f64; 2],
    /// Coulomb coefficient (-).
    pub friction: f64,
}

/// One point as outputs and files see it.
#[derive(Clone, Copy, Debug)]
pub struct PointView {
    /// The point's number at the start.
    pub id: u32,
    /// Position from the workpiece's lower left corner (m).
    pub position: [f64; 3],
    /// Velocity (m/s).
    pub velocity: [f64; 3],
    /// Volume at the start (m3).
    pub volume: f64,
    /// Mass (kg).
    pub mass: f64,
    /// Its material.
    pub report: PointReport,
}

/// A simulation whose effects, dimension and precision are chosen.
pub trait Solver: Send {
    /// Clock, tool and totals.
    fn progress(&self) -> &Progress;

    /// The tool.
    fn tool(&self) -> &RigidTool;

    /// One substep; `parallel` spreads it over the threads of the current pool without changing its result.
    ///
    /// # Errors
    /// `Error::Unstable` when a point moved too far or a value is not finite.
    fn step(&mut self, drive: &Drive, parallel: bool) -> Result<(), Error>;

    /// Length of the substep that `step` would take with this drive (s).
    fn time_step(&self, drive: &Drive) -> f64;

    /// Shows every point to `visit`.
    fn visit_points(&self, visit: &mut dyn FnMut(&PointView));

    /// Number of points that substeps move.
    fn points(&self) -> usize;

    /// Lets the mass follow the tool's speed (m/s) before a substep, where the scene scales it.
    fn scale_mass(&mut self, speed: f64);

    /// The points and deposits as numbers.
    fn bulk(&self) -> Bulk;

    /// Takes the state that `bulk` and `progress` gave.
    ///
    /// # Errors
    /// `Error::DamagedState` when it does not fit; the solver is then spoiled.
    fn restore(&mut self, bulk: &Bulk, progress: &Progress) -> Result<(), Error>;

    /// A second, independent solver in the same state.
    fn fork(&self) -> Box<dyn Solver>;
}

/// Numbers and optional passes of a simulation.
#[derive(Clone, Debug)]
pub struct Options {
    /// Courant number (-).
    pub courant: f64,
    /// Instruction set of the kernels.
    pub instructions: InstructionSet,
    /// Whether deviations of volume ratios are limited (`locking`).
    pub locking_control: bool,
    /// Mass scaling, if the scene names it.
    pub mass_scaling: Option<MassScaling>,
    /// Active window, if the scene names it.
    pub window: Option<ActiveWindow>,
}

/// The simulation of one scene, monomorphised for what the scene names.
#[derive(Clone)]
pub struct Simulation<R: Real, D: Dimension, F, M: ConstitutiveModel<R, D>, C> {
    /// Points, grid and deposits.
    pub partition: Partition<R, D, M::State>,
    /// Shape function.
    pub shape: F,
    /// Constitutive model.
    pub model: M,
    /// Contact law.
    pub contact: C,
    /// The tool.
    pub tool: RigidTool,
    /// Whether the points themselves touch the tool (`touching`), in the place of the contact law; not to begin with.
    pub points_touch: bool,
    /// What they changed in this substep.
    touched: Option<TouchedNodes>,
    /// Gravity or another body force; none to begin with.
    pub body_force: Option<Arc<dyn BodyForce>>,
    /// Numbers and passes.
    pub options: Options,
    /// Volumetric locking control, if the scene names it.
    pub locking_control: Option<LockingControl>,
    /// Nodes lighter than this (kg) stay at rest.
    pub lightest: f64,
    /// Clock, tool and totals.
    pub progress: Progress,
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>, C: ContactLaw>
    Simulation<R, D, F, M, C>
{
    /// A simulation of sorted points at rest or in motion; deposits them for the first substep.
    pub fn new(
        partition: Partition<R, D, M::State>,
        (shape, model, contact): (F, M, C),
        tool: RigidTool,
        options: Options,
    ) -> Self {
        let density = model.density();
        let lightest = partition
            .points()
            .map(|(block, lane)| block.volume[lane].to_f64() * density)
            .fold(f64::MAX, f64::min);
        let progress = Progress {
            clock: 0.0,
            last_step: 0.0,
            substeps: 0,
            tool_position: tool.position,
            fastest: 0.0,
            volume_ratio: 1.0,
            travel: 0.0,
            travel_uncontrolled: 0.0,
            cut_length: 0.0,
            contact_reach: 0.0,
            touches: [false; 2],
            window: None,
            mass_factor: 1.0,
            ledger: Ledger::default(),
        };
        // Weight falls with the square of a point's reach into a node's cell and force only with the reach: a node left
        // out at the square of the rounding error of a point's mass takes a rounding error of its force out of the balance.
        let lightest = lightest * if R::IS_SINGLE { 1e-14 } else { 1e-24 };
        let locking_control = options.locking_control.then(LockingControl::default);
        let mut simulation = Simulation {
            partition,
            shape,
            model,
            contact,
            tool,
            points_touch: false,
            touched: None,
            body_force: None,
            options,
            locking_control,
            lightest,
            progress,
        };
        let (mut start, mut fastest) = (0.0, 0.0_f64);
        simulation.visit_points(&mut |point| {
            let square: f64 = point.velocity.iter().map(|v| v * v).sum();
            start += 0.5 * point.mass * square + point.volume * point.report.elastic_energy;
            fastest = fastest.max(square.sqrt());
        });
        simulation.progress.ledger.initial_energy = start;
        simulation.progress.fastest = fastest;
        // Sorting divides the points by the window and deposits them.
        if simulation.options.window.is_some() {
            simulation.sort()
        } else {
            simulation.deposit()
        }
        simulation
    }

    /// Deposits all points without moving them.
    fn deposit(&mut self) {
        self.for_each_chunk(0.0, false, |chunk, _, outgoing, common| chunk.deposit(outgoing, common));
        self.partition.exchange_deposits();
    }

    /// Runs `work` on each chunk with what all share in a substep of `dt` (s).
    fn for_each_chunk(
        &mut self,
        dt: f64,
        parallel: bool,
        work: impl Fn(&mut Chunk<R, D, M::State>, &[NodeRun<R>], &mut NodeRun<R>, &Substep<'_, F, M, C>) + Sync,
    ) {
        let mut tool_after = self.tool.clone();
        tool_after.advance(dt);
        let touched = std::mem::take(&mut self.touched);
        let Partition { layout, chunks, incoming, outgoing, .. } = &mut self.partition;
        let common = Substep {
            layout,
            shape: &self.shape,
            model: &self.model,
            contact: &self.contact,
            tool: &self.tool,
            tool_after: Some(&tool_after),
            lightest: self.lightest,
            touched: touched.as_ref(),
            body_force: self.body_force.as_deref(),
            time: self.progress.clock,
            dt,
            instructions: self.options.instructions,
        };
        if parallel {
            let pairs = chunks.par_iter_mut().zip(outgoing.par_iter_mut()).with_max_len(1);
            pairs.for_each(|(chunk, outgoing)| work(chunk, incoming, outgoing, &common));
        } else {
            chunks
                .iter_mut()
                .zip(outgoing)
                .for_each(|(chunk, outgoing)| work(chunk, incoming, outgoing, &common));
        }
        self.touched = touched;
    }

    /// Solves the contact with the points for a substep of `dt` (s).
    fn touch_points(&mut self, dt: f64) {
        let conditions = Conditions {
            tool: &self.tool,
            body_force: self.body_force.as_deref(),
            lightest: self.lightest,
            time: [self.progress.clock, dt],
        };
        self.touched = Some(touching::solve(&self.partition, &self.shape, &conditions));
    }

    /// Adds the chunks' sums to the totals, in the order of the chunks.
    fn collect(&mut self, dt: f64) -> Result<(), Error> {
        let mut nodes = NodeSums::default();
        let (mut travel, mut volume_ratio) = (0.0_f64, 0.0_f64);
        if let Some(changes) = &self.touched {
            nodes = changes.sums;
            self.progress.ledger.add(&ChunkSums { nodes, ..ChunkSums::default() });
        }
        for chunk in &self.partition.chunks {
            let sums: &ChunkSums = &chunk.sums;
            self.progress.ledger.add(sums);
            nodes.touches |= sums.nodes.touches;
            nodes.contact_reach = nodes.contact_reach.max(sums.nodes.contact_reach);
            travel = travel.max(sums.points.travel);
            volume_ratio = volume_ratio.max(sums.points.volume_ratio);
        }
        let ledger = &self.progress.ledger;
        let finite = (ledger.tool_work + ledger.plastic_work + ledger.damping + volume_ratio).is_finite();
        if travel > TRAVEL_LIMIT || !finite {
            return Err(Error::Unstable(format!(
                "the run became unstable at t = {:.6e} s: a point moved {travel:.3} cells in one substep of {dt:.3e} s \
                 (at most {TRAVEL_LIMIT} is allowed); lower numerics.courant (now {}) or tool_velocity",
                self.progress.clock, self.options.courant
            )));
        }
        let fastest = travel * self.partition.layout.cell / dt;
        let sound = self.model.sound_speed(volume_ratio);
        if fastest > FASTEST * sound {
            // Substeps would shrink with its speed and never come to an end.
            return Err(Error::Unstable(format!(
                "the run became unstable at t = {:.6e} s: a point flies at {fastest:.3e} m/s, more than {FASTEST} times \
                 the speed of sound ({sound:.3e} m/s)",
                self.progress.clock
            )));
        }
        let progress = &mut self.progress;
        progress.contact_reach = nodes.contact_reach;
        progress.touches = [nodes.touches, nodes.touches || progress.touches[1]];
        if nodes.touches {
            let [x, y] = self.tool.velocity;
            progress.cut_length += dt * x.hypot(y);
        }
        progress.fastest = fastest;
        progress.volume_ratio = volume_ratio;
        progress.travel += travel;
        progress.travel_uncontrolled += travel;
        Ok(())
    }

    /// Sorts the points before any leaves the nodes of its chunk, and deposits them there anew.
    fn sort(&mut self) {
        let (model, ledger) = (&self.model, &mut self.progress.ledger);
        let density = model.density();
        let true_density = density / self.progress.mass_factor;
        if let Some(window) = &self.options.window {
            let edges = window.edges(&self.tool, &self.partition.layout);
            window.freeze_and_thaw(&mut self.partition, &edges);
            self.progress.window = Some(edges);
        }
        self.partition.sort(|block, lane| {
            let volume = block.volume[lane].to_f64();
            let square: f64 = (0..D::AXES).map(|axis| block.velocity[axis][lane].to_f64().powi(2)).sum();
            let report = model.report(&block.state, lane);
            ledger.retired_points += 1;
            ledger.retired_mass += true_density * volume;
            ledger.retired_energy += volume * (0.5 * density * square + report.elastic_energy);
            ledger.retired_heat += volume * report.heat;
        });
        self.progress.travel = 0.0;
        self.deposit();
    }

    /// Looks after volumetric locking each time the points have moved by the control's interval.
    fn control_locking(&mut self) {
        if let Some(control) = &mut self.locking_control
            && self.progress.travel_uncontrolled > locking::INTERVAL
        {
            self.progress.travel_uncontrolled = 0.0;
            self.progress.ledger.damping +=
                control.limit_deviations(&mut self.partition, &self.shape, &self.model);
        }
    }
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>, C: ContactLaw> Solver
    for Simulation<R, D, F, M, C>
{
    fn step(&mut self, drive: &Drive, parallel: bool) -> Result<(), Error> {
        let dt = self.time_step(drive);
        self.tool.velocity = drive.velocity;
        self.tool.friction = drive.friction;
        if self.points_touch {
            self.touch_points(dt);
        }
        self.for_each_chunk(dt, parallel, |chunk, incoming, outgoing, common| {
            chunk.substep(incoming, outgoing, common);
        });
        self.partition.exchange_deposits();
        self.collect(dt)?;
        self.tool.advance(dt);
        self.progress.tool_position = self.tool.position;
        self.progress.clock += dt;
        self.progress.last_step = dt;
        self.progress.substeps += 1;
        if self.progress.travel > SORT_TRAVEL {
            self.sort();
        }
        self.control_locking();
        Ok(())
    }

    /// Courant number times cell over wave speed plus speed of points and tool.
    fn time_step(&self, drive: &Drive) -> f64 {
        let [x, y] = drive.velocity;
        let speed =
            self.model.sound_speed(self.progress.volume_ratio) + self.progress.fastest.max(x.hypot(y));
        self.options.courant * self.partition.layout.cell / speed
    }

    fn progress(&self) -> &Progress {
        &self.progress
    }

    fn tool(&self) -> &RigidTool {
        &self.tool
    }

    fn points(&self) -> usize {
        self.partition.points().count()
    }

    fn scale_mass(&mut self, speed: f64) {
        let Some(scaling) = &mut self.options.mass_scaling else { return };
        if !scaling.follow(speed) {
            return;
        }
        let (density, factor) = (scaling.density(), scaling.factor());
        let ratio = factor / self.progress.mass_factor;
        let mut kinetic = 0.0;
        self.visit_points(&mut |point| {
            kinetic += 0.5 * point.mass * point.velocity.iter().map(|v| v * v).sum::<f64>();
        });
        self.progress.ledger.mass_scaling += (ratio - 1.0) * kinetic;
        self.progress.mass_factor = factor;
        self.model.set_density(factor * density);
        self.lightest *= ratio;
        // Deposits hold masses.
        self.sort();
    }

    fn visit_points(&self, visit: &mut dyn FnMut(&PointView)) {
        let layout = &self.partition.layout;
        let density = self.model.density();
        for (block, lane) in self.partition.all_points() {
            let cells = block.grid_position(lane);
            let mut view = PointView {
                id: block.id[lane],
                position: [0.0; 3],
                velocity: [0.0; 3],
                volume: block.volume[lane].to_f64(),
                mass: density * block.volume[lane].to_f64(),
                report: self.model.report(&block.state, lane),
            };
            for axis in 0..D::AXES {
                view.position[axis] = layout.origin[axis] + layout.cell * cells[axis];
                view.velocity[axis] = block.velocity[axis][lane].to_f64();
            }
            visit(&view);
        }
    }

    fn bulk(&self) -> Bulk {
        self.partition.bulk()
    }

    fn restore(&mut self, bulk: &Bulk, progress: &Progress) -> Result<(), Error> {
        if let (Some(window), Some(edges)) = (&self.options.window, &progress.window) {
            window.hold(&mut self.partition, edges);
        }
        self.partition.restore(bulk)?;
        self.lightest *= progress.mass_factor / self.progress.mass_factor;
        if let Some(scaling) = &mut self.options.mass_scaling {
            scaling.restore(progress.mass_factor);
            self.model.set_density(scaling.density() * progress.mass_factor);
        }
        self.progress = progress.clone();
        self.tool.position = progress.tool_position;
        Ok(())
    }

    fn fork(&self) -> Box<dyn Solver> {
        Box::new(self.clone())
    }
}
