//! The fit of a session's set-up with known errors of the machine.

use abbe_identify::error;
use abbe_identify::fit::{Minimum, minimum};
use abbe_identify::heldout::stated_rms_mm;
use abbe_identify::model_file::IdentifiedModel;
use abbe_identify::noise::outliers;
use abbe_identify::noise::{Noise, NoiseSource, ShownNoise};
use abbe_identify::numerics::triangle::Triangle;
use abbe_identify::problem::Problem;
use abbe_identify::results::Estimate;
use abbe_model::Diagnostic;
use abbe_model::component::ErrorName;
use abbe_model::session::Prior;
use abbe_model::session::Session;
use abbe_model::session::limits::MIN_UM;

use crate::noise_model::estimate_noise_model;
use crate::validate::RmsResult;

/// Maximum number of rounds that re-estimate noise and outliers.
const MAX_ROUNDS: usize = 4;

/// Root mean square of residuals, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rms {
    /// Over scalar readings.
    pub scalar_mm: f64,
    /// Whether the readings are vectors.
    pub vectors: bool,
    /// `√(χ²/ν)` of the whitened residual and of the set-up about its priors.
    pub noise_ratio: f64,
}

impl From<&Rms> for RmsResult {
    fn from(rms: &Rms) -> RmsResult {
        let rms_um = rms.scalar_mm * 1e3;
        let rms_3d_um = rms.vectors.then(|| rms_um * 3.0_f64.sqrt());
        RmsResult { rms_um, rms_3d_um, noise_ratio: rms.noise_ratio }
    }
}

/// A session whose errors of the machine are known and whose set-up is estimated.
#[derive(Clone)]
pub(super) struct KnownErrors<'m> {
    pub model: &'m IdentifiedModel,
    /// The session with the parameters of the model beside its set-up.
    pub full: Problem,
    /// The session with its set-up only.
    pub set_up: Problem,
    /// The parameters of the machine by index in the model.
    pub carried: Vec<usize>,
    /// The same by index in `full`.
    pub columns: Vec<usize>,
    /// Effects of the model that do not belong to the machine.
    pub not_carried: Vec<String>,
    /// Where the noise comes from: stated, repeats or the model.
    pub noise_source: NoiseSource,
}

/// The session linearised at known errors and an estimated set-up.
pub(super) struct Linearised {
    /// Whitened rows over the parameters of [`KnownErrors::full`], priors of the set-up included.
    pub triangle: Triangle,
    /// The parameters of [`KnownErrors::full`].
    pub beta: Vec<f64>,
    /// The factor of the model's parameters and the residual, with the set-up eliminated.
    pub machine: Triangle,
    /// Covariance of the model's parameters, enlarged along its null directions.
    pub covariance: faer::Mat<f64>,
    /// The null directions of the model over its parameters of the machine, one column each.
    pub null_directions: faer::Mat<f64>,
    /// Degrees of freedom of the residual.
    pub freedom: usize,
}

