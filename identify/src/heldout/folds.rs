//! The folds of cross-validation: runs, groups of runs, blocks, or sets of poses.
//!
//! Independent poses have two sets of folds. Blocks of joint space ([`super::joint_space`]) test whether the model
//! predicts poses outside the range of those that it was fitted to. They decide. Random folds test interpolation.

use std::collections::BTreeSet;

use abbe_model::chain::Machine;
use abbe_model::sensitivity::TestModel;
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use rand::SeedableRng;
use rand::seq::SliceRandom;

use super::joint_space;

/// The kind of folds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoldKind {
    /// Each run of each test.
    Runs,
    /// Groups of consecutive runs of each test, if there are very many runs.
    RunGroups,
    /// Five contiguous blocks of each test.
    Blocks,
    /// Ten blocks of joint space, or fewer if there are few poses.
    PoseBlocks,
    /// Ten seeded random folds of poses. They decide only if all poses have the same axis positions, or if there are
    /// too few for blocks.
    RandomPoses,
}

impl FoldKind {
    /// The kind in words.
    pub fn words(self) -> &'static str {
        match self {
            FoldKind::Runs => "one run at a time",
            FoldKind::RunGroups => "one group of consecutive runs of a test at a time",
            FoldKind::Blocks => "one of five contiguous blocks of each test at a time",
            FoldKind::PoseBlocks => "one block of joint space at a time",
            FoldKind::RandomPoses => "one random fold of poses at a time",
        }
    }

    /// Whether the readings are independent poses.
    pub fn is_poses(self) -> bool {
        matches!(self, FoldKind::PoseBlocks | FoldKind::RandomPoses)
    }
}

/// The folds of a session.
#[derive(Clone, Debug)]
pub struct Folds {
    /// Their kind.
    pub kind: FoldKind,
    /// Number of folds.
    pub count: usize,
    /// The fold of each row of each test.
    pub of_row: Vec<Vec<usize>>,
    /// For blocks of joint space, the random folds that test interpolation.
    pub interpolation: Option<Box<Folds>>,
    /// The pose of each row of each test. Rows at the same axis positions are one pose, as those of several targets on one
    /// flange. Empty along runs.
    pub pose_of_row: Vec<Vec<usize>>,
}

const BLOCKS_PER_TEST: usize = 5;
/// Number of random folds of poses.
const RANDOM_FOLDS: usize = 10;
/// Maximum number of folds of single runs. More folds cost time without better estimates. If the run column changes at
/// every reading, each reading would be a fold.
const MAX_FOLDS_OF_RUNS: usize = 64;
/// Number of folds for sessions with more runs.
const FOLDS_OF_MANY_RUNS: usize = 32;

impl Folds {
    /// The folds of a session.
    pub fn of(session: &Session, tests: &[Test], seed: u64) -> Folds {
        let readings: Vec<&Readings> = tests.iter().filter_map(|test| test.readings.as_deref()).collect();
        let poses = session.instruments().iter().all(|kind| kind.entry().reads_poses)
            && readings.iter().all(|r| r.run.is_empty());
        if poses {
            return Folds::of_poses(&session.machine, &readings, seed);
        }
        let runs: Vec<_> = readings.iter().map(|r| r.runs()).collect();
        let kind = if runs.iter().any(|runs| runs.len() < 2) {
            FoldKind::Blocks
        } else if runs.iter().map(Vec::len).sum::<usize>() <= MAX_FOLDS_OF_RUNS {
            FoldKind::Runs
        } else {
            FoldKind::RunGroups
        };
        let groups = (FOLDS_OF_MANY_RUNS / readings.len().max(1)).max(2);
        let mut count = 0;
        let of_row = readings
            .iter()
            .zip(runs)
            .map(|(r, runs)| {
                let mut rows = vec![0; r.rows()];
                let parts: Vec<std::ops::Range<usize>> = match kind {
                    FoldKind::Runs => runs,
                    FoldKind::RunGroups => {
                        let groups = groups.min(runs.len());
                        let first = |k: usize| runs.get(k * runs.len() / groups).map_or(r.rows(), |run| run.start);
                        (0..groups).map(|k| first(k)..first(k + 1)).collect()
                    }
                    _ => {
                        let blocks = BLOCKS_PER_TEST.min(r.rows().max(1));
                        (0..blocks).map(|k| k * r.rows() / blocks..(k + 1) * r.rows() / blocks).collect()
                    }
                };
                for part in parts {
                    rows[part].fill(count);
                    count += 1;
                }
                rows
            })
            .collect();
        Folds { kind, count, of_row, interpolation: None, pose_of_row: Vec::new() }
    }

    /// One fold for each test.
    pub fn by_test(models: &[TestModel]) -> Folds {
        Folds {
            kind: FoldKind::Runs,
            count: models.len(),
            of_row: models.iter().enumerate().map(|(test, model)| vec![test; model.rows()]).collect(),
            interpolation: None,
            pose_of_row: Vec::new(),
        }
    }

