//! The unit of a driver's numbers: internally, in files, in results and in words.

use crate::unit::Unit;

/// The unit of a driver's numbers. A file may state them in the unit of files or in the internal one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriverUnit {
    /// That of files: mm, °.
    pub file: Unit,
    /// That of the values: mm, rad.
    pub internal: Unit,
}

impl DriverUnit {
    /// The angle of a rotary axis.
    pub const ANGLE: DriverUnit = DriverUnit { file: Unit::Degree, internal: Unit::Radian };

    /// A unit in which values are as in files.
    pub const fn plain(unit: Unit) -> DriverUnit {
        DriverUnit { file: unit, internal: unit }
    }

    /// The name in results: `mm`, `deg`. A difference of temperatures is in kelvins.
    pub fn result(self) -> &'static str {
        if self.file == Unit::Celsius { Unit::Kelvin.name() } else { self.file.name() }
    }

    /// Whether the unit of files is the degree, and the internal one the radian.
    pub fn is_angle(self) -> bool {
        self.file != self.internal
    }

    /// Suffixes of keys, without repetition: that of files first.
    pub fn suffixes(self) -> impl Iterator<Item = &'static str> {
        [self.file.key(), self.internal.key()].into_iter().take(if self.is_angle() { 2 } else { 1 })
    }

    /// A number with a suffix in the internal unit; `None` if the suffix belongs to another driver.
    pub fn to_internal(self, suffix: &str, number: f64) -> Option<f64> {
        let is_file = || (suffix == self.file.key()).then(|| number.to_radians());
        (suffix == self.internal.key()).then_some(number).or_else(is_file)
    }

    /// A number of the internal unit in the unit of files and results.
    pub fn to_display(self, number: f64) -> f64 {
        if self.is_angle() { number.to_degrees() } else { number }
    }

    /// A number in the unit of files that reads back to the same bits, or else in the internal unit; with that unit.
    pub fn exact(self, value: f64) -> (Unit, f64) {
        if !self.is_angle() {
            return (self.file, value);
        }
        let degrees = value.to_degrees();
        let round = (degrees * 1e9).round() / 1e9;
        let exact = |candidate: &f64| candidate.to_radians() == value;
        let degrees = [round, degrees, degrees.next_up(), degrees.next_down()].into_iter().find(exact);
        degrees.map_or((self.internal, value), |degrees| (self.file, degrees))
    }
}
