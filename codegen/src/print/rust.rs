//! Printer for Rust without dependencies, for one reading and for columns of readings. Only the elementary functions need `std`.

use std::fmt::Write;

use crate::equation::Equation;
use crate::print::code::Code;
use crate::print::dialect::Dialect;
use crate::symbol::Unary;

struct Rust<'c, 'e>(&'c Code<'e>);

impl Dialect for Rust<'_, '_> {
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
        let name = match function {
            Unary::Neg => return format!("-({argument})"),
            Unary::Sin => "sin",
            Unary::Cos => "cos",
            Unary::Sqrt => "sqrt",
            Unary::Exp => "exp",
            Unary::Signum => "sign",
            Unary::Step => "step",
            Unary::Floor => "floor",
            Unary::Round => "round",
        };
        format!("elementary::{name}({argument})")
    }
}

/// Prints the file.
pub(crate) fn print(equation: &Equation) -> String {
    let value = Code::new(equation, false);
    let whole = Code::new(equation, equation.options.gradient);
    let mut file = String::new();
    for line in whole.header(0, ['[', ']']) {
        let _ = writeln!(file, "{}", format!("//! {line}").trim_end());
    }
    file.push('\n');
    for (name, places) in ["LENGTHS", "AXES", "ERRORS"].iter().zip(&whole.groups) {
        let what = match *name {
            "LENGTHS" => "Lengths of the set-up.",
            "AXES" if whole.equation.options.effects.is_empty() => {
                "Positions of moving axes: sine and cosine of a rotary one."
            }
            "AXES" => {
                "Positions of moving axes (sine and cosine of a rotary one), and other drivers of effects."
            }
            _ => "Errors and instrument parameters.",
        };
        let _ = writeln!(file, "/// {what}\npub const {name}: usize = {};", places.len());
    }
    file.push('\n');
    single(&mut file, &value, false);
    columns(&mut file, &value, false);
    if equation.options.gradient {
        single(&mut file, &whole, true);
        columns(&mut file, &whole, true);
    }
    elementary(&mut file, &whole);
    file
}

fn function(code: &Code<'_>, gradient: bool) -> String {
    let suffix = if gradient { "_gradient" } else { "" };
    format!("{}{suffix}", code.function())
}

/// The type of one reading's value or of its gradient.
fn shape(code: &Code<'_>, inner: &str) -> String {
    match code.outputs() {
        1 => inner.to_string(),
        outputs => format!("[{inner}; {outputs}]"),
    }
}

/// `a`, or `[a, b, c]` for three outputs.
fn gathered(items: &[String]) -> String {
    match items {
        [one] => one.clone(),
        several => format!("[{}]", several.join(", ")),
    }
}

fn single(file: &mut String, code: &Code<'_>, gradient: bool) {
    let dialect = Rust(code);
    let returned = if gradient {
        format!("({}, {})", shape(code, "f64"), shape(code, "[f64; ERRORS]"))
    } else {
        shape(code, "f64")
    };
    let what = if gradient {
        "Value and gradient of one reading."
    } else {
        "Value of one reading."
    };
    let _ = writeln!(
        file,
        "/// {what}\n#[inline(always)]\n#[must_use]\npub fn {}(lengths: &[f64; LENGTHS], axes: &[f64; AXES], errors: &[f64; ERRORS]) -> {returned} {{",
        function(code, gradient)
    );
    for (group, places) in crate::print::code::GROUPS.iter().zip(&code.groups) {
        let names: Vec<String> = places
            .clone()
            .map(|index| {
                if code.uses(index) {
                    code.inputs[index].clone()
                } else {
                    "_".to_string()
                }
            })
            .collect();
        let _ = writeln!(file, "    let [{}] = *{group};", names.join(", "));
    }
    let mut lines = code.lines(&dialect, |name, value| format!("    let {name} = {value};"));
    let results = code.results(&dialect);
    // If the last step is the only result, it needs no name.
    if let (false, [only], Some(last)) = (gradient, results.as_slice(), lines.last())
        && let Some(value) = last.strip_prefix(&format!("    let {only} = "))
    {
        let value = value.trim_end_matches(';').to_string();
        lines.pop();
        lines.push(format!("    {value}\n}}\n"));
        let _ = writeln!(file, "{}", lines.join("\n"));
        return;
    }
    for line in lines {
        let _ = writeln!(file, "{line}");
    }
    let (values, slopes) = results.split_at(code.outputs());
    let value = gathered(values);
    if gradient {
        let rows: Vec<String> = if code.errors() == 0 {
            vec!["[]".to_string(); code.outputs()]
        } else {
            slopes
                .chunks(code.errors())
                .map(|row| format!("[\n        {},\n    ]", row.join(",\n        ")))
                .collect()
        };
        let _ = writeln!(file, "    let gradient = {};", gathered(&rows));
        let _ = writeln!(file, "    ({value}, gradient)");
    } else {
        let _ = writeln!(file, "    {value}");
    }
    file.push_str("}\n\n");
}

