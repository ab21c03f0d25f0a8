//! Tests of sessions: their files, tests, estimated errors, effects and expressions.

use super::{DATA, MACHINE, SESSION, assert_contains, error_text, session, with_session, without_tests};

#[test]
fn missing_machine_file() {
    assert_contains(
        &with_session("\"machine.toml\"", "\"engine.toml\""),
        &["session.toml:2", "the machine file `engine.toml` does not exist"],
    );
}

#[test]
fn missing_data_file() {
    assert_contains(
        &error_text(session(MACHINE, SESSION, None)),
        &["session.toml:10", "the data file `C100.csv` does not exist", "looked for", "state the data folder"],
    );
}

#[test]
fn duplicate_test_names_and_missing_tests() {
    let twice = SESSION.to_string() + &SESSION[without_tests().len()..];
    assert_contains(
        &error_text(session(MACHINE, &twice, Some(DATA))),
        &["session.toml:15", "two tests have the name \"C100\""],
    );
    assert_contains(&error_text(session(MACHINE, without_tests(), None)), &["a session without tests"]);
}

#[test]
fn tests_without_a_motion() {
    assert_contains(&with_session("data = \"C100.csv\"\n", ""), &["session.toml:8", "neither data nor a motion"]);
    let both = SESSION.to_string()
        + "sweep = { axis = \"C\", from_deg = 0, to_deg = 10, step_deg = 1 }\npath = { kind = \"list\" }\n";
    assert_contains(&error_text(session(MACHINE, &both, Some(DATA))), &["session.toml:15", "both `sweep` and `path`"]);
}

#[test]
fn errors_of_missing_axes() {
    let unknown = |name: &str| with_session("[[test]]", &format!("[unknowns]\nerrors = [\"{name}\"]\n\n[[test]]"));
    assert_contains(&unknown("EX0B"), &["session.toml:9", "has no axis `B`"]);
    assert_contains(&unknown("error"), &["\"error\" is not the name of an error"]);
}

#[test]
fn numbers_and_positions_to_estimate() {
    let effect = |text: &str| session(MACHINE, &format!("{SESSION}\n[[effect]]\n{text}\n"), Some(DATA));
    let steps = |count: usize, estimate: &str| {
        let at: Vec<String> = (0..count).map(|k| format!("{}", k as f64 + 0.5)).collect();
        let at = at.join(", ");
        effect(&format!("component = \"EZC\"\nshape = \"steps\"\nat_deg = [{at}]\nestimate = [{estimate}]"))
    };
    let read = steps(40, "\"at\"").unwrap();
    assert!(read.effects[0].positions_estimated && read.effects[0].estimated.is_empty());
    assert!(!steps(41, "").unwrap().effects[0].positions_estimated);
    assert_contains(
        &error_text(steps(41, "\"at\"")),
        &["session.toml:19", "41 positions", "at most 40", "state fewer"],
    );
    assert_contains(&error_text(steps(1, "\"at\", \"at\"")), &["session.toml:19", "\"at\" stands twice"]);
    assert_contains(&error_text(steps(1, "\"width\"")), &["not a number of the shape \"steps\"", "known: at"]);
    let harmonic = effect("component = \"EZC\"\nshape = \"harmonic\"\norder = 2\nestimate = [\"at\"]");
    assert_contains(&error_text(harmonic), &["not a number of the shape \"harmonic\"", "remove `estimate`"]);
}

