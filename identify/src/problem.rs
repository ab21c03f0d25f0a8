//! The least-squares problem of a session with readings, over blocks of rows.
//!
//! A block is a sequence of consecutive readings of one run. One sweep of the chain times the basis functions gives its
//! rows of `[J | r]`. The rows are whitened along the run and absorbed into the triangular factor of their test and
//! fold. That factor has one column for each parameter of the test.

mod factors;
mod priors;
mod whitening;

pub use whitening::Filter;

use std::ops::Range;
use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::axis::{Axis, AxisKind};
use abbe_model::effect::Effect;
use abbe_model::instrument::channel::{self, Channel};
use abbe_model::instrument::{Contact, Station};
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use abbe_model::unit::Unit;
use faer::{Mat, MatMut};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::error;
use crate::heldout::folds::Folds;
use crate::noise::{Noise, PureError, ReadingNoise, Repeatability};
use crate::numerics::parallel;
use crate::numerics::triangle::BLOCK_ROWS;
use crate::parameters::{Parameters, TestParameters};
use abbe_model::driver::Reference;

/// A session with readings, its parameters, and the weights of its readings.
#[derive(Clone)]
pub struct Problem {
    /// The session.
    pub session: Arc<Session>,
    /// The tests that have readings: the values of their channels, mm. An angle is multiplied by the session's lever
    /// ([`Session::lever_mm`]), so that all channels have the same noise.
    pub tests: Vec<Test>,
    /// The models of these tests.
    pub models: Vec<TestModel>,
    /// The parameters.
    pub parameters: Parameters,
    /// Reference values of the session, from which drivers count.
    pub reference: Reference,
    /// The noise of a reading.
    pub noise: Noise,
    /// Excluded outliers, by test and row.
    pub rejected: Vec<Vec<bool>>,
    /// The values that were not read, by test and scalar reading; empty for a test that lacks none.
    missing: Vec<Vec<bool>>,
    /// The folds of cross-validation.
    pub folds: Folds,
    /// For each test, the parameters that affect its readings.
    test_parameters: Vec<TestParameters>,
}

/// Consecutive rows of one run of one test.
#[derive(Clone, Debug)]
pub struct RowBlock {
    /// Index of the test.
    pub test: usize,
    /// Its rows.
    pub rows: Range<usize>,
}

/// An output of the chain of a test.
pub(crate) enum Swept<'p> {
    /// Observed − model of a channel.
    Residual { channel: usize },
    /// The derivative of a channel by a component: the parameters of the test on which the component depends, each with
    /// the values of its basis function at the readings.
    Derivative { channel: usize, own: &'p [(usize, Option<Arc<Vec<f64>>>)] },
}

/// Writes terms to the entries of a channel, the first of which is given, or adds them.
pub(crate) fn put(entries: &mut [f64], channels: usize, terms: impl Iterator<Item = f64>, is_new: bool) {
    // Separate loops for one channel, so that the compiler can vectorise them.
    match (channels, is_new) {
        (1, true) => entries.iter_mut().zip(terms).for_each(|(entry, term)| *entry = term),
        (1, false) => entries.iter_mut().zip(terms).for_each(|(entry, term)| *entry += term),
        (_, true) => entries.iter_mut().step_by(channels).zip(terms).for_each(|(entry, term)| *entry = term),
        (_, false) => entries.iter_mut().step_by(channels).zip(terms).for_each(|(entry, term)| *entry += term),
    }
}

/// Factor on each channel, mm per internal unit: an angle counts as the length that has the same noise.
fn weights(session: &Session, channels: &[Channel]) -> Vec<f64> {
    channels.iter().map(|channel| if channel.is_angle() { session.lever_mm } else { 1.0 }).collect()
}

/// The values of the channels of a test, times their weights.
fn weighted(session: &Session, station: &Station<f64>, readings: Arc<Readings>) -> Arc<Readings> {
    let weights = weights(session, station.channels());
    if weights.iter().all(|weight| *weight == 1.0) && !station.refers_to_nominal() {
        return readings;
    }
    let mut readings = Arc::unwrap_or_clone(readings);
    readings.columns_to_channels(&session.machine, station);
    for values in readings.observed.chunks_exact_mut(weights.len()) {
        values.iter_mut().zip(&weights).for_each(|(value, weight)| *value *= weight);
    }
    Arc::new(readings)
}

