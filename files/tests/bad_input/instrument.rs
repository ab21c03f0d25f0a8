//! Tests of instrument set-ups.

use super::{DATA, MACHINE, SESSION, assert_contains, error_text, session, with_data, with_session, without_tests};

#[test]
fn unknown_instruments() {
    assert_contains(
        &with_session("\"ballbar\"", "\"bar\""),
        &["session.toml:5", "\"ballbar\", \"r-test\", \"probe\", "],
    );
    assert_contains(&with_session("\"ballbar\"", "\"tracker\""), &["`bar_mm` belongs to a ballbar"]);
}

#[test]
fn uncertainties_below_zero() {
    assert_contains(
        &with_session("bar_mm", "bar_u_um = -1\nbar_mm"),
        &["session.toml:11", "`bar_u_um` is -1", "cannot be negative"],
    );
    assert_contains(&with_session("noise_um = 0.3", "noise_um = -0.3"), &["session.toml:6", "cannot be negative"]);
}

#[test]
fn a_bar_that_does_not_fit() {
    let radians = DATA.replace("c_deg", "a_deg");
    let offset = SESSION.replace("[0, 100, 0]", "[0, 100, 60]");
    assert_contains(
        &error_text(session(MACHINE, &offset, Some(DATA))),
        &["session.toml:8", "a bar of 100.0000 mm cannot reach", "116.619 mm apart", "degrees read as radians"],
    );
    // A depends on both balls: degrees misread as radians separate the balls.
    let both = SESSION.replace("spindle_ball_mm = [0, 0, 0]", "spindle_ball_mm = [0, 100, 100]");
    let data = radians.replace("a_deg", "a_rad").replace(",90,", ",2,").replace(",270,", ",5,");
    assert_contains(&error_text(session(MACHINE, &both, Some(&data))), &["cannot reach"]);
    assert_contains(
        &with_data(&DATA.replace("length_mm", "deviation_um").replace("99.", "99999.").replace("100.", "99999.")),
        &["read 200.000 mm", "deviation"],
    );
}

#[test]
fn probes_that_miss_the_artefact() {
    const TEST: &str = r#"[[test]]
name = "1a"
data = "C100.csv"
radius_mm = 45
artefact_mm = [0, 0, 0]
stylus_mm = [0, 0, 0]
at = { x_mm = 45, y_mm = 0, z_mm = 0, a_deg = 0 }
"#;
    const TOUCHES: &str = "c_deg,deviation_um\n0,1.5\n90,-2.0\n";
    let probe = without_tests().replace("ballbar", "probe") + TEST;
    let read = |from: &str, to: &str| session(MACHINE, &probe.replace(from, to), Some(TOUCHES));
    let readings = read("", "").unwrap().tests.remove(0).readings.unwrap();
    assert_eq!(readings.observed, [-1.5e-3, 2.0e-3]);
    for (from, to, expected) in [
        ("radius_mm = 45", "radius_mm = 30", "is 15.000 mm from the artefact's nominal surface"),
        ("x_mm = 45", "x_mm = 0", "misses the artefact, or is on its axis"),
        (
            "stylus_mm = [0, 0, 0]",
            "stylus_mm = [0, 0, 0]\ndirection = [0, 1, 0]\nartefact_axis = [0, 1, 0]",
            "misses the artefact",
        ),
        ("stylus_mm = [0, 0, 0]", "stylus_mm = [0, 0, 0]\ndirection = [0, 0, 0]", "`direction` is zero"),
        ("radius_mm = 45", "radius_mm = 0", "it must be greater than 0"),
        ("radius_mm = 45", "radius_mm = 45\nbar_mm = 100", "`bar_mm` belongs to a ballbar"),
    ] {
        let error_text = error_text(read(from, to));
        assert!(error_text.contains(expected), "{to}: {error_text}");
    }
    let named = session(MACHINE, &probe, Some("c_deg,length_mm\n0,1\n90,2\n"));
    assert!(error_text(named).contains("unknown name `length_mm`"));
}

