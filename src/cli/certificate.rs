//! Options of a digital calibration certificate.

use std::path::{Path, PathBuf};

use abbe::certificate::{self, Certificate, EXAMPLE};
use abbe::identify::problem::Problem;
use abbe::identify::results::FitResult;
use abbe::model::files;
use clap::Args;

use super::failure::Failure;
use super::output;

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
    dcc: Option<PathBuf>,
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
}

impl CertificateArguments {
    /// The file that is written, if one is asked for.
    pub fn file(&self) -> Option<&PathBuf> {
        self.dcc.as_ref()
    }

    /// What the laboratory states, before the work; `None` if no certificate is asked for.
    ///
    /// # Errors
    /// If there is no file of it, with an example, or the file has a fault.
    pub fn read(&self, session: &Path) -> Result<Option<Wanted<'_>>, Failure> {
        let Some(file) = &self.dcc else { return Ok(None) };
        let place = match &self.certificate {
            Some(place) => place.clone(),
            None => output::folder_of(session).join(FILE),
        };
        if self.certificate.is_none() && !place.exists() {
            return Err(Failure::Other(format!(
                "{}: `--dcc` needs the administrative data of the certificate; write this file, for example\n\n{EXAMPLE}",
                place.display()
            )));
        }
        let source = files::text(&place, "the file of a certificate")?;
        Ok(Some(Wanted { file, data: certificate::read(&source)? }))
    }
}

impl Wanted<'_> {
    /// Writes the certificate.
    pub fn write(&self, problem: &Problem, result: &FitResult) -> Result<(), Failure> {
        output::write_whole(self.file, certificate::xml(problem, result, &self.data)?.as_bytes())
    }
}