/// Largest factor by which one step changes a number that must be positive.
const MAX_FACTOR_OF_NUMBER: f64 = 3.0;
/// Number of random poses of a test, at least, and the travel of a linear axis that states none, mm.
const RANDOM_POSES: usize = 60;
const RANDOM_TRAVEL_MM: f64 = 300.0;
/// Mean number of readings below which runs are evaluated together.
const SHORT_RUN: usize = 8;
impl Problem {
    /// The problem of a session with its declared parameters and effects, for tests and stations whose free points and
    /// poses are found ([`Problem::new`] finds them).
    ///
    /// # Errors
    /// If an effect cannot be evaluated.
    pub(crate) fn at(
        session: &Session,
        mut tests: Vec<Test>,
        stations: Vec<Station<f64>>,
        noise: Noise,
        seed: u64,
    ) -> Result<Problem, Diagnostic> {
        let mut models: Vec<TestModel> = Vec::with_capacity(tests.len());
        for (test, station) in tests.iter_mut().zip(stations) {
            if let Some(readings) = &mut test.readings {
                *readings = weighted(session, &station, Arc::clone(readings));
                let model = TestModel::new(Arc::clone(&session.machine), station, readings);
                let weights = weights(session, model.channels());
                models.push(model.weighted(weights));
            }
        }
        let missing = |test: &Test| -> Vec<bool> {
            let observed = || test.readings.iter().flat_map(|readings| &readings.observed);
            if observed().any(|value| value.is_nan()) {
                observed().map(|value| value.is_nan()).collect()
            } else {
                Vec::new()
            }
        };
        let missing = tests.iter().map(missing).collect();
        let reference = session.reference();
        let parameters = Parameters::declared(session, &tests, &models)?;
        let rejected = models.iter().map(|model| vec![false; model.rows()]).collect();
        let folds = Folds::of(session, &tests, seed);
        let session = Arc::new(session.clone());
        let mut problem = Problem {
            session,
            tests,
            models,
            parameters,
            reference,
            noise,
            rejected,
            missing,
            folds,
            test_parameters: Vec::new(),
        };
        problem.update_test_parameters();
        for effect in &problem.session.clone().effects {
            problem.add_effect(effect)?;
        }
        Ok(problem)
    }

    /// The problem of the same set-ups at random poses over the travel of the axes, of instruments that measure a pose
    /// wherever the axes are; `None` for others, and with effects.
    pub(crate) fn at_random_poses(&self) -> Option<Problem> {
        let session = &self.session;
        let is_free = |test: &Test| {
            test.station.kind().entry().reads_poses
                && matches!(test.station.contact(), Contact::None)
                && !session.machine.axes.is_empty()
        };
        if !self.parameters.effects.is_empty() || !self.tests.iter().all(is_free) {
            return None;
        }
        let mut random = Pcg64::seed_from_u64(1);
        let poses = RANDOM_POSES.max(self.parameters.list.len());
        let mut tests = self.tests.clone();
        for test in &mut tests {
            let channels = test.station.channels().len();
            let mut within = |axis: &Axis| -> Vec<f64> {
                let [low, high] = axis.travel.unwrap_or(match axis.kind {
                    AxisKind::Rotary => [-std::f64::consts::PI, std::f64::consts::PI],
                    AxisKind::Linear => [-RANDOM_TRAVEL_MM, RANDOM_TRAVEL_MM],
                });
                (0..poses).map(|_| low + (high - low) * random.random::<f64>()).collect()
            };
            let positions = session.machine.axes.iter().map(&mut within).collect();
            let observed = vec![0.0; poses * channels];
            test.readings = Some(Arc::new(Readings { positions, observed, channels, ..Readings::default() }));
        }
        let stations = self.models.iter().map(|model| model.station().clone()).collect();
        Problem::at(session, tests, stations, self.noise.clone(), 1).ok()
    }

    /// Adds the coefficients of an effect to the parameters.
    ///
    /// # Errors
    /// See [`Parameters::add_effect`].
    pub fn add_effect(&mut self, effect: &Effect) -> Result<(), Diagnostic> {
        self.parameters.add_effect(&self.session, &self.tests, &self.models, &self.reference, effect)?;
        self.update_test_parameters();
        Ok(())
    }

    /// Adds the changes of estimated numbers of shapes in `beta` (internal units, one value per parameter) to the shapes,
    /// sets them to zero, and linearises the model in these numbers at the coefficients in `beta`.
    ///
    /// # Errors
    /// If the data lack the column of a driver.
    pub fn linearise_numbers(&mut self, beta: &mut [f64]) -> Result<(), Diagnostic> {
        if self.parameters.has_numbers() || self.parameters.positions().next().is_some() {
            let (tests, models) = (&self.tests, &self.models);
            self.parameters.linearise_numbers(&self.session, tests, models, &self.reference, beta)?;
            self.update_test_parameters();
        }
        Ok(())
    }