/// An invalid R-test: the change in a valid one, and the message.
#[test]
fn invalid_sensors() {
    const TEST: &str = r#"[[test]]
name = "BK2"
data = "C100.csv"
setting = "E"
workpiece_ball_mm = [100, 0, 50]
spindle_ball_mm = [0, 0, 0]
sensor_angles_deg = [135, -35.264, 0]
at = { y_mm = 0, z_mm = 50, a_deg = 0 }
"#;
    const DATA: &str = "c_deg,x_mm,y_mm,du_um,dv_um,dw_um\n0,100,0,1.5,0,2\n90,0,100,-2,1,3\n";
    let good = without_tests().replace("ballbar", "r-test") + &TEST.replace("y_mm = 0, ", "");
    let read = |from: &str, to: &str, data: (&str, &str)| {
        assert!(good.contains(from) && DATA.contains(data.0), "{from} {}", data.0);
        session(MACHINE, &good.replacen(from, to, 1), Some(&DATA.replace(data.0, data.1)))
    };
    let readings = read("", "", ("", "")).unwrap().tests.remove(0).readings.unwrap();
    assert_eq!(readings.observed, [1.5e-3, 0.0, 2.0e-3, -2.0e-3, 1.0e-3, 3.0e-3]);
    let angles = "sensor_angles_deg = [135, -35.264, 0]";
    for (from, to, expected) in [
        ("setting = \"E\"\n", "", &["session.toml:8", "no `setting`", "\"Es\""][..]),
        ("\"E\"", "\"F\"", &["session.toml:11", "the text \"F\"", "sensors in the spindle"]),
        ("workpiece_ball_mm = [100, 0, 50]\n", "", &["session.toml:8", "no `workpiece_ball_mm`", "table frame"]),
        ("spindle_ball_mm", "bar_mm = 100\nspindle_ball_mm", &["session.toml:13", "`bar_mm` belongs to a ballbar"]),
        (angles, "sensor_angles_deg = [135, 0]", &["session.toml:14", "three angles"]),
        (angles, "sensor_angles_deg = [135, nan, 0]", &["session.toml:14", "`sensor_angles_deg` is NaN"]),
        (
            angles,
            "sensor_angles_deg = [135, -35.264, 0]\nsensor_directions = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
            &["session.toml:15", "both `sensor_angles_deg` and `sensor_directions`", "keep one"],
        ),
        (
            angles,
            "sensor_directions = [[1, 0, 0], [0, 1, 0], [1, 1, 0.01]]",
            &["session.toml:14", "almost in a plane", "0.007", "three independent measuring directions"],
        ),
        (
            angles,
            "sensor_directions = [[1, 0, 0], [0, 0, 0], [1, 1, 0.01]]",
            &["session.toml:14", "`sensor_directions` is zero"],
        ),
        (angles, "sensor_u_arcsec = -1", &["session.toml:14", "`sensor_u_arcsec` is -1", "cannot be negative"]),
        (angles, "", &["C100.csv:1", "column 4 has the unknown name `du_um`", "needs `dx_um`, `dy_um` and `dz_um`"]),
        ("[100, 0, 50]", "[100, 6, 50]", &["session.toml:8", "reading 1", "6.000 mm from the centre of the sensors"]),
        (
            angles,
            "path = { kind = \"follow\", axis = \"C\", offset = \"radial\", step_deg = 10 }",
            &["session.toml:14", "`offset` is the direction of a bar", "remove it"],
        ),
        (
            angles,
            "path = { kind = \"follow\", axis = \"C\", step_deg = 10, feed_mm_min = 10, programmed_feed_mm_min = 10 }",
            &["session.toml:14", "both `programmed_feed_mm_min` and `feed_mm_min`"],
        ),
    ] {
        assert_contains(&error_text(read(from, to, ("", ""))), expected);
    }
    for (from, to, expected) in [
        ("dw_um", "dz_um", &["C100.csv:1", "unknown name `dz_um`", "the sensor values"][..]),
        (",dw_um", ",temperature_c", &["C100.csv:1", "no column `dw_um`"]),
        ("dv_um", "du_mm", &["C100.csv:1", "have the same meaning"]),
        ("_um", "_m", &["session.toml:8", "the sensors read", "another unit"]),
    ] {
        assert_contains(&error_text(read("", "", (from, to))), expected);
    }
    let on_axis = good
        .replace("[100, 0, 50]", "[0, 0, 50]")
        .replace(angles, "path = { kind = \"follow\", axis = \"C\", step_deg = 10, programmed_feed_mm_min = 10 }");
    assert_contains(
        &error_text(session(MACHINE, &on_axis, Some(DATA))),
        &["session.toml:14", "`programmed_feed_mm_min` of a ball that lies on its axis of rotation", "feed_deg_min"],
    );
}

