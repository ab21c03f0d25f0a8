//! Tests of the chain over symbols against the chain over numbers.

use abbe_codegen::evaluate::evaluate_f64;
use abbe_codegen::{Equation, Options, Variable};
use abbe_model::chain::AxisPosition;
use abbe_model::frames::Rotation;
use abbe_model::instrument::{Station, Target, ballbar::BallBar};
use rand::RngExt;
use rand::SeedableRng;

use crate::support::{Chapter5, eight, hermle};

#[test]
fn the_symbolic_chain_evaluates_to_the_chain_over_numbers() {
    for rotation in [Rotation::Exact, Rotation::SmallAngle] {
        let machine = hermle(rotation);
        let errors = eight();
        let equation =
            Equation::of(&machine, &Chapter5 { extended: true }, &errors, &Options::default()).expect("an equation");
        let mut random = rand_pcg::Pcg64::seed_from_u64(4);
        for _ in 0..200 {
            let mut draw = |size: f64| random.random_range(-size..size);
            let (r, h, z_ca, d) = (draw(200.0), draw(100.0), draw(100.0), draw(200.0));
            let (a, c) = (draw(7.0), draw(7.0));
            let values: Vec<f64> =
                errors.iter().map(|e| if e.freedom.is_angle() { draw(0.1) } else { draw(10.0) }).collect();
            let spindle_ball = Target::on_tool([-d, 0.0, 0.0]);
            let bar = BallBar { workpiece_ball: Target::on_table([0.0, r, h - z_ca]), spindle_ball, bar: r };
            let state: Vec<_> = machine
                .axes
                .iter()
                .map(|axis| {
                    let position = match axis.name.as_str() {
                        "A" => a,
                        "C" => c,
                        _ => 0.0,
                    };
                    AxisPosition::new(axis.kind, position)
                })
                .collect();
            let slot = |slot| errors.iter().position(|e| machine.error_slot(e) == Some(slot));
            let bodies = machine.body_errors(|s| slot(s).is_some(), |s| slot(s).map_or(0.0, |i| values[i]));
            let expected = Station::BallBar(bar).read::<f64>(&machine, &state, &bodies, |_| None);
            let expected = expected.channels()[0];
            let found = evaluate_f64(&equation.arena, &equation.exact, |variable| match variable {
                Variable::Length(name) => match name.as_str() {
                    "R" => r,
                    "H" => h,
                    "Z_CA" => z_ca,
                    _ => d,
                },
                Variable::Position { axis, .. } => {
                    if axis == "A" {
                        a
                    } else {
                        c
                    }
                }
                Variable::Error(name) => errors.iter().position(|e| e == name).map_or(f64::NAN, |i| values[i]),
                Variable::Instrument(_) | Variable::Driver(_) | Variable::Coefficient(_) => f64::NAN,
            });
            let found = found.expect("plain numbers")[0];
            assert!((found - expected).abs() <= 1e-12 * expected, "{found} {expected}");
        }
    }
}

#[test]
fn value_and_gradient_of_the_chapter_5_test_take_at_most_70_operations() {
    let machine = hermle(Rotation::SmallAngle);
    let equation = Equation::of(&machine, &Chapter5 { extended: true }, &eight(), &Options::default());
    let program = equation.expect("an equation").program(true);
    let operations = program.operations();
    assert!(operations.arithmetic() <= 70, "{operations:?}");
    assert_eq!(operations.functions, 0);
}
