//! Heat conduction on the background grid, in a pass of its own that runs far more rarely than the substeps.
//!
//! ρ₀ c V₀ Ṫ = ∇·(k ∇T) J V₀, with Fourier's law in the present configuration: capacity follows the mass,
//! which deformation does not change, conduction the present volume J V₀. A pass of length Δt, with C_p = ρ₀
//! c V₀ a point's capacity and C_i = Σ_p w_ip C_p a node's:
//!
//! 1. around each node a plane is fitted to the points' temperatures, f_i(x) = T_i + g_i · (x − x_i), with
//!    weights w_ip C_p;
//! 2. heat flows between the nodes, Q_i = −Δt Σ_p k J_p V_p ∇w_ip · Σ_j ∇w_jp T_j;
//! 3. T_p ← T_p + Σ_i w_ip Q_i/C_i − α (T_p − Σ_i w_ip f_i(x_p)).
//!
//! Conservation: Σ_i ∇w_ip = 0, so ΣQ_i = 0, and Σ_p C_p w_ip = C_i. What the grid's increments do to the
//! points is what FLIP does to velocities, and has the same flaw: a cell's points may differ by patterns that
//! no node sees, which nothing would ever level. They are the last term's business. T_p − Σ w f is what the
//! planes do not explain: it vanishes for any linear field, whatever the arrangement of the points and up to
//! the surface; its sum over C_p is zero (each plane leaves no mean residual); and as an operator it lies
//! between 0 and 1 in the norm of C, so that no α ≤ 1 is unstable. With
//!
//! α = 1 − exp(−π² κ Δt/h²), κ = k/(ρ₀ c),
//!
//! patterns finer than a cell die out as fast as the heat equation would have a wave of two cells do, and as
//! their symbol is of fourth order in the wave number, a smooth field keeps second order. Planes rather than
//! means also give the nodes' temperatures: a node at the surface has its points on one side.
//!
//! Boundaries are insulated but for boxes of nodes of fixed temperature. There T_j in step 2 is the wall's,
//! and step 3 adds what the material's own T_i lacks to it.
//!
//! The explicit limit is Δt ≤ h²/(2 d κ) in d dimensions, some thousand substeps; a pass is due after
//! `FRACTION` of it on the solver's clock. Rounded temperatures would lose heat in single precision: what one
//! point's rounding takes is handed to the next in memory, and from one pass to the next.
//!
//! Affine fits in transfers: Jiang et al. (2015), doi:10.1145/2766996; the null space of increments:
//! Hammerquist and Nairn (2017), doi:10.1016/j.cma.2017.01.035. The form of the last term is this project's.
//!
//! Form of the effect: an optional pass; the points' kernel is the adiabatic one.

pub mod nodes;
pub mod sources;
pub mod tool;

use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::grid::{FixedNodes, Layout};
use crate::heat::nodes::HeatNode;
use crate::material::ConstitutiveModel;
use crate::partition::Partition;
use crate::points::{BLOCK, Block, Column, Places};
use crate::simd::Real;
use crate::transfer::stencils::{ExactStencils, for_each_node};
use serde::{Deserialize, Serialize};

/// Length of a pass over the explicit limit (-): errors of time stay below those of space, and splitting
/// heating from conduction lets heat lag by less than a cell.
const FRACTION: f64 = 0.25;
/// Largest part of the limit that one pass may take (-), where substeps themselves are that long.
const LARGEST_FRACTION: f64 = 0.5;
/// Heat by node of the layout (J), in rising order of the nodes.
pub type NodeHeat = Vec<(usize, f64)>;

/// Thermal effusivity e = √(k ρ c) (J/(m2 K √s)) of a conductivity (W/(m K)) and a heat capacity ρ c (J/(m3
/// K)).
pub fn effusivity(conductivity: f64, capacity: f64) -> f64 {
    (conductivity * capacity).sqrt()
}

/// Nodes held at a temperature.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedTemperature {
    /// Where; its axes mean nothing here.
    pub nodes: FixedNodes,
    /// The temperature (K).
    pub temperature: f64,
}

