//! A format of compensation tables: what a file of a format states about itself.

use abbe_model::chain::Machine;

use super::curves::Compensation;

/// A file to write: its name and its text.
pub type FileText = (String, String);

/// The format of the tables of a control.
pub struct TableFormat {
    /// The word by which it is requested.
    pub word: &'static str,
    /// The file.
    pub about: &'static str,
    /// How the control reads the files, one sentence or two.
    pub import: &'static [&'static str],
    /// Whether the files hold location errors.
    pub holds_locations: bool,
    /// Writes the files with a number of points, and adds the errors that they do not hold to the list.
    pub(crate) files: fn(&Machine, &Compensation, usize, &mut Vec<String>) -> Vec<FileText>,
}
