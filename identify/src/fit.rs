//! Estimation of the parameters of a session from its readings.
//!
//! The rank is decided on the linearisation at the nominal machine. Gauss–Newton then iterates in the identifiable directions only. A
//! non-identifiable combination keeps its nominal value and is reported as a combination, never as a number. The law of propagation gives
//! the uncertainties, `Cov = N (Nᵀ JᵀV⁻¹J N)⁻¹ Nᵀ`. The columns of `N` span the identifiable directions (JCGM 100, 5.2; JCGM 102, 6.2).

use std::cell::RefCell;
use std::collections::BTreeMap;

use abbe_model::effect::Effect;
use abbe_model::session::Session;
use abbe_model::session::limits::MIN_UM;
use faer::Mat;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::covariance;
use crate::error::IdentifyError;
use crate::heldout::{HeldOut, held_out, mislabelled_runs, rms_mm};
use crate::least_squares::{LeastSquares, Scaling, minimise};
use crate::noise::{self, Noise, NoiseSource, PureError};
use crate::parameter_description::parameter_meaning;
use crate::parameters::Role;
use crate::plausibility;
use crate::preference::pivot_preference;
use crate::problem::Problem;
use crate::rank::Rank;
use crate::results::{FitResult, Outlier, ParameterResult, Unobservable, phases_follow_amplitudes};
use crate::triangle::Triangle;

/// The result of a fit, in internal units.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Estimates of all parameters. A parameter in a null-space combination holds its identifiable part only.
    pub beta: Vec<f64>,
    /// Identifiable and null directions.
    pub rank: Rank,
    /// Covariance of the parameters (identifiable part), from the noise alone.
    pub covariance: Mat<f64>,
    /// The triangular factors of the folds at the solution.
    pub triangles: Vec<Triangle>,
    /// Residuals by test, mm.
    pub residuals: Vec<Vec<f64>>,
    /// Held-out residuals.
    pub held_out: HeldOut,
    /// χ², with each prior as an observation.
    pub chi_square: f64,
    /// Degrees of freedom of χ², at least 1.
    pub degrees_of_freedom: usize,
    /// The Birge ratio `√(χ²/ν)`. It is below 1 if the readings scatter less than the assumed noise.
    pub birge_ratio: f64,
    /// Factor on the standard uncertainties: the Birge ratio if it is significantly above 1, else 1.
    pub u_enlargement: f64,
}

/// Start value of the noise standard deviation if neither session nor repeats give one: 1 µm.
const START_NOISE_MM: f64 = 1e-3;
/// Least estimate of the noise standard deviation. Computed readings repeat exactly, but are still rounded.
const MIN_NOISE_MM: f64 = MIN_UM * 1e-3;
/// Maximum number of rounds that re-estimate noise and outliers.
const MAX_ROUNDS: usize = 6;
/// Relative change of the noise standard deviation at which the rounds stop.
const NOISE_TOLERANCE: f64 = 1e-4;
/// Significance level of the χ² test of the residual against the noise.
const BIRGE_SIGNIFICANCE: f64 = 1e-3;

/// The least-squares problem of a session, restricted to the identifiable directions.
struct IdentifiableDirections<'p, 'a> {
    problem: &'p Problem<'a>,
    basis: &'p Mat<f64>,
    /// The last linearisation: the parameters, and the triangular factors of the folds at these values.
    last: RefCell<(Vec<f64>, Vec<Triangle>)>,
}

impl IdentifiableDirections<'_, '_> {
    fn beta(&self, z: &[f64]) -> Vec<f64> {
        (0..self.basis.nrows())
            .map(|j| (0..z.len()).map(|k| self.basis[(j, k)] * z[k]).sum())
            .collect()
    }
}

impl LeastSquares for IdentifiableDirections<'_, '_> {
    fn parameters(&self) -> usize {
        self.basis.ncols()
    }

    fn linearise(&self, z: &[f64]) -> Result<Triangle, IdentifyError> {
        let beta = self.beta(z);
        if self.last.borrow().0 != beta {
            let triangles = self.problem.triangles(&beta)?;
            self.last.replace((beta, triangles));
        }
        let (beta, triangles) = &*self.last.borrow();
        Ok(in_directions(&whole(self.problem, beta, triangles), self.basis))
    }

