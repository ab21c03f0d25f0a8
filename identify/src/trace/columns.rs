//! Columns of candidates: sensitivity × basis, whitened as the readings are.
//!
//! The chain is evaluated once, for the sensitivities of every component; hundreds of candidates cost no further kinematics.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use abbe_model::effect::{Component, Driver, DriverSample, Effect, Shape};
use abbe_model::instrument::InsideUnit;
use abbe_model::sensitivity::Sensitivities;
use faer::{Mat, MatMut};
use rayon::prelude::*;

use crate::drivers;
use crate::error::IdentifyError;
use crate::problem::{Block, Problem};

/// One candidate laid out over the tests.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Number of columns.
    pub count: usize,
    /// How many numbers of its shape are chosen to fit: each may gain what a column may.
    pub numbers: usize,
    /// For each test, what moves: slot, factor of the component, and the basis functions.
    parts: Vec<Vec<LayoutPart>>,
}

impl Layout {
    /// Whether anything moves in a test.
    fn acts_in(&self, test: usize) -> bool {
        !self.parts[test].is_empty()
    }

    /// The greatest absolute value of its basis functions.
    pub fn greatest(&self) -> f64 {
        let parts = self.parts.iter().flatten();
        let factors = |part: &LayoutPart| {
            part.factor
                .as_ref()
                .map_or(1.0, |f| f.iter().fold(0.0_f64, |a, b| a.max(b.abs())))
        };
        parts
            .map(|part| {
                factors(part)
                    * part
                        .basis
                        .iter()
                        .flat_map(|basis| basis.iter())
                        .fold(0.0_f64, |a, b| a.max(b.abs()))
            })
            .fold(0.0, f64::max)
    }
}

#[derive(Clone, Debug)]
struct LayoutPart {
    moves: Moves,
    factor: Option<Arc<Vec<f64>>>,
    basis: Arc<Vec<Vec<f64>>>,
}

/// What a part of a layout moves.
#[derive(Clone, Copy, Debug)]
enum Moves {
    /// A component, through its sensitivity.
    Slot(usize),
    /// One coordinate of the reading itself.
    Reading(usize),
}

/// The whitened rows of a problem, by fold, and what is needed to lay any effect over them.
pub struct Columns<'p, 'a> {
    problem: &'p Problem<'a>,
    sensitivities: Vec<Sensitivities>,
    /// Place of each slot among the sensitivities, by test.
    place: Vec<HashMap<usize, usize>>,
    blocks: Vec<Block>,
    /// The scalar rows of each block that whitening keeps.
    kept: Vec<Vec<usize>>,
    /// Where each whitened row goes, block after block, so that folds lie together.
    target: Vec<usize>,
    /// The rows of each fold.
    pub fold_rows: Vec<std::ops::Range<usize>>,
    /// The tests whose readings each fold has.
    fold_tests: Vec<BTreeSet<usize>>,
    rows: usize,
    samples: std::sync::Mutex<HashMap<(usize, String), SharedSamples>>,
    bases: std::sync::Mutex<HashMap<(usize, String), SharedColumns>>,
}

type SharedColumns = Arc<Vec<Vec<f64>>>;
type SharedSamples = Option<Arc<Vec<DriverSample<f64>>>>;

impl<'p, 'a> Columns<'p, 'a> {
    /// At the unknowns' values of a fit.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn new(problem: &'p Problem<'a>, beta: &[f64]) -> Result<Columns<'p, 'a>, IdentifyError> {
        let values = problem.slot_values(beta);
        let pieces: Vec<(usize, std::ops::Range<usize>)> = problem
            .models
            .iter()
            .enumerate()
            .flat_map(|(test, model)| {
                let rows = model.rows();
                (0..rows.div_ceil(512)).map(move |k| (test, k * 512..((k + 1) * 512).min(rows)))
            })
            .collect();
        let parts: Vec<Sensitivities> = pieces
            .par_iter()
            .map(|(test, rows)| {
                let model = &problem.models[*test];
                model.sensitivities(&values[*test], &model.effective_slots(), rows.clone())
            })
            .collect();
        let mut sensitivities: Vec<Sensitivities> = Vec::new();
        for ((test, _), part) in pieces.iter().zip(parts) {
            match sensitivities.get_mut(*test) {
                Some(whole) => {
                    whole.readings_mm.extend(part.readings_mm);
                    for (column, more) in whole.derivatives.iter_mut().zip(part.derivatives) {
                        column.extend(more);
                    }
                }
                None => sensitivities.push(part),
            }
        }
        let place = sensitivities
            .iter()
            .map(|s| {
                s.slots
                    .iter()
                    .enumerate()
                    .map(|(place, slot)| (*slot, place))
                    .collect()
            })
            .collect();
        let blocks = problem.blocks();
        let mut fold_of = Vec::new();
        let mut fold_tests = vec![BTreeSet::new(); problem.folds.count];
        let kept: Vec<Vec<usize>> = blocks.iter().map(|block| problem.kept_rows(block)).collect();
        for (block, kept) in blocks.iter().zip(&kept) {
            for fold in problem.folds_of(kept, block) {
                fold_tests[fold].insert(block.test);
                fold_of.push(fold);
            }
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
        Ok(Columns {
            problem,
            sensitivities,
            place,
            blocks,
            kept,
            rows: target.len(),
            target,
            fold_rows,
            fold_tests,
            samples: Default::default(),
            bases: Default::default(),
        })
    }

