//! The largest stable time step of the scheme, worked out for a small elastic block.
//!
//! The scheme takes velocities from points to nodes, v = S v_p, and gives the points the nodes' accelerations
//! back, v_p ← v_p + Δt N a. What the nodes see of their own accelerations a substep later is P = S N of
//! them: all for smooth motion, a quarter for the shortest waves in a lattice of two points per edge. The
//! stress of a substep follows v + Δt a, in which a is not filtered yet. With the displacement u that has led
//! to the stress, a = -M⁻¹K u, a substep is
//!
//! v ← v + Δt P a,  u ← u + Δt (v + Δt a)  (v, a before the substep)
//!
//! It is at its limit where a wave returns with its sign changed, (v, u) → -(v, u): (I − P/2) M⁻¹K u = 2/Δt²
//! u. So
//!
//! Δt = √(2/λ),  λ the largest eigenvalue of (I − P/2) M⁻¹K.
//!
//! For P = I that is the familiar 2/ω. Inside a regular lattice of two points per edge it is 0.756 h/c (ν =
//! 0). A free surface has less: where the outermost points reach into the next row of cells by any amount,
//! its nodes have little mass and little stiffness, but stiffness over mass as large as can be. A workpiece's
//! surfaces lie on lines of nodes at the start and move off them with the first wave, so this is the limit
//! that counts. Where a transfer gives nodes more of the points' velocities back (APIC), the limit is higher.
//!
//! That is the limit of straight rows. Points that have moved unevenly by any amount have lower ones here and
//! there (tests); whole simulations of blocks hold at the limit all the same
//! (book/src/evidence/hard-cases.md).
//!
//! With smoothed increments (`partition::smoothing`) P′ takes the place of I: λ is the largest eigenvalue of
//! (P′ − P/2) M⁻¹K, and the limit twice as high.
//!
//! In the scalar product of K the operator is its own adjoint; λ is found by Lanczos' method there, which
//! needs K u and little else (Lanczos, 1950; without orthogonalising again, since copies of λ do no harm).
//! Derived here.

use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::simd::{Array, Vector};
use nalgebra::DMatrix;

/// How much longer than at rest the block is (-): its points reach into the cells around it, but hardly.
const STRETCH: f64 = 1e-6;
/// Most vectors of Lanczos' method; with these the limits of all materials are right to four digits (tests).
const STEPS: usize = 60;

/// A point's share in a node.
#[derive(Clone, Copy)]
struct Share {
    node: usize,
    /// Which of three along each axis.
    at: [usize; 3],
    weight: f64,
    slope: [f64; 3],
}

/// The largest Courant number (-), time step times speed of sound over cell length, at which an elastic block
/// is stable whose sides lie on lines of nodes.
///
/// * `per_edge`: points along the edge of a cell, at least 1
/// * `cells`: cells along each axis; what lies beyond the dimension's is not looked at
/// * `poissons_ratio`: of the material (-), from 0 to 0.5
pub fn largest_courant<D: Dimension, F: ShapeFunction<f64>>(
    shape: &F,
    per_edge: i32,
    cells: [usize; 3],
    poissons_ratio: f64,
    smoothed: bool,
) -> f64 {
    let block = Block::<D>::new(shape, per_edge as usize, cells, poissons_ratio, stretched);
    largest(&Block { smoothed, ..block })
}

/// A straight row, hardly longer than at rest: its ends reach into the cells around it.
fn stretched(place: f64) -> f64 {
    (1.0 + STRETCH) * place
}

