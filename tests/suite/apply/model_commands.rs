//! `abbe compensate`, `abbe compare` and `abbe export` on models of bundled and simulated sessions.

use std::path::{Path, PathBuf};
use std::process::Output;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;

use crate::suite::{abbe, ready, text};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// A model of the bundled measured session.
fn model(folder: &Path) -> PathBuf {
    let path = folder.join("model.json");
    let session = ready("hermle-c600u/measured/session.toml");
    let done = abbe(&["fit", text(&session), "--save", text(&path), "--quiet"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    path
}

/// A copy of the bundled measured session that declares more.
fn bundled_with(folder: &Path, more: &str) -> PathBuf {
    let bundled = ready("hermle-c600u/measured/session.toml");
    for entry in std::fs::read_dir(bundled.parent().unwrap()).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, folder.join(path.file_name().unwrap())).unwrap();
    }
    let session = folder.join("session.toml");
    let declared = std::fs::read_to_string(&session).unwrap() + more;
    std::fs::write(&session, declared).unwrap();
    session
}

fn success(done: &Output) -> String {
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout.clone()).unwrap()
}

fn refused(done: &Output, because: &str) {
    let message = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(1), "{message}");
    assert!(message.contains(because), "{message}");
}

fn rows(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_string).collect::<Vec<String>>());
    (lines.next().unwrap(), lines.collect())
}

#[test]
fn commands_are_corrected_row_by_row_and_nothing_is_lost() {
    let folder = folder();
    let model = model(folder.path());
    let commands = folder.path().join("program.csv");
    let mut program = String::from("line,x_mm,y_mm,z_mm,a_deg,c_deg\n");
    for row in 0..5000 {
        let angle = f64::from(row) * 0.05;
        program += &format!("N{row},{:.3},{:.3},{:.3},{:.3},{angle:.3}\n", 100.0 * angle.cos(), 50.0, -20.0, 30.0);
    }
    program += "broken,1,2,three,4,5\nshort,1,2\nfar,99999,0,0,30,0\nflat,10,20,30,0,40\n";
    std::fs::write(&commands, &program).unwrap();
    let out = folder.path().join("corrected.csv");
    let json = folder.path().join("summary.json");
    let run = ["compensate", text(&model), text(&commands), "--out", text(&out), "--json", text(&json)];
    let printed = success(&abbe(&run));
    assert!(printed.contains("5004 rows") && printed.contains("not-a-number"), "{printed}");
    let (header, corrected) = rows(&out);
    assert_eq!(header[..6], ["line", "x_mm", "y_mm", "z_mm", "a_deg", "c_deg"]);
    assert_eq!(header[6..], ["remaining_um", "remaining_arcsec", "condition", "state"]);
    assert_eq!(corrected.len(), 5004);
    for (number, row) in corrected[..5000].iter().enumerate() {
        assert_eq!((row[0].as_str(), row[9].as_str()), (format!("N{number}").as_str(), "corrected"), "{row:?}");
        assert!(row[6].parse::<f64>().unwrap() <= 1e-3 && row[7].parse::<f64>().unwrap() <= 2e-4, "{row:?}");
    }
    assert_eq!(corrected[5000], ["broken", "1", "2", "three", "4", "5", "", "", "", "not-a-number"]);
    assert_eq!(corrected[5001][..3], ["short", "1", "2"]);
    assert_eq!(corrected[5002][9], "beyond-travel");
    // With A at 0 the tool's direction does not depend on C: a singularity.
    assert_eq!(corrected[5003][9], "position-only");
    assert!(corrected[5003][6].parse::<f64>().unwrap() <= 1e-3, "{:?}", corrected[5003]);
    let summary: Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    assert_eq!(summary["rows"], 5004);
    assert_eq!(summary["marked"].as_array().unwrap().len(), 4);
    assert_eq!(summary["marked"][0]["line"], 5002);

    // The error at the corrected commands is what the correction took away, to second order.
    let errors = folder.path().join("errors.csv");
    success(&abbe(&["compensate", text(&model), text(&commands), "--out", text(&errors), "--inverse", "--quiet"]));
    let (header, errors) = rows(&errors);
    assert_eq!(header[6..], ["dx_um", "dy_um", "dz_um", "da_arcsec", "db_arcsec", "dc_arcsec", "state"]);
    assert_eq!(errors[0][..6], ["N0", "100.000", "50.000", "-20.000", "30.000", "0.000"]);
    let size: f64 = errors[0][6..9].iter().map(|um| um.parse::<f64>().unwrap().powi(2)).sum::<f64>().sqrt();
    assert!(size > 5.0 && size < 200.0, "{size} µm");
}

