//! HTML reports and plots. Each report is one file without external resources. The calculations are in
//! `abbe::identify`.
//!
//! - [`document`]: contents of a report. [`crate::report::provenance`]: inputs, version and
//!   command line. [`embed`]: data in the page.
//! - [`fit`], [`trace`], [`validate`](mod@validate), [`plan`], [`method`], [`next_test`], [`history`]: the report of each command.
//! - [`summary`], [`values`], [`residuals`], [`effects`], [`readings`], [`sections`]: sections.
//! - [`plots`], [`curves`]: plots of readings and of derived quantities. [`abscissae`]: what they are plotted against.
//!   [`decimate`]: decimation that keeps extremes.
//!
//! All text passes through templates that escape markup. Only the SVG drawings, the style sheets and the script of this
//! module are inserted verbatim.

pub mod abscissae;
pub mod curves;
pub mod decimate;
pub mod document;
pub mod effects;
pub mod embed;
pub mod fit;
#[cfg(feature = "fleet")]
pub mod history;
pub mod method;
pub mod next_test;
pub mod plan;
pub mod plots;
pub mod readings;
pub mod residuals;
pub mod sections;
pub mod summary;
pub mod trace;
pub mod validate;
mod validate_plots;
pub mod values;
