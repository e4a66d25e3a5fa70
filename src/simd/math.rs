//! exp, ln and pow of a whole vector, without branches, tables or calls.
//!
//! exp and ln reduce their argument to a short interval around zero or one and evaluate a polynomial there:
//!
//! * exp x = 2ᵏ eʳ with k = round(x / ln 2), r = x − k ln 2, and eʳ = 1 + r + r² P(r);
//! * ln x = k ln 2 + ln m with x = m 2ᵏ, √½ ≤ m < √2, and ln m = 2 artanh s = f − s (f − s² Q(s²)) for f = m
//!   − 1 and s = f / (2 + f).
//!
//! The coefficients of P and Q were found here by Remez exchange in 60 digits; they minimise the largest
//! relative error of eʳ and of ln m, which stands beside them. A scalar library function would cost a call
//! for each lane.

use super::{Real, Vector};

/// First part of ln 2, whose product with any exponent is exact in double precision, and the rest.
const LN_2: (f64, f64) = (0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10);
/// The same in single precision.
const LN_2_SINGLE: (f64, f64) = (0.693_138_122_558_593_8, 9.058_000_614_5e-6);

/// P in double precision: error 3.7e-18.
const EXP: [f64; 10] = [
    0.500_000_000_000_001_1,
    0.166_666_666_666_664_13,
    0.041_666_666_666_530_16,
    0.008_333_333_333_494_555,
    0.001_388_888_894_362_974_5,
    0.000_198_412_695_063_774_36,
    2.480_149_309_891_094e-5,
    2.755_758_654_867_036_6e-6,
    2.763_024_848_521_164_3e-7,
    2.500_000_833_243_082e-8,
];
/// P in single precision: error 3.1e-9.
const EXP_SINGLE: [f64; 5] = [
    0.499_999_934_491_219,
    0.166_665_206_369_390_1,
    0.041_668_387_781_100_07,
    0.008_368_716_671_222_378,
    0.001_381_461_203_616_128,
];

/// −Q in double precision: error 1.3e-18.
const LN: [f64; 7] = [
    -0.666_666_666_666_673_4,
    -0.399_999_999_994_143,
    -0.285_714_287_424_789_7,
    -0.222_221_985_631_316_37,
    -0.181_835_648_831_783_02,
    -0.153_140_354_369_125_5,
    -0.147_961_093_361_563_82,
];
/// −Q in single precision: error 8.1e-10.
const LN_SINGLE: [f64; 3] = [-0.666_667_764_167_619, -0.399_775_367_786_666, -0.298_718_674_667_535_04];

/// Σᵢ cᵢ xⁱ, given x²: even and odd powers apart, so that only half as many operations wait for each other.
#[inline(always)]
fn polynomial<V: Vector, const N: usize>(c: [f64; N], x: V, x2: V) -> V {
    let (mut i, mut j) = ((N - 1) / 2 * 2, N / 2 * 2 - 1);
    let (mut even, mut odd) = (V::constant(c[i]), V::constant(c[j]));
    while i > 0 {
        i -= 2;
        even = even.mul_add(x2, V::constant(c[i]));
    }
    while j > 1 {
        j -= 2;
        odd = odd.mul_add(x2, V::constant(c[j]));
    }
    odd.mul_add(x, even)
}

/// Exponential function of every lane.
///
/// * `x`: any number
///
/// Returns eˣ, with a relative error below 2.5 ε in the range of normal numbers. Below it (x < −708.396, in
/// single precision −87.336) the result is 0; above x = 709.78 (88.72) it is that of 709.78 (88.72), hence
/// finite. Not a number gives not a number.
#[inline(always)]
pub fn exp<V: Vector>(x: V) -> V {
    let single = V::Scalar::IS_SINGLE;
    let (lowest, highest) = if single { (-87.336, 88.72) } else { (-708.396, 709.78) };
    let (ln_2, rest) = if single { LN_2_SINGLE } else { LN_2 };
    let limited = V::constant(highest).min(x);
    let k = (limited * V::constant(std::f64::consts::LOG2_E)).round();
    let r = k.mul_add(V::constant(-rest), k.mul_add(V::constant(-ln_2), limited));
    let r2 = r * r;
    let p = if single { polynomial(EXP_SINGLE, r, r2) } else { polynomial(EXP, r, r2) };
    let result = (p.mul_add(r2, r) + V::constant(1.0)).scale_exponent(k);
    V::select(x.lt(V::constant(lowest)), V::constant(0.0), result)
}

