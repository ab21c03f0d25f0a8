//! `abbe schema`: files and results are what their schema says. The validator is a crate of its own; which keys a table
//! has is asked of the readers, which know nothing of the schema.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use jsonschema::Validator;
use serde_json::{Value, json};

use crate::suite::{abbe, ready, text, workspace};

/// A schema as the command prints it.
pub fn schema(subject: &str) -> Value {
    let printed = abbe(&["schema", subject]);
    assert!(printed.status.success(), "{}", String::from_utf8_lossy(&printed.stderr));
    serde_json::from_slice(&printed.stdout).unwrap()
}

fn validator(subject: &str) -> Validator {
    jsonschema::validator_for(&schema(subject)).unwrap()
}

fn faults(validator: &Validator, value: &Value) -> Vec<String> {
    validator.iter_errors(value).map(|fault| format!("{}: {fault}", fault.instance_path())).collect()
}

/// A TOML text as JSON. JSON has no `inf`.
fn as_json(text: &str) -> Value {
    fn value(from: toml::Value) -> Value {
        match from {
            toml::Value::Float(number) if number.is_infinite() => json!(f64::MAX),
            toml::Value::Float(number) => json!(number),
            toml::Value::Integer(number) => json!(number),
            toml::Value::Boolean(truth) => json!(truth),
            toml::Value::String(text) => json!(text),
            toml::Value::Datetime(date) => json!(date.to_string()),
            toml::Value::Array(items) => items.into_iter().map(value).collect(),
            toml::Value::Table(table) => Value::Object(table.into_iter().map(|(k, v)| (k, value(v))).collect()),
        }
    }
    value(toml::Value::Table(text.parse().unwrap()))
}

/// Every file of the workspace's sessions.
fn bundled(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            bundled(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "toml") {
            files.push(path);
        }
    }
}

#[test]
fn bundled_files_hold_and_misspelt_keys_do_not() {
    let (session, machine) = (validator("session"), validator("machine"));
    let mut files = Vec::new();
    bundled(&workspace().join("sessions"), &mut files);
    assert!(files.len() > 10);
    for file in files {
        let written = std::fs::read_to_string(&file).unwrap();
        if file.ends_with("errors.toml") {
            continue;
        }
        let schema = if file.ends_with("machine.toml") { &machine } else { &session };
        let value = as_json(&written);
        assert_eq!(faults(schema, &value), Vec::<String>::new(), "{}", file.display());
        for (right, wrong) in
            [("direction", "directoin"), ("bar_mm", "bar_m"), ("kind", "knid"), ("step_deg", "step_degree")]
        {
            let misspelt = written.replacen(&format!("{right} ="), &format!("{wrong} ="), 1);
            if misspelt != written {
                assert!(!schema.is_valid(&as_json(&misspelt)), "{}: {wrong}", file.display());
            }
        }
    }
}

/// The keys that the reader names when it meets one that it does not know.
pub fn known_to_the_reader(session: &str) -> BTreeSet<String> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("session.toml");
    std::fs::write(&file, session).unwrap();
    let told = abbe(&["plan", text(&file), "--no-effects"]);
    let told = String::from_utf8_lossy(&told.stderr).replace('\n', " ");
    assert!(told.contains("has the unknown key `zz`"), "{told}\n{session}");
    let list = told.split("known: ").nth(1).unwrap();
    list.split([' ', ','])
        .take_while(|word| !word.starts_with('─') && !word.starts_with('╯'))
        .filter(|word| word.chars().next().is_some_and(|c| c.is_ascii_lowercase()))
        .map(str::to_string)
        .collect()
}

pub fn properties(schema: &Value) -> BTreeSet<String> {
    schema["properties"].as_object().unwrap().keys().cloned().collect()
}

const SESSION: &str = "INSTRUMENT
UNKNOWNS
ROOT
[machine]
MACHINE
chain = \"w C b X Y Z t\"
[machine.axis.C]
AXIS
[[test]]
name = \"T\"
TEST
EFFECT
";

