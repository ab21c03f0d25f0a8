//! An axis of a structural code.

use abbe_model::axis::AxisKind;

/// The side of the chain from the bed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Workpiece,
    Tool,
}

/// An axis of the code.
pub(super) struct Body {
    pub name: String,
    pub kind: AxisKind,
    /// 0, 1, 2 for X, Y, Z of R.
    pub along: usize,
    pub on_table: bool,
}

impl Body {
    pub fn side(&self) -> Side {
        if self.on_table { Side::Workpiece } else { Side::Tool }
    }
}
