//! Vectors in the registers of AVX2 with FMA.
//!
//! Each register type has a module that gives its intrinsics the same short names; one macro then writes the
//! vector. The types are private to `simd`: see there for why their use is safe.

use core::arch::x86_64::*;
use std::marker::PhantomData;
use std::mem::transmute;
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign};

use super::portable::fold;
use super::{Kernel, Mask, Real, Simd, Vector};

/// The instruction set AVX2 with FMA: four `f64` or eight `f32` in a register.
#[derive(Clone, Copy, Debug)]
pub struct Avx2<R>(PhantomData<R>);

units! {
    /// Runs a kernel compiled for AVX2 and FMA: all that is inlined here is.
    ///
    /// # Safety
    /// The processor has AVX2 and FMA.
    #[target_feature(enable = "avx2,fma")]
    #[inline(never)]
    pub unsafe fn run<R: Real, S: Simd<Scalar = R>, K: Kernel<R>>(kernel: K) -> K::Output {
        kernel.run::<S>()
    }
}

/// Runs a kernel compiled for AVX2 and FMA, in its unit.
///
/// # Safety
/// The processor has AVX2 and FMA.
#[inline(always)]
pub unsafe fn run<R: Real, S: Simd<Scalar = R>, K: Kernel<R>>(kernel: K) -> K::Output {
    // SAFETY: the caller's.
    unsafe {
        match K::UNIT {
            0 => unit_0::run::<R, S, K>(kernel),
            1 => unit_1::run::<R, S, K>(kernel),
            2 => unit_2::run::<R, S, K>(kernel),
            _ => unit_3::run::<R, S, K>(kernel),
        }
    }
}

/// Intrinsics that touch registers only.
macro_rules! registers {
    ($intrinsics:expr) => {
        // SAFETY: these intrinsics only ask for AVX2 and FMA; a kernel gets our vectors from `run` alone,
        // whose caller has found both.
        unsafe { $intrinsics }
    };
}

/// Four `f64`.
mod f64x4 {
    pub use core::arch::x86_64::{
        __m256d as Register, _mm_loadu_si128 as load_integers, _mm_storeu_si128 as store_integers,
        _mm256_add_epi64 as add_bits, _mm256_add_pd as add, _mm256_and_pd as and,
        _mm256_and_si256 as and_bits, _mm256_andnot_pd as and_not, _mm256_blendv_pd as blend,
        _mm256_castpd_si256 as to_bits, _mm256_castsi256_pd as from_bits, _mm256_cmp_pd as compare,
        _mm256_cvtepi32_pd as from_integers, _mm256_cvtpd_epi32 as to_integers, _mm256_div_pd as div,
        _mm256_fmadd_pd as mul_add, _mm256_max_pd as max, _mm256_min_pd as min, _mm256_movemask_pd as signs,
        _mm256_mul_pd as mul, _mm256_or_pd as or, _mm256_or_si256 as or_bits, _mm256_round_pd as round,
        _mm256_set1_epi64x as splat_bits, _mm256_set1_pd as splat, _mm256_slli_epi64 as shift_left,
        _mm256_sqrt_pd as sqrt, _mm256_srli_epi64 as shift_right, _mm256_sub_pd as sub, _mm256_xor_pd as xor,
    };
}

/// Eight `f32`.
mod f32x8 {
    pub use core::arch::x86_64::{
        __m256 as Register, _mm256_add_epi32 as add_bits, _mm256_add_ps as add, _mm256_and_ps as and,
        _mm256_and_si256 as and_bits, _mm256_andnot_ps as and_not, _mm256_blendv_ps as blend,
        _mm256_castps_si256 as to_bits, _mm256_castsi256_ps as from_bits, _mm256_cmp_ps as compare,
        _mm256_cvtepi32_ps as from_integers, _mm256_cvtps_epi32 as to_integers, _mm256_div_ps as div,
        _mm256_fmadd_ps as mul_add, _mm256_loadu_si256 as load_integers, _mm256_max_ps as max,
        _mm256_min_ps as min, _mm256_movemask_ps as signs, _mm256_mul_ps as mul, _mm256_or_ps as or,
        _mm256_or_si256 as or_bits, _mm256_round_ps as round, _mm256_set1_epi32 as splat_bits,
        _mm256_set1_ps as splat, _mm256_slli_epi32 as shift_left, _mm256_sqrt_ps as sqrt,
        _mm256_srli_epi32 as shift_right, _mm256_storeu_si256 as store_integers, _mm256_sub_ps as sub,
        _mm256_xor_ps as xor,
    };
}

