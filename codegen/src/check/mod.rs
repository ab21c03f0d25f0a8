//! Check of an equation against the chain over dual numbers. Only a checked equation can be printed.

mod absent;
mod agreement;
mod deviation;
mod points;
mod reference;

pub use agreement::Agreement;
pub use deviation::Deviation;

use abbe_model::Diagnostic;

use crate::equation::Equation;
use crate::subject::Source;
use crate::variable::Variable;

/// An equation that agrees with the chain, and what the check found. [`check()`] alone makes one.
#[derive(Debug)]
#[non_exhaustive]
pub struct Checked<'e> {
    /// The equation.
    pub equation: &'e Equation,
    /// Agreement of its programs with the chain.
    pub agreement: Agreement,
    /// Errors and instrument parameters that the form does not contain.
    pub absent: Vec<Variable>,
    /// Ranges of the lengths and of the positions of moving axes in the session, mm or rad.
    pub range: Vec<(Variable, [f64; 2])>,
    /// Deviations of a truncated or small-angle form from the exact chain over that range.
    pub deviations: Vec<Deviation>,
}

/// Compares the programs of an equation, value and derivatives, with the chain over dual numbers; `source` is that of
/// the equation.
///
/// # Errors
/// If they disagree, if an effect has no value at a point, or if a normal form is needed and does not exist.
pub fn check<'e>(equation: &'e Equation, source: &impl Source) -> Result<Checked<'e>, Diagnostic> {
    let value = equation.program(false);
    let agreement = agreement::agreement(equation, source, &[&value, &equation.program(true)])?;
    let absent = absent::absent_parameters(equation, &agreement)?;
    let range = points::range(equation, source);
    let deviations = deviation::deviations(equation, source, &range, &value)?;
    Ok(Checked { equation, agreement, absent, range, deviations })
}