    /// Number of whitened rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The greatest coefficient that an effect may plausibly have, in inside units: 0.1 mm and 1 mrad on a machine tool, ten times as much on the
    /// robots and long chains that trackers and sockets measure.
    pub fn plausible(&self, effect: &Effect, layout: &Layout) -> f64 {
        let machine_tool = self.problem.session.instrument.is_two_sided();
        let scale = if machine_tool { 1.0 } else { 10.0 };
        let most = match drivers::component_unit(self.problem.session, &effect.component) {
            Some(InsideUnit::Millimetre) => 0.1 * scale,
            Some(InsideUnit::Radian) => 1e-3 * scale,
            Some(InsideUnit::Ratio) => 0.1,
            // The factor of a delay is the speed; a tenth of a second is long.
            None => return 0.1,
        };
        let greatest = layout.greatest();
        if greatest > 0.0 { most / greatest } else { 0.0 }
    }

    /// Lays an effect over the tests; `None` where the data lack what it follows.
    pub fn layout(&self, effect: &Effect) -> Option<Layout> {
        self.lay(effect, true)
    }

    /// The same for an effect that is tried once: its basis functions are not kept.
    pub fn layout_uncached(&self, effect: &Effect) -> Option<Layout> {
        self.lay(effect, false)
    }

    fn lay(&self, effect: &Effect, keep: bool) -> Option<Layout> {
        let session = self.problem.session;
        let mut parts = Vec::new();
        for (number, test) in self.problem.tests.iter().enumerate() {
            let mut of_test = Vec::new();
            if effect.acts_in(&test.name) {
                let readings = test.readings.as_ref()?;
                let axis = drivers::component_axis(session, &effect.component);
                let follows = match effect.driver {
                    abbe_model::effect::Driver::Gravity => format!("gravity {axis:?}"),
                    ref other => other.to_string(),
                };
                let samples = cached(&self.samples, (number, follows.clone()), || {
                    drivers::samples(
                        &session.machine,
                        &self.problem.models[number],
                        readings,
                        &self.problem.origin,
                        &effect.driver,
                        axis,
                    )
                    .map(Arc::new)
                })?;
                let make = || Arc::new(drivers::basis_columns(&effect.shape, &samples));
                let basis = if keep {
                    cached(
                        &self.bases,
                        (number, format!("{follows} {:?}", effect.shape)),
                        make,
                    )
                } else {
                    make()
                };
                for (slot, factor) in drivers::component_slots(session, test, readings, &effect.component) {
                    if self.place[number].contains_key(&slot) {
                        of_test.push(LayoutPart {
                            moves: Moves::Slot(slot),
                            factor: factor.map(Arc::new),
                            basis: basis.clone(),
                        });
                    }
                }
            }
            parts.push(of_test);
        }
        Some(Layout {
            count: effect.shape.coefficients(),
            numbers: effect.shape.numbers(),
            parts,
        })
    }

    /// Lays a shape over one coordinate of the readings of one test, whatever component would cause it; `by_direction` turns its sign with the
    /// direction of travel, `rows` confines it. `None` where the data lack what it follows.
    pub fn reading_layout(
        &self,
        effect: &Effect,
        test: usize,
        coordinate: usize,
        by_direction: bool,
        rows: Option<&std::ops::Range<usize>>,
    ) -> Option<Layout> {
        let session = self.problem.session;
        let readings = self.problem.tests[test].readings.as_ref()?;
        let samples = cached(&self.samples, (test, effect.driver.to_string()), || {
            let model = &self.problem.models[test];
            drivers::samples(
                &session.machine,
                model,
                readings,
                &self.problem.origin,
                &effect.driver,
                None,
            )
            .map(Arc::new)
        })?;
        let basis = Arc::new(drivers::basis_columns(&effect.shape, &samples));
        let factor = (by_direction || rows.is_some()).then(|| {
            let turned = |sample: &DriverSample<f64>| if by_direction { sample.direction } else { 1.0 };
            let inside = |row: usize| rows.is_none_or(|rows| rows.contains(&row));
            let factor = |(row, sample)| if inside(row) { turned(sample) } else { 0.0 };
            Arc::new(samples.iter().enumerate().map(factor).collect())
        });
        let mut parts = vec![Vec::new(); self.problem.tests.len()];
        parts[test].push(LayoutPart {
            moves: Moves::Reading(coordinate),
            factor,
            basis,
        });
        Some(Layout {
            count: effect.shape.coefficients(),
            numbers: 0,
            parts,
        })
    }

