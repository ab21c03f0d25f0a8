//! What a user can get wrong in a session, one test each: the message names the file, the line and the way out.

use std::fs;
use std::path::Path;

use abbe_model::ModelError;
use abbe_model::session::Session;
use abbe_model::session::read::{self, ReadOptions};

const MACHINE: &str = r#"name = "Small"
chain = "w C A b Y X Z t"

[axis.C]
direction = [0, 0, 1]

[axis.A]
direction = [1, 0, 0]

[axis.X]
[axis.Y]
[axis.Z]
"#;

const SESSION: &str = r#"[machine]
file = "machine.toml"

[instrument]
kind = "ballbar"
noise_um = 0.3

[[test]]
name = "C100"
data = "C100.csv"
bar_mm = 100.0
workpiece_ball_mm = [0, 100, 0]
spindle_ball_mm = [0, 0, 0]
"#;

const DATA: &str =
    "time_s,run,c_deg,length_mm\n0,1,0,99.9990\n1,1,90,100.0010\n2,1,180,100.0000\n3,1,270,99.9995\n";

/// Reads a session from three files.
fn session(machine: &str, session: &str, data: Option<&str>) -> Result<Session, ModelError> {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("machine.toml", machine);
    write("session.toml", session);
    if let Some(data) = data {
        write("C100.csv", data);
    }
    read::session(&folder.path().join("session.toml"), &ReadOptions::default())
}

/// The error as `file:line: message | help`, the file without its folder.
fn told(result: Result<Session, ModelError>) -> String {
    let fault = result.expect_err("this input is bad");
    let place = fault.place().expect("a place in a file").clone();
    let name = place.file.file_name().unwrap().to_string_lossy().into_owned();
    let message = fault.to_string().replace(&place.to_string(), &name);
    format!("{name}:{} {message} | {}", place.line, fault.help().unwrap_or(""))
}

#[track_caller]
fn holds(told: &str, parts: &[&str]) {
    for part in parts {
        assert!(told.contains(part), "`{part}` is not in\n{told}");
    }
}

fn with_session(from: &str, to: &str) -> String {
    assert!(SESSION.contains(from), "{from}");
    told(session(MACHINE, &SESSION.replacen(from, to, 1), Some(DATA)))
}

fn with_data(data: &str) -> String {
    told(session(MACHINE, SESSION, Some(data)))
}

fn with_machine(from: &str, to: &str) -> String {
    assert!(MACHINE.contains(from), "{from}");
    told(session(&MACHINE.replacen(from, to, 1), SESSION, Some(DATA)))
}

#[test]
fn the_good_one_reads() {
    let read = session(MACHINE, SESSION, Some(DATA)).unwrap();
    assert_eq!(read.tests[0].readings.as_ref().unwrap().rows(), 4);
}

#[test]
fn unknown_keys() {
    holds(
        &with_session("bar_mm", "bar_length = 1\nbar_mm"),
        &["session.toml:11", "test \"C100\" knows no key `bar_length`"],
    );
    holds(
        &with_session("noise_um", "nois_um"),
        &[
            "session.toml:6",
            "[instrument] knows no key `nois_um`",
            "did you mean `noise_um`?",
        ],
    );
    holds(
        &with_session("[instrument]", "[instruments]"),
        &["has no `instrument`"],
    );
    holds(
        &with_session("[machine]", "extra = 1\n[machine]"),
        &["session.toml:1", "the file knows no key `extra`"],
    );
    holds(
        &with_machine("direction = [1, 0, 0]", "directon = [1, 0, 0]"),
        &[
            "machine.toml:8",
            "knows no key `directon`",
            "did you mean `direction`?",
        ],
    );
}

#[test]
fn text_that_is_no_toml() {
    holds(
        &with_session("kind = ", "kind "),
        &["session.toml:5", "not valid TOML"],
    );
    holds(
        &with_session("100.0", "\"a\" 1"),
        &["session.toml:11", "not valid TOML"],
    );
}

#[test]
fn unknown_column() {
    holds(
        &with_data(&DATA.replace("c_deg", "c_degree")),
        &[
            "C100.csv:1",
            "column 3 is called `c_degree`",
            "did you mean `c_deg`?",
            "[columns]",
        ],
    );
    holds(&with_data(&DATA.replace(',', ";")), &["separator = \";\""]);
}

#[test]
fn missing_data_file() {
    holds(
        &told(session(MACHINE, SESSION, None)),
        &[
            "session.toml:10",
            "the data file `C100.csv` is not there",
            "looked for",
            "--data DIR",
        ],
    );
}

#[test]
fn missing_machine_file() {
    holds(
        &with_session("\"machine.toml\"", "\"engine.toml\""),
        &["session.toml:2", "the machine file `engine.toml` is not there"],
    );
}