/// What conduction needs to go on, and its running totals.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HeatTotals {
    /// Time of the last pass (s).
    pub last_pass: f64,
    /// Passes since the start.
    pub passes: u64,
    /// Heat that rounding has left over, for the next point (J).
    pub carry: f64,
    /// Elastic energy that heat flows took by expanding the material, until the ledger takes it over (J).
    pub thermoelastic: f64,
    /// Heat that came in through nodes of fixed temperature (J).
    pub boundary: f64,
    /// Friction work since the start, all of it heat (J).
    pub friction: f64,
    /// The part of it that the tool has taken (J).
    pub friction_in_tool: f64,
    /// The part of it that waits on nodes for the points to be sorted (J), the tool's share included.
    pub waiting: NodeHeat,
    /// The part of it that has found no node yet (J), the tool's share included.
    pub unplaced: f64,
    /// Heat that went from the workpiece to the tool through the contact (J).
    pub contact: f64,
    /// Rise of temperature (K) of the tool's cells, if it conducts.
    pub tool: Vec<f64>,
}

impl HeatTotals {
    /// Friction heat that waits (J), with the tool's share.
    pub fn waits(&self) -> f64 {
        self.unplaced + self.waiting.iter().map(|entry| entry.1).sum::<f64>()
    }
}

/// The pass.
#[derive(Clone, Debug)]
pub struct HeatConduction {
    /// k (W/(m K)).
    conductivity: f64,
    /// ρ₀ c (J/(m3 K)), never scaled with the mass.
    capacity: f64,
    /// Temperature (K) from which the pass counts, so that undisturbed material is exactly zero.
    reference: f64,
    /// Share of the friction heat that stays in the workpiece (-); the tool takes the rest.
    pub friction_share: f64,
    /// Whether the material starts at one temperature, so that nothing flows before something heats.
    pub starts_even: bool,
    /// Whether plastic work heats.
    pub plastic_work_heats: bool,
    /// Nodes of fixed temperature.
    pub fixed: Vec<FixedTemperature>,
    /// Working memory, no part of the state.
    nodes: Vec<HeatNode>,
}

impl HeatConduction {
    /// Conduction in a material, insulated.
    ///
    /// * `conductivity`: k (W/(m K)), above 0
    /// * `capacity`: ρ₀ c (J/(m3 K)), above 0
    /// * `reference`: temperature at the start (K)
    pub fn new(conductivity: f64, capacity: f64, reference: f64) -> Self {
        HeatConduction {
            conductivity,
            capacity,
            reference,
            friction_share: 1.0,
            starts_even: false,
            plastic_work_heats: true,
            fixed: Vec::new(),
            nodes: Vec::new(),
        }
    }

    /// ρ₀ c (J/(m3 K)).
    pub fn capacity(&self) -> f64 {
        self.capacity
    }

    /// Temperature (K) from which the pass counts.
    pub fn reference(&self) -> f64 {
        self.reference
    }

    /// Lets the tool take its share of the friction heat, by effusivities (`heat::sources`).
    ///
    /// * `conductivity`: of the tool (W/(m K))
    /// * `capacity`: ρ c of the tool (J/(m3 K))
    pub fn with_tool(self, conductivity: f64, capacity: f64) -> Self {
        let own = effusivity(self.conductivity, self.capacity);
        HeatConduction { friction_share: own / (own + effusivity(conductivity, capacity)), ..self }
    }

    /// Thermal diffusivity κ = k/(ρ₀ c) (m2/s).
    pub fn diffusivity(&self) -> f64 {
        self.conductivity / self.capacity
    }

    /// Explicit limit h²/(2 d κ) of a pass (s).
    pub fn limit<D: Dimension>(&self, layout: &Layout) -> f64 {
        layout.cell * layout.cell / (2.0 * D::AXES as f64 * self.diffusivity())
    }