    /// The rows of layouts in one block, in mm, not whitened.
    fn block_rows(&self, layouts: &[&Layout], block: &Block) -> Mat<f64> {
        let coordinates = self.problem.coordinates();
        let total: usize = layouts.iter().map(|layout| layout.count).sum();
        let scalars = block.rows.len() * coordinates;
        let first = block.rows.start;
        let mut raw = Mat::<f64>::zeros(scalars, total);
        let sensitivities = &self.sensitivities[block.test];
        let mut column = 0;
        for layout in layouts {
            for part in &layout.parts[block.test] {
                let derivative = match part.moves {
                    Moves::Slot(slot) => {
                        let whole = &sensitivities.derivatives[self.place[block.test][&slot]];
                        Some(&whole[first * coordinates..first * coordinates + scalars])
                    }
                    Moves::Reading(_) => None,
                };
                let factor = part.factor.as_ref().map(|factor| &factor[block.rows.clone()]);
                for k in 0..layout.count {
                    let basis = &part.basis[k][block.rows.clone()];
                    let Some(entries) = raw.col_mut(column + k).try_as_col_major_mut() else {
                        continue;
                    };
                    let entries = entries.as_slice_mut();
                    // One coordinate a reading and no factor is the common case, and the compiler makes vector instructions of it.
                    if let (1, Some(derivative), None) = (coordinates, derivative, factor) {
                        let terms = derivative.iter().zip(basis);
                        entries
                            .iter_mut()
                            .zip(terms)
                            .for_each(|(entry, (d, b))| *entry += d * b);
                        continue;
                    }
                    for (row, basis) in basis.iter().enumerate() {
                        let value = factor.map_or(*basis, |factor| basis * factor[row]);
                        let scalars = row * coordinates..(row + 1) * coordinates;
                        match (derivative, part.moves) {
                            (None, Moves::Reading(moved)) => entries[scalars.start + moved] += value,
                            (derivative, _) => {
                                let derivative = derivative.map_or(&[][..], |whole| &whole[scalars.clone()]);
                                let terms = entries[scalars].iter_mut().zip(derivative);
                                terms.for_each(|(entry, d)| *entry += d * value);
                            }
                        }
                    }
                }
            }
            column += layout.count;
        }
        raw
    }

    /// The rows of layouts that count, in mm, not whitened, block after block.
    pub fn plain_rows(&self, layouts: &[&Layout]) -> Mat<f64> {
        let blocks = self.blocks.iter().map(|block| self.block_rows(layouts, block));
        self.plain(blocks.collect())
    }

