//! Limits of numbers in input. Within them nothing overflows and angles remain accurate.

use crate::unit::Unit;
use crate::words;

/// The largest number that input may contain, in the unit of its name. A position of 10¹² is resolved to 10⁻⁴; in
/// degrees it is three thousand million revolutions.
pub const LARGEST: f64 = 1e12;

/// The longest length, mm: 1 km. No machine is longer, and rounding of it is far below any noise.
pub const MAX_LENGTH_MM: f64 = 1e6;

/// The least nonzero standard deviation or step, µm: a millionth of the resolution of any sensor.
pub const MIN_UM: f64 = 1e-6;

/// The fault of a number that is larger than [`LARGEST`].
pub fn too_large(number: f64) -> Option<String> {
    (number.is_finite() && number.abs() > LARGEST)
        .then(|| format!("{}, which is too large; the limit is {LARGEST:e}", words::number(number)))
}

/// As [`too_large`], for a number with a name: the limit of a length in mm, m or inches is [`MAX_LENGTH_MM`].
pub fn too_large_for(name: &str, number: f64) -> Option<String> {
    let unit = name.rsplit_once('_').and_then(|(_, unit)| Unit::parse(unit));
    let mm = match unit {
        Some(unit @ (Unit::Millimetre | Unit::Metre | Unit::Inch)) => unit.to_internal(number),
        _ => return too_large(number),
    };
    (number.is_finite() && mm.abs() > MAX_LENGTH_MM)
        .then(|| format!("{}, which is too large; the limit is 1 km", words::number(number)))
}

/// The fault of a standard deviation or step in µm that is neither zero nor at least [`MIN_UM`].
pub fn too_small_um(number: f64) -> Option<String> {
    (number > 0.0 && number < MIN_UM)
        .then(|| format!("{} µm; the least value other than 0 is {MIN_UM:e} µm", words::number(number)))
}

/// A number above zero, or what is wrong with it.
pub fn positive(number: f64) -> Result<f64, String> {
    if number > 0.0 { Ok(number) } else { Err(format!("{}; it must be greater than 0", words::number(number))) }
}

/// A number that is not below zero, or what is wrong with it.
pub(crate) fn not_negative(number: f64) -> Result<f64, String> {
    if number < 0.0 { Err(format!("{}; it cannot be negative", words::number(number))) } else { Ok(number) }
}

/// A whole number from `least` to `most`, or what is wrong with it.
pub(crate) fn count(number: f64, least: usize, most: usize) -> Result<usize, String> {
    if number.fract() == 0.0 && number >= least as f64 && number <= most as f64 {
        Ok(number as usize)
    } else {
        Err(format!("{}; a whole number from {least} to {most} is expected", words::number(number)))
    }
}