/// Poses of the tool instead of axis positions: the corrected commands are those of the axis positions that reach them.
#[test]
fn poses_are_reached_and_corrected() {
    let folder = folder();
    let model = model(folder.path());
    let poses = folder.path().join("poses.csv");
    // At A = 30° and C = 0 the tool's Z is (0, sin 30°, cos 30°) in the table frame, and R is turned by −30° about X.
    let (sin, cos) = 30_f64.to_radians().sin_cos();
    let (y, z) = (20.0, -10.0);
    let (py, pz) = (cos * y + sin * z, -sin * y + cos * z);
    std::fs::write(
        &poses,
        format!("px_mm,py_mm,pz_mm,i,j,k\n5,{py},{pz},0,{sin},{cos}\n0,0,0,0,0,0\n0,0,90000,0,{sin},{cos}\n"),
    )
    .unwrap();
    let out = folder.path().join("corrected.csv");
    success(&abbe(&["compensate", text(&model), text(&poses), "--out", text(&out), "--tool-mm", "0,0,0", "--quiet"]));
    let (header, found) = rows(&out);
    let column = |name: &str| header.iter().position(|own| own == name).unwrap();
    let commands = folder.path().join("commands.csv");
    std::fs::write(&commands, format!("x_mm,y_mm,z_mm,a_deg,c_deg\n5,{y},{z},30,0\n")).unwrap();
    let direct = folder.path().join("direct.csv");
    success(&abbe(&[
        "compensate",
        text(&model),
        text(&commands),
        "--out",
        text(&direct),
        "--tool-mm",
        "0,0,0",
        "--quiet",
    ]));
    let (names, direct) = rows(&direct);
    for (name, expected) in names.iter().zip(&direct[0]).take(5) {
        let value: f64 = found[0][column(name)].parse().unwrap();
        assert!((value - expected.parse::<f64>().unwrap()).abs() < 1e-6, "{name}: {value} {expected}");
    }
    assert_eq!(found[1][column("state")], "not-reachable");
    assert_eq!(found[2][column("state")], "not-reachable");
}

/// The joints of `sessions/pose/machine.toml`: axis and origin, mm. The axes of J4, J5 and J6 meet.
const JOINTS: [(usize, [f64; 3]); 6] = [
    (2, [0.0; 3]),
    (1, [150.0, 0.0, 500.0]),
    (1, [150.0, 0.0, 1200.0]),
    (0, [150.0, 0.0, 1300.0]),
    (1, [850.0, 0.0, 1300.0]),
    (0, [950.0, 0.0, 1300.0]),
];

/// How such a robot carries its tool at these joints, degrees, with J3 higher by `lift_mm`.
fn carried(joints_deg: &[f64], lift_mm: f64) -> Isometry3<f64> {
    let joints = JOINTS.iter().zip(joints_deg).enumerate();
    joints.fold(Isometry3::identity(), |frame, (number, ((axis, origin), deg))| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::ith_axis(*axis), deg.to_radians());
        let lift = Translation3::new(0.0, 0.0, if number == 2 { lift_mm } else { 0.0 });
        frame * lift * Isometry3::rotation_wrt_point(turn, Point3::from(*origin))
    })
}

