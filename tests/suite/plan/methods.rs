//! The three methods of the thesis: identifiability and uncertainty, and the disagreement of chapters 4 and 5 on θ_y0a
//! and θ_y0c.

use abbe::model::session::{Prior, Session};
use abbe::plan::results::Detectability;
use abbe::plan::results::PlanAnalysis;
use abbe::plan::{PlanOptions, analyse};

use crate::suite::plan::help::ready;

/// The plan of a method with this standard uncertainty of every set-up length, µm; 0: exactly known.
fn method(chapter: usize, setup_um: f64) -> Session {
    let mut session = ready(&format!("hermle-c600u/chapter{chapter}.toml"));
    for test in &mut session.tests {
        for prior in &mut test.priors {
            if matches!(prior, Prior::Gaussian(_)) {
                *prior = if setup_um > 0.0 { Prior::Gaussian(setup_um * 1e-3) } else { Prior::Known };
            }
        }
    }
    session
}

fn analysis(chapter: usize, setup_um: f64, effects: bool) -> PlanAnalysis {
    analyse(&method(chapter, setup_um), &PlanOptions { effects, ..PlanOptions::default() }).unwrap()
}

fn u(analysis: &PlanAnalysis, id: &str) -> f64 {
    analysis.errors.iter().find(|error| error.id == id).and_then(|error| error.u).unwrap()
}

fn rho(analysis: &PlanAnalysis, a: &str, b: &str) -> f64 {
    let place = |id: &str| analysis.correlation.ids.iter().position(|other| other == id).unwrap();
    analysis.correlation.matrix[place(a)][place(b)].unwrap()
}

/// Bias of an error, in its unit per unit of an effect, with its sign.
fn bias(analysis: &PlanAnalysis, effect: &str, error: &str) -> f64 {
    let effects = &analysis.effects.as_ref().unwrap().effects;
    let found = effects.iter().find(|found| found.id == effect).unwrap_or_else(|| panic!("{effect} is not there"));
    found.biases.iter().find(|bias| bias.id == error).map_or(0.0, |bias| bias.per_unit)
}

/// Tables 4.2, 4.3, 5.2, 5.3, 6.3 and 6.4: standard deviations over ten repetitions, µm and arcsec.
const REPEATED: [(&str, [f64; 3]); 8] = [
    ("EY0A", [0.08, 0.34, 0.08]),
    ("EZ0A", [0.37, 0.29, 0.2]),
    ("EB0A", [0.557, 0.427, 0.130]),
    ("EC0A", [0.388, 0.9072, 0.063]),
    ("EX0C", [0.15, 0.15, 0.12]),
    ("EY0C", [0.60, 0.49, 0.6]),
    ("EA0C", [0.489, 0.409, 0.785]),
    ("EB0C", [0.527, 0.579, 0.665]),
];

#[test]
fn each_method_identifies_all_eight_errors_with_the_set_up_priors() {
    for chapter in [4, 5, 6] {
        let plan = analysis(chapter, 1.0, false);
        assert!(plan.unidentifiable.is_empty());
        for (id, repeated) in REPEATED {
            let error = plan.errors.iter().find(|error| error.id == id).unwrap();
            let total: f64 = error.budget.iter().map(|part| part.share).sum();
            assert!((total - 1.0).abs() < 2e-3, "{chapter} {id}: shares come to {total}");
            let noise = error.budget.iter().find(|part| part.source == "noise").unwrap().u;
            // The repeatability of the thesis, printed with one or two digits, lies between that of white noise of 0.3 µm and
            // that of a new set-up.
            assert!(noise < 1.05 * repeated[chapter - 4], "{chapter} {id}: {noise}");
            assert!(u(&plan, id) > repeated[chapter - 4], "{chapter} {id}: {}", u(&plan, id));
        }
    }
}

/// In chapters 4 and 6 the ball of the A tests stands on the A table, and no error of C moves it. The values are of an
/// independent computation in NumPy. Those of EY0C, EC0A and EA0C follow by hand from the offsets of the spindle balls, 1 µm
/// each: √2 µm and √1.5 µm, and √2 µm over 111.8 mm and over 78 mm, beside the noise.
#[test]
fn a_ball_on_the_a_table_has_the_uncertainty_of_an_independent_computation() {
    let cases = [
        (4, "EY0C", 1.416, 2.0_f64.sqrt()),
        (4, "EC0A", 2.62, 2.0_f64.sqrt() * 1.845),
        (4, "EA0C", 2.61, 2.0_f64.sqrt() * 1.845),
        (4, "EB0C", 3.60, 3.60),
        (6, "EY0C", 1.226, 1.5_f64.sqrt()),
        (6, "EA0C", 3.74, 2.0_f64.sqrt() * 2.6445),
    ];
    let plans = [4, 6].map(|chapter| (chapter, analysis(chapter, 1.0, false)));
    for (chapter, id, independent, of_balls) in cases {
        let plan = &plans.iter().find(|(own, _)| *own == chapter).unwrap().1;
        let error = plan.errors.iter().find(|error| error.id == id).unwrap();
        let noise = error.budget.iter().find(|part| part.source == "noise").unwrap().u;
        let found = error.u.unwrap();
        assert!((found - independent).abs() < 0.004, "{chapter} {id}: {found}");
        assert!((found - noise.hypot(of_balls)).abs() < 2e-3 * found, "{chapter} {id}: {found}");
    }
}

