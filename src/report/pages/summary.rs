//! Key figures of the summary: agreement of residual and noise, held-out error, rank and readings.

use abbe::identify::noise::NoiseSource;
use abbe::identify::problem::Problem;
use abbe::identify::results::CrossValidation;
use abbe::model::words::counted;

use super::document::KeyFigure;
use crate::printers::html::integer;
use crate::report::cross_validation;
use crate::report::number::micrometres;

/// χ², degrees of freedom and the quantities that describe the quality of one model.
pub struct Quality<'r> {
    /// χ², priors included.
    pub chi_square: f64,
    /// Degrees of freedom ν.
    pub degrees_of_freedom: usize,
    /// Held-out RMS residual over scalar readings, µm.
    pub heldout_rms_um: f64,
    /// Held-out RMS length of the residual vector, µm.
    pub heldout_rms_3d_um: Option<f64>,
    /// Held-out errors by what is held out.
    pub cross_validation: &'r CrossValidation,
    /// Numerical rank.
    pub rank: usize,
    /// Number of parameters.
    pub parameters: usize,
    /// Noise standard deviation of one scalar reading, µm.
    pub noise_um: f64,
    /// Source of the noise.
    pub noise_source: NoiseSource,
}

impl Quality<'_> {
    /// χ²/ν. `None` without degrees of freedom.
    pub fn reduced_chi_square(&self) -> Option<f64> {
        (self.degrees_of_freedom > 0).then(|| self.chi_square / self.degrees_of_freedom as f64)
    }

    /// Whether the noise is known independently of the residual, so that χ²/ν is a test of the model.
    pub fn is_testable(&self) -> bool {
        self.noise_source.judges()
    }

    fn ratio(&self) -> String {
        self.reduced_chi_square().map_or("–".to_string(), |ratio| format!("{ratio:.2}"))
    }
}

/// χ²/ν of a model, compared with that of a first model if there is one.
pub fn chi_square(model: &Quality<'_>, before: Option<&Quality<'_>>) -> KeyFigure {
    if !model.is_testable() {
        return KeyFigure::new("χ²/ν", "not testable", "The noise is estimated from the residual itself.");
    }
    let freedom = format!(
        "χ²\u{a0}=\u{a0}{}, ν\u{a0}=\u{a0}{}; expected:\u{a0}1",
        integer(model.chi_square.round() as usize),
        integer(model.degrees_of_freedom)
    );
    let note = match before {
        Some(before) => format!("before: {}; {freedom}", before.ratio()),
        None => freedom,
    };
    KeyFigure::new("χ²/ν", model.ratio(), note)
}

/// Held-out error of a model against the noise, compared with that of a first model if there is one.
pub fn held_out(model: &Quality<'_>, before: Option<&Quality<'_>>) -> KeyFigure {
    let noise = if model.is_testable() {
        format!("noise: {} ({})", micrometres(model.noise_um), model.noise_source)
    } else {
        "noise: not stated, no repeated readings".to_string()
    };
    let figure = |quality: &Quality<'_>| match quality.heldout_rms_3d_um {
        Some(length) => format!("{} (vector {})", micrometres(quality.heldout_rms_um), micrometres(length)),
        None => micrometres(quality.heldout_rms_um),
    };
    let note = match before {
        Some(before) => format!("before: {}; {noise}", figure(before)),
        None => noise,
    };
    let of_before = before.map(|before| before.cross_validation);
    let others = cross_validation::sentences(model.cross_validation, of_before);
    let note = std::iter::once(note).chain(others).collect::<Vec<String>>().join("; ");
    KeyFigure::new("Held-out rms", figure(model), note)
}

/// Numerical rank against the number of parameters.
pub fn rank(rank: usize, parameters: usize) -> KeyFigure {
    let note = match parameters.saturating_sub(rank) {
        0 => "all parameters identifiable".to_string(),
        deficit => {
            format!("rank deficiency {deficit}: {} of parameters not identifiable", counted(deficit, "combination"))
        }
    };
    KeyFigure::new("Rank", format!("{rank} of {parameters}"), note)
}

/// Number of readings, tests and outliers.
pub fn readings(problem: &Problem, readings: usize, outliers: usize) -> KeyFigure {
    let tests = counted(problem.tests.len(), "test");
    let excluded = match outliers {
        0 => "no outliers".to_string(),
        some => format!("{} excluded", counted(some, "outlier")),
    };
    KeyFigure::new("Readings", integer(readings), format!("{tests}; {excluded}"))
}

/// The noise of a result and its source. The residual of a model is not called noise.
pub fn noise_sentence(noise_um: f64, source: NoiseSource) -> String {
    match source {
        NoiseSource::Residual => format!(
            "No noise is stated and there are no repeated readings. The uncertainties follow from the residual of the model, {}",
            micrometres(noise_um)
        ),
        other => format!("Noise standard deviation {} ({other})", micrometres(noise_um)),
    }
}
