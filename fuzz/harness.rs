//! Fuzz functions for every reader of `abbe-files`: files, read as the command reads them.
//!
//! For any input the reader returns, a message refers to existing bytes, and accepted values are finite.
//! `files/tests/corpus.rs` replays the corpus with these functions on every test run.

use std::fs;
use std::io::Write;
use std::path::Path;

use abbe_files::ReadOptions;
use abbe_model::Diagnostic;
use abbe_model::document::edit::SessionText;
use abbe_model::session::{Session, planned};

const MACHINE: &str = "chain = \"w C A b Y X Z t\"\n[axis.C]\n[axis.A]\n[axis.X]\n[axis.Y]\n[axis.Z]\n";

/// A ball-bar session whose data file has the name `DATA`.
const SESSION: &str = r#"[machine]
file = "machine.toml"
[instrument]
kind = "ballbar"
FORMAT
[[test]]
name = "XY"
data = "DATA"
bar_mm = 100.0
workpiece_ball_mm = [0, 0, 0]
spindle_ball_mm = [0, 0, 0]
COLUMNS
"#;

/// Runs `work` with the folder of this thread, in memory if the system has `/dev/shm`.
fn within<T>(work: impl FnOnce(&Path) -> T) -> T {
    thread_local! {
        static FOLDER: tempfile::TempDir = {
            let memory = Path::new("/dev/shm");
            let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
            let made = made.expect("a temporary folder");
            put(made.path(), "machine.toml", MACHINE.as_bytes());
            made
        };
    }
    FOLDER.with(|folder| work(folder.path()))
}

fn put(folder: &Path, name: &str, contents: &[u8]) {
    fs::write(folder.join(name), contents).expect("a file in a temporary folder");
}

/// Asserts that a message is not empty and that its span is a range of characters of the file, which the command
/// prints.
fn check_message(fault: &Diagnostic) {
    assert!(!fault.to_string().is_empty());
    let Some(location) = fault.location() else { return };
    let Some(span) = &location.span else { return };
    assert!(span.start <= span.end, "{fault}: {span:?}");
    if let Ok(text) = fs::read_to_string(&location.file)
        && span.end <= text.len()
    {
        assert!(text.is_char_boundary(span.start) && text.is_char_boundary(span.end), "{fault}: {span:?}");
    }
}

/// Reads the session of the folder. The numbers of an accepted session are finite.
fn session_in(folder: &Path) -> Option<Session> {
    let session = match abbe_files::session(&folder.join("session.toml"), &ReadOptions::default()) {
        Ok(session) => session,
        Err(fault) => {
            check_message(&fault);
            return None;
        }
    };
    for test in &session.tests {
        assert!(test.at.iter().all(|at| at.is_finite()));
        let Some(readings) = &test.readings else { continue };
        assert_eq!(readings.observed.len(), readings.rows() * readings.channels);
        assert!(readings.observed.iter().all(|value| value.is_finite()));
        assert!(readings.positions.iter().flatten().all(|value| value.is_finite()));
        // Each row belongs to exactly one run.
        assert_eq!(readings.runs().iter().map(|run| run.len()).sum::<usize>(), readings.rows());
    }
    Some(session)
}

/// `machine.toml`
pub fn machine(input: &[u8]) {
    within(|folder| {
        put(folder, "other.toml", input);
        match abbe_files::machine(&folder.join("other.toml")) {
            Ok(machine) => assert!(machine.axes.iter().flat_map(|axis| axis.direction).all(f64::is_finite)),
            Err(fault) => check_message(&fault),
        }
    });
}

/// `session.toml`: a plan or, with `data = "C.csv"`, a measured session.
pub fn session(input: &[u8]) {
    within(|folder| {
        put(folder, "C.csv", b"run,c_deg,length_mm\n1,0,100.0\n1,90,100.001\n2,90,100.0\n2,0,99.999\n");
        put(folder, "session.toml", input);
        let Some(session) = session_in(folder) else { return };
        let text = std::str::from_utf8(input).expect("an accepted session is UTF-8");
        let file = Path::new("session.toml");
        // The rewritten form of a valid session is a valid session.
        let mut again = SessionText::new(text, file).expect("it was read");
        again.set_machine_file("machine.toml");
        again.set_of_instrument("noise_um", 0.5);
        again.add_effects(&session.effects, &session.machine).expect("it was read");
        again.remove(&["effect"]);
        assert!(!again.to_string().contains("[[effect]]\ncomponent"));
        let short = text.matches("runs").count() == 0 && text.len() < 4000;
        let steps = session.tests.iter().filter(|test| test.motion.is_some()).count();
        if short && steps == 1 {
            // A plan that the machine cannot execute gives an error.
            if let Err(fault) = planned::planned_session(&session) {
                check_message(&fault);
            }
        }
    });
}

