//! Units that a file does not state: those that the values of the columns allow.

use std::collections::BTreeMap;

use abbe_model::axis::AxisKind;
use abbe_model::instrument::Fault;
use abbe_model::unit::Unit;
use abbe_model::words::{listed, number};

use super::grid::Grid;
use super::meaning::{Found, Meaning};
use super::{Expected, Table, unit};

/// Positions of a rotary axis beyond this, in radians, are degrees: more than one turn either way.
const MAX_TURN_RAD: f64 = 6.5;
/// Share by which a length may differ from the reference of the set-up.
const NEAR_REFERENCE: f64 = 0.05;
/// Positions beyond this are not in m.
const MAX_M: f64 = 20.0;
/// Deviations whose root mean square is at most this, mm, may be in the unit of the lengths beside them, and those of at
/// least this, µm, in µm.
const MAX_DEVIATION_MM: f64 = 5.0;
const MIN_DEVIATION_UM: f64 = 0.05;
/// Units of a length near the reference, the most probable first.
const LENGTHS: [Unit; 4] = [Unit::Millimetre, Unit::Micrometre, Unit::Metre, Unit::Inch];
/// Factor by which the range of positions may differ from the planned one: less than that between two units.
const NEAR_PLAN: f64 = 5.0;
/// Share of its travel by which an axis may exceed it: a reading behind the end of a drawing is no other unit.
const BEYOND: f64 = 0.5;
/// Times beyond this are in ms: of seconds since 1970 it is the year 5138.
const MAX_TIME_S: f64 = 1e11;
/// Temperatures from this on are in kelvins.
const MIN_KELVIN: f64 = 200.0;

/// Units of columns that state none.
#[derive(Clone)]
pub(super) struct Choice {
    /// The assumption in words.
    pub text: String,
    pub units: BTreeMap<usize, Unit>,
    /// Millimetres in the unit of the lengths; 1 where none is chosen.
    pub scale_mm: f64,
}

/// Whether our column has no unit.
pub(super) fn has_no_unit(meaning: &Meaning, expected: &Expected<'_>) -> bool {
    match meaning {
        Meaning::Reading(stem, _) => {
            expected.station.columns().iter().any(|column| column.stem == *stem && column.unit == Unit::One)
        }
        Meaning::Socket | Meaning::Run | Meaning::Clock | Meaning::Driver(_) => true,
        _ => false,
    }
}

/// For each group of columns without a stated unit, the units that their values allow, the most probable first. A file has
/// one unit of length and one of angle, unless its header says otherwise; what the test plans and how far the axes travel
/// decide between units before a fit does.
///
/// # Errors
/// If the unit of deviations can be told neither from the values nor by a fit: what to state.
pub(super) fn open(table: &Table<'_>) -> Result<Vec<Vec<Choice>>, Fault> {
    let Table { grid, found, expected, values } = table;
    let mut open = vec![table.lengths()?, table.angles()];
    let is_of = |unit: Unit| move |meaning: &Meaning| unit_of_reading(meaning, expected) == Some(unit);
    // Small rotations are in our unit.
    for (own, columns) in [
        (Unit::Arcsecond, table.without(&is_of(Unit::Arcsecond))),
        (Unit::Second, table.without(&|meaning| *meaning == Meaning::Time)),
        (Unit::Celsius, table.without(&|meaning| *meaning == Meaning::Temperature)),
    ] {
        let unit = match own {
            Unit::Second if values.median(columns.first().copied().unwrap_or(0)) > MAX_TIME_S => Unit::Millisecond,
            Unit::Celsius if values.largest(&columns) > MIN_KELVIN => Unit::Kelvin,
            own => own,
        };
        open.push(choice(grid, &[(&columns, unit)]).into_iter().collect());
    }
    let ambiguous: Vec<usize> = found.iter().filter(|one| one.unit == Some(Unit::Grad)).map(|one| one.column).collect();
    if !ambiguous.is_empty() {
        let of_unit = |unit: Unit| Choice {
            text: format!("`grad` of {} may be a degree or a gon: {unit} is read", named(grid, &ambiguous)),
            units: ambiguous.iter().map(|column| (*column, unit)).collect(),
            scale_mm: 1.0,
        };
        open.push(unit::DEGREE_OR_GON.map(of_unit).to_vec());
    }
    open.retain(|choices| !choices.is_empty());
    Ok(open)
}

