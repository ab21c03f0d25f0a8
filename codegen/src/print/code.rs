//! Common part of the languages for compilers and interpreters: names, expressions, arguments and the header.

use std::collections::HashSet;
use std::ops::Range;

use crate::check::Checked;
use crate::equation::Equation;
use crate::form::Kind;
use crate::print::arguments::{self, Argument};
use crate::print::dialect::{self, Dialect};
use crate::print::notes;
use crate::print::{Layout, Style};
use crate::program::{Input, Label, Program};
use crate::symbol::Unary;
use crate::variable::{Symbols, Variable, identifier};

/// Names that are reserved in Rust, C, Python or MATLAB, or that the printed code uses itself.
const RESERVED_WORDS: &str = "\
    as and assert auto await axes box break case catch char class const continue cos crate def default \
    del do double elif else elseif end enum errors except exp extern false finally float floor fn for from \
    function gen global goto gradient i if impl import in inline int is j k lambda lengths let long loop \
    match mod move mut n nonlocal not np or otherwise parfor pass persistent pi pub raise ref register \
    restrict return round self short sign signed sin sizeof sqrt static struct super switch trait true try \
    type typedef union unsafe unsigned use value void volatile where while with yield lane at y0 y1 j0 j1 yn \
    jn gamma main log";

/// How a language writes expressions.
pub(crate) struct Syntax {
    /// The sign of a product.
    pub(crate) times: &'static str,
    /// The sign of a quotient.
    pub(crate) over: &'static str,
    /// A function, by its [`name`], of an argument without parentheses.
    pub(crate) call: fn(Unary, &str) -> String,
    /// Further reserved names, separated by spaces.
    pub(crate) reserved: &'static str,
}

/// The name of a function in most languages.
pub(crate) fn name(function: Unary) -> &'static str {
    match function {
        Unary::Neg => "-",
        Unary::Sqrt => "sqrt",
        Unary::Sin => "sin",
        Unary::Cos => "cos",
        Unary::Exp => "exp",
        Unary::Signum => "sign",
        Unary::Step => "step",
        Unary::Floor => "floor",
        Unary::Round => "round",
    }
}

/// A program with names for all its quantities.
pub(crate) struct Code<'e> {
    pub(crate) checked: &'e Checked<'e>,
    /// The reading and, if requested, its derivatives.
    pub(crate) program: Program,
    /// Whether the derivatives are requested.
    pub(crate) gradient: bool,
    pub(crate) inputs: Vec<String>,
    steps: Vec<String>,
    /// Index ranges of the lengths, the axes and the errors among the inputs.
    pub(crate) groups: [Range<usize>; 3],
    /// The arguments by name; empty for arrays.
    pub(crate) arguments: Vec<Argument>,
    /// Name of the function that computes the value.
    pub(crate) name: String,
    syntax: &'static Syntax,
}

/// Names of the three groups of arguments.
pub(crate) const GROUPS: [&str; 3] = ["lengths", "axes", "errors"];

/// The functions of a file: the value alone and, if requested, value and gradient.
pub(crate) fn functions<'e>(checked: &'e Checked<'e>, style: &Style, syntax: &'static Syntax) -> Vec<Code<'e>> {
    let gradient = checked.equation.options.gradient.then_some(true);
    let requested = [false].into_iter().chain(gradient);
    requested.map(|gradient| Code::new(checked, gradient, style, syntax)).collect()
}

/// Lines, each with a line break at its end.
pub(crate) fn lines(lines: impl IntoIterator<Item = String>) -> String {
    lines.into_iter().map(|line| line + "\n").collect()
}

impl<'e> Code<'e> {
    pub(crate) fn new(checked: &'e Checked<'e>, gradient: bool, style: &Style, syntax: &'static Syntax) -> Self {
        let equation = checked.equation;
        let program = equation.program(gradient);
        let mut taken: HashSet<String> = [RESERVED_WORDS, syntax.reserved]
            .iter()
            .flat_map(|words| words.split_whitespace())
            .map(str::to_string)
            .collect();
        let mut name = |requested: String| {
            let mut free = requested.clone();
            let mut number = 2;
            while !taken.insert(free.clone()) {
                free = format!("{requested}_{number}");
                number += 1;
            }
            free
        };
        let symbols = equation.options.symbols;
        let mut arguments = Vec::new();
        if style.layout == Layout::Named {
            arguments = arguments::of(equation, &program.inputs, style.angles);
            for argument in &mut arguments {
                argument.name = name(std::mem::take(&mut argument.name));
            }
        }
        let turn = |variable: &Variable| match variable {
            Variable::Position { axis, .. } => identifier(axis),
            other => other.identifier(symbols),
        };
        let inputs: Vec<String> = program
            .inputs
            .iter()
            .enumerate()
            .map(|(index, input)| {
                let own = arguments.iter().find(|argument| argument.input() == Some(index));
                own.map(|argument| argument.name.clone()).unwrap_or_else(|| {
                    name(match input {
                        Input::Plain(variable) => variable.identifier(symbols),
                        Input::Sine(variable) => format!("sin_{}", turn(variable)),
                        Input::Cosine(variable) => format!("cos_{}", turn(variable)),
                    })
                })
            })
            .collect();
        let steps = program.steps.iter().map(|step| name(step_name(&step.label, symbols))).collect();
        let count = |requested: &dyn Fn(&Input) -> bool| program.inputs.iter().filter(|i| requested(i)).count();
        let lengths = count(&|input| matches!(input, Input::Plain(Variable::Length(_))));
        let small = count(&|input| matches!(input, Input::Plain(variable) if variable.is_small()));
        let all = program.inputs.len();
        Code {
            checked,
            gradient,
            syntax,
            arguments,
            name: function_name(equation, style.name_of_test),
            groups: [0..lengths, lengths..all - small, all - small..all],
            program,
            inputs,
            steps,
        }
    }

