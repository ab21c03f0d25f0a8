//! Tests the residual after the search for remaining structure, and describes and locates it.
//!
//! The detectors act on readings, not on components: a wave over an axis position in one test or one run, a wave with
//! opposite sign in the two directions, a curve, a local feature, a drift over time. Their null distribution comes from
//! the same pure error as that of the search.

use std::ops::Range;

use abbe_identify::error;
use abbe_identify::numerics::parallel;
use abbe_identify::numerics::tails::ln_chi_square_tail;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::axis::{Axis, AxisKind};
use abbe_model::driver::Driver;
use abbe_model::effect::shape::{Curve, Local, Periodic};
use abbe_model::effect::{Component, Effect, Shape};
use abbe_model::instrument::channel::{Channel, labels};
use abbe_model::session::readings::Readings;

use super::constants::STRUCTURED;
use super::start::Start;
use crate::candidates::columns::{Columns, EffectColumns};
use crate::candidates::gain::TrainedModel;
use crate::candidates::gram::{DrawSource, Gram};

/// Structure in a residual.
#[derive(Clone, Debug)]
pub struct Structure {
    /// Probability of at least as large a maximum in readings without structure.
    pub p_value: f64,
    /// Decrease of the sum of squares by the best detector in excess of its expectation for noise: its `χ²` less its
    /// degrees of freedom.
    pub excess: f64,
    /// Description: the test, the driver, and the amplitude.
    pub description: String,
}

impl Structure {
    /// Whether the structure is significant.
    pub fn is_significant(&self) -> bool {
        self.p_value <= STRUCTURED
    }
}

/// One detector: a term on one channel of the readings of a test.
struct Detector {
    effect: Effect,
    /// The channel of the readings.
    channel: usize,
    by_direction: bool,
    /// The rows in which it acts, if not in all.
    rows: Option<Range<usize>>,
    description: String,
}

impl Detector {
    /// Its columns. `None` if the data lack its driver.
    fn columns(&self, columns: &Columns<'_>) -> Option<EffectColumns> {
        columns.reading_columns(&self.effect, self.channel, self.by_direction, self.rows.as_ref())
    }
}

fn detectors(problem: &Problem) -> Vec<Detector> {
    let machine = &problem.session.machine;
    let mut detectors = Vec::new();
    for (test, model) in problem.tests.iter().zip(&problem.models) {
        let Some(readings) = &test.readings else { continue };
        let channels = model.channels();
        let mut of_test = TestResidual { name: &test.name, readings, channels, detectors: Vec::new() };
        for (axis, column) in readings.positions.iter().enumerate() {
            let low = column.iter().copied().fold(f64::INFINITY, f64::min);
            let high = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if high - low >= 1e-6 {
                of_test.over_axis(&machine.axes[axis], low, high);
            }
        }
        of_test.over_time(problem.reference.time_s);
        detectors.extend(of_test.detectors);
    }
    detectors
}

/// Collects the detectors of one test.
struct TestResidual<'t> {
    name: &'t str,
    readings: &'t Readings,
    channels: &'t [Channel],
    detectors: Vec<Detector>,
}

