//! Errors as a user sees them: what, where, what to do; the line of the file shown where one is meant.

use abbe::identify::IdentifyError;
use abbe::model::ModelError;

/// Why a command could not do its work.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Input.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Identification.
    #[error(transparent)]
    Identify(IdentifyError),
    /// An equation.
    #[error(transparent)]
    Codegen(#[from] abbe::codegen::CodegenError),
    /// A file that cannot be written.
    #[error("{path}: cannot be written: {source}")]
    Write {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// Options that do not go together.
    #[error("{0}")]
    CommandLine(String),
    /// The user interrupted the work; what there was by then has been written.
    #[error("{0}")]
    Interrupted(String),
    /// Anything else.
    #[error("{0}")]
    Other(String),
}

/// Exit status of a program that was interrupted, as shells give it.
pub const INTERRUPTED: u8 = 130;

impl From<IdentifyError> for Failure {
    fn from(error: IdentifyError) -> Self {
        match error {
            IdentifyError::Model(error) => Failure::Model(error),
            other => Failure::Identify(other),
        }
    }
}

impl Failure {
    /// The exit status: 1 for input that cannot be used, 2 for a wrong command line, 130 for an interruption.
    pub fn status(&self) -> u8 {
        match self {
            Failure::CommandLine(_) => 2,
            Failure::Interrupted(_) => INTERRUPTED,
            _ => 1,
        }
    }

    /// Writes the message to standard error.
    pub fn show(&self) {
        if let Failure::Interrupted(message) = self {
            eprintln!("{message}");
            return;
        }
        if let Failure::Model(ModelError::Input { place, message, help }) = self
            && let Some(span) = &place.span
            && let Ok(source) = std::fs::read_to_string(&place.file)
            && span.end <= source.len()
        {
            use ariadne::{Config, IndexType, Label, Report, ReportKind, Source};
            let name = place.file.display().to_string();
            let source = visible(&source);
            let mut report = Report::build(ReportKind::Error, (name.clone(), span.clone()))
                .with_config(
                    Config::default()
                        .with_index_type(IndexType::Byte)
                        .with_color(false),
                )
                .with_message(visible(&format!("{place}: {message}")))
                .with_label(Label::new((name.clone(), span.clone())).with_message("here"));
            if let Some(help) = help {
                report = report.with_help(visible(help));
            }
            if report.finish().eprint((name, Source::from(source))).is_ok() {
                return;
            }
        }
        eprintln!("error: {}", visible(&self.to_string()));
        if let Failure::Model(ModelError::Input { help: Some(help), .. }) = self {
            eprintln!("  help: {}", visible(help));
        }
    }
}

/// The text without what would steer a terminal: of a control character `?` is shown, one for each of its bytes, so that places stay.
pub fn visible(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if c == '\r' {
            shown.push(' ');
        } else if c.is_control() && !matches!(c, '\n' | '\t') {
            shown.extend(std::iter::repeat_n('?', c.len_utf8()));
        } else {
            shown.push(c);
        }
    }
    shown
}
