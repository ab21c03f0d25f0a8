//! The plan of a structural code: two tests of each rotary axis, a circle of each pair of linear axes.
//!
//! The balls are mounted once. Each test states the positions of the axes that it does not move. These are the
//! coordinates that the operator enters and that the data contain. Tests with the same bar and the same balls follow each
//! other.

use std::fmt::Write;

use abbe_model::axis::AxisKind;

use super::body::{Body, Side};
use super::geometry::{Geometry, STEM_MM};
use super::mounts::{Mounts, point_text};
use super::rotary::{self, PlannedMotion, PlannedTest};

/// Names of the directions of R, and of the angles about them.
const LETTERS: [&str; 3] = ["X", "Y", "Z"];
const ANGLES: [&str; 3] = ["A", "B", "C"];

const HEAD: &str = "[machine]\n\
    # The chain and its axes, beside this file.\n\
    file = \"machine.toml\"\n\n\
    [constants]\n\
    # Distance from a rotary axis to the ball that turns about it, mm. Lengths below may be expressions of these names.\n\
    R = 100.0\n\
    # Calibrated length of the bar, mm.\n\
    R_c = 100.0\n\
    # The same with an extension of 50 mm.\n\
    R_e = 150.0\n\n\
    [instrument]\n\
    # \"ballbar\"; others are \"probe\", \"tracker\", \"socket\".\n\
    kind = \"ballbar\"\n\
    # Standard deviation of one reading, µm.\n\
    noise_um = 0.3\n\
    # Resolution of a reading, µm.\n\
    resolution_um = 0.1\n\n";

/// The priors of the set-up.
const PRIORS: &str = "# Set-up priors: standard uncertainty of the ball positions and of the bar length, µm. 0: exactly known, inf: unknown.\n\
    workpiece_ball_u_um = [2, 2, 2]\n\
    spindle_ball_u_um = [1, 1, 1]\n\
    bar_u_um = 0.5\n";

/// The text of the plan; `None` if it would have no test.
pub(super) fn text(bodies: &[Body], geometry: &Geometry) -> Option<String> {
    let mut mounts = Mounts::of(bodies, geometry);
    let (mut planned, mut untested): (Vec<PlannedTest>, Vec<usize>) = (Vec::new(), Vec::new());
    for turning in (0..bodies.len()).filter(|index| bodies[*index].kind == AxisKind::Rotary) {
        let tests = rotary::tests(&mut mounts, bodies, turning, geometry);
        if tests.is_empty() {
            untested.push(turning);
        }
        planned.extend(tests);
    }
    let pairs = pairs(bodies);
    planned.extend(pairs.iter().map(|pair| circle(bodies, *pair, &mut mounts)));
    if planned.is_empty() {
        return None;
    }
    // The bar gets its extension once, and a ball is mounted again as seldom as possible.
    planned.sort_by_key(|test| (test.extended, test.setting.spindle, test.setting.workpiece));
    let mut text = HEAD.to_string();
    clearance(&mut text, geometry);
    unknowns(&mut text, bodies, &pairs, &untested);
    planned.iter().for_each(|test| self::test(&mut text, bodies, &mounts, test));
    Some(text)
}

/// The sizes of bar and holders.
fn clearance(text: &mut String, geometry: &Geometry) {
    let _ = write!(
        text,
        "[clearance]\n\
         # Radius of the bar, mm. With the bodies of the machine these sizes decide what can collide.\n\
         bar_radius_mm = {STEM_MM}\n\
         # The stem from the table to the workpiece ball.\n\
         workpiece_holder = {{ radius_mm = {STEM_MM}, length_mm = {stand} }}\n\
         # The stem from the spindle nose to the spindle ball.\n\
         spindle_holder = {{ radius_mm = {STEM_MM}, length_mm = {gauge} }}\n\
         # Less clearance causes a warning.\n\
         least_mm = 5\n\n",
        stand = geometry.stand(),
        gauge = geometry.gauge,
    );
}

