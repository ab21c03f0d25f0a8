//! The difference of two models and its covariance, with a common set-up counted once.
//!
//! Each model is a Gaussian over its parameters, with information `Λ = C⁻¹`. If both sessions use the same bar, its
//! deviation `s` is one parameter with one prior:
//!
//! ```text
//! Λ = Λ_A(a, s) + Λ_B(b, s) − 1/(f·u_s)²,    Λ·(a, b, s) = Λ_A·(a, s)_A + Λ_B·(b, s)_B
//! ```
//!
//! A fit whose residual exceeds its noise enlarges all its uncertainties by a factor, those of its priors included. `f`
//! is the larger factor of the two: each model contains at least that prior, so that `Λ` stays positive semidefinite,
//! and the prior that remains is the narrower one.
//!
//! That both used the same object is an assumption, which the readings test. With the variance `C` of a deviation after
//! a fit and its prior `f·u_s`, the readings alone have the information `i = 1/C − 1/(f·u_s)²` and the estimate
//! `l = s/(C·i)`. For one object `(l_B − l_A)²·i_A·i_B/(i_A + i_B)` is a χ² of one degree of freedom.

use abbe_identify::error;
use abbe_model::Diagnostic;
use abbe_model::session::Prior;
use faer::Mat;

use super::results::NotShared;
use abbe_identify::model_file::{IdentifiedModel, ModelParameter};
use abbe_identify::numerics::symmetric::pseudo_inverse;
use abbe_identify::numerics::tails::normal_tail;

/// Least share of a prior variance by which readings have to lower it to contain information about the object.
const LEAST_SHARE: f64 = 1e-3;
/// The word that states that nothing is shared.
const NOTHING: &str = "none";

/// Probability with which objects of one kind, such as bars, are taken for others although they are the same.
const REFUTED: f64 = 0.001;

/// The difference of two models with what they share.
pub(super) struct SharedDifference {
    /// The difference B − A over the common parameters, internal units.
    pub delta: Vec<f64>,
    /// Its covariance.
    pub covariance: Mat<f64>,
    /// Identifiers of the shared set-up.
    pub shared: Vec<String>,
    /// Set-up quantities that would be shared, if the readings did not show that they are not one object.
    pub refuted: Vec<NotShared>,
}

