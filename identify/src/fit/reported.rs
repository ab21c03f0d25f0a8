//! A fit in the form of its results: display units, words, and the lists of what is not identifiable and of outliers.

use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::effect::description::meaning;
use abbe_model::parameter_id::{ParameterId, Part};
use abbe_model::unit::ARCSEC_PER_RAD;

use super::outcome::{self, Determined};
use super::quantities::{Quantity, quantities, rms_of_waves, slopes_of_rms, u_of_undetermined_phase_deg};
use super::{Fit, StepPosition, covariance, enlargement_warning};
use super::{assume, cover, frames};
use crate::circular;
use crate::fit::FitResult;
use crate::heldout::cross_validation;
use crate::heldout::{mislabelled_runs, rms_by_unit_mm, rms_mm};
use crate::identifiability::weak;
use crate::noise;
use crate::noise::outliers::firsts_at_reversal;
use crate::numerics::rank::Rank;
use crate::parameter_description::parameter_meaning;
use crate::plausibility;
use crate::positioning::{self, diagonal};
use crate::problem::Problem;
use crate::results::{
    Estimate, Finding, Goodness, ModelFit, ModelResult, OfAngles, Outlier, Unobservable, phases_follow_amplitudes,
};
use crate::straightness;
use crate::tolerance::conformity;
use crate::unit::ParameterUnit;

/// The fit in its reported form.
///
/// # Errors
/// If the model cannot be evaluated for the cross-validation.
pub fn report(problem: &Problem, fit: &Fit) -> Result<FitResult, Diagnostic> {
    let plausibility = plausibility::examine(problem, fit);
    let model = model(problem, fit, outcome::goodness(problem, fit), None)?;
    let mut warnings = problem.session.warnings.clone();
    warnings.extend(plausibility::warnings(&plausibility));
    warnings.extend(plausibility::coefficients::warnings(problem, fit));
    warnings.extend(model.outcome.contradicted_noise().map(str::to_string));
    warnings.extend(noise::rigid_targets(problem));
    warnings.extend(noise::silent_channels(problem, &fit.residuals, model.rank));
    warnings.extend(mislabelled_runs(&problem.tests));
    warnings.extend(enlargement_warning(fit.u_enlargement));
    warnings.extend(assume::statements(problem));
    let circular = circular::of_session(&problem.session, problem.noise.sigma_mm, &problem.rejected);
    let diagonals = diagonal::of_session(&problem.session, &problem.rejected);
    Ok(FitResult {
        conformity: conformity(&problem.session, &model, &circular),
        circular,
        positioning: positioning::of_session(&problem.session, &problem.rejected),
        largest_of_diagonals: diagonal::largest(&diagonals),
        diagonals,
        straightness: straightness::of_session(&problem.session, &problem.rejected),
        model,
        frames: frames::frames(problem, fit),
        plausibility,
        warnings,
        about: problem.session.about.iter().cloned().collect(),
        base: None,
        tpoint: None,
        monte_carlo: None,
    })
}

/// How a search judges a model: on the readings that count at its end, and by its own held-out error.
#[derive(Clone, Copy)]
pub struct JudgedBy<'j> {
    /// The problem whose excluded readings do not count.
    pub readings: &'j Problem,
    /// The held-out error by the folds of the search, mm.
    pub heldout_mm: Option<f64>,
}

/// The result of a model with its goodness, which a search may know better than the fit alone.
///
/// # Errors
/// If the model cannot be evaluated for the cross-validation.
pub fn model(
    problem: &Problem,
    fit: &Fit,
    goodness: Goodness,
    judged_by: Option<JudgedBy<'_>>,
) -> Result<ModelResult, Diagnostic> {
    let JudgedBy { readings: judged, heldout_mm } =
        judged_by.unwrap_or(JudgedBy { readings: problem, heldout_mm: None });
    let (rms, held, of_angles) = rms_of_units(problem, judged, fit, heldout_mm);
    let in_3d = |rms: f64| problem.are_vectors().then(|| rms * 3.0_f64.sqrt() * 1e3);
    let determined = Determined::of(problem, fit)?;
    let mut parameters = parameters(problem, fit);
    determined.mark(problem, &mut parameters, goodness);
    Ok(ModelResult {
        noise: problem.reading_noise(),
        of_angles,
        noise_ar_coefficients: problem.noise.ar_coefficients.clone(),
        fit: ModelFit {
            readings: problem.readings(),
            rms_um: rms * 1e3,
            heldout_rms_um: held * 1e3,
            u_enlargement: fit.u_enlargement,
        },
        rms_3d_um: in_3d(rms),
        heldout_rms_3d_um: in_3d(held),
        heldout_by: problem.folds.kind.words().to_string(),
        cross_validation: cross_validation(problem, fit, held, judged)?,
        rank: fit.rank.identifiable_basis.ncols(),
        parameter_count: fit.beta.len(),
        chi_square: fit.chi_square,
        degrees_of_freedom: fit.degrees_of_freedom,
        birge_ratio: fit.birge_ratio,
        outcome: outcome::outcome(problem, fit, goodness, &determined),
        identifiable: ids(&parameters),
        covariance: covariance::of_parameters(problem, fit, &parameters),
        unobservable: unobservable(problem, &fit.rank),
        null_space: covariance::null_space(problem, &fit.rank),
        outliers: outliers(problem, fit),
        parameters,
    })
}

