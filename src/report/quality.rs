//! Key figures of a model: agreement of residual and noise, held-out error, rank and readings.

use abbe::identify::noise::NoiseSource;
use abbe::identify::problem::Problem;
use abbe::identify::results::{CrossValidation, Goodness, GoodnessVerdict, NotJudged, OfAngles};
use abbe::identify::unit::ReadingUnit;
use abbe::model::words::counted;

use super::block::KeyFigure;
use super::cross_validation;
use super::number::{integer, of_readings, three_digits};

/// The quantities that describe the quality of one model.
pub struct Quality<'r> {
    /// The unit of the figures of readings.
    pub unit: ReadingUnit,
    /// The figures of the angles beside lengths.
    pub of_angles: Option<OfAngles>,
    /// χ², priors included.
    pub chi_square: f64,
    /// Degrees of freedom ν.
    pub degrees_of_freedom: usize,
    /// RMS residual over scalar readings, µm.
    pub rms_um: f64,
    /// RMS length of the residual vector, µm.
    pub rms_3d_um: Option<f64>,
    /// Held-out RMS residual over scalar readings, µm.
    pub heldout_rms_um: f64,
    /// Held-out RMS length of the residual vector, µm.
    pub heldout_rms_3d_um: Option<f64>,
    /// Held-out errors by what is held out.
    pub cross_validation: &'r CrossValidation,
    /// What each fold holds out.
    pub heldout_by: &'r str,
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
    /// Whether the noise is known independently of the residual, so that χ²/ν is a test of the model.
    pub fn is_testable(&self) -> bool {
        self.noise_source.judges()
    }

    /// A figure of readings with its unit.
    fn shown(&self, value: f64) -> String {
        of_readings(value, self.unit)
    }

    /// χ²/ν; a dash without degrees of freedom.
    fn ratio(&self) -> String {
        match self.degrees_of_freedom {
            0 => "–".to_string(),
            freedom => format!("{:.2}", self.chi_square / freedom as f64),
        }
    }

    fn chi_square(&self, before: Option<&Quality<'_>>) -> KeyFigure {
        if !self.is_testable() {
            return KeyFigure::new("χ²/ν", "not testable", "the residual is taken for noise");
        }
        let before = before.map_or(String::new(), |before| format!("before {}; ", before.ratio()));
        KeyFigure::new("χ²/ν", self.ratio(), format!("{before}expected 1"))
    }

    fn residual(&self, before: Option<&Quality<'_>>) -> KeyFigure {
        let noise = match self.is_testable() {
            true => noise(self.noise_um, self.unit, self.noise_source),
            false => "noise not stated".to_string(),
        };
        let before = before.map_or(String::new(), |before| format!("before {}; ", self.shown(before.rms_um)));
        KeyFigure::new("Residual rms", self.shown(self.rms_um), format!("{before}{noise}"))
    }

    fn held_out(&self, before: Option<&Quality<'_>>) -> KeyFigure {
        let note = match before {
            Some(before) => format!("before {}", self.shown(before.heldout_rms_um)),
            None => "cross-validation".to_string(),
        };
        KeyFigure::new("Held-out rms", self.shown(self.heldout_rms_um), note)
    }

    fn rank(&self) -> KeyFigure {
        let note = match self.parameters.saturating_sub(self.rank) {
            0 => "all parameters identifiable".to_string(),
            deficit => format!("{} not identifiable", counted(deficit, "combination")),
        };
        KeyFigure::new("Rank", format!("{} of {}", self.rank, self.parameters), note)
    }

    /// The key figures, compared with those of a first model if there is one.
    pub fn key_figures(&self, before: Option<&Quality<'_>>) -> Vec<KeyFigure> {
        let mut figures = vec![self.chi_square(before), self.residual(before), self.held_out(before)];
        if let (Some(rms), Some(held)) = (self.rms_3d_um, self.heldout_rms_3d_um) {
            figures.push(KeyFigure::new("3-vector", self.shown(rms), format!("held out {}", self.shown(held))));
        }
        if let Some(angles) = self.of_angles {
            let in_arcsec = |value: f64| of_readings(value, ReadingUnit::Arcsecond);
            let [rms, held, noise] = [angles.rms_arcsec, angles.heldout_rms_arcsec, angles.noise_arcsec].map(in_arcsec);
            figures.push(KeyFigure::new("Angles, rms", rms, format!("held out {held}, noise {noise}")));
        }
        figures.push(self.rank());
        figures
    }

    /// What is held out, and the held-out errors that do not decide.
    pub fn held_out_sentences(&self, before: Option<&Quality<'_>>) -> Vec<String> {
        let others = cross_validation::sentences(self.cross_validation, before.map(|before| before.cross_validation));
        std::iter::once(format!("held out: leaving out {}", self.heldout_by)).chain(others).collect()
    }
}

/// Number of readings, tests and outliers.
pub fn readings(problem: &Problem, readings: usize, outliers: usize) -> KeyFigure {
    let tests = counted(problem.tests.len(), "test");
    let excluded = match outliers {
        0 => "no outliers".to_string(),
        some => format!("{} excluded", counted(some, "outlier")),
    };
    KeyFigure::new("Readings", integer(readings), format!("{tests}, {excluded}"))
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
pub fn noise(noise_um: f64, unit: ReadingUnit, source: NoiseSource) -> String {
    let figure = of_readings(noise_um, unit);
    match source {
        NoiseSource::Residual => format!("residual of the declared model {figure} (no noise stated, no repeats)"),
        other => format!("noise {figure} ({other})"),
    }
}

/// What follows the noise if the readings of a run are correlated.
pub fn autocorrelated(coefficients: &[f64]) -> &'static str {
    if coefficients.is_empty() { "" } else { ", autocorrelated along runs" }
}

/// The noise of a result and its source. The residual of a model is not called noise.
pub fn noise_sentence(noise_um: f64, unit: ReadingUnit, source: NoiseSource) -> String {
    match source {
        NoiseSource::Residual => format!(
            "No noise is stated or follows from repeats. The uncertainties follow from the residual of the model, {}",
            of_readings(noise_um, unit)
        ),
        other => format!("Noise standard deviation {} ({other})", of_readings(noise_um, unit)),
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
                "not judged: the residual is less than a tenth of the noise; the unit of the readings is the likely cause"
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
        Some(NotJudged::WrongUnit) => {
            "not to be quoted: the residual is less than a tenth of the noise, so that the unit of the readings is in doubt"
        }
        _ => "not to be quoted: the model lacks an effect, and u does not cover the bias that it causes in the estimates",
    })
}
