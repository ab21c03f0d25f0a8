//! The frames of a set-up after a fit: where an instrument stands and how its target is mounted, each as a rigid
//! transformation with the uncertainty of its six degrees of freedom.
//!
//! A tracker or a system of poses reads `m = B · E · P` (`stand.rs`), so that its frame in that of the base is
//! `(B · E)⁻¹`. A body at the tool has the pose `Trans(P) · D · H` in the tool frame (`pose.rs`). For the two sides of
//! `A X = Y B` these are the base–world and the hand–eye transformation. The uncertainty follows from the covariance of
//! the parameters, `J C Jᵀ`, with rotations as rotation vectors about the axes of the outer frame and `J` by central
//! differences.
//!
//! Location errors of the joints that are not separable from a pose are held at nominal
//! ([`Gauge::Machine`]), and the pose is relative to them.

use std::f64::consts::TAU;

use abbe_model::chain::{Frame, Machine};
use abbe_model::frames::{FixedPose, roll_pitch_yaw, turn};
use abbe_model::instrument::{Station, Target};
use faer::Mat;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Fit;
use super::base::{BaseParameters, Gauge, base_parameters};
use crate::problem::Problem;

/// A frame of the set-up, or a point with the directions of its outer frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetUpFrame {
    /// The outer frame: `base`, `flange`, `tool`, `table`.
    pub parent: String,
    /// The inner frame or point: `tracker`, `body`, `socket[S1]`.
    pub child: String,
    /// What the transformation does: coordinates in the base frame of a point in the tracker frame.
    pub meaning: String,
    /// Whether it is a point, so that the readings say nothing of a rotation.
    pub is_point: bool,
    /// The transformation, row by row, mm.
    pub matrix: [[f64; 4]; 4],
    /// The origin of the inner frame in the outer one, mm.
    pub xyz_mm: [f64; 3],
    /// Its standard uncertainty, mm; `null` where the readings do not determine it.
    pub u_xyz_mm: [Option<f64>; 3],
    /// The rotation as a quaternion x, y, z, w with w ≥ 0.
    pub quaternion_xyzw: [f64; 4],
    /// The rotation as `Rz(yaw)·Ry(pitch)·Rx(roll)`: roll, pitch, yaw about the fixed axes X, Y, Z of the outer frame, degrees.
    pub rpy_deg: [f64; 3],
    /// Standard uncertainty of roll, pitch and yaw, degrees; it grows without limit towards a pitch of 90°.
    pub u_rpy_deg: [Option<f64>; 3],
    /// Standard uncertainty of the rotation about the axes X, Y, Z of the outer frame, degrees.
    pub u_rotation_deg: [Option<f64>; 3],
    /// Covariance of x, y, z (mm) and of the rotation about the axes of the outer frame (degrees).
    pub covariance: [[f64; 6]; 6],
    /// Parameters at nominal that the readings do not separate from it: it is determined relative to them.
    pub relative_to: Vec<String>,
    /// The static transform of ROS 2, m.
    pub ros: String,
}

/// What determines a pose beside its parameters.
enum Nominal {
    /// `B` of an instrument.
    Stand(Isometry3<f64>),
    /// A point in its frame, mm, and the orientation of a body there.
    Body([f64; 3], UnitQuaternion<f64>),
}

/// A frame or a point of the set-up of a test.
struct Placed {
    name: &'static str,
    /// The body on which it is.
    on: Frame,
    nominal: Nominal,
    /// Its first parameter among those of the instrument.
    first: usize,
    /// Number of its parameters: 3 of a point, 6 of a pose.
    count: usize,
}

impl Placed {
    fn point(name: &'static str, target: &Target<f64>, first: usize) -> Placed {
        let nominal = Nominal::Body(target.mm, UnitQuaternion::identity());
        Placed { name, on: target.frame, nominal, first, count: 3 }
    }

    fn stand(name: &'static str, rotation: [[f64; 3]; 3], origin: [f64; 3]) -> Placed {
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_fn(|i, j| rotation[i][j]));
        let stand = Isometry3::from_parts(Translation3::from(Vector3::from(origin)), rotation.into());
        Placed { name, on: Frame::Bed, nominal: Nominal::Stand(stand), first: 0, count: 6 }
    }

    fn of(station: &Station<f64>) -> Vec<Placed> {
        match station {
            Station::Tracker(tracker) => vec![
                Placed::stand("tracker", tracker.stand.rotation, tracker.stand.origin),
                Placed::point("target", &tracker.target, 6),
            ],
            Station::Pose(pose) => {
                let nominal = Nominal::Body(pose.target.mm, pose.turn.unwrap_or_default());
                let body = Placed { name: "body", on: pose.target.frame, nominal, first: 6, count: 6 };
                vec![Placed::stand("instrument", pose.stand.rotation, pose.stand.origin), body]
            }
            Station::Socket(socket) => {
                let place = Target { frame: Frame::Bed, mm: socket.socket };
                vec![Placed::point("socket", &place, 0), Placed::point("ball", &socket.ball, 3)]
            }
            Station::Distance(distance) => {
                vec![Placed::point("station", &distance.station, 0), Placed::point("reflector", &distance.reflector, 3)]
            }
            _ => Vec::new(),
        }
    }

    /// The pose in its frame with these parameters, mm and rad.
    fn pose(&self, [x, y, z, a, b, c]: [f64; 6]) -> Isometry3<f64> {
        let rotation = turn(0, a) * turn(1, b) * turn(2, c);
        match self.nominal {
            Nominal::Stand(stand) => (stand * Isometry3::from_parts(Translation3::new(x, y, z), rotation)).inverse(),
            Nominal::Body(point, held) => {
                let place = Translation3::new(point[0] + x, point[1] + y, point[2] + z);
                Isometry3::from_parts(place, rotation * held)
            }
        }
    }
}

