//! Vectors as plain arrays, for any processor, and the operations of the numbers in them.
//!
//! The loops over lanes have a fixed length and no branches, so that the compiler turns them into whatever
//! vector instructions every processor of the platform has (SSE2 on x86-64, NEON on AArch64).

use std::marker::PhantomData;
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign};

use super::{InstructionSet, Kernel, Mask, Real, Simd, Vector};

/// The instruction set that needs none: arrays of two `f64` or four `f32`, as many as every x86-64 processor
/// and AArch64 have in a register.
#[derive(Clone, Copy, Debug)]
pub struct Portable<R>(PhantomData<R>);

/// `N` numbers side by side.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Array<R, const N: usize>([R; N]);

/// Yes or no for each of `N` numbers.
#[derive(Clone, Copy, Debug)]
pub struct ArrayMask<const N: usize>([bool; N]);

/// The array of one expression for each of its `N` lanes, one, two or four, written out.
///
/// Not `each!`: kernels hold thousands of these, and the compiler took three times as long for a kernel with
/// so many loops (book/src/evidence/performance.md, building). `$nothing` is what fills the array before; a
/// constant, since anything else fills it in a loop.
macro_rules! lanes {
    ($nothing:expr, $index:ident => $entry:expr) => {{
        const { assert!(N == 1 || N == 2 || N == 4) };
        let mut entries = [$nothing; N];
        lanes!(@ entries, 0, $index => $entry);
        if N > 1 {
            lanes!(@ entries, 1, $index => $entry);
        }
        if N == 4 {
            lanes!(@ entries, 2, $index => $entry);
            lanes!(@ entries, 3, $index => $entry);
        }
        entries
    }};
    (@ $entries:ident, $lane:literal, $index:ident => $entry:expr) => {
        let $index: usize = $lane;
        $entries[$index] = $entry;
    };
}

/// One operator of an array and its assigning twin.
macro_rules! operator {
    ($operator:ident, $function:ident, $assign:ident, $assign_function:ident) => {
        impl<R: Real, const N: usize> $operator for Array<R, N> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, o: Self) -> Self {
                Self(lanes!(R::ZERO, i => $operator::$function(self.0[i], o.0[i])))
            }
        }
        impl<R: Real, const N: usize> $assign for Array<R, N> {
            #[inline(always)]
            fn $assign_function(&mut self, o: Self) {
                *self = $operator::$function(*self, o);
            }
        }
    };
}
operator!(Add, add, AddAssign, add_assign);
operator!(Sub, sub, SubAssign, sub_assign);
operator!(Mul, mul, MulAssign, mul_assign);
operator!(Div, div, DivAssign, div_assign);

impl<R: Real, const N: usize> Neg for Array<R, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(lanes!(R::ZERO, i => -self.0[i]))
    }
}

impl<R: Real, const N: usize> Default for Array<R, N> {
    #[inline(always)]
    fn default() -> Self {
        Self([R::ZERO; N])
    }
}

/// The one lane left after the upper half has been joined to the lower as often as needed.
#[inline(always)]
pub(super) fn fold<R: Real, const N: usize>(mut lanes: [R; N], join: impl Fn(R, R) -> R) -> R {
    let mut half = N / 2;
    while half > 0 {
        let mut i = 0;
        while i < half {
            lanes[i] = join(lanes[i], lanes[i + half]);
            i += 1;
        }
        half /= 2;
    }
    lanes[0]
}

impl<R: Real, const N: usize> Vector for Array<R, N> {
    type Scalar = R;
    type Mask = ArrayMask<N>;
    const LANES: usize = N;

