//! Data inside the page: the drawn readings as scaled 16-bit integers, and all readings as compressed CSV.

use abbe::identify::series::Cause;
use abbe::model::instrument::channel;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::plots::{Column, SessionPlots, axes_of};
use crate::report::number::unit;
use crate::report::table::{self, Cell, Table, cells, numbers};

/// Maximum number of sliders.
pub const MAX_SLIDERS: usize = 40;

/// Encodes numbers as 16-bit integers: `value = offset + scale · k`, `k` from −32767 to 32767.
fn quantised(values: impl Iterator<Item = f64> + Clone) -> Value {
    let (low, high) = values.clone().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if !(high - low).is_finite() {
        return json!({"o": 0.0, "s": 0.0, "d": ""});
    }
    let (offset, scale) = ((low + high) / 2.0, (high - low) / 65534.0);
    let bytes: Vec<u8> = values
        .flat_map(|value| {
            let k = if scale > 0.0 { ((value - offset) / scale).round() as i16 } else { 0 };
            k.to_le_bytes()
        })
        .collect();
    json!({"o": offset, "s": scale, "d": STANDARD.encode(bytes)})
}

/// Indices of the shares with a slider, in descending order of their sum of squares.
pub fn sliders(session: &SessionPlots<'_>) -> Vec<usize> {
    let mut chosen: Vec<(f64, usize)> = (0..session.series.shares.len())
        .filter(|k| {
            let cause = session.series.shares[*k].cause;
            cause != Cause::Setup || !session.series.vectors
        })
        .map(|k| (session.series.weight_of(k), k))
        .filter(|(weight, _)| *weight > 0.0)
        .collect();
    chosen.sort_by(|a, b| b.0.total_cmp(&a.0));
    chosen.truncate(MAX_SLIDERS);
    chosen.into_iter().map(|(_, k)| k).collect()
}

/// Data of the interactive plots.
pub fn data(session: &SessionPlots<'_>) -> Value {
    let sliders = sliders(session);
    let tests: Vec<Value> = session
        .tests()
        .map(|(number, test)| {
            let readings = session.problem.tests[number].readings.as_ref();
            let axes = axes_of(session.problem, test, number);
            let mut ordinals: Vec<i64> = Vec::new();
            let traversals: Vec<Value> = test
                .stretches
                .iter()
                .enumerate()
                .map(|(k, stretch)| {
                    let rows = &session.rows[number][k];
                    let ordinal = ordinals.iter().position(|run| *run == stretch.run).unwrap_or_else(|| {
                        ordinals.push(stretch.run);
                        ordinals.len() - 1
                    });
                    let of = |values: &[f64]| quantised(rows.iter().map(|row| values[*row]));
                    let scalars = |values: &[f64]| {
                        let all = rows.iter().flat_map(|row| row * test.channels..(row + 1) * test.channels);
                        quantised(all.map(|i| values[i]))
                    };
                    let abscissae: serde_json::Map<String, Value> = axes
                        .iter()
                        .map(|(axis, values)| {
                            let key = if stretch.forward.is_some() { "x" } else { &axis.name };
                            (key.to_string(), of(values))
                        })
                        .collect();
                    let lines: Option<Value> = readings
                        .and_then(|r| r.origin.as_ref())
                        .map(|origin| quantised(rows.iter().map(|row| origin.line[*row] as f64)));
                    json!({
                        "run": ordinal, "number": stretch.run, "forward": stretch.forward, "n": rows.len(), "abscissa": abscissae, "line": lines,
                        "deviation": scalars(&test.deviation_um), "before": scalars(&test.before_um), "after": scalars(&test.after_um),
                        "shares": sliders.iter().map(|s| scalars(&test.shares_um[*s])).collect::<Vec<_>>(),
                    })
                })
                .collect();
            let units: Vec<String> = axes.iter().map(|(axis, _)| unit(axis.unit)).collect();
            json!({"name": test.name, "over": test.way.name, "units": units, "traversals": traversals})
        })
        .collect();
    json!({"unit": unit(session.series.unit.name()), "tests": tests})
}

/// All readings with deviation and residuals.
pub fn readings(session: &SessionPlots<'_>) -> Table {
    let machine = &session.problem.session.machine;
    let labels: Vec<String> = match &session.problem.models[..] {
        // One column for each channel; of tests with different channels, as many as the largest number.
        [first, others @ ..] if others.iter().all(|other| other.channels() == first.channels()) => {
            let labels = channel::labels(first.channels()).into_iter();
            labels.map(|label| if label.is_empty() { String::new() } else { format!("_{label}") }).collect()
        }
        models => {
            let most = models.iter().map(|model| model.channels().len()).max().unwrap_or(1);
            (1..=most).map(|channel| format!("_{channel}")).collect()
        }
    };
    let mut columns = ["test", ">file_line", ">run", ">time_s"].map(table::Column::from).to_vec();
    columns.extend(machine.axes.iter().map(|axis| numbers(format!("{}_{}", axis.name, axis.kind.unit()))));
    for column in ["deviation", "residual_before", "residual_after"] {
        columns.extend(labels.iter().map(|label| numbers(format!("{column}{label}_{}", session.series.unit.name()))));
    }
    let mut rows = Vec::new();
    for (test, series) in session.problem.tests.iter().zip(&session.series.tests) {
        let Some(readings) = &test.readings else { continue };
        for row in 0..readings.rows() {
            let mut cells = cells![
                &test.name,
                readings.line(row).map_or(String::new(), |line| line.to_string()),
                readings.run.get(row).map_or(String::new(), ToString::to_string),
                readings.time_s.get(row).map_or("".into(), |time| Cell::fixed(*time, 3)),
            ];
            let at = machine.axes.iter().zip(&readings.positions);
            cells.extend(at.map(|(axis, column)| Cell::fixed(axis.kind.to_display(column[row]), 5)));
            let own = row * series.channels..(row + 1) * series.channels;
            for column in [Column::Deviation, Column::Before, Column::After] {
                let read = |(channel, um): (usize, &f64)| match readings.was_read(row, channel) {
                    true => Cell::fixed(*um, 3),
                    false => "".into(),
                };
                cells.extend(column.of(series)[own.clone()].iter().enumerate().map(read));
                cells.extend((series.channels..labels.len()).map(|_| "".into()));
            }
            rows.push(cells);
        }
    }
    Table::new(columns, rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_bits_resolve_one_part_in_65534() {
        let values = [-17.25, 3.5, 48.125, 0.0];
        let encoded = quantised(values.into_iter());
        let bytes = STANDARD.decode(encoded["d"].as_str().unwrap()).unwrap();
        let number = |key: &str| encoded[key].as_f64().unwrap();
        for (value, pair) in values.iter().zip(bytes.chunks(2)) {
            let found = number("o") + number("s") * f64::from(i16::from_le_bytes([pair[0], pair[1]]));
            assert!((found - value).abs() <= 0.5 * 65.375 / 65534.0 + 1e-9, "{found} {value}");
        }
    }
}
