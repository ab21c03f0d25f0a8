//! `abbe nc`: NC programs of the planned tests.

use std::path::PathBuf;

use abbe::codegen::nc::{self, NcFiles, NcOptions};
use abbe::model::files::{self, ReadOptions};
use abbe::plan::collision;
use clap::Args;

use super::failure::Failure;
use super::message::print_warnings;
use super::{SessionArguments, folder, output};
use crate::printers::terminal;
use crate::report::nc as present;

/// Examples of `abbe nc`.
pub const HELP: &str = include_str!("help/nc.txt");

/// `abbe nc SESSION --control C --out DIR`
#[derive(Args)]
pub struct NcArguments {
    #[command(flatten)]
    session: SessionArguments,
    /// The control: linuxcnc, fanuc, siemens, heidenhain.
    ///
    /// Example: --control linuxcnc
    #[arg(long, value_name = "CONTROL")]
    control: String,
    /// New folder for the programs.
    ///
    /// Example: --out programs
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Overshoot before and after the measured path, degrees [default: 180 on full circles as far as the travel goes, 2
    /// otherwise].
    ///
    /// Example: --overshoot-deg 10
    #[arg(long, value_name = "DEG")]
    overshoot_deg: Option<f64>,
    /// Overshoot of a sweep of a linear axis, mm.
    ///
    /// Example: --overshoot-mm 5
    #[arg(long, value_name = "MM", default_value_t = NcOptions::default().overshoot_mm)]
    overshoot_mm: f64,
    /// Length by which the bar is longer at the feed-in, mm; 0 for no feed-in.
    ///
    /// Example: --feed-in-mm 1.5
    #[arg(long, value_name = "MM", default_value_t = NcOptions::default().feed_in_mm)]
    feed_in_mm: f64,
    /// Distance along the tool from which positions are approached, mm.
    ///
    /// Example: --clearance-mm 80
    #[arg(long, value_name = "MM", default_value_t = NcOptions::default().clearance_mm)]
    clearance_mm: f64,
    /// Pause between two runs, s.
    ///
    /// Example: --dwell-s 5
    #[arg(long, value_name = "S", default_value_t = NcOptions::default().dwell_s)]
    dwell_s: f64,
    /// Feed of approach and retreat, mm/min and °/min.
    ///
    /// Example: --approach-mm-min 500
    #[arg(long, value_name = "F", default_value_t = NcOptions::default().approach_feed)]
    approach_mm_min: f64,
    /// Largest error of a segment in the distance of the balls, µm.
    ///
    /// Example: --chord-um 0.2
    #[arg(long, value_name = "UM", default_value_t = NcOptions::default().chord_error_mm * 1e3)]
    chord_um: f64,
    /// Least increment of the control, mm and degrees: positions, changes and centres are whole increments [default: fanuc
    /// 0.001, heidenhain 0.0001, linuxcnc and siemens 0.000001].
    ///
    /// Example: --increment-mm 0.0001
    #[arg(long, value_name = "MM")]
    increment_mm: Option<f64>,
    /// Program number of `main` on a fanuc; the tests follow [default: 1000].
    ///
    /// Example: --number 7000
    #[arg(long, value_name = "N")]
    number: Option<u32>,
    /// Write paths of rotary and linear axes for the tool point over the table.
    #[arg(long)]
    tool_point: bool,
    /// Replace files in an existing folder.
    #[arg(long)]
    force: bool,
}

/// Runs `abbe nc`.
pub fn run(arguments: &NcArguments, quiet: bool) -> Result<(), Failure> {
    let control = nc::control(&arguments.control)?;
    let options = NcOptions {
        overshoot_deg: arguments.overshoot_deg,
        overshoot_mm: arguments.overshoot_mm,
        feed_in_mm: arguments.feed_in_mm,
        clearance_mm: arguments.clearance_mm,
        dwell_s: arguments.dwell_s,
        approach_feed: arguments.approach_mm_min,
        chord_error_mm: arguments.chord_um * 1e-3,
        increment_mm: arguments.increment_mm,
        number: arguments.number,
        tool_point: arguments.tool_point,
    };
    let reading = ReadOptions { read_data: false, ..arguments.session.options() };
    let (session, sources) = files::session_with_sources(&arguments.session.session, &reading)?;
    let NcFiles { files: written, warnings, moves } = nc::files(&session, control, &options)?;
    output::Outputs::in_folder(&arguments.out, written.iter().map(|(name, _)| name))
        .refuse_overwrite_of_sources(&sources)?;
    folder::write(&arguments.out, &written, arguments.force, |_| Ok(()))?;
    print_warnings(&warnings);
    print_warnings(&collision::warnings_of_programs(&session, &moves)?);
    if !quiet {
        let report = present::report(&session, &written, control);
        output::whole(&terminal::report(&report, None));
    }
    Ok(())
}
