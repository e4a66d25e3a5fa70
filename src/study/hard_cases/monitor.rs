//! A cut that is looked at on its way: the worst of what must not happen in any cut.

use super::Sheet;
use crate::Error;
use crate::scene::{Constants, Inputs, Scene};
use crate::session::{Advance, Outputs, PointFields, Session};
use crate::tool::profile::ToolShape;
use rayon::prelude::*;

/// Inputs that stay as they are.
pub const NO_SLOPE: Inputs = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };

/// The reference cut at another spacing (m), on one thread: cases run side by side.
pub fn cut(point_spacing: f64) -> Scene {
    let mut scene = Scene::default();
    scene.numerics.point_spacing = point_spacing;
    scene.numerics.threads = 1;
    scene
}

/// Cell length (m).
pub fn cell(scene: &Scene) -> f64 {
    scene.numerics.cell()
}

/// Speed of elastic waves (m/s).
pub fn wave_speed(c: &Constants) -> f64 {
    let nu = c.poissons_ratio;
    (c.youngs_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu) * c.density)).sqrt()
}

/// The worst of all looks.
#[derive(Clone, Debug)]
pub struct Worst {
    /// Part of the work that is unaccounted for (-).
    pub ledger: f64,
    /// Smallest volume ratio (-).
    pub ratio: f64,
    /// Most points with a volume ratio outside 0.7–1.3.
    pub outside: usize,
    /// Largest velocity that a point keeps (m/s).
    pub speed: f64,
    /// Fastest motion of a point along an axis in the substeps before the looks (m/s).
    pub motion: f64,
    /// Depth of the deepest point inside the tool (cells); below 0 where none is inside.
    pub depth: f64,
    /// Most points with a plastic strain above 10.
    pub strained: usize,
    /// Largest equivalent stress (Pa).
    pub stress: f64,
    /// Smallest gain of plastic work between looks (J).
    pub plastic_gain: f64,
    /// Numbers that were none.
    pub not_finite: usize,
}

/// A run that is looked at after every communication step. It ends with its first error.
pub struct Watched {
    /// The run; none where the scene was refused.
    pub session: Option<Session>,
    /// Why it ended, if it did.
    pub error: Option<Error>,
    /// The worst so far.
    pub worst: Worst,
    /// Number of points.
    pub count: usize,
    shape: Option<ToolShape>,
    cell: f64,
    plastic: f64,
}

impl Watched {
    /// Starts a run at time 0.
    pub fn new(scene: &Scene) -> Self {
        let (session, error) = match Session::new(scene, 0.0) {
            Ok(session) => (Some(session), None),
            Err(error) => (None, Some(error)),
        };
        let tool = &scene.tool;
        let shape =
            ToolShape::new(tool.rake_angle, tool.clearance_angle, tool.edge_radius, tool.length, tool.height);
        let worst = Worst {
            ledger: 0.0,
            ratio: 1.0,
            outside: 0,
            speed: 0.0,
            motion: 0.0,
            depth: f64::MIN,
            strained: 0,
            stress: 0.0,
            plastic_gain: 0.0,
            not_finite: 0,
        };
        let count = session.as_ref().map_or(0, |session| session.point_fields().id.len());
        let cell = cell(session.as_ref().map_or(scene, Session::scene));
        Watched { session, error, worst, count, shape: shape.ok(), cell, plastic: 0.0 }
    }

    /// Runs for another `duration` (s) in `steps` communication steps of equal length.
    pub fn run(&mut self, duration: f64, steps: u32) -> &mut Self {
        for _ in 0..steps {
            let (None, Some(session)) = (&self.error, &mut self.session) else { break };
            let time = session.time() + duration / f64::from(steps);
            match session.advance_to(time, &mut |_| true) {
                Ok(Advance::Reached) => self.look(),
                Ok(Advance::StoppedAt(time)) => {
                    self.error = Some(Error::Unstable(format!("stopped at {time} s without being asked to")));
                }
                Err(error) => self.error = Some(error),
            }
        }
        self
    }

    /// Gives other inputs from here on.
    pub fn steer(&mut self, inputs: Inputs, slopes: Inputs) -> &mut Self {
        if let (None, Some(session)) = (&self.error, &mut self.session) {
            self.error = session.set_inputs(inputs, slopes).err();
        }
        self
    }

