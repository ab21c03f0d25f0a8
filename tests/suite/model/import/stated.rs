//! What the user and the file state: hints, units in headers and in cells, times of day. Expected values are written by hand
//! or taken from the truth of a foreign file.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use abbe::files::{self, ReadOptions};
use abbe::model::session::Session;
use serde_json::Value;

use super::{difference, import, message, text, truth};

/// A session, the JSON of its import, and the messages; the session is `None` if the file is refused.
type Found = (Option<Session>, Value, String);

fn imported(folder: &Path, name: &str, contents: &str, plan: Option<&str>, more: &[&str]) -> Found {
    let folder = folder.join(std::fs::read_dir(folder).unwrap().count().to_string());
    let file = folder.join("in").join(name);
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(&file, contents).unwrap();
    let json = folder.join("import.json");
    let (output, session) = import(&folder, &file, plan, &[more, &["--json", text(&json)]].concat());
    let said = message(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    if !output.status.success() {
        return (None, Value::Null, said);
    }
    let result = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
    (Some(files::session(&session, &ReadOptions::default()).unwrap()), result, said)
}

/// The readings of test `kugelstab`, µm from 99.9881 mm, one every 5 degrees.
fn lengths() -> Vec<(f64, f64)> {
    let columns = truth("kugelstab.csv");
    columns[0].1.iter().copied().zip(columns[1].1.iter().copied()).collect()
}

/// A file of the ball bar: the header, and a row for each reading.
fn ballbar(header: &str, row: impl Fn(usize, f64, f64) -> String) -> String {
    let rows = lengths().into_iter().enumerate().map(|(k, (c, length))| row(k, c, length) + "\n");
    header.to_string() + "\n" + &rows.collect::<String>()
}

const PLAN: Option<&str> = Some("plan-hermle.toml");

#[test]
fn a_hint_stands_whatever_the_header_says() {
    let place = tempfile::tempdir().unwrap();
    // Our names stand over something else.
    let file = ballbar("A_deg,length_mm,c_deg,raw", |k, c, length| format!("{c},{},{},{length}", 12.0, 7 * k));
    let hints = ["--column", "c_deg=A_deg", "--column", "length_mm=raw"];
    let (session, result, said) = imported(place.path(), "kugelstab.csv", &file, PLAN, &hints);
    let session = session.expect(&said);
    assert_eq!(difference(&session, "kugelstab.csv"), None);
    let columns = result["tests"][0]["columns"].as_array().unwrap();
    let own: Vec<Option<&str>> = columns.iter().map(|column| column["own"].as_str()).collect();
    assert_eq!(own, [Some("c_deg"), None, None, Some("length_mm")]);

    // A unit that no reader of tables knows, and that of the header.
    let file = ballbar("C [deg],Length [µm]", |_, c, length| format!("{:.6},{length}", c / 0.9));
    let hints = ["--column", "c_gon=1", "--column", "length_mm=2"];
    let (session, _, said) = imported(place.path(), "kugelstab.csv", &file, PLAN, &hints);
    assert_eq!(difference(&session.expect(&said), "kugelstab.csv"), None);

    let file = ballbar("C,L", |_, c, length| format!("{c},{length}"));
    for (hint, expected) in [
        ("lenght_mm=L", "`lenght_mm` is no column of a test with this instrument"),
        ("lenght_mm=L", "did you mean `length_mm`?"),
        ("length_deg=L", "the unit of `length_deg` is one of angle, and the column holds a length"),
        ("length_mm=Long", "said to be column `Long`, which the file does not have"),
    ] {
        let (session, _, said) = imported(place.path(), "kugelstab.csv", &file, PLAN, &["--column", hint]);
        assert!(session.is_none() && said.contains(expected), "{hint}: {said}");
    }
    let twice = ["--column", "length_mm=L", "--column", "c_deg=2"];
    let (_, _, said) = imported(place.path(), "kugelstab.csv", &file, PLAN, &twice);
    assert!(said.contains("column 2 is said to be `length_mm` and `c_deg`"), "{said}");
}

#[test]
fn a_unit_behind_a_number_is_that_of_its_row() {
    let place = tempfile::tempdir().unwrap();
    let file = ballbar("C;Length", |k, c, length| match k % 3 {
        0 => format!("{c}°;{length} mm"),
        1 => format!("{c} deg;{} cm", length / 10.0),
        _ => format!("{} gon;{} in", c / 0.9, length / 25.4),
    });
    let (session, result, said) = imported(place.path(), "kugelstab.csv", &file, PLAN, &[]);
    assert_eq!(difference(&session.expect(&said), "kugelstab.csv"), None);
    let because = result["tests"][0]["normalised"].to_string();
    assert!(because.contains("units differ from row to row"), "{because}");

    let other = |unit: &'static str| {
        ballbar("C [deg];Length", move |k, c, length| format!("{c};{length}{}", if k == 9 { unit } else { " mm" }))
    };
    let (_, _, said) = imported(place.path(), "kugelstab.csv", &other("°"), PLAN, &[]);
    assert!(said.contains("line 11") && said.contains("is an angle, and the column is in mm"), "{said}");
    let (_, _, said) = imported(place.path(), "kugelstab.csv", &other(""), PLAN, &[]);
    assert!(
        said.contains("line 11") && said.contains("has no unit, and other numbers of the column have one"),
        "{said}"
    );
}

