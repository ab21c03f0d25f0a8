//! Robots from the files of their makers: `abbe new --from-urdf` and `--from-dh`.
//!
//! The forward kinematics of the written machines are compared with MuJoCo, which reads the URDF itself, and with the product
//! of the published Denavit–Hartenberg parameters.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use abbe::files::{self, ReadOptions};
use abbe::model::axis::AxisKind;
use abbe::model::chain::{AxisPosition, BodyErrors, Frame, Machine};
use abbe::model::frames::Point;
use nalgebra::{Matrix4, Rotation3, Vector3};
use rand::{RngExt, SeedableRng};

mod calibrated;
mod refused;
mod tables;

use crate::suite::{abbe, text, workspace};

const ROBOTS: [&str; 6] = ["ur5e", "ur10", "panda", "iiwa14", "irb120", "scara"];

fn urdf(name: &str) -> PathBuf {
    workspace().join("tests/robots").join(format!("{name}.urdf"))
}

fn success(output: &std::process::Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The machine that the command writes for a robot, and its folder.
fn created(place: &Path, name: &str, arguments: &[&str]) -> (Machine, PathBuf) {
    let folder = place.join(name);
    success(&abbe(&[&["new", text(&folder)], arguments].concat()));
    (files::machine(&folder.join("machine.toml")).unwrap(), folder)
}

/// A point of the flange in the tool frame of a machine: the target of its plan.
fn target_mm(folder: &Path) -> [f64; 3] {
    let options = ReadOptions { read_data: false, ..ReadOptions::default() };
    files::session(&folder.join("plan.toml"), &options).unwrap().tests[0].station.tool_point().mm
}

fn point_mm(machine: &Machine, q: &[f64], tool_mm: [f64; 3]) -> Vector3<f64> {
    let state: Vec<AxisPosition<f64>> =
        machine.axes.iter().zip(q).map(|(axis, q)| AxisPosition::new(axis.kind, *q)).collect();
    let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
    Vector3::from(machine.in_r(Frame::Tool, &state, &none, Point(tool_mm)).0)
}

/// Random positions within the travel of the axes, mm and rad.
fn positions(machine: &Machine, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut one = || {
        let of_axis = |axis: &abbe::model::axis::Axis| {
            let [low, high] = axis.travel.unwrap_or([-3.0, 3.0]);
            low + (high - low) * random.random::<f64>()
        };
        machine.axes.iter().map(of_axis).collect()
    };
    (0..count).map(|_| one()).collect()
}

const TARGET: [f64; 3] = [12.0, -34.0, 56.0];

/// Where MuJoCo puts the target at the last link, mm, for positions in m and rad.
fn of_mujoco(python: &Path, file: &Path, tip: &str, positions: &[Vec<f64>], target: [f64; 3]) -> Vec<Vector3<f64>> {
    let script = r#"
import json, sys
import numpy as np, mujoco
xml = open(sys.argv[1]).read()
at = xml.index(">", xml.index("<robot")) + 1
xml = xml[:at] + '<mujoco><compiler fusestatic="false" discardvisual="false"/></mujoco>' + xml[at:]
m = mujoco.MjModel.from_xml_string(xml); d = mujoco.MjData(m)
given = json.load(sys.stdin)
body = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, sys.argv[2])
points = []
for q in given["positions"]:
    d.qpos[:] = q
    mujoco.mj_forward(m, d)
    points.append(list((d.xpos[body] + d.xmat[body].reshape(3, 3) @ (np.array(given["target"]) * 1e-3)) * 1e3))
print(json.dumps(points))
"#;
    let given = serde_json::json!({"positions": positions, "target": target}).to_string();
    let mut child = std::process::Command::new(python)
        .args(["-c", script, text(file), tip])
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::io::Write::write_all(child.stdin.as_mut().unwrap(), given.as_bytes()).unwrap();
    drop(child.stdin.take());
    let points: Vec<[f64; 3]> = serde_json::from_str(&success(&child.wait_with_output().unwrap())).unwrap();
    points.into_iter().map(Vector3::from).collect()
}

/// Positions as MuJoCo counts them.
fn in_metres(machine: &Machine, positions: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let scaled = |q: &Vec<f64>| {
        let of_axis =
            |(q, axis): (&f64, &abbe::model::axis::Axis)| if axis.kind == AxisKind::Linear { q * 1e-3 } else { *q };
        q.iter().zip(&machine.axes).map(of_axis).collect()
    };
    positions.iter().map(scaled).collect()
}

fn tip(name: &str) -> &'static str {
    match name {
        "panda" => "panda_link8",
        "iiwa14" => "iiwa_link_ee",
        "scara" => "flange",
        _ => "tool0",
    }
}

