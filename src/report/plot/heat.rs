//! Correlations: squares whose side grows with the size, filled for plus and for minus in two colours, so that it reads in grey too.

use maud::html;

use super::scale::place;
use super::{Plot, cut};

/// Width of a plot.
const WIDTH: f64 = 560.0;
/// Room for names on the left and above.
const NAMES: f64 = 150.0;
/// Letters that fit there.
const MAX_LETTERS: usize = 21;
/// A square that is larger than this holds its number.
const NUMBERED: f64 = 34.0;

/// A map of correlations; `None` where one of the two is not seen.
pub fn map(
    name: String,
    title: String,
    caption: String,
    ids: &[String],
    matrix: &[Vec<Option<f64>>],
) -> Plot {
    let cell = ((WIDTH - NAMES - 10.0) / ids.len().max(1) as f64).min(44.0);
    let side = cell * ids.len() as f64;
    // Names above stand upright when squares are narrow.
    let letters = 11.0_f64.min(cell * 0.95);
    let inner = html! {
        @for (i, id) in ids.iter().enumerate() {
            @let at = NAMES + cell * (i as f64 + 0.5);
            @let size = format!("font-size:{}px", place(letters));
            @let line = place(at + letters * 0.35);
            text class="right" style=(size) x=(NAMES - 6.0) y=(line) { title { (id) } (cut(id, MAX_LETTERS)) }
            text style=(size) transform=(format!("translate({line} {}) rotate(-90)", NAMES - 6.0)) {
                (cut(id, MAX_LETTERS))
            }
        }
        rect class="frame" x=(NAMES) y=(NAMES) width=(place(side)) height=(place(side)) {}
        @for (i, row) in matrix.iter().enumerate() {
            @for (j, value) in row.iter().enumerate() {
                @if let Some(value) = value {
                    @let (x, y) = (NAMES + cell * (j as f64 + 0.5), NAMES + cell * (i as f64 + 0.5));
                    @let numbered = cell > NUMBERED && i < j;
                    @if numbered {
                        text class="small middle" x=(place(x)) y=(place(y + 4.0)) { (super::scale::text(*value, 0.01)) }
                    } @else {
                        @let half = 0.46 * cell * value.abs().sqrt().min(1.0);
                        @if half > 0.5 {
                            @let (class, corner) = if *value >= 0.0 { ("positive", "0") } else { ("negative", "99") };
                            @let size = place(2.0 * half);
                            rect class=(class) x=(place(x - half)) y=(place(y - half)) width=(size) height=(size) rx=(corner) {
                                title { (ids[i]) ", " (ids[j]) ": " (super::scale::text(*value, 0.01)) }
                            }
                        }
                    }
                }
            }
        }
        rect class="positive" x=(NAMES) y=(NAMES + side + 14.0) width="12" height="12" {}
        text x=(NAMES + 18.0) y=(NAMES + side + 24.0) { "positive (square)" }
        rect class="negative" x=(NAMES + 160.0) y=(NAMES + side + 14.0) width="12" height="12" rx="6" {}
        text x=(NAMES + 178.0) y=(NAMES + side + 24.0) { "negative (round)" }
    };
    Plot::still(name, title, caption, [WIDTH, NAMES + side + 36.0], inner)
}
