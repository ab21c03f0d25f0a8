//! `abbe fit`.

use std::path::PathBuf;

use abbe::identify::results::{FitMonteCarlo, FitResult, ParameterResult, Unobservable, Verdict};
use abbe::model::words::counted;
use clap::{Args, ValueEnum};

use super::failure::Failure;
use super::message::{Kind, tell};
use super::report::ReportArguments;
use super::{
    CommonArguments, SessionArguments, circular, compensation, csv, directions, geometric, output,
    plausibility, read_session, repeated, self_calibration, table,
};

/// Examples of `abbe fit`.
pub const HELP: &str = "Examples:
  abbe fit sessions/hermle-c600u/measured/session.toml --json fit.json --csv fit.csv
  abbe fit sessions/hermle-c600u/measured/session.toml --report fit.html --plots plots
  abbe fit run2/session.toml --repeat run3/session.toml
  abbe fit run1/session.toml --method cone
  abbe fit sessions/r-test/measured/session.toml --views views.csv
  abbe fit sessions/self-calibration/measured/session.toml --method self-calibration \\
      --monte-carlo 100000";

/// How errors are identified.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// All unknowns of the session at once, by least squares on the chain.
    Full,
    /// Position errors from the centre of one circle for each axis (Jiang 2014, Section 4.2), beside the full fit.
    Circle,
    /// Orientation errors from the cone of the bar with its extension (Sections 4.2.1, 5.2), beside the full fit.
    Cone,
    /// Orientation errors from circles in two planes along each axis (Section 6.1.2), beside the full fit.
    TwoPlane,
    /// Rotary axis, linear axes and artefact apart, from a probed cylinder (Zimmermann & Ibaraki 2020).
    SelfCalibration,
}

/// `abbe fit SESSION`
#[derive(Args)]
pub struct FitArguments {
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    common: CommonArguments,
    #[command(flatten)]
    faces: ReportArguments,
    /// How errors are identified.
    #[arg(long, value_enum, default_value = "full")]
    method: Method,
    /// Write readings and residuals of an R-test by direction: that of the sensors, X-, Y- and Z-wise, radial, tangential and axial.
    #[arg(long, value_name = "FILE.csv")]
    views: Option<std::path::PathBuf>,
    #[command(flatten)]
    draws: self_calibration::DrawArguments,
    /// Further sessions of the same plan: the scatter of their fits (Type A) beside the fits' own uncertainties (Type B).
    #[arg(
        long,
        value_name = "SESSION",
        num_args = 1..,
        conflicts_with_all = ["monte_carlo", "csv", "views", "report", "plots", "compensation"]
    )]
    repeat: Vec<PathBuf>,
    /// Write the result as CSV, one row a figure (not with another `--method`).
    #[arg(long, value_name = "FILE")]
    csv: Option<std::path::PathBuf>,
    #[command(flatten)]
    compensation: compensation::CompensationArguments,
}

/// Runs `abbe fit`.
pub fn run(arguments: &FitArguments) -> Result<(), Failure> {
    arguments.faces.check()?;
    arguments.compensation.check()?;
    let others = [
        arguments.csv.as_ref(),
        arguments.views.as_ref(),
        arguments.faces.file(),
    ];
    let outputs = arguments.common.outputs(&others)?;
    let tables = outputs.tables(arguments.common.quiet);
    if !arguments.repeat.is_empty() {
        if arguments.method != Method::Full {
            return Err(Failure::CommandLine(
                "--repeat compares full fits; leave out `--method`, or --repeat".into(),
            ));
        }
        return repeated::run(&arguments.session, &arguments.repeat, &arguments.common, &outputs);
    }
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    if arguments.views.is_some() && arguments.method != Method::Full {
        let message = "`--views` shows what the full fit leaves as residual: leave `--method` out";
        return Err(Failure::CommandLine(message.into()));
    }
    if arguments.method != Method::Full && (arguments.csv.is_some() || arguments.compensation.wanted()) {
        return Err(Failure::CommandLine(
            "--csv and --compensation go with the full fit; leave out --method, or use --json".into(),
        ));
    }
    if arguments.method == Method::SelfCalibration && arguments.faces.asked() {
        return Err(Failure::CommandLine(
            "`--report` and `--plots` show the full fit and the geometric methods; leave `--method` out"
                .to_string(),
        ));
    }
    if arguments.method == Method::SelfCalibration {
        return self_calibration::run(&session, &arguments.draws, &arguments.common, tables);
    }
    let geometric = match arguments.method {
        Method::Full | Method::SelfCalibration => None,
        Method::Circle => Some(abbe::identify::geometric::Method::Circle),
        Method::Cone => Some(abbe::identify::geometric::Method::Cone),
        Method::TwoPlane => Some(abbe::identify::geometric::Method::TwoPlane),
    };
    if let Some(method) = geometric {
        arguments.draws.refuse()?;
        return geometric::run(
            (&session, &sources),
            method,
            &arguments.common,
            &arguments.faces,
            tables,
        );
    }
    let draws = arguments.draws.draws(arguments.common.seed)?;
    let (problem, fit) = abbe::identify::fit::prepare(&session, arguments.common.seed)?;
    if let Some(path) = &arguments.views {
        directions::write(&problem, &fit, path)?;
    }
    let mut result = abbe::identify::fit::report(&problem, &fit);
    if let Some(draws) = &draws {
        abbe::identify::propagation::add_monte_carlo(&problem, &fit, draws, &mut result)?;
    }
    if tables {
        print(&result);
    }
    print_warnings(&result.warnings);
    if let Some(path) = &arguments.common.json {
        output::write_json(path, &result)?;
    }
    if let Some(path) = &arguments.csv {
        csv::write_fit(path, &result)?;
    }
    if arguments.faces.asked() {
        let document = crate::report::fit::document(&problem, &fit, &result)?;
        let method = crate::report::fit::method(&result);
        arguments
            .faces
            .write(&document, &method, (&session, &sources), arguments.common.seed)?;
    }
    arguments.compensation.run(&problem, &fit, tables)
}

