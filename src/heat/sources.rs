//! Heat that enters the workpiece on nodes of the grid: friction heat, and what the tool gives or takes.
//!
//! Friction is found on the nodes, substep by substep, and waits there until the points are sorted (when
//! nodes get other places in memory) or a conduction pass is due. Then a node's heat Q_i goes to the points
//! around it as in the pass,
//!
//! T_p ← T_p + Σ_i w_ip Q_i/C_i,  C_i = Σ_p w_ip C_p,
//!
//! so that the points gain ΣQ_i exactly. A node that has lost its points meanwhile hands its heat to the
//! other nodes, in proportion to what they hold.
//!
//! The two bodies share the friction heat in the ratio of their effusivities e = √(k ρ c), which is how two
//! half-spaces in perfect contact share the heat that arises between them: e_w/(e_w + e_t) stays in the
//! workpiece.
//!
//! Source: Carslaw and Jaeger (1959), Conduction of Heat in Solids, section 2.15 (contact of two
//! half-spaces).

use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::grid::shape_function::ShapeFunction;
use crate::heat::{HeatTotals, NodeHeat, warm};
use crate::material::ConstitutiveModel;
use crate::partition::Partition;
use crate::points::Places;
use crate::simd::Real;
use crate::transfer::stencils::{ExactStencils, for_each_node};

/// Adds heat (J) on a node.
pub fn add(sum: &mut NodeHeat, node: usize, heat: f64) {
    match sum.binary_search_by_key(&node, |entry| entry.0) {
        Ok(place) => sum[place].1 += heat,
        Err(place) => sum.insert(place, (node, heat)),
    }
}

/// Gives heat on nodes to the points around them; returns what found no points (J).
///
/// * `sources`: heat by node (J)
/// * `capacity`: ρ₀ c (J/(m3 K))
/// * `totals`: where what rounding leaves over is kept
pub fn deposit<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
    partition: &mut Partition<R, D, M::State>,
    (shape, model): (&F, &M),
    sources: &[(usize, f64)],
    capacity: f64,
    totals: &mut HeatTotals,
) -> f64 {
    if sources.is_empty() {
        return 0.0;
    }
    let Partition { layout, chunks, .. } = partition;
    let mut sources: Vec<Source> =
        sources.iter().map(|&(node, heat)| Source { node, heat, capacity: 0.0 }).collect();
    // Points that reach a source: chunk, block, lane.
    let mut near = Vec::new();
    for (c, chunk) in chunks.iter().enumerate() {
        for (b, block) in chunk.blocks.iter().enumerate() {
            find_near(layout, &block.places(), shape, capacity, &mut sources, &mut |lane| {
                near.push((c, b, lane))
            });
        }
    }
    let (mut total, mut placed) = (0.0, 0.0);
    for source in &sources {
        total += source.heat;
        placed += if source.capacity > 0.0 { source.heat } else { 0.0 };
    }
    if placed == 0.0 {
        return total;
    }
    let mut stencils: Option<((usize, usize), ExactStencils)> = None;
    for (c, b, lane) in near {
        let block = &mut chunks[c].blocks[b];
        if stencils.as_ref().is_none_or(|(place, _)| *place != (c, b)) {
            stencils = Some(((c, b), ExactStencils::of(&block.places(), shape)));
        }
        let Some((_, weights)) = &stencils else { continue };
        let rise = rise::<D>(layout, &block.places().node_of(lane), lane, weights, &sources);
        let own = capacity * block.volume[lane].to_f64();
        warm(model, block, lane, own, rise * total / placed, totals);
    }
    0.0
}

/// Heat (J) on a node and the capacity (J/K) of the points around it.
struct Source {
    node: usize,
    heat: f64,
    capacity: f64,
}

/// The source on a node of the layout, if there is one.
fn source_at(sources: &[Source], node: usize) -> Option<usize> {
    sources.binary_search_by_key(&node, |source| source.node).ok()
}

/// Shows the points of a block that reach a source to `visit`, and adds their capacity there.
#[inline(never)]
fn find_near<R: Real, D: Dimension, F: ShapeFunction<R>>(
    layout: &Layout,
    points: &Places<'_, R, D>,
    shape: &F,
    capacity: f64,
    sources: &mut [Source],
    visit: &mut dyn FnMut(usize),
) {
    let mut weights = None;
    // Sorted points share their nearest node with their neighbours.
    let mut last = (D::vector(|_| i32::MIN), false);
    for lane in points.points() {
        let node = points.node_of(lane);
        if node.as_ref() != last.0.as_ref() {
            let mut is_near = false;
            for_each_node::<D>(layout, &node, |index, _| is_near |= source_at(sources, index).is_some());
            last = (node, is_near);
        }
        if !last.1 {
            continue;
        }
        let weights = weights.get_or_insert_with(|| ExactStencils::of(points, shape));
        let own = capacity * points.volume[lane].to_f64();
        for_each_node::<D>(layout, &node, |index, places| {
            if let Some(k) = source_at(sources, index) {
                sources[k].capacity += own * weights.weight::<D>(lane, &places);
            }
        });
        visit(lane);
    }
}

/// Rise of temperature (K) of the point at `lane`, whose nearest node is `node`.
#[inline(never)]
fn rise<D: Dimension>(
    layout: &Layout,
    node: &D::Vector<i32>,
    lane: usize,
    weights: &ExactStencils,
    sources: &[Source],
) -> f64 {
    let mut rise = 0.0;
    for_each_node::<D>(layout, node, |index, places| {
        if let Some(k) = source_at(sources, index).filter(|&k| sources[k].capacity > 0.0) {
            rise += weights.weight::<D>(lane, &places) * sources[k].heat / sources[k].capacity;
        }
    });
    rise
}
