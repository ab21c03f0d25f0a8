//! Tests of second derivatives against central differences of the dual-number gradient at large random errors.

use abbe_codegen::evaluate::evaluate;
use abbe_codegen::{Equation, Options, Source, Subject, Variable, VariableValue};
use abbe_model::chain::{AxisPosition, Machine};
use abbe_model::component::ErrorName;
use abbe_model::frames::Rotation;
use abbe_model::instrument::{Station, Target, socket::Socket, stand::Stand, tracker::Tracker};
use abbe_model::scalar::Nominal;
use num_dual::{Derivative, DualSVec64};
use rand::{RngExt, SeedableRng};

use crate::support::{Chapter5, eight, hermle};
use crate::topologies::{AnyBar, machine};

type Pack = DualSVec64<8>;

#[derive(Clone, Copy)]
struct AnyTracker;

impl Source for AnyTracker {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        Subject::Station(Station::Tracker(Tracker {
            target: Target::on_tool([length("S_x"), length("S_y"), length("S_z")]),
            stand: Stand {
                rotation: [[0.6, 0.8, 0.0], [0.0, 0.0, 1.0], [0.8, -0.6, 0.0]].map(|row| row.map(N::constant)),
                origin: [250.0, -40.0, 900.0].map(N::constant),
            },
            is_polar: false,
        }))
    }
}

#[derive(Clone, Copy)]
struct AnySocket;

impl Source for AnySocket {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        Subject::Station(Station::Socket(Socket {
            ball: Target::on_tool([length("S_x"), length("S_y"), length("S_z")]),
            socket: [400.0, 100.0, 60.0].map(N::constant),
            is_located: true,
        }))
    }
}

/// Values of all variables.
struct State {
    lengths: Vec<(String, f64)>,
    positions: Vec<(String, f64)>,
    small: Vec<f64>,
}

fn draw(equation: &Equation, random: &mut impl rand::Rng) -> State {
    let mut point = State { lengths: Vec::new(), positions: Vec::new(), small: Vec::new() };
    for variable in equation.arena.variables() {
        match &variable {
            Variable::Length(name) => {
                point.lengths.push((name.clone(), random.random_range(-200.0..200.0)));
            }
            Variable::Position { axis, .. } => {
                let size = if variable.is_angle() { 3.0 } else { 300.0 };
                point.positions.push((axis.clone(), random.random_range(-size..size)));
            }
            Variable::Error(_) | Variable::Instrument(_) | Variable::Driver(_) | Variable::Coefficient(_) => {}
        }
    }
    point.small = equation
        .parameters
        .iter()
        .map(|parameter| {
            let size = if parameter.is_angle() { 0.1 } else { 10.0 };
            random.random_range(-size..size)
        })
        .collect();
    point
}

fn named(values: &[(String, f64)], name: &str) -> f64 {
    let found = values.iter().find(|(known, _)| known == name);
    found.map_or(0.0, |(_, value)| *value)
}

/// The gradient by dual numbers through the model's chain: output, parameter.
fn gradient(source: &impl Source, machine: &Machine, errors: &[ErrorName], at: &State) -> Vec<Vec<f64>> {
    let length = |name: &str| named(&at.lengths, name);
    let subject = source.subject(&length);
    let state: Vec<_> = machine
        .axes
        .iter()
        .map(|axis| {
            let held = source.held(&axis.name, &length, &length);
            AxisPosition::new(axis.kind, held.unwrap_or_else(|| named(&at.positions, &axis.name)))
        })
        .collect();
    let index = |slot: usize| errors.iter().position(|name| machine.error_slot(name) == Some(slot));
    let mut gradient: Vec<Vec<f64>> = Vec::new();
    for start in (0..errors.len()).step_by(8) {
        let seeded = |i: usize| {
            let mut seed = nalgebra::SVector::<f64, 8>::zeros();
            if (start..start + 8).contains(&i) {
                seed[i - start] = 1.0;
            }
            Pack::new(at.small[i], Derivative::some(seed))
        };
        let bodies = machine
            .body_errors(|slot| index(slot).is_some(), |slot| index(slot).map_or_else(|| Pack::from(0.0), seeded));
        let read = subject.read(machine, &state, &bodies, |_| None);
        gradient.resize(read.len(), Vec::new());
        for (row, value) in gradient.iter_mut().zip(read) {
            let slopes = value.eps.unwrap_generic(nalgebra::Const::<8>, nalgebra::Const::<1>);
            row.extend((start..errors.len().min(start + 8)).map(|k| slopes[k - start]));
        }
    }
    gradient
}

