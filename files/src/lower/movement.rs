//! The motion of the axes in a planned test: `sweep` and `path`.

use abbe_model::axis::{Axis, AxisKind};
use abbe_model::document::fault::{Fault, Within};
use abbe_model::document::movement as document;
use abbe_model::document::node::Named;
use abbe_model::document::schema;
use abbe_model::document::value::{Length, Positive};
use abbe_model::instrument::{Following, Station};
use abbe_model::session::limits;
use abbe_model::session::motion::{
    Course, FollowOffset, MAX_READINGS, Motion, Moved, Traversals, length_of, programmed_over_path_feed,
};

use super::Context;
use crate::axes;

/// Default feed of a linear axis or a circle, mm/s: 1000 mm/min.
const DEFAULT_FEED_MM_S: f64 = 1000.0 / 60.0;
/// Default speed of a rotary axis, rad/s: 120 °/min.
const DEFAULT_ROTARY_SPEED_RAD_S: f64 = 2.0 / 180.0 * std::f64::consts::PI;

/// The speed of an axis for which none is stated, mm/s or rad/s.
fn default_speed(kind: AxisKind) -> f64 {
    match kind {
        AxisKind::Linear => DEFAULT_FEED_MM_S,
        AxisKind::Rotary => DEFAULT_ROTARY_SPEED_RAD_S,
    }
}

/// One axis moves.
pub(super) fn sweep(
    context: &Context<'_>,
    document: &document::Sweep,
    station: &Station<f64>,
) -> Result<Motion, Fault> {
    let (axis, kind) = moved_axis(context, &document.axis)?;
    let end = |name: &str, mm: Option<f64>, deg: Option<f64>| {
        let (right, wrong, other) = match kind {
            AxisKind::Linear => (mm, deg, "deg"),
            AxisKind::Rotary => (deg, mm, "mm"),
        };
        if wrong.is_some() {
            let key = format!("{name}_{other}");
            return Err(Fault::new(format!("`{key}` for an axis in {}", kind.unit()), None).on_key().at(&key));
        }
        right.map(|number| kind.to_internal(number)).ok_or_else(|| {
            let key = format!("{name}_{}", kind.unit());
            Fault::of_table(format!("has no `{key}`"), format!("add `{key}`"))
        })
    };
    let from = end("from", document.from_mm, document.from_deg)?;
    let to = end("to", document.to_mm, document.to_deg)?;
    let step = end("step", document.step_mm, document.step_deg)?;
    let range = StepRange::new(from, to, step, &format!("step_{}", kind.unit()))?;
    let speed = speed(context, axis, station, document.feed_mm_min, document.feed_deg_min)?;
    Ok(Motion { moved: Moved::Axis(axis), course: range.course(speed, document.traversals, 1)? })
}

/// Several axes move together; `None` if the data contain the states.
pub(super) fn path(
    context: &Context<'_>,
    document: &document::Path,
    station: &Station<f64>,
) -> Result<Option<Motion>, Fault> {
    match document {
        document::Path::List(_) => Ok(None),
        document::Path::Circle(circle) => self::circle(context, circle).map(Some),
        document::Path::Line(line) => self::line(context, line).map(Some),
        document::Path::Follow(follow) => self::follow(context, follow, station).map(Some),
    }
}

fn circle(context: &Context<'_>, document: &document::Circle) -> Result<Motion, Fault> {
    let plane = &document.plane;
    let letters: Vec<String> = plane.chars().map(String::from).collect();
    let [first, second] = &letters[..] else {
        return Err(Fault::unexpected("two linear axes, such as \"XY\",").at("plane"));
    };
    let linear = |name: &str| -> Result<usize, Fault> {
        let axis = axes::axis(context.machine, name)?;
        if context.machine.axes[axis].kind != AxisKind::Linear {
            return Err(Fault::new(format!("axis `{name}` is rotary; a circle moves two linear axes"), None));
        }
        Ok(axis)
    };
    let axes = [linear(first).within("plane")?, linear(second).within("plane")?];
    if axes[0] == axes[1] {
        return Err(Fault::of_key(format!("= \"{plane}\" names one axis twice"), None).at("plane"));
    }
    let (_, radius) = document.radius_mm.evaluated("radius_mm", context.constants).within("radius_mm")?;
    limits::positive(radius).within("radius_mm")?;
    let mut centre = [0.0; 3];
    for (item, (to, length)) in centre.iter_mut().zip(document.centre_mm.iter().flat_map(|point| &point.0)).enumerate()
    {
        (_, *to) = length.evaluated("centre_mm", context.constants).within_item(item).within("centre_mm")?;
    }
    let range = StepRange::turn(document.from_deg, document.to_deg, document.step_deg)?;
    let speed = document.feed_mm_min.map_or(DEFAULT_FEED_MM_S, |feed| feed.0 / 60.0);
    let moved = Moved::Circle { axes, radius, centre };
    Ok(Motion { moved, course: range.course(speed, document.traversals, 1)? })
}

