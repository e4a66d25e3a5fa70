//! The whole paper cut at each level of speed: what it costs, and what it changes.

use cpu_time::ProcessTime;
use serde_json::{Value, json};
use swarf::scene::{Scene, Speed};
use swarf::session::Session;

/// Travel of the tool (m), and where the chip has settled, from which means are taken.
const TRAVEL: f64 = 2e-3;
const SETTLED: f64 = 1e-3;
/// Plastic strain above which material belongs to the chip (-), as for `chip_temperature`.
const CHIP_STRAIN: f64 = 0.05;

/// What a whole cut gives.
pub struct Cut {
    level: &'static str,
    result: Result<Numbers, String>,
}

struct Numbers {
    cpu: f64,
    /// Mean cutting and thrust force (N).
    force: [f64; 2],
    /// Mean plastic strain of the chip (-), and its mean temperature (K).
    strain: f64,
    temperature: f64,
}

/// Runs the cut at a point spacing (m) with every level; threads as the program chooses.
pub fn run_all(spacing: f64) -> Vec<Cut> {
    let levels = Speed::ALL.iter();
    levels
        .map(|&(level, speed)| {
            let mut scene = Scene::default();
            scene.numerics.point_spacing = spacing;
            scene.numerics.speed = speed;
            Cut { level, result: run(&scene) }
        })
        .collect()
}

fn run(scene: &Scene) -> Result<Numbers, String> {
    let mut session = Session::new(scene, 0.0).map_err(|e| e.to_string())?;
    let speed = scene.inputs.tool_velocity;
    let steps = 80;
    let begin = ProcessTime::now();
    let (mut impulse, mut last) = ([0.0; 2], 0.0);
    for k in 1..=steps {
        let time = TRAVEL / speed * f64::from(k) / f64::from(steps);
        session.advance_to(time, &mut |_| true).map_err(|e| e.to_string())?;
        if last * speed >= SETTLED {
            let outputs = session.outputs();
            impulse[0] += outputs.cutting_force * (time - last);
            impulse[1] += outputs.thrust_force * (time - last);
        }
        last = time;
    }
    let cpu = begin.elapsed().as_secs_f64();
    let fields = session.point_fields();
    let surface = scene.workpiece.height - scene.inputs.feed;
    let chip = fields.position.iter().zip(&fields.plastic_strain);
    let chip = chip.filter(|(position, strain)| position[1] > surface && **strain > CHIP_STRAIN);
    let (count, strain) = chip.fold((0.0, 0.0), |sum, (_, strain)| (sum.0 + 1.0, sum.1 + strain));
    let settled = (TRAVEL - SETTLED) / speed;
    Ok(Numbers {
        cpu,
        force: impulse.map(|component| component / settled),
        strain: strain / f64::max(count, 1.0),
        temperature: session.outputs().chip_temperature,
    })
}

impl Cut {
    /// Prints it, with differences to the exact one.
    pub fn print(&self, exact: &Cut) {
        match (&self.result, &exact.result) {
            (Ok(own), Ok(exact)) => {
                let [force, thrust, strain, rise] = own.differences(exact);
                println!(
                    "  {:<9} {:8.1} CPU s  force {:7.1} N ({force:+.2} %)  thrust {:7.1} N ({thrust:+.2} % of the \
                     force)  chip strain {:.3} ({strain:+.2} %)  temperature {:.1} K ({rise:+.2} %)",
                    self.level, own.cpu, own.force[0], own.force[1], own.strain, own.temperature
                );
            }
            (Err(text), _) | (_, Err(text)) => println!("  {:<9} refused: {text}", self.level),
        }
    }

    /// The same for the file.
    pub fn to_json(&self, exact: &Cut) -> Value {
        match (&self.result, &exact.result) {
            (Ok(own), Ok(exact)) => json!({
                "level": self.level,
                "cpu_s": own.cpu,
                "cutting_force_n": own.force[0],
                "thrust_force_n": own.force[1],
                "mean_chip_strain": own.strain,
                "mean_chip_temperature_k": own.temperature,
                "differences_percent_force_thrust_strain_temperature": own.differences(exact),
            }),
            (Err(text), _) | (_, Err(text)) => json!({"level": self.level, "refused": text}),
        }
    }
}

impl Numbers {
    /// Differences (%): force, thrust over the force, chip strain, chip temperature over its rise.
    fn differences(&self, exact: &Numbers) -> [f64; 4] {
        let rise = exact.temperature - Scene::default().workpiece.initial_temperature;
        [
            (self.force[0] - exact.force[0]) / exact.force[0],
            (self.force[1] - exact.force[1]) / exact.force[0],
            (self.strain - exact.strain) / exact.strain,
            (self.temperature - exact.temperature) / rise,
        ]
        .map(|difference| 100.0 * difference)
    }
}
