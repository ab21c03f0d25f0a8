//! The basis columns of an effect for the tests of a session: the component it moves, and its basis functions.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex};

use abbe_model::driver::{Driver, DriverInput, DriverSample};
use abbe_model::effect::shape::Curve;
use abbe_model::effect::{Component, Effect, Shape};
use abbe_model::instrument::InternalUnit;

use super::Columns;

/// The basis columns of an effect in each test.
#[derive(Clone, Debug)]
pub struct EffectColumns {
    /// Number of columns.
    pub count: usize,
    /// Number of tuned shape numbers. Each counts as a degree of freedom of the gain.
    pub numbers: usize,
    /// The terms of each test. Empty for a test in which the effect does not act.
    pub(super) terms: Vec<Vec<EffectTerm>>,
}

impl EffectColumns {
    /// Whether the effect acts in a test.
    pub(super) fn acts_in(&self, test: usize) -> bool {
        !self.terms[test].is_empty()
    }

    /// The largest absolute value of its basis functions.
    pub fn greatest(&self) -> f64 {
        let terms = self.terms.iter().flatten();
        let factors =
            |term: &EffectTerm| term.factor.as_ref().map_or(1.0, |f| f.iter().fold(0.0_f64, |a, b| a.max(b.abs())));
        terms
            .map(|term| {
                factors(term) * term.basis.iter().flat_map(|basis| basis.iter()).fold(0.0_f64, |a, b| a.max(b.abs()))
            })
            .fold(0.0, f64::max)
    }
}

/// One term of an effect in a test: a target, and the basis functions by which it moves.
#[derive(Clone, Debug)]
pub(super) struct EffectTerm {
    pub target: TermTarget,
    /// Factor of the basis functions in each row; 1 if absent.
    pub factor: Option<Arc<Vec<f64>>>,
    /// The basis functions, one value per row.
    pub basis: Arc<Vec<Vec<f64>>>,
}

/// The target of a term.
#[derive(Clone, Copy, Debug)]
pub(super) enum TermTarget {
    /// A component, through its sensitivity.
    Slot(usize),
    /// One coordinate of the reading itself.
    Reading(usize),
}

