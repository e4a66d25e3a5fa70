//! What the points of a grid cell have in common: stress, and how fast the material strains.
//!
//! A grid does not see stresses that alternate from point to point, so nothing holds them down: neighbours
//! part by as much as they yield at, and a picture of the points' own stress is a checkerboard. The mean over
//! a cell is what the forces are made of:
//!
//! σ̄ = Σ m σ / Σ m over the points of a cell; pressure −tr σ̄/3; von Mises √(3/2 s̄:s̄).
//!
//! The strain rate is that of the linear velocity field which fits the points of a cell and its neighbours
//! best (least squares by mass): with d its symmetric part less a third of its trace, √(2/3 d:d). In plane
//! strain nothing moves across.
//!
//! Points of the chip's rigid tail make cells of their own: the tail passes through whatever is in its way.

use std::collections::HashMap;

use crate::output::point_fields::PointFields;

/// Least determinant of second moments over that of a cell's own square at which a slope is known (-).
const LEAST_SPREAD: f64 = 1e-6;

/// Means at each point, in the order of the fields.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellMeans {
    /// Mean stress of the point's cell, xx, yy, zz, yz, xz, xy (Pa).
    pub stress: Vec<[f64; 6]>,
    /// Its equivalent stress (Pa).
    pub von_mises: Vec<f64>,
    /// Its pressure (Pa).
    pub pressure: Vec<f64>,
    /// Equivalent strain rate around the cell (1/s); 0 where too few points tell.
    pub strain_rate: Vec<f64>,
}

/// A cell by its place in the grid, and whether it is the tail's.
type Key = ([i32; 3], bool);

/// Sums over the points of a cell; places in cells from the cell's middle.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    mass: f64,
    stress: [f64; 6],
    /// Σ m x, Σ m v, Σ m x x, Σ m v x.
    place: [f64; 3],
    velocity: [f64; 3],
    places: [[f64; 3]; 3],
    velocities: [[f64; 3]; 3],
}

/// The means of a frame; its cells are those of the grid, which begins at the workpiece's corner.
pub fn cell_means(fields: &PointFields) -> CellMeans {
    let cell = if fields.cell > 0.0 { fields.cell } else { f64::INFINITY };
    let key =
        |i: usize| -> Key { (fields.position[i].map(|x| (x / cell).floor() as i32), fields.is_tail(i)) };
    let mut cells: HashMap<Key, Sums> = HashMap::new();
    let mut is_plane = true;
    for (i, position) in fields.position.iter().enumerate() {
        let key = key(i);
        let (mass, sums) = (fields.mass[i], cells.entry(key).or_default());
        is_plane &= position[2] == 0.0;
        let from_middle: [f64; 3] = std::array::from_fn(|k| position[k] / cell - f64::from(key.0[k]) - 0.5);
        sums.mass += mass;
        for k in 0..6 {
            sums.stress[k] += mass * fields.stress[i][k];
        }
        for a in 0..3 {
            sums.place[a] += mass * from_middle[a];
            sums.velocity[a] += mass * fields.velocity[i][a];
            for b in 0..3 {
                sums.places[a][b] += mass * from_middle[a] * from_middle[b];
                sums.velocities[a][b] += mass * fields.velocity[i][a] * from_middle[b];
            }
        }
    }
    let axes = if is_plane { 2 } else { 3 };
    // In the order of nothing: each cell's values are its own.
    let of_cell: HashMap<Key, ([f64; 6], f64)> = cells
        .iter()
        .map(|(key, sums)| {
            let stress = sums.stress.map(|sum| sum / sums.mass);
            (*key, (stress, strain_rate(&cells, key, axes) / cell))
        })
        .collect();
    let mut means = CellMeans::default();
    for i in 0..fields.position.len() {
        let (stress, strain_rate) = of_cell[&key(i)];
        let pressure = -(stress[0] + stress[1] + stress[2]) / 3.0;
        let normal: f64 = stress[..3].iter().map(|s| (s + pressure).powi(2)).sum();
        let shear: f64 = stress[3..].iter().map(|s| s * s).sum();
        means.stress.push(stress);
        means.von_mises.push((1.5 * normal + 3.0 * shear).sqrt());
        means.pressure.push(pressure);
        means.strain_rate.push(strain_rate);
    }
    means
}

