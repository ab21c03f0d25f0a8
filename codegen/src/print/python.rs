//! Printer for Python with NumPy: one function for one reading and for arrays of readings.

use std::fmt::Write;

use crate::equation::Equation;
use crate::print::code::{Code, GROUPS};
use crate::print::dialect::Dialect;
use crate::symbol::Unary;

struct Python<'c, 'e>(&'c Code<'e>);

impl Dialect for Python<'_, '_> {
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
        format!("{a} * {b}")
    }
    fn call(&self, function: Unary, argument: &str) -> String {
        match function {
            Unary::Neg => format!("-({argument})"),
            Unary::Sin => format!("np.sin({argument})"),
            Unary::Cos => format!("np.cos({argument})"),
            Unary::Sqrt => format!("np.sqrt({argument})"),
            Unary::Exp => format!("np.exp({argument})"),
            Unary::Signum => format!("np.sign({argument})"),
            Unary::Step => format!("np.heaviside({argument}, 1.0)"),
            Unary::Floor => format!("np.floor({argument})"),
            Unary::Round => format!("np.round({argument})"),
        }
    }
}

/// Prints the file.
pub(crate) fn print(equation: &Equation) -> String {
    let value = Code::new(equation, false);
    let whole = Code::new(equation, equation.options.gradient);
    let mut file = String::from("\"\"\"\n");
    for line in whole.header(0, ['[', ']']) {
        let _ = writeln!(file, "{line}");
    }
    file.push_str(
        "Each argument may be a number or an array; arrays must have one shape, that of the readings.\n\"\"\"\n\nimport numpy as np\n",
    );
    function(&mut file, &value, false);
    if equation.options.gradient {
        function(&mut file, &whole, true);
    }
    file
}

fn function(file: &mut String, code: &Code<'_>, gradient: bool) {
    let dialect = Python(code);
    let suffix = if gradient { "_gradient" } else { "" };
    let shape = if code.outputs() == 1 { "" } else { "(3, ...)" };
    let what = match (gradient, code.outputs()) {
        (false, 1) => "Value, one for each reading.".to_string(),
        (false, _) => format!("Value {shape}: coordinate, then reading."),
        (true, 1) => format!(
            "Value, and gradient ({}, ...): parameter, then reading.",
            code.errors()
        ),
        (true, _) => format!(
            "Value {shape}, and gradient (3, {}, ...): coordinate, parameter, reading.",
            code.errors()
        ),
    };
    let _ = writeln!(
        file,
        "\n\ndef {}{suffix}(lengths, axes, errors):\n    \"\"\"{what}\"\"\"",
        code.function()
    );
    for (group, places) in GROUPS.iter().zip(&code.groups) {
        for (number, index) in places.clone().enumerate() {
            if code.uses(index) {
                let _ = writeln!(file, "    {} = {group}[{number}]", code.inputs[index]);
            }
        }
    }
    for line in code.lines(&dialect, |name, value| format!("    {name} = {value}")) {
        let _ = writeln!(file, "{line}");
    }
    let results = code.results(&dialect);
    // Constants get the shape of the readings.
    let _ = writeln!(
        file,
        "    shape = np.broadcast_shapes(*(np.shape(argument) for group in (lengths, axes, errors) for argument in group))"
    );
    let (values, slopes) = results.split_at(code.outputs());
    let stack = |items: &[String], indent: &str| {
        let rows: Vec<String> = items
            .iter()
            .map(|item| format!("{indent}    np.broadcast_to({item}, shape),\n"))
            .collect();
        format!("np.stack([\n{}{indent}])", rows.concat())
    };
    let value = match values {
        [one] => format!("np.broadcast_to({one}, shape)"),
        several => stack(several, "    "),
    };
    let _ = writeln!(file, "    value = {value}");
    if !gradient {
        file.push_str("    return value\n");
        return;
    }
    let rows: Vec<String> = slopes
        .chunks(code.errors().max(1))
        .map(|row| stack(row, "    "))
        .collect();
    let gradient = match rows.as_slice() {
        [one] => one.clone(),
        several => format!("np.stack([{}])", several.join(", ")),
    };
    let _ = writeln!(file, "    gradient = {gradient}\n    return value, gradient");
}
