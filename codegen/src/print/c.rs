//! C99: one function for one reading, and one for columns of readings with a loop that vectorises.

use crate::check::Checked;
use crate::print::code::{Code, GROUPS, Syntax, functions, lines, name};
use crate::print::language::Language;
use crate::print::{Layout, Style};
use crate::symbol::Unary;

/// C99.
pub(crate) struct C;

const SYNTAX: Syntax = Syntax {
    times: "*",
    over: "/",
    call: |function, x| match function {
        Unary::Signum => format!("(double)((({x}) > 0.0) - (({x}) < 0.0))"),
        Unary::Step => format!("(double)(({x}) >= 0.0)"),
        other => format!("{}({x})", name(other)),
    },
    reserved: "nominal value gradient",
};

/// The advice for a file with square roots.
const ADVICE: &str = " * Compile with -O3 -fno-math-errno, otherwise the square root prevents vectorisation of the \
                      loop over readings.\n";

impl Language for C {
    fn print(&self, checked: &Checked<'_>, style: &Style) -> String {
        let functions = functions(checked, style, &SYNTAX);
        let whole = &functions[functions.len() - 1];
        let header = whole.header(0, ['[', ']']).into_iter();
        let header = lines(header.map(|line| format!(" * {line}").trim_end().to_string()));
        if style.layout == Layout::Named {
            return named(&functions, &header);
        }
        let advice = if whole.program.operations().roots == 0 { "" } else { ADVICE };
        let slopes =
            if whole.gradient { format!(", gradient[(j * {} + k) * n + i]", whole.errors()) } else { String::new() };
        let kernels: Vec<String> = functions.iter().map(|code| single(code) + "\n" + &columns(code)).collect();
        format!(
            "/*\n{header} * Columns: n readings; axes[a * n + i] and the results value[j * n + i]{slopes} of \
             reading i.\n\
             {advice} */\n#include <math.h>\n#include <stddef.h>\n\n{}",
            kernels.join("\n")
        )
    }
}