/// Equivalent strain rate around a cell, in speed per cell length (m/s).
fn strain_rate(cells: &HashMap<Key, Sums>, (at, is_tail): &Key, axes: usize) -> f64 {
    // The sums of the cells around, their places moved to this cell's middle.
    let mut all = Sums::default();
    let range = |axis: usize| if axis < axes { -1..=1 } else { 0..=0 };
    for i in range(0) {
        for j in range(1) {
            for k in range(2) {
                let Some(other) = cells.get(&([at[0] + i, at[1] + j, at[2] + k], *is_tail)) else { continue };
                let shift = [i, j, k].map(f64::from);
                all.mass += other.mass;
                for a in 0..3 {
                    all.place[a] += other.place[a] + other.mass * shift[a];
                    all.velocity[a] += other.velocity[a];
                    for b in 0..3 {
                        all.places[a][b] += other.places[a][b]
                            + other.place[a] * shift[b]
                            + shift[a] * other.place[b]
                            + other.mass * shift[a] * shift[b];
                        all.velocities[a][b] += other.velocities[a][b] + other.velocity[a] * shift[b];
                    }
                }
            }
        }
    }
    let mass = all.mass;
    let spread = |a: usize, b: usize| {
        if a.max(b) < axes { (all.places[a][b] - all.place[a] * all.place[b] / mass) / mass } else { 0.0 }
    };
    let moment = |a: usize, b: usize| (all.velocities[a][b] - all.velocity[a] * all.place[b] / mass) / mass;
    // An axis that there is not has a spread of one and no moment.
    let m = nalgebra::Matrix3::from_fn(|a, b| if a == b && a >= axes { 1.0 } else { spread(a, b) });
    let c = nalgebra::Matrix3::from_fn(|a, b| if b < axes { moment(a, b) } else { 0.0 });
    let inverse = if m.determinant() > LEAST_SPREAD { m.try_inverse() } else { None };
    let Some(inverse) = inverse else { return 0.0 };
    let gradient = c * inverse;
    let symmetric = 0.5 * (gradient + gradient.transpose());
    let d = symmetric - nalgebra::Matrix3::identity() * (symmetric.trace() / 3.0);
    (d.norm_squared() * 2.0 / 3.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points half a cell apart in 8 x 8 cells, with the stress and velocity that `at` gives.
    fn block(at: impl Fn(i32, i32, [f64; 2]) -> ([f64; 6], [f64; 3])) -> PointFields {
        let mut fields = PointFields { cell: 2e-5, ..PointFields::default() };
        for (i, j) in (0..16).flat_map(|i| (0..16).map(move |j| (i, j))) {
            let [x, y] = [i, j].map(|index| (f64::from(index) + 0.5) * 1e-5);
            let (stress, velocity) = at(i, j, [x, y]);
            fields.position.push([x, y, 0.0]);
            fields.velocity.push(velocity);
            fields.stress.push(stress);
            fields.mass.push(2e-9);
        }
        fields
    }

    /// What alternates from point to point is gone, what the cell has is left: a checkerboard of ±2 GPa on a
    /// shear of 0.5 GPa and a pressure of 0.3 GPa.
    #[test]
    fn a_checkerboard_has_no_mean() {
        let fields = block(|i, j, _| {
            let board = if (i + j) % 2 == 0 { 2e9 } else { -2e9 };
            ([board - 3e8, board - 3e8, board - 3e8, 0.0, 0.0, 5e8], [0.0; 3])
        });
        let means = cell_means(&fields);
        for i in 0..fields.position.len() {
            // Rounding of sums of 2e9.
            assert!((means.pressure[i] - 3e8).abs() < 10.0, "pressure {}", means.pressure[i]);
            assert!((means.von_mises[i] - 5e8 * 3f64.sqrt()).abs() < 10.0, "{}", means.von_mises[i]);
            assert!((means.stress[i][5] - 5e8).abs() < 10.0, "{:?}", means.stress[i]);
        }
    }

    /// Simple shear at 1e5 1/s has the equivalent rate γ̇/√3, a turning body none, stretching at 3e4 1/s in
    /// plane strain 2/√3 of that less what is volume: with d = diag(2, −1, −1) ε̇/3 it is 2/3 ε̇; and a
    /// checkerboard of velocities, which the grid does not see, leaves no trace inside.
    #[test]
    fn linear_velocity_fields_have_their_rates() {
        type Field = fn(i32, i32, [f64; 2]) -> [f64; 3];
        let cases: [(Field, f64); 4] = [
            (|_, _, [_, y]| [1e5 * y, 7.0, 0.0], 1e5 / 3f64.sqrt()),
            (|_, _, [x, y]| [-2e5 * y, 2e5 * x, 0.0], 0.0),
            (|_, _, [x, _]| [3e4 * x, 0.0, 0.0], 2e4),
            (|i, j, _| [if (i + j) % 2 == 0 { 9.0 } else { -9.0 }, 0.0, 0.0], 0.0),
        ];
        for (number, (velocity, expected)) in cases.into_iter().enumerate() {
            let fields = block(|i, j, x| ([0.0; 6], velocity(i, j, x)));
            for (i, rate) in cell_means(&fields).strain_rate.into_iter().enumerate() {
                let [x, y, _] = fields.position[i];
                // Six points a side have as many of one colour as of the other in each row.
                let is_inside = [x, y].iter().all(|&place| (2e-5..1.4e-4).contains(&place));
                if is_inside || number < 3 {
                    assert!((rate - expected).abs() < 1e-6 * 1e5, "case {number}: {rate} at {x}, {y}");
                }
            }
        }
    }

    /// A tail that passes through the chip makes no mean with it, and a lone point has no rate.
    #[test]
    fn a_tail_and_lone_points_stand_alone() {
        let mut fields = block(|_, _, [_, y]| ([1e9, 0.0, 0.0, 0.0, 0.0, 0.0], [1e5 * y, 0.0, 0.0]));
        let alone = cell_means(&fields);
        fields.tail = vec![false; fields.position.len()];
        for (position, is_tail) in [([3.1e-5, 3.1e-5, 0.0], true), ([9e-4, 9e-4, 0.0], false)] {
            fields.position.push(position);
            fields.velocity.push([1e3; 3]);
            fields.stress.push([-5e9; 6]);
            fields.mass.push(2e-9);
            fields.tail.push(is_tail);
        }
        let means = cell_means(&fields);
        assert_eq!(means.stress[..256], alone.stress[..]);
        assert_eq!(means.strain_rate[..256], alone.strain_rate[..]);
        assert_eq!(means.strain_rate[256..], [0.0; 2]);
        assert_eq!(means.stress[256], [-5e9; 6]);
    }
}