impl Table<'_> {
    /// The columns of these meanings that state no unit.
    fn without(&self, of: &dyn Fn(&Meaning) -> bool) -> Vec<usize> {
        let is_open =
            |one: &&Found| one.unit.is_none() && !has_no_unit(&one.meaning, self.expected) && of(&one.meaning);
        self.found.iter().filter(is_open).map(|one| one.column).collect()
    }

    /// The one unit that the columns of these meanings state.
    fn stated(&self, of: &dyn Fn(&Meaning) -> bool) -> Option<Unit> {
        let mut stated = self.found.iter().filter(|one| of(&one.meaning)).filter_map(|one| one.unit);
        let first = stated.next()?;
        stated.all(|other| other == first).then_some(first)
    }

    fn is_axis(&self, kind: AxisKind) -> impl Fn(&Meaning) -> bool {
        let axes = &self.expected.machine.axes;
        move |meaning: &Meaning| match meaning {
            Meaning::Axis(axis) => axes[*axis].kind == kind,
            Meaning::Polar => kind == AxisKind::Rotary,
            _ => false,
        }
    }

    /// Of these units, those in which the positions are those that the test plans, or that the travel allows; all if there
    /// are none.
    fn possible(&self, columns: &[usize], units: &[Unit]) -> Vec<Unit> {
        let axis = |column: &usize| match self.found.iter().find(|one| one.column == *column)?.meaning {
            Meaning::Axis(axis) => Some((axis, self.values.range(*column)?)),
            _ => None,
        };
        let moves: Vec<(usize, [f64; 2])> = columns.iter().filter_map(axis).collect();
        let is_possible = |unit: &&Unit| {
            moves.iter().all(|(axis, range)| {
                let [low, high] = range.map(|value| unit.to_internal(value));
                let is_near = |found: f64, planned: f64| {
                    let ratio = found / planned;
                    !ratio.is_finite() || ratio == 0.0 || (1.0 / NEAR_PLAN..NEAR_PLAN).contains(&ratio)
                };
                match (
                    self.expected.planned.as_ref().and_then(|planned| planned.get(*axis)),
                    &self.expected.machine.axes[*axis].travel,
                ) {
                    (Some([from, to]), _) if to > from => is_near(high - low, to - from),
                    (Some([at, _]), _) => is_near(low.abs().max(high.abs()), at.abs()),
                    (None, Some([from, to])) => low > from - BEYOND * (to - from) && high < to + BEYOND * (to - from),
                    (None, None) => true,
                }
            })
        };
        let possible: Vec<Unit> = units.iter().filter(is_possible).copied().collect();
        if possible.is_empty() { units.to_vec() } else { possible }
    }

    /// Positions and readings that are lengths, and deviations, which are often in µm beside them.
    fn lengths(&self) -> Result<Vec<Choice>, Fault> {
        let expected = self.expected;
        let is_deviation = |meaning: &Meaning| unit_of_reading(meaning, expected) == Some(Unit::Micrometre);
        let is_length = |meaning: &Meaning| unit_of_reading(meaning, expected) == Some(Unit::Millimetre);
        let linear = self.without(&self.is_axis(AxisKind::Linear));
        let lengths = self.without(&is_length);
        let deviations = self.without(&is_deviation);
        let stated = self
            .stated(&|meaning| self.is_axis(AxisKind::Linear)(meaning) || is_length(meaning))
            .filter(|unit| *unit != Unit::Micrometre);
        let both: Vec<usize> = linear.iter().chain(&lengths).copied().collect();
        let units: &[Unit] = match (self.values.largest(&both) < MAX_M, linear.is_empty()) {
            (true, false) => &[Unit::Millimetre, Unit::Metre, Unit::Inch],
            (true, true) => &[Unit::Metre, Unit::Millimetre, Unit::Inch],
            (false, _) => &[Unit::Millimetre, Unit::Inch],
        };
        let reference = expected.station.reference_mm();
        let near = |unit: &Unit| {
            let mm = unit.to_internal(self.values.median(lengths[0]));
            reference > 0.0 && (mm / reference - 1.0).abs() < NEAR_REFERENCE
        };
        let of_reference = (!lengths.is_empty()).then(|| LENGTHS.into_iter().find(near)).flatten();
        let mut units = self.possible(&linear, units);
        let known = stated.or(of_reference.filter(|unit| units.contains(unit)));
        if let Some(known) = known.filter(|known| units.contains(known) || linear.is_empty()) {
            units = vec![known];
        }
        if both.is_empty() {
            units = vec![stated.unwrap_or(Unit::Millimetre)];
        } else if self.values.largest(&both) == 0.0 {
            units.truncate(1);
        }
        let mut choices = Vec::new();
        for unit in units {
            let groups = [
                (&linear, unit),
                (&lengths, of_reference.unwrap_or(unit)),
                (&deviations, self.unit_of_deviations(&deviations, unit)?),
            ];
            choices.extend(choice(self.grid, &groups));
        }
        Ok(choices)
    }

    /// The unit of deviations beside lengths in a unit.
    fn unit_of_deviations(&self, deviations: &[usize], beside: Unit) -> Result<Unit, Fault> {
        let [first, ..] = deviations[..] else { return Ok(beside) };
        let rms = self.values.rms(deviations);
        let mm = beside.to_internal(rms);
        match (mm <= MAX_DEVIATION_MM, rms >= MIN_DEVIATION_UM) {
            (true, false) => Ok(beside),
            (false, _) => Ok(Unit::Micrometre),
            (true, true) => {
                let what = format!(
                    "the unit of {} is not stated, and deviations of {} rms may be in {beside} or in µm",
                    named(self.grid, deviations),
                    number(rms)
                );
                let stem = self.found.iter().find(|one| one.column == first).map_or("", |one| one.meaning.stem());
                let help = format!(
                    "state the unit in the name of the column, or say what it holds: {stem}_um={0} or {stem}_{beside}={0}",
                    self.grid.name(first)
                );
                Err((what, help))
            }
        }
    }

    /// Positions of rotary axes and directions.
    fn angles(&self) -> Vec<Choice> {
        let is_direction = |meaning: &Meaning| unit_of_reading(meaning, self.expected) == Some(Unit::Degree);
        let rotary = self.without(&self.is_axis(AxisKind::Rotary));
        let directions = self.without(&is_direction);
        let both: Vec<usize> = rotary.iter().chain(&directions).copied().collect();
        let axes = &self.expected.machine.axes;
        let is_arm = axes.iter().filter(|axis| axis.kind == AxisKind::Rotary).count() > 2;
        let units: &[Unit] = match (self.values.largest(&both) <= MAX_TURN_RAD, is_arm || rotary.is_empty()) {
            (false, _) => &[Unit::Degree],
            (true, true) => &[Unit::Radian, Unit::Degree],
            (true, false) => &[Unit::Degree, Unit::Radian],
        };
        let mut units = self.possible(&rotary, units);
        // A direction beside positions in another unit is one that a fit decides.
        if let Some(stated) = self.stated(&self.is_axis(AxisKind::Rotary)).filter(|unit| units.contains(unit)) {
            match rotary.is_empty() {
                true => units.sort_by_key(|unit| *unit != stated),
                false => units = vec![stated],
            }
        }
        if self.values.largest(&both) == 0.0 {
            units.truncate(1);
        }
        units.into_iter().filter_map(|unit| choice(self.grid, &[(&both, unit)])).collect()
    }
}

