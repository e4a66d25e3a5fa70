//! Two vectors as one.
//!
//! Where each operation waits for the one before, as in a return to the yield surface, a processor idles most
//! of the time. With two vectors side by side each operation is done twice, and the second is done while the
//! first is waited for. What the registers do not hold goes to the first-level cache and back, which costs
//! less.

use super::{Kernel, Mask, Real, Simd, Vector};
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign};

/// Two vectors, or their masks: the lower lanes, then the upper ones.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pair<V>(pub V, pub V);

/// One operator of a pair and its assigning twin.
macro_rules! operator {
    ($operator:ident, $function:ident, $assign:ident, $assign_function:ident) => {
        impl<V: Vector> $operator for Pair<V> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, o: Self) -> Self {
                Pair(self.0.$function(o.0), self.1.$function(o.1))
            }
        }
        impl<V: Vector> $assign for Pair<V> {
            #[inline(always)]
            fn $assign_function(&mut self, o: Self) {
                *self = self.$function(o);
            }
        }
    };
}
operator!(Add, add, AddAssign, add_assign);
operator!(Sub, sub, SubAssign, sub_assign);
operator!(Mul, mul, MulAssign, mul_assign);
operator!(Div, div, DivAssign, div_assign);

impl<V: Vector> Neg for Pair<V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Pair(-self.0, -self.1)
    }
}

/// Functions of a pair that are those of both vectors.
macro_rules! of_both {
    ($($function:ident($($other:ident),*) -> $result:ty;)*) => {
        $(
            #[inline(always)]
            fn $function(self, $($other: Self),*) -> $result {
                Pair(self.0.$function($($other.0),*), self.1.$function($($other.1),*))
            }
        )*
    };
}

impl<V: Vector> Vector for Pair<V> {
    type Scalar = V::Scalar;
    type Mask = Pair<V::Mask>;
    const LANES: usize = 2 * V::LANES;

    #[inline(always)]
    fn splat(x: V::Scalar) -> Self {
        Pair(V::splat(x), V::splat(x))
    }
    #[inline(always)]
    fn load(from: &[V::Scalar]) -> Self {
        let from = &from[..Self::LANES];
        Pair(V::load(&from[..V::LANES]), V::load(&from[V::LANES..]))
    }
    #[inline(always)]
    fn store(self, to: &mut [V::Scalar]) {
        let to = &mut to[..Self::LANES];
        self.0.store(&mut to[..V::LANES]);
        self.1.store(&mut to[V::LANES..]);
    }
    of_both! {
        mul_add(a, b) -> Self;
        sqrt() -> Self;
        abs() -> Self;
        min(o) -> Self;
        max(o) -> Self;
        round() -> Self;
        lt(o) -> Pair<V::Mask>;
        le(o) -> Pair<V::Mask>;
        gt(o) -> Pair<V::Mask>;
        ge(o) -> Pair<V::Mask>;
        scale_exponent(k) -> Self;
    }
    #[inline(always)]
    fn select(mask: Pair<V::Mask>, yes: Self, no: Self) -> Self {
        Pair(V::select(mask.0, yes.0, no.0), V::select(mask.1, yes.1, no.1))
    }
    #[inline(always)]
    fn sum(self) -> V::Scalar {
        (self.0 + self.1).sum()
    }
    #[inline(always)]
    fn max_lane(self) -> V::Scalar {
        self.0.max_lane().max(self.1.max_lane())
    }
    #[inline(always)]
    fn min_lane(self) -> V::Scalar {
        self.0.min_lane().min(self.1.min_lane())
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        let (lower, upper) = (self.0.split_exponent(), self.1.split_exponent());
        (Pair(lower.0, upper.0), Pair(lower.1, upper.1))
    }
    #[inline(always)]
    fn store_i32(self, to: &mut [i32]) {
        let to = &mut to[..Self::LANES];
        self.0.store_i32(&mut to[..V::LANES]);
        self.1.store_i32(&mut to[V::LANES..]);
    }
    #[inline(always)]
    fn load_i32(from: &[i32]) -> Self {
        let from = &from[..Self::LANES];
        Pair(V::load_i32(&from[..V::LANES]), V::load_i32(&from[V::LANES..]))
    }
    #[inline(always)]
    fn outlined<K: Kernel<V::Scalar>>(part: K) -> K::Output {
        V::outlined(part)
    }
}

impl<M: Mask> BitAnd for Pair<M> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        Pair(self.0 & o.0, self.1 & o.1)
    }
}
impl<M: Mask> BitOr for Pair<M> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, o: Self) -> Self {
        Pair(self.0 | o.0, self.1 | o.1)
    }
}
impl<M: Mask> Not for Pair<M> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Pair(!self.0, !self.1)
    }
}
impl<M: Mask> Mask for Pair<M> {
    #[inline(always)]
    fn any(self) -> bool {
        (self.0 | self.1).any()
    }
    #[inline(always)]
    fn all(self) -> bool {
        (self.0 & self.1).all()
    }
}

/// What [`Simd::load_transposed`] does, for twice as many points.
#[inline(always)]
pub fn load_transposed<S: Simd>(from: &[S::Scalar]) -> [Pair<S::Lanes>; 4] {
    let half = 4 * S::Lanes::LANES;
    let (lower, upper) = (S::load_transposed(&from[..half]), S::load_transposed(&from[half..2 * half]));
    each!(c < 4 => Pair(lower[c], upper[c]))
}

/// What [`Simd::store_transposed`] does, for twice as many points.
#[inline(always)]
pub fn store_transposed<S: Simd>(lanes: [Pair<S::Lanes>; 4], to: &mut [S::Scalar]) {
    let half = 4 * S::Lanes::LANES;
    S::store_transposed(each!(c < 4 => lanes[c].0), &mut to[..half]);
    S::store_transposed(each!(c < 4 => lanes[c].1), &mut to[half..2 * half]);
}
