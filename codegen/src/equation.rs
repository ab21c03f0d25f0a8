//! An equation: what the chain yields for symbols, with everything that a printer or a reader needs beside it.

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::frames::Rotation;
use abbe_model::instrument::Station;

use crate::error::CodegenError;
use crate::program::{Input, Label, Naming, Program};
use crate::run::Run;
use crate::subject::{Source, Subject, ToolPoint};
use crate::symbol::{Arena, Operand, Symbol};
use crate::variable::{Symbols, Variable};
use crate::vectors::{self, NamedVector};

/// How far an equation goes in the errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// As the chain has it.
    #[default]
    Exact,
    /// Coordinates up to products of two errors (squares too, where the rotations are exact); a length is still their norm.
    Bilinear,
    /// The value without errors and a coefficient for each error.
    First,
}

/// What form an equation takes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// How far it goes in the errors.
    pub order: Order,
    /// How error angles rotate; `None` for the machine's own way.
    pub rotation: Option<Rotation>,
    /// Which names errors go by.
    pub symbols: Symbols,
    /// Whether code comes with derivatives by every error.
    pub gradient: bool,
    /// The instrument's own unknowns that are carried, by their places in its list.
    pub unknowns: Vec<usize>,
}

/// What an equation is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The length of a ball bar.
    Length,
    /// Three coordinates that an instrument reads.
    Coordinates,
    /// The error vector of the tool in the table frame.
    Volumetric,
}

/// The closed form of one reading of one machine.
#[derive(Debug)]
pub struct Equation {
    /// The machine, with the rotation form that the equation has.
    pub machine: Machine,
    /// What form it takes.
    pub options: Options,
    /// What it is of.
    pub kind: Kind,
    /// Where its expressions live.
    pub arena: Arena,
    /// The errors and instrument unknowns that it is written in.
    pub parameters: Vec<Variable>,
    /// The coordinates of the reading as the chain has them.
    pub exact: Vec<Operand>,
    /// The vectors on the way there.
    pub vectors: Vec<NamedVector>,
}

impl Equation {
    /// The equation of a reading in the named errors; other errors are exact zeros.
    ///
    /// # Errors
    /// If the machine lacks the axis of an error, or the instrument an unknown.
    pub fn of(
        machine: &Machine,
        source: &impl Source,
        errors: &[ErrorName],
        options: &Options,
    ) -> Result<Equation, CodegenError> {
        let mut machine = machine.clone();
        machine.rotation = options.rotation.unwrap_or(machine.rotation);
        let arena = Arena::new();
        let known = source.subject(&|name: &str| arena.length(name)).unknowns();
        let mut parameters: Vec<Variable> = errors.iter().cloned().map(Variable::Error).collect();
        for place in &options.unknowns {
            let unknown = known.get(*place).ok_or_else(|| CodegenError::NoSuchUnknown {
                unknown: format!("number {place}"),
            })?;
            parameters.push(Variable::Unknown(*unknown));
        }
        let (kind, exact, vectors) = {
            let run = Run::<Symbol<'_>>::new(
                &machine,
                source,
                &parameters,
                &|variable| arena.variable(variable),
                &|place| arena.variable(parameters[place].clone()),
            )?;
            let kind = match run.subject {
                Subject::Station(Station::BallBar(_)) => Kind::Length,
                Subject::Station(_) => Kind::Coordinates,
                Subject::Volumetric { .. } => Kind::Volumetric,
            };
            let exact: Vec<Operand> = run.read().into_iter().map(Symbol::operand).collect();
            let vectors = vectors::of_subject(&run.subject, &machine, &run.state, &run.errors, &|slot| {
                run.unknown(slot)
            });
            (kind, exact, vectors)
        };
        Ok(Equation {
            machine,
            options: options.clone(),
            kind,
            arena,
            parameters,
            exact,
            vectors,
        })
    }

    /// The error vector of the tool in the table frame, over the whole workspace.
    ///
    /// # Errors
    /// If the machine lacks the axis of an error.
    pub fn volumetric(
        machine: &Machine,
        errors: &[ErrorName],
        options: &Options,
    ) -> Result<Equation, CodegenError> {
        Equation::of(machine, &ToolPoint, errors, options)
    }

    /// The arguments of its programs in their order: lengths, positions of moving axes from workpiece to tool (a rotary axis by sine and
    /// cosine), then errors and instrument unknowns as they were asked for.
    pub fn inputs(&self) -> Vec<Input> {
        let variables = self.arena.variables();
        let lengths = variables.iter().filter(|v| matches!(v, Variable::Length(_)));
        let mut inputs: Vec<Input> = lengths.cloned().map(Input::Plain).collect();
        for axis in &self.machine.axes {
            let position = Variable::Position {
                axis: axis.name.clone(),
                kind: axis.kind,
            };
            if variables.contains(&position) {
                match axis.kind {
                    AxisKind::Linear => inputs.push(Input::Plain(position)),
                    AxisKind::Rotary => {
                        inputs.push(Input::Sine(position.clone()));
                        inputs.push(Input::Cosine(position));
                    }
                }
            }
        }
        inputs.extend(self.parameters.iter().cloned().map(Input::Plain));
        inputs
    }

    /// The derivatives of each output by each parameter, output by output.
    pub fn gradients(&self) -> Vec<Vec<Operand>> {
        let parameters = self.parameter_operands();
        let gradient = |output: &Operand| self.arena.gradient(*output, &parameters);
        self.exact.iter().map(gradient).collect()
    }

    /// The steps that compute the reading and, with `gradient`, its derivatives by every parameter, output by output.
    pub fn program(&self, gradient: bool) -> Program {
        let mut outputs = self.exact.clone();
        let mut vectors = self.vectors.clone();
        if gradient {
            let parameters = self.parameter_operands();
            for output in &self.exact {
                let adjoints = self.arena.adjoints(*output, &parameters);
                outputs.extend(parameters.iter().map(|parameter| adjoints.of(*parameter)));
                if self.kind == Kind::Length {
                    vectors.extend(vectors::adjoint_vectors(&self.vectors, &adjoints));
                }
            }
        }
        let mut labels = vectors::labels(&vectors);
        if let (Kind::Length, Operand::Node(id)) = (self.kind, self.exact[0]) {
            labels.insert(id, Label::Scalar("length"));
        }
        self.arena
            .program(self.inputs(), &outputs, &labels, Naming::Shared)
    }

    /// The operands of the parameters.
    pub fn parameter_operands(&self) -> Vec<Operand> {
        let operand = |variable: &Variable| self.arena.variable(variable.clone()).operand();
        self.parameters.iter().map(operand).collect()
    }
}
