//! Kinematic parameters of controls, as far as the control's own model is publicly documented.
//!
//! A control computes the position of the tool over the table from the positions of its rotary axes. The tables hold the
//! change of each entry. The model of a control is two lines, of which it knows the positions and not the directions:
//! for two rotary axes under the workpiece, the first `T` next to the bed (A or B) and the second `C` on it, with the
//! location errors of this project, the lines at zero are displaced by
//!
//! ```text
//! line of T: (·, EY0T, EZ0T) for T = A,  (EX0T, ·, EZ0T) for T = B;    line of C: (EX0C + EX0T, EY0C + EY0T, ·)
//! ```
//!
//! The plain entries are these displacements. The best entries are those that make the volumetric error of the machine
//! with all its errors least over a travel ([`super::entries`]). What the control's model cannot express is listed.

use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName, Freedom};
use nalgebra::DVector;
use schemars::JsonSchema;
use serde::Serialize;

use super::entries::{Lines, NotRepresented, Remaining};
use super::travel::Travel;
use crate::compare::workspace::AxisRange;
use crate::error::unrepresentable;
use abbe_identify::model_file::IdentifiedModel;

/// The publicly documented kinematic model of a control.
pub struct KinematicModel {
    /// The model in the control's own words.
    pub about: &'static str,
    /// Where the model is documented.
    pub source: &'static str,
    /// The entries for a machine whose first axis has this letter.
    pub(crate) entries: fn(first: char) -> Vec<Entry>,
}

/// A displacement of an axis line that a control's model holds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Line {
    /// The first axis across itself in the plane of the table.
    FirstAcross,
    /// The first axis in Z.
    FirstHeight,
    /// The second axis along the first.
    SecondAlong,
    /// The second axis across the first, less the first.
    SecondAcross,
}

const LINES: [Line; 4] = [Line::FirstAcross, Line::FirstHeight, Line::SecondAlong, Line::SecondAcross];

impl Line {
    /// The location errors that add up to it: axis (0 first, 1 second) and freedom. The first one displaces the line.
    fn errors(self, first: char) -> Vec<(usize, Freedom)> {
        let [along, across] = if first == 'A' { [0, 1] } else { [1, 0] }.map(|place: usize| Freedom::ALL[place]);
        match self {
            Line::FirstAcross => vec![(0, across)],
            Line::FirstHeight => vec![(0, Freedom::ALL[2])],
            Line::SecondAlong => vec![(1, along), (0, along)],
            Line::SecondAcross => vec![(1, across)],
        }
    }
}

/// An entry: field, meaning, and its change as a sum of displacements.
pub(crate) struct Entry {
    pub field: &'static str,
    pub meaning: &'static str,
    pub terms: Vec<(f64, Line)>,
}

/// Which entries are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EntryChoice {
    /// Those that make the volumetric error least over the travel.
    #[default]
    Best,
    /// The displacements of the axis lines themselves.
    Plain,
}

/// The choices of entries: word, what it is.
pub const ENTRIES: [(EntryChoice, &str, &str); 2] = [
    (EntryChoice::Best, "best", "Those that leave the least volumetric error over the travel"),
    (EntryChoice::Plain, "plain", "The displacements of the axis lines themselves"),
];

/// The change of one entry.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct KinematicParameter {
    /// The control's own name or number.
    pub field: String,
    /// What it is.
    pub meaning: String,
    /// What is added to the present entry, mm.
    pub change_mm: f64,
    /// Standard uncertainty, mm.
    pub u_mm: f64,
    /// The plain change: that of the axis lines themselves, mm.
    pub plain_change_mm: f64,
}

/// The changes of a control's kinematic parameters.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct KinematicTable {
    /// The control.
    pub control: String,
    /// Where its model is documented.
    pub source: String,
    /// Which entries are written.
    pub entries: EntryChoice,
    /// The entries.
    pub parameters: Vec<KinematicParameter>,
    /// The travel of each axis.
    pub travel: Vec<AxisRange>,
    /// Whether the travel is that of the readings of the model.
    pub is_measured_travel: bool,
    /// The tool point in the tool frame, mm.
    pub tool_mm: [f64; 3],
    /// The volumetric error over the travel. A constant vector in the table frame, the zero of the workpiece, is none.
    pub remaining: Remaining,
    /// What the control's model does not represent: rms over the travel that the best entries leave of each, the
    /// largest first.
    pub not_represented: Vec<NotRepresented>,
    /// Entries that the readings do not determine, and identified errors that the entries cannot hold, with the reason.
    pub left_out: Vec<String>,
}

