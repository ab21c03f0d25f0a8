//! Tests of declared effects in equations: every shape against its closed form by hand, printed forms, refusals.

use std::f64::consts::{PI, TAU};

use abbe_codegen::evaluate::evaluate_f64;
use abbe_codegen::print::{Audience, LANGUAGES, Style};
use abbe_codegen::{Equation, Options, Order, Source, Subject, Variable, check};
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::driver::{Driver, DriverPart};
use abbe_model::effect::shape::{
    Cosine, Curve, Harmonic, Local, Periodic, Polynomial, Power, ReversalSpike, Spectrum, Steps, Triangle, Warmup,
};
use abbe_model::effect::{Component, Effect, Shape};
use abbe_model::instrument::{Station, Target, ballbar::BallBar, socket::Socket};
use abbe_model::scalar::Nominal;

use crate::support::printed;

/// A ball at the tool frame's origin in a socket at R's origin: the reading is the position of the ball.
#[derive(Clone, Copy)]
struct Ball;

impl Source for Ball {
    fn subject<N: Nominal>(&self, _length: &impl Fn(&str) -> N) -> Subject<N> {
        Subject::Station(Station::Socket(Socket {
            ball: Target::on_tool([N::constant(0.0); 3]),
            socket: [N::constant(0.0); 3],
            is_located: true,
        }))
    }
}

pub fn effect(component: &str, driver: &str, shape: Shape) -> Effect {
    Effect::new(Component::parse(component).expect("a component"), Driver::parse(driver), shape)
}

fn with(effects: Vec<Effect>) -> Options {
    Options { effects, gradient: true, ..Options::default() }
}

/// State of a driver at a point: position, direction, rate, distance since the reversal.
#[derive(Clone, Copy)]
struct At {
    q: f64,
    direction: f64,
    rate: f64,
    way: f64,
}

/// Basis functions of an effect on EYX of a machine with the single axis X. The derivatives of the reading in Y are the
/// basis functions, and the reading is their sum.
fn bases(driver: &str, shape: Shape, at: At) -> Vec<f64> {
    let machine = Machine::from_code("w b X t").expect("a code");
    let options = with(vec![effect("EYX", driver, shape)]);
    let equation = Equation::of(&machine, &Ball, &[], &options).expect("an equation");
    let variable = |variable: &Variable| match variable {
        Variable::Position { .. } => at.q,
        Variable::Driver(quantity) => match quantity.part {
            DriverPart::Value => at.q,
            DriverPart::Direction => at.direction,
            DriverPart::Rate => at.rate,
            DriverPart::SinceReversal => at.way,
        },
        Variable::Coefficient(coefficient) => coefficient.number as f64,
        other => panic!("{other:?} has no place here"),
    };
    let slopes = equation.gradients()[1].clone();
    let found = evaluate_f64(&equation.arena, &slopes, variable).expect("numbers");
    let value = evaluate_f64(&equation.arena, &equation.outputs, variable).expect("numbers")[1];
    let sum: f64 = found.iter().enumerate().map(|(k, b)| (k + 1) as f64 * b).sum();
    assert!((value - sum).abs() <= 1e-12 * (1.0 + sum.abs()), "{value} {sum}");
    found
}

#[track_caller]
fn near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-13, "{found} for {expected}");
    }
}

const HERE: At = At { q: 37.0, direction: -1.0, rate: 4.0, way: 6.0 };

fn here(q: f64) -> At {
    At { q, ..HERE }
}

