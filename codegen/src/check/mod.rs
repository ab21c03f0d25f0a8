//! Check of an equation against the chain over dual numbers. Only a checked equation can be printed.

mod points;
mod reference;

use abbe_model::Diagnostic;
use abbe_model::frames::Rotation;

use crate::check::points::{CheckPoint, PseudoRandom, draw_anywhere, worst};
use crate::check::reference::expected;
use crate::equation::Equation;
use crate::form::{Kind, Order};
use crate::normal_form::Ring;
use crate::program::Program;
use crate::run::Run;
use crate::subject::Source;
use crate::symbol::VariableId;
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
    let agreement = agreement(equation, source, &[&value, &equation.program(true)])?;
    let absent = absent_parameters(equation, &agreement)?;
    let range = points::range(equation, source);
    let deviations = deviations(equation, source, &range, &value)?;
    Ok(Checked { equation, agreement, absent, range, deviations })
}

/// The parameters that the outputs do not contain. A derivative that is not zero at some point proves that its
/// parameter is contained; otherwise the normal form decides.
pub(crate) fn absent_parameters(equation: &Equation, agreement: &Agreement) -> Result<Vec<Variable>, Diagnostic> {
    let rounding = 1e-9;
    let derivatives = equation.parameters.iter().zip(&agreement.largest_derivatives);
    let unseen = derivatives.filter(|(_, largest)| **largest < rounding);
    let unseen: Vec<Variable> = unseen.map(|(parameter, _)| parameter.clone()).collect();
    let below: Vec<VariableId> = equation.arena.variables_of(&equation.outputs);
    let in_graph = |parameter: &Variable| below.iter().any(|id| equation.arena.variable_at(*id) == *parameter);
    let (doubtful, mut absent): (Vec<Variable>, Vec<Variable>) = unseen.into_iter().partition(in_graph);
    if !doubtful.is_empty() {
        let requested = match (equation.kind, equation.vectors.as_slice()) {
            (Kind::Length, [.., bar]) => bar.components.to_vec(),
            (Kind::Distance, [.., stylus, step]) => {
                let radius = equation.touch.iter().map(|touch| touch.radius);
                let vectors = stylus.components.into_iter().chain(step.components);
                vectors.chain(radius).collect()
            }
            _ => equation.outputs.clone(),
        };
        let mut ring = Ring::exact(&equation.arena);
        ring.keep(&equation.whole);
        let forms = requested.iter().map(|w| ring.normal_form(*w)).collect::<Result<Vec<_>, _>>()?;
        let forms = ring.without_residue(&forms);
        absent.extend(ring.absent(&forms, &doubtful).into_iter().cloned());
    }
    Ok(absent)
}

/// Deviation of a form from the chain with exact rotations, at errors of a stated size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Size of every translation error, µm.
    pub shift_um: f64,
    /// Size of every angular error, degrees.
    pub tilt_deg: f64,
    /// Largest deviation found over signs and positions, µm.
    pub largest_um: f64,
}

/// Computes the deviations of a form from the chain with exact rotations. Errors are 10 µm and 0.01°, then ten times
/// those. All sign combinations are evaluated (256 random ones for more than eight errors) at 60 positions within the
/// range; one coordinate in four is at an end of its range. The result is empty for an exact form.
pub(crate) fn deviations(
    equation: &Equation,
    source: &impl Source,
    range: &[(Variable, [f64; 2])],
    program: &Program,
) -> Result<Vec<Deviation>, Diagnostic> {
    if equation.options.order == Order::Exact && equation.machine.rotation == Rotation::Exact {
        return Ok(Vec::new());
    }
    let mut exact = equation.machine.clone();
    exact.rotation = Rotation::Exact;
    let count = equation.parameters.len();
    // The contribution of an effect reaches the stated size where it is largest.
    let mut reach = vec![f64::MIN_POSITIVE; count];
    let mut draws = PseudoRandom::new(6);
    for _ in 0..60 {
        let point = drawn_between(range, count, &mut draws);
        let at = |variable: Variable| point.nominal(&variable);
        let run = Run::<f64>::new(&exact, source, &equation.parameters, &at, &|_| 0.0)?;
        for (index, reach) in reach.iter_mut().enumerate() {
            *reach = run.bases(index).fold(*reach, |most, basis| most.max(basis.abs()));
        }
    }
    for reach in &mut reach {
        if *reach < 1e-6 {
            *reach = 1.0;
        }
    }
    let mut deviations = Vec::new();
    for (shift_um, tilt_deg) in [(10.0, 0.01), (100.0, 0.1_f64)] {
        let mut draws = PseudoRandom::new(5);
        let mut largest = 0.0_f64;
        for _ in 0..60 {
            let point = drawn_between(range, count, &mut draws);
            let at = |variable: Variable| point.nominal(&variable);
            let mut run = Run::<f64>::new(&exact, source, &equation.parameters, &at, &|_| 0.0)?;
            // The parameters are the last inputs, in their order.
            let mut inputs = point.inputs(program, &equation.parameters);
            let first = inputs.len() - count;
            for pattern in 0..(1u64 << count.min(8)) {
                let pattern = if count <= 8 { pattern } else { draws.bits() };
                for (index, parameter) in equation.parameters.iter().enumerate() {
                    let sign = if pattern >> (index % 64) & 1 == 0 { 1.0 } else { -1.0 };
                    let size = if parameter.is_angle() { tilt_deg.to_radians() } else { shift_um * 1e-3 };
                    inputs[first + index] = sign * size / reach[index];
                }
                run.seed(&|index| inputs[first + index]);
                let found = program.run(&inputs);
                // Skip points at which the probe misses the artefact.
                let expected = run.read();
                for (found, expected) in found.iter().zip(expected).filter(|(_, e)| e.is_finite()) {
                    largest = largest.max(worst(*found, expected) * 1e3);
                }
            }
        }
        deviations.push(Deviation { shift_um, tilt_deg, largest_um: largest });
    }
    Ok(deviations)
}

/// A random point without errors within the range; one coordinate in four is at an end of its range.
fn drawn_between(range: &[(Variable, [f64; 2])], count: usize, draws: &mut PseudoRandom) -> CheckPoint {
    let nominal = range.iter().map(|(variable, [low, high])| {
        let along = draws.between(-1.0 / 6.0, 7.0 / 6.0).clamp(0.0, 1.0);
        (variable.clone(), low + (high - low) * along)
    });
    CheckPoint { nominal: nominal.collect(), small: vec![0.0; count] }
}

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
