use std::path::Path;

use abbe_files::ReadOptions;
use abbe_files::read::effect_of_document;
use abbe_model::Diagnostic;
use abbe_model::component::ErrorName;
use abbe_model::document::effect;
use abbe_model::document::node::Named;
use abbe_model::driver::Driver;
use abbe_model::effect::shape::Shape;
use abbe_model::effect::{Component, Effect};
use abbe_model::session::Session;
use serde_json::Value;

use super::carried::States;
use super::write::checksum;
use super::*;
use crate::fit::{Fit, prepare};
use crate::problem::Problem;

/// A bundled session with an effect on the axial motion of C, and its fit.
fn fitted() -> (Session, Problem, Fit) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
    let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
    let text = "[[effect]]\ncomponent = \"EZC\"\nshape = \"harmonic\"\norder = 2\n[[effect]]\ncomponent = \"EXA\"\n\
                shape = \"periodic\"\nperiod_deg = 33.3\n";
    let document: Named<Vec<effect::Effect>> =
        abbe_files::Source::new(&file, text).parse().unwrap().document().unwrap();
    let effects = document.0[0].1.iter();
    let read =
        effects.map(|of| effect_of_document(of, &session.machine, &session.instrument_parameters(), &[]).unwrap());
    session.effects = read.collect();
    let (problem, fit) = prepare(&session, 1).unwrap();
    (session, problem, fit)
}

fn text() -> String {
    let (_, problem, fit) = fitted();
    IdentifiedModel::of_fit(&problem, &fit, Provenance::default()).unwrap().to_text().unwrap()
}

fn read_text(text: &str) -> Result<IdentifiedModel, Diagnostic> {
    of_source(&abbe_files::Source::new(Path::new("model.json"), text))
}

#[test]
fn a_model_reads_back_to_the_same_bits_and_predicts_the_same_readings() {
    let (_, problem, fit) = fitted();
    let saved = IdentifiedModel::of_fit(&problem, &fit, Provenance::default()).unwrap();
    let text = saved.to_text().unwrap();
    let read = read_text(&text).unwrap();
    assert_eq!(read.machine, saved.machine);
    assert_eq!(read.effects, saved.effects);
    assert_eq!(read.parameters, saved.parameters);
    assert_eq!(read.covariance, saved.covariance);
    assert_eq!(read.locations, saved.locations);
    assert_eq!(read.ranges, saved.ranges);
    assert_eq!(read.to_text().unwrap(), text);
    let values: Vec<f64> = read.parameters.iter().map(|parameter| parameter.value).collect();
    for (new, old) in problem.residuals(&values).iter().flatten().zip(fit.residuals.iter().flatten()) {
        assert!((new - old).abs() < 1e-12, "{new} {old}");
    }
    // Uncertainties are those of the fit, as every parameter is identifiable.
    for (j, parameter) in problem.parameters.list.iter().enumerate() {
        let u = fit.covariance[(j, j)].sqrt() * fit.u_enlargement;
        assert!((read.u(j) / u - 1.0).abs() < 1e-9, "{}", parameter.id);
    }
}

/// `EZC` at an angle is `a cos 2C + b sin 2C`; a location error is constant.
#[test]
fn errors_at_states_are_those_of_the_effects() {
    let model = read_text(&text()).unwrap();
    let value = |id: &str| model.parameters.iter().find(|own| own.id.to_string() == id).unwrap().value;
    let c = model.machine.axis_index("C").unwrap();
    let angles = [0.1, 0.7, 2.0];
    let mut positions = vec![vec![0.0; 3]; model.machine.axes.len()];
    positions[c] = angles.to_vec();
    let readings = abbe_model::session::readings::Readings { positions, channels: 1, ..Default::default() };
    let states = States { readings, tool_mm: [0.0; 3], table_mm: [0.0; 3] };
    let errors = model.errors_at(&states).unwrap();
    let slot = |name: &str| model.machine.error_slot(&ErrorName::parse(name).unwrap()).unwrap();
    assert_eq!(errors.constant[slot("EX0C")], value("EX0C"));
    let (_, column) = errors.varying.iter().find(|(varying, _)| *varying == slot("EZC")).unwrap();
    for (found, angle) in column.iter().zip(angles) {
        let expected = value("EZC~C:h2.cos") * (2.0 * angle).cos() + value("EZC~C:h2.sin") * (2.0 * angle).sin();
        assert!((found - expected).abs() < 1e-18);
    }
    let contributions = model.contributions(&states).unwrap();
    let carried = model.carried_parameters();
    assert!(contributions.iter().all(|contribution| contribution.parameter < carried.len()));
}

/// The delay of a trigger shifts readings, not the machine: no command is corrected by it.
#[test]
fn effects_on_the_instrument_do_not_belong_to_the_machine() {
    let effect = |id: &str| Effect::new(Component::parse(id).unwrap(), Driver::None, Shape::Constant);
    assert!(IdentifiedModel::is_carried(&effect("EXX")));
    for id in ["trigger", "bar", "workpiece_ball.x"] {
        assert!(!IdentifiedModel::is_carried(&effect(id)), "{id}");
    }
}

/// The text with one value changed and the checksum renewed or left.
fn changed(path: &str, value: Value, renew: bool) -> String {
    let mut document: Value = serde_json::from_str(&text()).unwrap();
    *document.pointer_mut(path).unwrap() = value;
    if renew {
        document["sha256"] = Value::String(checksum(&document));
    }
    serde_json::to_string_pretty(&document).unwrap()
}

fn message(text: &str) -> String {
    let error = read_text(text).unwrap_err();
    format!("{error}; {}", error.help().unwrap_or_default())
}

#[test]
fn a_file_that_cannot_be_used_is_refused_with_its_key() {
    use serde_json::json;
    for (text, expected) in [
        ("[machine]\nfile = \"machine.toml\"".to_string(), "this is a session or machine file, not a model"),
        ("{\"command\": \"fit\"}".to_string(), "this is the result of a command"),
        ("{".to_string(), "model.json:1: not valid JSON"),
        ("{}".to_string(), "has no `schema`"),
        (changed("/schema_version", json!(2), true), "a newer program saved the model"),
        (changed("/parameters/0/internal", json!(1e-3), false), "the file was changed after it was saved"),
        (
            changed("/parameters/2/internal", json!("1"), true),
            "`parameters[2].internal` is the text \"1\"; a number is expected",
        ),
        (
            changed("/parameters/2/id", json!("EX0C"), true),
            "`parameters[4]` (EX0C): another parameter has the same name",
        ),
        (changed("/covariance/3/3", json!(-1.0), true), "the variance of EC0A is negative"),
        (changed("/covariance/3/2", json!(1.0), true), "`covariance` is not positive semidefinite"),
        (changed("/covariance/3", json!([1.0]), true), "`covariance` is no lower triangle"),
        (changed("/effects/0/shape", json!("wave"), true), "`effects[0].shape`: \"wave\" is not a shape"),
        (changed("/machine/chain", json!("w C b"), true), "`machine.chain`: "),
        (changed("/instrument", json!("eye"), true), "`instrument` is the text \"eye\"; \"ballbar\", "),
        (changed("/noise/source", json!("guess"), true), "`noise.source` is the text \"guess\"; \"stated\", "),
    ] {
        let message = message(&text);
        assert!(message.contains(expected), "{message}\nexpected {expected}");
        assert!(message.starts_with("model.json"), "{message}");
    }
}
