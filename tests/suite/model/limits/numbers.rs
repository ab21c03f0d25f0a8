//! Lengths, angles and readings at the limits of double precision.

use std::fs;

use super::{Case, displaced, fitted, folder, found, refused, session_refused, works};
use crate::suite::{abbe, ready, text};

#[test]
fn bars_of_a_millimetre_and_of_ten_metres() {
    for bar_mm in [1.0, 10_000.0] {
        let result = works(&Case { bar_mm, ..Case::default() });
        // 72 readings of 0.3 µm: the least-squares centre of a full circle has u = σ·√(2/n).
        let (_, u) = found(&result, "EX0C");
        assert!((u - 0.3 * (2.0_f64 / 72.0).sqrt()).abs() < 1e-3, "{u}");
    }
}

#[test]
fn a_bar_of_no_length() {
    session_refused(
        &Case { bar_mm: 5e-324, ..Case::default() },
        &["session.toml:11", "reading 1", "the two balls nominally coincide", "5e-324 mm"],
    );
}

#[test]
fn a_million_turns() {
    let angles = (0..36).map(|k| 360.0 * 1e6 + 10.0 * f64::from(k)).collect();
    works(&Case { angles, ..Case::default() });
}

/// At 10¹² degrees a double resolves 10⁻⁴ degrees; larger angles are meaningless.
#[test]
fn more_turns_than_double_precision_resolves() {
    let case = Case::default();
    let data = case.data().replacen("180.0", "1e13", 1);
    refused(
        folder(&case.session(), &data).path(),
        "fit",
        &[],
        &["C.csv:20", "`c_deg`", "`1e13` is infinite or too large; the limit is 1e12"],
    );
}

#[test]
fn a_denormal_angle() {
    let case = Case::default();
    let result = fitted(&case.session(), &case.data().replace("1,0.0,", "1,5e-324,"));
    displaced(&result, 1e-3);
}

#[test]
fn infinite_and_huge_readings() {
    for cell in ["inf", "-inf", "1e400", "1e300"] {
        let case = Case::default();
        let data = case.data().replacen("180.0", cell, 1);
        let parts = ["C.csv:20", "`c_deg`", "is infinite or too large; the limit is 1e12"];
        refused(folder(&case.session(), &data).path(), "fit", &[], &parts);
    }
}

#[test]
fn huge_numbers_in_a_session() {
    let case = Case::default();
    for (from, to, place) in [
        ("bar_mm = 100.0", "bar_mm = 1e300", "`bar_mm` is 1e300, which is too large; the limit is 1 km"),
        ("[0, 100.0, 0]", "[0, 1e300, 0]", "is 1e300, which is too large; the limit is 1 km"),
        ("[0, 100.0, 0]", "[0, 1000001, 0]", "is 1000001, which is too large; the limit is 1 km"),
        ("[0, 100.0, 0]", "[0, \"1e200 * 1e10\", 0]", "which is too large; the limit is 1 km"),
        (
            "data = \"C.csv\"",
            "data = \"C.csv\"\nat = { x_mm = 1e300 }",
            "`x_mm` is 1e300, which is too large; the limit is 1 km",
        ),
    ] {
        assert!(case.session().contains(from));
        let session = case.session().replacen(from, to, 1);
        refused(folder(&session, &case.data()).path(), "fit", &[], &["session.toml:", place]);
    }
}

#[test]
fn denormal_readings() {
    let data = "run,c_deg,length_mm\n1,0,5e-324\n1,90,5e-324\n1,180,5e-324\n";
    refused(folder(&Case::default().session(), data).path(), "fit", &[], &["a bar of 100.0000 mm read 0.000 mm"]);
}

/// All positions are multiples of 0.5°: a wave of 0.001° is zero in all readings but for rounding, and its amplitude without meaning.
#[test]
fn an_amplitude_of_kilometres_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(ready("hermle-c600u/measured")).unwrap() {
        let file = entry.unwrap().path();
        fs::copy(&file, folder.path().join(file.file_name().unwrap())).unwrap();
    }
    let session = folder.path().join("session.toml");
    let plain = fs::read_to_string(&session).unwrap();
    let warned = |period_deg: f64| {
        let wave = format!("component = \"EZC\"\ndriver = \"C\"\nshape = \"periodic\"\nperiod_deg = {period_deg}\n");
        fs::write(&session, format!("{plain}\n[[effect]]\n{wave}")).unwrap();
        let fit = abbe(&["fit", text(&session)]);
        assert!(fit.status.success());
        String::from_utf8(fit.stderr).unwrap().contains("which no machine has")
    };
    assert!(warned(0.001));
    assert!(!warned(180.0));
}
