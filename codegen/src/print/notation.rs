//! Notation of an article in a language for readers: how it spells names and expressions.

use crate::equation::Equation;
use crate::form::{Arrangement, Kind, Options};
use crate::print::article::line::LeftSide;
use crate::print::dialect::{Dialect, PRODUCT};
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
    /// An abbreviated function of an angle: `cθ_a`.
    fn abbreviated(&self, function: &str, angle: &str) -> String {
        format!("{function}{angle}")
    }
    /// A root whose argument can break across lines.
    fn long_root(&self, argument: &str) -> String {
        self.call(Unary::Sqrt, argument)
    }
    /// A quotient on the line; both parts have the necessary parentheses.
    fn inline_quotient(&self, a: &str, b: &str) -> String {
        format!("{a}/{b}")
    }
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
    /// The names of the coordinates or channels.
    pub(crate) names: &'a [&'static str],
    /// Whether sine and cosine of an axis are `sθ_a` and `cθ_a`, as in single equations of the literature.
    pub(crate) angles: bool,
}

impl<'a, N: Notation> Spelling<'a, N> {
    /// The names of an equation.
    pub(crate) fn new(notation: &'a N, program: &'a Program, equation: &'a Equation) -> Self {
        let Options { symbols, arrangement, .. } = equation.options;
        let angles = arrangement != Arrangement::Frames;
        Spelling { notation, program, symbols, kind: equation.kind, names: &equation.names, angles }
    }

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
            Variable::Position { .. } if self.angles => self.notation.abbreviated(letter, &self.variable(of)),
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
    pub(crate) fn label(&self, label: &Label) -> String {
        match label {
            Label::Vector { letter, frame, prime, coordinate } => {
                self.notation.coordinate(letter, *prime, frame, ["x", "y", "z"][*coordinate])
            }
            Label::Scalar(name) => (*name).to_string(),
            Label::Quantity(variable) => self.variable(variable),
            Label::Temporary(number) => self.notation.subscripted("t", &number.to_string()),
        }
    }

    pub(crate) fn output(&self, index: usize) -> String {
        let coordinate = |letter: &str| {
            let letter = self.notation.letter(letter);
            self.notation.coordinate(&letter, false, "", self.names[index])
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
    fn long_root(&self, argument: &str) -> String {
        self.notation.long_root(argument)
    }
    fn inline_quotient(&self, a: &str, b: &str) -> String {
        self.notation.inline_quotient(a, b)
    }
    fn square(&self, factor: &str) -> Option<String> {
        Some(self.notation.square(factor))
    }
    fn keeps_order(&self) -> bool {
        false
    }
}

/// A number with at most twelve digits: 0.6 where nominal lengths give 0.5999999999999996. A very small or large one is
/// written by `scientific`, from its mantissa and its exponent.
pub(crate) fn decimal(value: f64, scientific: impl Fn(&str, &str) -> String) -> String {
    let text = format!("{value:.11e}");
    let value: f64 = text.parse().unwrap_or(value);
    if value == 0.0 || (1e-4..1e12).contains(&value.abs()) {
        return format!("{value}");
    }
    match format!("{value:e}").split_once('e') {
        Some((mantissa, exponent)) => scientific(mantissa, exponent),
        None => text,
    }
}

/// A product without a sign between the factors; `dot` separates digits, which a space alone would join to one number.
pub(crate) fn juxtaposed(a: &str, b: &str, dot: &str) -> String {
    if a.ends_with(|c: char| c.is_ascii_digit()) && b.starts_with(|c: char| c.is_ascii_digit()) {
        format!("{a}{dot}{b}")
    } else {
        format!("{a}{PRODUCT}{b}")
    }
}
