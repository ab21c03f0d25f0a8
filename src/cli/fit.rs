//! `abbe fit`: estimate errors from readings.

use abbe::document::StatedFit;
use abbe::identify::{fit, propagation};
use abbe::trace::SessionFit;
use clap::Args;

use super::failure::Failure;
use super::forms::FormArguments;
use super::method::{self, Method};
use super::results::Read;
use super::save::SaveArguments;
use super::{CommonArguments, SessionArguments, certificate, monte_carlo, read_session, readings};
use crate::report;

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
    plausibility: super::PlausibilityArguments,
    #[command(flatten)]
    save: SaveArguments,
    #[command(flatten)]
    forms: FormArguments,
    /// Explanation that is accepted on the user's word: a declared effect, or one of its aliases, which then takes its
    /// place. Uncertainties do not cover the others; every output says so. May be repeated.
    ///
    /// Example: --assume EZC~C:h2
    #[arg(long, value_name = "EFFECT", allow_hyphen_values = true)]
    assume: Vec<String>,
    /// Method of identification.
    ///
    /// Example: --method two-plane
    #[arg(long, value_enum, default_value = "full")]
    method: Method,
    #[command(flatten)]
    readings: readings::ReadingArguments,
    #[command(flatten)]
    certificate: certificate::CertificateArguments,
    #[command(flatten)]
    draws: monte_carlo::DrawArguments,
}

/// Runs `abbe fit`.
pub fn run(arguments: &FitArguments) -> Result<(), Failure> {
    let common = &arguments.common;
    let [views, residuals] = arguments.readings.files();
    let others = [views, residuals, arguments.save.file(), arguments.certificate.file()];
    let outputs = common.output.prepared(&others)?;
    let wanted = arguments.certificate.read(&arguments.session.session, &outputs)?;
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    let session = fit::assume(&session, &arguments.assume)?;
    let certificate = wanted.as_ref().map(|wanted| wanted.of(&session)).transpose()?;
    let mut read = Read::session(&session, &sources, common.seed);
    read.files.extend(wanted.as_ref().and_then(|wanted| wanted.stamp.as_ref()));
    if arguments.method != Method::Full {
        method::refuse([
            ("--views", views.is_some()),
            ("--residuals", residuals.is_some()),
            ("--base", arguments.forms.base),
            ("--terms", arguments.forms.terms.is_some()),
            ("--save", arguments.save.file().is_some()),
            ("--dcc", arguments.certificate.file().is_some()),
            ("--allow-implausible", arguments.plausibility.allow_implausible),
        ])?;
        return arguments.method.run(&session, &arguments.draws, (common, &outputs), &read);
    }
    let draws = arguments.draws.draws(common.seed)?;
    let SessionFit { problem, fit: found, mut result } = SessionFit::of(&session, common.seed)?;
    arguments.readings.write(&problem, &found)?;
    arguments.plausibility.check(&result.plausibility)?;
    if let Some(draws) = &draws {
        propagation::add_monte_carlo(&problem, &found, draws, &mut result)?;
    }
    arguments.forms.add(&problem, &found, &mut result)?;
    let repeated: Vec<_> =
        common.repeated(&arguments.assume).into_iter().chain(arguments.plausibility.repeated()).collect();
    let commands = arguments.session.commands("fit", &repeated);
    let stated = StatedFit::of_fit(&problem, &result);
    let report = report::fit::report(&problem, &found, &stated, &commands, common.output.figures())?;
    common.output.put(&outputs, &report, &stated, &read)?;
    if let (Some(wanted), Some(certificate)) = (&wanted, &certificate) {
        wanted.write(certificate, &problem, &result)?;
    }
    arguments.save.run(&problem, &found, &sources, common.seed)
}
