//! Tables and sentences as HTML. All text passes through templates that escape markup.

use maud::{Markup, PreEscaped, html};

use crate::report::table::{Align, Table};

/// A word column with a longer cell than this wraps.
const MAX_UNWRAPPED: usize = 26;

/// The head of a page that stands alone: its policy, title and style.
pub fn head(policy: &str, title: &str, style: &str) -> Markup {
    html! {
        head {
            meta charset="utf-8";
            meta http-equiv="Content-Security-Policy" content=(policy);
            meta name="viewport" content="width=device-width, initial-scale=1";
            meta name="generator" content=(concat!("abbe ", env!("CARGO_PKG_VERSION")));
            link rel="icon" href="data:,";
            title { (title) }
            style { (PreEscaped(style)) }
        }
    }
}

/// The table under its title. Columns of words are aligned to the left, columns of numbers to the right.
pub fn table(table: &Table) -> Markup {
    let class: Vec<Option<&str>> = (0..table.columns.len()).map(|column| column_class(table, column)).collect();
    html! {
        @if !table.title.is_empty() { p { (table.title) "." } }
        div class="scroll" {
            table {
                thead {
                    tr { @for (column, class) in table.columns.iter().zip(&class) { th class=[*class] { (column.heading) } } }
                }
                tbody {
                    @for row in &table.rows {
                        tr { @for (cell, class) in row.iter().zip(&class) { td class=[*class] { (with_minus_signs(&cell.to_string())) } } }
                    }
                }
            }
        }
        @for note in &table.notes { p class="note" { (prose(note)) } }
    }
}

/// CSS class of a column.
fn column_class(table: &Table, column: usize) -> Option<&'static str> {
    let cells = || table.rows.iter().filter_map(|row| row.get(column)).map(ToString::to_string);
    let is_long = cells().any(|cell| cell.chars().count() > MAX_UNWRAPPED && cell.contains(' '));
    match (table.columns[column].align, is_long) {
        (Align::Left, true) => Some("word-column long"),
        (Align::Left, false) => Some("word-column"),
        (Align::Right, _) => None,
    }
}

/// Text with a minus sign in place of a hyphen before numbers.
pub fn with_minus_signs(text: &str) -> String {
    let word = |word: &str| match word.strip_prefix('-') {
        Some(number) if number.starts_with(|c: char| c.is_ascii_digit()) => format!("\u{2212}{number}"),
        _ => word.to_string(),
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// Text in which backquotes mark code.
pub fn prose(text: &str) -> Markup {
    html! {
        @for (number, part) in text.split('`').enumerate() {
            @if number % 2 == 1 { code { (part) } } @else { (with_minus_signs(part)) }
        }
    }
}

/// A list of sentences.
pub fn list(items: impl IntoIterator<Item = String>) -> Markup {
    html! { ul { @for item in items { li { (prose(&item)) } } } }
}

/// Contents that the reader unfolds.
pub fn folded(summary: &str, contents: &Markup) -> Markup {
    html! { details { summary { (summary) } (contents) } }
}

/// Contents, folded if there are more than `max` of these things.
pub fn folded_beyond(max: usize, count: usize, summary: &str, contents: Markup) -> Markup {
    if count > max { folded(summary, &contents) } else { contents }
}

/// Text with a capital first letter.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// An integer with a thin space between thousands.
pub fn integer(value: usize) -> String {
    let digits = value.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().filter_map(|group| std::str::from_utf8(group).ok()).collect();
    if digits.len() < 5 { digits } else { groups.join("\u{202f}") }
}

#[cfg(test)]
mod tests {
    use super::integer;

    #[test]
    fn integers_have_groups_of_three_digits_from_10_000_on() {
        assert_eq!(integer(9_876), "9876");
        assert_eq!(integer(12_345), "12\u{202f}345");
        assert_eq!(integer(1_234_567), "1\u{202f}234\u{202f}567");
    }
}
