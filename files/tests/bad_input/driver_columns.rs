//! Driver columns: names, units, `[columns]`, the driver of an effect, and values after a first-order lag.

use abbe_model::driver::{Driver, DriverInput};
use abbe_model::effect::Shape;
use abbe_model::sensitivity::TestModel;
use abbe_model::session::Session;

use super::{DATA, MACHINE, SESSION, assert_contains, error_text, session, with_data};

const EFFECT: &str = "[[effect]]\ncomponent = \"EX0C\"\ndriver = \"NAME\"\nshape = \"first-order-lag\"\ntau_s = 2\n";

/// The data with a column more, one value a row.
fn with_column(name: &str, values: [f64; 4]) -> String {
    let header = DATA.lines().next().unwrap();
    let rows = DATA.lines().skip(1).zip(values).map(|(row, value)| format!("{row},{value}\n"));
    format!("{header},{name}\n{}", rows.collect::<String>())
}

fn with_effect(driver: &str) -> String {
    SESSION.to_string() + &EFFECT.replace("NAME", driver)
}

/// The values of a driver in the first test.
fn values(session: &Session, driver: &Driver, lag_s: Option<f64>) -> Vec<f64> {
    let test = &session.tests[0];
    let readings = test.readings.as_ref().unwrap();
    let input = DriverInput {
        machine: &session.machine,
        model: &TestModel::new(session.machine.clone(), test.station.clone(), readings),
        readings,
        reference: &session.reference(),
        component_axis: None,
        lag_s,
    };
    driver.kind().samples(&input).unwrap().iter().map(|sample| sample.value).collect()
}

/// A temperature counts from the mean of the session, a torque from 0. The driver may omit the unit.
#[test]
fn a_column_is_a_driver() {
    for (name, column, zero) in
        [("spindle_temperature_c", "driver.spindle_temperature_c", 25.0), ("torque_j2_nm", "driver.torque_j2_nm", 0.0)]
    {
        let stated = [22.0, 24.0, 26.0, 28.0];
        for driver in [name, name.rsplit_once('_').unwrap().0] {
            let read = session(MACHINE, &with_effect(driver), Some(&with_column(column, stated))).unwrap();
            assert_eq!(read.effects[0].driver, Driver::Column(name.to_string()));
            assert_eq!(read.effects[0].id(), format!("EX0C~{name}:first-order-lag"));
            assert_eq!(values(&read, &read.effects[0].driver, None), stated.map(|value| value - zero));
        }
    }
}

/// The response to a ramp of 1 K/s from equilibrium is t − τ(1 − exp(−t/τ)). It does not depend on the sampling.
#[test]
fn a_lagged_ramp_has_its_closed_form() {
    let ramp = with_column("driver.spindle_temperature_c", [20.0, 21.0, 22.0, 23.0]);
    let read = session(MACHINE, &with_effect("spindle_temperature_c"), Some(&ramp)).unwrap();
    let Shape::FirstOrderLag(shape) = &read.effects[0].shape else { panic!("{:?}", read.effects[0]) };
    assert_eq!((shape.tau_s, shape.scale), (2.0, 1.0));
    for (row, value) in values(&read, &read.effects[0].driver, Some(2.0)).into_iter().enumerate() {
        let t = row as f64;
        let expected = 20.0 + t - 2.0 * (1.0 - (-t / 2.0).exp()) - 21.5;
        assert!((value - expected).abs() < 1e-12, "{row}: {value} {expected}");
    }
}

/// A constant column is exactly 0 in every state, so that rank sees that it determines nothing. Values that differ by
/// their last digit only are constant.
#[test]
fn a_constant_column_determines_nothing() {
    let next = |value: f64| f64::from_bits(value.to_bits() + 1);
    for stated in [[21.7; 4], [21.7, next(21.7), 21.7, next(next(21.7))], [0.1; 4], [-3e5 / 7.0; 4]] {
        let read = session(MACHINE, SESSION, Some(&with_column("driver.spindle_c", stated))).unwrap();
        let driver = Driver::parse("spindle_c");
        for lag_s in [None, Some(0.3), Some(7.0), Some(1e4)] {
            assert_eq!(values(&read, &driver, lag_s), [0.0; 4], "{stated:?} {lag_s:?}");
        }
    }
}

