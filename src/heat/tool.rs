//! The tool as a conducting body.
//!
//! Its cross-section is covered with square cells as large as the grid's, which move with it; a cell belongs
//! to the tool when its centre does. Heat flows between neighbouring cells (finite volumes, explicit), and
//! enters
//!
//! * as the tool's share of the friction heat, on the cell behind the place where it arose;
//! * through the contact, q = H (T_p − T_c) per area, between each point that the tool reaches (its distance
//!   is at most half its width) and the cell behind it. Over a pass of length Δt the pair exchanges what it
//!   would by itself,
//!
//!   Q = C (T_p − T_c) (1 − exp(−H A Δt/C)), 1/C = 1/C_p + 1/C_c,
//!
//!   which is stable for any conductance H; A is the face of the point's square or cube.
//!
//! All other faces are insulated: within a cut heat reaches some 0.05 mm deep. What the tool gains is counted
//! once and the same number taken from points or friction, so that heat is kept to rounding.
//!
//! Form of the effect: part of the conduction pass; without it nothing is kept or done.

use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::heat::{HeatTotals, NodeHeat, warm};
use crate::material::ConstitutiveModel;
use crate::partition::Partition;
use crate::points::BLOCK;
use crate::simd::Real;
use crate::tool::RigidTool;
use crate::tool::profile::ToolShape;

/// Largest part of the explicit limit that a step of the tool's own may take (-).
const FRACTION: f64 = 0.5;

/// The tool's cells and what they are made of; their temperatures belong to the state (`HeatTotals::tool`).
#[derive(Clone, Debug)]
pub struct ToolBody {
    /// Edge of a cell (m).
    cell: f64,
    /// Lower left corner of the cells from the tool's lowest point (m).
    corner: [f64; 2],
    /// Cells along x and y.
    counts: [usize; 2],
    /// Which cells belong to the tool.
    belongs: Vec<bool>,
    /// Width of the cut (m).
    width: f64,
    material: ToolMaterial,
}

/// What a tool is made of, for heat.
#[derive(Clone, Copy, Debug)]
pub struct ToolMaterial {
    /// k (W/(m K)), above 0.
    pub conductivity: f64,
    /// ρ c (J/(m3 K)), above 0.
    pub capacity: f64,
    /// H of the contact with the chip (W/(m2 K)).
    pub conductance: f64,
}

/// The workpiece on the other side of the contact.
#[derive(Clone, Copy, Debug)]
pub struct Opposite {
    /// ρ₀ c (J/(m3 K)).
    pub capacity: f64,
    /// Temperature at the start of tool and workpiece (K).
    pub reference: f64,
}

impl ToolBody {
    /// A tool of a shape.
    ///
    /// * `cell`: edge of a cell (m)
    /// * `width`: of the cut (m)
    pub fn new(shape: &ToolShape, cell: f64, width: f64, material: ToolMaterial) -> Self {
        let (corner, high) = shape.bounds();
        let counts = [0, 1].map(|axis| ((high[axis] - corner[axis]) / cell - 1e-9).ceil().max(1.0) as usize);
        let belongs = (0..counts[0] * counts[1])
            .map(|index| {
                let place = [index / counts[1], index % counts[1]];
                let centre = [0, 1].map(|axis| corner[axis] + cell * (place[axis] as f64 + 0.5));
                shape.closest(centre).distance < 0.0
            })
            .collect();
        ToolBody { cell, corner, counts, belongs, width, material }
    }

    /// Number of cells, those outside the tool included.
    pub fn cells(&self) -> usize {
        self.belongs.len()
    }

    /// Heat capacity of a cell (J/K).
    fn cell_capacity(&self) -> f64 {
        self.material.capacity * self.cell * self.cell * self.width
    }

    /// Heat stored (J) at rises of temperature (K) by cell.
    pub fn heat(&self, rises: &[f64]) -> f64 {
        self.cell_capacity() * rises.iter().sum::<f64>()
    }

