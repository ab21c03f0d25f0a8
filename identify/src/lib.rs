//! Identification: estimates of geometric errors with standard uncertainties.
//!
//! - [`numerics`]: linear algebra and statistics, independent of any machine;
//! - [`parameters`], [`problem`]: a session as a least-squares problem;
//! - [`fit`]: parameter estimation; [`heldout`]: cross-validation; [`noise`]: noise standard deviation and
//!   autocorrelation;
//! - [`plausibility`]: consistency of readings and session;
//! - [`monte_carlo`], [`propagation`]: propagation of distributions by Monte Carlo; [`repeated`]: Type A against Type B
//!   uncertainty;
//! - [`figure`]: the figures that standards define; [`circular`]: ball-bar characteristics of ISO 230-4 and the diagnosis of circular tests;
//! - [`linear`], [`identifiability`]: the linearised problem, and what its null space confounds;
//! - [`directions`]: readings and residuals of an R-test by direction;
//! - [`simulate`]: simulated readings; [`patterns`]: the pattern of each single error in a test; [`quantity`]: values
//!   with units;
//! - [`series`]: the columns of a session, reading by reading, for plots;
//! - [`model_file`]: the identified model as a value and as a file;
//! - [`tolerance`]: decisions of conformity by ISO 14253-1;
//! - [`results`]: the reported results, in the form of the JSON output.
//!
//! The example fits a bundled session as declared. Beside noise of 0.3 µm its readings contain one unmodelled effect, so
//! that the residual exceeds the noise:
//!
//! ```
//! use std::path::Path;
//!
//! use abbe_files::ReadOptions;
//! use abbe_identify::fit;
//!
//! let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
//! let session = abbe_files::session(&file, &ReadOptions::default())?;
//!
//! let (problem, found) = fit::prepare(&session, 1)?;
//! let declared = fit::report(&problem, &found)?;
//! assert!((declared.model.fit.rms_um - 0.548).abs() < 0.001);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

pub mod circular;
pub mod directions;
pub mod error;
pub mod figure;
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
mod set_up_points;
pub mod simulate;
pub mod start;
pub mod statements;
pub mod straightness;
pub mod tolerance;
pub mod unit;
