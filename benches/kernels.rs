//! Single kernels under Criterion: `cargo bench --bench kernels`. Each covers a path that no other does, on
//! more points than the cache of one core holds; throughput is in points (or numbers) per second. Last, the
//! states of an FMU.

#[path = "report/blocks.rs"]
mod blocks;
#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/importer/mod.rs"]
mod importer;
#[path = "../tests/common/reference_loop.rs"]
mod plain;

use blocks::{MOTION, sheared, sheared_plain};
use criterion::{
    BatchSize, BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main, measurement::WallTime,
};
use std::hint::black_box;
use std::time::Duration;
use swarf::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use swarf::simd::{InstructionSet, Kernel, Real, Simd, Vector, dispatch, math};
use swarf::simulation::Solver;
use swarf::stabilization::volumetric_locking::LockingControl;

/// 120,000 points, and 125,440 in space.
const FLAT: [i32; 3] = [300, 100, 1];
const DEEP: [i32; 3] = [40, 28, 14];

type Group<'a> = BenchmarkGroup<'a, WallTime>;

/// Whole substeps on one thread.
fn substep<R: Real, D: Dimension>(group: &mut Group<'_>, name: &str, cells: [i32; 3], set: InstructionSet) {
    let mut solver = sheared::<R, D>(cells);
    solver.options.instructions = set;
    group.throughput(Throughput::Elements(solver.points() as u64));
    group.bench_function(name, |b| b.iter(|| solver.step(&MOTION, false).expect("a stable block")));
}

fn substeps(c: &mut Criterion) {
    let mut group = c.benchmark_group("substep");
    let fastest = InstructionSet::detect();
    substep::<f64, PlaneStrain>(&mut group, "plane_strain_f64", FLAT, fastest);
    substep::<f64, PlaneStrain>(&mut group, "plane_strain_f64_portable", FLAT, InstructionSet::Portable);
    substep::<f32, PlaneStrain>(&mut group, "plane_strain_f32", FLAT, fastest);
    substep::<f64, ThreeDimensional>(&mut group, "three_dimensional_f64", DEEP, fastest);
    let mut plain = sheared_plain(FLAT);
    group.bench_function("plain_loop", |b| b.iter(|| plain.step(&MOTION)));
    group.finish();
}

fn passes(c: &mut Criterion) {
    let mut group = c.benchmark_group("pass");
    let mut solver = sheared::<f64, PlaneStrain>(FLAT);
    group.throughput(Throughput::Elements(solver.points() as u64));
    group.bench_function("sort", |b| b.iter(|| solver.partition.sort(|_, _| {}, false)));
    let mut control = LockingControl::default();
    group.bench_function("locking_control", |b| {
        b.iter(|| control.limit_deviations(&mut solver.partition, &solver.shape, &solver.model, false))
    });
    group.finish();
}

/// A function of one vector.
#[derive(Clone, Copy)]
enum Function {
    Exp,
    Ln,
    Pow,
}

/// It, on every number of a slice.
struct Apply<'a, R> {
    function: Function,
    numbers: &'a mut [R],
}

impl<R: Real> Kernel<R> for Apply<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) {
        let exponent = S::Lanes::constant(0.26);
        for numbers in self.numbers.chunks_exact_mut(S::Lanes::LANES) {
            let x = S::Lanes::load(numbers);
            match self.function {
                Function::Exp => math::exp(x),
                Function::Ln => math::ln(x),
                Function::Pow => math::pow(x, exponent),
            }
            .store(numbers);
        }
    }
}

fn functions_in<R: Real>(group: &mut Group<'_>, bits: u32) {
    for (name, function) in [("exp", Function::Exp), ("ln", Function::Ln), ("pow", Function::Pow)] {
        let start: Vec<R> = (0..4096).map(|k| R::from_f64(0.5 + f64::from(k) / 4096.0)).collect();
        let mut numbers = start.clone();
        group.throughput(Throughput::Elements(4096));
        group.bench_function(format!("{name}_f{bits}"), |b| {
            b.iter(|| {
                numbers.copy_from_slice(&start);
                dispatch(InstructionSet::detect(), Apply { function, numbers: &mut numbers });
                black_box(&mut numbers);
            });
        });
    }
}

fn functions(c: &mut Criterion) {
    let mut group = c.benchmark_group("function");
    functions_in::<f64>(&mut group, 64);
    functions_in::<f32>(&mut group, 32);
    group.finish();
}

/// A state that is freed when dropped.
struct Kept<'a>(&'a importer::Slave, *mut std::ffi::c_void);

impl Drop for Kept<'_> {
    fn drop(&mut self) {
        self.0.free(self.1);
    }
}

/// What masters with rollback and optimisers do in every step, through the C functions, with the reference
/// cut's 30,000 points.
fn states(c: &mut Criterion) {
    let mut group = c.benchmark_group("state");
    let slave = importer::Slave::new(false);
    slave.initialize();
    assert_eq!(slave.step(0.0, 1e-7), importer::Status::Ok, "{}", slave.log());
    let state = Kept(&slave, slave.state());
    let bytes = slave.serialize(state.1);
    println!("{} bytes of {} points", bytes.len(), slave.get_integer("numerics.active_points"));
    // States are freed outside of the time taken, one by one.
    let one = BatchSize::PerIteration;
    group.bench_function("copy", |b| b.iter_batched(|| (), |()| Kept(&slave, slave.state()), one));
    group.bench_function("go_back", |b| b.iter(|| slave.restore(state.1)));
    group.bench_function("serialise", |b| b.iter(|| slave.serialize(state.1)));
    group.bench_function("deserialise", |b| {
        b.iter_batched(|| (), |()| Kept(&slave, slave.deserialize(&bytes).1), one)
    });
    group.finish();
}

fn quickly() -> Criterion {
    Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_secs(1))
        .measurement_time(Duration::from_secs(3))
}

criterion_group! { name = all; config = quickly(); targets = substeps, passes, functions, states }
criterion_main!(all);
