//! `abbe volumetric`: the closed form of the error vector of the tool point, or its map.

use std::path::PathBuf;

use abbe::apply::volumetric::{self, MachineWithErrors, functions};
use abbe::codegen::{Equation, ToolPoint};
use abbe::equation::EquationParameters;
use abbe::files::{self, Source};
use abbe::model::axis::AxisKind;
use abbe::model::chain::Machine;
use abbe::model::{Diagnostic, pattern};
use clap::Args;

use super::Global;
use super::equation::FormArguments;
use super::output::{self, Outputs};
use super::results::{OutputArguments, Read};
use super::values;
use crate::report::volumetric as present;

/// Examples of `abbe volumetric`.
pub const HELP: &str = include_str!("help/volumetric.txt");

/// `abbe volumetric MACHINE`
#[derive(Args)]
pub struct VolumetricArguments {
    /// The machine file.
    machine: PathBuf,
    #[command(flatten)]
    form: FormArguments,
    #[command(flatten)]
    map: MapArguments,
}

/// Runs `abbe volumetric`.
pub fn run(arguments: &VolumetricArguments, _: Global) -> Result<(), Diagnostic> {
    let source = files::text(&arguments.machine, "the machine file")?;
    let machine = files::machine_of(&source)?;
    let outputs = arguments.map.output.prepared(&[arguments.form.out.as_ref(), arguments.map.map.as_ref()])?;
    let read = std::iter::once(&arguments.machine).chain(&arguments.map.functions);
    outputs.refuse_overwrite(read.map(PathBuf::as_path))?;
    if arguments.map.map.is_some() {
        return write_map(&source, &machine, &arguments.map, &outputs);
    }
    let form = &arguments.form;
    let mut parameters = EquationParameters::parse(&form.errors, &machine, &[], &[])?;
    if form.errors.is_empty() {
        parameters.errors = pattern::errors(&machine);
    }
    let equation = Equation::volumetric(&machine, &parameters.errors, &form.options(&parameters))?;
    form.write(&equation, &ToolPoint)
}

/// A map of the volumetric error.
#[derive(Args)]
struct MapArguments {
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
fn write_map(
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
    let grid = grid(machine, arguments.places, &arguments.axes)?;
    let erring = MachineWithErrors { machine, functions: &functions, tool_mm };
    let (places, summary) = volumetric::map(&erring, &grid, arguments.correction)?;
    output::write_whole(path, &output::csv(&present::places(machine, &places))?)?;
    let report = present::report(machine, path, &summary, functions.len());
    arguments.output.put(outputs, &report, &summary, &Read::files(machine_file.stamp.iter().chain(&source.stamp)))
}

/// Positions of each axis, mm or rad.
pub fn grid(machine: &Machine, places: usize, axes: &[String]) -> Result<Vec<Vec<f64>>, Diagnostic> {
    values::count("--places", "places", places, volumetric::MAX_POINTS)?;
    let mut wanted: Vec<Option<(char, f64)>> = vec![None; machine.axes.len()];
    for text in axes {
        let fault = || {
            Diagnostic::other(format!(
                "--axis {text}: write where the axis stands, `A=30`, or its number of places, `X:11`"
            ))
        };
        let sign = if text.contains('=') { '=' } else { ':' };
        let (name, number) = text.split_once(sign).ok_or_else(fault)?;
        let number: f64 = number.trim().parse().map_err(|_| fault())?;
        if number.is_nan() || (sign == ':' && (number < 1.0 || number.fract() != 0.0)) {
            return Err(fault());
        }
        if sign == '=' {
            values::POSITION.check(&format!("--axis {}=", name.trim()), number)?;
        } else if number > volumetric::MAX_POINTS as f64 {
            return Err(Diagnostic::other(format!("--axis {text}: {} places are the most", volumetric::MAX_POINTS)));
        }
        let Some(axis) = machine.axis_index(name.trim()) else {
            let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            return Err(Diagnostic::other(format!(
                "--axis {text}: the machine has no axis `{}`; its axes are {}",
                name.trim(),
                names.join(", ")
            )));
        };
        wanted[axis] = Some((sign, number));
    }
    let along = |axis: usize| -> Result<Vec<f64>, Diagnostic> {
        let body = &machine.axes[axis];
        let count = match wanted[axis] {
            Some(('=', at)) => return Ok(vec![body.kind.to_internal(at)]),
            Some((_, count)) => count as usize,
            None => places,
        };
        let [least, greatest] = match (body.travel, body.kind) {
            (Some(travel), _) => travel,
            (None, AxisKind::Rotary) => [-std::f64::consts::PI, std::f64::consts::PI],
            (None, AxisKind::Linear) => {
                return Err(Diagnostic::other(format!(
                    "axis `{}` states no travel: add `travel_mm` to the machine, or `--axis {}=0`",
                    body.name, body.name
                )));
            }
        };
        Ok(match count {
            1 => vec![0.5 * (least + greatest)],
            _ => (0..count).map(|k| least + (greatest - least) * k as f64 / (count - 1) as f64).collect(),
        })
    };
    (0..machine.axes.len()).map(along).collect()
}