/// A robot with a spherical wrist reaches each pose of a smooth path in two ways. The first row follows the stated positions,
/// each further one its predecessor, over more than one block of rows; and the robot with its errors stands at the poses.
#[test]
fn a_path_of_poses_keeps_the_branch_of_its_joints() {
    let folder = folder();
    let [model, poses, out] = ["model.json", "poses.csv", "corrected.csv"].map(|name| folder.path().join(name));
    success(&abbe(&["fit", text(&ready("pose/session.toml")), "--save", text(&model), "--quiet"]));
    let saved: Value = serde_json::from_str(&std::fs::read_to_string(&model).unwrap()).unwrap();
    let error = |id: &str| {
        let found = saved["parameters"].as_array().unwrap().iter().find(|parameter| parameter["id"] == id);
        found.map_or(0.0, |parameter| parameter["internal"].as_f64().unwrap())
    };
    let zeros_deg = ["EC0J1", "EB0J2", "EB0J3", "EA0J4", "EB0J5", "EA0J6"].map(|id| error(id).to_degrees());
    let tool = Point3::new(950.0, 0.0, 1300.0);
    let path = |k: usize| {
        let (sin, cos) = (k as f64 * std::f64::consts::TAU / 2500.0).sin_cos();
        [40.0 * sin, -20.0 + 15.0 * cos, 10.0 + 20.0 * sin, 60.0 + 30.0 * sin, 45.0 + 20.0 * cos, 100.0 * sin]
    };
    let turned = |[a, b, c, d, e, f]: [f64; 6]| [a, b, c, d - 180.0, -e, f - 180.0];
    let mut rows_of_poses = "px_mm,py_mm,pz_mm,qw,qx,qy,qz\n".to_string();
    for k in 0..2500 {
        let (pose, other) = (carried(&path(k), 0.0), carried(&turned(path(k)), 0.0));
        assert!((pose.inverse() * other * tool - tool).norm() < 1e-9 && pose.rotation.angle_to(&other.rotation) < 1e-7);
        let (point, turn) = (pose * tool, pose.rotation.quaternion());
        let cells = [point.x, point.y, point.z, turn.w, turn.i, turn.j, turn.k].map(|cell| format!("{cell:.12}"));
        rows_of_poses += &(cells.join(",") + "\n");
    }
    std::fs::write(&poses, rows_of_poses).unwrap();
    let seed = ["--at", "J4=-120", "--at", "J5=-65", "--at", "J6=-180"];
    for (seed, is_turned) in [(&seed[..0], false), (&seed[..], true)] {
        let run = ["compensate", text(&model), text(&poses), "--out", text(&out), "--tool-mm", "950,0,1300"];
        success(&abbe(&[&run[..], seed, &["--quiet"]].concat()));
        let (header, found) = rows(&out);
        let place = header.iter().position(|name| name.eq_ignore_ascii_case("j1_deg")).unwrap();
        assert_eq!(found.len(), 2500);
        for (k, row) in found.iter().enumerate() {
            let joints: Vec<f64> = row[place..place + 6].iter().map(|cell| cell.parse().unwrap()).collect();
            let wanted = if is_turned { turned(path(k)) } else { path(k) };
            // The errors are some hundred arcseconds; the other branch is 90 degrees away.
            let near = joints.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1.0);
            assert!(near, "row {k}: {row:?}, {wanted:?} expected");
            let actual: Vec<f64> = joints.iter().zip(zeros_deg).map(|(joint, zero)| joint + zero).collect();
            let off = (carried(&actual, error("EZ0J3")) * tool - carried(&wanted, 0.0) * tool).norm();
            assert!(off < 1e-5, "row {k}: {off:e} mm");
        }
    }
}

#[test]
fn a_file_that_cannot_be_compensated_is_refused_before_anything_is_written() {
    let folder = folder();
    let model = model(folder.path());
    let file = |name: &str, content: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        path
    };
    let out = folder.path().join("out.csv");
    let run = |commands: &Path| abbe(&["compensate", text(&model), text(commands), "--out", text(&out)]);
    refused(&run(&file("empty.csv", "")), "is empty");
    refused(&run(&file("none.csv", "a,b\n1,2\n")), "no column names an axis position or a pose");
    refused(&run(&file("twice.csv", "x_mm,X_um\n1,2\n")), "have the same meaning");
    refused(&run(&file("both.csv", "x_mm,px_mm,py_mm,pz_mm,i,j,k\n1,2,3,4,5,6,7\n")), "both axis positions and poses");
    refused(&run(&file("part.csv", "px_mm,py_mm\n1,2\n")), "incomplete");
    refused(&run(&file("point.csv", "px_mm,py_mm,pz_mm\n1,2,3\n")), "direction of the tool's Z");
    refused(&run(&file("corrected.csv", "x_mm,state\n1,corrected\n")), "may be corrected already");
    refused(&run(&folder.path().join("absent.csv")), "cannot be read");
    let commands = file("program.csv", "x_mm\n1\n");
    let at = ["compensate", text(&model), text(&commands), "--out", text(&out), "--at", "X=5"];
    refused(&abbe(&at), "--at X=5: the commands have a column for the positions of X");
    let twice = [&at[..5], &["--at", "A=5", "--at", "A=6"]].concat();
    refused(&abbe(&twice), "--at A=6: the position of A is stated twice");
    assert!(!out.exists());
    let over = abbe(&["compensate", text(&model), text(&commands), "--out", text(&commands)]);
    refused(&over, "one of the files that are read");
    assert_eq!(std::fs::read_to_string(&commands).unwrap(), "x_mm\n1\n");
}

