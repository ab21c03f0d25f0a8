//! Axes that a test holds: as symbols, or as exact numbers, without rounding residue of the nominal geometry.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use abbe_codegen::print::Style;
use abbe_codegen::{Arrangement, Equation, Options, Order, SessionTest, check, language};
use abbe_files::ReadOptions;
use abbe_model::frames::Rotation;
use abbe_model::session::Session;

use crate::tools;

fn sessions() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions")
}

/// A test of C with the table tilted to `angle`, with the spindle ball on the axis of C, and `place` for the sine and the
/// cosine in its position.
fn tilted(angle: &str, place: [&str; 2]) -> Session {
    of_table(angle, place, "L_b", "H - Z_CA + sqrt(L_b^2 - R^2)")
}

/// As [`tilted`], with the spindle ball `along` the axis of C.
fn of_table(angle: &str, [sin, cos]: [&str; 2], bar: &str, along: &str) -> Session {
    let text = format!(
        "[machine]\nfile = \"machine.toml\"\n\
         [constants]\nR = 100.0\nH = 75.0\nZ_CA = 60.0\nL_b = 149.9946\n\
         [instrument]\nkind = \"ballbar\"\n\
         [unknowns]\nerrors = [\"EY0A\", \"EZ0A\", \"EB0A\", \"EC0A\", \"EX0C\", \"EY0C\", \"EA0C\", \"EB0C\"]\n\
         [[test]]\nname = \"C\"\nbar_mm = \"{bar}\"\nworkpiece_ball_mm = [0, \"R\", \"H - Z_CA\"]\n\
         spindle_ball_mm = [0, 0, 0]\n\
         at = {{ a_deg = {angle}, y_mm = \"-({sin})*({along})\", z_mm = \"{cos}*({along})\" }}\n\
         sweep = {{ axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 5, feed_deg_min = 300 }}\n"
    );
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let folder = tools::folder(&format!("held-{}", COUNT.fetch_add(1, Ordering::Relaxed)));
    std::fs::copy(sessions().join("hermle-c600u/machine.toml"), folder.join("machine.toml")).expect("a machine");
    tools::write(&folder.join("session.toml"), &text);
    let session = abbe_files::session(&folder.join("session.toml"), &ReadOptions::default()).expect("a session");
    let _ = std::fs::remove_dir_all(&folder);
    session
}

fn printed(session: &Session, symbols: Option<&[String]>, options: &Options, word: &str) -> String {
    let source = SessionTest::new(session, &session.tests[0]).expect("a plan");
    let source = match symbols {
        Some(axes) => source.with_symbols(axes).expect("axes"),
        None => source,
    };
    let equation = Equation::of(&session.machine, &source, &session.unknowns, options).expect("an equation");
    let checked = check(&equation, &source).expect("agreement with dual numbers");
    language(word).expect("a language").print(&checked, &Style::default()).expect("a page")
}

fn first() -> Options {
    Options { order: Order::First, ..Options::default() }
}

/// The lines of a page without what the check found.
fn equations(text: &str) -> String {
    let (equations, _) = text.split_once("\nsymbols\n").expect("symbols");
    equations.lines().skip(2).collect::<Vec<&str>>().join("\n")
}

/// By hand, with the bar from the spindle ball to the workpiece ball and D = √(L_b² − R²):
///
/// ```text
/// b = (−R·s_c, R·c_a·c_c + D·s_a, R·s_a·c_c − D·c_a),  L₀ = L_b
/// ∂L/∂e_x0c = b·x = −R·s_c,  ∂L/∂e_y0c = b·(0, c_a, s_a) = R·c_c,  ∂L/∂e_y0a = b_y
/// ```
#[test]
fn a_tilted_table_stays_a_symbol() {
    for (angle, place) in
        [("45", ["sqrt(2)/2", "sqrt(2)/2"]), ("30", ["1/2", "sqrt(3)/2"]), ("-60", ["-sqrt(3)/2", "0.5"])]
    {
        let text = printed(&tilted(angle, place), None, &first(), "text");
        for line in [
            "L_0² = L_b²\n",
            "∂L/∂e_y0a = (√(L_b² − R²)·s_a + R·c_a·c_c)/L_0\n",
            "∂L/∂e_x0c = −R·s_c/L_0   (a constant multiple of that of θ_y0a)\n",
            "∂L/∂e_y0c = R·c_c/L_0\n",
            &format!("sine and cosine of the angle of axis A, held at {}°", angle.replace('-', "−")),
        ] {
            assert!(text.contains(line), "`{line}` is not in\n{text}");
        }
        // No number but the squares and the zeros of what is not observable.
        let digits = |word: &str| word.chars().any(|c| c.is_ascii_digit()) && !word.contains(['_', '∂']) && word != "0";
        let found: Vec<String> =
            equations(&text).split([' ', '\n', '/', '(', ')']).filter(|word| digits(word)).map(String::from).collect();
        assert!(found.is_empty(), "{angle}: {found:?}\n{text}");
        let single = Options { arrangement: Arrangement::Single, ..first() };
        let latex = printed(&tilted(angle, place), None, &single, "latex");
        assert!(latex.contains("\\mathrm{s}\\theta_{a}") && latex.contains("\\mathrm{c}\\theta_{a}"), "{latex}");
        assert!(!latex.contains("10^{"), "{latex}");
    }
}