/// The readings of `units-line.txt` with joints as they are converted, and columns before them.
fn robot(header: &str, before: impl Fn(usize) -> String, joint: impl Fn(f64) -> f64) -> String {
    let columns = truth("units-line.txt");
    let mut file = format!("{header}\n");
    for row in 0..columns[0].1.len() {
        file += &before(row);
        for (k, (_, values)) in columns.iter().enumerate() {
            let value = if k < 6 { joint(values[row]) } else { values[row] };
            let _ = write!(file, "{}{value:.7}", if k == 0 { "" } else { "," });
        }
        file.push('\n');
    }
    file
}

fn joints(unit: &str) -> String {
    (1..=6).map(|k| format!("J{k}{unit},")).collect::<String>() + "X [mm],Y [mm],Z [mm]"
}

#[test]
fn grad_is_a_degree_or_a_gon_as_the_machine_explains() {
    let place = tempfile::tempdir().unwrap();
    for (name, turn, word) in [("units-line.txt", 1.0, "deg"), ("units-line.txt", 0.9, "gon")] {
        let file = robot(&joints(" [Grad]"), |_| String::new(), |deg| deg / turn);
        let (session, result, said) = imported(place.path(), name, &file, None, &[]);
        assert_eq!(difference(&session.expect(&said), name), None, "{word}");
        let remarks = result["tests"][0]["remarks"].to_string();
        assert!(remarks.contains(&format!("may be a degree or a gon: {word} is read")), "{remarks}");
    }
}

#[test]
fn times_and_temperatures_have_the_unit_of_the_header_or_a_remark() {
    let place = tempfile::tempdir().unwrap();
    let readings = |session: &Session| {
        let readings = session.tests[0].readings.clone().unwrap();
        (
            readings.time_s.iter().take(3).map(|t| t - readings.time_s[0]).collect::<Vec<_>>(),
            readings.drivers["temperature_c"][1],
        )
    };
    let near = |(times, temperature): (Vec<f64>, f64)| {
        times.iter().zip([0.0, 1.5, 3.0]).all(|(a, b)| (a - b).abs() < 1e-9) && (temperature - 21.5).abs() < 1e-9
    };
    for (header, time, temperature) in [
        ("t_ms,temp_k", 1500.0, 294.65),
        ("Zeit [ms],Temp [°C]", 1500.0, 21.5),
        ("time_min,Temperature °F", 0.025, 70.7),
    ] {
        let file = robot(
            &format!("{header},{}", joints(" [deg]")),
            |k| format!("{},{temperature},", time * k as f64),
            |deg| deg,
        );
        let (session, result, said) = imported(place.path(), "units-line.txt", &file, None, &[]);
        let found = readings(&session.expect(&said));
        assert!(near(found.clone()), "{header}: {found:?}");
        assert!(!result["tests"][0]["remarks"].to_string().contains("is not stated"), "{header}");
    }
    for (temperature, words) in [(21.5, "c is read"), (294.65, "k is read")] {
        let file = robot(
            &format!("Time,Temp,{}", joints(" [deg]")),
            |k| format!("{},{temperature},", 1.5 * k as f64),
            |deg| deg,
        );
        let (session, result, said) = imported(place.path(), "units-line.txt", &file, None, &[]);
        let found = readings(&session.expect(&said));
        assert!(near(found.clone()), "{found:?}");
        let remarks = result["tests"][0]["remarks"].to_string();
        assert!(remarks.contains("the unit of `Time` is not stated: s is read"), "{remarks}");
        assert!(remarks.contains("the unit of `Temp` is not stated") && remarks.contains(words), "{remarks}");
    }
}

