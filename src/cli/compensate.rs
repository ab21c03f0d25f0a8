//! `abbe compensate`: commands that cancel the errors of an identified model.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use abbe::identify::correction::stream::{self, Output, Summary};
use abbe::identify::correction::{Aim, Correction, EstimatedErrors};
use abbe::identify::model_file;
use abbe::model::chain::Machine;
use abbe::model::files::{self, commands::CommandFile};
use clap::Args;

use super::failure::Failure;
use super::interrupt::Interrupts;
use super::json::{self, Origin};
use super::output::{self, Outputs};
use super::values;
use crate::report::compensate as present;

/// Examples of `abbe compensate`.
pub const HELP: &str = "FILE is a CSV with a header line. Columns such as x_mm, c_deg or J1_rad are axis positions; time_s, run, temperature_c and driver.NAME_unit are \
read where errors depend on them. Instead of axis positions it may state the tool's pose in the table frame: px_mm, py_mm, pz_mm \
with i, j, k (direction of the tool's Z: machines with five axes) or qw, qx, qy, qz (a quaternion: robots). All other columns are kept.

The output has the same rows. Its axis positions are corrected, so that the machine with its errors puts the tool where the machine \
without errors would be at the commanded positions. Machines with five axes correct position and direction of the tool, robots the whole \
pose, other machines the position. The last column of a row states what became of it: corrected, position-only (near a \
singularity), near-singular, beyond-travel, not-correctable, not-reachable, not-a-number. A row that is not corrected keeps its command.

Examples:
  abbe fit run1/session.toml --save model.json
  abbe compensate model.json program.csv --out corrected.csv
  abbe compensate model.json program.csv --out errors.csv --inverse
  abbe compensate model.json poses.csv --out corrected.csv --tool-mm 0,0,-120";

/// `abbe compensate MODEL FILE --out FILE`
#[derive(Args)]
pub struct CompensateArguments {
    /// The identified model: `abbe fit --save` or `abbe trace --save`.
    model: PathBuf,
    /// The commanded positions.
    commands: PathBuf,
    /// Where the corrected commands are written; `-` is standard output.
    ///
    /// Example: --out corrected.csv
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Write the error of the tool's pose at the commands instead of corrected commands.
    #[arg(long)]
    inverse: bool,
    /// The tool point in the tool frame [default: the instrument's point in the model].
    ///
    /// Example: --tool-mm 0,0,-120
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_hyphen_values = true)]
    tool_mm: Vec<f64>,
    /// Position of an axis without a column, mm or degrees [default: 0]; may be repeated.
    ///
    /// Example: --at A=30
    #[arg(long = "at", value_name = "AXIS=POSITION", allow_hyphen_values = true)]
    at: Vec<String>,
    /// Write the summary as JSON.
    ///
    /// Example: --json summary.json
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs `abbe compensate`.
pub fn run(arguments: &CompensateArguments, quiet: bool) -> Result<(), Failure> {
    let outputs = Outputs::new(std::iter::once(&arguments.out).chain(&arguments.json))?;
    outputs.refuse_overwrite([arguments.model.as_path(), arguments.commands.as_path()])?;
    let source = files::text(&arguments.model, "the model file")?;
    let model = model_file::read_text(&source.file, &source.text)?;
    let machine = &model.machine;
    let tool_mm = values::point_mm("--tool-mm", &arguments.tool_mm, model.tool_mm)?;
    let at = positions(machine, &arguments.at)?;
    let mut file = CommandFile::open(&arguments.commands, machine, at.clone())?;
    let columns = file.axis_columns();
    for text in &arguments.at {
        let name = text.split('=').next().unwrap_or_default().trim();
        if machine.axis_index(name).is_some_and(|axis| columns.contains(&Some(axis))) {
            return Err(Failure::Other(format!(
                "--at {text}: the commands have a column for the positions of {name}; remove one of the two"
            )));
        }
    }
    let errors = EstimatedErrors::of_model(&model, tool_mm, model.table_mm);
    let correction = Correction { machine, errors: &errors, tool_mm, aim: Aim::of(machine) };
    let wanted = if arguments.inverse { Output::Error } else { Output::Command };
    let mut summary = Summary::default();
    let interrupts = Interrupts::noticed();
    let written = output::write_streaming(&arguments.out, |to| {
        let mut to = BufWriter::new(UntilInterrupted { to, interrupts: &interrupts });
        summary = stream::run(&correction, &mut file, wanted, &at, &mut to)?;
        to.flush().map_err(|source| Failure::Write { path: arguments.out.display().to_string(), source })
    });
    if interrupts.came() && written.is_err() {
        return Err(Failure::Interrupted("interrupted; nothing is written".into()));
    }
    written?;
    if outputs.tables(quiet) {
        say!("{}: {}", arguments.out.display(), present::headline(&summary, correction.aim));
        output::print(&present::states(&summary));
        if !summary.marked.is_empty() {
            output::print(&present::marked(&summary));
        }
    }
    match &arguments.json {
        Some(path) => {
            let read = source.stamp.iter().chain([file.stamp()]);
            json::write(path, Origin::of_files(read), None, &summary)
        }
        None => Ok(()),
    }
}

/// A writer that fails after Ctrl-C, so that the temporary file behind it is removed.
struct UntilInterrupted<'w> {
    to: &'w mut dyn Write,
    interrupts: &'w Interrupts,
}

impl Write for UntilInterrupted<'_> {
    fn write(&mut self, contents: &[u8]) -> std::io::Result<usize> {
        if self.interrupts.came() {
            return Err(std::io::Error::other("interrupted"));
        }
        self.to.write(contents)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.to.flush()
    }
}

/// The stated positions of axes, zero for the others, mm or rad.
fn positions(machine: &Machine, stated: &[String]) -> Result<Vec<f64>, Failure> {
    let mut at = vec![None; machine.axes.len()];
    for text in stated {
        let fault = || Failure::Other(format!("--at {text}: write an axis and its position in mm or degrees, `A=30`"));
        let (name, number) = text.split_once('=').ok_or_else(fault)?;
        let number: f64 = number.trim().parse().map_err(|_| fault())?;
        values::POSITION.check(&format!("--at {}=", name.trim()), number)?;
        let Some(axis) = machine.axis_index(name.trim()) else {
            let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            let axes = names.join(", ");
            return Err(Failure::Other(format!(
                "--at {text}: the machine has no axis `{}`; its axes are {axes}",
                name.trim()
            )));
        };
        if at[axis].replace(machine.axes[axis].kind.to_internal(number)).is_some() {
            return Err(Failure::Other(format!("--at {text}: the position of {} is stated twice", name.trim())));
        }
    }
    Ok(at.into_iter().map(Option::unwrap_or_default).collect())
}
