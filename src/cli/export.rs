//! `abbe export`: the calibrated machine for other programs and for controls.

use std::path::PathBuf;

use abbe::identify::compensation::{self, Compensation, Control};
use abbe::identify::export::control::{self, EntryChoice, KinematicTable, NOT_DOCUMENTED};
use abbe::identify::export::dh::{self, DhTable};
use abbe::identify::export::travel::Travel;
use abbe::identify::export::{left_out, urdf};
use abbe::identify::model_file::{self, IdentifiedModel};
use abbe::identify::parameters::Role;
use abbe::model::component::{ErrorKind, ErrorName};
use abbe::model::files;
use abbe::model::words::cut;
use clap::{Args, ValueEnum};
use schemars::JsonSchema;
use serde::Serialize;

use super::failure::Failure;
use super::json::{self, Origin};
use super::output::{self, Outputs};
use super::values;
use crate::report::export as present;

/// Examples of `abbe export`.
pub const HELP: &str = "urdf writes the calibrated chain (ROS, lengths in m); dh writes Denavit-Hartenberg parameters of a robot in the modified form of Craig, \
with Hayati's angle for parallel axes. linuxcnc and fanuc write the change of each kinematic parameter of the control: what is added to the \
present entry, with its standard uncertainty. The entries make the rms of the volumetric error over the travel least: the measured range of \
each axis, or that of --travel. --entries plain writes the displacements of the axis lines themselves. The file states what remains. beckhoff writes location errors in the ISG CSV format. The source of each control's model \
stands in the table. For siemens and heidenhain the public manuals leave the signs open: nothing is written.

A fixed geometry holds location errors only. Effects are listed as left out.

Examples:
  abbe fit run1/session.toml --save model.json
  abbe export model.json --as urdf --out machine.urdf --tool-mm 0,0,-120
  abbe export model.json --as linuxcnc --out kinematics.csv --json kinematics.json
  abbe export model.json --as fanuc --out kinematics.csv --travel A=-30..110 --travel C=-180..180";

/// What is written.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// URDF of the calibrated chain
    Urdf,
    /// Denavit-Hartenberg parameters, calibrated and nominal
    Dh,
    /// LinuxCNC, xyzac-trt-kins and xyzbc-trt-kins
    Linuxcnc,
    /// Fanuc 30i, table rotation type
    Fanuc,
    /// Beckhoff TF5280, location errors
    Beckhoff,
    /// SINUMERIK 840D
    Siemens,
    /// Heidenhain TNC
    Heidenhain,
}

impl Format {
    /// The word of a control.
    fn control(self) -> &'static str {
        match self {
            Format::Linuxcnc => "linuxcnc",
            Format::Fanuc => "fanuc",
            Format::Siemens => NOT_DOCUMENTED[0].0,
            Format::Heidenhain => NOT_DOCUMENTED[1].0,
            Format::Beckhoff => "beckhoff",
            Format::Urdf | Format::Dh => "",
        }
    }
}

/// Entries of a control.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Entries {
    /// Those that leave the least volumetric error over the travel
    Best,
    /// The displacements of the axis lines themselves
    Plain,
}

impl Entries {
    fn choice(self) -> EntryChoice {
        match self {
            Entries::Best => EntryChoice::Best,
            Entries::Plain => EntryChoice::Plain,
        }
    }
}

/// `abbe export MODEL --as FORMAT --out FILE`
#[derive(Args)]
pub struct ExportArguments {
    /// The identified model: `abbe fit --save` or `abbe trace --save`.
    model: PathBuf,
    /// What is written.
    ///
    /// Example: --as urdf
    #[arg(long = "as", value_enum, value_name = "FORMAT")]
    format: Format,
    /// Where it is written; `-` is standard output.
    ///
    /// Example: --out robot.urdf
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The tool point in the tool frame, for urdf, dh and controls [default: the instrument's point in the model].
    ///
    /// Example: --tool-mm 0,0,120
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_hyphen_values = true)]
    tool_mm: Vec<f64>,
    /// Which entries of linuxcnc and fanuc are written.
    #[arg(long, value_enum, value_name = "ENTRIES", default_value = "best")]
    entries: Entries,
    /// Travel of an axis over which the error of the entries counts, mm or degrees [default: the measured range].
    ///
    /// Example: --travel A=-30..110 --travel C=-180..180
    #[arg(long, value_name = "AXIS=FROM..TO", allow_hyphen_values = true)]
    travel: Vec<String>,
    /// Write the same as JSON (dh and controls).
    ///
    /// Example: --json kinematics.json
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// The result of `abbe export` in JSON.
#[derive(Serialize, JsonSchema)]
pub struct ExportResult {
    /// Denavit-Hartenberg parameters with the identified location errors.
    #[serde(skip_serializing_if = "Option::is_none")]
    calibrated: Option<DhTable>,
    /// Those of the machine without errors.
    #[serde(skip_serializing_if = "Option::is_none")]
    nominal: Option<DhTable>,
    /// Changes of a control's kinematic parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    kinematics: Option<KinematicTable>,
    /// Effects and errors that a fixed geometry does not hold.
    left_out: Vec<String>,
}

