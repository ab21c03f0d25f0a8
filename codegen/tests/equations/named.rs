//! Compiles or interprets printed code with named arguments and compares it with dual numbers. Wrong names and wrong
//! shapes must be errors.

use std::fmt::Write;
use std::path::PathBuf;
use std::process::Command;

use abbe_codegen::print::Layout;
use abbe_codegen::{Equation, Options, ToolPoint};
use abbe_model::frames::Rotation;
use rand::SeedableRng;

use crate::programs::{Printed, check_all, laid_out};
use crate::support::{self, Chapter5, eight, hermle};
use crate::tools;
use crate::topologies::{What, cases};

/// The names of the arguments.
fn names(printed: &Printed) -> Vec<String> {
    printed.named(&printed.cases[0]).into_iter().map(|(name, _)| name).collect()
}

/// The arguments of the cases, a line each.
fn points(printed: &Printed) -> String {
    let row = |case| tools::line(printed.named(case).into_iter().map(|(_, value)| value));
    printed.cases.iter().map(|case| row(case) + "\n").collect()
}

/// Writes the modules, their points and a program, and runs it.
fn run_python(python: &PathBuf, name: &str, all: &[Printed], each: &str) -> String {
    let folder = tools::folder(name);
    let mut main =
        String::from("import numpy as np\n\ndef show(x):\n    print(' '.join(repr(float(v)) for v in x))\n\n");
    for printed in all {
        tools::write(&folder.join(format!("{}.py", printed.name)), &printed.text);
        tools::write(&folder.join(format!("{}.txt", printed.name)), &points(printed));
        let _ = write!(
            main,
            "import {0} as module\nnames = {1:?}\nerrors = names[len(names) - {2}:]\nf, g = module.{3}, module.{3}_gradient\n\
             rows = np.loadtxt('{0}.txt')\n{each}\n",
            printed.name,
            names(printed),
            printed.errors(),
            printed.function,
        );
    }
    tools::write(&folder.join("main.py"), &main);
    let output = tools::run(Command::new(python).current_dir(&folder).args(["-W", "error", "main.py"]));
    let _ = std::fs::remove_dir_all(&folder);
    output
}

#[test]
fn numpy() {
    let Some(python) = test_needs::python("named::numpy", "numpy") else { return };
    let all = laid_out("python", Layout::Named);
    let each = "
for row in rows:
    v, s = g(**dict(zip(names, row)))
    assert np.array_equal(v, f(**dict(zip(names, row))))
    show(np.concatenate([np.ravel(v), np.ravel(s)]))
print('columns')
v, s = g(**dict(zip(names, rows.T)))
for row in np.concatenate([np.reshape(v, (-1, len(rows))), np.reshape(s, (-1, len(rows)))]).T:
    show(row)
print('next')
# Errors are 0 by default; wrong names, shapes and lists are refused.
nominal = {name: value for name, value in zip(names, rows[0]) if name not in errors}
assert np.array_equal(f(**nominal), f(**nominal, **dict.fromkeys(errors, 0.0)))
def refused(kind, call):
    try:
        call()
    except kind:
        return
    raise AssertionError('accepted')
refused(TypeError, lambda: f(**nominal, EZ9Q=0.1))
refused(TypeError, lambda: f(rows[0], rows[0], rows[0]))
refused(TypeError, lambda: f(**{name: nominal[name] for name in list(nominal)[1:]}))
short = dict.fromkeys(names[:1], rows[:2, 0]) | dict.fromkeys(names[1:2], rows[:3, 1])
refused(ValueError, lambda: f(**(dict(zip(names, rows[0])) | short)))
";
    check_all(&all, &run_python(&python, "named-numpy", &all, each));
}

