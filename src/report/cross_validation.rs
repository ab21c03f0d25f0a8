//! Held-out errors by what is held out, in words: interpolation and extrapolation of poses, left-out tests.

use abbe::identify::results::ModelResult;
use abbe::model::unit::Unit;
use abbe::model::words::first_of;

use super::number::of_readings;

/// Maximum number of tests that a sentence names.
const MAX_NAMED: usize = 5;

/// A held-out error with its name: rms over scalar readings, and rms length of the vector, µm.
pub struct HeldOutFigure {
    /// What it tests.
    pub name: &'static str,
    /// Its unit.
    pub unit: Unit,
    /// Over scalar readings.
    pub rms_um: f64,
    /// Of the vector, for instruments with three coordinates.
    pub rms_3d_um: Option<f64>,
}

impl HeldOutFigure {
    /// The figure with its unit: `0.305 µm`, or `254 µm (vector 440 µm)`.
    pub fn in_words(&self) -> String {
        match self.rms_3d_um {
            Some(length) => {
                format!("{} (vector {})", of_readings(self.rms_um, self.unit), of_readings(length, self.unit))
            }
            None => of_readings(self.rms_um, self.unit),
        }
    }
}

/// The held-out errors of a model that it has.
pub fn figures(model: &ModelResult) -> Vec<HeldOutFigure> {
    let found = &model.cross_validation;
    let all = [
        ("extrapolation", found.extrapolation_rms_um, found.extrapolation_rms_3d_um),
        ("interpolation", found.interpolation_rms_um, found.interpolation_rms_3d_um),
        ("left-out run", found.left_out_run_rms_um, found.left_out_run_rms_3d_um),
        ("left-out test", found.left_out_test_rms_um, found.left_out_test_rms_3d_um),
    ];
    let present = all.into_iter().filter_map(|(name, rms_um, rms_3d_um)| {
        Some(HeldOutFigure { name, unit: model.noise.unit, rms_um: rms_um?, rms_3d_um })
    });
    present.collect()
}

/// The held-out errors that do not decide, one sentence each, compared with those of a first model if there is one.
pub fn sentences(model: &ModelResult, before: Option<&ModelResult>) -> Vec<String> {
    let held_out = &model.cross_validation;
    let earlier = before.map(figures).unwrap_or_default();
    let mut sentences = Vec::new();
    for figure in figures(model) {
        let value = match earlier.iter().find(|one| one.name == figure.name) {
            Some(before) => format!("before {}, after {}", before.in_words(), figure.in_words()),
            None => figure.in_words(),
        };
        match figure.name {
            "interpolation" if held_out.extrapolation_rms_um.is_some() => {
                sentences.push(format!(
                    "held-out blocks test extrapolation, and decide; interpolation, over random poses: {value}"
                ));
            }
            "left-out test" => {
                let tests = first_of(&held_out.left_out_tests, MAX_NAMED, ", ", "");
                sentences.push(format!("left-out test: {value} ({tests}, each predicted by the other tests)"));
            }
            _ => {}
        }
    }
    if !held_out.tests_not_left_out.is_empty() {
        let tests = held_out.tests_not_left_out.iter();
        let tests = tests.map(|test| format!("{} (needs {})", test.test, test.parameters.join(", ")));
        sentences.push(format!(
            "not predicted by the other tests: {}",
            first_of(&tests.collect::<Vec<_>>(), MAX_NAMED, ", ", "")
        ));
    }
    sentences
}
