//! What every output language implements.

use crate::check::Checked;
use crate::print::Style;
use crate::print::system::TestEquations;

/// A language in which equations are printed.
pub trait Language: Sync {
    /// The page or file of an equation.
    fn print(&self, checked: &Checked<'_>, style: &Style) -> String;
    /// The page of all tests of a session; `None` for a language of compilers.
    fn system(&self, tests: &[TestEquations<'_>], style: &Style) -> Option<String> {
        let _ = (tests, style);
        None
    }
}
