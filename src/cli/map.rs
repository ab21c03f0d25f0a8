//! `abbe volumetric --map`: the volumetric error over a grid, and its compensation.

mod grid;

use std::path::PathBuf;

use abbe::apply::volumetric::{self, MachineWithErrors, functions};
use abbe::files::{self, Source};
use abbe::model::Diagnostic;
use abbe::model::chain::Machine;
use clap::Args;

use super::output::{self, Outputs};
use super::results::{OutputArguments, Read};
use super::values;
use crate::report::volumetric as present;

/// A map of the volumetric error.
#[derive(Args)]
pub struct MapArguments {
    /// Write the error vector over the workspace to a CSV file instead of printing the closed form.
    #[arg(
        long,
        value_name = "FILE.csv",
        requires = "functions",
        conflicts_with_all = ["language", "order", "rotation", "errors", "notation", "gradient", "out"]
    )]
    pub map: Option<PathBuf>,
    /// The errors as functions of the axes: a TOML file of constants, tables, polynomials and harmonics.
    #[arg(long, value_name = "FILE", requires = "map")]
    pub functions: Option<PathBuf>,
    /// Number of places along each axis: here of each that moves.
    #[arg(long, value_name = "N", requires = "map", default_value_t = 5)]
    places: usize,
    /// Where an axis stands in the map, or its own number of places: `A=30` (mm or degrees), `X:11`; may be repeated.
    #[arg(long = "axis", value_name = "AXIS=AT|AXIS:N", requires = "map", allow_hyphen_values = true)]
    axes: Vec<String>,
    /// The tool point in the tool frame [default: 0,0,0].
    #[arg(long, value_name = "X,Y,Z", requires = "map", value_delimiter = ',', allow_hyphen_values = true)]
    tool_mm: Vec<f64>,
    /// Add the commands of the linear axes that cancel the error, and what they leave.
    #[arg(long, requires = "map")]
    correction: bool,
    #[command(flatten)]
    pub output: OutputArguments,
}

/// Runs `abbe volumetric --map`.
pub fn run(
    machine_file: &Source,
    machine: &Machine,
    arguments: &MapArguments,
    outputs: &Outputs,
) -> Result<(), Diagnostic> {
    let (Some(path), Some(file)) = (&arguments.map, &arguments.functions) else {
        return Err(Diagnostic::other("--map and --functions go together"));
    };
    let source = files::text(file, "the file of error functions")?;
    let functions = functions::of_source(&source, machine)?;
    let tool_mm = values::point_mm("--tool-mm", &arguments.tool_mm, [0.0; 3])?;
    let grid = grid::grid(machine, arguments.places, &arguments.axes)?;
    let erring = MachineWithErrors { machine, functions: &functions, tool_mm };
    let (places, summary) = volumetric::map(&erring, &grid, arguments.correction)?;
    output::write_whole(path, &output::csv(&present::places(machine, &places))?)?;
    let report = present::report(machine, path, &summary, functions.len());
    arguments.output.put(outputs, &report, &summary, &Read::files(machine_file.stamp.iter().chain(&source.stamp)))
}
