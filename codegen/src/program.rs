//! Conversion of an expression graph to a sequence of named steps, the input of every printer.

use std::collections::HashMap;

use crate::symbol::{Arena, Binary, Node, NodeId, Operand, Unary, operands};
use crate::tree::Tree;
use crate::variable::Variable;

/// An argument of a program: a variable, or the sine or cosine of an axis position, which is computed once per data
/// set.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// A variable itself.
    Plain(Variable),
    /// The sine of an axis position.
    Sine(Variable),
    /// The cosine of an axis position.
    Cosine(Variable),
}

impl Input {
    /// The variable, or the angle of the sine or cosine.
    pub fn variable(&self) -> &Variable {
        match self {
            Input::Plain(variable) | Input::Sine(variable) | Input::Cosine(variable) => variable,
        }
    }
}

/// The name of a step.
#[derive(Clone, Debug, PartialEq)]
pub enum Label {
    /// A coordinate of a named vector.
    Vector {
        /// The letter: `p`.
        letter: &'static str,
        /// The frame of its coordinates; empty if it needs none.
        frame: String,
        /// Whether the frame's own error is not yet applied; printed with a prime.
        prime: bool,
        /// 0, 1, 2.
        coordinate: usize,
    },
    /// A named scalar: the length.
    Scalar(&'static str),
    /// An error or instrument parameter that effects determine.
    Quantity(Variable),
    /// A common subexpression without a physical meaning.
    Temporary(usize),
}

/// One step: a name and its expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Its name.
    pub label: Label,
    /// Its expression in inputs and earlier steps.
    pub value: Tree,
}

/// A program: inputs, steps, outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// The inputs in a fixed order: lengths, axis positions, errors, instrument parameters.
    pub inputs: Vec<Input>,
    /// The steps in order.
    pub steps: Vec<Step>,
    /// The outputs.
    pub outputs: Vec<Tree>,
}

/// Which subexpressions become steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Naming {
    /// Those with a name and those used more than once: for code.
    Shared,
    /// Only those with a name: for readers.
    Labelled,
}

struct Builder<'a> {
    arena: &'a Arena,
    inputs: &'a [Input],
    places: HashMap<NodeId, usize>,
}

impl Builder<'_> {
    /// The input that a node represents, if any.
    fn input(&self, id: NodeId) -> Option<usize> {
        let input = match self.arena.node(id) {
            Node::Variable(variable) => Input::Plain(self.arena.variable_at(variable)),
            Node::Unary(function @ (Unary::Sin | Unary::Cos), a) => {
                let Some(Node::Variable(variable)) = self.arena.node_of(a) else {
                    return None;
                };
                let variable = self.arena.variable_at(variable);
                match function {
                    Unary::Sin => Input::Sine(variable),
                    _ => Input::Cosine(variable),
                }
            }
            _ => return None,
        };
        self.inputs.iter().position(|known| *known == input)
    }

    fn tree(&self, operand: Operand) -> Tree {
        match operand {
            Operand::Constant(constant) => Tree::Number(constant.value()),
            Operand::Node(id) => match (self.input(id), self.places.get(&id)) {
                (Some(input), _) => Tree::Input(input),
                (None, Some(step)) => Tree::Step(*step),
                (None, None) => self.expand(id),
            },
        }
    }

    fn expand(&self, id: NodeId) -> Tree {
        match self.arena.node(id) {
            // Every variable is an input; the caller lists them.
            Node::Variable(_) => Tree::Number(f64::NAN),
            Node::Unary(Unary::Neg, a) => match self.tree(a) {
                // −(x − y) is y − x if nothing else uses the difference.
                Tree::Binary(Binary::Sub, x, y) => Tree::Binary(Binary::Sub, y, x),
                a => Tree::Unary(Unary::Neg, Box::new(a)),
            },
            Node::Unary(op, a) => Tree::Unary(op, Box::new(self.tree(a))),
            Node::Binary(op, a, b) => Tree::Binary(op, Box::new(self.tree(a)), Box::new(self.tree(b))),
        }
    }
}

/// Number of operations of a program by kind; constants are not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Operations {
    /// Additions, subtractions and negations.
    pub sums: usize,
    /// Multiplications.
    pub products: usize,
    /// Divisions.
    pub quotients: usize,
    /// Square roots.
    pub roots: usize,
    /// Sines, cosines and other functions.
    pub functions: usize,
}

impl Operations {
    /// `+ − · / √`, without functions.
    pub fn arithmetic(&self) -> usize {
        self.sums + self.products + self.quotients + self.roots
    }

    fn count(&mut self, tree: &Tree) {
        match tree {
            Tree::Number(_) | Tree::Input(_) | Tree::Step(_) => {}
            Tree::Unary(function, a) => {
                match function {
                    Unary::Neg => self.sums += 1,
                    Unary::Sqrt => self.roots += 1,
                    _ => self.functions += 1,
                }
                self.count(a);
            }
            Tree::Binary(op, a, b) => {
                match op {
                    Binary::Add | Binary::Sub => self.sums += 1,
                    Binary::Mul => self.products += 1,
                    Binary::Div => self.quotients += 1,
                }
                self.count(a);
                self.count(b);
            }
        }
    }
}

impl Program {
    /// Derives the steps that compute `outputs`; `labels` gives the names of nodes.
    pub fn of(
        arena: &Arena,
        inputs: Vec<Input>,
        outputs: &[Operand],
        labels: &HashMap<NodeId, Label>,
        naming: Naming,
    ) -> Program {
        let nodes = arena.reachable(outputs);
        let mut uses: HashMap<NodeId, usize> = HashMap::new();
        let mut count = |operand: Operand| {
            if let Operand::Node(id) = operand {
                *uses.entry(id).or_default() += 1;
            }
        };
        outputs.iter().copied().for_each(&mut count);
        for id in &nodes {
            operands(arena.node(*id)).for_each(&mut count);
        }
        let mut builder = Builder { arena, inputs: &inputs, places: HashMap::new() };
        let mut steps = Vec::new();
        let mut temporaries = 0;
        for id in nodes {
            // An angle that enters only by its sine and cosine is not an input and is not computed.
            if builder.input(id).is_some() || matches!(arena.node(id), Node::Variable(_)) {
                continue;
            }
            let label = match labels.get(&id) {
                Some(label) => label.clone(),
                None if naming == Naming::Shared && uses[&id] > 1 => {
                    temporaries += 1;
                    Label::Temporary(temporaries)
                }
                None => continue,
            };
            let value = builder.expand(id);
            builder.places.insert(id, steps.len());
            steps.push(Step { label, value });
        }
        let outputs = outputs.iter().map(|output| builder.tree(*output)).collect();
        Program { inputs, steps, outputs }
    }

    /// Evaluates the outputs for values of the inputs.
    pub fn run(&self, inputs: &[f64]) -> Vec<f64> {
        let mut steps = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            let value = step.value.value(inputs, &steps);
            steps.push(value);
        }
        let value = |output: &Tree| output.value(inputs, &steps);
        self.outputs.iter().map(value).collect()
    }

    /// Number of operations of one evaluation.
    pub fn operations(&self) -> Operations {
        let mut operations = Operations::default();
        let values = self.steps.iter().map(|step| &step.value);
        values.chain(&self.outputs).for_each(|tree| operations.count(tree));
        operations
    }
}