/// The errors to estimate.
fn unknowns(text: &mut String, bodies: &[Body], pairs: &[[usize; 2]], untested: &[usize]) {
    text.push_str(
        "[unknowns]\n# The errors to estimate, by ISO 230-1: EX0C is the position error of C along X, EA0C its orientation error about X.\n\
         errors = [\n",
    );
    let given = given(bodies);
    for (index, body) in bodies.iter().enumerate() {
        if body.kind != AxisKind::Rotary {
            continue;
        }
        if untested.contains(&index) {
            let _ = writeln!(
                text,
                "  # {}: no linear axes follow it with a bar that stays clear of the head; its errors are not estimated.",
                body.name
            );
            continue;
        }
        let across = || (0..3).filter(|k| *k != body.along);
        let name = |letter: &str| format!("E{letter}0{}", body.name);
        let listed: Vec<String> = across()
            .filter(|k| !given.iter().any(|(axis, along, _)| (*axis, *along) == (index, *k)))
            .map(|k| LETTERS[k])
            .chain(across().map(|k| ANGLES[k]))
            .map(|letter| format!("\"{}\"", name(letter)))
            .collect();
        let mut left_out = String::new();
        for (_, along, other) in given.iter().filter(|(axis, _, _)| *axis == index) {
            let _ = write!(
                left_out,
                "; {own} is omitted: the readings depend only on its difference from E{along}0{other}, so {name} defines the origin of R along {along}",
                own = name(LETTERS[*along]),
                along = LETTERS[*along],
                other = bodies[*other].name,
                name = body.name,
            );
        }
        let _ = writeln!(
            text,
            "  {},  # position and orientation of {name}{left_out}",
            listed.join(", "),
            name = body.name
        );
    }
    for [first, second] in pairs.iter().map(|pair| pair.map(|axis| &bodies[axis])) {
        let about = ANGLES[3 - first.along - second.along];
        let _ = writeln!(text, "  \"E{about}0{}\",  # squareness of {} and {}", second.name, first.name, second.name);
    }
    text.push_str("]\n");
}

/// Position errors of axes of the head that are not estimated, each with its direction and an axis of the table. If
/// both sides have rotary axes across a direction, the readings depend only on the difference of their positions along
/// it.
fn given(bodies: &[Body]) -> Vec<(usize, usize, usize)> {
    let across = |side: Side, along: usize| {
        (0..bodies.len()).filter(move |index| {
            let body = &bodies[*index];
            body.kind == AxisKind::Rotary && body.side() == side && body.along != along
        })
    };
    // On each side the axis nearest to the bed carries the others.
    (0..3)
        .filter_map(|along| {
            let head = across(Side::Tool, along).next()?;
            let table = across(Side::Workpiece, along).next_back()?;
            Some((head, along, table))
        })
        .collect()
}

/// Pairs of linear axes at right angles, with one axis per direction.
fn pairs(bodies: &[Body]) -> Vec<[usize; 2]> {
    let mut first_along: Vec<usize> = Vec::new();
    for (index, body) in bodies.iter().enumerate() {
        let is_new = first_along.iter().all(|other| bodies[*other].along != body.along);
        if body.kind == AxisKind::Linear && is_new {
            first_along.push(index);
        }
    }
    first_along.sort_by_key(|index| bodies[*index].along);
    let mut pairs = Vec::new();
    for (place, first) in first_along.iter().enumerate() {
        for second in &first_along[place + 1..] {
            pairs.push([*first, *second]);
        }
    }
    pairs
}

/// Two linear axes that move the spindle ball on a circle.
fn circle(bodies: &[Body], pair: [usize; 2], mounts: &mut Mounts) -> PlannedTest {
    let [a, b] = pair.map(|axis| bodies[axis].name.as_str());
    PlannedTest {
        name: format!("{a}{b}"),
        about: format!("{a} and {b} move the spindle ball on a circle about the workpiece ball."),
        extended: false,
        setting: mounts.circle(bodies, pair),
        standing: Side::Tool,
        tilted: None,
        moving: pair.to_vec(),
        motion: PlannedMotion::Circle,
    }
}

