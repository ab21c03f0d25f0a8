//! The printers of reports: terminal, CSV, pages of HTML, notebooks, LaTeX and Typst.

pub mod csv;
pub mod html;
pub mod page;
pub mod paper;
pub mod sheet;
pub mod terminal;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::block::{Formula, KeyFigure, Report, Text};
    use crate::report::figure::bars::{NAMED, bars};
    use crate::report::figure::{Figure, Quantity};
    use crate::report::paper::{Part, Subject};
    use crate::report::provenance::Provenance;
    use crate::report::table::{Table, cells};
    use paper::layout::{Class, Layout};

    fn sample() -> Report {
        let mut report = Report::new("title-words");
        report.opening("verdict-word", ["opening-words".to_string()]);
        report.key(vec![KeyFigure::new("label-words", "value-words", "note-words")]);
        report.section("section-words");
        report.key("paragraph-words [@jcgm100]");
        // A page writes the first letter of an entry as a capital.
        report.key(Text::List(vec!["a list-words".into()]));
        report.key(Text::Note("remark-words".into()));
        report.key(Text::Steps(vec![("step-words".into(), "purpose-words".into())]));
        report.key(Table::new(["heading-words"], [cells!["cell-words"]]).named("table"));
        report.key(Formula::new("latex-words", "typst-words", "plain-words"));
        report.brief(Text::Note("brief-words".into()));
        report.folded("fold-words", "detail-words");
        report.page("page-words");
        let bar = bars(&Quantity::new("x", ""), &[("bar".into(), 1.0, NAMED)], &[]);
        report.figures([Figure::new("drawing", "figure-words", "", bar)]);
        report
    }

    #[test]
    fn every_printer_prints_every_kind_of_block() {
        let report = sample();
        let contains = |printed: &str, words: &[&str]| {
            words.iter().for_each(|words| assert!(printed.contains(&format!("{words}-words")), "{words}: {printed}"));
        };
        let common =
            ["opening", "label", "value", "note", "paragraph", "list", "remark", "step", "purpose", "cell", "plain"];
        let [first, all] = [Some("--all lists them"), None].map(|more| terminal::report(&report, more));
        contains(&first, &[&common[..], &["brief"]].concat());
        contains(&all, &[&common[..], &["fold", "detail"]].concat());
        assert!(!first.contains("detail") && !all.contains("brief") && !all.contains('@') && !all.contains("figure"));
        assert!([&first, &all].into_iter().all(|printed| !printed.contains("page-words")));
        let page = page::html(&report, &Provenance::of_command(None)).unwrap();
        contains(&page, &[&common[..], &["title", "section", "fold", "detail", "page", "figure"]].concat());
        assert!(!page.contains("brief-words") && page.contains("verdict-word"));
        contains(&html::notebook(&report), &[&common[..], &["title", "section", "brief"]].concat());
        let csv = String::from_utf8(csv::report(&report).unwrap()).unwrap();
        assert_eq!(csv, "# section-words\nheading-words\ncell-words\n");
        let layout = Layout { class: Class::Elsarticle, two_column: false };
        let files = paper::files("", "", &[Part { subject: Subject::Methods, report }], layout).unwrap();
        for language in ["tex", "typ"] {
            let text = |name: &str| {
                let (_, bytes) = files.iter().find(|(file, _)| *file == format!("{name}.{language}")).unwrap();
                String::from_utf8(bytes.clone()).unwrap()
            };
            let part = text("sections/methods");
            contains(
                &part,
                &["title", "opening", "section", "paragraph", "list", "remark", "step", "detail", "figure"],
            );
            assert!(part.contains("jcgm100") && part.contains("tables/table") && part.contains("figures/drawing"));
            assert!(!part.contains("brief-words"), "{part}");
            contains(&part, &[if language == "tex" { "latex" } else { "typst" }]);
            contains(&text("tables/table"), &["cell"]);
        }
    }
}
