//! What this machine can do at best, measured now: multiply-adds in registers, and bandwidth by size of the
//! data.

use cpu_time::ThreadTime;
use serde_json::{Value, json};
use std::hint::black_box;
use std::time::Instant;
use swarf::simd::{InstructionSet, Kernel, Real, Simd, Vector, dispatch};

/// Independent chains of multiply-adds: more than latency times throughput of any processor at hand.
const CHAINS: usize = 12;
/// Repetitions, of which the fastest counts: it is the least disturbed one.
const REPETITIONS: usize = 7;

/// Multiply-adds that touch registers alone.
struct MultiplyAdds<R> {
    rounds: usize,
    factor: R,
    summand: R,
}

impl<R: Real> Kernel<R> for MultiplyAdds<R> {
    /// Flop done, and a number that keeps the compiler from dropping them.
    type Output = (f64, R);

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) -> (f64, R) {
        let (factor, summand) = (S::Lanes::splat(self.factor), S::Lanes::splat(self.summand));
        let mut chains = [S::Lanes::splat(self.summand); CHAINS];
        for _ in 0..self.rounds {
            for chain in &mut chains {
                *chain = chain.mul_add(factor, summand);
            }
        }
        let flop = 2.0 * (self.rounds * CHAINS * S::Lanes::LANES) as f64;
        (flop, chains.into_iter().map(Vector::sum).sum())
    }
}

/// a = b + s c, the STREAM benchmark's triad.
struct Triad<'a> {
    a: &'a mut [f64],
    b: &'a [f64],
    c: &'a [f64],
}

impl Kernel<f64> for Triad<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = f64>>(self) {
        let s = S::Lanes::constant(3.0);
        let n = S::Lanes::LANES;
        let (b, c) = (self.b.chunks_exact(n), self.c.chunks_exact(n));
        for ((a, b), c) in self.a.chunks_exact_mut(n).zip(b).zip(c) {
            s.mul_add(S::Lanes::load(c), S::Lanes::load(b)).store(a);
        }
    }
}

/// How many times as much as one thread two do in the same wall time, measured now: what keeps a program that
/// divides its work without loss from 2 is the machine's.
#[derive(Debug)]
pub struct TwoThreads {
    /// Multiply-adds in registers.
    pub multiply_adds: f64,
    /// Triad over `SHARED` bytes, of which each of two threads has half.
    pub triad: f64,
}

/// Data of the triad on one and two threads (bytes): about what 120,000 points take.
const SHARED: usize = 16 << 20;

impl TwoThreads {
    /// Measures it, in half a second.
    pub fn measure() -> Self {
        let registers = || {
            let (factor, summand) = (black_box(0.999), black_box(1e-3));
            black_box(dispatch(
                InstructionSet::detect(),
                MultiplyAdds { rounds: 20_000_000, factor, summand },
            ));
        };
        let (mut whole, mut halves) = (Arrays::of(SHARED), [0, 1].map(|_| Arrays::of(SHARED / 2)));
        let [first, second] = &mut halves;
        // The system gives memory when it is first written.
        [&mut whole, &mut *first, &mut *second].into_iter().for_each(|arrays| arrays.pass(1));
        TwoThreads {
            multiply_adds: 2.0 * wall_time(registers) / side_by_side(registers, registers),
            triad: wall_time(|| whole.pass(40)) / side_by_side(|| first.pass(40), || second.pass(40)),
        }
    }
}

fn wall_time(work: impl FnOnce()) -> f64 {
    let begin = Instant::now();
    work();
    begin.elapsed().as_secs_f64()
}

/// Wall time of two threads until both have ended (s).
fn side_by_side(one: impl FnOnce() + Send, other: impl FnOnce() + Send) -> f64 {
    wall_time(|| {
        std::thread::scope(|scope| {
            scope.spawn(other);
            one();
        });
    })
}

/// The triad's arrays.
struct Arrays {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

impl Arrays {
    /// Three arrays of so many bytes together.
    fn of(bytes: usize) -> Self {
        let count = bytes / 24;
        Arrays { a: vec![0.0; count], b: vec![1.0; count], c: vec![2.0; count] }
    }

    fn pass(&mut self, times: usize) {
        for _ in 0..times {
            dispatch(InstructionSet::detect(), Triad { a: &mut self.a, b: &self.b, c: &self.c });
            black_box(&mut self.a);
        }
    }
}

/// CPU seconds of the fastest of some repetitions of `work`.
fn fastest(mut work: impl FnMut()) -> f64 {
    let seconds = |work: &mut dyn FnMut()| {
        let begin = ThreadTime::now();
        work();
        begin.elapsed().as_secs_f64()
    };
    (0..REPETITIONS).map(|_| seconds(&mut work)).fold(f64::INFINITY, f64::min)
}

/// Flop per second of one core.
fn multiply_adds<R: Real>(rounds: usize) -> f64 {
    let mut flop = 0.0;
    let seconds = fastest(|| {
        let work = MultiplyAdds {
            rounds,
            factor: black_box(R::from_f64(0.999)),
            summand: black_box(R::from_f64(1e-3)),
        };
        flop = black_box(dispatch(InstructionSet::detect(), work)).0;
    });
    flop / seconds
}

/// Bytes per second of one core, for three arrays of `bytes` together.
fn bandwidth(bytes: usize, moved: usize) -> f64 {
    let mut arrays = Arrays::of(bytes);
    let rounds = (moved / bytes).max(1);
    let seconds = fastest(|| arrays.pass(rounds));
    (rounds * arrays.a.len() * 24) as f64 / seconds
}

/// The machine's own limits, for one core.
pub struct Peak {
    /// Flop per second, in double and in single precision.
    pub double: f64,
    pub single: f64,
    /// Size of the data (bytes) and bytes per second.
    bandwidths: Vec<(usize, f64)>,
}

impl Peak {
    /// Measures them.
    pub fn measure(is_quick: bool) -> Self {
        let (rounds, moved) = if is_quick { (2_000_000, 1 << 28) } else { (20_000_000, 1 << 30) };
        let sizes = [1 << 16, 1 << 19, 1 << 23, 1 << 28];
        Peak {
            double: multiply_adds::<f64>(rounds),
            single: multiply_adds::<f32>(rounds),
            bandwidths: sizes.into_iter().map(|bytes| (bytes, bandwidth(bytes, moved))).collect(),
        }
    }

    /// Prints them.
    pub fn print(&self) {
        println!("one core's own peak ({}):", InstructionSet::detect().name());
        println!("  multiply-adds     f64 {:6.1}   f32 {:6.1} Gflop/s", self.double / 1e9, self.single / 1e9);
        for (bytes, rate) in &self.bandwidths {
            println!("  triad over {:>9} kB {:6.1} GB/s", bytes / 1024, rate / 1e9);
        }
    }

    /// The same for the file.
    pub fn to_json(&self) -> Value {
        let bandwidths = self.bandwidths.iter();
        json!({
            "instruction_set": InstructionSet::detect().name(),
            "fma_f64_flop_per_s": self.double,
            "fma_f32_flop_per_s": self.single,
            "triad": bandwidths
                .map(|(bytes, rate)| json!({"bytes": bytes, "bytes_per_s": rate}))
                .collect::<Vec<_>>(),
        })
    }
}
