//! Limits of numbers in input. Within them nothing overflows and angles remain accurate.

/// The largest number that input may contain, in the unit of its name. A position of 10¹² is resolved to 10⁻⁴; in
/// degrees it is three thousand million revolutions.
pub const LARGEST: f64 = 1e12;

/// The least nonzero standard deviation or step, µm: a millionth of the resolution of any sensor.
pub const MIN_UM: f64 = 1e-6;

/// The fault of a number that is larger than [`LARGEST`].
pub fn too_large(number: f64) -> Option<String> {
    (number.is_finite() && number.abs() > LARGEST)
        .then(|| format!("{number:e}, which is too large; the limit is {LARGEST:e}"))
}

/// The fault of a standard deviation or step in µm that is neither zero nor at least [`MIN_UM`].
pub(crate) fn too_small_um(number: f64) -> Option<String> {
    (number > 0.0 && number < MIN_UM).then(|| format!("{number:e} µm; the least value other than 0 is {MIN_UM:e} µm"))
}

/// The fault of a length with this name that is not above zero.
pub(crate) fn not_positive(name: &str, number: f64) -> Option<String> {
    (number <= 0.0).then(|| format!("`{name}` is {number}; it must be greater than 0"))
}
