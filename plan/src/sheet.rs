//! What an operator sets up for each test of a plan: balls, bar, axis positions, order and time.

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::instrument::InstrumentPoint;
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::session::placing::{balls, positions_for_bar};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Prior, Session, Test};

use super::collision::{self, TestClearance};
use super::states;
use crate::PlanError;
use abbe_identify::series::paths::{SetUpPath, set_up};

/// Times that the plan of a day needs, min.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetUpTimes {
    /// To mount a ball.
    pub setup_min: f64,
    /// To prepare a test: bar, positions, feed-in.
    pub test_min: f64,
}

/// The set-up of one test.
#[derive(Clone, Debug)]
pub struct TestSheet {
    /// The test.
    pub name: String,
    /// What is mounted for it, and what stays mounted, a sentence each.
    pub mounts: Vec<String>,
    /// The instrument's point in the table frame, mm, and its standard uncertainty, mm; `None` if it has none.
    pub table_point: Option<PlacedPoint>,
    /// The instrument's point in the tool frame, if it has one.
    pub tool_point: Option<PlacedPoint>,
    /// The calibrated length of a ball bar, mm.
    pub bar_mm: Option<f64>,
    /// The axes.
    pub axes: Vec<AxisRange>,
    /// Positions at which the spindle ball is at the centre of the workpiece ball, by axis, mm and degrees; `None` if
    /// no linear axes reach it within their travel.
    pub centring: Option<Vec<f64>>,
    /// The motion.
    pub path: SetUpPath,
    /// The positions of all axes at each pose, mm and degrees, for a test that consists of poses; empty for runs.
    pub poses: Vec<Vec<f64>>,
    /// Number of traversals.
    pub traversals: usize,
    /// Number of readings.
    pub readings: usize,
    /// Duration with set-up, min.
    pub minutes: f64,
    /// The least clearance, if machine or session state what can collide.
    pub clearance: Option<TestClearance>,
}

/// A point of the instrument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedPoint {
    /// What is there: `spindle ball`, `reflector`.
    pub name: &'static str,
    /// In its frame, mm.
    pub own_mm: [f64; 3],
    /// In R at the start, mm.
    pub start_mm: [f64; 3],
    /// Standard uncertainty of each coordinate in its frame, mm; infinite where it is unknown.
    pub u_mm: Option<[f64; 3]>,
}

/// An axis over a test, mm or degrees.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisRange {
    /// Its name.
    pub name: String,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// Position at the start.
    pub start: f64,
    /// Least position over the test.
    pub least: f64,
    /// Greatest position over the test.
    pub greatest: f64,
    /// Least and greatest position that it can have, if the machine states them.
    pub travel: Option<[f64; 2]>,
}

impl AxisRange {
    /// Whether it moves.
    pub fn moves(&self) -> bool {
        self.greatest - self.least > 1e-9
    }

    /// The distance to the nearer end of its travel.
    pub fn room(&self) -> Option<f64> {
        self.travel.map(|[low, high]| (self.least - low).min(high - self.greatest))
    }
}

/// The sheets of all tests, in their order.
///
/// # Errors
/// If a test has neither a motion nor data, or an axis would leave its travel.
pub fn sheets(session: &Session, times: SetUpTimes) -> Result<Vec<TestSheet>, PlanError> {
    let complete = states::complete(session, true)?;
    let clearances = collision::clearances(&complete);
    let mut sheets: Vec<TestSheet> = Vec::with_capacity(complete.tests.len());
    for (number, test) in complete.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        let Some(path) = set_up(&complete.machine, &test.name, &test.station, readings) else { continue };
        let clearance = clearances.iter().find(|found| found.test == test.name).cloned();
        let own = sheet(&complete.machine, &complete.tests[..number], test, readings, path, times);
        sheets.push(TestSheet { clearance, ..own });
    }
    Ok(sheets)
}

