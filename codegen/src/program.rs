//! From an expression graph to a sequence of named steps: what every printer prints.

use std::collections::HashMap;

use crate::symbol::{Arena, Binary, Node, NodeId, Operand, Unary, operands};
use crate::variable::Variable;

/// An expression as it will stand on one line.
#[derive(Clone, Debug, PartialEq)]
pub enum Tree {
    /// A number.
    Number(f64),
    /// An input, by its place in [`Program::inputs`].
    Input(usize),
    /// An earlier step, by its place in [`Program::steps`].
    Step(usize),
    /// A function of one operand.
    Unary(Unary, Box<Tree>),
    /// An operation on two operands.
    Binary(Binary, Box<Tree>, Box<Tree>),
}

impl Tree {
    /// Whether an input stands in it.
    pub(crate) fn holds(&self, input: usize) -> bool {
        match self {
            Tree::Input(place) => *place == input,
            Tree::Number(_) | Tree::Step(_) => false,
            Tree::Unary(_, a) => a.holds(input),
            Tree::Binary(_, a, b) => a.holds(input) || b.holds(input),
        }
    }

    /// How many names and numbers stand in it.
    pub(crate) fn leaves(&self) -> usize {
        match self {
            Tree::Number(_) | Tree::Input(_) | Tree::Step(_) => 1,
            Tree::Unary(_, a) => a.leaves(),
            Tree::Binary(_, a, b) => a.leaves() + b.leaves(),
        }
    }

    /// With one expression in the place of another, wherever that stands.
    pub(crate) fn replaced(&self, what: &Tree, by: &Tree) -> Tree {
        if self == what {
            return by.clone();
        }
        let inner = |tree: &Tree| Box::new(tree.replaced(what, by));
        match self {
            Tree::Number(_) | Tree::Input(_) | Tree::Step(_) => self.clone(),
            Tree::Unary(function, a) => Tree::Unary(*function, inner(a)),
            Tree::Binary(op, a, b) => Tree::Binary(*op, inner(a), inner(b)),
        }
    }

    fn value(&self, inputs: &[f64], steps: &[f64]) -> f64 {
        match self {
            Tree::Number(value) => *value,
            Tree::Input(place) => inputs[*place],
            Tree::Step(place) => steps[*place],
            Tree::Unary(function, a) => function.of(a.value(inputs, steps)),
            Tree::Binary(op, a, b) => op.of(a.value(inputs, steps), b.value(inputs, steps)),
        }
    }
}

/// An argument of a program: a variable, or the sine or cosine of an axis position, which is taken once a data set.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// A variable itself.
    Plain(Variable),
    /// The sine of an axis position.
    Sine(Variable),
    /// The cosine of an axis position.
    Cosine(Variable),
}

/// The name of a step.
#[derive(Clone, Debug, PartialEq)]
pub enum Label {
    /// A coordinate of a named vector.
    Vector {
        /// The letter: `p`.
        letter: &'static str,
        /// The frame it is given in; empty where it needs none.
        frame: String,
        /// Whether the frame's own error is still to be applied: printed with a prime.
        prime: bool,
        /// 0, 1, 2.
        coordinate: usize,
    },
    /// A quantity with a name of its own: the length.
    Scalar(&'static str),
    /// An error or instrument unknown that effects make up.
    Quantity(Variable),
    /// A common subexpression without a meaning of its own.
    Temporary(usize),
}

/// One step: a name and how it is computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// What it is called.
    pub label: Label,
    /// How it is computed from inputs and earlier steps.
    pub value: Tree,
}

/// Inputs, steps, outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// What goes in, in a fixed order: lengths, axis positions, errors, instrument unknowns.
    pub inputs: Vec<Input>,
    /// What is computed, in order.
    pub steps: Vec<Step>,
    /// What comes out.
    pub outputs: Vec<Tree>,
}

/// Which subexpressions get a step of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Naming {
    /// Those that have a name and those used more than once: for a compiler.
    Shared,
    /// Only those that have a name: for a reader.
    Labelled,
}

struct Builder<'a> {
    arena: &'a Arena,
    inputs: &'a [Input],
    places: HashMap<NodeId, usize>,
}

impl Builder<'_> {
    /// The input that a node is, if it is one.
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
            // Every variable is an input; the arena's caller lists them.
            Node::Variable(_) => Tree::Number(f64::NAN),
            Node::Unary(Unary::Neg, a) => match self.tree(a) {
                // −(x − y) is y − x where the difference is nobody else's.
                Tree::Binary(Binary::Sub, x, y) => Tree::Binary(Binary::Sub, y, x),
                a => Tree::Unary(Unary::Neg, Box::new(a)),
            },
            Node::Unary(op, a) => Tree::Unary(op, Box::new(self.tree(a))),
            Node::Binary(op, a, b) => Tree::Binary(op, Box::new(self.tree(a)), Box::new(self.tree(b))),
        }
    }
}

/// Operations of a program by kind; constants cost nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Operations {
    /// Additions, subtractions and changes of sign.
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
    /// The steps that compute `outputs`. `labels` names nodes by what they are.
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
        let mut builder = Builder {
            arena,
            inputs: &inputs,
            places: HashMap::new(),
        };
        let mut steps = Vec::new();
        let mut temporaries = 0;
        for id in nodes {
            // An angle whose sine and cosine are the inputs is itself none, and is not computed either.
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
        Program {
            inputs,
            steps,
            outputs,
        }
    }

    /// The outputs for the values of the inputs.
    pub fn run(&self, inputs: &[f64]) -> Vec<f64> {
        let mut steps = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            let value = step.value.value(inputs, &steps);
            steps.push(value);
        }
        let value = |output: &Tree| output.value(inputs, &steps);
        self.outputs.iter().map(value).collect()
    }

    /// How many operations one run takes.
    pub fn operations(&self) -> Operations {
        let mut operations = Operations::default();
        let values = self.steps.iter().map(|step| &step.value);
        values
            .chain(&self.outputs)
            .for_each(|tree| operations.count(tree));
        operations
    }
}