    /// The folds of independent poses.
    fn of_poses(machine: &Machine, readings: &[&Readings], seed: u64) -> Folds {
        let total: usize = readings.iter().map(|r| r.rows()).sum();
        let poses = joint_space::poses(readings);
        let distinct = poses.iter().max().map_or(0, |last| last + 1);
        // Too few poses for folds of their own: repeated readings of a pose are in several folds.
        let units = if distinct < RANDOM_FOLDS { (0..total).collect() } else { poses.clone() };
        let mut order: Vec<usize> = (0..units.iter().max().map_or(0, |last| last + 1)).collect();
        order.shuffle(&mut rand_pcg::Pcg64::seed_from_u64(seed));
        let mut fold_of_unit = vec![0; order.len()];
        for (place, unit) in order.into_iter().enumerate() {
            fold_of_unit[unit] = place % RANDOM_FOLDS;
        }
        let fold_of: Vec<usize> = units.into_iter().map(|unit| fold_of_unit[unit]).collect();
        let pose_of_row = by_test(readings, &poses);
        let random = Folds { pose_of_row, ..Folds::over_tests(FoldKind::RandomPoses, readings, &fold_of) };
        match joint_space::blocks(machine, readings, seed) {
            Some(blocks) => Folds {
                pose_of_row: random.pose_of_row.clone(),
                interpolation: Some(Box::new(random)),
                ..Folds::over_tests(FoldKind::PoseBlocks, readings, &blocks)
            },
            None => random,
        }
    }

    /// The folds of the rows of all tests, one test after the other.
    fn over_tests(kind: FoldKind, readings: &[&Readings], fold_of: &[usize]) -> Folds {
        let count = fold_of.iter().max().map_or(1, |last| last + 1);
        Folds { kind, count, of_row: by_test(readings, fold_of), interpolation: None, pose_of_row: Vec::new() }
    }
}

/// The values of the rows of all tests, one test after the other, divided by test.
fn by_test(readings: &[&Readings], mut values: &[usize]) -> Vec<Vec<usize>> {
    let of_test = |r: &&Readings| {
        let (rows, others) = values.split_at(r.rows());
        values = others;
        rows.to_vec()
    };
    readings.iter().map(of_test).collect()
}

/// Mean number of readings below which runs with recurring numbers are no traversals.
const SHORT_RUN: f64 = 4.0;
/// Least number of readings for a check of the run column.
const MIN_READINGS: usize = 24;

/// A warning for each test whose run column does not number traversals: its number changes from reading to reading.
pub fn mislabelled_runs(tests: &[Test]) -> Vec<String> {
    let warning = |test: &Test| {
        let readings = test.readings.as_ref()?;
        let runs = readings.runs();
        let numbers: BTreeSet<i64> = runs.iter().map(|run| readings.run.get(run.start).copied().unwrap_or(0)).collect();
        let length = readings.rows() as f64 / runs.len().max(1) as f64;
        let come_back = numbers.len() < runs.len();
        let one_each = length < 1.5;
        let wrong = readings.rows() >= MIN_READINGS && length < SHORT_RUN && (come_back || one_each);
        wrong.then(|| {
            format!(
                "the `run` column of test {} changes {} times in {} readings, and a run is one traversal in one direction: directions of travel, repeats and \
                 held-out runs cannot be taken from it; number the traversals, in the order in which they were measured",
                test.name,
                runs.len() - 1,
                readings.rows()
            )
        })
    };
    tests.iter().filter_map(warning).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use abbe_files::ReadOptions;

    use super::*;

    /// The bundled session (four tests of four runs) with another run column.
    fn numbered(number: impl Fn(usize, i64) -> i64) -> Session {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        for readings in session.tests.iter_mut().filter_map(|test| test.readings.as_mut()).map(Arc::make_mut) {
            for (row, run) in readings.run.iter_mut().enumerate() {
                *run = number(row, *run);
            }
        }
        session
    }

    fn folds(session: &Session) -> Folds {
        Folds::of(session, &session.tests, 1)
    }

    #[test]
    fn each_run_is_a_fold_up_to_a_maximum_number() {
        let as_measured = folds(&numbered(|_, run| run));
        assert_eq!((as_measured.kind, as_measured.count), (FoldKind::Runs, 16));
        assert_eq!(folds(&numbered(|_, _| 1)).kind, FoldKind::Blocks);
        for session in
            [numbered(|row, _| row as i64), numbered(|row, _| row as i64 % 2), numbered(|row, _| row as i64 / 10)]
        {
            let folds = folds(&session);
            assert_eq!((folds.kind, folds.count), (FoldKind::RunGroups, FOLDS_OF_MANY_RUNS));
            // Each fold is a sequence of rows of one test. No run is divided and no fold is empty.
            let mut next = 0;
            for (test, fold_of) in session.tests.iter().zip(&folds.of_row) {
                assert!(fold_of.is_sorted());
                assert_eq!(fold_of[0], next);
                next = fold_of[fold_of.len() - 1] + 1;
                for run in test.readings.as_ref().unwrap().runs() {
                    assert_eq!(fold_of[run.start], fold_of[run.end - 1]);
                }
            }
            assert_eq!(next, folds.count);
        }
    }

    #[test]
    fn a_run_column_that_does_not_number_traversals_gives_a_warning() {
        let warnings = |session: &Session| mislabelled_runs(&session.tests).len();
        assert_eq!(warnings(&numbered(|_, run| run)), 0);
        assert_eq!(warnings(&numbered(|_, _| 1)), 0);
        // Forward runs have number 1 and backward runs 2; then short runs with increasing numbers.
        assert_eq!(warnings(&numbered(|_, run| run % 2)), 0);
        assert_eq!(warnings(&numbered(|row, _| row as i64 / 3)), 0);
        assert_eq!(warnings(&numbered(|row, _| row as i64)), 4);
        assert_eq!(warnings(&numbered(|row, _| row as i64 % 4)), 4);
    }
}
