//! Tests of typeset output: LaTeX and Typst through a real engine without warnings; plain text by its lines.

use std::fmt::Write;
use std::process::Command;

use abbe_codegen::print::{Numbering, Style};
use abbe_codegen::{Arrangement, Equation, Options, Order, Source, Symbols, ToolPoint, check};
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::frames::Rotation;

use crate::effects::{Bar, every_shape};
use crate::support::{Chapter5, eight, hermle};
use crate::tools;
use crate::topologies::{AnyBar, CODES, all_errors, machine};

/// A source whose equation is printed.
trait Draw {
    fn draw(&self, machine: &Machine, errors: &[ErrorName], options: &Options, language: &str, style: &Style)
    -> String;
}

impl<S: Source> Draw for S {
    fn draw(
        &self,
        machine: &Machine,
        errors: &[ErrorName],
        options: &Options,
        language: &str,
        style: &Style,
    ) -> String {
        let equation = Equation::of(machine, self, errors, options).expect("an equation");
        let checked = check(&equation, self).expect("agreement with dual numbers");
        abbe_codegen::language(language).expect("a language").print(&checked, style).expect("a page")
    }
}

/// Every form of the chapter 5 test. For every topology the exact length, its first order, and the first order of the
/// volumetric error.
fn fragments(language: &str) -> Vec<String> {
    styled(language, &Style::default())
}

fn styled(language: &str, style: &Style) -> Vec<String> {
    let of = |machine: &Machine, source: &dyn Draw, errors: &[ErrorName], options: &Options| {
        source.draw(machine, errors, options, language, style)
    };
    let mut fragments = Vec::new();
    for rotation in [Rotation::Exact, Rotation::SmallAngle] {
        for order in [Order::Exact, Order::Bilinear, Order::First] {
            for symbols in [Symbols::Literature, Symbols::Iso] {
                let options = Options {
                    order,
                    symbols,
                    rotation: Some(rotation),
                    unknowns: (0..8).collect(),
                    gradient: order != Order::Bilinear,
                    ..Options::default()
                };
                let bar = Chapter5 { extended: true };
                fragments.push(of(&hermle(rotation), &bar, &eight(), &options));
            }
        }
    }
    for arrangement in [Arrangement::Single, Arrangement::Groups] {
        for rotation in [Rotation::Exact, Rotation::SmallAngle] {
            let options =
                Options { arrangement, rotation: Some(rotation), unknowns: (0..8).collect(), ..Options::default() };
            fragments.push(of(&hermle(rotation), &Chapter5 { extended: true }, &eight(), &options));
        }
    }
    for code in CODES {
        let machine = machine(code);
        let errors = all_errors(&machine);
        let motions: Vec<ErrorName> = errors.iter().filter(|name| name.kind == ErrorKind::Motion).cloned().collect();
        fragments.push(of(&machine, &AnyBar, &errors, &Options::default()));
        let first = Options { order: Order::First, ..Options::default() };
        fragments.push(of(&machine, &AnyBar, &errors, &first));
        fragments.push(of(&machine, &ToolPoint, &motions, &first));
    }
    // Every declared shape.
    let machine = Machine::from_code("w C b X t").expect("a code");
    for order in [Order::Exact, Order::Bilinear, Order::First] {
        let options =
            Options { order, gradient: order != Order::Bilinear, effects: every_shape(), ..Options::default() };
        fragments.push(of(&machine, &Bar, &eight()[4..], &options));
    }
    fragments.extend(crate::probe::fragments(language, style));
    for chapter in ["chapter4", "chapter5", "chapter6"] {
        for order in [Order::Exact, Order::First] {
            fragments.push(crate::sessions::system(&format!("hermle-c600u/{chapter}.toml"), order, language, style));
        }
    }
    fragments.push(crate::sessions::system("r-test/plan.toml", Order::First, language, style));
    fragments
}

/// Plain text has no engine to report errors: lines must fit the page and contain no undefined value.
#[test]
fn text() {
    for fragment in fragments("text") {
        let equations = fragment.split("\nsymbols\n").next().expect("equations");
        for line in equations.lines().skip(2) {
            // A remark on a coefficient follows it.
            let line = line.split("   (").next().unwrap_or(line);
            assert!(line.chars().count() <= 140, "{line}");
            assert!(!line.contains("NaN") && !line.contains("inf"), "{line}");
        }
    }
}