/// The table of a control of this name for a travel and a tool point in the tool frame, mm.
///
/// # Errors
/// If the control's model is not one of this machine, or an error of the model cannot be evaluated over the travel.
pub fn table(
    model: &IdentifiedModel,
    name: &str,
    kinematics: &KinematicModel,
    choice: EntryChoice,
    travel: &Travel,
    tool_mm: [f64; 3],
) -> Result<KinematicTable, Diagnostic> {
    let control = format!("{name}, {}", kinematics.about);
    let (first, second) = tilting_table(&model.machine).ok_or_else(|| {
        unrepresentable(
            &control,
            format!("the machine `{}`", model.machine.code()),
            "it describes two rotary axes under the workpiece, a tilting A (along X) or B (along Y) with C (along Z) on it",
        )
    })?;
    let axes = [first, second];
    let letter = if model.machine.axes[first].direction[0].abs() == 1.0 { 'A' } else { 'B' };
    let error = |axis: usize, freedom: Freedom| ErrorName {
        kind: ErrorKind::Location,
        freedom,
        axis: model.machine.axes[axes[axis]].name.clone(),
    };
    let index = |name: &ErrorName| {
        let own = model.parameters.iter().position(|p| p.id.error() == Some(name));
        own.filter(|index| model.is_estimated(*index))
    };
    // The errors of each line, and those of them that the readings determine.
    let names = LINES.map(|line| {
        line.errors(letter).into_iter().map(|(axis, freedom)| error(axis, freedom)).collect::<Vec<ErrorName>>()
    });
    let known = names.each_ref().map(|names| names.iter().filter_map(index).collect::<Vec<usize>>());
    let free = known.each_ref().map(|known| !known.is_empty());
    if !free.contains(&true) {
        let holds = "it has no entry for an error that the readings of the model determine";
        return Err(unrepresentable(control, "the model", holds));
    }
    let slots: Vec<usize> = names.iter().filter_map(|names| model.machine.error_slot(&names[0])).collect();
    let plain = known.each_ref().map(|known| known.iter().map(|k| model.parameters[*k].value).sum::<f64>());
    let lines = Lines::of(model, slots, travel, tool_mm)?;
    let (by_parameter, not_represented) = lines.by_parameter(&free)?;
    let (written, by_parameter) = match choice {
        EntryChoice::Best => (lines.best(&plain, &free), by_parameter),
        EntryChoice::Plain => (plain.to_vec(), plain_by_parameter(&known)),
    };
    let remaining = Remaining {
        without: lines.remaining(&[0.0; LINES.len()]),
        plain: lines.remaining(&plain),
        written: lines.remaining(&written),
        set_up_anew: false,
    };
    let mut parameters = Vec::new();
    let mut left_out: Vec<String> = Vec::new();
    for entry in (kinematics.entries)(letter) {
        let mut shares = [0.0; LINES.len()];
        for (share, line) in &entry.terms {
            shares[*line as usize] += share;
        }
        let used = (0..LINES.len()).filter(|line| shares[*line] != 0.0);
        if !entry.terms.is_empty() && used.clone().all(|line| !free[line]) {
            let names: Vec<String> = used.flat_map(|line| &names[line]).map(ToString::to_string).collect();
            let names = names.join(" or ");
            left_out.push(format!("{}: {}: the readings do not determine {names}", entry.field, entry.meaning));
            continue;
        }
        let sum = |values: &[f64]| shares.iter().zip(values).map(|(share, value)| share * value).sum::<f64>();
        let weights: Vec<(usize, f64)> =
            by_parameter.iter().map(|(parameter, change)| (*parameter, sum(change.as_slice()))).collect();
        let variance: f64 = weights
            .iter()
            .map(|(i, a)| weights.iter().map(|(j, b)| a * b * model.covariance[(*i, *j)]).sum::<f64>())
            .sum();
        parameters.push(KinematicParameter {
            field: entry.field.to_string(),
            meaning: entry.meaning.to_string(),
            change_mm: sum(&written),
            u_mm: variance.max(0.0).sqrt(),
            plain_change_mm: sum(&plain),
        });
    }
    left_out.extend(no_entry(model, &known));
    Ok(KinematicTable {
        control,
        source: kinematics.source.to_string(),
        entries: choice,
        parameters,
        travel: travel.axes(model),
        is_measured_travel: travel.is_measured,
        tool_mm,
        remaining,
        not_represented,
        left_out,
    })
}

/// The change of the plain displacements by each location error of the lines.
fn plain_by_parameter(known: &[Vec<usize>; LINES.len()]) -> Vec<(usize, DVector<f64>)> {
    let of_line = |(line, known): (usize, &Vec<usize>)| {
        let unit = move |k: usize, _: usize| f64::from(u8::from(k == line));
        known.iter().map(move |parameter| (*parameter, DVector::from_fn(LINES.len(), unit))).collect::<Vec<_>>()
    };
    known.iter().enumerate().flat_map(of_line).collect()
}

/// The identified errors and the effects that no entry holds by itself.
fn no_entry(model: &IdentifiedModel, known: &[Vec<usize>; LINES.len()]) -> Vec<String> {
    let errors = model.parameters.iter().enumerate().filter(|(_, parameter)| parameter.id.is_error());
    let errors = errors
        .filter(|(index, _)| !known.iter().flatten().any(|known| known == index) && model.is_estimated(*index))
        .map(|(_, parameter)| format!("{}: the control's model has no entry for it", parameter.id));
    let effects = model.effects.iter().map(|effect| format!("{}: not a fixed geometry", effect.id()));
    errors.chain(effects).collect()
}

/// The tilting axis next to the bed and the axis on it, by index, of a machine with a tilting rotary table.
fn tilting_table(machine: &Machine) -> Option<(usize, usize)> {
    let rotary: Vec<usize> =
        (0..machine.axes.len()).filter(|axis| machine.axes[*axis].kind == AxisKind::Rotary).collect();
    let [second, first] = rotary[..] else { return None };
    let along = |axis: usize, i: usize| machine.axes[axis].direction[i].abs() == 1.0;
    let is_table = first < machine.workpiece_side && second < first;
    (is_table && (along(first, 0) || along(first, 1)) && along(second, 2)).then_some((first, second))
}
