//! What follows from an identified model: what to enter in a control, and how it is compared.
//!
//! - [`control`]: the controls and what each takes; [`compensation`]: identified error motions as tables of a control;
//! - [`correction`]: corrected commands;
//! - [`export`]: a model in the form of a control, a robot or a simulator; [`volumetric`]: the errors over the workspace;
//! - [`compare`]: two models or sessions of one machine;
//! - [`geometric`]: the methods of the literature that take circles apart, beside the fit.

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

pub mod compare;
pub mod compensation;
pub mod control;
pub mod correction;
pub mod error;
pub mod export;
pub mod geometric;
pub mod volumetric;