/// Two sessions of a plan, simulated with and without a displaced C axis.
#[test]
fn a_comparison_names_what_has_changed() {
    let folder = folder();
    let session = |name: &str, error: &str, seed: &str| {
        let out = folder.path().join(name);
        let plan = ready("hermle-c600u/chapter5.toml");
        let run = ["simulate", text(&plan), "--out", text(&out), "--error", error, "--seed", seed, "--quiet"];
        success(&abbe(&run));
        out.join("session.toml")
    };
    let before = session("before", "EX0C=10um", "1");
    let after = session("after", "EX0C=40um", "2");
    let json = folder.path().join("differences.json");
    let printed = success(&abbe(&["compare", text(&before), text(&after), "--json", text(&json)]));
    assert!(printed.contains("1 significant difference of 8 parameters"), "{printed}");
    let result: Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    let first = &result["differences"][0];
    assert_eq!((first["id"].as_str(), first["significant"].as_bool()), (Some("EX0C"), Some(true)));
    let (value, u) = (first["value"].as_f64().unwrap(), first["u"].as_f64().unwrap());
    assert!((value - 30.0).abs() < 4.0 * u && u < 3.0, "{value} ± {u}");
    // The same from saved models.
    let save = |session: &Path, name: &str| {
        let path = folder.path().join(name);
        success(&abbe(&["fit", text(session), "--save", text(&path), "--quiet"]));
        path
    };
    let models = [save(&before, "a.json"), save(&after, "b.json")];
    let again = folder.path().join("again.json");
    success(&abbe(&["compare", text(&models[0]), text(&models[1]), "--json", text(&again), "--quiet"]));
    let again: Value = serde_json::from_str(&std::fs::read_to_string(&again).unwrap()).unwrap();
    let same = again["differences"][0]["value"].as_f64().unwrap();
    assert!((same - value).abs() < 1e-6 * value.abs(), "{same} {value}");
    // An input that is given twice has two tables, each with every difference once.
    let twice = success(&abbe(&["compare", text(&models[0]), text(&models[1]), text(&models[1]), "--all"]));
    assert_eq!(twice.lines().filter(|line| line.trim_start().starts_with("EX0C")).count(), 2, "{twice}");
    assert_eq!(abbe(&["compare", text(&before)]).status.code(), Some(2));
    let other = ready("r-test/measured/session.toml");
    refused(&abbe(&["compare", text(&before), text(&other)]), "one machine");
}

/// A constant error motion is no location error: it is listed as left out, and not written.
#[test]
fn an_error_motion_is_not_exported_as_a_location_error() {
    let folder = folder();
    let session = bundled_with(folder.path(), "\n[unknowns]\nerrors = [\"EY0C\", \"EXC\"]\n");
    let (model, out) = (folder.path().join("model.json"), folder.path().join("table.csv"));
    success(&abbe(&["fit", text(&session), "--save", text(&model), "--quiet"]));
    let printed = success(&abbe(&["export", text(&model), "--as", "beckhoff", "--out", text(&out)]));
    assert!(printed.contains("left out: EXC"), "{printed}");
    let table = std::fs::read_to_string(&out).unwrap();
    assert!(table.contains("Y0C") && !table.contains("XC"), "{table}");
}

