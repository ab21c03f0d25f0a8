//! What numbers from outside may be, whatever they say: within these limits nothing overflows and angles keep their meaning.

/// The largest number that a file or an argument may hold, in whatever unit its name says. A position of 10¹² is resolved to 10⁻⁴; in degrees that is
/// three thousand million turns.
pub const LARGEST: f64 = 1e12;

/// The least standard deviation or step other than zero, µm: a millionth of what any sensor resolves.
pub const MIN_UM: f64 = 1e-6;

/// What is wrong with a number that is larger than [`LARGEST`].
pub fn too_large(number: f64) -> Option<String> {
    (number.is_finite() && number.abs() > LARGEST)
        .then(|| format!("{number:e}, which is too large; {LARGEST:e} is the most"))
}

/// What is wrong with a standard deviation or step in µm that is neither zero nor at least [`LEAST_UM`].
pub fn too_small_um(number: f64) -> Option<String> {
    (number > 0.0 && number < MIN_UM).then(|| format!("{number:e} µm; {MIN_UM:e} µm is the least besides 0"))
}
