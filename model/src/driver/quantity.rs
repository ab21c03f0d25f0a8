//! A quantity that an effect follows and that is not the position of an axis, as a variable of a printed equation.

use super::Driver;
use super::sample::DriverPart;
use crate::axis::{Axis, AxisKind};

/// A quantity that an effect follows, with its names in programs and print.
#[derive(Clone, Debug, PartialEq)]
pub struct DriverQuantity {
    /// The driver to which it belongs.
    pub driver: Driver,
    /// Which part of the driver's state it is.
    pub part: DriverPart,
    /// The name in programs.
    pub identifier: String,
    /// The name in plain text; typeset output takes the letter and the subscript from it.
    pub text: String,
    /// The unit.
    pub unit: &'static str,
    /// The meaning, in words.
    pub meaning: String,
    /// The range of values if a session states none, in the unit.
    pub range: [f64; 2],
}

impl DriverQuantity {
    fn of_axis(axis: &Axis, part: DriverPart, name: &str, letter: char) -> DriverQuantity {
        DriverQuantity {
            driver: Driver::Axis(axis.name.clone()),
            part,
            identifier: format!("{name}_{}", axis.name),
            text: format!("{letter}_{}", axis.name.to_lowercase()),
            unit: "1",
            meaning: String::new(),
            range: [-1.0, 1.0],
        }
    }

    /// Direction of the last movement of an axis: −1, 0 or 1.
    pub fn direction(axis: &Axis) -> DriverQuantity {
        DriverQuantity {
            meaning: format!("direction of the last movement of axis {}: −1, 0 or 1", axis.name),
            ..DriverQuantity::of_axis(axis, DriverPart::Direction, "direction", 'σ')
        }
    }

    /// The rate of an axis, mm/s or rad/s.
    pub fn rate(axis: &Axis) -> DriverQuantity {
        let (unit, range) = match axis.kind {
            AxisKind::Linear => ("mm/s", [-50.0, 50.0]),
            AxisKind::Rotary => ("rad/s", [-1.0, 1.0]),
        };
        DriverQuantity {
            unit,
            range,
            meaning: format!("rate of axis {}", axis.name),
            ..DriverQuantity::of_axis(axis, DriverPart::Rate, "rate", 'v')
        }
    }

    /// Distance that an axis has travelled since its last reversal, mm or rad.
    pub fn since_reversal(axis: &Axis) -> DriverQuantity {
        let (unit, range) = match axis.kind {
            AxisKind::Linear => ("mm", [0.0, 100.0]),
            AxisKind::Rotary => ("rad", [0.0, std::f64::consts::PI]),
        };
        DriverQuantity {
            unit,
            range,
            meaning: format!("distance of axis {} since its last reversal", axis.name),
            ..DriverQuantity::of_axis(axis, DriverPart::SinceReversal, "since_reversal", 'w')
        }
    }
}
