//! Julia: one function with a method for one reading and a method for the columns of a matrix of readings.

use crate::check::Checked;
use crate::print::code::{Code, GROUPS, Syntax, functions, lines, name};
use crate::print::language::Language;
use crate::print::{Layout, Style};
use crate::symbol::Unary;

/// Julia 1.9 or later, without packages.
pub(crate) struct Julia;

const SYNTAX: Syntax = Syntax {
    times: "*",
    over: "/",
    call: |function, x| match function {
        Unary::Step => format!("ifelse({x} >= 0.0, 1.0, 0.0)"),
        // Julia rounds ties to even by default.
        Unary::Round => format!("round({x}, RoundNearestTiesAway)"),
        other => format!("{}({x})", name(other)),
    },
    reserved: "kernel baremodule begin column eachcol export first ifelse isa last local macro module outer quote \
               readings reshape stack using zeros",
};

impl Language for Julia {
    fn print(&self, checked: &Checked<'_>, style: &Style) -> String {
        let functions = functions(checked, style, &SYNTAX);
        let header = functions[functions.len() - 1].header(1, ['[', ']']).into_iter();
        let header = lines(header.map(|line| format!("# {line}").trim_end().to_string()));
        if style.layout == Layout::Named {
            return header + &functions.iter().map(named).collect::<String>();
        }
        let methods: String = functions.iter().map(|code| single(code) + &columns(code)).collect();
        format!(
            "{header}# axes: a vector for one reading, or a matrix with a row for each input and a column for each \
             reading.\n\
             {methods}"
        )
    }
}

/// The function with named arguments: numbers or arrays, which broadcast.
fn named(code: &Code<'_>) -> String {
    let names: Vec<&str> = code.arguments.iter().map(|argument| argument.name.as_str()).collect();
    let names = names.join(", ");
    let defaults = code.arguments.iter().map(|a| if a.error { format!("{} = 0.0", a.name) } else { a.name.clone() });
    let defaults = defaults.collect::<Vec<_>>().join(", ");
    let angles = code.of_angles("(pi / 180.0)").into_iter().map(|(name, value)| format!("        {name} = {value}"));
    let body = lines(angles) + &lines(code.assignments("        ", ""));
    let (values, slopes) = code.results();
    let gathered = |items: &[String]| match items {
        [one] => one.clone(),
        several => format!("({})", several.join(", ")),
    };
    let errors: Vec<&str> = code.named(true).map(|argument| argument.name.as_str()).collect();
    let row = |slopes: &[String]| {
        let fields = errors.iter().zip(slopes).map(|(name, slope)| format!("            {name} = {slope},\n"));
        format!("(;\n{}        )", fields.collect::<String>())
    };
    let rows: Vec<String> = slopes.chunks(errors.len().max(1)).map(row).collect();
    let value = gathered(&values);
    let (what, result) = if code.gradient {
        let result = format!("(; value = {value}, gradient = {})", gathered(&rows));
        ("Named tuple of the value and its derivatives by the errors", result)
    } else {
        ("Value", value)
    };
    format!(
        "\n\"{what}, for numbers or for arrays of one shape.\"\nfunction {}(; {defaults})\n    \
         function kernel({names})\n{body}        return {result}\n    end\n    return kernel.({names})\nend\n",
        code.function()
    )
}

/// The sizes of value and gradient of one reading, each without or with a last index for the reading.
fn sizes(code: &Code<'_>, reading: bool) -> String {
    let (value, gradient) = match (code.outputs(), reading) {
        (1, false) => ("", "[parameter]"),
        (1, true) => ("[reading]", "[parameter, reading]"),
        (_, false) => ("[coordinate]", "[parameter, coordinate]"),
        (_, true) => ("[coordinate, reading]", "[parameter, coordinate, reading]"),
    };
    let gradient = if code.gradient { format!(", gradient{gradient}") } else { String::new() };
    format!("value{value}{gradient}")
}

/// The documentation and the head of a method.
fn head(code: &Code<'_>, reading: bool, axes: &str) -> String {
    let of = if reading { "readings" } else { "one reading" };
    format!(
        "\n\"{} of {of}.\"\nfunction {}(lengths::AbstractVector, axes::{axes}, errors::AbstractVector)\n",
        sizes(code, reading),
        code.function()
    )
}

/// The method for one reading.
fn single(code: &Code<'_>) -> String {
    let mut text = head(code, false, "AbstractVector");
    for (group, word) in GROUPS.iter().enumerate() {
        for (number, input) in code.used(group) {
            text += &format!("    {input} = {word}[{}]\n", number + 1);
        }
    }
    text += &lines(code.assignments("    ", ""));
    let (values, slopes) = code.results();
    let value = match values.as_slice() {
        [one] => one.clone(),
        several => format!("[{}]", several.join(", ")),
    };
    if !code.gradient {
        return text + &format!("    return {value}\nend\n");
    }
    let slopes: String = slopes.iter().map(|slope| format!("        {slope},\n")).collect();
    let gradient = match (code.errors(), code.outputs()) {
        (0, 1) => "zeros(0)".to_string(),
        (0, outputs) => format!("zeros(0, {outputs})"),
        (_, 1) => format!("[\n{slopes}    ]"),
        (errors, outputs) => format!("reshape([\n{slopes}    ], {errors}, {outputs})"),
    };
    text + &format!("    gradient = {gradient}\n    return {value}, gradient\nend\n")
}

/// The method for the columns of a matrix.
fn columns(code: &Code<'_>) -> String {
    let readings = format!("[{}(lengths, column, errors) for column in eachcol(axes)]", code.function());
    let returned = match (code.gradient, code.outputs()) {
        (false, 1) => "readings",
        (false, _) => "stack(readings)",
        (true, 1) => "first.(readings), stack(last, readings)",
        (true, _) => "stack(first, readings), stack(last, readings)",
    };
    head(code, true, "AbstractMatrix") + &format!("    readings = {readings}\n    return {returned}\nend\n")
}