#[test]
fn a_time_of_day_goes_on_over_midnight() {
    let place = tempfile::tempdir().unwrap();
    // Two seconds apart, from 23:59:56.25 on.
    let of_day = |k: usize| {
        let t = (86396.25 + 2.0 * k as f64) % 86400.0;
        format!("{:02}:{:02}:{:06.3}", (t / 3600.0) as u32, (t / 60.0) as u32 % 60, t % 60.0)
    };
    let dated = |k: usize| {
        let date = if k < 2 { "2024-02-29" } else { "2024-03-01" };
        format!("{date}T{}+01:00", of_day(k))
    };
    // Month first: the day is above 12 in the first rows, the month in none.
    let american = |k: usize| {
        format!("{}/2023 {}", if k < 2 { "12/31" } else { "01/01" }, of_day(k)).replace("01/01/2023", "01/01/2024")
    };
    let ways: [(&str, &dyn Fn(usize) -> String); 3] = [("day", &of_day), ("dated", &dated), ("american", &american)];
    for (name, time) in ways {
        let file = robot(&format!("Zeit,{}", joints(" [deg]")), |k| time(k) + ",", |deg| deg);
        let (session, _, said) = imported(place.path(), "units-line.txt", &file, None, &[]);
        let session = session.expect(&said);
        let times = &session.tests[0].readings.as_ref().unwrap().time_s;
        for (k, pair) in times.windows(2).enumerate() {
            assert!((pair[1] - pair[0] - 2.0).abs() < 1e-6, "{name}, row {k}: {} s", pair[1] - pair[0]);
        }
    }
}

#[test]
fn deviations_that_may_be_in_two_units_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let deviations = |scale: f64| {
        ballbar("C [deg];Abweichung", move |_, c, length| format!("{c};{:.9}", (length - 99.9881) * 1e3 * scale))
    };
    // Of about 2 µm: in µm they may be mm.
    let (session, _, said) = imported(place.path(), "kugelstab.csv", &deviations(0.3), PLAN, &[]);
    assert!(session.is_none() && said.contains("the unit of `Abweichung` is not stated"), "{said}");
    assert!(said.contains("deviation_um=Abweichung") && said.contains("--column"), "{said}");
    let (session, _, said) =
        imported(place.path(), "kugelstab.csv", &deviations(1.0), PLAN, &["--column", "deviation_um=Abweichung"]);
    assert_eq!(difference(&session.expect(&said), "kugelstab.csv"), None);
    // In mm they are 0.003.
    let (session, result, said) = imported(place.path(), "kugelstab.csv", &deviations(1e-3), PLAN, &[]);
    assert_eq!(difference(&session.expect(&said), "kugelstab.csv"), None);
    assert!(result["tests"][0]["remarks"].to_string().contains("the unit of `Abweichung` is not stated: mm is read"));
}

