//! Lengths as a session writes them: numbers, or expressions over the session's constants.

use crate::scalar::Nominal;

/// A length in mm as written: `0`, `"R"`, `"H - Z_CA"`, `"sqrt(L^2 - R^2)"`.
#[derive(Clone, Debug, PartialEq)]
pub enum Length {
    /// A number.
    Number(f64),
    /// One of the session's constants.
    Constant(String),
    /// −a
    Negative(Box<Length>),
    /// a + b
    Sum(Box<Length>, Box<Length>),
    /// a − b
    Difference(Box<Length>, Box<Length>),
    /// a · b
    Product(Box<Length>, Box<Length>),
    /// a / b
    Quotient(Box<Length>, Box<Length>),
    /// √a
    Root(Box<Length>),
}

impl Length {
    /// The value over any nominal type, `constant` giving that of a named constant.
    pub fn evaluate<N: Nominal>(&self, constant: &impl Fn(&str) -> N) -> N {
        match self {
            Length::Number(value) => N::constant(*value),
            Length::Constant(name) => constant(name),
            Length::Negative(a) => -a.evaluate(constant),
            Length::Sum(a, b) => a.evaluate(constant) + b.evaluate(constant),
            Length::Difference(a, b) => a.evaluate(constant) - b.evaluate(constant),
            Length::Product(a, b) => a.evaluate(constant) * b.evaluate(constant),
            Length::Quotient(a, b) => a.evaluate(constant) / b.evaluate(constant),
            Length::Root(a) => a.evaluate(constant).sqrt(),
        }
    }
}
