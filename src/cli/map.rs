//! `abbe volumetric --map`: the volumetric error over a grid, and its compensation.

use std::path::PathBuf;

use abbe::identify::volumetric::{self, MachineWithErrors, Summary, functions};
use abbe::model::axis::AxisKind;
use abbe::model::chain::Machine;
use abbe::model::files::{self, Source};
use abbe::model::words::counted;
use clap::Args;

use super::failure::Failure;
use super::json::{self, Origin};
use super::{output, values};
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
    map: Option<PathBuf>,
    /// The errors as functions of the axes: a TOML file of constants, tables, polynomials and harmonics.
    #[arg(long, value_name = "FILE", requires = "map")]
    functions: Option<PathBuf>,
    /// Places along each axis that moves.
    #[arg(long, value_name = "N", requires = "map", default_value_t = 5)]
    places: usize,
    /// Where an axis stands in the map, or its own number of places: `A=30` (mm or degrees), `X:11`; may be repeated.
    #[arg(long = "axis", value_name = "AXIS=AT|AXIS:N", requires = "map", allow_hyphen_values = true)]
    axes: Vec<String>,
    /// The tool point in the tool frame.
    #[arg(long, value_name = "X,Y,Z", requires = "map", value_delimiter = ',', allow_hyphen_values = true)]
    tool_mm: Vec<f64>,
    /// Add the commands of the linear axes that cancel the error, and what they leave.
    #[arg(long, requires = "map")]
    compensate: bool,
    /// Write the summary of the map as JSON.
    #[arg(long, value_name = "FILE", requires = "map")]
    json: Option<PathBuf>,
}

impl MapArguments {
    /// The files that are written.
    pub fn outputs(&self) -> impl Iterator<Item = &PathBuf> {
        self.map.iter().chain(&self.json)
    }

    /// The file of the errors.
    pub fn functions(&self) -> Option<&PathBuf> {
        self.functions.as_ref()
    }

    /// Whether a map is asked for.
    pub fn wanted(&self) -> bool {
        self.map.is_some()
    }
}

/// Runs `abbe volumetric --map`.
pub fn run(machine_file: &Source, machine: &Machine, arguments: &MapArguments, tables: bool) -> Result<(), Failure> {
    let (Some(path), Some(file)) = (&arguments.map, &arguments.functions) else {
        return Err(Failure::Other("--map and --functions go together".into()));
    };
    let source = files::text(file, "the file of error functions")?;
    let functions = functions::of_source(&source, machine)?;
    let tool_mm = values::point_mm("--tool-mm", &arguments.tool_mm, [0.0; 3])?;
    let grid = grid(machine, arguments)?;
    let erring = MachineWithErrors { machine, functions: &functions, tool_mm };
    let (places, summary) = volumetric::map(&erring, &grid, arguments.compensate)?;
    output::write_whole(path, &output::csv(&present::places(machine, &places))?)?;
    if tables {
        print(&summary, functions.len(), &path.display().to_string());
    }
    if let Some(path) = &arguments.json {
        let read = machine_file.stamp.iter().chain(&source.stamp);
        json::write(path, Origin::of_files(read), None, &summary)?;
    }
    Ok(())
}

/// Positions of each axis, mm or rad.
fn grid(machine: &Machine, arguments: &MapArguments) -> Result<Vec<Vec<f64>>, Failure> {
    if arguments.places > volumetric::MAX_POINTS {
        return Err(Failure::Other(format!(
            "--places {}: a map has at most {} places",
            arguments.places,
            volumetric::MAX_POINTS
        )));
    }
    let mut wanted: Vec<Option<(char, f64)>> = vec![None; machine.axes.len()];
    for text in &arguments.axes {
        let fault = || {
            Failure::Other(format!(
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
            return Err(Failure::Other(format!("--axis {text}: {} places are the most", volumetric::MAX_POINTS)));
        }
        let Some(axis) = machine.axis_index(name.trim()) else {
            let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            return Err(Failure::Other(format!(
                "--axis {text}: the machine has no axis `{}`; its axes are {}",
                name.trim(),
                names.join(", ")
            )));
        };
        wanted[axis] = Some((sign, number));
    }
    let along = |axis: usize| -> Result<Vec<f64>, Failure> {
        let body = &machine.axes[axis];
        let inside = |q: f64| match body.kind {
            AxisKind::Linear => q,
            AxisKind::Rotary => q.to_radians(),
        };
        let count = match wanted[axis] {
            Some(('=', at)) => return Ok(vec![inside(at)]),
            Some((_, count)) => count as usize,
            None => arguments.places,
        };
        let [least, greatest] = match (body.travel, body.kind) {
            (Some(travel), _) => travel,
            (None, AxisKind::Rotary) => [-std::f64::consts::PI, std::f64::consts::PI],
            (None, AxisKind::Linear) => {
                return Err(Failure::Other(format!(
                    "axis `{}` states no travel: add `travel_mm` to the machine, or `--axis {}=0`",
                    body.name, body.name
                )));
            }
        };
        Ok(match count {
            0 => return Err(Failure::Other("--places 0: a map has at least one place".into())),
            1 => vec![0.5 * (least + greatest)],
            _ => (0..count).map(|k| least + (greatest - least) * k as f64 / (count - 1) as f64).collect(),
        })
    };
    (0..machine.axes.len()).map(along).collect()
}

fn print(summary: &Summary, functions: usize, path: &str) {
    say!("{path}: {}, {}", counted(summary.points, "place"), counted(functions, "error function"));
    let at: Vec<String> = summary.largest_at.iter().map(|at| format!("{} {:.1}", at.axis, at.position)).collect();
    say!("largest at {}\n", at.join(", "));
    output::print(&present::sizes(summary));
}
