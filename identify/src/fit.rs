//! Identify: the unknowns of a session from its readings.
//!
//! The rank is decided on the linearisation at the nominal machine; Gauss–Newton then moves in the seen directions only, so that what cannot
//! be seen stays at its nominal value and is reported as a combination, never as a number. Uncertainties follow from the law of propagation,
//! `Cov = N (Nᵀ JᵀV⁻¹J N)⁻¹ Nᵀ` with `N` the seen directions (JCGM 100, 5.2; JCGM 102, 6.2).

use std::cell::RefCell;
use std::collections::BTreeMap;

use abbe_model::effect::{Effect, Shape};
use abbe_model::session::Session;
use abbe_model::session::limits::MIN_UM;
use faer::Mat;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::error::IdentifyError;
use crate::heldout::{HeldOut, held_out, mislabelled_runs, rms_mm};
use crate::least_squares::{LeastSquares, Scaling, minimise};
use crate::noise::{self, Noise, NoiseSource, PureError};
use crate::parameters::Role;
use crate::plausibility;
use crate::preference::pivot_preference;
use crate::problem::Problem;
use crate::rank::Rank;
use crate::results::{FitResult, ParameterResult, Rejected, Unobservable};
use crate::triangle::Triangle;

/// What a fit found, internal units.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Every unknown; those in unseen combinations hold the part that is seen.
    pub beta: Vec<f64>,
    /// What is seen and what is not.
    pub rank: Rank,
    /// Covariance of the unknowns (seen part), from the noise alone.
    pub covariance: Mat<f64>,
    /// The triangles of the folds at the solution.
    pub triangles: Vec<Triangle>,
    /// Residuals by test, mm.
    pub residuals: Vec<Vec<f64>>,
    /// On readings that were left out.
    pub held_out: HeldOut,
    /// The Birge ratio `√(χ²/ν)`: residual over noise; below 1 where readings scatter less than the noise says.
    pub birge_ratio: f64,
    /// By how much uncertainties are enlarged: the Birge ratio where it is significantly above 1, else 1.
    pub u_enlargement: f64,
}

/// Guess of the noise from which iterations start where nothing is known: 1 µm.
const FIRST_GUESS_MM: f64 = 1e-3;
/// Least noise that is estimated: readings that repeat exactly, as computed ones do, are still rounded.
const MIN_NOISE_MM: f64 = MIN_UM * 1e-3;
/// How many times noise and outliers are found anew at most.
const ROUNDS: usize = 6;
/// Relative change of the noise from which on it is found.
const SETTLED: f64 = 1e-4;
/// Probability below which χ² is taken to say that the residual holds more than noise.
const BIRGE_SIGNIFICANCE: f64 = 1e-3;

/// A session as a problem in the directions that are seen.
struct IdentifiableDirections<'p, 'a> {
    problem: &'p Problem<'a>,
    basis: &'p Mat<f64>,
    /// The last linearisation: the unknowns, and the triangles of the folds there.
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
    fn unknowns(&self) -> usize {
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

/// The triangle of all readings and of what is known beforehand.
pub(crate) fn whole(problem: &Problem<'_>, beta: &[f64], triangles: &[Triangle]) -> Triangle {
    let mut whole = problem.prior_triangle(beta);
    triangles.iter().for_each(|triangle| whole.merge(triangle));
    whole
}

/// The triangle of `[J·N | r]` from that of `[J | r]`.
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

/// A session as a problem, with the noise that the session states, that its repeats show, or that the residual of its fit gives, and with its outliers excluded.
///
/// # Errors
/// See [`Problem::new`]; also if the iterations do not end.
pub fn prepare(session: &Session, seed: u64) -> Result<(Problem<'_>, Fit), IdentifyError> {
    prepare_with(session, &[], seed)
}

/// The same of a session that declares some more effects: noise, outliers and rank are those of the fit of that session, figure for figure.
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
        None => Noise::white(FIRST_GUESS_MM.max(floor), NoiseSource::Residual),
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
    // Noise and outliers follow from residuals, residuals from a fit; a few rounds settle both. What is returned is always a fit with the noise returned.
    for _ in 0..ROUNDS {
        let rejected = crate::outliers::reject(&problem, &fit);
        let unchanged = rejected == problem.rejected;
        problem.rejected = rejected;
        let noise = match stated {
            Some(_) => problem.noise.clone(),
            None => estimated_noise(&problem, &fit, floor),
        };
        let settled = (noise.sigma_mm / problem.noise.sigma_mm - 1.0).abs() < SETTLED;
        if settled && unchanged {
            break;
        }
        problem.noise = noise;
        fit = plausibility::checked(&problem, self::fit(&problem, Some(&fit.beta)))?;
    }
    Ok((problem, fit))
}

/// What the nominal machine leaves as residual, mm, once the set-ups are fitted to it (linearised): noise for a first decision on what is seen. The
/// machine's errors stay out of it: among sockets, shrinking the machine to nothing would explain every reading.
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
    let mut of_setups = Triangle::new(setups.len());
    of_setups.absorb(rows.as_ref());
    let count = (problem.readings() * problem.coordinates()) as f64;
    let sum_of_squares = of_setups.parts().2 + rest;
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
    let freedom = (count - fit.rank.seen.ncols() as f64).max(1.0);
    let sigma = rms_mm(problem, &fit.residuals) * (count / freedom).sqrt();
    Noise::white(sigma.max(floor).max(MIN_NOISE_MM), NoiseSource::Residual)
}

