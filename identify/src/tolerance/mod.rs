//! Decisions of conformity: the results of a session against its `[tolerance]`.
//!
//! [`rule`] is the decision rule of ISO 14253-1. The uncertainty of a parameter is that of the fit. That of a figure of
//! a test follows from the noise `σ` of a reading, from the `n` runs that are averaged, and from what the session states
//! of the instrument and of the bar:
//!
//! ```text
//! u²(G) = 2σ²/n + u²(instrument) + u²(set-up)        u²(F) = u²(D) = σ²/n + u²(bar) + u²(instrument) + u²(set-up)
//! u²(H) = 2σ²/n + u²(instrument)
//! ```
//!
//! `u(set-up)` follows from the priors of both balls by the evaluation of the figure, which removes the centre
//! (`circular::set_up`).

mod decide;
mod figures;
mod results;
pub mod rule;

pub use decide::conformity;
pub use results::{Conformity, ConformityItem};
