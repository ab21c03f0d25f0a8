//! Results as tables, figures and text. Nothing here computes a result, prints one, or knows an option.
//!
//! - [`table`]: a table as data; [`number`]: digits and units; [`figure`]: plots;
//! - one file per result: [`fit`], [`base`], [`trace`], [`validate`], [`plan`], [`next_test`], [`mod@poses`], [`method`],
//!   [`repeated`], [`self_calibration`], [`simulation`], [`patterns`], [`volumetric`], [`compensation`], `history`, `study`;
//! - parts of several results: [`parameters`], [`confounded`], [`cross_validation`], [`circular`], [`conformity`],
//!   [`plausibility`], [`effect`], [`uniqueness`], [`readings`], [`provenance`];
//! - [`pages`]: the pages of `--report`; [`paper`]: the sections of `abbe paper`.

pub mod base;
pub mod circular;
pub mod compare;
pub mod compensate;
pub mod compensation;
pub mod conformity;
pub mod confounded;
pub mod cross_validation;
pub mod effect;
pub mod export;
pub mod figure;
pub mod fit;
#[cfg(feature = "fleet")]
pub mod history;
pub mod method;
pub mod next_test;
pub mod number;
pub mod pages;
pub mod paper;
pub mod parameters;
pub mod patterns;
pub mod plan;
pub mod plausibility;
pub mod poses;
pub mod provenance;
pub mod readings;
pub mod repeated;
pub mod self_calibration;
pub mod simulation;
pub mod statements;
#[cfg(feature = "fleet")]
pub mod study;
pub mod table;
pub mod trace;
pub mod uniqueness;
pub mod validate;
pub mod volumetric;