/// Natural logarithm of every lane.
///
/// * `x`: a positive normal number
///
/// Returns ln x, with a relative error below 2.5 ε. Zero gives −1023 ln 2 = −709.09 (in single precision −127
/// ln 2 = −88.03) and a subnormal number something between that and the logarithm of the smallest normal one;
/// infinity gives 1024 ln 2 (128 ln 2). All of these are finite. Negative numbers and not a number give a
/// meaningless finite number.
#[inline(always)]
pub fn ln<V: Vector>(x: V) -> V {
    let single = V::Scalar::IS_SINGLE;
    let (ln_2, rest) = if single { LN_2_SINGLE } else { LN_2 };
    let (m, k) = x.split_exponent();
    let f = m - V::constant(1.0);
    let s = f / (f + V::constant(2.0));
    let z = s * s;
    let minus_q = if single { polynomial(LN_SINGLE, z, z * z) } else { polynomial(LN, z, z * z) };
    // What f lacks to ln m, less the small part of k ln 2: small numbers first, so that their rounding does
    // not count.
    let lack = s.mul_add(z.mul_add(minus_q, f), k * V::constant(-rest));
    k.mul_add(V::constant(ln_2), f - lack)
}

/// Power function of every lane.
///
/// * `x`: base, at least 0
/// * `y`: exponent
///
/// Returns xʸ = exp(y ln x), whose relative error is ε (3 + 3 |y ln x|) at most; overflow and underflow as in
/// [`exp`]. x⁰ = 1 for every x and 0ʸ = 0 for y > 0, exactly; 0ʸ is large and finite for y < 0. A base that
/// is not a number, or negative, is returned unchanged if y > 0.
///
/// ln and exp wait for each other; a loop over many points takes two thirds of the time if it does all of the
/// first before the second.
#[inline(always)]
pub fn pow<V: Vector>(x: V, y: V) -> V {
    let zero = V::constant(0.0);
    V::select(x.gt(zero) | y.le(zero), exp(y * ln(x)), x)
}

#[cfg(test)]
mod tests {
    use super::super::{InstructionSet, Kernel, Simd, dispatch};
    use super::*;

    /// One function of two arguments, for all numbers of two slices.
    struct Map<'a, R, F>(&'a [R], &'a [R], F);

    /// A function of this file.
    trait Function {
        fn of<V: Vector>(&self, x: V, y: V) -> V;
    }
    #[derive(Clone, Copy)]
    struct Exp;
    #[derive(Clone, Copy)]
    struct Ln;
    #[derive(Clone, Copy)]
    struct Pow;
    impl Function for Exp {
        #[inline(always)]
        fn of<V: Vector>(&self, x: V, _: V) -> V {
            exp(x)
        }
    }
    impl Function for Ln {
        #[inline(always)]
        fn of<V: Vector>(&self, x: V, _: V) -> V {
            ln(x)
        }
    }
    impl Function for Pow {
        #[inline(always)]
        fn of<V: Vector>(&self, x: V, y: V) -> V {
            pow(x, y)
        }
    }

