//! The error components of the simulated machine and their names in results.

use std::fmt;

/// The axes of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum AxisName {
    X,
    Y,
    Z,
    A,
    C,
}

impl AxisName {
    /// In the order of [`AxisName::index`].
    pub const ALL: [AxisName; 5] = [AxisName::X, AxisName::Y, AxisName::Z, AxisName::A, AxisName::C];

    /// 0 to 4.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Whether the axis is rotary.
    pub fn is_rotary(self) -> bool {
        matches!(self, AxisName::A | AxisName::C)
    }

    /// The degree of freedom along which the axis moves: EXX, EAA, ECC are positioning errors.
    pub fn own_freedom(self) -> Freedom {
        [Freedom::X, Freedom::Y, Freedom::Z, Freedom::A, Freedom::C][self.index()]
    }
}

/// The degrees of freedom of a body, in the order in which errors are applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum Freedom {
    X,
    Y,
    Z,
    A,
    B,
    C,
}

impl Freedom {
    /// All six.
    pub const ALL: [Freedom; 6] = [Freedom::X, Freedom::Y, Freedom::Z, Freedom::A, Freedom::B, Freedom::C];

    /// 0 to 5.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Whether it is a rotation.
    pub fn is_angle(self) -> bool {
        self.index() >= 3
    }
}

/// 0, 1, 2 for x, y, z.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Cartesian(pub usize);

impl fmt::Debug for Cartesian {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(["x", "y", "z"][self.0])
    }
}

/// An error component.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Component {
    /// Error motion: EZC is `Motion(Freedom::Z, AxisName::C)`.
    Motion(Freedom, AxisName),
    /// Location error, or squareness of a linear axis: EX0C, EC0Y.
    Location(Freedom, AxisName),
    /// Offset of the workpiece ball in the table frame.
    WorkpieceBall(Cartesian),
    /// Offset of the spindle ball in the tool frame.
    SpindleBall(Cartesian),
    /// True minus stated bar length.
    Bar,
    /// The gain error of the sensor.
    Sensor,
    /// The delay of the sensor reading.
    Trigger,
}

impl Component {
    /// The unit in which amplitudes of this component are given: `um`, `arcsec`, `percent` or `ms`.
    pub fn unit(self) -> &'static str {
        match self {
            Component::Motion(freedom, _) | Component::Location(freedom, _) => {
                if freedom.is_angle() {
                    "arcsec"
                } else {
                    "um"
                }
            }
            Component::WorkpieceBall(_) | Component::SpindleBall(_) | Component::Bar => "um",
            Component::Sensor => "percent",
            Component::Trigger => "ms",
        }
    }

    /// Reads the name that [`fmt::Display`] writes, and `sensor` for `gain`.
    pub fn parse(text: &str) -> Option<Component> {
        let cartesian = |letter: &str| ["x", "y", "z"].iter().position(|name| *name == letter).map(Cartesian);
        if let Some(letter) = text.strip_prefix("workpiece_ball.") {
            return cartesian(letter).map(Component::WorkpieceBall);
        }
        if let Some(letter) = text.strip_prefix("spindle_ball.") {
            return cartesian(letter).map(Component::SpindleBall);
        }
        match text {
            "bar" => return Some(Component::Bar),
            "gain" | "sensor" => return Some(Component::Sensor),
            "trigger" => return Some(Component::Trigger),
            _ => {}
        }
        let rest = text.strip_prefix('E')?;
        let freedom = Freedom::ALL.into_iter().find(|freedom| rest.starts_with(&format!("{freedom:?}")))?;
        let rest = &rest[1..];
        let axis = |name: &str| AxisName::ALL.into_iter().find(|axis| format!("{axis:?}") == name);
        match rest.strip_prefix('0') {
            Some(name) => Some(Component::Location(freedom, axis(name)?)),
            None => Some(Component::Motion(freedom, axis(rest)?)),
        }
    }
}

/// The size of a unit in mm, rad, s or as a ratio.
pub fn unit_size(unit: &str) -> f64 {
    match unit {
        "um" | "ms" => 1e-3,
        "arcsec" => std::f64::consts::PI / (180.0 * 3600.0),
        "percent" => 1e-2,
        other => unreachable!("no such unit in the plant: {other}"),
    }
}

impl fmt::Display for Component {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Component::Motion(freedom, axis) => write!(formatter, "E{freedom:?}{axis:?}"),
            Component::Location(freedom, axis) => write!(formatter, "E{freedom:?}0{axis:?}"),
            Component::WorkpieceBall(letter) => write!(formatter, "workpiece_ball.{letter:?}"),
            Component::SpindleBall(letter) => write!(formatter, "spindle_ball.{letter:?}"),
            Component::Bar => formatter.write_str("bar"),
            Component::Sensor => formatter.write_str("gain"),
            Component::Trigger => formatter.write_str("trigger"),
        }
    }
}

impl fmt::Debug for Component {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, formatter)
    }
}
