//! Sections as LaTeX: booktabs tables, PDF figures, BibTeX citations.

use super::Typesetter;
use super::layout::{Class, Fitted, Layout};
use crate::report::block::{Formula, pieces};
use crate::report::figure::Figure;
use crate::report::number::with_minus_signs;
use crate::report::table::{Align, Table};

/// Prints LaTeX for pdfLaTeX with `graphicx`, `booktabs` and `array`.
pub struct Latex;

/// Text with the characters that LaTeX reserves or that its fonts lack replaced.
pub fn escaped(text: &str) -> String {
    text.chars().map(character).collect()
}

fn character(c: char) -> String {
    let replacement = match c {
        '\\' => r"\textbackslash{}",
        '{' => r"\{",
        '}' => r"\}",
        '$' => r"\$",
        '&' => r"\&",
        '%' => r"\%",
        '#' => r"\#",
        '_' => r"\_\allowbreak{}",
        '^' => r"\textasciicircum{}",
        '~' => r"\textasciitilde{}",
        '<' => "$<$",
        '>' => "$>$",
        '|' => "$|$",
        '"' => "''",
        '\u{a0}' => "~",
        'µ' | 'μ' => r"$\mu$",
        '°' => r"$^\circ$",
        '″' => "$''$",
        '′' => "$'$",
        '−' => "$-$",
        '–' => "--",
        '…' => r"\ldots{}",
        '·' => r"$\cdot$",
        '×' => r"$\times$",
        '±' => r"$\pm$",
        '≤' => r"$\le$",
        '≥' => r"$\ge$",
        '≈' => r"$\approx$",
        '∞' => r"$\infty$",
        '√' => r"$\surd$",
        '²' => "$^2$",
        '³' => "$^3$",
        '⁻' => "$^-$",
        '¹' => "$^1$",
        'α' => r"$\alpha$",
        'β' => r"$\beta$",
        'θ' => r"$\theta$",
        'λ' => r"$\lambda$",
        'σ' => r"$\sigma$",
        'ν' => r"$\nu$",
        'χ' => r"$\chi$",
        'ρ' => r"$\rho$",
        'Σ' => r"$\Sigma$",
        'Δ' => r"$\Delta$",
        '∂' => r"$\partial$",
        '⋯' => r"$\cdots$",
        c if c.is_ascii() && !c.is_ascii_control() => return c.to_string(),
        // Letters with accents of Western European languages.
        '\u{c0}'..='\u{ff}' => return c.to_string(),
        c if c.is_whitespace() => " ",
        _ => "?",
    };
    replacement.to_string()
}