impl TestResidual<'_> {
    /// Adds a shape over each channel of the readings.
    fn add(&mut self, driver: &Driver, shape: Shape, description: String) {
        self.add_confined(driver, shape, false, None, description);
    }

    /// Adds a shape that changes sign with the direction of travel, or that acts in some rows only.
    fn add_confined(
        &mut self,
        driver: &Driver,
        shape: Shape,
        by_direction: bool,
        rows: Option<&Range<usize>>,
        description: String,
    ) {
        let effect = Effect::new(Component::Reading(self.name.to_string()), driver.clone(), shape);
        for (channel, label) in labels(self.channels).into_iter().enumerate() {
            let description = match label {
                "" => description.clone(),
                label => format!("{description} in {label}"),
            };
            let (effect, rows) = (effect.clone(), rows.cloned());
            self.detectors.push(Detector { effect, channel, by_direction, rows, description });
        }
    }

    fn over_axis(&mut self, axis: &Axis, low: f64, high: f64) {
        let (name, test) = (&axis.name, self.name);
        let driver = Driver::Axis(name.clone());
        self.waves(axis, &driver, high - low);
        for intervals in [6, 12, 24] {
            self.add(&driver, curve(low, high, intervals), format!("a curve over {name} in {test}"));
        }
        for share in [0.02, 0.06] {
            let width = share * (high - low);
            for k in 0..(0.5 / share) as usize {
                let centre = low + (high - low) * (k as f64 + 0.5) * 2.0 * share;
                let place = axis.kind.unit().behind(format_args!("{:.1}", axis.kind.to_display(centre)));
                let shape = Shape::Local(Local { centre, width, recurs: None });
                self.add(&driver, shape, format!("a local feature at {name} = {place} in {test}"));
            }
        }
        self.add(&driver, Shape::Backlash, format!("a difference between the directions of {name} in {test}"));
    }

    fn waves(&mut self, axis: &Axis, driver: &Driver, span: f64) {
        let (name, test) = (&axis.name, self.name);
        let wave = |half_cycles: usize| Shape::Periodic(Periodic { period: 2.0 * span / half_cycles as f64 });
        for half_cycles in (2..=80).chain((84..=240).step_by(4)) {
            let period = 2.0 * span / half_cycles as f64;
            let length = match axis.kind {
                AxisKind::Rotary => format!("{:.1}°", period.to_degrees()),
                AxisKind::Linear => format!("{period:.2} mm"),
            };
            let description = format!("a wave over {name} with a period of {length} in {test}");
            self.add(driver, wave(half_cycles), description.clone());
            if half_cycles <= 16 {
                let description = format!("{description}, opposite in the two directions");
                self.add_confined(driver, wave(half_cycles), true, None, description);
            }
        }
        // A structure that changes with time cancels in the mean over runs.
        let runs = self.readings.runs();
        let most = if runs.len() > 1 { MAX_HALF_CYCLES_OF_A_RUN } else { 0 };
        for half_cycles in 2..=most {
            let shows = |run: &&Range<usize>| half_cycles <= most_half_cycles(run.len());
            for (k, run) in runs.iter().enumerate().filter(|(_, run)| shows(run)) {
                let description = format!(
                    "a wave over {name}, {half_cycles} half cycles over its travel, in run {} of {test}",
                    k + 1
                );
                self.add_confined(driver, wave(half_cycles), false, Some(run), description);
            }
        }
    }

    fn over_time(&mut self, origin_s: f64) {
        let (readings, test) = (self.readings, self.name);
        if readings.time_s.is_empty() || readings.rows() < 2 {
            return;
        }
        let first = readings.time_s[0] - origin_s;
        let last = readings.time_s[readings.rows() - 1] - origin_s;
        self.add(&Driver::Time, Shape::Drift, format!("a drift over time in {test}"));
        if last > first {
            self.add(&Driver::Time, curve(first, last, 6), format!("a slow change over time in {test}"));
        }
    }
}

/// Maximum number of half cycles that is tested in one run.
const MAX_HALF_CYCLES_OF_A_RUN: usize = 40;

/// Maximum number of half cycles for a number of readings: 2.4 readings per cycle, as for the candidates of the
/// library.
fn most_half_cycles(readings: usize) -> usize {
    readings * 10 / 12
}

fn curve(from: f64, to: f64, intervals: usize) -> Shape {
    Shape::Curve(Curve { from, to, intervals, closed: false })
}

/// Number of entries of the basis functions of detectors from which on they are a batch: 128 MB.
const MAX_ENTRIES: usize = 32_000_000;
/// Detectors whose columns are formed together.
const AT_ONCE: usize = 64;

/// Detectors whose products are formed together, and the rest.
struct Batch<'d> {
    detectors: Vec<&'d Detector>,
    sets: Vec<EffectColumns>,
    rest: &'d [Detector],
}

impl<'d> Batch<'d> {
    fn of(detectors: &'d [Detector], columns: &Columns<'_>, max_entries: usize) -> Batch<'d> {
        let mut batch = Batch { detectors: Vec::new(), sets: Vec::new(), rest: detectors };
        let mut entries = 0;
        while entries < max_entries && !batch.rest.is_empty() {
            let (part, rest) = batch.rest.split_at(AT_ONCE.min(batch.rest.len()));
            let sets = parallel::map(part.len(), &|k| part[k].columns(columns));
            for (detector, set) in part.iter().zip(sets).filter_map(|(detector, set)| Some((detector, set?))) {
                entries += set.basis.nrows() * set.basis.ncols();
                batch.detectors.push(detector);
                batch.sets.push(set);
            }
            batch.rest = rest;
        }
        batch
    }
}

/// Tests the residual of a fit for structure that its model does not explain.
///
/// # Errors
/// If products are not finite, or `INTERRUPTED` if `should_continue` returns `false`.
pub(super) fn structure(
    problem: &Problem,
    start: &Start,
    null: &dyn DrawSource,
    should_continue: &(dyn Fn() -> bool + Sync),
) -> Result<Structure, Diagnostic> {
    structure_by_batches(problem, start, null, MAX_ENTRIES, should_continue)
}

