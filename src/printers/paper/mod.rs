//! The printers of `abbe paper`: sections of text, tables and figures as LaTeX and Typst, with their data.
//!
//! - [`layout`]: which widths a table gets in a column or on a page;
//! - [`latex`], [`typst`]: printers of a part and of the main file.

pub mod latex;
pub mod layout;
pub mod typst;

use super::csv;
use crate::report::block::{BIBLIOGRAPHY, Block, Body, Formula, Level, Sentence, Text};
use crate::report::figure::{self, Figure, file_name, svg};
use crate::report::paper::Part;
use crate::report::table::Table;
use layout::{Fitted, Layout, fitted};

/// A printer of sections.
pub trait Typesetter {
    /// Extension of its files.
    fn extension(&self) -> &'static str;
    /// A text with citations.
    fn text(&self, text: &str) -> String;
    /// A displayed formula.
    fn formula(&self, formula: &Formula) -> String;
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
pub fn files(title: &str, summary: &str, parts: &[Part], layout: Layout) -> Result<Vec<(String, Vec<u8>)>, String> {
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    let printers: [&dyn Typesetter; 2] = [&latex::Latex, &typst::Typst];
    let printed = |block: &&Block| block.level != Level::Brief;
    for block in parts.iter().flat_map(|part| part.report.blocks.iter().filter(printed)) {
        match &block.body {
            Body::Table(table) => files.push((format!("tables/{}.csv", file_name(&table.name)), csv::text(table)?)),
            Body::Figure(figure) => {
                files.push((format!("figures/{}.pdf", figure.name), figure::pdf::file(figure)?));
                files.push((format!("figures/{}.svg", figure.name), svg::untitled(figure).into_bytes()));
                files.push((format!("figures/{}.csv", figure.name), csv::text(&figure.chart.table)?));
            }
            _ => {}
        }
    }
    for printer in printers {
        let extension = printer.extension();
        for part in parts {
            let mut text = printer.heading(&part.report.title);
            for block in part.report.blocks.iter().filter(printed) {
                match &block.body {
                    Body::Text(words) => text.extend(sentences(words).iter().map(|one| printer.text(one) + "\n\n")),
                    Body::KeyFigures(_) => {}
                    Body::Formula(formula) => text.push_str(&printer.formula(formula)),
                    Body::Figure(figure) => text.push_str(&printer.figure(figure, layout)),
                    Body::Table(table) => {
                        let name = file_name(&table.name);
                        let printed =
                            fitted(table, layout).iter().map(|part| printer.table(&name, table, part)).collect();
                        files.push((format!("tables/{name}.{extension}"), String::into_bytes(printed)));
                        text.push_str(&printer.include(&format!("tables/{name}")));
                    }
                }
            }
            files.push((format!("sections/{}.{extension}", part.subject.word()), text.into_bytes()));
        }
        let names: Vec<String> = parts.iter().map(|part| format!("sections/{}", part.subject.word())).collect();
        files.push((format!("main.{extension}"), printer.main(title, summary, &names, layout).into_bytes()));
    }
    files.push(("refs.bib".into(), BIBLIOGRAPHY.as_bytes().to_vec()));
    Ok(files)
}

/// A text as paragraphs.
fn sentences(text: &Text) -> Vec<String> {
    match text {
        Text::Opening { sentences, .. } => sentences
            .iter()
            .map(|sentence| match sentence {
                Sentence::Words(words) => words.clone(),
                Sentence::Command(command, purpose) => format!("`{command}` {purpose}"),
            })
            .collect(),
        Text::Section(words)
        | Text::Heading(words)
        | Text::Fold(words)
        | Text::Paragraph(words)
        | Text::Note(words) => {
            vec![words.clone()]
        }
        Text::List(lines) => lines.clone(),
        Text::Steps(steps) => steps.iter().map(|(step, purpose)| format!("{step}: {purpose}")).collect(),
        Text::Controls => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::block::Report;
    use crate::report::paper::Subject;
    use crate::report::table::cells;

    fn sample() -> Table {
        let rows = (0..60).map(|k| cells![format!("EX0C~C:h{k}_x"), format!("{k}.5 & 3 % of #1 µm²"), "–"]);
        Table::new(["error", "a very long heading of words", ">u"], rows).titled("A table, {braces} and σ ≤ 2")
    }

    #[test]
    fn every_reference_that_a_section_cites_is_in_the_bibliography() {
        for source in [include_str!("../../report/paper/contents.rs"), include_str!("../../report/plan/analysis.rs")] {
            for cited in source.split("[@").skip(1) {
                let (keys, _) = cited.split_once(']').unwrap();
                for key in keys.split(";@") {
                    assert!(BIBLIOGRAPHY.contains(&format!("{{{key},")), "{key}");
                }
            }
        }
    }

    #[test]
    fn tables_of_both_languages_escape_what_the_languages_reserve() {
        let layout = Layout { class: layout::Class::Elsarticle, two_column: true };
        let mut report = Report::new("Bias");
        report.key("50 % of A_B [@jcgm100]");
        report.key(sample().named("t 1"));
        let files = files("50 % & more", "none", &[Part { subject: Subject::Bias, report }], layout).unwrap();
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
