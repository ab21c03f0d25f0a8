//! Fits readings that are in memory: a table whose axis lies 12 µm beside its nominal place.

use abbe::prelude::*;
use serde_json::json;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut session = Session::new(Machine::from_code("w C A b Y X Z t")?, "ballbar".parse()?);
    session.noise_mm = Some(0.1e-3);
    session.unknowns = ["EX0C", "EY0C"].iter().filter_map(|name| ErrorName::parse(name)).collect();

    // In place of readings: the length of a bar from (0.012 − 100 sin C, 100 cos C, 0) to (0, 0, 75).
    let c: Vec<f64> = (0..360).map(|degree| f64::from(degree).to_radians()).collect();
    let length = |c: &f64| ((0.012 - 100.0 * c.sin()).powi(2) + (100.0 * c.cos()).powi(2) + 75.0_f64.powi(2)).sqrt();
    let length: Vec<f64> = c.iter().map(length).collect();

    // The keys of a test are those of `[[test]]` in a session file.
    let test = json!({
        "name": "C125", "bar_mm": 125, "workpiece_ball_mm": [0, 100, 0], "spindle_ball_mm": [0, 0, 0], "at": {"z_mm": 75}
    });
    let columns = [MemoryColumn::numbers("c_rad", &c), MemoryColumn::numbers("length_mm", &length)];
    add_node(&mut session, "test", test.into(), &columns)?;

    let fit = SessionFit::of(&session, 1)?;
    println!("rank {} of {}", fit.result.model.rank, fit.result.model.parameter_count);
    let offset = fit.parameter("EX0C").ok_or("EX0C is not identifiable")?;
    println!("EX0C = {:.2} ± {:.2} {}", offset.value, offset.u, offset.unit);
    Ok(())
}
