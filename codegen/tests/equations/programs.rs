//! Equations to print, compile and run, and the values that their code must give: every topology of Table 1.1 at random
//! errors of 0.1 rad and 10 mm, value and gradient.

use abbe_codegen::print::Layout;
use abbe_codegen::program::Input;
use abbe_codegen::{Equation, Options, ToolPoint, Variable};
use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::driver::{Driver, DriverPart};
use abbe_model::frames::Rotation;
use rand::{RngExt, SeedableRng};

use crate::effects::{Bar, curve, every_shape};
use crate::operators::Batch;
use crate::support;
use crate::tools;
use crate::topologies::{AnyBar, CODES, Case, What, all_errors, cases, disagreement, machine, short};

/// Readings per equation.
pub const CASES: usize = 19;

/// One printed equation and its expected values.
pub struct Printed {
    pub name: String,
    pub function: &'static str,
    pub text: String,
    pub cases: Vec<Case>,
    /// The inputs to which the arguments of the cases belong.
    pub inputs: Vec<Input>,
}

impl Printed {
    /// The arguments of a case by name: lengths and parameters by their names, positions with their unit.
    pub fn named(&self, case: &Case) -> Vec<(String, f64)> {
        let values = case.arguments.concat();
        let mut named = Vec::new();
        for (index, (input, value)) in self.inputs.iter().zip(&values).enumerate() {
            let name = match input {
                Input::Sine(Variable::Position { axis, .. }) => {
                    named.push((format!("{axis}_rad"), value.atan2(values[index + 1])));
                    continue;
                }
                Input::Sine(_) | Input::Cosine(_) => continue,
                Input::Plain(Variable::Position { axis, kind }) => match kind {
                    AxisKind::Linear => format!("{axis}_mm"),
                    AxisKind::Rotary => continue,
                },
                Input::Plain(Variable::Driver(quantity)) => quantity.identifier.clone(),
                Input::Plain(Variable::Coefficient(coefficient)) => format!("k_{}", coefficient.number),
                Input::Plain(variable) => variable.name().replace('.', "_"),
            };
            named.push((name, *value));
        }
        named
    }

    /// Number of arguments by name that are errors, instrument parameters or coefficients.
    pub fn errors(&self) -> usize {
        self.cases[0].arguments[2].len()
    }
}

/// The equations of every topology, of operators, of effects and of probes, in a language.
pub fn all(language: &str) -> Vec<Printed> {
    laid_out(language, Layout::Flat)
}

/// As [`all`], with arguments as arrays or by name.
pub fn laid_out(language: &str, layout: Layout) -> Vec<Printed> {
    let mut random = rand_pcg::Pcg64::seed_from_u64(11);
    let mut printed = Vec::new();
    for code in CODES {
        let machine = machine(code);
        let errors = all_errors(&machine);
        for what in [What::Bar, What::Volumetric] {
            let options = Options { gradient: true, rotation: Some(Rotation::Exact), ..Options::default() };
            let equation = match what {
                What::Bar => Equation::of(&machine, &AnyBar, &errors, &options),
                What::Volumetric => Equation::volumetric(&machine, &errors, &options),
            };
            let equation = equation.expect("an equation");
            let (kind, function, text) = match what {
                What::Bar => ("bar", "bar_length", support::laid_out(&equation, &AnyBar, language, layout)),
                What::Volumetric => {
                    ("vol", "volumetric_error", support::laid_out(&equation, &ToolPoint, language, layout))
                }
            };
            printed.push(Printed {
                name: format!("{kind}_{}", short(code)),
                function,
                text,
                inputs: equation.program(false).inputs,
                cases: cases(what, &machine, &errors, CASES, &mut random),
            });
        }
    }
    printed.extend(operators(language, layout, &mut random));
    printed.push(effects(language, layout, &mut random));
    let probes = crate::probe::printed(language, layout, CASES, &mut random);
    printed.extend(probes.into_iter().map(|(name, text, cases, inputs)| Printed {
        name,
        function: "probe_distance",
        text,
        cases,
        inputs,
    }));
    // The other languages print the same operations.
    if ["c", "python"].contains(&language) {
        printed.extend(crate::instruments::printed(language, layout, CASES, &mut random));
    }
    printed
}

