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
    /// Whether the control shows coordinates, so that a work offset gives programs their positions: not of a robot or a mount.
    pub shows_coordinates: bool,
}

/// The datum of a session.
pub fn datum(session: &Session) -> Datum {
    let machine = &*session.machine;
    let rotary = |axis: &&Axis| axis.kind == AxisKind::Rotary;
    let (table, head) = machine.axes.split_at(machine.workpiece_side);
    // Joints of a robot have names of their own, and its controller shows another frame.
    let has_letter = |axis: &Axis| axis.name.len() == 1 && "ABCXYZUVW".contains(&axis.name);
    let has_linear = machine.axes.iter().any(|axis| axis.kind == AxisKind::Linear);
    let shows_coordinates = has_linear && machine.axes.iter().all(has_letter);
    let mut datum = Datum { shows_coordinates, ..Datum::default() };
    let through: Vec<&str> =
        table.iter().filter(rotary).filter(|axis| is_through(axis)).map(|axis| &*axis.name).collect();
    if !through.is_empty() {
        datum.origin.push(format!("The origin of R is on {} {}.", axes(&through), through.join(" and ")));
    }
    for axis in table.iter().filter(rotary).filter(|axis| !is_through(axis)) {
        datum.origin.push(format!("The axis of {} passes the origin of R at {}.", axis.name, place(axis)));
    }
    if !shows_coordinates {
        datum.origin.push(
            "R is the frame in which the machine file places the axes. Nothing is set: the positions are those of the axes."
                .into(),
        );
    } else if table.iter().all(|axis| axis.kind != AxisKind::Rotary) {
        let probed = session.tests.iter().find_map(|test| test.station.handling().probed);
        datum.origin.push(match probed {
            Some(object) => format!(
                "No rotary axis of the table fixes the origin of R: mount the {object}, probe its centre, and set the offset \
                 so that the control shows its coordinates."
            ),
            None => "The origin of R is where the tool point is with all axes at zero.".to_string(),
        });
    } else if let [only] = through[..]
        && let Some(along) = table.iter().find(|axis| axis.name == only).and_then(along)
        && let Some(object) = session.tests.iter().find_map(|test| Some(test.station.points()[0]?.name))
    {
        datum.origin.push(format!("Along {} it is where the coordinate of the {object} says.", LETTERS[along]));
    }
    datum.probing.extend(table.iter().filter(rotary).map(probing));
    datum.tool = if shows_coordinates { tool(session, machine, head) } else { tool_frame(session) };
    datum
}

/// The point at the tool on a machine whose control shows no coordinates: a robot, a mount.
fn tool_frame(session: &Session) -> Vec<String> {
    let name = session.tests.iter().find_map(|test| Some(test.station.points()[1]?.name));
    let words = |name| {
        format!("The coordinates of the {name} count in the tool frame, which coincides with R with all axes at zero.")
    };
    name.map(words).into_iter().collect()
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
    let points: Vec<_> = session.tests.iter().filter_map(|test| test.station.points()[1]).collect();
    let mut words = Vec::new();
    if let Some(point) = points.first() {
        let is_centre = points.iter().all(|point| point.target.mm.iter().all(|mm| mm.abs() < THROUGH_MM));
        words.push(match is_centre {
            true => format!(
                "Tool length: from the spindle nose to the centre of the {}, as measured. The tool point is that centre.",
                point.name
            ),
            false => format!(
                "Tool length: from the spindle nose to the tool point, from which the coordinates of the {} count.",
                point.name
            ),
        });
        if let Some(holder) = session.clearance.and_then(|sizes| sizes.spindle_holder) {
            words.push(format!(
                "The plan assumes {} mm from the nose to the centre of the {}.",
                number(holder.length_mm.0),
                point.name
            ));
        }
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
