//! `abbe export`: the calibrated machine for other programs and for controls.

mod travel;

use std::path::PathBuf;

use abbe::apply::export::kinematics::ENTRIES;
use abbe::exports::{self, ExportOptions};
use abbe::identify::model_file;
use abbe::model::files;
use abbe::model::files::robot::dh::Convention;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};

use super::failure::Failure;
use super::results::{OutputArguments, Read};
use super::{output, values};
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
    /// What is written.
    ///
    /// Example: --as urdf
    #[arg(long = "as", value_parser = formats(), value_name = "FORMAT")]
    format: String,
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
    /// The link at which the chain of --patch ends [default: the end of the arm].
    ///
    /// Example: --as urdf --patch robot.urdf --tip tool0
    #[arg(long, value_name = "LINK", requires = "patch", allow_hyphen_values = true)]
    tip: Option<String>,
    /// With dh: the convention of the parameters.
    ///
    /// Example: --as dh --convention standard
    #[arg(long, value_parser = values::words(&Convention::WORDS), default_value = "modified")]
    convention: Convention,
    /// With dh: the maker's table (CSV, as for `abbe new --from-dh`). The calibrated frames are the nearest to its own.
    ///
    /// Example: --as dh --convention standard --dh robot.csv
    #[arg(long, value_name = "FILE")]
    dh: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArguments,
}

/// Runs `abbe export`.
pub fn run(arguments: &ExportArguments) -> Result<(), Failure> {
    let outputs = arguments.output.prepared(&[Some(&arguments.out)])?;
    outputs.refuse_overwrite([arguments.model.as_path()])?;
    let source = files::text(&arguments.model, "the model file")?;
    let model = model_file::of_source(&source)?;
    let format = exports::format(&arguments.format)?;
    let patch = arguments.patch.as_ref().map(|file| files::text(file, "the URDF file")).transpose()?;
    outputs.refuse_overwrite(arguments.patch.iter().chain(&arguments.dh).map(PathBuf::as_path))?;
    let dh = arguments.dh.as_ref().map(|file| files::text(file, "the table")).transpose()?;
    let options = ExportOptions {
        convention: arguments.convention,
        dh,
        patch: patch.map(|source| (source, arguments.tip.clone())),
        tool_mm: values::point_mm("--tool-mm", &arguments.tool_mm, model.tool_mm)?,
        entries: exports::entries(&arguments.entries)?,
        travel: travel::stated(&arguments.travel, &model)?,
    };
    if let Some(option) = format.ignored(&options) {
        let owners = match option {
            "patch" => vec!["urdf"],
            "dh" | "convention" => vec!["dh"],
            _ => exports::words_with_entries(),
        };
        let owners: Vec<String> = owners.iter().map(|word| format!("`--as {word}`")).collect();
        return Err(Failure::CommandLine(format!("`--{option}` belongs to {}", owners.join(" and "))));
    }
    let exported = format.export(&model, &options)?;
    output::write_whole(&arguments.out, &exported.text)?;
    let left_out = &exported.result.left_out;
    let report = present::report(&model.machine.name, &arguments.out, exported.table, left_out);
    arguments.output.put(&outputs, &report, &exported.result, &Read::files(&source.stamp))
}
