//! A session that is built in memory is fitted as one from files. The readings follow from a closed form.

use std::f64::consts::TAU;

use abbe_files::read::add_node;
use abbe_files::table::memory::MemoryColumn;
use abbe_identify::fit;
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::session::Session;
use serde_json::json;

/// Offset of the axis of C, mm.
const OFFSET: [f64; 2] = [0.012, -0.007];

/// Length of a bar from a ball at radius 100 mm on the table to a ball 75 mm above its nominal centre:
/// √((ex − R sin C)² + (ey + R cos C)² + H²).
fn length(c: f64) -> f64 {
    let (x, y) = (OFFSET[0] - 100.0 * c.sin(), OFFSET[1] + 100.0 * c.cos());
    (x * x + y * y + 75.0 * 75.0).sqrt()
}

#[test]
fn the_offset_of_an_axis_is_found_in_readings_in_memory() {
    let mut session = Session::new(Machine::from_code("[wCAbYXZt]").unwrap(), "ballbar".parse().unwrap());
    session.noise_mm = Some(0.1e-3);
    session.unknowns = ["EX0C", "EY0C"].iter().filter_map(|name| ErrorName::parse(name)).collect();
    let forward: Vec<f64> = (0..180).map(|k| TAU * f64::from(k) / 180.0).collect();
    let c: Vec<f64> = forward.iter().chain(forward.iter().rev()).copied().collect();
    // Noise without a pattern over C: the fractional part of a multiple of the golden ratio.
    let noise = |row: usize| 0.35e-3 * ((row as f64 * 0.618_033_988_749_895).fract() - 0.5);
    let length_mm: Vec<f64> = c.iter().enumerate().map(|(row, c)| length(*c) + noise(row)).collect();
    let run: Vec<f64> = (0..c.len()).map(|row| if row < 180 { 1.0 } else { 2.0 }).collect();
    let columns = [("c_rad", &c), ("length_mm", &length_mm), ("run", &run)];
    let columns = columns.map(|(name, values)| MemoryColumn::numbers(name, values));
    let test = json!({"name": "C100", "bar_mm": 125, "workpiece_ball_mm": [0, 100, 0], "spindle_ball_mm": [0, 0, 0],
                      "at": {"z_mm": 75}});
    add_node(&mut session, "test", test.into(), &columns).unwrap();
    let (problem, found) = fit::prepare(&session, 1).unwrap();
    let report = fit::report(&problem, &found).unwrap();
    assert_eq!(report.model.fit.readings, 360);
    for (name, expected) in ["EX0C", "EY0C"].into_iter().zip(OFFSET) {
        let parameter = report.model.parameters.iter().find(|parameter| parameter.id == name).unwrap();
        assert!((parameter.value - expected * 1e3).abs() < 3.0 * parameter.u, "{name}: {}", parameter.value);
        assert!(parameter.u < 0.02, "{name}: {}", parameter.u);
    }
}

/// Results outlive the session that was passed in, and cross threads.
#[test]
fn a_fit_owns_what_it_needs() {
    fn owned<T: Send + Sync + 'static>() {}
    owned::<Session>();
    owned::<abbe_identify::problem::Problem>();
    owned::<fit::Fit>();
}