#[test]
fn text_in_a_numeric_cell() {
    holds(
        &with_data(&DATA.replace("100.0010", "lost")),
        &["C100.csv:3", "column 4 (`length_mm`): `lost` is not a number"],
    );
    holds(
        &with_data(&DATA.replace("100.0010", "")),
        &["C100.csv:3", "an empty cell"],
    );
}

#[test]
fn a_decimal_comma_undeclared() {
    let foreign = "time_s;run;c_deg;length_mm\n0;1;0;99,9990\n1;1;90;100,0010\n";
    let declared = SESSION.replace("[[test]]", "[format]\nseparator = \";\"\n\n[[test]]");
    holds(
        &told(session(MACHINE, &declared, Some(foreign))),
        &[
            "C100.csv:2",
            "column 4",
            "`99,9990` has a decimal comma",
            "decimal = \",\"",
        ],
    );
    let declared = SESSION.replace(
        "[[test]]",
        "[format]\nseparator = \";\"\ndecimal = \",\"\n\n[[test]]",
    );
    let read = session(MACHINE, &declared, Some(foreign)).unwrap();
    assert_eq!(
        read.tests[0].readings.as_ref().unwrap().observed,
        [99.9990, 100.0010]
    );
    holds(
        &with_data(&DATA.replace("99.9990", "99,9990")),
        &["C100.csv:2", "5 cells", "4 columns", "decimal comma"],
    );
    let only_decimal = SESSION.replace("[[test]]", "[format]\ndecimal = \",\"\n\n[[test]]");
    holds(
        &told(session(MACHINE, &only_decimal, Some(foreign))),
        &["session.toml:9", "also the separator"],
    );
}

#[test]
fn time_running_backwards() {
    holds(
        &with_data(&DATA.replace("\n2,1", "\n0.5,1")),
        &[
            "C100.csv:4",
            "column 1 (`time_s`)",
            "time runs backwards: 0.5 s after 1 s",
        ],
    );
}

#[test]
fn numbers_that_are_none() {
    holds(
        &with_data(&DATA.replace("100.0010", "NaN")),
        &["C100.csv:3", "column 4", "NaN"],
    );
    holds(
        &with_data(&DATA.replace("100.0010", "inf")),
        &["C100.csv:3", "column 4", "infinite"],
    );
    holds(
        &with_session("100.0", "nan"),
        &["session.toml:11", "`bar_mm` is NaN"],
    );
    holds(
        &with_machine("[1, 0, 0]", "[nan, 0, 0]"),
        &["machine.toml:8", "`direction` is NaN"],
    );
    holds(
        &with_machine("[1, 0, 0]", "[0, 0, 0]"),
        &["machine.toml:8", "has no length"],
    );
}

#[test]
fn empty_data() {
    holds(&with_data(""), &["C100.csv:0", "an empty data file"]);
    holds(&with_data("# nothing\n\n"), &["an empty data file"]);
    holds(
        &with_data("time_s,run,c_deg,length_mm\n"),
        &["an empty data file: a header without readings"],
    );
}

#[test]
fn one_reading() {
    holds(
        &with_data("time_s,run,c_deg,length_mm\n0,1,0,100\n"),
        &["C100.csv:2", "one reading"],
    );
}

#[test]
fn missing_columns() {
    holds(
        &with_data(&DATA.replace("length_mm", "temperature_c")),
        &[
            "C100.csv:1",
            "found: time_s, run, c_deg, temperature_c",
            "`length_mm`",
        ],
    );
    let swept = SESSION.to_string() + "sweep = { axis = \"A\", from_deg = 0, to_deg = 10, step_deg = 1 }\n";
    holds(
        &told(session(MACHINE, &swept, Some(DATA))),
        &["no column `a_deg`, though axis `A` moves"],
    );
}

#[test]
fn test_names_twice_and_tests_absent() {
    let twice = SESSION.to_string() + &SESSION[SESSION.find("[[test]]").unwrap()..];
    holds(
        &told(session(MACHINE, &twice, Some(DATA))),
        &["session.toml:15", "two tests are called \"C100\""],
    );
    let none = &SESSION[..SESSION.find("[[test]]").unwrap()];
    holds(&told(session(MACHINE, none, None)), &["a session without tests"]);
}

#[test]
fn a_chain_without_its_bed() {
    holds(
        &with_machine("w C A b Y X Z t", "w C A Y X Z t"),
        &["machine.toml:2", "0 beds `b`"],
    );
}

#[test]
fn an_axis_without_table_and_a_table_without_axis() {
    holds(
        &with_machine("[axis.Z]\n", ""),
        &[
            "machine.toml:2",
            "axis `Z` of the chain",
            "has no table",
            "add [axis.Z]",
        ],
    );
    holds(
        &with_machine("[axis.Z]\n", "[axis.Z]\n[axis.B]\n"),
        &["machine.toml:13", "axis `B` is not in the chain"],
    );
    holds(
        &with_machine("w C A b Y X Z t", "w C A b Y X Z Q1 t"),
        &["axis `Q1` of the chain"],
    );
}

