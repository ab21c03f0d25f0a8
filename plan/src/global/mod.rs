//! Global sensitivity of the estimates: Sobol' indices of each identified error with respect to set-up errors, noise
//! and undeclared effects, by the exact chain and the full fit, beside the linear prediction.
//!
//! The machine has no errors. A sample draws the true set-up, the noise and the coefficients of effects that the model
//! lacks. The estimate of the plan's least-squares problem is then the error of the estimate. It is found by the chord
//! method, with the gain at the nominal machine, which needs no further Jacobian:
//!
//! ```text
//! β ← β + Cov (Jᵀ W (y − L(β)) − P β)
//! ```
//!
//! | input | distribution |
//! |---|---|
//! | set-up parameter with a Gaussian prior | normal, with the standard uncertainty of the prior, or as stated |
//! | noise of all readings together | normal, with the noise of the plan |
//! | coefficient of an undeclared effect | uniform between plus and minus the stated size |
//!
//! The first-order part of the response gives the linear share of each input ([`super::budget`], [`super::bias`]).
//! Where the shares differ from the indices by more than their confidence intervals, the response is not linear.

mod indices;
mod sequence;

use abbe_identify::error;
use abbe_identify::linear::{Linearisation, is_of_interest, prior_u};
use abbe_identify::noise::ReadingNoise;
use abbe_identify::problem::Problem;
use abbe_identify::quantity::Given;
use abbe_model::Diagnostic;
use abbe_model::session::Prior;
use abbe_trace::candidates::columns::Columns;
use abbe_trace::candidates::library;
use faer::Mat;
use indices::Design;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::error::too_many;

pub use indices::SobolIndex;

/// Maximum number of steps of the chord method.
const MAX_STEPS: usize = 60;
/// Largest number of estimates of all fits, which are kept: 800 MB.
const MAX_ESTIMATES: usize = 100_000_000;
/// Step, in standard uncertainties, at which the chord method ends.
const SMALL_STEP: f64 = 1e-4;

/// How an analysis is sampled.
#[derive(Clone, Debug)]
pub struct GlobalOptions {
    /// Number of samples; a power of two keeps the sequence even.
    pub samples: usize,
    /// Seed of the digital shift, the noise and the resampling.
    pub seed: u64,
    /// Sizes of effects (half the range), by identifier, and of set-up parameters (standard deviation) instead of the
    /// uncertainty of their prior: `EZC~C:h2=2um`, `bar[A100]=1um`, `bar=1um` for all.
    pub vary: Vec<Given>,
}

/// Sobol' indices of the estimates of a plan.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct GlobalAnalysis {
    /// The noise of a reading.
    #[serde(flatten)]
    pub noise: ReadingNoise,
    /// Number of samples.
    pub samples: usize,
    /// Number of fits: samples times inputs plus two.
    pub evaluations: usize,
    /// The varied inputs.
    pub inputs: Vec<GlobalInput>,
    /// The identifiable errors.
    pub errors: Vec<GlobalError>,
    /// Largest change of a total index from fewer samples to all samples.
    pub convergence: Vec<Convergence>,
}

/// An input that is varied.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct GlobalInput {
    /// `noise`, a set-up parameter, or a coefficient of an effect.
    pub id: String,
    /// `normal` or `uniform`.
    pub distribution: &'static str,
    /// Standard deviation, or half the range, in `unit`.
    pub size: f64,
    /// Unit.
    pub unit: String,
}

/// The indices of the estimate of one error.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct GlobalError {
    /// The error.
    pub id: String,
    /// Unit of `standard_deviation` and `linear_standard_deviation`.
    pub unit: String,
    /// Standard deviation of the estimate over the samples.
    pub standard_deviation: f64,
    /// The same by linear propagation.
    pub linear_standard_deviation: f64,
    /// The indices by each input, in the order of `inputs`.
    pub indices: Vec<GlobalIndex>,
}

/// The index by one input beside its linear prediction.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct GlobalIndex {
    /// Sobol' index with its confidence interval (95 %).
    #[serde(flatten)]
    pub sobol: SobolIndex,
    /// Share of the variance by linear propagation: first order and total of a linear response.
    pub linear: f64,
}

/// The largest change of a total index from `samples` samples to all.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct Convergence {
    /// Number of samples.
    pub samples: usize,
    /// Largest change over all errors and inputs.
    pub largest_change: f64,
}

