//! Sessions built in memory against the same sessions read from files, and the errors of unusable ones.

use std::fs;
use std::path::Path;

use abbe_files::read::{add_node, plan_of_node};
use abbe_files::table::memory::{MemoryColumn, Values};
use abbe_files::{ReadOptions, Source};
use abbe_model::chain::Machine;
use abbe_model::diagnostic::Area;
use abbe_model::document::node::Node;
use abbe_model::document::{of_domain, print};
use abbe_model::instrument::InstrumentKind;
use abbe_model::session::Session;
use serde_json::json;

const SESSION: &str = r#"
[machine]
chain = "w C A b Y X Z t"
[machine.axis.C]
[machine.axis.A]
[machine.axis.X]
[machine.axis.Y]
[machine.axis.Z]
[instrument]
kind = "ballbar"
[[test]]
name = "C100"
data = "C100.csv"
bar_mm = 125.0
bar_u_um = 0.5
workpiece_ball_mm = [0, 100, 0]
workpiece_ball_u_um = 2
spindle_ball_mm = [0, 0, 0]
setup = "P1"
at = { z_mm = 75 }
sweep = { axis = "C", from_deg = 0, to_deg = 180, step_deg = 90, feed_deg_min = 120 }
"#;

const C_DEG: [f64; 3] = [0.0, 90.0, 180.0];
const TIME: [f64; 3] = [0.0, 1.0, 2.0];
const RUN: [f64; 3] = [1.0; 3];
const LENGTH: [f64; 3] = [125.001, 125.0, 124.999];

fn empty() -> Session {
    Session::new(Machine::from_code("w C A b Y X Z t").unwrap(), InstrumentKind::BallBar)
}

/// The test of the session file, without the name of its data.
fn test() -> Node {
    let document: Node = Source::new(Path::new("session.toml"), SESSION).parse().unwrap().document().unwrap();
    let mut test = document.get("test").unwrap().items()[0].clone();
    test.set("data", Node::default());
    test
}

fn columns<'a>(c_deg: &'a [f64], time: &'a [f64], run: &'a [f64], length: &'a [f64]) -> [MemoryColumn<'a>; 4] {
    [
        MemoryColumn::numbers("c_deg", c_deg),
        MemoryColumn::numbers("time_s", time),
        MemoryColumn::numbers("run", run),
        MemoryColumn::numbers("length_mm", length),
    ]
}

#[test]
fn a_session_in_memory_is_that_of_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let data = "time_s,run,c_deg,length_mm\n0,1,0,125.001\n1,1,90,125.0\n2,1,180,124.999\n";
    fs::write(folder.path().join("C100.csv"), data).unwrap();
    fs::write(folder.path().join("session.toml"), SESSION).unwrap();
    let read = abbe_files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap();
    let mut built = empty();
    add_node(&mut built, "test", test(), &columns(&C_DEG, &TIME, &RUN, &LENGTH)).unwrap();
    assert_eq!(built.unknowns, read.unknowns);
    assert_eq!(built.warnings, read.warnings);
    let (own, other) = (&built.tests[0], &read.tests[0]);
    assert_eq!(own.name, other.name);
    assert_eq!(own.station, other.station);
    assert_eq!(own.priors, other.priors);
    assert_eq!(own.motion, other.motion);
    assert_eq!(
        [&own.setup, &own.spindle_setup, &own.bar_setup],
        [&other.setup, &other.spindle_setup, &other.bar_setup]
    );
    assert_eq!(own.at, other.at);
    let [own, other] = [own, other].map(|test| test.readings.as_ref().unwrap());
    assert_eq!(own.positions, other.positions);
    assert_eq!(own.observed, other.observed);
    assert_eq!((&own.run, &own.time_s), (&other.run, &other.time_s));
    assert_eq!((own.line(1), other.line(1)), (None, Some(3)));
}

