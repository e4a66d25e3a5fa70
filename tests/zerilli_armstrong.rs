//! Zerilli and Armstrong's law at one material point, against an independent integration, and in short cuts.

mod common;

use common::{ROOM, Random};
use swarf::dimension::PlaneStrain;
use swarf::material::effects::Temperature;
use swarf::material::j2_plasticity::{J2Plasticity, State};
use swarf::material::zerilli_armstrong::{MELTING_RANGE, ZerilliArmstrong};
use swarf::material::{ConstitutiveModel, StepSums, library};
use swarf::points::{BLOCK, PointState};
use swarf::scene::{Constants, DimensionChoice, Heat, Inputs, Law, Precision, Scene, ShapeChoice};
use swarf::session::{Advance, Session};
use swarf::simd::{InstructionSet, Kernel, Real, Simd, Vector, dispatch};

type Model<R> = J2Plasticity<R, ZerilliArmstrong<R>>;
type Point<R> = State<R, PlaneStrain, Temperature<R>>;

fn steel() -> Constants {
    library::find("AISI 1045").expect("in the library").constants.clone()
}

fn model<R: Real>(c: &Constants) -> Model<R> {
    J2Plasticity::new(c, ZerilliArmstrong::full(c, ROOM))
}

fn fresh<R: Real>(model: &Model<R>) -> Point<R> {
    let mut state = Point::zeroed();
    (0..BLOCK).for_each(|lane| ConstitutiveModel::<R, PlaneStrain>::place(model, &mut state, lane, ROOM));
    state
}

/// One update of all points of a block by the same gradient, in any precision; gives the first point's
/// plastic work per volume (J/m3).
struct Update<'a, R: Real> {
    model: &'a Model<R>,
    state: &'a mut Point<R>,
    h: [[f64; 2]; 2],
    dt: f64,
}

impl<R: Real> Kernel<R> for Update<'_, R> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) -> f64 {
        let h = self.h.map(|row| row.map(S::Lanes::constant));
        let mut first = [R::ZERO; BLOCK];
        first[0] = R::ONE;
        let mut work = 0.0;
        for lane in (0..BLOCK).step_by(S::Lanes::LANES) {
            let mut totals = StepSums::zero();
            let (dt, volume) = (R::from_f64(self.dt), S::Lanes::load(&first[lane..]));
            ConstitutiveModel::<R, PlaneStrain>::update(
                self.model,
                self.state,
                lane,
                &h,
                dt,
                volume,
                &mut totals,
            );
            work += totals.plastic_work.sum().to_f64();
        }
        work
    }
}

fn update<R: Real>(model: &Model<R>, state: &mut Point<R>, h: [[f64; 2]; 2], dt: f64) -> f64 {
    dispatch(InstructionSet::detect(), Update { model, state, h, dt })
}

/// xx, yy and xy of the first point's deviator (Pa).
fn deviator<R: Real>(state: &Point<R>) -> [f64; 3] {
    [0, 1, 2].map(|k| state.deviator[k][0].to_f64())
}

fn equivalent_stress([xx, yy, xy]: [f64; 3]) -> f64 {
    (3.0 * (xx * xx + yy * yy + xx * yy + xy * xy)).sqrt()
}

/// Share of the strength that is left this close to melting (-).
fn solid(c: &Constants, temperature: f64) -> f64 {
    ((c.melting_temperature - temperature) / MELTING_RANGE).clamp(0.0, 1.0)
}

/// The law in plain scalar code (Pa); rates below 1/s count as 1/s.
fn flow_stress(c: &Constants, strain: f64, rate: f64, temperature: f64) -> f64 {
    let z = &c.zerilli_armstrong;
    let exponent = (-z.c3 + z.c4 * rate.max(1.0).ln()).min(0.0) * temperature;
    solid(c, temperature) * (z.c0 + z.c1 * exponent.exp() + z.c5 * strain.powf(z.n))
}