    /// Heat (J) of a cell that no change of a temperature (K) shows: points as warm as the tool exchange some
    /// of it to and fro, since their temperatures are rounded.
    pub fn unresolved_heat(&self, temperature: f64) -> f64 {
        self.cell_capacity() * f64::EPSILON * temperature
    }

    /// The cell at a place from the tool's lowest point (m), or the nearest of its neighbours that belongs to
    /// the tool.
    fn cell_at(&self, place: [f64; 2]) -> Option<usize> {
        let index = |axis: usize| ((place[axis] - self.corner[axis]) / self.cell).floor() as i64;
        let (column, row) = (index(0), index(1));
        let mut nearest: Option<(f64, usize)> = None;
        for i in column - 1..=column + 1 {
            for j in row - 1..=row + 1 {
                if !(0..self.counts[0] as i64).contains(&i) || !(0..self.counts[1] as i64).contains(&j) {
                    continue;
                }
                let cell = i as usize * self.counts[1] + j as usize;
                let offset = [(0, i), (1, j)]
                    .map(|(axis, k)| place[axis] - self.corner[axis] - self.cell * (k as f64 + 0.5));
                let square = offset[0] * offset[0] + offset[1] * offset[1];
                if self.belongs[cell] && nearest.is_none_or(|(least, _)| square < least) {
                    nearest = Some((square, cell));
                }
            }
        }
        nearest.map(|(_, cell)| cell)
    }

    /// The cell behind the surface that is nearest to a point of the workpiece, with the point's distance
    /// (m).
    fn cell_behind(&self, tool: &RigidTool, point: [f64; 2]) -> (f64, Option<usize>) {
        let from_tool = [0, 1].map(|axis| point[axis] - tool.position[axis]);
        let closest = tool.shape.closest(from_tool);
        let depth = closest.distance + 0.5 * self.cell;
        let inside = [0, 1].map(|axis| from_tool[axis] - depth * closest.normal[axis]);
        (closest.distance, self.cell_at(inside))
    }

    /// Conducts within the tool over `dt` (s).
    pub fn conduct(&self, rises: &mut [f64], dt: f64) {
        let diffusivity = self.material.conductivity / self.material.capacity;
        let number = diffusivity * dt / (self.cell * self.cell);
        let steps = (4.0 * number / FRACTION).ceil().max(1.0);
        let mut flow = vec![0.0; rises.len()];
        for _ in 0..steps as usize {
            flow.fill(0.0);
            let mut pass = |from: usize, to: usize| {
                if self.belongs[from] && self.belongs[to] {
                    let gained = number / steps * (rises[from] - rises[to]);
                    flow[from] -= gained;
                    flow[to] += gained;
                }
            };
            for i in 0..self.counts[0] {
                for j in 0..self.counts[1] {
                    let cell = i * self.counts[1] + j;
                    if i + 1 < self.counts[0] {
                        pass(cell, cell + self.counts[1]);
                    }
                    if j + 1 < self.counts[1] {
                        pass(cell, cell + 1);
                    }
                }
            }
            rises.iter_mut().zip(&flow).for_each(|(rise, gained)| *rise += gained);
        }
    }

    /// Takes the tool's share (-) of friction heat on nodes; returns what found no cell (J).
    pub fn take_friction<D: Dimension>(
        &self,
        (layout, tool): (&Layout, &RigidTool),
        sources: &NodeHeat,
        share: f64,
        rises: &mut [f64],
    ) -> f64 {
        let mut left = 0.0;
        for &(node, heat) in sources {
            let pencil = layout.start.partition_point(|&start| start <= node) - 1;
            let along = layout.low[pencil] + (node - layout.start[pencil]) as i32;
            let [x, y, _] = layout.position::<D>(pencil, along);
            match self.cell_behind(tool, [x, y]).1 {
                Some(cell) => rises[cell] += share * heat / self.cell_capacity(),
                None => left += share * heat,
            }
        }
        left
    }