impl<'m> KnownErrors<'m> {
    /// A model on a session.
    ///
    /// # Errors
    /// If the session has no readings, or none that depends on the model, or an error of `anew` is no parameter of the
    /// model.
    pub fn new(
        model: &'m IdentifiedModel,
        session: &Session,
        anew: &[ErrorName],
    ) -> Result<KnownErrors<'m>, Diagnostic> {
        let is_anew = |j: &usize| model.parameters[*j].id.error().is_some_and(|name| anew.contains(name));
        let carried = model.carried_parameters();
        if let Some(name) =
            anew.iter().find(|name| !carried.iter().any(|j| model.parameters[*j].id.error() == Some(name)))
        {
            let errors = carried.iter().map(|j| &model.parameters[*j]).filter(|parameter| parameter.id.is_error());
            let (what, these) = ("error to estimate anew", "its location errors are:");
            let known = errors.map(|parameter| parameter.id.clone());
            return Err(error::unknown("the model", what, name.to_string(), these, known));
        }
        let (noise, noise_source) = first_noise(model, session)?;
        let mut full = Problem::new(&model.session(session), noise.clone(), 1)?;
        // The uncertainty of the model contains the priors of its coefficients.
        full.parameters.list.iter_mut().filter(|p| !p.id.is_setup()).for_each(|p| p.prior = Prior::Free);
        let mut unknowns = anew.to_vec();
        unknowns.sort();
        unknowns.dedup();
        let own = Session { unknowns, effects: Vec::new(), ..session.clone() };
        let set_up = Problem::new(&own, noise, 1)?;
        let carried: Vec<usize> = carried.into_iter().filter(|j| !is_anew(j)).collect();
        let effects: Vec<usize> = model.carried_effects().collect();
        let column = |j: &usize| {
            let wanted = &model.parameters[*j];
            // Effects that differ only in the numbers of their shapes may be numbered otherwise in the model.
            full.parameters.list.iter().position(|own| match own.effect {
                Some(effect) => {
                    effects.get(effect).copied() == wanted.effect
                        && (Some(own.index), own.id.is_number()) == (wanted.index, wanted.id.is_number())
                }
                None => own.id == wanted.id,
            })
        };
        let columns: Option<Vec<usize>> = carried.iter().map(column).collect();
        let columns = columns.unwrap_or_default();
        let mut beta = vec![0.0; full.parameters.list.len()];
        columns.iter().zip(&carried).for_each(|(column, j)| beta[*column] = model.parameters[*j].value);
        full.linearise_numbers(&mut beta)?;
        let depends = |test: usize| full.own_parameters(test).iter().any(|j| columns.contains(j));
        if columns.is_empty() || !(0..full.tests.len()).any(depends) {
            return Err(error::not_applicable(
                "no reading of the session depends on an error that the model holds",
                "model and session have nothing in common",
                "fit a model of the axes that the session moves",
            ));
        }
        let left_out = model.effects.iter().filter(|effect| !IdentifiedModel::is_carried(effect));
        let not_carried = left_out.map(|effect| match effect.tests.is_empty() {
            true => format!("{} (an effect on the instrument or the set-up of its session)", effect.id()),
            false => format!("{} (an effect of single tests of its session)", effect.id()),
        });
        Ok(KnownErrors { model, not_carried: not_carried.collect(), full, set_up, carried, columns, noise_source })
    }

    /// The values of the model.
    pub fn model_values(&self) -> Vec<f64> {
        self.carried.iter().map(|j| self.model.parameters[*j].value).collect()
    }

    /// The location errors as estimated without any effect.
    pub fn location_values(&self) -> Vec<f64> {
        let value = |j: &usize| {
            let name = self.model.parameters[*j].id.error().map(ToString::to_string);
            let mut locations = self.model.locations.iter();
            locations.find(|location| Some(&location.id) == name.as_ref()).map_or(0.0, |location| location.value)
        };
        self.carried.iter().map(value).collect()
    }

    /// The values of the model without an effect.
    pub fn values_without(&self, effect: usize) -> Vec<f64> {
        let value = |j: &usize| match &self.model.parameters[*j] {
            own if own.effect == Some(effect) && own.id.is_coefficient() => 0.0,
            own => own.value,
        };
        self.carried.iter().map(value).collect()
    }

    /// The identifier of an effect of the model.
    pub fn effect_id(&self, effect: usize) -> String {
        let place = self.model.carried_effects().position(|carried| carried == effect);
        place.and_then(|place| self.full.parameters.effect_ids.get(place)).map(ToString::to_string).unwrap_or_default()
    }

    /// The problem of the set-up with these errors of the machine.
    fn problem(&self, values: &[f64]) -> Problem {
        let mut beta = vec![0.0; self.full.parameters.list.len()];
        self.columns.iter().zip(values).for_each(|(column, value)| beta[*column] = *value);
        let mut problem = self.set_up.clone();
        problem.parameters.known = self.full.slot_values(&beta);
        problem
    }

    /// Estimates the set-up.
    ///
    /// # Errors
    /// If the iterations do not converge.
    pub fn fit(&self, values: &[f64]) -> Result<Vec<f64>, Diagnostic> {
        Ok(minimum(&self.problem(values), None)?.beta)
    }

    /// Estimates the set-up, and noise and outliers in turn with it.
    ///
    /// # Errors
    /// If the iterations do not converge.
    pub fn settle(&mut self, values: &[f64]) -> Result<Vec<f64>, Diagnostic> {
        let mut problem = self.problem(values);
        let floor = problem.session.resolution_noise_mm();
        let mut beta = minimum(&problem, None)?.beta;
        for _ in 0..MAX_ROUNDS {
            let residuals = problem.residuals(&beta);
            let rejected = outliers::reject(&problem, &residuals);
            let mut settled = rejected == problem.rejected;
            problem.rejected = rejected;
            let mut estimated = estimate_noise_model(&mut problem, &residuals);
            if !estimated && problem.noise.source == NoiseSource::Residual {
                let kept = |test: usize, row: usize| !problem.rejected[test][row];
                if let Some(shown) = ShownNoise::of(&problem.tests, &residuals, kept) {
                    problem.noise = Noise::white(shown.sigma_mm.max(floor).max(MIN_UM * 1e-3), shown.source);
                    estimated = true;
                }
            }
            if matches!(problem.noise.source, NoiseSource::Repeats | NoiseSource::Targets) {
                self.noise_source = problem.noise.source;
            }
            settled &= !estimated;
            if settled {
                break;
            }
            beta = minimum(&problem, None)?.beta;
        }
        if self.model.noise.source == NoiseSource::Residual {
            // The model's own residual contains what the model lacks, and so does the residual here.
            let lacking = self.model.fit.heldout_rms_um * 1e-3;
            if problem.noise.sigma_mm < lacking {
                problem.noise = Noise::white(lacking, NoiseSource::Residual);
                self.noise_source = NoiseSource::Model;
                beta = minimum(&problem, None)?.beta;
            }
        }
        self.set_up.noise = problem.noise.clone();
        self.set_up.rejected.clone_from(&problem.rejected);
        self.full.noise = problem.noise;
        self.full.rejected = problem.rejected;
        Ok(beta)
    }

    /// The same readings without those that are not chosen.
    pub fn restricted_to(&self, chosen: &[Vec<bool>]) -> KnownErrors<'m> {
        let mut restricted = self.clone();
        for problem in [&mut restricted.set_up, &mut restricted.full] {
            for (rejected, chosen) in problem.rejected.iter_mut().zip(chosen) {
                rejected.iter_mut().zip(chosen).for_each(|(rejected, chosen)| *rejected |= !chosen);
            }
        }
        restricted
    }

    /// Rms and residuals at known errors and an estimated set-up.
    pub fn rms(&self, values: &[f64], beta: &[f64]) -> (Rms, Vec<Vec<f64>>) {
        let problem = self.problem(values);
        let residuals = problem.residuals(beta);
        let observations = whitened_readings(&problem) + problem.prior_rows();
        let freedom = observations.saturating_sub(beta.len()).max(1) as f64;
        let rms = Rms {
            scalar_mm: stated_rms_mm(&self.set_up, &residuals),
            vectors: self.set_up.are_vectors(),
            noise_ratio: (problem.sum_of_squares(beta) / freedom).sqrt(),
        };
        (rms, residuals)
    }

    /// Rms with other known errors and the set-up estimated again.
    ///
    /// # Errors
    /// If the iterations do not converge.
    pub fn rms_with(&self, values: &[f64]) -> Result<Rms, Diagnostic> {
        Ok(self.rms(values, &self.fit(values)?).0)
    }

    /// Residuals with other known errors and the set-up estimated again.
    ///
    /// # Errors
    /// If the iterations do not converge.
    pub fn residuals_with(&self, values: &[f64]) -> Result<Vec<Vec<f64>>, Diagnostic> {
        Ok(self.rms(values, &self.fit(values)?).1)
    }

    /// The session linearised by all parameters, at known errors and an estimated set-up.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn linearised(&self, values: &[f64], set_up: &[f64]) -> Result<Linearised, Diagnostic> {
        let list = &self.full.parameters.list;
        let mut beta = vec![0.0; list.len()];
        self.columns.iter().zip(values).for_each(|(column, value)| beta[*column] = *value);
        for (parameter, value) in self.set_up.parameters.list.iter().zip(set_up) {
            if let Some(j) = list.iter().position(|other| other.id == parameter.id) {
                beta[j] = *value;
            }
        }
        let triangle = self.full.prior_triangle(&beta).merged(&self.full.triangles(&beta)?);
        let sizes = self.full.parameters.sizes();
        let machine = triangle.eliminated(&self.columns, &sizes)?;
        let whitened = whitened_readings(&self.full);
        let rank = self.rank_of_set_up(&triangle, &sizes)?;
        let count = self.carried.len();
        let directions = &self.model.null_directions;
        let null_directions = faer::Mat::from_fn(count, directions.len(), |i, k| directions[k][self.carried[i]]);
        let own = &self.model.covariance;
        let covariance = faer::Mat::from_fn(count, count, |i, j| own[(self.carried[i], self.carried[j])])
            + &null_directions * null_directions.transpose();
        let freedom = (whitened + self.full.prior_rows()).saturating_sub(rank).max(1);
        Ok(Linearised { triangle, beta, machine, covariance, null_directions, freedom })
    }

    /// Number of identifiable directions of the set-up.
    fn rank_of_set_up(&self, triangle: &Triangle, sizes: &[f64]) -> Result<usize, Diagnostic> {
        let set_up: Vec<usize> = (0..sizes.len()).filter(|j| !self.columns.contains(j)).collect();
        let r = triangle.r();
        let scaled = faer::Mat::from_fn(r.nrows(), set_up.len(), |i, k| r[(i, set_up[k])] * sizes[set_up[k]]);
        Ok(abbe_identify::numerics::solve::Svd::of(scaled.as_ref())?.identifiable_rank())
    }

    /// The estimated set-up in display units.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn set_up_estimates(&self, values: &[f64]) -> Result<Vec<Estimate>, Diagnostic> {
        let problem = self.problem(values);
        let Minimum { beta, triangles, rank, .. } = minimum(&problem, None)?;
        let whole = problem.prior_triangle(&beta).merged(&triangles);
        let covariance = whole.covariance(&rank.identifiable_basis)?;
        let list = problem.parameters.list.iter().enumerate().filter(|(j, _)| rank.is_identifiable(*j));
        let estimate = list.map(|(j, parameter)| {
            let display = parameter.unit.display_per_internal;
            let u = covariance[(j, j)].max(0.0).sqrt() * display;
            let meaning = abbe_identify::parameter_description::parameter_meaning(&problem, j, None);
            Estimate::new(parameter.id.clone(), beta[j] * display, u, &parameter.unit.name).with_meaning(meaning)
        });
        Ok(estimate.collect())
    }

    /// A warning if the noise is not that of the session.
    pub fn noise_warning(&self) -> Option<String> {
        (self.noise_source == NoiseSource::Model).then(|| {
            format!(
                "the model's {} of {} counts as noise",
                match self.model.noise.source {
                    NoiseSource::Residual => "held-out rms, which contains what the model lacks,",
                    _ => "noise",
                },
                self.set_up.unit().text(self.set_up.noise.sigma_mm * 1e3, 2)
            )
        })
    }
}

