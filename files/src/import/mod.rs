//! Import: the layout and the columns of a foreign table of readings, from its bytes alone.
//!
//! - `grid`: encoding, separator, decimal sign, lines above the rows, names of the columns;
//! - `unit`, `words`: units and names of columns in the words of instruments and robots; `meaning`: what each column holds;
//! - `open_units`: units that the file does not state; `hint`: what the user says;
//! - `normalise`: the same readings as a table with our columns, where a session cannot state the layout;
//! - [`session`]: the session that reads the table; `guess`: the instrument that the columns belong to.
//!
//! Nothing here looks at the residual. What the file leaves open, such as the unit of a column without one, is one
//! [`Reading`] each, and the caller decides by a fit.

mod foreign;
mod grid;
mod guess;
mod hint;
mod meaning;
mod normalise;
mod open_units;
pub mod session;
pub(crate) mod unit;
mod values;
mod words;

pub use self::foreign::Foreign;
pub use self::guess::instrument;
pub use self::hint::Hint;
pub use self::meaning::ColumnFound;

use abbe_model::chain::Machine;
use abbe_model::document::layout::{Columns, Format};
use abbe_model::instrument::{Fault, InstrumentKind, Station};

/// Largest size of a file, bytes: a table is held in memory.
pub const MAX_BYTES: usize = 256 << 20;

/// A circle that a test moves on: the axes of its plane with their centre, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// The two axes, by index of the machine.
    pub axes: [usize; 2],
    /// Positions of the axes at the centre, mm: the polar angle counts from the first axis to the second.
    pub centre_mm: [f64; 2],
    /// Amplitude of each axis, mm.
    pub amplitude_mm: [f64; 2],
}

/// What is known of the readings before the file is looked at.
#[derive(Clone)]
pub struct Expected<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The instrument as set up.
    pub station: &'a Station<f64>,
    /// The circle of the test, for a file with a polar angle in place of positions.
    pub circle: Option<Circle>,
    /// The axis that alone moves in the test.
    pub moved: Option<usize>,
    /// The range of the planned positions of each axis, mm and rad, if the test plans a motion.
    pub planned: Option<Vec<[f64; 2]>>,
    /// What the user says of columns.
    pub hints: &'a [Hint],
}

impl Expected<'_> {
    /// The instrument.
    pub fn kind(&self) -> InstrumentKind {
        self.station.kind()
    }
}

/// A table as it is understood.
#[derive(Clone, Debug)]
pub struct Understood {
    /// The encoding, such as `utf-8`.
    pub encoding: &'static str,
    /// The separator in words.
    pub separator: &'static str,
    /// `.` or `,`.
    pub decimal: char,
    /// Lines above the names, or above the first row if there are none.
    pub skipped_lines: usize,
    /// Number of rows that are read.
    pub row_count: usize,
    /// The first rows, as they stand in the file.
    pub first_rows: Vec<Vec<String>>,
    /// How the readings are read. The first is the most probable one; the file does not decide between them.
    pub readings: Vec<Reading>,
}

/// One way to read a table.
#[derive(Clone, Debug)]
pub struct Reading {
    /// What it assumes that the file does not state, such as "J1 to J6 are in radians"; empty if nothing.
    pub assumes: Vec<String>,
    /// Millimetres in the unit of length that it assumes; 1 if it assumes none.
    pub scale_mm: f64,
    /// The columns with the units assumed.
    pub columns: Vec<ColumnFound>,
    /// `[format]` of the session that reads it.
    pub format: Format,
    /// `[columns]` of that session.
    pub own_columns: Columns,
    /// A table with our columns, which that session reads in place of the file.
    pub copy: Option<String>,
    /// What `[format]` and `[columns]` cannot state, so that there is a copy.
    pub normalised: Vec<String>,
    /// What was done or left out.
    pub remarks: Vec<String>,
}

/// A table with what its columns hold.
struct Table<'t> {
    grid: &'t grid::Grid,
    found: &'t [meaning::Found],
    expected: &'t Expected<'t>,
    values: values::Values,
}

/// Number of rows that are shown.
const SHOWN: usize = 5;

/// Reads the layout of a table and what its columns hold. `name` is that of the file, for the head of a normalised copy.
///
/// # Errors
/// If the table cannot be used as readings of the test: what was found with which layout, and what to do. The message does
/// not name the file.
pub fn understand(name: &str, bytes: &[u8], expected: &Expected<'_>) -> Result<Understood, Fault> {
    if bytes.len() > MAX_BYTES {
        let found = format!("{} bytes; the limit is {MAX_BYTES}", bytes.len());
        return Err((found, "thin out the readings, or split the file".into()));
    }
    let grid = grid::of(bytes)?;
    let found = hint::found(&grid, expected).and_then(|found| meaning::of(&grid, expected, found));
    let found = found.map_err(|fault| grid.with_layout(fault))?;
    let readings = normalise::readings(name, &grid, &found, expected).map_err(|fault| grid.with_layout(fault))?;
    Ok(Understood {
        encoding: grid.encoding,
        separator: grid.separator_in_words(),
        decimal: grid.decimal,
        skipped_lines: grid.skipped_lines(),
        row_count: grid.rows.len(),
        first_rows: grid.rows.iter().take(SHOWN).map(|row| row.cells.clone()).collect(),
        readings,
    })
}
