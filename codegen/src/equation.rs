//! Closed-form equation of a reading: the symbolic result of the chain, with everything that the printers need.

use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::effect::Shape;
use abbe_model::instrument::channel::{self, Channel};

use crate::coefficient::Coefficient;
use crate::error;
use crate::factored;
use crate::form::{Arrangement, Form, Kind, Options, Order};
use crate::program::{Input, Label, Naming, Program};
use crate::run::{self, Run};
use crate::subject::{Source, Subject, ToolPoint};
use crate::symbol::{Arena, NodeId, Operand, Symbol, length};
use crate::touch::ProbeTerms;
use crate::truncation::{self, FormContext};
use crate::variable::Variable;
use crate::vectors::{self, NamedVector};

/// The closed form of one reading of one machine, as data; [`mod@crate::check`] compares it with the chain before it is
/// printed.
#[derive(Debug)]
pub struct Equation {
    /// The machine, with the rotation convention of the equation.
    pub machine: Machine,
    /// The form of the equation.
    pub options: Options,
    /// The quantity that it describes.
    pub kind: Kind,
    /// The arena that owns its expressions.
    pub arena: Arena,
    /// The errors, instrument parameters and effect coefficients that it contains.
    pub parameters: Vec<Variable>,
    /// The coordinates of the reading without truncation.
    pub exact: Vec<Operand>,
    /// The coordinates of the reading in the requested form.
    pub outputs: Vec<Operand>,
    /// The name of each: x, y, z of a vector, or the channel.
    pub names: Vec<&'static str>,
    /// The unit of each, mm or rad.
    pub units: Vec<&'static str>,
    /// The requested form.
    pub form: Form,
    /// The name of the test, if it has one.
    pub name: Option<String>,
    /// The named lengths whose meaning is known.
    pub meanings: Vec<(String, String)>,
    /// The axes that the test holds and that stay symbols, with their positions, mm or rad.
    pub held: Vec<(Variable, f64)>,
    /// The intermediate vectors.
    pub vectors: Vec<NamedVector>,
    /// The driven errors: errors and instrument parameters that are determined by effects alone, as functions of their
    /// drivers.
    pub driven_errors: Vec<(Variable, Operand)>,
    /// The stated length of the bar, for a ball bar.
    pub stated_length: Option<Operand>,
    /// The length error of the bar and the gain error of its sensor, if included.
    pub(crate) bar_parameters: [Option<Operand>; 2],
    /// The quantities between the vectors of a probe and its reading, for a probe.
    pub touch: Option<ProbeTerms>,
    /// Basis functions that are kept as they are and never expanded.
    pub(crate) whole: Vec<Operand>,
}

