//! `abbe fit`: estimate errors from readings.

mod screen;

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::failure::Failure;
use super::message::print_warnings;
use super::report::ReportArguments;
use super::save::SaveArguments;
use super::{
    CommonArguments, SessionArguments, compensation, geometric, output, read_session, repeated, self_calibration,
};
use crate::report::fit::Figures;
use crate::report::readings;

/// Examples of `abbe fit`.
pub const HELP: &str = "Examples:
  abbe fit sessions/hermle-c600u/measured/session.toml
  abbe fit sessions/hermle-c600u/measured/session.toml --all
  abbe fit sessions/hermle-c600u/measured/session.toml --json fit.json --csv fit.csv
  abbe fit sessions/hermle-c600u/measured/session.toml --report fit.html --plots plots
  abbe fit run1/session.toml --base --save model.json
  abbe fit run2/session.toml --repeat run3/session.toml
  abbe fit run1/session.toml --method cone
  abbe fit run1/session.toml --monte-carlo 10000 --coverage 0.99
  abbe fit sessions/r-test/measured/session.toml --views views.csv --residuals residuals.csv
  abbe fit sessions/self-calibration/measured/session.toml --method self-calibration \\
      --monte-carlo 100000

The first screen answers in this order: goodness of fit and rank; estimates with standard uncertainty u, expanded uncertainty \
U = 2u and significance; what is confounded; what to do next. It folds set-up parameters, ball-bar figures, null-space \
directions and outliers. --all lists them.";

/// The method of identification.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// All parameters of the session together, by least squares on the kinematic chain.
    Full,
    /// Position errors from the centre of one circle per axis (Jiang 2014, Section 4.2), beside the full fit.
    Circle,
    /// Orientation errors from the cone of the bar with its extension (Jiang 2014, Sections 4.2.1, 5.2), beside the
    /// full fit.
    Cone,
    /// Orientation errors from circles in two planes along each axis (Jiang 2014, Section 6.1.2), beside the full fit.
    TwoPlane,
    /// Rotary axis, linear axes and artefact separately, from a probed cylinder (Zimmermann & Ibaraki 2020).
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
    report: ReportArguments,
    #[command(flatten)]
    save: SaveArguments,
    /// Print the base parameters: a minimal set of numbers with u that predicts the same readings, and the parameters
    /// that are held at nominal because the readings do not separate them.
    #[arg(long)]
    base: bool,
    /// Explanation of a declared effect that is accepted on the user's word: the effect, or one of its aliases, which then
    /// takes its place. Uncertainties do not cover the others; every output says so. May be repeated.
    ///
    /// Example: --assume EZC~C:h2
    #[arg(long, value_name = "EFFECT")]
    assume: Vec<String>,
    /// List everything that the first screen folds: set-up parameters, directions and diagnosis of ball-bar figures,
    /// null-space directions, outliers.
    #[arg(long)]
    all: bool,
    /// Method of identification.
    ///
    /// Example: --method two-plane
    #[arg(long, value_enum, default_value = "full")]
    method: Method,
    /// Write readings and residuals of an R-test by direction: of the sensors, along X, Y and Z, radial, tangential and
    /// axial.
    ///
    /// Example: --views views.csv
    #[arg(long, value_name = "FILE.csv")]
    views: Option<PathBuf>,
    /// Write reading and residual of every reading as CSV: test, run, line, axis positions, reading, residual in µm,
    /// residual over the noise standard deviation, and whether the reading counts or is an outlier (full fit only).
    ///
    /// Example: --residuals residuals.csv
    #[arg(long, value_name = "FILE.csv")]
    residuals: Option<PathBuf>,
    #[command(flatten)]
    draws: self_calibration::DrawArguments,
    /// Compare with further sessions of the same plan: standard uncertainty from the scatter of the fits (Type A)
    /// beside that of each fit (Type B).
    ///
    /// Example: --repeat day2/session.toml day3/session.toml
    #[arg(
        long,
        value_name = "SESSION",
        num_args = 1..,
        conflicts_with_all = ["monte_carlo", "csv", "views", "residuals", "report", "plots", "compensation", "save", "base"]
    )]
    repeat: Vec<PathBuf>,
    /// Write the result as CSV, one row per value (full fit only).
    ///
    /// Example: --csv fit.csv
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    compensation: compensation::CompensationArguments,
}

