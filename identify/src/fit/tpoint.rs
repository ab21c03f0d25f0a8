//! The terms of TPOINT that a fit of pointing observations is equivalent to.
//!
//! A term is a coefficient of a column of azimuth and elevation, true less encoder. With the azimuth `A` and the elevation
//! `E` of the commanded line of sight:
//!
//! | term | azimuth · cos E | elevation |
//! |---|---|---|
//! | IA, IE | −cos E, 0 | 0, 1 |
//! | AN, AW | −sin A sin E, −cos A sin E | −cos A, sin A |
//! | CA, NPAE | −1, −sin E | 0, 0 |
//! | TF, TX | 0, 0 | −cos E, −cot E |
//! | HAfqn, HSfqn | −f(n·q) cos E, −f(n·q) | 0 |
//! | HEfqn | 0 | f(n·q) |
//!
//! `f` is the sine (S) or the cosine (C); `q` is the elevation (E) or the azimuth (A), which in a harmonic counts from
//! south through east: 180° − A. With these signs the printed fits of TPOINT predict their own stars.
//!
//! The column of a parameter is its sensitivity at the nominal machine. A parameter is a term if the two columns are
//! proportional, whatever the directions of the axes are.

use abbe_model::Diagnostic;
use abbe_model::instrument::{Instrument, InstrumentKind};
use abbe_model::unit::ARCSEC_PER_RAD;
use faer::Mat;
use schemars::JsonSchema;
use serde::Serialize;

use super::Fit;
use crate::error;
use crate::problem::Problem;

/// Highest order of a harmonic term.
const HIGHEST_ORDER: usize = 8;
/// Largest part of a parameter's column that its term may leave, of its length.
const PROPORTIONAL: f64 = 1e-6;
/// Largest share of a null-space combination in a term that has a value.
const SEPARABLE: f64 = 1e-6;

/// The fit as terms of TPOINT.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PointingTerms {
    /// Number of stars without outliers.
    pub stars: usize,
    /// Rms of the residual on the sky: of the length of across and up, arcsec.
    pub sky_rms_arcsec: f64,
    /// The same with n − p in place of n, p the number of identifiable parameters, arcsec; `null` for n ≤ p.
    pub population_sd_arcsec: Option<f64>,
    /// The terms.
    pub terms: Vec<PointingTerm>,
    /// Parameters that are no term: their effect on the readings is that of none.
    pub without_term: Vec<String>,
}

/// A term of TPOINT.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PointingTerm {
    /// Its name: IA, CA, HASA2.
    pub term: String,
    /// Its value, arcsec; `null` if the readings do not separate it from others.
    pub value_arcsec: Option<f64>,
    /// Its standard uncertainty, arcsec.
    pub u_arcsec: Option<f64>,
    /// The sigma that TPOINT prints, arcsec: it takes the sky rms for the standard deviation of each coordinate, and
    /// does not count degrees of freedom.
    pub sigma_arcsec: Option<f64>,
    /// The parameters of which it consists.
    pub parameters: Vec<String>,
}

/// The terms of a fit.
///
/// # Errors
/// If the readings are no directions, or the model cannot be evaluated.
pub fn report(problem: &Problem, fit: &Fit) -> Result<PointingTerms, Diagnostic> {
    let names = |test: usize| problem.models[test].channels().iter().map(|channel| channel.name);
    if let Some(other) = (0..problem.tests.len()).find(|test| !names(*test).eq(["across", "up"])) {
        let (found, expected) = (problem.tests[other].station.kind(), InstrumentKind::Pointing);
        return Err(error::other_instrument("terms of TPOINT", found, expected));
    }
    let (directions, columns) = columns(problem)?;
    let terms = of_parameters(&directions, &columns);
    let squares = fit.residuals.iter().enumerate().flat_map(|(test, residuals)| {
        residuals.iter().enumerate().filter(move |(scalar, _)| problem.counts(test, *scalar)).map(|(_, r)| r * r)
    });
    let stars = problem.readings();
    let per_mm = ARCSEC_PER_RAD / problem.session.lever_mm;
    let sky_rms = (squares.sum::<f64>() / stars as f64).sqrt();
    let rank = fit.rank.identifiable_basis.ncols();
    // TPOINT's own sigma: the sky rms for the noise, without any enlargement.
    let sigma_per_u = sky_rms / (problem.noise.sigma_mm * fit.u_enlargement);
    let list = &problem.parameters.list;
    let sizes = problem.parameters.sizes();
    let covariance = fit.whole_covariance();
    let mut found = Vec::new();
    for name in &names_in_order() {
        let of: Vec<(usize, f64)> = (0..list.len())
            .filter_map(|j| terms[j].as_ref().filter(|(own, _)| own == name).map(|(_, factor)| (j, *factor)))
            .collect();
        if of.is_empty() {
            continue;
        }
        let value: f64 = of.iter().map(|(j, factor)| factor * fit.beta[*j]).sum();
        let pairs = of.iter().flat_map(|a| of.iter().map(move |b| (a, b)));
        let variance: f64 = pairs.map(|((i, a), (j, b))| a * b * covariance[(*i, *j)]).sum();
        let length = of.iter().map(|(j, factor)| (factor * sizes[*j]).powi(2)).sum::<f64>().sqrt();
        // The combinations that are reported as confounded: a null direction itself contains a little of every term.
        let share = |combination: &Vec<f64>| -> f64 {
            of.iter().map(|(j, factor)| factor * sizes[*j] * combination[*j]).sum::<f64>().abs() / length
        };
        let has_value = fit.rank.null_combinations.iter().all(|combination| share(combination) < SEPARABLE);
        let number = |internal: f64| has_value.then_some(internal * ARCSEC_PER_RAD);
        let u = variance.max(0.0).sqrt();
        found.push(PointingTerm {
            term: name.clone(),
            value_arcsec: number(value),
            u_arcsec: number(u),
            sigma_arcsec: number(u * sigma_per_u),
            parameters: of.iter().map(|(j, _)| list[*j].id.to_string()).collect(),
        });
    }
    let without = (0..list.len()).filter(|j| terms[*j].is_none()).map(|j| list[j].id.to_string());
    Ok(PointingTerms {
        stars,
        sky_rms_arcsec: sky_rms * per_mm,
        population_sd_arcsec: (stars > rank).then(|| sky_rms * per_mm * (stars as f64 / (stars - rank) as f64).sqrt()),
        terms: found,
        without_term: without.collect(),
    })
}

