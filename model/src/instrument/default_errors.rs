//! Errors of the machine that an instrument estimates if the session states none.

use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::component::{ErrorKind, ErrorName, Freedom};
use crate::pattern;

/// All location errors of all axes, except the rotation of a linear axis about its own direction, which affects no
/// reading. The joints of a robot have six each, more than its readings identify; the fit names the confounded
/// combinations.
pub(super) fn all_locations(machine: &Machine) -> Vec<ErrorName> {
    let mut errors = pattern::errors(machine);
    errors.retain(|name| {
        let of_linear = machine.axes.iter().find(|axis| axis.name == name.axis && axis.kind == AxisKind::Linear);
        let own = of_linear.is_some_and(|axis| name.freedom.index() == axis.own_freedom().index() + 3);
        name.kind == ErrorKind::Location && !own
    });
    errors
}

/// None: the readings determine error motions of the axis that moves, which are declared as effects or found by a search.
pub(super) fn none(_: &Machine) -> Vec<ErrorName> {
    Vec::new()
}

/// The orientation errors of every rotary axis, those about its own direction included: an index error. The rotation about
/// the direction of the axis before is excluded, because it is confounded with that axis' index error.
pub(super) fn orientations(machine: &Machine) -> Vec<ErrorName> {
    let rotary: Vec<usize> =
        (0..machine.axes.len()).filter(|axis| machine.axes[*axis].kind == AxisKind::Rotary).collect();
    let mut errors = Vec::new();
    for (place, axis) in rotary.iter().enumerate() {
        let before = place.checked_sub(1).map(|place| machine.axes[rotary[place]].own_freedom().index() % 3);
        let freedoms = Freedom::ALL.into_iter().filter(|freedom| freedom.index() >= 3);
        let own = freedoms.filter(|freedom| Some(freedom.index() % 3) != before);
        errors.extend(own.map(|freedom| ErrorName {
            kind: ErrorKind::Location,
            freedom,
            axis: machine.axes[*axis].name.clone(),
        }));
    }
    errors
}

/// The position and orientation errors of every rotary axis, in alphabetical order of the axes. The two location errors
/// in the axis' own degrees of freedom are excluded, because its own motion is confounded with them.
pub(super) fn positions_and_orientations(machine: &Machine) -> Vec<ErrorName> {
    let mut rotary: Vec<_> = machine.axes.iter().filter(|axis| axis.kind == AxisKind::Rotary).collect();
    rotary.sort_by(|a, b| a.name.cmp(&b.name));
    rotary
        .into_iter()
        .flat_map(|axis| {
            let own = axis.own_freedom().index() % 3;
            Freedom::ALL.into_iter().filter(move |freedom| freedom.index() % 3 != own).map(|freedom| ErrorName {
                kind: ErrorKind::Location,
                freedom,
                axis: axis.name.clone(),
            })
        })
        .collect()
}