/// Number of scalar readings after whitening.
fn whitened_readings(problem: &Problem) -> usize {
    problem.blocks().iter().map(|block| problem.kept_rows(block).len()).sum()
}

/// The noise before repeats are examined, and its source.
///
/// # Errors
/// If neither has a noise of the unit of the readings.
fn first_noise(model: &IdentifiedModel, session: &Session) -> Result<(Noise, NoiseSource), Diagnostic> {
    if let Some(sigma) = session.stated_noise_mm() {
        return Ok((Noise::white(sigma, NoiseSource::Stated), NoiseSource::Stated));
    }
    let unit = session.reading_unit();
    if model.unit != unit {
        return Err(error::missing(
            "the session",
            format!("noise, and that of the model is in {}", model.unit.symbol()),
            format!("state `noise_{unit}` in [instrument]"),
        ));
    }
    let noise = match model.noise.source {
        // A residual contains what the model lacks; on readings that it has not seen, that is the held-out error.
        NoiseSource::Residual => {
            Noise::white((model.fit.heldout_rms_um * 1e-3).max(model.noise.sigma_mm), NoiseSource::Residual)
        }
        // The inflation belongs to the likelihood of the model's families; it is no noise.
        NoiseSource::Stated
        | NoiseSource::Assumed
        | NoiseSource::Repeats
        | NoiseSource::Targets
        | NoiseSource::Model => Noise { source: NoiseSource::Residual, inflation: 1.0, ..model.noise.clone() },
    };
    Ok((noise, NoiseSource::Model))
}
