//! The columns of an effect for the tests of a session: its channel, and its basis functions of the driver.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex};

use abbe_identify::parameters::{LONG_DELAY_S, largest_plausible_share, physical_size};
use abbe_model::driver::{Driver, DriverInput, DriverPart};
use abbe_model::effect::shape::Curve;
use abbe_model::effect::{Component, Effect, Shape};
use faer::Mat;

use super::states::{Channel, DriverStates, Sensitivity};
use super::{Acting, Columns, SharedSamples};

/// The columns of an effect: a channel, and basis functions of the states of its driver.
#[derive(Clone, Debug)]
pub struct EffectColumns {
    /// Number of columns.
    pub count: usize,
    /// Number of tuned shape numbers. Each counts as a degree of freedom of the gain.
    pub numbers: usize,
    /// What moves the readings, and what it follows.
    pub channel: Arc<Channel>,
    /// The basis functions: states × columns. Those of the library are the largest arrays of a trace. Single precision halves
    /// them; they rank candidates, and the fit computes an effect that is found in double precision.
    pub basis: Arc<Mat<f32>>,
}

impl EffectColumns {
    /// Whether the effect acts in a test.
    pub(super) fn acts_in(&self, test: usize) -> bool {
        self.channel.acts_in(test)
    }

    /// The largest absolute value of its basis functions.
    pub fn greatest(&self) -> f64 {
        let columns = self.basis.col_iter().flat_map(|column| column.iter());
        self.channel.greatest_factor * f64::from(columns.fold(0.0_f32, |a, b| a.max(b.abs())))
    }
}

/// Columns of equal length as a matrix in single precision.
fn single(columns: &[Vec<f64>]) -> Arc<Mat<f32>> {
    let rows = columns.first().map_or(0, Vec::len);
    Arc::new(Mat::from_fn(rows, columns.len(), |i, k| columns[k][i] as f32))
}

