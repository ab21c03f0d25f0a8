//! Tests of foreign files: encodings, lines above the header, inches; nothing may be lost or misread.

use std::fs;

use abbe_files::ReadOptions;
use abbe_model::session::Session;

use super::{DATA, MACHINE, SESSION, assert_contains, error_text, session};

/// Reads the session with these lines before its test, and a data file of these bytes.
fn with_bytes(lines: &str, data: &[u8]) -> Result<Session, abbe_model::Diagnostic> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("machine.toml"), MACHINE).unwrap();
    fs::write(folder.path().join("C100.csv"), data).unwrap();
    let text = SESSION.replace("[[test]]", &format!("{lines}\n[[test]]"));
    fs::write(folder.path().join("session.toml"), text).unwrap();
    abbe_files::session(&folder.path().join("session.toml"), &ReadOptions::default())
}

fn observed(read: &Session) -> &[f64] {
    &read.tests[0].readings.as_ref().unwrap().observed
}

const FOREIGN: &str = "Lauf;Länge;Winkel\n1;99,9990;0\n1;100,0010;90\n1;100,0000;180\n";
const COLUMNS: &str = "[columns]\nrun = \"Lauf\"\nlength_mm = \"Länge\"\nc_deg = \"Winkel\"\n[format]\nseparator = \";\"\ndecimal = \",\"\n";

#[test]
fn latin_1_and_utf_16_are_read_as_utf_8_is() {
    let latin: Vec<u8> = FOREIGN.chars().map(|c| c as u8).collect();
    let wide = |mark: bool, of: fn(u16) -> [u8; 2]| -> Vec<u8> {
        let text = if mark { format!("\u{feff}{FOREIGN}") } else { FOREIGN.into() };
        text.encode_utf16().flat_map(of).collect()
    };
    for (bytes, more) in [
        (FOREIGN.as_bytes().to_vec(), ""),
        (latin.clone(), ""),
        (latin.clone(), "encoding = \"latin1\""),
        (wide(true, u16::to_le_bytes), ""),
        (wide(true, u16::to_be_bytes), ""),
        (wide(false, u16::to_le_bytes), ""),
        (wide(false, u16::to_be_bytes), ""),
        (wide(false, u16::to_le_bytes), "encoding = \"utf-16le\""),
    ] {
        let read = with_bytes(&format!("{COLUMNS}{more}"), &bytes).unwrap();
        assert_eq!(observed(&read), [99.9990, 100.0010, 100.0], "{more} {:?}", &bytes[..8]);
        assert_eq!(read.tests[0].readings.as_ref().unwrap().origin.as_ref().unwrap().line, [2, 3, 4]);
    }
    // A header in another encoding than the stated one.
    let fault = error_text(with_bytes(&format!("{COLUMNS}encoding = \"utf-8\""), &latin));
    assert_contains(&fault, &["C100.csv:1", "not valid UTF-8", "encoding = \"latin1\""]);
    let fault = error_text(with_bytes(&format!("{COLUMNS}encoding = \"latin1\""), FOREIGN.as_bytes()));
    assert_contains(&fault, &["no column `Länge`", "read as Latin-1", "encoding = "]);
    let fault = error_text(with_bytes(&format!("{COLUMNS}encoding = \"latin-one\""), &latin));
    assert_contains(&fault, &["session.toml", "which is not a known encoding", "latin1"]);
}

#[test]
fn lines_above_the_header_are_skipped() {
    let above = format!("Gerät \"7\nSerie;1;2;3;4\n\n{DATA}");
    let read = with_bytes("[format]\nskip_lines = 3\n", above.as_bytes()).unwrap();
    let readings = read.tests[0].readings.as_ref().unwrap();
    assert_eq!((readings.rows(), readings.line(0)), (4, Some(5)));
    assert_contains(&error_text(with_bytes("", above.as_bytes())), &["C100.csv:1"]);
}

#[test]
fn inches_and_mil() {
    let inch = "run,c_deg,length_in\n1,0,3.937\n1,90,3.93705\n";
    let read = with_bytes("", inch.as_bytes()).unwrap();
    assert!((observed(&read)[0] - 3.937 * 25.4).abs() < 1e-12);
    let mil = "run,c_deg,x_in,deviation_mil\n1,0,0.001,0.1\n1,90,0,-0.2\n";
    let read = with_bytes("", mil.as_bytes()).unwrap();
    assert!((observed(&read)[0] - (100.0 + 0.1 * 0.0254)).abs() < 1e-12);
    let x = read.machine.axis_index("X").unwrap();
    let positions = &read.tests[0].readings.as_ref().unwrap().positions[x];
    assert!((positions[0] - 0.0254).abs() < 1e-15);
}