/// The word of the frame in which points of a body are stated, and what brings them there.
fn outer(machine: &Machine, frame: Frame) -> (String, Isometry3<f64>) {
    let is_base = frame == Frame::Bed || (frame == Frame::Table && machine.workpiece_side == 0);
    match &machine.flange {
        _ if is_base => ("base".to_string(), Isometry3::identity()),
        Some(flange) if frame == Frame::Tool => ("flange".to_string(), Isometry3::from(flange).inverse()),
        _ => (frame.word(machine), Isometry3::identity()),
    }
}

/// The frames and points that a fit estimates; none where the null space of the readings has no stable parametrisation.
pub fn frames(problem: &Problem, fit: &Fit) -> Vec<SetUpFrame> {
    if problem.models.iter().all(|model| Placed::of(model.station()).is_empty()) {
        return Vec::new();
    }
    let Ok(base) = base_parameters(problem, fit, Gauge::Machine) else { return Vec::new() };
    let base = &base;
    let machine = &problem.session.machine;
    let list = &problem.parameters.list;
    let mut found: Vec<(SetUpFrame, &str)> = Vec::new();
    for (test, model) in problem.tests.iter().zip(&problem.models) {
        let unknowns = model.station().kind().unknowns();
        for placed in Placed::of(model.station()) {
            let (parent, before) = outer(machine, placed.on);
            let group = test.group(unknowns[placed.first].shared_by);
            if found.iter().any(|(frame, placed_group)| {
                *placed_group == group && frame.child == placed.name && frame.parent == parent
            }) {
                continue;
            }
            let parameter = |unknown: usize| {
                let id = unknowns[unknown].id(test.group(unknowns[unknown].shared_by));
                list.iter().position(|parameter| parameter.id == id)
            };
            let parameters: Vec<Option<usize>> = (placed.first..placed.first + placed.count).map(parameter).collect();
            if parameters.iter().any(Option::is_some) {
                let estimated = Estimated { problem, fit, base, placed: &placed, before, parameters };
                found.push((estimated.frame(parent), group));
            }
        }
    }
    let is_one_of_several = |(frame, _): &(SetUpFrame, &str)| {
        found.iter().filter(|(other, _)| (&other.parent, &other.child) == (&frame.parent, &frame.child)).count() > 1
    };
    let several: Vec<bool> = found.iter().map(is_one_of_several).collect();
    let named = |((mut frame, group), is_one_of_several): ((SetUpFrame, &str), bool)| {
        if is_one_of_several {
            frame.child = format!("{}[{group}]", frame.child);
        }
        let SetUpFrame { parent, child, .. } = &frame;
        let inner = if frame.is_point { format!("the {child}") } else { format!("a point in the {child} frame") };
        frame.meaning = format!("{parent} → {child}: coordinates in the {parent} frame of {inner}");
        frame.ros = ros(&frame);
        frame
    };
    found.into_iter().zip(several).map(named).collect()
}

/// Step of the central differences, mm and rad: truncation and rounding are about 1e-10 of a derivative.
const STEP: f64 = 1e-5;
/// Share of physical sizes below which a dependence is rounding.
const ROUNDING: f64 = 1e-7;

/// A frame or a point with its parameters, by index; `None` of a known one.
struct Estimated<'e> {
    problem: &'e Problem,
    fit: &'e Fit,
    base: &'e BaseParameters,
    placed: &'e Placed,
    /// From the frame of its body to its outer frame.
    before: Isometry3<f64>,
    parameters: Vec<Option<usize>>,
}

