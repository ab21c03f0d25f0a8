//! Key figures of a model: agreement of residual and noise, held-out errors by what is held out (interpolation and
//! extrapolation of poses, left-out tests), rank and readings.

use abbe::identify::noise::{NoiseSource, ReadingNoise};
use abbe::identify::problem::Problem;
use abbe::identify::results::{Goodness, GoodnessVerdict, ModelResult, NotJudged};
use abbe::model::unit::Unit;
use abbe::model::words::{counted, first_of};

use super::block::KeyFigure;
use super::number::{integer, of_readings, three_digits};

/// χ²/ν; a dash without degrees of freedom.
fn ratio(model: &ModelResult) -> String {
    match model.degrees_of_freedom {
        0 => "–".to_string(),
        freedom => format!("{:.2}", model.chi_square / freedom as f64),
    }
}

/// The key figures of a model, compared with those of the declared one if there is one.
pub fn key_figures(model: &ModelResult, before: Option<&ModelResult>) -> Vec<KeyFigure> {
    let shown = |value: f64| of_readings(value, model.noise.unit);
    let than = |figure: &dyn Fn(&ModelResult) -> String| before.map(|before| format!("before {}", figure(before)));
    let and = |before: Option<String>| before.map_or(String::new(), |before| before + "; ");
    let judges = model.noise.source.judges();
    let chi_square = match judges {
        true => KeyFigure::new("χ²/ν", ratio(model), and(than(&ratio)) + "expected 1"),
        false => KeyFigure::new("χ²/ν", "not testable", "the residual is taken for noise"),
    };
    let noise = match judges {
        true => noise(model.noise),
        false => "noise not stated".to_string(),
    };
    let held_out = than(&|before| shown(before.fit.heldout_rms_um)).unwrap_or_else(|| "cross-validation".to_string());
    let mut figures = vec![
        chi_square,
        KeyFigure::new("Residual rms", shown(model.fit.rms_um), and(than(&|before| shown(before.fit.rms_um))) + &noise),
        KeyFigure::new("Held-out rms", shown(model.fit.heldout_rms_um), held_out),
    ];
    if let (Some(rms), Some(held)) = (model.rms_3d_um, model.heldout_rms_3d_um) {
        figures.push(KeyFigure::new("3-vector", shown(rms), format!("held out {}", shown(held))));
    }
    if let Some(angles) = model.of_angles {
        let in_arcsec = |value: f64| of_readings(value, Unit::Arcsecond);
        let [rms, held, noise] = [angles.rms_arcsec, angles.heldout_rms_arcsec, angles.noise_arcsec].map(in_arcsec);
        figures.push(KeyFigure::new("Angles, rms", rms, format!("held out {held}, noise {noise}")));
    }
    let open = match model.parameter_count.saturating_sub(model.rank) {
        0 => "all parameters identifiable".to_string(),
        deficit => format!("{} not identifiable", counted(deficit, "combination")),
    };
    figures.push(KeyFigure::new("Rank", format!("{} of {}", model.rank, model.parameter_count), open));
    figures
}

/// What is held out, and the held-out errors that do not decide.
pub fn held_out_sentences(model: &ModelResult, before: Option<&ModelResult>) -> Vec<String> {
    let others = other_held_out(model, before);
    std::iter::once(format!("held out: leaving out {}", model.heldout_by)).chain(others).collect()
}

/// Number of readings, tests and outliers.
pub fn readings(problem: &Problem, model: &ModelResult) -> KeyFigure {
    let tests = counted(problem.tests.len(), "test");
    let excluded = match model.outliers.len() {
        0 => "no outliers".to_string(),
        some if model.outliers.iter().all(|outlier| outlier.first_at_reversal) => {
            format!("{} at a reversal excluded", counted(some, "first reading"))
        }
        some => format!("{} excluded", counted(some, "outlier")),
    };
    KeyFigure::new("Readings", integer(model.fit.readings), format!("{tests}, {excluded}"))
}

/// How far a chosen design is from the best one, by its bound.
pub fn efficiency(value: f64, bound: f64, of: &str) -> String {
    if !value.is_finite() || bound <= 0.0 {
        return format!("No choice of {of} reaches less than {}.", three_digits(bound));
    }
    format!(
        "No choice of {of} reaches less than {}: the chosen ones are within {:.1} % of it.",
        three_digits(bound),
        100.0 * (value / bound - 1.0).max(0.0)
    )
}

