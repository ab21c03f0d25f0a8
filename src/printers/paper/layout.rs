//! Tables in a column or on a page: which columns wrap, and into which parts a table is split.
//!
//! The width of a text is estimated from the widths of its characters at 8 points, generously.

use std::ops::Range;

use crate::report::table::{Align, Table};

/// Class of a document.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Journals of Elsevier: `elsarticle`.
    Elsarticle,
    /// Transactions of the IEEE: `IEEEtran`.
    Ieeetran,
}

/// Class and number of columns.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Class of the document.
    pub class: Class,
    /// Whether a page has two columns.
    pub two_column: bool,
}

impl Layout {
    /// Width of the text of a page, points.
    pub fn page_pt(self) -> f64 {
        match (self.class, self.two_column) {
            (Class::Elsarticle, false) => 468.0,
            (Class::Elsarticle, true) => 522.0,
            (Class::Ieeetran, _) => 516.0,
        }
    }

    /// Width of a column, points.
    pub fn column_pt(self) -> f64 {
        if self.two_column { 252.0 } else { self.page_pt() }
    }
}

/// Space between two columns of a table, points.
const GAP: f64 = 8.0;
/// Least width of a column of words that wrap, points.
const MIN_WRAPPED: f64 = 60.0;
/// Least share of its natural width that a wrapped column keeps in a narrow table.
const MIN_SHARE: f64 = 0.45;
/// Lines of a part: less than a page.
const MAX_LINES: f64 = 40.0;
/// How much a wrapped text is longer than its words, as lines end before the margin.
const RAGGED: f64 = 1.2;

/// Some columns of a table, and the width in points of those whose words wrap.
pub type Columns = Vec<(usize, Option<f64>)>;

/// A part of a table that fits.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// Its columns.
    pub columns: Columns,
    /// Its rows.
    pub rows: Range<usize>,
    /// Whether it needs the width of the page.
    pub wide: bool,
    /// Its number from 1, and the number of parts.
    pub part: [usize; 2],
}

/// The parts of a table that fit a layout.
pub fn fitted(table: &Table, layout: Layout) -> Vec<Fitted> {
    let natural: Vec<f64> = (0..table.columns.len())
        .map(|column| {
            let cells = table.rows.iter().filter_map(|row| row.get(column)).map(|cell| width_pt(&cell.to_string()));
            cells.fold(width_pt(&table.columns[column].heading), f64::max)
        })
        .collect();
    let all: Vec<usize> = (0..natural.len()).collect();
    let placed = |columns: &[usize], limit: f64, share: f64| wrapped(table, &natural, columns, limit, share);
    let in_column = placed(&all, layout.column_pt(), MIN_SHARE);
    let on_page = || placed(&all, layout.page_pt(), 0.0);
    let groups = match in_column.map(|columns| (columns, false)).or_else(|| Some((on_page()?, layout.two_column))) {
        Some((columns, wide)) => vec![(columns, wide)],
        None => split(&natural, layout.page_pt())
            .into_iter()
            .map(|group| {
                let kept = |columns: &[usize]| columns.iter().map(|column| (*column, None)).collect();
                (placed(&group, layout.page_pt(), 0.0).unwrap_or_else(|| kept(&group)), layout.two_column)
            })
            .collect(),
    };
    let parts: Vec<(Columns, bool, Range<usize>)> = groups
        .into_iter()
        .flat_map(|(columns, wide)| {
            let rows = stretches(table, &columns);
            rows.into_iter().map(move |rows| (columns.clone(), wide, rows))
        })
        .collect();
    let count = parts.len();
    let numbered = parts.into_iter().enumerate();
    numbered.map(|(k, (columns, wide, rows))| Fitted { columns, rows, wide, part: [k + 1, count] }).collect()
}

/// Stretches of rows that fit a page.
fn stretches(table: &Table, columns: &Columns) -> Vec<Range<usize>> {
    let mut stretches = Vec::new();
    let (mut start, mut lines) = (0, 0.0);
    for (number, row) in table.rows.iter().enumerate() {
        let needed = columns.iter().filter_map(|(column, width)| {
            let text = width_pt(&row.get(*column)?.to_string());
            Some((RAGGED * text / (*width)?).ceil())
        });
        let needed = needed.fold(1.0, f64::max);
        if lines + needed > MAX_LINES && number > start {
            stretches.push(start..number);
            (start, lines) = (number, 0.0);
        }
        lines += needed;
    }
    stretches.push(start..table.rows.len());
    stretches
}