#[test]
fn an_axis_of_unknown_kind() {
    let machine = MACHINE
        .replace("X Z t", "X Q1 t")
        .replace("[axis.Z]", "[axis.Q1]");
    holds(
        &told(session(&machine, SESSION, Some(DATA))),
        &["machine.toml:12", "axis `Q1`", "has no `kind`"],
    );
}

#[test]
fn effects_that_the_machine_cannot_have() {
    let effect = |text: &str| {
        told(session(
            MACHINE,
            &format!("{SESSION}\n[[effect]]\n{text}\n"),
            Some(DATA),
        ))
    };
    holds(
        &effect("component = \"EZB\"\ndriver = \"C\"\nshape = \"harmonic\"\norder = 2"),
        &["session.toml:16", "the machine \"Small\" has no axis `B`"],
    );
    holds(
        &effect("component = \"EZC\"\ndriver = \"B\"\nshape = \"harmonic\"\norder = 2"),
        &["session.toml:17", "no axis `B`"],
    );
    holds(
        &effect("component = \"EZC\"\nshape = \"harmonics\"\norder = 2"),
        &["\"harmonics\" is no shape", "did you mean `harmonic`?"],
    );
    holds(
        &effect("component = \"EZC\"\nshape = \"harmonic\""),
        &["needs `order`"],
    );
    holds(
        &effect("component = \"EXX\"\nshape = \"harmonic\"\norder = 1"),
        &["cannot follow \"X\"", "rotary"],
    );
    holds(
        &effect("component = \"EXX\"\nshape = \"periodic\"\nperiod_deg = 10"),
        &["session.toml:18", "`period_deg` for a driver in mm", "period_mm"],
    );
    holds(
        &effect("component = \"target.x\"\ndriver = \"time\"\nshape = \"drift\""),
        &["a ballbar does not have"],
    );
    holds(
        &effect("component = \"EZC\"\nshape = \"harmonic\"\norder = 2\ntests = [\"C10\"]"),
        &["no test is called \"C10\"", "did you mean `C100`?"],
    );
}