/// The largest Courant number of a block (-), by Lanczos' method.
fn largest<D: Dimension>(block: &Block<D>) -> f64 {
    let product = |a: &[[f64; 3]], b: &[[f64; 3]]| -> f64 {
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum()
    };
    // Any start that is no eigenvector of another value; its axes beyond the dimension's are never looked at.
    let nodes = block.mass.len();
    let mut wave: Vec<[f64; 3]> =
        (0..nodes).map(|k| std::array::from_fn(|axis| ((7 * k + 3 * axis) as f64).sin())).collect();
    let mut before = vec![[0.0; 3]; nodes];
    let (mut diagonal, mut beside) = (Vec::new(), Vec::new());
    let mut size = 0.0;
    for _ in 0..STEPS.min(nodes) {
        let mut force = block.force(&wave);
        let norm = product(&wave, &force).sqrt();
        if norm <= f64::EPSILON * diagonal.iter().copied().fold(0.0, f64::max) {
            break;
        }
        if !diagonal.is_empty() {
            beside.push(norm);
            size = norm;
        }
        wave.iter_mut().chain(&mut force).flatten().for_each(|entry| *entry /= norm);
        let mut next = block.step(&force);
        let own = product(&force, &next);
        diagonal.push(own);
        let entries = next.iter_mut().flatten().zip(wave.iter().flatten()).zip(before.iter().flatten());
        entries.for_each(|((next, wave), before)| *next -= own * wave + size * before);
        before = std::mem::replace(&mut wave, next);
    }
    let matrix = DMatrix::from_fn(diagonal.len(), diagonal.len(), |row, column| match row.abs_diff(column) {
        0 => diagonal[row],
        1 => beside[row.min(column)],
        _ => 0.0,
    });
    (2.0 / matrix.symmetric_eigenvalues().max()).sqrt()
}

/// What a point has of the nodes along one axis.
struct Row {
    /// The first of three nodes, counted from one before the block.
    first: usize,
    weights: [f64; 3],
    slopes: [f64; 3],
}

impl Row {
    /// Along an axis that the dimension does not have.
    const ONLY: Row = Row { first: 0, weights: [1.0, 0.0, 0.0], slopes: [0.0; 3] };

    /// Of a point at a place (cells from the block's lower side).
    fn at<F: ShapeFunction<f64>>(shape: &F, place: f64) -> Row {
        let nearest = place.round();
        let stencil = shape.stencil(Array::<f64, 1>::splat(place - nearest));
        let plain = |lanes: [Array<f64, 1>; 3]| lanes.map(Vector::sum);
        Row { first: nearest as usize, weights: plain(stencil.weights), slopes: plain(stencil.slopes) }
    }
}

/// A block of points on nodes; lengths in cells, speed of sound and density 1.
struct Block<D> {
    points: Vec<Vec<Share>>,
    /// Of the nodes; none is 0.
    mass: Vec<f64>,
    volume: f64,
    /// Lamé's constants.
    lame: f64,
    shear: f64,
    /// Whether increments are smoothed.
    smoothed: bool,
    dimension: std::marker::PhantomData<D>,
}

