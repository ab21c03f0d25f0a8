//! Options of a digital calibration certificate.

use std::path::{Path, PathBuf};

use abbe::certificate::{self, Certificate, EXAMPLE, Stated};
use abbe::files;
use abbe::files::stamp::FileStamp;
use abbe::identify::fit::FitResult;
use abbe::identify::problem::Problem;
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use clap::Args;

use super::output::{self, Outputs};

/// The name of the file of administrative data beside the session.
const FILE: &str = "certificate.toml";

/// Options of a digital calibration certificate.
#[derive(Args)]
pub struct CertificateArguments {
    /// Write a digital calibration certificate (XML, schema 3.1.2 of PTB): each error with its expanded uncertainty.
    /// Laboratory, customer and persons stand in `certificate.toml` beside the session.
    ///
    /// Example: --dcc certificate.xml
    #[arg(long, value_name = "FILE.xml")]
    pub dcc: Option<PathBuf>,
    /// File of the administrative data of `--dcc`, if it is not `certificate.toml` beside the session.
    ///
    /// Example: --dcc certificate.xml --certificate laboratory.toml
    #[arg(long, value_name = "FILE.toml", requires = "dcc")]
    certificate: Option<PathBuf>,
}

/// A certificate that is asked for.
pub struct Wanted<'a> {
    file: &'a Path,
    data: Certificate,
    /// The file of the laboratory as it was read.
    pub stamp: Option<FileStamp>,
}

impl CertificateArguments {
    /// What the laboratory states, before the work; `None` if no certificate is asked for.
    ///
    /// # Errors
    /// If there is no file of it, with an example, if the file has a fault, or if an output would replace it.
    pub fn read(&self, session: &Path, outputs: &Outputs) -> Result<Option<Wanted<'_>>, Diagnostic> {
        let Some(file) = &self.dcc else { return Ok(None) };
        let place = match &self.certificate {
            Some(place) => place.clone(),
            None => output::folder_of(session).join(FILE),
        };
        outputs.refuse_overwrite([place.as_path()])?;
        if self.certificate.is_none() && !place.exists() {
            return Err(Diagnostic::other(format!(
                "{}: `--dcc` needs the administrative data of the certificate; write this file, for example\n\n{EXAMPLE}",
                place.display()
            )));
        }
        let source = files::text(&place, "the file of a certificate")?;
        Ok(Some(Wanted { file, data: certificate::read(&source)?, stamp: source.stamp }))
    }
}

impl Wanted<'_> {
    /// What the certificate of a session states.
    ///
    /// # Errors
    /// If neither the file nor the session states a day and a serial number.
    pub fn of(&self, session: &Session) -> Result<Stated<'_>, Diagnostic> {
        Stated::of(&self.data, session)
    }

    /// Writes the certificate.
    pub fn write(&self, stated: &Stated, problem: &Problem, result: &FitResult) -> Result<(), Diagnostic> {
        output::write_whole(self.file, stated.xml(problem, result)?.as_bytes())
    }
}
