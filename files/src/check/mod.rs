//! Checks of a test and its readings, for sessions from files and sessions built in memory.
//!
//! A fault is a message and what to do. It has no place: the reader of a file adds the file and line.

mod plausibility;
mod runs;
pub(crate) mod setups;

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::instrument::{Checked, Fault};
use abbe_model::session::motion::{Course, Motion};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test, planned};
use abbe_model::unit::Unit;

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
    plausibility::check(machine, test, &planned)
}

/// Checks measured readings against the declared set-up. Returns warnings.
pub(crate) fn readings(machine: &Machine, test: &Test, readings: &Readings) -> Result<Vec<String>, Fault> {
    for (place, channel) in test.station.channels().iter().enumerate() {
        if (0..readings.rows()).all(|row| !readings.was_read(row, place)) {
            let message = format!("test \"{}\": no row has a value of `{}`", test.name, channel.name);
            return Err((message, "remove its column from the data, or leave it out of [columns]".into()));
        }
    }
    plausibility::check(machine, test, readings)?;
    test.station.check_observed(&test.name, &readings.observed)?;
    let checked = Checked { machine, test: &test.name, readings };
    test.station.check_readings(&checked)?;
    let doubts = [
        test.station.doubt(&checked),
        planned::beyond_travel(machine, readings),
        many_turns(machine, readings),
        of_another_unit(machine, test.motion.as_ref(), readings),
        runs::difference_from_stated(test.motion.as_ref(), readings).or_else(|| runs::missing_numbers(readings)),
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