#[test]
fn a_file_without_a_header_keeps_its_first_reading() {
    let rows = "0,1,0,99.9990\n1,1,90,100.0010\n2,1,180,100.0000\n";
    let columns = "[columns]\ntime_s = 1\nrun = 2\nc_deg = 3\nlength_mm = 4\n";
    let fault = error_text(with_bytes(columns, rows.as_bytes()));
    assert_contains(&fault, &["C100.csv:1", "numbers where a header is expected", "header = false"]);
    let read = with_bytes(&format!("{columns}[format]\nheader = false\n"), rows.as_bytes()).unwrap();
    assert_eq!(observed(&read), [99.9990, 100.0010, 100.0]);
    // A remark in the row does not make it a header.
    let remarks = rows.replace('\n', ",good\n");
    assert_contains(&error_text(with_bytes(columns, remarks.as_bytes())), &["numbers where a header is expected"]);
    assert_contains(
        &error_text(with_bytes(&columns.replace("= 4", "= \"reading\""), rows.as_bytes())),
        &["no column `reading`", "header = false"],
    );
    assert_contains(&error_text(with_bytes("", rows.as_bytes())), &["C100.csv:1", "header = false"]);
    // Names that look like numbers are names if [columns] says so.
    let numbered = "1,2,3\n0,0,99.9990\n1,90,100.0010\n";
    let columns = "[columns]\ntime_s = \"1\"\nc_deg = \"2\"\nlength_mm = \"3\"\n";
    assert_eq!(observed(&with_bytes(columns, numbered.as_bytes()).unwrap()).len(), 2);
}

#[test]
fn a_foreign_column_maps_to_one_column() {
    let twice = "angle,reading,reading\n0,99.9,100.0\n90,99.9,100.0\n";
    let columns = "[columns]\nc_deg = \"angle\"\nlength_mm = \"reading\"\n";
    let fault = error_text(with_bytes(columns, twice.as_bytes()));
    assert_contains(&fault, &["session.toml", "2 columns with the name `reading`: 2, 3", "number of one of them"]);
    let read = with_bytes(&columns.replace("\"reading\"", "3"), twice.as_bytes()).unwrap();
    assert_eq!(observed(&read), [100.0, 100.0]);
    // One foreign column cannot be two of ours, by name or by number.
    let one = "t,angle,reading\n0,0,100.0\n1,90,100.1\n";
    for both in ["run = \"t\"\ntime_s = \"t\"", "run = 1\ntime_s = \"t\"", "time_s = 1\nrun = 1"] {
        let fault = error_text(with_bytes(
            &format!("[columns]\n{both}\nc_deg = \"angle\"\nlength_mm = \"reading\"\n"),
            one.as_bytes(),
        ));
        assert_contains(&fault, &["session.toml", "column 1 of", "twice", "`run`", "`time_s`"]);
    }
}

#[test]
fn an_empty_table_of_columns_is_ignored() {
    assert_eq!(observed(&with_bytes("[columns]\n", DATA.as_bytes()).unwrap()).len(), 4);
    let tracker = SESSION
        .replace("ballbar", "tracker")
        .replace(
            "bar_mm = 100.0\nworkpiece_ball_mm = [0, 100, 0]\nspindle_ball_mm = [0, 0, 0]",
            "target_mm = [0, 0, 0]\nat = { a_deg = 0, x_mm = 0, y_mm = 0, z_mm = 0 }",
        )
        .replace("[[test]]", "[columns]\n[[test]]");
    let data = "c_deg,px_mm,py_mm,pz_mm\n0,1,2,3\n90,1,2,3\n";
    let read = session(MACHINE, &tracker, Some(data)).unwrap();
    assert_eq!(observed(&read).len(), 6);
}

