//! Errors of a machine as functions of its axes: constants, tables, polynomials, harmonics.

use std::path::Path;

use abbe_model::axis::AxisKind;
use abbe_model::chain::{ERRORS_PER_AXIS, Machine};
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::files::{self, Source};
use abbe_model::session::limits;
use serde::Deserialize;
use std::collections::BTreeMap;

use crate::error::IdentifyError;
use crate::quantity::Given;
use crate::unit::{ARCSEC, Unit};

/// The form of an error function; values in mm or rad.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// Constant.
    Constant(f64),
    /// Linear interpolation between given positions (ascending), constant beyond them.
    Table {
        /// mm or rad.
        at: Vec<f64>,
        /// mm or rad.
        values: Vec<f64>,
    },
    /// `Σ c_k (q/scale)^k`.
    Polynomial {
        /// mm or rad.
        scale: f64,
        /// From `c_0`.
        coefficients: Vec<f64>,
    },
    /// `amplitude · cos(2π q/period + phase)`.
    Harmonic {
        /// mm or rad.
        period: f64,
        /// mm or rad.
        amplitude: f64,
        /// rad.
        phase: f64,
    },
}

impl Form {
    /// The value at a position of the axis.
    pub fn at(&self, q: f64) -> f64 {
        match self {
            Form::Constant(value) => *value,
            Form::Table { at, values } => {
                let above = at.partition_point(|place| *place < q);
                match above {
                    0 => values[0],
                    k if k == at.len() => values[k - 1],
                    k => {
                        let share = (q - at[k - 1]) / (at[k] - at[k - 1]);
                        values[k - 1] + share * (values[k] - values[k - 1])
                    }
                }
            }
            Form::Polynomial { scale, coefficients } => {
                let x = q / scale;
                coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
            }
            Form::Harmonic { period, amplitude, phase } => {
                amplitude * (std::f64::consts::TAU * q / period + phase).cos()
            }
        }
    }
}