    /// The values of the driver of an effect at the readings, ascending, each once, internal unit of the driver.
    ///
    /// # Errors
    /// If the data lack the column of the driver.
    pub(crate) fn levels(&self, effect: &Effect) -> Result<Vec<f64>, Diagnostic> {
        Parameters::levels(&self.session, &self.tests, &self.models, &self.reference, effect)
    }

    /// Limits the changes of estimated numbers to what their shapes permit and to a factor of [`MAX_FACTOR_OF_NUMBER`].
    pub(crate) fn bound_numbers(&self, beta: &mut [f64]) {
        for (parameter, change) in self.parameters.list.iter().zip(beta) {
            let Some(effect) = parameter.number_of() else { continue };
            let shape = &self.parameters.effects[effect].shape;
            let present = shape.number(parameter.index);
            let is_valid = |change: f64| shape.with_number(parameter.index, present + change).check().is_ok();
            if !is_valid(-2.0 * present.abs()) {
                let [low, high] = [1.0 / MAX_FACTOR_OF_NUMBER, MAX_FACTOR_OF_NUMBER].map(|factor| factor * present);
                *change = change.clamp(low - present, high - present);
            }
        }
    }

    /// Whether the shapes can have their numbers with these changes.
    pub(crate) fn has_valid_numbers(&self, beta: &[f64]) -> bool {
        self.parameters.list.iter().zip(beta).all(|(parameter, change)| {
            parameter.number_of().is_none_or(|effect| {
                let (shape, number) = (&self.parameters.effects[effect].shape, parameter.index);
                shape.with_number(number, shape.number(number) + change).check().is_ok()
            })
        })
    }

    fn update_test_parameters(&mut self) {
        self.test_parameters =
            self.parameters.contributions.iter().map(|contributions| TestParameters::of(contributions)).collect();
    }

    /// The same problem without the families whose prior scale is estimated, and the index of each of its parameters.
    pub(crate) fn without_families(&self) -> (Problem, Vec<usize>) {
        let (parameters, kept) = self.parameters.without_families();
        let mut problem = Problem { parameters, ..self.clone() };
        problem.update_test_parameters();
        (problem, kept)
    }

    /// The same problem with one fold for each test.
    pub(crate) fn folded_by_test(&self) -> Problem {
        self.with_folds(Folds::by_test(&self.models))
    }

    /// The same problem with other folds.
    pub(crate) fn with_folds(&self, folds: Folds) -> Problem {
        Problem { folds, ..self.clone() }
    }

    /// Number of scalar readings of a test that are not excluded.
    pub fn scalars_of(&self, test: usize) -> usize {
        let rows = self.rejected[test].iter().filter(|rejected| !**rejected).count();
        let missing = self.missing[test].iter().enumerate();
        let channels = self.channels(test);
        rows * channels - missing.filter(|(i, missing)| **missing && !self.rejected[test][i / channels]).count()
    }

    /// Number of scalar readings that are not excluded.
    pub fn scalars(&self) -> usize {
        (0..self.tests.len()).map(|test| self.scalars_of(test)).sum()
    }

    /// Whether a scalar reading of a test was read and is not excluded.
    #[inline(always)]
    pub fn counts(&self, test: usize, scalar: usize) -> bool {
        let row = match self.channels(test) {
            1 => scalar,
            channels => scalar / channels,
        };
        !self.rejected[test][row] && !self.is_missing(test, scalar)
    }

    /// Whether a scalar reading of a test was not read.
    #[inline]
    pub(crate) fn is_missing(&self, test: usize, scalar: usize) -> bool {
        self.missing[test].get(scalar) == Some(&true)
    }

    /// Number of readings that are not excluded.
    pub fn readings(&self) -> usize {
        self.rejected.iter().flatten().filter(|rejected| !**rejected).count()
    }

    /// Number of channels of a reading of a test.
    pub fn channels(&self, test: usize) -> usize {
        self.models[test].weights().len()
    }

    /// The noise that repeats show, from the residuals of any model, mm, test by test.
    pub(crate) fn repeatability(&self, residuals: &[Vec<f64>]) -> Repeatability {
        PureError::of(&self.tests, residuals, |test, row| !self.rejected[test][row]).repeatability()
    }

    /// The noise of a reading, as results have it.
    pub fn reading_noise(&self) -> ReadingNoise {
        ReadingNoise { unit: self.unit(), value: self.noise.sigma_mm * 1e3, source: self.noise.source }
    }

