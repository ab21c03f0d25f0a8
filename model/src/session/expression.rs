//! Lengths in a session: numbers, or expressions in the session's constants.

use crate::scalar::Nominal;

/// A named length of a session.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// Its name, the symbol in equations: `R`, `Z_CA`.
    pub name: String,
    /// Its value, mm.
    pub mm: f64,
    /// Its meaning in words, as tables of symbols print it.
    pub means: Option<String>,
}

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

/// Largest length of an expression, characters.
const MAX_CHARACTERS: usize = 400;
/// Largest nesting depth of parentheses, signs and roots.
const MAX_DEPTH: usize = 40;

impl Length {
    /// Evaluates the length over any nominal type; `constant` gives the value of a named constant.
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

    /// Number of numbers and names in the expression.
    fn size(&self) -> usize {
        match self {
            Length::Number(_) | Length::Constant(_) => 1,
            Length::Negative(a) | Length::Root(a) => a.size(),
            Length::Sum(a, b) | Length::Difference(a, b) | Length::Product(a, b) | Length::Quotient(a, b) => {
                a.size() + b.size()
            }
        }
    }

    /// Parses numbers, names, `+ - * /`, `^2`, `sqrt( )` and parentheses.
    ///
    /// ```
    /// use abbe_model::session::expression::Length;
    ///
    /// let known = ["R", "L"];
    /// let length = Length::parse("-sqrt(L^2 - R^2)", &known)?;
    /// let value = length.evaluate(&|name: &str| if name == "R" { 100.0 } else { 150.0 });
    /// assert!((value + 111.8033988749895).abs() < 1e-12);
    /// # Ok::<(), String>(())
    /// ```
    ///
    /// # Errors
    /// The message tells what was found and where, or which constant is not among the `known` ones.
    pub fn parse(text: &str, known: &[&str]) -> Result<Length, String> {
        let characters: Vec<char> = text.chars().collect();
        if characters.len() > MAX_CHARACTERS {
            return Err(format!("an expression of {} characters; the limit is {MAX_CHARACTERS}", characters.len()));
        }
        let mut reader = Reader { characters, position: 0, depth: 0, known };
        let length = reader.sum()?;
        match reader.peek() {
            None => Ok(length),
            Some(found) => Err(format!("`{found}` where the expression should end")),
        }
    }
}

struct Reader<'a> {
    characters: Vec<char>,
    position: usize,
    depth: usize,
    known: &'a [&'a str],
}

impl Reader<'_> {
    /// The next character that is not a space.
    fn peek(&mut self) -> Option<char> {
        while self.characters.get(self.position).is_some_and(|c| c.is_whitespace()) {
            self.position += 1;
        }
        self.characters.get(self.position).copied()
    }

    fn accept(&mut self, expected: char) -> bool {
        let found = self.peek() == Some(expected);
        self.position += usize::from(found);
        found
    }

    fn sum(&mut self) -> Result<Length, String> {
        let mut left = self.product()?;
        loop {
            if self.accept('+') {
                left = Length::Sum(Box::new(left), Box::new(self.product()?));
            } else if self.accept('-') || self.accept('−') {
                left = Length::Difference(Box::new(left), Box::new(self.product()?));
            } else {
                return Ok(left);
            }
        }
    }

    fn product(&mut self) -> Result<Length, String> {
        let mut left = self.signed()?;
        loop {
            if self.accept('*') || self.accept('·') {
                left = Length::Product(Box::new(left), Box::new(self.signed()?));
            } else if self.accept('/') {
                left = Length::Quotient(Box::new(left), Box::new(self.signed()?));
            } else {
                return Ok(left);
            }
        }
    }

    fn signed(&mut self) -> Result<Length, String> {
        if self.accept('-') || self.accept('−') {
            self.deeper()?;
            let inner = self.signed()?;
            self.depth -= 1;
            return Ok(Length::Negative(Box::new(inner)));
        }
        self.accept('+');
        self.power()
    }

    fn power(&mut self) -> Result<Length, String> {
        let base = self.factor()?;
        if !self.accept('^') {
            return Ok(base);
        }
        if base.size() > MAX_CHARACTERS {
            return Err("too many nested squares".into());
        }
        if self.accept('2') && !self.characters.get(self.position).is_some_and(|c| c.is_alphanumeric()) {
            return Ok(Length::Product(Box::new(base.clone()), Box::new(base)));
        }
        Err("`^` with a power other than 2; only squares are allowed".into())
    }

    fn factor(&mut self) -> Result<Length, String> {
        match self.peek() {
            None => Err("the expression ends where a number or a constant is expected".into()),
            Some('(') => self.parenthesis(),
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' => self.named(),
            Some(c) => Err(format!("`{c}` where a number or a constant is expected")),
        }
    }

    fn parenthesis(&mut self) -> Result<Length, String> {
        if !self.accept('(') {
            return Err("`sqrt` without `(`".into());
        }
        self.deeper()?;
        let inner = self.sum()?;
        self.depth -= 1;
        if self.accept(')') { Ok(inner) } else { Err("a `(` without its `)`".into()) }
    }

    fn number(&mut self) -> Result<Length, String> {
        let start = self.position;
        while let Some(&c) = self.characters.get(self.position) {
            let exponent = matches!(c, 'e' | 'E');
            let sign = matches!(c, '+' | '-') && matches!(self.characters[self.position - 1], 'e' | 'E');
            if !(c.is_ascii_digit() || c == '.' || exponent || (sign && self.position > start)) {
                break;
            }
            self.position += 1;
        }
        let text: String = self.characters[start..self.position].iter().collect();
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Length::Number(value)),
            _ => Err(format!("`{text}` is not a number")),
        }
    }

    fn named(&mut self) -> Result<Length, String> {
        let start = self.position;
        while self.characters.get(self.position).is_some_and(|c| c.is_alphanumeric() || *c == '_') {
            self.position += 1;
        }
        let name: String = self.characters[start..self.position].iter().collect();
        if name == "sqrt" {
            return Ok(Length::Root(Box::new(self.parenthesis()?)));
        }
        if self.known.contains(&name.as_str()) {
            return Ok(Length::Constant(name));
        }
        if self.known.is_empty() {
            return Err(format!("no constant `{name}`: the session has no [constants]"));
        }
        Err(format!("no constant `{name}`; the session's constants are {}", self.known.join(", ")))
    }

    fn deeper(&mut self) -> Result<(), String> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(format!("an expression nested deeper than {MAX_DEPTH}"));
        }
        Ok(())
    }
}
