//! Compiles or interprets printed code and compares it with dual numbers: every topology of Table 1.1 at random errors of 0.1 rad and 10
//! mm, value and gradient, one reading at a time and in columns.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use abbe_codegen::program::Input;
use abbe_codegen::{Equation, Language, Options, Variable};
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::driver::{Driver, DriverPart};
use abbe_model::frames::Rotation;
use rand::{RngExt, SeedableRng};

use crate::effects::{Bar, curve, every_shape};
use crate::operators::Batch;
use crate::tools;
use crate::topologies::{AnyBar, CODES, Case, What, all_errors, cases, disagreement, machine, short};

const CASES: usize = 19;

/// One printed equation and its expected values.
struct Printed {
    name: String,
    function: &'static str,
    text: String,
    cases: Vec<Case>,
}

fn all(language: Language) -> Vec<Printed> {
    let mut random = rand_pcg::Pcg64::seed_from_u64(11);
    let mut printed = Vec::new();
    for code in CODES {
        let machine = machine(code);
        let errors = all_errors(&machine);
        for what in [What::Bar, What::Volumetric] {
            let options = Options {
                gradient: true,
                rotation: Some(Rotation::Exact),
                ..Options::default()
            };
            let equation = match what {
                What::Bar => Equation::of(&machine, &AnyBar, &errors, &options),
                What::Volumetric => Equation::volumetric(&machine, &errors, &options),
            };
            let equation = equation.expect("an equation");
            let (kind, function) = match what {
                What::Bar => ("bar", "bar_length"),
                What::Volumetric => ("vol", "volumetric_error"),
            };
            printed.push(Printed {
                name: format!("{kind}_{}", short(code)),
                function,
                text: equation.print(language).expect("code"),
                cases: cases(what, &machine, &errors, CASES, &mut random),
            });
        }
    }
    printed.extend(operators(language, &mut random));
    printed.push(effects(language, &mut random));
    let probes = crate::probe::printed(language, CASES, &mut random);
    printed.extend(probes.into_iter().map(|(name, text, cases)| Printed {
        name,
        function: "probe_distance",
        text,
        cases,
    }));
    printed
}

/// Compound operands under every operator: three coordinates, each shifted by one of three errors.
fn operators(language: Language, random: &mut impl rand::Rng) -> Vec<Printed> {
    let machine = Machine::from_code("w b X t").expect("a code");
    let errors: Vec<ErrorName> = ["EXX", "EYX", "EZX"]
        .iter()
        .filter_map(|name| ErrorName::parse(name))
        .collect();
    let options = Options {
        gradient: true,
        ..Options::default()
    };
    let mut printed = Vec::new();
    for batch in Batch::all() {
        let equation = Equation::of(&machine, &batch, &errors, &options).expect("an equation");
        let cases = (0..CASES).map(|_| {
            let lengths: [f64; 4] = std::array::from_fn(|_| random.random_range(50.0..150.0));
            let (x, small) = (random.random_range(-100.0..100.0), [0.5, -2.0, 7.0]);
            let ball = batch.coordinates(lengths);
            Case {
                arguments: [lengths.to_vec(), vec![x], small.to_vec()],
                values: vec![ball[0] + small[0] + x, ball[1] + small[1], ball[2] + small[2]],
                gradient: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            }
        });
        printed.push(Printed {
            name: format!("operators_{}", batch.0),
            function: "coordinates",
            text: equation.print(language).expect("code"),
            cases: cases.collect(),
        });
    }
    printed
}

