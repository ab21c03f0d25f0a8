//! Checks of a test and its readings, for sessions from files and sessions built in memory.
//!
//! A fault is a message and what to do. It has no place: the reader of a file adds the file and line.

use std::collections::BTreeSet;
use std::ops::Range;

use abbe_model::axis::AxisKind;
use abbe_model::chain::{BodyErrors, Machine};
use abbe_model::instrument::{Checked, Fault, InstrumentKind, SharedBy, Target};
use abbe_model::session::motion::{Course, Motion, Moved};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Prior, Session, Test, planned};
use abbe_model::unit::Unit;
use abbe_model::words::counted;

/// Least number of readings of a test.
pub(crate) const MIN_READINGS: usize = 2;

/// Checks the name of a test against those of the others.
pub(crate) fn name<'t>(name: &str, mut others: impl Iterator<Item = &'t str>) -> Result<(), Fault> {
    if name.trim().is_empty() {
        return Err(("a test without a name".into(), "add a name".into()));
    }
    if others.any(|other| other == name) {
        return Err((
            format!("two tests have the name \"{name}\""),
            "results name parameters by test: give each its own name".into(),
        ));
    }
    Ok(())
}

/// Checks the plan of a test without readings.
pub(crate) fn plan(machine: &Machine, test: &Test) -> Result<(), Fault> {
    let planned = planned::checked_plan(machine, test)?;
    check(machine, test, &planned)
}

/// Checks measured readings against the declared set-up. Returns warnings.
pub(crate) fn readings(machine: &Machine, test: &Test, readings: &Readings) -> Result<Vec<String>, Fault> {
    for (place, channel) in test.station.channels().iter().enumerate() {
        if (0..readings.rows()).all(|row| !readings.was_read(row, place)) {
            let message = format!("test \"{}\": no row has a value of `{}`", test.name, channel.name);
            return Err((message, "remove its column from the data, or leave it out of [columns]".into()));
        }
    }
    check(machine, test, readings)?;
    test.station.check_observed(&test.name, &readings.observed)?;
    let checked = Checked { machine, test: &test.name, readings };
    test.station.check_readings(&checked)?;
    let doubts = [
        test.station.doubt(&checked),
        planned::beyond_travel(machine, readings),
        many_turns(machine, readings),
        of_another_unit(machine, test.motion.as_ref(), readings),
        difference_from_stated(test.motion.as_ref(), readings).or_else(|| missing_numbers(readings)),
    ];
    Ok(doubts
        .into_iter()
        .flatten()
        .map(|doubt| format!("test \"{}\": {doubt}; the data are used as they are", test.name))
        .collect())
}

/// The fault of a time after another, if it decreases.
pub(crate) fn decreasing_time(before_s: f64, time_s: f64) -> Option<String> {
    (time_s < before_s).then(|| format!("time decreases: {time_s} s after {before_s} s in the row before"))
}

/// Turns beyond which the positions of a rotary axis are doubted. Degrees in a column of radians are 57 times as far.
const MANY_TURNS: f64 = 10.0;

/// A description of the first rotary axis whose positions are many turns from zero.
fn many_turns(machine: &Machine, readings: &Readings) -> Option<String> {
    machine.axes.iter().zip(&readings.positions).find_map(|(axis, positions)| {
        let turns = |position: &f64| position.abs() / std::f64::consts::TAU;
        let farthest = positions.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
        (axis.kind == AxisKind::Rotary && turns(&farthest) > MANY_TURNS).then(|| {
            format!(
                "axis `{}` goes to {:.3} deg, {:.0} turns from zero, as degrees in a column of radians would",
                axis.name,
                axis.kind.to_display(farthest),
                turns(&farthest),
            )
        })
    })
}

/// Share by which the factor between two spans may differ from that of two units.
const NEAR_FACTOR: f64 = 0.1;

