//! Numbers at their limits: each works, against a closed form, or is refused with its place and its reason.
//!
//! The session is the simplest there is: a bar between the turning table and a spindle ball that stands still. With the axis of C displaced by
//! `(x, y)` a ball at radius R reads `L = √((x − R·sin C)² + (y + R·cos C)²)`.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use super::{abbe, text};

const MACHINE: &str = "chain = \"w C A b Y X Z t\"\n\n[axis.C]\n[axis.A]\n[axis.X]\n[axis.Y]\n[axis.Z]\n";

/// Displacement of the C axis, mm.
const X: f64 = 0.010;
const Y: f64 = -0.020;

/// A session that is changed one thing at a time.
struct Case {
    bar_mm: f64,
    /// What the file says of the noise, if anything.
    noise: &'static str,
    errors: &'static str,
    /// More keys of the test.
    more: &'static str,
    /// Positions of C in degrees, once a run.
    angles: Vec<f64>,
    runs: usize,
    /// Added to every reading, mm.
    longer_mm: f64,
}

impl Default for Case {
    fn default() -> Case {
        Case {
            bar_mm: 100.0,
            noise: "noise_um = 0.3",
            errors: "[\"EX0C\", \"EY0C\"]",
            more: "",
            angles: (0..36).map(|k| 10.0 * f64::from(k)).collect(),
            runs: 2,
            longer_mm: 0.0,
        }
    }
}

impl Case {
    fn length_mm(&self, angle_deg: f64) -> f64 {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        (X - self.bar_mm * sin).hypot(Y + self.bar_mm * cos) + self.longer_mm
    }

    fn data(&self) -> String {
        let mut data = String::from("run,c_deg,length_mm\n");
        for run in 1..=self.runs {
            for angle in &self.angles {
                data += &format!("{run},{angle:?},{:?}\n", self.length_mm(*angle));
            }
        }
        data
    }

    fn session(&self) -> String {
        format!(
            "[machine]\nfile = \"machine.toml\"\n\n[instrument]\nkind = \"ballbar\"\n{}\n\n[unknowns]\nerrors = {}\n\n\
             [[test]]\nname = \"C\"\ndata = \"C.csv\"\nbar_mm = {:?}\nworkpiece_ball_mm = [0, {:?}, 0]\n\
             spindle_ball_mm = [0, 0, 0]\n{}\n",
            self.noise, self.errors, self.bar_mm, self.bar_mm, self.more
        )
    }
}

