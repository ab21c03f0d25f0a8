//! Sessions built in memory against the same sessions read from files, and the errors of unusable ones.

use std::fs;
use std::path::Path;

use abbe_model::ModelError;
use abbe_model::chain::Machine;
use abbe_model::document::node::Node;
use abbe_model::files::read::{add_node, document_of_text, plan_of_node};
use abbe_model::files::{self, ReadOptions};
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::instrument::tracker::Tracker;
use abbe_model::instrument::{InstrumentKind, Station};
use abbe_model::session::build::NewTest;
use abbe_model::session::columns::Columns;
use abbe_model::session::motion::Motion;
use abbe_model::session::{Prior, Session};

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

fn ball_bar() -> Station<f64> {
    Station::BallBar(BallBar { workpiece_ball: [0.0, 100.0, 0.0], spindle_ball: [0.0; 3], bar: 125.0 })
}

fn empty() -> Session {
    Session::new(Machine::from_code("w C A b Y X Z t").unwrap(), InstrumentKind::BallBar)
}

fn columns() -> Columns {
    Columns {
        axes: vec![("C".into(), [0.0_f64, 90.0, 180.0].map(f64::to_radians).to_vec())],
        run: vec![1; 3],
        time_s: vec![0.0, 1.0, 2.0],
        observed: vec![125.001, 125.0, 124.999],
        ..Columns::default()
    }
}

fn test() -> NewTest {
    NewTest::new("C100", ball_bar())
        .prior("bar", Prior::Gaussian(0.5e-3))
        .prior("workpiece_ball", Prior::Gaussian(2e-3))
        .setup("P1")
        .at("Z", 75.0)
        .readings(columns())
}

#[test]
fn a_session_in_memory_is_that_of_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let data = "time_s,run,c_deg,length_mm\n0,1,0,125.001\n1,1,90,125.0\n2,1,180,124.999\n";
    fs::write(folder.path().join("C100.csv"), data).unwrap();
    fs::write(folder.path().join("session.toml"), SESSION).unwrap();
    let read = files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap();
    let mut built = empty();
    let sweep = read.tests[0].motion.clone().unwrap();
    assert!(matches!(sweep, Motion::Sweep { .. }));
    built.add_test(test().motion(sweep)).unwrap();
    assert_eq!(built.unknowns, read.unknowns);
    assert_eq!(built.warnings, read.warnings);
    let (own, other) = (&built.tests[0], &read.tests[0]);
    assert_eq!(own.name, other.name);
    assert_eq!(own.station, other.station);
    assert_eq!(own.priors, other.priors);
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
    session.add_test(test()).unwrap();
    let with = |change: &dyn Fn(&mut Columns)| {
        let mut columns = columns();
        change(&mut columns);
        NewTest::new("other", ball_bar()).at("Z", 75.0).readings(columns)
    };
    let tracker = Station::Tracker(Tracker {
        target: [0.0; 3],
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        origin: [0.0; 3],
    });
    let no_bar = Station::BallBar(BallBar { workpiece_ball: [0.0, 100.0, 0.0], spindle_ball: [0.0; 3], bar: 0.0 });
    for (bad, expected) in [
        (test(), "two tests have the name \"C100\""),
        (NewTest::new(" ", ball_bar()), "a test without a name"),
        (NewTest::new("T", tracker), "its instrument is a tracker, that of the session a ballbar"),
        (NewTest::new("T", no_bar), "`bar` is 0; it must be greater than 0"),
        (NewTest::new("T", ball_bar()), "neither readings nor a motion"),
        (NewTest::new("T", ball_bar()).prior("mirror", Prior::Free), "a ballbar has no `mirror`"),
        (NewTest::new("T", ball_bar()).prior("bar", Prior::Gaussian(-1.0)), "the standard uncertainty of `bar` is -1"),
        (with(&|columns| columns.axes[0].0 = "Q".into()), "has no axis `Q`"),
        (with(&|columns| columns.axes.clear()), "no positions of an axis"),
        (with(&|columns| columns.axes[0].1.truncate(2)), "positions of C: 2 where 3 are expected"),
        (with(&|columns| columns.observed[1] = f64::NAN), "observed values is NaN (item 2)"),
        (with(&|columns| columns.observed[1] = 1e13), "too large"),
        (with(&|columns| columns.observed.truncate(1)), "not enough for a fit"),
        (with(&|columns| columns.run.truncate(1)), "run numbers: 1 where 3 are expected"),
        (with(&|columns| columns.time_s[2] = 0.5), "time decreases: 0.5 s after 1 s"),
        (with(&|columns| columns.observed = vec![0.001; 3]), "a bar of 125.0000 mm read 0.001 mm"),
        (test_at("C", 0.0), "cannot reach between its balls"),
    ] {
        let fault = session.add_test(bad).unwrap_err();
        assert!(fault.to_string().contains(expected), "`{expected}` is not in\n{fault}");
        assert!(matches!(fault, ModelError::Session { .. }) && fault.help().is_some());
        assert!(fault.location().is_none());
        assert_eq!(session.tests.len(), 1);
    }
}

fn test_at(axis: &str, position: f64) -> NewTest {
    NewTest::new("low", ball_bar()).at(axis, position).readings(columns())
}

/// A reading of which a value is missing is left out; the session tells how many and where, and faults of the others keep
/// their places among all items.
#[test]
fn missing_readings_are_left_out_and_told() {
    use abbe_model::files::table::memory::{MemoryColumn, Values};

    let document: Node = document_of_text(Path::new("session.toml"), SESSION).unwrap();
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
