//! The operations of vectors, masks and transposes, in every instruction set and precision.

use super::pair::Pair;
use super::*;

/// Runs a check of vectors in every precision with every instruction set of this processor.
macro_rules! in_every_set {
    ($check:ident) => {
        struct Run;
        impl<R: Real> Kernel<R> for Run {
            type Output = ();
            #[inline(always)]
            fn run<S: Simd<Scalar = R>>(self) {
                $check::<S>();
            }
        }
        for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
            dispatch::<f64, _>(set, Run);
            dispatch::<f32, _>(set, Run);
        }
    };
}

fn numbers<V: Vector>(of_lane: impl Fn(usize) -> f64) -> Vec<V::Scalar> {
    (0..V::LANES).map(|lane| V::Scalar::from_f64(of_lane(lane))).collect()
}

fn vector<V: Vector>(of_lane: impl Fn(usize) -> f64) -> V {
    V::load(&numbers::<V>(of_lane))
}

fn lanes<V: Vector>(v: V) -> Vec<f64> {
    let mut to = vec![V::Scalar::ZERO; V::LANES];
    v.store(&mut to);
    to.into_iter().map(Real::to_f64).collect()
}

/// The lanes where a mask is true, as bits.
fn set<V: Vector>(mask: V::Mask) -> usize {
    let answers = lanes(V::select(mask, V::constant(1.0), V::constant(0.0)));
    answers.into_iter().rev().fold(0, |set, answer| (set << 1) | usize::from(answer == 1.0))
}

/// First and second of pairs of numbers, with signs, zeros, ties, infinity and not a number.
const FIRST: [f64; 13] =
    [1.5, -3.0, 0.0, -0.0, 7.0, 1e30, 2.5, 1048576.5, f64::INFINITY, -1.0, f64::NAN, 1.0, 0.125];
const SECOND: [f64; 13] =
    [2.25, 0.5, -1.0, 0.0, 7.0, -1e-30, -2.5, 3.0, 1.0, f64::NEG_INFINITY, 1.0, f64::NAN, 1024.0];

fn every_operation_of_a_lane_is_that_of_a_scalar<V: Vector>() {
    let same = |name: &str, v: V, scalar: &dyn Fn(V::Scalar, V::Scalar) -> V::Scalar, shift: usize| {
        for (lane, got) in lanes(v).into_iter().enumerate() {
            let (a, b) = (FIRST[(lane + shift) % 13], SECOND[(lane + shift) % 13]);
            let want = scalar(V::Scalar::from_f64(a), V::Scalar::from_f64(b)).to_f64();
            let equal = got == want || (got.is_nan() && want.is_nan());
            assert!(equal, "{name}({a}, {b}) = {got}, not {want}, in lane {lane} of {}", V::LANES);
        }
    };
    for shift in 0..13 {
        let a: V = vector(|lane| FIRST[(lane + shift) % 13]);
        let b: V = vector(|lane| SECOND[(lane + shift) % 13]);
        same("add", a + b, &|a, b| a + b, shift);
        same("sub", a - b, &|a, b| a - b, shift);
        same("mul", a * b, &|a, b| a * b, shift);
        same("div", a / b, &|a, b| a / b, shift);
        same("neg", -a, &|a, _| -a, shift);
        same("sqrt", a.sqrt(), &|a, _| a.sqrt(), shift);
        same("abs", a.abs(), &|a, _| a.abs(), shift);
        same("min", a.min(b), &|a, b| if a < b { a } else { b }, shift);
        same("max", a.max(b), &|a, b| if a > b { a } else { b }, shift);
        let (mut add, mut sub, mut mul, mut div) = (a, a, a, a);
        add += b;
        sub -= b;
        mul *= b;
        div /= b;
        same("add_assign", add, &|a, b| a + b, shift);
        same("sub_assign", sub, &|a, b| a - b, shift);
        same("mul_assign", mul, &|a, b| a * b, shift);
        same("div_assign", div, &|a, b| a / b, shift);
        let truth = |t: bool| if t { V::Scalar::ONE } else { V::Scalar::ZERO };
        let number = |mask| V::select(mask, V::constant(1.0), V::constant(0.0));
        same("lt", number(a.lt(b)), &|a, b| truth(a < b), shift);
        same("le", number(a.le(b)), &|a, b| truth(a <= b), shift);
        same("gt", number(a.gt(b)), &|a, b| truth(a > b), shift);
        same("ge", number(a.ge(b)), &|a, b| truth(a >= b), shift);
    }
    assert_eq!(lanes(V::default() + V::splat(V::Scalar::ONE)), vec![1.0; V::LANES]);
}