    /// The unit of readings and residuals in results: µm, or ″ if every channel is an angle. At the lever of such
    /// a session ([`Session::lever_mm`]) one arcsecond is one micrometre.
    pub fn unit(&self) -> Unit {
        self.session.reading_unit()
    }

    /// Whether the readings of all tests are vectors, three coordinates each.
    pub fn are_vectors(&self) -> bool {
        self.models.iter().all(|model| channel::are_vector(model.channels()))
    }

    /// The blocks of rows, in order.
    pub fn blocks(&self) -> Vec<RowBlock> {
        let mut blocks = Vec::new();
        for (test, plan) in self.tests.iter().enumerate() {
            let Some(readings) = &plan.readings else { continue };
            let mut runs = readings.runs();
            // One by one, many short runs are slow. Only a whitening filter has to separate them.
            if self.noise.ar_coefficients.is_empty() && readings.rows() < SHORT_RUN * runs.len() {
                runs = std::iter::once(0..readings.rows()).collect();
            }
            for run in runs {
                // A block must not cut a whitening filter. Without a filter, a block has the number of rows that a
                // factor absorbs at once.
                let most = if self.noise.ar_coefficients.is_empty() {
                    (BLOCK_ROWS / self.channels(test)).max(1)
                } else {
                    run.len().max(1)
                };
                let mut start = run.start;
                while start < run.end {
                    let end = (start + most).min(run.end);
                    blocks.push(RowBlock { test, rows: start..end });
                    start = end;
                }
            }
        }
        blocks
    }

    /// The components of every test at the parameters `beta` (internal units).
    pub fn slot_values(&self, beta: &[f64]) -> Vec<SlotValues> {
        self.parameters.slot_values(&self.models, beta)
    }

    /// Rows of `[J | r]` of a block in mm, not whitened, outliers included: (rows × channels) × (parameters + 1).
    ///
    /// # Errors
    /// If the model yields a number that is not finite.
    pub fn rows(&self, values: &[SlotValues], block: &RowBlock) -> Result<Mat<f64>, Diagnostic> {
        let own = &self.test_parameters[block.test].parameters;
        let own_rows = self.own_rows(&values[block.test], block)?;
        let mut rows = Mat::zeros(own_rows.nrows(), self.parameters.list.len() + 1);
        let indices = own.iter().copied().chain([self.parameters.list.len()]);
        for (index, column) in indices.zip(own_rows.col_iter()) {
            rows.col_mut(index).copy_from(column);
        }
        Ok(rows)
    }

    /// The parameters that affect the readings of a test.
    pub fn own_parameters(&self, test: usize) -> &[usize] {
        &self.test_parameters[test].parameters
    }

    /// The nonzero columns of [`Problem::rows`]: those of [`Problem::own_parameters`], and the residual. `values`
    /// belong to the block's test.
    ///
    /// # Errors
    /// If the model yields a number that is not finite.
    pub fn own_rows(&self, values: &SlotValues, block: &RowBlock) -> Result<Mat<f64>, Diagnostic> {
        let (rows, columns) = self.shape(block);
        let mut rows = Mat::zeros(rows, columns);
        self.own_rows_into(values, block, rows.as_mut())?;
        Ok(rows)
    }

    /// The numbers of rows and columns of [`Problem::own_rows`].
    fn shape(&self, block: &RowBlock) -> (usize, usize) {
        (block.rows.len() * self.channels(block.test), self.own_parameters(block.test).len() + 1)
    }

    /// Writes [`Problem::own_rows`] over other rows.
    fn own_rows_into(
        &self,
        values: &SlotValues,
        block: &RowBlock,
        mut rows: MatMut<'_, f64>,
    ) -> Result<(), Diagnostic> {
        let channels = self.channels(block.test);
        let parameters = self.own_parameters(block.test).len();
        if self.tests[block.test].readings.is_none() {
            rows.fill(0.0);
            return Ok(());
        }
        let mut columns: Vec<&mut [f64]> = (rows.as_mut().col_iter_mut())
            .filter_map(|column| Some(column.try_as_col_major_mut()?.as_slice_mut()))
            .collect();
        // For each column and channel, the reading up to which it is written: further terms are added.
        let mut written = vec![0; parameters * channels];
        self.sweep(values, block, |output, start, values| {
            let first = |channel: usize| start * channels + channel;
            let (channel, own) = match output {
                Swept::Residual { channel } => {
                    let entries = &mut columns[parameters][first(channel)..];
                    return put(entries, channels, values.iter().copied(), true);
                }
                Swept::Derivative { channel, own } => (channel, own),
            };
            for (parameter, basis) in own {
                let written = &mut written[parameter * channels + channel];
                let is_new = *written <= start;
                *written = start + values.len();
                let entries = &mut columns[*parameter][first(channel)..];
                match basis {
                    None => put(entries, channels, values.iter().copied(), is_new),
                    Some(basis) => {
                        let basis = &basis[block.rows.start + start..];
                        put(entries, channels, values.iter().zip(basis).map(|(d, b)| d * b), is_new);
                    }
                }
            }
        })?;
        // A value that was not read says nothing.
        let first = block.rows.start * channels;
        for i in (0..rows.nrows()).filter(|i| self.is_missing(block.test, first + i)) {
            rows.as_mut().row_mut(i).fill(0.0);
        }
        Ok(())
    }

