//! Poses of the UR10 whose columns are misread.

use std::sync::Arc;

use abbe::files::{self, ReadOptions};
use abbe::identify::fit::{FitResult, prepare, report};
use abbe::identify::plausibility::{ConflictKind, SuggestionKind};
use abbe::identify::results::TraceVerdict;
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use abbe::trace::{TraceOptions, trace};
use test_needs::data;

use crate::suite::identify::targets::{POSES, TARGETS, written};
use crate::suite::{abbe, ready, text};

/// One pose in so many is read.
const EACH: usize = 40;

/// The session on some of the poses, with the session's text changed.
fn ur10(test: &str, change: impl Fn(String) -> String) -> Option<Session> {
    let path = "landgraf_ur10/Series_A/measurements_grid.csv";
    let table = std::fs::read_to_string(data(test, path)?).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut lines = table.lines();
    let mut few = lines.next().unwrap().to_string() + "\n";
    lines.step_by(EACH).for_each(|line| few += &(line.to_string() + "\n"));
    std::fs::write(at("poses.csv"), few).unwrap();
    let text = std::fs::read_to_string(ready("ur10/session.toml")).unwrap();
    let text = change(text.replace(path, "poses.csv"));
    std::fs::write(at("session.toml"), text).unwrap();
    std::fs::copy(ready("ur10/machine.toml"), at("machine.toml")).unwrap();
    Some(files::session(&at("session.toml"), &ReadOptions::default()).unwrap())
}

fn fitted(session: &Session) -> Result<FitResult, Diagnostic> {
    prepare(session, 1).map(|(problem, fit)| report(&problem, &fit).unwrap())
}

#[test]
fn poses_that_belong_to_the_robot_are_not_contradicted() {
    let test = "poses_that_belong_to_the_robot_are_not_contradicted";
    let Some(session) = ur10(test, |text| text) else {
        return;
    };
    let told = fitted(&session).unwrap().plausibility;
    assert!(told.conflicts.is_empty() && told.suggestions.is_empty(), "{told:?}");
    assert!(told.explained_variance.unwrap() > 0.9999, "{told:?}");
}

/// Positions that do not scatter have no variance that a model could explain, whatever the rounding of their mean.
#[test]
fn one_pose_read_again_and_again_contradicts_nothing() {
    let Some(mut session) = ur10("one_pose_read_again_and_again_contradicts_nothing", |text| text) else {
        return;
    };
    let readings = session.tests[0].readings.as_ref().unwrap();
    session.tests[0].readings = Some(Arc::new(readings.of_rows(&[1; 12])));
    let told = fitted(&session).unwrap().plausibility;
    assert!(told.explained_variance.is_none() && told.conflicts.is_empty(), "{told:?}");
}

#[test]
fn metres_for_millimetres_are_named() {
    let test = "metres_for_millimetres_are_named";
    for letter in ["px", "py", "pz"] {
        assert!(std::fs::read_to_string(ready("ur10/session.toml")).unwrap().contains(&format!("{letter}_mm = ")));
    }
    let change =
        |text: String| text.replace("px_mm =", "px_m =").replace("py_mm =", "py_m =").replace("pz_mm =", "pz_m =");
    let Some(session) = ur10(test, change) else { return };
    let error = fitted(&session).unwrap_err().to_string();
    println!("{error}");
    for part in ["none of the 45 parameters is identifiable", "measured positions are 1,000 times too large"] {
        assert!(error.contains(part), "`{part}` is not in {error}");
    }
}

#[test]
fn two_exchanged_joint_columns_are_named() {
    let test = "two_exchanged_joint_columns_are_named";
    let change = |text: String| {
        text.replace("J2_rad = \"shoulder_lift_joint\"", "J2_rad = \"elbow_joint\"")
            .replace("J3_rad = \"elbow_joint\"", "J3_rad = \"shoulder_lift_joint\"")
    };
    let Some(session) = ur10(test, change) else { return };
    match fitted(&session) {
        Ok(result) => {
            let told = &result.plausibility;
            println!("{told:?}");
            assert!(told.explained_variance.unwrap() < 0.99, "{told:?}");
            assert_eq!(told.conflicts[0].kind, ConflictKind::ExplainedVariance);
            let best = &told.suggestions[0];
            assert_eq!((best.kind, best.subject.as_str()), (SuggestionKind::ColumnsExchanged, "J2, J3"));
            assert!(result.warnings.iter().any(|warning| warning.contains("the columns of J2 and J3 are exchanged")));
        }
        Err(error) => assert!(error.to_string().contains("the columns of J2 and J3 are exchanged"), "{error}"),
    }
    let traced = trace(&session, &TraceOptions::default(), &|_| true).map(|found| found.result);
    match traced {
        Ok(found) => {
            assert!(found.verdict == TraceVerdict::Unexplained && found.effects.is_empty(), "{}", found.verdict)
        }
        Err(error) => assert!(error.to_string().contains("are exchanged"), "{error}"),
    }
}

