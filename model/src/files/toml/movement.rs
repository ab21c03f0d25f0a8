//! Reader of `sweep` and `path`: the motion of the axes in a planned test.

use super::{Context, quantity};
use crate::axis::AxisKind;
use crate::error::ModelError;
use crate::files::toml::document::{Table, Value};
use crate::instrument::{Following, Station};
use crate::session::motion::{
    DEFAULT_FEED_MM_S, FollowOffset, MAX_READINGS, Motion, default_speed, programmed_over_path_feed,
};

/// Reads `sweep = { axis, from_…, to_…, step_…, feed_…, runs, both_directions }`.
pub(super) fn sweep(context: &Context<'_>, value: Value<'_>, station: &Station<f64>) -> Result<Motion, ModelError> {
    let mut table = value.table("`sweep`".into())?;
    let (axis, kind) = moved_axis(context, &mut table)?;
    let range = StepRange::read(&mut table, kind, true)?;
    let speed = speed(context, &mut table, axis, station)?;
    let (runs, both_directions) = runs_and_directions(&mut table, range.steps())?;
    table.finish()?;
    Ok(Motion::Sweep { axis, from: range.from, to: range.to, step: range.step, speed, runs, both_directions })
}

/// Reads `path = { kind = "circle" | "follow" | "list", … }`.
pub(super) fn path(context: &Context<'_>, value: Value<'_>, station: &Station<f64>) -> Result<Motion, ModelError> {
    let mut table = value.table("`path`".into())?;
    let kind = table.require("kind", "\"circle\", \"follow\" or \"list\"")?;
    match kind.text()?.as_str() {
        "list" => {
            table.finish()?;
            Ok(Motion::List)
        }
        "circle" => circle(context, table),
        "follow" => follow(context, table, station),
        _ => Err(kind.unexpected("\"circle\", \"follow\" or \"list\"")),
    }
}

fn circle(context: &Context<'_>, mut table: Table<'_>) -> Result<Motion, ModelError> {
    let plane = table.require("plane", "the two linear axes, such as \"XY\"")?;
    let text = plane.text()?;
    let letters: Vec<String> = text.chars().map(String::from).collect();
    let [first, second] = &letters[..] else {
        return Err(plane.unexpected("two linear axes, such as \"XY\","));
    };
    let linear = |name: &str| -> Result<usize, ModelError> {
        let Some(index) = quantity::axis_index(context.machine, name) else {
            let (message, help) = quantity::no_axis(context.machine, name);
            return Err(plane.error(message, Some(help)));
        };
        if context.machine.axes[index].kind != AxisKind::Linear {
            return Err(plane.error(format!("axis `{name}` is rotary; a circle moves two linear axes"), None));
        }
        Ok(index)
    };
    let (first, second) = (linear(first)?, linear(second)?);
    if first == second {
        return Err(plane.error(format!("`plane` = \"{text}\" names one axis twice"), None));
    }
    let radius_value = table.require("radius_mm", "the radius of the circle")?;
    let (_, radius) = context.length(&radius_value)?;
    if radius <= 0.0 {
        return Err(radius_value.error(format!("`radius_mm` is {radius}; it must be greater than 0"), None));
    }
    let centre = match table.take("centre_mm") {
        Some(value) => context.point_mm(value)?,
        None => [0.0; 3],
    };
    let range = StepRange::read(&mut table, AxisKind::Rotary, false)?;
    let speed = match table.take("feed_mm_min") {
        Some(value) => value.positive()? / 60.0,
        None => DEFAULT_FEED_MM_S,
    };
    let (runs, both_directions) = runs_and_directions(&mut table, range.steps())?;
    table.finish()?;
    Ok(Motion::Circle {
        first,
        second,
        radius,
        centre,
        from: range.from,
        to: range.to,
        step: range.step,
        speed,
        runs,
        both_directions,
    })
}

