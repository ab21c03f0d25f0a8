//! The commands `abbe equation` and `abbe volumetric`: every language, every option, and the messages for invalid
//! requests.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use abbe::codegen::print::{LANGUAGES, OutputLanguage, Style};
use abbe::codegen::{Equation, Options, Order, SessionTest, Symbols, check};
use abbe::files::{self, ReadOptions};
use abbe::model::component::ErrorName;
use abbe::model::frames::Rotation;

use crate::suite::{abbe, ready, text};

fn plan() -> PathBuf {
    ready("hermle-c600u/chapter5.toml")
}

fn machine() -> PathBuf {
    ready("hermle-c600u/machine.toml")
}

/// Standard output of a command that succeeds without a message.
#[track_caller]
pub(in crate::suite) fn printed(arguments: &[&str]) -> String {
    let output = abbe(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && stderr.is_empty(), "{stderr}");
    String::from_utf8(output.stdout).unwrap()
}

/// Asserts that a command fails with these parts in its message.
#[track_caller]
pub(super) fn refused(arguments: &[&str], parts: &[&str]) {
    let output = abbe(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(output.stdout.is_empty(), "a result beside an error");
    for part in parts {
        assert!(stderr.contains(part), "`{part}` is not in\n{stderr}");
    }
}

/// The equation of the test A150 from the library.
fn of_library(language: &OutputLanguage, errors: &[&str], options: &Options) -> String {
    let session = files::session(&plan(), &ReadOptions::default()).unwrap();
    let test = session.tests.iter().find(|test| test.name == "A150").unwrap();
    let source = SessionTest::new(&session, test).unwrap();
    let named: Vec<ErrorName> = errors.iter().map(|name| ErrorName::parse(name).unwrap()).collect();
    let errors = if errors.is_empty() { &session.unknowns } else { &named };
    let equation = Equation::of(&session.machine, &source, errors, options).unwrap();
    let checked = check(&equation, &source).unwrap();
    language.print(&checked, &Style::default()).unwrap().trim_end().to_string() + "\n"
}

#[test]
fn every_option_reaches_the_library_in_every_language() {
    let plan = plan();
    for language in LANGUAGES {
        let a150 = ["equation", text(&plan), "--test", "A150", "--as", language.word];
        assert_eq!(printed(&a150), of_library(language, &[], &Options::default()));
        let forms = [
            ("bilinear", Order::Bilinear, "small-angle", Rotation::SmallAngle, "iso", Symbols::Iso),
            ("first", Order::First, "exact", Rotation::Exact, "literature", Symbols::Literature),
        ];
        for (order_word, order, rotation_word, rotation, symbols_word, symbols) in forms {
            let options = Options { order, rotation: Some(rotation), symbols, ..Options::default() };
            let form = ["--order", order_word, "--rotation", rotation_word, "--notation", symbols_word];
            let kept = ["--errors", "e_y0a,EX0C,EA0C"];
            let found = printed(&[&a150[..], &form, &kept].concat());
            let expected = of_library(language, &["EY0A", "EX0C", "EA0C"], &options);
            assert_eq!(found, expected, "{} {order_word}", language.word);
        }
        let options = Options { gradient: true, ..Options::default() };
        let found = printed(&[&a150[..], &["--gradient"]].concat());
        assert_eq!(found, of_library(language, &[], &options));
    }
}

/// Each language is recognised by a signature of its own.
#[test]
fn the_error_vector_in_every_language() {
    let machine = machine();
    let mut outputs = Vec::new();
    for (word, sign) in [
        ("text", "Δ.x ="),
        ("latex", "\\begin{align*}"),
        ("typst", "Delta"),
        ("rust", "pub fn volumetric_error("),
        ("c", "void volumetric_error("),
        ("python", "def volumetric_error("),
        ("matlab", "= volumetric_error("),
        ("julia", "function volumetric_error("),
        ("sympy", "import sympy as sp"),
        ("casadi", "import casadi as ca"),
    ] {
        let symbols: &[&str] = if matches!(word, "latex" | "typst") { &["--nomenclature"] } else { &[] };
        let found = printed(&[&["volumetric", text(&machine), "--as", word], symbols].concat());
        assert!(found.contains(sign), "{word}: {found}");
        assert!(found.contains("X of the tool point in the tool frame"), "{word}");
        outputs.push(found);
    }
    outputs.dedup();
    assert_eq!(outputs.len(), LANGUAGES.len());
    let first = printed(&["volumetric", text(&machine), "--order", "first", "--errors", "EX0C,EXX,EZC"]);
    for line in [
        // By hand at the machine without errors: Δ = Rz(−C)·Rx(−A)·(displacement of the tool − displacement of the
        // table).
        "∂Δ.x/∂e_x0c = −c_c\n",
        "∂Δ.y/∂e_x0c = s_c\n",
        "∂Δ.x/∂e_xx  = c_c   (a constant multiple of that of e_x0c)",
        "∂Δ.z/∂e_zc  = −1\n",
        "e_xx is confounded with e_x0c",
    ] {
        assert!(first.contains(line), "`{line}` is not in\n{first}");
    }
}

/// First order of the C test without extension, by hand: L₀ = R, and ∂L/∂e is the unit vector of the bar, (−sin C, cos
/// C, 0), times the displacement by the error. H − Z_CA stays a symbol although H = Z_CA.
#[test]
fn the_first_order_is_a_sum_and_a_table() {
    let found =
        printed(&["equation", text(&plan()), "--test", "A100", "--order", "first", "--rotation", "small-angle"]);
    for line in [
        "L    ≈ L_0 + S/L_0",
        "∂L/∂e_y0a = (R·c_a − (H − Z_CA)·s_a)/L_0\n",
        "∂L/∂e_z0a = (R·s_a + (H − Z_CA)·c_a)/L_0\n",
        "∂L/∂θ_y0a = 0   (not observable)",
        "∂L/∂e_x0c = 0   (not observable)",
        "Not contained: ",
        "Largest deviation from the exact chain over A −20° to 70°: ",
        " µm at errors of ±10 µm and ±0.01°, ",
    ] {
        assert!(found.contains(line), "`{line}` is not in\n{found}");
    }
}

/// The vector whose norm is the length, and its unit vector u = b/L propagated back through the chain.
#[test]
fn derivatives_are_printed_as_a_propagated_unit_vector() {
    let a150 =
        ["equation", text(&plan()), "--test", "A150", "--rotation", "small-angle", "--gradient"].map(str::to_string);
    let a150: Vec<&str> = a150.iter().map(String::as_str).collect();
    let found = printed(&a150);
    for line in ["L = √(b.x² + b.y² + b.z²)", "unit vector of the bar", "∂L/∂e_y0a = u.y\n", "∂L/∂e_z0a = u.z\n"]
    {
        assert!(found.contains(line), "`{line}` is not in\n{found}");
    }
    refused(
        &[&a150[..], &["--order", "bilinear"]].concat(),
        &["derivatives of a bilinear form", "rust, c, python, matlab or julia"],
    );
    refused(
        &["volumetric", text(&machine()), "--gradient", "--as", "latex"],
        &["derivatives of the error vector", "rust, c, python, matlab or julia"],
    );
}

/// Parameters of the bar beside errors of the machine: a longer bar reduces the reading by the same amount.
#[test]
fn instrument_parameters_are_kept_by_name() {
    let kept = ["--errors", "EY0A,bar,workpiece_ball.y"];
    let found = printed(&[&["equation", text(&plan()), "--test", "C100"][..], &kept].concat());
    assert!(found.contains("L = √(b.x² + b.y² + b.z²) − δ_bar"), "{found}");
    assert!(found.contains("error of the workpiece ball in y"), "{found}");
}

/// Readings determine which axes move and how far. Without readings every axis moves that the test does not hold.
#[test]
fn a_measured_session_has_equations_too() {
    let measured = ready("hermle-c600u/measured/session.toml");
    let asked = ["--test", "A150", "--order", "first"];
    let found = printed(&[&["equation", text(&measured)][..], &asked].concat());
    assert!(found.contains("over A −20° to 70°:"), "{found}");
    let folder = tempfile::tempdir().unwrap();
    for name in ["session.toml", "machine.toml"] {
        let from = ready("hermle-c600u/measured").join(name);
        fs::copy(from, folder.path().join(name)).unwrap();
    }
    let alone = folder.path().join("session.toml");
    let output = abbe(&[&["equation", text(&alone)][..], &asked].concat());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    assert!(stderr.contains("A100.csv") && stderr.contains("made without readings"), "{stderr}");
    let found = String::from_utf8(output.stdout).unwrap();
    assert!(found.contains("position of axis X"), "{found}");
}

#[test]
fn a_file_is_written_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a150.tex");
    let plan = plan();
    let latex = ["equation", text(&plan), "--test", "A150", "--as", "latex"];
    let shown = printed(&latex);
    assert_eq!(printed(&[&latex[..], &["--out", text(&file)]].concat()), "");
    assert_eq!(fs::read_to_string(&file).unwrap().trim_end(), shown.trim_end());
    // If the file cannot be written, the old file is unchanged and no temporary file remains.
    refused(&[&latex[..], &["--errors", "EX0B", "--out", text(&file)]].concat(), &["EX0B"]);
    assert_eq!(fs::read_to_string(&file).unwrap().trim_end(), shown.trim_end());
    let nowhere = folder.path().join("none/a150.tex");
    refused(
        &[&latex[..], &["--out", text(&nowhere)]].concat(),
        &["a150.tex: cannot be written", "there is no folder", "make it first"],
    );
    refused(&[&latex[..], &["--out", text(folder.path())]].concat(), &["cannot be written", "this is a folder"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// By hand: a stylus at (x, y) is √(x² + y²) from the axis; a shift of the cylinder along X reduces the reading by its
/// component along the probing direction.
#[test]
fn the_reading_of_a_probe_in_every_language() {
    let session = ready("self-calibration/session.toml");
    let of = |test: &str, more: &[&str]| {
        let mut all = vec!["equation", text(&session), "--test", test];
        all.extend(more);
        printed(&all)
    };
    let first = of("2", &["--order", "first", "--errors", "EX0C,EXX,radius"]);
    for line in [
        "L_0² = y² + x²",
        "d    ≈ L_0 − R + S/L_0 − δ_radius",
        "∂d/∂e_x0c    = −x/L_0",
        "∂d/∂e_xx     = x/L_0   (a constant multiple of that of e_x0c)",
    ] {
        assert!(first.contains(line), "{first}");
    }
    let exact = of("1a", &[]);
    assert!(exact.contains("d   = −l_n·(b + √(b² − a·c))/a"), "{exact}");
    for (language, start) in [
        ("latex", "\\begin{align*}"),
        ("typst", "\n$\n"),
        ("rust", "pub fn probe_distance("),
        ("c", "probe_distance("),
        ("python", "def probe_distance("),
        ("matlab", "probe_distance("),
    ] {
        for order in ["exact", "bilinear", "first"] {
            let page = of("3", &["--as", language, "--order", order, "--errors", "EX0C,artefact.x,form"]);
            assert!(page.contains(start), "{language} {order}: {page}");
        }
    }
    // The quantities of the quadratic equation have names where they are computed, and none in a sum of first order.
    let code = |order: &str| of("1a", &["--as", "c", "--order", order]);
    let named = |code: &str| ["double a =", "double b =", "double c ="].map(|name| code.contains(name));
    assert_eq!(named(&code("exact")), [true; 3], "{}", code("exact"));
    assert_eq!(named(&code("first")), [false; 3], "{}", code("first"));
    refused(
        &["equation", text(&session), "--test", "1a", "--gradient"],
        &["the derivatives of a probed distance are written as code only"],
    );
}

/// Each channel has its own unit, and so has its gradient.
#[test]
fn code_names_the_channels_of_an_instrument_with_their_units() {
    for (session, test, values) in [
        (
            "r-test/plan.toml",
            "BK1",
            "the three coordinates read, mm. Gradient: by the errors in their order, mm/mm and mm/rad.",
        ),
        ("distance/session.toml", "S1", "distance in mm. Gradient: by the errors in their order, mm/mm and mm/rad."),
        (
            "angle/session.toml",
            "polygon",
            "angle in rad. Gradient: by the errors in their order, in the unit of the value per mm and per rad.",
        ),
        ("laser/session.toml", "LX", "displacement in mm, vertical in mm, pitch in rad. Gradient: by the errors"),
        (
            "pose/session.toml",
            "body",
            "x in mm, y in mm, z in mm, rx in rad, ry in rad, rz in rad. Gradient: by the errors",
        ),
        ("pose/tracker.toml", "target", "range in mm, across in rad, up in rad. Gradient"),
    ] {
        let page = printed(&["equation", text(&ready(session)), "--test", test, "--as", "c"]);
        assert!(page.contains(&format!("* Value: {values}")), "{session}: {page}");
    }
}

#[test]
fn invalid_requests_are_refused_with_the_reason() {
    let (plan, machine) = (plan(), machine());
    let a150 = |more: &[&'static str]| -> Vec<String> {
        let start = ["equation", text(&plan), "--test", "A150"];
        start.iter().chain(more).map(|word| (*word).to_string()).collect()
    };
    let refused_with = |more: &[&'static str], parts: &[&str]| {
        let arguments = a150(more);
        refused(&arguments.iter().map(String::as_str).collect::<Vec<_>>(), parts);
    };
    refused(&["equation", text(&plan), "--test", "A200"], &["no test `A200`", "A100, A150, C100, C150"]);
    refused_with(&["--errors", "EQ0C"], &["`EQ0C` is no parameter of an equation", "EX0C"]);
    refused_with(&["--errors", "EX0B"], &["`EX0B` is an error of axis `B`", "does not have"]);
    refused_with(&["--errors", "EX0C,e_x0c"], &["`EX0C` is named twice"]);
    refused_with(&["--errors", "tracker.a"], &["another instrument", "workpiece_ball.x"]);
    refused(&["equation", "none.toml", "--test", "A150"], &["none.toml", "cannot be read"]);
    refused(&["volumetric", "none.toml"], &["none.toml", "cannot be read"]);
    refused(&["volumetric", text(&plan)], &["chapter5.toml:7", "the file has the unknown key `machine`", "chain"]);
    refused(&["volumetric", text(&machine), "--errors", "bar"], &["`bar`", "an error vector has no parameters"]);
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("machine.toml");
    fs::write(&broken, "chain = \"w C A Y X Z t\"\n").unwrap();
    refused(&["volumetric", text(&broken)], &["machine.toml:1", "0 beds `b`"]);
    for arguments in [&["--as", "fortran"][..], &["--order", "second"], &["--rotation", "big"]] {
        let all = [&["volumetric", text(&machine)][..], arguments].concat();
        let output = abbe(&all);
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains("possible values"));
    }
}

/// The printed Python, run by Python, against the length of a triangle. Without errors the balls of the C test without
/// extension are R apart at any C. With the axis displaced by 0.3 mm in X the length is √(R² + 0.09 − 2·0.3·R·sin C).
#[test]
fn printed_code_runs_unchanged() {
    let Some(python) = test_needs::python("printed_code_runs_unchanged", "numpy") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let module = folder.path().join("c100.py");
    let plan = plan();
    printed(&[
        "equation",
        text(&plan),
        "--test",
        "C100",
        "--as",
        "python",
        "--gradient",
        "--errors",
        "EX0C",
        "--out",
        text(&module),
    ]);
    let script = "
import math, c100
for c in [0.0, 0.7, 2.0, -2.5]:
    value, gradient = c100.bar_length_gradient(R=100.0, H=75.0, Z_CA=75.0, C_rad=c, EX0C=0.3)
    expected = math.sqrt(100.0**2 + 0.09 - 2 * 0.3 * 100.0 * math.sin(c))
    slope = (0.3 - 100.0 * math.sin(c)) / expected
    assert abs(float(value) - expected) < 1e-12 * expected, (value, expected)
    assert abs(float(gradient[0]) - slope) < 1e-12, (gradient, slope)
";
    let ran = Command::new(python).current_dir(folder.path()).args(["-c", script]).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
}

/// Options of typesetting and of code reach the library; a language that ignores one refuses it.
#[test]
fn equations_are_set_and_called_as_requested() {
    let plan = plan();
    let a150 = ["equation", text(&plan), "--test", "A150"];
    let of = |more: &[&str]| printed(&[&a150[..], more].concat());
    let latex = of(&["--as", "latex", "--number", "last", "--two-column", "--nomenclature"]);
    assert!(latex.contains("\\label{eq:ldbb-A150}") && !latex.contains("\\label{eq:ldbb-A150-1}"), "{latex}");
    assert!(latex.contains("test radius: distance of the pivot from the axis (Table 3.1)"), "{latex}");
    assert_eq!(latex, of(&["--as", "latex", "--number", "last", "--width", "8.4cm", "--nomenclature"]));
    assert!(of(&["--as", "latex", "--number", "all"]).contains("\\label{eq:ldbb-A150-1}"));
    let single = of(&["--form", "single", "--rotation", "small-angle"]);
    assert!(single.contains("e_y0a + cθ_a·(e_y0c"), "{single}");
    assert!(of(&["--as", "c"]).contains("struct bar_length_errors {"));
    assert!(of(&["--as", "c", "--angles", "deg"]).contains("double A_deg;"));
    assert!(of(&["--as", "c", "--layout", "flat"]).contains("void bar_length_columns("));
    let all = printed(&["equation", text(&plan), "--all-tests", "--order", "first"]);
    for part in ["test A100", "test C150", "derivatives of the readings", "A100", "√(R_e² − R²)/L_0"] {
        assert!(all.contains(part), "`{part}` is not in\n{all}");
    }
    let refuse = |more: &[&str], parts: &[&str]| refused(&[&a150[..], more].concat(), parts);
    refuse(&["--width", "84mm"], &["`--width` does not apply to `--as text`", "latex, typst"]);
    refuse(&["--as", "latex", "--layout", "flat"], &["`--layout` does not apply to `--as latex`", "rust, c, python"]);
    refuse(&["--as", "c", "--layout", "flat", "--angles", "deg"], &["`--angles` does not apply to `--layout flat`"]);
    refuse(&["--order", "first", "--form", "groups"], &["`groups`", "first order"]);
    refused(
        &["equation", text(&plan), "--all-tests", "--as", "c"],
        &["`--all-tests --as c` writes a file for each test", "--out"],
    );
    refuse(&["--symbols", "B"], &["no axis `B` that could stay a symbol", "C, A, Y, X, Z"]);
    for wrong in [&["--width", "84"][..], &["--width", "1mm"]] {
        let output = abbe(&[&a150[..], &["--as", "latex"], wrong].concat());
        assert_eq!(output.status.code(), Some(2));
    }
    assert_eq!(abbe(&["equation", text(&plan)]).status.code(), Some(2));
}

/// Code of all tests lies side by side: each function has the name of its test, and lengths that no reading depends on are
/// no arguments.
#[test]
fn code_of_all_tests_is_a_folder() {
    let place = tempfile::tempdir().unwrap();
    let plan = plan();
    let out = place.path().join("readings");
    let all = ["equation", text(&plan), "--all-tests", "--gradient", "--out", text(&out)];
    assert_eq!(printed(&[&all[..], &["--as", "python"]].concat()), "");
    let mut names: Vec<String> =
        fs::read_dir(&out).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, ["a100", "a150", "c100", "c150"].map(|test| format!("bar_length_{test}.py")));
    let a100 = fs::read_to_string(out.join("bar_length_a100.py")).unwrap();
    assert!(a100.contains("def bar_length_a100(") && a100.contains("def bar_length_a100_gradient("), "{a100}");
    assert!(!a100.contains("R_c") && !a100.contains("R_e"), "{a100}");
    assert!(fs::read_to_string(out.join("bar_length_a150.py")).unwrap().contains("    R_e: ArrayLike,"));
    // Not into a folder with files.
    refused(&[&all[..], &["--as", "python"]].concat(), &["is not empty"]);
    let flat = place.path().join("kernels");
    let kernels = ["equation", text(&plan), "--all-tests", "--as", "c", "--layout", "flat", "--out", text(&flat)];
    printed(&kernels);
    let a100 = fs::read_to_string(flat.join("bar_length_a100.c")).unwrap();
    assert!(a100.contains("void bar_length_a100_columns(") && !a100.contains("R_c"), "{a100}");
    if let Some(cc) = ["gcc", "cc"].into_iter().find(|cc| Command::new(cc).arg("--version").output().is_ok()) {
        let tests = ["a100", "a150", "c100", "c150"];
        let includes: String = tests.iter().map(|test| format!("#include \"bar_length_{test}.c\"\n")).collect();
        fs::write(flat.join("all.c"), includes + "int main(void) { return 0; }\n").unwrap();
        let output =
            Command::new(cc).current_dir(&flat).args(["-Wall", "-Werror", "all.c", "-o", "all", "-lm"]).output();
        let output = output.unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

/// `--symbols` reaches the library: the A test of the thesis holds C, which is a symbol on request.
#[test]
fn a_held_axis_is_a_symbol_on_request() {
    let plan = plan();
    let a100 = ["equation", text(&plan), "--test", "A100", "--form", "single", "--rotation", "small-angle"];
    assert!(!printed(&a100).contains("cθ_c"));
    let symbols = printed(&[&a100[..], &["--symbols", "A,C"]].concat());
    assert!(symbols.contains("θ_x0c·cθ_c + θ_y0c·sθ_c"), "{symbols}");
    assert!(symbols.contains("sine and cosine of the angle of axis C, held at 0°"), "{symbols}");
    assert_eq!(printed(&[&a100[..], &["--symbols", "none"]].concat()), printed(&a100));
    let code = printed(&[&a100[..4], &["--as", "c", "--symbols", "C"]].concat());
    assert!(code.contains("double C_rad;"), "{code}");
}
