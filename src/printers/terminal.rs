//! Reports on the terminal: sentences, and tables of aligned columns under a header.

use std::borrow::Cow;

use abbe::model::words::{cut, shortened};

use crate::report::block::{Body, KeyFigure, Level, Report, Sentence, Text, uncited};
use crate::report::table::{Align, Table, cells};

/// Largest width of a cell, in characters. A longer text is cut with an ellipsis; CSV and JSON hold it whole.
const MAX_WIDTH: usize = 160;

/// Length of a line that no result has but by a name that it quotes, bytes.
const MAX_LINE: usize = 1000;

/// A line of words. What a long line quotes is cut to a readable length.
pub fn line(text: &str) -> Cow<'_, str> {
    if text.len() > MAX_LINE { shortened(text) } else { Cow::Borrowed(text) }
}

/// The table without its title: one line per row under the header, then the notes, without a line end at the end.
pub fn text(table: &Table) -> String {
    let shown = |text: &str| cut(text, MAX_WIDTH).into_owned();
    let header: Vec<String> = table.columns.iter().map(|column| shown(&column.heading)).collect();
    let rows: Vec<Vec<String>> =
        table.rows.iter().map(|row| row.iter().map(|cell| shown(&cell.to_string())).collect()).collect();
    let mut width: Vec<usize> = header.iter().map(|cell| cell.chars().count()).collect();
    for row in &rows {
        for (w, cell) in width.iter_mut().zip(row) {
            *w = (*w).max(cell.chars().count());
        }
    }
    let row = |cells: &Vec<String>| {
        let aligned = cells.iter().zip(&table.columns).zip(&width).map(|((cell, column), width)| match column.align {
            Align::Left => format!("{cell:<width$}"),
            Align::Right => format!("{cell:>width$}"),
        });
        format!("  {}", aligned.collect::<Vec<_>>().join("  ")).trim_end().to_string()
    };
    let notes = table.notes.iter().map(|note| format!("  {}", shortened(note)));
    let header = Some(&header).filter(|header| header.iter().any(|heading| !heading.is_empty()));
    header.into_iter().chain(&rows).map(row).chain(notes).collect::<Vec<_>>().join("\n")
}

/// Entries of a long list that are printed without `--all`.
const MAX_LISTED: usize = 3;

/// The key blocks of a report, and what stands for its details; with `more`, the words that say how to see the details,
/// after what is left out. Without `more`, key blocks and details.
///
/// Figures and what belongs to the pages of browsers are left out.
pub fn report(report: &Report, more: Option<&str>) -> String {
    let levels = if more.is_some() { [Level::Brief, Level::Key] } else { [Level::Key, Level::Detail] };
    let mut out = String::new();
    // An untitled table at the start of a section has the heading of the section.
    let (mut gap, mut heading) = (false, "");
    for block in report.blocks.iter().filter(|block| levels.contains(&block.level)) {
        let hint = more.filter(|_| block.level == Level::Brief).map_or(String::new(), |more| format!("; {more}"));
        let (apart, text) = match &block.body {
            Body::Text(text) => {
                let (apart, text) = words(text, more, &hint);
                (apart, text.split('\n').map(line).collect::<Vec<_>>().join("\n"))
            }
            Body::KeyFigures(figures) => (false, key_figures(figures)),
            Body::Formula(formula) => (false, format!("  {}", formula.text)),
            Body::Table(table) => {
                let title = if table.title.is_empty() { heading } else { &table.title };
                let title = if title.is_empty() { String::new() } else { format!("{title}{hint}:\n") };
                (!title.is_empty(), title + &shown(table, more))
            }
            Body::Figure(_) => continue,
        };
        if let Body::Text(Text::Section(next)) = &block.body {
            (gap, heading) = (true, next);
        }
        if text.is_empty() {
            continue;
        }
        heading = "";
        if (apart || gap) && !out.is_empty() {
            out.push('\n');
        }
        gap = false;
        out.push_str(&text);
        out.push('\n');
    }
    out.truncate(out.trim_end().len());
    out
}

/// A text, and whether an empty line sets it apart.
fn words(text: &Text, more: Option<&str>, hint: &str) -> (bool, String) {
    match text {
        Text::Opening { word, sentences } => {
            let mut lines = sentences.iter().map(|sentence| match sentence {
                Sentence::Words(words) => uncited(words),
                Sentence::Command(command, purpose) => format!("  {command}  {purpose}"),
            });
            let first = lines.next().unwrap_or_default();
            let first = if word.is_empty() { first } else { format!("Verdict: {word}. {first}") };
            (false, std::iter::once(first).chain(lines).collect::<Vec<_>>().join("\n"))
        }
        Text::Section(_) | Text::Controls => (false, String::new()),
        Text::Heading(heading) | Text::Fold(heading) => (true, heading.clone()),
        Text::Paragraph(paragraph) => (false, uncited(paragraph) + hint),
        Text::Note(note) => (false, format!("  {}{hint}", uncited(note))),
        Text::List(lines) => (false, list(lines, more)),
        Text::Steps(steps) => {
            let width = steps.iter().map(|(step, _)| step.chars().count()).max().unwrap_or(0);
            let row = |(step, purpose): &(String, String)| format!("\n  {step:<width$}  {purpose}");
            (true, format!("Next:{}", steps.iter().map(row).collect::<String>()))
        }
    }
}

/// The lines of a list; with `more`, the first ones and the number of the others.
fn list(lines: &[String], more: Option<&str>) -> String {
    // One line more costs no more room than the number of the others.
    let shown = if more.is_none() || lines.len() <= MAX_LISTED + 1 { lines.len() } else { MAX_LISTED };
    let mut text: Vec<String> = lines[..shown].iter().map(|line| format!("  {}", uncited(line))).collect();
    text.extend(left_out(lines.len() - shown, more));
    text.join("\n")
}

/// The number of what is left out, and how to see it.
fn left_out(count: usize, more: Option<&str>) -> Option<String> {
    more.filter(|_| count > 0).map(|more| format!("  … {count} more; {more}"))
}

/// The rows of a table; with `more`, its key rows and the number of the others.
fn shown(table: &Table, more: Option<&str>) -> String {
    let Some(rows) = table.key_rows.as_ref().filter(|_| more.is_some()) else {
        return text(table);
    };
    let kept = rows.iter().filter_map(|row| table.rows.get(*row)).cloned().collect::<Vec<_>>();
    let count = table.rows.len() - kept.len();
    let mut key = Table { rows: kept, ..table.clone() };
    key.notes.splice(0..0, left_out(count, more).map(|line| line.trim_start().to_string()));
    text(&key)
}

/// One line for each figure.
fn key_figures(figures: &[KeyFigure]) -> String {
    let rows = figures.iter().map(|figure| cells![figure.label, &figure.value, &figure.note]);
    text(&Table::new(["", "", ""], rows))
}
