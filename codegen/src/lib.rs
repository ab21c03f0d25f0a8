//! Closed-form equations of readings: the model's kinematic chain evaluated over symbols instead of numbers.
//!
//! - [`symbol`]: named symbols, and the arena that holds their expressions and derivatives;
//! - [`variable`], [`subject`], [`session`]: the meaning of a symbol, and the quantity that an equation describes;
//! - [`effect`]: declared effects, their coefficients and drivers;
//! - [`mod@evaluate`]: evaluation of expressions over numbers;
//! - [`polynomial`], [`normal_form`]: the exact normal form, in which equality is decided;
//! - [`equation`]: the closed form of a reading, with its named vectors;
//! - [`first_order`]: its first-order form, as a table of sensitivities; [`check`]: the check before an equation is written;
//! - [`program`], [`mod@print`]: an equation as a sequence of steps, and in a language.
//!
//! The sensitivity of the C test with the extension bar to the location error EX0C, to first order: ∂L/∂EX0C = −R·sin C/L₀.
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

pub use effect::Coefficient;
pub use equation::{Equation, Form, Kind, Options, Order};
pub use error::CodegenError;
pub use evaluate::VariableValue;
pub use normal_form::Ring;
pub use polynomial::Polynomial;
pub use print::Language;
pub use session::SessionTest;
pub use subject::{Source, Subject, ToolPoint};
pub use symbol::{Arena, Operand, Symbol};
pub use variable::{Symbols, Variable};