/// Without the extension e_y0a and e_z0a have the columns R·c_a·c_c and R·s_a·c_c, and e_y0c has R·c_c: multiples of each
/// other, because A does not move.
#[test]
fn a_held_angle_is_constant_in_the_table_of_columns() {
    let session = of_table("45", ["sqrt(2)/2", "sqrt(2)/2"], "R", "H - Z_CA");
    let text = printed(&session, None, &first(), "text");
    for line in ["e_z0a is confounded with e_y0a", "e_y0c is confounded with e_y0a"] {
        assert!(text.contains(line), "`{line}` is not in\n{text}");
    }
}

/// With numbers in place of the symbol the constants are exact, and nothing is left of what cancels.
#[test]
fn numbers_of_a_held_axis_are_exact() {
    let numbers: &[String] = &[];
    let text = printed(&tilted("45", ["sqrt(2)/2", "sqrt(2)/2"]), Some(numbers), &first(), "text");
    for line in ["L_0² = L_b²\n", "∂L/∂e_y0a = √2/2·(√(L_b² − R²) + R·c_c)/L_0\n", "∂L/∂e_y0c = R·c_c/L_0\n"]
    {
        assert!(text.contains(line), "`{line}` is not in\n{text}");
    }
    let latex = printed(&tilted("45", ["sqrt(2)/2", "sqrt(2)/2"]), Some(numbers), &first(), "latex");
    assert!(latex.contains("\\frac{\\sqrt{2}}{2}"), "{latex}");
    let text = printed(&tilted("30", ["1/2", "sqrt(3)/2"]), Some(numbers), &first(), "text");
    for line in ["L_0² = L_b²\n", "√3/2", "1/2"] {
        assert!(text.contains(line), "`{line}` is not in\n{text}");
    }
    // An angle without exact sine: numbers of twelve digits, and no residue.
    let (sin, cos) = 30.5_f64.to_radians().sin_cos();
    let text = printed(&tilted("30.5", [&sin.to_string(), &cos.to_string()]), Some(numbers), &first(), "text");
    assert!(text.contains("L_0² = L_b²\n") && text.contains("∂L/∂e_y0c = R·c_c/L_0\n"), "{text}");
    // The cosine of 90° is zero.
    let text = printed(&tilted("90", ["1", "0"]), None, &first(), "text");
    assert!(text.contains("∂L/∂e_y0a = √(L_b² − R²)/L_0\n") && !equations(&text).contains("e-"), "{text}");
    let exact = printed(&tilted("90", ["1", "0"]), None, &Options::default(), "c");
    assert!(!exact.contains("e-17"), "{exact}");
}

/// Eqs. 3.20 and 3.21 of Jiang (2014) from the bundled session: the tests of A hold C, which stays a symbol.
#[test]
fn the_equations_of_the_thesis_from_the_bundled_session() {
    let session = abbe_files::session(&sessions().join("hermle-c600u/chapter5.toml"), &ReadOptions::default())
        .expect("a session");
    let symbols = ["A", "C"].map(String::from);
    let options =
        Options { arrangement: Arrangement::Single, rotation: Some(Rotation::SmallAngle), ..Options::default() };
    let of = |name: &str| {
        let test = session.tests.iter().find(|test| test.name == name).expect("the test");
        let source = SessionTest::new(&session, test).expect("a plan").with_symbols(&symbols).expect("axes");
        let equation = Equation::of(&session.machine, &source, &session.unknowns, &options).expect("an equation");
        equations(
            &language("text")
                .and_then(|text| text.print(&check(&equation, &source)?, &Style::default()))
                .expect("a page"),
        )
    };
    let kept = |name: &str| {
        let path = sessions().join(format!("../snapshots/codegen__{name}_text.snap"));
        let text = std::fs::read_to_string(path).expect("a snapshot");
        equations(text.splitn(3, "---\n").nth(2).expect("the text"))
    };
    assert_eq!(of("A100"), kept("eq_3_20"));
    assert_eq!(of("A150").replace("√(R_e² − R²)", "D"), kept("eq_3_21"));
}

/// What no axis is, is refused; code has numbers unless an axis is named.
#[test]
fn only_axes_of_the_machine_are_symbols() {
    let session = tilted("45", ["sqrt(2)/2", "sqrt(2)/2"]);
    let source = SessionTest::new(&session, &session.tests[0]).expect("a plan");
    let message = source.with_symbols(&["B".to_string()]).expect_err("no such axis").to_string();
    assert!(message.contains("has no axis `B`") && message.contains("C, A, Y, X, Z"), "{message}");
    assert!(!language("c").expect("a language").keeps_symbols());
    assert!(language("latex").expect("a language").keeps_symbols());
}
