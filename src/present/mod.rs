//! Results as tables and figures, and the printers that show them. Nothing here computes a result or knows an option.
//!
//! - [`table`]: a table as data; [`number`]: digits and units; [`figure`]: plots;
//! - printers: [`terminal`], [`csv`], [`html`];
//! - one file per result: [`fit`], [`base`], [`trace`], [`validate`], [`plan`], [`next_test`], [`method`], [`repeated`], [`self_calibration`],
//!   [`simulation`], [`patterns`], [`volumetric`], [`compensation`];
//! - parts of several results: [`parameters`], [`confounded`], [`cross_validation`], [`circular`], [`plausibility`],
//!   [`effect`], [`uniqueness`], [`readings`];
//! - [`report`]: the pages of `--report`; [`paper`]: the folder of `abbe paper`.

pub mod base;
pub mod circular;
pub mod compare;
pub mod compensate;
pub mod compensation;
pub mod confounded;
pub mod cross_validation;
pub mod csv;
pub mod effect;
pub mod export;
pub mod figure;
pub mod fit;
pub mod html;
pub mod method;
pub mod next_test;
pub mod number;
pub mod paper;
pub mod parameters;
pub mod patterns;
pub mod plan;
pub mod plausibility;
pub mod readings;
pub mod repeated;
pub mod report;
pub mod self_calibration;
pub mod simulation;
pub mod table;
pub mod terminal;
pub mod trace;
pub mod uniqueness;
pub mod validate;
pub mod volumetric;