/// Four `f32`.
mod f32x4 {
    pub use core::arch::x86_64::{
        __m128 as Register, _mm_add_epi32 as add_bits, _mm_add_ps as add, _mm_and_ps as and,
        _mm_and_si128 as and_bits, _mm_andnot_ps as and_not, _mm_blendv_ps as blend,
        _mm_castps_si128 as to_bits, _mm_castsi128_ps as from_bits, _mm_cmp_ps as compare,
        _mm_cvtepi32_ps as from_integers, _mm_cvtps_epi32 as to_integers, _mm_div_ps as div,
        _mm_fmadd_ps as mul_add, _mm_loadu_si128 as load_integers, _mm_max_ps as max, _mm_min_ps as min,
        _mm_movemask_ps as signs, _mm_mul_ps as mul, _mm_or_ps as or, _mm_or_si128 as or_bits,
        _mm_round_ps as round, _mm_set1_epi32 as splat_bits, _mm_set1_ps as splat,
        _mm_slli_epi32 as shift_left, _mm_sqrt_ps as sqrt, _mm_srli_epi32 as shift_right,
        _mm_storeu_si128 as store_integers, _mm_sub_ps as sub, _mm_xor_ps as xor,
    };
}

/// One operator of a vector and its assigning twin.
macro_rules! operator {
    ($vector:ident, $reg:ident, $operator:ident, $function:ident, $assign:ident, $assign_function:ident) => {
        impl $operator for $vector {
            type Output = Self;
            #[inline(always)]
            fn $function(self, o: Self) -> Self {
                Self(registers!($reg::$function(self.0, o.0)))
            }
        }
        impl $assign for $vector {
            #[inline(always)]
            fn $assign_function(&mut self, o: Self) {
                *self = $operator::$function(*self, o);
            }
        }
    };
}