    /// Number of scalar outputs of one reading.
    pub(crate) fn outputs(&self) -> usize {
        self.checked.equation.outputs.len()
    }

    /// Number of errors and instrument parameters.
    pub(crate) fn errors(&self) -> usize {
        self.checked.equation.parameters.len()
    }

    /// Name of the function.
    pub(crate) fn function(&self) -> String {
        format!("{}{}", self.name, if self.gradient { "_gradient" } else { "" })
    }

    /// The arguments of a group that the program uses, each as its index in the group and its name.
    pub(crate) fn used(&self, group: usize) -> Vec<(usize, &str)> {
        let places = self.groups[group].clone().enumerate();
        let used = places.filter(|(_, index)| self.uses(*index));
        used.map(|(number, index)| (number, self.inputs[index].as_str())).collect()
    }

    /// The arguments that are errors (`true`), or lengths, positions and drivers.
    pub(crate) fn named(&self, errors: bool) -> impl Iterator<Item = &Argument> {
        self.arguments.iter().filter(move |argument| argument.error == errors)
    }

    /// The sines, cosines and angles that the program uses, with their expressions in the arguments.
    pub(crate) fn of_angles(&self, per_degree: &str) -> Vec<(&str, String)> {
        let mut found = Vec::new();
        for argument in &self.arguments {
            let Some(angle) = &argument.angle else { continue };
            let name = &argument.name;
            let radian = if argument.unit == "deg" {
                format!("{name} {} {per_degree}", self.syntax.times)
            } else {
                name.clone()
            };
            let of = |function: Unary| (self.syntax.call)(function, &radian);
            let values = [(angle[0], of(Unary::Sin)), (angle[1], of(Unary::Cos)), (angle[2], radian.clone())];
            let used = values.into_iter().filter_map(|(index, value)| Some((index.filter(|i| self.uses(*i))?, value)));
            found.extend(used.map(|(index, value)| (self.inputs[index].as_str(), value)));
        }
        found
    }

    /// Whether the program uses an argument, itself or its sine, cosine or angle.
    pub(crate) fn uses_argument(&self, argument: &Argument) -> bool {
        let angle = argument.angle.iter().flatten().flatten().copied();
        argument.input().into_iter().chain(angle).any(|index| self.uses(index))
    }

    /// Whether the program uses an input.
    pub(crate) fn uses(&self, index: usize) -> bool {
        let steps = self.program.steps.iter().map(|step| &step.value);
        steps.chain(&self.program.outputs).any(|tree| tree.holds(index))
    }

    /// The assignments of the steps, each with `before` in front of the name and `end` at its end.
    pub(crate) fn assignments(&self, before: &str, end: &str) -> Vec<String> {
        let steps = self.steps.iter().zip(&self.program.steps);
        steps.map(|(name, step)| format!("{before}{name} = {}{end}", dialect::write(&step.value, self))).collect()
    }

    /// The outputs: values, and derivatives output by output.
    pub(crate) fn results(&self) -> (Vec<String>, Vec<String>) {
        let outputs = self.program.outputs.iter();
        let mut values: Vec<String> = outputs.map(|tree| dialect::write(tree, self)).collect();
        let slopes = values.split_off(self.outputs());
        (values, slopes)
    }

