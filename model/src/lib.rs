//! The model of a machine and its tests: a kinematic chain over an open scalar, its error components, the effects that drive them, and
//! the instruments that read it.
//!
//! - [`scalar`]: what a number may be; [`expression`]: a number that is not known yet;
//! - [`frames`], [`axis`], [`chain`]: points pushed through a machine;
//! - [`component`], [`effect`]: errors by name, and what makes them vary;
//! - [`instrument`]: from a state of the axes to a reading;
//! - [`sensitivity`]: readings and their derivatives by every component; [`replay`]: over columns of readings at once;
//! - [`session`]: machine, tests and readings as they stand in files.

pub mod axis;
pub mod chain;
pub mod code;
pub mod component;
pub mod effect;
pub mod error;
pub mod expression;
pub mod frames;
pub mod instrument;
pub mod replay;
pub mod scalar;
pub mod sensitivity;
pub mod session;

pub use error::ModelError;