    fn sum_of_squares(&self, z: &[f64]) -> f64 {
        self.problem.sum_of_squares(&self.beta(z))
    }
}

/// The triangular factor of all readings and priors.
pub(crate) fn whole(problem: &Problem<'_>, beta: &[f64], triangles: &[Triangle]) -> Triangle {
    let mut whole = problem.prior_triangle(beta);
    triangles.iter().for_each(|triangle| whole.merge(triangle));
    whole
}

/// The triangular factor of `[J·N | r]` from that of `[J | r]`.
pub fn in_directions(triangle: &Triangle, basis: &Mat<f64>) -> Triangle {
    let (r, c, rest) = triangle.parts();
    let (n, rank) = (basis.nrows(), basis.ncols());
    let reduced = &r * basis;
    let rows = Mat::from_fn(n + 1, rank + 1, |i, j| match (i == n, j == rank) {
        (true, true) => rest.sqrt(),
        (true, false) => 0.0,
        (false, true) => c[i],
        (false, false) => reduced[(i, j)],
    });
    let mut result = Triangle::new(rank);
    result.absorb(rows.as_ref());
    result
}

/// Prepares and fits a session. The noise is the stated one, that of repeats, or that of the residual. Outliers are excluded.
///
/// # Errors
/// See [`Problem::new`]; also if the iterations do not converge.
pub fn prepare(session: &Session, seed: u64) -> Result<(Problem<'_>, Fit), IdentifyError> {
    prepare_with(session, &[], seed)
}

/// As [`prepare`], for the session with further declared effects. Noise, outliers and rank are exactly those of a session that declares
/// them.
///
/// # Errors
/// See [`prepare`].
pub fn prepare_with<'a>(
    session: &'a Session,
    effects: &[Effect],
    seed: u64,
) -> Result<(Problem<'a>, Fit), IdentifyError> {
    let stated = session.noise_mm.filter(|sigma| *sigma > 0.0);
    let floor = session.resolution_mm.unwrap_or(0.0) / 12.0_f64.sqrt();
    let first = match stated {
        Some(sigma) => Noise::white(sigma, NoiseSource::Stated),
        None => Noise::white(START_NOISE_MM.max(floor), NoiseSource::Residual),
    };
    let mut problem = Problem::new(session, first, seed)?;
    for effect in effects {
        problem.add_effect(effect)?;
    }
    if stated.is_none() {
        problem.noise = Noise::white(
            nominal_residual_mm(&problem)?.max(floor).max(MIN_NOISE_MM),
            NoiseSource::Residual,
        );
    }
    let mut fit = plausibility::checked(&problem, fit(&problem, None))?;
    // Noise and outliers depend on the residuals, and the residuals on the fit. The returned fit always uses the returned noise.
    for _ in 0..MAX_ROUNDS {
        let rejected = crate::outliers::reject(&problem, &fit);
        let unchanged = rejected == problem.rejected;
        problem.rejected = rejected;
        let noise = match stated {
            Some(_) => problem.noise.clone(),
            None => estimated_noise(&problem, &fit, floor),
        };
        let settled = (noise.sigma_mm / problem.noise.sigma_mm - 1.0).abs() < NOISE_TOLERANCE;
        if settled && unchanged {
            break;
        }
        problem.noise = noise;
        fit = plausibility::checked(&problem, self::fit(&problem, Some(&fit.beta)))?;
    }
    Ok((problem, fit))
}

