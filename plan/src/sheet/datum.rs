//! Where the reference frame R is on a machine, and how an operator makes the control show its coordinates.

use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::Machine;
use abbe_model::session::Session;
use abbe_model::words::number;

/// An axis passes through the origin of R if it is no farther from it, mm.
const THROUGH_MM: f64 = 1e-6;
const LETTERS: [&str; 3] = ["X", "Y", "Z"];

/// The sentences by which an operator sets the control up for a session.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Datum {
    /// Where the origin of R is.
    pub origin: Vec<String>,
    /// How it is found on the machine.
    pub probing: Vec<String>,
    /// Tool length and pivot.
    pub tool: Vec<String>,
}

/// The datum of a session.
pub fn datum(session: &Session) -> Datum {
    let machine = &*session.machine;
    let rotary = |axis: &&Axis| axis.kind == AxisKind::Rotary;
    let (table, head) = machine.axes.split_at(machine.workpiece_side);
    let mut datum = Datum::default();
    let through: Vec<&str> =
        table.iter().filter(rotary).filter(|axis| is_through(axis)).map(|axis| &*axis.name).collect();
    if !through.is_empty() {
        datum.origin.push(format!("The origin of R is on {} {}.", axes(&through), through.join(" and ")));
    }
    for axis in table.iter().filter(rotary).filter(|axis| !is_through(axis)) {
        datum.origin.push(format!("The axis of {} passes the origin of R at {}.", axis.name, place(axis)));
    }
    if table.iter().all(|axis| axis.kind != AxisKind::Rotary) {
        datum.origin.push(
            "No rotary axis of the table fixes the origin of R: mount the workpiece ball, probe its centre, and set the \
             offset so that the control shows its coordinates."
                .into(),
        );
    } else if let [only] = through[..]
        && let Some(along) = table.iter().find(|axis| axis.name == only).and_then(along)
    {
        datum.origin.push(format!("Along {} it is where the coordinate of the workpiece ball says.", LETTERS[along]));
    }
    datum.probing.extend(table.iter().filter(rotary).map(probing));
    datum.tool = tool(session, machine, head);
    datum
}

fn axes(names: &[&str]) -> &'static str {
    if names.len() == 1 { "the axis of" } else { "the axes of" }
}

/// The direction of R along which an axis is.
fn along(axis: &Axis) -> Option<usize> {
    axis.principal().map(|(coordinate, _)| coordinate.index())
}

/// The point of an axis nearest to the origin of R.
fn foot(axis: &Axis) -> [f64; 3] {
    let share: f64 = (0..3).map(|i| axis.origin_mm[i] * axis.direction[i]).sum();
    std::array::from_fn(|i| axis.origin_mm[i] - share * axis.direction[i])
}

fn is_through(axis: &Axis) -> bool {
    foot(axis).iter().all(|mm| mm.abs() < THROUGH_MM)
}

fn place(axis: &Axis) -> String {
    let across = (0..3).filter(|i| along(axis) != Some(*i));
    let named = across.map(|i| format!("{} {} mm", LETTERS[i], number((foot(axis)[i] * 1e3).round() / 1e3)));
    named.collect::<Vec<_>>().join(", ")
}

/// How the axis of a table is found.
fn probing(axis: &Axis) -> String {
    let name = &axis.name;
    let Some(along) = along(axis) else {
        return format!("Axis of {name}: the control's kinematic data, or a measurement of the machine.");
    };
    let [first, second] = [0, 1, 2].into_iter().filter(|i| *i != along).map(|i| LETTERS[i]).collect::<Vec<_>>()[..]
    else {
        return String::new();
    };
    let half_turn = [[0.0, 180.0], [-90.0, 90.0], [-180.0, 0.0]].into_iter().find(|ends| {
        axis.travel.is_none_or(|[low, high]| {
            low <= axis.kind.to_internal(ends[0]) + 1e-9 && high >= axis.kind.to_internal(ends[1]) - 1e-9
        })
    });
    match half_turn {
        Some([low, high]) => format!(
            "Axis of {name}: fix a sphere to the table and probe its centre at {name} {low}° and {name} {high}°. The mean of both \
             is on the axis, in {first} and {second}."
        ),
        None => format!(
            "Axis of {name}: fix a sphere to the table and probe its centre at three positions of {name}. The centre of the circle \
             through them is on the axis, in {first} and {second}."
        ),
    }
}

/// What the control has to know of the tool.
fn tool(session: &Session, machine: &Machine, head: &[Axis]) -> Vec<String> {
    let balls: Vec<[f64; 3]> = session.tests.iter().map(|test| test.station.tool_point_mm()).collect();
    let is_ball = balls.iter().all(|ball| ball.iter().all(|mm| mm.abs() < THROUGH_MM));
    let mut words = vec![if is_ball {
        "Tool length: from the spindle nose to the centre of the spindle ball, as measured. The tool point is that centre.".to_string()
    } else {
        "Tool length: from the spindle nose to the tool point, from which the coordinates of the spindle ball count."
            .to_string()
    }];
    if let Some(holder) = session.clearance.and_then(|sizes| sizes.spindle_holder) {
        words
            .push(format!("The plan assumes {} mm from the nose to the centre of the ball.", number(holder.length_mm)));
    }
    for axis in head.iter().filter(|axis| axis.kind == AxisKind::Rotary && along(axis) != Some(2)) {
        words.push(format!(
            "Pivot: the tool point is {} mm below the axis of {}, tool length included.",
            number((foot(axis)[2] * 1e3).round() / 1e3),
            axis.name
        ));
    }
    let linear: Vec<String> = machine
        .axes
        .iter()
        .filter(|axis| axis.kind == AxisKind::Linear)
        .map(|axis| format!("{} 0", axis.name))
        .collect();
    if !linear.is_empty() {
        words.push(format!(
            "With all rotary axes at 0 the control shows {} when the tool point is at the origin of R.",
            linear.join(", ")
        ));
    }
    words
}
