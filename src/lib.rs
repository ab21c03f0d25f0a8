//! Abbe: a modelling workspace for the geometric errors of machine tools and other serial chains.
//!
//! The facade of seven crates. The command `abbe` is built on the same.
//!
//! | for | look in |
//! |---|---|
//! | a program that fits, traces, simulates or prints an equation | [`prelude`] |
//! | the machine, instruments, effects, sessions | [`model`] |
//! | their files: machines, sessions, tables of readings, robots | [`files`] |
//! | estimates, uncertainty, saved models | [`identify`] |
//! | the trace of unmodelled effects, the validation of a model | [`trace`] |
//! | what a set of readings would say: identifiability, next test, poses | [`plan`] |
//! | what follows from an identified model: correction, export, comparison, history | [`apply`] |
//! | closed forms and their languages | [`codegen`] |
//! | an analysis by its name: options → result → document, report, tables | [`analysis`] |
//! | results as JSON documents, parameters of equations by name | [`document`], [`equation`] |
//! | exports of a model | [`exports`] |
//! | foreign files of readings as a session | [`import`] |
//! | a fit as a digital calibration certificate | [`certificate`] |
//! | many sessions of many machines | [`fleet`] |
//!
//! The change that a simulated error of 10 µm makes is what the equation of the same test says, −R·sin C/L₀:
//!
//! ```
//! use abbe::identify::patterns::patterns;
//! use abbe::prelude::*;
//!
//! let plan = concat!(env!("CARGO_MANIFEST_DIR"), "/sessions/hermle-c600u/chapter5.toml");
//! let session = read_session(plan)?;
//! let test = session.tests.iter().position(|test| test.name == "C150").unwrap();
//!
//! let source = SessionTest::new(&session, &session.tests[test])?;
//! let options = EquationOptions { order: Order::First, ..EquationOptions::default() };
//! let equation = Equation::of(&session.machine, &source, &[ErrorName::parse("EX0C").unwrap()], &options)?;
//! let text = language("text")?.print(&check(&equation, &source)?, &Style::default())?;
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

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

// The printers name this library as the command does.
extern crate self as abbe;

pub use abbe_apply as apply;
pub use abbe_codegen as codegen;
pub use abbe_files as files;
pub use abbe_identify as identify;
pub use abbe_model as model;
pub use abbe_plan as plan;
pub use abbe_trace as trace;

#[doc(hidden)]
pub mod analysis;
pub mod certificate;
pub mod document;
pub mod equation;
pub mod exports;
#[cfg(feature = "fleet")]
pub mod fleet;
pub mod import;
#[doc(hidden)]
pub mod printers;
#[doc(hidden)]
pub mod report;
#[cfg(feature = "fleet")]
pub mod schemas;
#[cfg(feature = "fleet")]
pub mod temporary;

/// What a program needs to build or read a session, to simulate, fit, plan and trace it, and to print an equation.
pub mod prelude {
    use std::path::Path;

    pub use abbe_codegen::print::Style;
    pub use abbe_codegen::{Equation, Options as EquationOptions, Order, SessionTest, check, language};
    pub use abbe_files::read::add_node;
    pub use abbe_files::table::memory::MemoryColumn;
    pub use abbe_identify::fit::FitResult;
    pub use abbe_identify::quantity::Given;
    pub use abbe_identify::results::Estimate;
    pub use abbe_identify::simulate::{Simulated, Simulation, simulate};
    pub use abbe_model::Diagnostic;
    pub use abbe_model::chain::Machine;
    pub use abbe_model::component::ErrorName;
    pub use abbe_model::instrument::InstrumentKind;
    pub use abbe_model::session::Session;
    pub use abbe_plan::{PlanOptions, analyse};
    pub use abbe_trace::SessionFit;
    pub use abbe_trace::result::TraceResult;
    pub use abbe_trace::{Progress, TraceOptions, TraceOutcome, trace};

    /// Reads a session file and the machine and data that it names.
    ///
    /// # Errors
    /// [`Diagnostic`] with file, line and key of what cannot be used.
    pub fn read_session(file: impl AsRef<Path>) -> Result<Session, Diagnostic> {
        abbe_files::session(file.as_ref(), &abbe_files::ReadOptions::default())
    }
}
