//! Printed pages, read back: every equation of a page in text, LaTeX and Typst is evaluated in its order, and the last
//! ones are the reading and its derivatives. The table of symbols has every name of the page, with its unit.

mod values;

use std::collections::{BTreeMap, BTreeSet};

use abbe_codegen::evaluate::evaluate_f64;
use abbe_codegen::print::Style;
use abbe_codegen::program::Input;
use abbe_codegen::{Arrangement, Equation, Kind, Options, Order, Source, Symbols, ToolPoint, Variable, check};
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::driver::DriverPart;
use abbe_model::frames::Rotation;
use rand::{RngExt, SeedableRng};

use crate::effects::{Bar, every_shape};
use crate::probe::{Touch, errors};
use crate::support::{Chapter5, eight, hermle};
use crate::topologies::{AnyBar, CODES, all_errors, machine};

#[derive(Clone, Debug, PartialEq)]
enum Token {
    Number(f64),
    Name(String),
    Function(&'static str),
    Open,
    Close,
    Comma,
    Plus,
    Minus,
    Times,
    Over,
    Power,
}

const FUNCTIONS: [&str; 8] = ["sin", "cos", "exp", "sgn", "step", "floor", "round", "sqrt"];
const GREEK: [(&str, &str); 4] = [("theta", "θ"), ("delta", "δ"), ("Delta", "Δ"), ("sigma", "σ")];

/// A name without the marks of any notation.
fn canonical(text: &str) -> String {
    let mut text = text.replace('′', "'");
    for (word, letter) in GREEK {
        text = text.replace(&format!("\\{word}"), letter);
        text = text.replace(&format!("{word}_"), &format!("{letter}_"));
    }
    for word in ["\\mathrm", "\\frac", "frac(", "upright"] {
        text = text.replace(word, "");
    }
    text.chars().filter(|c| !"_{}()\\,.\" ²/∂".contains(*c)).collect()
}

/// The tokens of an expression of any of the three notations.
fn tokens(text: &str) -> Vec<Token> {
    let characters: Vec<char> = text.chars().collect();
    let mut tokens = Vec::new();
    let mut at = 0;
    while at < characters.len() {
        let rest: String = characters[at..].iter().collect();
        let starts = |word: &str| rest.starts_with(word);
        let (taken, token) = match characters[at] {
            ' ' | '\n' => (1, None),
            '+' => (1, Some(Token::Plus)),
            '-' | '−' => (1, Some(Token::Minus)),
            '·' => (1, Some(Token::Times)),
            '/' => (1, Some(Token::Over)),
            '^' => (1, Some(Token::Power)),
            '²' => {
                tokens.push(Token::Power);
                (1, Some(Token::Number(2.0)))
            }
            '√' => (1, Some(Token::Function("sqrt"))),
            '⌊' => {
                tokens.push(Token::Function("floor"));
                (1, Some(Token::Open))
            }
            '(' | '{' => (1, Some(Token::Open)),
            ')' | '}' | '⌋' => (1, Some(Token::Close)),
            ',' => (1, Some(Token::Comma)),
            'π' => (1, Some(Token::Number(std::f64::consts::PI))),
            c if c.is_ascii_digit() => {
                let digits = |c: &&char| c.is_ascii_digit() || **c == '.';
                let mut count = characters[at..].iter().take_while(digits).count();
                // A mantissa with its exponent, in plain text.
                if characters.get(at + count) == Some(&'e')
                    && characters.get(at + count + 1).is_some_and(|c| c.is_ascii_digit() || *c == '-')
                {
                    count += 2 + characters[at + count + 2..].iter().take_while(|c| c.is_ascii_digit()).count();
                }
                let number: String = characters[at..at + count].iter().collect();
                (count, Some(Token::Number(number.parse().expect("a number"))))
            }
            '\\' if starts("\\(") => (2, Some(Token::Open)),
            '\\' if starts("\\)") => (2, Some(Token::Close)),
            '\\' if starts("\\/") => (2, Some(Token::Over)),
            '\\' if starts("\\bigl") || starts("\\bigr") => (5, None),
            '\\' if starts("\\cdot") => (5, Some(Token::Times)),
            '\\' if starts("\\pi") => (3, Some(Token::Number(std::f64::consts::PI))),
            '\\' if starts("\\frac") => (5, Some(Token::Function("frac"))),
            '\\' if starts("\\operatorname{") => {
                let (word, _) = rest["\\operatorname{".len()..].split_once('}').expect("its end");
                let known = FUNCTIONS.into_iter().find(|known| *known == word).expect("a function");
                ("\\operatorname{}".len() + word.len(), Some(Token::Function(known)))
            }
            _ => {
                let name = name(&characters[at..]);
                let word = name.trim_start_matches('\\').trim_matches('"');
                let known = FUNCTIONS.into_iter().find(|known| *known == word);
                let known = known.or_else(|| (word == "sign").then_some("sgn"));
                let token = match (word, known) {
                    (_, Some(known)) => Token::Function(known),
                    ("frac", _) => Token::Function("frac"),
                    ("dot", _) => Token::Times,
                    ("pi", _) => Token::Number(std::f64::consts::PI),
                    _ => Token::Name(canonical(&name)),
                };
                (name.chars().count(), Some(token))
            }
        };
        tokens.extend(token);
        at += taken;
    }
    tokens
}

/// A name with its subscripts at the start of a text.
fn name(text: &[char]) -> String {
    let mut at = 0;
    let until = |from: usize, last: char| from + text[from..].iter().position(|c| *c == last).expect("its end") + 1;
    while at < text.len() {
        let starts = |word: &str| word.chars().enumerate().all(|(k, c)| text.get(at + k) == Some(&c));
        at = match text[at] {
            '\\' if starts("\\mathrm{") => until(at, '}'),
            // An abbreviated sine: `upright(s) theta_"a"`.
            'u' if starts("upright(") => until(at, ')') + 1,
            '\\' if text.get(at + 1).is_some_and(char::is_ascii_alphabetic) => {
                at + 1 + text[at + 1..].iter().take_while(|c| c.is_ascii_alphabetic()).count()
            }
            '"' => until(at + 1, '"'),
            '_' => match text.get(at + 1) {
                Some('{') => {
                    let mut depth = 0;
                    let end = text[at + 1..].iter().position(|c| {
                        depth += i32::from(*c == '{') - i32::from(*c == '}');
                        depth == 0
                    });
                    at + 1 + end.expect("its end") + 1
                }
                Some('(') => until(at, ')'),
                Some('"') => until(at + 2, '"'),
                _ => at + 2,
            },
            c if c.is_alphabetic() || c.is_ascii_digit() || c == '\'' || c == '′' => at + 1,
            '.' if text.get(at + 1).is_some_and(|c| c.is_alphabetic()) => at + 1,
            _ => break,
        };
    }
    assert!(at > 0, "{:?}", text.iter().collect::<String>());
    text[..at].iter().collect()
}

/// Evaluates tokens; products may have no sign.
struct Reader<'t> {
    tokens: &'t [Token],
    names: &'t BTreeMap<String, f64>,
    used: &'t mut BTreeSet<String>,
}

