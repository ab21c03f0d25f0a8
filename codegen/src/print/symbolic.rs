//! Expressions for SymPy and CasADi: Python functions over symbols, with named arguments.

use crate::check::Checked;
use crate::print::Style;
use crate::print::code::{Code, Syntax, functions, lines, name};
use crate::print::language::Language;
use crate::symbol::Unary;

/// SymPy expressions.
pub(crate) struct SymPy;

/// CasADi functions.
pub(crate) struct CasAdi;

const SYMPY: Syntax = Syntax {
    times: "*",
    over: "/",
    call: |function, x| match function {
        Unary::Step => format!("sp.Heaviside({x}, 1)"),
        Unary::Floor => format!("sp.floor({x})"),
        Unary::Round => format!("sp.sign({x}) * sp.floor(sp.Abs({x}) + 0.5)"),
        other => format!("sp.{}({x})", name(other)),
    },
    reserved: "value gradient sp",
};

const CASADI: Syntax = Syntax {
    times: "*",
    over: "/",
    call: |function, x| match function {
        Unary::Step => format!("(({x}) >= 0.0)"),
        Unary::Round => format!("(ca.sign({x}) * ca.floor(ca.fabs({x}) + 0.5))"),
        other => format!("ca.{}({x})", name(other)),
    },
    reserved: "value gradient ca nan inputs outputs names options",
};

/// The names of the arguments of a kind, each in a pattern.
fn names(code: &Code<'_>, errors: bool, each: impl Fn(&str) -> String) -> String {
    let names: Vec<String> = code.named(errors).map(|argument| each(&argument.name)).collect();
    names.join(", ")
}

/// The steps of the function.
fn body(code: &Code<'_>, per_degree: &str) -> String {
    let angles = code.of_angles(per_degree).into_iter().map(|(name, value)| format!("    {name} = {value}"));
    lines(angles) + &lines(code.assignments("    ", ""))
}

impl Language for SymPy {
    fn print(&self, checked: &Checked<'_>, style: &Style) -> String {
        let functions = functions(checked, style, &SYMPY);
        let whole = &functions[functions.len() - 1];
        let header = lines(whole.header(0, ['[', ']']));
        let mut file =
            format!("\"\"\"\n{header}Every argument is its symbol by default.\n\"\"\"\n\nimport sympy as sp\n\n");
        for argument in &whole.arguments {
            file += &format!("{0} = sp.Symbol(\"{0}\", real=True)\n", argument.name);
        }
        let parameters = names(whole, true, |name| format!("{name},")).replace(",,", ",");
        file += &format!("# The order of the gradient.\nPARAMETERS = ({})\n", parameters.replace(",, ", ", "));
        for code in &functions {
            let given = [names(code, false, |n| format!("{n}={n}")), names(code, true, |n| format!("{n}={n}"))];
            let given: Vec<String> = given.into_iter().filter(|names| !names.is_empty()).collect();
            let what = if code.gradient { "Value, and gradient: a row for each output." } else { "Value." };
            let (values, slopes) = code.results();
            let value = match values.as_slice() {
                [one] => one.clone(),
                several => format!("sp.Matrix([{}])", several.join(", ")),
            };
            let gradient = if code.gradient {
                let rows: Vec<String> = slopes.iter().map(|slope| format!("        {slope},\n")).collect();
                format!(", sp.Matrix({}, {}, [\n{}    ])", code.outputs(), code.errors(), rows.concat())
            } else {
                String::new()
            };
            file += &format!(
                "\n\ndef {}(*, {}):\n    \"\"\"{what}\"\"\"\n{}    return {value}{gradient}\n",
                code.function(),
                given.join(", "),
                body(code, "sp.pi / 180")
            );
        }
        file
    }
}

impl Language for CasAdi {
    fn print(&self, checked: &Checked<'_>, style: &Style) -> String {
        let functions = functions(checked, style, &CASADI);
        let whole = &functions[functions.len() - 1];
        let header = lines(whole.header(0, ['[', ']']));
        let mut file = format!(
            "\"\"\"\n{header}Each function returns a casadi.Function with named inputs and outputs; a length or \
             position that is not given is not a number.\n\"\"\"\n\nfrom math import nan\n\nimport casadi as ca\n"
        );
        for code in &functions {
            let symbols = code.arguments.iter().map(|a| format!("    {0} = ca.SX.sym(\"{0}\")\n", a.name));
            let symbols: String = symbols.collect();
            let all: Vec<&str> = code.arguments.iter().map(|argument| argument.name.as_str()).collect();
            let defaults = code.arguments.iter().map(|a| if a.error { "0.0" } else { "nan" });
            let defaults: Vec<&str> = defaults.collect();
            let quoted: Vec<String> = all.iter().map(|name| format!("\"{name}\"")).collect();
            let (values, slopes) = code.results();
            let mut outputs = vec![format!("ca.vertcat({})", values.join(", "))];
            let mut words = vec!["\"value\""];
            if code.gradient {
                let rows = slopes.chunks(code.errors().max(1)).map(|row| format!("ca.horzcat({})", row.join(", ")));
                outputs.push(format!("ca.vertcat({})", rows.collect::<Vec<_>>().join(", ")));
                words.push("\"gradient\"");
            }
            let name = code.function();
            file += &format!(
                "\n\ndef {name}() -> ca.Function:\n{symbols}{}    inputs = [{}]\n    outputs = [{}]\n    \
                 names = [{}]\n    options = {{\"default_in\": [{}]}}\n    \
                 return ca.Function(\"{name}\", inputs, outputs, names, [{}], options)\n",
                body(code, "(ca.pi / 180)"),
                all.join(", "),
                outputs.join(", "),
                quoted.join(", "),
                defaults.join(", "),
                words.join(", ")
            );
        }
        file
    }
}