#[test]
fn casadi() {
    let Some(python) = test_needs::python("named::casadi", "numpy, casadi") else { return };
    let all = laid_out("casadi", Layout::Named);
    let each = "
f, g = f(), g()
for row in rows:
    at = dict(zip(names, row))
    found = g(**at)
    assert np.array_equal(np.array(found['value']), np.array(f(**at)['value']))
    show(np.concatenate([np.ravel(np.array(found['value'])), np.ravel(np.array(found['gradient']))]))
print('columns')
for row in rows:
    found = g(**dict(zip(names, row)))
    show(np.concatenate([np.ravel(np.array(found['value'])), np.ravel(np.array(found['gradient']))]))
print('next')
nominal = {name: value for name, value in zip(names, rows[0]) if name not in errors}
assert np.array_equal(np.array(f(**nominal)['value']), np.array(f(**nominal, **dict.fromkeys(errors, 0.0))['value']))
try:
    f(**nominal, EZ9Q=0.1)
    raise AssertionError('accepted')
except RuntimeError:
    pass
";
    check_all(&all, &run_python(&python, "named-casadi", &all, each));
}

/// SymPy differentiates its expression; value and derivatives agree with dual numbers.
#[test]
fn sympy() {
    let Some(python) = test_needs::python("named::sympy", "numpy, sympy") else { return };
    let mut random = rand_pcg::Pcg64::seed_from_u64(12);
    let mut all = Vec::new();
    for (name, rotation) in [("exact", Rotation::Exact), ("small", Rotation::SmallAngle)] {
        let machine = hermle(rotation);
        let options = Options { gradient: true, ..Options::default() };
        let equation = Equation::volumetric(&machine, &eight(), &options).expect("an equation");
        all.push(Printed {
            name: format!("volumetric_{name}"),
            function: "volumetric_error",
            text: support::laid_out(&equation, &ToolPoint, "sympy", Layout::Named),
            inputs: equation.program(false).inputs,
            cases: cases(What::Volumetric, &machine, &eight(), 5, &mut random),
        });
        let source = Chapter5 { extended: true };
        let equation = Equation::of(&machine, &source, &eight(), &options).expect("an equation");
        let program = equation.program(true);
        let cases = (0..5).map(|_| {
            let arguments = bar_arguments(&mut random);
            let found = program.run(&arguments.concat());
            crate::topologies::Case { arguments, values: found[..1].to_vec(), gradient: found[1..].to_vec() }
        });
        all.push(Printed {
            name: format!("bar_{name}"),
            function: "bar_length",
            text: support::laid_out(&equation, &source, "sympy", Layout::Named),
            inputs: equation.program(false).inputs,
            cases: cases.collect(),
        });
    }
    let each = "
import sympy as sp
value = sp.Matrix([f()])
symbols = [getattr(module, name) for name in names]
own = sp.lambdify(symbols, [value, value.jacobian(module.PARAMETERS)], modules='numpy', cse=True)
printed = sp.lambdify(symbols, [sp.Matrix([g()[0]]), g()[1]], modules='numpy', cse=True)
for called in (own, printed):
    for row in rows:
        v, s = called(*row)
        show(np.concatenate([np.ravel(v), np.ravel(s)]))
    if called is own: print('columns')
print('next')
assert tuple(errors) == tuple(str(symbol) for symbol in module.PARAMETERS)
";
    check_all(&all, &run_python(&python, "named-sympy", &all, each));
}

/// Random lengths, angles and errors of the chapter 5 test.
fn bar_arguments(random: &mut impl rand::Rng) -> [Vec<f64>; 3] {
    use rand::RngExt;
    let lengths = (0..4).map(|_| random.random_range(60.0..140.0)).collect();
    let angles: [f64; 2] = [random.random_range(-3.0..3.0), random.random_range(-3.0..3.0)];
    let axes = angles.iter().flat_map(|angle| [angle.sin(), angle.cos()]).collect();
    let size = |index: usize| if matches!(index, 2 | 3 | 6 | 7) { 0.1 } else { 10.0 };
    let errors = (0..8).map(|index| random.random_range(-size(index)..size(index))).collect();
    [lengths, axes, errors]
}

