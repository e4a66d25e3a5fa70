//! Flop of a point-step, counted: the same kernels run on numbers that count what is done with them.
//!
//! Additions, subtractions, multiplications, divisions and square roots count one each, multiply-adds two;
//! comparisons, minima, roundings and sign changes count nothing. Everything executed counts, idle lanes of a
//! vector included.

use crate::blocks::{BAND, MOTION, block};
use crate::common::BlockIn;
use std::cell::Cell;
use std::fmt;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};
use swarf::dimension::Dimension;
use swarf::grid::shape_function::Gimp;
use swarf::simd::{Array, InstructionSet, Kernel, Real, Simd, Vector};
use swarf::simulation::Solver;

thread_local! {
    static FLOP: Cell<u64> = const { Cell::new(0) };
}

fn count<T>(result: T) -> T {
    FLOP.with(|flop| flop.set(flop.get() + 1));
    result
}

/// A double that counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
struct Counted(f64);

impl fmt::Display for Counted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

macro_rules! counted {
    ($operator:ident, $function:ident, $assign:ident, $assign_function:ident) => {
        impl $operator for Counted {
            type Output = Self;
            fn $function(self, o: Self) -> Self {
                count(Counted(self.0.$function(o.0)))
            }
        }
        impl $assign for Counted {
            fn $assign_function(&mut self, o: Self) {
                *self = $operator::$function(*self, o);
            }
        }
    };
}
counted!(Add, add, AddAssign, add_assign);
counted!(Sub, sub, SubAssign, sub_assign);
counted!(Mul, mul, MulAssign, mul_assign);
counted!(Div, div, DivAssign, div_assign);

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Counted(-self.0)
    }
}

impl Sum for Counted {
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Counted(0.0), Add::add)
    }
}

impl Real for Counted {
    const EPSILON: Self = Counted(f64::EPSILON);
    const ZERO: Self = Counted(0.0);
    const ONE: Self = Counted(1.0);
    const IS_SINGLE: bool = false;

    fn from_f64(x: f64) -> Self {
        Counted(x)
    }
    fn to_f64(self) -> f64 {
        self.0
    }
    fn sqrt(self) -> Self {
        count(Counted(Real::sqrt(self.0)))
    }
    fn abs(self) -> Self {
        Counted(Real::abs(self.0))
    }
    fn max(self, o: Self) -> Self {
        Counted(Real::max(self.0, o.0))
    }
    fn min(self, o: Self) -> Self {
        Counted(Real::min(self.0, o.0))
    }
    fn round(self) -> Self {
        Counted(Real::round(self.0))
    }
    fn split_exponent(self) -> (Self, Self) {
        let (m, k) = Real::split_exponent(self.0);
        (Counted(m), Counted(k))
    }
    fn scale_exponent(self, k: Self) -> Self {
        Counted(Real::scale_exponent(self.0, k.0))
    }
    fn to_i32(self) -> i32 {
        Real::to_i32(self.0)
    }
    fn from_i32(i: i32) -> Self {
        Counted(f64::from(i))
    }
    fn run<K: Kernel<Self>>(_set: InstructionSet, kernel: K) -> K::Output {
        kernel.run::<Counting>()
    }
}

/// Four counted numbers side by side, as in double precision.
#[derive(Clone, Copy)]
struct Counting;

impl Simd for Counting {
    type Scalar = Counted;
    type Lanes = Array<Counted, 4>;
    type Quad = Array<Counted, 4>;
    type Records = Array<Counted, 4>;

    fn load_transposed(from: &[Counted]) -> [Self::Lanes; 4] {
        std::array::from_fn(|c| {
            let lanes: [Counted; 4] = std::array::from_fn(|p| from[4 * p + c]);
            Vector::load(&lanes)
        })
    }
    fn store_transposed(lanes: [Self::Lanes; 4], to: &mut [Counted]) {
        for (c, vector) in lanes.into_iter().enumerate() {
            let column = entries(vector);
            (0..4).for_each(|p| to[4 * p + c] = column[p]);
        }
    }
    fn load_for_all(from: &[Counted]) -> Self::Records {
        Vector::load(from)
    }
    fn load_first(from: &[Counted]) -> Self::Records {
        Vector::load(from)
    }
    fn spread(record: Self::Records, entry: usize) -> Self::Records {
        Vector::splat(entries(record)[entry])
    }
    fn sum_points(record: Self::Records) -> Self::Quad {
        record
    }
    fn join(first: Self::Records, last: Self::Records) -> Self::Records {
        let ([a, b, ..], [.., c, d]) = (entries(first), entries(last));
        Vector::load(&[a, b, c, d])
    }
    fn first_twice(quad: Self::Records) -> Self::Records {
        let [a, b, ..] = entries(quad);
        Vector::load(&[a, b, a, b])
    }
}

fn entries(vector: Array<Counted, 4>) -> [Counted; 4] {
    let mut entries = [Counted(0.0); 4];
    vector.store(&mut entries);
    entries
}

/// Flop per point and substep, nodes included.
pub struct Flop {
    /// With no point yielding.
    pub elastic: f64,
    /// What is added for each yielding point, idle lanes of its vector included.
    pub per_return: f64,
}

impl Flop {
    /// Counts them in two blocks: one at rest and one with a yielding band.
    pub fn count<D: Dimension>(cells: [i32; 3]) -> Self {
        let (elastic, few) = in_block(block::<Counted, D>(cells, 0.0, BAND));
        let (mixed, many) = in_block(block::<Counted, D>(cells, 1.0, BAND));
        let per_return = (mixed - elastic) / (many - few);
        Flop { elastic: elastic - few * per_return, per_return }
    }

    /// Flop per point and substep where a share of the points yields (-).
    pub fn at(&self, yielding: f64) -> f64 {
        self.elastic + yielding * self.per_return
    }
}

/// Flop per point in one substep, and the share of the points that yielded in it.
fn in_block<D: Dimension>(mut solver: BlockIn<Counted, D, Gimp<Counted>>) -> (f64, f64) {
    let strains = |solver: &dyn Solver| {
        let mut strains = Vec::new();
        solver.visit_points(&mut |point| strains.push((point.id, point.report.plastic_strain)));
        strains.sort_unstable_by_key(|strain| strain.0);
        strains
    };
    for _ in 0..2 {
        solver.step(&MOTION, false).expect("a stable block");
    }
    let before = strains(&solver);
    FLOP.with(|flop| flop.set(0));
    solver.step(&MOTION, false).expect("a stable block");
    let flop = FLOP.with(Cell::get) as f64;
    let yielding = strains(&solver).iter().zip(&before).filter(|(now, before)| now.1 > before.1).count();
    let points = before.len() as f64;
    (flop / points, yielding as f64 / points)
}