/// The widths of columns within a limit: words wrap as far as needed. `None` if they do not fit.
fn wrapped(table: &Table, natural: &[f64], columns: &[usize], limit: f64, min_share: f64) -> Option<Columns> {
    let gaps = GAP * columns.len() as f64;
    let total: f64 = columns.iter().map(|column| natural[*column]).sum::<f64>() + gaps;
    if total <= limit {
        return Some(columns.iter().map(|column| (*column, None)).collect());
    }
    let least = |column: usize| {
        let cells = table.rows.iter().filter_map(|row| row.get(column)).map(ToString::to_string);
        cells.map(|cell| longest_word_pt(&cell)).fold(MIN_WRAPPED, f64::max)
    };
    let wrapping: Vec<(usize, f64)> = columns
        .iter()
        .filter(|column| table.columns[**column].align == Align::Left)
        .map(|column| (*column, least(*column)))
        .filter(|(column, least)| natural[*column] > *least)
        .collect();
    let of_words: f64 = wrapping.iter().map(|(column, _)| natural[*column]).sum();
    let at_least: f64 = wrapping.iter().map(|(_, least)| least).sum();
    let room = limit - (total - of_words);
    if wrapping.is_empty() || room / of_words < min_share || room < at_least {
        return None;
    }
    // What is above the least widths is shared in proportion.
    let share = (room - at_least) / (of_words - at_least);
    let width = |column: usize| {
        let (_, least) = wrapping.iter().find(|(wrapped, _)| *wrapped == column)?;
        Some(least + (natural[column] - least) * share)
    };
    Some(columns.iter().map(|column| (*column, width(*column))).collect())
}

/// Estimated width of the longest part of a text within which no line breaks.
fn longest_word_pt(text: &str) -> f64 {
    text.split_inclusive([' ', '_']).map(|word| width_pt(word.trim_end())).fold(0.0, f64::max)
}

/// Groups of columns that fit a page, each with the first column in front.
fn split(natural: &[f64], limit: f64) -> Vec<Vec<usize>> {
    let first = natural.first().copied().unwrap_or(0.0) + GAP;
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut used = f64::INFINITY;
    for (column, width) in natural.iter().enumerate().skip(1) {
        if used + width + GAP > limit {
            groups.push(vec![0]);
            used = first;
        }
        used += width + GAP;
        if let Some(group) = groups.last_mut() {
            group.push(column);
        }
    }
    groups
}

/// Estimated width of a text at 8 points.
fn width_pt(text: &str) -> f64 {
    let of = |c: char| match c {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' | ' ' | '[' | ']' | '(' | ')' => 3.2,
        'm' | 'w' | 'M' | 'W' | '%' | '√' | '±' | '≤' | '−' | '+' | '=' | '~' | '<' | '>' | '…' => 7.4,
        c if c.is_ascii_uppercase() => 6.4,
        c if c.is_ascii_digit() => 4.4,
        c if c.is_ascii_lowercase() => 4.5,
        _ => 5.5,
    };
    text.chars().map(of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::table::{Column, cells};

    const TWO: Layout = Layout { class: Class::Ieeetran, two_column: true };

    #[test]
    fn a_narrow_table_stays_in_its_column_and_a_matrix_is_split() {
        let narrow = Table::new(["a", ">b"], [cells!["EX0C", "1.25"]]);
        let one = [Fitted { columns: vec![(0, None), (1, None)], rows: 0..1, wide: false, part: [1, 1] }];
        assert_eq!(fitted(&narrow, TWO), one);
        let columns = (0..40).map(|_| Column::from(">EX0C, µm/µm"));
        let row = (0..40).map(|k| format!("{k}.123").into()).collect::<Vec<_>>();
        let parts = fitted(&Table::new(columns, [row]), TWO);
        assert!(parts.len() > 2 && parts.iter().all(|part| part.wide && part.columns[0].0 == 0));
        let mut all: Vec<usize> = parts.iter().flat_map(|part| part.columns[1..].iter().map(|c| c.0)).collect();
        all.dedup();
        assert_eq!(all, (1..40).collect::<Vec<_>>());
    }

    #[test]
    fn words_wrap_within_the_page_and_long_tables_have_parts() {
        let sentence = "no reading of these tests changes with the position of the axis along itself ".repeat(3);
        let rows = (0..100).map(|_| cells!["EX0C", &sentence, "1.0"]);
        let parts = fitted(&Table::new(["error", "why", ">u"], rows), TWO);
        let widths: f64 = parts[0].columns.iter().filter_map(|(_, width)| *width).sum();
        assert!(parts[0].wide && widths > 300.0 && widths < 516.0);
        assert!(parts.len() > 6 && parts.iter().all(|part| part.rows.len() < 15));
        assert_eq!(parts.iter().flat_map(|part| part.rows.clone()).collect::<Vec<_>>(), (0..100).collect::<Vec<_>>());
    }
}