impl Equation {
    /// Derives the equation of a reading in the named errors; other errors are exactly zero.
    ///
    /// # Errors
    /// If the machine lacks the axis of an error, if the instrument lacks a parameter, or if the form has no closed
    /// polynomial.
    pub fn of(
        machine: &Machine,
        source: &impl Source,
        errors: &[ErrorName],
        options: &Options,
    ) -> Result<Equation, Diagnostic> {
        let mut machine = machine.clone();
        machine.rotation = options.rotation.unwrap_or(machine.rotation);
        let arena = Arena::new();
        let parameters = parameters(&arena, &machine, source, errors, options)?;
        let run =
            Run::<Symbol<'_>>::new(&machine, source, &parameters, &|variable| arena.variable(variable), &|index| {
                arena.variable(parameters[index].clone())
            })?;
        let kind = match &run.subject {
            subject if subject.bar().is_some() => Kind::Length,
            subject if subject.probe().is_some() => Kind::Distance,
            Subject::Station(_) => Kind::Coordinates,
            Subject::Volumetric { .. } => Kind::Volumetric,
        };
        let exact: Vec<Operand> = run.read().into_iter().map(Symbol::operand).collect();
        let mut vectors =
            vectors::of_subject(&run.subject, &machine, &run.state, &run.errors, &|slot| run.unknown(slot));
        let on_the_way = vectors.clone();
        let inputs = inputs(&arena, &machine, &parameters);
        let held = held(&machine, source);
        let positions: Vec<Variable> = held.iter().map(|(position, _)| position.clone()).collect();
        let symbol = |index: usize| arena.variable(parameters[index].clone());
        let driven_errors = run.driven_errors(&symbol).into_iter();
        let driven_errors = driven_errors.map(|(variable, value)| (variable, value.operand())).collect();
        let bar_parameters = run.bar_parameters().map(|unknown| unknown.map(Symbol::operand));
        let whole = curves(&run, &parameters);
        let written =
            FormContext { arena: &arena, inputs: &inputs, parameters: &parameters, whole: &whole, held: &positions };
        let (outputs, form) = match options.order {
            Order::Exact if options.arrangement == Arrangement::Frames => (exact.clone(), Form::Exact),
            Order::Exact => {
                let bar = vectors.last().map_or([Operand::constant(0.0); 3], |bar| bar.components);
                (exact.clone(), Form::Factored(factored::groups(&run, bar, options.arrangement, &written)?))
            }
            Order::First if options.arrangement == Arrangement::Groups => {
                let why = "does not exist in first order; use the form frames or single".to_string();
                return Err(error::no_form("groups", why));
            }
            Order::Bilinear => truncation::bilinear(&run, &exact, &mut vectors, &written)?,
            Order::First => truncation::first(&run, &exact, &mut vectors, &written)?,
        };
        let stated_length = run.subject.bar().map(|bar| bar.bar.operand());
        let (names, units) = match run.subject.station().map(|station| station.map(|_| 0.0_f64)) {
            Some(station) if !channel::are_vector(station.channels()) => {
                let unit = |channel: &Channel| if channel.is_angle() { "rad" } else { "mm" };
                station.channels().iter().map(|channel| (channel.name, unit(channel))).unzip()
            }
            _ => (vec!["x", "y", "z"], vec!["mm"; 3]),
        };
        let touch = run.probe_geometry().map(|geometry| match vectors.as_slice() {
            [.., stylus, step] if options.order == Order::Bilinear => {
                let groups: Vec<Symbol<'_>> = [stylus, step]
                    .iter()
                    .flat_map(|vector| vector.components.map(|component| arena.symbol(component)))
                    .collect();
                ProbeTerms::of(&run::with_groups(&geometry, &groups), &on_the_way)
            }
            _ => ProbeTerms::of(&geometry, &on_the_way),
        });
        drop(run);
        let lengths = arena.variables().into_iter().filter(|variable| matches!(variable, Variable::Length(_)));
        let meanings = lengths.filter_map(|length| Some((length.name(), source.meaning(&length.name())?))).collect();
        Ok(Equation {
            machine,
            options: options.clone(),
            kind,
            arena,
            parameters,
            exact,
            outputs,
            form,
            name: source.name().map(str::to_string),
            meanings,
            held,
            vectors,
            driven_errors,
            stated_length,
            names,
            units,
            bar_parameters,
            touch,
            whole,
        })
    }

    /// Derives the error vector of the tool in the table frame, over the whole workspace.
    ///
    /// # Errors
    /// If the machine lacks the axis of an error.
    pub fn volumetric(machine: &Machine, errors: &[ErrorName], options: &Options) -> Result<Equation, Diagnostic> {
        Equation::of(machine, &ToolPoint, errors, options)
    }

    /// The arguments of its programs in order. First come the lengths and the positions of moving axes from workpiece
    /// to tool. A rotary axis is given by sine and cosine, and by its angle if an effect depends on that. Then come the
    /// other drivers of effects, then errors, instrument parameters and coefficients in the requested order.
    pub fn inputs(&self) -> Vec<Input> {
        inputs(&self.arena, &self.machine, &self.parameters)
    }

    /// The derivatives of each output by each parameter, output by output.
    pub fn gradients(&self) -> Vec<Vec<Operand>> {
        let parameters = self.parameter_operands();
        let gradient = |output: &Operand| self.arena.gradient(*output, &parameters);
        self.outputs.iter().map(gradient).collect()
    }

    /// The second derivatives of each output by each pair of parameters: output, row, column. They serve curvature
    /// terms of an error budget and solvers with Newton steps. Printed code contains first derivatives only.
    pub fn second_derivatives(&self) -> Vec<Vec<Vec<Operand>>> {
        let parameters = self.parameter_operands();
        let second = |output: &Operand| self.arena.second_derivatives(*output, &parameters);
        self.outputs.iter().map(second).collect()
    }

    /// The steps that compute the reading and, with `gradient`, its derivatives by every parameter, output by output. A
    /// length on which no output depends is no input of it.
    pub fn program(&self, gradient: bool) -> Program {
        let mut outputs = self.outputs.clone();
        let mut vectors = self.vectors.clone();
        if gradient {
            let parameters = self.parameter_operands();
            for output in &self.outputs {
                let adjoints = self.arena.adjoints(*output, &parameters);
                outputs.extend(parameters.iter().map(|parameter| adjoints.of(*parameter)));
                if self.kind == Kind::Length {
                    vectors.extend(vectors::adjoint_vectors(&self.vectors, &adjoints));
                }
            }
        }
        let mut labels = vectors::labels(&vectors);
        labels.extend(self.driven_labels());
        if let (Some(touch), false) = (&self.touch, self.options.order == Order::First) {
            labels.extend(touch.labels());
        }
        if let (Kind::Length | Kind::Distance, Operand::Node(id)) = (self.kind, self.outputs[0]) {
            labels.insert(id, Label::Scalar("reading"));
        }
        let used = self.arena.variables_of(&self.outputs);
        let used: Vec<Variable> = used.into_iter().map(|id| self.arena.variable_at(id)).collect();
        let is_needed = |input: &Input| match input.variable() {
            length @ Variable::Length(_) => used.contains(length),
            _ => true,
        };
        let inputs = self.inputs().into_iter().filter(is_needed).collect();
        Program::of(&self.arena, inputs, &outputs, &labels, Naming::Shared)
    }

    /// The names of the driven errors, which effects determine.
    pub(crate) fn driven_labels(&self) -> impl Iterator<Item = (NodeId, Label)> {
        let label = |(variable, value): &(Variable, Operand)| match value {
            Operand::Node(id) => Some((*id, Label::Quantity(variable.clone()))),
            Operand::Constant(_) => None,
        };
        self.driven_errors.iter().filter_map(label)
    }

    /// The operands of the parameters.
    pub fn parameter_operands(&self) -> Vec<Operand> {
        let operand = |variable: &Variable| self.arena.variable(variable.clone()).operand();
        self.parameters.iter().map(operand).collect()
    }
}