fn line(context: &Context<'_>, document: &document::Line) -> Result<Motion, Fault> {
    let machine = context.machine;
    let positions = |named: &Named<Length>| {
        let mut found: Vec<(usize, f64)> = Vec::with_capacity(named.0.len());
        for (key, length) in &named.0 {
            let linear = axes::axis_position(machine, key)
                .filter(|(axis, _)| machine.axes[*axis].kind == AxisKind::Linear)
                .ok_or_else(|| {
                    let linear = machine.axes.iter().filter(|axis| axis.kind == AxisKind::Linear);
                    let known: Vec<String> = linear.map(|axis| axis.column("")).collect();
                    let help = format!("a line moves linear axes: {}", known.join(", "));
                    Fault::new(format!("`{key}` is no position of a linear axis"), help).on_key().at(key)
                })?;
            if found.iter().any(|(axis, _)| *axis == linear.0) {
                let message = format!("the position of axis `{}` twice", machine.axes[linear.0].name);
                return Err(Fault::new(message, None).on_key().at(key));
            }
            let (_, number) = length.evaluated(key, context.constants).within(key)?;
            found.push((linear.0, linear.1.to_internal(number)));
        }
        Ok(found)
    };
    let starts = positions(&document.from).within("from")?;
    let stops = positions(&document.to).within("to")?;
    if starts.len() < 2 {
        let help = "one axis alone is `sweep = { … }`";
        return Err(Fault::of_key("names fewer than two axes", help).at("from"));
    }
    let is_of = |axis: usize| move |(other, _): &&(usize, f64)| *other == axis;
    if let Some((axis, _)) = stops.iter().find(|(axis, _)| !starts.iter().any(|start| is_of(*axis)(&start))) {
        let column = machine.axes[*axis].column("");
        return Err(Fault::of_key(format!("names `{column}`, which `from` does not"), None).at("to"));
    }
    let (mut axes, mut ends) = (Vec::new(), Vec::new());
    for (axis, start) in &starts {
        let name = machine.axes[*axis].column("");
        let Some((_, stop)) = stops.iter().find(is_of(*axis)) else {
            return Err(Fault::of_key(format!("has no `{name}`"), format!("add `{name}`")).at("to"));
        };
        if start == stop {
            let help = format!("state where it stands as `at = {{ {name} = … }}`");
            return Err(Fault::of_key(format!("has the same `{name}` as `from`"), help).at("to"));
        }
        axes.push(*axis);
        ends.push([*start, *stop]);
    }
    let range = StepRange::new(0.0, length_of(&ends), document.step_mm, "step_mm")?;
    let in_turn = document.in_turn.unwrap_or(false);
    let speed = document.feed_mm_min.map_or(DEFAULT_FEED_MM_S, |feed| feed.0 / 60.0);
    let course = range.course(speed, document.traversals, if in_turn { axes.len() } else { 1 })?;
    Ok(Motion { moved: Moved::Line { axes, ends, in_turn }, course })
}

fn follow(context: &Context<'_>, document: &document::Follow, station: &Station<f64>) -> Result<Motion, Fault> {
    if station.table_point().is_none() {
        let message =
            "a path of kind \"follow\" needs an instrument with a point of the table: a ball bar, an R-test or a probe";
        return Err(Fault::new(message, None));
    }
    let (axis, kind) = moved_axis(context, &document.axis)?;
    if kind != AxisKind::Rotary {
        let name = &context.machine.axes[axis].name;
        let message = format!("axis `{name}` is linear; a path of kind \"follow\" needs a rotary axis");
        return Err(Fault::new(message, None));
    }
    let offset = match (station.following(), document.offset) {
        (Following::AtBar, Some(offset)) => offset,
        (Following::AtBar, None) => return Err(Fault::missing("offset", "\"radial\", \"tangential\" or \"axial\"")),
        (Following::Touching(message, help), Some(_)) => {
            return Err(Fault::new(message, help).on_key().at("offset"));
        }
        (Following::Apart, Some(_)) => {
            let mut known = schema::fields::<document::Follow>();
            known.retain(|key| key != "offset");
            known.push("kind".to_string());
            return Err(Fault::unknown_key("offset", known));
        }
        (Following::Touching(..), None) => FollowOffset::Touching,
        (Following::Apart, None) => FollowOffset::None,
    };
    let range = StepRange::turn(document.from_deg, document.to_deg, document.step_deg)?;
    let speed = match document.programmed_feed_mm_min {
        Some(feed) => programmed_speed(context, axis, station, feed, document)?,
        None => speed(context, axis, station, document.feed_mm_min, document.feed_deg_min)?,
    };
    Ok(Motion { moved: Moved::Follow { axis, offset }, course: range.course(speed, document.traversals, 1)? })
}

fn moved_axis(context: &Context<'_>, name: &str) -> Result<(usize, AxisKind), Fault> {
    let axis = axes::axis(context.machine, name).within("axis")?;
    Ok((axis, context.machine.axes[axis].kind))
}

/// Start, end and step of a motion, in the internal unit.
struct StepRange {
    from: f64,
    to: f64,
    step: f64,
}

