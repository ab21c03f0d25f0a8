//! The three statements of a result: is it good, what to correct, what to measure next.
//!
//! The line of a rotary axis `k` in R with all axes at zero follows from the location errors of the axis and of the
//! rotary axes `p` between it and the bed on its side. To first order, with their translations `t`, rotations `ω` and
//! origins `o`,
//!
//! ```text
//! point:  o_k + Σ_p t_p + ω_p × (o_k − o_p)        direction:  d_k + Σ_p ω_p × d_k        p: k itself included
//! ```
//!
//! A linear axis has its own squareness errors in place of `ω_k`. The components across the axis are reported; a shift
//! of a line along itself is none.

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName, Freedom};

use crate::parameters::Role;
use crate::plausibility::Plausibility;
use crate::problem::Problem;
use crate::results::{
    AxisCorrection, Covariance, DeterminedBy, FitResult, GoodStatement, Goodness, GoodnessVerdict, LineQuantity,
    MeasureStatement, NextStep, ParameterResult, Statements, TraceResult, ValidationStatement,
};
use crate::tolerance::Conformity;
use crate::tolerance::rule::Decision;
use crate::unit::ARCSEC;
use crate::validate::results::{MovedParameter, ValidationResult, ValidationVerdict};

/// A component of a unit vector above which it is taken as along the axis.
const ALONG: f64 = 0.9;
/// Millimetres in a metre, micrometres in a millimetre.
const THOUSAND: f64 = 1e3;

impl Statements {
    /// Of a fit.
    pub fn of_fit(problem: &Problem, result: &FitResult) -> Statements {
        let goodness = result.outcome.goodness;
        let measure = match base_step(&result.plausibility, goodness.verdict) {
            Some(step) => step,
            None if !has_candidates(problem) => NextStep::Nothing,
            None if result.unobservable.is_empty() => NextStep::Improve,
            None => NextStep::Identify,
        };
        Statements {
            good: good(goodness, result.conformity.as_ref()),
            correct: corrections(&problem.session.machine, &result.parameters, &result.covariance),
            measure: measure.into(),
        }
    }

    /// Of a trace; `problem` is the model with the found effects.
    pub fn of_trace(problem: &Problem, result: &TraceResult) -> Statements {
        let goodness = result.outcome.goodness;
        let separating = result.effects.iter().find_map(|effect| Some((effect, effect.separating_tests.first()?)));
        let measure = match (separating, &result.plausibility.conflicts[..]) {
            (Some((effect, test)), []) => MeasureStatement {
                step: NextStep::SeparatingTest,
                test: (!test.name.is_empty()).then(|| test.name.clone()),
                description: Some(test.test.clone()),
                effect: Some(effect.name.meaning.clone()),
            },
            _ => {
                let step = match base_step(&result.plausibility, goodness.verdict) {
                    // The search has been made.
                    Some(NextStep::Trace) | None if !has_candidates(problem) => NextStep::Nothing,
                    Some(NextStep::Trace) | None if result.unobservable.is_empty() => NextStep::Improve,
                    Some(NextStep::Trace) | None => NextStep::Identify,
                    Some(step) => step,
                };
                step.into()
            }
        };
        Statements {
            good: GoodStatement { verdict: Some(result.verdict), ..good(goodness, result.conformity.as_ref()) },
            correct: corrections(&problem.session.machine, &result.after.parameters, &result.after.covariance),
            measure,
        }
    }
}

impl Statements<ValidationStatement, MovedParameter> {
    /// Of a validation.
    pub fn of_validation(result: &ValidationResult) -> Self {
        let step = match result.verdict {
            ValidationVerdict::Holds => NextStep::Nothing,
            ValidationVerdict::HoldsInRange => NextStep::WidenRange,
            ValidationVerdict::Degraded | ValidationVerdict::DoesNotHold => NextStep::Refit,
        };
        let ValidationResult { verdict, readings, readings_in_range, .. } = *result;
        Statements {
            good: ValidationStatement { verdict, readings, readings_in_range },
            correct: result.moved.clone(),
            measure: step.into(),
        }
    }
}

/// Whether candidate tests exist for a problem: it has errors to identify, the instrument is a ball bar, and a rotary
/// axis can be swept.
pub fn has_candidates(problem: &Problem) -> bool {
    let session = &problem.session;
    let has_errors = problem.parameters.list.iter().any(|parameter| parameter.role == Role::Error);
    let last = session.tests.last().map(|test| &test.station);
    has_errors
        && last.is_some_and(|station| station.bar().is_some())
        && session.machine.axes.iter().any(|axis| axis.kind == AxisKind::Rotary)
}

/// The step that has to come before any further test.
fn base_step(plausibility: &Plausibility, goodness: GoodnessVerdict) -> Option<NextStep> {
    match goodness {
        _ if !plausibility.conflicts.is_empty() => Some(NextStep::CorrectSession),
        GoodnessVerdict::NotJudged => Some(NextStep::StateNoise),
        verdict if verdict.lacks_an_effect() => Some(NextStep::Trace),
        _ => None,
    }
}