/// A vector of `$lanes` numbers `$scalar` and its mask; `$int` is the signed integer of the same size, `$reg`
/// the module of intrinsics.
macro_rules! vector {
    ($vector:ident, $mask:ident, $reg:ident, $scalar:ident, $int:ident, $lanes:literal) => {
        #[doc = concat!("Numbers of type ", stringify!($scalar), " in one register.")]
        #[derive(Clone, Copy, Debug)]
        #[repr(transparent)]
        pub struct $vector($reg::Register);

        #[doc = concat!("Comparison of two `", stringify!($vector), "`: all bits of a lane are its answer.")]
        #[derive(Clone, Copy, Debug)]
        #[repr(transparent)]
        pub struct $mask($reg::Register);

        operator!($vector, $reg, Add, add, AddAssign, add_assign);
        operator!($vector, $reg, Sub, sub, SubAssign, sub_assign);
        operator!($vector, $reg, Mul, mul, MulAssign, mul_assign);
        operator!($vector, $reg, Div, div, DivAssign, div_assign);

        impl Neg for $vector {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self(registers!($reg::xor(self.0, $reg::splat(-0.0))))
            }
        }

        impl Default for $vector {
            #[inline(always)]
            fn default() -> Self {
                Self::splat(0.0)
            }
        }

        impl $vector {
            /// The lanes as an array; the compiler keeps them in registers.
            #[inline(always)]
            fn lanes(self) -> [$scalar; $lanes] {
                let mut lanes = [0.0; $lanes];
                self.store(&mut lanes);
                lanes
            }
        }

        impl Vector for $vector {
            type Scalar = $scalar;
            type Mask = $mask;
            const LANES: usize = $lanes;

            #[inline(always)]
            fn splat(x: $scalar) -> Self {
                Self(registers!($reg::splat(x)))
            }
            #[inline(always)]
            fn load(from: &[$scalar]) -> Self {
                let from: &[$scalar; $lanes] = from.first_chunk().expect("at least as many numbers as lanes");
                // SAFETY: every bit pattern of the array is one of the register, which has the same size.
                Self(unsafe { transmute::<[$scalar; $lanes], $reg::Register>(*from) })
            }
            #[inline(always)]
            fn store(self, to: &mut [$scalar]) {
                let to: &mut [$scalar; $lanes] =
                    to.first_chunk_mut().expect("at least as many places as lanes");
                // SAFETY: every bit pattern of the register is one of the array, which has the same size.
                *to = unsafe { transmute::<$reg::Register, [$scalar; $lanes]>(self.0) };
            }
            #[inline(always)]
            fn mul_add(self, a: Self, b: Self) -> Self {
                Self(registers!($reg::mul_add(self.0, a.0, b.0)))
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(registers!($reg::sqrt(self.0)))
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self(registers!($reg::and_not($reg::splat(-0.0), self.0)))
            }
            #[inline(always)]
            fn min(self, o: Self) -> Self {
                Self(registers!($reg::min(self.0, o.0)))
            }
            #[inline(always)]
            fn max(self, o: Self) -> Self {
                Self(registers!($reg::max(self.0, o.0)))
            }
            #[inline(always)]
            fn round(self) -> Self {
                Self(registers!($reg::round::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(self.0)))
            }
            #[inline(always)]
            fn lt(self, o: Self) -> $mask {
                $mask(registers!($reg::compare::<_CMP_LT_OQ>(self.0, o.0)))
            }
            #[inline(always)]
            fn le(self, o: Self) -> $mask {
                $mask(registers!($reg::compare::<_CMP_LE_OQ>(self.0, o.0)))
            }
            #[inline(always)]
            fn gt(self, o: Self) -> $mask {
                $mask(registers!($reg::compare::<_CMP_GT_OQ>(self.0, o.0)))
            }
            #[inline(always)]
            fn ge(self, o: Self) -> $mask {
                $mask(registers!($reg::compare::<_CMP_GE_OQ>(self.0, o.0)))
            }
            #[inline(always)]
            fn select(mask: $mask, yes: Self, no: Self) -> Self {
                Self(registers!($reg::blend(no.0, yes.0, mask.0)))
            }
            #[inline(always)]
            fn sum(self) -> $scalar {
                fold(self.lanes(), |a, b| a + b)
            }
            #[inline(always)]
            fn max_lane(self) -> $scalar {
                fold(self.lanes(), Real::max)
            }
            #[inline(always)]
            fn min_lane(self) -> $scalar {
                fold(self.lanes(), Real::min)
            }
            #[inline(always)]
            fn split_exponent(self) -> (Self, Self) {
                const SHIFT: i32 = $scalar::MANTISSA_DIGITS as i32 - 1;
                const SQRT_HALF: $int = (std::f64::consts::FRAC_1_SQRT_2 as $scalar).to_bits() as $int;
                const ONE: $int = (1.0 as $scalar).to_bits() as $int;
                // 2^52 (2^23), whose last bits count ones: an integer below it put there becomes a number.
                const INTEGRAL: $scalar = 1.0 / $scalar::EPSILON;
                const BIAS: $scalar = ($scalar::MAX_EXP - 1) as $scalar;
                let (mantissa, exponent) = registers!({
                    let shifted = $reg::add_bits($reg::to_bits(self.0), $reg::splat_bits(ONE - SQRT_HALF));
                    let mantissa = $reg::and_bits(shifted, $reg::splat_bits((1 << SHIFT) - 1));
                    let exponent = $reg::or_bits(
                        $reg::shift_right::<SHIFT>(shifted),
                        $reg::splat_bits(INTEGRAL.to_bits() as $int),
                    );
                    (
                        $reg::from_bits($reg::add_bits(mantissa, $reg::splat_bits(SQRT_HALF))),
                        $reg::from_bits(exponent),
                    )
                });
                (Self(mantissa), Self(exponent) - Self::splat(INTEGRAL + BIAS))
            }
            #[inline(always)]
            fn scale_exponent(self, k: Self) -> Self {
                const SHIFT: i32 = $scalar::MANTISSA_DIGITS as i32 - 1;
                // The sum's last bits are those of k in two's complement.
                let k = k + Self::splat(1.5 / $scalar::EPSILON);
                Self(registers!($reg::from_bits($reg::add_bits(
                    $reg::to_bits(self.0),
                    $reg::shift_left::<SHIFT>($reg::to_bits(k.0)),
                ))))
            }
            #[inline(always)]
            fn store_i32(self, to: &mut [i32]) {
                let to: &mut [i32; $lanes] = to.first_chunk_mut().expect("at least as many places as lanes");
                // SAFETY: the array is as long as the register, whose store takes any alignment; AVX2 as
                // above.
                unsafe { $reg::store_integers(to.as_mut_ptr().cast(), $reg::to_integers(self.0)) }
            }
            #[inline(always)]
            fn load_i32(from: &[i32]) -> Self {
                let from: &[i32; $lanes] = from.first_chunk().expect("at least as many integers as lanes");
                // SAFETY: the array is as long as the register, whose load takes any alignment; AVX2 as
                // above.
                Self(unsafe { $reg::from_integers($reg::load_integers(from.as_ptr().cast())) })
            }
            #[inline(always)]
            fn outlined<K: Kernel<$scalar>>(part: K) -> K::Output {
                // SAFETY: these vectors exist within `run` alone, whose caller has found AVX2 and FMA.
                unsafe { run::<$scalar, Avx2<$scalar>, K>(part) }
            }
        }

        impl BitAnd for $mask {
            type Output = Self;
            #[inline(always)]
            fn bitand(self, o: Self) -> Self {
                Self(registers!($reg::and(self.0, o.0)))
            }
        }
        impl BitOr for $mask {
            type Output = Self;
            #[inline(always)]
            fn bitor(self, o: Self) -> Self {
                Self(registers!($reg::or(self.0, o.0)))
            }
        }
        impl Not for $mask {
            type Output = Self;
            #[inline(always)]
            fn not(self) -> Self {
                Self(registers!($reg::xor(self.0, $reg::from_bits($reg::splat_bits(-1)))))
            }
        }
        impl Mask for $mask {
            #[inline(always)]
            fn any(self) -> bool {
                registers!($reg::signs(self.0)) != 0
            }
            #[inline(always)]
            fn all(self) -> bool {
                registers!($reg::signs(self.0)) == (1 << $lanes) - 1
            }
        }
    };
}