/// The basis functions of curves; expanded interval by interval they have hundreds of terms.
fn curves(run: &Run<'_, Symbol<'_>>, parameters: &[Variable]) -> Vec<Operand> {
    let of_curve = |parameter: &Variable| match parameter {
        Variable::Coefficient(coefficient) => matches!(coefficient.effect.shape, Shape::Curve { .. }),
        _ => false,
    };
    let places = (0..parameters.len()).filter(|index| of_curve(&parameters[*index]));
    places.flat_map(|index| run.bases(index)).map(Symbol::operand).collect()
}

/// The requested errors, instrument parameters and effect coefficients.
fn parameters(
    arena: &Arena,
    machine: &Machine,
    source: &impl Source,
    errors: &[ErrorName],
    options: &Options,
) -> Result<Vec<Variable>, Diagnostic> {
    let known = source.subject(&|name: &str| length(arena, name)).unknowns();
    let mut parameters: Vec<Variable> = errors.iter().cloned().map(Variable::Error).collect();
    for index in &options.unknowns {
        let unknown = known.get(*index).ok_or_else(|| error::no_parameter(format!("number {index}")))?;
        parameters.push(Variable::Instrument(*unknown));
    }
    let coefficients = Coefficient::of_effects(&options.effects, machine, known)?;
    parameters.extend(coefficients.into_iter().map(Variable::Coefficient));
    // Naming them here fixes their order wherever terms are sorted.
    for (index, parameter) in parameters.iter().enumerate() {
        if parameters[..index].contains(parameter) {
            return Err(error::twice(parameter.name()));
        }
        arena.variable(parameter.clone());
    }
    Ok(parameters)
}

/// The axes that stay symbols although the test holds them.
fn held(machine: &Machine, source: &impl Source) -> Vec<(Variable, f64)> {
    let held = machine.axes.iter().filter_map(|axis| {
        let position = Variable::Position { axis: axis.name.clone(), kind: axis.kind };
        Some((position, source.held_symbol(&axis.name)?))
    });
    held.collect()
}

fn inputs(arena: &Arena, machine: &Machine, parameters: &[Variable]) -> Vec<Input> {
    let variables = arena.variables();
    let lengths = variables.iter().filter(|v| matches!(v, Variable::Length(_)));
    let mut inputs: Vec<Input> = lengths.cloned().map(Input::Plain).collect();
    for axis in &machine.axes {
        let position = Variable::Position { axis: axis.name.clone(), kind: axis.kind };
        if variables.contains(&position) {
            match axis.kind {
                AxisKind::Linear => inputs.push(Input::Plain(position)),
                AxisKind::Rotary => {
                    inputs.push(Input::Sine(position.clone()));
                    inputs.push(Input::Cosine(position.clone()));
                    if arena.is_used_directly(&position) {
                        inputs.push(Input::Plain(position));
                    }
                }
            }
        }
    }
    let drivers = variables.iter().filter(|v| matches!(v, Variable::Driver(_)));
    inputs.extend(drivers.cloned().map(Input::Plain));
    inputs.extend(parameters.iter().cloned().map(Input::Plain));
    inputs
}
