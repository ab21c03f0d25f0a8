//! What sheets order beside the set-up of the tests: programs and warnings.

use abbe::codegen::nc::{self, Control, NcFiles};
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use abbe::plan::collision;
use abbe::plan::sheet::TestSheet;

use super::SheetArguments;
use crate::printers::sheet::Order;

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
