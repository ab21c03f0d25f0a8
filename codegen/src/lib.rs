//! Equations of readings: the closed form that the model's one kinematic chain yields for symbols in the place of numbers.
//!
//! - [`symbol`]: symbols with names, and the arena that holds their expressions and derivatives;
//! - [`variable`], [`subject`], [`session`]: what a symbol may stand for, what an equation is of;
//! - [`effect`]: declared effects, coefficients and what they follow;
//! - [`mod@evaluate`]: expressions at numbers;
//! - [`polynomial`], [`normal`]: the exact normal form, in which equality is decided;
//! - [`equation`]: the closed form of a reading, with its named vectors;
//! - [`first`]: its first order, as a table of sensitivities; [`check`]: what confirms it before it is written;
//! - [`program`], [`mod@print`]: as a sequence of steps, and in a language.
//!
//! What the C test with the extended bar sees of the position of C's axis, to first order: ∂L/∂EX0C = −R·sin C/L₀.
//!
//! ```
//! use std::path::Path;
//!
//! use abbe_codegen::{Equation, Language, Options, Order, SessionTest};
//! use abbe_model::component::ErrorName;
//! use abbe_model::session::read::{self, ReadOptions};
//!
//! let plan = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/chapter5.toml");
//! let session = read::session(&plan, &ReadOptions::default())?;
//! let test = session.tests.iter().find(|test| test.name == "C150").unwrap();
//! let errors = [ErrorName::parse("EX0C").unwrap()];
//! let options = Options { order: Order::First, ..Options::default() };
//! let equation = Equation::of(&session.machine, &SessionTest::new(&session, test)?, &errors, &options)?;
//! let text = equation.print(Language::Text)?;
//! assert!(text.contains("∂L/∂e_x0c = −R·s_c/L_0"), "{text}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod check;
mod collect;
pub mod effect;
pub mod equation;
pub mod error;
pub mod evaluate;
pub mod first_order;
mod forms;
pub mod normal_form;
pub mod polynomial;
pub mod print;
pub mod program;
mod run;
pub mod session;
pub mod subject;
pub mod symbol;
pub mod touch;
pub mod variable;
pub mod vectors;

pub use effect::{Coefficient, Followed};
pub use equation::{Equation, Form, Kind, Options, Order};
pub use error::CodegenError;
pub use evaluate::Value;
pub use normal_form::Ring;
pub use polynomial::Polynomial;
pub use print::Language;
pub use session::SessionTest;
pub use subject::{Source, Subject, ToolPoint};
pub use symbol::{Arena, Operand, Symbol};
pub use variable::{Symbols, Variable};