/// A varied input.
enum Input {
    /// Parameter of the problem, standard deviation (internal unit).
    SetUp(usize, f64),
    /// Parameter of the problem with effects, half range (internal unit).
    Effect(usize, f64),
    Noise,
}

/// The parts that all samples share.
struct Plan<'p> {
    /// The problem that is estimated.
    problem: &'p Problem,
    /// The problem with the undeclared effects, which the samples follow.
    truth: Problem,
    inputs: Vec<Input>,
    linear: Linearisation,
    columns: Columns<'p>,
    /// `Cov Jᵀ` of the whitened readings.
    gain: Mat<f64>,
    /// Reciprocal prior variance of each parameter.
    prior: Vec<f64>,
    errors: Vec<usize>,
    seed: u64,
}

/// The Sobol' indices of a plan. The folds of the problem are its tests.
///
/// # Errors
/// If a name of `vary` is neither a set-up parameter with a prior nor an effect of the library, if there are too many
/// inputs, or if a fit does not converge because an input is too large.
pub fn global(problem: &Problem, options: &GlobalOptions) -> Result<GlobalAnalysis, Diagnostic> {
    if options.samples < 8 {
        let (purpose, found) = ("the global analysis", options.samples);
        return Err(error::too_few(purpose, "samples", 8, found));
    }
    let plan = Plan::new(problem, options)?;
    let (fits, estimates) = (options.samples * (plan.inputs.len() + 2), plan.errors.len());
    if fits.saturating_mul(estimates) > MAX_ESTIMATES {
        let (samples, inputs) = (options.samples, plan.inputs.len());
        return Err(too_many(
            format!("{samples} samples of {inputs} inputs are {fits} fits, each of {estimates} errors"),
            MAX_ESTIMATES,
            "state fewer samples",
        ));
    }
    let design = Design::evaluate(plan.inputs.len(), options.samples, options.seed, &|point| plan.estimate(point))?;
    let shares = plan.linear_variances()?;
    let list = &problem.parameters.list;
    let of = |samples: usize| -> Vec<Vec<SobolIndex>> {
        (0..plan.errors.len()).map(|output| design.indices(output, samples, options.seed)).collect()
    };
    let all = of(options.samples);
    let convergence = [8, 4, 2].map(|part| {
        let samples = options.samples / part;
        let fewer = of(samples);
        let pairs = fewer.iter().flatten().zip(all.iter().flatten());
        Convergence { samples, largest_change: pairs.map(|(a, b)| (a.total - b.total).abs()).fold(0.0, f64::max) }
    });
    let errors = plan.errors.iter().zip(all).zip(shares).enumerate().map(|(output, ((j, indices), shares))| {
        let display = list[*j].unit.display_per_internal;
        let variance: f64 = shares.iter().sum();
        let index = |(sobol, share): (SobolIndex, f64)| GlobalIndex {
            sobol,
            linear: if variance > 0.0 { share / variance } else { 0.0 },
        };
        GlobalError {
            id: list[*j].id.to_string(),
            unit: list[*j].unit.name.clone(),
            standard_deviation: design.standard_deviation(output) * display,
            linear_standard_deviation: variance.sqrt() * display,
            indices: indices.into_iter().zip(shares).map(index).collect(),
        }
    });
    Ok(GlobalAnalysis {
        noise: problem.reading_noise(),
        samples: options.samples,
        evaluations: options.samples * (plan.inputs.len() + 2),
        errors: errors.collect(),
        convergence: convergence.to_vec(),
        inputs: plan.reported(),
    })
}

