//! Snapshots of every form of one test, and small checks of the printed code.

use std::process::Command;

use abbe_codegen::{Arrangement, Equation, Options, Order, Symbols};
use abbe_model::frames::Rotation;

use crate::support::{self, Chapter5, eight, hermle};
use crate::tools;

const EXTENDED: Chapter5 = Chapter5 { extended: true };

fn chapter5(options: &Options) -> Equation {
    let machine = hermle(Rotation::SmallAngle);
    Equation::of(&machine, &EXTENDED, &eight(), options).expect("an equation")
}

fn printed(equation: &Equation, word: &str) -> String {
    support::printed(equation, &EXTENDED, word)
}

/// One snapshot per language and form. The last digits of the check differ between machines and are masked.
fn snapshot(name: &str, text: &str) {
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("../../../snapshots");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.bind(|| insta::assert_snapshot!(format!("codegen__{name}"), without_rounding(text)));
}

/// Replaces `2e-16` and the like, and a difference of `0`, by `…`.
fn without_rounding(text: &str) -> String {
    let word = |word: &str| {
        let digits = |part: &str| !part.is_empty() && part.chars().all(|c| c.is_ascii_digit());
        match word.split_once("e-") {
            Some((mantissa, exponent)) if digits(mantissa) && digits(exponent) => "…".to_string(),
            _ => word.to_string(),
        }
    };
    let line = |line: &str| {
        let masked = line.split(' ').map(word).collect::<Vec<_>>().join(" ");
        masked.replace("difference 0 (value)", "difference … (value)").replace(", 0 (gradient)", ", … (gradient)")
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn code_of_the_chapter_5_test() {
    let options = Options { gradient: true, ..Options::default() };
    let equation = chapter5(&options);
    for word in ["rust", "c", "python", "matlab", "julia"] {
        snapshot(&format!("chapter5_{word}"), &printed(&equation, word));
    }
}

#[test]
fn readable_forms_of_the_chapter_5_test() {
    for language in ["text", "latex", "typst"] {
        for (order, word) in [(Order::Exact, "exact"), (Order::Bilinear, "bilinear"), (Order::First, "first")] {
            let symbols = if order == Order::First { Symbols::Iso } else { Symbols::Literature };
            let options = Options { order, symbols, ..Options::default() };
            let text = printed(&chapter5(&options), language);
            snapshot(&format!("chapter5_{language}_{word}"), &text);
        }
    }
}

/// Eqs. 3.20 and 3.21 of Jiang (2014). The normal form proves each equal to the chain before it is printed.
#[test]
fn single_equations_of_the_chapter_5_tests() {
    let options = Options { arrangement: Arrangement::Single, ..Options::default() };
    for (name, extended) in [("eq_3_20", false), ("eq_3_21", true)] {
        let source = Chapter5 { extended };
        let machine = hermle(Rotation::SmallAngle);
        let equation = Equation::of(&machine, &source, &eight(), &options).expect("an equation");
        for language in ["text", "latex"] {
            snapshot(&format!("{name}_{language}"), &support::printed(&equation, &source, language));
        }
    }
}

#[test]
fn derivatives_of_the_chapter_5_test() {
    let options = Options { gradient: true, ..Options::default() };
    let text = printed(&chapter5(&options), "text");
    snapshot("chapter5_text_derivatives", &text);
}

/// Value and gradient of the chapter 5 test take at most 70 operations, counted by running the printed Rust over a
/// counting scalar.
#[test]
fn operations_counted_by_running_the_printed_code() {
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
    let Some(rustc) = test_needs::program("forms::operations", &[&rustc], &["--version"]) else {
        return;
    };
    let options = Options { gradient: true, ..Options::default() };
    let equation = chapter5(&options);
    let counted = equation.program(true).operations();
    let printed = printed(&equation, "rust");
    // Only the kernel of one reading, over the counting scalar instead of `f64`.
    let from = printed.find("/// Value and gradient of one reading.").expect("the kernel");
    let to = printed.find("/// Values and gradients of columns").expect("the columns");
    let kernel = printed[from..to].replace("f64", "Counted");
    let constants: String = printed.lines().filter(|line| line.starts_with("pub const")).collect::<Vec<_>>().join("\n");
    let main = format!(
        "use std::cell::Cell; use std::ops::*;
thread_local! {{ static COUNT: Cell<usize> = const {{ Cell::new(0) }}; }}
#[derive(Clone, Copy)] pub struct Counted(f64);
fn one(x: f64) -> Counted {{ COUNT.with(|c| c.set(c.get() + 1)); Counted(x) }}
impl Add for Counted {{ type Output = Counted; fn add(self, o: Counted) -> Counted {{ one(self.0 + o.0) }} }}
impl Sub for Counted {{ type Output = Counted; fn sub(self, o: Counted) -> Counted {{ one(self.0 - o.0) }} }}
impl Mul for Counted {{ type Output = Counted; fn mul(self, o: Counted) -> Counted {{ one(self.0 * o.0) }} }}
impl Div for Counted {{ type Output = Counted; fn div(self, o: Counted) -> Counted {{ one(self.0 / o.0) }} }}
impl Mul<Counted> for f64 {{ type Output = Counted; fn mul(self, o: Counted) -> Counted {{ one(self * o.0) }} }}
impl Div<Counted> for f64 {{ type Output = Counted; fn div(self, o: Counted) -> Counted {{ one(self / o.0) }} }}
impl Neg for Counted {{ type Output = Counted; fn neg(self) -> Counted {{ one(-self.0) }} }}
mod elementary {{ use super::*; pub fn sqrt(x: Counted) -> Counted {{ one(x.0.sqrt()) }} }}
{constants}
{kernel}
fn main() {{
    let c = |x: f64| Counted(x);
    let _ = bar_length_gradient(&[c(100.0), c(75.0), c(75.0), c(111.8)], &[c(0.1), c(0.99), c(0.2), c(0.98)], &[c(0.01); 8]);
    println!(\"{{}}\", COUNT.with(|c| c.get()));
}}"
    );
    let folder = tools::folder("counted");
    tools::write(&folder.join("main.rs"), &main);
    let binary = folder.join("run");
    tools::run(
        Command::new(rustc)
            .current_dir(&folder)
            .args(["--edition", "2024", "-A", "dead_code", "main.rs", "-o"])
            .arg(&binary),
    );
    let ran: usize = tools::run(&mut Command::new(&binary)).trim().parse().expect("a number");
    let _ = std::fs::remove_dir_all(&folder);
    println!("{ran} operations");
    assert_eq!(ran, counted.arithmetic());
    assert!(ran <= 70, "{ran}");
}

/// The benchmark code is the printer's output. `ABBE_WRITE_BENCHES=1` writes it again.
#[test]
fn the_benchmark_code_is_the_printed_code() {
    let options = Options { gradient: true, ..Options::default() };
    let equation = chapter5(&options);
    for (language, name) in [("rust", "emitted.rs"), ("c", "emitted.c")] {
        let printed = printed(&equation, language);
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("benches").join(name);
        if std::env::var("ABBE_WRITE_BENCHES").is_ok() {
            tools::write(&path, &printed);
        }
        let kept = std::fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(without_rounding(&kept), without_rounding(&printed), "{name}");
    }
}

/// The printed Rust needs `std` only for the functions in its last module.
#[test]
fn the_printed_rust_builds_without_std() {
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
    let Some(rustc) = test_needs::program("forms::without_std", &[&rustc], &["--version"]) else {
        return;
    };
    let options = Options { gradient: true, rotation: Some(Rotation::Exact), ..Options::default() };
    let printed = printed(&chapter5(&options), "rust");
    let end = printed.find("/// Functions that `core` lacks").expect("the last module");
    let stub = |name: &str| format!("pub fn {name}(x: f64) -> f64 {{ x }} ");
    let stubs: String = ["sqrt", "sin", "cos"].map(stub).concat();
    let text = format!("#![no_std]\n#![deny(warnings)]\n{}mod elementary {{ {stubs} }}\n", &printed[..end]);
    let folder = tools::folder("no-std");
    tools::write(&folder.join("lib.rs"), &text);
    let arguments = ["--edition", "2024", "--crate-type", "lib", "--emit", "metadata", "lib.rs"];
    tools::run(Command::new(rustc).current_dir(&folder).args(arguments));
    let _ = std::fs::remove_dir_all(&folder);
}