#[test]
fn composed_measurements_that_do_not_fit_together() {
    const COMPOSED: &str = r#"[[target]]
name = "stylus"
frame = "tool"
point_mm = [0, 0, 0]

[[target]]
name = "sphere"
frame = "table"
point_mm = [0, 20, 0]

[[target]]
name = "R"
length_mm = 15.5

[[channel]]
name = "contact"
distance = ["stylus", "sphere"]
less = ["R"]
reading = 0

[[test]]
name = "1a"
data = "C100.csv"
at = { x_mm = 0, y_mm = 35.5, z_mm = 0, a_deg = 0 }
"#;
    const CONTACTS: &str = "c_deg\n0\n90\n";
    let composed = without_tests().replace("ballbar", "composed") + COMPOSED;
    let read = |from: &str, to: &str| {
        assert!(composed.contains(from), "{from}");
        session(MACHINE, &composed.replacen(from, to, 1), Some(CONTACTS))
    };
    let whole = read("R", "R").unwrap();
    assert_eq!(whole.tests[0].readings.as_ref().unwrap().observed, [0.0, 0.0]);
    assert_eq!(whole.tests[0].station.channels().len(), 1);
    let alone = without_tests().replace("ballbar", "composed") + "[[test]]\nname = \"1a\"\ndata = \"C100.csv\"\n";
    let read_alone = |key: &str| error_text(session(MACHINE, &(alone.clone() + key), Some(CONTACTS)));
    assert_contains(&read_alone(""), &["is composed, but the session has no channel"]);
    assert_contains(&read_alone("zz = 1\n"), &["has the unknown key `zz`"]);
    for (from, to, expected) in [
        ("\"stylus\", \"sphere\"]", "\"stylus\", \"ball\"]", "\"ball\" is no target that is a point"),
        ("\"stylus\", \"sphere\"]", "\"stylus\", \"stylus\"]", "needs two different points"),
        ("less = [\"R\"]", "less = [\"sphere\"]", "\"sphere\" is no target that is a length"),
        ("reading = 0", "reading = 15.5", "is another constant than 0"),
        ("reading = 0", "", "has no reading, or two"),
        ("reading = 0", "column = \"length_arcsec\"", "has no unit of the channel"),
        ("reading = 0", "column = \"c_mm\"", "is the column of something else"),
        ("reading = 0", "column = \"length_mm\"", "no column `length_mm`"),
        ("distance = [", "along = [", "needs 3 targets"),
        ("frame = \"table\"", "frame = \"axis B\"", "no body of the machine"),
        ("frame = \"table\"\n", "", "[[target]] has no `frame`"),
        ("name = \"sphere\"", "name = \"stylus\"", "stands twice"),
        ("name = \"R\"", "name = \"R 1\"", "a name has at most 40 letters"),
        ("length_mm = 15.5", "length_mm = 15.5\npoint_mm = [0, 0, 0]", "or several of them"),
        ("length_mm = 15.5", "length_mm = 15.5\npoint_u_um = 1", "is of another target"),
        ("point_mm = [0, 20, 0]", "point_mm = [0, 35.5, 0]", "nominally coincide"),
        ("at = {", "R_m = 3\nat = {", "R_m"),
        ("kind = \"composed\"", "kind = \"probe\"", "[[target]] in a session of a touch probe"),
    ] {
        assert_contains(&error_text(read(from, to)), &[expected]);
    }
}
