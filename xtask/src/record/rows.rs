//! Rows of a result file from what `bench` wrote as JSON.

use serde_json::Value;

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// A number times a factor with some decimals; empty where there is none.
fn number(value: &Value, factor: f64, decimals: usize) -> String {
    value.as_f64().map_or_else(String::new, |number| format!("{:.decimals$}", factor * number))
}

fn word(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_string()
}

fn row_of<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_string).to_vec()
}

/// A difference in percent; empty for the cut that others are compared with.
fn difference(cut: &Value, key: &str, k: usize, is_first: bool) -> String {
    match cut[key][k].as_f64() {
        Some(percent) if !is_first => format!("{percent:+.2} %"),
        _ => String::new(),
    }
}

/// Rows of whole cuts.
pub fn cuts(measured: &Value) -> Vec<Vec<String>> {
    const DIFFERENCES: &str = "differences_percent_force_thrust_strain_temperature";
    let mut rows = vec![row_of([
        "cut",
        "CPU s",
        "wall time (s)",
        "force (N/mm)",
        "change",
        "thrust (N/mm)",
        "of the force",
        "strain of the chip",
        "change of the strain",
        "strain without melted points",
        "melted points",
        "chip (K)",
        "of the rise",
        "ledger",
        "mass factor",
    ])];
    for (k, cut) in list(measured).iter().enumerate() {
        let change = |index| difference(cut, DIFFERENCES, index, k == 0);
        rows.push(vec![
            word(&cut["cut"]),
            number(&cut["cpu_s"], 1.0, 1),
            number(&cut["wall_s"], 1.0, 1),
            number(&cut["cutting_force_n_per_m"], 1e-3, 1),
            change(0),
            number(&cut["thrust_force_n_per_m"], 1e-3, 1),
            change(1),
            number(&cut["mean_chip_strain"], 1.0, 3),
            change(2),
            number(&cut["mean_solid_chip_strain"], 1.0, 3),
            number(&cut["melted_points"], 1.0, 0),
            number(&cut["mean_chip_temperature_k"], 1.0, 1),
            change(3),
            number(&cut["ledger_error"], 100.0, 3) + " %",
            number(&cut["mass_factor"], 1.0, 2),
        ]);
    }
    rows
}

/// Means of several runs for each condition: the first cut as it is, the others by their differences to it.
pub fn conditions(measured: &Value, key: &str) -> Vec<Vec<String>> {
    const MEANS: &str = "mean_force_n_per_m_thrust_n_per_m_strain_rise_k";
    const DIFFERENCES: &str = "differences_percent_force_thrust_strain_rise";
    let mut rows = vec![row_of([
        "friction",
        "feed (mm)",
        "rake (°)",
        "cut",
        "CPU s",
        "force (N/mm)",
        "thrust (N/mm)",
        "strain",
        "rise (K)",
        "change of force",
        "of thrust over the force",
        "of strain",
        "of rise",
    ])];
    for condition in list(measured) {
        for (k, cut) in list(&condition[key]).iter().enumerate() {
            let means = &cut[MEANS];
            let own = [
                number(&means[0], 1e-3, 1),
                number(&means[1], 1e-3, 1),
                number(&means[2], 1.0, 3),
                number(&means[3], 1.0, 1),
            ];
            let mut row = vec![
                number(&condition["friction"], 1.0, 1),
                number(&condition["feed_m"], 1e3, 1),
                number(&condition["rake_rad"], 1f64.to_degrees(), 0),
                word(&cut["cut"]),
                number(&cut["cpu_s_mean"], 1.0, 1),
            ];
            row.extend(own.map(|value| if k == 0 { value } else { String::new() }));
            row.extend((0..4).map(|index| difference(cut, DIFFERENCES, index, k == 0)));
            rows.push(row);
        }
    }
    rows
}