#[test]
fn smooth_shapes_by_hand() {
    let polynomial = Shape::Polynomial(Polynomial { degree: 3, scale: 100.0 });
    near(&bases("X", polynomial, HERE), &[0.37, 0.1369, 0.050653]);
    let power = Shape::Power(Power { degree: 5, scale: 10.0 });
    near(&bases("temperature", power, here(12.0)), &[2.48832]);
    let harmonic = Shape::Harmonic(Harmonic { order: 3.0 });
    near(&bases("X", harmonic, here(PI / 12.0)), &[0.5_f64.sqrt(), 0.5_f64.sqrt()]);
    let periodic = Shape::Periodic(Periodic { period: 12.0 });
    near(&bases("X", periodic, here(38.0)), &[(TAU / 6.0).cos(), (TAU / 6.0).sin()]);
    let turn = Shape::Spectrum(Spectrum::of_turn(3));
    let third = 0.75_f64.sqrt();
    near(&bases("X", turn, here(PI / 3.0)), &[0.5, third, -0.5, third, -1.0, 0.0]);
    let travel = Shape::Spectrum(Spectrum { orders: 2, period: 12.0 });
    near(&bases("X", travel, here(1.0)), &[third, 0.5, 0.5, third]);
    near(&bases("time", Shape::Drift, here(1800.0)), &[0.5]);
    let warmup = Shape::Warmup(Warmup { tau_s: 600.0 });
    near(&bases("time", warmup, here(1200.0)), &[1.0 - (-2.0_f64).exp()]);
    near(&bases("X", Shape::Lag, HERE), &[-4.0]);
    let square = Shape::Polynomial(Polynomial { degree: 2, scale: 10.0 });
    near(&bases("speed-squared", square, HERE), &[1.6, 2.56]);
}

/// A triangular wave is the arc sine of a sine, scaled to 1.
#[test]
fn triangles_by_the_arc_sine() {
    for q in [-50.0, -7.0, 0.0, 2.9, 3.1, 8.0, 38.0_f64] {
        let angle = TAU * q / 12.0;
        let expected = [angle.cos(), angle.sin()].map(|wave| wave.asin() / (PI / 2.0));
        near(&bases("X", Shape::Triangle(Triangle { period: 12.0 }), here(q)), &expected);
    }
    near(&bases("X", Shape::Triangle(Triangle { period: 12.0 }), here(38.0)), &[1.0 / 3.0, 2.0 / 3.0]);
}

#[test]
fn cosine_and_cotangent_by_hand() {
    for q in [-2.0, -0.4, 0.3, 1.2, 4.0_f64] {
        near(&bases("X", Shape::Cosine(Cosine { order: 3.0 }), here(q)), &[(3.0 * q).cos()]);
        near(&bases("X", Shape::Cotangent, here(q)), &[1.0 / q.tan()]);
    }
}

#[test]
fn shapes_of_reversal_by_hand() {
    near(&bases("X", Shape::Backlash, HERE), &[0.5]);
    let spike = Shape::ReversalSpike(ReversalSpike { width: 3.0 });
    near(&bases("X", spike, HERE), &[-(-2.0_f64).exp()]);
}

#[test]
fn shapes_with_edges_by_hand_on_both_sides() {
    let steps = || Shape::Steps(Steps { at: vec![10.0, 37.0, 50.0] });
    near(&bases("X", steps(), HERE), &[1.0, 1.0, 0.0]);
    near(&bases("X", steps(), here(36.999)), &[1.0, 0.0, 0.0]);
    let bump = |recurs| Shape::Local(Local { centre: 30.0, width: 10.0, recurs });
    let expected = 0.5 * (1.0 + (0.7 * PI).cos());
    near(&bases("X", bump(None), HERE), &[expected]);
    for outside in [19.9, 40.1, 137.0, -63.0] {
        near(&bases("X", bump(None), here(outside)), &[0.0]);
    }
    for again in [37.0, 137.0, -63.0, -163.0] {
        near(&bases("X", bump(Some(100.0)), here(again)), &[expected]);
    }
    near(&bases("X", bump(Some(100.0)), here(180.0)), &[0.0]);
}

/// The cardinal cubic B-spline by its truncated powers (de Boor, ch. IX), independent of the implementation: N(s) = Σ
/// (−1)^k (4 over k) (s − k)₊³ / 6.
fn cardinal(s: f64) -> f64 {
    let terms = [1.0, -4.0, 6.0, -4.0, 1.0].into_iter().enumerate();
    let sum: f64 = terms.map(|(k, c)| c * (s - k as f64).max(0.0).powi(3)).sum();
    if (0.0..4.0).contains(&s) { sum / 6.0 } else { 0.0 }
}

