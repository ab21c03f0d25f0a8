//! The printers of `abbe paper`: sections of text, tables and figures as LaTeX and Typst, with their data.
//!
//! - [`layout`]: which widths a table gets in a column or on a page;
//! - [`latex`], [`typst`]: printers of a section and of the main file; [`references`]: the bibliography.

pub mod latex;
pub mod layout;
pub mod references;
pub mod typst;

use super::csv;
use crate::report::figure::{self, Figure, file_name, svg};
use crate::report::paper::{Item, Section};
use crate::report::table::{Cell, Table};
use layout::{Fitted, Layout, fitted};

/// A printer of sections.
pub trait Typesetter {
    /// Extension of its files.
    fn extension(&self) -> &'static str;
    /// A text with citations.
    fn text(&self, text: &str) -> String;
    /// A displayed formula of the two.
    fn formula(&self, latex: &str, typst: &str) -> String;
    /// A heading.
    fn heading(&self, text: &str) -> String;
    /// A part of a table with its caption.
    fn table(&self, name: &str, table: &Table, part: &Fitted) -> String;
    /// A figure with its caption.
    fn figure(&self, figure: &Figure, layout: Layout) -> String;
    /// Inclusion of another file of the folder, without its extension.
    fn include(&self, file: &str) -> String;
    /// The main file: title and abstract, and the sections by the names of their files.
    fn main(&self, title: &str, summary: &str, sections: &[String], layout: Layout) -> String;
}

/// The files of a paper: name in the folder, contents.
///
/// # Errors
/// If a table or a figure cannot be printed, which is a fault of the program.
pub fn files(
    title: &str,
    summary: &str,
    sections: &[Section],
    layout: Layout,
) -> Result<Vec<(String, Vec<u8>)>, String> {
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    let printers: [&dyn Typesetter; 2] = [&latex::Latex, &typst::Typst];
    for item in sections.iter().flat_map(|section| &section.items) {
        match item {
            Item::Table(name, table) => files.push((format!("tables/{}.csv", file_name(name)), csv::text(table)?)),
            Item::Figure(figure) => {
                files.push((format!("figures/{}.pdf", figure.name), figure::pdf::file(figure)?));
                files.push((format!("figures/{}.svg", figure.name), svg::untitled(figure).into_bytes()));
                files.push((format!("figures/{}.csv", figure.name), csv::text(&figure.table())?));
            }
            Item::Text(_) | Item::Formula(..) => {}
        }
    }
    for printer in printers {
        let extension = printer.extension();
        for section in sections {
            let mut text = printer.heading(section.heading);
            for item in &section.items {
                match item {
                    Item::Text(words) => text.push_str(&(printer.text(words) + "\n\n")),
                    Item::Formula(latex, typst) => text.push_str(&printer.formula(latex, typst)),
                    Item::Figure(figure) => text.push_str(&printer.figure(figure, layout)),
                    Item::Table(name, table) => {
                        let file = format!("tables/{}", file_name(name));
                        let parts = fitted(table, layout);
                        let printed: String =
                            parts.iter().map(|part| printer.table(&file_name(name), table, part)).collect();
                        files.push((format!("{file}.{extension}"), printed.into_bytes()));
                        text.push_str(&printer.include(&file));
                    }
                }
            }
            files.push((format!("sections/{}.{extension}", section.name), text.into_bytes()));
        }
        let names: Vec<String> = sections.iter().map(|section| format!("sections/{}", section.name)).collect();
        files.push((format!("main.{extension}"), printer.main(title, summary, &names, layout).into_bytes()));
    }
    files.push(("refs.bib".into(), references::bibliography().into_bytes()));
    Ok(files)
}

/// A cell, its negative numbers with minus signs.
fn minus(cell: &Cell) -> String {
    let words = cell.to_string();
    let signed = |word: &str| match word.strip_prefix('-') {
        Some(digits) if digits.starts_with(|c: char| c.is_ascii_digit()) => format!("−{digits}"),
        _ => word.to_string(),
    };
    words.split(' ').map(signed).collect::<Vec<_>>().join(" ")
}

/// A text as pieces: words, and the keys of the citations after them.
pub(crate) fn pieces(text: &str) -> Vec<(&str, Vec<&str>)> {
    let mut pieces = Vec::new();
    let mut rest = text;
    while let Some((words, (keys, after))) =
        rest.split_once("[@").and_then(|(words, after)| Some((words, after.split_once(']')?)))
    {
        pieces.push((words, keys.split(';').map(|key| key.trim().trim_start_matches('@')).collect()));
        rest = after;
    }
    pieces.push((rest, Vec::new()));
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::table::cells;

    fn sample() -> Table {
        let rows = (0..60).map(|k| cells![format!("EX0C~C:h{k}_x"), format!("{k}.5 & 3 % of #1 µm²"), "–"]);
        Table::new(["error", "a very long heading of words", ">u"], rows).titled("A table, {braces} and σ ≤ 2")
    }

    #[test]
    fn citations_are_separated_from_words() {
        let found = pieces("Rank [@a;@b] and x [@c].");
        assert_eq!(found, [("Rank ", vec!["a", "b"]), (" and x ", vec!["c"]), (".", vec![])]);
        assert_eq!(pieces("no [citation]"), [("no [citation]", vec![])]);
    }

    #[test]
    fn every_reference_that_a_section_cites_is_in_the_bibliography() {
        let bibliography = references::bibliography();
        for source in [
            include_str!("../../report/paper/contents.rs"),
            include_str!("../../report/paper/methods.rs"),
            include_str!("../../report/paper/comparison.rs"),
        ] {
            for (_, keys) in pieces(source) {
                for key in keys {
                    assert!(bibliography.contains(&format!("{{{key},")), "{key}");
                }
            }
        }
    }

    #[test]
    fn tables_of_both_languages_escape_what_the_languages_reserve() {
        let layout = Layout { class: layout::Class::Elsarticle, two_column: true };
        let items = vec![Item::Text("50 % of A_B [@jcgm100]".into()), Item::Table("t 1".into(), sample())];
        let section = Section { name: "bias", heading: "Bias", items };
        let files = files("50 % & more", "none", &[section], layout).unwrap();
        let text = |name: &str| {
            let (_, bytes) = files.iter().find(|(file, _)| file == name).unwrap();
            String::from_utf8(bytes.clone()).unwrap()
        };
        let latex = text("tables/t-1.tex");
        assert!(latex.contains(r"EX0C\textasciitilde{}C:h0\_\allowbreak{}x"), "{latex}");
        assert!(latex.contains(r"0.5 \& 3 \% of \#1 $\mu$m$^2$"), "{latex}");
        assert!(latex.contains(r"\{braces\} and $\sigma$ $\le$ 2 (part 1 of 2)"), "{latex}");
        assert!(text("sections/bias.tex").contains(r"50 \% of A\_\allowbreak{}B~\cite{jcgm100}"));
        assert!(text("sections/bias.typ").contains("#cite(<jcgm100>)"));
        assert!(text("main.tex").contains(r"50 \% \& more"));
        assert_eq!(text("tables/t-1.csv").lines().count(), 61);
    }
}