impl Columns<'_> {
    /// Computes the basis columns of an effect. `None` if the data lack its driver.
    pub fn effect_columns(&self, effect: &Effect) -> Option<EffectColumns> {
        self.compute(effect, true)
    }

    /// Computes the basis columns of an effect that is evaluated once: its basis functions are not cached.
    pub fn effect_columns_uncached(&self, effect: &Effect) -> Option<EffectColumns> {
        self.compute(effect, false)
    }

    fn compute(&self, effect: &Effect, keep: bool) -> Option<EffectColumns> {
        let session = &self.problem.session;
        let mut terms = Vec::new();
        for (number, test) in self.problem.tests.iter().enumerate() {
            let mut of_test = Vec::new();
            if effect.acts_in(&test.name) {
                let readings = test.readings.as_ref()?;
                let axis = effect.component.axis(&session.machine);
                let (follows, samples) = self.driver_samples(number, &effect.driver, axis, effect.shape.lag_s())?;
                let make = || Arc::new(effect.shape.columns(&samples));
                let basis = if keep {
                    cached(&self.bases, (number, format!("{follows} {:?}", effect.shape)), make)
                } else {
                    make()
                };
                let parameters = test.station.kind().unknowns();
                for (slot, factor) in effect.component.slots_in(&session.machine, parameters, readings) {
                    if self.slot_index[number].contains_key(&slot) {
                        of_test.push(EffectTerm {
                            target: TermTarget::Slot(slot),
                            factor: factor.map(Arc::new),
                            basis: basis.clone(),
                        });
                    }
                }
            }
            terms.push(of_test);
        }
        Some(EffectColumns { count: effect.shape.coefficients(), numbers: effect.shape.numbers(), terms })
    }

    /// The samples of a driver in a test, and its key in the caches. Some drivers, as the moment of gravity, differ
    /// from axis to axis.
    fn driver_samples(
        &self,
        test: usize,
        driver: &Driver,
        axis: Option<usize>,
        lag_s: Option<f64>,
    ) -> Option<(String, Arc<Vec<DriverSample<f64>>>)> {
        let readings = self.problem.tests[test].readings.as_ref()?;
        let kind = driver.kind();
        let name = if kind.is_of_component() { format!("{driver} {axis:?}") } else { driver.to_string() };
        let sampled = || {
            let input = DriverInput {
                machine: &self.problem.session.machine,
                model: &self.problem.models[test],
                readings,
                reference: &self.problem.reference,
                component_axis: axis,
                lag_s,
            };
            kind.samples(&input).map(Arc::new)
        };
        // A lag is a number that is tuned: its samples are used once.
        let samples = if lag_s.is_some() { sampled() } else { cached(&self.samples, (test, name.clone()), sampled) };
        Some((name, samples?))
    }

    /// The columns of a term on one coordinate of the readings of a test ([`Component::Reading`]). `by_direction`
    /// changes its sign with the direction of travel. `rows` confines it. `None` if the session has no such test, or
    /// the data lack its driver.
    pub fn reading_columns(
        &self,
        effect: &Effect,
        coordinate: usize,
        by_direction: bool,
        rows: Option<&Range<usize>>,
    ) -> Option<EffectColumns> {
        let Component::Reading(name) = &effect.component else {
            return None;
        };
        let test = self.problem.tests.iter().position(|test| test.name == *name)?;
        let (_, samples) = self.driver_samples(test, &effect.driver, None, effect.shape.lag_s())?;
        let basis = Arc::new(effect.shape.columns(&samples));
        let factor = (by_direction || rows.is_some()).then(|| {
            let turned = |sample: &DriverSample<f64>| if by_direction { sample.direction } else { 1.0 };
            let inside = |row: usize| rows.is_none_or(|rows| rows.contains(&row));
            let factor = |(row, sample)| if inside(row) { turned(sample) } else { 0.0 };
            Arc::new(samples.iter().enumerate().map(factor).collect())
        });
        let mut terms = vec![Vec::new(); self.problem.tests.len()];
        terms[test].push(EffectTerm { target: TermTarget::Reading(coordinate), factor, basis });
        Some(EffectColumns { count: effect.shape.coefficients(), numbers: 0, terms })
    }

    /// A nonparametric curve over an axis in the readings of each test in which the axis moves, without a component.
    /// Tests with too few readings for that many intervals have none.
    pub fn curves_of_tests(&self, driver: &Driver, intervals: usize) -> Vec<(Effect, EffectColumns)> {
        let Driver::Axis(name) = driver else {
            return Vec::new();
        };
        let Some(axis) = self.problem.session.machine.axis_index(name) else {
            return Vec::new();
        };
        let mut column_sets = Vec::new();
        for test in &self.problem.tests {
            let Some(readings) = &test.readings else { continue };
            let column = &readings.positions[axis];
            let low = column.iter().copied().fold(f64::INFINITY, f64::min);
            let high = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let longest = readings.runs().iter().map(|run| run.len()).max().unwrap_or(0);
            if high - low < 1e-6 || 2 * longest < 3 * intervals {
                continue;
            }
            let effect = Effect::new(
                Component::Reading(test.name.clone()),
                driver.clone(),
                Shape::Curve(Curve { from: low, to: high, intervals, closed: false }),
            );
            for coordinate in 0..self.problem.coordinates() {
                let column_set = self.reading_columns(&effect, coordinate, false, None);
                column_sets.extend(column_set.map(|column_set| (effect.clone(), column_set)));
            }
        }
        column_sets
    }

    /// The largest plausible coefficient of an effect, in internal units: 0.1 mm and 1 mrad on a machine tool, ten
    /// times as much on the robots and long chains that trackers and sockets measure.
    pub fn plausible(&self, effect: &Effect, column_set: &EffectColumns) -> f64 {
        let machine_tool = self.problem.session.instrument.is_two_sided();
        let scale = if machine_tool { 1.0 } else { 10.0 };
        let most = match effect.component.unit(self.problem.session.instrument.unknowns()) {
            Some(InternalUnit::Millimetre) => 0.1 * scale,
            Some(InternalUnit::Radian) => 1e-3 * scale,
            Some(InternalUnit::Ratio) => 0.1,
            // The factor of a delay is the speed. A tenth of a second is a long delay.
            None => return 0.1,
        };
        let greatest = column_set.greatest();
        if greatest > 0.0 { most / greatest } else { 0.0 }
    }
}