#[test]
fn c() {
    let cc = std::env::var("CC").unwrap_or_default();
    let Some(cc) = test_needs::program("named::c", &[&cc, "gcc", "cc"], &["--version"]) else {
        return;
    };
    let folder = tools::folder("named-c");
    let all = laid_out("c", Layout::Named);
    let mut output = String::new();
    for printed in &all {
        let (function, names) = (printed.function, names(printed));
        let (nominal, errors) = names.split_at(names.len() - printed.errors());
        // The size of the array that the function fills; a function of one value returns it.
        let outputs = printed.text.split_once("double value[").map_or(1, |(_, after)| {
            after.split(']').next().and_then(|size| size.parse().ok()).expect("the size of an array")
        });
        let given = |names: &[String], first: usize| -> String {
            let fields = names.iter().enumerate();
            fields.map(|(index, name)| format!(".{name} = x[{}], ", first + index)).collect()
        };
        let shown =
            |of: &str| -> String { errors.iter().map(|name| format!("printf(\"%.17g \", {of}{name});\n")).collect() };
        let body = if outputs > 1 {
            let shown: String = (0..outputs).map(|output| shown(&format!("g[{output}]."))).collect();
            format!(
                "double v[{outputs}], alone[{outputs}]; struct {function}_errors g[{outputs}]; {function}_gradient(&n, &e, v, g); {function}(&n, &e, alone);
                for (int k = 0; k < {outputs}; ++k) {{ printf(\"%.17g \", v[k]); if (v[k] < alone[k] || v[k] > alone[k]) return 2; }}\n{shown}"
            )
        } else {
            format!(
                "struct {function}_errors g; const double v = {function}_gradient(&n, &e, &g), alone = {function}(&n, &e);
                printf(\"%.17g \", v); if (v < alone || v > alone) return 2;\n{}",
                shown("g.")
            )
        };
        let text = format!(
            "#include \"one.h\"\n#include <stdio.h>\nint main(void) {{ double x[{0}];
            for (int r = 0; r < {1}; ++r) {{ for (int k = 0; k < {0}; ++k) if (scanf(\"%lf\", &x[k]) != 1) return 1;
            const struct {function}_nominal n = {{ {2} }}; const struct {function}_errors e = {{ {3} }};
            {body} printf(\"\\n\"); }} return 0; }}\n",
            names.len(),
            printed.cases.len(),
            given(nominal, 0),
            given(errors, nominal.len())
        );
        tools::write(&folder.join("one.h"), &printed.text);
        tools::write(&folder.join("run.c"), &text);
        tools::write(&folder.join("points.txt"), &points(printed));
        let strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "run.c", "-o", "run", "-lm"];
        tools::run(Command::new(&cc).current_dir(&folder).args(strict));
        let stdin = std::fs::File::open(folder.join("points.txt")).expect("the file just written");
        let found = tools::run(Command::new(folder.join("run")).stdin(stdin));
        let _ = write!(output, "{found}columns\n{found}next\n");
    }
    check_all(&all, &output);
    // A name that is no error does not compile.
    tools::write(&folder.join("one.h"), &all[0].text);
    let wrong = format!("#include \"one.h\"\nstruct {}_errors e = {{ .EZ9Q = 0.1 }};\n", all[0].function);
    tools::write(&folder.join("wrong.c"), &wrong);
    let refused = Command::new(&cc).current_dir(&folder).args(["-c", "wrong.c"]).output().expect("a compiler");
    assert!(!refused.status.success());
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn rust() {
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
    let Some(rustc) = test_needs::program("named::rust", &[&rustc], &["--version"]) else {
        return;
    };
    let folder = tools::folder("named-rust");
    let all = laid_out("rust", Layout::Named);
    let mut main = String::from(
        "#![deny(warnings)]\nfn numbers(text: &str) -> Vec<f64> { text.split_whitespace().map(|w| w.parse().unwrap()).collect() }\n\
         fn show(x: &[f64]) { println!(\"{}\", x.iter().map(|x| format!(\"{x:?}\")).collect::<Vec<_>>().join(\" \")); }\n",
    );
    let mut calls = String::new();
    for printed in &all {
        let (name, function, names) = (&printed.name, printed.function, names(printed));
        tools::write(&folder.join(format!("{name}.rs")), &printed.text);
        tools::write(&folder.join(format!("{name}.txt")), &points(printed));
        let (nominal, errors) = names.split_at(names.len() - printed.errors());
        let given = |names: &[String], first: usize| -> String {
            names.iter().enumerate().map(|(index, name)| format!("{name}: x[{}], ", first + index)).collect()
        };
        let shown = |of: &str| -> String { errors.iter().map(|name| format!("{of}{name}, ")).collect() };
        let shown = if printed.cases[0].values.len() > 1 {
            let slopes: String = (0..3).map(|output| shown(&format!("g[{output}]."))).collect();
            format!("v[0], v[1], v[2], {slopes}")
        } else {
            format!("v, {}", shown("g."))
        };
        let _ = write!(
            main,
            "#[allow(dead_code)] mod {name};
fn run_{name}() {{ for x in include_str!(\"{name}.txt\").lines().map(numbers) {{
    let n = {name}::Nominal {{ {} }}; let e = {name}::Errors {{ {} }};
    let (v, g) = {name}::{function}_gradient(&n, &e);
    assert_eq!(v, {name}::{function}(&n, &e));
    show(&[{shown}]);
}} }}\n",
            given(nominal, 0),
            given(errors, nominal.len())
        );
        let _ = writeln!(calls, "run_{name}(); println!(\"columns\"); run_{name}(); println!(\"next\");");
    }
    let _ = writeln!(main, "fn main() {{ {calls} }}");
    tools::write(&folder.join("main.rs"), &main);
    let binary = folder.join("run");
    tools::run(Command::new(rustc).current_dir(&folder).args(["--edition", "2024", "main.rs", "-o"]).arg(&binary));
    check_all(&all, &tools::run(&mut Command::new(&binary)));
    let _ = std::fs::remove_dir_all(&folder);
}

/// MATLAB's block of arguments as statements: Octave has none before version 11.
fn for_octave(text: &str) -> String {
    let (head, rest) = text.split_once("(in)\n").expect("named arguments");
    let (comments, rest) = rest.split_once("  arguments\n").expect("a block of arguments");
    let (block, body) = rest.split_once("  end\n").expect("its end");
    let default = |line: &str| {
        let name = line.trim().strip_prefix("in.")?.split(' ').next()?;
        line.ends_with(" = 0").then(|| format!("  if ~isfield(in, '{name}'), in.{name} = 0; end\n"))
    };
    let defaults: String = block.lines().filter_map(default).collect();
    format!("{head}(varargin)\n{comments}  in = struct(varargin{{:}});\n{defaults}{body}")
}

#[test]
fn octave() {
    let Some(octave) = test_needs::program("named::octave", &["octave-cli", "octave"], &["--version"]) else {
        return;
    };
    let folder = tools::folder("named-octave");
    let all = laid_out("matlab", Layout::Named);
    let mut main = String::from("1;\nfunction show(x)\n  printf('%.17g ', x);\n  printf('\\n');\nend\n");
    for printed in &all {
        let (name, function, names) = (&printed.name, printed.function, names(printed));
        let own = folder.join(name);
        std::fs::create_dir_all(&own).expect("a folder");
        tools::write(&own.join(format!("{function}.m")), &for_octave(&printed.text));
        tools::write(&own.join("points.txt"), &points(printed));
        let nominal = &names[..names.len() - printed.errors()];
        let quoted: Vec<String> = names.iter().map(|name| format!("'{name}'")).collect();
        let _ = write!(
            main,
            "cd('{}');\nclear('{function}');\nrows = load('points.txt');\nnames = {{{}}};
for r = 1:size(rows, 1)
  at = [names; num2cell(rows(r, :))];
  [v, g] = {function}(at{{:}});
  if any(v ~= {function}(at{{:}})), error('value'); end
  show([v; g]);
end
printf('columns\\n');
all = [names; num2cell(rows, 1)];
all(2, :) = cellfun(@(x) x', all(2, :), 'UniformOutput', false);
[v, g] = {function}(all{{:}});
both = [v; g];
for r = 1:size(rows, 1)
  show(both(:, r));
end
printf('next\\n');
zero = [names; num2cell([rows(1, 1:{2}), zeros(1, {3})])];
some = zero(:, 1:{2});
if any({function}(some{{:}}) ~= {function}(zero{{:}})), error('default'); end\n",
            own.display(),
            quoted.join(", "),
            nominal.len(),
            printed.errors()
        );
    }
    tools::write(&folder.join("main.m"), &main);
    let strict = ["--no-gui", "--norc", "--quiet", "main.m"];
    check_all(&all, &tools::run(Command::new(octave).current_dir(&folder).args(strict)));
    let _ = std::fs::remove_dir_all(&folder);
}
