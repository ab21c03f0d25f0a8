//! The quantities that a fit reports: identifiable parameters, amplitude and phase of harmonics, the rms of spectra, and
//! the positions of steps.

use super::{Fit, StepPosition};
use crate::problem::Problem;
use crate::unit::ParameterUnit;

/// A reported quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// A parameter, by index.
    Parameter(usize),
    /// Amplitude and phase of a harmonic, by the index of its cosine coefficient.
    Harmonic(usize),
    /// Rms over a period of a sum of cosines and sines: `√(Σ c²/2)`. The first coefficient and their number.
    Rms(usize, usize),
    /// An estimated position of a step, by index among [`Fit::positions`].
    Position(usize),
}

/// The rms over a period of a sum of cosines and sines with some coefficients.
pub(crate) fn rms_of_waves(coefficients: &[f64]) -> f64 {
    (0.5 * coefficients.iter().map(|c| c * c).sum::<f64>()).sqrt()
}

/// The derivative of [`rms_of_waves`] by each coefficient.
pub(crate) fn slopes_of_rms(coefficients: &[f64]) -> impl Iterator<Item = f64> {
    let rms = rms_of_waves(coefficients).max(f64::MIN_POSITIVE);
    coefficients.iter().map(move |c| 0.5 * c / rms)
}

/// Standard uncertainty of an undetermined phase, °: the standard deviation of a uniform distribution over one turn.
pub(crate) fn u_of_undetermined_phase_deg() -> f64 {
    180.0 / 3.0_f64.sqrt()
}

/// The reported quantities in their order: those of the identifiable parameters.
pub(crate) fn quantities(problem: &Problem, fit: &Fit) -> Vec<Quantity> {
    let (list, rank) = (&problem.parameters.list, &fit.rank);
    let mut quantities = Vec::new();
    let mut j = 0;
    while j < list.len() {
        let of_effect = list[j].coefficient_of();
        if let Some(effect) = of_effect.filter(|_| list[j].index == 0) {
            let effect = &problem.parameters.effects[effect];
            if effect.shape.needs_prior() {
                let count = effect.shape.coefficients();
                quantities.push(Quantity::Rms(j, count));
                j += count;
                continue;
            }
            let pair = effect.shape.is_wave();
            if pair && rank.is_identifiable(j) && rank.is_identifiable(j + 1) {
                quantities.push(Quantity::Harmonic(j));
                j += 2;
                continue;
            }
        }
        if rank.is_identifiable(j) {
            quantities.push(Quantity::Parameter(j));
        }
        if let Some(effect) = of_effect {
            let coefficient = list[j].index;
            let is_last = coefficient + 1 == problem.parameters.effects[effect].shape.coefficients();
            // The position of a step whose height is not identifiable is none either.
            let is_seen = |position: &StepPosition| {
                position.effect == effect && rank.is_identifiable(j - coefficient + position.step)
            };
            let own = (0..fit.positions.len()).filter(|k| is_last && is_seen(&fit.positions[*k]));
            quantities.extend(own.map(Quantity::Position));
        }
        j += 1;
    }
    quantities
}

/// Passes the reported quantities at the parameters `beta` to a function, in display units, amplitude before phase.
/// Each phase lies within half a turn of the fit's phase.
pub(crate) fn values_at(
    problem: &Problem,
    fit: &Fit,
    quantities: &[Quantity],
    beta: &[f64],
    mut accept: impl FnMut(f64),
) {
    let list = &problem.parameters.list;
    for quantity in quantities {
        match *quantity {
            Quantity::Parameter(j) => accept(problem.parameters.value(j, beta) * list[j].unit.display_per_internal),
            Quantity::Rms(j, count) => accept(rms_of_waves(&beta[j..j + count]) * list[j].unit.display_per_internal),
            Quantity::Position(k) => {
                let StepPosition { effect, step, .. } = fit.positions[k];
                let effect = &problem.parameters.effects[effect];
                let unit = ParameterUnit::of_number(&problem.session, effect);
                accept(effect.shape.positions()[step] * unit.display_per_internal);
            }
            Quantity::Harmonic(j) => {
                accept(beta[j].hypot(beta[j + 1]) * list[j].unit.display_per_internal);
                let (a, b) = (fit.beta[j], fit.beta[j + 1]);
                let off = (b * beta[j] - a * beta[j + 1]).atan2(a * beta[j] + b * beta[j + 1]);
                accept(((-b).atan2(a) + off).to_degrees());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use abbe_model::driver::Driver;
    use abbe_model::effect::shape::Harmonic;
    use abbe_model::effect::{Component, Effect, Shape};

    use super::*;
    use crate::fit::{fit, prepare};

    /// `A cos(nC + φ)` has the coefficients `A cos φ` and `−A sin φ`.
    #[test]
    fn amplitude_and_phase_of_a_harmonic_follow_from_its_coefficients() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let (mut problem, _) = prepare(&session, 1).unwrap();
        problem
            .add_effect(&Effect::new(
                Component::parse("EZC").unwrap(),
                Driver::parse("C"),
                Shape::Harmonic(Harmonic { order: 3.0 }),
            ))
            .unwrap();
        let mut fit = fit(&problem, None).unwrap();
        let quantities = quantities(&problem, &fit);
        let (place, j) = quantities
            .iter()
            .enumerate()
            .find_map(|(place, quantity)| match quantity {
                Quantity::Harmonic(j) => Some((place, *j)),
                Quantity::Parameter(_) | Quantity::Rms(..) | Quantity::Position(_) => None,
            })
            .unwrap();
        let coefficients = |amplitude_um: f64, phase_deg: f64| {
            let (sin, cos) = phase_deg.to_radians().sin_cos();
            [1e-3 * amplitude_um * cos, -1e-3 * amplitude_um * sin]
        };
        for (present_deg, other_deg) in [(170.0, 200.0), (-20.0, 40.0), (80.0, -60.0), (0.0, 90.0)] {
            fit.beta[j..j + 2].copy_from_slice(&coefficients(2.0, present_deg));
            let mut other = fit.beta.clone();
            other[j..j + 2].copy_from_slice(&coefficients(3.0, other_deg));
            let mut values = Vec::new();
            values_at(&problem, &fit, &quantities, &other, |value| values.push(value));
            // No harmonic with two reported values precedes this one.
            assert!((values[place] - 3.0).abs() < 1e-12, "{}", values[place]);
            assert!((values[place + 1] - other_deg).abs() < 1e-9, "{} and {other_deg}", values[place + 1]);
        }
    }

    /// `3 cos + 4 sin` has the rms `5/√2`.
    #[test]
    fn slopes_are_central_differences_of_the_rms() {
        assert!((rms_of_waves(&[3.0, 4.0]) - 5.0 / 2.0_f64.sqrt()).abs() < 1e-15);
        let waves = [3.0, -4.0, 0.5, 0.0];
        for (k, slope) in slopes_of_rms(&waves).enumerate() {
            let at = |change: f64| {
                let mut changed = waves;
                changed[k] += change;
                rms_of_waves(&changed)
            };
            assert!((slope - (at(1e-5) - at(-1e-5)) / 2e-5).abs() < 1e-9, "{k}: {slope}");
        }
        assert!(slopes_of_rms(&[0.0; 2]).all(|slope| slope == 0.0));
    }
}