/// Root mean square of the residual of the nominal machine, mm, after a linearised fit of the set-up quantities. It serves as the noise in
/// the first decision on the rank. Machine errors are excluded: in a socket session, shrinking the machine to a point would explain every
/// reading.
fn nominal_residual_mm(problem: &Problem<'_>) -> Result<f64, IdentifyError> {
    let list = &problem.parameters.list;
    let nominal = vec![0.0; list.len()];
    let mut whole = Triangle::new(list.len());
    for triangle in problem.triangles(&nominal)? {
        whole.merge(&triangle);
    }
    let (r, c, rest) = whole.parts();
    let setups: Vec<usize> = (0..list.len()).filter(|j| list[*j].role == Role::Setup).collect();
    let rows = Mat::from_fn(list.len(), setups.len() + 1, |i, j| match setups.get(j) {
        Some(setup) => r[(i, *setup)],
        None => c[i],
    });
    let mut setup_factor = Triangle::new(setups.len());
    setup_factor.absorb(rows.as_ref());
    let count = (problem.readings() * problem.coordinates()) as f64;
    let sum_of_squares = setup_factor.parts().2 + rest;
    Ok((sum_of_squares / count.max(1.0)).sqrt() * problem.noise.sigma_mm)
}

fn estimated_noise(problem: &Problem<'_>, fit: &Fit, floor: f64) -> Noise {
    let pure = PureError::of(&problem.tests, &fit.residuals, |test, row| {
        !problem.rejected[test][row]
    });
    if let Some(sigma) = pure.sigma_mm() {
        return Noise::white(sigma.max(floor).max(MIN_NOISE_MM), NoiseSource::Repeats);
    }
    let count = (problem.readings() * problem.coordinates()) as f64;
    let freedom = (count - fit.rank.identifiable_basis.ncols() as f64).max(1.0);
    let sigma = rms_mm(problem, &fit.residuals) * (count / freedom).sqrt();
    Noise::white(sigma.max(floor).max(MIN_NOISE_MM), NoiseSource::Residual)
}

/// Fits a problem, starting from the nominal machine or from given parameters.
///
/// # Errors
/// If there are no parameters, the model cannot be evaluated, or the iterations do not converge.
pub fn fit(problem: &Problem<'_>, start: Option<&[f64]>) -> Result<Fit, IdentifyError> {
    let parameter_count = problem.parameters.list.len();
    let size: Vec<f64> = problem
        .parameters
        .list
        .iter()
        .map(|parameter| parameter.size)
        .collect();
    let nominal = vec![0.0; parameter_count];
    let triangles = problem.triangles(&nominal)?;
    let preference = pivot_preference(&problem.parameters.list);
    let rank = Rank::decide(
        whole(problem, &nominal, &triangles).parts().0.as_ref(),
        &size,
        &preference,
    )?;
    let restricted = IdentifiableDirections {
        problem,
        basis: &rank.identifiable_basis,
        last: RefCell::new((nominal, triangles)),
    };
    let mut end = None;
    if rank.identifiable_basis.ncols() > 0 {
        let scale = Scaling::Physical(vec![1.0; rank.identifiable_basis.ncols()]);
        let from = start.map_or_else(
            || vec![0.0; rank.identifiable_basis.ncols()],
            |beta| rank.coordinates(beta, &size),
        );
        end = Some(restricted.beta(&minimise(&restricted, &from, &scale)?.x));
    }
    let (last, triangles) = restricted.last.into_inner();
    let beta = end.unwrap_or_else(|| last.clone());
    // After the last linearisation the parameters move by a step at which nonlinearity is negligible.
    let step: Vec<f64> = beta.iter().zip(&last).map(|(end, last)| end - last).collect();
    let triangles = triangles.iter().map(|triangle| triangle.after(&step)).collect();
    finish(problem, beta, triangles, rank)
}

/// Computes covariance, residuals, cross-validation and χ² at the solution.
fn finish(
    problem: &Problem<'_>,
    beta: Vec<f64>,
    triangles: Vec<Triangle>,
    rank: Rank,
) -> Result<Fit, IdentifyError> {
    let whole = whole(problem, &beta, &triangles);
    let covariance = self::covariance(&whole, &rank.identifiable_basis)?;
    let residuals = problem.residuals(&beta);
    let held_out = held_out(problem, &beta, &triangles, &whole, &rank.identifiable_basis)?;
    let zero = vec![0.0; beta.len()];
    let chi_square: f64 = whole.sum_of_squares_after(&zero);
    // Each prior counts as an observation in χ².
    let degrees_of_freedom = (problem.readings() * problem.coordinates() + problem.prior_rows())
        .saturating_sub(rank.identifiable_basis.ncols())
        .max(1);
    let free = degrees_of_freedom as f64;
    Ok(Fit {
        beta,
        rank,
        covariance,
        triangles,
        residuals,
        held_out,
        chi_square,
        degrees_of_freedom,
        birge_ratio: (chi_square / free).sqrt(),
        u_enlargement: u_enlargement(chi_square, free),
    })
}

