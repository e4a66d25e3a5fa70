//! Sima and Özel's law at one material point: against an independent integration, and its returns under any
//! constants.

mod common;

use common::{PointUpdate, ROOM, Random};
use swarf::dimension::PlaneStrain;
use swarf::material::ConstitutiveModel;
use swarf::material::effects::Temperature;
use swarf::material::hardening::TanhLaw;
use swarf::material::j2_plasticity::{J2Plasticity, State};
use swarf::material::library;
use swarf::material::multiplicative::WithRateAndHeat;
use swarf::points::{BLOCK, PointState};
use swarf::scene::Constants;
use swarf::simd::{InstructionSet, dispatch};

type Titanium = J2Plasticity<f64, WithRateAndHeat<f64, TanhLaw<f64>>>;
type Point = State<f64, PlaneStrain, Temperature<f64>>;

fn titanium() -> Constants {
    library::find("Ti-6Al-4V").expect("in the library").constants.clone()
}

fn model(c: &Constants) -> Titanium {
    J2Plasticity::new(c, WithRateAndHeat::full(c, ROOM))
}

/// The law in plain scalar code, without its rate factor (Pa).
fn still(c: &Constants, strain: f64, temperature: f64) -> f64 {
    let [a, b, power, d, s] = c.tanh;
    let melting = c.melting_temperature;
    let hardened =
        c.yield_stress + c.hardening_modulus * strain.powf(c.hardening_exponent) * (-strain.powf(a)).exp();
    let relative = (temperature / melting).min(1.0);
    let share = 1.0 - relative.powf(d);
    let tanh = (1.0 / (strain + relative.powf(b)).powf(power)).tanh().powf(s);
    let room = c.reference_temperature;
    let homologous = ((temperature - room) / (melting - room)).clamp(0.0, 1.0);
    hardened * (1.0 - homologous.powf(c.thermal_exponent)) * (share + (1.0 - share) * tanh)
}

/// Stress (Pa), plastic strain (-) and temperature (K) at total equivalent strains, by Runge and Kutta's
/// fourth-order method on dq/dt = 3μ (D − ε̄̇), ε̄̇ = ε̇₀ exp((q/Y − 1)/C), dT/dt = β q ε̄̇/(ρ c).
fn integrated(c: &Constants, rate: f64, strains: &[f64]) -> Vec<[f64; 3]> {
    let three_mu = 1.5 * c.youngs_modulus / (1.0 + c.poissons_ratio);
    let slope = |[q, strain, temperature]: [f64; 3]| {
        let y = still(c, strain, temperature);
        let plastic = if q > y { c.reference_rate * ((q / y - 1.0) / c.rate_coefficient).exp() } else { 0.0 };
        let heating = c.taylor_quinney * q / (c.density * c.specific_heat);
        [three_mu * (rate - plastic), plastic, heating * plastic]
    };
    common::integrate([0.0, 0.0, ROOM], rate, strains, slope)
}

fn equivalent_stress(state: &Point) -> f64 {
    let [xx, yy, xy] = [0, 1, 2].map(|k| state.deviator[k][0]);
    (3.0 * (xx * xx + yy * yy + xx * yy + xy * xy)).sqrt()
}

fn fresh(model: &Titanium) -> Point {
    let mut state = Point::zeroed();
    (0..BLOCK).for_each(|lane| ConstitutiveModel::<f64, PlaneStrain>::place(model, &mut state, lane, ROOM));
    state
}

/// Largest relative errors of stress and temperature in plane-strain compression at `rate` (1/s), in steps of
/// `step`.
fn errors(rate: f64, step: f64) -> [f64; 2] {
    const STRAINS: [f64; 7] = [0.05, 0.1, 0.2, 0.5, 0.8, 1.2, 1.6];
    let c = titanium();
    let exact = integrated(&c, rate, &STRAINS);
    let model = model(&c);
    let mut state = fresh(&model);
    let half = 0.75_f64.sqrt() * step;
    let h = [[(-half).exp_m1(), 0.0], [0.0, half.exp_m1()]];
    let (mut done, mut worst) = (0, [0.0_f64; 2]);
    for (strain, [q, _, temperature]) in STRAINS.into_iter().zip(exact) {
        while done < (strain / step).round() as usize {
            let update = PointUpdate::<PlaneStrain, _> {
                model: &model,
                state: &mut state,
                h: &[h; 4],
                dt: step / rate,
            };
            dispatch(InstructionSet::detect(), update);
            done += 1;
        }
        worst[0] = worst[0].max((equivalent_stress(&state) / q - 1.0).abs());
        worst[1] = worst[1].max((state.thermal.0[0] / temperature - 1.0).abs());
    }
    worst
}

