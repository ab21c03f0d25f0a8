//! Foreign files: the same readings from a spreadsheet, from other column names and from ball-bar XML give the same
//! fit.

use std::path::{Path, PathBuf};

use rust_xlsxwriter::Workbook;
use serde_json::Value;

use crate::plant::{AxisName, Component, Driver, Freedom, Injected, Kind, Recipe, Shape};
use crate::suite::{abbe, text};

/// Writes a session of circles and returns for each test its name, its columns and its rows.
fn circles(folder: &Path) -> Vec<(String, Vec<String>, Vec<Vec<f64>>)> {
    let backlash =
        Injected::new(Component::Motion(Freedom::Y, AxisName::Y), Driver::Axis(AxisName::Y), Shape::Backlash, 4.0);
    let recipe = Recipe::new(Kind::LinearCircles, 3).with(backlash);
    recipe.draw().write(folder).unwrap();
    ["XY-F1000", "XY-F3000"]
        .map(|test| {
            let table = std::fs::read_to_string(folder.join(format!("{test}.csv"))).unwrap();
            let mut lines = table.lines();
            let header = lines.next().unwrap().split(',').map(str::to_string).collect();
            let rows = lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
            (test.to_string(), header, rows)
        })
        .to_vec()
}

fn fit(session: &Path) -> Value {
    let file = session.with_extension("json");
    let run = abbe(&["fit", text(session), "--json", text(&file)]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap()
}

/// G(b) of a circle.
fn bidirectional_um(circle: &Value) -> f64 {
    let mut figures = circle["figures"].as_array().unwrap().iter();
    let found = figures.find(|figure| figure["id"] == "bidirectional_circular_deviation").unwrap();
    found["value"].as_f64().unwrap()
}

/// The error message of a session that is refused.
fn message_of(session: &Path) -> String {
    let run = abbe(&["fit", text(session)]);
    assert_eq!(run.status.code(), Some(1), "{}", String::from_utf8_lossy(&run.stdout));
    String::from_utf8_lossy(&run.stderr).into_owned()
}

fn rewritten(folder: &Path, name: &str, change: impl Fn(String) -> String) -> PathBuf {
    let session = std::fs::read_to_string(folder.join("session.toml")).unwrap();
    let file = folder.join(name);
    std::fs::write(&file, change(session)).unwrap();
    file
}

#[test]
fn a_spreadsheet_gives_the_same_fit() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let tests = circles(folder);
    let expected = fit(&folder.join("session.toml"));
    // Other names, another order, a title as a comment, both tests in one spreadsheet.
    let theirs = ["Zeit", "Lauf", "X-Position", "Y-Position", "Z", "A", "C", "Länge"];
    let mut book = Workbook::new();
    for (test, _, rows) in &tests {
        let sheet = book.add_worksheet().set_name(test).unwrap();
        sheet.write_string(0, 0, "# measured on Tuesday").unwrap();
        for (column, name) in theirs.iter().enumerate() {
            sheet.write_string(2, column as u16, *name).unwrap();
        }
        for (row, cells) in rows.iter().enumerate() {
            for (column, cell) in cells.iter().enumerate() {
                sheet.write_number(row as u32 + 3, column as u16, *cell).unwrap();
            }
        }
    }
    book.save(folder.join("circles.xlsx")).unwrap();
    let columns = "[columns]\ntime_s = \"Zeit\"\nrun = \"Lauf\"\nx_mm = \"X-Position\"\ny_mm = \"Y-Position\"\nz_mm = \"Z\"\na_deg = \"A\"\n\
                   c_deg = \"C\"\nlength_mm = \"Länge\"\n";
    let in_book = |session: String| {
        let mut session = session.replace("[[test]]", &format!("{columns}[[test]]")).replacen(columns, "", 1);
        session = session.replace(columns, "");
        session = session.replacen("[[test]]", &format!("{columns}\n[[test]]"), 1);
        for (test, ..) in &tests {
            session = session.replace(
                &format!("data = \"{test}.csv\""),
                &format!("data = \"circles.xlsx\"\nformat = {{ sheet = \"{test}\" }}"),
            );
        }
        session
    };
    let read = fit(&rewritten(folder, "book.toml", in_book));
    assert_eq!(read["parameters"], expected["parameters"]);
    assert_eq!(read["circular"], expected["circular"]);

    let several =
        rewritten(folder, "several.toml", |session| in_book(session).replace("format = { sheet = \"XY-F1000\" }", ""));
    let message = message_of(&several);
    assert!(
        message.contains("several sheets contain cells: XY-F1000, XY-F3000") && message.contains("sheet = "),
        "{message}"
    );
    let none =
        rewritten(folder, "none.toml", |session| in_book(session).replace("sheet = \"XY-F1000\"", "sheet = \"YZ\""));
    assert!(message_of(&none).contains("there is no sheet `YZ`"));
    std::fs::write(folder.join("circles.xlsx"), "no zip at all").unwrap();
    let message = message_of(&rewritten(folder, "broken.toml", in_book));
    assert!(message.contains("circles.xlsx: the spreadsheet cannot be read"), "{message}");
}