/// A session that has `zz` where `place` says.
pub fn with(place: &str, instrument: &str, test: &str, effect: &str) -> String {
    let mut session = SESSION.to_string();
    let at = |mark: &str| if mark == place { "zz = 1\n" } else { "" };
    for (mark, contents) in [
        ("UNKNOWNS", format!("[unknowns]\nerrors = []\n{}", at("UNKNOWNS"))),
        ("INSTRUMENT", format!("{}[instrument]\nkind = \"{instrument}\"\n{}", at("ROOT"), at("INSTRUMENT"))),
        ("ROOT", String::new()),
        ("MACHINE", at("MACHINE").to_string()),
        ("AXIS", at("AXIS").to_string()),
        ("TEST", format!("{test}\n{}", at("TEST"))),
        ("EFFECT", effect.to_string()),
    ] {
        session = session.replacen(&format!("{mark}\n"), &format!("{contents}\n"), 1);
    }
    // The other axes need nothing.
    session.replacen("[machine.axis.C]", "axis.X = {}\naxis.Y = {}\naxis.Z = {}\n[machine.axis.C]", 1)
}

pub const BAR: &str = "bar_mm = 100\nworkpiece_ball_mm = [100, 0, 0]\nspindle_ball_mm = [0, 0, 0]";
pub const SWEEP: &str = "sweep = { axis = \"C\", from_deg = 0, to_deg = 90, step_deg = 10 }";

#[test]
fn the_session_schema_has_the_keys_that_the_reader_knows() {
    let session = schema("session");
    let machine = schema("machine");
    let defs = |name: &str| session["$defs"][name].clone();
    let sweeping = format!("{BAR}\n{SWEEP}");
    for (place, expected) in [
        ("ROOT", properties(&session)),
        ("INSTRUMENT", properties(&defs("instrument"))),
        ("UNKNOWNS", properties(&session["properties"]["unknowns"])),
        ("AXIS", properties(&machine["$defs"]["axis"])),
    ] {
        let known = known_to_the_reader(&with(place, "ballbar", &sweeping, ""));
        assert_eq!(known, expected, "{place}");
    }
    let mut known = known_to_the_reader(&with("MACHINE", "ballbar", &sweeping, ""));
    known.remove("file");
    assert_eq!(known, properties(&machine));

    let mut known = BTreeSet::new();
    for instrument in defs("instrument")["properties"]["kind"]["enum"].as_array().unwrap() {
        known.extend(known_to_the_reader(&with("TEST", instrument.as_str().unwrap(), SWEEP, "")));
    }
    assert_eq!(known, properties(&defs("test")));

    let moving = |movement: &str| known_to_the_reader(&with("", "ballbar", &format!("{BAR}\n{movement}"), ""));
    assert_eq!(moving(&SWEEP.replace(" }", ", zz = 1 }")), properties(&defs("sweep")));
    for (index, path) in [
        "kind = \"list\"",
        "kind = \"circle\", plane = \"XY\", radius_mm = 100, step_deg = 1",
        "kind = \"line\", from = { x_mm = 0, y_mm = 0 }, to = { x_mm = 9, y_mm = 9 }, step_mm = 1",
        "kind = \"follow\", axis = \"C\", offset = \"radial\", step_deg = 1",
    ]
    .iter()
    .enumerate()
    {
        let mut known = moving(&format!("path = {{ {path}, zz = 1 }}"));
        // Said to be the wrong unit for what turns, so in the schema of neither.
        for wrong in ["from_mm", "to_mm", "step_mm"].into_iter().filter(|key| !path.contains(key)) {
            known.remove(wrong);
        }
        let expected = properties(&session["$defs"]["path"]["oneOf"][index]);
        assert_eq!(known, expected, "{path}");
    }
    for (table, at) in [("format", "[test.format]\nheader = true"), ("format", "[format]\nheader = true")] {
        let known = known_to_the_reader(&with("", "ballbar", &sweeping, &format!("{at}\nzz = 1")));
        assert_eq!(known, properties(&defs(table)));
    }

    let mut known = BTreeSet::new();
    for shape in [
        "component = \"bar\"\nshape = \"constant\"",
        "component = \"EZC\"\nshape = \"harmonic\"\norder = 2",
        "component = \"EAC\"\nshape = \"precession\"\norder = 2\nbackward = true",
        "component = \"EZC\"\nshape = \"spectrum\"\norders = 20",
        "component = \"EXX\"\nshape = \"polynomial\"\norder = 2",
        "component = \"EXX\"\nshape = \"periodic\"\nperiod_mm = 2",
        "component = \"EZC\"\nshape = \"curve\"",
        "component = \"EXX\"\nshape = \"reversal-spike\"\nwidth_mm = 2",
        "component = \"EXX\"\nshape = \"warmup\"\ntau_s = 2",
        "component = \"EXX\"\nshape = \"steps\"\nat_mm = [2]",
        "component = \"EZC\"\nshape = \"local\"\ncentre_deg = 2\nwidth_deg = 3",
    ] {
        let effect = format!("[[effect]]\n{shape}\nzz = 1\n");
        known.extend(known_to_the_reader(&with("", "ballbar", &sweeping, &effect)));
    }
    assert_eq!(known, properties(&defs("effect")));
}

