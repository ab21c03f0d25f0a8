//! One axis of a machine: kind, direction, origin and travel.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::frames::{Coordinate, Point, SinCos, cross_nominal, turn_about_nominal};
use crate::scalar::{Nominal, Scalar};
use crate::unit::Unit;

/// Whether an axis is linear or rotary. Its positions are in mm or radians.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(inline)]
pub enum AxisKind {
    /// Moves along its direction.
    Linear,
    /// Rotates about its direction.
    Rotary,
}

impl std::fmt::Display for AxisKind {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            AxisKind::Linear => "linear",
            AxisKind::Rotary => "rotary",
        })
    }
}

impl AxisKind {
    /// The kind that ISO 841 assigns to a one-letter name: A, B, C are rotary and X, Y, Z, U, V, W linear.
    pub fn of_letter(name: &str) -> Option<AxisKind> {
        match name {
            "A" | "B" | "C" => Some(AxisKind::Rotary),
            "X" | "Y" | "Z" | "U" | "V" | "W" => Some(AxisKind::Linear),
            _ => None,
        }
    }

    /// `mm` or `deg`: the display unit of a position.
    pub fn unit(self) -> Unit {
        match self {
            AxisKind::Linear => Unit::Millimetre,
            AxisKind::Rotary => Unit::Degree,
        }
    }

    /// Converts a position from mm or degrees to mm or radians.
    pub fn to_internal(self, position: f64) -> f64 {
        self.unit().to_internal(position)
    }

    /// Converts a position from mm or radians to mm or degrees.
    pub fn to_display(self, position: f64) -> f64 {
        self.unit().to_display(position)
    }
}

/// An axis, as a line in the reference frame R with all axes at zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// The name in the structural code.
    pub name: String,
    /// Linear or rotary.
    pub kind: AxisKind,
    /// Unit vector in R: the physical direction of the moving body for an increasing command.
    pub direction: [f64; 3],
    /// A point of the axis in R, mm.
    pub origin_mm: [f64; 3],
    /// Least and greatest position if stated, mm or radians.
    pub travel: Option<[f64; 2]>,
    /// The name of the joint in the robot's own file, by which files of readings may call the axis.
    pub joint: Option<String>,
}

impl Axis {
    /// The direction that ISO 841 assigns to a one-letter name: R's X for A, X and U, and so on.
    pub fn direction_of_letter(name: &str) -> Option<[f64; 3]> {
        match name {
            "A" | "X" | "U" => Some([1.0, 0.0, 0.0]),
            "B" | "Y" | "V" => Some([0.0, 1.0, 0.0]),
            "C" | "Z" | "W" => Some([0.0, 0.0, 1.0]),
            _ => None,
        }
    }

    /// Its column name in tables of positions: `x_mm`, `c_deg`; with a suffix `x_command_mm`.
    pub fn column(&self, suffix: &str) -> String {
        format!("{}{suffix}_{}", self.name.to_lowercase(), self.kind.unit())
    }

    /// The coordinate axis of R parallel to the direction, with the sign, if there is one.
    pub fn principal(&self) -> Option<(Coordinate, f64)> {
        Coordinate::ALL.into_iter().find_map(|coordinate| {
            let along = self.direction[coordinate.index()];
            (along.abs() == 1.0).then_some((coordinate, along))
        })
    }

    /// The degree of freedom in which the axis moves: `EB` for rotation about ±Y, `EX` for translation along ±X. For an
    /// oblique direction, its largest component decides.
    pub fn own_freedom(&self) -> crate::component::Freedom {
        let mut largest = 0;
        for index in 1..3 {
            if self.direction[index].abs() > self.direction[largest].abs() {
                largest = index;
            }
        }
        let offset = match self.kind {
            AxisKind::Linear => 0,
            AxisKind::Rotary => 3,
        };
        crate::component::Freedom::ALL[largest + offset]
    }

    /// `Rot(d, q) · point`, for a point relative to the origin of the axis.
    #[inline(always)]
    pub fn rotate<S: Scalar>(&self, turn: SinCos<S::Nominal>, point: Point<S>) -> Point<S> {
        if let Some((coordinate, sign)) = self.principal() {
            let sin = if sign > 0.0 { turn.sin } else { -turn.sin };
            return turn_about_nominal(coordinate, SinCos { sin, cos: turn.cos }, point);
        }
        // Rodrigues: p cos q + (d × p) sin q + d (d·p)(1 − cos q).
        let [dx, dy, dz] = self.direction.map(S::Nominal::constant);
        let [x, y, z] = point.0;
        let along = (x * dx + y * dy + z * dz) * (S::Nominal::constant(1.0) - turn.cos);
        let across = cross_nominal([-x, -y, -z], self.direction).0;
        Point([
            x * turn.cos + across[0] * turn.sin + along * dx,
            y * turn.cos + across[1] * turn.sin + along * dy,
            z * turn.cos + across[2] * turn.sin + along * dz,
        ])
    }
}
