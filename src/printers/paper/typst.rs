//! Sections as Typst: the same tables, figures and citations as in LaTeX.

use super::Typesetter;
use super::latex::{caption, sentences};
use super::layout::{Fitted, Layout};
use crate::report::block::{Formula, pieces};
use crate::report::figure::Figure;
use crate::report::number::with_minus_signs;
use crate::report::table::{Align, Table};

/// Prints Typst from version 0.13 on.
pub struct Typst;

/// A string of Typst. A line may break after the signs within identifiers.
fn string(text: &str) -> String {
    let mut string = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => string.extend(['\\', c]),
            c if c.is_whitespace() && c != '\u{a0}' => string.push(' '),
            '_' | '~' => string.extend([c, '\u{200b}']),
            c if c.is_control() => string.push('?'),
            c => string.push(c),
        }
    }
    string.push('"');
    string
}

impl Typesetter for Typst {
    fn extension(&self) -> &'static str {
        "typ"
    }

    fn text(&self, text: &str) -> String {
        let piece = |(words, keys): (&str, Vec<&str>)| {
            let cited: String = keys.iter().map(|key| format!("#cite(<{key}>)")).collect();
            if words.is_empty() { cited } else { format!("#{};{cited}", string(words)) }
        };
        pieces(text).into_iter().map(piece).collect()
    }

    fn formula(&self, formula: &Formula) -> String {
        match formula.displayed {
            true => format!("{}\n", formula.typst),
            false => format!("$ {} $\n\n", formula.typst),
        }
    }

    fn heading(&self, text: &str) -> String {
        format!("= {text}\n\n")
    }

    fn table(&self, name: &str, table: &Table, part: &Fitted) -> String {
        let widths: Vec<String> =
            part.columns.iter().map(|(_, width)| width.map_or("auto".into(), |pt| format!("{pt:.0}pt"))).collect();
        let align = part.columns.iter().map(|(column, _)| match table.columns[*column].align {
            Align::Left => "left",
            Align::Right => "right",
        });
        let row = |cells: Vec<String>| format!("    {},\n", cells.join(", "));
        let heading: Vec<String> =
            part.columns.iter().map(|(column, _)| string(&table.columns[*column].heading)).collect();
        let rows = table.rows[part.rows.clone()].iter().map(|cells| {
            let cell = |(column, _): &(usize, Option<f64>)| {
                cells.get(*column).map_or("\"\"".into(), |cell| string(&with_minus_signs(&cell.to_string())))
            };
            row(part.columns.iter().map(cell).collect())
        });
        let notes: String = table.notes.iter().map(|note| format!(" #linebreak() #{}", string(note))).collect();
        let scope = if part.wide { "  scope: \"parent\", placement: auto,\n" } else { "" };
        let label = if part.part[0] == 1 { format!(" <tab:{name}>") } else { String::new() };
        format!(
            "#figure(\n{scope}  kind: table, caption: figure.caption(position: top, [#{}]),\n  text(8pt, [#table(\n    \
             columns: ({},), align: ({},), stroke: none, inset: 3pt,\n    table.hline(), table.header({}),\n    \
             table.hline(stroke: 0.5pt),\n{}    table.hline(),\n  ){notes}]),\n){label}\n\n",
            string(&caption(&table.title, part)),
            widths.join(", "),
            align.collect::<Vec<_>>().join(", "),
            heading.join(", "),
            rows.collect::<String>(),
        )
    }

    fn figure(&self, figure: &Figure, layout: Layout) -> String {
        let width = if layout.two_column { "100%" } else { "75%" };
        format!(
            "#figure(\n  image(\"/figures/{name}.svg\", width: {width}),\n  caption: [#{}],\n) <fig:{name}>\n\n",
            string(&sentences(&figure.title, &figure.caption)),
            name = figure.name,
        )
    }

    fn include(&self, file: &str) -> String {
        format!("#include \"/{file}.typ\"\n\n")
    }

    fn main(&self, title: &str, summary: &str, sections: &[String], layout: Layout) -> String {
        let columns = if layout.two_column { 2 } else { 1 };
        let included: String = sections.iter().map(|section| format!("#include \"/{section}.typ\"\n")).collect();
        let margin = (595.0 - layout.page_pt()) / 2.0;
        format!(
            "#set document(title: {title})\n#set page(paper: \"a4\", columns: {columns}, margin: (x: {margin}pt, y: 60pt))\n\
             #set text(10pt)\n#set par(justify: true)\n#set heading(numbering: \"1.\")\n\
             #set figure(placement: none)\n\n#place(top + center, scope: \"parent\", float: true, [\n  \
             #text(16pt, {title})\n\n  Author\n])\n\n*Abstract.* {}\n\n{included}\n#bibliography(\"/refs.bib\", style: \"ieee\")\n",
            self.text(summary),
            title = string(title),
        )
    }
}
