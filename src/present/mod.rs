//! Results as tables and figures, and the printers that show them. Nothing here computes a result or knows an option.
//!
//! - [`table`]: a table as data; [`number`]: digits and units; [`figure`]: plots;
//! - printers: [`terminal`], [`csv`], [`html`];
//! - one file per result: [`fit`], [`base`], [`trace`], [`validate`], [`plan`], [`next_test`], [`mod@poses`], [`method`], [`repeated`], [`self_calibration`],
//!   [`simulation`], [`patterns`], [`volumetric`], [`compensation`], [`history`], [`study`];
//! - parts of several results: [`parameters`], [`confounded`], [`cross_validation`], [`circular`], [`conformity`],
//!   [`plausibility`],
//!   [`effect`], [`uniqueness`], [`readings`];
//! - [`report`]: the pages of `--report`; [`sheet`]: set-up sheets; [`paper`]: the folder of `abbe paper`.

pub mod base;
pub mod circular;
pub mod compare;
pub mod compensate;
pub mod compensation;
pub mod conformity;
pub mod confounded;
pub mod cross_validation;
pub mod csv;
pub mod effect;
pub mod export;
pub mod figure;
pub mod fit;
#[cfg(feature = "fleet")]
pub mod history;
pub mod html;
pub mod method;
pub mod next_test;
pub mod number;
pub mod paper;
pub mod parameters;
pub mod patterns;
pub mod plan;
pub mod plausibility;
pub mod poses;
pub mod readings;
pub mod repeated;
pub mod report;
pub mod self_calibration;
pub mod sheet;
pub mod simulation;
#[cfg(feature = "fleet")]
pub mod study;
pub mod table;
pub mod terminal;
pub mod trace;
pub mod uniqueness;
pub mod validate;
pub mod volumetric;
