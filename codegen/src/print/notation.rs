//! Notation of an article in a language for readers: how it spells names and expressions.

use crate::form::Kind;
use crate::print::article::line::LeftSide;
use crate::print::dialect::Dialect;
use crate::program::{Input, Label, Program};
use crate::symbol::Unary;
use crate::variable::{Symbols, Variable};

/// How a language for readers spells names and operations. Arguments already have their parentheses where they need
/// them.
pub(crate) trait Notation {
    /// A number that is not negative.
    fn number(&self, value: f64) -> String;
    /// A letter, Greek or not, or a word in its place.
    fn letter(&self, text: &str) -> String {
        text.to_string()
    }
    /// A letter with a subscript.
    fn subscripted(&self, letter: &str, subscript: &str) -> String;
    /// A coordinate `x`, `y` or `z` of a vector in a frame; an empty frame is omitted.
    fn coordinate(&self, vector: &str, prime: bool, frame: &str, coordinate: &str) -> String;
    /// A variable.
    fn variable(&self, variable: &Variable, symbols: Symbols) -> String {
        let (letter, subscript) = variable.letter_and_subscript(symbols);
        match subscript.as_str() {
            "" => self.letter(&letter),
            subscript => self.subscripted(&self.letter(&letter), subscript),
        }
    }
    /// A product.
    fn product(&self, a: &str, b: &str) -> String;
    /// A quotient, as a built-up fraction if [`Notation::fractions`] holds.
    fn quotient(&self, a: &str, b: &str) -> String;
    /// Whether a quotient is a built-up fraction, whose parts need no parentheses.
    fn fractions(&self) -> bool {
        true
    }
    /// A function of an argument without parentheses.
    fn call(&self, function: Unary, argument: &str) -> String;
    /// An expression in parentheses.
    fn group(&self, inside: &str) -> String {
        format!("({inside})")
    }
    /// The minus sign.
    fn minus(&self) -> &str {
        "-"
    }
    /// The square of a factor.
    fn square(&self, factor: &str) -> String {
        format!("{factor}^2")
    }
    /// The sign of a partial derivative, with the space that separates it from a letter.
    fn partial(&self) -> &str;
}

/// The names of an article in a notation.
pub(crate) struct Spelling<'a, N> {
    pub(crate) notation: &'a N,
    pub(crate) program: &'a Program,
    pub(crate) symbols: Symbols,
    pub(crate) kind: Kind,
}

impl<N: Notation> Spelling<'_, N> {
    /// A variable.
    pub(crate) fn variable(&self, variable: &Variable) -> String {
        self.notation.variable(variable, self.symbols)
    }

    /// The names of a symbol in the table: those of sine and cosine for a rotary axis.
    pub(crate) fn names(&self, symbol: &Input, separator: &str) -> String {
        match symbol {
            Input::Plain(_) => self.symbol(symbol),
            Input::Sine(of) | Input::Cosine(of) => {
                let names = [Input::Sine(of.clone()), Input::Cosine(of.clone())];
                names.map(|name| self.symbol(&name)).join(separator)
            }
        }
    }

    /// The left-hand side of an equation.
    pub(crate) fn left(&self, left: &LeftSide) -> String {
        match left {
            LeftSide::Named(label) => self.label(label),
            LeftSide::Square(label) => self.notation.square(&self.label(label)),
            LeftSide::Output(index) => self.output(*index),
            LeftSide::Slope(index, parameter) => {
                let [output, parameter] = [self.output(*index), self.variable(parameter)];
                let part = |of: String| format!("{}{of}", self.notation.partial());
                self.notation.quotient(&part(output), &part(parameter))
            }
        }
    }

    /// An input, such as `s_a` for the sine of θ_a.
    fn symbol(&self, input: &Input) -> String {
        let turn = |letter: &str, function: Unary, of: &Variable| match of {
            Variable::Position { axis, .. } => self.notation.subscripted(letter, &axis.to_lowercase()),
            other => self.notation.call(function, &self.variable(other)),
        };
        match input {
            Input::Plain(variable) => self.variable(variable),
            Input::Sine(of) => turn("s", Unary::Sin, of),
            Input::Cosine(of) => turn("c", Unary::Cos, of),
        }
    }

    /// A step, such as `p_A.x` for a coordinate of the point p in the frame of A.
    fn label(&self, label: &Label) -> String {
        match label {
            Label::Vector { letter, frame, prime, coordinate } => {
                self.notation.coordinate(letter, *prime, frame, ["x", "y", "z"][*coordinate])
            }
            Label::Scalar(name) => (*name).to_string(),
            Label::Quantity(variable) => self.variable(variable),
            Label::Temporary(number) => self.notation.subscripted("t", &number.to_string()),
        }
    }

    fn output(&self, index: usize) -> String {
        let coordinate = |letter: &str| {
            let letter = self.notation.letter(letter);
            self.notation.coordinate(&letter, false, "", ["x", "y", "z"][index])
        };
        match self.kind {
            Kind::Length => "L".to_string(),
            Kind::Distance => "d".to_string(),
            Kind::Coordinates => coordinate("m"),
            Kind::Volumetric => coordinate("Δ"),
        }
    }
}

impl<N: Notation> Dialect for Spelling<'_, N> {
    fn number(&self, value: f64) -> String {
        self.notation.number(value)
    }
    fn input(&self, index: usize) -> String {
        self.symbol(&self.program.inputs[index])
    }
    fn step(&self, index: usize) -> String {
        self.label(&self.program.steps[index].label)
    }
    fn product(&self, a: &str, b: &str) -> String {
        self.notation.product(a, b)
    }
    fn quotient(&self, a: &str, b: &str) -> String {
        self.notation.quotient(a, b)
    }
    fn fractions(&self) -> bool {
        self.notation.fractions()
    }
    fn call(&self, function: Unary, argument: &str) -> String {
        self.notation.call(function, argument)
    }
    fn group(&self, inside: &str) -> String {
        self.notation.group(inside)
    }
    fn minus(&self) -> &str {
        self.notation.minus()
    }
    fn square(&self, factor: &str) -> Option<String> {
        Some(self.notation.square(factor))
    }
    fn keeps_order(&self) -> bool {
        false
    }
}

/// Rounds the last digits of a number: 0.6 where nominal lengths give 0.5999999999999996.
pub(crate) fn rounded(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// A product without a sign between the factors; `dot` separates digits, which a space alone would join to one number.
pub(crate) fn juxtaposed(a: &str, b: &str, dot: &str) -> String {
    let gap = if a.ends_with(|c: char| c.is_ascii_digit()) && b.starts_with(|c: char| c.is_ascii_digit()) {
        dot
    } else {
        " "
    };
    format!("{a}{gap}{b}")
}

/// The argument of a sine or cosine: in parentheses if it is more than one name.
pub(crate) fn of_sin_cos(notation: &impl Notation, argument: &str) -> String {
    if argument.contains([' ', '^']) || argument.starts_with(notation.minus()) {
        notation.group(argument)
    } else {
        argument.to_string()
    }
}
