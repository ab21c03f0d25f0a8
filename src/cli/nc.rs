//! `abbe nc`: NC programs of the planned tests.

use std::path::PathBuf;

use abbe::apply::control::CONTROLS;
use abbe::codegen::nc::{self, NcFiles, NcOptions};
use abbe::model::Diagnostic;
use abbe::plan::collision;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use super::message::print_warnings;
use super::{Global, SessionArguments, folder, output};
use crate::printers::terminal;
use crate::report::nc as present;

/// Examples of `abbe nc`.
pub const HELP: &str = include_str!("help/nc.txt");

/// `abbe nc SESSION --control C --out DIR`
#[derive(Args)]
pub struct NcArguments {
    #[command(flatten)]
    session: SessionArguments,
    /// The control of the NC programs.
    ///
    /// Example: --control linuxcnc
    #[arg(long, value_name = "CONTROL", value_parser = controls())]
    control: &'static dyn nc::Control,
    /// Where the result is written: a new folder for the programs.
    ///
    /// Example: --out programs
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    motion: MotionArguments,
    #[command(flatten)]
    folder: super::ForceArguments,
}

/// Runs `abbe nc`.
pub fn run(arguments: &NcArguments, Global { quiet, .. }: Global) -> Result<(), Diagnostic> {
    let control = arguments.control;
    let options = arguments.motion.options();
    let (session, sources) = arguments.session.read_planned(|session| nc::has_letters(&session.machine))?;
    let NcFiles { files: written, warnings, moves, runs } = nc::files(&session, control, &options)?;
    output::Outputs::in_folder(&arguments.out, written.iter().map(|(name, _)| name))
        .refuse_overwrite_of_sources(&sources)?;
    folder::write(&arguments.out, &written, arguments.folder.force, |_| Ok(()))?;
    print_warnings(&warnings);
    print_warnings(&collision::warnings_of_programs(&session, &moves)?);
    if !quiet {
        let report = present::report(&session, &written, &runs, control);
        output::whole(&terminal::report(&report, None));
    }
    Ok(())
}

/// The controls with NC programs.
pub fn controls() -> impl TypedValueParser<Value = &'static dyn nc::Control> {
    let known = CONTROLS.iter().filter(|control| control.has_programs);
    let words = known.map(|control| PossibleValue::new(control.word).help(control.name));
    PossibleValuesParser::new(words).try_map(|word| nc::control(&word))
}

/// How programs move.
#[derive(Args)]
pub struct MotionArguments {
    /// Overshoot before and after the measured path, degrees [default: 180 on full circles as far as the travel goes, 2
    /// otherwise].
    ///
    /// Example: --overshoot-deg 10
    #[arg(long, value_name = "DEG")]
    overshoot_deg: Option<f64>,
    /// Overshoot of a sweep of a linear axis, or along a line, mm [default: 2, as far as the travel goes].
    ///
    /// Example: --overshoot-mm 5
    #[arg(long, value_name = "MM")]
    overshoot_mm: Option<f64>,
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
    /// Pause between two runs, and rest at each target of an instrument that reads at rest, s.
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
    /// Example: --program-number 7000
    #[arg(long, value_name = "N", requires = "control")]
    program_number: Option<u32>,
    /// Write paths of rotary and linear axes for the tool point over the table.
    #[arg(long, requires = "control")]
    tool_point: bool,
}

impl MotionArguments {
    /// The options of programs.
    pub fn options(&self) -> NcOptions {
        NcOptions {
            overshoot_deg: self.overshoot_deg,
            overshoot_mm: self.overshoot_mm,
            feed_in_mm: self.feed_in_mm,
            clearance_mm: self.clearance_mm,
            dwell_s: self.dwell_s,
            approach_feed: self.approach_mm_min,
            chord_error_mm: self.chord_um * 1e-3,
            increment_mm: self.increment_mm,
            number: self.program_number,
            tool_point: self.tool_point,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every dialect is that of a control of the registry, and the other way round.
    #[test]
    fn controls_with_programs_are_those_with_a_dialect() {
        let dialects = nc::CONTROLS.map(nc::Control::word);
        let controls: Vec<&str> = CONTROLS.iter().filter(|own| own.has_programs).map(|own| own.word).collect();
        assert_eq!(dialects[..], controls);
    }
}
