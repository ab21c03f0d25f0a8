//! Printer for MATLAB and Octave: one function file, for one reading and for rows of readings.

use std::fmt::Write;

use crate::equation::Equation;
use crate::print::code::{Code, GROUPS};
use crate::print::dialect::Dialect;
use crate::symbol::Unary;

struct Matlab<'c, 'e>(&'c Code<'e>);

impl Dialect for Matlab<'_, '_> {
    fn number(&self, value: f64) -> String {
        format!("{value:?}")
    }
    fn input(&self, index: usize) -> String {
        self.0.inputs[index].clone()
    }
    fn step(&self, index: usize) -> String {
        self.0.steps[index].clone()
    }
    fn product(&self, a: &str, b: &str) -> String {
        format!("{a} .* {b}")
    }
    fn quotient(&self, a: &str, b: &str) -> String {
        format!("{a} ./ {b}")
    }
    fn call(&self, function: Unary, argument: &str) -> String {
        match function {
            Unary::Neg => format!("-({argument})"),
            Unary::Sin => format!("sin({argument})"),
            Unary::Cos => format!("cos({argument})"),
            Unary::Sqrt => format!("sqrt({argument})"),
            Unary::Exp => format!("exp({argument})"),
            Unary::Signum => format!("sign({argument})"),
            Unary::Step => format!("double(({argument}) >= 0.0)"),
            Unary::Floor => format!("floor({argument})"),
            Unary::Round => format!("round({argument})"),
        }
    }
}

/// Prints the file, which must have the name of its function.
pub(crate) fn print(equation: &Equation) -> String {
    let code = Code::new(equation, equation.options.gradient);
    let dialect = Matlab(&code);
    let results = code.results(&dialect);
    let (values, slopes) = results.split_at(code.outputs());
    let returned = if slopes.is_empty() {
        "value"
    } else {
        "[value, gradient]"
    };
    let name = code.function();
    let mut file = format!("function {returned} = {name}(lengths, axes, errors)\n");
    for line in code.header(1, ['(', ')']) {
        let _ = writeln!(file, "{}", format!("% {line}").trim_end());
    }
    let _ = writeln!(
        file,
        "% Save as {name}.m. axes: a row for each input, a column for each reading; value and gradient likewise."
    );
    if code.outputs() > 1 && !slopes.is_empty() {
        let _ = writeln!(
            file,
            "% Rows of gradient: all parameters for x, then for y, then for z."
        );
    }
    for (group, places) in GROUPS.iter().zip(&code.groups) {
        for (number, index) in places.clone().enumerate() {
            if code.uses(index) {
                let column = if *group == "axes" { ", :" } else { "" };
                let _ = writeln!(
                    file,
                    "  {} = {group}({}{column});",
                    code.inputs[index],
                    number + 1
                );
            }
        }
    }
    for line in code.lines(&dialect, |name, value| format!("  {name} = {value};")) {
        let _ = writeln!(file, "{line}");
    }
    // Constants get the shape of the readings.
    file.push_str("  readings = zeros(1, max(size(axes, 2), 1));\n");
    let rows = |items: &[String]| {
        let rows: Vec<String> = items
            .iter()
            .map(|item| format!("    ({item}) + readings;\n"))
            .collect();
        rows.concat()
    };
    let _ = writeln!(file, "  value = [\n{}  ];", rows(values));
    if !slopes.is_empty() {
        let _ = writeln!(
            file,
            "  if nargout > 1\n    gradient = [\n{}    ];\n  end",
            rows(slopes)
        );
    }
    file.push_str("end\n");
    file
}