fn follow(context: &Context<'_>, mut table: Table<'_>, station: &Station<f64>) -> Result<Motion, ModelError> {
    if station.table_point_mm().is_none() {
        return Err(table.error(
            "a path of kind \"follow\" needs an instrument with a point of the table: a ball bar, an R-test or a probe",
            None,
        ));
    }
    let (axis, kind) = moved_axis(context, &mut table)?;
    if kind != AxisKind::Rotary {
        let name = &context.machine.axes[axis].name;
        return Err(
            table.error(format!("axis `{name}` is linear; a path of kind \"follow\" needs a rotary axis"), None)
        );
    }
    let offset = match station.following() {
        Following::AtBar => {
            let offset = table.require("offset", "\"radial\", \"tangential\" or \"axial\"")?;
            match offset.text()?.as_str() {
                "radial" => FollowOffset::Radial,
                "tangential" => FollowOffset::Tangential,
                "axial" => FollowOffset::Axial,
                _ => return Err(offset.unexpected("\"radial\", \"tangential\" or \"axial\"")),
            }
        }
        Following::Touching(message, help) => {
            if let Some(offset) = table.take("offset") {
                return Err(offset.source.error(offset.key_span.clone(), message, Some(help.into())));
            }
            FollowOffset::Touching
        }
        Following::Apart => FollowOffset::None,
    };
    let range = StepRange::read(&mut table, kind, false)?;
    let speed = match table.take("programmed_feed_mm_min") {
        Some(feed) => programmed_speed(context, &mut table, axis, station, &feed)?,
        None => speed(context, &mut table, axis, station)?,
    };
    let (runs, both_directions) = runs_and_directions(&mut table, range.steps())?;
    table.finish()?;
    Ok(Motion::Follow { axis, from: range.from, to: range.to, step: range.step, speed, runs, both_directions, offset })
}

fn moved_axis(context: &Context<'_>, table: &mut Table<'_>) -> Result<(usize, AxisKind), ModelError> {
    let value = table.require("axis", "the axis that moves")?;
    let name = value.text()?;
    let Some(axis) = quantity::axis_index(context.machine, &name) else {
        let (message, help) = quantity::no_axis(context.machine, &name);
        return Err(value.error(message, Some(help)));
    };
    Ok((axis, context.machine.axes[axis].kind))
}

/// Start, end and step of a motion, in the internal unit.
struct StepRange {
    from: f64,
    to: f64,
    step: f64,
}

impl StepRange {
    /// Reads `from_…`, `to_…` and `step_…`; the default of optional ends is a full revolution.
    fn read(table: &mut Table<'_>, kind: AxisKind, ends_needed: bool) -> Result<StepRange, ModelError> {
        let from = end(table, kind, ["from_mm", "from_deg"])?;
        let to = end(table, kind, ["to_mm", "to_deg"])?;
        let step = end(table, kind, ["step_mm", "step_deg"])?;
        let unit = kind.unit();
        let missing = |key: &str| {
            let help = format!("add `{key}_{unit}`");
            table.error(format!("{} has no `{key}_{unit}`", table.display_name()), Some(help))
        };
        let turn = kind == AxisKind::Rotary && !ends_needed;
        let from = match from {
            Some((from, _)) => from,
            None if turn => 0.0,
            None => return Err(missing("from")),
        };
        let to = match to {
            Some((to, _)) => to,
            None if turn => from + std::f64::consts::TAU,
            None => return Err(missing("to")),
        };
        let Some((step, stepped)) = step else {
            return Err(missing("step"));
        };
        if step <= 0.0 {
            let message =
                format!("`{}` must be greater than 0; the return traversal is `both_directions = true`", stepped.key);
            return Err(stepped.error(message, None));
        }
        if from == to {
            return Err(table.error(format!("{} has equal start and end", table.display_name()), None));
        }
        let range = StepRange { from, to, step };
        if range.steps() > MAX_READINGS as f64 {
            let message = format!("{:.2e} steps; the limit is {MAX_READINGS} readings", range.steps());
            return Err(stepped.error(message, Some("use a larger step".into())));
        }
        if range.steps() < 1.0 {
            return Err(stepped.error(format!("`{}` is larger than the whole motion", stepped.key), None));
        }
        Ok(range)
    }

    fn steps(&self) -> f64 {
        (self.to - self.from).abs() / self.step + 1e-6
    }
}

/// A number of an axis in mm or degrees, as the kind of the axis requires; the other unit is an error.
fn end<'a>(
    table: &mut Table<'a>,
    kind: AxisKind,
    [mm, deg]: [&'static str; 2],
) -> Result<Option<(f64, Value<'a>)>, ModelError> {
    let (right, wrong) = match kind {
        AxisKind::Linear => (table.take(mm), table.take(deg)),
        AxisKind::Rotary => (table.take(deg), table.take(mm)),
    };
    if let Some(wrong) = wrong {
        let message = format!("`{}` for an axis in {}", wrong.key, kind.unit());
        return Err(wrong.source.error(wrong.key_span.clone(), message, None));
    }
    match right {
        Some(value) => Ok(Some((kind.to_internal(value.number()?), value))),
        None => Ok(None),
    }
}

