//! Expressions on one line in any language, with the necessary parentheses.

use crate::symbol::{Binary, Unary};
use crate::tree::Tree;

/// Between two factors without a sign, until the page is complete: a place where a line can break.
pub(crate) const PRODUCT: char = '\u{2062}';

/// Notation of a language for the elements of expressions.
pub(crate) trait Dialect {
    /// A number that is not negative.
    fn number(&self, value: f64) -> String;
    /// The name of an input.
    fn input(&self, index: usize) -> String;
    /// The name of a step.
    fn step(&self, index: usize) -> String;
    /// A product of two factors that already have the necessary parentheses.
    fn product(&self, a: &str, b: &str) -> String;
    /// A quotient.
    fn quotient(&self, a: &str, b: &str) -> String;
    /// Whether [`Dialect::quotient`] sets a built-up fraction, whose parts need no parentheses.
    fn fractions(&self) -> bool {
        false
    }
    /// A function of an argument without parentheses.
    fn call(&self, function: Unary, argument: &str) -> String;
    /// A root whose argument can break across lines.
    fn long_root(&self, argument: &str) -> String {
        self.call(Unary::Sqrt, argument)
    }
    /// A quotient on the line; both parts have the necessary parentheses.
    fn inline_quotient(&self, a: &str, b: &str) -> String {
        self.quotient(a, b)
    }
    /// An expression in parentheses.
    fn group(&self, inside: &str) -> String {
        format!("({inside})")
    }
    /// The minus sign.
    fn minus(&self) -> &str {
        "-"
    }
    /// The square of a factor, if the language has a notation for it; otherwise the factor is multiplied by itself.
    fn square(&self, _factor: &str) -> Option<String> {
        None
    }
    /// Whether `a + (b + c)` keeps its parentheses: true for code, where the order affects rounding, false for readers.
    fn keeps_order(&self) -> bool {
        true
    }
}

/// Operator precedence of an expression.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Sum,
    Product,
    Atom,
}

/// The expression on one line.
pub(crate) fn write(tree: &Tree, dialect: &impl Dialect) -> String {
    bound(tree, dialect).0
}

/// The expression as a factor or as a term after a minus: in parentheses if it is a sum.
pub(crate) fn write_term(tree: &Tree, dialect: &impl Dialect) -> String {
    let (text, binding) = bound(tree, dialect);
    if binding < Binding::Product { dialect.group(&text) } else { text }
}

/// Breaks a sum into lines that are at most as wide as the first one, then the others, if possible. Breaks lie before a
/// plus or minus outside braces, in as few parentheses as the width allows; as a last resort roots and fractions are
/// written so that they break, and then products do. Every line except the first starts with its sign.
pub(crate) fn lines<D: Dialect>(
    terms: &[(bool, Tree)],
    dialect: &D,
    widths: [usize; 2],
    measure: impl Fn(&str) -> usize,
) -> Vec<String> {
    let fits = |lines: &[String]| {
        let widths = std::iter::once(widths[0]).chain(std::iter::repeat(widths[1]));
        lines.iter().zip(widths).all(|(line, width)| measure(line) <= width)
    };
    let lines = filled(&joined(terms, dialect), dialect, widths, 4, &measure);
    if fits(&lines) {
        return lines;
    }
    let fits_one = |text: &str| measure(text) <= widths[1] / 2;
    let loose = Loose { dialect, fits: &fits_one };
    let text = joined(terms, &loose);
    let lines = filled(&text, &loose, widths, 6, &measure);
    if fits(&lines) { lines } else { filled(&text, &loose, widths, 7, &measure) }
}

/// The terms on one line.
fn joined(terms: &[(bool, Tree)], dialect: &impl Dialect) -> String {
    let mut whole = String::new();
    for (index, (minus, tree)) in terms.iter().enumerate() {
        let sign = match (index, minus) {
            (0, false) => String::new(),
            (0, true) => dialect.minus().to_string(),
            (_, false) => " + ".to_string(),
            (_, true) => format!(" {} ", dialect.minus()),
        };
        // A nested sum needs parentheses only after a minus.
        let text = if *minus { write_term(tree, dialect) } else { write(tree, dialect) };
        whole.push_str(&sign);
        whole.push_str(&text);
    }
    whole
}

/// Fills lines with pieces that are as long as the width allows. The last of the depths of parentheses breaks products.
/// What must be broken inside its parentheses starts on a line of its own.
fn filled(
    text: &str,
    dialect: &impl Dialect,
    widths: [usize; 2],
    deepest: i32,
    measure: &impl Fn(&str) -> usize,
) -> Vec<String> {
    let width = widths[0].min(widths[1]);
    let mut pieces: Vec<(bool, String)> = split(text, dialect, 0).into_iter().map(|piece| (false, piece)).collect();
    for parentheses in 1..=deepest {
        let finer = |(alone, piece): (bool, String)| -> Vec<(bool, String)> {
            if measure(&piece) <= width {
                return vec![(alone, piece)];
            }
            let parts: Vec<String> = if parentheses == 7 {
                piece.split_inclusive(PRODUCT).map(str::to_string).collect()
            } else {
                split(&piece, dialect, parentheses)
            };
            let several = parts.len() > 1;
            parts.into_iter().enumerate().map(|(index, part)| ((alone || several) && index == 0, part)).collect()
        };
        pieces = pieces.into_iter().flat_map(finer).collect();
    }
    let mut lines: Vec<String> = Vec::new();
    for (alone, piece) in pieces {
        let width = widths[usize::from(lines.len() > 1)];
        match lines.last_mut() {
            Some(line) if !alone && measure(&format!("{line}{piece}")) <= width => line.push_str(&piece),
            Some(_) => lines.push(piece.trim_start().to_string()),
            None => lines.push(piece),
        }
    }
    lines
}

