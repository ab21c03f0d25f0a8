//! Units of files in internal units: lengths in mm, angles in rad.

/// A micrometre in mm.
pub const MICROMETRE: f64 = 1e-3;
/// An arcsecond in rad.
pub const ARCSECOND: f64 = std::f64::consts::PI / (180.0 * 3600.0);
