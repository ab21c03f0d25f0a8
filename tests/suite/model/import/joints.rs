//! Joints by the names of the robot's own file, and rows without a coordinate.

use abbe::files::{self, ReadOptions};
use abbe::identify::start::with_targets;
use abbe::model::chain::{AxisPosition, BodyErrors, Frame};
use abbe::model::frames::Point;
use std::sync::Arc;

use super::{abbe, foreign, import, message, text, workspace};

#[test]
fn columns_have_the_names_of_the_robots_own_joints() {
    let place = tempfile::tempdir().unwrap();
    for (robot, joint) in [("panda", "panda_joint"), ("iiwa14", "iiwa_joint_"), ("scara", "")] {
        let urdf = workspace().join("tests/robots").join(format!("{robot}.urdf"));
        let robot = place.path().join(robot);
        let output = abbe(&["new", text(&robot), "--from-urdf", text(&urdf)]);
        assert!(output.status.success(), "{}", message(&output));
        let machine = files::machine(&robot.join("machine.toml")).unwrap();
        // The names as they stand in the file; the columns from the last joint to the first, so that only names tell.
        let own = std::fs::read_to_string(&urdf).unwrap();
        let names: Vec<&str> = own
            .split("<joint ")
            .skip(1)
            .filter(|part| !part.contains("type=\"fixed\""))
            .map(|part| part.split("name=\"").nth(1).unwrap().split('"').next().unwrap())
            .collect();
        assert_eq!(names.len(), machine.axes.len());
        assert!(names.iter().all(|name| name.starts_with(joint)));
        let mut file =
            names.iter().rev().map(|name| format!("{name} position,")).collect::<String>() + "X [mm],Y [mm],Z [mm]\n";
        for row in 0..40 {
            let q: Vec<f64> = (0..names.len())
                .map(|k| {
                    let [low, high] = machine.axes[k].travel.unwrap();
                    0.5 * (low + high)
                        + 0.4 * (high - low) * f64::from(1 + 3 * row + 7 * (k as i32 + 1) * row % 11).sin()
                })
                .collect();
            let state: Vec<AxisPosition<f64>> =
                machine.axes.iter().zip(&q).map(|(axis, q)| AxisPosition::new(axis.kind, *q)).collect();
            let none = vec![BodyErrors::<f64>::NONE; machine.axes.len()];
            let at = machine.in_r(Frame::Tool, &state, &none, Point([40.0, -30.0, 20.0])).0;
            let shown = q.iter().zip(&machine.axes).rev().map(|(q, axis)| match axis.kind {
                abbe::model::axis::AxisKind::Linear => format!("{q:.6},"),
                abbe::model::axis::AxisKind::Rotary => format!("{q:.9},"),
            });
            file += &shown.collect::<String>();
            file += &format!("{:.6},{:.6},{:.6}\n", at[0], at[1], at[2]);
        }
        let poses = place.path().join("poses.csv");
        std::fs::write(&poses, file).unwrap();
        let out = robot.join("run1");
        let machine_file = robot.join("machine.toml");
        let output = abbe(&["import", text(&poses), "--machine", text(&machine_file), "--out", text(&out)]);
        assert!(output.status.success(), "{robot:?}: {}", message(&output));
        let written = std::fs::read_to_string(out.join("session.toml")).unwrap();
        for (k, name) in names.iter().enumerate() {
            let expected = format!("j{}_", k + 1);
            let line = written.lines().find(|line| line.ends_with(&format!("= \"{name} position\""))).unwrap();
            assert!(line.starts_with(&expected), "{line}");
        }
    }
}

/// A row that lacks a coordinate does not shift the others.
#[test]
fn a_target_is_found_from_the_rows_with_all_coordinates() {
    let place = tempfile::tempdir().unwrap();
    let (output, session) = import(place.path(), &foreign("units-line.txt"), None, &[]);
    assert!(output.status.success(), "{}", message(&output));
    let session = files::session(&session, &ReadOptions::default()).unwrap();
    let mut lacking = session.clone();
    let mut readings = session.tests[0].readings.as_deref().unwrap().clone();
    readings.observed[3 * 5] = f64::NAN;
    lacking.tests[0].readings = Some(Arc::new(readings));
    let point = with_targets(&lacking).tests[0].station.tool_point().mm;
    // Where the target is in the tool frame: `a_new_test_takes_the_set_up_of_another`.
    let expected = [-1184.3 + 30.0, -256.141 - 80.0, 11.6 - 20.0];
    assert!((0..3).all(|i| (point[i] - expected[i]).abs() < 0.2), "{point:?}");
}

/// A plan for sockets names files that are not there yet. Each file gives its own socket its poses, one after the other.
#[test]
fn a_plan_for_sockets_takes_its_files_one_by_one() {
    let place = tempfile::tempdir().unwrap();
    let urdf = workspace().join("tests/robots/ur5e.urdf");
    let robot = place.path().join("arm");
    let output = abbe(&["new", text(&robot), "--from-urdf", text(&urdf), "--measured-by", "sockets"]);
    assert!(output.status.success(), "{}", message(&output));
    let (plan, poses) = (robot.join("plan.toml"), place.path().join("poses.csv"));
    let measured = place.path().join("measured");
    std::fs::create_dir(&measured).unwrap();
    for (number, socket) in ["S1", "S2", "S3"].into_iter().enumerate() {
        let asked = ["poses", text(&plan), "--poses", "14", "--candidates", "200", "--test", socket];
        let output = abbe(&[&asked[..], &["--out", text(&poses), "--quiet"]].concat());
        assert!(output.status.success(), "{}", message(&output));
        // As a controller writes them: other names, semicolons.
        let mut file = String::from("A1 [deg];A2 [deg];A3 [deg];A4 [deg];A5 [deg];A6 [deg]\n");
        for row in std::fs::read_to_string(&poses).unwrap().lines().skip(1) {
            file += &(row.rsplit_once(',').unwrap().0.replace(',', ";") + "\n");
        }
        let own = measured.join(format!("{socket}.csv"));
        std::fs::write(&own, &file).unwrap();
        let output = abbe(&["import", text(&own), "--session", text(&plan)]);
        assert!(output.status.success(), "{socket}: {}", message(&output));
        let written = std::fs::read_to_string(&plan).unwrap();
        assert!(written.contains(&format!("data = \"{socket}.csv\"")), "{written}");
        assert_eq!(std::fs::read_to_string(robot.join(format!("{socket}.csv"))).unwrap(), file);
        // Those that are measured are there; the others are still awaited.
        let read = files::session(&plan, &ReadOptions::default());
        assert_eq!(read.is_ok(), number == 2);
    }
    let session = files::session(&plan, &ReadOptions::default()).unwrap();
    let rows: usize = session.tests.iter().map(|test| test.readings.as_ref().unwrap().rows()).sum();
    assert_eq!(rows, 3 * 14);
    // A second file of the same name is refused.
    let output = abbe(&["import", text(&measured.join("S1.csv")), "--session", text(&plan)]);
    assert!(message(&output).contains("has data already"), "{}", message(&output));
}
