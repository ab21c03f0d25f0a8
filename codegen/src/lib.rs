//! Closed-form equations of readings: the model's kinematic chain evaluated over symbols instead of numbers.
//!
//! In the order in which one module builds on the other:
//!
//! - [`Variable`], [`Coefficient`], [`DriverQuantity`](abbe_model::driver::DriverQuantity): the meaning of
//!   a symbol; [`symbol`]: the arena of expressions, and [`evaluate`](mod@evaluate);
//! - [`polynomial`], [`normal_form`]: the exact normal form, in which equality is decided; [`first_order`]: its table
//!   of sensitivities;
//! - [`Tree`], [`program`]: an equation as a sequence of steps; [`vectors`], [`touch`]: its named quantities;
//! - [`Source`], [`SessionTest`]: where a reading comes from; [`form`], [`equation`]: its closed form, as data;
//! - [`check`](mod@check): the comparison with dual numbers; [`print`](mod@print): the languages in which a checked
//!   equation is printed;
//! - [`nc`]: NC programs of planned tests.
//!
//! The sensitivity of the C test with the extension bar to the location error EX0C, to first order: ∂L/∂EX0C = −R·sin
//! C/L₀.
//!
//! ```
//! use std::path::Path;
//!
//! use abbe_codegen::print::Style;
//! use abbe_codegen::{Equation, Options, Order, SessionTest, check, language};
//! use abbe_model::component::ErrorName;
//! use abbe_files::ReadOptions;
//!
//! let plan = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/chapter5.toml");
//! let session = abbe_files::session(&plan, &ReadOptions::default())?;
//! let test = session.tests.iter().find(|test| test.name == "C150").unwrap();
//! let errors = [ErrorName::parse("EX0C").unwrap()];
//! let options = Options { order: Order::First, ..Options::default() };
//! let source = SessionTest::new(&session, test)?;
//! let equation = Equation::of(&session.machine, &source, &errors, &options)?;
//! let text = language("text")?.print(&check(&equation, &source)?, &Style::default())?;
//! assert!(text.contains("∂L/∂e_x0c = −R·s_c/L_0"), "{text}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

pub mod check;
mod coefficient;
mod collect;
mod constant;
mod effect;
pub mod equation;
pub mod error;
pub mod evaluate;
mod factored;
pub mod first_order;
mod follow;
pub mod form;
pub mod nc;
pub mod normal_form;
pub mod polynomial;
pub mod print;
pub mod program;
mod residue;
mod run;
mod session;
mod subject;
pub mod symbol;
pub mod touch;
mod tree;
mod truncation;
mod variable;
pub mod vectors;

pub use check::{Checked, check};
pub use coefficient::Coefficient;
pub use equation::Equation;
pub use evaluate::VariableValue;
pub use form::{Arrangement, Form, Kind, Options, Order};
pub use normal_form::Ring;
pub use polynomial::Polynomial;
pub use print::{LANGUAGES, OutputLanguage, language};
pub use session::SessionTest;
pub use subject::{Source, Subject, ToolPoint};
pub use symbol::{Arena, Operand, Symbol};
pub use tree::Tree;
pub use variable::{Symbols, Variable, identifier};
