//! One Johnson–Cook point along a straight path of deformation, against the continuous equations.
//!
//! Two paths at a constant rate D of the equivalent strain: plane-strain compression, F = diag(e^−√¾Dt,
//! e^√¾Dt, 1), and simple shear, F = I + √3 D t e_x ⊗ e_y. The continuous equations, for the Kirchhoff
//! deviator s with q = √(3/2 s:s):
//!
//! ds/dt = w s − s w + 2 μ (d − 3/2 ε̄̇ s/q),  dT/dt = β q ε̄̇/(ρ c),
//!
//! with d and w the symmetric and skew part of the velocity gradient, and the plastic rate ε̄̇
//!
//! * 0 below yield, q < Y(ε̄, T) = (A + B ε̄ⁿ)(1 − T*ᵐ);
//! * below the reference rate, where the law knows no rate, that which keeps q = Y:
//!   ε̄̇ = 3 μ (s:d)/q / (3 μ + ∂Y/∂ε̄ + ∂Y/∂T β q/(ρ c));
//! * else that at which q = Y (1 + C ln(ε̄̇/ε̇₀)): ε̄̇ = ε̇₀ exp((q/Y − 1)/C).
//!
//! They are solved with Dormand and Prince's embedded method of order 5 (1980,
//! doi:10.1016/0771-050X(80)90013-3) at a tolerance of 1e-11, with ξ = ε̄ⁿ in the place of ε̄, whose slope is
//! finite at first yield. Nothing is shared with the solver but the constants.

use super::Report;
use super::report::{line, logarithms, panel};
use crate::dimension::PlaneStrain;
use crate::material::{ConstitutiveModel, StepSums};
use crate::points::PointState;
use crate::scene::Constants;
use crate::simd::{InstructionSet, Kernel, Simd, Vector, dispatch};
use crate::study::body_setup::{ROOM, Steel, steel, steel_4340};

/// A path of deformation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// Along x, at constant volume.
    Compression,
    /// Along x, with planes of constant y.
    Shear,
}

/// Stress and state on a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Kirchhoff deviator xx, yy, xy (Pa).
    pub deviator: [f64; 3],
    /// Equivalent plastic strain (-).
    pub plastic_strain: f64,
    /// Temperature (K).
    pub temperature: f64,
}

impl Sample {
    /// q (Pa).
    pub fn equivalent_stress(&self) -> f64 {
        let [xx, yy, xy] = self.deviator;
        (3.0 * (xx * xx + yy * yy + xx * yy + xy * xy)).sqrt()
    }
}

/// Largest differences from the continuous solution.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Of q, over it (-).
    pub stress: f64,
    /// Of any component of the deviator, over q (-).
    pub component: f64,
    /// Of the temperature, over it (-).
    pub temperature: f64,
}

/// The unknowns of the continuous equations: s_xx, s_yy, s_xy (Pa), ξ (-), T (K).
type Unknowns = [f64; 5];

/// The continuous equations.
struct Continuous {
    constants: Constants,
    shear_modulus: f64,
    /// d_xx, d_yy, d_xy and w_xy (1/s).
    rates: [f64; 4],
}

impl Continuous {
    fn new(path: Path, rate: f64) -> Self {
        let constants = steel_4340();
        let shear_modulus = constants.youngs_modulus / (2.0 * (1.0 + constants.poissons_ratio));
        let half = 0.75_f64.sqrt() * rate;
        let rates = match path {
            Path::Compression => [-half, half, 0.0, 0.0],
            Path::Shear => [0.0, 0.0, half, half],
        };
        Continuous { constants, shear_modulus, rates }
    }

    /// Y (Pa), ∂Y/∂ξ (Pa) and ∂Y/∂T (Pa/K).
    fn strength(&self, xi: f64, temperature: f64) -> [f64; 3] {
        let c = &self.constants;
        let range = c.melting_temperature - c.reference_temperature;
        let homologous = ((temperature - c.reference_temperature) / range).clamp(0.0, 1.0);
        let softening = 1.0 - homologous.powf(c.thermal_exponent);
        let hardening = c.yield_stress + c.hardening_modulus * xi;
        let slope = -hardening * c.thermal_exponent * homologous.powf(c.thermal_exponent - 1.0) / range;
        [hardening * softening, c.hardening_modulus * softening, slope]
    }