impl StepRange {
    /// Of a rotation in degrees; by default a full revolution.
    fn turn(from: Option<f64>, to: Option<f64>, step: f64) -> Result<StepRange, Fault> {
        let from = from.unwrap_or(0.0).to_radians();
        let to = to.map_or(from + std::f64::consts::TAU, f64::to_radians);
        StepRange::new(from, to, step.to_radians(), "step_deg")
    }

    /// Checks the range; `key` is that of the step.
    fn new(from: f64, to: f64, step: f64, key: &str) -> Result<StepRange, Fault> {
        if step <= 0.0 {
            let what = "must be greater than 0; the return traversal is `both_directions = true`";
            return Err(Fault::of_key(what, None).at(key));
        }
        if from == to {
            return Err(Fault::of_table("has equal start and end", None));
        }
        let range = StepRange { from, to, step };
        if range.steps() > MAX_READINGS as f64 {
            let message = format!("{:.2e} steps; the limit is {MAX_READINGS} readings", range.steps());
            return Err(Fault::new(message, "use a larger step").at(key));
        }
        if range.steps() < 1.0 {
            return Err(Fault::is("larger than the whole motion").at(key));
        }
        Ok(range)
    }

    fn steps(&self) -> f64 {
        (self.to - self.from).abs() / self.step + 1e-6
    }

    /// The course through the range, with so many readings at each step.
    fn course(self, speed: f64, traversals: Traversals, readings: usize) -> Result<Course, Fault> {
        let (runs, steps) = (traversals.runs(), self.steps() * readings as f64);
        if traversals.runs.is_some() && runs as f64 * (steps + 1.0) * 2.0 > MAX_READINGS as f64 {
            let message = format!("{runs} runs of {steps:.0} steps; the limit is {MAX_READINGS} readings");
            return Err(Fault::new(message, None).at("runs"));
        }
        let StepRange { from, to, step } = self;
        Ok(Course { from, to, step, speed, traversals })
    }
}

/// The speed of an axis, in degrees or millimetres per minute; `feed_mm_min` of a rotary axis is the path speed of the
/// ball that it carries.
fn speed(
    context: &Context<'_>,
    axis: usize,
    station: &Station<f64>,
    mm: Option<Positive>,
    deg: Option<Positive>,
) -> Result<f64, Fault> {
    match (context.machine.axes[axis].kind, mm, deg) {
        (_, Some(_), Some(_)) => Err(Fault::new("both `feed_mm_min` and `feed_deg_min`", None).at("feed_deg_min")),
        (kind, None, None) => Ok(default_speed(kind)),
        (AxisKind::Linear, Some(feed), None) => Ok(feed.0 / 60.0),
        (AxisKind::Linear, None, Some(_)) => {
            Err(Fault::new("`feed_deg_min` for a linear axis", None).at("feed_deg_min"))
        }
        (AxisKind::Rotary, None, Some(deg)) => Ok(deg.0.to_radians() / 60.0),
        (AxisKind::Rotary, Some(feed), None) => {
            Ok(feed.0 / 60.0 / radius_on_axis(context, axis, station).within("feed_mm_min")?)
        }
    }
}

/// The speed of a rotary axis that linear axes follow, from the programmed feed.
fn programmed_speed(
    context: &Context<'_>,
    axis: usize,
    station: &Station<f64>,
    feed: Positive,
    document: &document::Follow,
) -> Result<f64, Fault> {
    const KEY: &str = "programmed_feed_mm_min";
    for (key, other) in [("feed_mm_min", document.feed_mm_min), ("feed_deg_min", document.feed_deg_min)] {
        if other.is_some() {
            let help = "the programmed feed determines the speed of the ball: keep one of them";
            return Err(Fault::new(format!("both `{KEY}` and `{key}`"), help).at(key));
        }
    }
    let radius = radius_on_axis(context, axis, station).within(KEY)?;
    Ok(feed.0 / 60.0 / programmed_over_path_feed(radius) / radius)
}

/// Distance of the carried ball from a rotary axis, mm.
fn radius_on_axis(context: &Context<'_>, axis: usize, station: &Station<f64>) -> Result<f64, Fault> {
    let carried = match station {
        station if axis < context.machine.workpiece_side => station.table_point().unwrap_or(station.tool_point()),
        station => station.tool_point(),
    };
    let radius = radius_about(&context.machine.axes[axis], carried.mm);
    if radius < 1e-3 {
        return Err(Fault::of_key("of a ball that lies on its axis of rotation", "use `feed_deg_min`"));
    }
    Ok(radius)
}

/// Distance of a point from an axis, all axes at zero, mm.
fn radius_about(axis: &Axis, point: [f64; 3]) -> f64 {
    let from: [f64; 3] = std::array::from_fn(|i| point[i] - axis.origin_mm[i]);
    let along: f64 = (0..3).map(|i| from[i] * axis.direction[i]).sum();
    let square: f64 = from.iter().map(|x| x * x).sum::<f64>() - along * along;
    square.max(0.0).sqrt()
}
