//! Convergence of the cut: values over spacings with their scatter, the band each spacing has, and what may
//! be extrapolated.
//!
//! With f(h) the mean over shifted starts, s(h) their standard deviation, and f₀ = f at the finest spacing:
//!
//! band(h) = (S |f(h) − f(h/2)| + 2 s(h)) / |f₀|
//!
//! S = 3, the factor usual for two grids of unknown order (Roache 1994). Only where all differences have one
//! sign and shrink by at least √2 per halving, orders within one of each other, is the order p taken for
//! known; then S = 1.25 / (1 − 2⁻ᵖ), the sum of what further halvings change with a quarter in reserve, and
//! f₀ + (f₀ − f(2 h₀)) / (2ᵖ − 1) is shown as the extrapolated value. At the finest spacing the next
//! difference is not known: it is taken as the last one over 2ᵖ, or as the last one itself where no order
//! holds.

/// Safety factor where no order is known.
const UNKNOWN_ORDER: f64 = 3.0;
/// Safety factor on what an order predicts.
const KNOWN_ORDER: f64 = 1.25;
/// Least ratio of differences from halving to halving that counts as shrinking: order one half.
const SHRINKS: f64 = std::f64::consts::SQRT_2;

/// One spacing: the values of runs from shifted starts.
#[derive(Clone, Debug)]
pub struct Station {
    /// Distance between points (m).
    pub spacing: f64,
    /// One value per start.
    pub values: Vec<f64>,
}

/// What the spacings say together.
#[derive(Clone, Debug)]
pub struct Convergence {
    /// Mean per spacing.
    pub means: Vec<f64>,
    /// Standard deviation over the starts, per spacing (that of the next coarser where there is one start
    /// only).
    pub scatter: Vec<f64>,
    /// Band per spacing, over the finest mean (-).
    pub bands: Vec<f64>,
    /// Order and extrapolated value, where the differences shrink as an order demands.
    pub order: Option<(f64, f64)>,
    /// The verdict in words.
    pub verdict: String,
}

/// Judges the values over at least two spacings, each half the one before.
///
/// # Panics
/// With fewer than two stations or an empty one.
pub fn judge(stations: &[Station]) -> Convergence {
    assert!(stations.len() >= 2, "convergence needs two spacings at least");
    let means: Vec<f64> =
        stations.iter().map(|s| s.values.iter().sum::<f64>() / s.values.len() as f64).collect();
    let mut scatter: Vec<f64> = Vec::new();
    for (station, mean) in stations.iter().zip(&means) {
        let n = station.values.len();
        let square: f64 = station.values.iter().map(|value| (value - mean).powi(2)).sum();
        scatter.push(if n > 1 {
            (square / (n - 1) as f64).sqrt()
        } else {
            scatter.last().copied().unwrap_or(0.0)
        });
    }
    let differences: Vec<f64> = means.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let finest = means[means.len() - 1];
    let last = differences[differences.len() - 1];
    let order = order(&differences).map(|p| (p, finest + last / (p.exp2() - 1.0)));
    let safety = order.map_or(UNKNOWN_ORDER, |(p, _)| KNOWN_ORDER / (1.0 - (-p).exp2()));
    let next = last.abs() * order.map_or(1.0, |(p, _)| (-p).exp2());
    let steps = differences.iter().map(|d| d.abs()).chain([next]);
    let bands = steps.zip(&scatter).map(|(step, s)| (safety * step + 2.0 * s) / finest.abs()).collect();
    let noise = scatter[scatter.len() - 1];
    let verdict = match order {
        Some((p, value)) => format!("differences shrink with order {p:.1}; extrapolated {}", digits(value)),
        None if differences.iter().all(|d| d.abs() <= 2.0 * noise) => {
            "differences lie within the scatter of the starts: no trend with the spacing".into()
        }
        None if differences.len() < 3 => "too few spacings to speak of an order".into(),
        None => "does not converge with an order: differences do not shrink evenly".into(),
    };
    Convergence { means, scatter, bands, order, verdict }
}

/// The order at the fine end, where at least three differences of one sign shrink evenly.
fn order(differences: &[f64]) -> Option<f64> {
    if differences.len() < 3 {
        return None;
    }
    let ratios: Vec<f64> = differences.windows(2).map(|pair| pair[0] / pair[1]).collect();
    let orders: Vec<f64> = ratios.iter().map(|ratio| ratio.log2()).collect();
    let is_even = ratios.iter().all(|ratio| *ratio >= SHRINKS)
        && orders.windows(2).all(|pair| (pair[0] - pair[1]).abs() <= 1.0);
    // More than second order is chance.
    is_even.then(|| orders[orders.len() - 1].min(2.0))
}

/// Four digits.
fn digits(value: f64) -> String {
    let decimals = (3 - value.abs().max(1e-300).log10().floor() as i32).clamp(0, 9) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stations(values: &[f64]) -> Vec<Station> {
        let spacing = |k: usize| 4e-5 / (1 << k) as f64;
        values.iter().enumerate().map(|(k, &v)| Station { spacing: spacing(k), values: vec![v] }).collect()
    }

    /// 500 + h with h = 40, 20, 10, 5: the value without spacing is found, and every band holds its true
    /// error.
    #[test]
    fn first_order_is_seen_and_extrapolated() {
        let result = judge(&stations(&[540.0, 520.0, 510.0, 505.0]));
        let (p, value) = result.order.expect("first order");
        assert!((p - 1.0).abs() < 1e-12 && (value - 500.0).abs() < 1e-9, "order {p}, value {value}");
        for (k, error) in [40.0, 20.0, 10.0, 5.0].into_iter().enumerate() {
            let band = result.bands[k] * 505.0;
            assert!(band >= error && band <= 1.3 * error, "band {band} for an error of {error}");
        }
    }

    /// What was seen of this cut before: 522, 508, 487. Growing differences give no order, and three times
    /// the last one.
    #[test]
    fn growing_differences_are_not_extrapolated() {
        let result = judge(&stations(&[530.0, 522.0, 508.0, 487.0]));
        assert_eq!(result.order, None);
        assert!(result.verdict.contains("does not converge"), "{}", result.verdict);
        assert!((result.bands[3] - 3.0 * 21.0 / 487.0).abs() < 1e-12, "{:?}", result.bands);
    }

    /// Starts that differ by more than the spacing does leave no room for a trend.
    #[test]
    fn scatter_is_part_of_the_band() {
        let of = |spacing: f64, middle: f64| Station { spacing, values: vec![middle - 10.0, middle + 10.0] };
        let result = judge(&[of(4e-5, 501.0), of(2e-5, 500.0), of(1e-5, 502.0), of(5e-6, 500.0)]);
        assert!(result.verdict.contains("within the scatter"), "{}", result.verdict);
        // Standard deviation of two values 20 apart: 14.1.
        assert!(
            (result.bands[0] - (3.0 + 2.0 * 200.0_f64.sqrt()) / 500.0).abs() < 1e-12,
            "{:?}",
            result.bands
        );
    }
}