/// Factor on the standard uncertainties: the Birge ratio `√(χ²/ν)` if it is significantly above 1, else 1.
pub(crate) fn u_enlargement(chi_square: f64, free: f64) -> f64 {
    let significance = ChiSquared::new(free).map(|law| law.sf(chi_square)).unwrap_or(1.0);
    if significance < BIRGE_SIGNIFICANCE {
        (chi_square / free).sqrt().max(1.0)
    } else {
        1.0
    }
}

/// The warning about enlarged uncertainties, if they are enlarged.
pub(crate) fn enlargement_warning(enlargement: f64) -> Option<String> {
    (enlargement > 1.0).then(|| {
        format!(
            "the residual exceeds the noise (χ² is {:.2} times its degrees of freedom); uncertainties are enlarged by {enlargement:.2}; \
             trace the residual to find the unmodelled effect",
            enlargement.powi(2)
        )
    })
}

/// `N (NᵀRᵀRN)⁻¹ Nᵀ`.
pub(crate) fn covariance(triangle: &Triangle, basis: &Mat<f64>) -> Result<Mat<f64>, IdentifyError> {
    let n = basis.nrows();
    if basis.ncols() == 0 {
        return Ok(Mat::zeros(n, n));
    }
    let (r, _, _) = triangle.parts();
    let reduced = &r * basis;
    let svd = reduced.svd().map_err(|_| IdentifyError::Decomposition)?;
    let singular: Vec<f64> = svd.S().column_vector().iter().copied().collect();
    let negligible = singular[0] * 1e-14;
    let spread = basis * svd.V();
    let scaled = Mat::from_fn(n, singular.len(), |i, k| {
        if singular[k] > negligible {
            spread[(i, k)] / singular[k]
        } else {
            0.0
        }
    });
    Ok(&scaled * scaled.transpose())
}

/// The fit in its reported form.
pub fn report(problem: &Problem<'_>, fit: &Fit) -> FitResult {
    let three = problem.coordinates() == 3;
    let rms = rms_mm(problem, &fit.residuals);
    let held = fit.held_out.rms_mm;
    let in_3d = |rms: f64| three.then(|| rms * 3.0_f64.sqrt() * 1e3);
    let plausibility = plausibility::examine(problem, fit);
    let mut warnings = problem.session.warnings.clone();
    warnings.extend(plausibility::warnings(&plausibility));
    warnings.extend(noise::stated_against_repeats(problem, &fit.residuals));
    warnings.extend(mislabelled_runs(&problem.tests));
    warnings.extend(enlargement_warning(fit.u_enlargement));
    let parameters = parameters(problem, fit);
    FitResult {
        noise_um: problem.noise.sigma_mm * 1e3,
        noise_source: problem.noise.source.word().to_string(),
        noise_ar_coefficients: problem.noise.ar_coefficients.clone(),
        readings: problem.readings(),
        rms_um: rms * 1e3,
        heldout_rms_um: held * 1e3,
        rms_3d_um: in_3d(rms),
        heldout_rms_3d_um: in_3d(held),
        heldout_by: problem.folds.kind.words().to_string(),
        rank: fit.rank.identifiable_basis.ncols(),
        parameter_count: fit.beta.len(),
        chi_square: fit.chi_square,
        degrees_of_freedom: fit.degrees_of_freedom,
        birge_ratio: fit.birge_ratio,
        u_enlargement: fit.u_enlargement,
        identifiable: ids(&parameters),
        covariance: covariance::of_parameters(problem, fit, &parameters),
        parameters,
        unobservable: unobservable(problem, &fit.rank),
        null_space: covariance::null_space(problem, &fit.rank),
        outliers: outliers(problem, fit),
        circular: crate::circular::of_session(problem.session, problem.noise.sigma_mm, &problem.rejected),
        plausibility,
        warnings,
        about: problem.session.about.iter().cloned().collect(),
        monte_carlo: None,
    }
}