/// Evaluates four readings at a time. The arrays of a block cannot overlap, so that the loop over its lanes is vectorised, and they are
/// small enough to stay in registers.
fn columns(file: &mut String, code: &Code<'_>, gradient: bool) {
    let name = function(code, gradient);
    let (outputs, errors) = (code.outputs(), code.errors());
    let slopes = if gradient {
        format!(", gradient: &mut [&mut [f64]; {}]", outputs * errors)
    } else {
        String::new()
    };
    let and = if gradient { " and gradients" } else { "" };
    let _ = write!(
        file,
        "/// Values{and} of columns of readings: a slice for each axis input, for each output{}.\n\
         ///\n/// # Panics\n/// If a column has another length than `value[0]`.\n\
         pub fn {name}_columns(lengths: &[f64; LENGTHS], axes: &[&[f64]; AXES], errors: &[f64; ERRORS], value: &mut [&mut [f64]; {outputs}]{slopes}) {{\n    \
         const LANES: usize = 4;\n    \
         let n = value[0].len();\n    \
         for column in axes {{\n        assert_eq!(column.len(), n, \"a column of axis positions is not as long as the values\");\n    }}\n",
        if gradient {
            ", for each derivative (output by output)"
        } else {
            ""
        },
    );
    let _ = writeln!(file, "    let mut at = 0;\n    while at + LANES <= n {{");
    let _ = writeln!(file, "        let mut v = [[0.0; LANES]; {outputs}];");
    if gradient {
        let _ = writeln!(file, "        let mut g = [[0.0; LANES]; {}];", outputs * errors);
    }
    let _ = write!(
        file,
        "        let mut x = [[0.0; LANES]; AXES];\n        \
         for (block, column) in x.iter_mut().zip(axes) {{\n            block.copy_from_slice(&column[at..at + LANES]);\n        }}\n        \
         for lane in 0..LANES {{\n"
    );
    let row = |index: &dyn Fn(usize) -> String, count: usize| {
        let inputs: Vec<String> = (0..count).map(index).collect();
        inputs.join(", ")
    };
    let axes = code.groups[1].len();
    let pattern = if gradient { "(values, slopes)" } else { "values" };
    let _ = writeln!(
        file,
        "            let {pattern} = {name}(lengths, &[{}], errors);",
        row(&|a| format!("x[{a}][lane]"), axes)
    );
    for output in 0..outputs {
        let of = if outputs == 1 {
            String::new()
        } else {
            format!("[{output}]")
        };
        let _ = writeln!(file, "            v[{output}][lane] = values{of};");
        if gradient {
            for k in 0..errors {
                let _ = writeln!(
                    file,
                    "            g[{}][lane] = slopes{of}[{k}];",
                    output * errors + k
                );
            }
        }
    }
    file.push_str("        }\n");
    file.push_str("        for (column, block) in value.iter_mut().zip(&v) {\n            column[at..at + LANES].copy_from_slice(block);\n        }\n");
    if gradient {
        file.push_str("        for (column, block) in gradient.iter_mut().zip(&g) {\n            column[at..at + LANES].copy_from_slice(block);\n        }\n");
    }
    file.push_str("        at += LANES;\n    }\n    for i in at..n {\n");
    let _ = writeln!(
        file,
        "        let {pattern} = {name}(lengths, &[{}], errors);",
        row(&|a| format!("axes[{a}][i]"), axes)
    );
    for output in 0..outputs {
        let of = if outputs == 1 {
            String::new()
        } else {
            format!("[{output}]")
        };
        let _ = writeln!(file, "        value[{output}][i] = values{of};");
        if gradient {
            let _ = writeln!(
                file,
                "        for (k, slope) in slopes{of}.iter().enumerate() {{\n            gradient[{}k][i] = *slope;\n        }}",
                if output == 0 {
                    String::new()
                } else {
                    format!("{} + ", output * errors)
                }
            );
        }
    }
    file.push_str("    }\n}\n\n");
}

/// The functions that `core` lacks, if the code calls them.
fn elementary(file: &mut String, code: &Code<'_>) {
    let dialect = Rust(code);
    let mut text = code.lines(&dialect, |_, value| value.to_string()).concat();
    text.push_str(&code.results(&dialect).concat());
    let functions = [
        ("sqrt", "x.sqrt()"),
        ("sin", "x.sin()"),
        ("cos", "x.cos()"),
        ("exp", "x.exp()"),
        ("sign", "if x == 0.0 { 0.0 } else { x.signum() }"),
        ("step", "if x >= 0.0 { 1.0 } else { 0.0 }"),
        ("floor", "x.floor()"),
        ("round", "x.round()"),
    ];
    let used: Vec<_> = functions
        .iter()
        .filter(|(name, _)| text.contains(&format!("elementary::{name}(")))
        .collect();
    if used.is_empty() {
        return;
    }
    file.push_str("/// Functions that `core` lacks. In a crate without `std` replace them by those of `libm`; nothing else needs `std`.\nmod elementary {\n");
    for (index, (name, body)) in used.iter().enumerate() {
        let gap = if index == 0 { "" } else { "\n" };
        let _ = write!(
            file,
            "{gap}    #[inline(always)]\n    pub fn {name}(x: f64) -> f64 {{\n        {body}\n    }}\n"
        );
    }
    file.push_str("}\n");
}
