//! Plans, next tests, poses, clearances and set-up sheets.

pub mod collision;
pub mod command;
pub mod design_bound;
pub mod figures;
pub mod help;
pub mod instruments;
pub mod methods;
pub mod next;
pub mod next_session;
pub mod poses;
pub mod poses_in_contact;
pub mod powers;
pub mod rank;
pub mod safe_plans;
pub mod sheet;
#[path = "../../../model/tests/jacobians/topologies.rs"]
pub mod topologies;
pub mod uncertainty;