/// A notation whose roots and fractions break across lines, where they do not fit on one.
struct Loose<'d, D> {
    dialect: &'d D,
    fits: &'d dyn Fn(&str) -> bool,
}

impl<D: Dialect> Dialect for Loose<'_, D> {
    fn number(&self, value: f64) -> String {
        self.dialect.number(value)
    }
    fn input(&self, index: usize) -> String {
        self.dialect.input(index)
    }
    fn step(&self, index: usize) -> String {
        self.dialect.step(index)
    }
    fn product(&self, a: &str, b: &str) -> String {
        self.dialect.product(a, b)
    }
    fn quotient(&self, a: &str, b: &str) -> String {
        self.dialect.inline_quotient(a, b)
    }
    fn call(&self, function: Unary, argument: &str) -> String {
        match function {
            Unary::Sqrt if !(self.fits)(argument) => self.dialect.long_root(argument),
            other => self.dialect.call(other, argument),
        }
    }
    fn group(&self, inside: &str) -> String {
        self.dialect.group(inside)
    }
    fn minus(&self) -> &str {
        self.dialect.minus()
    }
    fn square(&self, factor: &str) -> Option<String> {
        self.dialect.square(factor)
    }
    fn keeps_order(&self) -> bool {
        self.dialect.keeps_order()
    }
}

/// Splits the text before each plus and minus that is in at most `parentheses` parentheses and in no braces.
fn split(text: &str, dialect: &impl Dialect, parentheses: i32) -> Vec<String> {
    let signs = [" + ".to_string(), format!(" {} ", dialect.minus())];
    let mut pieces = Vec::new();
    let (mut start, mut braces, mut depth) = (0, 0, 0);
    for (at, character) in text.char_indices() {
        match character {
            '{' => braces += 1,
            '}' => braces -= 1,
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        let sign = signs.iter().any(|sign| text[at..].starts_with(sign));
        if sign && braces == 0 && depth <= parentheses && at > start {
            pieces.push(text[start..at].to_string());
            start = at;
        }
    }
    pieces.push(text[start..].to_string());
    pieces
}

fn bound(tree: &Tree, dialect: &impl Dialect) -> (String, Binding) {
    let at_least = |tree: &Tree, least: Binding| {
        let (text, binding) = bound(tree, dialect);
        if binding < least { dialect.group(&text) } else { text }
    };
    match tree {
        Tree::Number(value) if *value < 0.0 => (format!("{}{}", dialect.minus(), dialect.number(-value)), Binding::Sum),
        Tree::Number(value) => (dialect.number(*value), Binding::Atom),
        Tree::Input(index) => (dialect.input(*index), Binding::Atom),
        Tree::Step(index) => (dialect.step(*index), Binding::Atom),
        Tree::Unary(Unary::Neg, a) => (format!("{}{}", dialect.minus(), at_least(a, Binding::Product)), Binding::Sum),
        Tree::Unary(function, a) => (dialect.call(*function, &write(a, dialect)), Binding::Atom),
        Tree::Binary(op, a, b) => match op {
            Binary::Add | Binary::Sub => {
                let keep = dialect.keeps_order() || *op == Binary::Sub;
                // A leading minus in the second operand needs its parentheses in every language.
                let (right, binding) = bound(b, dialect);
                let starts_with_minus = right.starts_with(dialect.minus());
                let right =
                    if binding == Binding::Sum && (keep || starts_with_minus) { dialect.group(&right) } else { right };
                let left = at_least(a, Binding::Sum);
                let sign = if *op == Binary::Add { "+" } else { dialect.minus() };
                (format!("{left} {sign} {right}"), Binding::Sum)
            }
            Binary::Mul => {
                // For readers the number comes first.
                if let (false, Tree::Binary(Binary::Mul, number, rest)) = (dialect.keeps_order(), &**b)
                    && matches!((&**number, &**a), (Tree::Number(_), Tree::Input(_) | Tree::Step(_)))
                {
                    let first = Tree::Binary(Binary::Mul, number.clone(), a.clone());
                    return bound(&Tree::Binary(Binary::Mul, Box::new(first), rest.clone()), dialect);
                }
                if a == b
                    && let Some(square) = dialect.square(&at_least(a, Binding::Atom))
                {
                    return (square, Binding::Product);
                }
                let left = at_least(a, Binding::Product);
                let right =
                    if dialect.keeps_order() { at_least(b, Binding::Atom) } else { at_least(b, Binding::Product) };
                (dialect.product(&left, &right), Binding::Product)
            }
            Binary::Div if dialect.fractions() => {
                (dialect.quotient(&write(a, dialect), &write(b, dialect)), Binding::Atom)
            }
            Binary::Div => {
                (dialect.quotient(&at_least(a, Binding::Product), &at_least(b, Binding::Atom)), Binding::Product)
            }
        },
    }
}