/// The JSON that a command writes.
fn written(arguments: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("result.json");
    let run = abbe(&[arguments, &["--json", text(&file)]].concat());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap()
}

/// The fields in front of every result of a fit or a trace.
const ENVELOPE: [&str; 7] = ["schema_version", "tool_version", "command", "session", "seed", "options", "statements"];
/// The fields of a model: of a fit, and before and after a trace.
const MODEL: [&str; 20] = [
    "noise_um",
    "noise_source",
    "noise_ar_coefficients",
    "readings",
    "rms_um",
    "heldout_rms_um",
    "heldout_by",
    "rank",
    "parameter_count",
    "chi_square",
    "degrees_of_freedom",
    "birge_ratio",
    "u_enlargement",
    "outcome",
    "parameters",
    "identifiable",
    "covariance",
    "unobservable",
    "null_space",
    "outliers",
];
/// Held-out errors of a session of runs with several tests, one of which can be left out and one cannot.
const LEFT_OUT: [&str; 4] = ["left_out_run_rms_um", "left_out_test_rms_um", "left_out_tests", "tests_not_left_out"];

fn has_exactly(value: &Value, design: &[&str], added: &[&str]) {
    let found: BTreeSet<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
    let wanted: BTreeSet<&str> = design.iter().copied().collect();
    assert!(wanted.is_subset(&found), "{wanted:?} in {found:?}");
    let allowed: BTreeSet<&str> = design.iter().chain(added).copied().collect();
    assert!(found.is_subset(&allowed), "{found:?}");
}