/// Azimuth and elevation of the commanded line of sight of each reading, rad, and the sensitivity of across and up to each
/// parameter at the nominal machine, two rows for each reading.
fn columns(problem: &Problem) -> Result<(Vec<[f64; 2]>, Mat<f64>), Diagnostic> {
    let parameters = problem.parameters.list.len();
    let nominal = problem.slot_values(&vec![0.0; parameters]);
    let lever_mm = problem.session.lever_mm;
    let (mut directions, mut rows) = (Vec::new(), Vec::new());
    for block in problem.blocks() {
        let model = &problem.models[block.test];
        let own = problem.rows(&nominal, &block)?;
        for (k, row) in block.rows.clone().enumerate() {
            if problem.rejected[block.test][row] {
                continue;
            }
            let mut direction = [0.0; 2];
            let station: &dyn Instrument = &**model.station();
            station.columns_of_channels(&problem.session.machine, &model.state(row), &mut direction);
            directions.push(direction);
            rows.extend(
                [2 * k, 2 * k + 1]
                    .map(|scalar| (0..parameters).map(|j| own[(scalar, j)] / lever_mm).collect::<Vec<f64>>()),
            );
        }
    }
    Ok((directions, Mat::from_fn(rows.len(), parameters, |i, j| rows[i][j])))
}

/// The term of each parameter, and the value of the term over that of the parameter.
fn of_parameters(directions: &[[f64; 2]], columns: &Mat<f64>) -> Vec<Option<(String, f64)>> {
    let terms: Vec<(String, Vec<f64>)> = names_in_order()
        .into_iter()
        .filter_map(|name| {
            let column = directions.iter().map(|at| column(&name, *at)).collect::<Option<Vec<_>>>()?.concat();
            Some((name, column))
        })
        .collect();
    let of = |j: usize| {
        let own = || columns.col(j).iter();
        let square: f64 = own().map(|x| x * x).sum();
        terms.iter().find_map(|(name, column)| {
            let factor = own().zip(column).map(|(x, t)| x * t).sum::<f64>() / column.iter().map(|t| t * t).sum::<f64>();
            let left: f64 = own().zip(column).map(|(x, t)| (x - factor * t).powi(2)).sum();
            (square > 0.0 && left <= PROPORTIONAL.powi(2) * square).then(|| (name.clone(), factor))
        })
    };
    (0..columns.ncols()).map(of).collect()
}

/// All terms: those with a name of their own before harmonics.
fn names_in_order() -> Vec<String> {
    let mut names = ["IA", "IE", "AN", "AW", "CA", "NPAE", "TF", "TX"].map(str::to_string).to_vec();
    for order in 1..=HIGHEST_ORDER {
        for result in ["A", "S", "E"] {
            for (function, of) in [("S", "A"), ("C", "A"), ("S", "E"), ("C", "E")] {
                let order = if order == 1 { String::new() } else { order.to_string() };
                names.push(format!("H{result}{function}{of}{order}"));
            }
        }
    }
    names
}

/// The column of a term in one direction: azimuth times the cosine of the elevation, and elevation. `None` if there is no
/// such term.
fn column(name: &str, [a, e]: [f64; 2]) -> Option<[f64; 2]> {
    let ((sin_a, cos_a), (sin_e, cos_e)) = (a.sin_cos(), e.sin_cos());
    Some(match name {
        "IA" => [-cos_e, 0.0],
        "IE" => [0.0, 1.0],
        "AN" => [-sin_a * sin_e, -cos_a],
        "AW" => [-cos_a * sin_e, sin_a],
        "CA" => [-1.0, 0.0],
        "NPAE" => [-sin_e, 0.0],
        "TF" => [0.0, -cos_e],
        "TX" => [0.0, -cos_e / sin_e],
        harmonic => {
            let letters: Vec<char> = harmonic.chars().collect();
            let &['H', result, function, of, ref order @ ..] = &letters[..] else {
                return None;
            };
            let order = if order.is_empty() { 1.0 } else { order.iter().collect::<String>().parse().ok()? };
            let angle: f64 = order * if of == 'A' { std::f64::consts::PI - a } else { e };
            let value = if function == 'S' { angle.sin() } else { angle.cos() };
            match result {
                'A' => [-value * cos_e, 0.0],
                'S' => [-value, 0.0],
                _ => [0.0, value],
            }
        }
    })
}