/// A reported quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// A parameter, by index.
    Parameter(usize),
    /// Amplitude and phase of a harmonic, by the index of its cosine coefficient.
    Harmonic(usize),
}

/// The reported quantities in their order: those of the identifiable parameters.
pub(crate) fn quantities(problem: &Problem<'_>, rank: &Rank) -> Vec<Quantity> {
    let list = &problem.parameters.list;
    let mut quantities = Vec::new();
    let mut j = 0;
    while j < list.len() {
        if let Role::Coefficient {
            effect,
            coefficient: 0,
        } = list[j].role
        {
            let effect = &problem.parameters.effects[effect];
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
        j += 1;
    }
    quantities
}

/// Passes the reported quantities at the parameters `beta` to a function, in display units, amplitude before phase. Each phase lies within
/// half a turn of the fit's phase.
pub(crate) fn values_at(
    problem: &Problem<'_>,
    fit: &Fit,
    quantities: &[Quantity],
    beta: &[f64],
    mut accept: impl FnMut(f64),
) {
    let list = &problem.parameters.list;
    for quantity in quantities {
        match *quantity {
            Quantity::Parameter(j) => accept(beta[j] * list[j].unit.display_per_internal),
            Quantity::Harmonic(j) => {
                accept(beta[j].hypot(beta[j + 1]) * list[j].unit.display_per_internal);
                let (a, b) = (fit.beta[j], fit.beta[j + 1]);
                let off = (b * beta[j] - a * beta[j + 1]).atan2(a * beta[j] + b * beta[j + 1]);
                accept(((-b).atan2(a) + off).to_degrees());
            }
        }
    }
}

/// The identifiable parameters, in display units. A harmonic has amplitude and phase of `amplitude · cos(order · angle + phase)`.
pub fn parameters(problem: &Problem<'_>, fit: &Fit) -> Vec<ParameterResult> {
    let list = &problem.parameters.list;
    let u_internal = |j: usize| fit.covariance[(j, j)].max(0.0).sqrt() * fit.u_enlargement;
    let mut results = Vec::new();
    for quantity in quantities(problem, &fit.rank) {
        match quantity {
            Quantity::Harmonic(j) => results.extend(amplitude_and_phase(problem, fit, j)),
            Quantity::Parameter(j) => {
                let unit = &list[j].unit;
                let value = fit.beta[j] * unit.display_per_internal;
                let u = u_internal(j) * unit.display_per_internal;
                results.push(
                    ParameterResult::new(&list[j].id, value, u, &unit.name)
                        .with_meaning(parameter_meaning(problem, j, None)),
                );
            }
        }
    }
    results
}

fn amplitude_and_phase(problem: &Problem<'_>, fit: &Fit, j: usize) -> [ParameterResult; 2] {
    let id = problem.parameters.list[j].id.trim_end_matches(".cos");
    let (a, b) = (fit.beta[j], fit.beta[j + 1]);
    let cov = |p: usize, q: usize| fit.covariance[(p, q)] * fit.u_enlargement.powi(2);
    let amplitude = a.hypot(b);
    let (ca, sa) = if amplitude > 0.0 {
        (a / amplitude, b / amplitude)
    } else {
        (1.0, 0.0)
    };
    let along = ca * ca * cov(j, j) + 2.0 * ca * sa * cov(j, j + 1) + sa * sa * cov(j + 1, j + 1);
    let across = sa * sa * cov(j, j) - 2.0 * ca * sa * cov(j, j + 1) + ca * ca * cov(j + 1, j + 1);
    let unit = &problem.parameters.list[j].unit;
    let u_phase = if amplitude > 0.0 {
        (across.max(0.0).sqrt() / amplitude)
            .to_degrees()
            .min(u_of_undetermined_phase_deg())
    } else {
        u_of_undetermined_phase_deg()
    };
    let display = unit.display_per_internal;
    let u_amplitude = along.max(0.0).sqrt() * display;
    let result = |name: &str, value: f64, u: f64, unit: &str| {
        ParameterResult::new(format!("{id}.{name}"), value, u, unit).with_meaning(parameter_meaning(
            problem,
            j,
            Some(name),
        ))
    };
    let mut pair = [
        result("amplitude", amplitude * display, u_amplitude, &unit.name),
        result("phase", (-b).atan2(a).to_degrees(), u_phase, "deg"),
    ];
    phases_follow_amplitudes(&mut pair);
    pair
}

/// The identifiers of parameters.
pub(crate) fn ids(parameters: &[ParameterResult]) -> Vec<String> {
    parameters.iter().map(|parameter| parameter.id.clone()).collect()
}

/// Standard uncertainty of an undetermined phase, °: the standard deviation of a uniform distribution over one turn.
pub(crate) fn u_of_undetermined_phase_deg() -> f64 {
    180.0 / 3.0_f64.sqrt()
}

/// The null-space combinations, in display units and in words.
pub fn unobservable(problem: &Problem<'_>, rank: &Rank) -> Vec<Unobservable> {
    let list = &problem.parameters.list;
    rank.null_combinations
        .iter()
        .zip(&rank.pivots)
        .map(|(row, pivot)| {
            let others = (0..row.len()).filter(|j| j != pivot && row[*j] != 0.0);
            let displayed: Vec<(usize, f64)> = std::iter::once(*pivot)
                .chain(others)
                .map(|j| (j, row[j] * list[j].size * list[j].unit.display_per_internal))
                .collect();
            let leading = displayed.first().map_or(1.0, |(_, value)| *value);
            let combination: BTreeMap<String, f64> = displayed
                .iter()
                .map(|(j, value)| (list[*j].id.clone(), value / leading))
                .collect();
            let why = match displayed.as_slice() {
                [(j, _)] => format!("no reading of these tests changes with {}", list[*j].id),
                [(first, _), rest @ ..] => {
                    let others: Vec<&str> = rest.iter().map(|(j, _)| list[*j].id.as_str()).collect();
                    format!(
                        "{} is confounded with {}: null-space direction, in this proportion they leave every reading unchanged",
                        list[*first].id,
                        others.join(", ")
                    )
                }
                [] => String::new(),
            };
            Unobservable { combination, why }
        })
        .collect()
}

/// The excluded outliers, by test, file and line.
pub fn outliers(problem: &Problem<'_>, fit: &Fit) -> Vec<Outlier> {
    let coordinates = problem.coordinates();
    let mut list = Vec::new();
    for (number, test) in problem.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        for row in (0..readings.rows()).filter(|row| problem.rejected[number][*row]) {
            let residual = &fit.residuals[number][row * coordinates..(row + 1) * coordinates];
            list.push(Outlier {
                test: test.name.clone(),
                file: readings.file.display().to_string(),
                line: readings.line.get(row).copied().unwrap_or(0),
                residual_um: residual.iter().map(|v| v * v).sum::<f64>().sqrt() * 1e3,
            });
        }
    }
    list
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_model::driver::Driver;
    use abbe_model::effect::shape::Harmonic;
    use abbe_model::effect::{Component, Shape};
    use abbe_model::session::read::{self, ReadOptions};

    use super::*;

    /// `A cos(nC + φ)` has the coefficients `A cos φ` and `−A sin φ`.
    #[test]
    fn amplitude_and_phase_of_a_harmonic_follow_from_its_coefficients() {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = read::session(&file, &ReadOptions::default()).unwrap();
        let (mut problem, _) = prepare(&session, 1).unwrap();
        problem
            .add_effect(&Effect {
                component: Component::parse("EZC").unwrap(),
                driver: Driver::parse("C"),
                shape: Shape::Harmonic(Harmonic { order: 3.0 }),
                tests: Vec::new(),
            })
            .unwrap();
        let mut fit = fit(&problem, None).unwrap();
        let quantities = quantities(&problem, &fit.rank);
        let (place, j) = quantities
            .iter()
            .enumerate()
            .find_map(|(place, quantity)| match quantity {
                Quantity::Harmonic(j) => Some((place, *j)),
                Quantity::Parameter(_) => None,
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
            assert!(
                (values[place + 1] - other_deg).abs() < 1e-9,
                "{} and {other_deg}",
                values[place + 1]
            );
        }
    }
}
