//! Reports: one HTML file that needs nothing else, and its plots by themselves. No mathematics: what is drawn was computed by `identify`.
//!
//! - [`document`], [`page`]: sections, and the page around them; [`provenance`]: what it takes to do the same again;
//! - [`drawn`], [`readings`], [`curves`]: the plots of readings and of what stands behind them; [`thin`]: fewer points, no peak lost; [`embed`]: the
//!   data that the page brings along;
//! - [`fit`], [`method`], [`trace`], [`plan`], [`next`], [`plausibility`]: what a report of each command holds;
//! - [`plot`]: the drawings.
//!
//! Everything goes through templates that escape; only drawings of this module and the page's own style and script are taken as they are.

pub mod circular;
pub mod curves;
pub mod decimate;
pub mod document;
pub mod embed;
pub mod fit;
pub mod method;
pub mod next_test;
pub mod page;
pub mod plan;
pub mod plausibility;
pub mod plot;
pub mod plots;
pub mod provenance;
pub mod readings;
pub mod trace;