/// A header with a structure for lengths and positions and one for errors.
fn named(functions: &[Code<'_>], header: &str) -> String {
    let code = &functions[0];
    let name = code.function();
    let fields = |errors: bool| {
        let fields = code.named(errors).map(|a| format!("    double {}; /* {} */\n", a.name, a.unit));
        let fields: String = fields.collect();
        // A structure without members is not C.
        if fields.is_empty() { "    double none;\n".to_string() } else { fields }
    };
    let guard = name.to_uppercase() + "_H";
    let mut file = format!(
        "/*\n{header} * A member that an initialiser does not name is 0.\n */\n\
         #ifndef {guard}\n#define {guard}\n\n#include <math.h>\n\nstruct {name}_nominal {{\n{}}};\n\n\
         struct {name}_errors {{\n{}}};\n",
        fields(false),
        fields(true)
    );
    for code in functions {
        let outputs = code.outputs();
        let several = outputs > 1;
        let result = if several { format!(", double value[{outputs}]") } else { String::new() };
        let slopes = match (code.gradient, several) {
            (false, _) => String::new(),
            (true, false) => format!(", struct {name}_errors *gradient"),
            (true, true) => format!(", struct {name}_errors gradient[{outputs}]"),
        };
        let returned = if several { "void" } else { "double" };
        let what = if code.gradient { "Value, and its derivatives by the errors" } else { "Value" };
        file += &format!(
            "\n/* {what}. */\nstatic inline {returned} {}(const struct {name}_nominal *nominal, const struct \
             {name}_errors *errors{result}{slopes})\n{{\n",
            code.function()
        );
        for errors in [false, true] {
            let group = if errors { "errors" } else { "nominal" };
            let used = code.named(errors).filter(|argument| code.uses_argument(argument));
            file += &lines(used.map(|a| format!("    const double {0} = {group}->{0};", a.name)));
            file += &format!("    (void){group};\n");
        }
        let angles = code.of_angles("(3.14159265358979323846 / 180.0)").into_iter();
        file += &lines(angles.map(|(name, value)| format!("    const double {name} = {value};")));
        file += &lines(code.assignments("    const double ", ";"));
        let (values, slopes) = code.results();
        if several {
            file += &lines(values.iter().enumerate().map(|(i, value)| format!("    value[{i}] = {value};")));
        }
        for (output, slopes) in slopes.chunks(code.errors().max(1)).enumerate() {
            let to = if several { format!("gradient[{output}].") } else { "gradient->".to_string() };
            let slopes = code.named(true).zip(slopes);
            file += &lines(slopes.map(|(argument, slope)| format!("    {to}{} = {slope};", argument.name)));
        }
        if code.gradient && code.errors() == 0 {
            file += "    (void)gradient;\n";
        }
        file += &if several { "}\n".to_string() } else { format!("    return {};\n}}\n", values[0]) };
    }
    file + "\n#endif\n"
}

/// What a function computes, and its signature as declaration and as head of the definition.
fn head(code: &Code<'_>, of: &str, signature: &str) -> String {
    let what = if code.gradient { "Value and gradient" } else { "Value" };
    format!("/* {what} of {of}. */\n{signature};\n\n{signature}\n{{\n")
}

/// The function for one reading.
fn single(code: &Code<'_>) -> String {
    let signature = format!(
        "void {}(const double *lengths, const double *axes, const double *errors, double *value{})",
        code.function(),
        if code.gradient { ", double *gradient" } else { "" }
    );
    let mut text = head(code, "one reading", &signature);
    text += &arguments(code, &[0, 1, 2]);
    text += &lines(code.assignments("    const double ", ";"));
    text += &results(code, |name, index, value| format!("    {name}[{index}] = {value};\n"));
    text + "}\n"
}

/// The function for columns of readings. Each column is a pointer of its own, so that the compiler knows that no two
/// overlap.
fn columns(code: &Code<'_>) -> String {
    let signature = format!(
        "void {}_columns(size_t n, const double *restrict lengths, const double *restrict axes, \
         const double *restrict errors, double *restrict value{})",
        code.function(),
        if code.gradient { ", double *restrict gradient" } else { "" }
    );
    let mut text = head(code, "n readings", &signature);
    let axes = code.used(1);
    for (number, input) in &axes {
        text += &format!("    const double *restrict column_{input} = axes + {number} * n;\n");
    }
    text += &results(code, |name, index, _| format!("    double *restrict {name}_{index} = {name} + {index} * n;\n"));
    if axes.is_empty() {
        text += "    (void)axes;\n";
    }
    text += &arguments(code, &[0, 2]);
    // gcc tests only a limited number of columns for overlap; the pragma asserts that there is none.
    text += "#if defined(__GNUC__) && !defined(__clang__)\n#pragma GCC ivdep\n#endif\n";
    text += "    for (size_t i = 0; i < n; ++i) {\n";
    for (_, input) in &axes {
        text += &format!("        const double {input} = column_{input}[i];\n");
    }
    text += &lines(code.assignments("        const double ", ";"));
    text += &results(code, |name, index, value| format!("        {name}_{index}[i] = {value};\n"));
    text + "    }\n}\n"
}

/// A line for each value and each derivative, by the name of its array, its index and its expression.
fn results(code: &Code<'_>, line: impl Fn(&str, usize, &str) -> String) -> String {
    let (values, slopes) = code.results();
    let of = |name: &str, results: &[String]| {
        let lines = results.iter().enumerate().map(|(index, result)| line(name, index, result));
        lines.collect::<String>()
    };
    of("value", &values) + &of("gradient", &slopes)
}

/// Declares the used arguments of the given groups by name; marks a group without any as unused.
fn arguments(code: &Code<'_>, groups: &[usize]) -> String {
    let mut text = String::new();
    for group in groups {
        let used = code.used(*group);
        for (number, input) in &used {
            text += &format!("    const double {input} = {}[{number}];\n", GROUPS[*group]);
        }
        if used.is_empty() {
            text += &format!("    (void){};\n", GROUPS[*group]);
        }
    }
    text
}
