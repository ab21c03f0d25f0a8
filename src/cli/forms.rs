//! Other forms of the estimates of a fit: base parameters, terms of a pointing model.

use abbe::identify::fit::{Fit, FitResult, base, tpoint};
use abbe::identify::problem::Problem;
use abbe::model::Diagnostic;
use clap::{Args, ValueEnum};

/// The forms that are printed besides the parameters.
#[derive(Args)]
pub struct FormArguments {
    /// Print the base parameters: a minimal set of numbers with u that predicts the same readings, and the parameters
    /// that are held at nominal because the readings do not separate them.
    #[arg(long)]
    pub base: bool,
    /// Print the terms of a pointing model that the fit is equivalent to: IA, IE, AN, AW, CA, NPAE, TF, TX, harmonics.
    ///
    /// Example: --terms tpoint
    #[arg(long, value_enum, value_name = "MODEL")]
    pub terms: Option<Terms>,
}

/// The pointing model whose terms are printed.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Terms {
    /// Those of TPOINT.
    #[value(name = "tpoint")]
    TPoint,
}

impl FormArguments {
    /// Adds the forms that are asked for to a result.
    ///
    /// # Errors
    /// If the readings have no such form, or the model cannot be evaluated.
    pub fn add(&self, problem: &Problem, fit: &Fit, result: &mut FitResult) -> Result<(), Diagnostic> {
        if self.base {
            result.base = Some(base::report(problem, fit)?);
        }
        if let Some(Terms::TPoint) = self.terms {
            result.tpoint = Some(tpoint::report(problem, fit)?);
        }
        Ok(())
    }
}