/// Runs `abbe export`.
pub fn run(arguments: &ExportArguments, quiet: bool) -> Result<(), Failure> {
    let outputs = Outputs::new(std::iter::once(&arguments.out).chain(&arguments.json))?;
    outputs.refuse_overwrite([arguments.model.as_path()])?;
    let source = files::text(&arguments.model, "the model file")?;
    let model = model_file::read_text(&source.file, &source.text)?;
    let tool_mm = values::point_mm("--tool-mm", &arguments.tool_mm, model.tool_mm)?;
    if !matches!(arguments.format, Format::Linuxcnc | Format::Fanuc) {
        let other = [(arguments.entries == Entries::Plain, "--entries"), (!arguments.travel.is_empty(), "--travel")];
        if let Some((_, option)) = other.iter().find(|(is_given, _)| *is_given) {
            return Err(Failure::CommandLine(format!("`{option}` belongs to `--as linuxcnc` and `--as fanuc`")));
        }
    }
    let mut result = ExportResult { calibrated: None, nominal: None, kinematics: None, left_out: left_out(&model) };
    let (text, tables) = match arguments.format {
        Format::Urdf => (urdf::urdf(&model, tool_mm)?.into_bytes(), Vec::new()),
        Format::Dh => {
            let [calibrated, nominal] = dh::tables(&model, tool_mm)?;
            let table = present::dh(&calibrated, &nominal);
            (result.calibrated, result.nominal) = (Some(calibrated), Some(nominal));
            ([present::dh_header(&table).into_bytes(), output::csv(&table)?].concat(), vec![table])
        }
        Format::Beckhoff => {
            let (text, missing) = beckhoff(&model)?;
            result.left_out = missing;
            (text, Vec::new())
        }
        control => {
            let travel = travel(&arguments.travel, &model)?;
            let table = control::table(&model, control.control(), arguments.entries.choice(), &travel, tool_mm)?;
            result.left_out.clone_from(&table.left_out);
            let printed = present::kinematics(&table);
            let text = [present::kinematics_header(&table).into_bytes(), output::csv(&printed)?].concat();
            result.kinematics = Some(table);
            (text, vec![printed])
        }
    };
    output::write_whole(&arguments.out, &text)?;
    if outputs.tables(quiet) {
        say!("{}: written", arguments.out.display());
        tables.iter().for_each(output::print);
        for missing in &result.left_out {
            say!("left out: {missing}");
        }
    }
    match &arguments.json {
        Some(path) => json::write(path, Origin::of_files(&source.stamp), None, &result),
        None => Ok(()),
    }
}

/// The travel of each axis: the measured range, or that of an option `AXIS=FROM..TO`.
fn travel(options: &[String], model: &IdentifiedModel) -> Result<Travel, Failure> {
    let mut travel = Travel::measured(model);
    for option in options {
        let refused = |why: &str| {
            let axes: Vec<&str> = model.machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            Failure::CommandLine(format!(
                "`--travel {}`: {why}; AXIS=FROM..TO is expected, as A=-30..110, in mm or degrees, with an axis of {}",
                cut(option, 80),
                axes.join(", ")
            ))
        };
        let (name, range) = option.split_once('=').ok_or_else(|| refused("no `=`"))?;
        let (from, to) = range.split_once("..").ok_or_else(|| refused("no `..`"))?;
        let axis = model.machine.axis_index(name.trim()).ok_or_else(|| refused("no such axis"))?;
        let number = |text: &str| text.trim().parse::<f64>().ok();
        let (from, to) = number(from).zip(number(to)).ok_or_else(|| refused("no two numbers"))?;
        values::POSITION.all(&format!("--travel {}=", model.machine.axes[axis].name), &[from, to])?;
        if from >= to {
            return Err(refused("the first number is not below the second"));
        }
        let kind = model.machine.axes[axis].kind;
        travel.ranges[axis] = [from, to].map(|value| kind.to_internal(value));
        travel.is_measured = false;
    }
    Ok(travel)
}

/// The location errors in the format of the control, and what it does not hold.
fn beckhoff(model: &IdentifiedModel) -> Result<(Vec<u8>, Vec<String>), Failure> {
    let errors = model.parameters.iter().enumerate().filter(|(_, parameter)| parameter.role == Role::Error);
    let named = errors
        .filter(|(index, _)| model.is_estimated(*index))
        .filter_map(|(_, parameter)| Some((ErrorName::parse(&parameter.id)?, parameter.value)));
    let locations = named.filter(|(name, _)| name.kind == ErrorKind::Location).collect();
    let compensation = Compensation { locations, left_out: left_out(model), ..Compensation::default() };
    let control: Option<&Control> =
        compensation::CONTROLS.iter().find(|control| control.word == Format::Beckhoff.control());
    let Some(control) = control else {
        return Err(Failure::Other("the format of Beckhoff is not in the registry".into()));
    };
    let tables = compensation::tables(&model.machine, &compensation, control, compensation::MAX_POINTS);
    match tables.files.into_iter().next() {
        Some((_, text)) => Ok((text.into_bytes(), tables.left_out)),
        None => Err(Failure::Other("the model has no location error that the format holds".into())),
    }
}
