//! Tests of the equations of the sessions that come with the program.

use std::path::PathBuf;

use abbe_codegen::print::{LANGUAGES, Layout, Style, TestEquations};
use abbe_codegen::{Equation, Kind, Options, Order, SessionTest, check};
use abbe_files::ReadOptions;

use crate::support::printed;

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../sessions").join(name)
}

/// The page of all tests of a session.
pub fn system(name: &str, order: Order, word: &str, style: &Style) -> String {
    let session = abbe_files::session(&file(name), &ReadOptions::default()).expect("a session");
    let equations = |order: Order| -> Vec<(Equation, SessionTest<'_>)> {
        let options = Options { order, ..Options::default() };
        let of = |test| {
            let source = SessionTest::new(&session, test).expect("a plan");
            (Equation::of(&session.machine, &source, &session.unknowns, &options).expect("an equation"), source)
        };
        session.tests.iter().map(of).collect()
    };
    let (whole, first) = (equations(order), equations(Order::First));
    let whole: Vec<_> = whole.iter().map(|(equation, source)| check(equation, source).expect("agreement")).collect();
    let first: Vec<_> = first.iter().map(|(equation, source)| check(equation, source).expect("agreement")).collect();
    let tests = whole.iter().zip(&first).map(|(equation, first)| TestEquations { equation, first });
    let language = abbe_codegen::language(word).expect("a language");
    language.print_system(&tests.collect::<Vec<_>>(), style).expect("a page")
}

/// Every test has a column, every error a row; the entries are the known coefficients.
#[test]
fn the_equations_of_a_session() {
    let text = system("hermle-c600u/chapter5.toml", Order::First, "text", &Style::default());
    let (_, matrix) = text.split_once("derivatives of the readings").expect("a matrix");
    let (matrix, _) = matrix.split_once("\nsymbols\n").expect("symbols");
    // The matrix has two blocks; the second has one test.
    let row = |name: &str| -> String {
        let lines = matrix.lines().filter_map(|line| line.trim_start().strip_prefix(name));
        lines.flat_map(str::split_whitespace).collect::<Vec<&str>>().join(" ")
    };
    assert_eq!(row("A100 "), "A150 C100");
    assert!(matrix.lines().any(|line| line.trim() == "C150"), "{matrix}");
    // By hand: the unit vector of the bar times the displacement by the error.
    assert_eq!(row("e_x0c "), "0 √(R_e² − R²)/L_0 −R·s_c/L_0 −R·s_c/L_0");
    assert_eq!(
        row("e_z0a "),
        "(R·s_a + (H − Z_CA)·c_a)/L_0 (R·s_a + (H − Z_CA)·c_a)/L_0 (H − Z_CA)/L_0 (H − Z_CA − √(R_e² − R²))/L_0"
    );
}

#[test]
fn every_test_of_the_bundled_plans() {
    for chapter in ["chapter4", "chapter5", "chapter6"] {
        let path = file(&format!("hermle-c600u/{chapter}.toml"));
        let session = abbe_files::session(&path, &ReadOptions::default()).expect("a session");
        for test in &session.tests {
            let source = SessionTest::new(&session, test).expect("a plan");
            for order in [Order::Exact, Order::Bilinear, Order::First] {
                let options = Options { order, ..Options::default() };
                let equation = Equation::of(&session.machine, &source, &session.unknowns, &options);
                let equation = equation.expect("an equation");
                assert_eq!(equation.kind, Kind::Length);
                let checked = check(&equation, &source).expect("agreement");
                for language in LANGUAGES {
                    assert!(!language.print(&checked, &Style::default()).expect("a page").is_empty());
                }
            }
        }
    }
}

/// Printed code asks only for those lengths of the session that its equation contains.
#[test]
fn every_named_argument_is_used() {
    let style = Style { layout: Layout::Named, ..Style::default() };
    for chapter in ["chapter4", "chapter5", "chapter6"] {
        let path = file(&format!("hermle-c600u/{chapter}.toml"));
        let session = abbe_files::session(&path, &ReadOptions::default()).expect("a session");
        for test in &session.tests {
            let source = SessionTest::new(&session, test).expect("a plan");
            let equation = Equation::of(&session.machine, &source, &session.unknowns, &Options::default());
            let equation = equation.expect("an equation");
            let checked = check(&equation, &source).expect("agreement");
            let printed = abbe_codegen::language("python").and_then(|python| python.print(&checked, &style));
            let printed = printed.expect("a program");
            let (signature, body) = printed.split_once(") -> ").expect("a function");
            let (body, _) = body.split_once("\ndef ").unwrap_or((body, ""));
            let (_, body) = body.split_once("shape = ").expect("the shape");
            let (_, body) = body.split_once('\n').expect("a body");
            let words: Vec<&str> = body.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').collect();
            let arguments = signature.lines().filter_map(|line| line.trim().strip_suffix(": ArrayLike,"));
            let unused: Vec<&str> = arguments.filter(|name| !words.contains(name)).collect();
            assert!(unused.is_empty(), "{chapter}, {}: {unused:?}\n{printed}", test.name);
        }
    }
}

#[test]
fn every_test_of_the_self_calibration() {
    let path = file("self-calibration/session.toml");
    let session = abbe_files::session(&path, &ReadOptions::default()).expect("a session");
    for test in &session.tests {
        let source = SessionTest::new(&session, test).expect("a plan");
        for order in [Order::Exact, Order::Bilinear, Order::First] {
            let options = Options { order, unknowns: (0..11).collect(), ..Options::default() };
            let equation = Equation::of(&session.machine, &source, &session.unknowns, &options);
            let equation = equation.expect("an equation");
            assert_eq!(equation.kind, Kind::Distance);
            let checked = check(&equation, &source).expect("agreement");
            for language in LANGUAGES {
                assert!(!language.print(&checked, &Style::default()).expect("a page").is_empty());
            }
        }
    }
}

/// A distance derived from the length of the bar remains an expression in the equation.
#[test]
fn lengths_derived_from_the_bar_stay_expressions() {
    let path = file("hermle-c600u/chapter5.toml");
    let session = abbe_files::session(&path, &ReadOptions::default()).expect("a session");
    let test = session.tests.iter().find(|test| test.name == "A150").expect("the test");
    let source = SessionTest::new(&session, test).expect("a plan");
    let equation = Equation::of(&session.machine, &source, &session.unknowns, &Options::default());
    let text = printed(&equation.expect("an equation"), &source, "text");
    assert!(text.contains("√(R_e² − R²)"), "{text}");
    assert!(!text.contains("111.8"), "{text}");
}
