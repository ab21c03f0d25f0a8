//! Tests of the files of telescopes: the readings of the same table as CSV, and the place of every fault.

use std::fs;

use abbe_files::ReadOptions;
use abbe_model::Diagnostic;
use abbe_model::session::Session;

use super::{assert_contains, error_text};

const MOUNT: &str = r#"chain = "w b AZ EL t"
[axis.AZ]
kind = "rotary"
direction = [0, 0, -1]
[axis.EL]
kind = "rotary"
direction = [0, -1, 0]
"#;

const TPOINT: &str = "A telescope\n: ALTAZ\n: ROTNL\n-30 14 40.3\n\
    010.5 37.4 010.4 37.5 000.4 ; [1]\n; a comment\n350.25 47 350.125 46.875 -12\nEND\nnothing is read here\n";

/// Azimuths of the file are 180° less those of Abbe.
const MMT: &str = "CAT: FK5 1\nRAA:   77.375  347.25\nAA: 1 2\nTAA:   77.5  -12.25\nLST: 19:11:22.950\n\
    CAT: FK5 2\nTAA:   20.25  170.0\nRAA:   20.5  169.875\n";

/// Reads a session of one test with this file; `edit` changes the session and the machine.
fn read(name: &str, data: &str, edit: impl Fn(&str) -> String) -> Result<Session, Diagnostic> {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("mount.toml", &edit(MOUNT));
    write(name, data);
    write(
        "session.toml",
        &edit(&format!(
            "[machine]\nfile = \"mount.toml\"\n[instrument]\nkind = \"pointing\"\n[[test]]\nname = \"N\"\ndata = \"{name}\"\n"
        )),
    );
    abbe_files::session(&folder.path().join("session.toml"), &ReadOptions::default())
}

fn unchanged(text: &str) -> String {
    text.to_string()
}

/// The same readings as those of a CSV file.
#[track_caller]
fn assert_equals_csv(name: &str, data: &str, csv: &str) -> Session {
    let own = read(name, data, unchanged).unwrap();
    let other = read("a.csv", csv, unchanged).unwrap();
    let [a, b] = [&own, &other].map(|session| session.tests[0].readings.as_ref().unwrap());
    let near = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(near(&a.observed, &b.observed), "{:?} {:?}", a.observed, b.observed);
    assert!(a.positions.iter().zip(&b.positions).all(|(a, b)| near(a, b)));
    assert_eq!(a.drivers, b.drivers);
    own
}

#[test]
fn the_readings_are_those_of_the_same_table_as_csv() {
    let header = "true_azimuth_deg,true_elevation_deg,az_deg,el_deg";
    let csv = format!("{header},driver.rotator_deg\n10.5,37.4,10.4,37.5,0.4\n350.25,47,350.125,46.875,-12\n");
    let own = assert_equals_csv("a.dat", TPOINT, &csv);
    assert_eq!(own.tests[0].readings.as_ref().unwrap().line(1), Some(7));
    let without_rotator = TPOINT.replace(" 000.4 ;", " ;").replace(" -12", "");
    let csv = format!("{header}\n10.5,37.4,10.4,37.5\n350.25,47,350.125,46.875\n");
    assert_equals_csv("a.dat", &without_rotator, &csv);
    let csv = format!("{header}\n192.25,77.5,192.75,77.375\n10,20.25,10.125,20.5\n");
    let own = assert_equals_csv("a.dat", MMT, &csv);
    assert_eq!(own.tests[0].readings.as_ref().unwrap().line(0), Some(2));
    // Any other file of this extension is a table.
    assert_equals_csv("b.dat", &csv, &csv);
}

#[test]
fn every_fault_has_its_line() {
    let tpoint = |from: &str, to: &str| error_text(read("a.dat", &TPOINT.replacen(from, to, 1), unchanged));
    assert_contains(&tpoint("ALTAZ", "EQUAT"), &["a.dat:4", "no option `: ALTAZ`", "alt-azimuth"]);
    assert_contains(&tpoint("010.4 37.5 000.4", "010.4"), &["a.dat:5", "a line with 3 numbers", "true azimuth"]);
    assert_contains(&tpoint("46.875 -12", "46.875"), &["a.dat:7", "a row of 4 cells", "5 columns"]);
    assert_contains(&tpoint("46.875", "46:52"), &["a.dat:7", "`46:52` is not a number", "el_deg"]);
    assert_contains(&error_text(read("a.dat", "A\n: ALTAZ\n", unchanged)), &["a.dat", "ends before the latitude"]);
    assert_contains(&error_text(read("a.dat", "A\n: ALTAZ\n-30 14 40\nEND\n", unchanged)), &["an empty data file"]);
    let mmt = |from: &str, to: &str| error_text(read("a.dat", &MMT.replacen(from, to, 1), unchanged));
    assert_contains(&mmt("TAA:   77.5", "TAB: "), &["a.dat:6", "no `TAA:`", "a record starts with `CAT:`"]);
    assert_contains(&mmt("RAA:   20.5", "RAB: "), &["a.dat:8", "no `RAA:`"]);
    assert_contains(&mmt("347.25", ""), &["a.dat:2", "`RAA:` with 1 number instead of 2"]);
    assert_contains(&mmt("170.0", "S"), &["a.dat:7", "`TAA:`: `S` is not a number"]);
    let as_tracker = |text: &str| {
        text.replace("pointing\"", "tracker\"").replace("name = \"N\"", "name = \"N\"\ntarget_mm = [0, 0, 0]")
    };
    for data in [TPOINT, MMT] {
        assert_contains(&error_text(read("a.dat", data, as_tracker)), &["kind `tracker`", "kind = \"pointing\""]);
    }
    let three = |text: &str| text.replace("AZ EL t\"", "AZ EL C t\"\n[axis.C]\ndirection = [1, 0, 0]\n");
    assert_contains(&error_text(read("a.dat", TPOINT, three)), &["3 rotary axes", "two rotary axes"]);
}

/// The nominal line of sight far from the stars: the direction of an axis is reversed.
#[test]
fn a_mount_that_turns_the_other_way_is_refused() {
    let reversed = |text: &str| text.replace("[0, 0, -1]", "[0, 0, 1]").replace("[0, -1, 0]", "[0, 1, 0]");
    let text = error_text(read("a.dat", TPOINT, reversed));
    assert_contains(&text, &["away from what was observed", "direction = [0, 0, -1]"]);
}

/// The readings agree with the line of sight along X, whatever the session states: found if it has no prior, named if it has.
#[test]
fn a_line_of_sight_that_fits_is_found_or_named() {
    let elsewhere = |more: &'static str| {
        move |text: &str| text.replace("name = \"N\"", &format!("name = \"N\"\nline_of_sight = [0.6, 0, -0.8]{more}"))
    };
    let warnings = read("a.dat", TPOINT, elsewhere("")).unwrap().warnings.join(" ");
    assert_contains(
        &warnings,
        &["points 53.", "from another line of sight", "`line_of_sight = [1.000000, 0.000000, 0.000000]`"],
    );
    let text = error_text(read("a.dat", TPOINT, elsewhere("\nline_of_sight_u_arcsec = 30")));
    assert_contains(
        &text,
        &["points 53.", "most readings agree with `line_of_sight = [1.000000, 0.000000, 0.000000]`"],
    );
}