#[test]
fn effects_on_missing_components() {
    let effect = |text: &str| error_text(session(MACHINE, &format!("{SESSION}\n[[effect]]\n{text}\n"), Some(DATA)));
    assert_contains(
        &effect("component = \"EZB\"\ndriver = \"C\"\nshape = \"harmonic\"\norder = 2"),
        &["session.toml:16", "the machine \"Small\" has no axis `B`"],
    );
    assert_contains(
        &effect("component = \"EZC\"\ndriver = \"B\"\nshape = \"harmonic\"\norder = 2"),
        &["session.toml:17", "no axis `B`"],
    );
    assert_contains(
        &effect("component = \"EZC\"\nshape = \"harmonics\"\norder = 2"),
        &["\"harmonics\" is not a shape", "did you mean `harmonic`?"],
    );
    assert_contains(&effect("component = \"EZC\"\nshape = \"harmonic\""), &["needs `order`"]);
    let alias = |keys: &str| effect(&format!("component = \"EXX\"\nshape = \"constant\"\n[[effect.alias]]\n{keys}"));
    assert_contains(
        &alias("component = \"EZC\"\nshape = \"harmonic\"\nordr = 2"),
        &["session.toml:21", "[[effect.alias]] has the unknown key `ordr`", "did you mean `order`?"],
    );
    assert_contains(
        &alias("component = \"EZB\"\nshape = \"constant\""),
        &["session.toml:19", "the machine \"Small\" has no axis `B`"],
    );
    assert_contains(
        &alias("component = \"EXX\"\nshape = \"constant\"\nassumed = true"),
        &["session.toml:", "[[effect.alias]] has the unknown key `assumed`"],
    );
    assert_contains(
        &with_session("[[test]]", "[test]"),
        &["session.toml:8", "`test` is a table; a list in square brackets is expected", "write [[test]]"],
    );
    assert_contains(
        &effect("component = \"EXX\"\nshape = \"harmonic\"\norder = 1"),
        &["cannot have the driver \"X\"", "rotary"],
    );
    assert_contains(
        &effect("component = \"EXX\"\nshape = \"periodic\"\nperiod_deg = 10"),
        &["session.toml:18", "`period_deg` for a driver in mm", "period_mm"],
    );
    let spectrum = |keys: &str| effect(&format!("component = \"EZC\"\nshape = \"spectrum\"\n{keys}"));
    assert_contains(&spectrum(""), &["the shape \"spectrum\" needs `orders`", "orders = 40"]);
    assert_contains(&spectrum("orders = 0"), &["session.toml:18", "240"]);
    assert_contains(&spectrum("orders = 4\nscale_arcsec = 1"), &["`scale_arcsec` for the component", "use `scale_um`"]);
    assert_contains(&spectrum("orders = 4\nscale_um = -1"), &["session.toml:19"]);
    assert_contains(&spectrum("orders = 4\nscale_um = 1e9"), &["must be between", "1000000"]);
    assert_contains(&spectrum("orders = 4\nscale_um = 1\nfamily = \"a\""), &["`family` beside a stated scale"]);
    assert_contains(&spectrum("orders = 4\nfamily = \"\""), &["the name of a family is empty"]);
    assert_contains(&effect("component = \"EXX\"\nshape = \"spectrum\"\norders = 4"), &["needs `period_mm`"]);
    assert_contains(
        &effect("component = \"EXX\"\ndriver = \"time\"\nshape = \"spectrum\"\norders = 4\nperiod_s = 9"),
        &["cannot have the driver \"time\"", "must be an axis"],
    );
    assert_contains(
        &effect("component = \"target.x\"\ndriver = \"time\"\nshape = \"drift\""),
        &["a ballbar does not have"],
    );
    assert_contains(
        &effect("component = \"EZC\"\nshape = \"harmonic\"\norder = 2\ntests = [\"C10\"]"),
        &["no test has the name \"C10\"", "did you mean `C100`?"],
    );
}

#[test]
fn expressions_over_unknown_constants() {
    assert_contains(
        &with_session("[0, 100, 0]", "[0, \"R\", 0]"),
        &["session.toml:12", "no constant `R`", "no [constants]"],
    );
    let constants = SESSION.replace("[[test]]", "[constants]\nR = 100\nH = 75\n\n[[test]]");
    assert_contains(
        &error_text(session(MACHINE, &constants.replace("[0, 100, 0]", "[0, \"r\", 0]"), Some(DATA))),
        &["no constant `r`", "R, H"],
    );
    assert_contains(
        &error_text(session(MACHINE, &constants.replace("[0, 100, 0]", "[0, \"sqrt(H - R)\", 0]"), Some(DATA))),
        &["evaluates to NaN"],
    );
    let deep = format!("[0, \"{}R{}\", 0]", "(".repeat(60), ")".repeat(60));
    assert_contains(
        &error_text(session(MACHINE, &constants.replace("[0, 100, 0]", &deep), Some(DATA))),
        &["nested deeper"],
    );
    let mut squares = "R".to_string();
    for _ in 0..30 {
        squares = format!("({squares})^2");
    }
    let wide = format!("[0, \"{squares}\", 0]");
    assert_contains(
        &error_text(session(MACHINE, &constants.replace("[0, 100, 0]", &wide), Some(DATA))),
        &["too many nested squares"],
    );
}