    /// Conducts over the time since the last pass, if one is due at `clock` (s); whether it did.
    pub fn conduct_if_due<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
        &mut self,
        partition: &mut Partition<R, D, M::State>,
        shape: &F,
        model: &M,
        clock: f64,
        totals: &mut HeatTotals,
    ) -> bool {
        let limit = self.limit::<D>(&partition.layout);
        let span = clock - totals.last_pass;
        if span < FRACTION * limit {
            return false;
        }
        let count = (span / (LARGEST_FRACTION * limit)).ceil().max(1.0);
        for _ in 0..count as usize {
            self.conduct(partition, shape, model, span / count, totals);
        }
        totals.last_pass = clock;
        true
    }

    /// One pass of `dt` (s).
    pub fn conduct<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
        &mut self,
        partition: &mut Partition<R, D, M::State>,
        shape: &F,
        model: &M,
        dt: f64,
        totals: &mut HeatTotals,
    ) {
        self.fit_planes(partition, shape, model);
        let held = self.hold_walls::<D>(&partition.layout);
        self.flow(partition, shape, model, dt);
        totals.boundary += self.raise(&held);
        let decay = std::f64::consts::PI.powi(2) * self.diffusivity() * dt / partition.layout.cell.powi(2);
        self.update_points(partition, shape, model, -(-decay).exp_m1(), totals);
        totals.passes += 1;
    }

    /// Step 1: a plane of temperature around each node.
    fn fit_planes<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
        &mut self,
        partition: &Partition<R, D, M::State>,
        shape: &F,
        model: &M,
    ) {
        self.nodes.clear();
        self.nodes.resize(partition.layout.nodes(), HeatNode::default());
        for block in partition.chunks.iter().flat_map(|chunk| &chunk.blocks) {
            let points = block.places();
            let temperatures = temperatures(model, block);
            self.add_moments(&partition.layout, &points, &ExactStencils::of(&points, shape), &temperatures);
        }
        self.nodes.iter_mut().filter(|node| node.capacity > 0.0).for_each(HeatNode::fit::<D>);
    }

    /// Adds to the nodes' moments what the points of a block have; temperatures in K.
    #[inline(never)]
    fn add_moments<R: Real, D: Dimension>(
        &mut self,
        layout: &Layout,
        points: &Places<'_, R, D>,
        weights: &ExactStencils,
        temperatures: &Column<f64>,
    ) {
        for lane in points.points() {
            let capacity = self.capacity * points.volume[lane].to_f64();
            let temperature = temperatures[lane] - self.reference;
            for_each_node::<D>(layout, &points.node_of(lane), |index, places| {
                let share = capacity * weights.weight::<D>(lane, &places);
                let node = &mut self.nodes[index];
                node.capacity += share;
                node.heat += share * temperature;
                node.square += share * temperature * temperature;
                for a in 0..D::AXES {
                    let moment = share * points.from_node(lane, &places, a);
                    node.first[a] += moment;
                    node.mixed[a] += moment * temperature;
                    for b in 0..=a {
                        node.second[a][b] += moment * points.from_node(lane, &places, b);
                    }
                }
            });
        }
    }

    /// Gives nodes of fixed temperature that temperature; returns each with what its material lacks (K).
    fn hold_walls<D: Dimension>(&mut self, layout: &Layout) -> Vec<(usize, f64)> {
        let mut held = Vec::new();
        for wall in &self.fixed {
            for pencil in 0..layout.low.len() {
                let Some((low, high)) = wall.nodes.on_pencil::<D>(layout, pencil) else { continue };
                let count = (layout.start[pencil + 1] - layout.start[pencil]) as i32;
                let bottom = layout.low[pencil];
                for along in low.max(bottom)..=high.min(bottom + count - 1) {
                    let index = (layout.offset[pencil] + along) as usize;
                    let node = &mut self.nodes[index];
                    let own = node.driving;
                    node.driving = wall.temperature - self.reference;
                    held.push((index, node.driving - own));
                }
            }
        }
        held
    }

    /// Step 2: heat that flows to each node.
    fn flow<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
        &mut self,
        partition: &Partition<R, D, M::State>,
        shape: &F,
        model: &M,
        dt: f64,
    ) {
        let layout = &partition.layout;
        let per_slope = self.conductivity * dt / (layout.cell * layout.cell);
        for block in partition.chunks.iter().flat_map(|chunk| &chunk.blocks) {
            let points = block.places();
            let mut conductances = [0.0; BLOCK];
            for lane in points.points() {
                conductances[lane] = per_slope * model.present_volume_ratio(&block.state, lane);
            }
            self.add_flow(layout, &points, &ExactStencils::of(&points, shape), &conductances);
        }
    }

    /// Adds to the heat that flows to each node what flows in the points of a block.
    ///
    /// * `conductances`: k Δt/h² times the present volume ratio (J/(m3 K))
    #[inline(never)]
    fn add_flow<R: Real, D: Dimension>(
        &mut self,
        layout: &Layout,
        points: &Places<'_, R, D>,
        weights: &ExactStencils,
        conductances: &Column<f64>,
    ) {
        for lane in points.points() {
            let node = points.node_of(lane);
            let mut slope = [0.0; 3];
            for_each_node::<D>(layout, &node, |index, places| {
                let driving = self.nodes[index].driving;
                for axis in 0..D::AXES {
                    slope[axis] += driving * weights.slope::<D>(lane, &places, axis);
                }
            });
            if slope == [0.0; 3] {
                continue;
            }
            let conductance = conductances[lane] * points.volume[lane].to_f64();
            let flux = slope.map(|slope| -conductance * slope);
            for_each_node::<D>(layout, &node, |index, places| {
                let terms = (0..D::AXES).map(|axis| flux[axis] * weights.slope::<D>(lane, &places, axis));
                self.nodes[index].flow += terms.sum::<f64>();
            });
        }
    }

    /// From heat to rise of temperature on each node; walls make up what their material lacks, and take what
    /// flows to them. Returns the heat that came in through walls (J).
    fn raise(&mut self, held: &[(usize, f64)]) -> f64 {
        let mut entered = 0.0;
        for &(index, lack) in held {
            let node = &mut self.nodes[index];
            entered += node.capacity * lack - node.flow;
            node.flow = node.capacity * lack;
        }
        for node in &mut self.nodes {
            node.flow = if node.capacity > 0.0 { node.flow / node.capacity } else { 0.0 };
        }
        entered
    }

    /// Step 3: the points follow the nodes, and the planes where they stray.
    fn update_points<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
        &mut self,
        partition: &mut Partition<R, D, M::State>,
        shape: &F,
        model: &M,
        levelling: f64,
        totals: &mut HeatTotals,
    ) {
        let Partition { layout, chunks, .. } = partition;
        for block in chunks.iter_mut().flat_map(|chunk| &mut chunk.blocks) {
            let points = block.places();
            let mut rises = temperatures(model, block);
            self.follow(layout, &points, &ExactStencils::of(&points, shape), levelling, &mut rises);
            for lane in 0..BLOCK {
                if block.is_point(lane) && rises[lane] != 0.0 {
                    let capacity = self.capacity * block.volume[lane].to_f64();
                    warm(model, block, lane, capacity, rises[lane], totals);
                }
            }
        }
    }

    /// From the points' temperatures (K) to what they rise by (K).
    #[inline(never)]
    fn follow<R: Real, D: Dimension>(
        &self,
        layout: &Layout,
        points: &Places<'_, R, D>,
        weights: &ExactStencils,
        levelling: f64,
        temperatures: &mut Column<f64>,
    ) {
        for lane in points.points() {
            let (mut rise, mut plane) = (0.0, 0.0);
            for_each_node::<D>(layout, &points.node_of(lane), |index, places| {
                let node = &self.nodes[index];
                let weight = weights.weight::<D>(lane, &places);
                let slopes =
                    (0..D::AXES).map(|axis| node.mixed[axis] * points.from_node(lane, &places, axis));
                rise += weight * node.flow;
                plane += weight * (node.value + slopes.sum::<f64>());
            });
            temperatures[lane] = rise - levelling * (temperatures[lane] - self.reference - plane);
        }
    }
}

/// Temperatures (K) of a block's points, 0 where there is none.
fn temperatures<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
    model: &M,
    block: &Block<R, D, M::State>,
) -> Column<f64> {
    let mut temperatures = [0.0; BLOCK];
    for lane in block.places().points() {
        temperatures[lane] = model.temperature(&block.state, lane);
    }
    temperatures
}

/// Raises a point's temperature by `rise` (K) and by what earlier roundings have left over; its own goes
/// there.
pub(crate) fn warm<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
    model: &M,
    block: &mut Block<R, D, M::State>,
    lane: usize,
    capacity: f64,
    rise: f64,
    totals: &mut HeatTotals,
) {
    let old = model.temperature(&block.state, lane);
    let wanted = rise + totals.carry / capacity;
    let taken = model.set_temperature(&mut block.state, lane, old + wanted);
    totals.thermoelastic += block.volume[lane].to_f64() * taken;
    totals.carry = capacity * (wanted - (model.temperature(&block.state, lane) - old));
}