/// Root mean square of the residuals and of the held-out residuals of a fit, mm: of the lengths, if there are angles too,
/// whose figures are apart. The held-out error of a search has the proportion of lengths and angles of the fit.
fn rms_of_units(
    problem: &Problem,
    judged: &Problem,
    fit: &Fit,
    heldout_mm: Option<f64>,
) -> (f64, f64, Option<OfAngles>) {
    let scale = heldout_mm.map_or(1.0, |mm| mm / fit.held_out.rms_mm);
    let arcsec = |mm: f64| mm / judged.session.lever_mm * ARCSEC_PER_RAD;
    match [&fit.residuals, &fit.held_out.residuals].map(|residuals| rms_by_unit_mm(judged, residuals)) {
        [[Some(rms), Some(of_angles)], [Some(held), Some(held_of_angles)]] => {
            let of_angles = OfAngles {
                noise_arcsec: arcsec(problem.noise.sigma_mm),
                rms_arcsec: arcsec(of_angles),
                heldout_rms_arcsec: arcsec(held_of_angles) * scale,
            };
            (rms, held * scale, Some(of_angles))
        }
        _ => {
            let held = heldout_mm.unwrap_or_else(|| rms_mm(judged, &fit.held_out.residuals));
            (rms_mm(judged, &fit.residuals), held, None)
        }
    }
}

/// The identifiable parameters, in display units, with uncertainties that cover aliases and positions of steps. A harmonic
/// has amplitude and phase of `amplitude · cos(order · angle + phase)`.
pub fn parameters(problem: &Problem, fit: &Fit) -> Vec<Estimate> {
    let mut parameters = parameters_of_noise(problem, fit);
    cover::cover(&mut parameters, problem, fit);
    parameters
}

/// The same with the uncertainties from the noise alone.
pub(crate) fn parameters_of_noise(problem: &Problem, fit: &Fit) -> Vec<Estimate> {
    let list = &problem.parameters.list;
    let u_internal = |j: usize| fit.covariance[(j, j)].max(0.0).sqrt() * fit.u_enlargement;
    let mut results = Vec::new();
    for quantity in quantities(problem, fit) {
        match quantity {
            Quantity::Harmonic(j) => results.extend(amplitude_and_phase(problem, fit, j)),
            Quantity::Rms(j, count) => results.push(rms_of_spectrum(problem, fit, j, count)),
            Quantity::Position(k) => results.push(position(problem, &fit.positions[k])),
            Quantity::Parameter(j) => {
                let unit = &list[j].unit;
                let value = problem.parameters.value(j, &fit.beta) * unit.display_per_internal;
                let u = u_internal(j) * unit.display_per_internal;
                let mut result = Estimate::new(list[j].id.clone(), value, u, &unit.name)
                    .with_meaning(parameter_meaning(problem, j, None));
                let interval = fit.intervals.iter().find(|interval| interval.parameter == j);
                result.interval_95 =
                    interval.map(|interval| interval.ends.map(|end| value + end * unit.display_per_internal));
                results.push(result);
            }
        }
    }
    results
}

/// An estimated position of a step, in the unit of its driver.
fn position(problem: &Problem, position: &StepPosition) -> Estimate {
    let StepPosition { effect: number, step, u, interval_95, .. } = *position;
    let effect = &problem.parameters.effects[number];
    let ParameterUnit { name, display_per_internal } = ParameterUnit::of_number(&problem.session, effect);
    let [value, u] = [effect.shape.positions()[step], u].map(|value| value * display_per_internal);
    let place = (effect.shape.positions().len() > 1).then_some(step + 1);
    let id = ParameterId::Effect(Arc::clone(&problem.parameters.effect_ids[number]), Part::Position(place));
    let which = place.map_or("position".to_string(), |place| format!("position {place}"));
    let meaning = format!("{}, {which}", meaning(&problem.session.machine, effect));
    let interval_95 = interval_95.map(|ends| ends.map(|end| end * display_per_internal));
    Estimate { interval_95, ..Estimate::new(id, value, u, &name).with_meaning(meaning) }
}

