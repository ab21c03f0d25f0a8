//! What an effect may follow besides the position of an axis, with unit, meaning and names.

use abbe_model::axis::AxisKind;

/// The driver of an effect, if it is not the position of an axis.
#[derive(Clone, Debug, PartialEq)]
pub enum DriverQuantity {
    /// Direction of the last movement of an axis: −1, 0 or 1.
    Direction(String),
    /// The rate of an axis, mm/s or rad/s.
    Rate(String, AxisKind),
    /// Distance that an axis has travelled since its last reversal, mm or rad.
    SinceReversal(String, AxisKind),
    /// Time since the session's first reading, s.
    Time,
    /// Temperature above the session's mean, °C.
    Temperature,
    /// Moment about an axis of a unit weight at the instrument's point, m.
    Gravity(String),
}

impl DriverQuantity {
    pub(crate) fn unit(&self) -> &'static str {
        match self {
            DriverQuantity::Direction(_) => "1",
            DriverQuantity::Rate(_, AxisKind::Linear) => "mm/s",
            DriverQuantity::Rate(_, AxisKind::Rotary) => "rad/s",
            DriverQuantity::SinceReversal(_, AxisKind::Linear) => "mm",
            DriverQuantity::SinceReversal(_, AxisKind::Rotary) => "rad",
            DriverQuantity::Time => "s",
            DriverQuantity::Temperature => "°C",
            DriverQuantity::Gravity(_) => "m",
        }
    }

    pub(crate) fn meaning(&self) -> String {
        match self {
            DriverQuantity::Direction(axis) => {
                format!("direction of the last movement of axis {axis}: −1, 0 or 1")
            }
            DriverQuantity::Rate(axis, _) => format!("rate of axis {axis}"),
            DriverQuantity::SinceReversal(axis, _) => {
                format!("distance of axis {axis} since its last reversal")
            }
            DriverQuantity::Time => "time since the first reading of the session".to_string(),
            DriverQuantity::Temperature => "temperature above the mean of the session".to_string(),
            DriverQuantity::Gravity(axis) => {
                format!("moment of a unit weight about axis {axis}")
            }
        }
    }

    /// The name in plain text; typeset output takes the letter and the subscript from it.
    pub(crate) fn text(&self) -> String {
        let of = |letter: &str, axis: &str| format!("{letter}_{}", axis.to_lowercase());
        match self {
            DriverQuantity::Direction(axis) => of("σ", axis),
            DriverQuantity::Rate(axis, _) => of("v", axis),
            DriverQuantity::SinceReversal(axis, _) => of("w", axis),
            DriverQuantity::Time => "t".to_string(),
            DriverQuantity::Temperature => "T".to_string(),
            DriverQuantity::Gravity(axis) => of("g", axis),
        }
    }

    pub(crate) fn identifier(&self) -> String {
        match self {
            DriverQuantity::Direction(axis) => format!("direction_{axis}"),
            DriverQuantity::Rate(axis, _) => format!("rate_{axis}"),
            DriverQuantity::SinceReversal(axis, _) => format!("since_reversal_{axis}"),
            DriverQuantity::Time => "time_s".to_string(),
            DriverQuantity::Temperature => "temperature_c".to_string(),
            DriverQuantity::Gravity(axis) => format!("gravity_{axis}"),
        }
    }
}