/// The entries of a control state what remains, over the measured range or a travel that is requested.
#[test]
fn entries_of_a_control_state_what_remains() {
    let folder = folder();
    let model = model(folder.path());
    let (out, json) = (folder.path().join("table.csv"), folder.path().join("table.json"));
    let export = |options: &[&str]| {
        let run = [&["export", text(&model), "--as", "linuxcnc", "--out", text(&out), "--json", text(&json)], options];
        let printed = success(&abbe(&run.concat()));
        let result: Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
        (result["kinematics"].clone(), std::fs::read_to_string(&out).unwrap(), printed)
    };
    let rms = |table: &Value, which: &str| table["remaining"][which]["rms_um"].as_f64().unwrap();
    let (best, file, printed) = export(&[]);
    assert!(rms(&best, "written") < rms(&best, "plain") && rms(&best, "plain") < rms(&best, "without"), "{best:#}");
    assert_eq!(best["is_measured_travel"], true);
    for said in [&file, &printed] {
        assert!(said.contains("the measured range: C ") && said.contains("these entries: rms "), "{said}");
        assert!(said.contains("Not represented by the control's model"), "{said}");
    }
    assert!(file.lines().any(|line| line.starts_with("field,meaning,change_mm,u_mm,plain_change_mm")), "{file}");
    let (plain, ..) = export(&["--entries", "plain"]);
    assert_eq!(plain["remaining"]["written"], best["remaining"]["plain"]);
    for (plain, best) in plain["parameters"].as_array().unwrap().iter().zip(best["parameters"].as_array().unwrap()) {
        assert_eq!(plain["change_mm"], best["plain_change_mm"]);
    }
    let (stated, file, _) = export(&["--travel", "A=-30..60", "--travel", "Z=-50..50"]);
    assert!(file.contains("as requested: C ") && file.contains("A -30 to 60 deg"), "{file}");
    assert!(stated["is_measured_travel"] == false && rms(&stated, "written") != rms(&best, "written"));
    let schema: Value = serde_json::from_slice(&abbe(&["schema", "export"]).stdout).unwrap();
    assert!(jsonschema::is_valid(&schema, &serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap()));
    for (format, option, because) in [
        ("fanuc", "--travel=A=60..-30", "the first number is not below the second"),
        ("fanuc", "--travel=Q=0..1", "has no axis `Q`; its axes are"),
        ("fanuc", "--travel=A=x..1", "no two numbers"),
        ("dh", "--travel=A=0..1", "belongs to `--as linuxcnc`"),
        ("beckhoff", "--entries=plain", "belongs to `--as linuxcnc`"),
    ] {
        let done = abbe(&["export", text(&model), "--as", format, "--out", text(&out), option]);
        let message = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.code() == Some(2) && message.contains(because), "{option}: {message}");
    }
    let far = abbe(&["export", text(&model), "--as", "fanuc", "--out", text(&out), "--travel=A=0..1e300"]);
    refused(&far, "a position in mm or degrees");
}

/// A file that holds a fixed geometry alone states what it leaves out and what that leaves, as the screen and JSON do. The
/// entries that are written leave no more than the plain location errors.
#[test]
fn a_fixed_geometry_states_what_the_effects_leave() {
    let folder = folder();
    let effect = "\n[[effect]]\ncomponent = \"EYA\"\ndriver = \"A\"\nshape = \"harmonic\"\norder = 2\n";
    let session = bundled_with(folder.path(), effect);
    let [model, out, json] = ["model.json", "machine.urdf", "export.json"].map(|name| folder.path().join(name));
    success(&abbe(&["fit", text(&session), "--save", text(&model), "--quiet"]));
    let printed = success(&abbe(&["export", text(&model), "--as", "urdf", "--out", text(&out), "--json", text(&json)]));
    let result: Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    let rms = |which: &str| result["remaining"][which]["rms_um"].as_f64().unwrap();
    assert!(0.0 < rms("written") && rms("written") < rms("plain") && rms("plain") < rms("without"), "{result:#}");
    let file = std::fs::read_to_string(&out).unwrap();
    for said in [&file, &printed] {
        assert!(said.contains("left out: EYA~A:h2"), "{said}");
        assert!(said.contains(&format!("{:.1} um rms over the range of its readings", rms("without"))), "{said}");
        assert!(said.contains("which leave least without the effects"), "{said}");
        assert!(said.contains("the zero of the workpiece is presumed to be measured on the table"), "{said}");
    }
    assert_eq!(result["remaining"]["set_up_anew"], false);
}

