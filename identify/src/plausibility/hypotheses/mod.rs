//! The mistakes that are tried: each is the session with one statement changed.

mod dh;
mod set_ups;

use std::sync::Arc;

use abbe_model::axis::AxisKind;
use abbe_model::session::{Session, Test};
use abbe_model::unit::Unit;

use super::results::SuggestionKind;

/// A session with one statement changed.
pub(super) struct Hypothesis {
    pub kind: SuggestionKind,
    pub subject: String,
    pub words: String,
    pub session: Session,
    /// The factor by which the readings of the changed session are larger.
    pub factor: f64,
}

impl Hypothesis {
    pub fn new(kind: SuggestionKind, subject: &str, words: String, session: Session) -> Hypothesis {
        let subject = subject.to_string();
        Hypothesis { kind, subject, words, session, factor: 1.0 }
    }
}

pub(super) use dh::conventions;

/// Coordinates of balls below this are zero, mm.
const ZERO_MM: f64 = 1e-6;

/// The mistakes that are tried for an instrument that measures between table and tool.
pub(super) fn of_two_sides(session: &Session) -> Vec<Hypothesis> {
    let mut list = axes(session);
    list.extend(set_ups::balls(session));
    list.extend(set_ups::readings(session));
    list.extend(set_ups::columns(session));
    list.extend(set_ups::things(session));
    list.extend(set_ups::moves(session));
    list
}

/// Applies a change to the readings of every test; positions by axis, observed values in mm.
pub(super) fn with_readings(session: &Session, change: impl Fn(&Test, &mut Vec<Vec<f64>>, &mut Vec<f64>)) -> Session {
    let mut changed = session.clone();
    for (test, stated) in changed.tests.iter_mut().zip(&session.tests) {
        if let Some(readings) = test.readings.as_mut().map(Arc::make_mut) {
            change(stated, &mut readings.positions, &mut readings.observed);
        }
    }
    changed
}

/// Axes reversed, exchanged, or read in another unit.
fn axes(session: &Session) -> Vec<Hypothesis> {
    let machine = &session.machine;
    let is_used = |axis: &usize| {
        let readings = session.tests.iter().filter_map(|test| test.readings.as_ref());
        let mut positions = readings.flat_map(|readings| &readings.positions[*axis]);
        positions.any(|position| position.abs() > ZERO_MM)
    };
    let used: Vec<usize> = (0..machine.axes.len()).filter(is_used).collect();
    let mut list = Vec::new();
    for &k in &used {
        let mut changed = session.clone();
        Arc::make_mut(&mut changed.machine).axes[k].direction = machine.axes[k].direction.map(|along| -along);
        let name = &machine.axes[k].name;
        list.push(Hypothesis::new(
            SuggestionKind::AxisReversed,
            name,
            format!("the direction of axis {name} is reversed"),
            changed,
        ));
    }
    let rotary: Vec<usize> = (0..machine.axes.len()).filter(|k| machine.axes[*k].kind == AxisKind::Rotary).collect();
    for (place, &first) in rotary.iter().enumerate() {
        for &second in &rotary[place + 1..] {
            let mut changed = session.clone();
            Arc::make_mut(&mut changed.machine).axes.swap(first, second);
            for test in &mut changed.tests {
                test.at.swap(first, second);
                if test.at_written.len() > second {
                    test.at_written.swap(first, second);
                }
                if let Some(readings) = test.readings.as_mut().map(Arc::make_mut) {
                    readings.positions.swap(first, second);
                }
            }
            let names = [first, second].map(|k| machine.axes[k].name.as_str());
            list.push(Hypothesis::new(
                SuggestionKind::AxesExchanged,
                &names.join(", "),
                format!("axes {} and {} are exchanged in the chain", names[0], names[1]),
                changed,
            ));
        }
    }
    let linear: Vec<usize> = used.iter().copied().filter(|k| machine.axes[*k].kind == AxisKind::Linear).collect();
    list.extend(columns_exchanged(session, &linear));
    for kind in [AxisKind::Rotary, AxisKind::Linear] {
        let of_kind: Vec<usize> = used.iter().copied().filter(|k| machine.axes[*k].kind == kind).collect();
        if of_kind.is_empty() {
            continue;
        }
        let names: Vec<&str> = of_kind.iter().map(|k| machine.axes[*k].name.as_str()).collect();
        for (factor, unit) in units(kind) {
            let changed = with_readings(session, |_, positions, _| {
                of_kind.iter().for_each(|k| positions[*k].iter_mut().for_each(|value| *value *= factor));
            });
            list.push(Hypothesis::new(
                SuggestionKind::ColumnUnit,
                &names.join(", "),
                format!("the positions of {} are {unit}", names.join(", ")),
                changed,
            ));
        }
    }
    list
}

/// The columns of two of these axes exchanged, and those of three or more in reverse order.
pub(super) fn columns_exchanged(session: &Session, axes: &[usize]) -> Vec<Hypothesis> {
    let name = |axis: usize| session.machine.axes[axis].name.as_str();
    let exchanged = |pairs: &[(usize, usize)], subject: &str, words: String| {
        let changed = with_readings(session, |_, positions, _| {
            pairs.iter().for_each(|(one, other)| positions.swap(*one, *other));
        });
        Hypothesis::new(SuggestionKind::ColumnsExchanged, subject, words, changed)
    };
    let pairs = axes.iter().enumerate().flat_map(|(place, one)| axes[place + 1..].iter().map(|other| (*one, *other)));
    let mut list: Vec<Hypothesis> = pairs
        .map(|(one, other)| {
            let names = [name(one), name(other)];
            let words = format!("the columns of {} and {} are exchanged", names[0], names[1]);
            exchanged(&[(one, other)], &names.join(", "), words)
        })
        .collect();
    if axes.len() > 2 {
        let reversed: Vec<(usize, usize)> = (0..axes.len() / 2).map(|k| (axes[k], axes[axes.len() - 1 - k])).collect();
        let names = axes.iter().map(|axis| name(*axis)).collect::<Vec<_>>().join(", ");
        let words = format!("the columns of {names} are in reverse order");
        list.push(exchanged(&reversed, &names, words));
    }
    list
}

/// Factors by which positions are off where their unit is another, and what the column then holds.
pub(super) fn units(kind: AxisKind) -> Vec<(f64, &'static str)> {
    match kind {
        AxisKind::Rotary => vec![
            (Unit::Degree.per_internal(), "in radians, not in degrees"),
            (Unit::Degree.internal(), "in degrees, not in radians"),
        ],
        AxisKind::Linear => lengths().to_vec(),
    }
}

/// The same for lengths.
pub(super) fn lengths() -> [(f64, &'static str); 4] {
    [
        (Unit::Metre.internal(), "1,000 times too small: in m, not in mm, or in mm, not in µm"),
        (Unit::Micrometre.internal(), "1,000 times too large: in µm, not in mm, or in mm, not in m"),
        (Unit::Inch.internal(), "in inches, not in mm"),
        (Unit::Inch.per_internal(), "in mm, not in inches"),
    ]
}

/// The tests with readings.
fn measured(session: &Session) -> impl Iterator<Item = &Test> {
    session.tests.iter().filter(|test| test.readings.is_some())
}
