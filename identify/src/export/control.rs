//! Location errors as kinematic parameters of controls, as far as the control's own model is publicly documented.
//!
//! A control computes the position of the tool over the table from the positions of its rotary axes. The tables hold the
//! change of each entry: the identified line of an axis less the nominal one. What the control's model cannot express,
//! such as the orientation of an axis, is listed as left out.
//!
//! For two rotary axes under the workpiece, the first `T` next to the bed (A or B) and the second `C` on it, with the
//! location errors of this project, the lines at zero are displaced by
//!
//! ```text
//! line of T: (·, EY0T, EZ0T) for T = A,  (EX0T, ·, EZ0T) for T = B;    line of C: (EX0C + EX0T, EY0C + EY0T, ·)
//! ```

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName, Freedom};
use schemars::JsonSchema;
use serde::Serialize;

use crate::error::IdentifyError;
use crate::model_file::IdentifiedModel;
use crate::parameters::Role;

/// A control with a publicly documented kinematic model.
pub struct ControlKinematics {
    /// The word by which it is requested.
    pub word: &'static str,
    /// The control and its model.
    pub about: &'static str,
    /// Where the model is documented.
    pub source: &'static str,
    /// The entries for a machine: field, meaning, and its change as a sum of errors of the first and the second axis.
    entries: fn(first: char) -> Vec<Entry>,
}

/// An entry: field, meaning, terms.
struct Entry {
    field: &'static str,
    meaning: &'static str,
    /// Coefficient, axis (0 first, 1 second), freedom.
    terms: Vec<(f64, usize, Freedom)>,
}

/// A control whose kinematic model is not exported, with the reason.
pub const NOT_DOCUMENTED: &[(&str, &str)] = &[
    (
        "siemens",
        "the vectors of SINUMERIK 840D (MD24500 TRAFO5_PART_OFFSET, MD24550 TRAFO5_BASE_TOOL, MD24560 TRAFO5_JOINT_OFFSET) are \
         listed in public manuals without the equation that fixes their signs for each machine type",
    ),
    (
        "heidenhain",
        "the kinematics tables of TNC controls belong to the machine manufacturer; the public manuals list their columns without \
         the sign of a transformation",
    ),
];

/// The controls with a documented model.
pub const KINEMATICS: &[ControlKinematics] = &[
    ControlKinematics {
        word: "linuxcnc",
        about: "LinuxCNC, xyzac-trt-kins and xyzbc-trt-kins (HAL pins)",
        source: "LinuxCNC, src/emc/kinematics/trtfuncs.c, xyzacKinematicsForward and xyzbcKinematicsForward; \
                 man 9 xyzac-trt-kins",
        entries: linuxcnc,
    },
    ControlKinematics {
        word: "fanuc",
        about: "Fanuc Series 30i, tool centre point control, table rotation type (No. 19680 = 12)",
        source: "Fanuc A-79348E, Series 30i-MODEL A, Tool center point control for 5-axis machining, Nos. 19680, 19700 to 19705",
        entries: fanuc,
    },
];

/// `tran = Rz(−c)·(Rx(−a)·(J − r − d) + d) + r`: the line of C is at `r`, that of A at `r + d`.
fn linuxcnc(first: char) -> Vec<Entry> {
    let (x, y, z) = (Freedom::ALL[0], Freedom::ALL[1], Freedom::ALL[2]);
    let offset = if first == 'A' {
        Entry { field: "y-offset", meaning: "line of A less line of C in Y", terms: vec![(-1.0, 1, y)] }
    } else {
        Entry { field: "x-offset", meaning: "line of B less line of C in X", terms: vec![(-1.0, 1, x)] }
    };
    vec![
        Entry { field: "x-rot-point", meaning: "line of C in X", terms: vec![(1.0, 1, x), (1.0, 0, x)] },
        Entry { field: "y-rot-point", meaning: "line of C in Y", terms: vec![(1.0, 1, y), (1.0, 0, y)] },
        Entry { field: "z-rot-point", meaning: "line of the tilting axis in Z", terms: vec![(1.0, 0, z)] },
        offset,
    ]
}