/// Stress (Pa), plastic strain (-) and temperature (K) at total equivalent strains, by Runge and Kutta's
/// fourth-order method on dq/dt = 3μ (D − ε̄̇), the law solved for ε̄̇, and dT/dt = β q ε̄̇/(ρ c).
fn integrated(c: &Constants, rate: f64, strains: &[f64]) -> Vec<[f64; 3]> {
    let z = &c.zerilli_armstrong;
    let three_mu = 1.5 * c.youngs_modulus / (1.0 + c.poissons_ratio);
    let slope = |[q, strain, temperature]: [f64; 3]| {
        let thermal = (q / solid(c, temperature) - z.c0 - z.c5 * strain.powf(z.n)) / z.c1;
        let plastic = if q > flow_stress(c, strain, 1.0, temperature) {
            ((thermal.ln() / temperature + z.c3) / z.c4).exp()
        } else {
            0.0
        };
        let heating = c.taylor_quinney * q / (c.density * c.specific_heat);
        [three_mu * (rate - plastic), plastic, heating * plastic]
    };
    common::integrate([0.0, 0.0, ROOM], rate, strains, slope)
}

/// Gradient of a step of plane-strain compression of this equivalent strain (-).
fn compression(step: f64) -> [[f64; 2]; 2] {
    let half = 0.75_f64.sqrt() * step;
    [[(-half).exp_m1(), 0.0], [0.0, half.exp_m1()]]
}

/// Largest relative errors of stress and temperature in plane-strain compression at `rate` (1/s), in steps of
/// `step`.
fn errors(rate: f64, step: f64) -> [f64; 2] {
    const STRAINS: [f64; 7] = [0.05, 0.1, 0.2, 0.5, 0.8, 1.2, 1.6];
    let c = steel();
    let exact = integrated(&c, rate, &STRAINS);
    let model = model::<f64>(&c);
    let mut state = fresh(&model);
    let (mut done, mut worst) = (0, [0.0_f64; 2]);
    for (strain, [q, _, temperature]) in STRAINS.into_iter().zip(exact) {
        while done < (strain / step).round() as usize {
            update(&model, &mut state, compression(step), step / rate);
            done += 1;
        }
        worst[0] = worst[0].max((equivalent_stress(deviator(&state)) / q - 1.0).abs());
        worst[1] = worst[1].max((state.thermal.0[0] / temperature - 1.0).abs());
    }
    worst
}

/// The continuous equations have one solution. The scheme is of first order, so the bound is for steps of
/// 1e-4 and the error halves with them; nothing is shared with the integration but the constants.
#[test]
fn an_adiabatic_point_follows_the_continuous_equations() {
    for rate in [1e2, 1e3, 1e5, 1e7] {
        let (coarse, fine) = (errors(rate, 2e-4), errors(rate, 1e-4));
        println!("rate {rate:e} 1/s: stress and temperature off by {fine:?}, at twice the step {coarse:?}");
        assert!(fine.iter().all(|&e| e < 5e-5), "rate {rate:e} 1/s: off by {fine:?}");
        assert!(fine[0] < 0.6 * coarse[0], "rate {rate:e} 1/s: {coarse:?} became {fine:?}");
    }
}

/// h in a frame turned by an angle (rad): R h Rᵀ.
fn turned(h: [[f64; 2]; 2], angle: f64) -> [[f64; 2]; 2] {
    let r = [[angle.cos(), -angle.sin()], [angle.sin(), angle.cos()]];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..4).map(|k| r[i][k / 2] * h[k / 2][k % 2] * r[j][k % 2]).sum::<f64>())
    })
}

