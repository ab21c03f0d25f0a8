//! Errors of a machine as functions of its axes: constants, tables, polynomials, harmonics.

use std::collections::BTreeMap;
use std::path::Path;

use abbe_files::Source;
use abbe_files::read::lowered;
use abbe_identify::quantity::Given;
use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::{ERRORS_PER_AXIS, Machine};
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::document::fault::{Fault, Within};
use abbe_model::document::value::{Long, Positive};
use abbe_model::unit::Unit;
use schemars::JsonSchema;
use serde::Deserialize;

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

/// Periods of a harmonic, mm or rad. Beyond them its argument is no number, or constant.
const PERIODS: std::ops::RangeInclusive<f64> = 1e-6..=1e9;

/// A file of error functions. Several functions of one error are summed.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Constant errors with their units, such as EX0C = "12 um".
    #[serde(default)]
    constant: Long<BTreeMap<String, String>>,
    /// Functions of the position of an axis.
    #[serde(default)]
    function: Long<Vec<Function>>,
}

/// A function of the position of an axis: a table, a polynomial or a harmonic.
#[derive(Deserialize, JsonSchema)]
#[serde(rename = "error_function", deny_unknown_fields)]
struct Function {
    /// The error, such as EXX.
    error: String,
    /// The axis of the position; default: the own axis of an error motion.
    over: Option<String>,
    /// Linear interpolation, constant beyond the ends.
    table: Option<Table>,
    /// The sum of coefficients times powers of position over scale, from power 0.
    polynomial: Option<Polynomial>,
    /// An amplitude times the cosine of the position.
    harmonic: Option<Harmonic>,
}

/// Values at positions.
#[derive(Deserialize, JsonSchema)]
#[serde(rename = "table", deny_unknown_fields)]
struct Table {
    /// Ascending positions of a linear axis.
    at_mm: Option<Long<Vec<f64>>>,
    /// Ascending positions of a rotary axis.
    at_deg: Option<Long<Vec<f64>>>,
    /// The values of an error of length.
    um: Option<Long<Vec<f64>>>,
    /// The values of an angular error.
    arcsec: Option<Long<Vec<f64>>>,
}

/// A polynomial in position over scale.
#[derive(Deserialize, JsonSchema)]
#[serde(rename = "polynomial", deny_unknown_fields)]
struct Polynomial {
    /// The scale of a linear axis; default 1 mm.
    scale_mm: Option<Positive>,
    /// The scale of a rotary axis; default 1 rad.
    scale_deg: Option<Positive>,
    /// The coefficients of an error of length, from power 0.
    um: Option<Vec<f64>>,
    /// The coefficients of an angular error, from power 0.
    arcsec: Option<Vec<f64>>,
}

