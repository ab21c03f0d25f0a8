//! What an operator sets up for each test of a plan: datum, balls, bar, axis positions, order and time.

mod datum;

use abbe_identify::series::paths::{SetUpPath, set_up};
use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::{Frame, Machine};
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::instrument::{Handling, InstrumentPoint};
use abbe_model::session::placing::{balls, positions_for_bar};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Prior, Session, Test};
pub use datum::{Datum, datum};

use crate::collision::{self, TestClearance};
use crate::states;

/// Times that the plan of a day needs, min.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetUpTimes {
    /// To mount a ball.
    pub setup_min: f64,
    /// To prepare a test: positions, feed-in.
    pub test_min: f64,
    /// To assemble the bar, to change its extension and to calibrate it.
    pub bar_min: f64,
}

/// Farther travels are none: a file that states 10⁹ means that the axis has no ends, mm or rad.
const NO_TRAVEL: f64 = 1e6;

/// The set-up of one test.
#[derive(Clone, Debug)]
pub struct TestSheet {
    /// The test.
    pub name: String,
    /// What is mounted for it, and what stays mounted, a sentence each.
    pub mounts: Vec<String>,
    /// What an operator does with the instrument.
    pub handling: Handling,
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
    /// Duration of what precedes the motion, min.
    pub set_up_min: f64,
    /// Duration of the motion, min.
    pub moving_min: f64,
    /// The least clearance, if machine or session state what can collide.
    pub clearance: Option<TestClearance>,
}

/// A point of the instrument.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedPoint {
    /// What is there: `spindle ball`, `reflector`.
    pub name: &'static str,
    /// The body on which it is fixed, in words: `the table`, `axis A`.
    pub body: String,
    /// In the frame of that body, mm.
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

/// The sheets of all tests, in their order. `basic_bar_mm` is the length of the bar without an extension.
///
/// # Errors
/// If a test has neither a motion nor data, or an axis would leave its travel.
pub fn sheets(session: &Session, times: SetUpTimes, basic_bar_mm: Option<f64>) -> Result<Vec<TestSheet>, Diagnostic> {
    let complete = states::complete(session, true)?;
    let clearances = collision::clearances(&complete);
    let mut sheets: Vec<TestSheet> = Vec::with_capacity(complete.tests.len());
    for (number, test) in complete.tests.iter().enumerate() {
        let Some(readings) = &test.readings else { continue };
        let Some(path) = set_up(&complete.machine, &test.name, &test.station, readings) else { continue };
        let clearance = clearances.iter().find(|found| found.test == test.name).cloned();
        let before = mounting(&complete.machine, &complete.tests[..number], test, basic_bar_mm);
        let own = sheet(&complete.machine, before, test, readings, path, times);
        sheets.push(TestSheet { clearance, ..own });
    }
    Ok(sheets)
}