fn table_of(data: &str, format: &str, columns: &str, input: &[u8]) {
    within(|folder| {
        let text = SESSION.replace("DATA", data).replace("FORMAT", format).replace("COLUMNS", columns);
        put(folder, "session.toml", text.as_bytes());
        put(folder, data, input);
        session_in(folder);
    });
}

/// A CSV file with the names of Abbe.
pub fn table(input: &[u8]) {
    table_of("data.csv", "", "", input);
}

/// A foreign CSV file: the first byte selects the format, the rest is the file.
pub fn foreign(input: &[u8]) {
    let Some((choice, rest)) = input.split_first() else {
        return;
    };
    let (separator, decimal) = [(";", ","), ("\\t", "."), (":", "."), ("|", ",")][usize::from(choice % 4)];
    let header = choice & 4 == 0;
    let format = format!("[format]\nseparator = \"{separator}\"\ndecimal = \"{decimal}\"\nheader = {header}\n");
    let columns = match (header, choice & 8 == 0) {
        (true, true) => "columns = { x_mm = \"X act\", y_mm = \"Y act\", deviation_um = \"ΔL\" }",
        (true, false) => "columns = { time_s = \"t\", c_rad = \"C\", length_mm = \"L\" }",
        (false, true) => "columns = { x_mm = 1, y_mm = 2, length_mm = 3 }",
        (false, false) => "columns = { run = 1, a_rad = 3, length_mm = 2 }",
    };
    table_of("data.csv", &format, columns, rest);
}

/// A ball-bar file in XML.
pub fn xml(input: &[u8]) {
    let columns = "columns = { deviation_um = \"READINGS\" }\n\
                   path = { kind = \"circle\", plane = \"XY\", radius_mm = 100, from_deg = 0, to_deg = 360, step_deg = 1 }";
    table_of("data.b5r", "", columns, input);
}

/// A spreadsheet: a complete file if the input begins like a ZIP file, otherwise the XML of its sheet.
pub fn sheet(input: &[u8]) {
    if input.starts_with(b"PK") {
        table_of("data.xlsx", "", "", input);
    } else {
        table_of("data.xlsx", "", "", &book(input).expect("a ZIP file in memory"));
    }
}

/// The smallest workbook that contains the XML of a sheet.
fn book(sheet: &[u8]) -> zip::result::ZipResult<Vec<u8>> {
    const PARTS: [(&str, &str); 5] = [
        (
            "[Content_Types].xml",
            r#"<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="xml" ContentType="application/xml"/></Types>"#,
        ),
        (
            "_rels/.rels",
            concat!(
                r#"<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">"#,
                r#"<Relationship Id="rId1" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/officeDocument" "#,
                r#"Target="xl/workbook.xml"/></Relationships>"#,
            ),
        ),
        (
            "xl/workbook.xml",
            concat!(
                r#"<workbook xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main" "#,
                r#"xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships">"#,
                r#"<sheets><sheet name="A" sheetId="1" r:id="rId1"/></sheets></workbook>"#,
            ),
        ),
        (
            "xl/_rels/workbook.xml.rels",
            concat!(
                r#"<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">"#,
                r#"<Relationship Id="rId1" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet" "#,
                r#"Target="worksheets/sheet1.xml"/>"#,
                r#"<Relationship Id="rId2" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/sharedStrings" "#,
                r#"Target="sharedStrings.xml"/></Relationships>"#,
            ),
        ),
        (
            "xl/sharedStrings.xml",
            r#"<sst xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><si><t>x_mm</t></si><si><t>y_mm</t></si><si><t>length_mm</t></si></sst>"#,
        ),
    ];
    let mut writer = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, text) in PARTS {
        writer.start_file(name, stored)?;
        writer.write_all(text.as_bytes())?;
    }
    writer.start_file("xl/worksheets/sheet1.xml", stored)?;
    writer.write_all(sheet)?;
    Ok(writer.finish()?.into_inner())
}