/// The speed of an axis, in degrees or millimetres per minute; `feed_mm_min` of a rotary axis is the path speed of the
/// ball that it carries.
fn speed(context: &Context<'_>, table: &mut Table<'_>, axis: usize, station: &Station<f64>) -> Result<f64, ModelError> {
    let (mm, deg) = (table.take("feed_mm_min"), table.take("feed_deg_min"));
    match (context.machine.axes[axis].kind, mm, deg) {
        (_, Some(_), Some(deg)) => Err(deg.error("both `feed_mm_min` and `feed_deg_min`", None)),
        (kind, None, None) => Ok(default_speed(kind)),
        (AxisKind::Linear, Some(feed), None) => Ok(feed.positive()? / 60.0),
        (AxisKind::Linear, None, Some(deg)) => Err(deg.error("`feed_deg_min` for a linear axis", None)),
        (AxisKind::Rotary, None, Some(deg)) => Ok(deg.positive()?.to_radians() / 60.0),
        (AxisKind::Rotary, Some(feed), None) => {
            let feed_mm_s = feed.positive()? / 60.0;
            Ok(feed_mm_s / radius_on_axis(context, axis, station, &feed)?)
        }
    }
}

/// The speed of a rotary axis that linear axes follow, from the programmed feed.
fn programmed_speed(
    context: &Context<'_>,
    table: &mut Table<'_>,
    axis: usize,
    station: &Station<f64>,
    feed: &Value<'_>,
) -> Result<f64, ModelError> {
    let feed_mm_s = feed.positive()? / 60.0;
    for key in ["feed_mm_min", "feed_deg_min"] {
        if let Some(other) = table.take(key) {
            let help = "the programmed feed determines the speed of the ball: keep one of them";
            return Err(other.error(format!("both `programmed_feed_mm_min` and `{key}`"), Some(help.into())));
        }
    }
    let radius = radius_on_axis(context, axis, station, feed)?;
    Ok(feed_mm_s / programmed_over_path_feed(radius) / radius)
}

/// Distance of the carried ball from a rotary axis, mm.
fn radius_on_axis(
    context: &Context<'_>,
    axis: usize,
    station: &Station<f64>,
    feed: &Value<'_>,
) -> Result<f64, ModelError> {
    let carried = match station {
        station if axis < context.machine.workpiece_side => station.table_point_mm().unwrap_or(station.tool_point_mm()),
        station => station.tool_point_mm(),
    };
    let radius = radius_about(&context.machine.axes[axis], carried);
    if radius < 1e-3 {
        let message = format!("`{}` of a ball that lies on its axis of rotation", feed.key);
        return Err(feed.error(message, Some("use `feed_deg_min`".into())));
    }
    Ok(radius)
}

/// Distance of a point from an axis, all axes at zero, mm.
fn radius_about(axis: &crate::axis::Axis, point: [f64; 3]) -> f64 {
    let from: [f64; 3] = std::array::from_fn(|i| point[i] - axis.origin_mm[i]);
    let along: f64 = (0..3).map(|i| from[i] * axis.direction[i]).sum();
    let square: f64 = from.iter().map(|x| x * x).sum::<f64>() - along * along;
    square.max(0.0).sqrt()
}

/// Reads `runs` and `both_directions`; the default is one run in both directions.
fn runs_and_directions(table: &mut Table<'_>, steps: f64) -> Result<(usize, bool), ModelError> {
    let both_directions = match table.take("both_directions") {
        Some(value) => value.boolean()?,
        None => true,
    };
    let runs = match table.take("runs") {
        Some(value) => {
            let runs = value.count(1, MAX_READINGS)?;
            if runs as f64 * (steps + 1.0) * 2.0 > MAX_READINGS as f64 {
                return Err(
                    value.error(format!("{runs} runs of {steps:.0} steps; the limit is {MAX_READINGS} readings"), None)
                );
            }
            runs
        }
        None => 1,
    };
    Ok((runs, both_directions))
}