/// The history of a column continues from one file to the next, with the column linear between.
#[test]
fn a_lag_continues_from_test_to_test() {
    let column = "driver.spindle_temperature_c";
    let all = with_column(column, [20.0, 23.0, 21.0, 24.0]);
    let driver = Driver::parse("spindle_temperature_c");
    let whole = values(&session(MACHINE, SESSION, Some(&all)).unwrap(), &driver, Some(1.5));
    let mut lines = all.lines();
    let header = lines.next().unwrap();
    let rows: Vec<&str> = lines.collect();
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: String| std::fs::write(folder.path().join(name), text).unwrap();
    let second = SESSION[SESSION.find("[[test]]").unwrap()..].replace("C100", "C101");
    write("machine.toml", MACHINE.to_string());
    write("session.toml", format!("{SESSION}\n{second}"));
    write("C100.csv", format!("{header}\n{}\n{}\n", rows[0], rows[1]));
    write("C101.csv", format!("{header}\n{}\n{}\n", rows[2], rows[3]));
    let options = abbe_files::ReadOptions::default();
    let mut read = abbe_files::session(&folder.path().join("session.toml"), &options).unwrap();
    let reference = read.reference();
    for part in [0, 2] {
        let readings = read.tests[0].readings.clone().unwrap();
        let model = TestModel::new(read.machine.clone(), read.tests[0].station.clone(), &readings);
        let input = DriverInput {
            machine: &read.machine,
            model: &model,
            readings: &readings,
            reference: &reference,
            component_axis: None,
            lag_s: Some(1.5),
        };
        for (sample, whole) in driver.kind().samples(&input).unwrap().iter().zip(&whole[part..]) {
            assert!((sample.value - whole).abs() < 1e-12, "{part}: {} {whole}", sample.value);
        }
        read.tests.remove(0);
    }
}

#[test]
fn foreign_driver_columns() {
    let foreign = "t,angle,reading,T1\n0,0,100.0,20\n1,1,100.1,21\n";
    for key in ["driver.spindle_temperature_c", "\"driver.spindle_temperature_c\""] {
        let columns =
            format!("[columns]\ntime_s = \"t\"\nc_deg = \"angle\"\nlength_mm = \"reading\"\n{key} = \"T1\"\n");
        let file = SESSION.replace("[[test]]", &format!("{columns}\n[[test]]"));
        let read = session(MACHINE, &file, Some(foreign)).unwrap();
        assert_eq!(read.tests[0].readings.as_ref().unwrap().drivers["spindle_temperature_c"], [20.0, 21.0]);
    }
    let unknown = SESSION.replace("[[test]]", "[columns]\nlength_mm = 3\ndriver.load_lb = \"T1\"\n[[test]]");
    assert_contains(
        &error_text(session(MACHINE, &unknown, Some(foreign))),
        &["session.toml:10", "unknown column `driver.load_lb`", "driver.NAME_unit", "_c, _k, _pct"],
    );
}

#[test]
fn bad_driver_columns() {
    let values = [1.0, 2.0, 3.0, 4.0];
    for name in ["driver.temperature", "driver.load_lb", "driver._c", "driver.9_c", "driver.a b_c"] {
        assert_contains(
            &with_data(&with_column(name, values)),
            &["C100.csv:1", &format!("unknown name `{name}`"), "driver.NAME_unit", "_c, _k, _pct"],
        );
    }
    let twice = with_column("driver.t_c,driver.t_c", values);
    assert_contains(&with_data(&twice), &["columns `driver.t_c` and `driver.t_c` have the same meaning"]);
    let data = with_column("driver.load_kg", values);
    assert_contains(
        &error_text(session(MACHINE, &with_effect("lod"), Some(&data))),
        &["effect driven by \"lod\"", "load_kg", "columns as NAME_unit"],
    );
    let axis = EFFECT.replace("NAME", "C");
    assert_contains(
        &error_text(session(MACHINE, &(SESSION.to_string() + &axis), Some(&data))),
        &["the shape \"first-order-lag\" cannot have the driver \"C\"", "a column of the data"],
    );
    let scaled = with_effect("load_kg") + "scale_c = 2\n";
    assert_contains(
        &error_text(session(MACHINE, &scaled, Some(&data))),
        &["`scale_c` for a driver in kg", "`scale_kg`"],
    );
}
