//! Times of a fit, of the readings of the model and of their derivatives, for a session file, as JSON.

use std::hint::black_box;
use std::time::Instant;

use abbe::identify::fit::SessionFit;
use abbe::identify::noise::{Noise, NoiseSource};
use abbe::identify::problem::Problem;
use abbe::prelude::*;
use rayon::prelude::*;

fn best(mut work: impl FnMut()) -> f64 {
    let times = (0..7).map(|_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Cargo adds `--bench`.
    let file = std::env::args().skip(1).find(|word| word != "--bench").ok_or("name a session file")?;
    let session = read_session(file)?;
    let problem = Problem::new(&session, Noise::white(1e-3, NoiseSource::Stated), 1)?;
    let beta = vec![0.0; problem.parameters.list.len()];
    let fit = best(|| drop(black_box(SessionFit::of(&session, 1))));
    let predict = best(|| {
        let values = problem.slot_values(&beta);
        let models = problem.models.iter().zip(&values);
        black_box(models.map(|(model, values)| model.readings_mm(values)).collect::<Vec<_>>());
    });
    let blocks = problem.blocks();
    let jacobian = best(|| {
        let values = problem.slot_values(&beta);
        let rows = blocks.par_iter().map(|block| problem.own_rows(&values[block.test], block));
        black_box(rows.collect::<Result<Vec<_>, _>>().is_ok());
    });
    println!("{{\"fit\": {fit}, \"predict\": {predict}, \"jacobian\": {jacobian}}}");
    Ok(())
}