impl<D: Dimension> Block<D> {
    /// `moved`: where a point of the lattice at rest is, along an axis (cells from the block's middle).
    fn new<F: ShapeFunction<f64>>(
        shape: &F,
        per_edge: usize,
        cells: [usize; 3],
        poissons_ratio: f64,
        mut moved: impl FnMut(f64) -> f64,
    ) -> Self {
        let along = |axis: usize| if axis < D::AXES { cells[axis] * per_edge } else { 1 };
        let rows: [usize; 3] = std::array::from_fn(|axis| cells[axis] + 3);
        let mut places = vec![usize::MAX; rows.iter().product()];
        let (mut points, mut mass) = (Vec::new(), Vec::new());
        let volume = (per_edge as f64).powi(-(D::AXES as i32));
        for number in 0..along(0) * along(1) * along(2) {
            let plane = number / along(0);
            let own = [number % along(0), plane % along(1), plane / along(1)];
            let own: [Row; 3] = std::array::from_fn(|axis| {
                if axis >= D::AXES {
                    return Row::ONLY;
                }
                let middle = 0.5 * cells[axis] as f64;
                let place = (own[axis] as f64 + 0.5) / per_edge as f64;
                Row::at(shape, middle + moved(place - middle))
            });
            let mut shares = Vec::new();
            for corner in 0..27 {
                let at = [corner % 3, corner / 3 % 3, corner / 9];
                let weights: [f64; 3] = std::array::from_fn(|axis| own[axis].weights[at[axis]]);
                let weight = weights.iter().product();
                if weight <= 0.0 {
                    continue;
                }
                let node = [2, 1, 0]
                    .into_iter()
                    .fold(0, |node, axis| node * rows[axis] + own[axis].first + at[axis]);
                if places[node] == usize::MAX {
                    places[node] = mass.len();
                    mass.push(0.0);
                }
                let node = places[node];
                mass[node] += volume * weight;
                let slope = std::array::from_fn(|axis| {
                    let others = (0..3).filter(|&other| other != axis).map(|other| weights[other]);
                    own[axis].slopes[at[axis]] * others.product::<f64>()
                });
                shares.push(Share { node, at, weight, slope });
            }
            points.push(shares);
        }
        let lame = poissons_ratio / (1.0 - poissons_ratio);
        let shear = 0.5 * (1.0 - lame);
        let dimension = std::marker::PhantomData;
        Block { points, mass, volume, lame, shear, smoothed: false, dimension }
    }

    /// K u: what displacements of the nodes call forth.
    fn force(&self, displacement: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut force = vec![[0.0; 3]; self.mass.len()];
        for shares in &self.points {
            let mut gradient = [[0.0; 3]; 3];
            for share in shares {
                for (a, row) in gradient.iter_mut().enumerate() {
                    (0..3).for_each(|b| row[b] += displacement[share.node][a] * share.slope[b]);
                }
            }
            let pressure = self.lame * (0..3).map(|a| gradient[a][a]).sum::<f64>();
            for share in shares {
                for a in 0..3 {
                    let shear: f64 = (0..3).map(|b| (gradient[a][b] + gradient[b][a]) * share.slope[b]).sum();
                    force[share.node][a] += self.volume * (pressure * share.slope[a] + self.shear * shear);
                }
            }
        }
        force
    }

    /// (I − P/2) M⁻¹ of forces, or (P′ − P/2) M⁻¹.
    fn step(&self, force: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let acceleration: Vec<[f64; 3]> =
            force.iter().zip(&self.mass).map(|(force, mass)| force.map(|f| f / mass)).collect();
        let mut step = acceleration.clone();
        for shares in &self.points {
            let mut own = [0.0; 3];
            for share in shares {
                (0..3).for_each(|a| own[a] += share.weight * acceleration[share.node][a]);
            }
            for share in shares {
                let part = 0.5 * self.volume * share.weight / self.mass[share.node];
                (0..3).for_each(|a| step[share.node][a] -= part * own[a]);
            }
            if self.smoothed {
                self.smooth(shares, &acceleration, &mut step);
            }
        }
        step
    }