    fn derivative(&self, y: &Unknowns, is_plastic: bool) -> Unknowns {
        let c = &self.constants;
        let [xx, yy, xy, xi, temperature] = *y;
        let [d_xx, d_yy, d_xy, w] = self.rates;
        let q = (3.0 * (xx * xx + yy * yy + xx * yy + xy * xy)).sqrt();
        let heating = c.taylor_quinney * q / (c.density * c.specific_heat);
        let (mut rate, mut xi_rate) = (0.0, 0.0);
        if is_plastic {
            let n = c.hardening_exponent;
            let three_mu = 3.0 * self.shear_modulus;
            // s:d with s_zz = −s_xx − s_yy and d_zz = 0.
            let power = xx * d_xx + yy * d_yy + 2.0 * xy * d_xy;
            let [strength, per_xi, per_kelvin] = self.strength(xi.max(0.0), temperature);
            let strain_power = xi.max(0.0).powf((1.0 - n) / n);
            // Over n ε̄ⁿ⁻¹, so that nothing is infinite at ε̄ = 0.
            let stiffness = (three_mu + per_kelvin * heating) * strain_power / n + per_xi;
            xi_rate = three_mu * power / q / stiffness;
            rate = xi_rate * strain_power / n;
            if rate > c.reference_rate {
                rate = c.reference_rate * ((q / strength - 1.0) / c.rate_coefficient).exp();
                xi_rate = rate * n / strain_power;
            }
        }
        let flow = 3.0 * self.shear_modulus * rate / q.max(1e-300);
        let two_mu = 2.0 * self.shear_modulus;
        // w s − s w for w = (0, w; −w, 0).
        let turn = [2.0 * w * xy, -2.0 * w * xy, w * (yy - xx)];
        [
            turn[0] + two_mu * d_xx - flow * xx,
            turn[1] + two_mu * d_yy - flow * yy,
            turn[2] + two_mu * d_xy - flow * xy,
            xi_rate,
            heating * rate,
        ]
    }

    /// One step of Dormand and Prince's method: the result and the largest error relative to the unknowns'
    /// size.
    fn step(&self, y: &Unknowns, h: f64, is_plastic: bool) -> (Unknowns, f64) {
        const STAGES: [&[f64]; 6] = [
            &[1.0 / 5.0],
            &[3.0 / 40.0, 9.0 / 40.0],
            &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
            &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
            &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
            &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
        ];
        const ERROR: [f64; 7] = [
            71.0 / 57600.0,
            0.0,
            -71.0 / 16695.0,
            71.0 / 1920.0,
            -17253.0 / 339200.0,
            22.0 / 525.0,
            -1.0 / 40.0,
        ];
        let mut slopes = vec![self.derivative(y, is_plastic)];
        let mut at = *y;
        for weights in STAGES {
            for k in 0..5 {
                at[k] = y[k] + h * weights.iter().zip(&slopes).map(|(a, slope)| a * slope[k]).sum::<f64>();
            }
            slopes.push(self.derivative(&at, is_plastic));
        }
        let scale = [1e9, 1e9, 1e9, 1.0, 300.0];
        let error = (0..5)
            .map(|k| h * ERROR.iter().zip(&slopes).map(|(e, slope)| e * slope[k]).sum::<f64>() / scale[k]);
        (at, error.fold(0.0, |worst, e| worst.max(e.abs())))
    }

    /// The solution at times (s) in rising order, from rest at room temperature.
    fn solve(&self, times: &[f64]) -> Vec<Sample> {
        const TOLERANCE: f64 = 1e-11;
        let n = self.constants.hardening_exponent;
        let mut y: Unknowns = [0.0, 0.0, 0.0, 0.0, ROOM];
        let [xx, yy, xy, ..] = self.derivative(&y, false);
        // Before yield the path is straight, or turns by less than a thousandth: yield is found by halving.
        let yields = |y: &Unknowns| {
            (3.0 * (y[0] * y[0] + y[1] * y[1] + y[0] * y[1] + y[2] * y[2])).sqrt()
                >= self.constants.yield_stress
        };
        let speed = (3.0 * (xx * xx + yy * yy + xx * yy + xy * xy)).sqrt();
        let (mut time, mut h) = (0.0, 1e-3 * self.constants.yield_stress / speed);
        let mut is_plastic = false;
        let mut samples = Vec::with_capacity(times.len());
        for &end in times {
            while time < end {
                let try_h = h.min(end - time);
                let (next, error) = self.step(&y, try_h, is_plastic);
                if !is_plastic && yields(&next) {
                    if try_h < 1e-15 * end {
                        is_plastic = true;
                    } else {
                        h = 0.5 * try_h;
                    }
                    continue;
                }
                if error <= TOLERANCE {
                    (y, time) = (next, if try_h < h { end } else { time + try_h });
                }
                h = try_h.max(if error <= TOLERANCE { h } else { 0.0 })
                    * (0.9 * (TOLERANCE / error.max(1e-30)).powf(0.2)).clamp(0.2, 2.0);
            }
            samples.push(Sample {
                deviator: [y[0], y[1], y[2]],
                plastic_strain: y[3].powf(1.0 / n),
                temperature: y[4],
            });
        }
        samples
    }
}

/// Updates of the first points of a block, all by the same gradient.
struct Updates<'a> {
    model: &'a Steel,
    state: &'a mut <Steel as ConstitutiveModel<f64, PlaneStrain>>::State,
    h: [[f64; 2]; 2],
    dt: f64,
    count: usize,
}