/// One error as a function of one axis' position.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorFunction {
    /// The error's slot in the machine.
    pub slot: usize,
    /// The axis of the position, by index.
    pub over: usize,
    /// The form.
    pub form: Form,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    constant: BTreeMap<String, String>,
    #[serde(default)]
    function: Vec<FunctionEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FunctionEntry {
    error: String,
    over: Option<String>,
    table: Option<TableEntry>,
    polynomial: Option<PolynomialEntry>,
    harmonic: Option<HarmonicEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TableEntry {
    at_mm: Option<Vec<f64>>,
    at_deg: Option<Vec<f64>>,
    um: Option<Vec<f64>>,
    arcsec: Option<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PolynomialEntry {
    scale_mm: Option<f64>,
    scale_deg: Option<f64>,
    um: Option<Vec<f64>>,
    arcsec: Option<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HarmonicEntry {
    order: Option<f64>,
    period_mm: Option<f64>,
    period_deg: Option<f64>,
    amplitude_um: Option<f64>,
    amplitude_arcsec: Option<f64>,
    #[serde(default)]
    phase_deg: f64,
}

/// Reads a file of error functions:
///
/// ```toml
/// [constant]                 # location errors and squarenesses
/// EX0C = "1.3 um"
/// EC0Y = "-4 arcsec"
///
/// [[function]]
/// error = "EXX"              # follows its own axis unless `over` names another
/// table = { at_mm = [-300, 0, 300], um = [0, 3, 8] }
///
/// [[function]]
/// error = "EZC"
/// harmonic = { order = 2, amplitude_um = 1.5, phase_deg = 60 }
///
/// [[function]]
/// error = "EBY"
/// polynomial = { scale_mm = 250, arcsec = [0.5, 2.0, -1.0] }
/// ```
///
/// Several functions of one error are summed.
///
/// # Errors
/// If the file cannot be read, is not of this form, holds a number beyond [`limits::LARGEST`], or names something that
/// the machine lacks. The message names the file and the entry.
pub fn read(path: &Path, machine: &Machine) -> Result<Vec<ErrorFunction>, IdentifyError> {
    of_source(&files::text(path, "the file of error functions")?, machine)
}

/// As [`read`], from a file that has been read.
///
/// # Errors
/// As [`read`].
pub fn of_source(source: &Source, machine: &Machine) -> Result<Vec<ErrorFunction>, IdentifyError> {
    let fault = |message: String| IdentifyError::Request(format!("{}: {message}", source.file.display()));
    functions(&files::read::document_of(source)?, machine).map_err(fault)
}

/// The functions of a file; the error is a message.
fn functions(file: &File, machine: &Machine) -> Result<Vec<ErrorFunction>, String> {
    let mut functions = Vec::new();
    for (id, quantity) in &file.constant {
        let (slot, over, angle) = error_slot_of(machine, id)?;
        let unit = Unit::of(if angle {
            abbe_model::instrument::InternalUnit::Radian
        } else {
            abbe_model::instrument::InternalUnit::Millimetre
        });
        let given = Given::of(id, quantity).map_err(|fault| fault.to_string())?;
        functions.push(ErrorFunction {
            slot,
            over,
            form: Form::Constant(given.inside(&unit).map_err(|fault| fault.to_string())?),
        });
    }
    for (number, entry) in file.function.iter().enumerate() {
        let label = format!("[[function]] {} (`{}`)", number + 1, entry.error);
        functions.push(function(machine, entry).map_err(|message| format!("{label}: {message}"))?);
    }
    Ok(functions)
}

fn function(machine: &Machine, entry: &FunctionEntry) -> Result<ErrorFunction, String> {
    let (slot, own, angle) = error_slot_of(machine, &entry.error)?;
    let over = match &entry.over {
        None => own,
        Some(name) => machine.axis_index(name).ok_or_else(|| no_axis(machine, name))?,
    };
    let kind = machine.axes[over].kind;
    let form = match (&entry.table, &entry.polynomial, &entry.harmonic) {
        (Some(table), None, None) => {
            let at = position(kind, table.at_mm.clone(), table.at_deg.clone(), "at")?
                .ok_or_else(|| format!("a table needs positions: `at_{}`", unit_suffix(kind)))?;
            let values = values(angle, table.um.clone(), table.arcsec.clone())?;
            if at.len() != values.len() || at.len() < 2 {
                return Err(format!(
                    "{} positions and {} values; a table needs the same number of both, at least two",
                    at.len(),
                    values.len()
                ));
            }
            if at.windows(2).any(|pair| pair[1] <= pair[0]) {
                return Err("the positions of a table must ascend".into());
            }
            Form::Table { at, values }
        }
        (None, Some(polynomial), None) => {
            let single = |value: Option<f64>| value.map(|value| vec![value]);
            let scale = position(kind, single(polynomial.scale_mm), single(polynomial.scale_deg), "scale")?
                .map_or(1.0, |scale| scale[0]);
            if scale <= 0.0 {
                return Err("the scale of a polynomial must be above 0".into());
            }
            let coefficients = values(angle, polynomial.um.clone(), polynomial.arcsec.clone())?;
            Form::Polynomial { scale, coefficients }
        }
        (None, None, Some(harmonic)) => {
            let single = |value: Option<f64>| value.map(|value| vec![value]);
            let period = position(kind, single(harmonic.period_mm), single(harmonic.period_deg), "period")?;
            check_finite(harmonic.order.as_slice())?;
            let period = match (period, harmonic.order, kind) {
                (Some(period), None, _) => period[0],
                (None, Some(order), AxisKind::Rotary) => std::f64::consts::TAU / order,
                _ => {
                    return Err(
                        "a harmonic needs either a `period_…` or, over a rotary axis, an `order` (cycles per turn)"
                            .into(),
                    );
                }
            };
            if period.is_nan() || period <= 0.0 || period.is_infinite() {
                return Err("the period of a harmonic must be a length or an angle above 0".into());
            }
            let amplitude = values(angle, single(harmonic.amplitude_um), single(harmonic.amplitude_arcsec))?;
            check_finite(&[harmonic.phase_deg])?;
            Form::Harmonic { period, amplitude: amplitude[0], phase: harmonic.phase_deg.to_radians() }
        }
        _ => return Err("give exactly one of `table`, `polynomial` and `harmonic`".into()),
    };
    Ok(ErrorFunction { slot, over, form })
}

/// Slot and axis of an error, and whether it is an angle.
fn error_slot_of(machine: &Machine, id: &str) -> Result<(usize, usize, bool), String> {
    let Some(name) = ErrorName::parse(id) else {
        return Err(format!("`{id}` is not the name of an error; use ISO 230-1 names such as EXX, EB0A"));
    };
    let Some(slot) = machine.error_slot(&name) else {
        return Err(no_axis(machine, &name.axis));
    };
    let axis = slot / ERRORS_PER_AXIS;
    let angle = name.freedom.is_angle();
    if machine.axes[axis].kind == AxisKind::Linear && name.kind == ErrorKind::Location && !angle {
        return Err(format!("`{id}`: a linear axis has squareness errors (angles) but no position errors"));
    }
    Ok((slot, axis, angle))
}

fn no_axis(machine: &Machine, name: &str) -> String {
    let axes: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
    format!("the machine has no axis `{name}`; its axes are {}", axes.join(", "))
}

fn unit_suffix(kind: AxisKind) -> &'static str {
    match kind {
        AxisKind::Linear => "mm",
        AxisKind::Rotary => "deg",
    }
}

fn position(
    kind: AxisKind,
    mm: Option<Vec<f64>>,
    deg: Option<Vec<f64>>,
    id_stem: &str,
) -> Result<Option<Vec<f64>>, String> {
    let (right, wrong) = match kind {
        AxisKind::Linear => (mm, deg),
        AxisKind::Rotary => (deg.map(|list| list.into_iter().map(f64::to_radians).collect()), mm),
    };
    if wrong.is_some() {
        return Err(format!("`{id_stem}_{}` is expected for this axis", unit_suffix(kind)));
    }
    check_finite(right.as_deref().unwrap_or_default())?;
    Ok(right)
}

fn values(angle: bool, um: Option<Vec<f64>>, arcsec: Option<Vec<f64>>) -> Result<Vec<f64>, String> {
    let (right, wrong, display_per_internal, word) =
        if angle { (arcsec, um, ARCSEC, "arcsec") } else { (um, arcsec, 1e3, "um") };
    let values = match (right, wrong) {
        (Some(values), None) if !values.is_empty() => values,
        _ => return Err(format!("the values of this error must be in `{word}`")),
    };
    check_finite(&values)?;
    Ok(values.into_iter().map(|value| value / display_per_internal).collect())
}

/// Checks that numbers are finite and within the limits of all files.
fn check_finite(values: &[f64]) -> Result<(), String> {
    for value in values {
        if !value.is_finite() {
            return Err(format!("`{value}` is not a finite number"));
        }
        if let Some(fault) = limits::too_large(*value) {
            return Err(fault);
        }
    }
    Ok(())
}
