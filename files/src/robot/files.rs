//! `machine.toml` and `plan.toml` of a robot.

use std::fmt::Write;

use abbe_model::axis::AxisKind;
use abbe_model::frames::FixedPose;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::chain::{Chain, Joint};
use crate::table::csv::decimal;

/// How the robot is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// A laser tracker and a target at the flange.
    Tracker,
    /// A ball at the flange that sits in sockets.
    Sockets,
}

impl Measured {
    /// Both, by their words.
    pub const WORDS: [(&'static str, Measured); 2] = [("tracker", Measured::Tracker), ("sockets", Measured::Sockets)];
}

/// Largest sweep of a joint in a plan, in each direction, rad and mm.
const SWEEP_RAD: f64 = 1.0;
const SWEEP_MM: f64 = 100.0;
/// Number of steps of a sweep, and the least range that has ends at whole degrees or millimetres.
const STEPS: f64 = 20.0;
const LEAST_WHOLE: f64 = 2.0;
/// Position of the joints that a test holds, rad: away from the stretched arm.
const HELD_RAD: f64 = 0.4;
/// Number of sockets in a plan.
const SOCKETS: usize = 3;

/// The names and texts of the files of a robot; `source` names the file of its maker, `target_mm` is the target or the ball
/// in the frame of the flange.
pub fn files(chain: &Chain, source: &str, measured: Measured, target_mm: [f64; 3]) -> Vec<(String, String)> {
    vec![("machine.toml".into(), machine(chain, source)), ("plan.toml".into(), plan(chain, measured, target_mm))]
}

/// The name of a joint as an axis.
fn axis(joint: usize) -> String {
    format!("J{}", joint + 1)
}

fn list(values: [f64; 3]) -> String {
    format!("[{}]", values.map(decimal).join(", "))
}

/// A text on one line, for comments and quotes.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() || c == '"' || c == '\\' { '_' } else { c }).collect()
}

fn machine(chain: &Chain, source: &str) -> String {
    let names: Vec<String> = (0..chain.joints.len()).map(axis).collect();
    let mut text = format!(
        "# From {}: the chain from {} to {}. All axes with all joints at zero, in the frame of {}.\n",
        plain(source),
        plain(&chain.base),
        plain(&chain.flange),
        plain(&chain.base),
    );
    for assumed in &chain.assumed {
        let _ = writeln!(text, "# Assumed: {}.", plain(assumed));
    }
    let _ = write!(text, "name = \"{}\"\nchain = \"w b {} t\"\n", plain(&chain.name), names.join(" "));
    let FixedPose { xyz_mm, rpy_deg } = FixedPose::from(&chain.end);
    let _ = writeln!(text, "flange = {{ xyz_mm = {}, rpy_deg = {} }}", list(xyz_mm), list(rpy_deg));
    for (number, joint) in chain.joints.iter().enumerate() {
        let (point, direction) = chain.line(number);
        let _ = write!(text, "\n[axis.{}]\n", names[number]);
        // A number alone is that of the row.
        if !joint.name.bytes().all(|byte| byte.is_ascii_digit()) {
            let _ = writeln!(text, "joint = {}", toml_edit::Value::from(joint.name.as_str()));
        }
        let (kind, unit) = match joint.kind {
            AxisKind::Rotary => ("rotary", "travel_deg"),
            AxisKind::Linear => ("linear", "travel_mm"),
        };
        let _ = write!(
            text,
            "kind = \"{kind}\"\ndirection = {}\norigin_mm = {}\n",
            list(direction.into()),
            list(point.into())
        );
        if let Some(ends) = joint.travel {
            let ends = ends.map(|end| decimal(joint.kind.to_display(end)));
            let _ = writeln!(text, "{unit} = [{}]", ends.join(", "));
        }
    }
    text
}

/// The position at which a test holds a joint.
fn held(chain: &Chain, joint: usize) -> f64 {
    let joint_of = &chain.joints[joint];
    let wanted = match joint_of.kind {
        AxisKind::Rotary => HELD_RAD * if joint.is_multiple_of(2) { 1.0 } else { -1.0 },
        AxisKind::Linear => joint_of.travel.map_or(0.0, |[lower, upper]| 0.5 * (lower + upper)),
    };
    within(wanted, joint_of.travel)
}

/// The position at which a test holds a joint, deg or mm: three places where they lie within its travel.
fn held_to_display(chain: &Chain, joint: usize) -> f64 {
    let Joint { kind, travel, .. } = chain.joints[joint];
    let position = kind.to_display(held(chain, joint));
    let (lower, upper) = travel.map_or((f64::MIN, f64::MAX), |ends| ends.map(|end| kind.to_display(end)).into());
    let places = [position * 1e3, position * 1e3 - 0.5, position * 1e3 + 0.5].map(|near| near.round() / 1e3);
    places.into_iter().find(|near| (lower..=upper).contains(near)).unwrap_or(position)
}

fn within(position: f64, travel: Option<[f64; 2]>) -> f64 {
    travel.map_or(position, |[lower, upper]| position.clamp(lower, upper))
}

/// The pose of the flange at these positions, mm.
fn flange(chain: &Chain, positions: &[f64]) -> Isometry3<f64> {
    let mut pose = Isometry3::identity();
    for (joint, position) in positions.iter().enumerate() {
        let (point, direction) = chain.line(joint);
        let motion = match chain.joints[joint].kind {
            AxisKind::Linear => {
                Isometry3::from_parts(Translation3::from(direction * *position), UnitQuaternion::identity())
            }
            AxisKind::Rotary => {
                let turn = UnitQuaternion::from_scaled_axis(direction * *position);
                Isometry3::from_parts(Translation3::from(point - turn * point), turn)
            }
        };
        pose *= motion;
    }
    pose * chain.end
}

fn plan(chain: &Chain, measured: Measured, target_mm: [f64; 3]) -> String {
    let at_zero = chain.end * Point3::from(target_mm);
    let point = list([at_zero.x, at_zero.y, at_zero.z]);
    let columns: Vec<String> = (chain.joints.iter().enumerate())
        .map(|(number, joint)| {
            format!("{}_{}", axis(number).to_lowercase(), if joint.kind == AxisKind::Linear { "mm" } else { "deg" })
        })
        .collect();
    match measured {
        Measured::Tracker => tracker(chain, &point, target_mm, &columns),
        Measured::Sockets => sockets(chain, &point, target_mm, &columns),
    }
}

fn tracker(chain: &Chain, point: &str, target_mm: [f64; 3], columns: &[String]) -> String {
    let mut text = format!(
        "# A plan for a laser tracker: each joint turns alone with the target at {} in the frame of the flange.\n\
         # `abbe plan plan.toml` says what these tests identify, `abbe poses plan.toml --poses 60` chooses poses instead.\n\
         # Measured poses: `abbe import poses.csv --session plan.toml --like {}`, columns {}, px_mm, py_mm, pz_mm.\n\n\
         [machine]\nfile = \"machine.toml\"\n\n\
         [instrument]\nkind = \"tracker\"\n# Enter the standard deviation of one coordinate.\nnoise_um = 20\n",
        list(target_mm),
        axis(0),
        columns.join(", ")
    );
    for (number, joint) in chain.joints.iter().enumerate() {
        let name = axis(number);
        let (reach, unit, feed) = match joint.kind {
            AxisKind::Rotary => (SWEEP_RAD, "deg", "feed_deg_min = 600"),
            AxisKind::Linear => (SWEEP_MM, "mm", "feed_mm_min = 3000"),
        };
        let middle = held(chain, number);
        let ends = [-reach, reach].map(|by| joint.kind.to_display(within(middle + by, joint.travel)));
        // Whole degrees or millimetres within the travel, unless it is short.
        let whole = [ends[0].ceil(), ends[1].floor()];
        let [from, to] = if whole[1] - whole[0] >= LEAST_WHOLE { whole } else { ends };
        let step = (to - from) / STEPS;
        let others = (0..chain.joints.len())
            .filter(|other| *other != number)
            .map(|other| format!("{} = {}", columns[other], decimal(held_to_display(chain, other))));
        let _ = write!(
            text,
            "\n[[test]]\nname = \"{name}\"\n# The target in the tool frame, which lies in the frame of the base with all joints at zero.\n\
             target_mm = {point}\ntarget_u_um = inf\nsetup = \"tracker\"\nspindle_setup = \"target\"\nat = {{ {} }}\n\
             sweep = {{ axis = \"{name}\", from_{unit} = {}, to_{unit} = {}, step_{unit} = {}, {feed}, runs = 1 }}\n",
            others.collect::<Vec<_>>().join(", "),
            decimal(from),
            decimal(to),
            decimal(step),
        );
    }
    text
}

fn sockets(chain: &Chain, point: &str, target_mm: [f64; 3], columns: &[String]) -> String {
    let mut text = format!(
        "# A plan for a ball in {SOCKETS} sockets; the ball is at {} in the frame of the flange.\n\
         # `abbe poses plan.toml --poses 40 --out poses.csv` chooses poses. Enter where the sockets are.\n\
         # Measured poses: one file for each socket with the columns {}.\n\n\
         [machine]\nfile = \"machine.toml\"\n\n\
         [instrument]\nkind = \"socket\"\n# Enter how well the ball repeats in its socket.\nnoise_um = 20\n",
        list(target_mm),
        columns.join(", ")
    );
    for number in 0..SOCKETS {
        let name = format!("S{}", number + 1);
        let turned: Vec<f64> = (0..chain.joints.len())
            .map(|joint| {
                let by = match chain.joints[joint].kind {
                    AxisKind::Rotary => 0.6 * (number as f64 - 1.0) * if joint == 0 { 1.0 } else { 0.3 },
                    AxisKind::Linear => 0.0,
                };
                within(held(chain, joint) + by, chain.joints[joint].travel)
            })
            .collect();
        let place = flange(chain, &turned) * Point3::from(target_mm);
        let rounded: Vector3<f64> = place.coords.map(|x| (x * 10.0).round() / 10.0);
        let _ = write!(
            text,
            "\n[[test]]\nname = \"{name}\"\ndata = \"{name}.csv\"\nsocket = \"{name}\"\nsocket_mm = {}\nball_mm = {point}\nball_u_um = inf\n",
            list(rounded.into())
        );
    }
    text
}
