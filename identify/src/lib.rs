//! Identification: from readings to errors with honest uncertainties, and from the residual to the effect that the model lacks.
//!
//! - [`least_squares`], [`triangle`], [`rank`]: the numerical core, which knows no machine;
//! - [`parameters`], [`problem`]: a session as a least-squares problem;
//! - [`fit`]: identify; [`heldout`]: judge on readings that the fit did not see; [`noise`]: how much is noise;
//! - [`plausibility`]: whether readings and session belong together;
//! - [`monte_carlo`], [`propagation`]: distributions by drawing; [`repeated`]: Type A beside Type B;
//! - [`compensation`]: identified error motions as curves over their axis;
//! - [`circular`]: ball-bar figures of ISO 230-4 and the classical diagnosis;
//! - [`trace`]: close the loop; [`effect_description`], [`parameter_description`]: effects and parameters in words;
//! - [`plan`]: what tests can see before anybody measures;
//! - [`directions`]: readings and residuals of an R-test by direction;
//! - [`simulate`]: readings from a model; [`patterns`]: what each error alone does to a test; [`quantity`]: values with their units as people write them;
//! - [`views`]: a session reading by reading, as plots draw it;
//! - [`results`]: what is reported, as it stands in JSON.
//!
//! A bundled session, fitted as it is declared and then traced. What is in it beside noise of 0.3 µm is an axial wobble of the C table, 1.5 µm · cos(2 C + 60°):
//!
//! ```
//! use std::path::Path;
//!
//! use abbe_identify::fit;
//! use abbe_identify::trace::{TraceOptions, trace};
//! use abbe_model::session::read::{self, ReadOptions};
//!
//! let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
//! let session = read::session(&file, &ReadOptions::default())?;
//!
//! let (problem, found) = fit::prepare(&session, 1)?;
//! let declared = fit::report(&problem, &found);
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

pub mod circle;
pub mod circular;
pub mod compensation;
mod covariance;
pub mod directions;
pub mod drivers;
pub mod effect_description;
pub mod error;
pub mod fit;
pub mod geometric;
pub mod heldout;
pub mod least_squares;
pub mod monte_carlo;
pub mod noise;
pub mod outliers;
pub mod parameter_description;
pub mod parameters;
pub mod patterns;
pub mod plan;
pub mod plausibility;
mod preference;
pub mod problem;
pub mod propagation;
pub mod quantity;
pub mod rank;
pub mod repeated;
pub mod results;
pub mod self_calibration;
pub mod series;
pub mod simulate;
pub mod start;
pub mod trace;
pub mod triangle;
pub mod unit;
pub mod volumetric;

pub use error::IdentifyError;