/// Runs `abbe fit`.
pub fn run(arguments: &FitArguments) -> Result<(), Failure> {
    arguments.report.check()?;
    arguments.compensation.check()?;
    let others =
        [arguments.csv.as_ref(), arguments.views.as_ref(), arguments.residuals.as_ref(), arguments.report.file()];
    let others = [others.as_slice(), &[arguments.save.file()]].concat();
    let outputs = arguments.common.outputs(&others)?;
    let tables = outputs.tables(arguments.common.quiet);
    if !arguments.repeat.is_empty() {
        if arguments.method != Method::Full {
            return Err(Failure::CommandLine(
                "`--repeat` compares full fits: leave out `--method` or `--repeat`".into(),
            ));
        }
        return repeated::run(&arguments.session, &arguments.repeat, &arguments.common, &outputs);
    }
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    let session = abbe::identify::fit::assume(&session, &arguments.assume)?;
    if arguments.views.is_some() && arguments.method != Method::Full {
        let message = "`--views` writes residuals of the full fit: leave out `--method`";
        return Err(Failure::CommandLine(message.into()));
    }
    if arguments.residuals.is_some() && arguments.method != Method::Full {
        let message = "`--residuals` writes residuals of the full fit: leave out `--method`";
        return Err(Failure::CommandLine(message.into()));
    }
    if arguments.method != Method::Full && (arguments.csv.is_some() || arguments.compensation.wanted()) {
        return Err(Failure::CommandLine(
            "`--csv` and `--compensation` write results of the full fit: leave out `--method`, or use `--json`".into(),
        ));
    }
    if arguments.method != Method::Full && (arguments.base || arguments.save.file().is_some()) {
        let message = "`--base` and `--save` take the result of the full fit: leave out `--method`";
        return Err(Failure::CommandLine(message.into()));
    }
    if arguments.method == Method::SelfCalibration && arguments.report.asked() {
        return Err(Failure::CommandLine(
            "`--report` and `--plots` show the full fit and the geometric methods: leave out `--method`".to_string(),
        ));
    }
    if arguments.method == Method::SelfCalibration {
        return self_calibration::run((&session, &sources), &arguments.draws, &arguments.common, tables);
    }
    let geometric = match arguments.method {
        Method::Full | Method::SelfCalibration => None,
        Method::Circle => Some(abbe::identify::geometric::Method::Circle),
        Method::Cone => Some(abbe::identify::geometric::Method::Cone),
        Method::TwoPlane => Some(abbe::identify::geometric::Method::TwoPlane),
    };
    if let Some(method) = geometric {
        arguments.draws.refuse()?;
        return geometric::run((&session, &sources), method, &arguments.common, &arguments.report, tables);
    }
    let draws = arguments.draws.draws(arguments.common.seed)?;
    let (problem, fit) = abbe::identify::fit::prepare(&session, arguments.common.seed)?;
    if let Some(path) = &arguments.views {
        output::write_whole(path, &output::csv(&readings::by_direction(&problem, &fit)?)?)?;
    }
    if let Some(path) = &arguments.residuals {
        output::write_whole(path, &output::csv(&readings::residuals(&problem, &fit))?)?;
    }
    let mut result = abbe::identify::fit::report(&problem, &fit)?;
    if let Some(draws) = &draws {
        abbe::identify::propagation::add_monte_carlo(&problem, &fit, draws, &mut result)?;
    }
    if arguments.base {
        result.base = Some(abbe::identify::fit::base::report(&problem, &fit)?);
    }
    if tables {
        screen::print(&problem, &fit, &result, &arguments.session, arguments.all);
    }
    print_warnings(&result.warnings);
    arguments.common.write_json(&sources, &result)?;
    if let Some(path) = &arguments.csv {
        output::write_figures(path, &Figures::of_fit(&result))?;
    }
    if arguments.report.asked() {
        let document = crate::report::pages::fit::document(&problem, &fit, &result)?;
        arguments.report.write(&document, (&session, &sources), arguments.common.seed)?;
    }
    arguments.save.run(&problem, &fit, &sources, arguments.common.seed)?;
    arguments.compensation.run(&problem, &fit, tables)
}