/// The test with batches of about `max_entries` entries.
fn structure_by_batches(
    problem: &Problem,
    start: &Start,
    null: &dyn DrawSource,
    max_entries: usize,
    should_continue: &(dyn Fn() -> bool + Sync),
) -> Result<Structure, Diagnostic> {
    let columns = &Columns::of_readings(problem);
    let detectors = detectors(problem);
    let mut batch = Batch::of(&detectors, columns, max_entries);
    // In a long session the detectors come in batches, all with the same null draws.
    let in_batches = !batch.rest.is_empty();
    let sets = if in_batches { Vec::new() } else { std::mem::take(&mut batch.sets) };
    let mut first = Gram::new(columns, sets, start.model.clone(), &start.residual, start.prior());
    first.take_draws(null, in_batches.then_some(usize::MAX), should_continue)?;
    let folds: Vec<usize> = (0..columns.fold_rows.len()).collect();
    let mut best: Option<(&Detector, f64, f64)> = None;
    let mut null_best = vec![f64::NEG_INFINITY; first.draws()];
    loop {
        if !should_continue() {
            return Err(error::interrupted());
        }
        let mut gram = first.clone();
        if in_batches {
            gram.append(std::mem::take(&mut batch.sets));
        }
        let trained = TrainedModel::new(&gram, &[], &folds)?;
        let gains = trained.gains(&|_| true)?;
        for (detector, gain) in batch.detectors.iter().zip(gains).filter(|(_, gain)| gain.freedom > 0) {
            let score = -ln_chi_square_tail(gain.gain, gain.freedom);
            if best.is_none_or(|(_, best, _)| score > best) {
                best = Some((detector, score, gain.gain - gain.freedom as f64));
            }
        }
        let of_batch = trained.null_best(&[], &vec![0.0; batch.detectors.len()], 1.0)?;
        null_best.iter_mut().zip(of_batch).for_each(|(best, score)| *best = best.max(score));
        if batch.rest.is_empty() {
            break;
        }
        batch = Batch::of(batch.rest, columns, max_entries);
    }
    let Some((detector, score, excess)) = best else {
        return Ok(Structure {
            p_value: 1.0,
            excess: 0.0,
            description: "no detector applies to these readings".to_string(),
        });
    };
    let above = null_best.iter().filter(|null| **null >= score).count();
    let p_value = (above + 1) as f64 / (null_best.len() + 1) as f64;
    let size_um = (2.0 * excess.max(0.0) / columns.rows().max(1) as f64).sqrt() * problem.noise.sigma_mm * 1e3;
    let description = format!("{} ({} over all readings)", detector.description, problem.unit().text(size_um, 2));
    Ok(Structure { p_value, excess: excess.max(0.0), description })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use abbe_identify::fit::{Fit, prepare};

    use super::*;
    use crate::candidates::gram::Given;

    fn measured() -> (Problem, Fit) {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        prepare(&abbe_files::session(&file, &ReadOptions::default()).unwrap(), 1).unwrap()
    }

    #[test]
    fn a_structure_test_can_be_interrupted() {
        let (problem, fit) = measured();
        let start = Start::of(&problem, &Columns::of_readings(&problem), &fit).unwrap();
        let rows = start.residual.len();
        let draws = Given(3, move |_| vec![0.0; rows]);
        let tested = |should_continue: bool| structure(&problem, &start, &draws, &|| should_continue);
        assert_eq!(tested(false).err(), Some(error::interrupted()));
        // One of four: no draw has structure.
        assert_eq!(tested(true).unwrap().p_value, 0.25);
    }

    /// Detectors that come in batches lead to the decision of all together.
    #[test]
    fn batches_of_detectors_find_the_same_structure() {
        let (problem, fit) = measured();
        let start = Start::of(&problem, &Columns::of_readings(&problem), &fit).unwrap();
        let rows = start.residual.len();
        let draw = move |k: usize| (0..rows).map(|i| ((i * (2 * k + 3)) as f64).sin()).collect();
        let draws = Given(9, draw);
        let found = |max_entries: usize| structure_by_batches(&problem, &start, &draws, max_entries, &|| true).unwrap();
        let (together, in_batches) = (found(MAX_ENTRIES), found(1));
        // The undeclared harmonic of the table is larger than any of the draws.
        assert_eq!((together.p_value, in_batches.p_value), (0.1, 0.1));
        assert_eq!(together.description, in_batches.description);
        assert!(together.description.contains("over C"), "{}", together.description);
        assert!((together.excess / in_batches.excess - 1.0).abs() < 1e-9 && together.excess > 1000.0);
    }

    /// A batch ends behind the detectors with which it has as many entries as it may have.
    #[test]
    fn a_batch_has_as_many_entries_as_it_may_have() {
        let (problem, _) = measured();
        let (all, columns) = (detectors(&problem), Columns::of_readings(&problem));
        let sizes = |max_entries: usize| {
            let (mut rest, mut sizes) = (all.as_slice(), Vec::new());
            while !rest.is_empty() {
                let batch = Batch::of(rest, &columns, max_entries);
                sizes.push(rest.len() - batch.rest.len());
                rest = batch.rest;
            }
            sizes
        };
        assert_eq!(sizes(MAX_ENTRIES), [all.len()]);
        assert_eq!(sizes(1).len(), all.len().div_ceil(AT_ONCE));
        assert!(all.len() > 2 * AT_ONCE, "{}", all.len());
    }
}