#[test]
fn a_cell_without_a_number_is_an_error_with_row_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (test, header, rows) = circles(folder).swap_remove(0);
    let mut book = Workbook::new();
    let sheet = book.add_worksheet();
    for (column, name) in header.iter().enumerate() {
        sheet.write_string(0, column as u16, name).unwrap();
        for (row, cells) in rows.iter().enumerate() {
            sheet.write_number(row as u32 + 1, column as u16, cells[column]).unwrap();
        }
    }
    sheet.write_string(7, 2, "about 99").unwrap();
    book.save(folder.join("one.xlsx")).unwrap();
    let message =
        message_of(&rewritten(folder, "one.toml", |session| session.replace(&format!("{test}.csv"), "one.xlsx")));
    assert!(message.contains("one.xlsx:8: column 3 (`x_mm`): `about 99` is not a number"), "{message}");
}

/// Ball-bar XML of the runs of a test: deviations from 100 mm in µm.
fn xml(rows: &[Vec<f64>], run: &dyn Fn(usize, &str, &str) -> String) -> String {
    let mut text =
        String::from("<?xml version=\"1.0\"?>\n<BALLBAR_TEST>\n<OPERATOR>N.N.</OPERATOR><PLANE TEST_PLANE=\"XY\"/>\n");
    for (index, rows) in rows.chunk_by(|a, b| a[1] == b[1]).enumerate() {
        let turn = rows[0][2] * rows[1][3] - rows[1][2] * rows[0][3];
        let readings: Vec<String> = rows.iter().map(|row| format!("{:.4}", (row[7] - 100.0) * 1e3)).collect();
        text.push_str(&run(index, if turn > 0.0 { "CCW" } else { "CW" }, &readings.join(" ")));
    }
    text + "<FEATURE NAME=\"AF_CIRCULARITY\" DT=\"UT_LENGTH_UM\">4.1</FEATURE><FEATURE/></BALLBAR_TEST>\n"
}