/// The summary of corrected commands covers every row, those too that could not be corrected, and states its tool point.
#[test]
fn a_summary_covers_all_rows() {
    let folder = folder();
    let model = model(folder.path());
    let [commands, out] = ["commands.csv", "corrected.csv"].map(|name| folder.path().join(name));
    std::fs::write(&commands, "x_mm,y_mm,z_mm,a_deg,c_deg\n10,20,-10,30,40\n0,0,0,0,0\n-50,60,0,-10,200\n").unwrap();
    let printed =
        success(&abbe(&["compensate", text(&model), text(&commands), "--out", text(&out), "--tool-mm", "0,0,-120"]));
    let (header, found) = rows(&out);
    let column = |name: &str| header.iter().position(|own| own == name).unwrap();
    // Where A is at zero its axis is no longer apart from that of the tool, and the direction cannot be corrected.
    let states: Vec<&str> = found.iter().map(|row| row[column("state")].as_str()).collect();
    assert_eq!(states, ["corrected", "position-only", "corrected"]);
    let largest = |name: &str| found.iter().map(|row| row[column(name)].parse::<f64>().unwrap()).fold(0.0, f64::max);
    assert!(largest("remaining_arcsec") > 0.1, "{found:?}");
    assert!(printed.contains("Tool point [0.000, 0.000, -120.000] mm in the tool frame."), "{printed}");
    let line = printed.lines().find(|line| line.contains("largest remaining error of all rows")).unwrap();
    assert!(line.contains(&format!("{:.3}″", largest("remaining_arcsec"))), "{line}");
    // A row without a command has no remaining error, and is not among all.
    std::fs::write(&commands, "x_mm,y_mm,z_mm,a_deg,c_deg\n10,20,-10,30,40\n#REF!,0,0,0,0\n").unwrap();
    let printed = success(&abbe(&["compensate", text(&model), text(&commands), "--out", text(&out), "--force"]));
    assert!(printed.contains("largest remaining error of the 1 row that has a command"), "{printed}");
}

/// MuJoCo reads the exported chain and moves the tool as the model does.
#[test]
fn mujoco_reads_the_exported_urdf() {
    let Some(python) = test_needs::python("mujoco_reads_the_exported_urdf", "numpy, mujoco") else { return };
    let folder = folder();
    let model = model(folder.path());
    let urdf = folder.path().join("machine.urdf");
    success(&abbe(&["export", text(&model), "--as", "urdf", "--out", text(&urdf), "--tool-mm", "0,0,-120", "--quiet"]));
    // Poses of the tool over the table from the library's chain, by `--inverse` errors on top of the nominal machine.
    let script = r#"
import json, sys
import numpy as np, mujoco
xml = open(sys.argv[1]).read()
# MuJoCo joins links without joints to their parents unless it is told not to.
at = xml.index(">", xml.index("<robot")) + 1
xml = xml[:at] + '<mujoco><compiler fusestatic="false"/></mujoco>' + xml[at:]
m = mujoco.MjModel.from_xml_string(xml); d = mujoco.MjData(m)
model = json.load(open(sys.argv[2]))
e = {p["id"]: p["internal"] for p in model["parameters"]}
def rx(a): c,s=np.cos(a),np.sin(a); return np.array([[1,0,0],[0,c,-s],[0,s,c]])
def ry(a): c,s=np.cos(a),np.sin(a); return np.array([[c,0,s],[0,1,0],[-s,0,c]])
def rz(a): c,s=np.cos(a),np.sin(a); return np.array([[c,-s,0],[s,c,0],[0,0,1]])
def E0(k): return rx(e.get("EA0"+k,0))@ry(e.get("EB0"+k,0))@rz(e.get("EC0"+k,0)), np.array([e.get("E%s0%s"%(f,k),0) for f in "XYZ"])
rng = np.random.default_rng(1); worst = 0
names = [mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_JOINT, i) for i in range(m.njnt)]
for _ in range(50):
    q = {"X": rng.uniform(-200,200), "Y": rng.uniform(-200,200), "Z": rng.uniform(-200,200), "A": rng.uniform(-1,1), "C": rng.uniform(-3,3)}
    for i, n in enumerate(names): d.qpos[m.jnt_qposadr[i]] = q[n]*1e-3 if n in "XYZ" else q[n]
    mujoco.mj_forward(m, d)
    def pose(body):
        b = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, body); return d.xpos[b], d.xmat[b].reshape(3,3)
    pt, _ = pose("tool"); pw, Rw = pose("table")
    found = Rw.T@(pt-pw)*1e3
    RA, tA = E0("A"); RC, tC = E0("C")
    R = RA@rx(q["A"])@RC@rz(q["C"]); t = tA + RA@rx(q["A"])@tC
    want = R.T@(np.array([q["X"],q["Y"],q["Z"]-120])-t)
    worst = max(worst, np.abs(found-want).max())
print(worst)
"#;
    let done = std::process::Command::new(&python).args(["-c", script, text(&urdf), text(&model)]).output().unwrap();
    let worst: f64 = success(&done).trim().parse().unwrap();
    assert!(worst < 1e-6, "{worst:e} mm");
}