    impl<R: Real, F: Function> Kernel<R> for Map<'_, R, F> {
        type Output = Vec<f64>;
        #[inline(always)]
        fn run<S: Simd<Scalar = R>>(self) -> Vec<f64> {
            let n = S::Lanes::LANES;
            let mut result = vec![R::ZERO; self.0.len()];
            for ((x, y), to) in
                self.0.chunks_exact(n).zip(self.1.chunks_exact(n)).zip(result.chunks_exact_mut(n))
            {
                self.2.of(S::Lanes::load(x), S::Lanes::load(y)).store(to);
            }
            result.into_iter().map(R::to_f64).collect()
        }
    }

    /// Arguments, rounded to the precision and padded to full vectors, and what each instruction set makes of
    /// them.
    fn results<R: Real, F: Function + Copy>(f: F, arguments: &[(f64, f64)]) -> Vec<(f64, f64, f64)> {
        let padded = arguments.len().next_multiple_of(8);
        let at = |i: usize| arguments[i.min(arguments.len() - 1)];
        let x: Vec<R> = (0..padded).map(|i| R::from_f64(at(i).0)).collect();
        let y: Vec<R> = (0..padded).map(|i| R::from_f64(at(i).1)).collect();
        let mut all = Vec::new();
        for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
            let result = dispatch(set, Map(&x, &y, f));
            all.extend(x.iter().zip(&y).zip(result).map(|((x, y), result)| (x.to_f64(), y.to_f64(), result)));
        }
        all
    }

    /// The largest error of `f` against `exact` on `arguments`, relative and in units of ε, and where it is.
    fn largest_error<R: Real, F: Function + Copy>(
        f: F,
        exact: impl Fn(f64, f64) -> f64,
        arguments: &[(f64, f64)],
    ) -> (f64, f64, f64) {
        let errors = results::<R, F>(f, arguments).into_iter().map(|(x, y, result)| {
            let want = exact(x, y);
            let error =
                if result == want { 0.0 } else { ((result - want) / want).abs() / R::EPSILON.to_f64() };
            (if error.is_nan() { f64::INFINITY } else { error }, x, y)
        });
        errors.max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are arguments")
    }

    /// `n` numbers evenly spaced from `a` to `b`, both included.
    fn between(a: f64, b: f64, n: i32) -> impl Iterator<Item = f64> {
        (0..n).map(move |i| a + (b - a) * f64::from(i) / f64::from(n - 1))
    }

    /// Bound: one rounding of ½ ε in the last sum, less than that in each smaller part, and the library's own
    /// ½ ε.
    #[test]
    fn exp_is_good_to_the_last_digits_over_the_whole_range() {
        fn check<R: Real>(lowest: f64, highest: f64) {
            let mut x: Vec<f64> = between(lowest, highest, 200_001).collect();
            x.extend(between(-0.4, 0.4, 100_001));
            x.extend((-300..0).flat_map(|i| [10_f64.powi(i), -(10_f64.powi(i))]));
            let x: Vec<(f64, f64)> = x.into_iter().map(|x| (x, 0.0)).collect();
            let (error, at, _) = largest_error::<R, _>(Exp, |x, _| x.exp(), &x);
            println!("exp: largest error {error:.2} epsilon at {at}");
            assert!(error <= 2.5, "error of exp = {error} epsilon at {at}");
        }
        check::<f64>(-708.396, 709.78);
        check::<f32>(-87.336, 88.72);
    }

    /// An exponential that left the finite range, or a subnormal number (slow), would spoil a whole step.
    #[test]
    fn exp_is_zero_below_the_normal_numbers_finite_above_and_one_at_zero() {
        fn check<R: Real>(lowest: f64, largest: f64) {
            for (x, _, result) in results::<R, _>(Exp, &[(1e4, 0.0), (f64::INFINITY, 0.0), (1e30, 0.0)]) {
                assert!(result > 0.99 * largest && result <= largest, "exp {x} = {result}");
            }
            for (x, _, result) in
                results::<R, _>(Exp, &[(lowest, 0.0), (-1e30, 0.0), (f64::NEG_INFINITY, 0.0)])
            {
                assert_eq!(result, 0.0, "exp {x}");
            }
            for (x, _, result) in
                results::<R, _>(Exp, &[(0.0, 0.0), (-0.0, 0.0), (1e-30, 0.0), (-1e-310, 0.0)])
            {
                assert_eq!(result, 1.0, "exp {x}");
            }
            for (_, _, result) in results::<R, _>(Exp, &[(f64::NAN, 0.0)]) {
                assert!(result.is_nan(), "exp NaN = {result}");
            }
        }
        check::<f64>(-708.3965, 0.998 * f64::MAX);
        check::<f32>(-87.3366, 0.998 * f64::from(f32::MAX));
    }

    /// Bound as for exp. Near one the logarithm vanishes, and still the relative error must hold.
    #[test]
    fn ln_is_good_to_the_last_digits_over_the_whole_range() {
        fn check<R: Real>(smallest: i32, largest: i32) {
            let mut x: Vec<f64> =
                between(f64::from(smallest), f64::from(largest), 200_001).map(f64::exp2).collect();
            x.extend(between(0.5, 2.0, 200_001));
            x.extend((1..60).flat_map(|i| [1.0 + 0.5_f64.powi(i), 1.0 - 0.5_f64.powi(i)]));
            let x: Vec<(f64, f64)> = x.into_iter().map(|x| (x, 0.0)).collect();
            let (error, at, _) = largest_error::<R, _>(Ln, |x, _| x.ln(), &x);
            println!("ln: largest error {error:.2} epsilon at {at}");
            assert!(error <= 2.5, "error of ln = {error} epsilon at {at}");
        }
        check::<f64>(-1022, 1023);
        check::<f32>(-126, 127);
    }

    /// A point without plastic strain asks for ln 0, and goes on with a finite number.
    #[test]
    fn ln_is_finite_from_zero_to_infinity() {
        fn check<R: Real>(lowest: f64, subnormal: f64, normal: f64) {
            let arguments = [(0.0, 0.0), (subnormal, 0.0), (0.5 * normal, 0.0), (normal, 0.0), (1.0, 0.0)];
            for result in results::<R, _>(Ln, &arguments).chunks(8) {
                let result: Vec<f64> = result.iter().map(|result| result.2).collect();
                assert!((result[0] / lowest - 1.0).abs() < 1e-6, "ln 0 = {}, not {lowest}", result[0]);
                assert!(result.is_sorted() && result[1] < result[3], "{result:?} do not grow");
                assert_eq!(result[4], 0.0, "ln 1");
            }
            for (x, _, result) in results::<R, _>(Ln, &[(f64::INFINITY, 0.0), (f64::MAX, 0.0)]) {
                assert!(result.is_finite() && result > 88.0, "ln {x} = {result}");
            }
        }
        check::<f64>(-1023.0 * std::f64::consts::LN_2, 5e-324, f64::MIN_POSITIVE);
        check::<f32>(-127.0 * std::f64::consts::LN_2, 1e-45, f64::from(f32::MIN_POSITIVE));
    }

    /// The error of y ln x, a few ε of it, becomes a relative error of the power.
    #[test]
    fn pow_loses_digits_only_in_proportion_to_the_exponent_of_e() {
        fn check<R: Real>() {
            let mut arguments = Vec::new();
            for y in [-7.0, -1.0, -0.5, 0.01, 0.12, 0.34, 0.5, 1.0, 1.03, 2.0, 3.5, 20.0] {
                let most = 50_f64.min(80.0 * f64::abs(y));
                arguments.extend(between(-most, most, 4001).map(|t| ((t / y).exp(), y)));
            }
            let bound = |x: f64, y: f64| 3.0 + 3.0 * (y * x.ln()).abs();
            let mut largest = 0.0_f64;
            for (x, y, result) in results::<R, _>(Pow, &arguments) {
                let error = (result / x.powf(y) - 1.0).abs() / R::EPSILON.to_f64();
                largest = largest.max(error);
                assert!(error <= bound(x, y), "error of {x} to the {y} = {error} epsilon");
            }
            println!("pow: largest error {largest:.2} epsilon for |y ln x| up to 50");
            assert!(largest * f64::EPSILON < 1e-13, "{largest} epsilon");
        }
        check::<f64>();
        check::<f32>();
    }

    /// The hardening law at zero strain, and laws with a hardening exponent of zero, must be exact.
    #[test]
    fn pow_is_exact_at_zero_one_and_for_the_exponent_zero() {
        fn check<R: Real>() {
            for (x, y, result) in results::<R, _>(Pow, &[(0.0, 0.34), (0.0, 1e-6), (-0.0, 2.0), (0.0, 30.0)])
            {
                assert_eq!(result, 0.0, "{x} to the {y}");
            }
            let ones = [
                (0.0, 0.0),
                (1e-320, 0.0),
                (3.0, 0.0),
                (1e30, 0.0),
                (f64::INFINITY, -0.0),
                (1.0, 7.5),
                (1.0, -1e9),
            ];
            for (x, y, result) in results::<R, _>(Pow, &ones) {
                assert_eq!(result, 1.0, "{x} to the {y}");
            }
            for (x, y, result) in results::<R, _>(Pow, &[(0.0, -0.1), (0.0, -1e6), (1e30, 1e6)]) {
                assert!(result > 1e3 && result.is_finite(), "{x} to the {y} = {result}");
            }
            for (_, y, result) in results::<R, _>(Pow, &[(f64::NAN, 0.5)]) {
                assert!(result.is_nan(), "NaN to the {y} = {result}");
            }
        }
        check::<f64>();
        check::<f32>();
    }
}
