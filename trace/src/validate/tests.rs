use std::path::Path;

use abbe_files::ReadOptions;
use abbe_identify::error;
use abbe_identify::fit::prepare;
use abbe_identify::model_file::Provenance;
use abbe_identify::noise::NoiseSource;
use abbe_model::component::ErrorName;
use abbe_model::session::{Prior, Session};

use super::*;

/// The tests of a bundled session with these names, and one error to be estimated.
fn session(tests: &[&str]) -> Session {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
    let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
    session.tests.retain(|test| tests.contains(&test.name.as_str()));
    session.unknowns = vec![ErrorName::parse("EX0C").unwrap()];
    session.noise_mm = Some(1e-3);
    session
}

fn model(session: &Session) -> IdentifiedModel {
    let (problem, fit) = prepare(session, 1).unwrap();
    IdentifiedModel::of_fit(&problem, &fit, Provenance::default()).unwrap()
}

/// With one parameter, generalised least squares gives the difference of two separate estimates, with the root of the
/// sum of their variances.
#[test]
fn a_change_is_the_difference_of_two_fits() {
    let (first, second) = (session(&["C100"]), session(&["C150"]));
    let mut moved = model(&first);
    let other = model(&second);
    let place = |model: &IdentifiedModel| model.parameters.iter().position(|p| p.id.to_string() == "EX0C").unwrap();
    let (i, j) = (place(&moved), place(&other));
    moved.parameters[i].value += 30.0 * moved.u(i).hypot(other.u(j));
    let known_noise = KnownErrors::new(&moved, &second, &[]).unwrap();
    let values = known_noise.model_values();
    let beta = known_noise.fit(&values).unwrap();
    let found = moved::moved(&known_noise, &known_noise.linearised(&values, &beta).unwrap()).unwrap();
    assert_eq!(found.len(), 1);
    let expected_um = (other.parameters[j].value - moved.parameters[i].value) * 1e3;
    assert!((found[0].change.value / expected_um - 1.0).abs() < 2e-3, "{found:?} {expected_um}");
    // The excess of the residual over the stated noise enlarges the uncertainty.
    let u_um = moved.u(i).hypot(other.u(j)) * 1e3;
    assert!(found[0].change.u / u_um > 0.999 && found[0].change.u / u_um < 1.5, "{found:?} {u_um}");
}

/// The readings of the model's own session are predicted; a set-up that is known exactly leaves nothing to estimate.
#[test]
fn a_model_holds_on_its_own_readings_also_without_a_set_up() {
    let mut own = session(&["A100", "A150", "C100", "C150"]);
    for test in &mut own.tests {
        test.priors.iter_mut().for_each(|prior| *prior = Prior::Known);
    }
    own.noise_mm = None;
    let model = model(&own);
    let validation = validate(&model, &own).unwrap();
    assert!(validation.result.set_up.is_empty());
    assert_eq!(validation.result.readings_in_range, validation.result.readings);
    assert!(validation.result.moved.is_empty(), "{:?}", validation.result.moved);
    let readings = validation.result.readings + validation.result.outliers;
    assert_eq!(validation.predicted_mm.iter().map(Vec::len).sum::<usize>(), readings);
}

#[test]
fn readings_outside_the_range_are_counted_and_named() {
    let model = model(&session(&["C100"]));
    let second = session(&["C100", "C150"]);
    let result = validate(&model, &second).unwrap().result;
    assert!(result.readings_in_range > 0 && result.readings_in_range < result.readings);
    assert_eq!(result.outside, ["Z"]);
    assert!(result.model.in_range.is_some());
    let outside = validate(&model, &session(&["C150"])).unwrap().result;
    assert_eq!(outside.readings_in_range, 0);
    assert!(outside.warnings.iter().any(|warning| warning.contains("no reading lies inside the range")));
}

#[test]
fn a_session_that_the_model_does_not_affect_is_refused() {
    let mut second = session(&["A100"]);
    let model = model(&session(&["C100"]));
    second.tests.iter_mut().for_each(|test| test.readings = None);
    assert_eq!(validate(&model, &second).err(), Some(error::no_readings()));
    let mut empty = model.clone();
    empty.parameters.retain(|parameter| parameter.id.is_setup());
    let error = validate(&empty, &session(&["A100"])).err().unwrap().to_string();
    assert!(error.contains("nothing in common"), "{error}");
}

/// A family inflates the likelihood of its readings. Another session without a noise of its own has the noise of the
/// model, not the inflated one, which would make any residual look as predicted.
#[test]
fn the_inflation_of_families_is_no_noise() {
    let mut second = session(&["C100", "C150"]);
    let model = model(&second);
    second.noise_mm = None;
    for readings in second.tests.iter_mut().filter_map(|test| test.readings.as_mut()).map(std::sync::Arc::make_mut) {
        // One traversal, so that nothing repeats.
        let first: Vec<usize> = readings.runs().into_iter().next().unwrap().collect();
        *readings = readings.of_rows(&first);
    }
    let mut inflated = model.clone();
    inflated.noise.inflation = 40.0;
    let [plain, inflated] = [&model, &inflated].map(|model| validate(model, &second).unwrap().result);
    assert_eq!(plain.noise.source, NoiseSource::Model);
    assert_eq!(inflated.model, plain.model);
    assert_eq!(inflated.verdict, plain.verdict);
}
