//! Plan: which errors a set of tests identifies, before the measurement, and which test to add next.
//!
//! A plan has no data. It receives nominal readings at its planned states, and becomes the same least-squares problem
//! as a measured session. Fit and plan therefore share one Jacobian.
//!
//! - [`analyse`]: uncertainties, budgets, identifiability, indices, and the contribution of each test;
//! - [`effects`]: detectability and bias of undeclared effects; [`bias`]: the bias by each undeclared effect;
//! - [`variations`], [`candidates`], [`mod@improve`], [`separate`], [`aliases`],
//!   [`mod@proposal`]: the next test; [`mod@range`]: how far a sweep can shrink;
//! - [`states`], [`sensitivity`], [`budget`], [`indices`], [`structure`]: the parts of the analysis;
//! - [`design`]: the engine of optimal design behind next test, separating test and poses;
//! - [`mod@global`]: Sobol' indices of the estimates;
//! - [`collision`]: clearance of bar, holders and bodies along every test; [`poses`]: poses for a tracker;
//! - [`sheet`]: what an operator sets up;
//! - [`results`]: the results, as they are written to JSON.

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

pub mod aliases;
mod analysis;
mod ball_positions;
pub mod bias;
pub mod budget;
pub(crate) mod candidate_information;
mod candidate_layout;
mod candidate_motions;
pub mod candidates;
pub mod clearance;
pub mod collision;
pub mod design;
pub mod effects;
pub mod error;
pub mod global;
pub mod improve;
pub mod indices;
pub mod poses;
pub mod proposal;
pub mod range;
pub mod results;
pub mod sensitivity;
pub mod separate;
pub mod sheet;
mod statements;
pub mod states;
pub mod structure;
mod sweep;
pub mod variations;

pub use analysis::{PlanOptions, analyse, prepared};
pub use separate::{SeparatingTest, SeparationAnalysis, separating_tests, separation};
pub use statements::{PlanStatement, attainable};
