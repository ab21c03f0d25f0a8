//! Reader of the shape of an effect and its parameters.
//!
//! Numbers in the unit of the driver have a suffix: `_mm` for a linear axis, `_deg` (or `_rad`) for a rotary one, `_s` for time, `_c` for
//! temperature, `_m` for the gravity moment of a unit weight.

use std::f64::consts::TAU;

use super::Context;
use crate::axis::AxisKind;
use crate::effect::{Driver, Shape};
use crate::error::ModelError;
use crate::files::spelling::known_names;
use crate::files::toml::document::{Table, Value};

/// Default number of intervals of a curve.
const CURVE_INTERVALS: usize = 12;

/// The identifiers of shapes.
const SHAPES: [&str; 13] = [
    "constant",
    "polynomial",
    "power",
    "harmonic",
    "periodic",
    "curve",
    "backlash",
    "lag",
    "reversal-spike",
    "drift",
    "warmup",
    "steps",
    "local",
];

/// The unit of a driver's numbers in files.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum DriverUnit {
    Millimetre,
    Angle,
    Second,
    Celsius,
    Metre,
}

impl DriverUnit {
    /// The unit of this driver.
    pub fn of(context: &Context<'_>, driver: &Driver) -> DriverUnit {
        match driver {
            Driver::Axis(name) => match context
                .machine
                .axis_index(name)
                .map(|i| context.machine.axes[i].kind)
            {
                Some(AxisKind::Rotary) => DriverUnit::Angle,
                _ => DriverUnit::Millimetre,
            },
            Driver::Time => DriverUnit::Second,
            Driver::Temperature => DriverUnit::Celsius,
            Driver::Gravity | Driver::None => DriverUnit::Metre,
        }
    }

    /// The recommended suffix.
    fn suffix(self) -> &'static str {
        match self {
            DriverUnit::Millimetre => "mm",
            DriverUnit::Angle => "deg",
            DriverUnit::Second => "s",
            DriverUnit::Celsius => "c",
            DriverUnit::Metre => "m",
        }
    }

    /// The meaning of a suffix for this driver: `Some(true)` degrees, `Some(false)` the internal unit, `None` the unit of another driver.
    fn degrees(self, suffix: &str) -> Option<bool> {
        match (self, suffix) {
            (DriverUnit::Angle, "deg") => Some(true),
            (DriverUnit::Angle, "rad") => Some(false),
            (unit, suffix) if unit.suffix() == suffix => Some(false),
            _ => None,
        }
    }
}

/// A key with the suffixes of every unit.
type Suffixed = [&'static str; 6];
const PERIOD: Suffixed = [
    "period_mm",
    "period_deg",
    "period_rad",
    "period_s",
    "period_c",
    "period_m",
];
const CENTRE: Suffixed = [
    "centre_mm",
    "centre_deg",
    "centre_rad",
    "centre_s",
    "centre_c",
    "centre_m",
];
const WIDTH: Suffixed = [
    "width_mm",
    "width_deg",
    "width_rad",
    "width_s",
    "width_c",
    "width_m",
];
const FROM: Suffixed = ["from_mm", "from_deg", "from_rad", "from_s", "from_c", "from_m"];
const TO: Suffixed = ["to_mm", "to_deg", "to_rad", "to_s", "to_c", "to_m"];
const AT: Suffixed = ["at_mm", "at_deg", "at_rad", "at_s", "at_c", "at_m"];
const SCALE: Suffixed = [
    "scale_mm",
    "scale_deg",
    "scale_rad",
    "scale_s",
    "scale_c",
    "scale_m",
];

/// Takes the form of a key that is present; also returns whether it is in degrees.
fn suffixed<'a>(
    table: &mut Table<'a>,
    keys: Suffixed,
    unit: DriverUnit,
) -> Result<Option<(Value<'a>, bool)>, ModelError> {
    let mut found = None;
    for key in keys {
        let Some(value) = table.take(key) else { continue };
        let suffix = key.rsplit('_').next().unwrap_or("");
        let Some(degrees) = unit.degrees(suffix) else {
            let stem = key.trim_end_matches(suffix);
            let message = format!("`{key}` for a driver in {}", unit.suffix());
            let help = format!("use `{stem}{}`", unit.suffix());
            return Err(value.source.error(value.key_span.clone(), message, Some(help)));
        };
        if found.is_some() {
            return Err(value.error(format!("`{key}` is given twice, in two units"), None));
        }
        found = Some((value, degrees));
    }
    Ok(found)
}

fn converted(value: &Value<'_>, degrees: bool) -> Result<f64, ModelError> {
    let number = value.number()?;
    Ok(if degrees { number.to_radians() } else { number })
}

fn optional(table: &mut Table<'_>, keys: Suffixed, unit: DriverUnit) -> Result<Option<f64>, ModelError> {
    match suffixed(table, keys, unit)? {
        Some((value, degrees)) => Ok(Some(converted(&value, degrees)?)),
        None => Ok(None),
    }
}

