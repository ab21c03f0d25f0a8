//! `abbe simulate`: simulate readings of planned tests.

use std::path::PathBuf;

use abbe::files::{self, Changes, with_readings};
use abbe::identify::quantity::{self, Given};
use abbe::identify::simulate::{Simulation, SimulationResult, simulate};
use abbe::model::Diagnostic;
use abbe::model::unit::ARCSEC_PER_RAD;
use clap::Args;

use super::results::Read;
use super::{CommonArguments, Global, SessionArguments, folder, output, read_session, values};
use crate::report::simulation as present;

/// Examples of `abbe simulate`, and the names of values.
pub const HELP: &str = include_str!("help/simulate.txt");

/// `abbe simulate SESSION --out DIR`
#[derive(Args)]
pub struct SimulateArguments {
    #[command(flatten)]
    session: SessionArguments,
    /// Where the result is written: a new folder for the session with readings.
    ///
    /// Example: --out run1
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Value of an error; may be repeated. Set-up parameters have values too.
    ///
    /// Example: --error EY0A=35.3um --error bar[A100]=0.4um
    #[arg(long = "error", value_name = "NAME=VALUE", allow_hyphen_values = true)]
    errors: Vec<String>,
    /// Value of a coefficient of a declared effect; may be repeated.
    ///
    /// Example: --effect EZC~C:h2.amplitude=1.5um --effect EZC~C:h2.phase=60deg
    #[arg(long = "effect", value_name = "NAME=VALUE", allow_hyphen_values = true)]
    effects: Vec<String>,
    /// TOML file with values of errors, effects and set-up parameters.
    ///
    /// Example: --values errors.toml
    #[arg(long = "values", value_name = "FILE")]
    file: Option<PathBuf>,
    /// Standard deviation of a reading, µm, instead of the session's.
    ///
    /// Example: --noise-um 0.5
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    noise_um: Option<f64>,
    /// Standard deviation of a reading of an angle, arcsec, instead of the session's.
    ///
    /// Example: --noise-arcsec 0.2
    #[arg(long, value_name = "ARCSEC", allow_negative_numbers = true)]
    noise_arcsec: Option<f64>,
    /// Draw the set-up parameters from their priors.
    #[arg(long)]
    draw_setups: bool,
    /// Omit the declared effects from the session that is written.
    #[arg(long)]
    hide_effects: bool,
    #[command(flatten)]
    common: CommonArguments,
}

/// Runs `abbe simulate`.
pub fn run(arguments: &SimulateArguments, _: Global) -> Result<(), Diagnostic> {
    let outputs = arguments.common.output.prepared(&[])?;
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
    arguments.noise_arcsec.map(|noise| values::NOISE_ARCSEC.check("--noise-arcsec", noise)).transpose()?;
    let simulation = Simulation {
        given,
        noise_mm: arguments.noise_um.map(|noise_um| noise_um * 1e-3),
        noise_rad: arguments.noise_arcsec.map(|arcsec| arcsec / ARCSEC_PER_RAD),
        draw_setups: arguments.draw_setups,
        seed: arguments.common.seed,
    };
    let simulated = simulate(&session, &simulation)?;
    let SimulateArguments { noise_um, noise_arcsec, hide_effects, .. } = *arguments;
    let changes = Changes { noise_um, noise_arcsec, hide_effects };
    let files = with_readings((&session, &sources), &simulated.readings, changes)?;
    if output::is_same(output::folder_of(&sources.file), &arguments.out) {
        return Err(Diagnostic::other(format!(
            "{}: this folder contains the plan itself; write the readings to another folder",
            arguments.out.display()
        )));
    }
    output::Outputs::in_folder(&arguments.out, files.iter().map(|(name, _)| name))
        .refuse_overwrite_of_sources(&sources)?;
    folder::write(&arguments.out, &files, arguments.common.output.folder.force, |made| {
        // The written files are read back as a session.
        let path = made.join("session.toml");
        files::session(&path, &files::ReadOptions::default())?;
        Ok(())
    })?;
    let common = &arguments.common;
    let result = SimulationResult::of(&session, &simulated, &arguments.out.join("session.toml"));
    let report = present::report(&session, &result.written_session, &simulated, common.seed);
    common.output.put(&outputs, &report, &result, &Read::session(&session, &sources, common.seed))
}
