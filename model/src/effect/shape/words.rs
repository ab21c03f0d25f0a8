//! The words around a shape in the plain description of an effect.

use crate::driver::DriverUnit;

/// What a shape needs to describe an effect in a sentence.
#[derive(Clone, Debug)]
pub struct EffectWords {
    /// The motion of the component: `axial motion`.
    pub motion: String,
    /// The driver as the object of a sentence: `its angle`, `the position of the X slide`, `time`.
    pub driver: String,
    /// ` of the X slide` if the effect follows another axis, else empty.
    pub of_another_axis: String,
    /// The words for proportionality to this driver, if it has its own: ` under gravity (compliance)`.
    pub proportional: Option<String>,
    /// Whether the component is the positioning error of the axis that it follows.
    pub is_positioning: bool,
    /// The unit of the driver.
    pub unit: DriverUnit,
}

impl EffectWords {
    /// The motion in proportion to the driver.
    pub fn in_proportion(&self) -> String {
        match &self.proportional {
            Some(proportional) => format!("{}{proportional}", self.motion),
            None => format!("{} in proportion to {}", self.motion, self.driver),
        }
    }
    /// A position, period or width of the driver, with its unit.
    pub fn at_value(&self, value: f64) -> String {
        self.unit.file.behind(four_digits(self.unit.to_display(value)))
    }
}

/// Four significant digits, at most four decimals.
pub(super) fn four_digits(value: f64) -> String {
    let magnitude = value.abs().max(1e-3).log10().floor() as i32;
    let text = format!("{value:.*}", (3 - magnitude).clamp(0, 4) as usize);
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|digit| matches!(digit, b'0' | b'.')) => zero.to_string(),
        Some(positive) => format!("−{positive}"),
        None => text,
    }
}