/// Several starts of each way to compute a cut: least and most of each, and the mean force.
pub fn ways(measured: &Value) -> Vec<Vec<String>> {
    let mut rows = vec![row_of(["way", "CPU s", "force (N/mm)", "mean force (N/mm)", "thrust (N/mm)"])];
    let name = |cut: &Value| word(&cut["cut"]).split(", start").next().unwrap_or_default().to_string();
    for starts in list(measured).chunk_by(|a, b| name(a) == name(b)) {
        let values = |key: &str, factor: f64| {
            starts.iter().filter_map(|cut| Some(factor * cut[key].as_f64()?)).collect::<Vec<f64>>()
        };
        let span = |key: &str, factor: f64| {
            let values = values(key, factor);
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            format!("{least:.1} to {most:.1}")
        };
        let forces = values("cutting_force_n_per_m", 1e-3);
        let mean = forces.iter().sum::<f64>() / forces.len() as f64;
        rows.push(vec![
            name(&starts[0]),
            span("cpu_s", 1.0),
            span("cutting_force_n_per_m", 1e-3),
            format!("{mean:.1}"),
            span("thrust_force_n_per_m", 1e-3),
        ]);
    }
    rows
}

pub fn step_rates(measured: &Value) -> Vec<Vec<String>> {
    let mut rows = vec![row_of([
        "precision",
        "million point-steps per CPU second",
        "two threads over one",
        "of the machine in multiply-adds",
        "in the triad",
    ])];
    rows.extend(list(measured).iter().map(|line| {
        vec![
            word(&line["precision"]),
            number(&line["point_steps_per_cpu_s"], 1e-6, 1),
            number(&line["two_threads_over_one"], 1.0, 2),
            number(&line["two_threads_over_one_multiply_adds"], 1.0, 2),
            number(&line["two_threads_over_one_triad"], 1.0, 2),
        ]
    }));
    rows
}

pub fn flatness(measured: &Value) -> Vec<Vec<String>> {
    let mut rows = vec![row_of([
        "precision",
        "points",
        "cost per point-step over that of the smallest block",
        "points that yield",
    ])];
    for precision in list(measured) {
        rows.extend(list(&precision["sizes"]).iter().map(|size| {
            vec![
                word(&precision["precision"]),
                number(&size["points"], 1.0, 0),
                number(&size["over_smallest"], 1.0, 2),
                number(&size["mean_yielding_share"], 100.0, 0) + " %",
            ]
        }));
    }
    rows
}

pub fn speeds(measured: &Value) -> Vec<Vec<String>> {
    let mut rows = vec![row_of([
        "row",
        "points",
        "threads",
        "million point-steps per CPU second",
        "points that yield",
        "two threads over one",
    ])];
    rows.extend(list(measured).iter().map(|line| {
        vec![
            word(&line["name"]),
            number(&line["points"], 1.0, 0),
            number(&line["threads"], 1.0, 0),
            number(&line["point_steps_per_cpu_s"], 1e-6, 1),
            number(&line["yielding_share"], 100.0, 0) + " %",
            number(&line["thread_efficiency"], 2.0, 2),
        ]
    }));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shapes of what `bench` writes: one line for all starts of a way, differences but for the first
    /// cut.
    #[test]
    fn cuts_become_rows() {
        let cut = |name: &str, force: f64| {
            serde_json::json!({"cut": name, "cpu_s": 2.0,
                "cutting_force_n_per_m": force, "thrust_force_n_per_m": 1e5,
                "differences_percent_force_thrust_strain_temperature": [1.0, 0.0, 0.0, 0.0]})
        };
        let measured =
            Value::from(vec![cut("a, start 0/5", 6e5), cut("a, start 1/5", 7e5), cut("b, start 0/5", 5e5)]);
        let rows = ways(&measured);
        assert_eq!(rows[1], ["a", "2.0 to 2.0", "600.0 to 700.0", "650.0", "100.0 to 100.0"]);
        assert_eq!(rows.len(), 3);
        let rows = cuts(&measured);
        assert_eq!((rows[1][4].as_str(), rows[2][4].as_str()), ("", "+1.00 %"));
        assert!(rows.iter().all(|row| row.len() == rows[0].len()));
    }
}
