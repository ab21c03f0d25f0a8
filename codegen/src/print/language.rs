//! What every output language implements.

use crate::check::Checked;
use crate::print::style::Style;

/// A language in which equations are printed.
pub trait Language: Sync {
    /// The page or file of an equation.
    fn print(&self, checked: &Checked<'_>, style: &Style) -> String;
}
