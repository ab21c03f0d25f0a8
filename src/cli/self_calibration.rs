//! `abbe fit --method self-calibration`: rotary axis, linear axes and artefact separately.

use abbe::identify::results::Interval;
use abbe::identify::self_calibration::{self, FunctionResult, MonteCarlo, SelfCalibration};
use abbe::model::files::SourceMap;
use abbe::model::session::Session;
use abbe::model::words::counted;
use clap::Args;

use super::failure::Failure;
use super::{CommonArguments, json, message, screen, table};

/// Monte Carlo propagation of a self-calibration or of the full fit.
#[derive(Args)]
pub struct DrawArguments {
    /// Propagate distributions by Monte Carlo with this number of runs (JCGM 101), for the full fit and for a
    /// self-calibration.
    ///
    /// Example: --monte-carlo 100000
    #[arg(long, value_name = "RUNS")]
    monte_carlo: Option<u64>,
    /// Coverage probability of the intervals of --monte-carlo.
    ///
    /// Example: --monte-carlo 10000 --coverage 0.99
    #[arg(long, value_name = "P", requires = "monte_carlo", default_value_t = 0.95)]
    coverage: f64,
}

/// Minimum number of runs for 95 % intervals (JCGM 101, 7.2.2: 10⁴, so that 200 runs lie beyond each end).
const MIN_RUNS: u64 = 10_000;

impl DrawArguments {
    /// Refuses Monte Carlo with another method.
    pub fn refuse(&self) -> Result<(), Failure> {
        match self.monte_carlo {
            None => Ok(()),
            Some(_) => Err(Failure::CommandLine(
                "`--monte-carlo` works with the full fit and with `--method self-calibration`: leave out `--method` or `--monte-carlo`"
                    .into(),
            )),
        }
    }

    /// The requested Monte Carlo propagation.
    pub fn draws(&self, seed: u64) -> Result<Option<MonteCarlo>, Failure> {
        let Some(runs) = self.monte_carlo else {
            return Ok(None);
        };
        if runs < MIN_RUNS {
            return Err(Failure::Other(format!(
                "`--monte-carlo {runs}`: at least {MIN_RUNS} runs are needed for the coverage intervals"
            )));
        }
        if !(self.coverage > 0.5 && self.coverage < 0.9999) {
            return Err(Failure::Other(format!(
                "`--coverage {}`: a probability between 0.5 and 0.9999 is expected",
                self.coverage
            )));
        }
        Ok(Some(MonteCarlo { runs, seed, coverage: self.coverage }))
    }
}

/// Runs `abbe fit --method self-calibration`.
pub fn run(
    (session, sources): (&Session, &SourceMap),
    draws: &DrawArguments,
    common: &CommonArguments,
    tables: bool,
) -> Result<(), Failure> {
    let draws = draws.draws(common.seed)?;
    let calibration = self_calibration::calibrate(session)?;
    let result = calibration.report(session, draws.as_ref());
    if tables {
        print(&result);
    }
    message::print_warnings(&result.warnings);
    if let Some(path) = &common.json {
        json::write_of_session(path, sources, common.seed, &result)?;
    }
    Ok(())
}

fn print(result: &SelfCalibration) {
    say!(
        "{}, {}, residual {}",
        counted(result.readings, "reading"),
        screen::noise(result.noise_um, &result.noise_source),
        table::micrometres(result.rms_um)
    );
    say!(
        "{} of four functions, numerical rank {} without boundary conditions",
        counted(result.value_count, "value"),
        result.rank_without_conditions
    );
    say!(
        "{} under {}, numerical rank {}",
        counted(result.parameter_count, "parameter"),
        counted(result.conditions.len(), "condition"),
        result.rank
    );
    for condition in &result.conditions {
        say!("  {condition}");
    }
    say!("\nFunctions, µm, value ± standard uncertainty:");
    print_functions(&result.functions);
    if let Some(radius) = &result.radius {
        say!("");
        screen::print_parameters(&[radius]);
    }
    if !result.parameters.is_empty() {
        say!("\nPosition of axis {}, by the least-squares circle of its displacements:", result.axis);
        screen::print_parameters(&result.parameters.iter().collect::<Vec<_>>());
        say!("\nThe same, from the angles of rotation:");
        screen::print_parameters(&result.parameters_by_turn.iter().collect::<Vec<_>>());
        say!("\nError motions of axis {}, µm:", result.axis);
        print_functions(&result.error_motions);
    }
    screen::print_missing(&result.unobservable, &[], true);
    if let Some(drawn) = &result.monte_carlo {
        say!(
            "\nMonte Carlo, {}, seed {}; coverage intervals of {} %, µm:",
            counted(drawn.runs, "run"),
            drawn.seed,
            drawn.coverage_probability * 100.0
        );
        let rows: Vec<Vec<String>> = drawn
            .quantities
            .iter()
            .map(|quantity| {
                let (mean, u) = table::value_and_u(quantity.mean_um, quantity.u_um);
                let interval = |Interval { low, high }: Interval| {
                    let (low, _) = table::value_and_u(low, quantity.u_um);
                    let (high, _) = table::value_and_u(high, quantity.u_um);
                    format!("{low} to {high}")
                };
                vec![
                    quantity.id.clone(),
                    mean,
                    u,
                    interval(quantity.shortest_interval_um),
                    interval(quantity.symmetric_interval_um),
                ]
            })
            .collect();
        table::print(&["quantity", "mean", "u", "shortest", "symmetric"], &rows);
    }
}

/// Functions side by side, one line per angle.
fn print_functions(functions: &[FunctionResult]) {
    let mut angles: Vec<f64> = Vec::new();
    for point in functions.iter().flat_map(|function| &function.points) {
        if !angles.contains(&point.at_deg) {
            angles.push(point.at_deg);
        }
    }
    angles.sort_by(f64::total_cmp);
    let mut header = vec!["angle"];
    header.extend(functions.iter().map(|function| function.id.as_str()));
    let cell = |function: &FunctionResult, angle: f64| {
        let point = function.points.iter().find(|point| point.at_deg == angle);
        let Some((value, u)) = point.and_then(|point| Some((point.value_um?, point.u_um?))) else {
            return "–".to_string();
        };
        if u < 1e-9 {
            return format!("{:.2}", value + 0.0);
        }
        let (value, u) = table::value_and_u(value, u);
        format!("{value} ± {u}")
    };
    let rows: Vec<Vec<String>> = angles
        .iter()
        .map(|angle| {
            let mut row = vec![format!("{angle}°")];
            row.extend(functions.iter().map(|function| cell(function, *angle)));
            row
        })
        .collect();
    table::print(&header, &rows);
}