#[test]
fn curves_by_truncated_powers() {
    let open = || Shape::Curve(Curve { from: 10.0, to: 60.0, intervals: 5, closed: false });
    // Beyond its ends a curve is constant.
    for (q, position) in [(10.0, 0.0), (22.5, 1.25), (37.0, 2.7), (59.9, 4.99), (-20.0, 0.0)] {
        let expected: Vec<f64> = (0..8).map(|j| cardinal(position - j as f64 + 3.0)).collect();
        near(&bases("X", open(), here(q)), &expected);
    }
    for at in [60.0, 80.0] {
        near(&bases("X", open(), here(at)), &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0]);
    }
    let closed = || Shape::Curve(Curve { from: 0.0, to: 60.0, intervals: 6, closed: true });
    for q in [0.0_f64, 13.0, 59.0, 73.0, -47.0] {
        let position = (q / 10.0).rem_euclid(6.0);
        let turns = |j: i32| (-1..=1).map(move |turn| f64::from(j + 6 * turn));
        let expected: Vec<f64> = (0..6).map(|j| turns(j).map(|j| cardinal(position - j + 3.0)).sum()).collect();
        near(&bases("X", closed(), here(q)), &expected);
    }
}

/// One effect of each shape on a machine with a rotary axis; the components include an instrument parameter and a
/// delay.
pub fn every_shape() -> Vec<Effect> {
    let polynomial = |degree, scale| Shape::Polynomial(Polynomial { degree, scale });
    let local = Shape::Local(Local { centre: 0.5, width: 0.4, recurs: Some(TAU) });
    vec![
        effect("EZC", "C", Shape::Harmonic(Harmonic { order: 2.0 })),
        effect("EXC", "C", Shape::Periodic(Periodic { period: 0.3 })),
        effect("EXC", "C", Shape::Triangle(Triangle { period: 0.7 })),
        effect("EAC", "C", Shape::Spectrum(Spectrum::of_turn(2))),
        effect("EYX", "X", Shape::Spectrum(Spectrum { orders: 2, period: 150.0 })),
        effect("EYC", "C", polynomial(2, PI)),
        effect("EX0C", "temperature", polynomial(1, 1.0)),
        effect("EY0C", "time", Shape::Drift),
        effect("EBC", "C", Shape::Backlash),
        effect("ECC", "C", Shape::Lag),
        effect("EAC", "C", Shape::ReversalSpike(ReversalSpike { width: 0.1 })),
        effect("EZC", "C", Shape::Steps(Steps { at: vec![-1.0, 1.0] })),
        effect("EXC", "C", local),
        effect("EBC", "gravity", polynomial(1, 1.0)),
        effect("EYX", "X", Shape::Power(Power { degree: 3, scale: 100.0 })),
        effect("bar", "time", Shape::Warmup(Warmup { tau_s: 900.0 })),
        effect("workpiece_ball.x", "temperature", polynomial(1, 1.0)),
        effect("gain", "temperature", polynomial(1, 1.0)),
        effect("trigger", "none", Shape::Constant),
    ]
}

/// A curve, which is printed as code only.
pub fn curve() -> Effect {
    let shape = Shape::Curve(Curve { from: 0.0, to: TAU, intervals: 4, closed: true });
    effect("EYC", "C", shape)
}

/// A bar between balls at stated positions.
#[derive(Clone, Copy)]
pub struct Bar;

impl Source for Bar {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        let zero = N::constant(0.0);
        Subject::Station(Station::BallBar(BallBar {
            workpiece_ball: Target::on_table([zero, length("R"), N::constant(20.0)]),
            spindle_ball: Target::on_tool([zero; 3]),
            bar: length("R"),
        }))
    }
}

#[test]
fn every_form_is_confirmed_with_every_shape() {
    let machine = Machine::from_code("w C b X t").expect("a code");
    let errors: Vec<ErrorName> = ErrorName::parse("EX0X").into_iter().collect();
    for order in [Order::Exact, Order::Bilinear, Order::First] {
        let mut options = Options { order, gradient: order != Order::Bilinear, ..with(every_shape()) };
        for curved in [false, true] {
            options.effects.extend(curved.then(curve));
            let equation = Equation::of(&machine, &Bar, &errors, &options).expect("an equation");
            let checked = check(&equation, &Bar).expect("agreement");
            assert!(checked.agreement.points == 40 && checked.agreement.largest() < 1e-12);
            for language in LANGUAGES {
                let for_readers = matches!(language.audience, Audience::Readers | Audience::Authors);
                match language.print(&checked, &Style::default()) {
                    Ok(text) => assert!(!(text.contains("NaN") || curved && for_readers), "{text}"),
                    Err(refused) => {
                        let message = refused.to_string();
                        assert!(curved && for_readers, "{message}");
                        assert!(message.contains("`EYC~C:curve`") && message.contains("rust, c, python"), "{message}");
                    }
                }
            }
        }
    }
}