    /// The outputs, where there is a run.
    pub fn outputs(&self) -> Outputs {
        self.session.as_ref().map(|session| session.outputs().clone()).unwrap_or_default()
    }

    /// A figure of the run, and none where an error ended it.
    pub fn figure(&self, value: f64) -> f64 {
        if self.error.is_some() { f64::NAN } else { value }
    }

    /// The error's text, or nothing.
    pub fn remark(&self) -> String {
        self.error.as_ref().map_or(String::new(), ToString::to_string)
    }

    fn look(&mut self) {
        let Some(session) = &self.session else { return };
        let (o, fields) = (session.outputs(), session.point_fields());
        let worst = &mut self.worst;
        worst.ledger = worst.ledger.max(o.balance_error.abs());
        worst.ratio = worst.ratio.min(o.min_jacobian);
        let outside = fields.jacobian.iter().filter(|&&j| !(0.7..=1.3).contains(&j)).count();
        worst.outside = worst.outside.max(outside);
        let strained = fields.plastic_strain.iter().filter(|&&strain| strain > 10.0).count();
        worst.strained = worst.strained.max(strained);
        let speeds = fields.velocity.iter().map(|v| v.iter().map(|v| v * v).sum::<f64>().sqrt());
        worst.speed = speeds.fold(worst.speed, f64::max);
        worst.motion = worst.motion.max(session.fastest_motion());
        worst.stress = fields.stress.iter().map(equivalent_stress).fold(worst.stress, f64::max);
        worst.plastic_gain = worst.plastic_gain.min(o.plastic_work - self.plastic);
        self.plastic = o.plastic_work;
        if let Some(shape) = &self.shape {
            for p in &fields.position {
                let relative = [p[0] - o.tool_position_x, p[1] - o.tool_position_y];
                worst.depth = worst.depth.max(-shape.closest(relative).distance / self.cell);
            }
        }
        worst.not_finite += not_finite(&fields) + outputs_not_finite(o);
    }
}

/// √(3/2 s:s) of a stress (Pa).
fn equivalent_stress(s: &[f64; 6]) -> f64 {
    let normal = (s[0] - s[1]).powi(2) + (s[1] - s[2]).powi(2) + (s[2] - s[0]).powi(2);
    (0.5 * normal + 3.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5])).sqrt()
}

/// Numbers of the points that are not finite.
pub fn not_finite(fields: &PointFields) -> usize {
    let vectors = fields.position.iter().chain(&fields.velocity).flatten();
    let scalars = fields.plastic_strain.iter().chain(&fields.temperature).chain(&fields.jacobian);
    let all = vectors.chain(scalars).chain(fields.stress.iter().flatten());
    all.filter(|value| !value.is_finite()).count()
}

/// Outputs that are not finite.
pub fn outputs_not_finite(outputs: &Outputs) -> usize {
    crate::variables::COLUMNS.iter().filter(|column| !(column.value)(outputs).is_finite()).count()
}

/// Cuts `travel` (m) at the scenes' speeds in `steps` looks each, side by side, in the order given.
pub fn cut_all(scenes: &[Scene], travel: f64, steps: u32) -> Vec<Watched> {
    scenes
        .par_iter()
        .with_max_len(1)
        .map(|scene| {
            let mut run = Watched::new(scene);
            run.run(travel / scene.inputs.tool_velocity, steps);
            run
        })
        .collect()
}

/// The bounds of any cut: ledger within 1 %, no volume ratio below 0.3, nothing that is no number.
pub fn soundness(sheet: &mut Sheet, name: &str, run: &Watched) {
    let retries = run.outputs().retries;
    let ledger = run.figure(100.0 * run.worst.ledger);
    sheet.at_most(format!("{name}: ledger"), ledger, "%", 1.0).retried(retries).remarked(run.remark());
    let ratio = run.figure(run.worst.ratio);
    sheet.at_least(format!("{name}: smallest volume ratio"), ratio, "", 0.3).retried(retries);
    if run.worst.not_finite > 0 {
        sheet.at_most(format!("{name}: numbers that are none"), run.worst.not_finite as f64, "", 0.0);
    }
}

/// A number in [0, 1) that looks random and belongs to its key (Steele, Lea and Flood's SplitMix64).
pub fn random(key: u64) -> f64 {
    let mut z = key.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}