/// The continuous equations have one solution. The scheme is of first order, so the bound is for steps of
/// 1e-4 and the error halves with them; nothing is shared with the integration but the constants.
#[test]
fn a_softening_point_follows_the_continuous_equations() {
    for rate in [1e3, 1e5, 1e7] {
        let (coarse, fine) = (errors(rate, 2e-4), errors(rate, 1e-4));
        println!("rate {rate:e} 1/s: stress and temperature off by {fine:?}, at twice the step {coarse:?}");
        assert!(fine.iter().all(|&e| e < 5e-5), "rate {rate:e} 1/s: off by {fine:?}");
        assert!(fine[0] < 0.6 * coarse[0], "rate {rate:e} 1/s: {coarse:?} became {fine:?}");
    }
}

/// A bracket needs continuity and two signs, not a falling function: also where the law loses strength faster
/// than 3μ, as a soft elasticity and wild constants make it, the return ends on the yield surface of its own
/// strain and temperature.
#[test]
fn softening_returns_end_on_the_yield_surface() {
    let mut random = Random(2010);
    let (mut returns, mut steep, mut worst) = (0, 0, 0.0_f64);
    for _ in 0..3000 {
        let c = Constants {
            youngs_modulus: random.one_of(&[113.8e9, 5e9, 1e9, 3e8]),
            hardening_modulus: random.one_of(&[683.1e6, 3e9]),
            hardening_exponent: random.one_of(&[0.1, 0.47, 1.0]),
            rate_coefficient: random.one_of(&[0.0, 0.035]),
            tanh: [
                random.within(0.5, 6.0),
                random.within(0.5, 6.0),
                random.within(0.5, 4.0),
                random.within(0.3, 2.0),
                random.within(0.0, 4.0),
            ],
            ..titanium()
        };
        let model = model(&c);
        let three_mu = 1.5 * c.youngs_modulus / (1.0 + c.poissons_ratio);
        let dt = 10_f64.powf(random.within(-9.0, 0.0));
        let mut state = fresh(&model);
        let mut trials = [0.0; BLOCK];
        for lane in 0..BLOCK {
            let some = 10_f64.powf(random.within(-6.0, 0.7));
            let strain = random.one_of(&[0.0, some]);
            let temperature = random.within(250.0, 0.999 * c.melting_temperature);
            let at_rest = still(&c, strain, temperature);
            trials[lane] = at_rest * (1.0 + 10_f64.powf(random.within(-6.0, 0.7)));
            // Pure shear: q = √3 |s_xy|.
            state.deviator[2][lane] = trials[lane] / 3_f64.sqrt();
            state.plastic_strain[lane] = strain;
            state.thermal.0[lane] = temperature;
            state.yield_stress[lane] = at_rest;
        }
        let old = state.clone();
        let update = PointUpdate::<PlaneStrain, _> {
            model: &model,
            state: &mut state,
            h: &[[[0.0; 2]; 2]; BLOCK],
            dt,
        };
        dispatch(InstructionSet::detect(), update);
        for lane in 0..BLOCK {
            let q = 3_f64.sqrt() * state.deviator[2][lane].abs();
            let (before, after) = (old.plastic_strain[lane], state.plastic_strain[lane]);
            let x = after - before;
            let rise = c.taylor_quinney / (c.density * c.specific_heat);
            let flow = |x: f64| {
                let factor = 1.0 + c.rate_coefficient * (x / dt / c.reference_rate).max(1.0).ln();
                still(&c, before + x, old.thermal.0[lane] + rise * (trials[lane] - three_mu * x) * x) * factor
            };
            let f = |x: f64| trials[lane] - three_mu * x - flow(x);
            returns += 1;
            // Steeper than 3μ: f rises somewhere on the way.
            let way: Vec<f64> = (1..=40).map(|k| f(trials[lane] / three_mu * f64::from(k) / 40.0)).collect();
            steep += i32::from(way.windows(2).any(|pair| pair[1] > pair[0]));
            // Only ε̄ + x is stored: f may change sign anywhere within its rounding; elsewhere |f| is the
            // solver's tolerance of 1e-12 and the rounding of the law's powers.
            let lost = 4.0 * f64::EPSILON * after.max(before);
            let (low, high) = (f((x - lost).max(0.0)), f(x + lost));
            let bound = 1e-10 * trials[lane];
            assert!(
                x >= 0.0 && (low.abs().min(high.abs()).min(f(x).abs()) < bound || low * high <= 0.0),
                "f = {:e} Pa at x = {x:e} of a trial of {:e} Pa; {c:?}, ε̄ {before:e}, T {} K",
                f(x),
                trials[lane],
                old.thermal.0[lane]
            );
            assert!((q - (trials[lane] - three_mu * x)).abs() < 1e-11 * trials[lane] + three_mu * lost);
            worst = worst.max(f(x).abs() / trials[lane]);
        }
    }
    println!(
        "{returns} returns, {steep} of them with a rising f; largest |f| {worst:.1e} of the trial stress"
    );
    assert!(steep > 1000, "only {steep} of {returns} returns met a law steeper than 3μ");
}