/// Number of columns that are computed together.
const CHUNK_COLUMNS: usize = 48;

/// Groups consecutive effects whose columns are computed together: as many as fit into a chunk, and at least one.
pub fn chunked(column_sets: &[&EffectColumns]) -> Vec<Range<usize>> {
    let mut chunks = Vec::new();
    let (mut start, mut width) = (0, 0);
    for (index, column_set) in column_sets.iter().enumerate() {
        if width > 0 && width + column_set.count > CHUNK_COLUMNS {
            chunks.push(start..index);
            (start, width) = (index, 0);
        }
        width += column_set.count;
    }
    if start < column_sets.len() {
        chunks.push(start..column_sets.len());
    }
    chunks
}

/// The cached value of a key. Computes and stores it if it is absent.
fn cached<K: std::hash::Hash + Eq, V: Clone>(store: &Mutex<HashMap<K, V>>, key: K, make: impl FnOnce() -> V) -> V {
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_model::files::{self, ReadOptions};

    use super::*;
    use crate::fit::prepare;

    /// A constant term is 1 in the readings of its test and 0 in all others. No fit has it as a parameter.
    #[test]
    fn a_term_of_the_readings_acts_in_its_test_alone() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = files::session(&file, &ReadOptions::default()).unwrap();
        let (mut problem, fit) = prepare(&session, 1).unwrap();
        let effect = Effect::new(Component::Reading(problem.tests[1].name.clone()), Driver::None, Shape::Constant);
        let columns = Columns::new(&problem, &fit.beta);
        let term = columns.reading_columns(&effect, 0, false, None).unwrap();
        let rows = columns.unwhitened_rows(&[&term]);
        let kept = |test: usize| problem.rejected[test].iter().filter(|rejected| !**rejected).count();
        assert_eq!(rows.nrows(), (0..problem.tests.len()).map(kept).sum::<usize>());
        let own = kept(0)..kept(0) + kept(1);
        assert!((0..rows.nrows()).all(|i| rows[(i, 0)] == f64::from(u8::from(own.contains(&i)))));
        drop(columns);
        assert!(problem.add_effect(&effect).is_err());
    }

    /// Chunks are full, and each effect is in exactly one. The chunk size bounds the memory of a screening.
    #[test]
    fn chunks_are_filled_in_order() {
        let column_sets = |counts: &[usize]| -> Vec<EffectColumns> {
            let of_count = |&count: &usize| EffectColumns { count, numbers: 0, terms: Vec::new() };
            counts.iter().map(of_count).collect()
        };
        let ends = |counts: &[usize]| -> Vec<usize> {
            let column_sets = column_sets(counts);
            let chunks = chunked(&column_sets.iter().collect::<Vec<_>>());
            let starts: Vec<usize> = chunks.iter().map(|chunk| chunk.start).collect();
            let ends: Vec<usize> = chunks.iter().map(|chunk| chunk.end).collect();
            assert!(starts.iter().zip([0].iter().chain(&ends)).all(|(start, end)| start == end));
            ends
        };
        assert_eq!(ends(&[]), [0; 0]);
        assert_eq!(ends(&[2; 24]), [24]);
        assert_eq!(ends(&[2; 25]), [24, 25]);
        assert_eq!(ends(&[1, 47, 1, 46, 2]), [2, 4, 5]);
        // A curve with many coefficients is a chunk of its own.
        assert_eq!(ends(&[3, 200, 3, 3]), [1, 2, 4]);
    }
}
