//! `abbe export`: the calibrated machine for other programs and for controls.

use std::path::PathBuf;

use abbe::apply::export::kinematics::ENTRIES;
use abbe::apply::export::travel::Travel;
use abbe::exports::{self, Contents, ExportOptions};
use abbe::files;
use abbe::files::robot::dh::Convention;
use abbe::identify::model_file::{self, IdentifiedModel};
use abbe::model::Diagnostic;
use abbe::model::words::cut;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};

use super::failure::command_line;
use super::results::{OutputArguments, Read};
use super::{Global, folder, output, values};
use crate::report::export as present;

/// Examples of `abbe export`.
pub const HELP: &str = include_str!("help/export.txt");

fn formats() -> PossibleValuesParser {
    let formats = exports::formats().into_iter();
    PossibleValuesParser::new(formats.map(|format| PossibleValue::new(format.word).help(format.about)))
}

fn entries() -> PossibleValuesParser {
    PossibleValuesParser::new(ENTRIES.iter().map(|(_, word, about)| PossibleValue::new(*word).help(*about)))
}

/// `abbe export MODEL --as FORMAT --out FILE`
#[derive(Args)]
pub struct ExportArguments {
    /// The identified model: `abbe fit --save` or `abbe trace --save`.
    model: PathBuf,
    /// The format of the output.
    ///
    /// Example: --as urdf
    #[arg(long = "as", value_parser = formats(), value_name = "FORMAT")]
    format: String,
    /// Where the result is written: a file, `-` for standard output; for tables a new folder.
    ///
    /// Example: --out robot.urdf
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The tool point in the tool frame [default: the instrument's point in the model].
    ///
    /// Example: --tool-mm 0,0,120
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_hyphen_values = true)]
    tool_mm: Vec<f64>,
    /// Which entries of linuxcnc and fanuc are written.
    #[arg(long, value_parser = entries(), value_name = "ENTRIES", default_value = "best")]
    entries: String,
    /// Travel of an axis over which the error of the entries counts, mm or degrees [default: the measured range].
    ///
    /// Example: --travel A=-30..110 --travel C=-180..180
    #[arg(long, value_name = "AXIS=FROM..TO", allow_hyphen_values = true)]
    travel: Vec<String>,
    /// With urdf: the URDF file of the robot. The origins of its joints are changed and nothing else.
    ///
    /// Example: --as urdf --patch robot.urdf
    #[arg(long, value_name = "FILE")]
    patch: Option<PathBuf>,
    /// The link at which the chain of the URDF ends [default: the end of the arm].
    ///
    /// Example: --as urdf --patch robot.urdf --tip tool0
    #[arg(long, value_name = "LINK", requires = "patch", allow_hyphen_values = true)]
    tip: Option<String>,
    /// The convention of Denavit-Hartenberg parameters: standard is Rz(θ)·Tz(d)·Tx(a)·Rx(α), modified is
    /// Tx(a)·Rx(α)·Rz(θ)·Tz(d).
    ///
    /// Example: --as dh --convention standard
    #[arg(long, value_parser = values::words(&Convention::WORDS), default_value = "modified")]
    convention: Convention,
    /// With dh: the maker's table (CSV, as for `abbe new --from-dh`). The calibrated frames are the nearest to its own.
    ///
    /// Example: --as dh --convention standard --dh robot.csv
    #[arg(long, value_name = "FILE")]
    dh: Option<PathBuf>,
    /// Number of places along each axis: here of a compensation table, over the range in which the axis moved while the
    /// readings observed the error [default: 37].
    ///
    /// Example: --as heidenhain-tables --places 73
    #[arg(long, value_name = "N")]
    places: Option<usize>,
    /// Position of an axis, mm or degrees, at which entries are 0 [default: the first of a table without position 0].
    ///
    /// Example: --as linuxcnc-tables --reference X=-400
    #[arg(long, value_name = "AXIS=POSITION", allow_hyphen_values = true)]
    reference: Vec<String>,
    #[command(flatten)]
    output: OutputArguments,
}

