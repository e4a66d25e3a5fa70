//! The main loop: one explicit substep of the material point method on the solver's own clock.
//!
//! * this file: `Simulation` and `step`, the loop on one screen; `contacts` and `heating`: its parts about
//!   the tool and heat; `waiting`: substeps in which nothing can happen;
//! * `solver`: the simulation as the rest of the program sees it, whatever its kernel; `options`: numbers and
//!   optional passes.
//!
//! What may be touched: a pass is called in `step` and keeps what it needs between substeps in `Progress`,
//! which is saved; nothing here knows a scene, a file or the FMI.

pub(crate) mod solver;

mod contacts;
mod heating;
mod options;
mod waiting;

pub use options::Options;

use crate::checkpoint::StateBytes;
use crate::chip_separation::Rows;
use crate::contact::BoxedLaw;
use crate::dimension::Dimension;
use crate::energy::ledger::Ledger;
use crate::energy::watch::{self, Watch};
use crate::error::Error;
use crate::grid::body_force::BodyForce;
use crate::grid::shape_function::ShapeFunction;
use crate::heat::tool::ToolBody;
use crate::heat::{HeatConduction, HeatTotals};
use crate::material::ConstitutiveModel;
use crate::parallel::take_turns;
use crate::partition::chunk::{Chunk, PointsStep};
use crate::partition::nodes::{ChunkNodes, ContactAreas, StepContext};
use crate::partition::step_bounds::{self, Bounds, MOST_RETRIES, StepMotion};
use crate::partition::{MOST_CHUNKS, Partition};
use crate::points::{BLOCK, Block, PointState};
use crate::simd::Real;
pub use crate::simulation::solver::{PointView, Progress, Solver, ToolMotion, Touches};
use crate::speedups::rigid_chip::{FaceContact, TailMotion};
use crate::stabilization::null_space_filter::{self, NullSpaceFilter};
use crate::stabilization::volumetric_locking::{self, LockingControl};
use crate::tool::RigidTool;
use crate::transfer::{NodeRun, PassSums};
use std::cmp::Reverse;
use std::sync::Arc;

/// Points are sorted again before any can have moved further than this along an axis (cells); together with
/// one substep's `transfer::TRAVEL_LIMIT` it stays within the cell of margin that the grid keeps for motion.
const SORT_TRAVEL: f64 = 0.5;

/// Way in contact (cells) in which the tool has only just touched.
const FIRST_TOUCH: f64 = 0.5;

