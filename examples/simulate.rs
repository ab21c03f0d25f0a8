//! Builds a machine and a ball-bar test in memory, simulates an error of 10 µm, and identifies it.

use abbe::prelude::*;
use serde_json::json;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut session = Session::new(Machine::from_code("w C A b Y X Z t")?, "ballbar".parse()?);
    session.noise_mm = Some(0.3e-3);
    session.unknowns = ["EX0C", "EY0C"].iter().filter_map(|name| ErrorName::parse(name)).collect();

    // A bar of 125 mm from a ball at radius 100 mm on the table to a ball 75 mm above the table.
    let test = json!({
        "name": "C125", "bar_mm": 125, "workpiece_ball_mm": [0, 100, 0], "spindle_ball_mm": [0, 0, 0], "at": {"z_mm": 75},
        "sweep": {"axis": "C", "from_deg": 0, "to_deg": 360, "step_deg": 0.5}
    });
    add_node(&mut session, "test", test.into(), &[])?;

    let given = vec![Given::parse("EX0C=10um")?];
    let simulated = simulate(&session, &Simulation { given, seed: 1, ..Simulation::default() })?;
    let fit = SessionFit::of(&session.with_readings(simulated.readings), 1)?;
    for parameter in &fit.result.model.parameters {
        println!("{} = {:.2} ± {:.2} {}", parameter.id, parameter.value, parameter.u, parameter.unit);
    }
    Ok(())
}