impl Kernel<f64> for Updates<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = f64>>(self) {
        let h = self.h.map(|row| row.map(S::Lanes::splat));
        let zero = S::Lanes::splat(0.0);
        for _ in 0..self.count {
            let mut totals = StepSums::zero();
            ConstitutiveModel::<f64, PlaneStrain>::update(
                self.model,
                self.state,
                0,
                &h,
                self.dt,
                zero,
                &mut totals,
            );
        }
    }
}

/// The solver's material point on a path at `rate` (1/s), in steps of `strain_step` of equivalent strain,
/// looked at after each of the `counts` of steps.
fn solver(path: Path, rate: f64, strain_step: f64, counts: &[usize]) -> Vec<Sample> {
    let model = steel(&steel_4340());
    let mut state = <Steel as ConstitutiveModel<f64, PlaneStrain>>::State::zeroed();
    for lane in 0..crate::points::BLOCK {
        ConstitutiveModel::<f64, PlaneStrain>::place(&model, &mut state, lane, ROOM);
    }
    let half = 0.75_f64.sqrt() * strain_step;
    let h = match path {
        Path::Compression => [[(-half).exp_m1(), 0.0], [0.0, half.exp_m1()]],
        Path::Shear => [[0.0, 2.0 * half], [0.0, 0.0]],
    };
    let mut done = 0;
    let mut samples = Vec::with_capacity(counts.len());
    for &count in counts {
        let updates =
            Updates { model: &model, state: &mut state, h, dt: strain_step / rate, count: count - done };
        dispatch(InstructionSet::detect(), updates);
        done = count;
        samples.push(Sample {
            deviator: [0, 1, 2].map(|k| state.deviator[k][0]),
            plastic_strain: state.plastic_strain[0],
            temperature: state.thermal.0[0],
        });
    }
    samples
}

/// Equivalent strains at which solver and continuous solution are compared (-).
pub const STRAINS: [f64; 8] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0];

/// Largest errors over `STRAINS` on a path at `rate` (1/s) with strain steps of `strain_step` (-).
pub fn errors(path: Path, rate: f64, strain_step: f64) -> Errors {
    let counts = STRAINS.map(|strain| (strain / strain_step).round() as usize);
    let times = STRAINS.map(|strain| strain / rate);
    let exact = Continuous::new(path, rate).solve(&times);
    let mut errors = Errors::default();
    for (a, b) in solver(path, rate, strain_step, &counts).iter().zip(&exact) {
        let q = b.equivalent_stress();
        for k in 0..3 {
            errors.component = errors.component.max((a.deviator[k] - b.deviator[k]).abs() / q);
        }
        errors.stress = errors.stress.max((a.equivalent_stress() / q - 1.0).abs());
        errors.temperature = errors.temperature.max((a.temperature / b.temperature - 1.0).abs());
    }
    errors
}

/// Rates of the equivalent strain (1/s).
pub const RATES: [f64; 4] = [1.0, 1e3, 1e5, 1e7];

/// Both paths at four rates, and how the error falls with the step.
pub fn verify(report: &mut Report) {
    const STEPS: [f64; 4] = [4e-4, 2e-4, 1e-4, 5e-5];
    let mut charts = Vec::new();
    for (path, name) in [(Path::Compression, "plane-strain compression"), (Path::Shear, "simple shear")] {
        let mut lines = Vec::new();
        let mut worst = Errors::default();
        let mut least = f64::MAX;
        for rate in RATES {
            let all = STEPS.map(|step| errors(path, rate, step));
            worst.stress = worst.stress.max(all[2].stress);
            worst.component = worst.component.max(all[2].component);
            worst.temperature = worst.temperature.max(all[2].temperature);
            let orders = [(all[1].component, all[2].component), (all[2].component, all[3].component)];
            least = orders.map(|(a, b)| (a / b).log2()).into_iter().fold(least, f64::min);
            lines.push(line(
                format!("{rate:.0e} 1/s"),
                logarithms(STEPS.into_iter().zip(all.map(|e| e.component))),
            ));
        }
        let name = format!("{name}, strain steps of 1e-4, worst of four rates");
        report.at_most(format!("{name}: equivalent stress"), worst.stress, "", 1e-5, "");
        report.at_most(format!("{name}: temperature"), worst.temperature, "", 1e-5, "");
        let note = if path == Path::Shear { "first order: the stress turns with the material" } else { "" };
        report.show(format!("{name}: any component"), worst.component, "", note);
        report.at_least(format!("{name}: order in the step"), least, 0.98, "");
        charts.push(panel(format!("log10 error, {}", name.split(',').next().unwrap_or_default()), lines));
    }
    report.plot(
        "material_point.png",
        "Johnson–Cook point against the continuous equations, strains to 2",
        "log10 of the strain step",
        charts,
    );
}