#[test]
fn radians_declared_as_degrees_are_named() {
    let test = "radians_declared_as_degrees_are_named";
    let Some(session) = ur10(test, |text| text.replace("_rad = ", "_deg = ")) else {
        return;
    };
    let told = match fitted(&session) {
        Ok(result) => result.warnings.join("\n"),
        Err(error) => error.to_string(),
    };
    println!("{told}");
    assert!(told.contains("the positions of J1, J2, J3, J4, J5, J6 are in radians, not in degrees"), "{told}");
}

#[test]
fn a_joint_of_the_opposite_sign_is_named() {
    let test = "a_joint_of_the_opposite_sign_is_named";
    let machine_sign = |axis: usize| {
        let mut session = ur10(test, |text| text)?;
        let direction = session.machine.axes[axis].direction;
        Arc::make_mut(&mut session.machine).axes[axis].direction = direction.map(|along| -along);
        Some(session)
    };
    for axis in 1..5 {
        let Some(session) = machine_sign(axis) else { return };
        let name = format!("the positions of J{} have the opposite sign", axis + 1);
        let told = match fitted(&session) {
            Ok(result) => result.warnings.join("\n"),
            Err(error) => error.to_string(),
        };
        println!("{told}");
        assert!(told.contains(&name), "{name}: {told}");
    }
}

/// A quaternion is written with its scalar first or last. Either order read as the other is named, also where no noise is
/// stated and the orientations would weigh nothing beside the positions.
#[test]
fn the_order_of_a_quaternion_is_named() {
    let table = std::fs::read_to_string(ready("pose/body.csv")).unwrap();
    let own = std::fs::read_to_string(ready("pose/session.toml")).unwrap();
    let unstated = own.replace("noise_um = 20\nnoise_arcsec = 10\n", "");
    assert_ne!(own, unstated);
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(ready("pose/machine.toml"), folder.path().join("machine.toml")).unwrap();
    for (order, expected) in [("qw,qx,qy,qz", "scalar last"), ("qx,qy,qz,qw", "")] {
        for text in [&own, &unstated] {
            std::fs::write(folder.path().join("body.csv"), table.replace("qx,qy,qz,qw", order)).unwrap();
            std::fs::write(folder.path().join("session.toml"), text).unwrap();
            let session = files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap();
            let told = match fitted(&session) {
                Ok(result) => result.plausibility.suggestions.iter().map(|one| one.words.clone()).collect(),
                Err(error) => error.to_string(),
            };
            println!("{order}: {told}");
            match expected {
                "" => assert!(told.is_empty(), "{told}"),
                words => assert!(told.contains(words), "{told}"),
            }
        }
    }
    // The scalar first in the file, read by the header of the other order.
    let turned: Vec<String> = table
        .lines()
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            let [others @ .., x, y, z, w] = &cells[..] else { panic!("{line}") };
            if *x == "qx" { line.to_string() } else { [others, &[w, x, y, z]].concat().join(",") }
        })
        .collect();
    std::fs::write(folder.path().join("body.csv"), turned.join("\n")).unwrap();
    std::fs::write(folder.path().join("session.toml"), &own).unwrap();
    let session = files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap();
    let told = match fitted(&session) {
        Ok(result) => result.plausibility.suggestions.iter().map(|one| one.words.clone()).collect(),
        Err(error) => error.to_string(),
    };
    assert!(told.contains("scalar first"), "{told}");
}

/// Poses of an independent chain whose measured positions are in inches, in mm where inches are stated, or whose columns of
/// two joints are exchanged: the message says so.
#[test]
fn inches_and_exchanged_columns_of_poses_are_named() {
    let header = "j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,px_mm,py_mm,pz_mm";
    let of_inches = header.replace("px_mm,py_mm,pz_mm", "px_in,py_in,pz_in");
    let exchanged = header.replace("j2_deg,j3_deg", "j3_deg,j2_deg");
    for (columns, scale, words) in [
        (header, 1.0, ""),
        (header, 1.0 / 25.4, "the measured positions are in inches, not in mm"),
        (of_inches.as_str(), 1.0, "the measured positions are in mm, not in inches"),
        (exchanged.as_str(), 1.0, "the columns of J2 and J3 are exchanged"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let file = written(folder.path(), POSES, 1, &TARGETS, [0.0; 2]);
        for number in 0..TARGETS.len() {
            let table = folder.path().join(format!("{number}.csv"));
            let rows = std::fs::read_to_string(&table).unwrap();
            let scaled = rows.lines().skip(1).map(|line| {
                let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
                let cells = cells.iter().enumerate().map(|(k, cell)| if k < 6 { *cell } else { cell * scale });
                cells.map(|cell| format!("{cell:.9}")).collect::<Vec<_>>().join(",")
            });
            let rows = std::iter::once(columns.to_string()).chain(scaled).collect::<Vec<_>>().join("\n");
            std::fs::write(&table, rows + "\n").unwrap();
        }
        let run = abbe(&["fit", text(&file), "--quiet"]);
        let told = String::from_utf8_lossy(&run.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        let is_named = !words.is_empty() && told.contains(&format!("explained if {words}"));
        assert!(is_named || words.is_empty() && told.is_empty(), "{columns}: {told}");
        assert_eq!(run.status.success(), words.is_empty(), "{columns}: {told}");
    }
}
