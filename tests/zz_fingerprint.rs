//! x
use swarf::scene::Inputs;
use swarf::variables::COLUMNS;
use swarf::{Scene, Session};
fn hash(bytes: impl IntoIterator<Item = u64>) -> u64 {
    bytes.into_iter().fold(0xcbf29ce484222325, |h, b| (h ^ b).wrapping_mul(0x100000001b3).rotate_left(7))
}
#[test]
fn fingerprint() {
    for spacing in [4e-5, 2.5e-5] {
        let mut scene = Scene::default();
        scene.numerics.point_spacing = spacing;
        scene.numerics.threads = 1;
        let mut session = Session::new(&scene, 0.0).unwrap();
        for k in 1..=8 {
            let end = 7.3e-7 * f64::from(k);
            let inputs = Inputs { feed: 3e-4 + 1e-6 * f64::from(k), ..scene.inputs };
            let slopes = Inputs { tool_velocity: 1e5, feed: 0.0, friction: 1e3 };
            let _ = session.set_inputs(inputs, slopes);
            session.advance_to(end, &mut |_| true).unwrap();
            let line: Vec<String> =
                COLUMNS.iter().map(|c| format!("{}={:e}", c.name, (c.value)(session.outputs()))).collect();
            println!("FP {spacing} {k} {}", line.join(" "));
            let f = session.point_fields();
            let bits = f
                .position
                .iter()
                .flatten()
                .chain(f.velocity.iter().flatten())
                .chain(f.stress.iter().flatten())
                .chain(&f.temperature)
                .chain(&f.plastic_strain)
                .chain(&f.jacobian)
                .map(|v| v.to_bits());
            println!("FP {spacing} {k} points {:016x}", hash(bits));
        }
    }
}
