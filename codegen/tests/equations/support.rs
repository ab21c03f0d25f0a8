//! Shared support of this crate's integration tests.
#![allow(dead_code)]

use abbe_codegen::print::{Layout, Style};
use abbe_codegen::{Equation, Source, Subject, check, language};
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::frames::Rotation;
use abbe_model::instrument::{Station, Target, ballbar::BallBar};
use abbe_model::scalar::Nominal;

/// The machine of seed 000.
pub fn hermle(rotation: Rotation) -> Machine {
    let mut machine = Machine::from_code("w C A b Y X Z t").expect("a valid code");
    machine.rotation = rotation;
    machine
}

/// The A and C tests of chapter 5 of seed 000, with the lengths as symbols.
#[derive(Clone, Copy)]
pub struct Chapter5 {
    /// With the extension bar the spindle ball is at (−D, 0, 0).
    pub extended: bool,
}

impl Source for Chapter5 {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        let zero = N::constant(0.0);
        let d = if self.extended { -length("D") } else { zero };
        Subject::Station(Station::BallBar(BallBar {
            workpiece_ball: Target::on_table([zero, length("R"), length("H") - length("Z_CA")]),
            spindle_ball: Target::on_tool([d, zero, zero]),
            bar: length("R"),
        }))
    }

    fn held<N: Nominal>(&self, axis: &str, _: &impl Fn(&str) -> N, _: &impl Fn(&str) -> N) -> Option<N> {
        matches!(axis, "X" | "Y" | "Z").then(|| N::constant(0.0))
    }

    fn range(&self, axis: &str) -> Option<[f64; 2]> {
        match axis {
            "A" => Some([-20.0_f64.to_radians(), 70.0_f64.to_radians()]),
            "C" => None,
            _ => None,
        }
    }

    fn length_mm(&self, name: &str) -> Option<f64> {
        match name {
            "R" => Some(100.0),
            "H" | "Z_CA" => Some(75.0),
            "D" => Some(12500.0_f64.sqrt()),
            _ => None,
        }
    }
}

/// The eight position-independent errors of A and C.
pub fn eight() -> Vec<ErrorName> {
    ["EY0A", "EZ0A", "EB0A", "EC0A", "EX0C", "EY0C", "EA0C", "EB0C"]
        .iter()
        .filter_map(|name| ErrorName::parse(name))
        .collect()
}

/// A checked equation in a language.
pub fn printed(equation: &Equation, source: &impl Source, word: &str) -> String {
    laid_out(equation, source, word, Layout::Flat)
}

/// A checked equation in a language, with arguments as arrays or by name.
pub fn laid_out(equation: &Equation, source: &impl Source, word: &str, layout: Layout) -> String {
    let checked = check(equation, source).expect("agreement with dual numbers");
    let style = Style { layout, ..Style::default() };
    language(word).expect("a language").print(&checked, &style).expect("a page")
}
