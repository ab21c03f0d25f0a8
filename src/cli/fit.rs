//! `abbe fit`: estimate errors from readings.

use abbe::analysis::{Analysis, FitOptions, Given};
use abbe::apply::geometric;
use abbe::identify::{fit, plausibility, self_calibration};
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use abbe::trace::SessionFit;
use clap::{Args, ValueEnum};

use super::failure::command_line;
use super::output::Outputs;
use super::results::{Read, ReadingArguments, SaveArguments};
use super::{CommonArguments, Global, SessionArguments, certificate, read_session};
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
        refuse([
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

/// The method of identification.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// All parameters of the session together, by least squares on the kinematic chain.
    Full,
    /// Position errors from the centre of one circle per axis (Jiang 2014, Section 4.2), beside the full fit.
    Circle,
    /// Orientation errors from the cone of the bar with its extension (Jiang 2014, Sections 4.2.1, 5.2), beside the
    /// full fit.
    Cone,
    /// Orientation errors from circles in two planes along each axis (Jiang 2014, Section 6.1.2), beside the full fit.
    TwoPlane,
    /// Rotary axis, linear axes and artefact separately, from a probed cylinder (Zimmermann & Ibaraki 2020).
    SelfCalibration,
}

impl Method {
    /// The geometric method, if it is one.
    fn geometric(self) -> Option<geometric::Method> {
        match self {
            Method::Full | Method::SelfCalibration => None,
            Method::Circle => Some(geometric::Method::Circle),
            Method::Cone => Some(geometric::Method::Cone),
            Method::TwoPlane => Some(geometric::Method::TwoPlane),
        }
    }

    /// Runs a geometric method beside the full fit, or a self-calibration.
    pub fn run(
        self,
        session: &Session,
        options: &FitOptions,
        (common, outputs): (&CommonArguments, &Outputs),
        read: &Read<'_>,
    ) -> Result<(), Diagnostic> {
        if let Some(method) = self.geometric() {
            if options.monte_carlo.is_some() {
                return Err(command_line(
                    "`--monte-carlo` works with the full fit and with `--method self-calibration`: leave out `--method` or `--monte-carlo`",
                ));
            }
            let result = geometric::compare(session, method, common.seed)?;
            let (problem, _) = fit::prepare(session, common.seed)?;
            return common.output.put(outputs, &report::method::report(&problem, &result), &result, read);
        }
        let draws = options.draws(common.seed)?;
        let result = self_calibration::calibrate(session)?.report(session, draws.as_ref());
        common.output.put(outputs, &report::self_calibration::report(session, &result), &result, read)
    }
}

/// Refuses options that take the result of the full fit, each with whether it is given.
pub fn refuse<const N: usize>(options: [(&str, bool); N]) -> Result<(), Diagnostic> {
    match options.into_iter().find(|(_, is_given)| *is_given) {
        None => Ok(()),
        Some((name, _)) => {
            Err(command_line(format!("`{name}` takes the result of the full fit: leave out `--method`")))
        }
    }
}
