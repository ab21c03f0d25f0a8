//! Truncation error of first-order, bilinear and small-angle forms against the exact chain.

use abbe_model::Diagnostic;
use abbe_model::frames::Rotation;

use crate::check::points::{CheckPoint, PseudoRandom, worst};
use crate::equation::Equation;
use crate::form::Order;
use crate::program::Program;
use crate::run::Run;
use crate::subject::Source;
use crate::variable::Variable;

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
