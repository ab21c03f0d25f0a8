//! Instruments as a test sets them up.

use super::{DATA, MACHINE, SESSION, holds, session, told, with_data, with_session, without_tests};

#[test]
fn instruments_that_are_not_built() {
    holds(
        &with_session("\"ballbar\"", "\"r-test\""),
        &["session.toml:5", "\"r-test\" is not built yet"],
    );
    holds(
        &with_session("\"ballbar\"", "\"bar\""),
        &["\"ballbar\", \"tracker\", \"socket\" or \"probe\" is expected"],
    );
    holds(
        &with_session("\"ballbar\"", "\"tracker\""),
        &["`bar_mm` belongs to a ballbar"],
    );
}

#[test]
fn uncertainties_below_zero() {
    holds(
        &with_session("bar_mm", "bar_u_um = -1\nbar_mm"),
        &["session.toml:11", "`bar_u_um` is -1", "cannot be negative"],
    );
    holds(
        &with_session("noise_um = 0.3", "noise_um = -0.3"),
        &["session.toml:6", "cannot be negative"],
    );
}

#[test]
fn a_bar_that_cannot_reach() {
    let radians = DATA.replace("c_deg", "a_deg");
    let offset = SESSION.replace("[0, 100, 0]", "[0, 100, 60]");
    holds(
        &told(session(MACHINE, &offset, Some(DATA))),
        &[
            "session.toml:8",
            "a bar of 100.0000 mm cannot reach",
            "116.619 mm apart",
            "degrees taken for radians",
        ],
    );
    // A follows from both balls: turned by degrees read as radians the balls come apart.
    let both = SESSION.replace("spindle_ball_mm = [0, 0, 0]", "spindle_ball_mm = [0, 100, 100]");
    let data = radians
        .replace("a_deg", "a_rad")
        .replace(",90,", ",2,")
        .replace(",270,", ",5,");
    holds(&told(session(MACHINE, &both, Some(&data))), &["cannot reach"]);
    holds(
        &with_data(
            &DATA
                .replace("length_mm", "deviation_um")
                .replace("99.", "99999.")
                .replace("100.", "99999."),
        ),
        &["read 200.000 mm", "deviation"],
    );
}

#[test]
fn probes_that_cannot_touch() {
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
        (
            "radius_mm = 45",
            "radius_mm = 30",
            "stands 15.000 mm before the artefact's nominal surface",
        ),
        (
            "x_mm = 45",
            "x_mm = 0",
            "looks past the artefact, or stands on its axis",
        ),
        (
            "stylus_mm = [0, 0, 0]",
            "stylus_mm = [0, 0, 0]\ndirection = [0, 1, 0]\nartefact_axis = [0, 1, 0]",
            "looks past",
        ),
        (
            "stylus_mm = [0, 0, 0]",
            "stylus_mm = [0, 0, 0]\ndirection = [0, 0, 0]",
            "`direction` has no length",
        ),
        (
            "radius_mm = 45",
            "radius_mm = 0",
            "a cylinder has a radius above 0",
        ),
        (
            "radius_mm = 45",
            "radius_mm = 45\nbar_mm = 100",
            "`bar_mm` belongs to a ballbar",
        ),
    ] {
        let told = told(read(from, to));
        assert!(told.contains(expected), "{to}: {told}");
    }
    let named = session(MACHINE, &probe, Some("c_deg,length_mm\n0,1\n90,2\n"));
    assert!(told(named).contains("`length_mm`, which is not known"));
}
