//! What the user says of columns.

use crate::document::layout::ForeignColumn;
use crate::document::value::Count;
use crate::instrument::Fault;

/// What the user says of a column: our name, which includes the unit, and the name or the number in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Hint {
    /// Our name, such as `c_deg`.
    pub own: String,
    /// The name or the number in the file.
    pub foreign: ForeignColumn,
}

impl Hint {
    /// `OWN=THEIRS`, such as `c_deg=3` or `length_mm=Messwert`.
    ///
    /// # Errors
    /// If it is not of this form.
    pub fn parse(text: &str) -> Result<Hint, Fault> {
        let parts = text.split_once('=').map(|(own, theirs)| (own.trim(), theirs.trim()));
        let Some((own, theirs)) = parts.filter(|(own, theirs)| !own.is_empty() && !theirs.is_empty()) else {
            let help =
                "write OWN=THEIRS: our name with its unit, and the name or the number in the file, such as c_deg=3";
            return Err((format!("`{text}` names no column"), help.into()));
        };
        let number = theirs.parse::<usize>().ok().filter(|number| (1..=MAX_COLUMNS).contains(number));
        let foreign = number
            .map_or_else(|| ForeignColumn::Name(theirs.to_string()), |number| ForeignColumn::Number(Count(number)));
        Ok(Hint { own: own.to_string(), foreign })
    }
}

/// Largest number of a column.
const MAX_COLUMNS: usize = 1_000_000;
