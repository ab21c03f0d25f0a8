//! `abbe fit`: estimate errors from readings.

use abbe::analysis::FitOptions;
use abbe::identify::{fit, plausibility, propagation};
use abbe::model::Diagnostic;
use abbe::trace::SessionFit;
use clap::Args;

use super::forms::FormArguments;
use super::method::{self, Method};
use super::readings::ReadingArguments;
use super::results::Read;
use super::save::SaveArguments;
use super::{CommonArguments, Global, SessionArguments, certificate, monte_carlo, read_session};

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
    #[command(flatten)]
    forms: FormArguments,
    #[command(flatten)]
    options: FitOptions,
    /// Method of identification.
    ///
    /// Example: --method two-plane
    #[arg(long, value_enum, default_value = "full")]
    method: Method,
    #[command(flatten)]
    readings: ReadingArguments,
    #[command(flatten)]
    certificate: certificate::CertificateArguments,
    #[command(flatten)]
    draws: monte_carlo::DrawArguments,
}

/// Runs `abbe fit`.
pub fn run(arguments: &FitArguments, _: Global) -> Result<(), Diagnostic> {
    let common = &arguments.common;
    let ReadingArguments { views, residuals } = &arguments.readings;
    let (save, dcc) = (&arguments.save.save, &arguments.certificate.dcc);
    let outputs = common.output.prepared(&[views, residuals, save, dcc].map(Option::as_ref))?;
    let wanted = arguments.certificate.read(&arguments.session.session, &outputs)?;
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    let session = fit::assume(&session, &arguments.options.assume)?;
    let certificate = wanted.as_ref().map(|wanted| wanted.of(&session)).transpose()?;
    let mut read = Read::session(&session, &sources, common.seed);
    read.files.extend(wanted.as_ref().and_then(|wanted| wanted.stamp.as_ref()));
    if arguments.method != Method::Full {
        method::refuse([
            ("--views", views.is_some()),
            ("--residuals", residuals.is_some()),
            ("--base", arguments.forms.base),
            ("--terms", arguments.forms.terms.is_some()),
            ("--save", save.is_some()),
            ("--dcc", dcc.is_some()),
            ("--allow-implausible", arguments.options.allow_implausible),
        ])?;
        return arguments.method.run(&session, &arguments.draws, (common, &outputs), &read);
    }
    let draws = arguments.draws.draws(common.seed)?;
    let mut found = SessionFit::of(&session, common.seed)?;
    let SessionFit { problem, fit, result } = &mut found;
    arguments.readings.write(problem, fit)?;
    if !arguments.options.allow_implausible {
        plausibility::accepted(&result.plausibility)?;
    }
    if let Some(draws) = &draws {
        propagation::add_monte_carlo(problem, fit, draws, result)?;
    }
    arguments.forms.add(problem, fit, result)?;
    let commands = arguments.session.commands::<SessionFit>(common.seed, &arguments.options)?;
    common.output.put_found(&outputs, &found, &commands, &read)?;
    if let (Some(wanted), Some(certificate)) = (&wanted, &certificate) {
        wanted.write(certificate, &found.problem, &found.result)?;
    }
    arguments.save.run(&found.problem, &found.fit, &sources, common.seed)
}