impl Columns<'_> {
    /// Computes the basis columns of an effect. `None` if the data lack its driver.
    pub fn effect_columns(&self, effect: &Effect) -> Option<EffectColumns> {
        if effect.shape.turns().is_some() {
            return self.turning_columns(effect);
        }
        let channel = self.channel(effect)?;
        let key = (Arc::as_ptr(&channel.states) as usize, format!("{:?}", effect.shape));
        let basis = cached(&self.bases, key, || single(&self.basis(&effect.shape, &channel)));
        Some(EffectColumns { count: effect.shape.coefficients(), numbers: effect.shape.numbers(), channel, basis })
    }

    /// The columns of an effect whose direction turns ([`Effect::parts`]). With the sensitivities `s₁`, `s₂` of its two
    /// components and the basis functions `b₁`, `b₂` there, a column is `s · b` with `s = √(s₁² + s₂²)`, the sensitivity in
    /// the most effective direction, and `b = (s₁ b₁ + s₂ b₂)/s`, which differs from channel to channel.
    fn turning_columns(&self, effect: &Effect) -> Option<EffectColumns> {
        let machine = &self.problem.session.machine;
        let parts = effect.parts(machine);
        let acting: Vec<Acting> =
            parts.iter().map(|part| self.acting(&part.component, effect)).collect::<Option<_>>()?;
        let sensitivity =
            |part: usize, test: usize, scalar: usize| acting[part].0[test].get(scalar).copied().unwrap_or_default();
        let axis = effect.component.axis(machine);
        let key = format!("{} turning {:?} {}", effect.component, effect.tests, driver_name(&effect.driver, axis));
        let channel = cached(&self.channels, key, || {
            let mut samples = Vec::new();
            let mut total = Vec::new();
            for (number, test) in self.problem.tests.iter().enumerate() {
                let scalars = acting.iter().map(|(of_part, _)| of_part[number].len()).max().unwrap_or(0);
                let norm = |scalar| (0..parts.len()).fold(0.0, |sum: f64, k| sum.hypot(sensitivity(k, number, scalar)));
                total.push(Sensitivity::within(0, (0..scalars).map(norm).collect()));
                samples.push(match effect.acts_in(&test.name) && scalars > 0 {
                    true => Some(self.driver_samples(number, &effect.driver, axis, None)?),
                    false => None,
                });
            }
            let channels: Vec<usize> = (0..samples.len()).map(|test| self.problem.channels(test)).collect();
            let states = Arc::new(DriverStates::of_scalars(&samples, &channels));
            Some(Arc::new(Channel { sensitivity: total, states, greatest_factor: 1.0, lagging: None }))
        })?;
        let mut basis = vec![vec![0.0; channel.states.samples.len()]; effect.shape.coefficients()];
        let of_parts: Vec<Vec<Vec<f64>>> =
            parts.iter().map(|part| part.columns(effect.shape.columns(&channel.states.samples))).collect();
        let mut state = 0;
        for (test, total) in channel.sensitivity.iter().enumerate() {
            let scalars = if channel.states.acts_in(test) { 0..total.len() } else { 0..0 };
            for (scalar, total) in scalars.map(|scalar| (scalar, total.at(scalar))) {
                for (k, column) in basis.iter_mut().enumerate() {
                    let of_part = |part: usize| sensitivity(part, test, scalar) * of_parts[part][k][state];
                    let sum: f64 = (0..parts.len()).map(of_part).sum();
                    column[state] = if total > 0.0 { sum / total } else { 0.0 };
                }
                state += 1;
            }
        }
        let (count, numbers) = (effect.shape.coefficients(), effect.shape.numbers());
        Some(EffectColumns { count, numbers, channel, basis: single(&basis) })
    }

    /// The columns of an effect on the channel of another, which differs from it in the shape numbers alone.
    pub fn reshaped(&self, shape: &Shape, channel: &Arc<Channel>) -> EffectColumns {
        let basis = single(&self.basis(shape, channel));
        EffectColumns { count: shape.coefficients(), numbers: shape.numbers(), channel: Arc::clone(channel), basis }
    }

    /// The basis functions of a shape at the states of a channel, one column for each coefficient.
    pub fn basis(&self, shape: &Shape, channel: &Channel) -> Vec<Vec<f64>> {
        let Some(driver) = &channel.lagging else { return shape.columns(&channel.states.samples) };
        let acting = (0..channel.sensitivity.len()).filter(|test| channel.acts_in(*test));
        let samples = acting.filter_map(|test| self.driver_samples(test, driver, None, shape.lag_s()));
        shape.columns(&samples.flat_map(|of_test| of_test.to_vec()).collect::<Vec<_>>())
    }

    /// The channel of an effect. `None` if the data lack its driver.
    fn channel(&self, effect: &Effect) -> Option<Arc<Channel>> {
        let machine = &self.problem.session.machine;
        let axis = effect.component.axis(machine);
        let part = effect.shape.uses();
        let name = driver_name(&effect.driver, axis);
        let lag_s = effect.shape.lag_s();
        let key = format!("{} {:?} {name} {part:?} {}", effect.component, effect.tests, lag_s.is_some());
        cached(&self.channels, key, || {
            let (sensitivity, greatest_factor) = self.acting(&effect.component, effect)?;
            let mut samples = Vec::new();
            for (number, test) in self.problem.tests.iter().enumerate() {
                let of_driver = match effect.acts_in(&test.name) {
                    true => Some(self.driver_samples(number, &effect.driver, axis, lag_s)?),
                    false => None,
                };
                samples.push(of_driver.filter(|_| !sensitivity[number].is_empty()));
            }
            let lagging = lag_s.map(|_| effect.driver.clone());
            let states = self.states(&name, &samples, part, lagging.is_some());
            let sensitivity = sensitivity.into_iter().map(Sensitivity::whole).collect();
            Some(Arc::new(Channel { sensitivity, states, greatest_factor, lagging }))
        })
    }

    /// What a component changes in the tests of an effect. `None` if a test in which it acts has no readings.
    fn acting(&self, component: &Component, effect: &Effect) -> Option<Acting> {
        let machine = &self.problem.session.machine;
        cached(&self.acting, format!("{component} {:?}", effect.tests), || {
            let mut greatest_factor = 0.0_f64;
            let mut sensitivity = Vec::new();
            for (number, test) in self.problem.tests.iter().enumerate() {
                if !effect.acts_in(&test.name) {
                    sensitivity.push(Arc::default());
                    continue;
                }
                let readings = test.readings.as_ref()?;
                let slots = component.slots_in(machine, test.station.kind().unknowns(), readings);
                let derivatives = &self.derivatives[number];
                let known: Vec<_> =
                    slots.into_iter().filter_map(|(slot, factor)| Some((derivatives.get(&slot)?, factor))).collect();
                for (_, factor) in &known {
                    let greatest = factor.as_ref().map_or(1.0, |f| f.iter().fold(0.0_f64, |a, b| a.max(b.abs())));
                    greatest_factor = greatest_factor.max(greatest);
                }
                // Most components are one slot, whose derivative they share.
                if let [(derivative, None)] = known.as_slice() {
                    sensitivity.push(Arc::clone(derivative));
                    continue;
                }
                let mut of_test: Vec<f64> = Vec::new();
                for (derivative, factor) in known {
                    of_test.resize(derivative.len(), 0.0);
                    let of_row = |row: usize| factor.as_ref().map_or(1.0, |factor| factor[row]);
                    for (i, (sum, derivative)) in of_test.iter_mut().zip(derivative.iter()).enumerate() {
                        *sum += derivative * of_row(i / self.problem.channels(number));
                    }
                }
                sensitivity.push(Arc::new(of_test));
            }
            Some((sensitivity, greatest_factor))
        })
    }

    /// The states of a driver in the tests with samples.
    fn states(
        &self,
        name: &str,
        samples: &[Option<SharedSamples>],
        part: DriverPart,
        lagging: bool,
    ) -> Arc<DriverStates> {
        let tests: Vec<usize> = (0..samples.len()).filter(|test| samples[*test].is_some()).collect();
        let distinct = || if lagging { DriverStates::of_readings(samples) } else { DriverStates::of(samples, part) };
        cached(&self.states, format!("{name} {part:?} {tests:?} {lagging}"), || Arc::new(distinct()))
    }

    /// The samples of a driver in a test. Some drivers, as the moment of gravity, differ from axis to axis.
    fn driver_samples(
        &self,
        test: usize,
        driver: &Driver,
        axis: Option<usize>,
        lag_s: Option<f64>,
    ) -> Option<SharedSamples> {
        let readings = self.problem.tests[test].readings.as_ref()?;
        let sampled = || {
            let input = DriverInput {
                machine: &self.problem.session.machine,
                model: &self.problem.models[test],
                readings,
                reference: &self.problem.reference,
                component_axis: axis,
                lag_s,
            };
            driver.kind().samples(&input).map(Arc::new)
        };
        // A lag is a number that is tuned: its samples are used once.
        if lag_s.is_some() { sampled() } else { cached(&self.samples, (test, driver_name(driver, axis)), sampled) }
    }

    /// The columns of a term on one channel of the readings of a test ([`Component::Reading`]). `by_direction`
    /// changes its sign with the direction of travel. `rows` confines it. `None` if the session has no such test, or
    /// the data lack its driver.
    pub fn reading_columns(
        &self,
        effect: &Effect,
        channel: usize,
        by_direction: bool,
        rows: Option<&Range<usize>>,
    ) -> Option<EffectColumns> {
        let Component::Reading(name) = &effect.component else {
            return None;
        };
        let test = self.problem.tests.iter().position(|test| test.name == *name)?;
        let part = effect.shape.uses();
        let key = format!(
            "{} {channel} {by_direction} {rows:?} {} {part:?} {}",
            effect.component,
            effect.driver,
            effect.shape.lag_s().is_some()
        );
        let channel = cached(&self.channels, key, || {
            let samples = self.driver_samples(test, &effect.driver, None, effect.shape.lag_s())?;
            let channels = self.problem.channels(test);
            let turned = |row: usize| if by_direction { samples[row].direction } else { 1.0 };
            let of_row = |row: usize, moved: usize| if moved == channel { turned(row) } else { 0.0 };
            let acting = rows.cloned().unwrap_or(0..samples.len());
            let first = acting.start * channels;
            let of_rows = acting.flat_map(|row| (0..channels).map(move |moved| (row, moved)));
            let mut sensitivity = vec![Sensitivity::default(); self.problem.tests.len()];
            sensitivity[test] = Sensitivity::within(first, of_rows.map(|(row, moved)| of_row(row, moved)).collect());
            let mut of_tests = vec![None; self.problem.tests.len()];
            of_tests[test] = Some(samples);
            let lagging = effect.shape.lag_s().map(|_| effect.driver.clone());
            let states = self.states(&effect.driver.to_string(), &of_tests, part, lagging.is_some());
            Some(Arc::new(Channel { sensitivity, states, greatest_factor: 1.0, lagging }))
        })?;
        Some(EffectColumns { numbers: 0, ..self.reshaped(&effect.shape, &channel) })
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
        for (number, test) in self.problem.tests.iter().enumerate() {
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
            for channel in 0..self.problem.channels(number) {
                let column_set = self.reading_columns(&effect, channel, false, None);
                column_sets.extend(column_set.map(|column_set| (effect.clone(), column_set)));
            }
        }
        column_sets
    }

    /// The largest plausible coefficient of an effect, in internal units ([`largest_plausible_share`]).
    pub fn plausible(&self, effect: &Effect, column_set: &EffectColumns) -> f64 {
        let session = &self.problem.session;
        let unit = effect.component.unit(&session.instrument_parameters());
        let share = largest_plausible_share(unit, session.instrument);
        // The basis function of a delay is the speed.
        let Some(unit) = unit else { return share * LONG_DELAY_S };
        let most = share * physical_size(unit);
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

/// The name of a driver, with the axis of the component if its values differ from axis to axis.
fn driver_name(driver: &Driver, axis: Option<usize>) -> String {
    if driver.kind().is_of_component() { format!("{driver} {axis:?}") } else { driver.to_string() }
}

/// The cached value of a key. Computes and stores it if it is absent. All callers receive the value stored first.
fn cached<K: std::hash::Hash + Eq, V: Clone>(store: &Mutex<HashMap<K, V>>, key: K, make: impl FnOnce() -> V) -> V {
    let found = store.lock().ok().and_then(|store| store.get(&key).cloned());
    if let Some(value) = found {
        return value;
    }
    let value = make();
    match store.lock() {
        Ok(mut store) => store.entry(key).or_insert(value).clone(),
        Err(_) => value,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use abbe_identify::fit::prepare;
    use abbe_model::effect::shape::{Harmonic, Polynomial};

    use super::*;

    /// A constant term is 1 in the readings of its test and 0 in all others. No fit has it as a parameter.
    #[test]
    fn a_term_of_the_readings_acts_in_its_test_alone() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let (mut problem, fit) = prepare(&session, 1).unwrap();
        let effect = Effect::new(Component::Reading(problem.tests[1].name.clone()), Driver::None, Shape::Constant);
        let columns = Columns::new(&problem, &fit.beta);
        let term = columns.reading_columns(&effect, 0, false, None).unwrap();
        let rejected = &problem.rejected;
        let accepted = |test: usize| (0..rejected[test].len()).filter(move |row| !rejected[test][*row]);
        for fold in 0..problem.folds.count {
            let rows = columns.unwhitened_rows_of_fold(&term, fold);
            let in_fold = |test: usize| accepted(test).filter(|row| problem.folds.of_row[test][*row] == fold).count();
            let own = in_fold(0)..in_fold(0) + in_fold(1);
            assert_eq!(rows.nrows(), (0..problem.tests.len()).map(in_fold).sum::<usize>());
            assert!((0..rows.nrows()).all(|i| rows[(i, 0)] == f64::from(u8::from(own.contains(&i)))));
        }
        drop(columns);
        assert!(problem.add_effect(&effect).is_err());
    }

    /// A term of one run is 1 in its rows and 0 in all others, in the products too.
    #[test]
    fn a_term_of_one_run_is_zero_outside() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let (problem, _) = prepare(&session, 1).unwrap();
        let effect = Effect::new(Component::Reading(problem.tests[1].name.clone()), Driver::None, Shape::Constant);
        let columns = Columns::of_readings(&problem);
        let run = problem.tests[1].readings.as_ref().unwrap().runs()[1].clone();
        let term = columns.reading_columns(&effect, 0, false, Some(&run)).unwrap();
        let sensitivity = &term.channel.sensitivity;
        assert!((0..sensitivity.len()).all(|test| sensitivity[test].is_empty() == (test != 1)));
        let rows = problem.tests[1].readings.as_ref().unwrap().rows();
        assert!(run.start > 0 && run.end < rows, "{run:?} of {rows}");
        assert!((0..rows + 5).all(|row| sensitivity[1].at(row) == f64::from(u8::from(run.contains(&row)))));
    }

    /// A bar tells errors of a tenth of a physical size at most: 0.1 mm, 1 mrad. A function that reaches 3 is scaled.
    #[test]
    fn the_largest_plausible_coefficient_moves_the_component_by_a_tenth_of_its_size() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let (problem, fit) = prepare(&session, 1).unwrap();
        let columns = Columns::new(&problem, &fit.beta);
        let plausible = |component: &str, driver: &str, shape: Shape| {
            let component = Component::parse(component).unwrap();
            let driver = Driver::parse_on(&session.machine, driver);
            let effect = Effect::new(component, driver, shape);
            let column_set = columns.effect_columns(&effect).unwrap();
            (columns.plausible(&effect, &column_set), column_set.greatest())
        };
        let (angle, greatest) = plausible("EAC", "C", Shape::Harmonic(Harmonic { order: 1.0 }));
        assert!((greatest - 1.0).abs() < 1e-9 && (angle - 1e-3).abs() < 1e-12, "{angle} rad");
        let (length, greatest) = plausible("EZC", "C", Shape::Polynomial(Polynomial { degree: 2, scale: 1.0 }));
        assert!(greatest > 1.5 && (length * greatest - 0.1).abs() < 1e-9, "{length} mm, {greatest}");
    }

    /// Chunks are full, and each effect is in exactly one. The chunk size bounds the memory of a screening.
    #[test]
    fn chunks_are_filled_in_order() {
        let column_sets = |counts: &[usize]| -> Vec<EffectColumns> {
            let states = Arc::new(DriverStates::of(&[], DriverPart::Value));
            let channel = Arc::new(Channel { sensitivity: Vec::new(), states, greatest_factor: 1.0, lagging: None });
            let of_count = |&count: &usize| EffectColumns {
                count,
                numbers: 0,
                channel: Arc::clone(&channel),
                basis: Arc::new(Mat::zeros(0, count)),
            };
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