/// A bar with an effect of every shape, against the program that dual numbers confirmed.
fn effects(language: Language, random: &mut impl rand::Rng) -> Printed {
    let machine = Machine::from_code("w C b X t").expect("a code");
    let options = Options {
        gradient: true,
        effects: every_shape().into_iter().chain([curve()]).collect(),
        ..Options::default()
    };
    let errors: Vec<ErrorName> = ErrorName::parse("EX0C").into_iter().collect();
    let equation = Equation::of(&machine, &Bar, &errors, &options).expect("an equation");
    let program = equation.program(true);
    let cases = (0..CASES).map(|_| {
        let angle = random.random_range(-3.0..3.0_f64);
        let mut arguments = [Vec::new(), Vec::new(), Vec::new()];
        for input in &program.inputs {
            let (group, value) = match input {
                Input::Sine(_) => (1, angle.sin()),
                Input::Cosine(_) => (1, angle.cos()),
                Input::Plain(variable) => match variable {
                    Variable::Length(_) => (0, random.random_range(90.0..110.0)),
                    Variable::Position { axis, .. } if axis == "C" => (1, angle),
                    Variable::Position { .. } => (1, random.random_range(-150.0..-50.0)),
                    Variable::Driver(quantity) if quantity.part == DriverPart::Direction => {
                        (1, if random.random() { 1.0 } else { -1.0 })
                    }
                    Variable::Driver(quantity) if quantity.driver == Driver::Time => {
                        (1, random.random_range(0.0..4000.0))
                    }
                    Variable::Driver(quantity) if quantity.part == DriverPart::SinceReversal => {
                        (1, random.random_range(0.0..0.5))
                    }
                    Variable::Driver(_) => (1, random.random_range(-2.0..2.0)),
                    _ => (2, random.random_range(-0.1..0.1)),
                },
            };
            arguments[group].push(value);
        }
        let found = program.run(&arguments.concat());
        Case {
            arguments,
            values: found[..1].to_vec(),
            gradient: found[1..].to_vec(),
        }
    });
    Printed {
        name: "effects".to_string(),
        function: "bar_length",
        cases: cases.collect(),
        text: equation.print(language).expect("code"),
    }
}

/// Compares values and gradients of the cases with rows of numbers, twice: one reading at a time, then in columns.
fn compare(printed: &Printed, single: &str, columns: &str) {
    for text in [single, columns] {
        let worst = disagreement(&printed.cases, &tools::rows(text), true);
        assert!(worst <= 1e-12, "{}: {worst:e}", printed.name);
    }
}

fn sizes(printed: &Printed) -> [usize; 5] {
    let case = &printed.cases[0];
    let [lengths, axes, errors] = &case.arguments;
    [
        lengths.len(),
        axes.len(),
        errors.len(),
        case.values.len(),
        case.gradient.len(),
    ]
}

fn points(printed: &Printed) -> String {
    let row = |case: &Case| tools::line(case.arguments.concat());
    printed.cases.iter().map(|case| row(case) + "\n").collect()
}