#[test]
fn six_robots_from_urdf_move_as_in_mujoco() {
    let Some(python) = test_needs::python("six_robots_from_urdf_move_as_in_mujoco", "numpy, mujoco") else { return };
    let place = tempfile::tempdir().unwrap();
    for name in ROBOTS {
        let (machine, folder) =
            created(place.path(), name, &["--from-urdf", text(&urdf(name)), "--target-mm", "12,-34,56"]);
        let poses = positions(&machine, 100, 5);
        let expected = of_mujoco(&python, &urdf(name), tip(name), &in_metres(&machine, &poses), TARGET);
        let tool = target_mm(&folder);
        let worst =
            poses.iter().zip(&expected).map(|(q, p)| (point_mm(&machine, q, tool) - p).norm()).fold(0.0, f64::max);
        println!("{name}: {worst:.1e} mm");
        // 1e-9 m.
        assert!(worst < 1e-6, "{name}: {worst:e} mm");
        success(&abbe(&["plan", text(&folder.join("plan.toml")), "--no-effects", "--quiet"]));
    }
}

/// A row of a published table, m and degrees: a, alpha, d, theta, and the kind of the joint.
type Row = (f64, f64, f64, f64, char);

/// The published tables: whether modified, and the rows.
fn tables() -> Vec<(&'static str, bool, Vec<Row>)> {
    vec![
        (
            "ur5e",
            false,
            vec![
                (0.0, 90.0, 0.1625, 0.0, 'R'),
                (-0.425, 0.0, 0.0, 0.0, 'R'),
                (-0.3922, 0.0, 0.0, 0.0, 'R'),
                (0.0, 90.0, 0.1333, 0.0, 'R'),
                (0.0, -90.0, 0.0997, 0.0, 'R'),
                (0.0, 0.0, 0.0996, 0.0, 'R'),
            ],
        ),
        (
            "ur10",
            false,
            vec![
                (0.0, 90.0, 0.1273, 0.0, 'R'),
                (-0.612, 0.0, 0.0, 0.0, 'R'),
                (-0.5723, 0.0, 0.0, 0.0, 'R'),
                (0.0, 90.0, 0.163941, 0.0, 'R'),
                (0.0, -90.0, 0.1157, 0.0, 'R'),
                (0.0, 0.0, 0.0922, 0.0, 'R'),
            ],
        ),
        (
            "panda",
            true,
            vec![
                (0.0, 0.0, 0.333, 0.0, 'R'),
                (0.0, -90.0, 0.0, 0.0, 'R'),
                (0.0, 90.0, 0.316, 0.0, 'R'),
                (0.0825, 90.0, 0.0, 0.0, 'R'),
                (-0.0825, -90.0, 0.384, 0.0, 'R'),
                (0.0, 90.0, 0.0, 0.0, 'R'),
                (0.088, 90.0, 0.0, 0.0, 'R'),
                (0.0, 0.0, 0.107, 0.0, 'F'),
            ],
        ),
        (
            "iiwa14",
            false,
            vec![
                (0.0, -90.0, 0.36, 0.0, 'R'),
                (0.0, 90.0, 0.0, 0.0, 'R'),
                (0.0, 90.0, 0.42, 0.0, 'R'),
                (0.0, -90.0, 0.0, 0.0, 'R'),
                (0.0, -90.0, 0.4, 0.0, 'R'),
                (0.0, 90.0, 0.0, 0.0, 'R'),
                (0.0, 0.0, 0.126, 0.0, 'R'),
            ],
        ),
        (
            "irb120",
            false,
            vec![
                (0.0, -90.0, 0.29, 0.0, 'R'),
                (0.27, 0.0, 0.0, -90.0, 'R'),
                (0.07, -90.0, 0.0, 0.0, 'R'),
                (0.0, 90.0, 0.302, 0.0, 'R'),
                (0.0, -90.0, 0.0, 0.0, 'R'),
                (0.0, 0.0, 0.072, 180.0, 'R'),
            ],
        ),
        (
            "scara",
            false,
            vec![
                (0.3, 0.0, 0.1916, 0.0, 'R'),
                (0.25, 180.0, 0.0, 0.0, 'R'),
                (0.0, 0.0, 0.0, 0.0, 'P'),
                (0.0, 0.0, 0.05, 0.0, 'R'),
            ],
        ),
    ]
}

/// The product of a table at these positions (rad, mm), applied to a point of the flange, mm.
fn of_table(rows: &[Row], modified: bool, q: &[f64], point: [f64; 3]) -> Vector3<f64> {
    let turn = |axis: Vector3<f64>, angle: f64| Rotation3::new(axis * angle).to_homogeneous();
    let shift = |x: f64, z: f64| Matrix4::new_translation(&Vector3::new(x, 0.0, z));
    let mut frame = Matrix4::identity();
    let mut moved = q.iter();
    for (a, alpha, d, theta, kind) in rows {
        let (mut theta, mut d) = (theta.to_radians(), d * 1e3);
        match kind {
            'R' => theta += moved.next().unwrap(),
            'P' => d += moved.next().unwrap(),
            _ => {}
        }
        let about_z = turn(Vector3::z(), theta) * shift(0.0, d);
        let about_x = shift(a * 1e3, 0.0) * turn(Vector3::x(), alpha.to_radians());
        frame *= if modified { about_x * about_z } else { about_z * about_x };
    }
    frame.transform_point(&point.into()).coords
}