/// A point that is strained, turned and strained again along turned axes carries the turned stress of one
/// that was not turned on the way: neither law nor return knows of axes.
#[test]
fn a_path_that_is_turned_gives_the_same_stress() {
    let c = steel();
    let model = model::<f64>(&c);
    let (mut still, mut moved) = (fresh(&model), fresh(&model));
    let (dt, path) = (1e-9, [[-3e-4, 1e-4], [2e-4, 3e-4]]);
    let strain = |state: &mut Point<f64>, h| (0..200).map(|_| update(&model, state, h, dt)).sum::<f64>();
    let back = path.map(|row| row.map(|entry| -entry));
    for state in [&mut still, &mut moved] {
        strain(state, path);
        // Off the flow stress of that rate, at which a point at rest would go on flowing.
        (0..6).for_each(|_| _ = update(&model, state, back, dt));
    }
    let (angle, turns) = (1.1_f64, 100);
    let by = angle / f64::from(turns);
    let turn = [[by.cos() - 1.0, -by.sin()], [by.sin(), by.cos() - 1.0]];
    for _ in 0..turns {
        let work = update(&model, &mut moved, turn, dt);
        assert!(work == 0.0, "a rotation did plastic work: {work} J/m3");
    }
    let work = [strain(&mut still, path), strain(&mut moved, turned(path, angle))];
    let [xx, yy, xy] = deviator(&still);
    let exact = turned([[xx, xy], [xy, yy]], angle);
    let [a, b, ab] = deviator(&moved);
    // Rounding of 500 increments, in stress: a few E ε each; yielding forgets it.
    let bound = 1e-11 * c.youngs_modulus;
    for (value, exact) in [(a, exact[0][0]), (b, exact[1][1]), (ab, exact[0][1])] {
        assert!((value - exact).abs() < bound, "{value:e} Pa, turned {exact:e} Pa, bound {bound} Pa");
    }
    assert!((work[1] / work[0] - 1.0).abs() < 1e-9, "plastic work {work:?} J/m3");
    assert!(still.plastic_strain[0] > 0.1, "the path hardly yielded: {}", still.plastic_strain[0]);
}

/// Single precision tells the same stress and temperature within what 2000 rounded steps leave.
#[test]
fn single_precision_agrees_within_rounding() {
    let c = steel();
    let (double, single) = (model::<f64>(&c), model::<f32>(&c));
    let (mut a, mut b) = (fresh(&double), fresh(&single));
    let (step, rate) = (5e-4, 1e5);
    for _ in 0..2000 {
        update(&double, &mut a, compression(step), step / rate);
        update(&single, &mut b, compression(step), step / rate);
    }
    let stress = equivalent_stress(deviator(&b)) / equivalent_stress(deviator(&a)) - 1.0;
    let temperature = f64::from(b.thermal.0[0]) / a.thermal.0[0] - 1.0;
    println!("single precision: stress off by {stress:.1e}, temperature by {temperature:.1e}");
    // Strain and temperature are sums of 2000 terms, each rounded at 6e-8 of the sum.
    let bound = 2000.0 * f64::from(f32::EPSILON) / 2.0;
    assert!(stress.abs() < bound && temperature.abs() < bound, "off by {stress:e}, {temperature:e}");
}

