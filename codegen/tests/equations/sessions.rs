//! Tests of the equations of the sessions that come with the program.

use std::path::PathBuf;

use abbe_codegen::print::{LANGUAGES, Style};
use abbe_codegen::{Equation, Kind, Options, Order, SessionTest, check};
use abbe_model::files;

use crate::support::printed;

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../sessions").join(name)
}

#[test]
fn every_test_of_the_bundled_plans() {
    for chapter in ["chapter4", "chapter5", "chapter6"] {
        let path = file(&format!("hermle-c600u/{chapter}.toml"));
        let session = files::session(&path, &files::ReadOptions::default()).expect("a session");
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

#[test]
fn every_test_of_the_self_calibration() {
    let path = file("self-calibration/session.toml");
    let session = files::session(&path, &files::ReadOptions::default()).expect("a session");
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
    let session = files::session(&path, &files::ReadOptions::default()).expect("a session");
    let test = session.tests.iter().find(|test| test.name == "A150").expect("the test");
    let source = SessionTest::new(&session, test).expect("a plan");
    let equation = Equation::of(&session.machine, &source, &session.unknowns, &Options::default());
    let text = printed(&equation.expect("an equation"), &source, "text");
    assert!(text.contains("√(R_e² − R²)"), "{text}");
    assert!(!text.contains("111.8"), "{text}");
}