#[test]
fn an_equation_names_driven_errors_and_their_drivers() {
    let machine = Machine::from_code("w C b X t").expect("a code");
    let effects = vec![
        effect("EZC", "C", Shape::Harmonic(Harmonic { order: 2.0 })),
        effect("bar", "time", Shape::Warmup(Warmup { tau_s: 900.0 })),
    ];
    let equation = Equation::of(&machine, &Bar, &[], &with(effects)).expect("an equation");
    let text = printed(&equation, &Bar, "text");
    for line in [
        "errors as functions of drivers\n",
        "  e_zc  = k_1·cos(2·θ_c) + k_2·sin(2·θ_c)\n",
        "  δ_bar = k_3·(1 − exp(−t/900))\n",
        " − δ_bar\n",
        "harmonic coefficient (EZC~C:h2.sin)",
        "time since the first reading of the session",
    ] {
        assert!(text.contains(line), "`{line}` is not in\n{text}");
    }
    let latex = printed(&equation, &Bar, "latex");
    assert!(latex.contains("e_{zc} &= k_{1} \\cos(2 \\theta_{c}) + k_{2} \\sin(2 \\theta_{c})"), "{latex}");
}

/// A first-order harmonic in X and Y of C is confounded with the eccentricity of the ball: the same column twice.
#[test]
fn an_effect_confounded_with_a_location_error_is_marked() {
    let machine = Machine::from_code("w C b X t").expect("a code");
    let options = Options { order: Order::First, ..with(vec![effect("EX0C", "none", Shape::Constant)]) };
    let errors: Vec<ErrorName> = ErrorName::parse("EX0C").into_iter().collect();
    let equation = Equation::of(&machine, &Bar, &errors, &options).expect("an equation");
    let text = printed(&equation, &Bar, "text");
    assert!(text.contains("k_1 is confounded with e_x0c"), "{text}");
}

#[test]
fn effects_without_a_closed_form_are_refused_by_name() {
    let machine = Machine::from_code("w C b X t").expect("a code");
    let refused = |effect: Effect| {
        let equation = Equation::of(&machine, &Bar, &[], &with(vec![effect]));
        equation.expect_err("no equation").to_string()
    };
    let long = Shape::Curve(Curve { from: 0.0, to: TAU, intervals: 200, closed: true });
    let message = refused(effect("EZC", "C", long));
    assert!(
        message.contains("EZC~C:curve") && message.contains("200") && message.contains("fewer intervals"),
        "{message}"
    );
    let message = refused(effect("EZA", "A", Shape::Backlash));
    assert!(message.contains("EZA~A:backlash") && message.contains("`A`"), "{message}");
    let message = refused(effect("tracker.x", "time", Shape::Drift));
    assert!(message.contains("tracker.x~time:drift"), "{message}");
    let message = refused(effect("bar", "gravity", Shape::Backlash));
    assert!(message.contains("cannot be written: gravity exerts no moment about \"bar\"; to omit it"), "{message}");
    let of_readings =
        Effect { component: Component::Reading("C150".to_string()), ..effect("EZC", "C", Shape::Constant) };
    let message = refused(of_readings);
    let wanted = "`reading[C150]~C:constant` cannot be written: it adds to the readings of C150 and is not part of \
                  the chain; to omit it";
    assert!(message.contains(wanted), "{message}");
    let twice = effect("EZC", "C", Shape::Backlash);
    let equation = Equation::of(&machine, &Bar, &[], &with(vec![twice.clone(), twice]));
    assert!(equation.is_err_and(|error| error.message.contains("named twice")));
}
