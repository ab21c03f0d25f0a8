//! Whether sessions and models are of one machine.

use abbe_identify::model_file::IdentifiedModel;
use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use abbe_model::session::Session;

/// Largest difference of directions, and of origins in mm, that counts as rounding.
const ROUNDING: f64 = 1e-9;

/// What differs between two machines: chain, axes, rotation convention, gravity. `places` name them in sentences, as in
/// "the model" and "the session".
pub fn differences(own: &Machine, other: &Machine, places: [&str; 2]) -> Vec<String> {
    let [here, there] = places;
    if own.code() != other.code() {
        return vec![format!("the chain is `{}` in {here} and `{}` in {there}", own.code(), other.code())];
    }
    let mut differences = Vec::new();
    let apart = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > ROUNDING);
    for (a, b) in own.axes.iter().zip(&other.axes) {
        for (what, unit, own, other) in
            [("direction", "", &a.direction, &b.direction), ("origin", " mm", &a.origin_mm, &b.origin_mm)]
        {
            if apart(own, other) {
                let axis = &a.name;
                differences.push(format!(
                    "the {what} of axis {axis} is {own:?}{unit} in {here} and {other:?}{unit} in {there}"
                ));
            }
        }
        if a.kind != b.kind {
            differences.push(format!("axis {} is linear in one and rotary in the other", a.name));
        }
    }
    if own.rotation != other.rotation {
        differences.push("`rotation` is \"exact\" in one and \"small-angle\" in the other".into());
    }
    if apart(&own.gravity, &other.gravity) {
        differences.push(format!("gravity is {:?} in {here} and {:?} in {there}", own.gravity, other.gravity));
    }
    differences
}

/// Checks that a session is of the machine of a model. Returns warnings about differences that change no prediction.
///
/// # Errors
/// If chain, axes, rotation convention or gravity differ, with what differs.
pub(super) fn check(model: &IdentifiedModel, session: &Session) -> Result<Vec<String>, Diagnostic> {
    let (own, other) = (&model.machine, session.machine.as_ref());
    let differences = differences(own, other, ["the model", "the session"]);
    if !differences.is_empty() {
        return Err(Diagnostic::session(
            format!("the model is of another machine than the session: {}", differences.join("; ")),
            "validate the model on a session of its machine, or fit a model of this one",
        ));
    }
    let mut warnings = Vec::new();
    if own.name != other.name {
        warnings.push(format!(
            "the machine is called \"{}\" in the model and \"{}\" in the session; its axes are the same",
            own.name, other.name
        ));
    }
    Ok(warnings)
}