    /// The lines of the header, without comment signs. Indices of arguments start at `first` and are enclosed in
    /// `brackets`.
    pub(crate) fn header(&self, first: usize, brackets: [char; 2]) -> Vec<String> {
        let at = |group: &str, number: usize| format!("{group}{}{}{}", brackets[0], number + first, brackets[1]);
        let equation = self.checked.equation;
        let mut lines = notes::title(equation);
        lines.push(String::new());
        if self.arguments.is_empty() {
            lines.push("Arguments in order:".to_string());
        } else {
            lines.push("Arguments by name; errors are 0 by default:".to_string());
            let row = |a: &Argument| format!("  {:<20} {:<4} {}", a.name, a.unit, a.meaning);
            lines.extend(self.arguments.iter().map(row));
        }
        let groups = GROUPS.iter().filter(|_| self.arguments.is_empty());
        for (group, places) in groups.zip(&self.groups) {
            for (number, index) in places.clone().enumerate() {
                let input = &self.program.inputs[index];
                let (unit, meaning) = match input {
                    Input::Plain(variable) => (variable.unit(), notes::meaning(equation, variable)),
                    Input::Sine(variable) => ("1", format!("sine of the {}", notes::meaning(equation, variable))),
                    Input::Cosine(variable) => ("1", format!("cosine of the {}", notes::meaning(equation, variable))),
                };
                let argument = at(group, number);
                lines.push(format!("  {argument:<12} {:<12} {unit:<4} {meaning}", self.inputs[index]));
            }
        }
        let what = match equation.kind {
            Kind::Length => "the length read, mm".to_string(),
            Kind::Distance => "the distance to the surface along the probing direction, mm".to_string(),
            Kind::Coordinates if equation.names == ["x", "y", "z"] => "the three coordinates read, mm".to_string(),
            Kind::Coordinates => {
                let read = equation.names.iter().zip(&equation.units).map(|(name, unit)| format!("{name} in {unit}"));
                read.collect::<Vec<_>>().join(", ")
            }
            Kind::Volumetric => "the error vector x, y, z, mm".to_string(),
        };
        let by = match self.arguments.is_empty() {
            true => format!("{}, {} and so on", at("errors", 0), at("errors", 1)),
            false => "the errors in their order".to_string(),
        };
        let unit = match equation.kind == Kind::Coordinates && equation.units.contains(&"rad") {
            true => "in the unit of the value per mm and per rad",
            false => "mm/mm and mm/rad",
        };
        lines.push(format!("Value: {what}. Gradient: by {by}, {unit}."));
        let operations = self.program.operations();
        let functions = match (operations.functions, equation.options.effects.is_empty()) {
            (0, _) => String::new(),
            (1, true) => ", and 1 sine or cosine of an error".to_string(),
            (some, true) => format!(", and {some} sines and cosines of errors"),
            (1, false) => ", and 1 function of an error or driver".to_string(),
            (some, false) => format!(", and {some} functions of errors and drivers"),
        };
        let with = if self.program.outputs.len() > self.outputs() { "Value and gradient" } else { "Value" };
        lines.push(format!(
            "{with}: {} operations per reading ({} + and −, {} ·, {} /, {} √{functions}).",
            operations.arithmetic(),
            operations.sums,
            operations.products,
            operations.quotients,
            operations.roots,
        ));
        lines.extend(notes::notes(self.checked));
        lines
    }
}

impl Dialect for Code<'_> {
    fn number(&self, value: f64) -> String {
        format!("{value:?}")
    }
    fn input(&self, index: usize) -> String {
        self.inputs[index].clone()
    }
    fn step(&self, index: usize) -> String {
        self.steps[index].clone()
    }
    fn product(&self, a: &str, b: &str) -> String {
        format!("{a} {} {b}", self.syntax.times)
    }
    fn quotient(&self, a: &str, b: &str) -> String {
        format!("{a} {} {b}", self.syntax.over)
    }
    fn call(&self, function: Unary, argument: &str) -> String {
        (self.syntax.call)(function, argument)
    }
}

/// Name of the function that computes the value, followed by that of its test if requested: `bar_length_a150`.
pub(crate) fn function_name(equation: &Equation, name_of_test: bool) -> String {
    let name = match equation.kind {
        Kind::Length => "bar_length",
        Kind::Distance => "probe_distance",
        Kind::Coordinates => "coordinates",
        Kind::Volumetric => "volumetric_error",
    };
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' };
    let test = equation.name.as_deref().filter(|_| name_of_test);
    let test = test.map(|test| format!("_{}", test.chars().map(plain).collect::<String>()));
    format!("{name}{}", test.unwrap_or_default())
}

fn step_name(label: &Label, symbols: Symbols) -> String {
    match label {
        Label::Vector { letter, frame, prime, coordinate } => {
            let turned = if *prime { "t" } else { "" };
            let frame = if frame.is_empty() { String::new() } else { format!("_{}", identifier(frame)) };
            format!("{letter}{turned}{frame}_{}", ["x", "y", "z"][*coordinate])
        }
        Label::Scalar(name) => (*name).to_string(),
        Label::Quantity(variable) => variable.identifier(symbols),
        Label::Temporary(number) => format!("t{number}"),
    }
}