fn agrees(what: &str, source: &impl Source, machine: &Machine, errors: &[ErrorName]) {
    let equation = Equation::of(machine, source, errors, &Options::default()).expect("an equation");
    let second = equation.second_derivatives();
    let mut random = rand_pcg::Pcg64::seed_from_u64(17);
    for _ in 0..5 {
        let mut point = draw(&equation, &mut random);
        let value = |variable: &Variable| {
            VariableValue::<f64>::Nominal(match variable {
                Variable::Length(name) => named(&point.lengths, name),
                Variable::Position { axis, .. } => named(&point.positions, axis),
                small => {
                    let index = equation.parameters.iter().position(|known| known == small);
                    index.map_or(f64::NAN, |index| point.small[index])
                }
            })
        };
        let found: Vec<Vec<Vec<f64>>> = second
            .iter()
            .map(|rows| rows.iter().map(|row| evaluate(&equation.arena, row, value).expect("numbers")).collect())
            .collect();
        for (k, parameter) in equation.parameters.iter().enumerate() {
            // The error of a central difference is h²/6 of the third derivative plus rounding over h.
            let step = if parameter.is_angle() { 1e-5 } else { 1e-3 };
            let here = point.small[k];
            point.small[k] = here + step;
            let above = gradient(source, machine, errors, &point);
            point.small[k] = here - step;
            let below = gradient(source, machine, errors, &point);
            point.small[k] = here;
            for output in 0..found.len() {
                let scale = found[output].iter().flatten().fold(1.0_f64, |most, x| most.max(x.abs()));
                for l in 0..errors.len() {
                    let difference = (above[output][l] - below[output][l]) / (2.0 * step);
                    let own = found[output][l][k];
                    assert!(
                        (own - difference).abs() <= 1e-7 * scale,
                        "{what}: output {output}, {} and {}: {own:e}, by differences {difference:e}",
                        errors[l],
                        errors[k]
                    );
                    // Reverse accumulation twice, in either order, gives the same value to rounding.
                    assert!((own - found[output][k][l]).abs() <= 1e-10 * scale);
                }
            }
        }
    }
}

fn errors(names: &[&str]) -> Vec<ErrorName> {
    names.iter().map(|name| ErrorName::parse(name).expect("a name")).collect()
}

#[test]
fn second_derivatives_agree_with_differences_of_dual_numbers() {
    for rotation in [Rotation::Exact, Rotation::SmallAngle] {
        let bar = Chapter5 { extended: true };
        agrees("chapter 5", &bar, &hermle(rotation), &eight());
    }
    // One error of each kind, for axes on either side of the bed and of every kind.
    let table = errors(&["EX0C", "EB0C", "EC0A", "EAA", "EZC", "EC0X", "EBY", "EZZ"]);
    for code in ["[wCAXYbZt]", "[wXYbZCAt]", "[wCXYbZAt]"] {
        agrees(code, &AnyBar, &machine(code), &table);
        agrees(code, &AnyTracker, &machine(code), &table);
    }
    let mut robot = Machine::from_code("w b C B A t").expect("a code");
    robot.axes[1].origin_mm = [0.0, 25.0, 127.0];
    robot.axes[1].direction = [0.0, -1.0, 0.0];
    robot.axes[2].origin_mm = [-612.0, 0.0, 127.0];
    let joints = errors(&["EX0C", "EB0C", "ECC", "EZ0B", "EA0B", "EBB", "EYA", "EC0A"]);
    agrees("robot", &AnyTracker, &robot, &joints);
    agrees("robot", &AnySocket, &robot, &joints);
}
