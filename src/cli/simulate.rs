//! `abbe simulate`.

use std::path::PathBuf;

use abbe::identify::quantity::{self, Given};
use abbe::identify::simulate::{Simulated, Simulation, simulate};
use abbe::model::files::table::csv;
use abbe::model::files::toml::{rewrite, write};
use abbe::model::files::{self, SourceMap};
use abbe::model::session::Session;
use abbe::model::session::limits::{LARGEST, MIN_UM};
use abbe::model::words::counted;
use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::failure::Failure;
use super::{CommonArguments, SessionArguments, fit, folder, output, read_session, table};

/// Examples and the names that values go by.
pub const HELP: &str = "Values go by the names that results use, with their unit: errors by ISO 230-1 or the literature (EY0A, e_y0a), set-up \
quantities (`bar[A100]`, `workpiece_ball.x[P1]`), coefficients of the [[effect]]s that the session declares \
(--effect \"EZC~C:h2.amplitude=1.5um\"). A harmonic takes amplitude and phase of \
amplitude · cos(order · angle + phase). What is not given is zero.

Examples:
  abbe simulate sessions/hermle-c600u/chapter5.toml --out run1 --error EY0A=35.3um \\
      --error EB0A=-1.29arcsec
  abbe simulate sessions/hermle-c600u/chapter5.toml --out run2 --draw-setups --seed 7
  abbe simulate sessions/hermle-c600u/chapter5.toml --out run3 --draw-setups --seed 8

errors.toml holds one value a line, `EY0A = \"35.3 um\"`; names with other than letters and digits stand in quotes.";

/// `abbe simulate SESSION --out DIR`
#[derive(Args)]
pub struct SimulateArguments {
    #[command(flatten)]
    session: SessionArguments,
    /// The folder to write the measured session to.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The value of an error or a set-up quantity; may be repeated.
    #[arg(long = "error", value_name = "NAME=VALUE", allow_hyphen_values = true)]
    errors: Vec<String>,
    /// The value of a coefficient of a declared effect; may be repeated.
    #[arg(long = "effect", value_name = "NAME=VALUE", allow_hyphen_values = true)]
    effects: Vec<String>,
    /// A TOML file of such values.
    #[arg(long = "errors", value_name = "FILE")]
    file: Option<PathBuf>,
    /// Standard deviation of the noise, µm; the session's own if not given.
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    noise_um: Option<f64>,
    /// Draw set-up quantities from what the session says is known of them.
    #[arg(long)]
    draw_setups: bool,
    /// Leave the declared effects out of the session that is written, as if nobody knew of them.
    #[arg(long)]
    hide_effects: bool,
    /// Replace files in a folder that is there.
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
        // The command line has the last word.
        given.retain(|other| other.id != value.id);
        given.push(value);
    }
    if let Some(noise) = arguments.noise_um
        && noise != 0.0
        && !(MIN_UM..=LARGEST).contains(&noise)
    {
        return Err(Failure::Other(format!(
            "--noise-um {noise}: a standard deviation in µm is a number that is not negative: 0, or {MIN_UM:e} to {LARGEST:e}"
        )));
    }
    let simulation = Simulation {
        given,
        noise_mm: arguments.noise_um.map(|noise_um| noise_um * 1e-3),
        draw_setups: arguments.draw_setups,
        seed: arguments.common.seed,
    };
    let simulated = simulate(&session, &simulation)?;
    let files = files((&session, &sources), &simulated, arguments)?;
    if output::is_same(output::folder_of(&sources.file), &arguments.out) {
        return Err(Failure::Other(format!(
            "{}: the plan itself lies there; write its readings to another folder",
            arguments.out.display()
        )));
    }
    output::Outputs::in_folder(&arguments.out, files.iter().map(|(name, _)| name))
        .refuse_overwrite_of_sources(&sources)?;
    folder::write(&arguments.out, &files, arguments.force, |made| {
        // What is left behind has to be a session.
        let path = made.join("session.toml");
        files::session(&path, &files::ReadOptions::default())?;
        Ok(())
    })?;
    report(
        &session,
        &simulated,
        arguments,
        outputs.tables(arguments.common.quiet),
    )
}

