//! Builds a machine and a ball-bar test in memory, simulates an error of 10 µm, and identifies it.

use abbe::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut session = Session::new(Machine::from_code("w C A b Y X Z t")?, InstrumentKind::BallBar);
    session.noise_mm = Some(0.3e-3);
    session.unknowns = ["EX0C", "EY0C"].iter().filter_map(|name| ErrorName::parse(name)).collect();

    // A bar of 125 mm from a ball at radius 100 mm on the table to a ball 75 mm above the table.
    let bar = BallBar { workpiece_ball: [0.0, 100.0, 0.0], spindle_ball: [0.0; 3], bar: 125.0 };
    let turn = Motion::sweep(&session.machine, "C", [0.0, std::f64::consts::TAU], 0.01)?;
    session.add_test(NewTest::new("C125", Station::BallBar(bar)).at("Z", 75.0).motion(turn))?;

    let given = vec![Given::parse("EX0C=10um")?];
    let simulated = simulate(&session, &Simulation { given, seed: 1, ..Simulation::default() })?;
    let fit = SessionFit::of(&session.with_readings(simulated.readings), 1)?;
    for parameter in &fit.result.parameters {
        println!("{} = {:.2} ± {:.2} {}", parameter.id, parameter.value, parameter.u, parameter.unit);
    }
    Ok(())
}
