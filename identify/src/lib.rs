//! Identification: estimates of geometric errors with standard uncertainties, and the search for unmodelled effects in
//! the residual.
//!
//! - [`numerics`]: linear algebra and statistics, independent of any machine;
//! - [`parameters`], [`problem`]: a session as a least-squares problem;
//! - [`fit`]: parameter estimation; [`heldout`]: cross-validation; [`noise`]: noise standard deviation and
//!   autocorrelation;
//! - [`plausibility`]: consistency of readings and session;
//! - [`monte_carlo`], [`propagation`]: propagation of distributions by Monte Carlo; [`repeated`]: Type A against Type B
//!   uncertainty;
//! - [`circular`]: ball-bar characteristics of ISO 230-4 and the diagnosis of circular tests;
//! - [`candidates`]: the effects that a trace examines; [`trace`]: search for the unmodelled effect behind the
//!   residual;
//! - [`linear`], [`identifiability`]: the linearised problem, and what its null space confounds;
//! - [`directions`]: readings and residuals of an R-test by direction;
//! - [`simulate`]: simulated readings; [`patterns`]: the pattern of each single error in a test; [`quantity`]: values
//!   with units;
//! - [`series`]: the columns of a session, reading by reading, for plots;
//! - [`model_file`]: the identified model as a value and as a file;
//! - [`tolerance`]: decisions of conformity by ISO 14253-1;
//! - [`validate`](mod@validate): a model against readings that it never saw;
//! - [`results`]: the reported results, in the form of the JSON output.
//!
//! The example fits a bundled session as declared, then traces it. Beside noise of 0.3 µm the readings contain one
//! unmodelled effect, an axial motion of the C table of 1.5 µm · cos(2 C + 60°):
//!
//! ```
//! use std::path::Path;
//!
//! use abbe_identify::fit;
//! use abbe_identify::trace::{TraceOptions, trace};
//! use abbe_files::ReadOptions;
//!
//! let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
//! let session = abbe_files::session(&file, &ReadOptions::default())?;
//!
//! let (problem, found) = fit::prepare(&session, 1)?;
//! let declared = fit::report(&problem, &found)?;
//! assert!((declared.rms_um - 0.548).abs() < 0.001);
//!
//! let options = TraceOptions { only: vec!["EZC".into()], draws: 99, ..TraceOptions::default() };
//! let found = trace(&session, &options, &|_| true)?.result;
//! assert!((found.after.rms_um - 0.304).abs() < 0.001);
//! let amplitude = &found.effects[0].parameters[0];
//! assert_eq!(amplitude.id, "EZC~C:h2.amplitude");
//! assert!((amplitude.value - 1.5).abs() < 3.0 * amplitude.u);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

pub mod candidates;
pub mod circular;
pub mod directions;
pub mod error;
pub mod fit;
pub mod heldout;
pub mod identifiability;
pub mod linear;
pub mod model_file;
pub mod monte_carlo;
pub mod noise;
pub mod numerics;
pub mod parameter_description;
pub mod parameters;
pub mod patterns;
pub mod plausibility;
pub mod positioning;
pub mod problem;
pub mod propagation;
pub mod quantity;
pub mod repeated;
pub mod results;
pub mod self_calibration;
pub mod series;
mod session_fit;
pub mod simulate;
pub mod start;
pub mod statements;
pub mod straightness;
pub mod tolerance;
pub mod trace;
pub mod unit;
pub mod validate;

pub use error::IdentifyError;
pub use session_fit::SessionFit;
