//! Tests of the probe's reading against geometry with 4 × 4 matrices: the intersection of the probing line with the
//! cylinder, found by bisection.

use abbe_codegen::print::{Layout, Style};
use abbe_codegen::program::Input;
use abbe_codegen::{Equation, Options, Order, Source, Subject, Variable, check};
use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::instrument::{Station, Target, probe::Probe};
use abbe_model::scalar::Nominal;
use nalgebra::{Matrix4, Rotation3, Vector3, Vector4};
use rand::{RngExt, SeedableRng};

use crate::support;
use crate::topologies::Case;

/// A cylinder on the table and a probe that moves straight towards it, or in a stated direction.
#[derive(Clone, Copy)]
pub struct Touch {
    pub stated: bool,
}

const LENGTHS: [(&str, f64); 8] =
    [("A_x", 3.0), ("A_y", -2.0), ("A_z", 30.0), ("R", 45.0), ("S_x", 1.5), ("S_y", -4.0), ("S_z", 25.0), ("D", 70.0)];
/// Position of the probe that moves in a stated direction.
const HELD: [(&str, f64); 2] = [("Y", -8.0), ("Z", -7.0)];
const STATED: [f64; 3] = [-0.96, 0.28, 0.0];
const TILTED: [f64; 3] = [0.28, 0.0, 0.96];

impl Touch {
    fn axis(self) -> [f64; 3] {
        if self.stated { [0.0, 0.0, 1.0] } else { TILTED }
    }

    pub fn machine(self) -> Machine {
        let code = if self.stated { "w C b X Y Z t" } else { "w C A b X Y Z t" };
        let mut machine = Machine::from_code(code).expect("a code");
        for axis in &mut machine.axes {
            if axis.kind == AxisKind::Rotary {
                // In a stated direction the probe hits the cylinder only if the table does not carry it away.
                axis.origin_mm = if self.stated { [1.0, -3.5, 41.25] } else { [12.5, -30.0, 41.25] };
            }
        }
        machine
    }
}

impl Source for Touch {
    fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
        Subject::Station(Station::Probe(Probe {
            artefact: Target::on_table(["A_x", "A_y", "A_z"].map(length)),
            axis: self.axis().map(N::constant),
            radius: length("R"),
            stylus: Target::on_tool(["S_x", "S_y", "S_z"].map(length)),
            direction: self.stated.then(|| STATED.map(N::constant)),
        }))
    }

    fn held<N: Nominal>(&self, axis: &str, length: &impl Fn(&str) -> N, _: &impl Fn(&str) -> N) -> Option<N> {
        let held = || HELD.iter().find(|(name, _)| *name == axis);
        match axis {
            "X" if self.stated => Some(length("D")),
            _ if self.stated => held().map(|(_, value)| N::constant(*value)),
            _ => None,
        }
    }

    fn length_mm(&self, name: &str) -> Option<f64> {
        LENGTHS.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
    }
}

pub fn errors(machine: &Machine) -> Vec<ErrorName> {
    let names = ["EX0C", "EY0C", "EA0C", "EB0C", "EXC", "ECC", "EY0A", "EB0A", "EC0A", "EXX", "EBX", "EC0Y", "EAZ"];
    let names = names.iter().filter_map(|name| ErrorName::parse(name));
    names.filter(|name| machine.axis_index(&name.axis).is_some()).collect()
}

fn options(order: Order) -> Options {
    Options { order, gradient: true, unknowns: (0..11).collect(), ..Options::default() }
}

/// Positions of the axes in the machine's order, and errors in the equation's order.
struct State {
    lengths: Vec<(String, f64)>,
    positions: Vec<f64>,
    small: Vec<f64>,
}

impl State {
    fn length(&self, name: &str) -> f64 {
        self.lengths.iter().find(|(known, _)| known == name).expect("a length").1
    }

