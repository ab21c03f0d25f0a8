//! Equations of instruments that read distances, directions, rotations and poses: printed code against dual numbers.

use abbe_codegen::error::NO_POLYNOMIAL;
use abbe_codegen::print::{LANGUAGES, Layout, Style};
use abbe_codegen::program::Input;
use abbe_codegen::{Equation, Options, Order, Source, Subject, Variable, check};
use abbe_model::axis::AxisKind;
use abbe_model::chain::{AxisPosition, Frame, Machine};
use abbe_model::component::ErrorName;
use abbe_model::document::composed as document;
use abbe_model::document::session::Parts;
use abbe_model::document::value::{Direction, Length, Three, Uncertainty};
use abbe_model::instrument::angle::Angle;
use abbe_model::instrument::column::Quantity;
use abbe_model::instrument::composed::{Composed, Composition, composed};
use abbe_model::instrument::distance::Distance;
use abbe_model::instrument::laser::Laser;
use abbe_model::instrument::measured::Place;
use abbe_model::instrument::pointing::Pointing;
use abbe_model::instrument::pose::Pose;
use abbe_model::instrument::stand::Stand;
use abbe_model::instrument::tracker::Tracker;
use abbe_model::instrument::{Geometry, InstrumentKind, Station, Target};
use abbe_model::rotation_error::Body;
use abbe_model::scalar::Nominal;
use num_dual::Dual64;
use rand::RngExt;

use crate::programs::Printed;
use crate::support;
use crate::topologies::{Case, all_errors, machine, short};

/// An instrument with its points anywhere.
#[derive(Clone, Copy, Debug)]
pub enum Any {
    Laser,
    Angle,
    Distance,
    Pointing,
    Polar,
    Pose,
    Composed,
}

const ALL: [Any; 7] = [Any::Laser, Any::Angle, Any::Distance, Any::Pointing, Any::Polar, Any::Pose, Any::Composed];

/// A stylus that touches a sphere, and its height above the centre along a direction of the tool.
fn composition() -> Composition {
    let texts = |names: &[&str]| names.iter().map(ToString::to_string).collect::<Vec<_>>();
    let at = Some(Three([0.0; 3].map(Length::Number)));
    let target = |name: &str, frame: &str| document::Target {
        name: name.into(),
        frame: Some(frame.into()),
        ..document::Target::default()
    };
    let parts = Parts {
        target: vec![
            document::Target { point_mm: at.clone(), ..target("stylus", "tool") },
            document::Target { point_mm: at, ..target("sphere", "table") },
            document::Target { direction: Some(Direction([0.0, 0.0, 1.0])), ..target("normal", "tool") },
            document::Target { length_mm: Some(Length::Number(15.5)), ..target("R", "table") },
        ],
        channel: vec![
            document::Channel {
                name: "contact".into(),
                distance: Some(texts(&["stylus", "sphere"])),
                less: texts(&["R"]),
                reading: Some(0.0),
                ..document::Channel::default()
            },
            document::Channel {
                name: "height".into(),
                along: Some(texts(&["stylus", "sphere", "normal"])),
                column: Some("height_um".into()),
                zero_u_um: Some(Uncertainty::unknown()),
                ..document::Channel::default()
            },
        ],
        ..Parts::default()
    };
    let machine = Machine::from_code("w C b X Z t").expect("a code");
    let composed = composed("composed".parse().expect("a kind"), &parts, &machine).expect("a composition");
    let (InstrumentKind::Composed(composition), _) = composed else { panic!("{composed:?}") };
    composition
}

impl Source for Any {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        let table = Target::on_table(["W_x", "W_y", "W_z"].map(length));
        let tool = Target::on_tool(["S_x", "S_y", "S_z"].map(length));
        let directions = [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]].map(|row| row.map(N::constant));
        let stand = || Stand { rotation: directions, origin: [250.0, -4000.0, 900.0].map(N::constant) };
        Subject::Station(match self {
            Any::Laser => {
                let mut laser = Laser {
                    reflector: tool,
                    optic: table,
                    frame: directions,
                    channels: Vec::new(),
                    is_beam_stated: false,
                    datum: N::constant(0.0),
                };
                laser.keep_channels(&|quantity| matches!(quantity, Quantity::Channel(_)));
                laser.into()
            }
            Any::Angle => Angle { about: directions[..2].to_vec(), body: Body::Relative }.into(),
            Any::Distance => Distance { station: table, reflector: tool }.into(),
            Any::Pointing => Pointing { directions, is_free: true }.into(),
            Any::Polar => Tracker { target: tool, stand: stand(), is_polar: true }.into(),
            Any::Pose => Pose { target: tool, stand: stand(), turn: None }.into(),
            Any::Composed => {
                let places = vec![
                    Place::Point(tool),
                    Place::Point(table),
                    Place::Direction(Frame::Tool, directions),
                    Place::Number(length("R")),
                    Place::Number(N::constant(0.0)),
                ];
                Composed { composition: composition(), places }.into()
            }
        })
    }
}