/// The noise and its source in words. A residual is not called noise.
pub fn noise(noise: ReadingNoise) -> String {
    let figure = of_readings(noise.value, noise.unit);
    match noise.source {
        NoiseSource::Residual => format!("residual of the declared model {figure} (no noise stated, no repeats)"),
        other => format!("noise {figure} ({other})"),
    }
}

/// The noise of a model and its source in words, and whether the readings of a run are correlated.
pub fn noise_of_model(model: &ModelResult) -> String {
    noise(model.noise) + autocorrelated(model)
}

/// The same as a sentence, without its full stop.
pub fn noise_sentence_of_model(model: &ModelResult) -> String {
    noise_sentence(model.noise) + autocorrelated(model)
}

fn autocorrelated(model: &ModelResult) -> &'static str {
    if model.noise_ar_coefficients.is_empty() { "" } else { ", autocorrelated along runs" }
}

/// The noise of a result and its source. The residual of a model is not called noise.
pub fn noise_sentence(noise: ReadingNoise) -> String {
    let figure = of_readings(noise.value, noise.unit);
    match noise.source {
        NoiseSource::Residual => format!(
            "No noise is stated or follows from repeats. The uncertainties follow from the residual of the model, {figure}"
        ),
        other => format!("Noise standard deviation {figure} ({other})"),
    }
}

/// Whether the residual agrees with the noise.
pub fn agreement(goodness: Goodness, degrees_of_freedom: usize) -> String {
    let figures = format!("χ²/ν = {:.2}, ν = {degrees_of_freedom}", goodness.chi_square_ratio);
    match goodness.verdict {
        GoodnessVerdict::NotJudged => match goodness.not_judged {
            Some(NotJudged::BelowNoise) => {
                format!("not judged: the residual is far below the noise ({figures}), so the noise is overstated")
            }
            Some(NotJudged::WrongUnit) => {
                "not judged: the residual is less than a tenth of the noise, or the readings have a size that such an \
                 instrument does not read; their unit is the likely cause"
                    .to_string()
            }
            Some(NotJudged::NoDegreesOfFreedom) => {
                "not judged: no degrees of freedom, the parameters are as many as the readings".to_string()
            }
            Some(NotJudged::NoNoise) | None => {
                "cannot be judged: no noise is stated or follows from repeats, so the residual is taken for noise"
                    .to_string()
            }
        },
        GoodnessVerdict::Exceeds => format!("the residual exceeds the noise ({figures}): the model lacks an effect"),
        GoodnessVerdict::Structured => {
            format!(
                "the residual is no larger than the noise ({figures}), but it has structure: the model lacks an effect"
            )
        }
        GoodnessVerdict::Agrees => format!("the residual agrees with the noise ({figures})"),
    }
}

/// What the estimates of a model are not good for; `None` if they may be quoted.
pub fn reservation(goodness: Goodness) -> Option<&'static str> {
    (!goodness.quotable).then_some(match goodness.not_judged {
        Some(NotJudged::WrongUnit) => "not to be quoted: the unit of the readings is in doubt",
        _ => {
            "not to be quoted: the model lacks an effect, and u does not cover the bias that it causes in the estimates"
        }
    })
}

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
pub fn held_out(model: &ModelResult) -> Vec<HeldOutFigure> {
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
fn other_held_out(model: &ModelResult, before: Option<&ModelResult>) -> Vec<String> {
    let found = &model.cross_validation;
    let earlier = before.map(held_out).unwrap_or_default();
    let mut sentences = Vec::new();
    for figure in held_out(model) {
        let value = match earlier.iter().find(|one| one.name == figure.name) {
            Some(before) => format!("before {}, after {}", before.in_words(), figure.in_words()),
            None => figure.in_words(),
        };
        match figure.name {
            "interpolation" if found.extrapolation_rms_um.is_some() => {
                sentences.push(format!(
                    "held-out blocks test extrapolation, and decide; interpolation, over random poses: {value}"
                ));
            }
            "left-out test" => {
                let tests = first_of(&found.left_out_tests, MAX_NAMED, ", ", "");
                sentences.push(format!("left-out test: {value} ({tests}, each predicted by the other tests)"));
            }
            _ => {}
        }
    }
    if !found.tests_not_left_out.is_empty() {
        let tests = found.tests_not_left_out.iter();
        let tests = tests.map(|test| format!("{} (needs {})", test.test, test.parameters.join(", ")));
        sentences.push(format!(
            "not predicted by the other tests: {}",
            first_of(&tests.collect::<Vec<_>>(), MAX_NAMED, ", ", "")
        ));
    }
    sentences
}
