//! The README of a paper's folder.

use abbe::files::SourceMap;
use abbe::model::Diagnostic;
use abbe::model::session::Session;

use super::PaperArguments;
use crate::report::block::Body;
use crate::report::paper::{Part, Subject};
use crate::report::provenance::Provenance;

/// The commands that make the folder and its results again, and the files that were read.
pub fn readme(
    arguments: &PaperArguments,
    origins: &[(Session, SourceMap)],
    sections: &[Part],
) -> Result<String, Diagnostic> {
    let mut text = String::from("# Files of a paper\n\n## This folder\n\n");
    let mut inputs = String::new();
    for (place, (session, sources)) in origins.iter().enumerate() {
        let found = Provenance::of((session, sources), arguments.seed);
        if place == 0 {
            text.push_str(&format!("```sh\n{}\n```\n\n", found.command));
        }
        for input in &found.inputs {
            inputs.push_str(&format!("- `{}`, {} bytes, SHA-256 `{}`\n", input.path, input.bytes, input.sha256));
        }
    }
    text.push_str("## Results\n\n| part | files | command |\n|---|---|---|\n");
    let first = arguments.sessions[0].display();
    for section in sections {
        let command = match section.subject {
            Subject::Sensitivity => format!("abbe plan {first} --all --patterns patterns.csv"),
            Subject::Trace => format!("abbe fit {first} --all --residuals residuals.csv --plots plots"),
            Subject::Methods if section.report.blocks.len() > 3 => format!("abbe fit {first} --json fit.json"),
            Subject::Equations => {
                format!("abbe equation {first} --all-tests --order first --form single --nomenclature --as latex")
            }
            Subject::Bias => format!("abbe paper {first} --out bias --parts bias"),
            _ => format!("abbe plan {first} --all --json plan.json"),
        };
        let files = section.report.blocks.iter().filter_map(|block| match &block.body {
            Body::Table(table) => Some(format!("`tables/{}`", table.name)),
            Body::Figure(figure) => Some(format!("`figures/{}`", figure.name)),
            _ => None,
        });
        let files = files.collect::<Vec<_>>().join(", ");
        text.push_str(&format!("| {} | {files} | `{command}` |\n", section.subject.word()));
    }
    text.push_str(
        "\nEach table is there for LaTeX, Typst and as CSV. Each figure is there as PDF, as SVG, and its data as CSV, which \
         pgfplots reads: `\\addplot table [col sep=comma] {figures/NAME.csv};`.\n\n## Typeset\n\n```sh\npdflatex main && \
         bibtex main && pdflatex main && pdflatex main && pdflatex main\ntypst compile main.typ\n```\n\n## Files that were read\n\n",
    );
    Ok(text + &inputs)
}
