//! The columns of candidates: sensitivity × basis function, whitened as the readings are.
//!
//! The chain is evaluated once for the sensitivities of every component. Hundreds of candidates need no further
//! kinematics.

mod adjoint;
mod basis;
mod states;
mod unwhitened;

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock};

use abbe_identify::numerics::parallel;
use abbe_identify::problem::{Problem, RowBlock};
use abbe_model::Diagnostic;
use abbe_model::driver::DriverSample;
use abbe_model::sensitivity::Sensitivities;
use abbe_model::unit::Unit;
pub use adjoint::{Adjoint, TrainingRows, WhitenedRows};
pub use basis::{EffectColumns, chunked};
use faer::{Mat, MatMut};
pub use states::{Channel, DriverStates, Sensitivity, SensitivityValues};

/// Number of readings per evaluation of sensitivities.
const ROWS_AT_ONCE: usize = 512;
/// Evaluations whose results are held beside the whole.
const PIECES_AT_ONCE: usize = 64;

/// The whitened rows of a problem in fold order, and the data to compute the columns of any effect.
pub struct Columns<'p> {
    problem: &'p Problem,
    /// For each test the derivative of each scalar reading by each slot.
    derivatives: Vec<HashMap<usize, Arc<Vec<f64>>>>,
    blocks: Vec<RowBlock>,
    /// The scalar rows of each block that whitening keeps.
    kept: Vec<Vec<usize>>,
    /// Index of each whitened row, block after block, in fold order.
    target: Vec<usize>,
    /// The rows of each fold.
    pub fold_rows: Vec<Range<usize>>,
    /// The whitened rows of each block. Projections without single folds share most of them.
    whole: OnceLock<Vec<Arc<WhitenedRows>>>,
    rows: usize,
    /// What each component changes, by its name and tests. Channels with other drivers share it.
    acting: Mutex<HashMap<String, Option<Acting>>>,
    /// The samples of each driver, by test and name. `None` if the data have no such column.
    samples: Mutex<HashMap<(usize, String), Option<SharedSamples>>>,
    /// The distinct states of each driver, by name, the part that shapes use, and tests.
    states: Mutex<HashMap<String, Arc<DriverStates>>>,
    /// The channels, by component, driver and tests. `None` if the data lack the driver.
    channels: Mutex<HashMap<String, Option<Arc<Channel>>>>,
    /// The basis functions of each shape, by the address of the states and the shape.
    bases: Mutex<HashMap<(usize, String), Arc<Mat<f32>>>>,
}

/// The change of each scalar reading per unit of a component, by test, and the largest factor of a sensitivity in it.
type Acting = (Vec<Arc<Vec<f64>>>, f64);

type SharedSamples = Arc<Vec<DriverSample<f64>>>;