fn good(goodness: Goodness, conformity: Option<&Conformity>) -> GoodStatement {
    let of = |decision: Decision| -> Vec<String> {
        let items = conformity.iter().flat_map(|conformity| &conformity.items);
        items.filter(|item| item.decision == decision).map(|item| item.id.clone()).collect()
    };
    GoodStatement {
        verdict: None,
        goodness,
        decision: conformity.map(|conformity| conformity.verdict),
        failed: of(Decision::Fail),
        undecided: of(Decision::Undecided),
    }
}

/// A linear function of the location errors: coefficients of translations (mm per mm) and rotations (per rad).
type Terms = Vec<(ErrorName, f64)>;

/// The axis lines with identified location errors.
fn corrections(machine: &Machine, parameters: &[ParameterResult], covariance: &Covariance) -> Vec<AxisCorrection> {
    let mut found = Vec::new();
    for index in 0..machine.axes.len() {
        let axis = &machine.axes[index];
        let mut quantities = vec![LineQuantity::Direction];
        if axis.kind == AxisKind::Rotary {
            quantities.insert(0, LineQuantity::Point);
        }
        for quantity in quantities {
            for (i, coordinate) in ['X', 'Y', 'Z'].into_iter().enumerate() {
                if axis.direction[i].abs() > ALONG {
                    continue;
                }
                let terms = terms(machine, index, quantity, i);
                let nominal = match quantity {
                    LineQuantity::Point => axis.origin_mm[i],
                    LineQuantity::Direction => axis.direction[i],
                };
                found.extend(correction(&axis.name, quantity, coordinate, nominal, &terms, parameters, covariance));
            }
        }
    }
    found
}

/// The location errors that change a component of an axis line.
fn terms(machine: &Machine, index: usize, quantity: LineQuantity, i: usize) -> Terms {
    let axis = &machine.axes[index];
    let on_tool_side = index >= machine.workpiece_side;
    // From the bed to the axis, on its side.
    let before: Vec<usize> = match on_tool_side {
        true => (machine.workpiece_side..index).collect(),
        false => (index + 1..machine.workpiece_side).collect(),
    };
    let rotary = |k: &usize| machine.axes[*k].kind == AxisKind::Rotary;
    let carriers = before.into_iter().filter(rotary).chain([index]);
    let mut terms = Terms::new();
    for k in carriers {
        let name = |freedom: usize| ErrorName {
            kind: ErrorKind::Location,
            freedom: Freedom::ALL[freedom],
            axis: machine.axes[k].name.clone(),
        };
        let lever: [f64; 3] = match quantity {
            LineQuantity::Point => std::array::from_fn(|c| axis.origin_mm[c] - machine.axes[k].origin_mm[c]),
            LineQuantity::Direction => axis.direction,
        };
        if quantity == LineQuantity::Point {
            terms.push((name(i), 1.0));
        }
        // (ω × v)_i = ω_j v_k − ω_k v_j
        let (j, l) = ((i + 1) % 3, (i + 2) % 3);
        terms.extend([(name(3 + j), lever[l]), (name(3 + l), -lever[j])].into_iter().filter(|(_, by)| *by != 0.0));
    }
    terms
}

/// The change of one component; `None` if no error of it is identified.
fn correction(
    axis: &str,
    quantity: LineQuantity,
    coordinate: char,
    nominal: f64,
    terms: &[(ErrorName, f64)],
    parameters: &[ParameterResult],
    covariance: &Covariance,
) -> Option<AxisCorrection> {
    // Index and change of the component in mm or 1 per unit of the parameter.
    let own: Vec<(usize, f64)> = (terms.iter())
        .filter_map(|(name, by)| {
            let id = name.to_string();
            let place = parameters.iter().position(|parameter| parameter.id == id)?;
            let internal = if name.freedom.is_angle() { by / ARCSEC } else { by / THOUSAND };
            Some((place, internal))
        })
        .collect();
    // An error of the axis itself has to be identified.
    let is_own = |place: usize| parameters[place].id.ends_with(&format!("0{axis}"));
    if !own.iter().any(|(place, _)| is_own(*place)) {
        return None;
    }
    let shown = match quantity {
        LineQuantity::Point => THOUSAND,
        LineQuantity::Direction => THOUSAND * THOUSAND,
    };
    let change: f64 = own.iter().map(|(place, by)| by * parameters[*place].value).sum();
    let of = |a: usize, b: usize| covariance.matrix.get(a).and_then(|row| row.get(b)).copied().unwrap_or(0.0);
    let variance: f64 = own.iter().map(|(a, x)| own.iter().map(|(b, y)| x * y * of(*a, *b)).sum::<f64>()).sum();
    let by_prior = own.iter().any(|(place, _)| parameters[*place].determined_by == DeterminedBy::Prior);
    Some(AxisCorrection {
        axis: axis.to_string(),
        quantity,
        coordinate,
        nominal,
        identified: nominal + change,
        change: change * shown,
        u: variance.max(0.0).sqrt() * shown,
        unit: if quantity == LineQuantity::Point { "um" } else { "um/m" }.to_string(),
        determined_by: if by_prior { DeterminedBy::Prior } else { DeterminedBy::Readings },
        quotable: own.iter().all(|(place, _)| parameters[*place].quotable),
    })
}
