//! Several points side by side, and one kernel compiled for every instruction set.
//!
//! A kernel is written once against [`Simd`] and [`Vector`], with ordinary operators; [`dispatch`] runs the
//! copy of it that was compiled for the instruction set asked for. The choice is made at run time because one
//! library is shipped for every processor of a platform: without it the whole solver would be confined to the
//! oldest one's instructions.
//!
//! * `portable`: plain arrays, for any processor, and the independent check of the next;
//! * `avx2`: 256-bit registers with fused multiply-add, on x86-64 processors since 2013;
//! * [`pair`]: two vectors as one, for work that waits for its own results;
//! * [`math`]: exp, ln and pow of a whole vector, without branches or tables.
//!
//! All `unsafe` of the numerical code is in this folder. The vectors of `avx2` cannot be named outside it: a
//! kernel receives them only from [`dispatch`], which has checked the processor. That check is what makes
//! their use safe.
//!
//! The two instruction sets differ in the last bits, since only one fuses multiplication and addition.

/// The array of one expression for each index below a number: `each!(k < 3 => f(k))`.
///
/// A loop, and not `array::from_fn` or `map`: a closure given to those is compiled by itself first, without
/// the instruction set of the kernel around it, and intrinsics cannot be inlined there. Only link-time
/// optimisation would mend that afterwards.
macro_rules! each {
    ($index:ident < $count:expr => $entry:expr) => {{
        let mut entries = [Default::default(); $count];
        let mut $index = 0;
        while $index < $count {
            entries[$index] = $entry;
            $index += 1;
        }
        entries
    }};
}
pub(crate) use each;

/// A function of a closure that is always inlined, for the same reason: `inlined!(D::vector, |axis|
/// f(axis))`.
macro_rules! inlined {
    ($function:path, |$($index:ident),+| $entry:expr) => {
        $function(
            #[inline(always)]
            |$($index),+| $entry,
        )
    };
}
pub(crate) use inlined;

/// What [`Simd`] asks of records where a register holds those of one point.
macro_rules! one_abreast {
    () => {
        type Records = Self::Quad;

        #[inline(always)]
        fn load_for_all(from: &[Self::Scalar]) -> Self::Records {
            Self::Quad::load(from)
        }
        #[inline(always)]
        fn load_first(from: &[Self::Scalar]) -> Self::Records {
            Self::Quad::load(from)
        }
        #[inline(always)]
        fn spread(record: Self::Records, entry: usize) -> Self::Records {
            let mut entries = [0.0; 4];
            record.store(&mut entries);
            Self::Quad::splat(entries[entry])
        }
        #[inline(always)]
        fn sum_points(records: Self::Records) -> Self::Quad {
            records
        }
    };
}

/// Four units of compilation, `unit_0` to `unit_3`, each with a copy of the function given
/// ([`Kernel::UNIT`]).
macro_rules! units {
    (@ $unit:ident $run:item) => {
        mod $unit {
            use super::{Kernel, Real, Simd};

            $run
        }
    };
    ($run:item) => {
        units!(@ unit_0 $run);
        units!(@ unit_1 $run);
        units!(@ unit_2 $run);
        units!(@ unit_3 $run);
    };
}

#[cfg(target_arch = "x86_64")]
mod avx2;
pub mod math;
pub mod pair;
mod portable;
mod scalar;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

use std::fmt::{Debug, Display};
use std::iter::Sum;
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign};

pub use portable::{Array, ArrayMask, Portable};

/// A number, `f32` or `f64`: the precision of a kernel.
pub trait Real:
    Copy
    + Default
    + Debug
    + Display
    + PartialEq
    + PartialOrd
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + Sum
{
    /// Distance from one to the next larger number.
    const EPSILON: Self;
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// Whether this is `f32`; where a polynomial has fewer terms then, the compiler removes the other branch.
    const IS_SINGLE: bool;

    /// The nearest number of this precision.
    fn from_f64(x: f64) -> Self;
    /// The same number, exactly.
    fn to_f64(self) -> f64;
    /// Square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// The larger one; `o` if either is not a number, as in [`Vector::max`].
    fn max(self, o: Self) -> Self;
    /// The smaller one; `o` if either is not a number, as in [`Vector::min`].
    fn min(self, o: Self) -> Self;
    /// The nearest integral number, the even one of two equally near.
    fn round(self) -> Self;
    /// (m, k) with self = m 2^k; see [`Vector::split_exponent`].
    fn split_exponent(self) -> (Self, Self);
    /// self 2^k; see [`Vector::scale_exponent`].
    fn scale_exponent(self, k: Self) -> Self;
    /// The nearest integer, the even one of two equally near; see [`Vector::store_i32`].
    fn to_i32(self) -> i32;
    /// The nearest number of this precision to an integer.
    fn from_i32(i: i32) -> Self;

    /// Runs a kernel in this precision; use [`dispatch`].
    #[doc(hidden)]
    fn run<K: Kernel<Self>>(set: InstructionSet, kernel: K) -> K::Output;
}

