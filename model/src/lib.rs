//! Model of a machine and its tests: a kinematic chain over an open scalar, its error components, the effects on them,
//! and the instruments.
//!
//! - [`scalar`]: numeric types of the chain; [`expression`]: the symbolic scalar;
//! - [`frames`], [`axis`], [`chain`]: transformation of points through a machine;
//! - [`component`], [`effect`], [`driver`]: names of errors, and their dependence on drivers; [`pattern`]: one name for
//!   several errors; [`parameter_id`]: what a parameter is;
//! - [`instrument`]: readings from states of the axes;
//! - [`sensitivity`]: readings and their derivatives by every component; [`replay`]: evaluation over columns of
//!   readings;
//! - [`session`]: machine, tests and readings; [`document`]: the keys of their files;
//! - [`median`]: the median; [`words`]: counts in messages; [`calendar`]: dates and times of day in texts; [`mod@unit`]: units.
//!
//! The chain over plain and dual numbers: the reading of a ball bar, and its derivative by a location error of C,
//! ∂L/∂EX0C = −R·sin C/L₀.
//!
//! ```
//! use abbe_model::chain::{AxisPosition, Machine};
//! use abbe_model::component::ErrorName;
//! use abbe_model::instrument::ballbar::BallBar;
//! use abbe_model::instrument::{Station, Target};
//! use abbe_model::scalar::Scalar;
//! use num_dual::Dual64;
//!
//! fn reading<S: Scalar<Nominal = f64>>(machine: &Machine, bar: &Station<f64>, c: f64, ex0c: S) -> S {
//!     let at = |name: &str| match name {
//!         "C" => c,
//!         "Z" => 75.0,
//!         _ => 0.0,
//!     };
//!     let state: Vec<_> = machine.axes.iter().map(|axis| AxisPosition::new(axis.kind, at(&axis.name))).collect();
//!     let slot = ErrorName::parse("EX0C").and_then(|name| machine.error_slot(&name));
//!     let errors = machine.body_errors(|each| Some(each) == slot, |_| ex0c);
//!     bar.read(machine, &state, &errors, |_| None).channels()[0]
//! }
//!
//! let machine = Machine::from_code("[wCAbYXZt]")?;
//! // Ball at R = 100 mm on the table, the other on the axis 75 mm above: L₀ = 125 mm.
//! let workpiece_ball = Target::on_table([0.0, 100.0, 0.0]);
//! let bar = BallBar { workpiece_ball, spindle_ball: Target::on_tool([0.0; 3]), bar: 125.0 };
//! let bar: Station<f64> = bar.into();
//! let c = 0.7_f64;
//! assert!((reading(&machine, &bar, c, 0.0_f64) - 125.0).abs() < 1e-12);
//! let with = reading(&machine, &bar, c, Dual64::from(0.0).derivative());
//! assert!((with.eps + 100.0 * c.sin() / 125.0).abs() < 1e-12);
//! # Ok::<(), abbe_model::Diagnostic>(())
//! ```

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

pub mod axis;
pub mod body;
pub mod calendar;
pub mod chain;
pub mod code;
pub mod component;
pub mod diagnostic;
pub mod document;
pub mod driver;
pub mod effect;
pub mod expression;
pub mod frames;
pub mod instrument;
pub mod median;
pub mod parameter_id;
pub mod pattern;
pub mod pose;
pub mod replay;
pub mod rotation_error;
pub mod scalar;
pub mod sensitivity;
pub mod session;
pub mod unit;
pub mod words;

pub use diagnostic::Diagnostic;