impl Typesetter for Latex {
    fn extension(&self) -> &'static str {
        "tex"
    }

    fn text(&self, text: &str) -> String {
        let piece = |(words, keys): (&str, Vec<&str>)| match keys.is_empty() {
            true => escaped(words),
            false => format!("{}~\\cite{{{}}}", escaped(words.trim_end()), keys.join(",")),
        };
        pieces(text).into_iter().map(piece).collect()
    }

    fn formula(&self, formula: &Formula) -> String {
        match formula.displayed {
            true => format!("{}\n", formula.latex),
            false => format!("\\begin{{equation*}}\n{}\n\\end{{equation*}}\n\n", formula.latex),
        }
    }

    fn heading(&self, text: &str) -> String {
        format!("\\section{{{}}}\n\n", escaped(text))
    }

    fn table(&self, name: &str, table: &Table, part: &Fitted) -> String {
        let environment = if part.wide { "table*" } else { "table" };
        let columns = part.columns.iter().map(|(column, width)| match (table.columns[*column].align, width) {
            (_, Some(width)) => format!(">{{\\raggedright\\arraybackslash}}p{{{width:.0}pt}}"),
            (Align::Left, None) => "l".to_string(),
            (Align::Right, None) => "r".to_string(),
        });
        let row = |cells: Vec<String>| cells.join(" & ") + " \\\\\n";
        let heading = part.columns.iter().map(|(column, _)| escaped(&table.columns[*column].heading)).collect();
        let rows = table.rows[part.rows.clone()].iter().map(|cells| {
            let cell = |(column, _): &(usize, Option<f64>)| {
                cells.get(*column).map_or(String::new(), |cell| escaped(&with_minus_signs(&cell.to_string())))
            };
            row(part.columns.iter().map(cell).collect())
        });
        let notes: String = table.notes.iter().map(|note| format!("\n\\par\\smallskip {}", escaped(note))).collect();
        let label = if part.part[0] == 1 { format!("\\label{{tab:{name}}}") } else { String::new() };
        format!(
            "\\begin{{{environment}}}[!htbp]\n\\centering\\footnotesize\\setlength{{\\tabcolsep}}{{4pt}}\\setlength{{\\belowcaptionskip}}{{3pt}}\n\
             \\caption{{{}}}{label}\n\\begin{{tabular}}{{{}}}\n\\toprule\n{}\\midrule\n{}\\bottomrule\n\\end{{tabular}}\
             {notes}\n\\end{{{environment}}}\n\n",
            escaped(&caption(&table.title, part)),
            columns.collect::<String>(),
            row(heading),
            rows.collect::<String>(),
        )
    }

    fn figure(&self, figure: &Figure, layout: Layout) -> String {
        let width = if layout.two_column { r"\columnwidth" } else { r"0.75\textwidth" };
        format!(
            "\\begin{{figure}}[!htbp]\n\\centering\n\
             \\includegraphics[width={width},height=0.7\\textheight,keepaspectratio]{{figures/{name}.pdf}}\n\
             \\caption{{{}}}\\label{{fig:{name}}}\n\\end{{figure}}\n\n",
            escaped(&sentences(&figure.title, &figure.caption)),
            name = figure.name,
        )
    }

    fn include(&self, file: &str) -> String {
        format!("\\input{{{file}}}\n\n")
    }

    fn main(&self, title: &str, summary: &str, sections: &[String], layout: Layout) -> String {
        let (title, summary) = (escaped(title), self.text(summary));
        let [class, front, style] = match layout.class {
            Class::Elsarticle => [
                // The footer of the first page in this class is 2 pt wider than the page.
                if layout.two_column { "[final,5p,twocolumn]{elsarticle}" } else { "[final,3p]{elsarticle}" }
                    .to_string()
                    + "\n\\makeatletter\\let\\ps@pprintTitle\\ps@plain\\makeatother",
                format!(
                    "\\begin{{frontmatter}}\n\\title{{{title}}}\n\\author{{Author}}\n\\begin{{abstract}}\n{summary}\n\
                     \\end{{abstract}}\n\\end{{frontmatter}}\n"
                ),
                "elsarticle-num".to_string(),
            ],
            Class::Ieeetran => [
                if layout.two_column { "[journal]{IEEEtran}" } else { "[journal,onecolumn]{IEEEtran}" }.to_string(),
                format!(
                    "\\title{{{title}}}\n\\author{{Author}}\n\\maketitle\n\\begin{{abstract}}\n{summary}\n\
                     \\end{{abstract}}\n"
                ),
                "IEEEtran".to_string(),
            ],
        };
        let included: String = sections.iter().map(|section| format!("\\input{{{section}}}\n")).collect();
        format!(
            "\\documentclass{class}\n\\usepackage{{amsmath}}\n\\usepackage{{graphicx}}\n\\usepackage{{booktabs}}\n\
             \\usepackage{{array}}\n\\extrafloats{{200}}\n\\setlength{{\\emergencystretch}}{{3em}}\n\
             \\begin{{document}}\n{front}{included}\\bibliographystyle{{{style}}}\n\\bibliography{{refs}}\n\
             \\end{{document}}\n"
        )
    }
}

/// The caption of a part of a table.
pub(super) fn caption(title: &str, part: &Fitted) -> String {
    let title = title.replace('\n', " ");
    match part.part {
        [_, 1] => title,
        [number, count] => format!("{title} (part {number} of {count})"),
    }
}

/// Title and caption of a figure as sentences.
pub(super) fn sentences(title: &str, caption: &str) -> String {
    format!("{}. {caption}", title.trim_end_matches('.')).trim_end().to_string()
}