    /// `[J | r]` at given values, likewise.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn plain_model_rows(&self, beta: &[f64]) -> Result<Mat<f64>, IdentifyError> {
        let values = self.problem.slot_values(beta);
        let blocks = self.blocks.iter().map(|block| self.problem.rows(&values, block));
        Ok(self.plain(blocks.collect::<Result<_, _>>()?))
    }

    /// The fold of each row of [`Columns::plain_rows`].
    pub fn plain_folds(&self) -> Vec<usize> {
        let coordinates = self.problem.coordinates();
        let fold = |block: &Block, i: usize| {
            self.problem.folds.of_row[block.test][block.rows.start + i / coordinates]
        };
        self.blocks
            .iter()
            .flat_map(|block| self.counting(block).into_iter().map(move |i| fold(block, i)))
            .collect()
    }

    /// The scalar rows of a block whose readings count.
    fn counting(&self, block: &Block) -> Vec<usize> {
        let coordinates = self.problem.coordinates();
        let rejected = &self.problem.rejected[block.test];
        (0..block.rows.len() * coordinates)
            .filter(|i| !rejected[block.rows.start + i / coordinates])
            .collect()
    }

    fn plain(&self, blocks: Vec<Mat<f64>>) -> Mat<f64> {
        let counting: Vec<Vec<usize>> = self.blocks.iter().map(|block| self.counting(block)).collect();
        let mut rows = Mat::zeros(
            counting.iter().map(Vec::len).sum(),
            blocks.first().map_or(0, Mat::ncols),
        );
        let mut start = 0;
        for (block, counting) in blocks.iter().zip(&counting) {
            for (k, i) in counting.iter().enumerate() {
                for j in 0..block.ncols() {
                    rows[(start + k, j)] = block[(*i, j)];
                }
            }
            start += counting.len();
        }
        rows
    }

    /// A free curve over an axis in each test in which it moves, in the readings themselves, whatever component would cause it; none where the readings are
    /// too few for that many intervals.
    pub fn curves_of_tests(&self, driver: &Driver, intervals: usize) -> Vec<(Effect, Layout)> {
        let Driver::Axis(name) = driver else {
            return Vec::new();
        };
        let Some(axis) = self.problem.session.machine.axis_index(name) else {
            return Vec::new();
        };
        let mut layouts = Vec::new();
        for (number, test) in self.problem.tests.iter().enumerate() {
            let Some(readings) = &test.readings else { continue };
            let column = &readings.positions[axis];
            let low = column.iter().copied().fold(f64::INFINITY, f64::min);
            let high = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let longest = readings.runs().iter().map(|run| run.len()).max().unwrap_or(0);
            if high - low < 1e-6 || 2 * longest < 3 * intervals {
                continue;
            }
            let effect = Effect {
                component: Component::TriggerDelay,
                driver: driver.clone(),
                shape: Shape::Curve {
                    from: low,
                    to: high,
                    intervals,
                    closed: false,
                },
                tests: vec![test.name.clone()],
            };
            for coordinate in 0..self.problem.coordinates() {
                let layout = self.reading_layout(&effect, number, coordinate, false, None);
                layouts.extend(layout.map(|layout| (effect.clone(), layout)));
            }
        }
        layouts
    }

    /// The rows of each fold in which any of the layouts moves anything; none of a fold in which none does.
    pub fn moved_rows(&self, layouts: &[Layout]) -> Vec<std::ops::Range<usize>> {
        let moved = |test: &usize| layouts.iter().any(|layout| layout.acts_in(*test));
        let folds = self.fold_rows.iter().zip(&self.fold_tests);
        folds
            .map(|(rows, tests)| {
                if tests.iter().any(moved) {
                    rows.clone()
                } else {
                    rows.start..rows.start
                }
            })
            .collect()
    }

    /// The stretches of rows of some folds in which any of the layouts moves anything.
    pub fn moved_stretches(
        &self,
        layouts: &[Layout],
        folds: impl IntoIterator<Item = usize>,
    ) -> Vec<std::ops::Range<usize>> {
        let moved = self.moved_rows(layouts);
        let mut stretches: Vec<std::ops::Range<usize>> = Vec::new();
        for rows in folds
            .into_iter()
            .map(|fold| &moved[fold])
            .filter(|rows| !rows.is_empty())
        {
            match stretches.last_mut() {
                Some(last) if last.end == rows.start => last.end = rows.end,
                _ => stretches.push(rows.clone()),
            }
        }
        stretches
    }

    /// Fills columns, which are zero before, with the whitened rows of layouts, one after another.
    pub fn fill(&self, layouts: &[&Layout], mut columns: MatMut<'_, f64>) {
        let total: usize = layouts.iter().map(|layout| layout.count).sum();
        let mut start = 0;
        for (block, kept) in self.blocks.iter().zip(&self.kept) {
            let target = &self.target[start..start + kept.len()];
            start += kept.len();
            if target.is_empty() || !layouts.iter().any(|layout| layout.acts_in(block.test)) {
                continue;
            }
            let white = self.problem.whitened(self.block_rows(layouts, block), kept);
            let together = target[target.len() - 1] - target[0] + 1 == target.len();
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

    /// Puts whitened rows of `[J | r]` at given values in the same order: rows × (unknowns + 1).
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn model_rows(&self, beta: &[f64]) -> Result<Mat<f64>, IdentifyError> {
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

    /// Places columns that were whitened block by block in the order of the folds.
    pub fn placed(&self, values: &[f64]) -> Vec<f64> {
        let mut placed = vec![0.0; self.rows];
        for (value, target) in values.iter().zip(&self.target) {
            placed[*target] = *value;
        }
        placed
    }

    /// The test, row and coordinate of each whitened row, in the order of the folds.
    pub fn origin_of_rows(&self) -> Vec<(usize, usize, usize)> {
        let coordinates = self.problem.coordinates();
        let mut origins = vec![(0, 0, 0); self.rows];
        let mut start = 0;
        for (block, kept) in self.blocks.iter().zip(&self.kept) {
            for (k, i) in kept.iter().enumerate() {
                let row = block.rows.start + i / coordinates;
                origins[self.target[start + k]] = (block.test, row, i % coordinates);
            }
            start += kept.len();
        }
        origins
    }
}

fn cached<K: std::hash::Hash + Eq, V: Clone>(
    store: &std::sync::Mutex<HashMap<K, V>>,
    key: K,
    make: impl FnOnce() -> V,
) -> V {
    let found = store.lock().ok().and_then(|store| store.get(&key).cloned());
    if let Some(value) = found {
        return value;
    }
    let value = make();
    if let Ok(mut store) = store.lock() {
        store.insert(key, value.clone());
    }
    value
}
