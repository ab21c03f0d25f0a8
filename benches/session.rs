//! Processor times of a fit, of the readings of the model and of their derivatives, for a session file, as JSON.

use std::hint::black_box;

use abbe::identify::noise::{Noise, NoiseSource};
use abbe::identify::problem::Problem;
use abbe::prelude::*;
use abbe::trace::SessionFit;
use rayon::prelude::*;

/// Mean processor time of a repeated computation, s. Other work on the machine does not count.
fn mean_cpu_s(repeats: u32, mut work: impl FnMut()) -> std::io::Result<f64> {
    let start = cpu_s()?;
    (0..repeats).for_each(|_| work());
    Ok((cpu_s()? - start) / f64::from(repeats))
}

/// Processor time of this process on Linux, in user and system mode, s.
fn cpu_s() -> std::io::Result<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat")?;
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let ticks = after_name.split_whitespace().skip(11).take(2).filter_map(|field| field.parse::<f64>().ok());
    Ok(ticks.sum::<f64>() / 100.0)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Cargo adds `--bench`.
    let file = std::env::args().skip(1).find(|word| word != "--bench").ok_or("name a session file")?;
    let session = read_session(file)?;
    let problem = Problem::new(&session, Noise::white(1e-3, NoiseSource::Stated), 1)?;
    let beta = vec![0.0; problem.parameters.list.len()];
    let fit = mean_cpu_s(5, || drop(black_box(SessionFit::of(&session, 1))))?;
    let predict = mean_cpu_s(50, || {
        let values = problem.slot_values(&beta);
        let models = problem.models.iter().zip(&values);
        black_box(models.map(|(model, values)| model.readings(values)).collect::<Vec<_>>());
    })?;
    let blocks = problem.blocks();
    let jacobian = mean_cpu_s(20, || {
        let values = problem.slot_values(&beta);
        let rows = blocks.par_iter().map(|block| problem.own_rows(&values[block.test], block));
        black_box(rows.collect::<Result<Vec<_>, _>>().is_ok());
    })?;
    println!("{{\"fit\": {fit}, \"predict\": {predict}, \"jacobian\": {jacobian}}}");
    Ok(())
}