vector!(F64x4, MaskF64x4, f64x4, f64, i64, 4);
vector!(F32x8, MaskF32x8, f32x8, f32, i32, 8);
vector!(F32x4, MaskF32x4, f32x4, f32, i32, 4);

/// Rows (one vector per point) to columns (one vector per component), or back: a matrix of 4 × 4.
#[inline(always)]
fn transpose(rows: [F64x4; 4]) -> [F64x4; 4] {
    let [F64x4(a), F64x4(b), F64x4(c), F64x4(d)] = rows;
    registers!({
        let (ab_even, ab_odd) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
        let (cd_even, cd_odd) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
        [
            F64x4(_mm256_permute2f128_pd::<0x20>(ab_even, cd_even)),
            F64x4(_mm256_permute2f128_pd::<0x20>(ab_odd, cd_odd)),
            F64x4(_mm256_permute2f128_pd::<0x31>(ab_even, cd_even)),
            F64x4(_mm256_permute2f128_pd::<0x31>(ab_odd, cd_odd)),
        ]
    })
}

/// Rows to columns, or back, of two matrices of 4 × 4 at once: one in the lower, one in the upper halves.
#[inline(always)]
fn transpose_halves(rows: [F32x8; 4]) -> [F32x8; 4] {
    let [F32x8(a), F32x8(b), F32x8(c), F32x8(d)] = rows;
    registers!({
        let (ab_low, ab_high) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
        let (cd_low, cd_high) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
        [
            F32x8(_mm256_shuffle_ps::<0b01_00_01_00>(ab_low, cd_low)),
            F32x8(_mm256_shuffle_ps::<0b11_10_11_10>(ab_low, cd_low)),
            F32x8(_mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high)),
            F32x8(_mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high)),
        ]
    })
}

/// Points p and p + 4 in one register: what the transposition of halves needs to end with the lanes in order.
#[inline(always)]
fn load_pair(from: &[f32], p: usize) -> F32x8 {
    let (low, high) = (F32x4::load(&from[4 * p..]).0, F32x4::load(&from[4 * p + 16..]).0);
    F32x8(registers!(_mm256_insertf128_ps::<1>(_mm256_castps128_ps256(low), high)))
}

/// The reverse of `load_pair`.
#[inline(always)]
fn store_pair(pair: F32x8, to: &mut [f32], p: usize) {
    let (low, high) = registers!((_mm256_castps256_ps128(pair.0), _mm256_extractf128_ps::<1>(pair.0)));
    F32x4(low).store(&mut to[4 * p..]);
    F32x4(high).store(&mut to[4 * p + 16..]);
}

