//! Results as tables, figures and text. Nothing here computes a result, prints one, or knows an option.
//!
//! - [`block`]: a report as blocks; [`table`]: a table as data; [`number`]: digits and units; [`figure`]: plots;
//! - one file per result: [`fit`], [`base`], [`trace`], [`validate`], [`plan`], [`next`], [`mod@poses`], [`method`],
//!   [`repeated`], [`self_calibration`], [`simulation`], [`patterns`], [`volumetric`], [`compare`], [`compensate`],
//!   [`compensation`], [`export`], [`import`], [`nc`], `history`, `run`;
//! - parts of several results: [`statements`], [`quality`], [`parameters`], [`effects`], [`confounded`],
//!   [`cross_validation`], [`circular`], [`conformity`], [`plausibility`], [`mod@pointing`], [`effect`], [`uniqueness`], [`readings`],
//!   [`session`], [`commands`], [`provenance`];
//! - [`paper`]: the parts of `abbe paper`.

pub mod base;
pub mod block;
pub mod circular;
pub mod commands;
pub mod compare;
pub mod compensate;
pub mod compensation;
pub mod conformity;
pub mod confounded;
pub mod cross_validation;
pub mod effect;
pub mod effects;
pub mod export;
pub mod figure;
pub mod fit;
#[cfg(feature = "fleet")]
pub mod history;
pub mod import;
pub mod method;
pub mod nc;
pub mod next;
pub mod number;
pub mod paper;
pub mod parameters;
pub mod patterns;
pub mod plan;
pub mod plausibility;
pub mod pointing;
pub mod poses;
pub mod positioning;
pub mod provenance;
pub mod quality;
pub mod readings;
pub mod repeated;
#[cfg(feature = "fleet")]
pub mod run;
pub mod self_calibration;
pub mod session;
pub mod simulation;
pub mod statements;
pub mod straightness;
#[cfg(feature = "fleet")]
pub mod table;
pub mod trace;
pub mod uniqueness;
pub mod validate;
mod validate_plots;
pub mod volumetric;