#[test]
fn results_hold_and_have_the_fields_of_the_design() {
    let measured = ready("hermle-c600u/measured/session.toml");
    let fit = written(&["fit", text(&measured)]);
    assert_eq!(faults(&validator("fit"), &fit), Vec::<String>::new());
    let of_fit = ["circular", "warnings"];
    has_exactly(&fit, &MODEL, &[&ENVELOPE[..], &LEFT_OUT, &of_fit].concat());
    let of_a_parameter = ["expanded_u", "significant", "meaning", "determined_by", "quotable"];
    has_exactly(&fit["parameters"][0], &["id", "value", "u", "unit"], &of_a_parameter);
    has_exactly(&schema("fit")["$defs"]["Unobservable"]["properties"], &["combination", "why"], &["finding"]);
    let mut other = fit.clone();
    other["rms_mm"] = json!(1.0);
    assert!(!validator("fit").is_valid(&other));
    other = fit;
    other.as_object_mut().unwrap().remove("rms_um");
    assert!(!validator("fit").is_valid(&other));

    let trace = written(&["trace", text(&measured), "--only", "EZC~C:h", "--only", "EAC~C:h"]);
    assert_eq!(faults(&validator("trace"), &trace), Vec::<String>::new());
    has_exactly(
        &trace,
        &["verdict", "noise_um", "before", "after", "effects", "remainder"],
        &[
            &ENVELOPE[..],
            &["unique", "residual_before", "changed_parameters", "candidates", "candidates_detectable", "families"],
            &["warnings", "interrupted"],
        ]
        .concat(),
    );
    for model in ["before", "after"] {
        has_exactly(&trace[model], &MODEL, &LEFT_OUT);
    }
    let effect = &trace["effects"][0];
    has_exactly(
        effect,
        &["component", "driver", "shape", "order", "parameters", "p_value", "rms_gain_um", "aliases", "separated_by"],
        &[
            "family",
            "heldout_rms_um",
            "left_out_test_rms_um",
            "aliases_left_out_test_rms_um",
            "separation",
            "meaning",
            "unique",
            "explanation_count",
            "explanations",
            "separating_tests",
        ],
    );
    has_exactly(&effect["parameters"][0], &["id", "value", "u", "unit"], &of_a_parameter);
    assert!(effect["order"].is_u64(), "{effect}");
    has_exactly(
        &schema("trace")["$defs"]["EffectName"]["properties"],
        &["component", "driver", "shape", "order"],
        &["tests", "meaning"],
    );
    has_exactly(&trace["remainder"], &["structured", "p_value", "where"], &[]);
}

#[test]
fn the_other_results_hold() {
    let plan = ready("hermle-c600u/chapter5.toml");
    let calibration = ready("self-calibration/measured/session.toml");
    let folder = tempfile::tempdir().unwrap();
    let (out, map) = (folder.path().join("run"), folder.path().join("map.csv"));
    let patterns = folder.path().join("patterns.csv");
    let machine = ready("volumetric/machine.toml");
    let errors = ready("volumetric/errors.toml");
    for (subject, arguments) in [
        ("plan", vec!["plan", text(&plan)]),
        ("next-test", vec!["plan", text(&plan), "--range"]),
        ("patterns", vec!["plan", text(&plan), "--patterns", text(&patterns)]),
        ("next-test", vec!["plan", text(&plan), "--separate", "EZC~C:h2,EAC~C:h1"]),
        ("self-calibration", vec!["fit", text(&calibration), "--method", "self-calibration", "--monte-carlo", "10000"]),
        ("simulate", vec!["simulate", text(&plan), "--out", text(&out), "--error", "EY0A=10um"]),
        (
            "map",
            vec![
                "volumetric",
                text(&machine),
                "--map",
                text(&map),
                "--functions",
                text(&errors),
                "--correction",
                "--axis",
                "X:3",
                "--axis",
                "Y:3",
                "--axis",
                "Z:3",
            ],
        ),
    ] {
        let result = written(&arguments);
        assert_eq!(faults(&validator(subject), &result), Vec::<String>::new(), "{subject}");
    }
    // A circle has the most to say.
    let (mine, run) = (folder.path().join("mine"), folder.path().join("circles"));
    assert!(abbe(&["new", text(&mine), "--from-code", "[wXbYZt]"]).status.success());
    let circles = mine.join("plan.toml");
    written(&["simulate", text(&circles), "--out", text(&run), "--error", "EC0Y=8arcsec"]);
    let circles = written(&["fit", text(&run.join("session.toml"))]);
    assert_eq!(faults(&validator("fit"), &circles), Vec::<String>::new());
    has_exactly(
        &circles["circular"][0]["diagnosis"][0],
        &["fault", "axes", "values", "circularity_um", "share_percent"],
        &[],
    );

    let session = out.join("session.toml");
    let again = folder.path().join("again");
    written(&["simulate", text(&plan), "--out", text(&again), "--seed", "2"]);
    let repeated = written(&["compare", text(&session), text(&again.join("session.toml")), "--repeated"]);
    assert_eq!(faults(&validator("repeat"), &repeated), Vec::<String>::new());
    let compared = written(&["fit", text(&session), "--method", "cone"]);
    assert_eq!(faults(&validator("geometric"), &compared), Vec::<String>::new());
}
