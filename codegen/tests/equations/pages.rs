//! Printed pages, read back: every equation of a page in text, LaTeX and Typst is evaluated in its order, and the last
//! ones are the reading and its derivatives. The table of symbols has every name of the page, with its unit.

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

/// Prints an equation in three languages and reads it back.
fn read_back<S: Source>(machine: &Machine, source: &S, errors: &[ErrorName], options: &Options) {
    let equation = Equation::of(machine, source, errors, options).expect("an equation");
    let checked = check(&equation, source).expect("agreement with dual numbers");
    let mut random = rand_pcg::Pcg64::seed_from_u64(5);
    let mut values: Vec<(Variable, f64)> = Vec::new();
    let mut names: BTreeMap<String, f64> = BTreeMap::new();
    let mut units: BTreeMap<String, (String, &'static str)> = BTreeMap::new();
    for input in equation.inputs() {
        let (Input::Plain(variable) | Input::Sine(variable) | Input::Cosine(variable)) = &input;
        if !values.iter().any(|(known, _)| known == variable) {
            let value = match variable {
                Variable::Length(name) => source.length_mm(name).unwrap_or(100.0) * random.random_range(0.9..1.1),
                Variable::Position { .. } if variable.is_angle() => random.random_range(-1.2..1.2),
                Variable::Position { .. } => random.random_range(-3.0..3.0),
                Variable::Driver(quantity) if quantity.part == DriverPart::Direction => -1.0,
                Variable::Driver(_) => random.random_range(0.1..2.0),
                // Small, so that a touching probe meets its artefact.
                small if small.is_angle() => random.random_range(-1e-3..1e-3),
                _ => random.random_range(-0.1..0.1),
            };
            values.push((variable.clone(), value));
        }
        let value = values.iter().find(|(known, _)| known == variable).expect("a value").1;
        let own = canonical(&variable.text(options.symbols));
        let of_axis = |letter: &str| match variable {
            Variable::Position { .. } if options.arrangement != Arrangement::Frames => format!("{letter}{own}"),
            Variable::Position { axis, .. } => format!("{letter}{}", axis.to_lowercase()),
            _ => own.clone(),
        };
        match &input {
            Input::Plain(_) => {
                names.insert(own.clone(), value);
                units.insert(own, (variable.meaning(), variable.unit()));
            }
            Input::Sine(_) | Input::Cosine(_) => {
                let is_sine = matches!(input, Input::Sine(_));
                let name = of_axis(if is_sine { "s" } else { "c" });
                // Sine and cosine of something else than an axis are functions of it.
                names.entry(own).or_insert(value);
                if matches!(variable, Variable::Position { .. }) {
                    names.insert(name.clone(), if is_sine { value.sin() } else { value.cos() });
                    units.insert(name, ("sine and cosine of the ".to_string() + &variable.meaning(), "1"));
                }
            }
        }
    }
    let value = |zero: bool| {
        move |values: &[(Variable, f64)], variable: &Variable| {
            let value = values.iter().find(|(known, _)| known == variable).map_or(f64::NAN, |(_, value)| *value);
            if zero && variable.is_small() { 0.0 } else { value }
        }
    };
    let wanted = evaluate_f64(&equation.arena, &equation.outputs, |v| value(false)(&values, v)).expect("numbers");
    let slopes: Vec<Vec<f64>> = equation
        .arena_gradients()
        .iter()
        .map(|row| evaluate_f64(&equation.arena, row, |v| value(true)(&values, v)).expect("numbers"))
        .collect();
    let outputs: Vec<String> = match equation.kind {
        Kind::Length => vec!["L".into()],
        Kind::Distance => vec!["d".into()],
        Kind::Coordinates => ["mx", "my", "mz"].map(String::from).to_vec(),
        Kind::Volumetric => ["Δx", "Δy", "Δz"].map(String::from).to_vec(),
    };
    let style = Style { nomenclature: true, ..Style::default() };
    for language in ["text", "latex", "typst"] {
        let page = abbe_codegen::language(language).and_then(|own| own.print(&checked, &style)).expect("a page");
        let what = |row: &str| format!("{language}, {:?} {:?}: {row}\n{page}", options.order, equation.kind);
        let (mut known, mut used) = (names.clone(), BTreeSet::new());
        let (mut lefts, mut read, mut found_slopes) = (BTreeSet::new(), BTreeMap::new(), 0);
        for (left, right, remark) in statements(&page, language) {
            let tokens = tokens(&right);
            let mut reader = Reader { tokens: &tokens, names: &known, used: &mut used };
            let value = reader.sum();
            assert!(reader.tokens.is_empty(), "{}", what(&format!("{left} = {right}: {:?}", reader.tokens)));
            if left.contains('∂') || left.contains("partial") {
                let parts: Vec<&str> = left.split(if left.contains('∂') { "∂" } else { "partial" }).collect();
                let (of, by) = (canonical(parts[1]), canonical(parts[2]));
                let output = outputs.iter().position(|output| *output == of).expect("an output");
                let mut parameters = equation.parameters.iter();
                let parameter = parameters.position(|own| canonical(&own.text(options.symbols)) == by);
                let wanted = slopes[output][parameter.unwrap_or_else(|| panic!("{}", what(&by)))];
                assert!((value - wanted).abs() < 1e-9 * (1.0 + wanted.abs()), "{} {value} {wanted}", what(&left));
                let all_zero = slopes.iter().all(|row| row[parameter.expect("it")].abs() < 1e-9);
                // A step may be zero here and not elsewhere.
                let is_effect = matches!(equation.parameters[parameter.expect("it")], Variable::Coefficient(_));
                let not_observable = remark.contains("not observable");
                assert!(not_observable == all_zero || is_effect && !not_observable, "{}", what(&left));
                found_slopes += 1;
                continue;
            }
            let is_square = left.ends_with('²') || left.ends_with("^2");
            let name = canonical(left.trim_end_matches("^2"));
            let value = if is_square { value.sqrt() } else { value };
            assert!(lefts.insert(name.clone()), "{}", what(&left));
            if outputs.contains(&name) {
                read.insert(name, value);
            } else {
                known.insert(name, value);
            }
        }
        for (output, wanted) in outputs.iter().zip(&wanted) {
            // Lengths are differences of large numbers; a coordinate that is always zero may be left out.
            let found = read.get(output).copied().unwrap_or(0.0);
            assert!((found - wanted).abs() < 1e-9 * (1.0 + wanted.abs()), "{} {found} {wanted}", what(output));
        }
        let single = options.arrangement == Arrangement::Single;
        assert_eq!(found_slopes > 0, options.order == Order::First && !single, "{}", what("derivatives"));
        check_symbols(&page, language, &units, &used, &lefts);
    }
}

/// A word of a table without the escapes of its language.
fn plain(text: &str) -> String {
    let text = text.replace("$^\\circ$", "°").replace("$\\mu$", "µ").replace("$\\theta$", "θ").replace("$-$", "−");
    text.replace("\\textasciitilde{}", "~").replace(['$', '\\'], "")
}

/// The table has every name of the page once, with meaning and unit, and in LaTeX breaks where a column is full.
fn check_symbols(
    page: &str,
    language: &str,
    units: &BTreeMap<String, (String, &'static str)>,
    used: &BTreeSet<String>,
    lefts: &BTreeSet<String>,
) {
    let tables = symbols(page, language);
    let mut listed: BTreeMap<String, (String, String)> = BTreeMap::new();
    for (names, meaning, unit) in tables.iter().flatten() {
        assert!(!meaning.is_empty(), "{names:?}\n{page}");
        for name in names {
            let twice = listed.insert(name.clone(), (meaning.clone(), unit.clone()));
            assert!(twice.is_none(), "{language}: {name} twice\n{page}");
        }
    }
    for name in used.iter().filter(|name| units.contains_key(*name)) {
        let (_, unit) = &units[name];
        let (_, listed) = listed.get(name).unwrap_or_else(|| panic!("{language}: {name} is not listed\n{page}"));
        assert_eq!(plain(listed), *unit, "{language}: {name}\n{page}");
    }
    if language == "text" {
        return;
    }
    for name in lefts {
        let (meaning, unit) = listed.get(name).unwrap_or_else(|| panic!("{language}: {name} is not listed\n{page}"));
        let unit = plain(unit);
        let is_direction = name.starts_with('u');
        let wanted: &[&str] = match name.as_str() {
            "S" | "a" | "b" | "c" => &["mm²"],
            _ if is_direction => &["1"],
            _ if units.contains_key(name) => continue,
            _ => &["mm", "rad", "1"],
        };
        assert!(wanted.contains(&unit.as_str()), "{language}: {name} in {unit}, {meaning}\n{page}");
    }
    for name in listed.keys() {
        let small_or_used = units.contains_key(name) || lefts.contains(name) || used.contains(name);
        assert!(small_or_used, "{language}: {name} is listed and not printed\n{page}");
    }
    if language == "latex" {
        let width = page.split("\\arraybackslash}p{").nth(1).and_then(|rest| rest.split("pt}").next());
        let width: usize = width.expect("a width").parse().expect("points");
        // Five points a character; 34 lines fit a column.
        let lines = |row: &(Vec<String>, String, String)| 1 + plain(&row.1).chars().count() * 5 / width;
        let heights: Vec<usize> = tables.iter().map(|table| table.iter().map(lines).sum()).collect();
        for (height, next) in heights.iter().zip(&tables[1..]) {
            assert!(height + lines(&next[0]) > 34, "{heights:?}");
        }
        // The first row of a table may be added.
        for (height, table) in heights.iter().zip(&tables) {
            assert!(*height <= 34 + lines(&table[0]), "{heights:?}");
        }
    }
}

/// The derivatives at zero errors, which first-order pages print.
trait Gradients {
    fn arena_gradients(&self) -> Vec<Vec<abbe_codegen::Operand>>;
}

impl Gradients for Equation {
    fn arena_gradients(&self) -> Vec<Vec<abbe_codegen::Operand>> {
        let parameters: Vec<abbe_codegen::Operand> =
            self.parameters.iter().map(|parameter| self.arena.variable(parameter.clone()).operand()).collect();
        self.exact.iter().map(|output| self.arena.gradient(*output, &parameters)).collect()
    }
}

#[test]
fn pages_of_a_bar_have_the_values_of_the_chain() {
    for rotation in [Rotation::Exact, Rotation::SmallAngle] {
        for order in [Order::Exact, Order::Bilinear, Order::First] {
            for symbols in [Symbols::Literature, Symbols::Iso] {
                for extended in [false, true] {
                    let options = Options {
                        order,
                        symbols,
                        rotation: Some(rotation),
                        unknowns: (0..8).collect(),
                        ..Options::default()
                    };
                    read_back(&hermle(rotation), &Chapter5 { extended }, &eight(), &options);
                }
            }
        }
        for arrangement in [Arrangement::Single, Arrangement::Groups] {
            let options =
                Options { arrangement, rotation: Some(rotation), unknowns: (0..8).collect(), ..Options::default() };
            read_back(&hermle(rotation), &Chapter5 { extended: true }, &eight(), &options);
        }
    }
}

#[test]
fn pages_of_every_topology_have_the_values_of_the_chain() {
    for code in CODES {
        let machine = machine(code);
        let errors = all_errors(&machine);
        let motions: Vec<ErrorName> = errors.iter().filter(|name| name.kind == ErrorKind::Motion).cloned().collect();
        read_back(&machine, &AnyBar, &errors, &Options::default());
        let first = Options { order: Order::First, ..Options::default() };
        read_back(&machine, &AnyBar, &errors, &first);
        read_back(&machine, &ToolPoint, &motions, &first);
    }
}

#[test]
fn pages_of_every_shape_of_an_effect_have_the_values_of_the_chain() {
    let machine = Machine::from_code("w C b X t").expect("a code");
    for order in [Order::Exact, Order::Bilinear, Order::First] {
        let options = Options { order, effects: every_shape(), ..Options::default() };
        read_back(&machine, &Bar, &eight()[4..], &options);
    }
}

#[test]
fn pages_of_a_probe_have_the_values_of_the_chain() {
    for stated in [false, true] {
        for order in [Order::Exact, Order::Bilinear, Order::First] {
            let touch = Touch { stated };
            let machine = touch.machine();
            let options = Options { order, rotation: Some(Rotation::SmallAngle), ..Options::default() };
            read_back(&machine, &touch, &errors(&machine), &options);
        }
    }
}
