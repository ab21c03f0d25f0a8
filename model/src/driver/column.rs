//! A column of the data that is no axis: a spindle temperature, a payload, a motor torque. Its word is `NAME_unit`.
//!
//! The data have it as `driver.NAME_unit`. The unit determines from where the values count and by what powers divide
//! them. An effect may follow the column through a first-order lag: see [`super::Reference`]. The ambient temperature
//! has the column `temperature_c` and the word `temperature`.

use std::borrow::Cow;

use super::Driver;
use super::kind::{DriverInput, DriverKind, Entry, Recorded, SymbolInput, Symbols};
use super::quantity::DriverQuantity;
use super::sample::{DriverPart, DriverSample};
use super::unit::DriverUnit;
use crate::axis::AxisKind;
use crate::scalar::Nominal;
use crate::session::readings::Readings;
use crate::unit::Unit;

/// The values of a column, `NAME_unit`.
pub(super) struct Column<'a>(pub &'a str);

/// The column of the ambient temperature.
pub const TEMPERATURE: &str = "temperature_c";
/// The prefix of driver columns in data files and in `[columns]`.
pub const PREFIX: &str = "driver.";

/// A unit of driver columns.
struct ColumnUnit {
    unit: Unit,
    /// The divisor of powers if a session states none.
    scale: f64,
    /// Whether values count from the mean of the session, because the zero of the unit is a convention.
    from_mean: bool,
    /// The letter in printed equations.
    letter: char,
}

const fn unit(unit: Unit, scale: f64, from_mean: bool, letter: char) -> ColumnUnit {
    ColumnUnit { unit, scale, from_mean, letter }
}

/// The units that the name of a column can end with.
const UNITS: [ColumnUnit; 19] = [
    unit(Unit::Celsius, 1.0, true, 'T'),
    unit(Unit::Kelvin, 1.0, true, 'T'),
    unit(Unit::Percent, 1.0, true, 'q'),
    unit(Unit::Hectopascal, 1.0, true, 'p'),
    unit(Unit::Kilopascal, 1.0, false, 'p'),
    unit(Unit::Megapascal, 1.0, false, 'p'),
    unit(Unit::Bar, 1.0, false, 'p'),
    unit(Unit::Kilogram, 1.0, false, 'm'),
    unit(Unit::Newton, 1.0, false, 'F'),
    unit(Unit::NewtonMetre, 1.0, false, 'M'),
    unit(Unit::PerMinute, 1000.0, false, 'n'),
    unit(Unit::Hertz, 1.0, false, 'f'),
    unit(Unit::Ampere, 1.0, false, 'I'),
    unit(Unit::Volt, 1.0, false, 'U'),
    unit(Unit::Watt, 1000.0, false, 'P'),
    unit(Unit::Kilowatt, 1.0, false, 'P'),
    unit(Unit::Millimetre, 1.0, false, 'q'),
    unit(Unit::Micrometre, 1.0, false, 'q'),
    unit(Unit::Degree, 1.0, false, 'q'),
];

const DRIVER_UNITS: [DriverUnit; UNITS.len()] = {
    let mut units = [DriverUnit::plain(UNITS[0].unit); UNITS.len()];
    let mut k = 0;
    while k < units.len() {
        units[k] = DriverUnit::plain(UNITS[k].unit);
        k += 1;
    }
    units
};

pub(super) const ENTRY: Entry =
    Entry { word: Some("temperature"), driver: |_| Driver::Column(TEMPERATURE.to_string()), units: &DRIVER_UNITS };

/// The quantity and the unit of `NAME_unit`; `None` if it is no name of a column.
fn parts(name: &str) -> Option<(&str, &'static ColumnUnit)> {
    let (quantity, suffix) = name.rsplit_once('_')?;
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let valid = quantity.starts_with(|c: char| c.is_ascii_alphabetic()) && quantity.chars().all(plain);
    let unit = UNITS.iter().find(|known| known.unit.key() == suffix).filter(|_| valid)?;
    Some((quantity, unit))
}

/// Whether a text is the name of a column, `NAME_unit`.
pub(crate) fn is_name(text: &str) -> bool {
    parts(text).is_some()
}

/// The name of a column without its unit.
pub fn quantity(name: &str) -> &str {
    parts(name).map_or(name, |(quantity, _)| quantity)
}

