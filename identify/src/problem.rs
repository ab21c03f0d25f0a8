//! A session with readings as a least-squares problem over blocks of rows.
//!
//! A block is a stretch of consecutive readings of one run. Its rows of `[J | r]` are made from one sweep of dual numbers times the basis
//! functions, whitened along the run, and absorbed into the triangle of the fold that they belong to.

use std::ops::Range;

use abbe_model::effect::Effect;
use abbe_model::instrument::Station;
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::{Prior, Session, Test};
use faer::Mat;
use num_dual::DualNum;
use rayon::prelude::*;

use crate::drivers::Origin;
use crate::error::IdentifyError;
use crate::heldout::Folds;
use crate::noise::Noise;
use crate::parameters::Parameters;
use crate::triangle::{BLOCK_ROWS, Triangle};

/// A session with readings, its unknowns, and how its readings are weighted.
#[derive(Clone)]
pub struct Problem<'a> {
    /// The session.
    pub session: &'a Session,
    /// The tests that have readings.
    pub tests: Vec<&'a Test>,
    /// Those tests, ready to be evaluated.
    pub models: Vec<TestModel<'a>>,
    /// The unknowns.
    pub parameters: Parameters,
    /// When the session began.
    pub origin: Origin,
    /// The noise of a reading.
    pub noise: Noise,
    /// Readings that are left out, by test and row.
    pub rejected: Vec<Vec<bool>>,
    /// Which readings are left out together when the model is judged.
    pub folds: Folds,
    /// The slots that some parameter moves, by test.
    slots: Vec<Vec<usize>>,
}

/// Consecutive rows of one run of one test.
#[derive(Clone, Debug)]
pub struct Block {
    /// Index of the test.
    pub test: usize,
    /// Its rows.
    pub rows: Range<usize>,
}

