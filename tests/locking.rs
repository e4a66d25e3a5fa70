//! The volumetric locking control: what it limits, what it leaves alone, and what it must conserve.

mod common;

use common::{Lattice, Random, SteelBlock, SteelState, distant_tool, elastic, points, steel_4340, total};
use swarf::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use swarf::grid::shape_function::Gimp;
use swarf::material::ConstitutiveModel;
use swarf::stabilization::volumetric_locking::LockingControl;

/// A block whose points have a smooth volume strain and, every seventh of them, one of `noise` on top.
fn noisy_block<D: Dimension>(noise: f64) -> SteelBlock<D, Gimp<f64>> {
    let (domain, cells) = if D::AXES == 2 { ([50, 50, 1], [12, 9, 1]) } else { ([24, 24, 24], [6, 5, 4]) };
    let corner = [10, 10, if D::AXES == 2 { 0 } else { 10 }];
    let lattice = Lattice { domain, corner, cells, per_edge: 2, cell: 2e-5, fixed: vec![], courant: 0.5 };
    let mut random = Random(7);
    lattice.build(&steel_4340(), Gimp::new(2), distant_tool(), |x, state: &mut SteelState<D>, lane| {
        let smooth = 4e-3 * (2e4 * x[0]).sin();
        let is_noisy = random.within(0.0, 7.0) < 1.0;
        state.jacobian[lane] = 1.0 + smooth + if is_noisy { random.one_of(&[-noise, noise]) } else { 0.0 };
        for component in 0..D::DEVIATOR {
            state.deviator[component][lane] = random.within(-3e8, 3e8);
        }
        [random.within(-5.0, 5.0), random.within(-5.0, 5.0), random.within(-5.0, 5.0)]
    })
}

/// All records that the next substep reads.
fn deposits<D: Dimension>(block: &SteelBlock<D, Gimp<f64>>) -> Vec<f64> {
    block.partition.incoming.iter().flat_map(|run| run.records.iter().flat_map(|r| r.0)).collect()
}

/// The control takes exactly the energy it says, and the nodes feel exactly the new pressures: as if every
/// point had been deposited anew.
fn control_is_consistent<D: Dimension>() {
    let mut block = noisy_block::<D>(0.04);
    let (before, old) = (points(&block), deposits(&block));
    let mut control = LockingControl::default();
    let taken = control.limit_deviations(&mut block.partition, &Gimp::new(2), &block.model, false);
    let (after, now) = (points(&block), deposits(&block));
    let fallen = total(&before, elastic) - total(&after, elastic);
    println!("{} of {} J taken", taken, total(&before, elastic));
    assert!(taken > 0.01 * total(&before, elastic), "the control took {taken} J from a noisy block");
    // Two sums of some thousand terms.
    assert!((taken - fallen).abs() <= 1e-12 * fallen, "took {taken} J, the points lost {fallen} J");

    let anew = SteelBlock::new(
        block.partition.clone(),
        (block.shape, block.model),
        block.tool.clone(),
        block.contact.clone(),
        block.options.clone(),
    );
    let exact = deposits(&anew);
    let scale = exact.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    let worst = exact.iter().zip(&now).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let moved = old.iter().zip(&now).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!(
        "deposits differ by {:.1e} of the largest; the control changed them by {:.1e}",
        worst / scale,
        moved / scale
    );
    // Forces are sums of some ten terms each; the change itself is a few percent.
    assert!(
        worst <= 1e-13 * scale && moved > 1e-3 * scale,
        "deposits off by {worst} of {scale}, moved {moved}"
    );
}

/// See `control_is_consistent`.
#[test]
fn the_control_takes_the_energy_it_says_and_the_forces_follow() {
    control_is_consistent::<PlaneStrain>();
    control_is_consistent::<ThreeDimensional>();
}

/// What a wave or a shear band may have, deviations below the pressure under a punch, is not touched; neither
/// is any deviation in a material that never yields.
#[test]
fn small_deviations_are_left_alone() {
    let threshold = 2.968 * 792e6 / (207e9 / 1.2);
    let mut control = LockingControl::default();
    // Neighbours with noise of the other sign pull the average away by less than the noise.
    let mut block = noisy_block::<PlaneStrain>(0.5 * threshold);
    let before = points(&block);
    let taken = control.limit_deviations(&mut block.partition, &Gimp::new(2), &block.model, false);
    assert_eq!(taken, 0.0, "energy taken from deviations of half to all of the threshold");
    assert!(points(&block).iter().zip(&before).all(|(a, b)| a.report == b.report), "a point was changed");

    let mut block = noisy_block::<PlaneStrain>(0.04);
    block.model = common::steel(&common::never_yielding(steel_4340()));
    let taken = control.limit_deviations(&mut block.partition, &Gimp::new(2), &block.model, false);
    assert_eq!(taken, 0.0, "energy taken from a material that never yields");
}

/// Applied again and again, the control leaves no point further from the average around it than the
/// threshold. Averages move with the points, so once is not enough; the rest falls by more than half each
/// time.
#[test]
fn deviations_end_at_the_threshold() {
    let mut block = noisy_block::<PlaneStrain>(0.06);
    let mut control = LockingControl::default();
    let extreme = |block: &SteelBlock<PlaneStrain, Gimp<f64>>| {
        points(block).iter().map(|p| (p.report.jacobian - 1.0).abs()).fold(0.0, f64::max)
    };
    let start = extreme(&block);
    let mut taken = vec![];
    for _ in 0..12 {
        taken.push(control.limit_deviations(&mut block.partition, &Gimp::new(2), &block.model, false));
    }
    let threshold = 2.968_408_5 * ConstitutiveModel::<f64, PlaneStrain>::yield_volume_strain(&block.model);
    println!(
        "largest volume strain {start:.4} before, {:.4} after; threshold {threshold:.4}; {taken:?} J",
        extreme(&block)
    );
    assert!(taken[11] <= 1e-4 * taken[0], "energy taken in turn: {taken:?} J");
    // The smooth part, 0.004, and what averages of noisy points keep of the noise.
    assert!(extreme(&block) < threshold + 0.012, "a volume strain of {} is left", extreme(&block));
}