/// Fits a problem, from the nominal machine or from earlier estimates.
///
/// # Errors
/// If there is nothing to fit, the model cannot be evaluated, or the iterations do not end.
pub fn fit(problem: &Problem<'_>, start: Option<&[f64]>) -> Result<Fit, IdentifyError> {
    finish(problem, minimum(problem, start)?)
}

/// Where the sum of squares of readings and priors is least.
pub(crate) struct Minimum {
    /// The estimates, in internal units (mm, rad).
    pub beta: Vec<f64>,
    /// The triangles of the folds at `beta`.
    pub triangles: Vec<Triangle>,
    /// The rank at the nominal machine.
    pub rank: Rank,
}

/// Minimises the sum of squares in the identifiable directions, from the nominal machine or from earlier estimates.
///
/// # Errors
/// If the model cannot be evaluated, or the iterations do not end.
pub(crate) fn minimum(problem: &Problem<'_>, start: Option<&[f64]>) -> Result<Minimum, IdentifyError> {
    let unknowns = problem.parameters.list.len();
    let size: Vec<f64> = problem
        .parameters
        .list
        .iter()
        .map(|parameter| parameter.size)
        .collect();
    let nominal = vec![0.0; unknowns];
    let triangles = problem.triangles(&nominal)?;
    let preference = pivot_preference(&problem.parameters.list);
    let rank = Rank::decide(
        whole(problem, &nominal, &triangles).parts().0.as_ref(),
        &size,
        &preference,
    )?;
    let seen = IdentifiableDirections {
        problem,
        basis: &rank.seen,
        last: RefCell::new((nominal, triangles)),
    };
    let mut end = None;
    if rank.seen.ncols() > 0 {
        let scale = Scaling::Physical(vec![1.0; rank.seen.ncols()]);
        let from = start.map_or_else(
            || vec![0.0; rank.seen.ncols()],
            |beta| rank.coordinates(beta, &size),
        );
        end = Some(seen.beta(&minimise(&seen, &from, &scale)?.x));
    }
    let (last, triangles) = seen.last.into_inner();
    let beta = end.unwrap_or_else(|| last.clone());
    // The iterations end within a step of the last linearisation that is too small for the model to bend.
    let step: Vec<f64> = beta.iter().zip(&last).map(|(end, last)| end - last).collect();
    let triangles = triangles.iter().map(|triangle| triangle.after(&step)).collect();
    Ok(Minimum {
        beta,
        triangles,
        rank,
    })
}

