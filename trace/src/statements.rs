//! The three statements of a trace and of a validation.

use abbe_identify::problem::Problem;
use abbe_identify::results::{GoodStatement, MeasureStatement, NextStep, Statements};
use abbe_identify::statements::{base_step, good, has_candidates, in_doubt};

use crate::result::TraceResult;
use crate::validate::{MovedParameter, ValidationResult, ValidationStatement, ValidationVerdict};

/// Of a trace; `problem` is the model with the found effects.
pub fn of_trace(problem: &Problem, result: &TraceResult) -> Statements {
    let model = &result.after;
    let separating = result.effects.iter().find_map(|effect| Some((effect, effect.separating_tests.first()?)));
    let measure = match (separating, &result.plausibility.conflicts[..]) {
        (Some((effect, test)), []) if !result.interrupted => MeasureStatement {
            step: NextStep::SeparatingTest,
            test: (!test.name.is_empty()).then(|| test.name.clone()),
            description: Some(test.test.clone()),
            effect: Some(effect.name.meaning.clone()),
        },
        _ => {
            let step = match base_step(&result.plausibility, model.outcome.goodness) {
                Some(NextStep::Trace) | None if result.interrupted => NextStep::Trace,
                // The search has been made.
                Some(NextStep::Trace) | None if !has_candidates(problem) => NextStep::Nothing,
                Some(NextStep::Trace) | None if model.unobservable.is_empty() => NextStep::Improve,
                Some(NextStep::Trace) | None => NextStep::Identify,
                Some(step) => step,
            };
            let is_unit = step == NextStep::CheckUnit;
            let description = in_doubt(problem, &result.plausibility).filter(|_| is_unit);
            MeasureStatement { description, ..step.into() }
        }
    };
    let good = GoodStatement { verdict: Some(result.verdict), ..good(model, result.conformity.as_ref()) };
    Statements::of_model(problem, model, good, measure)
}

/// Of a validation.
pub fn of_validation(result: &ValidationResult) -> Statements<ValidationStatement, MovedParameter> {
    let step = match result.verdict {
        _ if result.not_judged.is_some() => NextStep::Trace,
        ValidationVerdict::Holds => NextStep::Nothing,
        ValidationVerdict::HoldsInRange => NextStep::WidenRange,
        ValidationVerdict::Degraded | ValidationVerdict::DoesNotHold => NextStep::Refit,
    };
    let ValidationResult { verdict, readings, readings_in_range, .. } = *result;
    Statements {
        good: ValidationStatement { verdict, readings, readings_in_range },
        correct: Vec::new(),
        changed: result.moved.clone(),
        further: Vec::new(),
        measure: step.into(),
    }
}