/// Every instrument on two machines, with all errors and all of its parameters at 1 mm and 0.01 rad.
pub fn printed(language: &str, layout: Layout, count: usize, random: &mut impl rand::Rng) -> Vec<Printed> {
    let mut printed = Vec::new();
    for (any, code) in ALL.into_iter().flat_map(|any| ["[wCXYbZBt]", "[wBAXYbZt]"].map(|code| (any, code))) {
        let machine = machine(code);
        let unknowns = (0..any.subject::<f64>(&|_| 0.0).unknowns().len()).collect();
        let options = Options { gradient: true, unknowns, ..Options::default() };
        let equation = Equation::of(&machine, &any, &all_errors(&machine), &options).expect("an equation");
        printed.push(Printed {
            name: format!("{any:?}_{}", short(code)).to_lowercase(),
            function: "coordinates",
            inputs: equation.program(false).inputs,
            cases: (0..count).map(|_| case(any, &machine, &equation, random)).collect(),
            text: support::laid_out(&equation, &any, language, layout),
        });
    }
    printed
}

/// Reading and derivatives by dual numbers at one state.
fn case(any: Any, machine: &Machine, equation: &Equation, random: &mut impl rand::Rng) -> Case {
    let positions: Vec<f64> = (machine.axes.iter())
        .map(|axis| if axis.kind == AxisKind::Linear { 300.0 } else { 3.0 })
        .map(|most| random.random_range(-most..most))
        .collect();
    let small: Vec<f64> = (equation.parameters.iter())
        .map(|parameter| if parameter.is_angle() { 0.01 } else { 1.0 })
        .map(|most| random.random_range(-most..most))
        .collect();
    let mut lengths: Vec<(String, f64)> = Vec::new();
    let mut arguments = [Vec::new(), Vec::new(), Vec::new()];
    for input in equation.program(false).inputs {
        let position = |variable: &Variable| match variable {
            Variable::Position { axis, .. } => positions[machine.axis_index(axis).expect("an axis")],
            other => panic!("{other:?} moves"),
        };
        match &input {
            Input::Sine(variable) => arguments[1].push(position(variable).sin()),
            Input::Cosine(variable) => arguments[1].push(position(variable).cos()),
            Input::Plain(Variable::Length(name)) => {
                lengths.push((name.clone(), random.random_range(-200.0..200.0)));
                arguments[0].extend(lengths.last().map(|(_, length)| *length));
            }
            Input::Plain(variable @ Variable::Position { .. }) => arguments[1].push(position(variable)),
            Input::Plain(variable) => {
                let index = equation.parameters.iter().position(|known| known == variable);
                arguments[2].push(small[index.expect("a parameter")]);
            }
        }
    }
    let length = |name: &str| lengths.iter().find(|(known, _)| known == name).map_or(0.0, |(_, length)| *length);
    let Subject::Station(station): Subject<f64> = any.subject(&length) else { panic!("a station") };
    let state: Vec<_> = machine.axes.iter().zip(&positions).map(|(axis, q)| AxisPosition::new(axis.kind, *q)).collect();
    let read = |seed: usize| {
        read(&station, machine, &state, equation, &|k| Dual64::new(small[k], if k == seed { 1.0 } else { 0.0 }))
    };
    let values: Vec<f64> = read(0).iter().map(|value| value.re).collect();
    let by_parameter: Vec<Vec<f64>> =
        (0..small.len()).map(|seed| read(seed).iter().map(|value| value.eps).collect()).collect();
    let gradient = (0..values.len()).flat_map(|output| by_parameter.iter().map(move |row| row[output])).collect();
    Case { arguments, values, gradient }
}

fn read(
    station: &Station<f64>,
    machine: &Machine,
    state: &[AxisPosition<f64>],
    equation: &Equation,
    small: &dyn Fn(usize) -> Dual64,
) -> Vec<Dual64> {
    let of = |wanted: &dyn Fn(&Variable) -> bool| equation.parameters.iter().position(wanted);
    let error = |slot: usize| {
        of(&|parameter| matches!(parameter, Variable::Error(name) if machine.error_slot(name) == Some(slot)))
    };
    let bodies = machine.body_errors(|slot| error(slot).is_some(), |slot| error(slot).map_or(Dual64::from(0.0), small));
    let unknowns = station.kind().unknowns();
    let unknown = |slot: usize| {
        of(&|parameter| matches!(parameter, Variable::Instrument(own) if *own == unknowns[slot])).map(small)
    };
    station.read(machine, state, &bodies, unknown).channels().to_vec()
}

/// Every language prints every instrument, exact and in first order where there is one, with one output for each channel under its name.
#[test]
fn every_language_prints_one_output_for_each_channel() {
    let machine = Machine::from_code("w C b X Z t").expect("a code");
    let errors: Vec<_> = ["EX0C", "ECC", "EBX"].iter().filter_map(|name| ErrorName::parse(name)).collect();
    for any in ALL {
        for order in [Order::Exact, Order::First] {
            let options = Options { order, ..Options::default() };
            let equation = match Equation::of(&machine, &any, &errors, &options) {
                // The printer has the first order of polynomials; a distance is a root, a bearing a quotient.
                Err(error) if order == Order::First && error.code == NO_POLYNOMIAL => continue,
                equation => equation.expect("an equation"),
            };
            let checked = check(&equation, &any).expect("agreement with dual numbers");
            for language in LANGUAGES {
                let text =
                    language.print(&checked, &Style::default()).unwrap_or_else(|fault| panic!("{any:?}: {fault}"));
                assert!(!text.is_empty());
            }
            let text = abbe_codegen::language("text").expect("a language").print(&checked, &Style::default()).unwrap();
            let Subject::Station(station): Subject<f64> = any.subject(&|_| 1.0) else { panic!("a station") };
            for channel in station.channels() {
                assert!(text.contains(&format!("m.{}", channel.name)), "{any:?}, {}: {text}", channel.name);
            }
        }
    }
}
