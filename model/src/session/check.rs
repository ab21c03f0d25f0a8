//! Checks of a test and its readings, for sessions from files and sessions built in memory.
//!
//! A fault is a message and what to do. It has no place: the reader of a file adds the file and line.

use super::readings::Readings;
use super::{Test, planned, plausibility, runs};
use crate::chain::Machine;
use crate::instrument::{Checked, Fault};

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
        planned::many_turns(machine, readings),
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