impl<'a> Problem<'a> {
    /// From a session, with its declared unknowns and effects.
    ///
    /// # Errors
    /// If there are no readings, or an effect cannot be evaluated.
    pub fn new(session: &'a Session, noise: Noise, seed: u64) -> Result<Problem<'a>, IdentifyError> {
        let tests: Vec<&Test> = session
            .tests
            .iter()
            .filter(|test| test.readings.is_some())
            .collect();
        if tests.is_empty() {
            return Err(IdentifyError::NoReadings);
        }
        let stations = crate::start::stations(session, &tests);
        let models: Vec<TestModel<'a>> = tests
            .iter()
            .zip(stations)
            .filter_map(|(test, station)| {
                let readings = test.readings.as_ref()?;
                Some(TestModel::new(&session.machine, station, readings))
            })
            .collect();
        let origin = Origin::of(session);
        let parameters = Parameters::declared(session, &tests, &models)?;
        let rejected = models.iter().map(|model| vec![false; model.rows()]).collect();
        let folds = Folds::of(session, &tests, seed);
        let mut problem = Problem {
            session,
            tests,
            models,
            parameters,
            origin,
            noise,
            rejected,
            folds,
            slots: Vec::new(),
        };
        problem.update_slots();
        for effect in &session.effects {
            problem.add_effect(effect)?;
        }
        Ok(problem)
    }

    /// Adds an effect's coefficients to the unknowns.
    ///
    /// # Errors
    /// See [`Parameters::add_effect`].
    pub fn add_effect(&mut self, effect: &Effect) -> Result<(), IdentifyError> {
        self.parameters
            .add_effect(self.session, &self.tests, &self.models, &self.origin, effect)?;
        self.update_slots();
        Ok(())
    }

    fn update_slots(&mut self) {
        self.slots = self
            .parameters
            .parts
            .iter()
            .map(|parts| {
                let mut slots: Vec<usize> = parts.iter().map(|part| part.slot).collect();
                slots.sort_unstable();
                slots.dedup();
                slots
            })
            .collect();
    }

    /// Number of readings that count.
    pub fn readings(&self) -> usize {
        self.rejected
            .iter()
            .flatten()
            .filter(|rejected| !**rejected)
            .count()
    }

    /// Number of scalar coordinates a reading.
    pub fn coordinates(&self) -> usize {
        self.session.instrument.coordinates()
    }

    /// The stretches of rows that are evaluated together, in order.
    pub fn blocks(&self) -> Vec<Block> {
        let mut blocks = Vec::new();
        for (test, plan) in self.tests.iter().enumerate() {
            let Some(readings) = &plan.readings else { continue };
            for run in readings.runs() {
                // A whitening filter must not be cut; without one, blocks are what the triangle absorbs at once.
                let most = if self.noise.memory.is_empty() {
                    (BLOCK_ROWS / self.coordinates()).max(1)
                } else {
                    run.len().max(1)
                };
                let mut start = run.start;
                while start < run.end {
                    let end = (start + most).min(run.end);
                    blocks.push(Block {
                        test,
                        rows: start..end,
                    });
                    start = end;
                }
            }
        }
        blocks
    }

    /// The components of every test at the unknowns' values (inside units).
    pub fn slot_values(&self, beta: &[f64]) -> Vec<SlotValues> {
        self.parameters.slot_values(&self.models, beta)
    }

    /// Residuals observed − model of a block, mm, a reading's coordinates together.
    fn residual_block(&self, values: &[SlotValues], block: &Block, readings_mm: &[f64]) -> Vec<f64> {
        let _ = values;
        let coordinates = self.coordinates();
        let scalars = block.rows.start * coordinates..block.rows.end * coordinates;
        let Some(readings) = &self.tests[block.test].readings else {
            return Vec::new();
        };
        readings.observed[scalars]
            .iter()
            .zip(readings_mm)
            .map(|(observed, model)| observed - model)
            .collect()
    }

    /// Rows of `[J | r]` of a block in mm, not whitened, rejected rows included: (rows × coordinates) × (unknowns + 1).
    ///
    /// # Errors
    /// If the model yields a number that is not finite.
    pub fn rows(&self, values: &[SlotValues], block: &Block) -> Result<Mat<f64>, IdentifyError> {
        let model = &self.models[block.test];
        let slots = &self.slots[block.test];
        let sensitivities = model.sensitivities(&values[block.test], slots, block.rows.clone());
        let residual = self.residual_block(values, block, &sensitivities.readings_mm);
        let coordinates = self.coordinates();
        if let Some(bad) = residual.iter().position(|value| !value.is_finite()) {
            return Err(IdentifyError::NotFinite {
                test: self.tests[block.test].name.clone(),
                row: block.rows.start + bad / coordinates + 1,
                value: sensitivities.readings_mm[bad],
            });
        }
        let unknowns = self.parameters.list.len();
        let mut rows = Mat::zeros(residual.len(), unknowns + 1);
        for part in &self.parameters.parts[block.test] {
            let Ok(place) = slots.binary_search(&part.slot) else {
                continue;
            };
            let derivative = &sensitivities.derivatives[place];
            let column = rows.col_mut(part.parameter);
            let entries = column.try_as_col_major_mut().map(|column| column.as_slice_mut());
            let Some(entries) = entries else { continue };
            match &part.basis {
                None => entries
                    .iter_mut()
                    .zip(derivative)
                    .for_each(|(entry, d)| *entry += d),
                Some(basis) => {
                    for (i, (entry, d)) in entries.iter_mut().zip(derivative).enumerate() {
                        *entry += d * basis[block.rows.start + i / coordinates];
                    }
                }
            }
        }
        for (i, value) in residual.into_iter().enumerate() {
            rows[(i, unknowns)] = value;
        }
        Ok(rows)
    }

    /// The scalar rows of a block that whitening keeps: those that neither are nor remember a rejected reading.
    pub fn kept_rows(&self, block: &Block) -> Vec<usize> {
        let coordinates = self.coordinates();
        let rejected = &self.rejected[block.test];
        (0..block.rows.len() * coordinates)
            .filter(|i| {
                let row = block.rows.start + i / coordinates;
                let reach = self.noise.memory.len().min(i / coordinates);
                (row - reach..=row).all(|row| !rejected[row])
            })
            .collect()
    }

    /// Divides rows by the noise: `(x_t − Σ a_k x_{t−k})/σ_innovation` along a run, and drops rejected ones. Returns the rows that remain, with
    /// the fold of each.
    pub fn whiten(&self, rows: &Mat<f64>, block: &Block) -> (Mat<f64>, Vec<usize>) {
        let coordinates = self.coordinates();
        let memory = &self.noise.memory;
        let fold_of = &self.folds.of_row[block.test];
        let kept = self.kept_rows(block);
        let innovation = 1.0 / self.noise.innovation_mm();
        let marginal = 1.0 / self.noise.sigma_mm;
        let white = Mat::from_fn(kept.len(), rows.ncols(), |k, j| {
            let i = kept[k];
            if i / coordinates < memory.len() {
                return rows[(i, j)] * marginal;
            }
            let past: f64 = memory
                .iter()
                .enumerate()
                .map(|(lag, a)| a * rows[(i - (lag + 1) * coordinates, j)])
                .sum();
            (rows[(i, j)] - past) * innovation
        });
        let folds = kept
            .iter()
            .map(|i| fold_of[block.rows.start + i / coordinates])
            .collect();
        (white, folds)
    }

    /// The triangle of each fold at the unknowns' values, in inside units of the unknowns.
    ///
    /// # Errors
    /// If the model yields a number that is not finite.
    pub fn triangles(&self, beta: &[f64]) -> Result<Vec<Triangle>, IdentifyError> {
        let unknowns = self.parameters.list.len();
        let values = self.slot_values(beta);
        let blocks = self.blocks();
        let partial: Vec<Vec<(usize, Triangle)>> = blocks
            .par_iter()
            .map(|block| {
                let rows = self.rows(&values, block)?;
                let (white, folds) = self.whiten(&rows, block);
                let mut present: Vec<usize> = folds.clone();
                present.sort_unstable();
                present.dedup();
                Ok(present
                    .into_iter()
                    .map(|fold| {
                        let chosen: Vec<usize> = (0..folds.len()).filter(|i| folds[*i] == fold).collect();
                        let part = Mat::from_fn(chosen.len(), white.ncols(), |i, j| white[(chosen[i], j)]);
                        let mut triangle = Triangle::new(unknowns);
                        triangle.absorb(part.as_ref());
                        (fold, triangle)
                    })
                    .collect())
            })
            .collect::<Result<_, IdentifyError>>()?;
        let mut triangles = vec![Triangle::new(unknowns); self.folds.count];
        for (fold, triangle) in partial.into_iter().flatten() {
            triangles[fold].merge(&triangle);
        }
        Ok(triangles)
    }

    /// What is known beforehand, as rows: Gaussian priors and distances between sockets.
    pub fn prior_triangle(&self, beta: &[f64]) -> Triangle {
        self.prior_triangle_about(beta, |_| 0.0, |_| 0.0)
    }

    /// The same with other expectations: `centre` of each unknown with a Gaussian prior, and by how much each distance between sockets is
    /// `longer`, mm.
    pub fn prior_triangle_about(
        &self,
        beta: &[f64],
        centre: impl Fn(usize) -> f64,
        longer: impl Fn(usize) -> f64,
    ) -> Triangle {
        let unknowns = self.parameters.list.len();
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for (j, parameter) in self.parameters.list.iter().enumerate() {
            if let Prior::Gaussian(u) = parameter.prior {
                let mut row = vec![0.0; unknowns + 1];
                row[j] = 1.0 / u;
                row[unknowns] = (centre(j) - beta[j]) / u;
                rows.push(row);
            }
        }
        for (number, distance) in self.session.socket_distances.iter().enumerate() {
            let ends: Vec<Option<([usize; 3], [f64; 3])>> =
                distance.between.iter().map(|name| self.socket(name)).collect();
            let [Some((a, nominal_a)), Some((b, nominal_b))] = ends[..] else {
                continue;
            };
            let place = |k: usize, unknown: usize, nominal: f64| {
                let mut seed = nalgebra::SVector::<f64, 6>::zeros();
                seed[k] = 1.0;
                num_dual::DualSVec64::<6>::new(nominal + beta[unknown], num_dual::Derivative::some(seed))
            };
            let square = (0..3)
                .map(|i| (place(i, a[i], nominal_a[i]) - place(i + 3, b[i], nominal_b[i])).powi(2))
                .fold(num_dual::DualSVec64::<6>::from(0.0), |sum, term| sum + term);
            let length = square.sqrt();
            let gradient = length
                .eps
                .unwrap_generic(nalgebra::Const::<6>, nalgebra::Const::<1>);
            let mut row = vec![0.0; unknowns + 1];
            for i in 0..3 {
                row[a[i]] += gradient[i] / distance.u_mm;
                row[b[i]] += gradient[i + 3] / distance.u_mm;
            }
            row[unknowns] = (distance.distance_mm + longer(number) - length.re) / distance.u_mm;
            rows.push(row);
        }
        let mut triangle = Triangle::new(unknowns);
        triangle.absorb(Mat::from_fn(rows.len(), unknowns + 1, |i, j| rows[i][j]).as_ref());
        triangle
    }

    /// The unknowns of a socket and where it stands nominally.
    fn socket(&self, name: &str) -> Option<([usize; 3], [f64; 3])> {
        let test = self
            .tests
            .iter()
            .position(|test| test.socket.as_deref() == Some(name))?;
        let Station::Socket(station) = self.models[test].station() else {
            return None;
        };
        let mut unknowns = [0; 3];
        for (unknown, coordinate) in unknowns.iter_mut().zip(["x", "y", "z"]) {
            let id = format!("socket.{coordinate}[{name}]");
            *unknown = self
                .parameters
                .list
                .iter()
                .position(|parameter| parameter.id == id)?;
        }
        Some((unknowns, station.socket))
    }

    /// Residuals observed − model of every test, mm, rejected readings included.
    pub fn residuals(&self, beta: &[f64]) -> Vec<Vec<f64>> {
        let values = self.slot_values(beta);
        self.models
            .par_iter()
            .enumerate()
            .map(|(test, model)| {
                let block = Block {
                    test,
                    rows: 0..model.rows(),
                };
                let readings = model.readings_mm(&values[test]);
                self.residual_block(&values, &block, &readings)
            })
            .collect()
    }

    /// Sum of squares of whitened residuals and priors.
    pub fn sum_of_squares(&self, beta: &[f64]) -> f64 {
        let residuals = self.residuals(beta);
        let coordinates = self.coordinates();
        let readings: f64 = self
            .blocks()
            .iter()
            .map(|block| {
                let residual =
                    &residuals[block.test][block.rows.start * coordinates..block.rows.end * coordinates];
                let column = Mat::from_fn(residual.len(), 1, |i, _| residual[i]);
                let (white, _) = self.whiten(&column, block);
                (0..white.nrows()).map(|i| white[(i, 0)].powi(2)).sum::<f64>()
            })
            .sum();
        let nothing = vec![0.0; beta.len()];
        readings + self.prior_triangle(beta).sum_of_squares_after(&nothing)
    }
}