impl<'p> Columns<'p> {
    /// Computes the sensitivities at the parameter values of a fit.
    pub fn new(problem: &'p Problem, beta: &[f64]) -> Columns<'p> {
        let derivatives = sensitivities(problem, beta).into_iter();
        let derivatives =
            derivatives.map(|of_test| of_test.slots.into_iter().zip(shared(of_test.derivatives)).collect()).collect();
        Columns { derivatives, ..Columns::of_readings(problem) }
    }

    /// For terms of the readings alone ([`Columns::reading_columns`]): no component acts.
    pub fn of_readings(problem: &'p Problem) -> Columns<'p> {
        let blocks = problem.blocks();
        let mut fold_of = Vec::new();
        let kept: Vec<Vec<usize>> = blocks.iter().map(|block| problem.kept_rows(block)).collect();
        for (block, kept) in blocks.iter().zip(&kept) {
            fold_of.extend(problem.folds_of(kept, block));
        }
        let mut next = 0;
        let mut target = vec![0; fold_of.len()];
        let mut fold_rows = Vec::new();
        for fold in 0..problem.folds.count {
            let start = next;
            for (row, _) in fold_of.iter().enumerate().filter(|(_, f)| **f == fold) {
                target[row] = next;
                next += 1;
            }
            fold_rows.push(start..next);
        }
        Columns {
            problem,
            derivatives: vec![HashMap::new(); problem.tests.len()],
            blocks,
            kept,
            rows: target.len(),
            target,
            fold_rows,
            whole: OnceLock::new(),
            acting: Default::default(),
            samples: Default::default(),
            states: Default::default(),
            channels: Default::default(),
            bases: Default::default(),
        }
    }

    /// The unit of figures of readings.
    pub fn unit(&self) -> Unit {
        self.problem.unit()
    }

    /// Number of whitened rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The unwhitened columns of effects in one block, mm.
    fn block_rows(&self, column_sets: &[&EffectColumns], block: &RowBlock) -> Mat<f64> {
        let channels = self.problem.channels(block.test);
        let total: usize = column_sets.iter().map(|column_set| column_set.count).sum();
        let mut raw = Mat::<f64>::zeros(block.rows.len() * channels, total);
        let mut column = 0;
        for column_set in column_sets {
            if column_set.acts_in(block.test) {
                let Channel { sensitivity, states, .. } = &*column_set.channel;
                let (sensitivity, first) = (&sensitivity[block.test], block.rows.start * channels);
                for k in 0..column_set.count {
                    let basis = column_set.basis.col_as_slice(k);
                    let state = |scalar: usize| states.of_scalar(block.test, scalar, channels);
                    let entries = raw.col_as_slice_mut(column + k).iter_mut().zip(first..);
                    entries.for_each(|(entry, i)| *entry = sensitivity.at(i) * f64::from(basis[state(i)]));
                }
            }
            column += column_set.count;
        }
        raw
    }

    /// Fills zero columns with the whitened columns of effects, one after another.
    pub fn fill(&self, column_sets: &[&EffectColumns], mut columns: MatMut<'_, f64>) {
        let total: usize = column_sets.iter().map(|column_set| column_set.count).sum();
        let mut start = 0;
        for (block, kept) in self.blocks.iter().zip(&self.kept) {
            let target = &self.target[start..start + kept.len()];
            start += kept.len();
            if target.is_empty() || !column_sets.iter().any(|column_set| column_set.acts_in(block.test)) {
                continue;
            }
            let white = self.problem.whitened(self.block_rows(column_sets, block), kept);
            let together = target.windows(2).all(|pair| pair[1] == pair[0] + 1);
            for (mut column, white) in columns.as_mut().col_iter_mut().zip(white.col_iter()).take(total) {
                if together {
                    column.subrows_mut(target[0], target.len()).copy_from(white);
                    continue;
                }
                for (place, value) in target.iter().zip(white.iter()) {
                    column[*place] = *value;
                }
            }
        }
    }

    /// The whitened rows of `[J | r]` at given parameter values, in fold order: rows × (parameters + 1).
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn model_rows(&self, beta: &[f64]) -> Result<Mat<f64>, Diagnostic> {
        let values = self.problem.slot_values(beta);
        let mut rows = Mat::zeros(self.rows, beta.len() + 1);
        let mut start = 0;
        for block in &self.blocks {
            let raw = self.problem.rows(&values, block)?;
            let (white, _) = self.problem.whiten(&raw, block);
            for j in 0..white.ncols() {
                for i in 0..white.nrows() {
                    rows[(self.target[start + i], j)] = white[(i, j)];
                }
            }
            start += white.nrows();
        }
        Ok(rows)
    }

    /// Whitens values by test and scalar reading, in mm, in fold order.
    pub fn whitened_values(&self, values: &[Vec<f64>]) -> Vec<f64> {
        let mut white = Vec::with_capacity(self.rows);
        for (block, kept) in self.blocks.iter().zip(&self.kept) {
            let channels = self.problem.channels(block.test);
            let own = &values[block.test][block.rows.start * channels..block.rows.end * channels];
            let column = Mat::from_fn(own.len(), 1, |i, _| own[i]);
            white.extend(self.problem.whitened(column, kept).col(0).iter());
        }
        self.placed(&white)
    }

    /// Sorts values that are whitened block by block into fold order.
    pub fn placed(&self, values: &[f64]) -> Vec<f64> {
        let mut placed = vec![0.0; self.rows];
        for (value, target) in values.iter().zip(&self.target) {
            placed[*target] = *value;
        }
        placed
    }

    /// The test, row and channel of each whitened row, in fold order.
    pub fn origin_of_rows(&self) -> Vec<(usize, usize, usize)> {
        let mut origins = vec![(0, 0, 0); self.rows];
        let mut start = 0;
        for (block, kept) in self.blocks.iter().zip(&self.kept) {
            let channels = self.problem.channels(block.test);
            for (k, i) in kept.iter().enumerate() {
                let row = block.rows.start + i / channels;
                origins[self.target[start + k]] = (block.test, row, i % channels);
            }
            start += kept.len();
        }
        origins
    }
}

/// The columns, with equal ones held once. Equal errors of two linear axes that follow each other change the readings equally,
/// so that about half of the columns of a machine equal others.
fn shared(columns: Vec<Vec<f64>>) -> Vec<Arc<Vec<f64>>> {
    let mut distinct: Vec<Arc<Vec<f64>>> = Vec::new();
    let one = |column: Vec<f64>| match distinct.iter().find(|known| ***known == column) {
        Some(known) => Arc::clone(known),
        None => {
            let column = Arc::new(column);
            distinct.push(Arc::clone(&column));
            column
        }
    };
    columns.into_iter().map(one).collect()
}

/// The sensitivities of every test, computed in pieces that keep all cores busy with both short and long tests.
fn sensitivities(problem: &Problem, beta: &[f64]) -> Vec<Sensitivities> {
    let values = problem.slot_values(beta);
    let pieces: Vec<(usize, Range<usize>)> = problem
        .models
        .iter()
        .enumerate()
        .flat_map(|(test, model)| {
            let rows = model.rows();
            // A test without readings has a piece too, because the sensitivities are in the order of the tests.
            (0..rows.div_ceil(ROWS_AT_ONCE).max(1))
                .map(move |k| (test, k * ROWS_AT_ONCE..((k + 1) * ROWS_AT_ONCE).min(rows)))
        })
        .collect();
    let mut tests: Vec<Sensitivities> = Vec::new();
    for pieces in pieces.chunks(PIECES_AT_ONCE) {
        let parts = parallel::map(pieces.len(), &|k| {
            let (test, rows) = &pieces[k];
            let model = &problem.models[*test];
            model.sensitivities(&values[*test], &model.effective_slots(), rows.clone())
        });
        for ((test, _), mut part) in pieces.iter().zip(parts) {
            match tests.get_mut(*test) {
                Some(whole) => {
                    whole.readings.extend(part.readings);
                    for (column, more) in whole.derivatives.iter_mut().zip(part.derivatives) {
                        column.extend(more);
                    }
                }
                None => {
                    let scalars = problem.models[*test].rows() * problem.channels(*test);
                    part.derivatives.iter_mut().for_each(|column| column.reserve_exact(scalars - column.len()));
                    tests.push(part);
                }
            }
        }
    }
    tests
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use abbe_identify::fit::prepare;

    use super::*;

    #[test]
    fn equal_columns_are_held_once() {
        let found = shared(vec![vec![1.0, 2.0], vec![0.0, 0.0], vec![1.0, 2.0], vec![0.0, -0.0], vec![1.0, 2.5]]);
        assert_eq!(found.iter().map(|column| column[1]).collect::<Vec<_>>(), [2.0, 0.0, 2.0, 0.0, 2.5]);
        let same = |a: usize, b: usize| Arc::ptr_eq(&found[a], &found[b]);
        assert!(same(0, 2) && same(1, 3) && !same(0, 1) && !same(0, 4));
    }

    /// No file holds a test without readings, but a calling program may supply one.
    #[test]
    fn sensitivities_match_their_tests_if_one_has_no_readings() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let without = session.tests[1].readings.as_ref().unwrap().of_rows(&[]);
        session.tests[1].readings = Some(std::sync::Arc::new(without));
        let (problem, fit) = prepare(&session, 1).unwrap();
        let rows: Vec<usize> = problem.models.iter().map(|model| model.rows()).collect();
        let found: Vec<usize> =
            sensitivities(&problem, &fit.beta).iter().map(|of_test| of_test.readings.len()).collect();
        assert_eq!(found, rows);
        assert_eq!(found[1], 0);
    }
}