#[test]
fn unknowns_that_the_machine_cannot_have() {
    let unknown = |name: &str| {
        with_session(
            "[[test]]",
            &format!("[unknowns]\nerrors = [\"{name}\"]\n\n[[test]]"),
        )
    };
    holds(&unknown("EX0B"), &["session.toml:9", "has no axis `B`"]);
    holds(&unknown("error"), &["\"error\" is no error's name"]);
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
fn tests_that_do_not_say_how_they_move() {
    holds(
        &with_session("data = \"C100.csv\"\n", ""),
        &["session.toml:8", "neither data nor a movement"],
    );
    let both = SESSION.to_string()
        + "sweep = { axis = \"C\", from_deg = 0, to_deg = 10, step_deg = 1 }\npath = { kind = \"list\" }\n";
    holds(
        &told(session(MACHINE, &both, Some(DATA))),
        &["both `sweep` and `path`"],
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
fn expressions_over_unknown_constants() {
    holds(
        &with_session("[0, 100, 0]", "[0, \"R\", 0]"),
        &["session.toml:12", "no constant `R`", "no [constants]"],
    );
    let constants = SESSION.replace("[[test]]", "[constants]\nR = 100\nH = 75\n\n[[test]]");
    holds(
        &told(session(
            MACHINE,
            &constants.replace("[0, 100, 0]", "[0, \"r\", 0]"),
            Some(DATA),
        )),
        &["no constant `r`", "R, H"],
    );
    holds(
        &told(session(
            MACHINE,
            &constants.replace("[0, 100, 0]", "[0, \"sqrt(H - R)\", 0]"),
            Some(DATA),
        )),
        &["comes to NaN"],
    );
    let deep = format!("[0, \"{}R{}\", 0]", "(".repeat(60), ")".repeat(60));
    holds(
        &told(session(
            MACHINE,
            &constants.replace("[0, 100, 0]", &deep),
            Some(DATA),
        )),
        &["nested deeper"],
    );
    let mut squares = "R".to_string();
    for _ in 0..30 {
        squares = format!("({squares})^2");
    }
    let wide = format!("[0, \"{squares}\", 0]");
    holds(
        &told(session(
            MACHINE,
            &constants.replace("[0, 100, 0]", &wide),
            Some(DATA),
        )),
        &["squares of squares"],
    );
}

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
fn columns_of_other_peoples_files() {
    let with = |columns: &str| SESSION.replace("[[test]]", &format!("{columns}\n[[test]]"));
    let foreign = "t,angle,reading,remark\n0,0,100.0,a\n1,1,100.1,b\n";
    let good = with("[columns]\ntime_s = \"t\"\nc_deg = \"angle\"\nlength_mm = 3\n");
    let read = session(MACHINE, &good, Some(foreign)).unwrap();
    assert_eq!(read.tests[0].readings.as_ref().unwrap().observed, [100.0, 100.1]);
    holds(
        &told(session(
            MACHINE,
            &with("[columns]\nc_deg = \"angel\"\nlength_mm = 3\n"),
            Some(foreign),
        )),
        &[
            "session.toml:9",
            "has no column `angel`",
            "did you mean `angle`?",
            "t, angle, reading, remark",
        ],
    );
    holds(
        &told(session(
            MACHINE,
            &with("[columns]\nc_degree = \"angle\"\nlength_mm = 3\n"),
            Some(foreign),
        )),
        &["knows no column `c_degree`", "did you mean `c_deg`?"],
    );
    holds(
        &told(session(
            MACHINE,
            &with("[columns]\nc_deg = \"angle\"\nlength_mm = 7\n"),
            Some(foreign),
        )),
        &["column 7 of", "which has 4"],
    );
    holds(
        &told(session(
            MACHINE,
            &with("[format]\nheader = false\n"),
            Some("0,1,2\n"),
        )),
        &["without a header", "[columns]"],
    );
}

#[test]
fn rows_and_lines_are_counted_through_comments_and_crlf() {
    let data = format!("\u{feff}# from the bar\r\n\r\n{}", DATA.replace('\n', "\r\n"));
    let read = session(MACHINE, SESSION, Some(&data)).unwrap();
    let readings = read.tests[0].readings.as_ref().unwrap();
    assert_eq!(readings.line, [4, 5, 6, 7]);
    holds(&with_data(&data.replace("100.0000", "x")), &["C100.csv:6"]);
    holds(
        &with_data(&DATA.replace(",1,90,", ",90,")),
        &["C100.csv:3", "3 cells", "4 columns"],
    );
}

#[test]
fn torn_and_garbled_files_are_refused_or_read_and_never_panic() {
    for cut in 0..SESSION.len() {
        let _ = session(MACHINE, &SESSION[..cut], Some(DATA));
    }
    for cut in 0..MACHINE.len() {
        let _ = session(&MACHINE[..cut], SESSION, Some(DATA));
    }
    for cut in 0..DATA.len() {
        let _ = session(MACHINE, SESSION, Some(&DATA[..cut]));
        for garbage in ["\"", ",", "\n", "-", "é", "\0", "1e999"] {
            let garbled = format!("{}{garbage}{}", &DATA[..cut], &DATA[cut..]);
            let _ = session(MACHINE, SESSION, Some(&garbled));
        }
    }
    let nested = format!("x = {}", "[".repeat(100_000));
    holds(
        &told(session(MACHINE, &nested, None)),
        &["session.toml:1", "not valid TOML"],
    );
}

#[test]
fn a_line_without_end() {
    holds(
        &with_data(&"1".repeat(3 << 20)),
        &["C100.csv:1", "a line of more than"],
    );
}

#[test]
fn spans_count_the_byte_order_mark() {
    let marked = format!("\u{feff}{}", SESSION.replace("100.0", "nan"));
    let fault = session(MACHINE, &marked, Some(DATA)).unwrap_err();
    let span = fault.place().unwrap().span.clone().unwrap();
    assert_eq!(&marked[span], "nan");
}

#[test]
fn files_that_are_none() {
    let folder = tempfile::tempdir().unwrap();
    let read = |path: &Path| told(read::session(path, &ReadOptions::default()));
    holds(&read(folder.path()), &["this is a folder"]);
    holds(
        &read(&folder.path().join("no.toml")),
        &["the session file cannot be read"],
    );
    let latin = folder.path().join("latin.toml");
    fs::write(&latin, b"name = \"\xe4\"").unwrap();
    holds(&read(&latin), &["byte 9 is not UTF-8"]);
}

#[test]
fn probes_that_cannot_touch() {
    const PROBE: &str = r#"[machine]
file = "machine.toml"

[instrument]
kind = "probe"

[[test]]
name = "1a"
data = "C100.csv"
radius_mm = 45
artefact_mm = [0, 0, 0]
stylus_mm = [0, 0, 0]
at = { x_mm = 45, y_mm = 0, z_mm = 0, a_deg = 0 }
"#;
    const TOUCHES: &str = "c_deg,deviation_um\n0,1.5\n90,-2.0\n";
    let read = |from: &str, to: &str| session(MACHINE, &PROBE.replace(from, to), Some(TOUCHES));
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
    let named = session(MACHINE, PROBE, Some("c_deg,length_mm\n0,1\n90,2\n"));
    assert!(told(named).contains("`length_mm`, which is not known"));
}