#[test]
fn ball_bar_xml_gives_the_same_fit() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let tests = circles(folder);
    let expected = fit(&folder.join("session.toml"));
    let path = |session: String| {
        let movement = "columns = { deviation_um = \"READINGS\" }\npath = { kind = \"circle\", plane = \"XY\", radius_mm = 100, step_deg = 1 }\n";
        let mut session = session;
        for (test, ..) in &tests {
            session = session.replace(&format!("data = \"{test}.csv\""), &format!("data = \"{test}.b5r\"\n{movement}"));
        }
        session
    };
    let in_elements = |_: usize, direction: &str, readings: &str| {
        format!("<RUN>\n<RUN_DIRECTION>{direction}</RUN_DIRECTION>\n<READINGS>{readings}</READINGS>\n</RUN>\n")
    };
    let in_attributes = |_: usize, direction: &str, readings: &str| {
        let each: Vec<String> = readings.split(' ').map(|value| format!("<R>{value}</R>")).collect();
        format!("<READINGS RUN_DIRECTION=\"{direction}\">{}</READINGS>\n", each.concat())
    };
    let forms: [&dyn Fn(usize, &str, &str) -> String; 2] = [&in_elements, &in_attributes];
    for form in forms {
        for (test, _, rows) in &tests {
            std::fs::write(folder.join(format!("{test}.b5r")), xml(rows, form)).unwrap();
        }
        let read = fit(&rewritten(folder, "xml.toml", path));
        for (read, expected) in
            read["parameters"].as_array().unwrap().iter().zip(expected["parameters"].as_array().unwrap())
        {
            assert_eq!(read["id"], expected["id"]);
            let values = [read, expected].map(|parameter| parameter["value"].as_f64().unwrap());
            assert!((values[0] - values[1]).abs() < 1e-3, "{read} {expected}");
        }
        for (read, expected) in
            read["circular"].as_array().unwrap().iter().zip(expected["circular"].as_array().unwrap())
        {
            assert!((bidirectional_um(read) - bidirectional_um(expected)).abs() < 1e-3);
        }
        let warnings = read["warnings"].to_string();
        assert!(warnings.contains("not publicly known") && warnings.contains("FEATURE (2), OPERATOR"), "{warnings}");
    }
    // UTF-16, as some programs write it.
    let (test, _, rows) = &tests[0];
    let wide: Vec<u8> =
        std::iter::once(0xfeff).chain(xml(rows, &in_elements).encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let file = folder.join(format!("{test}.b5r"));
    std::fs::write(&file, wide).unwrap();
    fit(&rewritten(folder, "wide.toml", path));

    // Information that the file lacks is requested, not guessed.
    let session = rewritten(folder, "xml.toml", path);
    let says = |contents: &str, message: &str| {
        std::fs::write(&file, contents).unwrap();
        let stderr = message_of(&session);
        assert!(stderr.contains(message), "{message}: {stderr}");
    };
    let good = xml(rows, &in_elements);
    says(
        &good.replace("<RUN_DIRECTION>CCW</RUN_DIRECTION>", "<RUN_DIRECTION>0</RUN_DIRECTION>"),
        "RUN_DIRECTION is `0`, which is not known",
    );
    says(&good.replace("<RUN_DIRECTION>CCW</RUN_DIRECTION>", ""), "READINGS without a RUN_DIRECTION");
    says(&good.replace("TEST_PLANE=\"XY\"", "TEST_PLANE=\"YZ\""), "TEST_PLANE is `YZ`, but the test's `path` is in XY");
    says(&good.replace("<READINGS>", "<READINGS>dropout "), "READINGS: `dropout` is not a number");
    says(&good.replace("READINGS", "VALUES"), "it has no element READINGS");
    says(&good[..good.find("<READINGS>").unwrap() + 40], "it ends within <READINGS>");
    says("<a></b>", "not valid XML");
    std::fs::write(&file, &good).unwrap();
    let numbered = good.replace(">CCW<", ">0<").replace(">CW<", ">1<");
    std::fs::write(&file, numbered).unwrap();
    fit(&rewritten(folder, "numbered.toml", |session| {
        path(session).replace("data = \"XY-F1000.b5r\"", "data = \"XY-F1000.b5r\"\nformat = { anticlockwise = \"0\" }")
    }));
    std::fs::write(&file, &good).unwrap();
    let message = message_of(&rewritten(folder, "unit.toml", |session| {
        path(session).replace("columns = { deviation_um = \"READINGS\" }", "")
    }));
    assert!(
        message.contains("does not state the unit of its READINGS") && message.contains("deviation_um = "),
        "{message}"
    );
}

/// The direction of a run in files: CCW and CW have their meaning whatever the session states for other words; numbers
/// and booleans are the stated value or the opposite. A session that states forward runs only is warned of backward
/// runs.
#[test]
fn the_direction_of_a_run_is_read_from_words_numbers_and_booleans() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let tests = circles(folder);
    let expected = fit(&folder.join("session.toml"));
    let (test, _, rows) = &tests[0];
    let run = |_: usize, direction: &str, readings: &str| {
        format!("<RUN><RUN_DIRECTION>{direction}</RUN_DIRECTION><READINGS>{readings}</READINGS></RUN>\n")
    };
    let good = xml(rows, &run);
    let session = |more: &str, both: bool| {
        let data = format!(
            "data = \"{test}.b5r\"\n{more}\ncolumns = {{ deviation_um = \"READINGS\" }}\n\
             path = {{ kind = \"circle\", plane = \"XY\", radius_mm = 100, step_deg = 1, both_directions = {both} }}\n"
        );
        rewritten(folder, "directions.toml", |session| session.replace(&format!("data = \"{test}.csv\""), &data))
    };
    let g = |fit: &Value| fit["circular"][0]["diagnosis"].clone();
    let figure = |of: &Value, fault: &str, id: &str| {
        let found = of.as_array().unwrap().iter().find(|found| found["fault"] == fault && found["axes"] != "X");
        let values = found.unwrap()["values"].as_array().unwrap();
        values.iter().find(|value| value["id"] == id).unwrap()["value"].as_f64().unwrap()
    };
    for (words, more) in [
        (["CCW", "CW"], "format = { anticlockwise = \"0\" }"),
        (["ccw", "Clockwise"], ""),
        (["0", "1"], "format = { anticlockwise = 0 }"),
        (["True", "FALSE"], "format = { anticlockwise = true }"),
        (["false", "true"], "format = { anticlockwise = \"0\" }"),
    ] {
        let file = good
            .replace(">CCW<", ">+<")
            .replace(">CW<", &format!(">{}<", words[1]))
            .replace(">+<", &format!(">{}<", words[0]));
        std::fs::write(folder.join(format!("{test}.b5r")), file).unwrap();
        let read = fit(&session(more, true));
        // The backlash of Y, 4 µm, has the sign of the direction; a wrong direction would invert it.
        let values = [&read, &expected].map(|fit| figure(&g(fit), "backlash", "Y+"));
        assert!((values[0] - values[1]).abs() < 0.01 && values[0] > 3.0, "{words:?} {more}: {values:?}");
        let warnings = read["warnings"].to_string();
        assert!(!warnings.contains("forward"), "{warnings}");
        let warnings = fit(&session(more, false))["warnings"].to_string();
        assert!(warnings.contains("backward, but the session states runs = 1, both_directions = false"), "{warnings}");
    }
    let three = good.replacen(">CCW<", ">2<", 1).replace(">CCW<", ">0<").replace(">CW<", ">1<");
    std::fs::write(folder.join(format!("{test}.b5r")), three).unwrap();
    let stderr = message_of(&session("format = { anticlockwise = \"0\" }", true));
    assert!(stderr.contains("RUN_DIRECTION is `") && stderr.contains("the other word in this file"), "{stderr}");
}