impl<'p> Plan<'p> {
    fn new(problem: &'p Problem, options: &GlobalOptions) -> Result<Plan<'p>, Diagnostic> {
        let list = &problem.parameters.list;
        let nominal = vec![0.0; list.len()];
        let mut truth = problem.clone();
        let mut inputs = Vec::new();
        let mut used = vec![false; options.vary.len()];
        for (j, parameter) in list.iter().enumerate() {
            let (true, Prior::Gaussian(mut size)) = (parameter.id.is_setup(), parameter.prior) else { continue };
            let names = [parameter.id.to_string(), parameter.id.clone().with_group("").to_string()];
            for (given, used) in options.vary.iter().zip(&mut used) {
                if names.contains(&given.id) {
                    size = given.inside(&parameter.unit)?.abs();
                    *used = true;
                }
            }
            if size > 0.0 {
                inputs.push(Input::SetUp(j, size));
            }
        }
        let candidates = library::candidates(problem)?;
        for (given, _) in options.vary.iter().zip(&used).filter(|(_, used)| !**used) {
            let Some(candidate) = candidates.iter().find(|candidate| candidate.effect.id() == given.id) else {
                let uncertain = list.iter().filter(|p| p.id.is_setup() && prior_u(p).is_some());
                let what = "set-up parameter with an uncertainty and no effect of the library called";
                let these = "identifiers are as in `bar[A100]` and `EZC~C:h2`; the set-up parameters are:";
                return Err(error::unknown("the plan", what, &given.id, these, uncertain.map(|p| p.id.clone())));
            };
            let first = truth.parameters.list.len();
            truth.add_effect(&candidate.effect)?;
            for j in first..truth.parameters.list.len() {
                inputs.push(Input::Effect(j, given.inside(&truth.parameters.list[j].unit)?.abs()));
            }
        }
        inputs.push(Input::Noise);
        let linear = Linearisation::of(problem, &nominal)?;
        let columns = Columns::new(problem, &nominal);
        let rows = columns.model_rows(&nominal)?;
        let gain = &linear.covariance * rows.as_ref().subcols(0, list.len()).transpose();
        Ok(Plan {
            problem,
            truth,
            inputs,
            columns,
            gain,
            prior: list.iter().map(|parameter| prior_u(parameter).map_or(0.0, |u| 1.0 / (u * u))).collect(),
            errors: (0..list.len()).filter(|j| is_of_interest(&list[*j]) && linear.rank.is_identifiable(*j)).collect(),
            linear,
            seed: options.seed,
        })
    }

    /// The readings of each test at parameter values of a problem, mm.
    fn readings(problem: &Problem, beta: &[f64]) -> Vec<Vec<f64>> {
        let values = problem.slot_values(beta);
        problem.models.iter().zip(&values).map(|(model, values)| model.readings(values)).collect()
    }

    /// The estimates of the errors, internal units, for inputs between 0 and 1.
    fn estimate(&self, point: &[f64]) -> Result<Vec<f64>, Diagnostic> {
        let mut truth = vec![0.0; self.truth.parameters.list.len()];
        let mut noise = vec![0.0; self.columns.rows()];
        for (input, u) in self.inputs.iter().zip(point) {
            match input {
                Input::SetUp(j, size) => truth[*j] = size * Normal::standard().inverse_cdf(*u),
                Input::Effect(j, size) => truth[*j] = size * (2.0 * u - 1.0),
                Input::Noise => {
                    // One number stands for the noise of all readings.
                    let mut random = Pcg64::new(u128::from(u.to_bits()), u128::from(self.seed));
                    noise.iter_mut().for_each(|value| *value = StandardNormal.sample(&mut random));
                }
            }
        }
        let observed = Self::readings(&self.truth, &truth);
        let count = self.problem.parameters.list.len();
        let mut beta = vec![0.0; count];
        for _ in 0..MAX_STEPS {
            let mut difference = observed.clone();
            let predicted = Self::readings(self.problem, &beta);
            for (value, predicted) in difference.iter_mut().flatten().zip(predicted.iter().flatten()) {
                *value -= predicted;
            }
            let mut residual = self.columns.whitened_values(&difference);
            residual.iter_mut().zip(&noise).for_each(|(value, noise)| *value += noise);
            let from_prior: Vec<f64> = beta.iter().zip(&self.prior).map(|(value, weight)| value * weight).collect();
            let mut largest = 0.0_f64;
            let steps: Vec<f64> = (0..count)
                .map(|i| {
                    let by_readings: f64 = self.gain.row(i).iter().zip(&residual).map(|(g, r)| g * r).sum();
                    let row = self.linear.covariance.row(i);
                    let by_priors: f64 = row.iter().zip(&from_prior).map(|(c, p)| c * p).sum();
                    let step = by_readings - by_priors;
                    let u = self.linear.covariance[(i, i)].sqrt();
                    largest = largest.max(if u > 0.0 { step.abs() / u } else { 0.0 });
                    step
                })
                .collect();
            beta.iter_mut().zip(&steps).for_each(|(value, step)| *value += step);
            if largest < SMALL_STEP {
                return Ok(self.errors.iter().map(|j| beta[*j]).collect());
            }
            if !largest.is_finite() {
                break;
            }
        }
        let found = "a fit does not converge";
        Err(error::not_applicable("global analysis", found, "an input is too large: reduce its size"))
    }

    /// Variance of each error by each input in linear propagation, internal units.
    fn linear_variances(&self) -> Result<Vec<Vec<f64>>, Diagnostic> {
        let nominal = vec![0.0; self.truth.parameters.list.len()];
        let truth = Columns::new(&self.truth, &nominal);
        let rows = truth.model_rows(&nominal)?;
        let of = |error: usize| {
            let response = |j: usize| -> f64 {
                let signal: f64 = self.gain.row(error).iter().zip(rows.col(j).iter()).map(|(g, c)| g * c).sum();
                signal
            };
            let variance = |input: &Input| match input {
                Input::SetUp(j, size) => (response(*j) * size).powi(2),
                Input::Effect(j, size) => (response(*j) * size).powi(2) / 3.0,
                Input::Noise => self.gain.row(error).iter().map(|g| g * g).sum(),
            };
            self.inputs.iter().map(variance).collect()
        };
        Ok(self.errors.iter().map(|error| of(*error)).collect())
    }

    fn reported(&self) -> Vec<GlobalInput> {
        let list = &self.truth.parameters.list;
        let input = |j: usize, distribution: &'static str, size: f64| GlobalInput {
            id: list[j].id.to_string(),
            distribution,
            size: size * list[j].unit.display_per_internal,
            unit: list[j].unit.name.clone(),
        };
        let of = |one: &Input| match one {
            Input::SetUp(j, size) => input(*j, "normal", *size),
            Input::Effect(j, size) => input(*j, "uniform", *size),
            Input::Noise => GlobalInput {
                id: "noise".into(),
                distribution: "normal",
                size: self.problem.noise.sigma_mm * 1e3,
                unit: "um".into(),
            },
        };
        self.inputs.iter().map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use abbe_identify::noise::{Noise, NoiseSource};

    use super::*;
    use crate::{budget, states};

    fn problem_of(name: &str) -> Problem {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions").join(name);
        let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        session.tests.truncate(2);
        let plan = states::complete(&session, true).unwrap();
        states::problem_by_test(&plan, Noise::white(3e-4, NoiseSource::Stated)).unwrap()
    }

    /// Set-up errors of micrometres are in the linear range. The linear shares are those of the uncertainty budget, and
    /// the indices agree with them within their confidence intervals. An effect of 20 µm dominates.
    #[test]
    fn small_inputs_have_the_shares_of_the_budget() {
        let problem = problem_of("hermle-c600u/chapter5.toml");
        let options = GlobalOptions { samples: 128, seed: 1, vary: Vec::new() };
        let found = global(&problem, &options).unwrap();
        let linear = Linearisation::of(&problem, &vec![0.0; problem.parameters.list.len()]).unwrap();
        assert!(!found.errors.is_empty());
        for error in &found.errors {
            let j = problem.parameters.list.iter().position(|parameter| parameter.id.to_string() == error.id).unwrap();
            let parts = budget::budget(&problem, &linear, j);
            for (input, index) in found.inputs.iter().zip(&error.indices) {
                let share = parts.iter().find(|part| part.source == input.id).map_or(0.0, |part| part.share);
                assert!((index.linear - share).abs() < 2e-4, "{} {}: {index:?} {share}", error.id, input.id);
                let within = 2.0 * index.sobol.total_half_width + 0.01;
                assert!((index.sobol.total - share).abs() < within, "{} {}: {index:?} {share}", error.id, input.id);
            }
            let ratio = error.standard_deviation / error.linear_standard_deviation;
            assert!((ratio - 1.0).abs() < 0.1, "{}: {ratio}", error.id);
        }
        assert_eq!(found.evaluations, 128 * (found.inputs.len() + 2));
        let vary = vec![Given::parse("EZA~A:h2=20um").unwrap()];
        let found = global(&problem, &GlobalOptions { vary, ..options.clone() }).unwrap();
        let of = |id: &str| found.inputs.iter().position(|input| input.id == id).unwrap();
        let error = found.errors.iter().find(|error| error.id == "EZ0A").unwrap();
        let by_effect = error.indices[of("EZA~A:h2.cos")].sobol.total + error.indices[of("EZA~A:h2.sin")].sobol.total;
        assert!(by_effect > 0.8, "{by_effect}");
        let vary = vec![Given::parse("nothing=1um").unwrap()];
        assert!(global(&problem, &GlobalOptions { vary, ..options }).unwrap_err().to_string().contains("nothing"));
    }
}
