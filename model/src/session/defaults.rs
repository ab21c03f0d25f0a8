//! Defaults of a session: what applies where nothing is stated.

use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::component::{ErrorKind, ErrorName, Freedom};
use crate::instrument::InstrumentKind;
use crate::pattern;
use crate::session::Prior;

/// The errors to be estimated with an instrument.
pub fn unknowns(machine: &Machine, kind: InstrumentKind) -> Vec<ErrorName> {
    match kind {
        InstrumentKind::BallBar | InstrumentKind::Probe | InstrumentKind::RTest => {
            position_and_orientation_errors(machine)
        }
        InstrumentKind::Tracker | InstrumentKind::Socket => all_location_errors(machine),
    }
}

/// The priors of an instrument's parameters, in their order: known exactly, but for the place of a tracker and of a
/// socket.
pub fn priors(kind: InstrumentKind) -> Vec<Prior> {
    let parameters = kind.unknowns().iter();
    parameters
        .map(|parameter| match parameter.thing {
            "tracker" | "socket" => Prior::Free,
            _ => Prior::Known,
        })
        .collect()
}

/// The name shared by tests with the same mounted spindle ball. The ball at a robot's flange stays mounted from socket
/// to socket; a ball in a spindle is mounted for each test.
pub fn spindle_setup(kind: InstrumentKind, test: &str) -> &str {
    match kind {
        InstrumentKind::Socket => "tool",
        _ => test,
    }
}

/// All location errors of all axes, except the rotation of a linear axis about its own direction, which affects no
/// reading. The joints of a robot have six each, more than its readings identify; the fit names the confounded
/// combinations.
fn all_location_errors(machine: &Machine) -> Vec<ErrorName> {
    let mut errors = pattern::errors(machine);
    errors.retain(|name| {
        let of_linear = machine.axes.iter().find(|axis| axis.name == name.axis && axis.kind == AxisKind::Linear);
        let own = of_linear.is_some_and(|axis| name.freedom.index() == axis.own_freedom().index() + 3);
        name.kind == ErrorKind::Location && !own
    });
    errors
}

/// The position and orientation errors of every rotary axis, in alphabetical order of the axes. The two location errors
/// in the axis' own degrees of freedom are excluded, because its own motion is confounded with them.
fn position_and_orientation_errors(machine: &Machine) -> Vec<ErrorName> {
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