    /// What a point adds to P′ (`partition::smoothing`).
    fn smooth(&self, shares: &[Share], acceleration: &[[f64; 3]], step: &mut [[f64; 3]]) {
        for own in shares {
            for other in shares {
                if (0..3).any(|axis| own.at[axis].abs_diff(other.at[axis]) > 1) {
                    continue;
                }
                let part = self.volume * own.weight * other.weight / self.mass[own.node];
                for a in 0..3 {
                    step[own.node][a] -= part * (acceleration[own.node][a] - acceleration[other.node][a]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::{PlaneStrain, ThreeDimensional};
    use crate::grid::shape_function::{Gimp, Linear};
    use nalgebra::SymmetricEigen;

    /// The matrices themselves, and all their eigenvalues: with M^(1/2) on both sides I − P/2 and M⁻¹K are
    /// symmetric, and their product has the eigenvalues of Lᵀ K L, L L ᵀ = I − P/2.
    fn by_all_eigenvalues<D: Dimension>(block: &Block<D>) -> f64 {
        let nodes = block.mass.len();
        let unit = |k: usize| {
            let mut unit = vec![[0.0; 3]; nodes];
            unit[k / D::AXES][k % D::AXES] = 1.0;
            unit
        };
        let size = nodes * D::AXES;
        let root = |k: usize| block.mass[k / D::AXES].sqrt();
        let stiffness = DMatrix::from_fn(size, size, |_, _| 0.0);
        let (mut stiffness, mut rest) = (stiffness.clone(), stiffness);
        for column in 0..size {
            let (force, step) = (block.force(&unit(column)), block.step(&unit(column)));
            for row in 0..size {
                let (node, axis) = (row / D::AXES, row % D::AXES);
                stiffness[(row, column)] = force[node][axis] / root(row) / root(column);
                rest[(row, column)] = step[node][axis] * root(row) * root(column);
            }
        }
        let lower = rest.cholesky().expect("I - P/2 and P' - P/2 are positive").l();
        let all = SymmetricEigen::new(lower.transpose() * stiffness * lower).eigenvalues;
        (2.0 / all.max()).sqrt()
    }

    /// Numbers evenly from -1 to 1, the same in each run.
    fn noise() -> impl FnMut() -> f64 {
        let mut state = 1u64;
        move || {
            // Knuth's linear congruence; its upper bits are random enough.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    /// Lanczos' method finds the largest eigenvalue, in the plane and in space.
    #[test]
    fn the_limit_is_that_of_all_eigenvalues() {
        for ratio in [0.0, 0.3, 0.34, 0.495] {
            let shape = Gimp::new(2);
            let block = Block::<PlaneStrain>::new(&shape, 2, [6, 6, 1], ratio, stretched);
            let limit = largest_courant::<PlaneStrain, _>(&shape, 2, [6, 6, 1], ratio, false);
            let exact = by_all_eigenvalues(&block);
            println!("ν = {ratio}: {limit:.5}, by all eigenvalues {exact:.5}");
            assert!((limit / exact - 1.0).abs() < 1e-4, "ν = {ratio}: {limit}, exact {exact}");
        }
        for ratio in [0.0, 0.3, 0.495] {
            let shape = Gimp::new(2);
            let block = Block::<PlaneStrain>::new(&shape, 2, [6, 6, 1], ratio, stretched);
            let limit = largest_courant::<PlaneStrain, _>(&shape, 2, [6, 6, 1], ratio, true);
            let exact = by_all_eigenvalues(&Block { smoothed: true, ..block });
            println!("smoothed, ν = {ratio}: {limit:.5}, by all eigenvalues {exact:.5}");
            assert!((limit / exact - 1.0).abs() < 1e-4, "smoothed, ν = {ratio}: {limit}, exact {exact}");
        }
        let shape = Gimp::new(2);
        let block = Block::<ThreeDimensional>::new(&shape, 2, [2, 2, 1], 0.3, stretched);
        let limit = largest_courant::<ThreeDimensional, _>(&shape, 2, [2, 2, 1], 0.3, false);
        let exact = by_all_eigenvalues(&block);
        assert!((limit / exact - 1.0).abs() < 1e-4, "in space: {limit}, exact {exact}");
        let in_space = largest_courant::<ThreeDimensional, _>(&shape, 2, [4, 4, 4], 0.3, false);
        let crowded = largest_courant::<PlaneStrain, _>(&Gimp::new(4), 4, [6, 6, 1], 0.3, false);
        println!("ν = 0.3 in space: {in_space:.4}; four points per edge: {crowded:.4}");
        assert!(in_space < 0.53 && crowded < 0.48, "more neighbours, shorter steps: {in_space}, {crowded}");
    }

    /// What was seen with whole simulations (book/src/evidence/hard-cases.md): a block at ν = 0.3 holds at
    /// 0.55 and not at 0.57, a bar one cell thick not at 0.5. Without light nodes (linear weights: no point
    /// reaches out) the lattice's inside sets the limit, 0.756 at ν = 0.
    #[test]
    fn limits_are_where_simulations_fail() {
        let limit = |cells, ratio| largest_courant::<PlaneStrain, _>(&Gimp::new(2), 2, cells, ratio, false);
        let (block, thin) = (limit([6, 6, 1], 0.3), limit([32, 1, 1], 0.3));
        assert!((0.54..0.57).contains(&block) && (0.45..0.5).contains(&thin), "{block}, thin {thin}");
        let inside = largest_courant::<PlaneStrain, _>(&Linear, 2, [6, 6, 1], 0.0, false);
        assert!((inside - 0.756).abs() < 1e-3, "{inside}");
    }

    /// A substep gives no wave energy where P′ − P has no negative eigenvalue: with straight rows and with
    /// points that are off their places by up to a quarter of a cell.
    #[test]
    fn smoothing_keeps_more_than_what_points_give_back() {
        let mut random = noise();
        for size in [0.0, 1e-3, 0.25] {
            let shape = Gimp::new(2);
            let moved = |place| stretched(place) + size * random();
            let block = Block::<PlaneStrain>::new(&shape, 2, [6, 6, 1], 0.3, moved);
            let block = Block { smoothed: true, ..block };
            let nodes = block.mass.len();
            // P′ − P = (P′ − P/2) − P/2, and (I − P/2) has the latter; M^(1/2) on both sides makes it
            // symmetric.
            let plain =
                Block { smoothed: false, points: block.points.clone(), mass: block.mass.clone(), ..block };
            let matrix = DMatrix::from_fn(nodes, nodes, |row, column| {
                let mut unit = vec![[0.0; 3]; nodes];
                unit[column][0] = 1.0;
                let scale = (block.mass[row] * block.mass[column]).sqrt();
                let identity = if row == column { 1.0 } else { 0.0 };
                let half_p = identity - scale * plain.step(&unit)[row][0];
                scale * block.step(&unit)[row][0] - half_p
            });
            let least = SymmetricEigen::new(matrix).eigenvalues.min();
            println!("points off by {size}: least eigenvalue {least:.1e}");
            assert!(least > -1e-12, "points off by {size}: {least}");
        }
    }

    /// Uneven rows have lower limits than straight ones, but not by much: of points that are off their places
    /// by up to 1e-6, 1e-4 and 1e-2 cells, thirty arrangements each. The figures of
    /// book/src/evidence/hard-cases.md.
    #[test]
    fn uneven_rows_have_lower_limits() {
        let mut random = noise();
        let shape = Gimp::new(2);
        for (cells, straight, least) in
            [([6, 6, 1], 0.5485, 0.50), ([8, 2, 1], 0.5428, 0.50), ([32, 1, 1], 0.4857, 0.47)]
        {
            let limit = largest_courant::<PlaneStrain, _>(&shape, 2, cells, 0.3, false);
            assert!((limit - straight).abs() < 1e-3, "{cells:?}: {limit}");
            let limits: Vec<f64> = [1e-6, 1e-4, 1e-2]
                .into_iter()
                .flat_map(|size| (0..30).map(move |_| size))
                .map(|size| {
                    let moved = |place| place + size * random();
                    largest(&Block::<PlaneStrain>::new(&shape, 2, cells, 0.3, moved))
                })
                .collect();
            let lowest = limits.iter().copied().fold(f64::MAX, f64::min);
            let mean = limits.iter().sum::<f64>() / limits.len() as f64;
            let below = limits.iter().filter(|&&uneven| uneven < limit).count();
            println!(
                "{cells:?}: straight {limit:.4}, uneven {lowest:.4} at the least, {mean:.4} on average, \
                 {below} lower"
            );
            assert!((least..limit).contains(&lowest), "{cells:?}: {lowest}");
        }
    }
}