#[test]
fn latex() {
    let candidates = ["pdflatex"];
    let Some(engine) = test_needs::program("typeset::latex", &candidates, &["--version"]) else {
        return;
    };
    let folder = tools::folder("latex");
    let mut document = String::from(
        "\\documentclass{article}\n\\usepackage{amsmath}\n\\usepackage[a4paper,margin=18mm]{geometry}\n\\begin{document}\n",
    );
    for fragment in fragments("latex") {
        let _ = writeln!(document, "{fragment}\n\\clearpage");
    }
    document.push_str("\\end{document}\n");
    tools::write(&folder.join("all.tex"), &document);
    let arguments = ["-interaction=nonstopmode", "-halt-on-error", "all.tex"];
    let output = Command::new(engine).current_dir(&folder).args(arguments).output().expect("the engine starts");
    let log = String::from_utf8_lossy(&std::fs::read(folder.join("all.log")).expect("a log")).into_owned();
    assert!(output.status.success(), "{}", &log[log.len().saturating_sub(3000)..]);
    let complaints: Vec<&str> =
        log.lines().filter(|line| line.contains("Warning") || line.contains("Overfull")).collect();
    assert!(complaints.is_empty(), "{} complaints, {:?}", complaints.len(), &complaints[..complaints.len().min(20)]);
    let _ = std::fs::remove_dir_all(&folder);
}

/// Typst by the typst compiler, which PyPI provides prebuilt (the crate takes a quarter of an hour to build).
#[test]
fn typst() {
    let Some(python) = test_needs::python("typeset::typst", "typst") else { return };
    let folder = tools::folder("typst");
    let mut document = String::from("#set page(paper: \"a3\", flipped: true, margin: 18mm)\n");
    for fragment in fragments("typst") {
        let _ = writeln!(document, "{fragment}\n#pagebreak()");
    }
    tools::write(&folder.join("all.typ"), &document);
    let script = "import typst\n_, warnings = typst.compile_with_warnings('all.typ', output='all.pdf')\nfor w in warnings: print(w.message)";
    let complaints = tools::run(Command::new(python).current_dir(&folder).args(["-c", script]));
    assert!(complaints.trim().is_empty(), "{complaints}");
    let _ = std::fs::remove_dir_all(&folder);
}

/// Every fragment in a column of 84 mm with numbers and a table of symbols: no line is too long.
#[test]
fn latex_in_two_columns() {
    let Some(engine) = test_needs::program("typeset::latex_in_two_columns", &["pdflatex"], &["--version"]) else {
        return;
    };
    let folder = tools::folder("latex-two-columns");
    let mut document = String::from(
        "\\documentclass[10pt]{article}\n\\usepackage{amsmath,array,booktabs}\n\\setlength\\textwidth{84mm}\n\
         \\raggedbottom\\begin{document}\n",
    );
    let style = Style { numbering: Numbering::All, width_mm: Some(84.0), nomenclature: true, ..Style::default() };
    for (index, fragment) in styled("latex", &style).into_iter().enumerate() {
        let _ =
            writeln!(document, "{}\n\\clearpage", fragment.replace("\\label{eq:", &format!("\\label{{eq:{index}-")));
    }
    document.push_str("\\end{document}\n");
    tools::write(&folder.join("all.tex"), &document);
    let arguments = ["-interaction=nonstopmode", "-halt-on-error", "all.tex"];
    let output = Command::new(engine).current_dir(&folder).args(arguments).output().expect("the engine starts");
    let log = String::from_utf8_lossy(&std::fs::read(folder.join("all.log")).expect("a log")).into_owned();
    assert!(output.status.success(), "{}", &log[log.len().saturating_sub(3000)..]);
    let complaint = |line: &&str| line.contains("Overfull") || line.contains("Warning") && !line.contains("Label(s)");
    let complaints: Vec<&str> = log.lines().filter(complaint).collect();
    assert!(complaints.is_empty(), "{} complaints, {:?}", complaints.len(), &complaints[..complaints.len().min(20)]);
    let _ = std::fs::remove_dir_all(&folder);
}
