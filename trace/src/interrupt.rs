//! Interrupts a trace: the caller can stop it at any time and gets the effects found so far.

use abbe_identify::error;
use abbe_model::Diagnostic;

use super::Progress;

/// Asks the caller of a trace whether to continue.
#[derive(Clone, Copy)]
pub struct Interrupt<'t>(pub &'t (dyn Fn(Progress) -> bool + Sync));

impl Interrupt<'_> {
    /// Returns if the trace continues.
    ///
    /// # Errors
    /// `INTERRUPTED` if the caller stops the trace.
    pub fn check(&self) -> Result<(), Diagnostic> {
        if (self.0)(Progress::Working) { Ok(()) } else { Err(error::interrupted()) }
    }
}