/// Compound operands under every operator: three coordinates, each shifted by one of three errors.
fn operators(language: &str, layout: Layout, random: &mut impl rand::Rng) -> Vec<Printed> {
    let machine = Machine::from_code("w b X t").expect("a code");
    let errors: Vec<ErrorName> = ["EXX", "EYX", "EZX"].iter().filter_map(|name| ErrorName::parse(name)).collect();
    let options = Options { gradient: true, ..Options::default() };
    let mut printed = Vec::new();
    for batch in Batch::all() {
        let equation = Equation::of(&machine, &batch, &errors, &options).expect("an equation");
        let cases = (0..CASES).map(|_| {
            let lengths: [f64; 4] = std::array::from_fn(|_| random.random_range(50.0..150.0));
            let (x, small) = (random.random_range(-100.0..100.0), [0.5, -2.0, 7.0]);
            let ball = batch.coordinates(lengths);
            Case {
                arguments: [lengths.to_vec(), vec![x], small.to_vec()],
                values: vec![ball[0] + small[0] + x, ball[1] + small[1], ball[2] + small[2]],
                gradient: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            }
        });
        printed.push(Printed {
            name: format!("operators_{}", batch.0),
            function: "coordinates",
            inputs: equation.program(false).inputs,
            text: support::laid_out(&equation, &batch, language, layout),
            cases: cases.collect(),
        });
    }
    printed
}

/// A bar with an effect of every shape, against the program that dual numbers confirmed.
fn effects(language: &str, layout: Layout, random: &mut impl rand::Rng) -> Printed {
    let machine = Machine::from_code("w C b X t").expect("a code");
    let options =
        Options { gradient: true, effects: every_shape().into_iter().chain([curve()]).collect(), ..Options::default() };
    let errors: Vec<ErrorName> = ErrorName::parse("EX0C").into_iter().collect();
    let equation = Equation::of(&machine, &Bar, &errors, &options).expect("an equation");
    let program = equation.program(true);
    let cases = (0..CASES).map(|_| {
        let angle = random.random_range(-3.0..3.0_f64);
        let mut arguments = [Vec::new(), Vec::new(), Vec::new()];
        for input in &program.inputs {
            let (group, value) = match input {
                Input::Sine(_) => (1, angle.sin()),
                Input::Cosine(_) => (1, angle.cos()),
                Input::Plain(variable) => match variable {
                    Variable::Length(_) => (0, random.random_range(90.0..110.0)),
                    Variable::Position { axis, .. } if axis == "C" => (1, angle),
                    Variable::Position { .. } => (1, random.random_range(-150.0..-50.0)),
                    Variable::Driver(quantity) if quantity.part == DriverPart::Direction => {
                        (1, if random.random() { 1.0 } else { -1.0 })
                    }
                    Variable::Driver(quantity) if quantity.driver == Driver::Time => {
                        (1, random.random_range(0.0..4000.0))
                    }
                    Variable::Driver(quantity) if quantity.part == DriverPart::SinceReversal => {
                        (1, random.random_range(0.0..0.5))
                    }
                    Variable::Driver(_) => (1, random.random_range(-2.0..2.0)),
                    _ => (2, random.random_range(-0.1..0.1)),
                },
            };
            arguments[group].push(value);
        }
        let found = program.run(&arguments.concat());
        Case { arguments, values: found[..1].to_vec(), gradient: found[1..].to_vec() }
    });
    Printed {
        name: "effects".to_string(),
        function: "bar_length",
        inputs: equation.program(false).inputs,
        cases: cases.collect(),
        text: support::laid_out(&equation, &Bar, language, layout),
    }
}

/// Compares values and gradients of the cases with rows of numbers, twice: one reading at a time, then in columns.
fn compare(printed: &Printed, single: &str, columns: &str) {
    for text in [single, columns] {
        let worst = disagreement(&printed.cases, &tools::rows(text), true);
        assert!(worst <= 1e-12, "{}: {worst:e}", printed.name);
    }
}

/// Numbers of lengths, axes, errors, values and derivatives.
pub fn sizes(printed: &Printed) -> [usize; 5] {
    let case = &printed.cases[0];
    let [lengths, axes, errors] = &case.arguments;
    [lengths.len(), axes.len(), errors.len(), case.values.len(), case.gradient.len()]
}

/// The arguments of the cases, a line each.
pub fn points(printed: &Printed) -> String {
    let row = |case: &Case| tools::line(case.arguments.concat());
    printed.cases.iter().map(|case| row(case) + "\n").collect()
}

/// Compares the output of all printed equations: rows, the word `columns`, rows, the word `next`.
pub fn check_all(all: &[Printed], output: &str) {
    let parts: Vec<&str> = output.split("next\n").collect();
    assert_eq!(parts.len(), all.len() + 1);
    for (printed, part) in all.iter().zip(parts) {
        let (single, columns) = part.split_once("columns\n").expect("two parts");
        compare(printed, single, columns);
    }
}
