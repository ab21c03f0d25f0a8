//! `abbe sheet`: set-up sheets of the planned tests.

use std::path::PathBuf;

use abbe::codegen::nc::{self, Control, NcFiles};
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use abbe::model::words::counted;
use abbe::plan::collision;
use abbe::plan::sheet::{SetUpTimes, TestSheet, sheets};
use clap::Args;

use super::message::print_warnings;
use super::nc::{MotionArguments, controls};
use super::{Global, SessionArguments, output, values};
use crate::printers::sheet as present;
use crate::printers::sheet::Order;

/// Examples of `abbe sheet`.
pub const HELP: &str = include_str!("help/sheet.txt");

/// `abbe sheet SESSION --out FILE.html`
#[derive(Args)]
pub struct SheetArguments {
    #[command(flatten)]
    session: SessionArguments,
    /// Where the result is written: the page; `-` is standard output.
    ///
    /// Example: --out sheets.html
    #[arg(long, value_name = "FILE.html")]
    out: PathBuf,
    /// Length of the bar without an extension, mm [default: the shortest bar of the session].
    ///
    /// Example: --bar-mm 100
    #[arg(long, value_name = "MM")]
    bar_mm: Option<f64>,
    /// Time to mount a ball.
    ///
    /// Example: --setup-min 10
    #[arg(long, value_name = "MIN", default_value_t = 5.0)]
    setup_min: f64,
    /// Time to prepare a test.
    ///
    /// Example: --test-min 2
    #[arg(long, value_name = "MIN", default_value_t = 1.0)]
    test_min: f64,
    /// Time to assemble the bar, or to change its extension, and to calibrate it.
    ///
    /// Example: --bar-min 3
    #[arg(long, value_name = "MIN", default_value_t = 5.0)]
    bar_min: f64,
    /// The control of the NC programs: the sheets name them.
    ///
    /// Example: --control fanuc
    #[arg(long, value_name = "CONTROL", value_parser = controls())]
    control: Option<&'static dyn Control>,
    #[command(flatten)]
    motion: MotionArguments,
}

/// Runs `abbe sheet`.
pub fn run(arguments: &SheetArguments, Global { quiet, .. }: Global) -> Result<(), Diagnostic> {
    for (flag, value) in
        [("--setup-min", arguments.setup_min), ("--test-min", arguments.test_min), ("--bar-min", arguments.bar_min)]
    {
        values::MINUTES.check(flag, value)?;
    }
    arguments.bar_mm.map(|mm| values::BAR_MM.check("--bar-mm", mm)).transpose()?;
    output::check_page(&arguments.out)?;
    let outputs = output::Outputs::new([&arguments.out])?.quieted(quiet);
    let (session, sources) = arguments.session.read_planned(|_| true)?;
    outputs.refuse_overwrite_of_sources(&sources)?;
    let times = SetUpTimes { setup_min: arguments.setup_min, test_min: arguments.test_min, bar_min: arguments.bar_min };
    let bars = session.tests.iter().filter_map(|test| Some(test.station.bar()?.bar));
    let basic_bar_mm = arguments.bar_mm.or(bars.reduce(f64::min));
    let sheets = sheets(&session, times, basic_bar_mm)?;
    let source = sources.file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let order = order(&session, &sheets, arguments, source, basic_bar_mm)?;
    let page = present::html(&session, &sheets, &order);
    print_warnings(&order.warnings);
    output::write_whole(&arguments.out, page.as_bytes())?;
    if outputs.tables() {
        say!("{}: {}, one page each, and an overview", arguments.out.display(), counted(sheets.len(), "test"));
    }
    Ok(())
}

/// The programs of the sheets, if the plan has some: poses and robots have none. Without a stated control, the motion is that
/// of one without an increment, the names are left out, and what forbids programs is a warning.
fn programs(
    session: &Session,
    arguments: &SheetArguments,
    warnings: &mut Vec<String>,
) -> Result<Option<(&'static dyn Control, NcFiles)>, Diagnostic> {
    let control = arguments.control.map_or_else(|| nc::control("linuxcnc"), Ok)?;
    if arguments.control.is_none() && !nc::has_programs(session) {
        return Ok(None);
    }
    match nc::files(session, control, &arguments.motion.options()) {
        Ok(programs) => Ok(Some((control, programs))),
        Err(error) if arguments.control.is_some() => Err(error),
        Err(error) => {
            warnings.push(format!("no program can be written: {error}"));
            Ok(None)
        }
    }
}

/// The order of work of these sheets.
pub fn order(
    session: &Session,
    sheets: &[TestSheet],
    arguments: &SheetArguments,
    source: String,
    basic_bar_mm: Option<f64>,
) -> Result<Order, Diagnostic> {
    let mut warnings = session.warnings.clone();
    let programs = programs(session, arguments, &mut warnings)?;
    warnings.extend(collision::unchecked(session, true));
    let clearances: Vec<_> = sheets.iter().filter_map(|sheet| sheet.clearance.clone()).collect();
    warnings.extend(collision::warnings(session, &clearances));
    if let Some((_, programs)) = &programs {
        warnings.extend(programs.warnings.iter().cloned());
        warnings.extend(collision::warnings_of_moves(session, &programs.moves));
    }
    Ok(Order {
        source,
        control: programs.as_ref().map(|(control, _)| *control).filter(|_| arguments.control.is_some()),
        main: programs.as_ref().and_then(|(_, programs)| programs.files.first()).map(|(name, _)| name.clone()),
        number: arguments.motion.options().number(),
        runs: programs.map_or(Vec::new(), |(_, programs)| programs.runs),
        basic_bar_mm,
        warnings,
    })
}
