//! Errors on standard error: what was found and where, what to do, and an excerpt of the file.

use abbe::identify::IdentifyError;
use abbe::model::ModelError;

use super::message::{Kind, lines, tell, visible};

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Input that cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The identification failed.
    #[error(transparent)]
    Identify(IdentifyError),
    /// The equation cannot be made.
    #[error(transparent)]
    Codegen(#[from] abbe::codegen::CodegenError),
    /// The results of a fleet cannot be read or written.
    #[error(transparent)]
    Fleet(#[from] abbe::fleet::FleetError),
    /// A file that cannot be written.
    #[error("{path}: cannot be written: {source}")]
    Write {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// Options that contradict each other.
    #[error("{0}")]
    CommandLine(String),
    /// The user interrupted the work. The results found until then have been written.
    #[error("{0}")]
    Interrupted(String),
    /// Any other error.
    #[error("{0}")]
    Other(String),
}

/// Exit status of an interrupted program, as in shells.
pub const INTERRUPTED: u8 = 130;

impl From<IdentifyError> for Failure {
    fn from(error: IdentifyError) -> Self {
        match error {
            IdentifyError::Model(error) => Failure::Model(error),
            error @ IdentifyError::NotInTheLibrary { .. } => {
                Failure::Other(format!("{error}; `abbe trace --list` lists all candidates"))
            }
            other => Failure::Identify(other),
        }
    }
}

impl From<String> for Failure {
    fn from(message: String) -> Self {
        Failure::Other(message)
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
        if let Failure::Model(error) = self
            && let Some(location) = error.location()
            && let Some(span) = &location.span
            && let Ok(source) = std::fs::read_to_string(&location.file)
            && span.end <= source.len()
        {
            use ariadne::{Color, Config, IndexType, Label, Report, ReportKind, Source};
            let name = location.file.display().to_string();
            let source = visible(&source);
            let config = Config::default().with_index_type(IndexType::Byte);
            let label = Label::new((name.clone(), span.clone())).with_message("here").with_color(Color::Red);
            let report = Report::build(ReportKind::Error, (name.clone(), span.clone()))
                .with_config(config)
                .with_label(label)
                .finish();
            let mut excerpt = Vec::new();
            if report.write((name, Source::from(source)), &mut excerpt).is_ok() {
                tell(Kind::Error, &error.to_string());
                // The first line of the excerpt is another `Error:`.
                let first = excerpt.iter().position(|byte| *byte == b'\n').unwrap_or(0);
                lines(excerpt.get(first + 1..).unwrap_or_default());
                self.help();
                return;
            }
        }
        tell(Kind::Error, &self.to_string());
        self.help();
    }

    /// Writes what to do, if the error states it.
    fn help(&self) {
        match self {
            Failure::Model(ModelError::Input { help: Some(help), .. }) => tell(Kind::Help, help),
            Failure::Model(ModelError::FileAccess { help, .. }) => tell(
                Kind::Help,
                &format!("{help} (`--data DIR` names the data folder, `--allow-outside` allows files outside)"),
            ),
            _ => {}
        }
    }
}
