//! Whole cuts: CPU seconds, forces once the chip has settled, and the chip, for comparing one way to compute
//! with another.

use cpu_time::ProcessTime;
use serde_json::{Value, json};
use std::time::Instant;
use swarf::scene::Scene;
use swarf::scene::speed_levels;
use swarf::session::Session;

/// Plastic strain above which material belongs to the chip (-), as for `chip_temperature`.
const CHIP_STRAIN: f64 = 0.05;
/// Share of its strength that material keeps at least where it counts as solid (-).
const SOLID: f64 = 0.01;
/// Communication steps of a cut.
const STEPS: u32 = 80;

/// A cut, how far it goes and from where on its forces are taken.
pub struct Plan {
    /// The scene.
    pub scene: Scene,
    /// Travel of the tool (m).
    pub travel: f64,
    /// Travel after which the chip has settled (m).
    pub settled: f64,
}

/// What a whole cut gives.
#[derive(Clone, Debug)]
pub struct Numbers {
    /// Points at the start.
    points: i32,
    /// CPU seconds of all threads, and seconds of wall time.
    pub cpu: f64,
    wall: f64,
    substeps: u64,
    /// Mean cutting and thrust force over the width (N/m).
    pub force: [f64; 2],
    /// Mean plastic strain of the chip (-), and its mean temperature (K).
    strain: f64,
    temperature: f64,
    /// Points of the chip that heat has left next to no strength, and the mean plastic strain of the others
    /// (-).
    melted: usize,
    solid_strain: f64,
    /// Temperature at the start (K).
    start_temperature: f64,
    /// Error of the energy ledger over the tool's work (-).
    balance_error: f64,
    /// Factor on the mass (-).
    mass_factor: f64,
}

impl Plan {
    /// Runs the cut.
    ///
    /// # Errors
    /// What the program says against the scene, or of its end.
    pub fn run(&self) -> Result<Numbers, String> {
        let scene = &self.scene;
        let (begin, clock) = (ProcessTime::now(), Instant::now());
        let mut session = Session::new(scene, 0.0).map_err(|e| e.to_string())?;
        let speed = scene.inputs.tool_velocity;
        let (mut impulse, mut last, mut substeps, mut points) = ([0.0; 2], 0.0, 0, 0);
        let mut from = None;
        for k in 1..=STEPS {
            let time = self.travel / speed * f64::from(k) / f64::from(STEPS);
            session.advance_to(time, &mut |_| true).map_err(|e| e.to_string())?;
            let outputs = session.outputs();
            substeps += u64::from(outputs.substeps.unsigned_abs());
            if k == 1 {
                points = outputs.active_points;
            }
            if last * speed >= self.settled * (1.0 - 1e-9) {
                from = from.or(Some(last));
                impulse[0] += outputs.cutting_force * (time - last);
                impulse[1] += outputs.thrust_force * (time - last);
            }
            last = time;
        }
        let (cpu, wall) = (begin.elapsed().as_secs_f64(), clock.elapsed().as_secs_f64());
        let fields = session.point_fields();
        let surface = scene.workpiece.height - scene.inputs.feed;
        let chip = fields.position.iter().zip(&fields.plastic_strain).zip(&fields.temperature);
        let chip = chip.filter(|((position, strain), _)| position[1] > surface && **strain > CHIP_STRAIN);
        let chip: Vec<(f64, f64)> = chip.map(|((_, &strain), &temperature)| (strain, temperature)).collect();
        let molten = melting(scene);
        let solid: Vec<(f64, f64)> = chip.iter().copied().filter(|point| point.1 < molten).collect();
        let mean_strain = |points: &[(f64, f64)]| {
            points.iter().map(|point| point.0).sum::<f64>() / f64::max(points.len() as f64, 1.0)
        };
        let settled = last - from.unwrap_or(last);
        let outputs = session.outputs();
        Ok(Numbers {
            points,
            cpu,
            wall,
            substeps,
            force: impulse.map(|component| component / settled / scene.workpiece.width),
            strain: mean_strain(&chip),
            temperature: outputs.chip_temperature,
            melted: chip.len() - solid.len(),
            solid_strain: mean_strain(&solid),
            start_temperature: scene.workpiece.initial_temperature,
            balance_error: outputs.balance_error,
            mass_factor: outputs.mass_factor,
        })
    }
}