/// Runs `abbe export`.
pub fn run(arguments: &ExportArguments, _: Global) -> Result<(), Diagnostic> {
    let format = exports::format(&arguments.format)?;
    let outputs = arguments.output.prepared(&[Some(&arguments.out).filter(|_| !format.is_of_tables())])?;
    outputs.refuse_overwrite([arguments.model.as_path()])?;
    let source = files::text(&arguments.model, "the model file")?;
    let model = model_file::of_source(&source)?;
    outputs.refuse_overwrite(arguments.patch.iter().chain(&arguments.dh).map(PathBuf::as_path))?;
    let options = arguments.options(&model)?;
    if let Some((option, owners)) = format.ignored(&options) {
        let owners: Vec<String> = owners.iter().map(|word| format!("`--as {word}`")).collect();
        return Err(command_line(format!("`--{option}` belongs to {}", owners.join(" and "))));
    }
    let exported = format.export(&model, &options)?;
    let mut written = vec![arguments.out.clone()];
    match &exported.contents {
        Contents::File(text) => output::write_whole(&arguments.out, text)?,
        Contents::Folder(files) => {
            folder::write(&arguments.out, files, arguments.output.folder.force, |_| Ok(()))?;
            written = files.iter().map(|(name, _)| arguments.out.join(name)).collect();
        }
    }
    let report = present::report(&model.machine.name, &written, exported.table, &exported.result);
    arguments.output.put(&outputs, &report, &exported.result, &Read::files(&source.stamp))
}

impl ExportArguments {
    /// The options for a model; the files that they name are read.
    pub fn options(&self, model: &IdentifiedModel) -> Result<ExportOptions, Diagnostic> {
        let patch = self.patch.as_ref().map(|file| files::foreign_text(file, "the URDF file")).transpose()?;
        let dh = self.dh.as_ref().map(|file| files::foreign_text(file, "the table")).transpose()?;
        Ok(ExportOptions {
            convention: self.convention,
            dh,
            patch: patch.map(|source| (source, self.tip.clone())),
            tool_mm: values::point_mm("--tool-mm", &self.tool_mm, model.tool_mm)?,
            entries: exports::entries(&self.entries)?,
            travel: travel(&self.travel, model)?,
            places: self.places,
            references: self.reference.iter().map(|option| reference(option)).collect::<Result<_, _>>()?,
        })
    }
}

/// The travel of each axis over which the entries of a control count: the measured range, or that of an option
/// `AXIS=FROM..TO`.
fn travel(options: &[String], model: &IdentifiedModel) -> Result<Travel, Diagnostic> {
    options.iter().try_fold(Travel::measured(model), |travel, option| {
        let refused = |why: String| {
            command_line(format!(
                "`--travel {}`: {why}; AXIS=FROM..TO is expected, as A=-30..110, in mm or degrees",
                cut(option, 80)
            ))
        };
        let (name, range) = option.split_once('=').ok_or_else(|| refused("no `=`".into()))?;
        let (from, to) = range.split_once("..").ok_or_else(|| refused("no `..`".into()))?;
        let number = |text: &str| text.trim().parse::<f64>().ok();
        let (from, to) = number(from).zip(number(to)).ok_or_else(|| refused("no two numbers".into()))?;
        values::POSITION.all(&format!("--travel {}=", cut(name.trim(), 80)), &[from, to])?;
        travel.with(model, name.trim(), [from, to]).map_err(|error| refused(error.to_string()))
    })
}

/// The axis and the position of an option `AXIS=POSITION`.
fn reference(option: &str) -> Result<(String, f64), Diagnostic> {
    let place = option.split_once('=').and_then(|(name, place)| Some((name.trim(), place.trim().parse().ok()?)));
    let (name, place) = place.ok_or_else(|| {
        let found = cut(option, 80);
        command_line(format!("`--reference {found}`: AXIS=POSITION is expected, as X=-400, in mm or degrees"))
    })?;
    values::POSITION.check(&format!("--reference {}=", cut(name, 80)), place)?;
    Ok((name.to_string(), place))
}
