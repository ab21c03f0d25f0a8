//! Compiles or interprets printed code and compares it with dual numbers, one reading at a time and in columns.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use crate::programs::{CASES, all, check_all, points, sizes};
use crate::tools;

#[test]
fn rust() {
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
    let Some(rustc) = test_needs::program("compiled::rust", &[&rustc], &["--version"]) else {
        return;
    };
    let folder = tools::folder("rust");
    let all = all("rust");
    let mut main = String::from("#![deny(warnings)]\n");
    for printed in &all {
        tools::write(&folder.join(format!("{}.rs", printed.name)), &printed.text);
        let _ = writeln!(main, "#[allow(dead_code)] mod {};", printed.name);
    }
    main.push_str(
        "fn numbers(text: &str) -> Vec<f64> { text.split_whitespace().map(|w| w.parse().unwrap()).collect() }\n",
    );
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
    tools::run(Command::new(rustc).current_dir(&folder).args(["--edition", "2024", "main.rs", "-o"]).arg(&binary));
    check_all(&all, &tools::run(&mut Command::new(&binary)));
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn c() {
    let cc = std::env::var("CC").unwrap_or_default();
    let Some(cc) = test_needs::program("compiled::c", &[&cc, "gcc", "cc"], &["--version"]) else {
        return;
    };
    let folder = tools::folder("c");
    let all = all("c");
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
        let strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "run.c", "-o", "run", "-lm"];
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
    let Some(python) = test_needs::python("compiled::python", "numpy") else { return };
    let folder = tools::folder("python");
    let all = all("python");
    let mut main =
        String::from("import numpy as np\n\ndef show(x):\n    print(' '.join(repr(float(v)) for v in x))\n\n");
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
    check_all(&all, &tools::run(Command::new(python).current_dir(&folder).args(strict)));
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn octave() {
    let candidates = ["octave-cli", "octave"];
    let Some(octave) = test_needs::program("compiled::octave", &candidates, &["--version"]) else {
        return;
    };
    let folder = tools::folder("octave");
    let all = all("matlab");
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
    check_all(&all, &tools::run(Command::new(octave).current_dir(&folder).args(strict)));
    let _ = std::fs::remove_dir_all(&folder);
}