impl Estimated<'_> {
    /// The pose with one of the parameters changed.
    fn pose(&self, changed: Option<usize>, by: f64) -> Isometry3<f64> {
        let value = |k: usize| {
            let estimate = self.parameters.get(k).copied().flatten().map_or(0.0, |j| self.base.beta[j]);
            if changed == Some(k) { estimate + by } else { estimate }
        };
        self.before * self.placed.pose(std::array::from_fn(value))
    }

    /// The derivatives by a parameter of x, y, z, of the rotation about X, Y, Z of the outer frame, and of roll, pitch, yaw.
    fn derivatives(&self, parameter: usize) -> [f64; 9] {
        let [less, more] = [-STEP, STEP].map(|by| self.pose(Some(parameter), by));
        let shift = more.translation.vector - less.translation.vector;
        let rotation = (more.rotation * less.rotation.inverse()).scaled_axis();
        let [from, to] = [less, more].map(|pose| Vector3::from(roll_pitch_yaw(&pose.rotation)));
        let turned = (to - from).map(|angle| angle - TAU * (angle / TAU).round());
        std::array::from_fn(|row| [shift, rotation, turned][row / 3][row % 3] / (2.0 * STEP))
    }

    /// Whether a parameter changes with one that is held at nominal.
    fn depends(&self, parameter: usize, held: usize) -> bool {
        let list = &self.problem.parameters.list;
        let change = self.base.transfer[(parameter, held)] * list[held].size;
        parameter == held || change.abs() > ROUNDING * list[parameter].size
    }

    /// The parameters at nominal that the readings do not separate from these: those that the gauge holds, and the first of
    /// each combination that the readings determine by less than their noise.
    fn relative_to(&self, estimated: &[usize]) -> Vec<String> {
        let rank = &self.fit.rank;
        let moves = |held: &&usize| estimated.iter().any(|j| self.depends(*j, **held));
        let mut held: Vec<usize> = self.base.held.iter().filter(moves).copied().collect();
        for ((combination, pivot), weak_u) in rank.null_combinations.iter().zip(&rank.pivots).zip(&rank.weak_u) {
            if weak_u.is_some() && estimated.iter().any(|j| combination[*j].abs() > ROUNDING) {
                held.push(*pivot);
            }
        }
        held.sort_unstable();
        held.dedup();
        held.into_iter().map(|j| self.problem.parameters.list[j].id.to_string()).collect()
    }

    fn frame(&self, parent: String) -> SetUpFrame {
        let list = &self.problem.parameters.list;
        let (places, estimated): (Vec<usize>, Vec<usize>) =
            self.parameters.iter().enumerate().filter_map(|(k, j)| Some((k, (*j)?))).unzip();
        let columns: Vec<[f64; 9]> = places.iter().map(|k| self.derivatives(*k)).collect();
        let jacobian = Mat::from_fn(9, columns.len(), |row, column| columns[column][row]);
        let of_parameters =
            Mat::from_fn(columns.len(), columns.len(), |a, b| self.base.covariance[(estimated[a], estimated[b])]);
        let covariance = &jacobian * of_parameters * jacobian.transpose();
        // What shares a direction with a held quantity of the set-up has no value of its own.
        let held: Vec<usize> = self.base.held.iter().filter(|held| list[**held].id.is_setup()).copied().collect();
        let is_open = |row: usize| {
            estimated.iter().zip(&columns).any(|(j, derivatives)| {
                (derivatives[row] * list[*j].size).abs() > ROUNDING && held.iter().any(|held| self.depends(*j, *held))
            })
        };
        let is_point = self.parameters.len() == 3;
        let u = |row: usize| (!is_open(row)).then(|| covariance[(row, row)].max(0.0).sqrt());
        let degrees = |row: usize| u(row).map(f64::to_degrees).filter(|_| !is_point);
        let scale = |row: usize| if row < 3 { 1.0 } else { 1.0_f64.to_degrees() };
        let pose = self.pose(None, 0.0);
        let matrix = pose.to_homogeneous();
        let quaternion = pose.rotation.coords * if pose.rotation.w < 0.0 { -1.0 } else { 1.0 };
        let FixedPose { xyz_mm, rpy_deg } = FixedPose::from(&pose);
        SetUpFrame {
            parent,
            child: self.placed.name.to_string(),
            meaning: String::new(),
            is_point,
            matrix: std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)])),
            xyz_mm,
            u_xyz_mm: std::array::from_fn(u),
            quaternion_xyzw: quaternion.into(),
            rpy_deg,
            u_rpy_deg: std::array::from_fn(|i| degrees(6 + i)),
            u_rotation_deg: std::array::from_fn(|i| degrees(3 + i)),
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i, j)] * scale(i) * scale(j))),
            relative_to: self.relative_to(&estimated),
            ros: String::new(),
        }
    }
}

/// The command that publishes a frame as a static transform.
fn ros(frame: &SetUpFrame) -> String {
    let [x, y, z] = frame.xyz_mm.map(|mm| mm * 1e-3);
    let [qx, qy, qz, qw] = frame.quaternion_xyzw;
    let name = |name: &str| {
        let plain = name.trim_end_matches(']').chars();
        plain.map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect::<String>()
    };
    format!(
        "ros2 run tf2_ros static_transform_publisher --x {x:.9} --y {y:.9} --z {z:.9} --qx {qx:.12} --qy {qy:.12} \
         --qz {qz:.12} --qw {qw:.12} --frame-id {} --child-frame-id {}",
        name(&frame.parent),
        name(&frame.child)
    )
}
