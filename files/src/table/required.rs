//! Columns that an instrument requires.

use abbe_model::instrument::Fault;
use abbe_model::instrument::column::Quantity;
use abbe_model::session::motion::{Motion, Moved};

use super::columns::{Column, Role, known, listed};
use super::request::Request;

/// Returns a fault if one of them is missing.
pub(super) fn required(request: &Request<'_>, columns: &[Column], header: Option<&[String]>) -> Result<(), Fault> {
    let has = |accepted: &dyn Fn(&Role) -> bool| columns.iter().any(|column| accepted(&column.role));
    let found = || match header {
        Some(header) => format!("; found: {}", listed(header)),
        None => String::new(),
    };
    let missing = |what: String, help: String| Err((format!("no column {what}{}", found()), help));
    let reads = |quantity: Quantity| match quantity {
        Quantity::Socket => request.test.socket.is_some() || has(&|role| *role == Role::Socket),
        quantity => has(&|role| matches!(role, Role::Reading(own, _) if *own == quantity)),
    };
    if let Some((what, help)) = request.test.station.missing(&reads) {
        return missing(what, help);
    }
    let moved = request.moved();
    let motion = request.test.motion.as_ref();
    let on_circle = motion.filter(|motion| matches!(motion.moved, Moved::Circle { .. })).map(Motion::axes);
    let by_angle = has(&|role| matches!(role, Role::Polar(_)));
    if by_angle && on_circle.is_none() {
        let help = "state the circle: `path = { kind = \"circle\", plane = \"XY\", radius_mm = 100, … }`";
        return Err(("a polar angle, but the test states no circle".into(), help.into()));
    }
    let is_read = |index: usize| {
        by_angle && on_circle.is_some_and(|axes| axes.contains(&index))
            || has(&|role| matches!(role, Role::Axis(own, _) if *own == index))
    };
    for (index, axis) in request.machine.axes.iter().enumerate() {
        if request.at_listed.get(index) == Some(&true) || is_read(index) {
            continue;
        }
        let name = axis.column("");
        if moved.contains(&index) {
            let what = format!("`{name}`, though axis `{}` moves in this test", axis.name);
            return missing(what, "add its positions to the data".into());
        }
        if request.instrument().entry().needs_every_axis {
            let help = format!("add the positions of axis `{}` to the data, or state it", axis.name);
            return missing(format!("`{name}`"), format!("{help}: `at = {{ {name} = 0 }}`"));
        }
    }
    if (0..request.machine.axes.len()).any(is_read) {
        return Ok(());
    }
    missing("with the position of an axis".into(), format!("known here: {}", listed(&known(request))))
}