fn required(
    table: &mut Table<'_>,
    word: &Value<'_>,
    keys: Suffixed,
    unit: DriverUnit,
    shape: &str,
) -> Result<f64, ModelError> {
    let suffix = unit.suffix();
    let stem = keys[0].trim_end_matches("mm");
    optional(table, keys, unit)?.ok_or_else(|| {
        let message = format!("the shape \"{shape}\" needs `{stem}{suffix}`");
        word.error(message, Some(format!("add `{stem}{suffix} = …`")))
    })
}

fn order<'a>(table: &mut Table<'a>, value: &Value<'_>, word: &str) -> Result<Value<'a>, ModelError> {
    table.take("order").ok_or_else(|| {
        let message = format!("the shape \"{word}\" needs `order`");
        value.error(message, Some("add `order = 1`".into()))
    })
}

/// Reads the shape `word` from the other keys of its table; `default_scale` applies to a polynomial without a stated scale.
pub(super) fn shape(
    table: &mut Table<'_>,
    value: &Value<'_>,
    word: &str,
    unit: DriverUnit,
    default_scale: f64,
) -> Result<Shape, ModelError> {
    match word {
        "constant" => Ok(Shape::Constant),
        "polynomial" | "power" => {
            let degree = order(table, value, word)?.count(1, 30)?;
            let scale = optional(table, SCALE, unit)?.unwrap_or(default_scale);
            Ok(if word == "power" {
                Shape::Power { degree, scale }
            } else {
                Shape::Polynomial { degree, scale }
            })
        }
        "harmonic" => Ok(Shape::Harmonic {
            order: order(table, value, word)?.positive()?,
        }),
        "periodic" => Ok(Shape::Periodic {
            period: required(table, value, PERIOD, unit, word)?,
        }),
        "curve" => curve(table, value, word, unit),
        "backlash" => Ok(Shape::Backlash),
        "lag" => Ok(Shape::Lag),
        "reversal-spike" => Ok(Shape::ReversalSpike {
            width: required(table, value, WIDTH, unit, word)?,
        }),
        "drift" => Ok(Shape::Drift),
        "warmup" => {
            let tau = table.take("tau_s").ok_or_else(|| {
                let help = "add `tau_s`, the time constant in seconds";
                value.error("the shape \"warmup\" needs `tau_s`", Some(help.into()))
            })?;
            Ok(Shape::Warmup {
                tau_s: tau.positive()?,
            })
        }
        "steps" => {
            let Some((list, degrees)) = suffixed(table, AT, unit)? else {
                let message = format!("the shape \"steps\" needs `at_{}`", unit.suffix());
                return Err(value.error(message, Some(format!("add `at_{} = [ … ]`", unit.suffix()))));
            };
            let items = list.list("a list of positions")?;
            let at = items
                .iter()
                .map(|item| converted(item, degrees))
                .collect::<Result<_, _>>()?;
            Ok(Shape::Steps { at })
        }
        "local" => {
            let centre = required(table, value, CENTRE, unit, word)?;
            let width = required(table, value, WIDTH, unit, word)?;
            let recurs = match table.take("recurs") {
                Some(recurs) => recurs.boolean()?,
                None => true,
            };
            Ok(Shape::Local {
                centre,
                width,
                recurs: (recurs && unit == DriverUnit::Angle).then_some(TAU),
            })
        }
        other => {
            let message = format!("\"{other}\" is not a shape");
            Err(value.error(message, Some(known_names(other, &SHAPES))))
        }
    }
}

/// Reads a curve. By default it covers the full revolution of a rotary axis and is closed; for other drivers its ends are required.
fn curve(
    table: &mut Table<'_>,
    value: &Value<'_>,
    word: &str,
    unit: DriverUnit,
) -> Result<Shape, ModelError> {
    let stated = table.take("closed");
    let mut closed = match &stated {
        Some(closed) => closed.boolean()?,
        None => unit == DriverUnit::Angle,
    };
    let (from, to) = if unit == DriverUnit::Angle {
        let from = optional(table, FROM, unit)?;
        let to = optional(table, TO, unit)?;
        // A curve with stated ends is open unless it is declared closed.
        closed &= stated.is_some() || (from.is_none() && to.is_none());
        let from = from.unwrap_or(0.0);
        (from, to.unwrap_or(from + TAU))
    } else {
        (
            required(table, value, FROM, unit, word)?,
            required(table, value, TO, unit, word)?,
        )
    };
    let intervals = match table.take("intervals") {
        Some(intervals) => intervals.count(1, 500)?,
        None => CURVE_INTERVALS,
    };
    Ok(Shape::Curve {
        from,
        to,
        intervals,
        closed,
    })
}