fn folder(session: &str, data: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("machine.toml", MACHINE),
        ("session.toml", session),
        ("C.csv", data),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// What `abbe` says where it cannot go on.
#[track_caller]
fn refused(folder: &Path, command: &str, more: &[&str], parts: &[&str]) {
    let session = folder.join("session.toml");
    let output = abbe(&[&[command, text(&session)], more].concat());
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(output.stdout.is_empty(), "a result beside an error");
    for part in parts {
        assert!(told.contains(part), "`{part}` is not in\n{told}");
    }
}

/// The result of a fit that works.
#[track_caller]
fn fitted(session: &str, data: &str) -> Value {
    let folder = folder(session, data);
    let (session, json) = (folder.path().join("session.toml"), folder.path().join("fit.json"));
    let output = abbe(&["fit", text(&session), "--json", text(&json)]);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{told}");
    let mut result: Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    result["told"] = told.into();
    result
}

/// Value and uncertainty of a parameter.
#[track_caller]
fn found(result: &Value, id: &str) -> (f64, f64) {
    let parameters = result["parameters"].as_array().unwrap();
    let parameter = parameters.iter().find(|parameter| parameter["id"] == id);
    let parameter = parameter.unwrap_or_else(|| panic!("no {id} in {result:#}"));
    (
        parameter["value"].as_f64().unwrap(),
        parameter["u"].as_f64().unwrap(),
    )
}

/// That the displacement of the axis comes back, µm.
#[track_caller]
fn displaced(result: &Value, within_um: f64) {
    for (id, wanted_mm) in [("EX0C", X), ("EY0C", Y)] {
        let (value, u) = found(result, id);
        assert!((value - 1e3 * wanted_mm).abs() <= within_um, "{id}: {value}");
        assert!(u > 0.0 && u.is_finite(), "{id}: u {u}");
    }
}

#[track_caller]
fn works(case: &Case) -> Value {
    let result = fitted(&case.session(), &case.data());
    displaced(&result, 1e-3);
    result
}

#[track_caller]
fn session_refused(case: &Case, parts: &[&str]) {
    refused(folder(&case.session(), &case.data()).path(), "fit", &[], parts);
}

#[test]
fn bars_of_a_millimetre_and_of_ten_metres() {
    for bar_mm in [1.0, 10_000.0] {
        let result = works(&Case {
            bar_mm,
            ..Case::default()
        });
        // 72 readings of 0.3 µm: the least-squares centre of a full circle has u = σ·√(2/n).
        let (_, u) = found(&result, "EX0C");
        assert!((u - 0.3 * (2.0_f64 / 72.0).sqrt()).abs() < 1e-3, "{u}");
    }
}

#[test]
fn a_bar_of_no_length() {
    session_refused(
        &Case {
            bar_mm: 5e-324,
            ..Case::default()
        },
        &[
            "session.toml:11",
            "reading 1",
            "the two balls nominally lie in one place",
            "5e-324 mm",
        ],
    );
}

#[test]
fn a_million_turns() {
    let angles = (0..36).map(|k| 360.0 * 1e6 + 10.0 * f64::from(k)).collect();
    works(&Case {
        angles,
        ..Case::default()
    });
}

/// At 10¹² degrees a double knows where it is to 10⁻⁴ degrees; beyond, an angle means nothing.
#[test]
fn more_turns_than_a_number_can_count() {
    let case = Case::default();
    let data = case.data().replacen("180.0", "1e13", 1);
    refused(
        folder(&case.session(), &data).path(),
        "fit",
        &[],
        &[
            "C.csv:20",
            "`c_deg`",
            "`1e13` is infinite or too large; 1e12 is the most",
        ],
    );
}

#[test]
fn an_angle_of_the_smallest_number() {
    let case = Case::default();
    let result = fitted(&case.session(), &case.data().replace("1,0.0,", "1,5e-324,"));
    displaced(&result, 1e-3);
}

#[test]
fn infinite_and_huge_readings() {
    for cell in ["inf", "-inf", "1e400", "1e300"] {
        let case = Case::default();
        let data = case.data().replacen("180.0", cell, 1);
        let parts = [
            "C.csv:20",
            "`c_deg`",
            "is infinite or too large; 1e12 is the most",
        ];
        refused(folder(&case.session(), &data).path(), "fit", &[], &parts);
    }
}

#[test]
fn huge_numbers_in_a_session() {
    let case = Case::default();
    for (from, to, place) in [
        (
            "bar_mm = 100.0",
            "bar_mm = 1e300",
            "`bar_mm` is 1e300, which is too large; 1e12 is the most",
        ),
        (
            "[0, 100.0, 0]",
            "[0, 1e300, 0]",
            "is 1e300, which is too large; 1e12 is the most",
        ),
        (
            "[0, 100.0, 0]",
            "[0, \"1e200 * 1e10\", 0]",
            "which is too large; 1e12 is the most",
        ),
        (
            "data = \"C.csv\"",
            "data = \"C.csv\"\nat = { x_mm = 1e300 }",
            "`x_mm` is 1e300, which is too large; 1e12 is the most",
        ),
    ] {
        assert!(case.session().contains(from));
        let session = case.session().replacen(from, to, 1);
        refused(
            folder(&session, &case.data()).path(),
            "fit",
            &[],
            &["session.toml:", place],
        );
    }
}

#[test]
fn readings_of_the_smallest_number() {
    let data = "run,c_deg,length_mm\n1,0,5e-324\n1,90,5e-324\n1,180,5e-324\n";
    refused(
        folder(&Case::default().session(), data).path(),
        "fit",
        &[],
        &["a bar of 100.0000 mm read 0.000 mm"],
    );
}

/// A noise of zero says that it is to be found; readings that repeat exactly show none, and what is left is the rounding of a double.
#[test]
fn a_noise_of_zero() {
    for noise in ["noise_um = 0", ""] {
        let result = works(&Case {
            noise,
            ..Case::default()
        });
        assert_eq!(result["noise_source"], "repeats");
        assert!((result["noise_um"].as_f64().unwrap() - 1e-6).abs() < 1e-18);
        let (_, u) = found(&result, "EX0C");
        assert!((u - 1e-6 * (2.0_f64 / 72.0).sqrt()).abs() < 1e-9, "{u}");
    }
}

#[test]
fn a_noise_that_is_no_noise() {
    for (noise, message) in [
        (
            "noise_um = 1e-300",
            "`noise_um` is 1e-300 µm; 1e-6 µm is the least besides 0",
        ),
        (
            "noise_um = 5e-324",
            "`noise_um` is 5e-324 µm; 1e-6 µm is the least besides 0",
        ),
        (
            "noise_um = 1e300",
            "`noise_um` is 1e300, which is too large; 1e12 is the most",
        ),
        ("noise_um = inf", "`noise_um` is infinite"),
        ("noise_um = -0.1", "`noise_um` is -0.1; it cannot be negative"),
        (
            "resolution_um = 1e-300",
            "`resolution_um` is 1e-300 µm; 1e-6 µm is the least besides 0",
        ),
    ] {
        session_refused(
            &Case {
                noise,
                ..Case::default()
            },
            &["session.toml:6", message],
        );
    }
}

/// The least and the greatest that are taken are computed with as well as any other.
#[test]
fn noises_at_their_limits() {
    let least = works(&Case {
        noise: "noise_um = 1e-6",
        ..Case::default()
    });
    let (_, u) = found(&least, "EX0C");
    assert!((u / (1e-6 * (2.0_f64 / 72.0).sqrt()) - 1.0).abs() < 1e-3, "{u}");
    // A kilometre of noise hides a millimetre of error: nothing is seen, and that is said.
    let case = Case {
        noise: "noise_um = 1e9",
        ..Case::default()
    };
    let greatest = fitted(&case.session(), &case.data());
    assert_eq!(greatest["rank"], 0);
    assert_eq!(greatest["parameters"].as_array().unwrap().len(), 0);
    assert_eq!(greatest["unobservable"].as_array().unwrap().len(), 2);
}

#[test]
fn priors_of_zero_and_of_infinity() {
    let known = works(&Case {
        more: "bar_u_um = 0",
        ..Case::default()
    });
    assert_eq!(known["parameters"].as_array().unwrap().len(), 2);
    // Known not at all, the mean of 72 readings says how long the bar is.
    let free = works(&Case {
        more: "bar_u_um = inf",
        longer_mm: 0.05,
        ..Case::default()
    });
    let (value, u) = found(&free, "bar[C]");
    assert!((value + 50.0).abs() < 1e-3, "{value}");
    assert!((u - 0.3 / 72.0_f64.sqrt()).abs() < 1e-3, "{u}");
}

#[test]
fn priors_that_are_none() {
    for (more, message) in [
        (
            "bar_u_um = -1",
            "`bar_u_um` is -1; an uncertainty cannot be negative",
        ),
        ("bar_u_um = nan", "`bar_u_um` is NaN"),
        (
            "bar_u_um = 1e-300",
            "`bar_u_um` is 1e-300 µm; 1e-6 µm is the least besides 0",
        ),
        (
            "bar_u_um = 1e300",
            "`bar_u_um` is 1e300, which is too large; 1e12 is the most",
        ),
    ] {
        session_refused(
            &Case {
                more,
                ..Case::default()
            },
            &["session.toml:17", message],
        );
    }
}

/// A bar known to 0.1 µm that is 50 µm longer: the weighted mean of both statements, and uncertainties enlarged by what they disagree.
#[test]
fn a_prior_that_the_readings_contradict() {
    let case = Case {
        more: "bar_u_um = 0.1",
        longer_mm: 0.05,
        ..Case::default()
    };
    let result = fitted(&case.session(), &case.data());
    displaced(&result, 0.05);
    let (from_prior, from_readings) = (1.0 / 0.1_f64.powi(2), 72.0 / 0.3_f64.powi(2));
    let (value, _) = found(&result, "bar[C]");
    let wanted = -50.0 * from_readings / (from_prior + from_readings);
    assert!((value - wanted).abs() < 0.01, "{value} {wanted}");
    assert!(result["birge_ratio"].as_f64().unwrap() > 10.0);
    assert!(
        result["told"]
            .as_str()
            .unwrap()
            .contains("the residual exceeds the noise")
    );
}

/// One bar, described twice: it is said, and the tighter statement holds.
#[test]
fn priors_that_contradict_each_other() {
    let case = Case {
        more: "bar_u_um = 1\nbar_setup = \"B\"",
        ..Case::default()
    };
    let session = case.session();
    let test = &session[session.find("[[test]]").unwrap()..];
    let second = test
        .replace("name = \"C\"", "name = \"D\"")
        .replace("bar_u_um = 1", "bar_u_um = 0.001");
    let result = fitted(&format!("{session}\n{second}"), &case.data());
    displaced(&result, 1e-3);
    let told = result["told"].as_str().unwrap();
    assert!(
        told.contains("tests \"C\" and \"D\" share the set-up \"B\" and describe it differently"),
        "{told}"
    );
    let (_, u) = found(&result, "bar[B]");
    assert!((u - 0.001).abs() < 1e-5, "{u}");
}

/// The spindle ball, if nobody knows where it is, is the axis' own displacement.
#[test]
fn exactly_collinear_columns() {
    let case = Case {
        more: "spindle_ball_u_um = inf",
        ..Case::default()
    };
    let result = fitted(&case.session(), &case.data());
    assert_eq!((&result["rank"], &result["unknowns"]), (&2.into(), &5.into()));
    assert_eq!(result["parameters"].as_array().unwrap().len(), 0);
    let whys: Vec<&str> = result["unobservable"]
        .as_array()
        .unwrap()
        .iter()
        .map(|u| u["why"].as_str().unwrap())
        .collect();
    for (error, ball) in [("EX0C", "spindle_ball.x[C]"), ("EY0C", "spindle_ball.y[C]")] {
        let said = whys
            .iter()
            .any(|why| why.starts_with(&format!("{error} cannot be told from {ball}")));
        assert!(said, "{whys:?}");
    }
    assert!(
        whys.contains(&"no reading of these tests changes with spindle_ball.z[C]"),
        "{whys:?}"
    );
    // What they do together is seen all the same.
    assert!(result["rms_um"].as_f64().unwrap() < 1e-3);
}

#[test]
fn more_unknowns_than_readings() {
    let case = Case {
        errors: "[\"EX0C\", \"EY0C\", \"EZ0C\", \"EA0C\", \"EB0C\", \"EC0C\"]",
        more: "bar_u_um = inf",
        angles: vec![0.0, 90.0],
        runs: 1,
        ..Case::default()
    };
    let result = fitted(&case.session(), &case.data());
    assert_eq!(
        (&result["readings"], &result["rank"], &result["unknowns"]),
        (&2.into(), &2.into(), &7.into())
    );
    assert!(result["rms_um"].as_f64().unwrap() < 1e-3);
    assert!(!result["unobservable"].as_array().unwrap().is_empty());
}

/// A perfect circle about the nominal axis: nothing is displaced, and nothing scatters.
#[test]
fn all_readings_equal() {
    for noise in ["noise_um = 0.3", "noise_um = 0", ""] {
        let case = Case {
            noise,
            ..Case::default()
        };
        let data: String = case
            .data()
            .lines()
            .enumerate()
            .fold(String::new(), |mut data, (number, line)| {
                let (place, length) = line.rsplit_once(',').unwrap();
                data += &format!("{place},{}\n", if number == 0 { length } else { "100" });
                data
            });
        let result = fitted(&case.session(), &data);
        for id in ["EX0C", "EY0C"] {
            assert!(found(&result, id).0.abs() < 1e-6, "{result:#}");
        }
    }
}

#[test]
fn one_run() {
    let result = works(&Case {
        runs: 1,
        ..Case::default()
    });
    let by = result["heldout_by"].as_str().unwrap();
    assert_eq!(by, "one of five contiguous blocks of each test at a time");
    assert!(result["heldout_rms_um"].as_f64().unwrap() < 1e-3);
}

fn plan() -> TempDir {
    let case = Case {
        more: "sweep = { axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 10 }",
        ..Case::default()
    };
    folder(&case.session().replace("data = \"C.csv\"\n", ""), "")
}

#[test]
fn arguments_at_their_limits() {
    let folder = plan();
    let out = folder.path().join("out");
    for (command, more, message) in [
        ("plan", &["--noise-um", "1e-300"][..], "`--noise-um 0.000000"),
        (
            "plan",
            &["--noise-um", "inf"],
            "it has to be a positive number of µm, 1e-6 to 1e12",
        ),
        (
            "plan",
            &["--setup-um", "1e300"],
            "it has to be a positive number of µm, 1e-6 to 1e12",
        ),
        (
            "simulate",
            &["--noise-um", "1e300"],
            "not negative: 0, or 1e-6 to 1e12",
        ),
        (
            "simulate",
            &["--noise-um", "1e-300"],
            "not negative: 0, or 1e-6 to 1e12",
        ),
        (
            "simulate",
            &["--error", "EX0C=1e300um"],
            "1e300 is too large; 1e12 is the most",
        ),
    ] {
        let mut arguments = more.to_vec();
        if command == "simulate" {
            arguments.extend(["--out", text(&out)]);
        }
        refused(folder.path(), command, &arguments, &[message]);
        assert!(!out.exists());
    }
}

/// A sweep in steps that no machine can make, and one of more readings than there is memory.
#[test]
fn steps_without_end() {
    for step in ["1e-300", "1e-6"] {
        let folder = plan();
        let path = folder.path().join("session.toml");
        let session = fs::read_to_string(&path)
            .unwrap()
            .replace("step_deg = 10", &format!("step_deg = {step}"));
        fs::write(&path, session).unwrap();
        refused(
            folder.path(),
            "plan",
            &["--no-effects"],
            &[
                "session.toml:16",
                "1000000 readings is the most",
                "take a larger step",
            ],
        );
    }
}

/// A smallest number given is a smallest number simulated: the same readings as without.
#[test]
fn an_error_of_the_smallest_number() {
    let folder = plan();
    let session = folder.path().join("session.toml");
    let simulated = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let output = abbe(
            &[
                &["simulate", text(&session), "--out", text(&out), "--noise-um", "0"],
                more,
            ]
            .concat(),
        );
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        fs::read_to_string(out.join("C.csv")).unwrap()
    };
    let plain = simulated("plain", &[]);
    assert_eq!(simulated("small", &["--error", "EX0C=5e-324um"]), plain);
    assert_ne!(simulated("large", &["--error", "EX0C=1um"]), plain);
}