    #[inline(always)]
    fn splat(x: R) -> Self {
        Self(lanes!(R::ZERO, _i => x))
    }
    #[inline(always)]
    fn load(from: &[R]) -> Self {
        Self(*from.first_chunk().expect("at least as many numbers as lanes"))
    }
    #[inline(always)]
    fn store(self, to: &mut [R]) {
        *to.first_chunk_mut().expect("at least as many places as lanes") = self.0;
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(lanes!(R::ZERO, i => self.0[i].sqrt()))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(lanes!(R::ZERO, i => self.0[i].abs()))
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Self(lanes!(R::ZERO, i => self.0[i].min(o.0[i])))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Self(lanes!(R::ZERO, i => self.0[i].max(o.0[i])))
    }
    #[inline(always)]
    fn round(self) -> Self {
        Self(lanes!(R::ZERO, i => self.0[i].round()))
    }
    #[inline(always)]
    fn lt(self, o: Self) -> ArrayMask<N> {
        ArrayMask(lanes!(false, i => self.0[i] < o.0[i]))
    }
    #[inline(always)]
    fn le(self, o: Self) -> ArrayMask<N> {
        ArrayMask(lanes!(false, i => self.0[i] <= o.0[i]))
    }
    #[inline(always)]
    fn gt(self, o: Self) -> ArrayMask<N> {
        ArrayMask(lanes!(false, i => self.0[i] > o.0[i]))
    }
    #[inline(always)]
    fn ge(self, o: Self) -> ArrayMask<N> {
        ArrayMask(lanes!(false, i => self.0[i] >= o.0[i]))
    }
    #[inline(always)]
    fn select(mask: ArrayMask<N>, yes: Self, no: Self) -> Self {
        Self(lanes!(R::ZERO, i => if mask.0[i] { yes.0[i] } else { no.0[i] }))
    }
    #[inline(always)]
    fn sum(self) -> R {
        fold(self.0, |a, b| a + b)
    }
    #[inline(always)]
    fn max_lane(self) -> R {
        fold(self.0, R::max)
    }
    #[inline(always)]
    fn min_lane(self) -> R {
        fold(self.0, R::min)
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        let split = lanes!((R::ZERO, R::ZERO), i => self.0[i].split_exponent());
        (Self(lanes!(R::ZERO, i => split[i].0)), Self(lanes!(R::ZERO, i => split[i].1)))
    }
    #[inline(always)]
    fn scale_exponent(self, k: Self) -> Self {
        Self(lanes!(R::ZERO, i => self.0[i].scale_exponent(k.0[i])))
    }
    #[inline(always)]
    fn store_i32(self, to: &mut [i32]) {
        *to.first_chunk_mut().expect("at least as many places as lanes") = lanes!(0, i => self.0[i].to_i32());
    }
    #[inline(always)]
    fn load_i32(from: &[i32]) -> Self {
        let from: &[i32; N] = from.first_chunk().expect("at least as many integers as lanes");
        Self(lanes!(R::ZERO, i => R::from_i32(from[i])))
    }
    #[inline(always)]
    fn outlined<K: Kernel<R>>(part: K) -> K::Output {
        R::run(InstructionSet::Portable, part)
    }
}

impl<const N: usize> BitAnd for ArrayMask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        Self(lanes!(false, i => self.0[i] & o.0[i]))
    }
}
impl<const N: usize> BitOr for ArrayMask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, o: Self) -> Self {
        Self(lanes!(false, i => self.0[i] | o.0[i]))
    }
}
impl<const N: usize> Not for ArrayMask<N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(lanes!(false, i => !self.0[i]))
    }
}
impl<const N: usize> Mask for ArrayMask<N> {
    #[inline(always)]
    fn any(self) -> bool {
        self.0.into_iter().fold(false, |any, lane| any | lane)
    }
    #[inline(always)]
    fn all(self) -> bool {
        self.0.into_iter().fold(true, |all, lane| all & lane)
    }
}

/// Splits `4 N` numbers into four vectors of `N`.
#[inline(always)]
fn load_transposed<R: Real, const N: usize>(from: &[R]) -> [Array<R, N>; 4] {
    let from = &from[..4 * N];
    each!(c < 4 => Array(each!(p < N => from[4 * p + c])))
}

/// Joins four vectors of `N` to `4 N` numbers.
#[inline(always)]
fn store_transposed<R: Real, const N: usize>(lanes: [Array<R, N>; 4], to: &mut [R]) {
    let to = &mut to[..4 * N];
    for p in 0..N {
        for c in 0..4 {
            to[4 * p + c] = lanes[c].0[p];
        }
    }
}

/// Implements [`Simd`] with `$lanes` points side by side.
macro_rules! simd {
    ($scalar:ident, $lanes:literal) => {
        impl Simd for Portable<$scalar> {
            type Scalar = $scalar;
            type Lanes = Array<$scalar, $lanes>;
            type Quad = Array<$scalar, 4>;
            one_abreast!();

            #[inline(always)]
            fn load_transposed(from: &[$scalar]) -> [Self::Lanes; 4] {
                load_transposed(from)
            }
            #[inline(always)]
            fn store_transposed(lanes: [Self::Lanes; 4], to: &mut [$scalar]) {
                store_transposed(lanes, to);
            }

            #[inline(always)]
            fn join(Array([a, b, ..]): Self::Records, Array([.., c, d]): Self::Records) -> Self::Records {
                Array([a, b, c, d])
            }
            #[inline(always)]
            fn first_twice(Array([a, b, ..]): Self::Records) -> Self::Records {
                Array([a, b, a, b])
            }
        }
    };
}

simd!(f64, 2);
simd!(f32, 4);

units! {
    /// Runs a kernel on plain arrays.
    #[inline(never)]
    pub fn run<R: Real, S: Simd<Scalar = R>, K: Kernel<R>>(kernel: K) -> K::Output {
        kernel.run::<S>()
    }
}

/// Runs a kernel on plain arrays, in its unit.
#[inline(always)]
pub(super) fn run<R: Real, S: Simd<Scalar = R>, K: Kernel<R>>(kernel: K) -> K::Output {
    match K::UNIT {
        0 => unit_0::run::<R, S, K>(kernel),
        1 => unit_1::run::<R, S, K>(kernel),
        2 => unit_2::run::<R, S, K>(kernel),
        _ => unit_3::run::<R, S, K>(kernel),
    }
}