/// From first yield on, for any state, step and constants, the returned stress lies on the flow stress of the
/// new strain, rate and temperature: at 1/s, at melting and where no rate strengthens further the law has
/// kinks.
#[test]
fn every_return_ends_on_the_yield_surface() {
    let mut random = Random(1987);
    let mut returns = 0;
    for _ in 0..4000 {
        let mut c = steel();
        c.youngs_modulus = random.one_of(&[205e9, 205e9, 5e9]);
        c.zerilli_armstrong.c0 = random.one_of(&[159.2e6, 0.0]);
        c.zerilli_armstrong.c3 = random.one_of(&[0.00609, 0.0, 0.05]);
        c.zerilli_armstrong.c4 = random.one_of(&[0.000189, 0.0, 0.002]);
        c.zerilli_armstrong.n = random.one_of(&[0.171, 0.0, 1.0]);
        let model = model::<f64>(&c);
        let three_mu = 1.5 * c.youngs_modulus / (1.0 + c.poissons_ratio);
        let dt = 10_f64.powf(random.within(-13.0, 2.0));
        let mut state = fresh(&model);
        let mut trials = [0.0; BLOCK];
        for lane in 0..BLOCK {
            let some = 10_f64.powf(random.within(-9.0, 1.0));
            let strain = random.one_of(&[0.0, some]);
            let melting = c.melting_temperature;
            let warm = random.within(77.0, 1.02 * melting);
            let soft = melting - random.within(0.0, 1.1 * MELTING_RANGE);
            let temperature = random.one_of(&[warm, warm, soft]);
            let at_rest = flow_stress(&c, strain, 0.0, temperature);
            trials[lane] = at_rest * (1.0 + 10_f64.powf(random.within(-6.0, 0.7))) + 1e3;
            // Pure shear: q = √3 |s_xy|.
            state.deviator[2][lane] = trials[lane] / 3_f64.sqrt();
            state.plastic_strain[lane] = strain;
            state.thermal.0[lane] = temperature;
            state.yield_stress[lane] = at_rest;
        }
        let old = state.clone();
        update(&model, &mut state, [[0.0; 2]; 2], dt);
        for lane in 0..BLOCK {
            let (before, after) = (old.plastic_strain[lane], state.plastic_strain[lane]);
            let (trial, x) = (trials[lane], after - before);
            let rise = c.taylor_quinney / (c.density * c.specific_heat);
            let temperature = |x: f64| old.thermal.0[lane] + rise * (trial - three_mu * x) * x;
            let flow = |x: f64| flow_stress(&c, before + x, x / dt, temperature(x));
            let f = |x: f64| trial - three_mu * x - flow(x);
            returns += 1;
            // Only ε̄ + x is stored: f may change sign anywhere within its rounding; elsewhere |f| is the
            // solver's tolerance of 1e-12, the rounding of the law's powers and that of a temperature next to
            // melting.
            let lost = 4.0 * f64::EPSILON * after.max(before);
            let (low, high) = (f((x - lost).max(0.0)), f(x + lost));
            let bound = 1e-10 * trial;
            assert!(
                x >= 0.0 && (low.abs().min(high.abs()).min(f(x).abs()) < bound || low * high <= 0.0),
                "f = {:e} Pa at x = {x:e} of a trial of {trial:e} Pa; {:?}, E {:e} Pa, dt {dt:e} s, ε̄ \
                 {before:e}, T {} K",
                f(x),
                c.zerilli_armstrong,
                c.youngs_modulus,
                old.thermal.0[lane]
            );
            // At rest, as the point keeps it.
            let (kept, exact) = (state.yield_stress[lane], flow_stress(&c, after, 0.0, temperature(x)));
            let cold = flow_stress(&c, after, 0.0, 0.0);
            assert!(
                (kept - exact).abs() < 1e-8 * cold,
                "at rest {kept:e} Pa, exact {exact:e} Pa; {:?}, ε̄ {after:e}, T {} K",
                c.zerilli_armstrong,
                temperature(x)
            );
        }
    }
    println!("{returns} returns");
}

/// A small cut of AISI 1045 at 20 m/s.
fn scene() -> Scene {
    let mut scene = Scene::default();
    scene.material.name = "AISI 1045".into();
    scene.material.law = Law::ZerilliArmstrong;
    (scene.workpiece.length, scene.workpiece.height) = (1e-3, 4e-4);
    scene.numerics.point_spacing = 1e-5;
    scene.numerics.threads = 1;
    scene.inputs = Inputs { tool_velocity: 20.0, feed: 1.5e-4, friction: 0.2 };
    scene
}