#[test]
fn rust() {
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
    let Some(rustc) = tools::find("compiled::rust", &[&rustc], &["--version"]) else {
        return;
    };
    let folder = tools::folder("rust");
    let all = all(Language::Rust);
    let mut main = String::from("#![deny(warnings)]\n");
    for printed in &all {
        tools::write(&folder.join(format!("{}.rs", printed.name)), &printed.text);
        let _ = writeln!(main, "#[allow(dead_code)] mod {};", printed.name);
    }
    main.push_str("fn numbers(text: &str) -> Vec<f64> { text.split_whitespace().map(|w| w.parse().unwrap()).collect() }\n");
    main.push_str("fn show(x: &[f64]) { println!(\"{}\", x.iter().map(|x| format!(\"{x:?}\")).collect::<Vec<_>>().join(\" \")); }\n");
    main.push_str("fn main() {\n");
    for printed in &all {
        let (name, function) = (&printed.name, printed.function);
        let [lengths, axes, _, values, slopes] = sizes(printed);
        let flat = if values == 1 {
            "let (v, g) = (vec![v], g.to_vec());".to_string()
        } else {
            "let (v, g) = (v.to_vec(), g.concat());".to_string()
        };
        let _ = write!(
            main,
            "    {{ let rows: Vec<Vec<f64>> = include_str!(\"{name}.txt\").lines().map(numbers).collect();
        for row in &rows {{
            let (l, rest) = row.split_at({lengths}); let (a, e) = rest.split_at({axes});
            let (v, g) = {name}::{function}_gradient(l.try_into().unwrap(), a.try_into().unwrap(), e.try_into().unwrap());
            let alone = {name}::{function}(l.try_into().unwrap(), a.try_into().unwrap(), e.try_into().unwrap());
            assert_eq!(v, alone);
            {flat}
            show(&[v, g].concat());
        }}
        println!(\"columns\");
        for row in &rows {{
            // A column has one set of errors, so each case becomes columns of its own: three blocks and a remainder.
            let (l, rest) = row.split_at({lengths}); let (a, e) = rest.split_at({axes});
            let x: Vec<Vec<f64>> = a.iter().map(|a| vec![*a; 19]).collect();
            let x: Vec<&[f64]> = x.iter().map(Vec::as_slice).collect();
            let (mut v, mut g) = (vec![vec![0.0; 19]; {values}], vec![vec![0.0; 19]; {slopes}]);
            let mut vs: Vec<&mut [f64]> = v.iter_mut().map(Vec::as_mut_slice).collect();
            let mut gs: Vec<&mut [f64]> = g.iter_mut().map(Vec::as_mut_slice).collect();
            {name}::{function}_gradient_columns(l.try_into().unwrap(), x.as_slice().try_into().unwrap(), e.try_into().unwrap(), vs.as_mut_slice().try_into().unwrap(), gs.as_mut_slice().try_into().unwrap());
            let all: Vec<&Vec<f64>> = v.iter().chain(&g).collect();
            assert!(all.iter().all(|c| c.iter().all(|x| *x == c[0])));
            show(&all.iter().map(|c| c[18]).collect::<Vec<_>>());
        }}
        println!(\"next\"); }}\n"
        );
        tools::write(&folder.join(format!("{name}.txt")), &points(printed));
    }
    main.push_str("}\n");
    tools::write(&folder.join("main.rs"), &main);
    let binary = folder.join("run");
    tools::run(
        Command::new(rustc)
            .current_dir(&folder)
            .args(["--edition", "2024", "main.rs", "-o"])
            .arg(&binary),
    );
    check_all(&all, &tools::run(&mut Command::new(&binary)));
    let _ = std::fs::remove_dir_all(&folder);
}

/// Compares the output of all printed equations: rows, the word `columns`, rows, the word `next`.
fn check_all(all: &[Printed], output: &str) {
    let parts: Vec<&str> = output.split("next\n").collect();
    assert_eq!(parts.len(), all.len() + 1);
    for (printed, part) in all.iter().zip(parts) {
        let (single, columns) = part.split_once("columns\n").expect("two parts");
        compare(printed, single, columns);
    }
}

#[test]
fn c() {
    let cc = std::env::var("CC").unwrap_or_default();
    let Some(cc) = tools::find("compiled::c", &[&cc, "gcc", "cc"], &["--version"]) else {
        return;
    };
    let folder = tools::folder("c");
    let all = all(Language::C);
    let mut output = String::new();
    for printed in &all {
        let function = printed.function;
        let [lengths, axes, errors, values, slopes] = sizes(printed);
        let text = format!(
            "{}\n#include <stdio.h>\n#include <stdlib.h>\n
static double x[{CASES}][{lengths} + {axes} + {errors}], column[{axes} * {CASES}], v[{values} * {CASES}], g[{slopes} * {CASES}];
int main(void) {{
    for (int r = 0; r < {CASES}; ++r) for (int k = 0; k < {lengths} + {axes} + {errors}; ++k) if (scanf(\"%lf\", &x[r][k]) != 1) return 1;
    for (int r = 0; r < {CASES}; ++r) {{
        double alone[{values}];
        {function}_gradient(x[r], x[r] + {lengths}, x[r] + {lengths} + {axes}, v, g);
        {function}(x[r], x[r] + {lengths}, x[r] + {lengths} + {axes}, alone);
        for (int k = 0; k < {values}; ++k) {{ printf(\"%.17g \", v[k]); if (v[k] < alone[k] || v[k] > alone[k]) return 2; }}
        for (int k = 0; k < {slopes}; ++k) printf(\"%.17g \", g[k]);
        printf(\"\\n\");
    }}
    printf(\"columns\\n\");
    for (int r = 0; r < {CASES}; ++r) {{
        for (int a = 0; a < {axes}; ++a) for (int i = 0; i < {CASES}; ++i) column[a * {CASES} + i] = x[i][{lengths} + a];
        {function}_gradient_columns({CASES}, x[r], column, x[r] + {lengths} + {axes}, v, g);
        for (int k = 0; k < {values}; ++k) printf(\"%.17g \", v[k * {CASES} + r]);
        for (int k = 0; k < {slopes}; ++k) printf(\"%.17g \", g[k * {CASES} + r]);
        printf(\"\\n\");
    }}
    return 0;
}}\n",
            printed.text
        );
        tools::write(&folder.join("run.c"), &text);
        let strict = [
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-pedantic",
            "-O1",
            "run.c",
            "-o",
            "run",
            "-lm",
        ];
        tools::run(Command::new(&cc).current_dir(&folder).args(strict));
        output.push_str(&run_with_input(&folder.join("run"), &[], &points(printed)));
        output.push_str("next\n");
    }
    check_all(&all, &output);
    let _ = std::fs::remove_dir_all(&folder);
}

fn run_with_input(program: &Path, arguments: &[&Path], input: &str) -> String {
    let file = program.with_extension("input");
    let file = if file.parent().is_some_and(Path::exists) && program.is_absolute() {
        file
    } else {
        std::env::temp_dir().join("abbe-codegen-input")
    };
    tools::write(&file, input);
    let stdin = std::fs::File::open(&file).expect("the file just written");
    tools::run(Command::new(program).args(arguments).stdin(stdin))
}

#[test]
fn python() {
    let own = std::env::var("ABBE_PYTHON").unwrap_or_default();
    let candidates = [own.as_str(), "python3", "/usr/bin/python3"];
    let Some(python) = tools::find("compiled::python", &candidates, &["-c", "import numpy"]) else {
        return;
    };
    let folder = tools::folder("python");
    let all = all(Language::Python);
    let mut main = String::from(
        "import numpy as np\n\ndef show(x):\n    print(' '.join(repr(float(v)) for v in x))\n\n",
    );
    for printed in &all {
        let (name, function) = (&printed.name, printed.function);
        let [lengths, axes, ..] = sizes(printed);
        tools::write(&folder.join(format!("{name}.py")), &printed.text);
        tools::write(&folder.join(format!("{name}.txt")), &points(printed));
        let _ = write!(
            main,
            "import {name}
rows = np.loadtxt('{name}.txt')
for row in rows:
    l, a, e = row[:{lengths}], row[{lengths}:{lengths} + {axes}], row[{lengths} + {axes}:]
    v, g = {name}.{function}_gradient(l, a, e)
    assert np.array_equal(v, {name}.{function}(l, a, e))
    show(np.concatenate([np.ravel(v), np.ravel(g)]))
print('columns')
c = rows.T
v, g = {name}.{function}_gradient(c[:{lengths}], c[{lengths}:{lengths} + {axes}], c[{lengths} + {axes}:])
for row in np.concatenate([np.reshape(v, (-1, len(rows))), np.reshape(g, (-1, len(rows)))]).T:
    show(row)
print('next')\n\n"
        );
    }
    tools::write(&folder.join("main.py"), &main);
    let strict = ["-W", "error", "main.py"];
    check_all(
        &all,
        &tools::run(Command::new(python).current_dir(&folder).args(strict)),
    );
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn octave() {
    let candidates = ["octave-cli", "octave"];
    let Some(octave) = tools::find("compiled::octave", &candidates, &["--version"]) else {
        return;
    };
    let folder = tools::folder("octave");
    let all = all(Language::Matlab);
    let mut main = String::from("1;\nfunction show(x)\n  printf('%.17g ', x);\n  printf('\\n');\nend\n");
    for printed in &all {
        let (name, function) = (&printed.name, printed.function);
        let [lengths, axes, ..] = sizes(printed);
        let own = folder.join(name);
        std::fs::create_dir_all(&own).expect("a folder");
        tools::write(&own.join(format!("{function}.m")), &printed.text);
        tools::write(&own.join("points.txt"), &points(printed));
        let _ = write!(
            main,
            "cd('{}');
clear('{function}');
rows = load('points.txt');
for r = 1:size(rows, 1)
  l = rows(r, 1:{lengths}); a = rows(r, {lengths} + (1:{axes}))'; e = rows(r, {lengths} + {axes} + 1:end);
  [v, g] = {function}(l, a, e);
  if any(v ~= {function}(l, a, e)), error('value'); end
  show([v; g]);
end
printf('columns\\n');
for r = 1:size(rows, 1)
  l = rows(r, 1:{lengths}); a = rows(:, {lengths} + (1:{axes}))'; e = rows(r, {lengths} + {axes} + 1:end);
  [v, g] = {function}(l, a, e);
  both = [v; g];
  show(both(:, r));
end
printf('next\\n');\n",
            own.display()
        );
    }
    tools::write(&folder.join("main.m"), &main);
    let strict = ["--no-gui", "--norc", "--quiet", "main.m"];
    check_all(
        &all,
        &tools::run(Command::new(octave).current_dir(&folder).args(strict)),
    );
    let _ = std::fs::remove_dir_all(&folder);
}