fn print(result: &FitResult) {
    plausibility::print(&result.plausibility);
    say!(
        "{}, {}",
        counted(result.readings, "reading"),
        noise(result.noise_um, &result.noise_source)
    );
    say!(
        "residual {}, held out {} (leaving out {})",
        table::micrometres(result.rms_um),
        table::micrometres(result.heldout_rms_um),
        result.heldout_by
    );
    if let (Some(rms), Some(held)) = (result.rms_3d_um, result.heldout_rms_3d_um) {
        say!(
            "length of the 3-vector: residual {}, held out {}",
            table::micrometres(rms),
            table::micrometres(held)
        );
    }
    say!(
        "{} of {} parameters identifiable (rank)",
        result.rank,
        result.parameter_count
    );
    say!("");
    match &result.monte_carlo {
        Some(drawn) => print_drawn(drawn),
        None => print_parameters(&result.parameters),
    }
    print_unobservable(&result.unobservable);
    if !result.outliers.is_empty() {
        say!("\nExcluded as outliers:");
        for reading in &result.outliers {
            say!(
                "  {} {}:{}  residual {}",
                reading.test,
                reading.file,
                reading.line,
                table::micrometres(reading.residual_um)
            );
        }
    }
    circular::print(&result.circular);
}

/// What uncertainties follow from, in words: the residual of a model is not called noise.
pub fn noise(noise_um: f64, source: &str) -> String {
    let figure = table::micrometres(noise_um);
    match source {
        "residual" => format!("residual of the declared model {figure} (no noise stated, no repeats)"),
        other => format!("noise {figure} ({other})"),
    }
}

/// The table of identified parameters.
pub fn print_parameters(parameters: &[ParameterResult]) {
    let rows: Vec<Vec<String>> = parameters
        .iter()
        .map(|p| {
            let (value, u) = table::value_and_u(p.value, p.u);
            vec![p.id.clone(), value, u, p.unit.clone()]
        })
        .collect();
    table::print(&["parameter", "value", "u (k=1)", "unit"], &rows);
}

/// Both propagations side by side, with the interval that is quoted.
fn print_drawn(drawn: &FitMonteCarlo) {
    let rows: Vec<Vec<String>> = drawn
        .parameters
        .iter()
        .map(|parameter| {
            let (value, gum_u) = table::value_and_u(parameter.value, parameter.gum_u);
            let (_, u) = table::value_and_u(parameter.value, parameter.u);
            let (quoted, of) = match parameter.verdict {
                Verdict::Agree => (parameter.gum_interval, "GUM"),
                Verdict::Differ => (parameter.symmetric_interval, "Monte Carlo"),
                Verdict::Undecided => (
                    parameter.symmetric_interval,
                    "Monte Carlo (too few runs to compare)",
                ),
            };
            let [low, high] = [quoted.low, quoted.high].map(|end| table::value_and_u(end, parameter.u).0);
            vec![
                parameter.id.clone(),
                value,
                gum_u,
                u,
                format!("{low} … {high}"),
                parameter.unit.clone(),
                of.to_string(),
            ]
        })
        .collect();
    let interval = format!("{} %", drawn.coverage_probability * 100.0);
    table::print(
        &[
            "parameter",
            "value",
            "u GUM",
            "u drawn",
            &interval,
            "unit",
            "quoted",
        ],
        &rows,
    );
    let off = |verdict: Verdict| drawn.parameters.iter().filter(|p| p.verdict == verdict).count();
    say!(
        "\nMonte Carlo, {}, seed {}: {} of {} agree with the GUM within the tolerance of JCGM 101, 8.1; {} differ",
        counted(drawn.runs, "run"),
        drawn.seed,
        off(Verdict::Agree),
        counted(drawn.parameters.len(), "parameter"),
        off(Verdict::Differ)
    );
}

/// What cannot be seen, in words.
pub fn print_unobservable(unobservable: &[Unobservable]) {
    if unobservable.is_empty() {
        return;
    }
    say!("\nNot seen by these readings:");
    for item in unobservable {
        let terms: Vec<String> = item
            .combination
            .iter()
            .map(|(id, value)| format!("{id} {value:.4}"))
            .collect();
        say!("  {}", item.why);
        if terms.len() > 1 {
            say!("    {}", terms.join(" : "));
        }
    }
}

/// Named warnings, on standard error.
pub fn print_warnings(warnings: &[String]) {
    for warning in warnings {
        tell(Kind::Warning, warning);
    }
}
