//! MATLAB and Octave: one function file, for one reading and for rows of readings.

use crate::check::Checked;
use crate::print::code::{Code, GROUPS, Syntax, function_name, lines, name};
use crate::print::language::Language;
use crate::print::style::Style;
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
    reserved: "",
};

impl Language for Matlab {
    /// The file must have the name of its function.
    fn print(&self, checked: &Checked<'_>, _: &Style) -> String {
        let code = Code::new(checked, checked.equation.options.gradient, &SYNTAX);
        let (values, slopes) = code.results();
        let returned = if slopes.is_empty() { "value" } else { "[value, gradient]" };
        let name = function_name(checked.equation.kind);
        let mut file = format!("function {returned} = {name}(lengths, axes, errors)\n");
        let header = code.header(1, ['(', ')']).into_iter();
        file += &lines(header.map(|line| format!("% {line}").trim_end().to_string()));
        file += &format!(
            "% Save as {name}.m. axes: a row for each input, a column for each reading; value and gradient likewise.\n"
        );
        if code.outputs() > 1 && !slopes.is_empty() {
            file += "% Rows of gradient: all parameters for x, then for y, then for z.\n";
        }
        for (group, word) in GROUPS.iter().enumerate() {
            let column = if *word == "axes" { ", :" } else { "" };
            for (number, input) in code.used(group) {
                file += &format!("  {input} = {word}({}{column});\n", number + 1);
            }
        }
        file += &lines(code.assignments("  ", ";"));
        // Constants get the shape of the readings.
        file += "  readings = zeros(1, max(size(axes, 2), 1));\n";
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