/// Lanes are independent, so a vector must give what a plain loop gives, special numbers included.
#[test]
fn vectors_agree_with_a_loop_over_scalars() {
    fn check<S: Simd>() {
        every_operation_of_a_lane_is_that_of_a_scalar::<S::Lanes>();
        every_operation_of_a_lane_is_that_of_a_scalar::<S::Quad>();
        every_operation_of_a_lane_is_that_of_a_scalar::<Pair<S::Lanes>>();
    }
    in_every_set!(check);
}

/// One rounding differs from two by half a unit in the last place of the product at most; exact products
/// agree.
#[test]
fn mul_add_is_the_product_plus_the_summand() {
    fn check<S: Simd>() {
        let x = |lane: usize| 1.0 + lane as f64 / 3.0;
        let exact = S::Lanes::constant(3.0).mul_add(vector(|lane| lane as f64), S::Lanes::constant(-2.0));
        assert_eq!(
            lanes(exact),
            (0..S::Lanes::LANES).map(|lane| 3.0 * lane as f64 - 2.0).collect::<Vec<_>>()
        );
        let v: S::Lanes = vector(x);
        let lack = v.mul_add(v, -(v * v));
        for (lane, lack) in lanes(lack).into_iter().enumerate() {
            let bound = x(lane) * x(lane) * S::Scalar::EPSILON.to_f64();
            assert!(lack.abs() <= bound, "x x - x x = {lack} for x = {}", x(lane));
        }
    }
    in_every_set!(check);
}

/// Rounding decides the exponent of exp and the cell of a point; a tie goes to the even number (IEEE 754).
#[test]
fn rounding_goes_to_the_nearest_and_then_the_even_integer() {
    fn check<S: Simd>() {
        let cases = [0.5, 1.5, 2.5, -0.5, -1.5, 0.49, -2.51, 8388607.5, 1e30, -3e20, 0.0, 4194303.25];
        for case in cases {
            let want = S::Scalar::from_f64(case).to_f64().round_ties_even();
            assert_eq!(lanes(S::Lanes::constant(case).round())[0], want, "{case}");
            assert_eq!(lanes(S::Quad::constant(case).round())[3], want, "{case}");
            let mut integers = [7; 9];
            if case.abs() < 1e9 {
                S::Lanes::constant(case).store_i32(&mut integers);
                assert_eq!(f64::from(integers[S::Lanes::LANES - 1]), want, "{case}");
                assert_eq!(integers[S::Lanes::LANES], 7, "the place behind the last lane is untouched");
            }
        }
        let integers: Vec<i32> = (0..8).map(|i| 3 - 1000 * i).collect();
        let loaded: Vec<f64> = integers.iter().map(|&i| f64::from(i)).collect();
        assert_eq!(lanes(S::Lanes::load_i32(&integers)), loaded[..S::Lanes::LANES]);
        assert_eq!(lanes(S::Quad::load_i32(&integers)), loaded[..4]);
    }
    in_every_set!(check);
}