/// Temperature (K) at which the material keeps the share `SOLID` of its strength, 1 − T*ᵐ; infinite where
/// heat does not soften it.
fn melting(scene: &Scene) -> f64 {
    if !scene.effects.thermal_softening {
        return f64::INFINITY;
    }
    let constants = &scene.material.constants;
    let homologous = (1.0 - SOLID).powf(1.0 / constants.thermal_exponent);
    constants.reference_temperature
        + homologous * (constants.melting_temperature - constants.reference_temperature)
}

impl Numbers {
    /// Prints a cut with its differences to another one.
    pub fn print(&self, name: &str, other: &Numbers) {
        let [force, thrust, strain, rise] = self.differences(other);
        let solid = 100.0 * (self.solid_strain / other.solid_strain - 1.0);
        println!(
            "  {name:<26} {:8.1} CPU s {:7.1} s  force {:7.2} N/mm ({force:+.2} %)  thrust {:7.2} \
             ({thrust:+.2} % of the force)  strain {:.3} ({strain:+.2} %), without {} melted points {:.3} \
             ({solid:+.2} %)  {:.1} K ({rise:+.2} %)  ledger {:.3} %  mass x {:.3}",
            self.cpu,
            self.wall,
            self.force[0] * 1e-3,
            self.force[1] * 1e-3,
            self.strain,
            self.melted,
            self.solid_strain,
            self.temperature,
            100.0 * self.balance_error,
            self.mass_factor
        );
    }

    /// The same for the file.
    pub fn to_json(&self, name: &str, other: &Numbers) -> Value {
        json!({
            "cut": name,
            "points": self.points,
            "cpu_s": self.cpu,
            "wall_s": self.wall,
            "substeps": self.substeps,
            "cpu_ns_per_point_step": 1e9 * self.cpu / (f64::from(self.points) * self.substeps as f64),
            "cutting_force_n_per_m": self.force[0],
            "thrust_force_n_per_m": self.force[1],
            "mean_chip_strain": self.strain,
            "melted_points": self.melted,
            "mean_solid_chip_strain": self.solid_strain,
            "mean_chip_temperature_k": self.temperature,
            "ledger_error": self.balance_error,
            "mass_factor": self.mass_factor,
            "differences_percent_force_thrust_strain_temperature": self.differences(other),
        })
    }

    /// Differences (%): force, thrust over the force, chip strain, chip temperature over its rise.
    fn differences(&self, other: &Numbers) -> [f64; 4] {
        [
            (self.force[0] - other.force[0]) / other.force[0],
            (self.force[1] - other.force[1]) / other.force[0],
            (self.strain - other.strain) / other.strain,
            (self.temperature - other.temperature) / (other.temperature - other.start_temperature),
        ]
        .map(|difference| 100.0 * difference)
    }
}

/// Runs cuts one after another, prints each with its difference to the first that ran, and returns them for
/// the file.
pub fn compare(plans: impl IntoIterator<Item = (String, Plan)>) -> Vec<Value> {
    let mut first = None;
    let run = |(name, plan): (String, Plan)| match plan.run() {
        Ok(numbers) => {
            let other = first.get_or_insert_with(|| numbers.clone());
            numbers.print(&name, other);
            numbers.to_json(&name, other)
        }
        Err(text) => {
            println!("  {name:<26} refused: {text}");
            json!({"cut": name, "refused": text})
        }
    };
    plans.into_iter().map(run).collect()
}

