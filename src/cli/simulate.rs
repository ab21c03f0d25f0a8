//! `abbe simulate`: simulate readings of planned tests.

use std::path::PathBuf;

use abbe::identify::quantity::{self, Given};
use abbe::identify::simulate::{Simulated, Simulation, simulate};
use abbe::model::files::{self, Changes, SourceMap, with_readings};
use abbe::model::session::Session;
use abbe::model::words::counted;
use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::failure::Failure;
use super::{CommonArguments, SessionArguments, folder, message, output, read_session, values};
use crate::report::number::micrometres;
use crate::report::simulation::truth;
use crate::report::table::Table;

/// Examples of `abbe simulate`, and the names of values.
pub const HELP: &str = "Names of values are those of results, with a unit: errors (EY0A of ISO 230-1, e_y0a of the literature), set-up \
parameters (`bar[A100]`, `workpiece_ball.x[P1]`), coefficients of the [[effect]] tables of the session \
(--effect \"EZC~C:h2.amplitude=1.5um\"). A harmonic is amplitude · cos(order · angle + phase). Values that are not \
given are zero.

Examples:
  abbe simulate sessions/hermle-c600u/chapter5.toml --out run1 --error EY0A=35.3um \\
      --error EB0A=-1.29arcsec
  abbe simulate sessions/hermle-c600u/chapter5.toml --out run2 --draw-setups --seed 7
  abbe simulate sessions/hermle-c600u/chapter5.toml --out run3 --draw-setups --seed 8 \\
      --noise-um 0.5

A file for --errors has one value per line, `EY0A = \"35.3 um\"`. Names with other characters than letters and digits are quoted.";

/// `abbe simulate SESSION --out DIR`
#[derive(Args)]
pub struct SimulateArguments {
    #[command(flatten)]
    session: SessionArguments,
    /// New folder for the session with readings.
    ///
    /// Example: --out run1
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Value of an error or a set-up parameter; may be repeated.
    ///
    /// Example: --error EY0A=35.3um --error bar[A100]=0.4um
    #[arg(long = "error", value_name = "NAME=VALUE", allow_hyphen_values = true)]
    errors: Vec<String>,
    /// Value of a coefficient of a declared effect; may be repeated.
    ///
    /// Example: --effect EZC~C:h2.amplitude=1.5um --effect EZC~C:h2.phase=60deg
    #[arg(long = "effect", value_name = "NAME=VALUE", allow_hyphen_values = true)]
    effects: Vec<String>,
    /// TOML file with such values.
    ///
    /// Example: --errors errors.toml
    #[arg(long = "errors", value_name = "FILE")]
    file: Option<PathBuf>,
    /// Standard deviation of the noise, µm [default: the noise of the session].
    ///
    /// Example: --noise-um 0.5
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    noise_um: Option<f64>,
    /// Draw the set-up parameters from their priors.
    #[arg(long)]
    draw_setups: bool,
    /// Omit the declared effects from the session that is written.
    #[arg(long)]
    hide_effects: bool,
    /// Replace files in an existing folder.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    common: CommonArguments,
}

/// Runs `abbe simulate`.
pub fn run(arguments: &SimulateArguments) -> Result<(), Failure> {
    let outputs = arguments.common.outputs(&[])?;
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    let mut given = match &arguments.file {
        Some(file) => {
            outputs.refuse_overwrite([file.as_path()])?;
            quantity::read(file)?
        }
        None => Vec::new(),
    };
    for text in arguments.errors.iter().chain(&arguments.effects) {
        let value = Given::parse(text)?;
        // A value on the command line replaces that of the file.
        given.retain(|other| other.id != value.id);
        given.push(value);
    }
    arguments.noise_um.map(|noise| values::NOISE_UM.check("--noise-um", noise)).transpose()?;
    let simulation = Simulation {
        given,
        noise_mm: arguments.noise_um.map(|noise_um| noise_um * 1e-3),
        draw_setups: arguments.draw_setups,
        seed: arguments.common.seed,
    };
    let simulated = simulate(&session, &simulation)?;
    let changes = Changes { noise_um: arguments.noise_um, hide_effects: arguments.hide_effects };
    let files = with_readings((&session, &sources), &simulated.readings, changes)?;
    if output::is_same(output::folder_of(&sources.file), &arguments.out) {
        return Err(Failure::Other(format!(
            "{}: this folder contains the plan itself; write the readings to another folder",
            arguments.out.display()
        )));
    }
    output::Outputs::in_folder(&arguments.out, files.iter().map(|(name, _)| name))
        .refuse_overwrite_of_sources(&sources)?;
    folder::write(&arguments.out, &files, arguments.force, |made| {
        // The written files are read back as a session.
        let path = made.join("session.toml");
        files::session(&path, &files::ReadOptions::default())?;
        Ok(())
    })?;
    report((&session, &sources), &simulated, arguments, outputs.tables(arguments.common.quiet))
}

/// The simulated session and the true values of its parameters.
#[derive(Serialize, JsonSchema)]
pub struct SimulationResult {
    /// The session file that was written.
    written_session: String,
    /// Number of simulated readings.
    readings: usize,
    /// Standard deviation of the simulated noise, µm.
    noise_um: f64,
    /// Resolution of the readings, µm; `null` for none.
    resolution_um: Option<f64>,
    /// The parameters that are not zero.
    truth: Vec<TrueValue>,
    /// Warnings in words.
    warnings: Vec<String>,
}

/// The true value of a parameter.
#[derive(Serialize, JsonSchema)]
struct TrueValue {
    /// Identifier: `EY0A`, `bar[A100]`, `EZC~C:h2.cos`.
    id: String,
    /// The value, in `unit`.
    value: f64,
    /// `um`, `arcsec`, …
    unit: String,
}

fn report(
    (session, sources): (&Session, &SourceMap),
    simulated: &Simulated,
    arguments: &SimulateArguments,
    tables: bool,
) -> Result<(), Failure> {
    let report = SimulationResult {
        written_session: arguments.out.join("session.toml").display().to_string(),
        readings: simulated.readings.iter().map(|readings| readings.rows()).sum(),
        noise_um: simulated.noise_mm * 1e3,
        resolution_um: session.resolution_mm.map(|step| step * 1e3),
        truth: simulated
            .truth
            .iter()
            .map(|(id, value, unit)| TrueValue { id: id.clone(), value: *value, unit: unit.clone() })
            .collect(),
        warnings: simulated.warnings.clone(),
    };
    if tables {
        print(session, &report, &truth(simulated), arguments.common.seed);
    }
    message::print_warnings(&report.warnings);
    arguments.common.write_json(sources, &report)
}

fn print(session: &Session, report: &SimulationResult, truth: &Table, seed: u64) {
    say!(
        "{}: {} of {}, noise {}, seed {}",
        report.written_session,
        counted(report.readings, "reading"),
        counted(session.tests.len(), "test"),
        micrometres(report.noise_um),
        seed
    );
    if truth.rows.is_empty() {
        say!("No error is given: the readings are those of the nominal machine.");
    } else {
        say!("");
        output::print(truth);
    }
}
