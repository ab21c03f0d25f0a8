//! Maps of symmetric matrices. Colour and shape both show the sign, so that the map is legible in grey.

use maud::html;

use super::Kind;
use super::scale::{coordinate, text};
use super::svg::{Drawing, WIDTH, shortened};
use crate::report::table::{Cell, Table, cells, numbers, words};

/// Width of a character of a name, SVG units.
const CHARACTER: f64 = 7.2;
/// Longest name, characters.
const MAX_NAME: usize = 21;
/// Cells wider than this contain the number, SVG units.
const MIN_NUMBERED: f64 = 31.0;

/// A symmetric matrix with entries from −1 to 1.
#[derive(Clone, Debug)]
pub struct Matrix {
    /// What its entries are: `correlation`.
    pub quantity: &'static str,
    /// Names of its rows and columns.
    pub ids: Vec<String>,
    /// Its rows. `None` stands for a parameter that is not identifiable.
    pub rows: Vec<Vec<Option<f64>>>,
}

impl Kind for Matrix {
    fn drawing(&self) -> Drawing {
        let ids = &self.ids;
        let longest = ids.iter().map(|id| id.chars().count().min(MAX_NAME)).max().unwrap_or_default();
        let names = 12.0 + CHARACTER * longest as f64;
        let cell = ((WIDTH - names - 10.0) / ids.len().max(1) as f64).min(44.0);
        let side = cell * ids.len() as f64;
        let font_px = 11.0_f64.min(cell * 0.95);
        let inner = html! {
            @for (i, id) in ids.iter().enumerate() {
                @let at = names + cell * (i as f64 + 0.5);
                @let size = format!("font-size:{}px", coordinate(font_px));
                @let line = coordinate(at + font_px * 0.35);
                text class="right" style=(size) x=(names - 6.0) y=(line) { title { (id) } (shortened(id, MAX_NAME)) }
                text style=(size) transform=(format!("translate({line} {}) rotate(-90)", names - 6.0)) {
                    (shortened(id, MAX_NAME))
                }
            }
            rect class="frame" x=(names) y=(names) width=(coordinate(side)) height=(coordinate(side)) {}
            @for (i, row) in self.rows.iter().enumerate() {
                @for (j, value) in row.iter().enumerate() {
                    @if let Some(value) = value {
                        @let (x, y) = (names + cell * (j as f64 + 0.5), names + cell * (i as f64 + 0.5));
                        @let numbered = cell > MIN_NUMBERED && i < j;
                        @if numbered {
                            text class="small middle" x=(coordinate(x)) y=(coordinate(y + 4.0)) { (text(*value, 0.01)) }
                        } @else {
                            @let half = 0.46 * cell * value.abs().sqrt().min(1.0);
                            @if half > 0.5 {
                                @let (class, corner) =
                                    if *value >= 0.0 { ("positive", "0") } else { ("negative", "99") };
                                @let size = coordinate(2.0 * half);
                                rect class=(class) x=(coordinate(x - half)) y=(coordinate(y - half)) width=(size)
                                    height=(size) rx=(corner) {
                                    title { (ids[i]) ", " (ids[j]) ": " (text(*value, 0.01)) }
                                }
                            }
                        }
                    }
                }
            }
            rect class="positive" x=(names) y=(names + side + 14.0) width="12" height="12" {}
            text x=(names + 18.0) y=(names + side + 24.0) { "positive (square)" }
            rect class="negative" x=(names + 160.0) y=(names + side + 14.0) width="12" height="12" rx="6" {}
            text x=(names + 178.0) y=(names + side + 24.0) { "negative (round)" }
        };
        Drawing::new([WIDTH, names + side + 36.0], inner)
    }

    /// One row per entry.
    fn table(&self) -> Table {
        let rows = self.ids.iter().zip(&self.rows).flat_map(|(row, entries)| {
            let entries = self.ids.iter().zip(entries);
            entries.filter_map(move |(column, value)| Some(cells![row, column, Cell::exact((*value)?)]))
        });
        Table::new([words("row"), words("column"), numbers(self.quantity)], rows)
    }
}
