//! How a search for effects treats a session that its readings contradict.

use abbe_identify::fit::{Fit, fit};
use abbe_identify::plausibility::{ConflictKind, Plausibility, Pulls};
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::session::Prior;

/// Maximum number of rounds: a conflict may appear only after another is removed.
const MAX_ROUNDS: usize = 5;

/// A changed statement that lowers the residual by this factor is the explanation.
const STATEMENT_EXPLAINS: f64 = 5.0;

/// Whether readings and session disagree so much that a search for effects is meaningless.
pub fn is_another_session(plausibility: &Plausibility) -> bool {
    plausibility.conflicts.iter().any(|conflict| match conflict.kind {
        ConflictKind::Residual | ConflictKind::Orientations => true,
        ConflictKind::ExplainedVariance => conflict.value < conflict.stated,
        ConflictKind::Statement => conflict.value > STATEMENT_EXPLAINS * conflict.stated,
        ConflictKind::SetupParameter
        | ConflictKind::Setups
        | ConflictKind::Unit
        | ConflictKind::LocationError
        | ConflictKind::ZeroAngle => false,
    })
}

/// Whether any set-up parameter has a stated uncertainty.
fn has_priors(problem: &Problem) -> bool {
    let list = &problem.parameters.list;
    list.iter().any(|parameter| matches!(parameter.prior, Prior::Gaussian(_)))
}

/// Replaces the priors of the set-up parameters whose statements the readings contradict by wide ones, so that no
/// effect is accepted instead of a wrong statement. Returns the identifiers of these parameters and the fit; `None`
/// where nothing is contradicted.
///
/// # Errors
/// If the freed problem cannot be fitted.
pub fn with_set_ups_freed(problem: &mut Problem, before: &Fit) -> Result<Option<(Vec<String>, Fit)>, Diagnostic> {
    if !has_priors(problem) {
        return Ok(None);
    }
    let mut freed: Vec<String> = Vec::new();
    let mut found = before.clone();
    for _ in 0..MAX_ROUNDS {
        let pulls = Pulls::of(problem, &found);
        let contradicted: Vec<usize> = pulls.contradicted().iter().map(|pull| pull.parameter).collect();
        if contradicted.is_empty() {
            break;
        }
        for j in contradicted {
            let parameter = &mut problem.parameters.list[j];
            parameter.prior = Prior::Gaussian(parameter.size);
            freed.push(parameter.id.to_string());
        }
        found = fit(problem, Some(&found.beta))?;
    }
    Ok((!freed.is_empty()).then_some((freed, found)))
}