/// A harmonic of the position.
#[derive(Deserialize, JsonSchema)]
#[serde(rename = "harmonic", deny_unknown_fields)]
struct Harmonic {
    /// Cycles per turn of a rotary axis.
    order: Option<Positive>,
    /// The period over a linear axis.
    period_mm: Option<Positive>,
    /// The period over a rotary axis.
    period_deg: Option<Positive>,
    /// The amplitude of an error of length.
    amplitude_um: Option<f64>,
    /// The amplitude of an angular error.
    amplitude_arcsec: Option<f64>,
    /// The phase at position 0; default 0.
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
/// If the file cannot be read, is not of this form, holds a number beyond the limits of input, or names something that
/// the machine lacks. The message names the file and the line.
pub fn read(path: &Path, machine: &Machine) -> Result<Vec<ErrorFunction>, Diagnostic> {
    of_source(&abbe_files::text(path, "the file of error functions")?, machine)
}

/// As [`read`], from a file that has been read.
///
/// # Errors
/// As [`read`].
pub fn of_source(source: &Source, machine: &Machine) -> Result<Vec<ErrorFunction>, Diagnostic> {
    lowered(source, |file: &File| {
        let mut functions = Vec::new();
        for (id, quantity) in &file.constant.0 {
            let constant = constant(machine, id, quantity).map_err(|fault| fault.on_key().at(id));
            functions.push(constant.within("constant")?);
        }
        for (item, entry) in file.function.0.iter().enumerate() {
            functions.push(function(machine, entry).within_item(item).within("function")?);
        }
        Ok(functions)
    })
}

fn constant(machine: &Machine, id: &str, quantity: &str) -> Result<ErrorFunction, Fault> {
    let (slot, over, angle) = error_slot_of(machine, id)?;
    let unit = if angle { Unit::Arcsecond } else { Unit::Micrometre };
    let inside = Given::of(id, quantity).and_then(|given| given.inside(&unit.into()));
    let form = Form::Constant(inside.map_err(|fault| Fault::new(fault.to_string(), None))?);
    Ok(ErrorFunction { slot, over, form })
}

fn function(machine: &Machine, entry: &Function) -> Result<ErrorFunction, Fault> {
    let (slot, own, angle) = error_slot_of(machine, &entry.error).within("error")?;
    let over = match &entry.over {
        None => own,
        Some(name) => machine.axis_index(name).ok_or_else(|| no_axis(machine, name)).within("over")?,
    };
    let kind = machine.axes[over].kind;
    let form = match (&entry.table, &entry.polynomial, &entry.harmonic) {
        (Some(table), None, None) => self::table(kind, angle, table).within("table")?,
        (None, Some(Polynomial { scale_mm, scale_deg, um, arcsec }), None) => {
            let scale = of_axis(kind, "scale", scale_mm, scale_deg).within("polynomial")?;
            let scale = scale.map_or(1.0, |scale| kind.to_internal(scale.0));
            Form::Polynomial {
                scale,
                coefficients: values(angle, um.as_deref(), arcsec.as_deref()).within("polynomial")?,
            }
        }
        (None, None, Some(harmonic)) => self::harmonic(kind, angle, harmonic).within("harmonic")?,
        _ => {
            let error = &entry.error;
            let help = "such as `harmonic = { order = 2, amplitude_um = 1.5 }`";
            return Err(Fault::new(
                format!("`{error}`: give exactly one of `table`, `polynomial` and `harmonic`"),
                help,
            ));
        }
    };
    Ok(ErrorFunction { slot, over, form })
}

fn table(kind: AxisKind, angle: bool, table: &Table) -> Result<Form, Fault> {
    let [um, arcsec] = [&table.um, &table.arcsec].map(|list| list.as_ref().map(|Long(list)| list.as_slice()));
    let values = values(angle, um, arcsec)?;
    let Long(at) = of_axis(kind, "at", &table.at_mm, &table.at_deg)?.ok_or_else(|| {
        let key = format!("at_{}", kind.unit());
        Fault::missing(&key, "the positions of the values")
    })?;
    if at.len() != values.len() || at.len() < 2 {
        let what = format!("{} positions and {} values", at.len(), values.len());
        return Err(Fault::new(what, "a table needs the same number of both, at least two"));
    }
    if at.windows(2).any(|pair| pair[1] <= pair[0]) {
        return Err(Fault::new("the positions of a table must ascend", None));
    }
    Ok(Form::Table { at: at.iter().map(|place| kind.to_internal(*place)).collect(), values })
}

fn harmonic(kind: AxisKind, angle: bool, harmonic: &Harmonic) -> Result<Form, Fault> {
    let period = of_axis(kind, "period", &harmonic.period_mm, &harmonic.period_deg)?;
    let period = match (period, harmonic.order, kind) {
        (Some(period), None, _) => kind.to_internal(period.0),
        (None, Some(order), AxisKind::Rotary) => std::f64::consts::TAU / order.0,
        _ => {
            let message = "a harmonic needs either a `period_…` or, over a rotary axis, an `order` (cycles per turn)";
            return Err(Fault::new(message, None));
        }
    };
    if !PERIODS.contains(&period) {
        let [least, most] = [PERIODS.start(), PERIODS.end()].map(|period| kind.to_display(*period));
        let message = format!("a period from {least:.1e} to {most:.1e} {} is expected", kind.unit());
        return Err(Fault::new(message, None));
    }
    let [um, arcsec] = [harmonic.amplitude_um, harmonic.amplitude_arcsec].map(|value| value.map(|value| [value]));
    let amplitude = values(angle, um.as_ref().map(<[f64; 1]>::as_slice), arcsec.as_ref().map(<[f64; 1]>::as_slice))?[0];
    Ok(Form::Harmonic { period, amplitude, phase: harmonic.phase_deg.to_radians() })
}

/// Slot and axis of an error, and whether it is an angle.
fn error_slot_of(machine: &Machine, id: &str) -> Result<(usize, usize, bool), Fault> {
    let Some(name) = ErrorName::parse(id) else {
        return Err(Fault::new(format!("`{id}` is not the name of an error"), "use ISO 230-1 names such as EXX, EB0A"));
    };
    let slot = machine.error_slot(&name).ok_or_else(|| no_axis(machine, &name.axis))?;
    let axis = slot / ERRORS_PER_AXIS;
    let angle = name.freedom.is_angle();
    if machine.axes[axis].kind == AxisKind::Linear && name.kind == ErrorKind::Location && !angle {
        let message = format!("`{id}`: a linear axis has squareness errors (angles) but no position errors");
        return Err(Fault::new(message, None));
    }
    Ok((slot, axis, angle))
}

fn no_axis(machine: &Machine, name: &str) -> Fault {
    let axes: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
    Fault::new(format!("the machine has no axis `{name}`"), format!("its axes are {}", axes.join(", ")))
}

/// What is stated in the unit of an axis, in mm or degrees.
fn of_axis<'v, T>(kind: AxisKind, stem: &str, mm: &'v Option<T>, deg: &'v Option<T>) -> Result<Option<&'v T>, Fault> {
    let ((right, unit), (wrong, other)) = match kind {
        AxisKind::Linear => ((mm, "mm"), (deg, "deg")),
        AxisKind::Rotary => ((deg, "deg"), (mm, "mm")),
    };
    match wrong {
        None => Ok(right.as_ref()),
        Some(_) => {
            let message = format!("`{stem}_{unit}` is expected for this axis");
            Err(Fault::new(message, None).on_key().at(&format!("{stem}_{other}")))
        }
    }
}

/// Values of an error, mm or rad.
fn values(angle: bool, um: Option<&[f64]>, arcsec: Option<&[f64]>) -> Result<Vec<f64>, Fault> {
    let (right, wrong, unit) = if angle { (arcsec, um, Unit::Arcsecond) } else { (um, arcsec, Unit::Micrometre) };
    match (right, wrong) {
        (Some(values), None) if !values.is_empty() => Ok(values.iter().map(|value| unit.to_internal(*value)).collect()),
        _ => Err(Fault::new(format!("the values of this error must be in `{unit}`"), None)),
    }
}
