//! Results as tables, figures and text. Nothing here computes a result, prints one, or knows an option.
//!
//! - [`block`]: a report as blocks; [`table`]: a table as data; [`number`]: digits and units; [`figure`]: plots;
//! - one file per result: [`fit`], [`trace`], [`validate`], [`plan`], [`next`], [`mod@poses`], [`method`], [`repeated`],
//!   [`self_calibration`], [`simulation`], [`patterns`], [`volumetric`], [`compare`], [`compensate`], [`export`], [`import`],
//!   [`nc`], `history`, `run`;
//! - parts of several results: [`statements`], [`quality`], [`parameters`], [`effects`], [`confounded`], [`standards`],
//!   [`conformity`], [`plausibility`], [`readings`], [`session`], [`commands`], [`provenance`];
//! - [`paper`]: the parts of `abbe paper`.

pub mod block;
pub mod commands;
pub mod compare;
pub mod compensate;
pub mod conformity;
pub mod confounded;
pub mod effects;
pub mod export;
pub mod figure;
pub mod fit;
pub mod frames;
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
pub mod poses;
pub mod provenance;
pub mod quality;
pub mod readings;
pub mod repeated;
#[cfg(feature = "fleet")]
pub mod run;
pub mod self_calibration;
pub mod session;
pub mod simulation;
pub mod standards;
pub mod statements;
pub mod table;
pub mod trace;
pub mod validate;
pub mod volumetric;
