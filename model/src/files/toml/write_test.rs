//! Writer of ball-bar tests as `[[test]]` blocks.

use std::fmt::Write;

use super::quoted::quoted;
use crate::axis::AxisKind;
use crate::chain::Machine;
use crate::instrument::Station;
use crate::instrument::ballbar::BAR;
use crate::session::motion::{FollowOffset, Motion};
use crate::session::{Prior, Test};

/// A `[[test]]` block of a planned ball-bar test, with the positions of the axes that it does not move; `remark` is a
/// comment above it. `None` for another instrument, or for a test without a motion of its own.
///
/// ```
/// use abbe_model::chain::Machine;
/// use abbe_model::files::toml::write_test::block;
/// use abbe_model::instrument::Station;
/// use abbe_model::instrument::ballbar::BallBar;
/// use abbe_model::instrument::InstrumentKind;
/// use abbe_model::session::build::NewTest;
/// use abbe_model::session::motion::Motion;
/// use abbe_model::session::Session;
///
/// let mut session = Session::new(Machine::from_code("wCAbYXZt")?, InstrumentKind::BallBar);
/// let bar = BallBar { workpiece_ball: [0.0, 100.0, 0.0], spindle_ball: [0.0; 3], bar: 125.0 };
/// let turn = Motion::sweep(&session.machine, "C", [0.0, std::f64::consts::TAU], 1.0_f64.to_radians())?;
/// session.add_test(NewTest::new("C100", Station::BallBar(bar)).at("Z", 75.0).motion(turn))?;
/// let block = block(&session.tests[0], &session.machine, "a circle").unwrap();
/// assert!(block.starts_with("# a circle\n[[test]]\nname = \"C100\"\nbar_mm = 125\n"), "{block}");
/// assert!(block.contains("at = { z_mm = 75 }\nsweep = { axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 1, "));
/// # Ok::<(), abbe_model::ModelError>(())
/// ```
pub fn block(test: &Test, machine: &Machine, remark: &str) -> Option<String> {
    let Station::BallBar(bar) = &test.station else {
        return None;
    };
    let motion = test.motion.as_ref()?;
    let (moved, motion) = motion_line(motion, machine)?;
    let mut text = String::new();
    for line in remark.lines() {
        let _ = writeln!(text, "# {line}");
    }
    let _ = writeln!(text, "[[test]]\nname = {}\nbar_mm = {}", quoted(&test.name), number(bar.bar));
    let _ = writeln!(text, "workpiece_ball_mm = {}", point(bar.workpiece_ball));
    let _ = writeln!(text, "spindle_ball_mm = {}", point(bar.spindle_ball));
    for (key, setup) in [("setup", &test.setup), ("spindle_setup", &test.spindle_setup), ("bar_setup", &test.bar_setup)]
    {
        if *setup != test.name {
            let _ = writeln!(text, "{key} = {}", quoted(setup));
        }
    }
    let u = |range: std::ops::Range<usize>| -> Vec<String> {
        test.priors.get(range).unwrap_or_default().iter().map(|prior| uncertainty_um(*prior)).collect()
    };
    for (key, range) in [("workpiece_ball_u_um", 0..3), ("spindle_ball_u_um", 3..6)] {
        let u = u(range);
        if u.iter().any(|u| u != "0") {
            let _ = writeln!(text, "{key} = [{}]", u.join(", "));
        }
    }
    if let [u] = &u(BAR..BAR + 1)[..]
        && u != "0"
    {
        let _ = writeln!(text, "bar_u_um = {u}");
    }
    let held: Vec<String> = (0..machine.axes.len())
        .filter(|axis| !moved.contains(axis))
        .map(|axis| (axis, number(machine.axes[axis].kind.to_display(test.at[axis]))))
        .filter(|(_, position)| position != "0")
        .map(|(axis, position)| format!("{} = {position}", machine.axes[axis].column("")))
        .collect();
    if !held.is_empty() {
        let _ = writeln!(text, "at = {{ {} }}", held.join(", "));
    }
    let _ = writeln!(text, "{motion}");
    Some(text)
}

/// The axes whose positions follow from a motion, and its line.
fn motion_line(motion: &Motion, machine: &Machine) -> Option<(Vec<usize>, String)> {
    let name = |axis: usize| quoted(&machine.axes[axis].name);
    let linear = || (0..machine.axes.len()).filter(|axis| machine.axes[*axis].kind == AxisKind::Linear);
    let range = |kind: AxisKind, from: f64, to: f64, step: f64| {
        let unit = kind.unit();
        let [from, to, step] = [from, to, step].map(|end| number(kind.to_display(end)));
        format!("from_{unit} = {from}, to_{unit} = {to}, step_{unit} = {step}")
    };
    let often = |runs: usize, both_directions: bool| format!("runs = {runs}, both_directions = {both_directions}");
    Some(match *motion {
        Motion::Sweep { axis, from, to, step, speed, runs, both_directions } => {
            let kind = machine.axes[axis].kind;
            let line = format!(
                "sweep = {{ axis = {}, {}, feed_{}_min = {}, {} }}",
                name(axis),
                range(kind, from, to, step),
                kind.unit(),
                number(60.0 * kind.to_display(speed)),
                often(runs, both_directions)
            );
            (vec![axis], line)
        }
        Motion::Circle { first, second, radius, centre, from, to, step, speed, runs, both_directions } => {
            let line = format!(
                "path = {{ kind = \"circle\", plane = \"{}{}\", radius_mm = {}, centre_mm = {}, {}, feed_mm_min = {}, {} }}",
                machine.axes[first].name,
                machine.axes[second].name,
                number(radius),
                point(centre),
                range(AxisKind::Rotary, from, to, step),
                number(60.0 * speed),
                often(runs, both_directions)
            );
            (vec![first, second], line)
        }
        Motion::Follow { axis, from, to, step, speed, runs, both_directions, offset } => {
            let offset = match offset {
                FollowOffset::Radial => "radial",
                FollowOffset::Tangential => "tangential",
                FollowOffset::Axial => "axial",
                FollowOffset::None | FollowOffset::Touching => return None,
            };
            let line = format!(
                "path = {{ kind = \"follow\", axis = {}, offset = \"{offset}\", {}, feed_deg_min = {}, {} }}",
                name(axis),
                range(AxisKind::Rotary, from, to, step),
                number(60.0 * speed.to_degrees()),
                often(runs, both_directions)
            );
            (std::iter::once(axis).chain(linear()).collect(), line)
        }
        Motion::List => return None,
    })
}

/// A standard uncertainty of a set-up length, µm.
fn uncertainty_um(prior: Prior) -> String {
    match prior {
        Prior::Known => "0".to_string(),
        Prior::Gaussian(u) => number(u * 1e3),
        Prior::Free => "inf".to_string(),
    }
}

fn point(mm: [f64; 3]) -> String {
    format!("[{}]", mm.map(number).join(", "))
}

/// A number with nine decimals at most: far below what a control resolves.
fn number(value: f64) -> String {
    let text = format!("{value:.9}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_string() } else { text.to_string() }
}