/// Masks are sets of lanes: `&`, `|`, `!` are intersection, union and complement.
#[test]
fn masks_are_sets_of_lanes() {
    fn check_vector<V: Vector>() {
        for (a, b) in (0..1usize << V::LANES).step_by(3).zip((0..1usize << V::LANES).rev()) {
            let has = |set: usize, lane: usize| (set >> lane) & 1 == 1;
            let mask = |set| vector::<V>(|lane| f64::from(u8::from(has(set, lane)))).gt(V::constant(0.5));
            let full = (1usize << V::LANES) - 1;
            assert_eq!(set::<V>(mask(a)), a);
            assert_eq!(set::<V>(mask(a) & mask(b)), a & b);
            assert_eq!(set::<V>(mask(a) | mask(b)), a | b);
            assert_eq!(set::<V>(!mask(a)), !a & full);
            assert_eq!(mask(a).any(), a != 0, "{a:b}");
            assert_eq!(mask(a).all(), a == full, "{a:b}");
            assert_eq!((!mask(a)).all(), a == 0, "{a:b}");
        }
    }
    fn check<S: Simd>() {
        check_vector::<S::Lanes>();
        check_vector::<S::Quad>();
        check_vector::<Pair<S::Lanes>>();
    }
    in_every_set!(check);
}

/// The documented order, so that a sum of as many lanes has the same bits whatever the instruction set.
#[test]
fn sums_fold_the_upper_half_onto_the_lower() {
    fn check_vector<V: Vector>() {
        let x = numbers::<V>(|lane| 1.0 / (lane as f64 + 0.7) - 0.4);
        let at = |lane: usize| x[lane] + x[lane + 8];
        let want = match *x.as_slice() {
            [a, b] => a + b,
            [a, b, c, d] => (a + c) + (b + d),
            [a, b, c, d, e, f, g, h] => ((a + e) + (c + g)) + ((b + f) + (d + h)),
            // Sixteen: halved once, they are eight.
            [..] => ((at(0) + at(4)) + (at(2) + at(6))) + ((at(1) + at(5)) + (at(3) + at(7))),
        };
        assert_eq!(V::load(&x).sum(), want);
        for largest in 0..V::LANES {
            let v: V = vector(|lane| if lane == largest { 2.0 } else { -(lane as f64) });
            assert_eq!(v.max_lane().to_f64(), 2.0);
            assert_eq!((-v).min_lane().to_f64(), -2.0);
        }
    }
    fn check<S: Simd>() {
        check_vector::<S::Lanes>();
        check_vector::<S::Quad>();
        check_vector::<Pair<S::Lanes>>();
    }
    in_every_set!(check);
}

/// A transposition moves numbers, so it is exact, and its reverse gives back the numbers it came from.
#[test]
fn transposes_move_component_c_of_point_p_to_lane_p_of_vector_c() {
    fn check<S: Simd>() {
        let n = S::Lanes::LANES;
        let from: Vec<S::Scalar> = (0..4 * n + 1).map(|i| S::Scalar::from_f64(i as f64)).collect();
        let columns = S::load_transposed(&from);
        for (c, column) in columns.into_iter().enumerate() {
            assert_eq!(lanes(column), (0..n).map(|p| (4 * p + c) as f64).collect::<Vec<_>>());
        }
        let mut to = vec![-S::Scalar::ONE; 4 * n + 1];
        S::store_transposed(columns, &mut to);
        assert_eq!(to[..4 * n], from[..4 * n]);
        assert_eq!(to[4 * n], -S::Scalar::ONE);

        let from: Vec<S::Scalar> = (0..8 * n + 1).map(|i| S::Scalar::from_f64(i as f64)).collect();
        let columns = pair::load_transposed::<S>(&from);
        for (c, column) in columns.into_iter().enumerate() {
            assert_eq!(lanes(column), (0..2 * n).map(|p| (4 * p + c) as f64).collect::<Vec<_>>());
        }
        let mut to = vec![-S::Scalar::ONE; 8 * n + 1];
        pair::store_transposed::<S>(columns, &mut to);
        assert_eq!(to[..8 * n], from[..8 * n]);
        assert_eq!(to[8 * n], -S::Scalar::ONE);
    }
    in_every_set!(check);
}