    /// Sweeps the chain of a test with readings over a block. `put` receives an output, the first reading of the values
    /// relative to the start of the block, and one value per reading, mm and mm per internal unit.
    ///
    /// # Errors
    /// If the model yields a number that is not finite.
    pub(crate) fn sweep(
        &self,
        values: &SlotValues,
        block: &RowBlock,
        mut put: impl FnMut(Swept<'_>, usize, &[f64]),
    ) -> Result<(), Diagnostic> {
        let Some(readings) = &self.tests[block.test].readings else { return Ok(()) };
        let channels = self.channels(block.test);
        let own = &self.test_parameters[block.test];
        let slots = own.slots.len();
        let all = &readings.observed[block.rows.start * channels..block.rows.end * channels];
        let mut residual: Vec<f64> = Vec::new();
        let mut bad = None;
        self.models[block.test].sweep(values, &own.slots, block.rows.clone(), |output, start, values| {
            if let Some(by) = output.checked_sub(channels) {
                let own = &own.contributions[by % slots];
                return put(Swept::Derivative { channel: by / slots, own }, start, values);
            }
            let observed = || all[start * channels + output..].iter().step_by(channels);
            residual.clear();
            residual.resize(values.len(), 0.0);
            let entries = residual.iter_mut().zip(values);
            // As in [`put`].
            match channels {
                1 => entries.zip(&all[start..]).for_each(|((entry, value), observed)| *entry = observed - value),
                _ => entries.zip(observed()).for_each(|((entry, value), observed)| *entry = observed - value),
            }
            if bad.is_none() && residual.iter().any(|residual| !residual.is_finite()) {
                let rows = observed().zip(values).zip(&residual).enumerate();
                let found = |(_, ((observed, _), residual)): &(usize, ((&f64, &f64), &f64))| {
                    !residual.is_finite() && !observed.is_nan()
                };
                bad = rows.into_iter().find(found).map(|(i, ((_, value), _))| (start + i, *value));
            }
            put(Swept::Residual { channel: output }, start, &residual);
        });
        match bad {
            None => Ok(()),
            Some((row, value)) => {
                Err(error::not_finite(&self.tests[block.test].name, block.rows.start + row + 1, value))
            }
        }
    }

    /// Residuals observed − model of every test, mm, outliers included; zero for a value that was not read.
    pub fn residuals(&self, beta: &[f64]) -> Vec<Vec<f64>> {
        let values = self.slot_values(beta);
        parallel::map(self.models.len(), &|test| {
            let mut residuals = self.models[test].readings(&values[test]);
            let observed = self.tests[test].readings.iter().flat_map(|readings| &readings.observed);
            residuals.iter_mut().zip(observed).for_each(|(value, observed)| *value = observed - *value);
            let missing = residuals.iter_mut().zip(&self.missing[test]).filter(|(_, missing)| **missing);
            missing.for_each(|(value, _)| *value = 0.0);
            residuals
        })
    }

    /// Sum of squares of whitened residuals and priors.
    pub fn sum_of_squares(&self, beta: &[f64]) -> f64 {
        let residuals = self.residuals(beta);
        let blocks = self.blocks();
        let squares = parallel::map(blocks.len(), &|k| {
            let block = &blocks[k];
            let channels = self.channels(block.test);
            let residual = &residuals[block.test][block.rows.start * channels..block.rows.end * channels];
            let column = Mat::from_fn(residual.len(), 1, |i, _| residual[i]);
            let (white, _) = self.whiten(&column, block);
            white.col(0).iter().map(|value| value * value).sum::<f64>()
        });
        let readings: f64 = squares.iter().sum();
        readings + self.prior_triangle(beta).sum_of_squares()
    }
}