    /// The arguments of a program, in its order and its three groups.
    fn arguments(&self, machine: &Machine, inputs: &[Input], parameters: &[Variable]) -> [Vec<f64>; 3] {
        let mut groups = [Vec::new(), Vec::new(), Vec::new()];
        let position = |variable: &Variable| match variable {
            Variable::Position { axis, .. } => self.positions[machine.axis_index(axis).expect("an axis")],
            other => panic!("{other:?} moves"),
        };
        for input in inputs {
            match input {
                Input::Sine(variable) => groups[1].push(position(variable).sin()),
                Input::Cosine(variable) => groups[1].push(position(variable).cos()),
                Input::Plain(Variable::Length(name)) => groups[0].push(self.length(name)),
                Input::Plain(variable @ Variable::Position { .. }) => groups[1].push(position(variable)),
                Input::Plain(variable) => {
                    let index = parameters.iter().position(|known| known == variable);
                    groups[2].push(self.small[index.expect("a parameter")]);
                }
            }
        }
        groups
    }
}

fn shift(by: Vector3<f64>) -> Matrix4<f64> {
    Matrix4::new_translation(&by)
}

fn turn(axis: Vector3<f64>, angle: f64) -> Matrix4<f64> {
    Rotation3::new(axis * angle).to_homogeneous()
}

/// `Trans · Rx · Ry · Rz`.
fn six(error: [f64; 6]) -> Matrix4<f64> {
    let [x, y, z, a, b, c] = error;
    shift(Vector3::new(x, y, z)) * turn(Vector3::x(), a) * turn(Vector3::y(), b) * turn(Vector3::z(), c)
}