/// Point A on the first axis in machine coordinates, and the vector from A to point B on the second axis.
fn fanuc(first: char) -> Vec<Entry> {
    let (x, y, z) = (Freedom::ALL[0], Freedom::ALL[1], Freedom::ALL[2]);
    let point = |freedom: Freedom, along: bool| if along { Vec::new() } else { vec![(1.0, 0, freedom)] };
    // Along the first axis point A is where it was: what the second axis is displaced there goes into the vector.
    let vector = |freedom: Freedom, along: bool| {
        let mut terms = vec![(1.0, 1, freedom)];
        if along {
            terms.push((1.0, 0, freedom));
        }
        terms
    };
    vec![
        Entry { field: "19700", meaning: "rotary table position, X", terms: point(x, first == 'A') },
        Entry { field: "19701", meaning: "rotary table position, Y", terms: point(y, first == 'B') },
        Entry { field: "19702", meaning: "rotary table position, Z", terms: point(z, false) },
        Entry { field: "19703", meaning: "vector from first to second axis, X", terms: vector(x, first == 'A') },
        Entry { field: "19704", meaning: "vector from first to second axis, Y", terms: vector(y, first == 'B') },
        Entry { field: "19705", meaning: "vector from first to second axis, Z", terms: Vec::new() },
    ]
}

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
}

/// The changes of a control's kinematic parameters.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct KinematicTable {
    /// The control.
    pub control: String,
    /// Where its model is documented.
    pub source: String,
    /// The entries.
    pub parameters: Vec<KinematicParameter>,
    /// Entries that the readings do not determine, and identified errors that the entries cannot hold, with the reason.
    pub left_out: Vec<String>,
}

/// The table of a control.
///
/// # Errors
/// If the control's model is not documented, or is not one of this machine.
pub fn table(model: &IdentifiedModel, word: &str) -> Result<KinematicTable, IdentifyError> {
    if let Some((_, why)) = NOT_DOCUMENTED.iter().find(|(own, _)| *own == word) {
        return Err(IdentifyError::Request(format!("no table for `{word}`: {why}; no sign is guessed")));
    }
    let Some(control) = KINEMATICS.iter().find(|control| control.word == word) else {
        let words: Vec<&str> = KINEMATICS.iter().map(|control| control.word).collect();
        return Err(IdentifyError::Request(format!("no control `{word}`; known are {}", words.join(", "))));
    };
    let (first, second) = tilting_table(&model.machine).ok_or_else(|| {
        IdentifyError::Request(format!(
            "{} describes two rotary axes under the workpiece, a tilting A (along X) or B (along Y) with C (along Z) on it; this \
             machine is `{}`",
            control.about,
            model.machine.code()
        ))
    })?;
    let axes = [first, second].map(|axis| model.machine.axes[axis].name.clone());
    let letter = if model.machine.axes[first].direction[0].abs() == 1.0 { 'A' } else { 'B' };
    let name = |axis: usize, freedom: Freedom| {
        ErrorName { kind: ErrorKind::Location, freedom, axis: axes[axis].clone() }.to_string()
    };
    let index = |axis: usize, freedom: Freedom| {
        let own = |id: &str| model.parameters.iter().position(|p| p.role == Role::Error && p.id == id);
        own(&name(axis, freedom)).filter(|index| model.is_estimated(*index))
    };
    let mut used: Vec<usize> = Vec::new();
    let mut parameters = Vec::new();
    let mut left_out: Vec<String> = Vec::new();
    for entry in (control.entries)(letter) {
        let terms: Vec<(f64, usize)> =
            entry.terms.iter().filter_map(|(share, axis, freedom)| Some((*share, index(*axis, *freedom)?))).collect();
        if terms.is_empty() && !entry.terms.is_empty() {
            let names: Vec<String> = entry.terms.iter().map(|(_, axis, freedom)| name(*axis, *freedom)).collect();
            let names = names.join(" or ");
            left_out.push(format!("{}: {}: the readings do not determine {names}", entry.field, entry.meaning));
            continue;
        }
        used.extend(terms.iter().map(|(_, parameter)| *parameter));
        let variance: f64 =
            terms.iter().map(|(a, i)| terms.iter().map(|(b, j)| a * b * model.covariance[(*i, *j)]).sum::<f64>()).sum();
        parameters.push(KinematicParameter {
            field: entry.field.to_string(),
            meaning: entry.meaning.to_string(),
            change_mm: terms.iter().fold(0.0, |sum, (share, i)| sum + share * model.parameters[*i].value),
            u_mm: variance.max(0.0).sqrt(),
        });
    }
    if used.is_empty() {
        return Err(IdentifyError::Request(format!(
            "{} has no entry for an error that the readings of the model determine",
            control.about
        )));
    }
    let errors = model.parameters.iter().enumerate().filter(|(_, parameter)| parameter.role == Role::Error);
    left_out.extend(
        errors
            .filter(|(index, _)| !used.contains(index) && model.is_estimated(*index))
            .map(|(_, parameter)| format!("{}: the control's model has no entry for it", parameter.id)),
    );
    let effects = model.effects.iter().map(|effect| format!("{}: not a fixed geometry", effect.id()));
    left_out.extend(effects);
    Ok(KinematicTable { control: control.about.to_string(), source: control.source.to_string(), parameters, left_out })
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