/// A description of an axis whose positions span what the stated motion spans in another unit.
fn of_another_unit(machine: &Machine, motion: Option<&Motion>, readings: &Readings) -> Option<String> {
    let (axis, Course { from, to, .. }) = (motion?.axis()?, motion?.course);
    let positions = readings.positions[axis].iter().copied();
    let span = positions.clone().fold(f64::NEG_INFINITY, f64::max) - positions.fold(f64::INFINITY, f64::min);
    let axis = &machine.axes[axis];
    let (units, column): (&[(Unit, &str)], Unit) = match axis.kind {
        AxisKind::Rotary => (&[(Unit::Radian, "radians")], Unit::Degree),
        AxisKind::Linear => (&[(Unit::Metre, "metres"), (Unit::Inch, "inches")], Unit::Millimetre),
    };
    let stated = (to - from).abs();
    let is_near = |factor: f64| (stated / span / factor - 1.0).abs() < NEAR_FACTOR;
    let (_, unit) = units.iter().find(|(unit, _)| unit.convert(1.0, column).is_some_and(is_near))?;
    let [span, stated] = [span, stated].map(|span| axis.kind.to_display(span));
    Some(format!(
        "axis `{}` covers {span:.3} {column} where the session states {stated:.3} {column}, as {unit} in a column of {column} would",
        axis.name
    ))
}

/// The warning about a noise of a unit in which no channel reads, while that of the channels is not stated.
pub(crate) fn noise_of_no_channel(session: &Session) -> Option<String> {
    let units = session.units();
    let unused = |stated: Option<f64>, other: Option<f64>, reads: bool| stated.is_some() && other.is_none() && !reads;
    let of = |stated: &str, needed: &str, unit: &str| {
        Some(format!("`{stated}` is the noise of {unit}, which no test reads: state `{needed}`"))
    };
    if unused(session.noise_mm, session.noise_rad, units.lengths || !units.angles) {
        return of("noise_um", "noise_arcsec", "lengths");
    }
    if unused(session.noise_rad, session.noise_mm, units.angles || !units.lengths) {
        return of("noise_arcsec", "noise_um", "angles");
    }
    None
}

/// Warnings about a test that shares a mounted object with an earlier one and describes it differently.
pub(crate) fn differing(earlier: &[Test], test: &Test) -> Vec<String> {
    let unknowns = test.station.kind().unknowns();
    let mut warnings = Vec::new();
    for group in mounted_groups(test.station.kind()) {
        let Some(first) = earlier.iter().find(|other| other.group(group) == test.group(group)) else {
            continue;
        };
        let own = |test: &Test| -> (Vec<Prior>, Target<f64>) {
            let priors = unknowns.iter().zip(&test.priors);
            let priors = priors.filter(|(unknown, _)| unknown.shared_by == group);
            (priors.map(|(_, prior)| *prior).collect(), test.station.shared(group))
        };
        if own(first) != own(test) {
            warnings.push(format!(
                "tests \"{}\" and \"{}\" share the set-up \"{}\" and describe it differently; an object that is mounted \
                 once has one position",
                first.name,
                test.name,
                test.group(group)
            ));
        }
    }
    warnings
}

/// The groups of an instrument's parameters that belong to objects that a user mounts.
fn mounted_groups(kind: InstrumentKind) -> Vec<SharedBy> {
    let groups = [SharedBy::Setup, SharedBy::SpindleSetup, SharedBy::BarSetup];
    groups.into_iter().filter(|group| kind.shares(*group)).collect()
}

/// A warning for each test whose positions and readings a test has already: one file stands for two measurements.
pub(crate) fn repeated(tests: &[Test], test: &Test) -> Option<String> {
    let own = test.readings.as_deref()?;
    let is_same = |other: &&Test| {
        let same = |other: &Readings| other.positions == own.positions && other.observed == own.observed;
        other.readings.as_deref().is_some_and(same)
    };
    let other = tests.iter().find(is_same)?;
    Some(format!(
        "tests \"{}\" and \"{}\" have the same positions and readings: is one file named twice? Both count as measured",
        other.name, test.name
    ))
}

/// A run is a forward and backward run if its net advance is less than this fraction of its path length.
const MIN_ADVANCE: f64 = 0.5;

