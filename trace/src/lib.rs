//! The trace: the unmodelled effect behind the residual of a fitted model, and whether the model with it holds.
//!
//! 1. The noise standard deviation and autocorrelation follow from repeats ([`abbe_identify::noise`]). Outliers are
//!    excluded by name ([`abbe_identify::noise::outliers`]).
//! 2. The columns of the library's effects ([`candidates`]) are computed for the session. Their products with the model,
//!    the residual and the null draws are computed once.
//! 3. The search (`search`) adds, removes, exchanges and merges effects (`moves`). Its p-values come from the same
//!    search on readings without structure (`null`). An effect is accepted if its p-value is below the significance
//!    level and the held-out error decreases by more than the standard error of the decrease. That standard error
//!    follows from paired differences over runs, blocks or poses.
//! 4. All parameters are refitted together (`judge`). The result ([`result`]) states the held-out error before and after.
//! 5. For each effect the trace lists its aliases ([`alias`]), in an order that left-out tests decide. It tests the
//!    residual for remaining structure (`remainder`), as [`SessionFit`] does where limits are to be decided.
//! 6. A saved model is judged by readings that it never saw ([`validate`](mod@validate)).
//!
//! The example fits a bundled session as declared, then traces it. Beside noise of 0.3 µm the readings contain one
//! unmodelled effect, an axial motion of the C table of 1.5 µm · cos(2 C + 60°):
//!
//! ```
//! use std::path::Path;
//!
//! use abbe_identify::fit;
//! use abbe_trace::{TraceOptions, trace};
//! use abbe_files::ReadOptions;
//!
//! let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
//! let session = abbe_files::session(&file, &ReadOptions::default())?;
//!
//! let (problem, found) = fit::prepare(&session, 1)?;
//! let declared = fit::report(&problem, &found)?;
//! assert!((declared.model.fit.rms_um - 0.548).abs() < 0.001);
//!
//! let options = TraceOptions { only: vec!["EZC".into()], draws: 99, ..TraceOptions::default() };
//! let found = trace(&session, &options, &|_| true)?.result;
//! assert!((found.after.fit.rms_um - 0.304).abs() < 0.001);
//! let amplitude = &found.effects[0].parameters[0];
//! assert_eq!(amplitude.id, "EZC~C:h2.amplitude");
//! assert!((amplitude.value - 1.5).abs() < 3.0 * amplitude.u);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

pub mod alias;
pub mod candidates;
mod constants;
mod implausible;
pub mod interrupt;
mod judge;
mod moves;
mod neighbours;
mod noise_model;
mod null;
mod paired;
mod plausible;
mod policy;
mod poses;
mod progress;
mod remainder;
pub mod result;
pub mod screening;
mod search;
mod session_fit;
mod start;
mod state;
pub mod statements;
mod trace;
pub mod validate;

pub use progress::Progress;
pub use session_fit::SessionFit;
pub use trace::{SearchStep, TraceOptions, TraceOutcome, trace};