#[test]
fn chapters_4_and_5_agree_on_the_sum_and_disagree_on_its_parts() {
    // Tables 4.3 and 5.3.
    let (y0a, y0c): ([f64; 2], [f64; 2]) = ([6.62, -1.29], [-3.75, 4.48]);
    let difference = [y0a[0] - y0a[1], y0c[0] - y0c[1]];
    assert!(difference[0] > 7.0 && difference[1] < -8.0);
    // The C test with the longer bar determines the sum of the two, which agrees.
    assert!((difference[0] + difference[1]).abs() < 0.4);

    let plans = [analysis(4, 1.0, false), analysis(5, 1.0, false)];
    for plan in &plans {
        assert!((rho(plan, "EB0A", "EB0C") + 0.70).abs() < 0.015, "{}", rho(plan, "EB0A", "EB0C"));
    }
    let both = |id: &str| u(&plans[0], id).hypot(u(&plans[1], id));
    // The repeatability does not explain the difference.
    assert!(difference[0] / 0.557_f64.hypot(0.427) > 10.0);
    // A spindle ball with u = 1 µm in every test explains it at about two standard deviations.
    let ratio = [difference[0] / both("EB0A"), difference[1] / both("EB0C")];
    println!("difference over predicted: EB0A {:+.2}, EB0C {:+.2}", ratio[0], ratio[1]);
    assert!((2.0..2.5).contains(&ratio[0]) && (-2.0..-1.4).contains(&ratio[1]));
}

#[test]
fn an_offset_of_the_spindle_ball_between_two_tests_explains_both_differences_without_a_residual() {
    let plan = analysis(5, 0.0, true);
    let (a, c) = ("EB0A", "EB0C");
    let height = "spindle_ball.z~none:constant[A150]";
    let per_um = bias(&plan, height, a);
    // One µm over D = 111.8 mm is 1.845″.
    assert!((per_um.abs() - 1.845).abs() < 0.01, "{per_um}");
    assert!((per_um + bias(&plan, height, c)).abs() < 1e-3 * per_um.abs());
    let sideways = "spindle_ball.x~none:constant[C150]";
    assert!(bias(&plan, sideways, a).abs() < 1e-3);
    assert!((bias(&plan, sideways, c).abs() - 1.845).abs() < 0.01);
    // Each is completely confounded: the residual is clean at any size.
    for effect in [height, sideways] {
        let found = plan.effects.as_ref().unwrap().effects.iter().find(|found| found.id == effect).unwrap();
        assert_eq!(found.verdict, Detectability::Confounded, "{effect}");
        assert!(found.detectable_amplitude.is_none());
    }
    println!("4.3 µm: EB0A {:+.2}″, EB0C {:+.2}″", 4.3 * per_um, 4.3 * bias(&plan, height, c));
}

/// Y stands at zero in all tests, so a squareness that tilts Y moves nothing. X stands at −D in A150 and at zero
/// elsewhere, so a tilt of X displaces the ball by a constant in A150 alone, and 1″ of it is as 1″ of `EB0A`. Whatever
/// the priors, rounding decides neither.
#[test]
fn an_effect_without_an_arm_has_no_signal_and_one_with_a_constant_arm_is_confounded() {
    for setup_um in [0.0, 1.0, 2.0] {
        let plan = analysis(5, setup_um, true);
        let effects = &plan.effects.as_ref().unwrap().effects;
        let of = |id: &str| effects.iter().find(|effect| effect.id == format!("{id}~none:constant")).unwrap();
        for effect in [of("EA0Y"), of("EC0Y")] {
            assert_eq!((effect.verdict, effect.residual_share), (Detectability::NoSignal, 0.0), "{}", effect.id);
            assert!(effect.detectable_amplitude.is_none() && effect.biases.is_empty(), "{}", effect.id);
        }
        for effect in [of("EB0X"), of("EC0X")] {
            assert_eq!(effect.verdict, Detectability::Confounded, "{}", effect.id);
            assert!(effect.residual_share < 1e-9, "{}: {}", effect.id, effect.residual_share);
        }
        if setup_um == 0.0 {
            assert!((bias(&plan, "EB0X~none:constant", "EB0A").abs() - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn a_repeatable_straightness_of_x_biases_both_chapters_alike() {
    let effect = "EZX~X:power2";
    let [four, five] = [analysis(4, 0.0, true), analysis(5, 0.0, true)];
    for error in ["EB0A", "EB0C"] {
        let (a, b) = (bias(&four, effect, error), bias(&five, effect, error));
        assert!(a.abs() > 1.0, "{error}: {a}");
        assert!((a - b).abs() < 0.01 * a.abs(), "{error}: {a} in chapter 4, {b} in chapter 5");
    }
}

#[test]
fn the_table_in_the_docs_agrees_with_the_computation() {
    let docs = std::fs::read_to_string(crate::suite::workspace().join("docs/guide/methods.md")).unwrap();
    for (column, chapter) in [4, 5, 6].into_iter().enumerate() {
        let plan = analysis(chapter, 1.0, false);
        let mut one = method(chapter, 1.0);
        one.tests.iter_mut().for_each(|test| test.spindle_setup = "one".to_string());
        let one = analyse(&one, &PlanOptions { effects: false, ..PlanOptions::default() }).unwrap();
        for error in &plan.errors {
            let start = format!("| `{}` |", error.id);
            let row = docs.lines().find(|line| line.starts_with(&start)).unwrap();
            let cells: Vec<&str> = row.split('|').map(str::trim).collect();
            let printed = |k: usize| cells[3 + 4 * column + k].parse::<f64>().unwrap();
            let noise = error.budget.iter().find(|part| part.source == "noise").unwrap().u;
            for (k, value) in [noise, error.u.unwrap(), u(&one, &error.id)].into_iter().enumerate() {
                assert!(
                    (printed(k) - value).abs() <= 0.006 * value,
                    "{chapter} {}: {} for {value}",
                    error.id,
                    printed(k)
                );
            }
        }
    }
}
