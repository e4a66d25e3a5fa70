//! Thermal expansion of free and confined blocks.

use swarf::dimension::{PlaneStrain, ThreeDimensional};
use swarf::study::verification::expansion::{RISE, confined, free_in_plane_strain, free_stretch, run};

/// The exact solutions of the law turn into those of small strains: the project's reference for AISI 4340 at
/// 100 K (`analytic_reference.json`, "thermal_expansion") has strains of 1.35e-3 and 1.755e-3, −279.45 MPa
/// across the plane and a pressure of 698.625 MPa.
#[test]
fn exact_solutions_become_those_of_small_strains() {
    // A hundred thousandth of the rise: quadratic terms are below 1e-7 of the linear ones.
    let small = 1e-5 * RISE;
    let (stretch, across) = free_in_plane_strain(small);
    let pairs = [
        (free_stretch(small) - 1.0, 1.35e-3),
        (stretch - 1.0, 1.755e-3),
        (across, -279.45e6),
        (-confined(small), 698.625e6),
    ];
    for (exact, reference) in pairs {
        assert!((exact / (1e-5 * reference) - 1.0).abs() < 1e-6, "{exact}, reference {}", 1e-5 * reference);
    }
}

/// A block without walls takes the stretch that heat alone gives, and in plane strain the stress across.
#[test]
fn a_free_block_expands_without_stress() {
    let free = run::<ThreeDimensional>(false, RISE);
    let strain = free.volume_ratio.cbrt() - 1.0;
    assert!((strain - 1.35e-3).abs() < 1e-6, "strain {strain}");
    let plane = run::<PlaneStrain>(false, RISE);
    let (stretch, across) = free_in_plane_strain(RISE);
    let strain = plane.volume_ratio.sqrt() - stretch;
    println!(
        "free in space {:e}, in the plane {strain:e}, stress {:?}, exact {across}",
        free.volume_ratio.cbrt() - 1.00135,
        plane.stress
    );
    assert!(strain.abs() < 1e-6, "the strain is off by {strain}");
    assert!((plane.stress[1] / across - 1.0).abs() < 1e-3, "{:?} Pa, exact {across} Pa", plane.stress);
}

/// Walls that keep the volume feel the whole bulk modulus.
#[test]
fn a_confined_block_is_under_pressure() {
    let held = run::<PlaneStrain>(true, RISE);
    let error = held.stress[0] / confined(RISE) - 1.0;
    println!("confined {error:e}");
    assert!(
        error.abs() < 1e-6 && (held.volume_ratio - 1.0).abs() < 1e-9,
        "{held:?}, exact {} Pa",
        confined(RISE)
    );
}