/// Plastic work (J) after a time (s), every communication step with a closed ledger.
fn plastic_work(scene: &Scene, end: f64) -> f64 {
    let mut session = Session::new(scene, 0.0).expect("a scene that runs");
    println!("{}", session.effects_summary());
    for k in 1..=10 {
        let advance = session.advance_to(end * f64::from(k) / 10.0, &mut |_| true).expect("a stable run");
        assert_eq!(advance, Advance::Reached);
    }
    let outputs = session.outputs();
    println!("{outputs:?}");
    // The reference cut's bound (tests/reference_cut.rs).
    assert!(outputs.balance_error.abs() < 0.01, "ledger off by {}", outputs.balance_error);
    assert!(outputs.chip_temperature_peak > 400.0, "cold: {} K", outputs.chip_temperature_peak);
    outputs.plastic_work
}

/// Both laws of the material cut with about the same work in the plane, as their stresses agree where they
/// were measured; in single precision the work is the same but for rounding.
#[test]
fn a_cut_takes_about_the_work_of_the_other_law() {
    let coupled = plastic_work(&scene(), 1.5e-5);
    let mut other = scene();
    other.material.law = Law::JohnsonCook;
    let plain = plastic_work(&other, 1.5e-5);
    assert!(
        (coupled / plain - 1.0).abs() < 0.25,
        "plastic work {coupled} J, with Johnson and Cook {plain} J"
    );
    let mut single = scene();
    single.numerics.precision = Precision::Single;
    let rounded = plastic_work(&single, 1.5e-5);
    assert!(
        (rounded / coupled - 1.0).abs() < 1e-3,
        "plastic work {rounded} J in single precision, {coupled} J"
    );
}

/// Three cells of width are the plane's cut but for the free sides; both precisions run.
#[test]
fn a_cut_in_space_runs_in_both_precisions() {
    let mut scene = scene();
    scene.numerics.point_spacing = 2e-5;
    scene.workpiece.width = 1.6e-4;
    scene.numerics.dimension = DimensionChoice::ThreeDimensional;
    let double = plastic_work(&scene, 1.2e-5);
    scene.numerics.precision = Precision::Single;
    let single = plastic_work(&scene, 1.2e-5);
    assert!((single / double - 1.0).abs() < 1e-3, "plastic work {single} J in single precision, {double} J");
}

/// Without rate the flow stress is that at 1/s, which is lower; without heat nothing warms.
#[test]
fn a_scene_without_rate_or_heat_takes_them_out() {
    let mut scene = scene();
    let work = |scene: &Scene| {
        let mut session = Session::new(scene, 0.0).expect("a scene that runs");
        session.advance_to(4e-6, &mut |_| true).expect("a stable run");
        (session.outputs().plastic_work, session.outputs().chip_temperature_peak)
    };
    let (whole, warm) = work(&scene);
    scene.effects.rate = false;
    let (slow, _) = work(&scene);
    assert!(slow < 0.97 * whole, "plastic work {slow} J without rate, {whole} J with it");
    scene.effects.heat = Heat::None;
    let (_, cold) = work(&scene);
    assert!(warm > ROOM + 50.0 && (cold - ROOM).abs() < 1e-9, "{cold} K without heat, {warm} K with it");
}

/// What has no kernel or no constants is refused in words that say what goes.
#[test]
fn what_does_not_go_with_the_law_is_refused_in_words() {
    let refused = |change: fn(&mut Scene), parts: &[&str]| {
        let mut scene = scene();
        change(&mut scene);
        let text = Session::new(&scene, 0.0).err().expect("a refusal").to_string();
        assert!(parts.iter().all(|part| text.contains(part)), "{text}");
    };
    let law = "material.law = zerilli_armstrong";
    refused(|scene| scene.material.name = "AISI 4340".into(), &[law, "AISI 4340", "AISI 1045", "custom"]);
    refused(|scene| scene.effects.damage = true, &[law, "effects.damage = false"]);
    refused(|scene| scene.effects.thermal_softening = false, &[law, "effects.thermal_softening = true"]);
    refused(|scene| scene.numerics.shape_function = ShapeChoice::Linear, &[law, "gimp"]);
    refused(
        |scene| scene.effects.artificial_viscosity = true,
        &["effects.artificial_viscosity = true", "material.law = johnson_cook"],
    );
}
