//! Printer for C99: one function for one reading, and one for columns of readings with a loop that vectorises.

use std::fmt::Write;

use crate::equation::Equation;
use crate::print::code::{Code, GROUPS};
use crate::print::dialect::Dialect;
use crate::symbol::Unary;

struct C<'c, 'e>(&'c Code<'e>);

impl Dialect for C<'_, '_> {
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
            Unary::Sin => format!("sin({argument})"),
            Unary::Cos => format!("cos({argument})"),
            Unary::Sqrt => format!("sqrt({argument})"),
            Unary::Exp => format!("exp({argument})"),
            Unary::Signum => format!("(double)((({argument}) > 0.0) - (({argument}) < 0.0))"),
            Unary::Step => format!("(double)(({argument}) >= 0.0)"),
            Unary::Floor => format!("floor({argument})"),
            Unary::Round => format!("round({argument})"),
        }
    }
}

/// Prints the file.
pub(crate) fn print(equation: &Equation) -> String {
    let value = Code::new(equation, false);
    let whole = Code::new(equation, equation.options.gradient);
    let mut file = String::from("/*\n");
    for line in whole.header(0, ['[', ']']) {
        let _ = writeln!(file, "{}", format!(" * {line}").trim_end());
    }
    let advice = match whole.program.operations().roots {
        0 => "",
        _ => {
            " * Compile with -O3 -fno-math-errno, otherwise the square root prevents vectorisation of the loop over readings.\n"
        }
    };
    let _ = writeln!(
        file,
        " * Columns: n readings; axes[a * n + i] and the results value[j * n + i]{} of reading i.\n{advice} */\n\
         #include <math.h>\n#include <stddef.h>\n",
        if equation.options.gradient {
            format!(", gradient[(j * {} + k) * n + i]", whole.errors())
        } else {
            String::new()
        }
    );
    kernel(&mut file, &value, false);
    if equation.options.gradient {
        kernel(&mut file, &whole, true);
    }
    file.truncate(file.trim_end().len());
    file.push('\n');
    file
}

fn kernel(file: &mut String, code: &Code<'_>, gradient: bool) {
    let dialect = C(code);
    let suffix = if gradient { "_gradient" } else { "" };
    let name = format!("{}{suffix}", code.function());
    let slopes = if gradient { ", double *gradient" } else { "" };
    let what = if gradient { "Value and gradient" } else { "Value" };
    let one = format!(
        "void {name}(const double *lengths, const double *axes, const double *errors, double *value{slopes})"
    );
    let _ = writeln!(file, "/* {what} of one reading. */\n{one};\n\n{one}\n{{");
    declare(file, code, "    ", &[0, 1, 2]);
    for line in code.lines(&dialect, |name, value| {
        format!("    const double {name} = {value};")
    }) {
        let _ = writeln!(file, "{line}");
    }
    let results = code.results(&dialect);
    let (values, derivatives) = results.split_at(code.outputs());
    for (index, value) in values.iter().enumerate() {
        let _ = writeln!(file, "    value[{index}] = {value};");
    }
    for (index, slope) in derivatives.iter().enumerate() {
        let _ = writeln!(file, "    gradient[{index}] = {slope};");
    }
    file.push_str("}\n\n");

    let slopes = if gradient {
        ", double *restrict gradient"
    } else {
        ""
    };
    let many = format!(
        "void {name}_columns(size_t n, const double *restrict lengths, const double *restrict axes, const double *restrict errors, double *restrict value{slopes})"
    );
    let _ = writeln!(file, "/* {what} of n readings. */\n{many};\n\n{many}\n{{");
    // Each column is a pointer of its own, so that the compiler knows that no two overlap.
    for (number, index) in code.groups[1].clone().enumerate() {
        if code.uses(index) {
            let _ = writeln!(
                file,
                "    const double *restrict column_{} = axes + {number} * n;",
                code.inputs[index]
            );
        }
    }
    for index in 0..code.outputs() {
        let _ = writeln!(file, "    double *restrict value_{index} = value + {index} * n;");
    }
    for index in 0..derivatives.len() {
        let _ = writeln!(
            file,
            "    double *restrict gradient_{index} = gradient + {index} * n;"
        );
    }
    if !code.groups[1].clone().any(|index| code.uses(index)) {
        file.push_str("    (void)axes;\n");
    }
    declare(file, code, "    ", &[0, 2]);
    // gcc tests only a limited number of columns for overlap; the pragma asserts that there is none.
    file.push_str("#if defined(__GNUC__) && !defined(__clang__)\n#pragma GCC ivdep\n#endif\n");
    file.push_str("    for (size_t i = 0; i < n; ++i) {\n");
    for index in code.groups[1].clone() {
        if code.uses(index) {
            let input = &code.inputs[index];
            let _ = writeln!(file, "        const double {input} = column_{input}[i];");
        }
    }
    for line in code.lines(&dialect, |name, value| {
        format!("        const double {name} = {value};")
    }) {
        let _ = writeln!(file, "{line}");
    }
    for (index, value) in values.iter().enumerate() {
        let _ = writeln!(file, "        value_{index}[i] = {value};");
    }
    for (index, slope) in derivatives.iter().enumerate() {
        let _ = writeln!(file, "        gradient_{index}[i] = {slope};");
    }
    file.push_str("    }\n}\n\n");
}

/// Declares the used arguments of the given groups by name; marks a group without any as unused.
fn declare(file: &mut String, code: &Code<'_>, indent: &str, groups: &[usize]) {
    for group in groups {
        let mut used = false;
        for (number, index) in code.groups[*group].clone().enumerate() {
            if code.uses(index) {
                used = true;
                let name = &code.inputs[index];
                let _ = writeln!(
                    file,
                    "{indent}const double {name} = {}[{number}];",
                    GROUPS[*group]
                );
            }
        }
        if !used {
            let _ = writeln!(file, "{indent}(void){};", GROUPS[*group]);
        }
    }
}