/// The report contains the notes of the measurement and the ball-bar figures; the JSON contains the notes.
#[test]
fn notes_and_ball_bar_figures_are_in_the_report() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    circles(folder);
    let notes = "[about]\nserial_number = \"4711\"\noperator = \"N. N. <nn@example.org>\"\ndate = 2026-11-22\ncomment = \"after the repair\"\n";
    let session =
        rewritten(folder, "about.toml", |session| session.replacen("[[test]]", &format!("{notes}[[test]]"), 1));
    let read = fit(&session);
    assert_eq!(read["about"]["serial_number"], "4711");
    assert_eq!(read["about"]["date"], "2026-11-22");
    assert!(fit(&folder.join("session.toml")).get("about").is_none());
    for command in ["fit", "trace"] {
        let (report, json) = (folder.join("report.html"), folder.join("about-again.json"));
        let mut arguments = vec![command, text(&session), "--report", text(&report), "--json", text(&json)];
        if command == "trace" {
            arguments.extend(["--quiet", "--max-effects", "1", "--only", "EYY~Y:backlash"]);
        }
        let run = abbe(&arguments);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let found: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
        assert_eq!(found["about"]["comment"], "after the repair", "{command}");
        let page = std::fs::read_to_string(&report).unwrap();
        for part in
            ["<dt>serial number</dt><dd>4711</dd>", "N. N. &lt;nn@example.org&gt;", "2026-11-22", "after the repair"]
        {
            assert!(page.contains(part), "{command}: {part}");
        }
        if command == "fit" {
            for part in [
                "Ball-bar figures",
                "circular error (G)",
                "bidirectional circular error (G(b))",
                "mean bidirectional radial error (D)",
                "backlash Y+",
            ] {
                assert!(page.contains(part), "{part}");
            }
            let g = bidirectional_um(&read["circular"][0]);
            assert!(page.contains(&format!("<td>{g:.2}</td>")), "{g}");
        }
    }
}

/// A report suggests `--improve` only if the command accepts it: it is refused for other instruments than a ball bar
/// and without a rotary axis. A model that lacks an effect is traced first, as the opening says.
#[test]
fn a_report_suggests_no_command_that_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("report.html");
    let offers = |session: &Path| {
        let run = abbe(&["fit", text(session), "--report", text(&report)]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        std::fs::read_to_string(&report).unwrap().contains("--improve")
    };
    assert!(offers(&crate::suite::ready("table-and-head/measured/session.toml")));
    assert!(!offers(&crate::suite::ready("hermle-c600u/measured/session.toml")));
    let r_test = crate::suite::ready("r-test/measured/session.toml");
    // The R-test lacks an effect: a search comes first. A next test is there all the same.
    assert!(!offers(&r_test));
    let run = abbe(&["plan", text(&r_test), "--no-effects", "--improve", "1"]);
    assert!(run.status.success(), "every instrument has a next test: {}", String::from_utf8_lossy(&run.stderr));
}