/// A file as someone would write it: units and separators vary.
fn file_of(rows: &[Row], number: usize) -> String {
    let [in_mm, in_rad, names_joint] = [number.is_multiple_of(2), number % 3 == 1, number.is_multiple_of(3)];
    let (length, angle) = (if in_mm { "mm" } else { "m" }, if in_rad { "rad" } else { "deg" });
    let mut file = String::from("# A table\n");
    if names_joint {
        file += "joint;";
    }
    let _ = writeln!(file, "a_{length};alpha_{angle};d_{length};theta_{angle};type");
    for (row, (a, alpha, d, theta, kind)) in rows.iter().enumerate() {
        let scale = if in_mm { 1e3 } else { 1.0 };
        let angle = |degrees: f64| match (in_rad, degrees) {
            (false, degrees) => degrees.to_string(),
            (true, 0.0) => "0".into(),
            (true, degrees) => format!("{}*pi/180", degrees).replace("90*pi/180", "pi/2").replace("180*pi/180", "pi"),
        };
        if names_joint {
            let _ = write!(file, "axis {row};");
        }
        let kind = match kind {
            'R' => "revolute",
            'P' => "prismatic",
            _ => "fixed",
        };
        // The joint variable stands in the column that the joint moves.
        let (d, theta) = (format!("{}", d * scale), angle(*theta));
        let (d, theta) = match kind {
            "revolute" => (d, format!("q{} + {theta}", row + 1)),
            "prismatic" => (format!("q{} + {d}", row + 1), theta),
            _ => (d, theta),
        };
        let _ = writeln!(file, "{};{};{d};{theta};{kind}", a * scale, angle(*alpha));
    }
    file.replace("+ -", "- ")
}

#[test]
fn six_robots_from_dh_move_as_their_published_tables_say() {
    let place = tempfile::tempdir().unwrap();
    for (number, (name, modified, rows)) in tables().into_iter().enumerate() {
        let file = place.path().join(format!("{name}.csv"));
        std::fs::write(&file, file_of(&rows, number)).unwrap();
        let convention = if modified { "modified" } else { "standard" };
        let asked = ["--from-dh", text(&file), "--convention", convention, "--target-mm", "12,-34,56"];
        let (machine, folder) = created(place.path(), name, &asked);
        let tool = target_mm(&folder);
        for q in positions(&machine, 100, 7) {
            let off = (point_mm(&machine, &q, tool) - of_table(&rows, modified, &q, TARGET)).norm();
            assert!(off < 1e-6, "{name}: {off:e} mm at {q:?}");
        }
    }
    // What is not stated is never guessed silently.
    let file = place.path().join("bare.csv");
    std::fs::write(&file, "a,alpha,d,theta\n0,pi/2,0.1625,q1\n-0.425,0,0,q2\n").unwrap();
    let (_, folder) = created(place.path(), "bare", &["--from-dh", text(&file), "--convention", "standard"]);
    let written = std::fs::read_to_string(folder.join("machine.toml")).unwrap();
    assert!(written.contains("# Assumed: the unit of the lengths is not stated: m."), "{written}");
    assert!(!abbe(&["new", text(&place.path().join("x")), "--from-dh", text(&file)]).status.success());
}

/// The same displacement in the frame of the flange, whatever the pose: the target of the plan.
#[test]
fn the_target_of_the_plan_is_at_the_flange() {
    let place = tempfile::tempdir().unwrap();
    let (machine, folder) =
        created(place.path(), "ur10", &["--from-urdf", text(&urdf("ur10")), "--target-mm", "0,0,80"]);
    let tool = target_mm(&folder);
    let flange = created(place.path(), "flange", &["--from-urdf", text(&urdf("ur10"))]).1;
    let flange = target_mm(&flange);
    for q in positions(&machine, 20, 3) {
        let apart = (point_mm(&machine, &q, tool) - point_mm(&machine, &q, flange)).norm();
        assert!((apart - 80.0).abs() < 1e-9, "{apart}");
    }
    // Sockets: a plan that `--poses` takes.
    let (_, folder) =
        created(place.path(), "sockets", &["--from-urdf", text(&urdf("panda")), "--measured-by", "sockets"]);
    let plan = std::fs::read_to_string(folder.join("plan.toml")).unwrap();
    assert_eq!(plan.matches("[[test]]").count(), 3, "{plan}");
    let options = ReadOptions { read_data: false, ..ReadOptions::default() };
    files::session(&folder.join("plan.toml"), &options).unwrap();
}
