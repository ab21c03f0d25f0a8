//! Rust without dependencies, for one reading and for columns of readings. Only the elementary functions need `std`.

use crate::check::Checked;
use crate::print::code::{Code, GROUPS, Syntax, functions, lines, name};
use crate::print::language::Language;
use crate::print::{Layout, Style};

/// Rust without dependencies.
pub(crate) struct Rust;

const SYNTAX: Syntax = Syntax {
    times: "*",
    over: "/",
    call: |function, x| format!("elementary::{}({x})", name(function)),
    reserved: "nominal elementary",
};

impl Language for Rust {
    fn print(&self, checked: &Checked<'_>, style: &Style) -> String {
        let functions = functions(checked, style, &SYNTAX);
        let whole = &functions[functions.len() - 1];
        let header = whole.header(0, ['[', ']']).into_iter();
        let mut file = lines(header.map(|line| format!("//! {line}").trim_end().to_string())) + "\n";
        if style.layout == Layout::Named {
            let structures = [
                (false, "Lengths, positions and drivers; all of them are stated.", ""),
                (true, "Errors.", ", Default"),
            ];
            for (errors, what, derived) in structures {
                let name = if errors { "Errors" } else { "Nominal" };
                let fields = whole
                    .named(errors)
                    .map(|a| format!("    /// {}, {}.\n    pub {}: f64,\n", a.meaning, a.unit, a.name));
                file += &format!(
                    "/// {what}\n#[allow(non_snake_case)]\n\
                     #[derive(Clone, Copy, Debug, PartialEq{derived})]\npub struct {name} \
                     {{\n{}}}\n\n",
                    fields.collect::<String>()
                );
            }
            file += &functions.iter().map(named).collect::<Vec<_>>().join("\n");
            file.push('\n');
            return file + &elementary(whole);
        }
        let axes = if checked.equation.options.effects.is_empty() {
            "Positions of moving axes: sine and cosine of a rotary one."
        } else {
            "Positions of moving axes (sine and cosine of a rotary one), and other drivers of effects."
        };
        let groups = ["Lengths of the set-up.", axes, "Errors and instrument parameters."];
        for ((name, what), places) in GROUPS.iter().zip(groups).zip(&whole.groups) {
            let name = name.to_uppercase();
            file += &format!("/// {what}\npub const {name}: usize = {};\n", places.len());
        }
        for code in &functions {
            file.extend(["\n", &single(code), "\n", &columns(code)]);
        }
        file.push('\n');
        file + &elementary(whole)
    }
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

/// The function with named arguments.
fn named(code: &Code<'_>) -> String {
    let (returned, what) = if code.gradient {
        (format!("({}, {})", shape(code, "f64"), shape(code, "Errors")), "Value, and its derivatives by the errors")
    } else {
        (shape(code, "f64"), "Value")
    };
    let mut text = format!(
        "/// {what}.\n#[allow(non_snake_case, unused_variables)]\n#[must_use]\n\
         pub fn {}(nominal: &Nominal, errors: &Errors) -> {returned} {{\n",
        code.function()
    );
    for errors in [false, true] {
        let group = if errors { "Errors" } else { "Nominal" };
        let used = code.named(errors).filter(|argument| code.uses_argument(argument));
        let names: Vec<&str> = used.map(|argument| argument.name.as_str()).collect();
        let names = names.iter().map(|name| format!("{name}, ")).collect::<String>();
        text += &format!("    let {group} {{ {names}.. }} = *{};\n", group.to_lowercase());
    }
    let angles = code.of_angles("(core::f64::consts::PI / 180.0)").into_iter();
    text += &lines(angles.map(|(name, value)| format!("    let {name} = {value};")));
    text += &lines(code.assignments("    let ", ";"));
    let (values, slopes) = code.results();
    let mut value = gathered(&values);
    if code.gradient {
        let row = |slopes: &[String]| {
            let fields = code.named(true).zip(slopes);
            let fields = fields.map(|(argument, slope)| format!("        {}: {slope},\n", argument.name));
            format!("Errors {{\n{}    }}", fields.collect::<String>())
        };
        let rows: Vec<String> = match code.errors() {
            0 => vec!["Errors {}".to_string(); code.outputs()],
            errors => slopes.chunks(errors).map(row).collect(),
        };
        value = format!("({value}, {})", gathered(&rows));
    }
    text + &format!("    {value}\n}}\n")
}

/// The function for one reading.
fn single(code: &Code<'_>) -> String {
    let (returned, what) = if code.gradient {
        let types = format!("({}, {})", shape(code, "f64"), shape(code, "[f64; ERRORS]"));
        (types, "Value and gradient")
    } else {
        (shape(code, "f64"), "Value")
    };
    let mut text = format!(
        "/// {what} of one reading.\n#[inline(always)]\n#[must_use]\npub fn {}(lengths: &[f64; LENGTHS], \
         axes: &[f64; AXES], errors: &[f64; ERRORS]) -> {returned} {{\n",
        code.function()
    );
    for (group, places) in GROUPS.iter().zip(&code.groups) {
        let input = |index: usize| {
            if code.uses(index) { code.inputs[index].as_str() } else { "_" }
        };
        let names: Vec<&str> = places.clone().map(input).collect();
        text += &format!("    let [{}] = *{group};\n", names.join(", "));
    }
    let mut steps = code.assignments("    let ", ";");
    let (values, slopes) = code.results();
    // If the last step is the only result, it needs no name.
    if let (false, [only], Some(last)) = (code.gradient, values.as_slice(), steps.last())
        && let Some(value) = last.strip_prefix(&format!("    let {only} = "))
    {
        let value = format!("    {}", value.trim_end_matches(';'));
        steps.pop();
        steps.push(value);
        return text + &lines(steps) + "}\n";
    }
    text += &lines(steps);
    let mut value = gathered(&values);
    if code.gradient {
        let rows: Vec<String> = if code.errors() == 0 {
            vec!["[]".to_string(); code.outputs()]
        } else {
            let row = |row: &[String]| format!("[\n        {},\n    ]", row.join(",\n        "));
            slopes.chunks(code.errors()).map(row).collect()
        };
        text += &format!("    let gradient = {};\n", gathered(&rows));
        value = format!("({value}, gradient)");
    }
    text + &format!("    {value}\n}}\n")
}

/// The function for columns of readings, four readings at a time. The arrays of a block cannot overlap, so that the
/// loop over its lanes is vectorised, and they are small enough to stay in registers.
fn columns(code: &Code<'_>) -> String {
    let name = code.function();
    let (outputs, errors) = (code.outputs(), code.errors());
    let all = outputs * errors;
    let only_with_gradient = |text: String| if code.gradient { text } else { String::new() };
    let slopes = only_with_gradient(format!(", gradient: &mut [&mut [f64]; {all}]"));
    let and = only_with_gradient(" and gradients".to_string());
    let each = only_with_gradient(", for each derivative (output by output)".to_string());
    let pattern = if code.gradient { "(values, slopes)" } else { "values" };
    let call = |input: &dyn Fn(usize) -> String| {
        let inputs: Vec<String> = (0..code.groups[1].len()).map(input).collect();
        format!("let {pattern} = {name}(lengths, &[{}], errors);", inputs.join(", "))
    };
    let block = call(&|axis| format!("x[{axis}][lane]"));
    let rest = call(&|axis| format!("axes[{axis}][i]"));
    let blocks_of_slopes = only_with_gradient(format!("        let mut g = [[0.0; LANES]; {all}];\n"));
    let (mut into_block, mut into_rest) = (String::new(), String::new());
    for output in 0..outputs {
        let of = if outputs == 1 { String::new() } else { format!("[{output}]") };
        into_block += &format!("            v[{output}][lane] = values{of};\n");
        into_rest += &format!("        value[{output}][i] = values{of};\n");
        if code.gradient {
            for k in 0..errors {
                into_block += &format!("            g[{}][lane] = slopes{of}[{k}];\n", output * errors + k);
            }
            let first = if output == 0 { String::new() } else { format!("{} + ", output * errors) };
            into_rest += &format!(
                "        for (k, slope) in slopes{of}.iter().enumerate() {{\n            \
                 gradient[{first}k][i] = *slope;\n        }}\n"
            );
        }
    }
    let store = |columns: &str, blocks: &str| {
        format!(
            "        for (column, block) in {columns}.iter_mut().zip(&{blocks}) {{\n            \
             column[at..at + LANES].copy_from_slice(block);\n        }}\n"
        )
    };
    let stored = store("value", "v") + &only_with_gradient(store("gradient", "g"));
    format!(
        "/// Values{and} of columns of readings: a slice for each axis input, for each output{each}.
///
/// # Panics
/// If a column has another length than `value[0]`.
pub fn {name}_columns(lengths: &[f64; LENGTHS], axes: &[&[f64]; AXES], errors: &[f64; ERRORS], \
value: &mut [&mut [f64]; {outputs}]{slopes}) {{
    const LANES: usize = 4;
    let n = value[0].len();
    for column in axes {{
        assert_eq!(column.len(), n, \"a column of axis positions is not as long as the values\");
    }}
    let mut at = 0;
    while at + LANES <= n {{
        let mut v = [[0.0; LANES]; {outputs}];
{blocks_of_slopes}        let mut x = [[0.0; LANES]; AXES];
        for (block, column) in x.iter_mut().zip(axes) {{
            block.copy_from_slice(&column[at..at + LANES]);
        }}
        for lane in 0..LANES {{
            {block}
{into_block}        }}
{stored}        at += LANES;
    }}
    for i in at..n {{
        {rest}
{into_rest}    }}
}}
"
    )
}

/// The functions that `core` lacks, if the code calls them.
fn elementary(code: &Code<'_>) -> String {
    let (values, slopes) = code.results();
    let angles = code.of_angles("").into_iter().map(|(_, value)| value).collect();
    let text = [code.assignments("", ""), values, slopes, angles].concat().concat();
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
    let used =
        functions.iter().filter(|(name, _)| text.contains(&format!("elementary::{name}("))).map(|(name, body)| {
            format!("    #[inline(always)]\n    pub fn {name}(x: f64) -> f64 {{\n        {body}\n    }}\n")
        });
    let used: Vec<String> = used.collect();
    if used.is_empty() {
        return String::new();
    }
    format!(
        "/// Functions that `core` lacks. In a crate without `std` replace them by those of `libm`; nothing else needs \
         `std`.\nmod elementary {{\n{}}}\n",
        used.join("\n")
    )
}