/// The rms of a spectrum over a period, with the uncertainty by propagation.
fn rms_of_spectrum(problem: &Problem, fit: &Fit, first: usize, count: usize) -> Estimate {
    let parameter = &problem.parameters.list[first];
    let own = &fit.beta[first..first + count];
    let rms = rms_of_waves(own);
    let slopes: Vec<(usize, f64)> = (first..).zip(slopes_of_rms(own)).collect();
    let products = slopes.iter().flat_map(|(j, a)| slopes.iter().map(move |(k, b)| a * b * fit.covariance[(*j, *k)]));
    let variance: f64 = products.sum();
    let display = parameter.unit.display_per_internal;
    let u = variance.max(0.0).sqrt() * fit.u_enlargement * display;
    Estimate::new(parameter.id.with_part(Part::Rms), rms * display, u, &parameter.unit.name)
        .with_meaning(parameter_meaning(problem, first, Some(&Part::Rms)))
}

fn amplitude_and_phase(problem: &Problem, fit: &Fit, j: usize) -> [Estimate; 2] {
    let (a, b) = (fit.beta[j], fit.beta[j + 1]);
    let cov = |p: usize, q: usize| fit.covariance[(p, q)] * fit.u_enlargement.powi(2);
    let amplitude = a.hypot(b);
    let (ca, sa) = if amplitude > 0.0 { (a / amplitude, b / amplitude) } else { (1.0, 0.0) };
    let along = ca * ca * cov(j, j) + 2.0 * ca * sa * cov(j, j + 1) + sa * sa * cov(j + 1, j + 1);
    let across = sa * sa * cov(j, j) - 2.0 * ca * sa * cov(j, j + 1) + ca * ca * cov(j + 1, j + 1);
    let unit = &problem.parameters.list[j].unit;
    let u_phase = if amplitude > 0.0 {
        (across.max(0.0).sqrt() / amplitude).to_degrees().min(u_of_undetermined_phase_deg())
    } else {
        u_of_undetermined_phase_deg()
    };
    let display = unit.display_per_internal;
    let u_amplitude = along.max(0.0).sqrt() * display;
    let result = |part: Part, value: f64, u: f64, unit: &str| {
        let meaning = parameter_meaning(problem, j, Some(&part));
        Estimate::new(problem.parameters.list[j].id.with_part(part), value, u, unit).with_meaning(meaning)
    };
    let mut pair = [
        result(Part::Amplitude, amplitude * display, u_amplitude, &unit.name),
        result(Part::Phase, (-b).atan2(a).to_degrees(), u_phase, "deg"),
    ];
    phases_follow_amplitudes(&mut pair);
    pair
}

/// The identifiers of parameters that have a column of the Jacobian: positions of steps have none and count in no rank.
fn ids(parameters: &[Estimate]) -> Vec<String> {
    parameters.iter().filter(|own| !own.is(ParameterId::is_position)).map(|own| own.id.clone()).collect()
}

/// The null-space combinations, in display units and in words.
pub fn unobservable(problem: &Problem, rank: &Rank) -> Vec<Unobservable> {
    let list = &problem.parameters.list;
    let rows = rank.null_combinations.iter().zip(&rank.pivots).zip(&rank.weak_u);
    rows.map(|((row, pivot), weak_u)| {
        let others = (0..row.len()).filter(|j| j != pivot && row[*j] != 0.0);
        let displayed: Vec<(usize, f64)> = std::iter::once(*pivot)
            .chain(others)
            .map(|j| (j, row[j] * list[j].size * list[j].unit.display_per_internal))
            .collect();
        let leading = displayed.first().map_or(1.0, |(_, value)| *value);
        let combination = displayed.iter().map(|(j, value)| (list[*j].id.to_string(), value / leading)).collect();
        let leader = &list[*pivot];
        let others: Vec<String> = displayed[1..].iter().map(|(j, _)| list[*j].id.to_string()).collect();
        let (finding, why) = match weak_u {
            Some(u) => (Finding::Weak, weak(leader, &others, *u)),
            None if others.is_empty() => {
                (Finding::Structural, format!("no reading of these tests changes with {}", leader.id))
            }
            None => {
                let others = others.join(", ");
                let words = "null-space direction, in this proportion they leave every reading unchanged";
                (Finding::Structural, format!("{} is confounded with {others}: {words}", leader.id))
            }
        };
        Unobservable { combination, finding, why }
    })
    .collect()
}

/// The excluded outliers, by test, file and line.
pub fn outliers(problem: &Problem, fit: &Fit) -> Vec<Outlier> {
    let mut list = Vec::new();
    for (number, test) in problem.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        let (origin, channels) = (readings.origin.as_ref(), problem.channels(number));
        let firsts = firsts_at_reversal(readings);
        for row in (0..readings.rows()).filter(|row| problem.rejected[number][*row]) {
            let residual = &fit.residuals[number][row * channels..(row + 1) * channels];
            list.push(Outlier {
                test: test.name.clone(),
                file: origin.map_or(String::new(), |origin| origin.file.display().to_string()),
                line: readings.line(row).unwrap_or(0),
                residual_um: residual.iter().map(|v| v * v).sum::<f64>().sqrt() * 1e3,
                first_at_reversal: firsts.contains(&row),
            });
        }
    }
    list
}