fn sheet(
    machine: &Machine,
    before: Mounting,
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
            unit: axis.kind.unit().name(),
            start: display(column[0]),
            least: display(column.iter().copied().fold(f64::INFINITY, f64::min)),
            greatest: display(column.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
            travel: axis
                .travel
                .filter(|travel| travel.iter().all(|end| end.abs() < NO_TRAVEL))
                .map(|travel| travel.map(display)),
        }
    });
    let moving_s = readings.time_s.last().zip(readings.time_s.first()).map_or(0.0, |(last, first)| last - first);
    let point = |point: InstrumentPoint<'_, f64>, start: Option<&[f64; 3]>| PlacedPoint {
        name: point.name,
        body: match point.target.frame {
            frame @ Frame::Axis(_) => frame.word(machine),
            frame => format!("the {}", frame.word(machine)),
        },
        own_mm: point.target.mm,
        start_mm: start.copied().unwrap_or_default(),
        u_mm: uncertainty_mm(test, point.first),
    };
    let [on_table, on_tool] = test.station.points();
    let table_point = on_table.map(|own| point(own, path.workpiece_mm.first()));
    let poses = if path.is_path { Vec::new() } else { poses(machine, readings) };
    TestSheet {
        name: test.name.clone(),
        set_up_min: times.test_min
            + times.setup_min * before.mounted as f64
            + if before.bar_changes { times.bar_min } else { 0.0 },
        moving_min: moving_s / 60.0,
        mounts: before.words,
        handling: test.station.handling(),
        table_point,
        tool_point: on_tool.map(|own| point(own, path.tool_mm.first())),
        bar_mm: test.station.bar().map(|bar| bar.bar),
        axes: axes.collect(),
        centring: centring(machine, test, &start),
        path,
        poses,
        traversals: readings.runs().len(),
        readings: readings.rows(),
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

/// Lengths of the bar that differ by no more have the same extension, mm: calibration changes a length by less.
const SAME_MM: f64 = 1.0;

/// What has to be done before a test.
#[derive(Clone, Debug, PartialEq)]
pub struct Mounting {
    /// A sentence for each object.
    pub words: Vec<String>,
    /// Balls or devices that are mounted.
    pub mounted: usize,
    /// Whether the bar is assembled anew, or its extension put on, taken off or replaced.
    pub bar_changes: bool,
}

/// What has to be done before a test that follows others. `basic_mm` is the length of the bar without an extension.
pub(super) fn mounting(machine: &Machine, earlier: &[Test], test: &Test, basic_mm: Option<f64>) -> Mounting {
    let mut found = Mounting { words: Vec::new(), mounted: 0, bar_changes: false };
    let last = earlier.last();
    let shared = |of: fn(&Test) -> &str| earlier.iter().rev().find(|other| of(other) == of(test));
    let mut note = |thing: &str, other: Option<&Test>, stays: bool| match other {
        Some(other) if stays => found.words.push(format!("{thing}: stays as in test {}", other.name)),
        Some(other) => {
            found.mounted += 1;
            found.words.push(format!("{thing}: mount it again as in test {}", other.name));
        }
        None => {
            found.mounted += 1;
            found.words.push(format!("{thing}: mount it"));
        }
    };
    // Several balls can stand on the table; the spindle holds one.
    let in_spindle = last.is_some_and(|last| last.spindle_setup == test.spindle_setup);
    let groups: [(fn(&Test) -> &str, bool); 2] = [(|test| &test.setup, true), (|test| &test.spindle_setup, in_spindle)];
    for (point, (group, stays)) in test.station.points().iter().zip(groups) {
        if let Some(point) = point {
            let (first, rest) = point.name.split_at(1);
            let thing = format!("{}{rest}{}", first.to_uppercase(), point.target.mounted(machine));
            note(&thing, shared(group), stays);
        }
    }
    if let Some(beside) = test.station.handling().beside {
        // One stands; what stood elsewhere in between is set up again.
        note(&beside, shared(|test| &test.setup), last.is_some_and(|last| last.setup == test.setup));
    }
    if let Some(bar) = test.station.bar() {
        let (words, changes) = of_bar(earlier, test, bar.bar, basic_mm.unwrap_or(bar.bar));
        found.words.push(words);
        found.bar_changes = changes;
    }
    found
}

/// What is done to the bar, and whether that is a change.
fn of_bar(earlier: &[Test], test: &Test, bar_mm: f64, basic_mm: f64) -> (String, bool) {
    let extension = |mm: f64| Some(mm - basic_mm).filter(|extension| *extension > SAME_MM);
    let with = |mm: f64| match extension(mm) {
        Some(extension) => format!("with the extension of {extension:.0} mm"),
        None => "without an extension".to_string(),
    };
    let before = earlier.iter().rev().find_map(|other| Some((other, other.station.bar()?.bar)));
    let Some((last, last_mm)) = before else {
        return (format!("Bar: assemble it {}", with(bar_mm)), true);
    };
    if last.bar_setup == test.bar_setup {
        return (format!("Bar: stays assembled as in test {}", last.name), false);
    }
    let again = earlier.iter().rev().find(|other| other.bar_setup == test.bar_setup);
    let as_in = again.map_or(String::new(), |other| format!(", as in test {}", other.name));
    let words = match (extension(last_mm), extension(bar_mm)) {
        (None, Some(on)) => format!("Bar: put the extension of {on:.0} mm on{as_in}"),
        (Some(off), None) => format!("Bar: take the extension of {off:.0} mm off{as_in}"),
        (Some(off), Some(on)) if (on - off).abs() > SAME_MM => {
            format!("Bar: replace the extension of {off:.0} mm by that of {on:.0} mm{as_in}")
        }
        _ => format!("Bar: assemble it anew {}", with(bar_mm)),
    };
    (words, true)
}

#[cfg(test)]
mod tests {
    use super::uncertainty_mm;
    use abbe_files::ReadOptions;
    use std::path::Path;

    #[test]
    fn balls_have_the_uncertainty_that_the_session_states() {
        let of = |name: &str| {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions").join(name);
            abbe_files::session(&file, &ReadOptions::default()).unwrap().tests.remove(0)
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