/// The simulation of one scene, monomorphised for what the scene names.
#[derive(Clone)]
pub struct Simulation<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>> {
    /// Points, grid and deposits.
    pub partition: Partition<R, D, M::State>,
    /// Shape function.
    pub shape: F,
    /// Constitutive model.
    pub model: M,
    /// The tool.
    pub tool: RigidTool,
    /// How workpiece and tool act on each other.
    pub contact: BoxedLaw<R, D, F, M::State>,
    /// Whether contact gives its friction heat by node (`NodalImpulses::friction_heat`); not to begin with.
    pub wants_friction_heat: bool,
    /// Gravity or another body force; none to begin with.
    pub body_force: Option<Arc<dyn BodyForce>>,
    /// Numbers and passes.
    pub options: Options,
    /// Brings back velocities that the grid cannot see.
    pub null_space_filter: NullSpaceFilter,
    /// Volumetric locking control, if the scene names it.
    pub locking_control: Option<LockingControl>,
    /// Heat conduction, if the scene names it; none to begin with.
    conduction: Option<HeatConduction>,
    /// The tool as a conducting body, if the scene names it; none to begin with.
    tool_body: Option<ToolBody>,
    /// What is known of a body that nothing has touched.
    waiting: waiting::Waiting,
    /// Nodes lighter than this (kg) stay at rest.
    pub lightest: f64,
    /// Points near the edge's path, while they get their sides.
    rows: Rows,
    /// Clock, tool and totals.
    pub progress: Progress,
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>> Simulation<R, D, F, M> {
    /// Mass of a node that is left out, over that of the lightest point (-).
    ///
    /// Weight falls with the square of a point's reach into a node's cell and force only with the reach: a
    /// node left out at the square of the rounding error of a point's mass takes a rounding error of its
    /// force out of the balance.
    const NEGLIGIBLE: f64 = if R::IS_SINGLE { 1e-14 } else { 1e-24 };

    /// A simulation of sorted points at rest or in motion; deposits them for the first substep.
    pub fn new(
        partition: Partition<R, D, M::State>,
        (shape, model): (F, M),
        tool: RigidTool,
        contact: BoxedLaw<R, D, F, M::State>,
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
            retries: 0,
            tool_position: tool.position,
            fastest: 0.0,
            volume_ratio: 1.0,
            travel: 0.0,
            travel_unseen: 0.0,
            travel_uncontrolled: 0.0,
            null_space_velocities: 0,
            cut_length: 0.0,
            contact_reach: 0.0,
            contact_areas: ContactAreas::default(),
            touches: Touches::default(),
            distance_since_contact: 0.0,
            window: None,
            tail: TailMotion::at_rest(0.0),
            mass_factor: 1.0,
            ledger: Ledger::default(),
            heat: HeatTotals::default(),
        };
        let lightest = lightest * Self::NEGLIGIBLE;
        let locking_control = options.locking_control.then(LockingControl::default);
        let mut simulation = Simulation {
            partition,
            shape,
            model,
            tool,
            contact,
            wants_friction_heat: false,
            body_force: None,
            options,
            null_space_filter: NullSpaceFilter::default(),
            locking_control,
            conduction: None,
            tool_body: None,
            waiting: waiting::Waiting::default(),
            lightest,
            rows: Rows::default(),
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
        if let Some(separation) = &simulation.options.separation {
            simulation.partition.follow_edge(separation.edge(&simulation.tool));
        }
        if simulation.options.window.is_some() || simulation.options.separation.is_some() {
            simulation.sort(false)
        } else {
            simulation.deposit(false)
        }
        simulation
    }

    /// Lets heat flow, and contact tell where friction heats.
    pub fn set_conduction(&mut self, conduction: HeatConduction) {
        self.conduction = Some(conduction);
        self.wants_friction_heat = true;
    }

    /// Lets the tool conduct heat, too.
    pub fn set_tool_body(&mut self, body: ToolBody) {
        self.progress.heat.tool = vec![0.0; body.cells()];
        self.tool_body = Some(body);
    }

    /// Deposits all points without moving them.
    fn deposit(&mut self, parallel: bool) {
        self.for_each_chunk(0.0, parallel, |chunk, nodes, outgoing, common| {
            chunk.deposit(nodes, outgoing, common)
        });
        self.partition.exchange_deposits();
    }

    /// What points, nodes and contact share in a substep of `dt` (s).
    fn step_context(&self, dt: f64) -> StepContext {
        StepContext {
            time: self.progress.clock,
            dt,
            lightest: self.lightest,
            share_per_mass: self.shape.steepness() / self.lightest_point(),
            body_force: self.body_force.clone(),
            drift: std::array::from_fn(|axis| match &self.options.separation {
                Some(_) if axis < 2 => dt * self.tool.velocity[axis] / self.partition.layout.cell,
                _ => 0.0,
            }),
            is_affine: M::State::IS_AFFINE,
            instructions: self.options.instructions,
        }
    }

    /// Runs `work` on each chunk, its nodes and its deposits with what all share in a substep of `dt` (s).
    fn for_each_chunk(
        &mut self,
        dt: f64,
        parallel: bool,
        work: impl Fn(&mut Chunk<R, D, M::State>, &mut ChunkNodes<R>, &mut NodeRun<R>, &PointsStep<'_, F, M>)
        + Sync,
    ) {
        let step = self.step_context(dt);
        let Partition { layout, chunks, nodes, outgoing, .. } = &mut self.partition;
        let common = PointsStep { layout, shape: &self.shape, model: &self.model, step: &step };
        let triples =
            chunks.iter_mut().zip(nodes).zip(outgoing).map(|((chunk, nodes), out)| (chunk, nodes, out));
        if parallel {
            let mut sorted = [const { None }; MOST_CHUNKS];
            sorted.iter_mut().zip(triples).for_each(|(place, triple)| *place = Some(triple));
            // The longest first; the order changes no result.
            sorted.sort_unstable_by_key(|triple| Reverse(triple.as_ref().map(|(chunk, ..)| chunk.cost)));
            take_turns(sorted.into_iter().flatten(), |(chunk, nodes, out)| work(chunk, nodes, out, &common));
        } else {
            triples.for_each(|(chunk, nodes, out)| work(chunk, nodes, out, &common));
        }
    }

    /// Mass of the lightest point (kg).
    fn lightest_point(&self) -> f64 {
        self.lightest / Self::NEGLIGIBLE
    }

    /// Contact and momentum equation on the nodes for a substep of `dt` (s), or of as many halves of it as
    /// keep the points' motion within bounds; gives the length kept.
    fn update_grid(&mut self, mut dt: f64, parallel: bool) -> Result<f64, Error> {
        for retry in 0.. {
            self.move_nodes(dt, parallel);
            let mut bounds =
                self.partition.nodes.iter().fold(Bounds::default(), |most, nodes| most.max(nodes.bounds));
            if self.options.separation.is_some() {
                // Points move against a grid that moves itself.
                let [x, y] = self.tool.velocity;
                bounds.travel += dt * x.hypot(y) / self.partition.layout.cell;
            }
            if bounds.hold() {
                break;
            }
            if retry == MOST_RETRIES {
                return Err(bounds.given_up(self.progress.clock, dt));
            }
            dt *= 0.5;
            self.progress.retries += 1;
        }
        Ok(dt)
    }

    /// Looks at the energy of all points now and then, and where there is reason to.
    fn watch_energy(&self, is_suspicious: bool) -> Result<(), Error> {
        // The ledger does not know the work of a body force.
        if !(is_suspicious || watch::is_due(self.progress.substeps)) || self.body_force.is_some() {
            return Ok(());
        }
        let mut watch = Watch::default();
        self.visit_points(&mut |point| {
            let square: f64 = point.velocity.iter().map(|v| v * v).sum();
            watch.count(0.5 * point.mass * square, point.volume, &point.report);
        });
        let touched = self.progress.cut_length;
        let starts = touched > 0.0 && touched < FIRST_TOUCH * self.partition.layout.cell;
        watch.judge(self.progress.clock, &self.progress.ledger, starts)
    }

    /// Adds the chunks' sums to the totals, in the order of the chunks.
    fn accumulate_sums(&mut self, dt: f64) -> Result<(), Error> {
        let contact = self.touched().sums;
        let (mut travel, mut volume_ratio) = (0.0_f64, 0.0_f64);
        let friction_before = self.progress.ledger.friction_work;
        let (touches, contact_reach) = (contact.touches, contact.contact_reach);
        self.progress.ledger.add(&contact, &PassSums::default());
        let Partition { chunks, nodes, .. } = &self.partition;
        for (Chunk { sums: points, .. }, ChunkNodes { sums: nodes, .. }) in chunks.iter().zip(nodes) {
            self.progress.ledger.add(nodes, points);
            travel = travel.max(points.travel);
            volume_ratio = volume_ratio.max(points.volume_ratio);
        }
        self.note_friction_heat(friction_before);
        let ledger = &self.progress.ledger;
        let finite = ledger.is_finite() && volume_ratio.is_finite();
        let cell = self.partition.layout.cell;
        let sound = self.model.sound_speed(volume_ratio);
        let motion = StepMotion { clock: self.progress.clock, dt, travel, cell };
        step_bounds::check_motion(&motion, sound, finite)?;
        let progress = &mut self.progress;
        progress.contact_reach = contact_reach;
        progress.contact_areas.all += dt * contact.contact_areas.all;
        progress.contact_areas.sticking += dt * contact.contact_areas.sticking;
        progress.touches = Touches { now: touches, ever: touches || progress.touches.ever };
        let [x, y] = self.tool.velocity;
        let distance = dt * x.hypot(y);
        if touches {
            progress.cut_length += distance;
            progress.distance_since_contact = 0.0;
        } else {
            progress.distance_since_contact += distance;
        }
        progress.fastest = travel * cell / dt;
        progress.volume_ratio = volume_ratio;
        progress.travel += travel;
        self.contact.note_motion(std::f64::consts::SQRT_2 * travel + distance / cell);
        progress.travel_unseen += travel;
        progress.travel_uncontrolled += travel;
        Ok(())
    }

    /// Sorts the points before any leaves the nodes of its chunk, and deposits them there anew.
    fn sort(&mut self, parallel: bool) {
        // Nodes get other places.
        self.deposit_friction_heat();
        let (model, ledger) = (&self.model, &mut self.progress.ledger);
        let density = model.density();
        let true_density = density / self.progress.mass_factor;
        let mut retire = |block: &Block<R, D, M::State>, lane: usize| {
            let volume = block.volume[lane].to_f64();
            let square: f64 = (0..D::AXES).map(|axis| block.velocity[axis][lane].to_f64().powi(2)).sum();
            let report = model.report(&block.state, lane);
            ledger.retired_points += 1;
            ledger.retired_mass += true_density * volume;
            ledger.retired_energy += volume * (0.5 * density * square + report.elastic_energy);
            ledger.retired_heat += volume * report.heat;
        };
        if let Some(separation) = &self.options.separation {
            self.partition.recount_nodes();
            let lost = separation.part(&mut self.partition, &self.tool, model, &mut self.rows);
            ledger.damping += lost;
        }
        if let Some(window) = &self.options.window {
            let edges = window.edges(&self.tool, &self.partition.layout);
            window.freeze_and_thaw(&mut self.partition, &edges);
            self.progress.window = Some(edges);
        }
        if let Some(chip_tail) = &self.options.chip_tail {
            let contact = FaceContact { lowest: self.tool.position[1], reach: self.progress.contact_reach };
            let now = self.progress.clock;
            self.progress.tail =
                chip_tail.follow(&mut self.partition, contact, self.progress.tail, now, &mut retire);
        }
        self.partition.sort(retire, parallel);
        self.progress.travel = 0.0;
        self.contact.note_sort();
        self.null_space_filter.make_room(self.partition.layout.nodes());
        self.deposit(parallel);
    }

    /// By how much (m/s) a point's velocity may differ from its nodes' at the end of this substep, if it is
    /// time to look: each time the points have moved by the interval of `stabilization::null_space_filter`.
    /// With scaled mass it is the bound of the true density: σ_y/(ρ c) goes with the inverse root of ρ.
    fn outlier_bound(&mut self) -> Option<f64> {
        if self.progress.travel_unseen <= null_space_filter::INTERVAL {
            return None;
        }
        self.progress.travel_unseen = 0.0;
        Some(self.model.yield_speed() * self.progress.mass_factor.sqrt()).filter(|bound| bound.is_finite())
    }

    /// Brings velocities back that the grid cannot see; returns whether there are so many that the run may
    /// have gone wrong.
    fn filter_null_space(&mut self, parallel: bool) -> bool {
        let density = self.model.density();
        let (count, taken) =
            self.null_space_filter.restore_outliers(&mut self.partition, &self.shape, density, parallel);
        self.progress.null_space_velocities += count;
        self.progress.ledger.damping += taken;
        count > 0 && count as f64 > null_space_filter::SUSPICIOUS * self.points() as f64
    }

    /// Looks after volumetric locking each time the points have moved by the control's interval.
    fn control_locking(&mut self, parallel: bool) {
        if let Some(control) = &mut self.locking_control
            && self.progress.travel_uncontrolled > volumetric_locking::INTERVAL
        {
            self.progress.travel_uncontrolled = 0.0;
            self.progress.ledger.damping +=
                control.limit_deviations(&mut self.partition, &self.shape, &self.model, parallel);
        }
    }
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>> Solver
    for Simulation<R, D, F, M>
{
    fn step(&mut self, motion: &ToolMotion, parallel: bool) -> Result<(), Error> {
        self.tool.velocity = motion.velocity;
        self.tool.friction = motion.friction;
        let dt = self.update_grid(self.time_step(motion), parallel)?;
        let bound = self.outlier_bound();
        self.for_each_chunk(dt, parallel, |chunk, nodes, outgoing, common| {
            chunk.update_particles(nodes, outgoing, common, bound)
        });
        self.partition.exchange_deposits();
        self.accumulate_sums(dt)?;
        self.tool.advance(dt);
        if let Some(separation) = &self.options.separation {
            self.partition.move_grid(separation.edge(&self.tool));
        }
        self.progress.tool_position = self.tool.position;
        self.progress.clock += dt;
        self.progress.last_step = dt;
        self.progress.substeps += 1;
        let is_suspicious = self.filter_null_space(parallel);
        if self.progress.travel > SORT_TRAVEL {
            self.sort(parallel);
        }
        self.control_locking(parallel);
        self.conduct_heat(parallel);
        self.note_harmless_tool();
        self.watch_energy(is_suspicious)
    }

    fn pass(&mut self, motion: &ToolMotion) -> bool {
        self.pass_substep(motion)
    }

    /// Courant number times cell over wave speed plus speed of points and tool.
    fn time_step(&self, motion: &ToolMotion) -> f64 {
        let [x, y] = motion.velocity;
        let fastest = self.progress.fastest.max(x.hypot(y));
        let speed = self.model.signal_speed(self.progress.volume_ratio, fastest) + fastest;
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

    fn bytes_per_point(&self) -> usize {
        size_of::<Block<R, D, M::State>>() / BLOCK
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
        self.sort(false);
    }

    fn visit_points(&self, visit: &mut dyn FnMut(&PointView)) {
        let (layout, density) = (&self.partition.layout, self.model.density());
        let view = |(block, lane): (&Block<R, D, M::State>, usize), origin: &[f64; 3]| {
            PointView::new(block, lane, (layout, origin, density), self.model.report(&block.state, lane))
        };
        self.partition.points().for_each(|point| visit(&view(point, &layout.origin)));
        self.partition.frozen_points().for_each(|point| visit(&view(point, &layout.home)));
        for mut view in self.partition.tail_points().map(|point| view(point, &layout.home)) {
            let [x, y, z] = view.position;
            let [x, y] = self.progress.tail.carry([x, y], self.progress.clock);
            view.position = [x, y, z];
            view.is_tail = true;
            visit(&view);
        }
    }

    fn state_bytes(&self) -> StateBytes {
        let mut bulk = self.partition.state_bytes();
        self.contact.save(&mut bulk);
        bulk
    }

    fn restore(&mut self, bulk: &StateBytes, progress: &Progress) -> Result<(), Error> {
        if let (Some(window), Some(edges)) = (&self.options.window, &progress.window) {
            window.hold(&mut self.partition, edges);
        }
        let mut reader = bulk.reader();
        self.partition.restore(&mut reader)?;
        self.contact.restore(&mut reader)?;
        reader.finish()?;
        if progress.heat.tool.len() != self.progress.heat.tool.len() {
            return Err(Error::DamagedState("its tool does not fit this scene".into()));
        }
        self.lightest *= progress.mass_factor / self.progress.mass_factor;
        if let Some(scaling) = &mut self.options.mass_scaling {
            scaling.restore(progress.mass_factor);
            self.model.set_density(scaling.density() * progress.mass_factor);
        }
        self.progress = progress.clone();
        self.tool.position = progress.tool_position;
        self.waiting = waiting::Waiting::default();
        Ok(())
    }

    fn fork(&self) -> Box<dyn Solver> {
        Box::new(self.clone())
    }
}