/// Everything that follows from the solution.
fn finish(problem: &Problem<'_>, minimum: Minimum) -> Result<Fit, IdentifyError> {
    let Minimum {
        beta,
        triangles,
        rank,
    } = minimum;
    let whole = whole(problem, &beta, &triangles);
    let covariance = covariance(&whole, &rank.seen)?;
    let residuals = problem.residuals(&beta);
    let held_out = held_out(problem, &beta, &triangles, &whole, &rank.seen)?;
    let zero = vec![0.0; beta.len()];
    let chi_square: f64 = whole.sum_of_squares_after(&zero);
    // What is known beforehand counts as observed: it has its rows in χ².
    let free = (problem.readings() * problem.coordinates() + problem.prior_rows())
        .saturating_sub(rank.seen.ncols())
        .max(1) as f64;
    Ok(Fit {
        beta,
        rank,
        covariance,
        triangles,
        residuals,
        held_out,
        birge_ratio: (chi_square / free).sqrt(),
        u_enlargement: u_enlargement(chi_square, free),
    })
}

/// By how much uncertainties are enlarged: the Birge ratio `√(χ²/ν)` where it is significantly above 1, else 1.
pub(crate) fn u_enlargement(chi_square: f64, free: f64) -> f64 {
    let significance = ChiSquared::new(free).map(|law| law.sf(chi_square)).unwrap_or(1.0);
    if significance < BIRGE_SIGNIFICANCE {
        (chi_square / free).sqrt().max(1.0)
    } else {
        1.0
    }
}

/// What a user should know where uncertainties are enlarged.
pub(crate) fn enlargement_warning(enlargement: f64) -> Option<String> {
    (enlargement > 1.0).then(|| {
        format!(
            "the residual exceeds the noise (χ² is {:.2} times its degrees of freedom); uncertainties are enlarged by {enlargement:.2}; \
             `abbe trace` looks for the cause",
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

/// The fit as it is reported.
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
    FitResult {
        noise_um: problem.noise.sigma_mm * 1e3,
        noise_source: problem.noise.source.word().to_string(),
        readings: problem.readings(),
        rms_um: rms * 1e3,
        heldout_rms_um: held * 1e3,
        rms_3d_um: in_3d(rms),
        heldout_rms_3d_um: in_3d(held),
        heldout_by: problem.folds.kind.words().to_string(),
        rank: fit.rank.seen.ncols(),
        unknowns: fit.beta.len(),
        birge_ratio: fit.birge_ratio,
        u_enlargement: fit.u_enlargement,
        parameters: parameters(problem, fit),
        unobservable: unobservable(problem, &fit.rank),
        rejected: rejected(problem, fit),
        circular: crate::circular::of_session(problem.session, problem.noise.sigma_mm, &problem.rejected),
        plausibility,
        warnings,
        about: problem.session.about.iter().cloned().collect(),
        monte_carlo: None,
    }
}

/// A quantity that a fit reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// An unknown, by its place.
    Unknown(usize),
    /// Amplitude and phase of a harmonic, by the place of its cosine.
    Harmonic(usize),
}

/// What is reported, in its order: the unknowns that are seen.
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
            let pair = matches!(effect.shape, Shape::Harmonic { .. } | Shape::Periodic { .. });
            if pair && rank.is_identifiable(j) && rank.is_identifiable(j + 1) {
                quantities.push(Quantity::Harmonic(j));
                j += 2;
                continue;
            }
        }
        if rank.is_identifiable(j) {
            quantities.push(Quantity::Unknown(j));
        }
        j += 1;
    }
    quantities
}

/// Passes on the values of quantities at other unknowns than those of a fit, in outside units, amplitude before phase. A phase is counted from that of the
/// fit, so that none lies a turn away.
pub(crate) fn values_at(
    problem: &Problem<'_>,
    fit: &Fit,
    quantities: &[Quantity],
    beta: &[f64],
    mut put: impl FnMut(f64),
) {
    let list = &problem.parameters.list;
    for quantity in quantities {
        match *quantity {
            Quantity::Unknown(j) => put(beta[j] * list[j].unit.display_per_internal),
            Quantity::Harmonic(j) => {
                put(beta[j].hypot(beta[j + 1]) * list[j].unit.display_per_internal);
                let (a, b) = (fit.beta[j], fit.beta[j + 1]);
                let off = (b * beta[j] - a * beta[j + 1]).atan2(a * beta[j] + b * beta[j + 1]);
                put(((-b).atan2(a) + off).to_degrees());
            }
        }
    }
}