/// A description of the difference between the runs of the data and those of the stated motion, if any. Data without a
/// `run` column are not compared.
pub(super) fn difference_from_stated(motion: Option<&Motion>, readings: &Readings) -> Option<String> {
    let motion = motion.filter(|_| !readings.run.is_empty())?;
    let (runs, both_directions) = (motion.course.traversals.runs(), motion.course.traversals.both_directions());
    let (mut forward, mut backward, mut turning) = (0, 0, Vec::new());
    for run in readings.runs() {
        let (net, whole) = advance_and_length(motion, readings, &run);
        if whole > 0.0 && net.abs() < MIN_ADVANCE * whole {
            turning.push(readings.run[run.start].to_string());
        } else if net > 0.0 {
            forward += 1;
        } else if net < 0.0 {
            backward += 1;
        }
    }
    let states = format!("the session states runs = {runs}, both_directions = {both_directions}");
    if !turning.is_empty() {
        let numbers = turning.join(", ");
        return Some(match turning.len() {
            1 => format!(
                "run {numbers} goes forward and backward under one number: `run` numbers each traversal in one direction; {states}"
            ),
            _ => format!(
                "runs {numbers} go forward and backward under one number each: `run` numbers each traversal in one direction; {states}"
            ),
        });
    }
    let enough = forward >= runs && (backward >= runs || !both_directions);
    let only_forward = both_directions || backward == 0;
    (!(enough && only_forward))
        .then(|| format!("the data contain {} forward and {backward} backward, but {states}", counted(forward, "run")))
}

/// A description of the gaps in the numbers of the runs, if any: `1, 3, 4` lacks run 2. Numbers with as many gaps as steps
/// (`1, 3`, `2, 4, 6`) are a numbering of their own.
pub(super) fn missing_numbers(readings: &Readings) -> Option<String> {
    let present: BTreeSet<i64> = readings.run.iter().copied().collect();
    let (first, last) = (*present.first()?, *present.last()?);
    let steps = present.len() as i64 - 1;
    // A large number is no count of runs.
    let gaps = last.checked_sub(first)?.checked_sub(steps)?;
    if !(1..steps).contains(&gaps) {
        return None;
    }
    let missing: Vec<String> = (first..=last).filter(|run| !present.contains(run)).map(|run| run.to_string()).collect();
    let runs = if missing.len() == 1 { "run" } else { "runs" };
    Some(format!("the data lack {runs} {} between runs {first} and {last}", missing.join(", ")))
}

/// Net advance of a run in the direction of the motion, and its total path length: along an axis, or around a circle by
/// the swept area.
fn advance_and_length(motion: &Motion, readings: &Readings, run: &Range<usize>) -> (f64, f64) {
    let sum = |steps: &mut dyn Iterator<Item = f64>| {
        let sense = motion.course.to - motion.course.from;
        steps.map(|step| step * sense).fold((0.0, 0.0), |(net, whole), step| (net + step, whole + step.abs()))
    };
    match &motion.moved {
        Moved::Axis(axis) | Moved::Follow { axis, .. } => {
            let positions = &readings.positions[*axis][run.clone()];
            sum(&mut positions.windows(2).map(|pair| pair[1] - pair[0]))
        }
        Moved::Circle { axes, .. } => {
            let [x, y] = axes.map(|axis| &readings.positions[axis][run.clone()]);
            let area = |k: usize| (x[k] - x[0]) * (y[k + 1] - y[0]) - (x[k + 1] - x[0]) * (y[k] - y[0]);
            sum(&mut (0..x.len() - 1).map(area))
        }
        Moved::Line { axes, ends, .. } => {
            let step = |k: usize| {
                let way = axes.iter().zip(ends).map(|(axis, [start, end])| {
                    let positions = &readings.positions[*axis][run.clone()];
                    (positions[k + 1] - positions[k]) * (end - start)
                });
                way.sum::<f64>()
            };
            sum(&mut (0..run.len() - 1).map(step))
        }
    }
}

/// Checks that the instrument nominally fits: the distance between the balls is the length of the bar, the stylus is in
/// front of its artefact, the ball is in its nest. If a single mistake in the positions of an axis (its sign, its unit, its
/// column) explains the deviation, the help names it.
pub(super) fn check(machine: &Machine, test: &Test, readings: &Readings) -> Result<(), Fault> {
    let Err((message, help)) = check_nominal(machine, test, readings) else {
        return Ok(());
    };
    let help = match mistakes(machine, test, readings) {
        found if found.is_empty() => help,
        found => format!("it would fit if {}; {help}", found.join(", or if ")),
    };
    Err((message, help))
}