impl Reader<'_> {
    fn next_is(&mut self, token: &Token) -> bool {
        let is = self.tokens.first() == Some(token);
        if is {
            self.tokens = &self.tokens[1..];
        }
        is
    }

    fn sum(&mut self) -> f64 {
        let sign = if self.next_is(&Token::Minus) { -1.0 } else { 1.0 };
        let mut sum = sign * self.term();
        loop {
            if self.next_is(&Token::Plus) {
                sum += self.term();
            } else if self.next_is(&Token::Minus) {
                sum -= self.term();
            } else {
                return sum;
            }
        }
    }

    fn term(&mut self) -> f64 {
        let mut product = self.factor();
        loop {
            if self.next_is(&Token::Times) {
                product *= self.factor();
            } else if self.next_is(&Token::Over) {
                product /= self.factor();
            } else {
                match self.tokens.first() {
                    Some(Token::Number(_) | Token::Name(_) | Token::Function(_) | Token::Open) => {
                        product *= self.factor();
                    }
                    _ => return product,
                }
            }
        }
    }

    fn factor(&mut self) -> f64 {
        let mut value = self.primary();
        while self.next_is(&Token::Power) {
            let power = self.primary();
            value = if power == 2.0 { value * value } else { value.powf(power) };
        }
        value
    }

    fn primary(&mut self) -> f64 {
        let (first, rest) = self.tokens.split_first().expect("an operand");
        self.tokens = rest;
        match first {
            Token::Number(value) => *value,
            Token::Minus => -self.primary(),
            Token::Name(name) => {
                self.used.insert(name.clone());
                *self.names.get(name).unwrap_or_else(|| panic!("{name} among {:?}", self.names.keys()))
            }
            Token::Open => {
                let value = self.sum();
                assert!(self.next_is(&Token::Close), "{:?}", self.tokens);
                value
            }
            Token::Function("frac") => {
                assert!(self.next_is(&Token::Open));
                let above = self.sum();
                // `{a}{b}` or `(a, b)`.
                if !self.next_is(&Token::Comma) {
                    assert!(self.next_is(&Token::Close) && self.next_is(&Token::Open));
                }
                let below = self.sum();
                assert!(self.next_is(&Token::Close));
                above / below
            }
            Token::Function(function) => {
                let x = self.primary();
                match *function {
                    "sin" => x.sin(),
                    "cos" => x.cos(),
                    "exp" => x.exp(),
                    "sqrt" => x.sqrt(),
                    "floor" => x.floor(),
                    "round" => x.round(),
                    "step" => f64::from(u8::from(x >= 0.0)),
                    "sgn" => f64::from(u8::from(x > 0.0)) - f64::from(u8::from(x < 0.0)),
                    other => panic!("{other}"),
                }
            }
            other => panic!("{other:?} before {:?}", self.tokens),
        }
    }
}

