//! Units that a file does not state: those that the values of the columns allow.

use std::collections::BTreeMap;

use abbe_model::axis::AxisKind;
use abbe_model::instrument::Fault;
use abbe_model::words::{listed, number};

use super::Expected;
use super::grid::Grid;
use super::meaning::{Found, Meaning};
use super::unit::{self, Unit};
use super::values::Values;

/// Positions of a rotary axis beyond this, in radians, are degrees: more than one turn either way.
const MAX_TURN_RAD: f64 = 6.5;
/// Share by which a length may differ from the reference of the set-up.
const NEAR_REFERENCE: f64 = 0.05;
/// Positions beyond this are not in m.
const MAX_M: f64 = 20.0;
/// Deviations whose root mean square is below the first are in mm, those above the second in µm, where no unit is stated.
/// Between them they may be both.
const DEVIATIONS: [f64; 2] = [0.05, 5.0];
/// Times beyond this are in ms: of seconds since 1970 it is the year 5138.
const MAX_TIME_S: f64 = 1e11;
/// Temperatures from this on are in kelvins.
const MIN_KELVIN: f64 = 200.0;

/// The units of columns that state none, with the assumption in words.
pub(super) type Choice = (String, BTreeMap<usize, Unit>);

/// Whether our column has no unit.
pub(super) fn has_no_unit(meaning: &Meaning, expected: &Expected<'_>) -> bool {
    match meaning {
        Meaning::Reading(stem, _) => {
            expected.station.columns().iter().any(|column| column.stem == *stem && column.unit.is_empty())
        }
        Meaning::Socket | Meaning::Run | Meaning::Clock | Meaning::Driver(_) => true,
        _ => false,
    }
}

/// For each group of columns without a stated unit, the units that their values allow, the most probable first.
///
/// # Errors
/// If the unit of deviations can be told neither from the values nor by a fit: what to state.
pub(super) fn open(
    grid: &Grid,
    found: &[Found],
    expected: &Expected<'_>,
    values: &Values,
) -> Result<Vec<Vec<Choice>>, Fault> {
    let machine = expected.machine;
    let without = |of: &dyn Fn(&Meaning) -> bool| -> Vec<usize> {
        let is_open = |one: &&Found| one.unit.is_none() && !has_no_unit(&one.meaning, expected) && of(&one.meaning);
        found.iter().filter(is_open).map(|one| one.column).collect()
    };
    let of_kind = |kind: AxisKind| {
        move |meaning: &Meaning| match meaning {
            Meaning::Axis(axis) => machine.axes[*axis].kind == kind,
            Meaning::Polar => kind == AxisKind::Rotary,
            _ => false,
        }
    };
    let named = |columns: &[usize]| {
        let names: Vec<String> = columns.iter().map(|column| format!("`{}`", grid.name(*column))).collect();
        listed(&names, "and")
    };
    let choices = |columns: &[usize], units: &[&'static str]| -> Vec<Choice> {
        let of_unit = |own: &&'static str| {
            let text = format!("the unit of {} is not stated: {own} is read", named(columns));
            (text, columns.iter().map(|column| (*column, unit_of(own))).collect())
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
    let unit_of_reading = |meaning: &Meaning| {
        match meaning {
            Meaning::Reading(stem, _) => expected.station.columns().iter().find(|column| column.stem == *stem),
            _ => None,
        }
        .map(|column| column.unit)
    };
    let lengths = without(&|meaning| unit_of_reading(meaning) == Some("mm"));
    if !lengths.is_empty() {
        let reference = expected.station.reference_mm();
        let median = values.median(lengths[0]);
        let near = |unit: &&&str| {
            let mm = unit_of(unit).to_internal(median);
            reference > 0.0 && (mm / reference - 1.0).abs() < NEAR_REFERENCE
        };
        let units: Vec<&'static str> = match ["mm", "um", "m", "in"].iter().find(near) {
            Some(unit) => vec![unit],
            None if values.largest(&lengths) < MAX_M => vec!["m", "mm", "in"],
            None => vec!["mm", "in"],
        };
        open.push(choices(&lengths, &units));
    }
    let deviations = without(&|meaning| unit_of_reading(meaning) == Some("um"));
    if let [first, ..] = deviations[..] {
        let rms = values.rms(&deviations);
        if (DEVIATIONS[0]..=DEVIATIONS[1]).contains(&rms) {
            let what = format!(
                "the unit of {} is not stated, and deviations of {} rms may be in mm or in µm",
                named(&deviations),
                number(rms)
            );
            let stem = found.iter().find(|one| one.column == first).map_or("", |one| one.meaning.stem());
            let help = format!(
                "state the unit in the name of the column, or say what it holds: {stem}_um={0} or {stem}_mm={0}",
                grid.name(first)
            );
            return Err((what, help));
        }
        open.push(choices(&deviations, &[if rms < DEVIATIONS[0] { "mm" } else { "um" }]));
    }
    // Directions may be in radians, small rotations are in our unit.
    let directions = without(&|meaning| unit_of_reading(meaning) == Some("deg"));
    if !directions.is_empty() {
        let units: &[&str] = if values.largest(&directions) <= MAX_TURN_RAD { &["rad", "deg"] } else { &["deg"] };
        open.push(choices(&directions, units));
    }
    for (own, is_of) in [
        ("arcsec", &(|meaning: &Meaning| unit_of_reading(meaning) == Some("arcsec")) as &dyn Fn(&Meaning) -> bool),
        ("s", &|meaning| *meaning == Meaning::Time),
        ("c", &|meaning| *meaning == Meaning::Temperature),
    ] {
        let columns = without(is_of);
        let unit = match own {
            "s" if values.median(columns.first().copied().unwrap_or(0)) > MAX_TIME_S => "ms",
            "c" if values.largest(&columns) > MIN_KELVIN => "k",
            own => own,
        };
        if !columns.is_empty() {
            open.push(choices(&columns, &[unit]));
        }
    }
    let ambiguous: Vec<usize> =
        found.iter().filter(|one| one.unit.is_some_and(Unit::is_ambiguous)).map(|one| one.column).collect();
    if !ambiguous.is_empty() {
        let of_unit = |(word, unit): (&str, Unit)| {
            let text = format!("`grad` of {} may be a degree or a gon: {word} is read", named(&ambiguous));
            (text, ambiguous.iter().map(|column| (*column, unit)).collect())
        };
        open.push(unit::DEGREE_OR_GON.map(of_unit).to_vec());
    }
    Ok(open)
}

/// A unit of these lists.
fn unit_of(word: &str) -> Unit {
    unit::of(word).unwrap_or(Unit::of_own("1"))
}
