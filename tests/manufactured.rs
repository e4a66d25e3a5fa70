//! Manufactured solutions with a material of the tests' own (`study::verification::manufactured`).

use swarf::dimension::{PlaneStrain, ThreeDimensional};
use swarf::grid::shape_function::Gimp;
use swarf::study::verification::manufactured::{AxisAligned, Vortex, axis_aligned, order, vortex};

/// The formulas give the published samples (tests/data/mms_body_force_samples.csv, its origin is in the
/// README there), whose 15 digits leave some roundings of terms that cancel.
#[test]
fn body_forces_match_the_samples() {
    let mut compared = [0, 0];
    for row in include_str!("data/mms_body_force_samples.csv").lines().skip(1) {
        let (case, numbers) = row.split_once(',').expect("a case and its numbers");
        let x: Vec<f64> = numbers.split(',').map(|cell| cell.parse().expect("a number")).collect();
        let (place, time, printed) = ([x[0], x[1], x[2]], x[3], [x[4], x[5], x[6]]);
        let force = match case {
            "axis_aligned_3D" => {
                compared[0] += 1;
                AxisAligned::new(0.05, 3).body_force(place, time)
            }
            "generalized_vortex" => {
                compared[1] += 1;
                let solution = Vortex::new(1.0);
                solution.body_force(solution.motion(place, time).0, time)
            }
            _ => continue,
        };
        let size = printed.iter().map(|b: &f64| b.abs()).fold(0.0, f64::max);
        for axis in 0..3 {
            assert!(
                (force[axis] - printed[axis]).abs() < 1e-11 * size,
                "{case}: b = {force:?} m/s2, printed {printed:?}"
            );
        }
    }
    assert_eq!(compared, [4, 5], "samples of the two motions");
}

/// Second order in the cell, 1.9 in the issue, while no point changes its cell. Valid for amplitudes up to
/// 1e-3 (strains of 0.3 %): points keep the size of their square, and what that leaves over or takes twice
/// grows with the strain.
#[test]
fn axis_aligned_motion_converges_at_second_order() {
    let runs = [8, 16, 32, 64].map(|cells| axis_aligned::<PlaneStrain, _>(Gimp::new(2), cells, 1e-3, 0.01));
    let errors: Vec<f64> = runs.iter().map(|run| run.error).collect();
    let orders = [order(errors[1], errors[2]), order(errors[2], errors[3])];
    println!("errors {errors:.6?} of the amplitude, orders {orders:.3?}");
    assert!(runs.iter().all(|run| run.changed_cells == 0), "points have changed cell");
    assert!(orders.iter().all(|&order| order >= 1.9), "orders {orders:?} from errors {errors:?}");
    let space =
        [8, 16].map(|cells| axis_aligned::<ThreeDimensional, _>(Gimp::new(2), cells, 1e-3, 0.005).error);
    println!("in space: errors {space:.6?}, order {:.3}", order(space[0], space[1]));
    assert!(order(space[0], space[1]) >= 1.9, "in space: errors {space:?}");
}

/// At 0.05 strains reach 16 % and the order falls below 1.7 when points change cell: the range above is no
/// modesty.
#[test]
fn axis_aligned_order_ends_with_the_strain() {
    let errors = [16, 32].map(|cells| axis_aligned::<PlaneStrain, _>(Gimp::new(2), cells, 0.05, 0.02).error);
    println!("errors {errors:.6?} of the amplitude, order {:.3}", order(errors[0], errors[1]));
    assert!(order(errors[0], errors[1]) < 1.7 && errors[1] < 0.03, "errors {errors:?}");
}

/// Order 1.7 in the issue: reached for small turns over the whole time, and at the published amplitude of 1
/// rad until 0.1 s, when the shear has reached 1.9. Later the points' squares, which do not follow the shear,
/// lose touch with each other and the error saturates at 0.7 of the amplitude, whatever the cell.
#[test]
fn generalised_vortex_converges_until_the_points_part() {
    for (amplitude, end) in [(1e-3, 1.0), (1.0, 0.1)] {
        let errors = [32, 64].map(|cells| vortex(Gimp::new(2), cells, amplitude, end).error);
        println!("A = {amplitude} to {end} s: errors {errors:.6?}, order {:.3}", order(errors[0], errors[1]));
        assert!(order(errors[0], errors[1]) >= 1.7, "A = {amplitude} to {end} s: errors {errors:?}");
    }
    let errors = [16, 32].map(|cells| vortex(Gimp::new(2), cells, 1.0, 1.0).error);
    println!("A = 1 to 1 s: errors {errors:.6?}");
    assert!(errors.iter().all(|&error| (0.5..1.0).contains(&error)), "A = 1 to 1 s: errors {errors:?}");
}
