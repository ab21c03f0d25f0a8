//! Reference value and derivatives of a form, from the chain over dual numbers.

use abbe_model::Diagnostic;
use abbe_model::chain::MachineState;
use num_dual::{Derivative, Dual64, DualNum, DualSVec64, HyperDual64};

use crate::check::points::CheckPoint;
use crate::equation::Equation;
use crate::form::Order;
use crate::run::Run;
use crate::subject::Source;
use crate::variable::Variable;

/// Number of parameters seeded per dual-number evaluation.
const PACK: usize = 8;
type Pack = DualSVec64<PACK>;

/// The outputs, and the derivatives of each output by every parameter.
pub(crate) type ValueAndGradient = (Vec<f64>, Vec<Vec<f64>>);

/// The reading, and the coordinate groups from which it is computed.
fn run<S>(
    equation: &Equation,
    source: &impl Source,
    point: &CheckPoint,
    small: impl Fn(usize) -> S,
) -> Result<(Vec<S>, Vec<S>), Diagnostic>
where
    S: DualNum<Primitive = f64> + Copy,
{
    let nominal = |variable: Variable| point.nominal(&variable);
    let run = Run::<S>::new(&equation.machine, source, &equation.parameters, &nominal, &small)?;
    let groups = match (run.subject.bar(), run.probe_geometry()) {
        (Some(bar), _) => {
            let unknown = |slot: usize| run.unknown(slot);
            let at = MachineState { machine: &equation.machine, state: &run.state, errors: &run.errors };
            let (p, q) = bar.balls(at, &unknown);
            p.minus(q).0.to_vec()
        }
        (None, Some(geometry)) => [geometry.stylus.0, geometry.step.0].concat(),
        (None, None) => run.read(),
    };
    Ok((run.read(), groups))
}

/// The reference outputs of a program.
pub(crate) fn expected(
    equation: &Equation,
    source: &impl Source,
    point: &CheckPoint,
) -> Result<ValueAndGradient, Diagnostic> {
    match equation.options.order {
        Order::Exact => by_duals(equation, source, point, &point.small),
        Order::First => {
            let zero = vec![0.0; equation.parameters.len()];
            let (mut values, gradient) = by_duals(equation, source, point, &zero)?;
            for (value, row) in values.iter_mut().zip(&gradient) {
                let linear = row.iter().zip(&point.small).map(|(slope, e)| slope * e);
                *value += linear.sum::<f64>();
            }
            Ok((values, gradient))
        }
        Order::Bilinear => expected_bilinear(equation, source, point),
    }
}

/// The reading and its derivatives at the given parameter values.
fn by_duals(
    equation: &Equation,
    source: &impl Source,
    point: &CheckPoint,
    at: &[f64],
) -> Result<ValueAndGradient, Diagnostic> {
    let values = run(equation, source, point, |i| at[i])?.0;
    let mut gradient = vec![vec![0.0; at.len()]; values.len()];
    for start in (0..at.len()).step_by(PACK) {
        let seeded = |i: usize| {
            let mut seed = nalgebra::SVector::<f64, PACK>::zeros();
            if (start..start + PACK).contains(&i) {
                seed[i - start] = 1.0;
            }
            Pack::new(at[i], Derivative::some(seed))
        };
        let read = run(equation, source, point, seeded)?.0;
        for (row, value) in gradient.iter_mut().zip(read) {
            let slopes = value.eps.unwrap_generic(nalgebra::Const::<PACK>, nalgebra::Const::<1>);
            let end = at.len().min(start + PACK);
            for k in start..end {
                row[k] = slopes[k - start];
            }
        }
    }
    Ok((values, gradient))
}

/// The second-order Taylor series of the coordinate groups and its derivatives, from hyper-dual numbers.
fn expected_bilinear(
    equation: &Equation,
    source: &impl Source,
    point: &CheckPoint,
) -> Result<ValueAndGradient, Diagnostic> {
    let count = equation.parameters.len();
    let mut base = Vec::new();
    let mut slopes: Vec<Vec<f64>> = Vec::new();
    let mut curves: Vec<(usize, usize, Vec<f64>)> = Vec::new();
    for k in 0..count {
        for l in k..count {
            let seed = |i: usize| {
                let part = |j: usize| if i == j { 1.0 } else { 0.0 };
                HyperDual64::new(0.0, part(k), part(l), 0.0)
            };
            let groups = run(equation, source, point, seed)?.1;
            if l == k {
                slopes.push(groups.iter().map(|group| group.eps1).collect());
            }
            base = groups.iter().map(|group| group.re).collect();
            let half = if k == l { 0.5 } else { 1.0 };
            curves.push((k, l, groups.iter().map(|group| half * group.eps1eps2).collect()));
        }
    }
    if count == 0 {
        base = run(equation, source, point, |_| 0.0)?.1;
    }
    let mut values = Vec::new();
    let mut gradient: Vec<Vec<f64>> = Vec::new();
    for direction in 0..count.max(1) {
        let e = |i: usize| Dual64::new(point.small[i], if i == direction { 1.0 } else { 0.0 });
        let group = |j: usize| {
            let linear = (0..count).fold(Dual64::from(base[j]), |sum, i| sum + e(i) * slopes[i][j]);
            let curve = |sum, (k, l, by): &(usize, usize, Vec<f64>)| sum + e(*k) * e(*l) * by[j];
            curves.iter().fold(linear, curve)
        };
        let groups: Vec<Dual64> = (0..base.len()).map(group).collect();
        let read = reading_of_groups(equation, source, point, &groups, &e)?;
        values = read.iter().map(|value| value.re).collect();
        gradient.resize(read.len(), vec![0.0; count]);
        for (row, value) in gradient.iter_mut().zip(read) {
            if direction < count {
                row[direction] = value.eps;
            }
        }
    }
    Ok((values, gradient))
}

/// Computes the reading from its coordinate groups: the groups themselves, the length with the parameters of the bar,
/// or the distance of a probe.
fn reading_of_groups(
    equation: &Equation,
    source: &impl Source,
    point: &CheckPoint,
    groups: &[Dual64],
    small: &impl Fn(usize) -> Dual64,
) -> Result<Vec<Dual64>, Diagnostic> {
    let nominal = |variable: Variable| point.nominal(&variable);
    let run = Run::<Dual64>::new(&equation.machine, source, &equation.parameters, &nominal, small)?;
    let reading = run.reading_of_groups(groups);
    Ok(reading.map_or_else(|| groups.to_vec(), |reading| vec![reading]))
}