/// Runs each plan with several Courant numbers, the plan's times `COURANT_FACTORS`, and compares the means
/// with those of the first plan: what a level changes shows only against the scatter of runs that differ by
/// nothing that matters.
pub fn compare_means(plans: impl IntoIterator<Item = (String, Plan)>) -> Vec<Value> {
    let mut first = None;
    let run = |(name, plan): (String, Plan)| {
        let runs: Result<Vec<Numbers>, String> = COURANT_FACTORS
            .iter()
            .map(|factor| {
                let mut scene = plan.scene.clone();
                speed_levels::apply(&mut scene);
                scene.numerics.courant *= factor;
                Plan { scene, ..plan }.run()
            })
            .collect();
        let runs = match runs {
            Ok(runs) => runs,
            Err(text) => {
                println!("  {name:<26} refused: {text}");
                return json!({"cut": name, "refused": text});
            }
        };
        let means = Means::of(&runs);
        let other = first.get_or_insert_with(|| means.clone());
        let [force, thrust, strain, rise] = means.differences(other);
        println!(
            "  {name:<26} {:8.1} CPU s  force {:.1} ± {:.1} N/mm ({force:+.2} %)  thrust {:.1} ± {:.1} \
             ({thrust:+.2} % of the force)  strain {:.3} ± {:.3} ({strain:+.2} %)  rise {:.1} ± {:.1} K \
             ({rise:+.2} %)  ledger {:.3} %",
            means.cpu,
            means.figures[0] * 1e-3,
            means.scatter[0] * 1e-3,
            means.figures[1] * 1e-3,
            means.scatter[1] * 1e-3,
            means.figures[2],
            means.scatter[2],
            means.figures[3],
            means.scatter[3],
            100.0 * means.balance_error,
        );
        json!({
            "cut": name,
            "courant_factors": COURANT_FACTORS,
            "cpu_s_mean": means.cpu,
            "mean_force_n_per_m_thrust_n_per_m_strain_rise_k": means.figures,
            "standard_deviation": means.scatter,
            "differences_percent_force_thrust_strain_rise": means.differences(other),
            "runs": runs.iter().map(|numbers| numbers.to_json(&name, &runs[0])).collect::<Vec<_>>(),
        })
    };
    plans.into_iter().map(run).collect()
}

/// Time steps that differ by as little as can matter to nobody.
const COURANT_FACTORS: [f64; 3] = [0.94, 0.97, 1.0];

/// Means over runs.
#[derive(Clone, Debug)]
struct Means {
    cpu: f64,
    /// Forces (N/m), mean strain (-) and rise of temperature (K) of the chip; and their standard deviations.
    figures: [f64; 4],
    scatter: [f64; 4],
    /// The largest error of the ledger (-).
    balance_error: f64,
}

impl Means {
    fn of(runs: &[Numbers]) -> Self {
        let n = runs.len() as f64;
        let figures =
            |run: &Numbers| [run.force[0], run.force[1], run.strain, run.temperature - run.start_temperature];
        let mean = |of: &dyn Fn(&Numbers) -> f64| runs.iter().map(of).sum::<f64>() / n;
        let means: [f64; 4] = std::array::from_fn(|k| mean(&|run| figures(run)[k]));
        let squares = |k: usize| mean(&|run| (figures(run)[k] - means[k]).powi(2));
        Means {
            cpu: mean(&|run| run.cpu),
            figures: means,
            scatter: std::array::from_fn(|k| (squares(k) * n / (n - 1.0)).sqrt()),
            balance_error: runs.iter().map(|run| run.balance_error.abs()).fold(0.0, f64::max),
        }
    }

    /// Differences (%): force, thrust over the force, chip strain, rise of the chip's temperature.
    fn differences(&self, other: &Means) -> [f64; 4] {
        let (own, base) = (&self.figures, &other.figures);
        let scales = [base[0], base[0], base[2], base[3]];
        std::array::from_fn(|k| 100.0 * (own[k] - base[k]) / scales[k])
    }
}
