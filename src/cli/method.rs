//! `abbe fit --method`: the methods of identification other than the full fit.

use abbe::analysis::FitOptions;
use abbe::apply::geometric;
use abbe::identify::{fit, self_calibration};
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use clap::ValueEnum;

use super::CommonArguments;
use super::failure::command_line;
use super::output::Outputs;
use super::results::Read;
use crate::report;

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
