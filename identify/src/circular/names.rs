//! Names of tests in ISO 10791-6, as far as a public source confirms them.
//!
//! Yamaji, Hamabata & Ihara (2014), Section 5, after ISO/DIS 10791-6:2012: in a machine with two rotary axes on the table,
//! BK1 moves A with Y and Z, or B with Z and X, and BK2 moves C with X and Y; the instrument measures in the radial, the
//! tangential and the axial direction. Names for machines with rotary axes in the head are not confirmed, and not given.

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::session::Test;
use abbe_model::session::motion::{FollowOffset, Moved};

/// The name of the motion of a test.
pub(super) fn iso_10791_6(machine: &Machine, test: &Test) -> Option<&'static str> {
    let Moved::Follow { axis, .. } = test.motion.as_ref()?.moved else { return None };
    let rotary = machine.axes.iter().enumerate().filter(|(_, axis)| axis.kind == AxisKind::Rotary);
    let on_table = rotary.map(|(index, _)| index < machine.workpiece_side).collect::<Vec<bool>>();
    if on_table != [true, true] {
        return None;
    }
    match machine.axes[axis].name.as_str() {
        "A" | "B" => Some("BK1"),
        "C" => Some("BK2"),
        _ => None,
    }
}

/// The direction of the bar in a synchronous motion.
pub(super) fn bar_direction(test: &Test) -> Option<&'static str> {
    let Moved::Follow { offset, .. } = test.motion.as_ref()?.moved else { return None };
    match offset {
        FollowOffset::Radial => Some("radial"),
        FollowOffset::Tangential => Some("tangential"),
        FollowOffset::Axial => Some("axial"),
        FollowOffset::None | FollowOffset::Touching => None,
    }
}