/// Distance from the stylus to the intersection of the probing line with the cylinder, mm.
fn geometry(touch: Touch, parameters: &[Variable], point: &State) -> f64 {
    let machine = touch.machine();
    let error = |axis: &str, kind: ErrorKind| -> [f64; 6] {
        let mut six = [0.0; 6];
        for (parameter, value) in parameters.iter().zip(&point.small) {
            if let Variable::Error(name) = parameter
                && name.axis == axis
                && name.kind == kind
            {
                six[name.freedom.index()] = *value;
            }
        }
        six
    };
    let unknown = |thing: &str, coordinate: &str| {
        let pairs = parameters.iter().zip(&point.small);
        let found = pairs.filter_map(|(parameter, value)| match parameter {
            Variable::Instrument(u) if u.thing == thing && u.coordinate == coordinate => Some(*value),
            _ => None,
        });
        found.sum::<f64>()
    };
    let matrix = |index: usize, with_errors: bool| {
        let axis = &machine.axes[index];
        let (d, o) = (Vector3::from(axis.direction), Vector3::from(axis.origin_mm));
        let [location, motion] = [ErrorKind::Location, ErrorKind::Motion].map(|kind| match with_errors {
            true => error(&axis.name, kind),
            false => [0.0; 6],
        });
        let q = point.positions[index];
        match axis.kind {
            AxisKind::Rotary => shift(o) * six(location) * six(motion) * turn(d, q) * shift(-o),
            AxisKind::Linear => {
                let tilt = Vector3::new(location[3], location[4], location[5]).cross(&d);
                shift(o + (d + tilt) * q) * six(motion) * shift(-o)
            }
        }
    };
    // From the bed outwards on either side.
    let table = |with_errors: bool| {
        let outwards = (0..machine.workpiece_side).rev();
        outwards.fold(Matrix4::identity(), |t, index| t * matrix(index, with_errors))
    };
    let tool = |with_errors: bool| {
        let outwards = machine.workpiece_side..machine.axes.len();
        outwards.fold(Matrix4::identity(), |t, index| t * matrix(index, with_errors))
    };
    let transformed = |t: Matrix4<f64>, p: Vector3<f64>| (t * Vector4::new(p.x, p.y, p.z, 1.0)).xyz();
    let vector = |names: [&str; 3]| Vector3::from(names.map(|name| point.length(name)));
    let (artefact, stylus) = (vector(["A_x", "A_y", "A_z"]), vector(["S_x", "S_y", "S_z"]));
    let axis = Vector3::from(touch.axis());
    let direction = if touch.stated {
        Vector3::from(STATED)
    } else {
        let foot = transformed(table(false), artefact);
        let along = transformed(table(false), artefact + axis) - foot;
        let inward = foot - transformed(tool(false), stylus);
        (inward - along * inward.dot(&along)).normalize()
    };
    let off = Vector3::from(["x", "y", "z"].map(|k| unknown("stylus", k)));
    let start = transformed(tool(true), stylus + off);
    let pose = six(["x", "y", "z", "a", "b", "c"].map(|k| unknown("artefact", k)));
    let to_artefact = (table(true) * shift(artefact) * pose).try_inverse().expect("a motion");
    let radius = point.length("R") + unknown("radius", "") + unknown("form", "");
    let beyond = |t: f64| {
        let p = transformed(to_artefact, start + direction * t);
        (p - axis * p.dot(&axis)).norm() - radius
    };
    // The distance from the axis is convex along the line. Ternary search finds its minimum, bisection the crossing
    // before it.
    let (mut low, mut high) = (-2000.0, 2000.0);
    for _ in 0..200 {
        let third = (high - low) / 3.0;
        if beyond(low + third) < beyond(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    let (mut outside, mut inside) = (low - 3000.0, low);
    if beyond(inside) > 0.0 {
        return f64::NAN;
    }
    for _ in 0..100 {
        let middle = 0.5 * (outside + inside);
        if beyond(middle) > 0.0 {
            outside = middle;
        } else {
            inside = middle;
        }
    }
    inside
}

fn point(touch: Touch, parameters: &[Variable], size: [f64; 2], random: &mut impl rand::Rng) -> State {
    let lengths: Vec<(String, f64)> =
        LENGTHS.iter().map(|(name, value)| (name.to_string(), value * random.random_range(0.9..1.1))).collect();
    let position = |axis: &abbe_model::axis::Axis, random: &mut dyn FnMut(f64, f64) -> f64| match axis.kind {
        AxisKind::Rotary => random(-3.0, 3.0),
        AxisKind::Linear if !touch.stated => random(60.0, 150.0),
        AxisKind::Linear => match HELD.iter().find(|(name, _)| *name == axis.name) {
            Some((_, value)) => *value,
            None => lengths[7].1,
        },
    };
    let mut draw = |low: f64, high: f64| random.random_range(low..high);
    let machine = touch.machine();
    let positions: Vec<f64> = machine.axes.iter().map(|axis| position(axis, &mut draw)).collect();
    let small = parameters.iter().map(|parameter| {
        let size = size[usize::from(parameter.is_angle())];
        draw(-size, size)
    });
    let small: Vec<f64> = small.collect();
    State { lengths, positions, small }
}

fn equation(touch: Touch, order: Order) -> Equation {
    let machine = touch.machine();
    let equation = Equation::of(&machine, &touch, &errors(&machine), &options(order)).expect("an equation");
    check(&equation, &touch).expect("agreement");
    equation
}

#[test]
fn the_exact_form_is_the_intersection_of_line_and_cylinder() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(21);
    for stated in [false, true] {
        let touch = Touch { stated };
        let equation = equation(touch, Order::Exact);
        let program = equation.program(false);
        let mut met = 0;
        for _ in 0..40 {
            let point = point(touch, &equation.parameters, [2.0, 0.02], &mut random);
            let arguments = point.arguments(&equation.machine, &program.inputs, &equation.parameters);
            let found = program.run(&arguments.concat())[0];
            let expected = geometry(touch, &equation.parameters, &point);
            assert_eq!(found.is_finite(), expected.is_finite());
            if expected.is_finite() {
                met += 1;
                assert!((found - expected).abs() < 1e-8, "{found} {expected}");
            }
        }
        assert!(met >= 30, "{met}");
    }
}

/// Central differences of the geometry, with steps of 1 µm and 1e-5 rad.
#[test]
fn the_first_order_is_the_slope_of_the_geometry() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(22);
    for stated in [false, true] {
        let touch = Touch { stated };
        let equation = equation(touch, Order::First);
        let program = equation.program(true);
        for _ in 0..10 {
            let mut point = point(touch, &equation.parameters, [0.0001, 0.0001], &mut random);
            point.small.fill(0.0);
            let arguments = point.arguments(&equation.machine, &program.inputs, &equation.parameters);
            let found = program.run(&arguments.concat());
            assert!((found[0] - geometry(touch, &equation.parameters, &point)).abs() < 1e-8);
            for (index, parameter) in equation.parameters.iter().enumerate() {
                let step = if parameter.is_angle() { 1e-5 } else { 1e-3 };
                let mut at = |value: f64| {
                    point.small[index] = value;
                    geometry(touch, &equation.parameters, &point)
                };
                let slope = (at(step) - at(-step)) / (2.0 * step);
                at(0.0);
                let scale = slope.abs().max(1.0);
                assert!(
                    (found[1 + index] - slope).abs() < 1e-5 * scale,
                    "{}: {} {slope}",
                    parameter.name(),
                    found[1 + index]
                );
            }
        }
    }
}