#[test]
fn an_unusable_test_is_refused_and_the_session_unchanged() {
    let mut session = empty();
    let good = columns(&C_DEG, &TIME, &RUN, &LENGTH);
    add_node(&mut session, "test", test(), &good).unwrap();
    let named = |key: &str, value: serde_json::Value| {
        let mut test = test();
        test.set("name", "other");
        test.set(key, value);
        test
    };
    let other = named("name", "other".into());
    let lengths = |of: [f64; 3]| of;
    let (nan, large, short) = (lengths([125.0, f64::NAN, 125.0]), lengths([125.0, 1e13, 125.0]), lengths([0.001; 3]));
    let with = |length| columns(&C_DEG, &TIME, &RUN, length);
    let mut unknown = good;
    unknown[0].name = "q_deg";
    for (test, columns, expected) in [
        (test(), &good[..], "two tests have the name \"C100\""),
        (named("name", " ".into()), &good, "a test without a name"),
        (named("mirror_u_um", 1.into()), &good, "test \"other\" has the unknown key `mirror_u_um`"),
        (
            named("target_mm", 1.into()),
            &good,
            "`target_mm` belongs to a tracker; this session's instrument is a ballbar",
        ),
        (named("bar_mm", 0.into()), &good, "`bar_mm` is 0; it must be greater than 0"),
        (named("bar_u_um", (-1).into()), &good, "`bar_u_um` is -1; an uncertainty cannot be negative"),
        (named("sweep", json!(null)), &[], "has neither data nor a motion"),
        (named("at", json!({})), &good, "cannot reach between its balls"),
        (other.clone(), &unknown, "unknown column `q_deg`"),
        (other.clone(), &good[3..], "no column `c_deg`, though axis `C` moves in this test; found: length_mm"),
        (other.clone(), &columns(&C_DEG[..2], &TIME, &RUN, &LENGTH), "`time_s` has 3 values, `c_deg` has 2"),
        (other.clone(), &with(&nan), "`length_mm`, item 1: it is NaN"),
        (other.clone(), &with(&large), "`length_mm`, item 1: it is 1e13, which is too large"),
        (other.clone(), &with(&short), "a bar of 125.0000 mm read 0.001 mm"),
        (
            other.clone(),
            &columns(&C_DEG[..1], &TIME[..1], &RUN[..1], &LENGTH[..1]),
            "1 readings, which is not enough for a fit",
        ),
        (
            other.clone(),
            &columns(&C_DEG, &[0.0, 1.0, 0.5], &RUN, &LENGTH),
            "`time_s`, item 2: time decreases: 0.5 s after 1 s",
        ),
        (other, &columns(&C_DEG, &TIME, &[1.0, 1.5, 2.0], &LENGTH), "`run`, item 1: `1.5` is not a run number"),
    ] {
        let fault = add_node(&mut session, "test", test, columns).unwrap_err();
        assert!(fault.to_string().contains(expected), "`{expected}` is not in\n{fault}");
        assert!(fault.code.area == Area::Session && fault.help() != Some(""), "{fault}");
        assert!(fault.location().is_none());
        assert_eq!(session.tests.len(), 1);
    }
}

/// A reading of which a value is missing is left out; the session tells how many and where, and faults of the others keep
/// their places among all items.
#[test]
fn missing_readings_are_left_out_and_told() {
    let document: Node = Source::new(Path::new("session.toml"), SESSION).parse().unwrap().document().unwrap();
    let test = &document.get("test").unwrap().items()[0];
    let mut head = document.clone();
    head.set("test", Node::from_iter::<[Node; 0]>([]));
    let c = [0.0, f64::NAN, 60.0, 90.0, 120.0, 180.0];
    let time = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
    let length = [125.0, 125.0, 1e99, 125.001, 125.002, 125.003];
    let marks = |items: &[usize]| -> Vec<bool> { (0..6).map(|item| items.contains(&item)).collect() };
    let (of_c, of_length) = (marks(&[1]), marks(&[2, 3]));
    let added = |length: &[f64], time: &[f64], of_length: &[bool]| {
        let columns = [
            MemoryColumn { name: "c_deg", values: Values::Numbers(&c), missing: &of_c },
            MemoryColumn { name: "time_s", values: Values::Numbers(time), missing: &[] },
            MemoryColumn { name: "length_mm", values: Values::Numbers(length), missing: of_length },
        ];
        let mut session = plan_of_node(head.clone()).unwrap();
        add_node(&mut session, "test", test.clone(), &columns).map(|()| session).map_err(|fault| fault.to_string())
    };
    let session = added(&length, &time, &of_length).unwrap();
    let told = "test \"C100\": 3 of 6 readings are missing: `c_deg` item 1; `length_mm` items 2, 3";
    assert_eq!(session.warnings, [told]);
    let readings = session.tests[0].readings.as_ref().unwrap();
    assert_eq!(readings.observed, [125.0, 125.002, 125.003]);
    assert_eq!(readings.time_s, [0.0, 4.0, 5.0]);
    let c_axis = session.machine.axis_index("C").unwrap();
    assert_eq!(readings.positions[c_axis], [0.0_f64, 120.0, 180.0].map(f64::to_radians));

    // The fifth item is no number, the last time decreases: places among all items, not among the present ones.
    let fault = added(&[125.0, 125.0, 1e99, 125.0, f64::NAN, 125.0], &time, &of_length).unwrap_err();
    assert!(fault.contains("length_mm") && fault.contains("item 4"), "{fault}");
    let fault = added(&length, &[0.0, 1.0, 2.0, 3.0, 4.0, 3.5], &of_length).unwrap_err();
    assert!(fault.contains("`time_s`, item 5"), "{fault}");
    // One reading is left.
    let fault = added(&length, &time, &marks(&[1, 2, 3, 4, 5])).unwrap_err();
    assert!(fault.contains("5 of 6 readings are missing"), "{fault}");
    let fault = added(&length, &time, &[true]).unwrap_err();
    assert!(fault.contains("`length_mm` has 6 values, and marks 1"), "{fault}");
}

#[test]
fn a_planned_test_is_written_as_a_document() {
    let mut session = Session::new(Machine::from_code("wCAbYXZt").unwrap(), "ballbar".parse().unwrap());
    let turn = json!({"axis": "C", "from_deg": 0, "to_deg": 360, "step_deg": 1});
    let test = json!({"name": "C100", "bar_mm": 125, "workpiece_ball_mm": [0, 100, 0], "spindle_ball_mm": [0, 0, 0],
                      "at": {"z_mm": 75}, "sweep": turn});
    add_node(&mut session, "test", test.into(), &[]).unwrap();
    let text = print::text_of(&of_domain::test(&session.tests[0], &session.machine, session.instrument)).unwrap();
    assert!(text.starts_with("name = \"C100\"\nbar_mm = 125\n"), "{text}");
}