/// The name in data files: `temperature_c`, `driver.NAME_unit`.
pub fn in_files(name: &str) -> Cow<'static, str> {
    if name == TEMPERATURE { Cow::Borrowed(TEMPERATURE) } else { Cow::Owned(format!("{PREFIX}{name}")) }
}

/// The column with this name in data files; `None` if it is no driver column.
pub fn of_files(name: &str) -> Option<&str> {
    let own = if name == TEMPERATURE { name } else { name.strip_prefix(PREFIX)? };
    is_name(own).then_some(own)
}

/// What to do about a driver column whose name is invalid.
pub fn help_on_name() -> String {
    let suffixes: Vec<String> = UNITS.iter().map(|known| format!("_{}", known.unit.key())).collect();
    format!(
        "a driver column is `{PREFIX}NAME_unit`, such as `{PREFIX}spindle_temperature_c`; NAME has ASCII letters, digits \
         and `_`; units are {}",
        suffixes.join(", ")
    )
}

impl Column<'_> {
    fn unit_of_name(&self) -> &'static ColumnUnit {
        parts(self.0).map_or(&UNITS[0], |(_, unit)| unit)
    }

    fn words(&self) -> String {
        quantity(self.0).replace('_', " ")
    }
}

/// Whether the values of a column count from the mean of the session.
pub(super) fn counts_from_mean(name: &str) -> bool {
    Column(name).unit_of_name().from_mean
}

impl DriverKind for Column<'_> {
    fn unit(&self, _: Option<AxisKind>) -> DriverUnit {
        DriverUnit::plain(self.unit_of_name().unit)
    }
    fn samples(&self, input: &DriverInput<'_>) -> Option<Vec<DriverSample<f64>>> {
        let values = match input.lag_s {
            None => Cow::Borrowed(input.readings.drivers.get(self.0)?),
            Some(tau_s) => Cow::Owned(input.reference.lagged(self.0, input.readings, tau_s)?),
        };
        let counted = |value: &f64| DriverSample::plain(input.reference.counted(self.0, *value), 0.0);
        Some(values.iter().map(counted).collect())
    }
    fn phrase(&self) -> String {
        format!("the {}", self.words())
    }
    fn is_observable(&self, recorded: &Recorded<'_>, _: Option<AxisKind>) -> bool {
        recorded.columns.contains(&self.0)
    }
    fn default_scale(&self, _: Option<AxisKind>) -> f64 {
        self.unit_of_name().scale
    }
    fn missing_column(&self, readings: &Readings) -> Option<String> {
        let recorded = readings.drivers.contains_key(self.0);
        Some(if recorded { "time_s".to_string() } else { in_files(self.0).into_owned() })
    }
    fn per(&self) -> Option<&'static str> {
        Some(match self.unit_of_name().unit {
            Unit::NewtonMetre => "(N m)",
            unit => DriverUnit::plain(unit).result(),
        })
    }
    fn proportional(&self) -> Option<String> {
        Some(format!(", following {}", self.phrase()))
    }
}

impl Symbols for Column<'_> {
    fn symbols<N: Nominal>(
        &self,
        input: &SymbolInput<'_, N>,
        named: &impl Fn(DriverQuantity) -> N,
    ) -> Option<DriverSample<N>> {
        let ColumnUnit { unit, scale, from_mean, letter, .. } = self.unit_of_name();
        let mut text = letter.to_string();
        if self.0 != TEMPERATURE {
            text.push_str(&format!("_{}", quantity(self.0)));
        }
        let (mut identifier, mut meaning) = (self.0.to_string(), self.words());
        if *from_mean {
            meaning.push_str(" above the mean of the session");
        }
        if let Some(tau_s) = input.lag_s {
            identifier.push_str(&format!("_lag_{tau_s}_s"));
            text.push_str(&format!("_lag_{tau_s}_s"));
            meaning.push_str(&format!(", after a first-order lag of {tau_s} s"));
        }
        let quantity = DriverQuantity {
            driver: Driver::Column(self.0.to_string()),
            part: DriverPart::Value,
            identifier,
            text,
            unit: unit.symbol(),
            meaning,
            range: if *from_mean { [-5.0 * scale, 5.0 * scale] } else { [0.0, 10.0 * scale] },
        };
        Some(DriverSample::plain(named(quantity), N::constant(0.0)))
    }
}