/// A few numbers side by side (its lanes), with ordinary operators.
pub trait Vector:
    Copy
    + Default
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
{
    /// The number in a lane.
    type Scalar: Real;
    /// What a comparison gives: yes or no for each lane.
    type Mask: Mask;
    /// Number of lanes.
    const LANES: usize;

    /// The same number in every lane.
    fn splat(x: Self::Scalar) -> Self;

    /// The same number in every lane, rounded to the precision at hand.
    #[inline(always)]
    fn constant(x: f64) -> Self {
        Self::splat(Self::Scalar::from_f64(x))
    }

    /// The first `LANES` numbers of a slice, of any alignment. Panics if there are fewer.
    fn load(from: &[Self::Scalar]) -> Self;
    /// Writes the lanes to the first `LANES` numbers of a slice, of any alignment. Panics if there are fewer.
    fn store(self, to: &mut [Self::Scalar]);
    /// self a + b, rounded once where the instruction set can, else twice (two fast instructions beat one
    /// slow call).
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// Square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// The smaller number; `o` where either is not a number.
    fn min(self, o: Self) -> Self;
    /// The larger number; `o` where either is not a number.
    fn max(self, o: Self) -> Self;
    /// The nearest integral number, the even one of two equally near.
    fn round(self) -> Self;
    /// Where self < o.
    fn lt(self, o: Self) -> Self::Mask;
    /// Where self ≤ o.
    fn le(self, o: Self) -> Self::Mask;
    /// Where self > o.
    fn gt(self, o: Self) -> Self::Mask;
    /// Where self ≥ o.
    fn ge(self, o: Self) -> Self::Mask;
    /// `yes` where the mask is true, `no` elsewhere; both have been computed.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Sum of all lanes. The upper half is added to the lower until one lane is left, (x₀ + x₂) + (x₁ + x₃)
    /// for four lanes: the same order, hence the same bits, in every instruction set with as many lanes.
    fn sum(self) -> Self::Scalar;
    /// The largest lane.
    fn max_lane(self) -> Self::Scalar;
    /// The smallest lane.
    fn min_lane(self) -> Self::Scalar;

    /// Mantissa m in [√½, √2) and exponent k, an integral number, with self = m 2^k: the first step of a
    /// logarithm.
    ///
    /// For positive normal numbers. Zero and subnormal numbers give the smallest k, less one, and m = 1 plus
    /// what they hold, so that m 2^k stays positive and grows with self; infinity gives m = 1 and the largest
    /// k, plus one.
    fn split_exponent(self) -> (Self, Self);

    /// self 2^k for integral k, by integer addition to the exponent: the last step of an exponential.
    ///
    /// self and the result must be normal numbers, and not zero. Not a number stays so if k is not a number
    /// either.
    fn scale_exponent(self, k: Self) -> Self;

    /// Writes the nearest integers (even one of two equally near) to the first `LANES` places of a slice.
    /// Panics if there are fewer. What an `i32` cannot hold gives an integer that depends on the instruction
    /// set.
    fn store_i32(self, to: &mut [i32]);
    /// The first `LANES` integers of a slice, rounded to the precision at hand. Panics if there are fewer.
    fn load_i32(from: &[i32]) -> Self;

    /// Runs a part of a kernel as a function of its own, with the vectors of the instruction set that this
    /// one belongs to.
    fn outlined<K: Kernel<Self::Scalar>>(part: K) -> K::Output;
}

/// Yes or no for each lane of a vector.
pub trait Mask:
    Copy + Debug + Send + Sync + 'static + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// Whether it is true in at least one lane.
    fn any(self) -> bool;
    /// Whether it is true in every lane.
    fn all(self) -> bool;
}

