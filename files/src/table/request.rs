//! What a test requires of its data file, and what the session states of the layout of the file.

use abbe_model::chain::Machine;
use abbe_model::diagnostic::Location;
pub(crate) use abbe_model::document::layout::ForeignColumn;
use abbe_model::instrument::InstrumentKind;
use abbe_model::session::Test;
use abbe_model::session::motion::Motion;
use encoding_rs::Encoding;

use crate::store::Store;

/// The layout of the rows of a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Format {
    /// The separator between cells.
    pub separator: u8,
    /// `.` or `,`.
    pub decimal: u8,
    /// Whether the first row names the columns.
    pub header: bool,
    /// The sheet of a spreadsheet; by default the first that is not empty.
    pub sheet: Option<String>,
    /// The word in a ball-bar file in XML for the direction from the first axis of the plane towards the second.
    pub anticlockwise: Option<String>,
    /// The stated encoding of the text.
    pub encoding: Option<&'static Encoding>,
    /// Lines (of a spreadsheet: rows) above the header.
    pub skip_lines: usize,
}

impl Default for Format {
    fn default() -> Self {
        Format {
            separator: b',',
            decimal: b'.',
            header: true,
            sheet: None,
            anticlockwise: None,
            encoding: None,
            skip_lines: 0,
        }
    }
}

/// A line of `[columns]`: own name = foreign name.
#[derive(Clone, Debug)]
pub(crate) struct ColumnMapping {
    /// Our name, which includes the unit.
    pub own: String,
    /// The foreign name or number.
    pub foreign: ForeignColumn,
    /// The location of the line.
    pub location: Location,
}

/// What a test requires of its data file.
pub(crate) struct Request<'a> {
    /// The machine that has the axes of the columns.
    pub machine: &'a Machine,
    /// The test, without its readings.
    pub test: &'a Test,
    /// Where its file lies.
    pub store: &'a Store,
    /// Which positions in [`Test::at`] the session states.
    pub at_listed: &'a [bool],
    /// The layout of the rows.
    pub format: Format,
    /// Foreign names, if declared.
    pub columns: Option<&'a [ColumnMapping]>,
}

impl Request<'_> {
    /// The instrument.
    pub fn instrument(&self) -> InstrumentKind {
        self.test.station.kind()
    }

    /// The reference length of deviations, mm.
    pub fn bar_mm(&self) -> f64 {
        self.test.station.reference_mm()
    }

    /// Warnings with the name of the test.
    pub fn named(&self, warnings: Vec<String>) -> Vec<String> {
        let name = &self.test.name;
        warnings.into_iter().map(|warning| format!("test \"{name}\": {warning}")).collect()
    }

    /// Axes that move in the planned test: those that its motion names.
    pub fn moved(&self) -> &[usize] {
        self.test.motion.as_ref().map_or(&[], Motion::axes)
    }
}
