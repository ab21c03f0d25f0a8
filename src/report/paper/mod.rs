//! The parts of `abbe paper`: selections of text, tables and figures, from results.

pub mod contents;
pub mod equations;

use abbe::identify::problem::Problem;
use abbe::model::parameter_id::ParameterId;

use super::block::{Body, Report, Text};
use super::table::Cell;

/// What a part of the paper is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// The methods.
    Methods,
    /// Machine, set-ups and tests.
    SetUp,
    /// The closed form of the readings, and the nomenclature.
    Equations,
    /// Sensitivities of the readings.
    Sensitivity,
    /// Predicted uncertainties.
    Uncertainty,
    /// Correlation of the errors.
    Correlation,
    /// Ranks, null space, base parameters.
    Identifiability,
    /// Biases by undeclared effects.
    Bias,
    /// Several sessions beside each other.
    Comparison,
    /// Estimates and residuals.
    Trace,
}

/// The subjects in the order of the paper, with the words of `--parts`, which are the names of their files.
pub const SUBJECTS: &[(&str, Subject)] = &[
    ("methods", Subject::Methods),
    ("set-up", Subject::SetUp),
    ("equations", Subject::Equations),
    ("sensitivity", Subject::Sensitivity),
    ("uncertainty", Subject::Uncertainty),
    ("correlation", Subject::Correlation),
    ("identifiability", Subject::Identifiability),
    ("bias", Subject::Bias),
    ("comparison", Subject::Comparison),
    ("trace", Subject::Trace),
];

impl Subject {
    /// Its word.
    pub fn word(self) -> &'static str {
        SUBJECTS.iter().find(|(_, own)| *own == self).map_or("", |(word, _)| word)
    }
}

/// A part of the paper. The title of the report is its heading.
pub struct Part {
    /// What it is about.
    pub subject: Subject,
    /// Contents.
    pub report: Report,
}

impl Part {
    /// The part with words in place of the identifiers of set-up parameters: `spindle_ball.y[S1]` is "spindle ball y (S1)".
    pub fn with_set_up_in_words(mut self, problem: &Problem) -> Part {
        let set_up = problem.parameters.list.iter().filter(|parameter| parameter.id.is_setup());
        let mut words: Vec<(String, String)> =
            set_up.map(|parameter| (parameter.id.to_string(), in_words(&parameter.id))).collect();
        // A longer identifier may contain a shorter one.
        words.sort_by_key(|(id, _)| std::cmp::Reverse(id.len()));
        let replace = |text: &mut String| {
            words.iter().filter(|(id, _)| text.contains(id)).collect::<Vec<_>>().into_iter().for_each(|(id, words)| {
                *text = text.replace(id, words);
            });
        };
        for block in &mut self.report.blocks {
            match &mut block.body {
                Body::Table(table) => {
                    for cell in table.rows.iter_mut().flatten() {
                        if let Cell::Text(text) = cell {
                            replace(text);
                        }
                    }
                    table.columns.iter_mut().for_each(|column| replace(&mut column.heading));
                }
                Body::Text(Text::Paragraph(text)) => replace(text),
                _ => {}
            }
        }
        self
    }
}

/// `spindle_ball.y[S1]` as "spindle ball y (S1)".
fn in_words(id: &ParameterId) -> String {
    let quantity = id.clone().with_group("").to_string().replace(['_', '.'], " ");
    id.group().map_or(quantity.clone(), |group| format!("{quantity} ({group})"))
}
