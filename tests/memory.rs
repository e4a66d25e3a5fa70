//! The paper's resolution fits into little memory: a test program of its own, since the measure is the
//! process's.

use swarf::scene::Scene;
use swarf::session::Session;

/// Most memory this process ever had resident (MB), where the system tells.
fn peak_resident() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes / 1e3)
}

/// 120,000 points, run past several sorts by two threads, need less than 64 MB (the project's own bound; the
/// points' state is 13 MB, and sorting keeps a second set).
#[test]
fn the_papers_resolution_runs_in_64_megabytes() {
    let mut scene = Scene::default();
    scene.numerics.point_spacing = 5e-6;
    scene.numerics.threads = 2;
    // Fast, so that points move far enough to be sorted.
    scene.inputs.tool_velocity = 200.0;
    let mut session = Session::new(&scene, 0.0).expect("a good scene");
    session.advance_to(8e-8, &mut |_| true).expect("a stable run");
    assert_eq!(session.outputs().active_points, 120_000);
    assert!(session.outputs().substeps > 60, "{} substeps", session.outputs().substeps);
    let Some(megabytes) = peak_resident() else {
        println!("this system does not tell the peak of resident memory");
        return;
    };
    println!("peak resident memory {megabytes:.1} MB");
    assert!(megabytes < 64.0, "peak resident memory {megabytes:.1} MB");
}