/// The equations of a page: left, right and remark.
fn statements(page: &str, language: &str) -> Vec<(String, String, String)> {
    let mut rows = Vec::new();
    match language {
        "text" => {
            let (page, _) = page.split_once("\nsymbols\n").expect("symbols");
            for line in page.lines().skip(2).filter(|line| line.starts_with("  ")) {
                match [" = ", " ≈ "].iter().find_map(|relation| line.split_once(relation)) {
                    Some((left, right)) => rows.push((left.trim().to_string(), right.to_string())),
                    None => rows.last_mut().expect("a first line").1.push_str(line),
                }
            }
        }
        "latex" => {
            for part in page.split("\\begin{align*}\n").skip(1) {
                let (part, _) = part.split_once("\n\\end{align*}").expect("its end");
                let part = part.replace("\\notag", "").replace("\\\\\n  &\\qquad {}", " ");
                for row in part.split("\\\\\n") {
                    let halves = ["&=", "&\\approx"].iter().find_map(|relation| row.split_once(relation));
                    let (left, right) = halves.unwrap_or_else(|| panic!("{row}"));
                    rows.push((left.trim().to_string(), right.to_string()));
                }
            }
        }
        _ => {
            for part in page.split("$\n").skip(1).step_by(2) {
                let part = part.replace(" \\\n  & quad ", " ");
                for row in part.trim_end().split(" \\\n") {
                    let halves = ["&=", "&approx"].iter().find_map(|relation| row.split_once(relation));
                    let (left, right) = halves.unwrap_or_else(|| panic!("{row}"));
                    rows.push((left.trim().to_string(), right.to_string()));
                }
            }
        }
    }
    let without_remark = |(left, right): (String, String)| {
        let marks = ["   (not observable", "   (a constant multiple", "\\quad\\text{", " quad #["];
        let mark = marks.into_iter().find_map(|mark| right.find(mark));
        let (right, remark) = right.split_at(mark.unwrap_or(right.len()));
        (left, right.to_string(), remark.to_string())
    };
    rows.into_iter().map(without_remark).collect()
}

/// Rows of the table of symbols: canonical names, meaning and unit; by tables.
fn symbols(page: &str, language: &str) -> Vec<Vec<(Vec<String>, String, String)>> {
    let names = |names: &str| names.split(", ").map(canonical).collect::<Vec<String>>();
    match language {
        "text" => {
            let (_, table) = page.split_once("\nsymbols\n").expect("symbols");
            let rows = table.lines().take_while(|line| line.starts_with("  ")).map(|line| {
                let words: Vec<&str> = line.split_whitespace().collect();
                let count = words.iter().take_while(|word| word.ends_with(',')).count() + 1;
                let own = words[..count].iter().map(|word| canonical(word));
                (own.collect(), words[count + 1..].join(" "), words[count].to_string())
            });
            vec![rows.collect()]
        }
        "latex" => {
            let tables = page.split("  \\midrule\n").skip(1).map(|table| {
                let (table, _) = table.split_once("  \\bottomrule").expect("its end");
                let rows = table.lines().map(|line| {
                    let cells: Vec<&str> = line.trim().trim_end_matches(" \\\\").split(" & ").collect();
                    let own = names(&cells[0].replace(",\\ ", ", ").replace('$', ""));
                    (own, cells[1].replace("\\allowbreak{}", ""), cells[2].to_string())
                });
                rows.collect()
            });
            tables.collect()
        }
        _ => {
            let tables = page.split("[Unit], table.hline(stroke: 0.5pt),\n").skip(1).map(|table| {
                let (table, _) = table.split_once("  table.hline(),\n)").expect("its end");
                let rows = table.lines().map(|line| {
                    let line = line.trim().trim_start_matches('[').trim_end_matches("],");
                    let cells: Vec<&str> = line.split("], [").collect();
                    (names(&cells[0].replace('$', "")), cells[1].to_string(), cells[2].to_string())
                });
                rows.collect()
            });
            tables.collect()
        }
    }
}
