//! Two elastic disks that collide through the grid (`study::verification::disks`).

use swarf::study::verification::disks::{Settings, run, run_affine};

/// All forces are internal, so momentum stays zero: 1e-13 of Σ m |v| is the bound. The material
/// dissipates nothing; 1 % of energy lost is the bound, kept on this grid with four by four points
/// per cell and a Courant number of 0.1 until the disks have parted (the free flight before they meet is left
/// out, it loses nothing).
#[test]
fn colliding_disks_keep_momentum_and_nearly_all_energy() {
    let outcome = run(Settings { per_edge: 4, cells: 60, courant: 0.1, from: 1.35, end: 2.6 });
    println!(
        "momentum {:.1e}, energy lost {:.3} %, centres part at {:.3} of their speed",
        outcome.momentum_drift,
        100.0 * outcome.energy_loss,
        outcome.restitution
    );
    assert!(outcome.momentum_drift < 1e-13, "momentum {:e} of Σ m |v|", outcome.momentum_drift);
    assert!(outcome.energy_loss.abs() < 0.01, "{:e} of the energy is lost", outcome.energy_loss);
    let elastic = outcome.history[1].iter().map(|entry| entry.1).fold(0.0, f64::max);
    assert!(elastic > 0.9, "only {elastic} of the energy became elastic: the disks hardly met");
}

/// What is lost is the scheme's and falls with the cell.
#[test]
fn the_loss_falls_with_the_cell() {
    let losses = [20, 40]
        .map(|cells| run(Settings { per_edge: 2, cells, courant: 0.1, from: 1.0, end: 3.5 }).energy_loss);
    println!("energy lost on 20 and 40 cells per metre: {losses:.4?}");
    assert!(losses[1] > 0.0 && losses[1] < 0.65 * losses[0], "losses {losses:?}");
}

/// The affine transfer keeps momentum too, and loses more energy than FLIP, as its points take the grid's
/// filtered velocity.
#[test]
fn the_affine_transfer_keeps_momentum_and_loses_more_energy() {
    let settings = Settings { per_edge: 2, cells: 40, courant: 0.1, from: 1.35, end: 2.6 };
    let (flip, apic) = (run(settings), run_affine(settings));
    println!("energy lost: FLIP {:.4}, APIC {:.4}", flip.energy_loss, apic.energy_loss);
    assert!(apic.momentum_drift < 1e-13, "momentum {:e} of Σ m |v|", apic.momentum_drift);
    assert!(
        apic.energy_loss > flip.energy_loss,
        "APIC loses {}, FLIP {}",
        apic.energy_loss,
        flip.energy_loss
    );
}
