//! Python with NumPy: one function for one reading and for arrays of readings.

use crate::check::Checked;
use crate::print::code::{Code, GROUPS, Syntax, functions, lines, name};
use crate::print::language::Language;
use crate::print::{Layout, Style};
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
    reserved: "shape value gradient np ArrayLike NDArray",
};

impl Language for Python {
    fn print(&self, checked: &Checked<'_>, style: &Style) -> String {
        let functions = functions(checked, style, &SYNTAX);
        let header = lines(functions[functions.len() - 1].header(0, ['[', ']']));
        let text: String = functions.iter().map(function).collect();
        let imports = match style.layout {
            Layout::Flat => "import numpy as np\n".to_string(),
            Layout::Named => {
                let names: Vec<String> =
                    functions[0].named(true).map(|argument| format!("    \"{}\",\n", argument.name)).collect();
                let parameters = format!("\n# The order of the gradient.\nPARAMETERS = (\n{})\n", names.concat());
                format!("import numpy as np\nfrom numpy.typing import ArrayLike, NDArray\n{parameters}")
            }
        };
        format!(
            "\"\"\"\n{header}Each argument may be a number or an array; arrays must have one shape, that of the \
             readings.\n\
             \"\"\"\n\n{imports}{text}"
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
    let mut text = format!("\n\ndef {}", code.function());
    // Constants get the shape of the readings.
    if code.arguments.is_empty() {
        text += &format!("(lengths, axes, errors):\n    \"\"\"{what}\"\"\"\n");
        for (group, word) in GROUPS.iter().enumerate() {
            for (number, input) in code.used(group) {
                text += &format!("    {input} = {word}[{number}]\n");
            }
        }
    } else {
        let required = code.named(false).map(|argument| format!("    {}: ArrayLike,\n", argument.name));
        let optional = code.named(true).map(|argument| format!("    {}: ArrayLike = 0.0,\n", argument.name));
        let arguments: String = required.chain(optional).collect();
        let returned =
            if code.gradient { "tuple[NDArray[np.float64], NDArray[np.float64]]" } else { "NDArray[np.float64]" };
        text += &format!("(\n    *,\n{arguments}) -> {returned}:\n    \"\"\"{what}\"\"\"\n");
        let names: Vec<&str> = code.arguments.iter().map(|argument| argument.name.as_str()).collect();
        for name in &names {
            text += &format!("    {name} = np.asarray({name}, dtype=float)\n");
        }
        let shapes: Vec<String> = names.iter().map(|name| format!("{name}.shape")).collect();
        text += &format!("    shape = np.broadcast_shapes({})\n", shapes.join(", "));
        text +=
            &lines(code.of_angles("(np.pi / 180.0)").into_iter().map(|(name, value)| format!("    {name} = {value}")));
    }
    text += &lines(code.assignments("    ", ""));
    if code.arguments.is_empty() {
        text += "    shape = np.broadcast_shapes(*(np.shape(argument) for group in (lengths, axes, errors) for \
                 argument in group))\n";
    }
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
