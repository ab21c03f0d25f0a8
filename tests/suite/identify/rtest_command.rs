//! The R-test at the command line: equations, plans, simulated readings, views.

use crate::suite::{abbe, ready, text};

/// First order by hand for the nest on a C table: an error δ of the table in X displaces its point, so the tool lies at
/// −δ from it, in the frame of a table rotated by C.
#[test]
fn the_equation_of_bk2_agrees_with_a_rotating_table() {
    let output = abbe(&[
        "equation",
        text(&ready("r-test/plan.toml")),
        "--test",
        "BK2",
        "--order",
        "first",
        "--errors",
        "EX0C,EC0C,sensor.theta",
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let printed = String::from_utf8_lossy(&output.stdout);
    let printed = printed.split_whitespace().collect::<Vec<_>>().join(" ");
    for line in
        ["∂m.x/∂e_x0c = −c_c", "∂m.y/∂e_x0c = s_c", "∂m.x/∂θ_z0c = y·c_c − x·s_c", "∂m.y/∂θ_z0c = −y·s_c − x·c_c"]
    {
        assert!(printed.contains(line), "{line} is not in\n{printed}");
    }
}

/// Every order, with the sensors on either body: the command prints a form only after its check against dual numbers.
#[test]
fn equations_of_raw_sensors_are_printed_in_every_order() {
    for test in ["BK1", "BK1-Es"] {
        for order in ["exact", "bilinear", "first"] {
            let printed = stdout_of(&[
                "equation",
                text(&ready("r-test/machine-b.toml")),
                "--test",
                test,
                "--order",
                order,
                "--errors",
                "EY0A,EA0Z,sensor.omega,workpiece_ball.x",
            ]);
            // cos 35.264°: the component of sensor u along X.
            assert!(printed.contains("0.816500507611"), "{test} {order}: {printed}");
            // X need not move and is stationary.
            assert!(!printed.contains("position of axis X"), "{test} {order}: {printed}");
        }
    }
}

/// The standard output of a successful command.
fn stdout_of(arguments: &[&str]) -> String {
    let outcome = abbe(arguments);
    assert!(outcome.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&outcome.stderr));
    String::from_utf8(outcome.stdout).unwrap()
}

#[test]
fn a_planned_session_is_simulated_and_fitted_with_raw_sensors_in_both_settings() {
    let folder = tempfile::tempdir().unwrap();
    let (run, json, csv) = (folder.path().join("run"), folder.path().join("fit.json"), folder.path().join("views.csv"));
    stdout_of(&[
        "simulate",
        text(&ready("r-test/machine-b.toml")),
        "--out",
        text(&run),
        "--error",
        "EB0A=7arcsec",
        "--error",
        "EC0A=-9arcsec",
        "--draw-setups",
        "--seed",
        "3",
    ]);
    let data = std::fs::read_to_string(run.join("BK1.csv")).unwrap();
    assert!(data.lines().next().unwrap().ends_with("du_mm,dv_mm,dw_mm"), "{data:.80}");
    stdout_of(&["fit", text(&run.join("session.toml")), "--json", text(&json), "--views", text(&csv)]);
    let fit: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    for (id, expected) in [("EB0A", 7.0), ("EC0A", -9.0)] {
        let parameters = fit["parameters"].as_array().unwrap();
        let found = parameters.iter().find(|parameter| parameter["id"] == id).unwrap();
        let [value, u] = ["value", "u"].map(|key| found[key].as_f64().unwrap());
        assert!((value - expected).abs() < 4.0 * u && u < 0.1, "{id}: {value} ± {u}");
    }
    let rms = ["rms_um", "rms_3d_um", "heldout_rms_3d_um"].map(|key| fit[key].as_f64().unwrap());
    assert!((rms[0] - 0.3).abs() < 0.02, "{rms:?}");
    assert!((rms[1] - rms[0] * 3.0_f64.sqrt()).abs() < 1e-6 && rms[2] < 0.56, "{rms:?}");
    let views = std::fs::read_to_string(&csv).unwrap();
    let header = views.lines().next().unwrap();
    assert!(header.starts_with("test,run,a_deg,b_deg,") && header.ends_with("residual_axial_um"), "{header}");
    assert_eq!(views.lines().count(), 1 + data.lines().skip(1).count() * 3);
}

#[test]
fn the_bundled_session_is_planned_and_its_clearance_checked_in_its_setting() {
    let output =
        abbe(&["plan", text(&ready("r-test/plan.toml")), "--no-effects", "--device-mm", "290,500,100,120,100,100"]);
    assert!(output.status.success());
    let warned = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(warned.contains("device on the table: shaft and jig, 200 mm"), "{warned}");
    assert!(!warned.contains("device in the spindle"), "{warned}");
}

#[test]
fn views_of_a_ball_bar_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = abbe(&[
        "fit",
        text(&ready("hermle-c600u/measured/session.toml")),
        "--views",
        text(&folder.path().join("views.csv")),
    ]);
    assert_eq!(output.status.code(), Some(1));
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(stderr.contains("r-test") && stderr.contains("ballbar"), "{stderr}");
}
