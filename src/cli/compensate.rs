//! `abbe compensate`: commands that cancel the errors of an identified model.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use abbe::apply::correction::Correction;
use abbe::apply::correction::stream::{self, Output, Summary};
use abbe::files::{self, commands::CommandFile};
use abbe::identify::model_file;
use abbe::identify::model_file::errors::EstimatedErrors;
use abbe::model::Diagnostic;
use abbe::model::pose::Aim;
use clap::Args;

use super::failure::{stopped, unwritable};
use super::interrupt::Interrupts;
use super::results::{OutputArguments, Read};
use super::{Global, output, values};
use crate::report::compensate as present;

/// Examples of `abbe compensate`.
pub const HELP: &str = include_str!("help/compensate.txt");

/// `abbe compensate MODEL FILE --out FILE`
#[derive(Args)]
pub struct CompensateArguments {
    /// The identified model: `abbe fit --save` or `abbe trace --save`.
    model: PathBuf,
    /// The commanded positions.
    commands: PathBuf,
    /// Where the result is written: the corrected commands; `-` is standard output.
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
    /// Position of an axis without a column, mm or degrees [default: 0]; may be repeated. Of poses: the positions from which
    /// the first row is reached, and with them the branch of the joints.
    ///
    /// Example: --at A=30
    #[arg(long = "at", value_name = "AXIS=POSITION", allow_hyphen_values = true)]
    at: Vec<String>,
    #[command(flatten)]
    output: OutputArguments,
}

/// Runs `abbe compensate`.
pub fn run(arguments: &CompensateArguments, _: Global) -> Result<(), Diagnostic> {
    let outputs = arguments.output.prepared(&[Some(&arguments.out)])?;
    outputs.refuse_overwrite([arguments.model.as_path(), arguments.commands.as_path()])?;
    let source = files::text(&arguments.model, "the model file")?;
    let model = model_file::of_source(&source)?;
    let machine = &model.machine;
    let tool_mm = values::point_mm("--tool-mm", &arguments.tool_mm, model.tool_mm)?;
    let at = values::positions(machine, &arguments.at)?;
    let mut file = CommandFile::open(&arguments.commands, machine, at.clone())?;
    let columns = file.axis_columns();
    for text in &arguments.at {
        let name = text.split('=').next().unwrap_or_default().trim();
        if machine.axis_index(name).is_some_and(|axis| columns.contains(&Some(axis))) {
            return Err(Diagnostic::other(format!(
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
        to.flush().map_err(|source| unwritable(&arguments.out, source))
    });
    if interrupts.came() && written.is_err() {
        return Err(stopped("interrupted; nothing is written"));
    }
    written?;
    let of_model = arguments.tool_mm.is_empty();
    let mut warnings: Vec<String> = present::fitted_tool(&model).filter(|_| of_model).into_iter().collect();
    warnings.extend(file.warning().map(str::to_string));
    let report = present::report(&arguments.out, &summary, correction.aim, of_model, warnings);
    arguments.output.put(&outputs, &report, &summary, &Read::files(source.stamp.iter().chain([file.stamp()])))
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