/// A test with its motion.
fn test(text: &mut String, bodies: &[Body], mounts: &Mounts, test: &PlannedTest) {
    let _ = writeln!(text, "\n# {}", test.about);
    remounted(text, test);
    let _ = write!(text, "[[test]]\nname = \"{}\"\n", test.name);
    common(text, bodies, mounts, test);
    let names: String = test.moving.iter().map(|axis| bodies[*axis].name.as_str()).collect();
    let Some(last) = test.moving.last().map(|axis| &bodies[*axis]) else { return };
    if !matches!(test.motion, PlannedMotion::Circle) {
        text.push_str(
            "# The axis moves there and back. Adapt the ends to its travel. `runs` repeats both directions.\n",
        );
    }
    let _ = match test.motion {
        PlannedMotion::Sweep { from, to } => {
            let step = if last.along == 2 { 2 } else { 1 };
            writeln!(
                text,
                "sweep = {{ axis = \"{names}\", from_deg = {from}, to_deg = {to}, step_deg = {step}, feed_deg_min = 500, runs = 1, both_directions = true }}"
            )
        }
        PlannedMotion::Follow { offset, to } => writeln!(
            text,
            "path = {{ kind = \"follow\", axis = \"{names}\", offset = \"{offset}\", from_deg = -{to}, to_deg = {to}, step_deg = 1, feed_deg_min = 300, runs = 1, both_directions = true }}"
        ),
        PlannedMotion::Circle => {
            // Z is the second axis. A table goes down where the spindle ball is above the workpiece ball.
            let (what, ends) = match (last.along, last.on_table) {
                (2, false) => ("an arc of 220° above the table", "from_deg = -20, to_deg = 200, "),
                (2, true) => ("an arc of 220° with the spindle ball above", "from_deg = -200, to_deg = 20, "),
                _ => ("a full circle from the first towards the second", ""),
            };
            writeln!(
                text,
                "# Two linear axes, {what} and back. `runs` repeats both directions.\n\
                 path = {{ kind = \"circle\", plane = \"{names}\", radius_mm = \"R_c\", {ends}step_deg = 2, feed_mm_min = 1000, runs = 1, both_directions = true }}"
            )
        }
    };
}

/// States that no axis can bring the balls together, so that one is mounted again.
fn remounted(text: &mut String, PlannedTest { setting, standing, .. }: &PlannedTest) {
    let ball = if *standing == Side::Tool { "spindle" } else { "workpiece" };
    if setting.remounted_along.is_empty() {
        return;
    }
    let along: Vec<&str> = setting.remounted_along.iter().map(|k| LETTERS[*k]).collect();
    let _ = writeln!(
        text,
        "# No linear axis can move the balls there along {}: the {ball} ball is mounted again for this test.",
        along.join(" and ")
    );
}

/// The entries that all tests have: bar, balls, set-ups, priors, and positions of the axes that the test does not move.
fn common(text: &mut String, bodies: &[Body], mounts: &Mounts, test: &PlannedTest) {
    let setting = &test.setting;
    let bar = if test.extended { "R_e" } else { "R_c" };
    let _ = write!(
        text,
        "# Calibrated length.\n\
         bar_mm = \"{bar}\"\n\
         # The workpiece ball in the frame of the table, the spindle ball in that of the tool, all axes at zero.\n\
         workpiece_ball_mm = {workpiece}\n\
         spindle_ball_mm = {spindle}\n\
         # Tests with the same set-up names share the workpiece ball, the spindle ball and the bar, which are mounted once. Use another name for a\n\
         # test before which one of them is mounted again.\n\
         setup = \"P{p}\"\n\
         spindle_setup = \"S{s}\"\n\
         bar_setup = \"{bar}\"\n\
         {PRIORS}",
        workpiece = point_text(&mounts.workpiece[setting.workpiece]),
        spindle = point_text(&mounts.spindle[setting.spindle]),
        p = setting.workpiece + 1,
        s = setting.spindle + 1,
    );
    let linear = setting.at.iter().map(|(name, position)| format!("{}_mm = {}", name.to_lowercase(), position.text()));
    let stands = |(index, body): &(usize, &Body)| body.kind == AxisKind::Rotary && !test.moving.contains(index);
    let rotary = bodies.iter().enumerate().filter(stands).map(|(index, body)| {
        let deg = test.tilted.filter(|(other, _)| *other == index).map_or(0.0, |(_, deg)| deg);
        format!("{}_deg = {deg}", body.name.to_lowercase())
    });
    let at: Vec<String> = linear.chain(rotary).collect();
    if !at.is_empty() {
        let _ = writeln!(
            text,
            "# Positions of the other axes, as the operator enters them and the data contain them.\nat = {{ {} }}",
            at.join(", ")
        );
    }
}
