//! The further test that tells a found effect from what looks like it: of a menu, the one after which the two differ by the most standard deviations.

use super::Trace;
use super::report::effect_name;
use crate::error::IdentifyError;
use crate::parameters::Role;
use crate::plan::menu::Menu;
use crate::plan::separate::separation;
use crate::results::SeparationResult;

/// Look-alikes that are tried before it is said that no test on the menu tells the effect from any.
const MOST_TRIED: usize = 4;
/// Standard deviations from which on two effects count as told apart.
const TOLD_APART_SIGMA: f64 = 3.0;

/// Fills in, for each found effect, the test on the menu that tells it from the first of its look-alikes that any test tells it from. Without a menu for the
/// session's instrument nothing is filled in.
///
/// # Errors
/// If an effect cannot be laid over the session.
pub fn tell_apart(trace: &mut Trace<'_>, menu: &Menu) -> Result<(), IdentifyError> {
    let first = trace.before.parameters.effects.len();
    for (k, found) in trace.effects.iter().enumerate() {
        let is_own = |role: &Role| matches!(role, Role::Coefficient { effect, .. } if *effect == first + k);
        let coefficients: Vec<f64> = trace
            .after
            .parameters
            .list
            .iter()
            .zip(&trace.after_fit.beta)
            .filter(|(parameter, _)| is_own(&parameter.role))
            .map(|(_, value)| *value)
            .collect();
        for alias in trace.look_alikes[k].iter().take(MOST_TRIED) {
            let beta = &trace.after_fit.beta;
            let test = match separation(&trace.after, beta, found, &coefficients, alias, menu) {
                Ok(Some(test)) => test,
                Ok(None) => continue,
                Err(IdentifyError::Request(_)) => return Ok(()),
                Err(error) => return Err(error),
            };
            if test.after < TOLD_APART_SIGMA {
                continue;
            }
            let effect = &mut trace.result.effects[k];
            effect.separated_by = Some(test.test);
            effect.separation = Some(SeparationResult {
                from: effect_name(alias),
                before_sigma: test.before,
                after_sigma: test.after,
                minutes: test.minutes,
            });
            break;
        }
    }
    Ok(())
}