/// The difference B − A over the common parameters. Objects of a kind of which the readings show one to be two are not
/// shared.
///
/// # Errors
/// If a covariance has no inverse, or a stated quantity is not estimated in both.
pub(super) fn difference(
    a: &IdentifiedModel,
    b: &IdentifiedModel,
    common: &[(usize, usize)],
    things: Option<&[String]>,
) -> Result<SharedDifference, Diagnostic> {
    let mut shared = shared(a, b, things)?;
    let refuted = refuted(a, b, &mut shared);
    if shared.is_empty() {
        let delta = common.iter().map(|(i, j)| b.estimate(*j) - a.estimate(*i)).collect();
        let covariance = Mat::from_fn(common.len(), common.len(), |k, l| {
            a.covariance[(common[k].0, common[l].0)] + b.covariance[(common[k].1, common[l].1)]
        });
        return Ok(SharedDifference { delta, covariance, shared: Vec::new(), refuted });
    }
    // The parameters of both: those of A, then those of B that are not shared.
    let own_b: Vec<usize> = (0..b.parameters.len()).filter(|j| !shared.iter().any(|(_, of_b)| of_b == j)).collect();
    let count = a.parameters.len() + own_b.len();
    let place_b = |j: usize| match shared.iter().find(|(_, of_b)| *of_b == j) {
        Some((of_a, _)) => *of_a,
        None => a.parameters.len() + own_b.partition_point(|own| *own < j),
    };
    let mut information = Mat::<f64>::zeros(count, count);
    let mut gradient = vec![0.0; count];
    let mut add = |model: &IdentifiedModel, place: &dyn Fn(usize) -> usize| -> Result<(), Diagnostic> {
        let own = inverse(model)?;
        let value: Vec<f64> = (0..model.parameters.len()).map(|j| model.estimate(j)).collect();
        for i in 0..value.len() {
            for j in 0..value.len() {
                information[(place(i), place(j))] += own[(i, j)];
                gradient[place(i)] += own[(i, j)] * value[j];
            }
        }
        Ok(())
    };
    add(a, &|i| i)?;
    add(b, &place_b)?;
    let enlargement = a.fit.u_enlargement.max(b.fit.u_enlargement);
    for (i, _) in &shared {
        if let Prior::Gaussian(u) = a.parameters[*i].prior() {
            information[(*i, *i)] -= (enlargement * u).powi(-2);
        }
    }
    let scale: Vec<f64> =
        (0..count).map(|i| if information[(i, i)] > 0.0 { information[(i, i)].sqrt().recip() } else { 0.0 }).collect();
    let scaled = Mat::from_fn(count, count, |i, j| information[(i, j)] * scale[i] * scale[j]);
    let inverse = pseudo_inverse(scaled.as_ref())?;
    let joint = Mat::from_fn(count, count, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
    let value: Vec<f64> = (0..count).map(|i| (0..count).map(|j| joint[(i, j)] * gradient[j]).sum()).collect();
    let ends: Vec<(usize, usize)> = common.iter().map(|(i, j)| (*i, place_b(*j))).collect();
    let delta = ends.iter().map(|(i, j)| value[*j] - value[*i]).collect();
    let covariance = Mat::from_fn(ends.len(), ends.len(), |k, l| {
        let ((i, j), (p, q)) = (ends[k], ends[l]);
        joint[(j, q)] - joint[(j, p)] - joint[(i, q)] + joint[(i, p)]
    });
    let shared = shared.iter().map(|(i, _)| a.parameters[*i].id.to_string()).collect();
    Ok(SharedDifference { delta, covariance, shared, refuted })
}

/// Takes the kinds of objects out of `shared` of which the readings show one to be two (Bonferroni over the kind). The
/// others of the kind may differ by less than the readings show; a kit of bars that was assembled again is another one.
fn refuted(a: &IdentifiedModel, b: &IdentifiedModel, shared: &mut Vec<(usize, usize)>) -> Vec<NotShared> {
    let tested: Vec<Option<NotShared>> = shared.iter().map(|pair| test(a, b, *pair)).collect();
    let kind = |i: usize| thing(a, i);
    let of_kind = |name: &str| shared.iter().filter(|(i, _)| kind(*i) == name).count() as f64;
    let mut kinds: Vec<&str> = Vec::new();
    let mut refuted: Vec<NotShared> = Vec::new();
    for ((i, _), found) in shared.iter().zip(&tested) {
        if found.as_ref().is_some_and(|found| found.p_value * of_kind(kind(*i)) < REFUTED) && !kinds.contains(&kind(*i))
        {
            kinds.push(kind(*i));
        }
    }
    for ((i, _), found) in shared.iter().zip(tested) {
        if let Some(found) = found.filter(|_| kinds.contains(&kind(*i))) {
            let refuted_itself = found.p_value * of_kind(kind(*i)) < REFUTED;
            refuted.push(NotShared { refuted: refuted_itself, ..found });
        }
    }
    let kinds: Vec<String> = kinds.into_iter().map(str::to_string).collect();
    shared.retain(|(i, _)| !kinds.iter().any(|kind| kind == thing(a, *i)));
    refuted
}

/// The kind of a set-up quantity: `bar` of `bar[C100]`, `workpiece_ball` of `workpiece_ball.x[P1]`.
fn thing(model: &IdentifiedModel, parameter: usize) -> &str {
    model.parameters[parameter].id.thing().unwrap_or_default()
}

/// The test of one object by the readings of both sessions; `None` if one of them contains no information about it.
fn test(a: &IdentifiedModel, b: &IdentifiedModel, (i, j): (usize, usize)) -> Option<NotShared> {
    let alone = |model: &IdentifiedModel, k: usize| {
        let variance = model.covariance[(k, k)];
        let of_prior = match model.parameters[k].prior() {
            Prior::Gaussian(u) => (model.fit.u_enlargement * u).powi(-2),
            Prior::Free | Prior::Known => 0.0,
        };
        let information = 1.0 / variance - of_prior;
        // Below this share of the variance the difference is rounding.
        (information * variance > LEAST_SHARE)
            .then(|| (model.parameters[k].value / (variance * information), 1.0 / information))
    };
    let ((of_a, variance_a), (of_b, variance_b)) = (alone(a, i)?, alone(b, j)?);
    let (value, u) = (of_b - of_a, (variance_a + variance_b).sqrt());
    Some(NotShared {
        change: a.parameters[i].change(value, u),
        p_value: (2.0 * normal_tail((value / u).abs())).min(1.0),
        refuted: false,
    })
}

/// The information of a model: the inverse of its covariance over the parameters that are not held.
fn inverse(model: &IdentifiedModel) -> Result<Mat<f64>, Diagnostic> {
    let count = model.parameters.len();
    let scale: Vec<f64> = (0..count).map(|i| if model.u(i) > 0.0 { model.u(i).recip() } else { 0.0 }).collect();
    let scaled = Mat::from_fn(count, count, |i, j| model.covariance[(i, j)] * scale[i] * scale[j]);
    let inverse = pseudo_inverse(scaled.as_ref())?;
    Ok(Mat::from_fn(count, count, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

/// The set-up quantities that are the same object in both sessions, by index in each.
///
/// # Errors
/// If a stated quantity is not estimated, with the same prior, in both, or if nothing is stated beside others.
fn shared(
    a: &IdentifiedModel,
    b: &IdentifiedModel,
    things: Option<&[String]>,
) -> Result<Vec<(usize, usize)>, Diagnostic> {
    let is_setup = |p: &ModelParameter| p.id.is_setup() && !p.held;
    let of_both = a.parameters.iter().enumerate().filter(|(_, p)| is_setup(p)).filter_map(|(i, p)| {
        let same = |q: &ModelParameter| q.id == p.id && is_setup(q) && q.prior_u == p.prior_u;
        b.parameters.iter().position(same).map(|j| (i, j))
    });
    let mut of_both: Vec<(usize, usize)> = of_both.collect();
    let thing = |i: usize| thing(a, i);
    let things_stated = things.unwrap_or_default();
    if things_stated.len() > 1 && things_stated.iter().any(|stated| stated == NOTHING) {
        let (one, other) = ("shared set-up quantities".to_string(), format!("\"{NOTHING}\""));
        return Err(error::contradictory(one, other, "state either"));
    }
    for stated in things_stated.iter().filter(|stated| *stated != NOTHING) {
        if !of_both.iter().any(|(i, _)| thing(*i) == stated) {
            let mut known: Vec<&str> = of_both.iter().map(|(i, _)| thing(*i)).collect();
            known.sort_unstable();
            known.dedup();
            let what = "set-up quantity with the same prior in both called";
            return Err(error::unknown("the pair of models", what, stated, "these are:", known));
        }
    }
    of_both.retain(|(i, _)| match things {
        Some(things) => things.iter().any(|stated| stated == thing(*i)),
        None => thing(*i) == "bar" && a.parameters[*i].prior_u.is_some(),
    });
    Ok(of_both)
}
