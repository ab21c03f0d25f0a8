//! Agreement of the programs of an equation with the chain over dual numbers, at points with large errors.

use abbe_model::Diagnostic;

use crate::check::points::{CheckPoint, PseudoRandom, draw_anywhere, worst};
use crate::check::reference::expected;
use crate::equation::Equation;
use crate::program::Program;
use crate::subject::Source;
use crate::variable::Variable;

/// Number of points at which every program is checked.
const POINTS: usize = 40;
/// Largest relative difference that is accepted.
const TOLERANCE: f64 = 1e-12;
/// Sizes of the errors at the check points, mm and rad. They are far larger than real errors, so that a wrong term of
/// any order is detected.
const SIZES: [f64; 2] = [10.0, 0.1];

/// Agreement of a program with the chain.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Number of points compared, with errors of up to ±10 mm and ±0.1 rad.
    pub points: usize,
    /// Largest difference of a value, relative to the largest value.
    pub value: f64,
    /// Largest difference of a derivative, relative to the largest derivative by the same parameter. Below 1 mm/mm or 1
    /// mm/rad the reference is 1, because the derivatives by an unobservable parameter are rounding errors only.
    pub gradient: f64,
    /// Largest derivative by each parameter over all points, mm/mm and mm/rad.
    pub largest_derivatives: Vec<f64>,
}

impl Agreement {
    /// The larger of the value and gradient differences.
    pub fn largest(&self) -> f64 {
        self.value.max(self.gradient)
    }
}

/// Compares programs, with or without derivatives, with the chain over dual numbers at points with large errors.
///
/// # Errors
/// If they disagree; the program must then not be written.
pub(crate) fn agreement(
    equation: &Equation,
    source: &impl Source,
    programs: &[&Program],
) -> Result<Agreement, Diagnostic> {
    let mut draws = PseudoRandom::new(4);
    let mut agreement = Agreement::default();
    let count = equation.parameters.len();
    let mut value_scale = f64::MIN_POSITIVE;
    let mut scales = vec![0.0_f64; count];
    let mut difference = 0.0_f64;
    let mut differences = vec![0.0_f64; count];
    let mut tries = 0;
    while agreement.points < POINTS && tries < 10 * POINTS {
        tries += 1;
        let nominal = draw_anywhere(equation, source, &mut draws);
        let size = |variable: &Variable| SIZES[usize::from(variable.is_angle())];
        let small = equation.parameters.iter().map(|p| draws.between(-size(p), size(p)));
        let point = CheckPoint { small: small.collect(), nominal };
        let (values, gradient) = expected(equation, source, &point)?;
        // Skip an impossible set-up, such as the root of a negative length.
        if !values.iter().chain(gradient.iter().flatten()).all(|x| x.is_finite()) {
            continue;
        }
        let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        value_scale = value_scale.max(largest);
        for row in &gradient {
            for k in 0..count {
                scales[k] = scales[k].max(row[k].abs());
            }
        }
        for program in programs {
            let found = program.run(&point.inputs(program, &equation.parameters));
            let (found_values, found_slopes) = found.split_at(values.len());
            for (found, expected) in found_values.iter().zip(&values) {
                difference = difference.max(worst(*found, *expected));
            }
            // A program without derivatives has no derivatives to compare.
            for (index, (found, expected)) in found_slopes.iter().zip(gradient.iter().flatten()).enumerate() {
                let k = index % count;
                differences[k] = differences[k].max(worst(*found, *expected));
            }
        }
        agreement.points += 1;
    }
    agreement.value = difference / value_scale;
    let relative = differences.iter().zip(&scales).map(|(d, s)| d / s.max(1.0));
    agreement.gradient = relative.fold(0.0, f64::max);
    if agreement.points == 0 || agreement.largest() > TOLERANCE {
        return Err(Diagnostic::equation(format!(
            "the equation is not written: over {} points it differs from the chain with dual numbers by {:.1e} (value) and \
             {:.1e} (derivatives), relative; the limit is 1e-12",
            agreement.points, agreement.value, agreement.gradient
        )));
    }
    agreement.largest_derivatives = scales;
    Ok(agreement)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_larger_difference_counts() {
        for (value, gradient) in [(3e-9, 2e-12), (1e-12, 3e-9)] {
            assert_eq!(Agreement { value, gradient, ..Agreement::default() }.largest(), 3e-9);
        }
    }
}
