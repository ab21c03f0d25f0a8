//! Python with NumPy: one function for one reading and for arrays of readings.

use crate::check::Checked;
use crate::print::code::{Code, GROUPS, Syntax, functions, lines, name};
use crate::print::language::Language;
use crate::print::style::Style;
use crate::symbol::Unary;

/// Python with NumPy.
pub(crate) struct Python;

const SYNTAX: Syntax = Syntax {
    times: "*",
    over: "/",
    call: |function, x| match function {
        Unary::Step => format!("np.heaviside({x}, 1.0)"),
        other => format!("np.{}({x})", name(other)),
    },
    reserved: "",
};

impl Language for Python {
    fn print(&self, checked: &Checked<'_>, _: &Style) -> String {
        let functions = functions(checked, &SYNTAX);
        let header = lines(functions[functions.len() - 1].header(0, ['[', ']']));
        let functions: String = functions.iter().map(function).collect();
        format!(
            "\"\"\"\n{header}Each argument may be a number or an array; arrays must have one shape, that of the \
             readings.\n\
             \"\"\"\n\nimport numpy as np\n{functions}"
        )
    }
}

fn function(code: &Code<'_>) -> String {
    let errors = code.errors();
    let what = match (code.gradient, code.outputs()) {
        (false, 1) => "Value, one for each reading.".to_string(),
        (false, _) => "Value (3, ...): coordinate, then reading.".to_string(),
        (true, 1) => format!("Value, and gradient ({errors}, ...): parameter, then reading."),
        (true, _) => {
            format!("Value (3, ...), and gradient (3, {errors}, ...): coordinate, parameter, reading.")
        }
    };
    let mut text = format!("\n\ndef {}(lengths, axes, errors):\n    \"\"\"{what}\"\"\"\n", code.function());
    for (group, word) in GROUPS.iter().enumerate() {
        for (number, input) in code.used(group) {
            text += &format!("    {input} = {word}[{number}]\n");
        }
    }
    text += &lines(code.assignments("    ", ""));
    // Constants get the shape of the readings.
    text += "    shape = np.broadcast_shapes(*(np.shape(argument) for group in (lengths, axes, errors) for argument in \
             group))\n";
    let (values, slopes) = code.results();
    let stack = |items: &[String]| {
        let rows = items.iter().map(|item| format!("        np.broadcast_to({item}, shape),\n"));
        format!("np.stack([\n{}    ])", rows.collect::<String>())
    };
    let value = match values.as_slice() {
        [one] => format!("np.broadcast_to({one}, shape)"),
        several => stack(several),
    };
    text += &format!("    value = {value}\n");
    if !code.gradient {
        return text + "    return value\n";
    }
    let rows: Vec<String> = slopes.chunks(errors.max(1)).map(stack).collect();
    let gradient = match rows.as_slice() {
        [one] => one.clone(),
        several => format!("np.stack([{}])", several.join(", ")),
    };
    text + &format!("    gradient = {gradient}\n    return value, gradient\n")
}
