//! The instrument that the columns of a table belong to, where no session names it.

use abbe_model::chain::Machine;
use abbe_model::document::node::{Node, Value};
use abbe_model::instrument::{Fault, InstrumentKind, Station};
use abbe_model::words::listed;

use super::{Expected, Hint, grid, hint, meaning};

/// The columns of an instrument follow from its set-up. These set-ups are never written: they say what columns there are.
fn any_set_up(kind: InstrumentKind) -> Node {
    let point = |x: f64, y: f64, z: f64| Node::from_iter([x, y, z]);
    let zero = || point(0.0, 0.0, 0.0);
    let keys: Vec<(&str, Node)> = match kind.word() {
        "ballbar" => {
            vec![("bar_mm", 100.0.into()), ("workpiece_ball_mm", point(0.0, 100.0, 0.0)), ("spindle_ball_mm", zero())]
        }
        "r-test" => vec![("setting", "E".into()), ("workpiece_ball_mm", zero()), ("spindle_ball_mm", zero())],
        "probe" => vec![("artefact_mm", zero()), ("radius_mm", 10.0.into()), ("stylus_mm", zero())],
        "socket" => vec![("ball_mm", zero())],
        "tracker" | "pose" => vec![("target_mm", zero())],
        "laser" => vec![("beam", point(1.0, 0.0, 0.0))],
        "angle" => vec![("about", point(0.0, 0.0, 1.0))],
        "distance" => vec![("reflector_mm", zero()), ("station_mm", zero())],
        _ => Vec::new(),
    };
    Node::table(keys.into_iter().map(|(key, node)| (key.to_string(), node)))
}

/// A set-up of an instrument, as a session states it.
pub(super) fn station(kind: InstrumentKind, set_up: &Node, machine: &Machine) -> Option<Station<f64>> {
    let read = kind.set_up(set_up, &[], machine).ok()?;
    Some(read.station.map(|length| length.mm))
}

/// The keys of a set-up that can be estimated, for an instrument that stands where no one knows.
pub(super) fn unknown_set_up(kind: InstrumentKind) -> Option<Vec<(&'static str, Node)>> {
    let zero = || Node::from_iter([0.0, 0.0, 0.0]);
    let unknown = || Node::from(Value::Number(f64::INFINITY, "inf".into()));
    match kind.word() {
        "tracker" => Some(vec![("target_mm", zero()), ("target_u_um", unknown())]),
        "socket" => Some(vec![("ball_mm", zero()), ("ball_u_um", unknown())]),
        _ => None,
    }
}

/// The instrument whose columns a table has.
///
/// # Errors
/// If there is none, or more than one: what to do.
pub fn instrument(bytes: &[u8], machine: &Machine, hints: &[Hint]) -> Result<InstrumentKind, Fault> {
    let grid = grid::of(bytes)?;
    let has_linear = machine.axes.iter().any(|axis| axis.kind == abbe_model::axis::AxisKind::Linear);
    let mut fitting: Vec<(usize, InstrumentKind)> = Vec::new();
    let mut of_most: Option<Fault> = None;
    for &kind in InstrumentKind::ALL {
        let Some(station) = station(kind, &any_set_up(kind), machine) else { continue };
        let expected =
            Expected { machine, station: &station, circle: None, moved: only_axis(machine), planned: None, hints };
        match hint::found(&grid, &expected).and_then(|found| meaning::of(&grid, &expected, found)) {
            Ok(found) => {
                let readings = found.iter().filter(|one| one.is_reading()).count();
                // Three coordinates are those of a tracker if they are large, of an R-test if they are small.
                let is_large =
                    found.iter().any(|one| one.is_reading() && largest_mm(&grid, one, has_linear) > MAX_DEVIATION_MM);
                let is_other = match kind {
                    InstrumentKind::RTest => is_large || !has_linear,
                    InstrumentKind::Tracker => has_linear && !is_large,
                    _ => false,
                };
                if readings > 0 && !is_other {
                    fitting.push((readings, kind));
                }
            }
            Err(fault)
                if kind == InstrumentKind::Tracker && !has_linear || kind == InstrumentKind::BallBar && has_linear =>
            {
                of_most = Some(fault);
            }
            Err(_) => {}
        }
    }
    let most = fitting.iter().map(|(readings, _)| *readings).max().unwrap_or(0);
    fitting.retain(|(readings, _)| *readings == most);
    let words: Vec<&str> = fitting.iter().map(|(_, kind)| kind.word()).collect();
    let all = || InstrumentKind::ALL.iter().map(|kind| kind.word()).collect::<Vec<_>>();
    match fitting[..] {
        [(_, kind)] => Ok(kind),
        [] => Err(grid.with_layout(of_most.unwrap_or_else(|| {
            let help = format!("state the instrument: {}", listed(&all(), "or"));
            ("no column holds the readings of an instrument".into(), help)
        }))),
        _ => {
            let what = format!("the columns may be those of {}", listed(&words, "or"));
            Err(grid.with_layout((what, format!("state the instrument: {}", listed(&words, "or")))))
        }
    }
}

/// Deviations from a position are smaller, mm.
const MAX_DEVIATION_MM: f64 = 5.0;

/// The largest value of a column, mm; in mm if it states no unit.
fn largest_mm(grid: &grid::Grid, found: &meaning::Found, has_linear: bool) -> f64 {
    // Metres without a unit are small numbers, and a robot has no R-test.
    if found.unit.is_none() && !has_linear {
        return f64::INFINITY;
    }
    let cells = grid.rows.iter().filter_map(|row| grid::number_with_unit(&row.cells[found.column], grid.decimal));
    let largest = cells.map(|(value, _)| value.abs()).fold(0.0, f64::max);
    found.unit.map_or(largest, |unit| unit.to_internal(largest))
}

/// The axis of a machine that has one.
pub(super) fn only_axis(machine: &Machine) -> Option<usize> {
    (machine.axes.len() == 1).then_some(0)
}
