//! MATLAB and Octave: one function file, for one reading and for rows of readings.

use crate::check::Checked;
use crate::print::arguments::Argument;
use crate::print::code::{Code, GROUPS, Syntax, lines, name};
use crate::print::language::Language;
use crate::print::{Layout, Style};
use crate::symbol::Unary;

/// MATLAB or Octave.
pub(crate) struct Matlab;

const SYNTAX: Syntax = Syntax {
    times: ".*",
    over: "./",
    call: |function, x| match function {
        Unary::Step => format!("double(({x}) >= 0.0)"),
        other => format!("{}({x})", name(other)),
    },
    reserved: "readings in arguments",
};

impl Language for Matlab {
    /// The file must have the name of its function.
    fn print(&self, checked: &Checked<'_>, style: &Style) -> String {
        let code = Code::new(checked, checked.equation.options.gradient, style, &SYNTAX);
        let (values, slopes) = code.results();
        let returned = if slopes.is_empty() { "value" } else { "[value, gradient]" };
        let name = &code.name;
        let named = style.layout == Layout::Named;
        let arguments = if named { "in" } else { "lengths, axes, errors" };
        let mut file = format!("function {returned} = {name}({arguments})\n");
        let header = code.header(1, ['(', ')']).into_iter();
        file += &lines(header.map(|line| format!("% {line}").trim_end().to_string()));
        if named {
            file += &format!("% Save as {name}.m. A number or a row for each argument, by name: {name}(R=100, ...).\n");
        } else {
            file += &format!(
                "% Save as {name}.m. axes: a row for each input, a column for each reading; \
                 value and gradient likewise.\n"
            );
        }
        if code.outputs() > 1 && !slopes.is_empty() {
            file += "% Rows of gradient: all parameters for x, then for y, then for z.\n";
        }
        if named {
            let row = |a: &Argument| {
                let default = if a.error { " = 0" } else { "" };
                format!("    in.{} (1,:) double{default}\n", a.name)
            };
            let block: String = code.named(false).chain(code.named(true)).map(row).collect();
            file += &format!("  arguments\n{block}  end\n");
            file += &lines(code.arguments.iter().map(|a| format!("  {0} = in.{0};", a.name)));
            let angles = code.of_angles("(pi / 180)").into_iter();
            file += &lines(angles.map(|(name, value)| format!("  {name} = {value};")));
        }
        for (group, word) in GROUPS.iter().enumerate().filter(|_| !named) {
            let column = if *word == "axes" { ", :" } else { "" };
            for (number, input) in code.used(group) {
                file += &format!("  {input} = {word}({}{column});\n", number + 1);
            }
        }
        file += &lines(code.assignments("  ", ";"));
        // Constants get the shape of the readings.
        file += &if named {
            let names: Vec<&str> = code.arguments.iter().map(|argument| argument.name.as_str()).collect();
            format!("  readings = 0 .* ({});\n", names.join(" + "))
        } else {
            "  readings = zeros(1, max(size(axes, 2), 1));\n".to_string()
        };
        let rows = |items: &[String]| {
            let rows = items.iter().map(|item| format!("    ({item}) + readings;\n"));
            rows.collect::<String>()
        };
        file += &format!("  value = [\n{}  ];\n", rows(&values));
        if !slopes.is_empty() {
            file += &format!("  if nargout > 1\n    gradient = [\n{}    ];\n  end\n", rows(&slopes));
        }
        file + "end\n"
    }
}