/// Four numbers of each of the points abreast, p of which holds `from(p)`, `from(p)` + 1, ….
fn records<S: Simd>(from: impl Fn(usize) -> i32) -> S::Records {
    vector(|lane| f64::from(from(lane / 4)) + (lane % 4) as f64)
}

/// What is expected of records, from their entries by point.
fn by_point<S: Simd>(entries: impl Fn(f64) -> [f64; 4]) -> Vec<f64> {
    (0..S::ABREAST).flat_map(|point| entries(100.0 * point as f64)).collect()
}

/// Halves of each point's four numbers.
#[test]
fn halves_of_records_are_joined_and_doubled() {
    fn check<S: Simd>() {
        let from = |first: i32| records::<S>(|point| first + 100 * point as i32);
        assert_eq!(lanes(S::join(from(0), from(10))), by_point::<S>(|p| [p, p + 1.0, p + 12.0, p + 13.0]));
        assert_eq!(lanes(S::first_twice(from(5))), by_point::<S>(|p| [p + 5.0, p + 6.0, p + 5.0, p + 6.0]));
    }
    in_every_set!(check);
}

/// Loading, spreading and adding up move whole numbers, so all of it is exact.
#[test]
fn records_of_points_are_loaded_spread_and_added_up() {
    fn check<S: Simd>() {
        assert_eq!(S::Records::LANES, 4 * S::ABREAST);
        let numbers: Vec<S::Scalar> = (1..6).map(S::Scalar::from_i32).collect();
        assert_eq!(lanes(S::load_for_all(&numbers)), by_point::<S>(|_| [1.0, 2.0, 3.0, 4.0]));
        let first = by_point::<S>(|p| if p == 0.0 { [1.0, 2.0, 3.0, 4.0] } else { [0.0; 4] });
        assert_eq!(lanes(S::load_first(&numbers)), first);
        let from = records::<S>(|point| 100 * point as i32);
        for entry in 0..4 {
            let want = by_point::<S>(|p| [p + entry as f64; 4]);
            assert_eq!(lanes(S::spread(from, entry)), want, "entry {entry}");
        }
        let all = (0..S::ABREAST).map(|point| 100.0 * point as f64).sum::<f64>();
        let sum: Vec<f64> = (0..4).map(|entry| all + (entry * S::ABREAST) as f64).collect();
        assert_eq!(lanes(S::sum_points(from)), sum);
    }
    in_every_set!(check);
}

/// x = m 2^k exactly, with m around one: what the logarithm builds on.
#[test]
fn exponents_split_off_can_be_put_back() {
    fn check_vector<V: Vector>() {
        for i in 0..500 {
            let x: V = vector(|lane| (f64::from(i - 250) / 3.0 + lane as f64).exp2());
            let (m, k) = x.split_exponent();
            assert!(
                lanes(m).iter().all(|m| (0.5_f64.sqrt() as f32 as f64..2.0_f64.sqrt()).contains(m)),
                "{m:?}"
            );
            assert_eq!(lanes(k.round()), lanes(k));
            assert_eq!(lanes(m.scale_exponent(k)), lanes(x));
        }
    }
    fn check<S: Simd>() {
        check_vector::<S::Lanes>();
        check_vector::<S::Quad>();
        check_vector::<Pair<S::Lanes>>();
    }
    in_every_set!(check);
}

/// A slice too short is an error of the caller, which must not become a read behind its end.
#[test]
#[should_panic(expected = "at least as many numbers as lanes")]
fn loads_from_a_short_slice_panic() {
    struct Short;
    impl Kernel<f32> for Short {
        type Output = f32;
        #[inline(always)]
        fn run<S: Simd<Scalar = f32>>(self) -> f32 {
            S::Lanes::load(&[1.0; 7]).sum()
        }
    }
    dispatch(InstructionSet::detect(), Short);
}
