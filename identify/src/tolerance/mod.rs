//! Decisions of conformity: the results of a session against its `[tolerance]`.
//!
//! [`rule`] is the decision rule of ISO 14253-1. The uncertainty of a parameter is that of the fit. That of a figure of
//! a test follows from the noise `σ` of a reading, from the `n` runs that are averaged, and from what the session states
//! of the instrument and of the bar:
//!
//! ```text
//! u²(G) = u²(H) = 2σ²/n + u²(instrument)        u²(F) = u²(D) = σ²/n + u²(bar) + u²(instrument)
//! ```

mod decide;
mod figures;
mod results;
pub mod rule;

pub use decide::conformity;
pub use results::{Conformity, ConformityItem};
