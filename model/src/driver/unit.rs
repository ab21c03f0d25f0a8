//! The unit of a driver's numbers: internally, in files, in results and in words.

/// The unit of a driver's numbers. A file may state them in the unit of files or in the internal one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriverUnit {
    /// Suffix of keys in the unit of files: `mm`, `deg`.
    pub file: &'static str,
    /// Suffix of keys in the internal unit: `mm`, `rad`.
    pub internal: &'static str,
    /// The name in results: `mm`, `deg`, `K`.
    pub result: &'static str,
    /// The symbol behind a number, with its space: ` mm`, `°`.
    pub symbol: &'static str,
}

impl DriverUnit {
    /// A unit by its suffixes in files and inside, its name in results and its symbol.
    pub const fn new(file: &'static str, internal: &'static str, result: &'static str, symbol: &'static str) -> Self {
        DriverUnit { file, internal, result, symbol }
    }

    /// Whether the unit of files is the degree.
    pub fn is_angle(self) -> bool {
        self.file != self.internal
    }

    /// Suffixes of keys, without repetition: that of files first.
    pub fn suffixes(self) -> impl Iterator<Item = &'static str> {
        [self.file, self.internal].into_iter().take(if self.is_angle() { 2 } else { 1 })
    }

    /// A number with a suffix in the internal unit; `None` if the suffix belongs to another driver.
    pub fn to_internal(self, suffix: &str, number: f64) -> Option<f64> {
        if suffix == self.internal {
            Some(number)
        } else if suffix == self.file {
            Some(number.to_radians())
        } else {
            None
        }
    }

    /// A number of the internal unit in the unit of files and results.
    pub fn to_display(self, number: f64) -> f64 {
        if self.is_angle() { number.to_degrees() } else { number }
    }

    /// A number in the unit of files that reads back to the same bits, or else in the internal unit; with its suffix.
    pub fn exact(self, value: f64) -> (&'static str, f64) {
        if !self.is_angle() {
            return (self.file, value);
        }
        let degrees = value.to_degrees();
        let round = (degrees * 1e9).round() / 1e9;
        for candidate in [round, degrees, degrees.next_up(), degrees.next_down()] {
            if candidate.to_radians() == value {
                return (self.file, candidate);
            }
        }
        (self.internal, value)
    }
}
