//! Plan: what tests can see before anybody measures, and which test to make next.
//!
//! A plan has no data; it is given nominal readings at its planned states and becomes the same least-squares problem as a measured session, so
//! that there is one Jacobian in the house.
//!
//! - [`analyse`]: uncertainties, budgets, blind spots, indices, and what each test contributes;
//! - [`effects`]: what undeclared effects would do;
//! - [`menu`], [`mod@prepared`], [`information`], [`goal`], [`mod@improve`], [`mod@separate`]: the next test; [`mod@range`]: how far a sweep can shrink;
//! - [`states`], [`linear`], [`sensitivity`], [`budget`], [`blind`], [`indices`]: the parts of it;
//! - [`results`]: what is reported, as it stands in JSON.

mod analysis;
mod ball_positions;
pub mod budget;
pub mod candidate_information;
mod candidate_layout;
pub mod candidate_tests;
pub mod clearance;
pub mod criterion;
pub mod detectability;
pub mod effects;
pub mod identifiability;
pub mod improve;
pub mod indices;
pub mod information;
pub mod linear;
pub mod range;
mod ranking;
pub mod results;
pub mod sensitivity;
pub mod separate;
pub mod states;
mod sweep;

pub use analysis::{BAR_TRAVEL_MM, PlanOptions, analyse, analyse_problem, prepared};
pub use separate::{SeparatingTest, SeparationAnalysis, separating_tests, separation};