fn sheet(
    machine: &Machine,
    earlier: &[Test],
    test: &Test,
    readings: &Readings,
    path: SetUpPath,
    times: SetUpTimes,
) -> TestSheet {
    let start: Vec<f64> = readings.positions.iter().map(|column| column[0]).collect();
    let axes = machine.axes.iter().zip(&readings.positions).map(|(axis, column)| {
        let display = |q: f64| axis.kind.to_display(q);
        AxisRange {
            name: axis.name.clone(),
            unit: axis.kind.unit(),
            start: display(column[0]),
            least: display(column.iter().copied().fold(f64::INFINITY, f64::min)),
            greatest: display(column.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
            travel: axis.travel.map(|travel| travel.map(display)),
        }
    });
    let (mounts, mounted) = mounts(earlier, test);
    let moving_s = readings.time_s.last().zip(readings.time_s.first()).map_or(0.0, |(last, first)| last - first);
    let point = |point: InstrumentPoint<'_, f64>, start: Option<&[f64; 3]>| PlacedPoint {
        name: point.name,
        own_mm: *point.mm,
        start_mm: start.copied().unwrap_or_default(),
        u_mm: uncertainty_mm(test, point.first),
    };
    let [on_table, on_tool] = test.station.points();
    let table_point = on_table.map(|own| point(own, path.workpiece_mm.first()));
    let poses = if path.is_path { Vec::new() } else { poses(machine, readings) };
    TestSheet {
        name: test.name.clone(),
        mounts,
        table_point,
        tool_point: on_tool.map(|own| point(own, path.tool_mm.first())),
        bar_mm: test.station.bar().map(|bar| bar.bar),
        axes: axes.collect(),
        centring: centring(machine, test, &start),
        path,
        poses,
        traversals: readings.runs().len(),
        readings: readings.rows(),
        minutes: times.test_min + times.setup_min * mounted as f64 + moving_s / 60.0,
        clearance: None,
    }
}

/// The prior of three coordinates.
fn uncertainty_mm(test: &Test, first: usize) -> Option<[f64; 3]> {
    let of = |prior: &Prior| match prior {
        Prior::Known => 0.0,
        Prior::Gaussian(u) => *u,
        Prior::Free => f64::INFINITY,
    };
    let own: Vec<f64> = test.priors.get(first..first + 3)?.iter().map(of).collect();
    own.try_into().ok()
}

/// What has to be mounted, in words, and the number of balls among it.
fn mounts(earlier: &[Test], test: &Test) -> (Vec<String>, usize) {
    let mut words = Vec::new();
    let mut mounted = 0;
    let shared = |of: fn(&Test) -> &str| earlier.iter().rev().find(|other| of(other) == of(test));
    let mut note = |thing: &str, other: Option<&Test>| match other {
        Some(other) => words.push(format!("{thing}: stays as in test {}", other.name)),
        None => {
            mounted += 1;
            words.push(format!("{thing}: mount it"));
        }
    };
    let groups: [fn(&Test) -> &str; 2] = [|test| &test.setup, |test| &test.spindle_setup];
    for (point, group) in test.station.points().iter().zip(groups) {
        if let Some(point) = point {
            let (first, rest) = point.name.split_at(1);
            note(&format!("{}{rest}", first.to_uppercase()), shared(group));
        }
    }
    if test.station.bar().is_some() {
        match shared(|test| &test.bar_setup) {
            Some(other) => words.push(format!("Bar: stays assembled as in test {}", other.name)),
            None => words.push("Bar: assemble it".to_string()),
        }
    }
    (words, mounted)
}

/// The positions at which the two balls of a bar coincide, mm and degrees.
fn centring(machine: &Machine, test: &Test, start: &[f64]) -> Option<Vec<f64>> {
    let bar = test.station.bar()?;
    let at = positions_for_bar(machine, bar, start, [0.0; 3])?;
    let inside = machine
        .axes
        .iter()
        .zip(&at)
        .all(|(axis, q)| axis.travel.is_none_or(|[low, high]| *q >= low - 1e-9 && *q <= high + 1e-9));
    let coincide = |bar: &BallBar<f64>| {
        let (workpiece, spindle) = balls(machine, bar, &at);
        (0..3).all(|i| (workpiece[i] - spindle[i]).abs() < 1e-3)
    };
    (inside && coincide(bar)).then(|| machine.axes.iter().zip(&at).map(|(axis, q)| axis.kind.to_display(*q)).collect())
}

/// The positions of all axes, mm and degrees, row by row.
fn poses(machine: &Machine, readings: &Readings) -> Vec<Vec<f64>> {
    let display = |axis: usize, row: usize| {
        let kind: AxisKind = machine.axes[axis].kind;
        kind.to_display(readings.positions[axis][row])
    };
    (0..readings.rows()).map(|row| (0..machine.axes.len()).map(|axis| display(axis, row)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_model::files::{self, ReadOptions};

    use super::uncertainty_mm;

    #[test]
    fn balls_have_the_uncertainty_that_the_session_states() {
        let of = |name: &str| {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions").join(name);
            files::session(&file, &ReadOptions::default()).unwrap().tests.remove(0)
        };
        // `workpiece_ball_u_um = [2, 2, 2]`, `spindle_ball_u_um = [1, 1, 1]`.
        let test = of("hermle-c600u/chapter5.toml");
        for (first, wanted) in [(0, 2e-3), (3, 1e-3)] {
            let found = uncertainty_mm(&test, first).unwrap();
            assert!(found.iter().all(|u| (u - wanted).abs() < 1e-15), "{found:?}");
        }
        assert!(uncertainty_mm(&test, test.priors.len() - 2).is_none());
    }
}