/// The unknowns that are seen, in outside units; harmonics as amplitude and phase of `amplitude · cos(order · angle + phase)`.
pub fn parameters(problem: &Problem<'_>, fit: &Fit) -> Vec<ParameterResult> {
    let list = &problem.parameters.list;
    let u_inside = |j: usize| fit.covariance[(j, j)].max(0.0).sqrt() * fit.u_enlargement;
    let mut results = Vec::new();
    for quantity in quantities(problem, &fit.rank) {
        match quantity {
            Quantity::Harmonic(j) => results.extend(amplitude_and_phase(problem, fit, j)),
            Quantity::Unknown(j) => results.push(ParameterResult {
                id: list[j].id.clone(),
                value: fit.beta[j] * list[j].unit.display_per_internal,
                u: u_inside(j) * list[j].unit.display_per_internal,
                unit: list[j].unit.name.clone(),
            }),
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
            .min(any_phase_deg())
    } else {
        any_phase_deg()
    };
    [
        ParameterResult {
            id: format!("{id}.amplitude"),
            value: amplitude * unit.display_per_internal,
            u: along.max(0.0).sqrt() * unit.display_per_internal,
            unit: unit.name.clone(),
        },
        ParameterResult {
            id: format!("{id}.phase"),
            value: (-b).atan2(a).to_degrees(),
            u: u_phase,
            unit: "deg".to_string(),
        },
    ]
}

/// Of a phase no more can be said than the standard deviation of a uniform one, °.
pub(crate) fn any_phase_deg() -> f64 {
    180.0 / 3.0_f64.sqrt()
}

/// The unseen combinations, in outside units and in words.
pub fn unobservable(problem: &Problem<'_>, rank: &Rank) -> Vec<Unobservable> {
    let list = &problem.parameters.list;
    rank.unseen
        .iter()
        .zip(&rank.pivots)
        .map(|(row, pivot)| {
            let others = (0..row.len()).filter(|j| j != pivot && row[*j] != 0.0);
            let outside: Vec<(usize, f64)> = std::iter::once(*pivot)
                .chain(others)
                .map(|j| (j, row[j] * list[j].size * list[j].unit.display_per_internal))
                .collect();
            let leading = outside.first().map_or(1.0, |(_, value)| *value);
            let combination: BTreeMap<String, f64> = outside
                .iter()
                .map(|(j, value)| (list[*j].id.clone(), value / leading))
                .collect();
            let why = match outside.as_slice() {
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

/// The readings that are left out, by name.
pub fn rejected(problem: &Problem<'_>, fit: &Fit) -> Vec<Rejected> {
    let coordinates = problem.coordinates();
    let mut list = Vec::new();
    for (number, test) in problem.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        for row in (0..readings.rows()).filter(|row| problem.rejected[number][*row]) {
            let residual = &fit.residuals[number][row * coordinates..(row + 1) * coordinates];
            list.push(Rejected {
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

    use abbe_model::effect::{Component, Driver};
    use abbe_model::session::read::{self, ReadOptions};

    use super::*;

    /// `A cos(nC + φ)` has the coefficients `A cos φ` and `−A sin φ`.
    #[test]
    fn a_wave_elsewhere_has_the_amplitude_and_the_phase_that_its_coefficients_say() {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = read::session(&file, &ReadOptions::default()).unwrap();
        let (mut problem, _) = prepare(&session, 1).unwrap();
        problem
            .add_effect(&Effect {
                component: Component::parse("EZC").unwrap(),
                driver: Driver::parse("C"),
                shape: Shape::Harmonic { order: 3.0 },
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
                Quantity::Unknown(_) => None,
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
            // Every wave before this one says two numbers; there is none.
            assert!((values[place] - 3.0).abs() < 1e-12, "{}", values[place]);
            assert!(
                (values[place + 1] - other_deg).abs() < 1e-9,
                "{} and {other_deg}",
                values[place + 1]
            );
        }
    }
}
