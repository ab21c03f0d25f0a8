//! `abbe fit`: estimate errors from readings.

use abbe::analysis::{Analysis, FitOptions, Given};
use abbe::identify::{fit, plausibility};
use abbe::model::Diagnostic;
use abbe::trace::SessionFit;
use clap::Args;

use super::method::{self, Method};
use super::readings::ReadingArguments;
use super::results::Read;
use super::save::SaveArguments;
use super::{CommonArguments, Global, SessionArguments, certificate, read_session};

/// Examples of `abbe fit`.
pub const HELP: &str = include_str!("help/fit.txt");

/// `abbe fit SESSION`
#[derive(Args)]
pub struct FitArguments {
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    common: CommonArguments,
    #[command(flatten)]
    save: SaveArguments,
    /// Method of identification.
    ///
    /// Example: --method two-plane
    #[arg(long, value_enum, default_value = "full")]
    method: Method,
    #[command(flatten)]
    options: FitOptions,
    #[command(flatten)]
    readings: ReadingArguments,
    #[command(flatten)]
    certificate: certificate::CertificateArguments,
}

/// Runs `abbe fit`.
pub fn run(arguments: &FitArguments, _: Global) -> Result<(), Diagnostic> {
    let common = &arguments.common;
    let ReadingArguments { views, residuals } = &arguments.readings;
    let (save, dcc) = (&arguments.save.save, &arguments.certificate.dcc);
    let outputs = common.output.prepared(&[views, residuals, save, dcc].map(Option::as_ref))?;
    let wanted = arguments.certificate.read(&arguments.session.session, &outputs)?;
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    let options = &arguments.options;
    let session = fit::assume(&session, &options.assume)?;
    let certificate = wanted.as_ref().map(|wanted| wanted.of(&session)).transpose()?;
    let mut read = Read::session(&session, &sources, common.seed);
    read.files.extend(wanted.as_ref().and_then(|wanted| wanted.stamp.as_ref()));
    if arguments.method != Method::Full {
        method::refuse([
            ("--views", views.is_some()),
            ("--residuals", residuals.is_some()),
            ("--base", options.base),
            ("--terms", options.terms.is_some()),
            ("--save", save.is_some()),
            ("--dcc", dcc.is_some()),
            ("--allow-implausible", options.allow_implausible),
        ])?;
        return arguments.method.run(&session, options, (common, &outputs), &read);
    }
    // The tables of readings show why a session is refused.
    let accepting = FitOptions { allow_implausible: true, assume: Vec::new(), ..options.clone() };
    let found = SessionFit::run(&[Given::Session(&session)], &accepting, common.seed, &|_| true)?;
    arguments.readings.write(&found.problem, &found.fit)?;
    if !options.allow_implausible {
        plausibility::accepted(&found.result.plausibility)?;
    }
    // A proposed command repeats what decides on estimates, not what is stated beside them.
    let FitOptions { assume, allow_implausible, .. } = options.clone();
    let repeated = FitOptions { assume, allow_implausible, ..FitOptions::default() };
    let commands = arguments.session.commands::<SessionFit>(common.seed, &repeated)?;
    common.output.put_found(&outputs, &found, &commands, &read)?;
    if let (Some(wanted), Some(certificate)) = (&wanted, &certificate) {
        wanted.write(certificate, &found.problem, &found.result)?;
    }
    arguments.save.run(&found.problem, &found.fit, &sources, common.seed)
}