/// The distance is exact to second order in `v` and `u`: a tenth of the errors gives a thousandth of the deviation.
#[test]
fn the_bilinear_form_deviates_by_third_order() {
    let touch = Touch { stated: false };
    let equation = equation(touch, Order::Bilinear);
    let program = equation.program(false);
    let mut random = rand_pcg::Pcg64::seed_from_u64(23);
    for _ in 0..10 {
        let mut point = point(touch, &equation.parameters, [1.0, 0.01], &mut random);
        let mut off = |scale: f64| {
            let small = point.small.clone();
            point.small.iter_mut().for_each(|e| *e *= scale);
            let arguments = point.arguments(&equation.machine, &program.inputs, &equation.parameters);
            let off = program.run(&arguments.concat())[0] - geometry(touch, &equation.parameters, &point);
            point.small = small;
            off.abs()
        };
        let (whole, tenth) = (off(1.0), off(0.1));
        assert!(whole < 0.05 && tenth < whole.mul_add(3e-3, 1e-8), "{whole:e} {tenth:e}");
    }
}

#[test]
fn a_direction_that_the_table_tilts_away_from_has_no_first_order() {
    struct Oblique;
    impl Source for Oblique {
        fn subject<N: Nominal>(&self, length: &impl Fn(&str) -> N) -> Subject<N> {
            Touch { stated: true }.subject(length)
        }
        fn length_mm(&self, name: &str) -> Option<f64> {
            Touch { stated: true }.length_mm(name)
        }
    }
    let machine = Machine::from_code("w C A b X Y Z t").expect("a code");
    let refused = Equation::of(&machine, &Oblique, &errors(&machine)[..2], &options(Order::First));
    assert!(matches!(&refused, Err(error) if error.message.contains("probing `direction`")), "{refused:?}");
}

/// Printed code to compile and run: every language, with the values that dual numbers confirmed to 1e-12.
pub fn printed(
    language: &str,
    layout: Layout,
    count: usize,
    random: &mut impl rand::Rng,
) -> Vec<(String, String, Vec<Case>, Vec<Input>)> {
    let mut printed = Vec::new();
    for stated in [false, true] {
        let touch = Touch { stated };
        let equation = equation(touch, Order::Exact);
        let program = equation.program(true);
        let mut cases = Vec::new();
        while cases.len() < count {
            let point = point(touch, &equation.parameters, [5.0, 0.05], random);
            let arguments = point.arguments(&equation.machine, &program.inputs, &equation.parameters);
            let found = program.run(&arguments.concat());
            // Near the edge of the artefact rounding errors grow without bound.
            if found.iter().all(|value| value.is_finite() && value.abs() < 300.0) {
                cases.push(Case { arguments, values: found[..1].to_vec(), gradient: found[1..].to_vec() });
            }
        }
        let text = support::laid_out(&equation, &touch, language, layout);
        printed.push((format!("probe_{}", usize::from(stated)), text, cases, equation.program(false).inputs));
    }
    printed
}

/// Every form, for the engines that typeset them.
pub fn fragments(language: &str, style: &Style) -> Vec<String> {
    let mut fragments = Vec::new();
    for stated in [false, true] {
        for order in [Order::Exact, Order::Bilinear, Order::First] {
            let touch = Touch { stated };
            let machine = touch.machine();
            let options = Options { gradient: order == Order::First, ..options(order) };
            let equation = Equation::of(&machine, &touch, &errors(&machine), &options).expect("an equation");
            let checked = check(&equation, &touch).expect("agreement with dual numbers");
            let language = abbe_codegen::language(language).expect("a language");
            fragments.push(language.print(&checked, style).expect("a page"));
        }
    }
    fragments
}
