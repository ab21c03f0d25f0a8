//! Traces the residual of a measured session, adds the found effects to it, and fits it again.

use abbe::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut session = read_session("sessions/hermle-c600u/measured/session.toml")?;
    let before = SessionFit::of(&session, 1)?;

    let traced = trace(&session, &TraceOptions::default(), &|_| true)?;
    println!("{}", traced.result.verdict);
    for effect in &traced.result.effects {
        println!("{}: {}", effect.name.component, effect.name.meaning);
    }

    session.effects.extend(traced.effects);
    let after = SessionFit::of(&session, 1)?;
    let held_out_um = [&before, &after].map(|fit| fit.result.model.fit.heldout_rms_um);
    println!("held-out rms {:.3} µm before, {:.3} µm after", held_out_um[0], held_out_um[1]);
    Ok(())
}