    /// Exchanges heat with the points that the tool reaches, over `dt` (s).
    ///
    pub fn exchange<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
        &self,
        (partition, model): (&mut Partition<R, D, M::State>, &M),
        tool: &RigidTool,
        workpiece: Opposite,
        dt: f64,
        totals: &mut HeatTotals,
    ) {
        let Partition { layout, chunks, .. } = partition;
        let (low, high) = tool.bounds();
        let own = self.cell_capacity();
        for block in chunks.iter_mut().flat_map(|chunk| &mut chunk.blocks) {
            for lane in 0..BLOCK {
                if !block.is_point(lane) {
                    continue;
                }
                let place = layout.place(block, lane);
                if (0..2).any(|axis| {
                    place[axis] < low[axis] - layout.cell || place[axis] > high[axis] + layout.cell
                }) {
                    continue;
                }
                let volume = block.volume[lane].to_f64();
                let present = volume * model.present_volume_ratio(&block.state, lane);
                let (edge, face) = if D::AXES == 2 {
                    let edge = (present / self.width).sqrt();
                    (edge, edge * self.width)
                } else {
                    let edge = present.cbrt();
                    (edge, edge * edge)
                };
                let (distance, Some(cell)) = self.cell_behind(tool, place) else { continue };
                if distance > 0.5 * edge {
                    continue;
                }
                let points = workpiece.capacity * volume;
                let pair = points * own / (points + own);
                let rise = model.temperature(&block.state, lane) - workpiece.reference;
                let share = -(-self.material.conductance * face * dt / pair).exp_m1();
                let heat = pair * (rise - totals.tool[cell]) * share;
                if heat != 0.0 {
                    totals.tool[cell] += heat / own;
                    totals.contact += heat;
                    warm(model, block, lane, points, -heat / points, totals);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rectangular body of `cells` by twice as many.
    fn block(cells: usize) -> ToolBody {
        let shape = ToolShape::new(0.0, 0.0, 0.0, 5e-4, 1e-3).expect("a right-angled wedge");
        let material = ToolMaterial { conductivity: 46.0, capacity: 203.0 * 15_700.0, conductance: 1e6 };
        ToolBody::new(&shape, 5e-4 / cells as f64, 1e-3, material)
    }

    /// The slowest mode of an insulated rectangle decays as exp(−π² κ t/L²); cells are of second order, and
    /// keep the heat.
    #[test]
    fn the_slowest_mode_decays_as_it_must() {
        let kappa = 46.0 / (203.0 * 15_700.0);
        let time = 2e-3;
        let errors = [8, 16].map(|cells| {
            let body = block(cells);
            assert!(body.belongs.iter().all(|&belongs| belongs), "the wedge is a rectangle");
            let edge = 5e-4 / cells as f64;
            let mode = |row: usize| (std::f64::consts::PI * (row as f64 + 0.5) * edge / 1e-3).cos();
            let mut rises: Vec<f64> =
                (0..body.cells()).map(|cell| 300.0 + 100.0 * mode(cell % body.counts[1])).collect();
            let before = body.heat(&rises);
            body.conduct(&mut rises, time);
            let after = body.heat(&rises);
            assert!((after / before - 1.0).abs() < 1e-13, "{before} J became {after} J");
            let decay = (-kappa * (std::f64::consts::PI / 1e-3).powi(2) * time).exp();
            let exact = |row: usize| 300.0 + 100.0 * mode(row) * decay;
            (0..rises.len()).map(|k| (rises[k] - exact(k % body.counts[1])).abs()).fold(0.0, f64::max)
        });
        let order = (errors[0] / errors[1]).log2();
        assert!(order > 1.9 && errors[1] < 0.05, "order {order} of errors {errors:?} K");
    }
}