/// `session.toml` last: where it is, the rest is.
fn files(
    (session, sources): (&Session, &SourceMap),
    simulated: &Simulated,
    arguments: &SimulateArguments,
) -> Result<Vec<folder::NewFile>, Failure> {
    let file = sources.file.as_path();
    let mut files = Vec::new();
    let mut data: Vec<(String, String)> = Vec::new();
    for (test, readings) in session.tests.iter().zip(&simulated.readings) {
        let name = data_name(&test.name, &data);
        let text = csv::text(&session.machine, &test.station, readings);
        data.push((test.name.clone(), name.clone()));
        files.push((name, text));
    }
    if let Some(machine) = &sources.machine_text {
        files.push(("machine.toml".into(), machine.clone()));
    }
    let mut text = write::with_data(&sources.text, file, &data)?;
    text = rewrite::with_machine_file(&text, file, "machine.toml")?;
    if let Some(noise_um) = arguments.noise_um {
        text = rewrite::with_noise(&text, file, noise_um)?;
    }
    // The tables written here have our columns, whatever those of the original had.
    text = rewrite::without_tables(&text, &["format", "columns"]);
    if arguments.hide_effects {
        text = rewrite::without_tables(&text, &["effect"]);
    }
    files.push(("session.toml".into(), text));
    Ok(files)
}

/// A file name for a test that no system stumbles over and no other test has.
fn data_name(test: &str, taken: &[(String, String)]) -> String {
    let plain: String = test
        .chars()
        .map(|c| {
            if c.is_alphanumeric() || matches!(c, '-' | '_' | '.') {
                c
            } else {
                '-'
            }
        })
        .collect();
    let plain = plain.trim_start_matches('.');
    let mut name = format!("{plain}.csv");
    let mut number = 2;
    while taken.iter().any(|(_, other)| other.eq_ignore_ascii_case(&name)) {
        name = format!("{plain}-{number}.csv");
        number += 1;
    }
    name
}

/// What `abbe simulate` reports as JSON.
#[derive(Serialize, JsonSchema)]
pub struct Report {
    session: String,
    readings: usize,
    noise_um: f64,
    resolution_um: Option<f64>,
    seed: u64,
    truth: Vec<Value>,
    warnings: Vec<String>,
}

/// A value that was put into the model.
#[derive(Serialize, JsonSchema)]
struct Value {
    id: String,
    value: f64,
    unit: String,
}

fn report(
    session: &Session,
    simulated: &Simulated,
    arguments: &SimulateArguments,
    tables: bool,
) -> Result<(), Failure> {
    let report = Report {
        session: arguments.out.join("session.toml").display().to_string(),
        readings: simulated.readings.iter().map(|readings| readings.rows()).sum(),
        noise_um: simulated.noise_mm * 1e3,
        resolution_um: session.resolution_mm.map(|step| step * 1e3),
        seed: arguments.common.seed,
        truth: simulated
            .truth
            .iter()
            .map(|(id, value, unit)| Value {
                id: id.clone(),
                value: *value,
                unit: unit.clone(),
            })
            .collect(),
        warnings: simulated.warnings.clone(),
    };
    if tables {
        print(session, &report);
    }
    fit::print_warnings(&report.warnings);
    if let Some(path) = &arguments.common.json {
        output::write_json(path, &report)?;
    }
    Ok(())
}

fn print(session: &Session, report: &Report) {
    say!(
        "{}: {} of {}, noise {}, seed {}",
        report.session,
        counted(report.readings, "reading"),
        counted(session.tests.len(), "test"),
        table::micrometres(report.noise_um),
        report.seed
    );
    let rows: Vec<Vec<String>> = report
        .truth
        .iter()
        .map(|value| {
            vec![
                value.id.clone(),
                format!("{:.4}", value.value),
                value.unit.clone(),
            ]
        })
        .collect();
    if rows.is_empty() {
        say!("no error: the nominal machine");
    } else {
        say!("");
        table::print(&["given", "value", "unit"], &rows);
    }
}
