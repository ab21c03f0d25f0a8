//! The three statements of a plan.

use abbe_identify::problem::Problem;
use abbe_identify::results::{NextStep, Statements};
use abbe_identify::statements::has_candidates;
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;
use abbe_model::session::Session;
use schemars::JsonSchema;
use serde::Serialize;

use crate::design::Goal;
use crate::improve::{ImproveOptions, improve};
use crate::results::{Contribution, ErrorAnalysis, PlanAnalysis};
use crate::states;
use crate::variations::TestVariations;

/// Whether a plan is good.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct PlanStatement {
    /// Number of errors that the plan is to identify.
    pub errors: usize,
    /// The errors that it does not identify.
    pub not_identifiable: Vec<String>,
    /// The errors that set-up priors alone determine.
    pub determined_by_prior: Vec<String>,
    /// The error with the largest predicted standard uncertainty; 1 µm counts as 1″.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst: Option<String>,
}

/// Share of a variance from which a contribution of the set-up limits an error.
const MIN_LIMITING_SHARE: f64 = 0.1;
/// Contributions that limit an error, at most.
const MAX_LIMITING: usize = 2;

/// The step after a session is fitted with the effects and the noise of `problem`, or [`NextStep::NoneHelps`] if it asks for
/// a test that identifies and no candidate test does.
pub fn attainable(problem: &Problem, step: NextStep) -> NextStep {
    attainable_of(step, || {
        // Priors determine the coefficients of families, so that no test identifies more of them.
        let effects = problem.parameters.effects.iter().filter(|effect| effect.family().is_none());
        let session = Session { effects: effects.map(Effect::alone).collect(), ..Session::clone(&problem.session) };
        states::problem_by_test(&states::complete(&session, false)?, problem.noise.clone())
    })
}

fn attainable_of(step: NextStep, problem: impl FnOnce() -> Result<Problem, Diagnostic>) -> NextStep {
    let options = ImproveOptions { goal: Goal::WorstUncertainty, tests: 1, by_minute: false };
    let helps = || Ok::<_, Diagnostic>(!improve(&problem()?, &TestVariations::default(), &options)?.steps.is_empty());
    // A search that fails proposes nothing either.
    if step == NextStep::Identify && !helps().unwrap_or(false) { NextStep::NoneHelps } else { step }
}

impl PlanAnalysis {
    /// The three statements of the plan of a problem.
    pub fn statements(&self, problem: &Problem) -> Statements<PlanStatement, Contribution> {
        let worst = self.worst();
        let step = match self.errors.iter().all(|error| error.u.is_some()) {
            _ if !has_candidates(problem) => NextStep::Nothing,
            true => NextStep::Improve,
            false => NextStep::Identify,
        };
        let ids = self.errors.iter().filter(|error| error.u.is_none()).map(|error| error.id.clone());
        Statements {
            good: PlanStatement {
                errors: self.errors.len(),
                not_identifiable: ids.collect(),
                determined_by_prior: self.determined_by_prior.iter().map(|item| item.error.clone()).collect(),
                worst: worst.map(|error| error.id.clone()),
            },
            correct: worst.map_or(Vec::new(), limiting),
            changed: Vec::new(),
            further: Vec::new(),
            measure: attainable_of(step, || Ok(problem.clone())).into(),
        }
    }
}

/// The contributions of the set-up that limit an error: none if the noise has half of the variance.
fn limiting(error: &ErrorAnalysis) -> Vec<Contribution> {
    if error.noise_share() >= 0.5 {
        return Vec::new();
    }
    let setup = error.budget.iter().filter(|part| !part.is_noise()).enumerate();
    let named = setup.take_while(|(k, part)| *k == 0 || (*k < MAX_LIMITING && part.share >= MIN_LIMITING_SHARE));
    named.map(|(_, part)| part.clone()).collect()
}
