//! `abbe validate`: a saved model against readings that it never saw.

use std::path::PathBuf;

use abbe::identify::model_file;
use abbe::identify::validate::{Validation, validate};
use abbe::model::files;
use clap::Args;

use super::failure::Failure;
use super::json::{self, Origin};
use super::message::print_warnings;
use super::report::ReportArguments;
use super::{CommonArguments, SessionArguments, output, read_session};
use crate::report::table::Table;
use crate::report::validate as present;

/// Examples of `abbe validate`.
pub const HELP: &str = "Examples:
  abbe fit run1/session.toml --save model.json
  abbe validate model.json run2/session.toml
  abbe validate model.json run2/session.toml --json validate.json --report validate.html

The model is that of `abbe fit --save` or `abbe trace --save`. Only the set-up of SESSION is estimated: balls, bar, \
pose of the tracker. The verdict is `holds`, `holds-in-range` (inside the range of axes and drivers of the model's data), \
`degraded` (better than the location errors alone, but worse than predicted) or `does-not-hold`.";

/// Rows of a list that the first screen shows.
const MAX_ROWS: usize = 10;

/// `abbe validate MODEL SESSION`
#[derive(Args)]
pub struct ValidateArguments {
    /// The model, a file of `abbe fit --save` or `abbe trace --save`.
    model: PathBuf,
    #[command(flatten)]
    session: SessionArguments,
    #[command(flatten)]
    common: CommonArguments,
    #[command(flatten)]
    report: ReportArguments,
    /// List everything that the first screen folds: the model without each effect, set-up parameters.
    #[arg(long)]
    all: bool,
    /// Write the result as CSV, one row per value.
    ///
    /// Example: --csv validate.csv
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

/// Runs `abbe validate`.
pub fn run(arguments: &ValidateArguments) -> Result<(), Failure> {
    arguments.report.check()?;
    let outputs = arguments.common.outputs(&[arguments.csv.as_ref(), arguments.report.file()])?;
    outputs.refuse_overwrite([arguments.model.as_path()])?;
    let source = files::text(&arguments.model, "the model file")?;
    let model = model_file::read_text(&source.file, &source.text)?;
    let (session, sources) = read_session(&arguments.session, &outputs)?;
    let validation = validate(&model, &session)?;
    let result = &validation.result;
    if outputs.tables(arguments.common.quiet) {
        print(&validation, arguments.all);
    }
    print_warnings(&result.warnings);
    if let Some(path) = &arguments.common.json {
        let mut origin = Origin::of_session(&sources);
        origin.add(Origin::of_files(&source.stamp));
        json::write(path, origin, Some(arguments.common.seed), result)?;
    }
    if let Some(path) = &arguments.csv {
        output::write_figures(path, &present::figures(result))?;
    }
    if arguments.report.asked() {
        let document = crate::report::pages::validate::document(&session, &validation);
        arguments.report.write(&document, (&session, &sources), arguments.common.seed)?;
    }
    Ok(())
}

fn print(validation: &Validation, all: bool) {
    let result = &validation.result;
    say!("{}: {}", result.verdict, present::sentence(result));
    say!("{}", present::readings(result));
    output::print(&present::residuals(result));
    if result.moved.is_empty() {
        say!("\nNo parameter of the machine has moved significantly.");
    } else {
        print_rows(present::moved(result), all);
    }
    if !result.without.is_empty() {
        print_rows(present::without(result), all);
    }
    if all && !result.set_up.is_empty() {
        output::print(&present::set_up(result));
    } else if !result.set_up.is_empty() {
        say!(
            "\n{} of the set-up estimated; --all lists them",
            abbe::model::words::counted(result.set_up.len(), "parameter")
        );
    }
}

/// Prints the first rows of a table and the number of the others; every row with `all`.
fn print_rows(mut table: Table, all: bool) {
    let rows = table.rows.len();
    if !all && rows > MAX_ROWS {
        table.rows.truncate(MAX_ROWS);
    }
    let more = rows - table.rows.len();
    output::print(&table);
    if more > 0 {
        say!("  … {more} more; --all lists them");
    }
}
