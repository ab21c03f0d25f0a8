//! Tests of tables of readings: columns, cells, lines.

use super::{DATA, MACHINE, SESSION, assert_contains, error_text, session, with_data};

#[test]
fn unknown_column() {
    assert_contains(
        &with_data(&DATA.replace("c_deg", "c_degree")),
        &["C100.csv:1", "column 3 has the unknown name `c_degree`", "did you mean `c_deg`?", "[columns]"],
    );
    assert_contains(&with_data(&DATA.replace(',', ";")), &["separator = \";\""]);
}

#[test]
fn missing_columns() {
    assert_contains(
        &with_data(&DATA.replace("length_mm", "temperature_c")),
        &["C100.csv:1", "found: time_s, run, c_deg, temperature_c", "`length_mm`"],
    );
    let swept = SESSION.to_string() + "sweep = { axis = \"A\", from_deg = 0, to_deg = 10, step_deg = 1 }\n";
    assert_contains(&error_text(session(MACHINE, &swept, Some(DATA))), &["no column `a_deg`, though axis `A` moves"]);
}

#[test]
fn foreign_columns() {
    let with = |columns: &str| SESSION.replace("[[test]]", &format!("{columns}\n[[test]]"));
    let foreign = "t,angle,reading,remark\n0,0,100.0,a\n1,1,100.1,b\n";
    let good = with("[columns]\ntime_s = \"t\"\nc_deg = \"angle\"\nlength_mm = 3\n");
    let read = session(MACHINE, &good, Some(foreign)).unwrap();
    assert_eq!(read.tests[0].readings.as_ref().unwrap().observed, [100.0, 100.1]);
    assert_contains(
        &error_text(session(MACHINE, &with("[columns]\nc_deg = \"angel\"\nlength_mm = 3\n"), Some(foreign))),
        &["session.toml:9", "has no column `angel`", "did you mean `angle`?", "t, angle, reading, remark"],
    );
    assert_contains(
        &error_text(session(MACHINE, &with("[columns]\nc_degree = \"angle\"\nlength_mm = 3\n"), Some(foreign))),
        &["has the unknown column `c_degree`", "did you mean `c_deg`?"],
    );
    assert_contains(
        &error_text(session(MACHINE, &with("[columns]\nc_deg = \"angle\"\nlength_mm = 7\n"), Some(foreign))),
        &["there is no column 7 in", "which has 4"],
    );
    assert_contains(
        &error_text(session(MACHINE, &with("[format]\nheader = false\n"), Some("0,1,2\n"))),
        &["without a header", "[columns]"],
    );
}

#[test]
fn text_in_a_numeric_cell() {
    assert_contains(
        &with_data(&DATA.replace("100.0010", "lost")),
        &["C100.csv:3", "column 4 (`length_mm`): `lost` is not a number"],
    );
    assert_contains(&with_data(&DATA.replace("100.0010", "")), &["C100.csv:3", "an empty cell"]);
}

#[test]
fn a_decimal_comma_undeclared() {
    let foreign = "time_s;run;c_deg;length_mm\n0;1;0;99,9990\n1;1;90;100,0010\n";
    let declared = SESSION.replace("[[test]]", "[format]\nseparator = \";\"\n\n[[test]]");
    assert_contains(
        &error_text(session(MACHINE, &declared, Some(foreign))),
        &["C100.csv:2", "column 4", "`99,9990` has a decimal comma", "decimal = \",\""],
    );
    let declared = SESSION.replace("[[test]]", "[format]\nseparator = \";\"\ndecimal = \",\"\n\n[[test]]");
    let read = session(MACHINE, &declared, Some(foreign)).unwrap();
    assert_eq!(read.tests[0].readings.as_ref().unwrap().observed, [99.9990, 100.0010]);
    assert_contains(
        &with_data(&DATA.replace("99.9990", "99,9990")),
        &["C100.csv:2", "5 cells", "4 columns", "decimal comma"],
    );
    let only_decimal = SESSION.replace("[[test]]", "[format]\ndecimal = \",\"\n\n[[test]]");
    assert_contains(
        &error_text(session(MACHINE, &only_decimal, Some(foreign))),
        &["session.toml:9", "also the separator"],
    );
}

#[test]
fn decreasing_time() {
    assert_contains(
        &with_data(&DATA.replace("\n2,1", "\n0.5,1")),
        &["C100.csv:4", "column 1 (`time_s`)", "time decreases: 0.5 s after 1 s"],
    );
}

#[test]
fn empty_data() {
    assert_contains(&with_data(""), &["C100.csv:0", "an empty data file"]);
    assert_contains(&with_data("# nothing\n\n"), &["an empty data file"]);
    assert_contains(&with_data("time_s,run,c_deg,length_mm\n"), &["an empty data file: a header without readings"]);
}

#[test]
fn one_reading() {
    assert_contains(&with_data("time_s,run,c_deg,length_mm\n0,1,0,100\n"), &["C100.csv:2", "one reading"]);
}

#[test]
fn rows_and_lines_are_counted_through_comments_and_crlf() {
    let data = format!("\u{feff}# from the bar\r\n\r\n{}", DATA.replace('\n', "\r\n"));
    let read = session(MACHINE, SESSION, Some(&data)).unwrap();
    let readings = read.tests[0].readings.as_ref().unwrap();
    assert_eq!(readings.origin.as_ref().unwrap().line, [4, 5, 6, 7]);
    assert_contains(&with_data(&data.replace("100.0000", "x")), &["C100.csv:6"]);
    assert_contains(&with_data(&DATA.replace(",1,90,", ",90,")), &["C100.csv:3", "3 cells", "4 columns"]);
}

#[test]
fn a_line_without_end() {
    assert_contains(&with_data(&"1".repeat(3 << 20)), &["C100.csv:1", "a line of more than"]);
}