/// One instruction set in one precision: a vector of points side by side, and a vector of four for one grid
/// node.
pub trait Simd: Copy + Send + Sync + 'static {
    /// The precision.
    type Scalar: Real;
    /// As many points as a register holds: 4 in `f64` and 8 in `f32` with AVX2, half as many without.
    type Lanes: Vector<Scalar = Self::Scalar>;
    /// The four numbers of one grid node.
    type Quad: Vector<Scalar = Self::Scalar>;
    /// Four numbers of each of `ABREAST` points, one point after another.
    type Records: Vector<Scalar = Self::Scalar>;
    /// Points whose four numbers a register holds: 2 in `f32` with AVX2, else 1.
    const ABREAST: usize = Self::Records::LANES / 4;

    /// Gathers four components of `Lanes::LANES` points stored one after another, `from[4 p + c]`, into one
    /// vector per component: result `c`, lane `p`. Panics if `from` is shorter than four times the lanes.
    fn load_transposed(from: &[Self::Scalar]) -> [Self::Lanes; 4];
    /// Writes lane `p` of vector `c` to `to[4 p + c]`. Panics if `to` is shorter than four times the lanes.
    fn store_transposed(lanes: [Self::Lanes; 4], to: &mut [Self::Scalar]);

    /// The first four numbers of a slice for every point. Panics if there are fewer.
    fn load_for_all(from: &[Self::Scalar]) -> Self::Records;
    /// The first four numbers of a slice for the first point, zeros for the others. Panics if there are
    /// fewer.
    fn load_first(from: &[Self::Scalar]) -> Self::Records;
    /// Entry `entry` (below 4) of each record in all four of its places.
    fn spread(records: Self::Records, entry: usize) -> Self::Records;
    /// Sum over the points.
    fn sum_points(records: Self::Records) -> Self::Quad;

    /// The first two numbers of each record of one vector and the last two of another.
    fn join(first: Self::Records, last: Self::Records) -> Self::Records;
    /// The first two numbers of each record, twice.
    fn first_twice(records: Self::Records) -> Self::Records;

    /// Asks for part `part` of `parts` of something's memory before it is needed: a hint that changes nothing
    /// but the time, and is none where the instruction set has no such hint.
    #[inline(always)]
    fn prefetch<T>(_what: &T, _part: usize, _parts: usize) {}

    /// Runs a part of a kernel as a function of its own, which is compiled once for all kernels that share
    /// it.
    #[inline(always)]
    fn outlined<K: Kernel<Self::Scalar>>(part: K) -> K::Output {
        Self::Lanes::outlined(part)
    }
}

/// Work that is compiled once per instruction set.
///
/// `run` and all it calls are marked `#[inline(always)]`: only what is inlined into [`dispatch`] is compiled
/// for the instruction set. Hence threads are started outside: each calls `dispatch` by itself, since a
/// closure that another thread runs is not inlined.
pub trait Kernel<R: Real> {
    /// What the work gives.
    type Output;
    /// Unit of compilation, 0 to 3. The compiler works at several at once, but puts all copies of a generic
    /// function into one: kernels that come in many heavy copies spread them with this.
    const UNIT: usize = 0;
    /// Does the work with the vectors of one instruction set.
    fn run<S: Simd<Scalar = R>>(self) -> Self::Output;
}

/// Runs a kernel compiled for `set`. Panics if the processor does not have it.
///
/// Costs one call that is not inlined and one load: call it for many points, not for one.
#[inline]
pub fn dispatch<R: Real, K: Kernel<R>>(set: InstructionSet, kernel: K) -> K::Output {
    R::run(set, kernel)
}

/// An instruction set that kernels are compiled for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum InstructionSet {
    /// What every processor of the platform has.
    Portable,
    /// AVX2 and FMA of x86-64.
    Avx2,
}

impl InstructionSet {
    /// Every instruction set, available here or not.
    pub const ALL: [Self; 2] = [Self::Portable, Self::Avx2];

    /// The fastest instruction set of this processor.
    pub fn detect() -> Self {
        if Self::Avx2.is_available() { Self::Avx2 } else { Self::Portable }
    }

    /// Whether this processor has it.
    #[inline]
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 => false,
        }
    }

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        if self == Self::Avx2 { "avx2" } else { "portable" }
    }
}
