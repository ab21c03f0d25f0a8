//! Abbe: a modelling workspace for the geometric errors of machine tools and other serial chains.
//!
//! The facade of three crates: [`model`] (chain, effects, instruments, sessions), [`identify`] (fit, trace, simulate)
//! and [`codegen`] (closed forms). The command `abbe` is built on the same.
//!
//! The three together: the change that a simulated error of 10 µm makes is what the equation of the same test says,
//! −R·sin C/L₀.
//!
//! ```
//! use std::path::Path;
//!
//! use abbe::codegen::{Equation, Options, Order, SessionTest, check, language};
//! use abbe::identify::patterns::patterns;
//! use abbe::identify::quantity::Given;
//! use abbe::model::component::ErrorName;
//! use abbe::model::files::{self, ReadOptions};
//!
//! let plan = Path::new(env!("CARGO_MANIFEST_DIR")).join("sessions/hermle-c600u/chapter5.toml");
//! let session = files::session(&plan, &ReadOptions::default())?;
//! let test = session.tests.iter().position(|test| test.name == "C150").unwrap();
//!
//! let source = SessionTest::new(&session, &session.tests[test])?;
//! let options = Options { order: Order::First, ..Options::default() };
//! let equation = Equation::of(&session.machine, &source, &[ErrorName::parse("EX0C").unwrap()], &options)?;
//! let text = language("text")?.print(&check(&equation, &source)?)?;
//! assert!(text.contains("∂L/∂e_x0c = −R·s_c/L_0"));
//!
//! let found = patterns(&session, &[Given::parse("EX0C=10um")?])?;
//! let c = session.machine.axis_index("C").unwrap();
//! let angles = &found.tests[test].1.positions[c];
//! for (c, change_um) in angles.iter().zip(&found.patterns[test].deviations_um) {
//!     assert!((change_um + 10.0 * 100.0 * c.sin() / 149.9946).abs() < 2e-3);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use abbe_codegen as codegen;
pub use abbe_identify as identify;
pub use abbe_model as model;
