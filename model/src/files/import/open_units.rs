//! Units that a file does not state: those that the values of the columns allow.

use std::collections::BTreeMap;

use super::Expected;
use super::grid::Grid;
use super::meaning::{Found, Meaning};
use super::unit::Unit;
use super::values::Values;
use crate::axis::AxisKind;
use crate::words::listed;

/// Positions of a rotary axis beyond this, in radians, are degrees: more than one turn either way.
const MAX_TURN_RAD: f64 = 6.5;
/// Share by which a length may differ from the reference of the set-up.
const NEAR_REFERENCE: f64 = 0.05;
/// Positions beyond this are not in m.
const MAX_M: f64 = 20.0;
/// Deviations below this are in mm, not µm, where no unit is stated.
const MAX_DEVIATION_MM: f64 = 0.5;

/// The units of columns that state none, with the assumption in words.
pub(super) type Choice = (String, BTreeMap<usize, Unit>);

/// For each group of columns without a stated unit, the units that their values allow, the most probable first.
pub(super) fn open(grid: &Grid, found: &[Found], expected: &Expected<'_>, values: &Values) -> Vec<Vec<Choice>> {
    let machine = expected.machine;
    let without = |of: &dyn Fn(&Meaning) -> bool| -> Vec<usize> {
        found.iter().filter(|one| one.unit.is_none() && of(&one.meaning)).map(|one| one.column).collect()
    };
    let of_kind = |kind: AxisKind| {
        move |meaning: &Meaning| match meaning {
            Meaning::Axis(axis) => machine.axes[*axis].kind == kind,
            Meaning::Polar => kind == AxisKind::Rotary,
            _ => false,
        }
    };
    let choices = |columns: &[usize], units: &[&'static str]| -> Vec<Choice> {
        let names: Vec<String> = columns.iter().map(|column| grid.name(*column)).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let of_unit = |own: &&'static str| {
            let text = format!("the unit of {} is not stated: {own} is read", listed(&names, "and"));
            (text, columns.iter().map(|column| (*column, Unit::of_own(own))).collect())
        };
        units.iter().map(of_unit).collect()
    };
    let mut open = Vec::new();
    let rotary = without(&of_kind(AxisKind::Rotary));
    if !rotary.is_empty() {
        let is_arm = machine.axes.iter().filter(|axis| axis.kind == AxisKind::Rotary).count() > 2;
        let units: &[&str] = match (values.largest(&rotary) <= MAX_TURN_RAD, is_arm) {
            (false, _) => &["deg"],
            (true, true) => &["rad", "deg"],
            (true, false) => &["deg", "rad"],
        };
        open.push(choices(&rotary, units));
    }
    let linear = without(&of_kind(AxisKind::Linear));
    if !linear.is_empty() {
        let units: &[&str] = if values.largest(&linear) < MAX_M { &["mm", "m", "in"] } else { &["mm", "in"] };
        open.push(choices(&linear, units));
    }
    let is_length = |meaning: &Meaning, deviation: bool| match meaning {
        Meaning::Reading(stem, false) => {
            let column = expected.station.columns().iter().find(|column| column.stem == *stem);
            column.is_some_and(|column| (column.unit == "um") == deviation)
        }
        _ => false,
    };
    let lengths = without(&|meaning| is_length(meaning, false));
    if !lengths.is_empty() {
        let reference = expected.station.reference_mm();
        let median = values.median(lengths[0]);
        let near = |unit: &&&str| {
            let mm = crate::files::quantity::Unit::of_length(unit).map_or(0.0, |unit| unit.to_internal(median));
            reference > 0.0 && (mm / reference - 1.0).abs() < NEAR_REFERENCE
        };
        let units: Vec<&'static str> = match ["mm", "um", "m", "in"].iter().find(near) {
            Some(unit) => vec![unit],
            None if values.largest(&lengths) < MAX_M => vec!["m", "mm", "in"],
            None => vec!["mm", "in"],
        };
        open.push(choices(&lengths, &units));
    }
    let deviations = without(&|meaning| is_length(meaning, true));
    if !deviations.is_empty() {
        let units: &[&str] = if values.largest(&deviations) < MAX_DEVIATION_MM { &["mm"] } else { &["um"] };
        open.push(choices(&deviations, units));
    }
    open
}