#[test]
fn duplicate_rows_are_reported_and_are_not_repeats() {
    let copied = |data: &str| {
        let read = session(MACHINE, SESSION, Some(data)).unwrap();
        (read.tests[0].readings.as_ref().unwrap().rows(), read.warnings)
    };
    assert_eq!(copied(DATA), (4, Vec::new()));
    // With time: each of two rows repeated.
    let mut lines: Vec<&str> = DATA.lines().collect();
    lines.insert(2, lines[1]);
    lines.insert(5, lines[4]);
    let (rows, warnings) = copied(&lines.join("\n"));
    assert_eq!(rows, 4);
    assert_eq!(warnings.len(), 1);
    assert_contains(
        &warnings[0],
        &["test \"C100\"", "C100.csv", "2 rows are copies", "line 3, 6", "not treated as repeats"],
    );
    // Without time: the whole file repeated after itself.
    let mut timeless = "run,c_deg,length_mm\n".to_string();
    let mut reading = 100.0;
    for run in 1..=2 {
        for k in 0..8 {
            reading += 0.0007 * f64::from(k % 3 - 1);
            timeless += &format!("{run},{},{reading:.4}\n", k * 45);
        }
    }
    assert_eq!(copied(&timeless), (16, Vec::new()));
    let body = timeless.split_once('\n').unwrap().1.to_string();
    let (rows, warnings) = copied(&(timeless.clone() + &body));
    assert_eq!((rows, warnings.len()), (16, 1), "{warnings:?}");
    assert_contains(&warnings[0], &["16 rows", "…"]);
    // Repeats at fixed axes, some equal by rounding, are kept; so is a closed path that ends as it began.
    let dwell = "run,c_deg,length_mm\n1,0,100.000\n1,0,100.000\n1,0,100.001\n1,90,100.000\n1,90,100.000\n";
    assert_eq!(copied(dwell), (5, Vec::new()));
    let closed = "run,c_deg,x_mm,length_mm\n1,0,0,100.000\n1,90,0,100.002\n1,0,0,100.000\n";
    assert_eq!(copied(closed), (3, Vec::new()));
    // A column that is not read distinguishes rows as well.
    let counted = "t,angle,reading,n\n0,0,100.0,1\n0,0,100.0,2\n1,90,100.1,3\n";
    let read =
        with_bytes("[columns]\ntime_s = \"t\"\nc_deg = \"angle\"\nlength_mm = \"reading\"\n", counted.as_bytes());
    assert_eq!(observed(&read.unwrap()).len(), 3);
}

#[test]
fn notes_of_the_measurement_are_kept_in_order() {
    let notes = "[about]\nserial_number = 4711\noperator = \"N. N.\"\ndate = 2026-11-22\ncomment = \"\"\"after\nrepair\"\"\"\norder = \"Z-9\"\n";
    let read = with_bytes(notes, DATA.as_bytes()).unwrap();
    let expected = [
        ("serial_number", "4711"),
        ("operator", "N. N."),
        ("date", "2026-11-22"),
        ("comment", "after\nrepair"),
        ("order", "Z-9"),
    ];
    let expected = expected.map(|(name, note)| (name.to_string(), note.to_string()));
    assert_eq!(read.about, expected);
    let fault = error_text(with_bytes("[about]\noperator = [1]\n", DATA.as_bytes()));
    assert_contains(&fault, &["session.toml:9", "`operator` is a list of 1; a text"]);
    assert_contains(&error_text(with_bytes("about = 3\n[x]\n", DATA.as_bytes())), &["session.toml"]);
}

#[test]
fn sign_and_unit_mistakes_of_an_axis_are_suggested() {
    // X moves the ball away from the axis of C; with the opposite sign the bar fits.
    let with = |column: &str, value: &dyn Fn(f64) -> f64| {
        let mut data = format!("run,{column},x_mm,y_mm,length_mm\n");
        for k in 0..12 {
            let angle = f64::from(k) * 7.0;
            let (sin, cos) = angle.to_radians().sin_cos();
            // C rotates the ball at [0, 100, 0] about Z; the spindle keeps a distance of 100 mm in X.
            let (x, y) = (-100.0 * sin + 100.0, 100.0 * cos);
            data += &format!("1,{},{x},{y},100\n", value(angle));
        }
        data
    };
    session(MACHINE, SESSION, Some(&with("c_deg", &|angle| angle))).unwrap();
    let fault = error_text(session(MACHINE, SESSION, Some(&with("c_deg", &|angle| -angle))));
    assert_contains(&fault, &["cannot reach", "positions of C were read with the opposite sign"]);
    let fault = error_text(session(MACHINE, SESSION, Some(&with("c_deg", &f64::to_radians))));
    assert_contains(&fault, &["cannot reach", "positions of C were read in radians rather than degrees"]);
    let inches = with("c_deg", &|angle| angle).replace("x_mm,y_mm", "x_in,y_in");
    let fault = error_text(session(MACHINE, SESSION, Some(&inches)));
    assert_contains(&fault, &["positions of Y and X were read in mm rather than inches"]);
}