#[test]
fn a_refusal_says_how_the_file_was_read_and_names_it_once() {
    let place = tempfile::tempdir().unwrap();
    let file = ballbar("C [deg];Lenght [mm]", |_, c, length| format!("{c};{length}"));
    let (_, _, said) = imported(place.path(), "kugelstab.csv", &file, PLAN, &[]);
    assert!(
        said.contains("read as utf-8, separator semicolon, decimal point, names on line 1, first row on line 2"),
        "{said}"
    );
    assert!(said.contains("did you mean column `Lenght [mm]`?") && said.contains("length_mm=Lenght [mm]"), "{said}");
    assert_eq!(said.matches("kugelstab.csv").count(), 1, "{said}");
    let short = "C;Length\n1;2\n1\n2\n3;4\n";
    let (_, _, said) = imported(place.path(), "kugelstab.csv", short, PLAN, &[]);
    assert_eq!(said.matches("kugelstab.csv").count(), 1, "{said}");
    assert!(said.contains("lines below the first row are no rows"), "{said}");
    // The instrument that the columns do not tell.
    let file: PathBuf = place.path().join("poses.csv");
    std::fs::write(&file, "J1 [deg],J2 [deg],J3 [deg],J4 [deg],J5 [deg],J6 [deg],Wert\n1,2,3,4,5,6,7\n2,3,4,5,6,7,8\n")
        .unwrap();
    let (output, _) = import(&place.path().join("kind"), &file, None, &[]);
    let said = message(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(!output.status.success() && said.contains("`--kind` names the instrument"), "{said}");
}

#[test]
fn a_key_that_the_new_session_lacks_is_stated_with_set() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("bar.csv");
    std::fs::write(&file, "X [mm];Y [mm];Laenge [mm]\n100,0;0,0;100,0001\n0,0;100,0;100,0004\n-100,0;0,0;100,0002\n")
        .unwrap();
    let (machine, out) = (super::ready("hermle-c600u/machine.toml"), folder.path().join("run1"));
    let output = super::abbe(&["import", text(&file), "--machine", text(&machine), "--out", text(&out)]);
    let said = message(&output);
    assert!(!output.status.success() && !out.exists(), "{said}");
    assert!(said.contains("no `bar_mm`") && said.contains("--set bar_mm=100"), "{said}");
    // Of another instrument the key that it lacks.
    std::fs::write(&file, "c_deg,x_mm,y_mm,z_mm,dx_um,dy_um,dz_um\n0,100,0,0,1,2,3\n10,98.48,17.36,0,1,2,3\n").unwrap();
    let output = super::abbe(&["import", text(&file), "--machine", text(&machine), "--out", text(&out)]);
    let said = message(&output);
    assert!(said.contains("no `setting`") && said.contains("--set setting=VALUE"), "{said}");
}

/// One cell without a date leaves the others as they are: days of December, no 12th of several months.
#[test]
fn a_cell_without_a_date_does_not_turn_the_others_about() {
    let folder = tempfile::tempdir().unwrap();
    let mut contents = String::from("time,c_deg,length_mm\n");
    for k in 0..60 {
        let day = 11 + k / 20;
        let time = if k == 30 { "n/a".to_string() } else { format!("12/{day}/2026 12:{k:02}:00") };
        writeln!(contents, "{time},{k},{}", 149.99 + 1e-4 * f64::from(k)).unwrap();
    }
    let set = ["--set", "bar_mm=150", "--set", "workpiece_ball_mm=[150,0,0]", "--set", "spindle_ball_mm=[0,0,0]"];
    let file = folder.path().join("bar.csv");
    std::fs::write(&file, contents).unwrap();
    let (machine, out) = (super::ready("hermle-c600u/machine.toml"), folder.path().join("run1"));
    let asked = [
        "import",
        text(&file),
        "--machine",
        text(&machine),
        "--out",
        text(&out),
        "--set",
        "at={x_mm=0,y_mm=0,z_mm=0,a_deg=0}",
    ];
    let output = super::abbe(&[&asked[..], &set].concat());
    assert!(output.status.success(), "{}", message(&output));
    let session = files::session(&out.join("session.toml"), &ReadOptions::default()).unwrap();
    let time = &session.tests[0].readings.as_ref().unwrap().time_s;
    // From 11 December 12:00 to 13 December 12:59.
    let last = time.iter().fold(f64::NEG_INFINITY, |a: f64, b| a.max(*b))
        - time.iter().fold(f64::INFINITY, |a: f64, b| a.min(*b));
    assert_eq!(last, 2.0 * 86400.0 + 59.0 * 60.0);
    assert_eq!(time.len(), 59);
}
