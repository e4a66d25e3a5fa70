//! The two precisions, `f32` and `f64`, and the choice of a kernel's copy by instruction set at run time.

#[cfg(target_arch = "x86_64")]
use super::avx2;
use super::portable::{self, Portable};
use super::{InstructionSet, Kernel, Real};

/// Implements [`Real`]; `$bits` is the unsigned integer of the same size.
macro_rules! real {
    ($scalar:ident, $bits:ident, $is_single:literal) => {
        impl Real for $scalar {
            const EPSILON: Self = $scalar::EPSILON;
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const IS_SINGLE: bool = $is_single;

            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $scalar
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                $scalar::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                $scalar::abs(self)
            }
            #[inline(always)]
            fn max(self, o: Self) -> Self {
                if self > o { self } else { o }
            }
            #[inline(always)]
            fn min(self, o: Self) -> Self {
                if self < o { self } else { o }
            }
            #[inline(always)]
            fn round(self) -> Self {
                // Numbers from 2^52 (2^23) on are integral; adding that pushes the fraction out of a smaller
                // one. The standard function would be a call where the oldest processors lack the
                // instruction.
                let integral = $scalar::EPSILON.recip();
                let pushed = (self.abs() + integral) - integral;
                if self.abs() < integral { pushed.copysign(self) } else { self }
            }
            #[inline(always)]
            fn split_exponent(self) -> (Self, Self) {
                const SHIFT: u32 = $scalar::MANTISSA_DIGITS - 1;
                let sqrt_half = (std::f64::consts::FRAC_1_SQRT_2 as $scalar).to_bits();
                let shifted = self.to_bits().wrapping_add((1.0 as $scalar).to_bits() - sqrt_half);
                let k = (shifted >> SHIFT) as i32 - ($scalar::MAX_EXP - 1);
                let mantissa = (shifted & ((1 << SHIFT) - 1)) + sqrt_half;
                ($scalar::from_bits(mantissa), k as $scalar)
            }
            #[inline(always)]
            fn scale_exponent(self, k: Self) -> Self {
                const SHIFT: u32 = $scalar::MANTISSA_DIGITS - 1;
                // The sum's last bits are those of k in two's complement.
                let k = k + 1.5 * $scalar::EPSILON.recip();
                $scalar::from_bits(self.to_bits().wrapping_add(k.to_bits() << SHIFT))
            }
            #[inline(always)]
            fn to_i32(self) -> i32 {
                Real::round(self) as i32
            }
            #[inline(always)]
            fn from_i32(i: i32) -> Self {
                i as $scalar
            }

            #[inline]
            fn run<K: Kernel<Self>>(set: InstructionSet, kernel: K) -> K::Output {
                assert!(set.is_available(), "this processor does not have {}", set.name());
                match set {
                    InstructionSet::Portable => portable::run::<$scalar, Portable<$scalar>, K>(kernel),
                    #[cfg(target_arch = "x86_64")]
                    // SAFETY: the assertion above has found AVX2 and FMA on this processor.
                    InstructionSet::Avx2 => unsafe { avx2::run::<$scalar, avx2::Avx2<$scalar>, K>(kernel) },
                    #[cfg(not(target_arch = "x86_64"))]
                    InstructionSet::Avx2 => unreachable!("not available on this platform"),
                }
            }
        }
    };
}

real!(f32, u32, true);
real!(f64, u64, false);