/// The factor by which a mistake changes the positions of an axis, and its description.
type Mistake = (f64, &'static str);

const SIGN: &str = "with the opposite sign (check its `direction` and its column)";
/// Mistakes that are tried on linear axes. Sign and unit errors both multiply the positions by a factor.
const LINEAR: [Mistake; 7] = [
    (-1.0, SIGN),
    (Unit::Metre.internal(), "in m rather than mm"),
    (Unit::Micrometre.internal(), "in µm rather than mm"),
    (Unit::Inch.internal(), "in inches rather than mm"),
    (Unit::Mil.internal(), "in mil rather than mm"),
    (Unit::Inch.per_internal(), "in mm rather than inches"),
    (Unit::Mil.per_internal(), "in mm rather than mil"),
];
/// Mistakes that are tried on rotary axes.
const ROTARY: [Mistake; 3] = [
    (-1.0, SIGN),
    (Unit::Degree.per_internal(), "in radians rather than degrees"),
    (Unit::Degree.internal(), "in degrees rather than radians"),
];

/// Largest number of readings on which mistakes are tried.
const MAX_TRIED: usize = 500;

/// The mistakes, of one axis, of all axes of a kind, or of two exchanged columns, whose correction makes the instrument fit.
fn mistakes(machine: &Machine, test: &Test, readings: &Readings) -> Vec<String> {
    let rows: Vec<usize> = (0..readings.rows()).step_by(readings.rows().div_ceil(MAX_TRIED).max(1)).collect();
    let readings = readings.of_rows(&rows);
    let matters = |axis: usize| readings.positions[axis].iter().any(|q| *q != 0.0);
    let mut found: Vec<(f64, String)> = Vec::new();
    for (kind, mistakes) in [(AxisKind::Linear, &LINEAR[..]), (AxisKind::Rotary, &ROTARY[..])] {
        let axes: Vec<usize> =
            (0..machine.axes.len()).filter(|axis| machine.axes[*axis].kind == kind && matters(*axis)).collect();
        let together = (axes.len() > 1).then(|| axes.clone());
        let groups = axes.iter().map(|axis| vec![*axis]).chain(together);
        for group in groups.collect::<Vec<_>>() {
            let names: Vec<&str> = group.iter().map(|axis| machine.axes[*axis].name.as_str()).collect();
            for (factor, words) in mistakes {
                let mut corrected = readings.clone();
                for axis in &group {
                    for position in &mut corrected.positions[*axis] {
                        *position *= factor;
                    }
                }
                if check_nominal(machine, test, &corrected).is_ok() {
                    let description = format!("the positions of {} were read {words}", names.join(" and "));
                    found.push((misfit(machine, test, &corrected), description));
                }
            }
        }
    }
    for first in 0..machine.axes.len() {
        for second in first + 1..machine.axes.len() {
            let [one, other] = [first, second].map(|axis| &machine.axes[axis]);
            if one.kind != other.kind || !(matters(first) || matters(second)) {
                continue;
            }
            let mut corrected = readings.clone();
            corrected.positions.swap(first, second);
            if check_nominal(machine, test, &corrected).is_ok() {
                let description = format!("the columns of {} and {} were exchanged", one.name, other.name);
                found.push((misfit(machine, test, &corrected), description));
            }
        }
    }
    // A scale that nearly stops an axis makes many set-ups fit, so only corrections about as good as the best are kept.
    let best = found.iter().map(|(misfit, _)| *misfit).fold(f64::INFINITY, f64::min);
    found.retain(|(misfit, _)| *misfit <= EQUIVALENT_FACTOR * best + EQUIVALENT_MM);
    found.into_iter().map(|(_, description)| description).collect()
}

/// Corrections are equivalent if their misfits differ by less than this factor and this length, mm.
const EQUIVALENT_FACTOR: f64 = 2.0;
const EQUIVALENT_MM: f64 = 0.05;

/// Nominal misfit of the instrument, mm: rms over the readings.
fn misfit(machine: &Machine, test: &Test, readings: &Readings) -> f64 {
    let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
    let mut state = Vec::new();
    let mut sum = 0.0;
    for row in 0..readings.rows() {
        readings.state(machine, row, &mut state);
        let reading = test.station.read::<f64>(machine, &state, &none, |_| None);
        let nominal = test.station.reference_mm();
        sum += reading.channels().iter().map(|x| (x - nominal).powi(2)).sum::<f64>();
    }
    (sum / readings.rows().max(1) as f64).sqrt()
}

/// A point without a prior may be anywhere: the fit finds it.
fn check_nominal(machine: &Machine, test: &Test, readings: &Readings) -> Result<(), Fault> {
    let is_free = |first: usize| test.priors.iter().skip(first).take(3).any(|prior| *prior == Prior::Free);
    if test.station.points().iter().flatten().any(|point| is_free(point.first)) {
        return Ok(());
    }
    test.station.check_set_up(&Checked { machine, test: &test.name, readings })
}