/// The unit in which messages name the readings of a column; `None` for a column of another kind.
fn unit_of_reading(meaning: &Meaning, expected: &Expected<'_>) -> Option<Unit> {
    let Meaning::Reading(stem, _) = meaning else { return None };
    expected.station.columns().iter().find(|column| column.stem == *stem).map(|column| column.unit)
}

/// Groups of columns, each in a unit; `None` if they have no columns.
fn choice(grid: &Grid, groups: &[(&Vec<usize>, Unit)]) -> Option<Choice> {
    let mut by_unit: Vec<(Unit, Vec<usize>)> = Vec::new();
    for (columns, unit) in groups.iter().filter(|(columns, _)| !columns.is_empty()) {
        match by_unit.iter_mut().find(|(own, _)| own == unit) {
            Some((_, all)) => all.extend(columns.iter()),
            None => by_unit.push((*unit, columns.to_vec())),
        }
    }
    let texts = by_unit
        .iter()
        .map(|(unit, columns)| format!("the unit of {} is not stated: {} is read", named(grid, columns), unit.key()));
    let units = by_unit.iter().flat_map(|(own, columns)| columns.iter().map(move |column| (*column, *own)));
    let first = by_unit.first().map(|(unit, _)| *unit)?;
    let scale_mm = if first.is_length() { first.to_internal(1.0) } else { 1.0 };
    Some(Choice { text: texts.collect::<Vec<_>>().join("; "), units: units.collect(), scale_mm })
}

fn named(grid: &Grid, columns: &[usize]) -> String {
    let names: Vec<String> = columns.iter().map(|column| format!("`{}`", grid.name(*column))).collect();
    listed(&names, "and")
}