/// Asks for part `part` of `parts` of the cache lines of `what`, up to the second level: the first is full of
/// what is at hand. Each part has the same number of lines, known to the compiler, so the last may go on
/// behind
/// `what`.
#[inline(always)]
fn prefetch<T>(what: &T, part: usize, parts: usize) {
    const LINE: usize = 64;
    let lines = size_of::<T>().div_ceil(LINE);
    let each = lines.div_ceil(parts);
    let begin = std::ptr::from_ref(what).cast::<i8>();
    for line in part * each..(part + 1) * each {
        // SAFETY: a hint reads nothing that a program can see and faults at no address.
        unsafe { _mm_prefetch::<_MM_HINT_T1>(begin.wrapping_add(LINE * line)) }
    }
}

impl Simd for Avx2<f64> {
    type Scalar = f64;
    type Lanes = F64x4;
    type Quad = F64x4;
    one_abreast!();

    #[inline(always)]
    fn load_transposed(from: &[f64]) -> [F64x4; 4] {
        let from = &from[..16];
        transpose([
            F64x4::load(&from[..4]),
            F64x4::load(&from[4..8]),
            F64x4::load(&from[8..12]),
            F64x4::load(&from[12..]),
        ])
    }

    #[inline(always)]
    fn store_transposed(lanes: [F64x4; 4], to: &mut [f64]) {
        let to = &mut to[..16];
        let [a, b, c, d] = transpose(lanes);
        a.store(&mut to[..4]);
        b.store(&mut to[4..8]);
        c.store(&mut to[8..12]);
        d.store(&mut to[12..]);
    }

    #[inline(always)]
    fn join(first: F64x4, last: F64x4) -> F64x4 {
        F64x4(registers!(_mm256_blend_pd::<0b1100>(first.0, last.0)))
    }
    #[inline(always)]
    fn first_twice(record: F64x4) -> F64x4 {
        F64x4(registers!(_mm256_permute2f128_pd::<0>(record.0, record.0)))
    }

    #[inline(always)]
    fn prefetch<T>(what: &T, part: usize, parts: usize) {
        prefetch(what, part, parts);
    }
}

impl Simd for Avx2<f32> {
    type Scalar = f32;
    type Lanes = F32x8;
    type Quad = F32x4;
    type Records = F32x8;

    #[inline(always)]
    fn load_for_all(from: &[f32]) -> F32x8 {
        let record = F32x4::load(from).0;
        F32x8(registers!(_mm256_set_m128(record, record)))
    }
    #[inline(always)]
    fn load_first(from: &[f32]) -> F32x8 {
        let record = F32x4::load(from).0;
        F32x8(registers!(_mm256_zextps128_ps256(record)))
    }
    #[inline(always)]
    fn spread(records: F32x8, entry: usize) -> F32x8 {
        F32x8(registers!(match entry {
            0 => _mm256_permute_ps::<0b00_00_00_00>(records.0),
            1 => _mm256_permute_ps::<0b01_01_01_01>(records.0),
            2 => _mm256_permute_ps::<0b10_10_10_10>(records.0),
            _ => _mm256_permute_ps::<0b11_11_11_11>(records.0),
        }))
    }
    #[inline(always)]
    fn sum_points(records: F32x8) -> F32x4 {
        let (low, high) =
            registers!((_mm256_castps256_ps128(records.0), _mm256_extractf128_ps::<1>(records.0)));
        F32x4(low) + F32x4(high)
    }

    #[inline(always)]
    fn load_transposed(from: &[f32]) -> [F32x8; 4] {
        let from = &from[..32];
        transpose_halves([load_pair(from, 0), load_pair(from, 1), load_pair(from, 2), load_pair(from, 3)])
    }

    #[inline(always)]
    fn store_transposed(lanes: [F32x8; 4], to: &mut [f32]) {
        let to = &mut to[..32];
        let [a, b, c, d] = transpose_halves(lanes);
        store_pair(a, to, 0);
        store_pair(b, to, 1);
        store_pair(c, to, 2);
        store_pair(d, to, 3);
    }

    #[inline(always)]
    fn join(first: F32x8, last: F32x8) -> F32x8 {
        F32x8(registers!(_mm256_blend_ps::<0b1100_1100>(first.0, last.0)))
    }
    #[inline(always)]
    fn first_twice(records: F32x8) -> F32x8 {
        F32x8(registers!(_mm256_shuffle_ps::<0b01_00_01_00>(records.0, records.0)))
    }

    #[inline(always)]
    fn prefetch<T>(what: &T, part: usize, parts: usize) {
        prefetch(what, part, parts);
    }
}
