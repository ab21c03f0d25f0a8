//! Maps of symmetric matrices. Colour and shape both show the sign, so that the map is legible in grey.

use abbe::model::words::cut;

use super::Chart;
use super::drawing::{Element, WIDTH};
use super::scale::text;
use crate::report::table::{Cell, Table, cells, numbers, words};

/// Width of a character of a name, SVG units.
const CHARACTER: f64 = 7.2;
/// Longest name, characters.
const MAX_NAME: usize = 21;
/// Cells wider than this contain the number, SVG units.
const MIN_NUMBERED: f64 = 31.0;

/// A symmetric matrix with entries from −1 to 1, whose rows and columns have these names. `quantity` says what the entries
/// are. `None` stands for a parameter that is not identifiable.
pub fn matrix(quantity: &str, ids: &[String], rows: &[Vec<Option<f64>>]) -> Chart {
    let longest = ids.iter().map(|id| id.chars().count().min(MAX_NAME)).max().unwrap_or_default();
    let names = 12.0 + CHARACTER * longest as f64;
    let cell = ((WIDTH - names - 10.0) / ids.len().max(1) as f64).min(44.0);
    let side = cell * ids.len() as f64;
    let font_px = 11.0_f64.min(cell * 0.95);
    let mut elements = Vec::new();
    for (i, id) in ids.iter().enumerate() {
        let line = names + cell * (i as f64 + 0.5) + font_px * 0.35;
        let name = cut(id, MAX_NAME);
        elements.push(Element::text("right", (names - 6.0, line), name.clone()).sized(font_px).titled(id));
        elements.push(Element::upwards("", (line, names - 6.0), name).sized(font_px));
    }
    elements.push(Element::rectangle("frame", (names, names), [side; 2]));
    for (i, row) in rows.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            let Some(value) = *value else { continue };
            let (x, y) = (names + cell * (j as f64 + 0.5), names + cell * (i as f64 + 0.5));
            let half = 0.46 * cell * value.abs().sqrt().min(1.0);
            if cell > MIN_NUMBERED && i < j {
                elements.push(Element::text("small middle", (x, y + 4.0), text(value, 0.01)));
            } else if half > 0.5 {
                let symbol = match value >= 0.0 {
                    true => Element::rectangle("positive", (x - half, y - half), [2.0 * half; 2]),
                    false => Element::circle("negative", (x, y), half),
                };
                elements.push(symbol.titled(format!("{}, {}: {}", ids[i], ids[j], text(value, 0.01))));
            }
        }
    }
    let baseline = names + side + 24.0;
    elements.extend([
        Element::rectangle("positive", (names, baseline - 10.0), [12.0; 2]),
        Element::text("", (names + 18.0, baseline), "positive (square)"),
        Element::circle("negative", (names + 166.0, baseline - 4.0), 6.0),
        Element::text("", (names + 178.0, baseline), "negative (round)"),
    ]);
    let rows = ids.iter().zip(rows).flat_map(|(row, entries)| {
        let entries = ids.iter().zip(entries);
        entries.filter_map(move |(column, value)| Some(cells![row, column, Cell::exact((*value)?)]))
    });
    let table = Table::new([words("row"), words("column"), numbers(quantity)], rows);
    Chart::new("matrix", [WIDTH, baseline + 12.0], elements, table)
}
