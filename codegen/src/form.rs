//! The form of an equation: what a caller requests, and what the form consists of.

use abbe_model::effect::Effect;
use abbe_model::frames::Rotation;

use crate::first_order::FirstOrder;
use crate::polynomial::Polynomial;
use crate::symbol::Unary;
use crate::tree::{Tree, sum, terms_of};
use crate::variable::Symbols;

/// Truncation order of an equation in the errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// No truncation.
    #[default]
    Exact,
    /// Coordinates up to products of two errors (and squares, for exact rotations); a length is the norm of these
    /// coordinates.
    Bilinear,
    /// The value without errors and a coefficient for each error.
    First,
}

/// How an equation is divided for readers. Code does not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Arrangement {
    /// The division that suits the order: named vectors frame by frame, coordinate groups, or a table of coefficients.
    #[default]
    Frames,
    /// One equation for the reading.
    Single,
    /// The coordinate groups, and the reading as a function of them.
    Groups,
}

impl Arrangement {
    /// The word by which it is requested.
    pub fn word(self) -> &'static str {
        match self {
            Arrangement::Frames => "frames",
            Arrangement::Single => "single",
            Arrangement::Groups => "groups",
        }
    }
}

/// The form of an equation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Truncation order in the errors.
    pub order: Order,
    /// How the equation is divided for readers.
    pub arrangement: Arrangement,
    /// Rotation convention of the error angles; `None` for that of the machine.
    pub rotation: Option<Rotation>,
    /// Naming convention of the errors.
    pub symbols: Symbols,
    /// Whether the derivatives by every error are included.
    pub gradient: bool,
    /// Parameters of the instrument that are included, by index in its list.
    pub unknowns: Vec<usize>,
    /// Effects that are included, with all their coefficients.
    pub effects: Vec<Effect>,
}

impl Options {
    /// The same in first order, without derivatives: its coefficients are the sensitivities.
    #[must_use]
    pub fn in_first_order(self) -> Options {
        let arrangement = match self.arrangement {
            Arrangement::Groups => Arrangement::Single,
            other => other,
        };
        Options { order: Order::First, gradient: false, arrangement, ..self }
    }
}

/// The quantity that an equation describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The length of a ball bar.
    Length,
    /// The distance from a probe to the surface of its artefact.
    Distance,
    /// Three coordinates measured by an instrument.
    Coordinates,
    /// The error vector of the tool in the table frame.
    Volumetric,
}

/// The content of an equation, by the requested order.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// The named vectors, and the outputs in terms of them.
    Exact,
    /// The coordinate groups of the bar vector as products of the matrices of the chain, without truncation.
    Factored(Vec<Tree>),
    /// The coordinate groups, grouped by error: the bar vector for a length, otherwise the coordinates themselves.
    Groups {
        /// The normal forms.
        polynomials: Vec<Polynomial>,
        /// The expressions as printed.
        printed: Vec<Tree>,
        /// Whether the truncation omitted nothing because the chain has no further terms. This is decided for up to
        /// twelve parameters. For more, the full normal form is not built and the value is false.
        complete: bool,
    },
    /// The value without errors and a coefficient for each error, with the printed expression of each.
    First(FirstOrder, PrintedFirstOrder),
}

/// The first-order form as printed.
#[derive(Clone, Debug, PartialEq)]
pub struct PrintedFirstOrder {
    /// The coordinates without errors; for a length, its square.
    pub nominal: Vec<Tree>,
    /// Sign of `L₀` and the offset added to it, if the reading without errors is not `L₀` itself.
    pub alternative_length: Option<(f64, Tree)>,
    /// The coefficients, parameter by parameter, coordinate by coordinate.
    pub coefficients: Vec<Vec<Tree>>,
    /// For a constant multiple of an earlier column: numerator and denominator of the factor.
    pub factors: Vec<Option<(Tree, Tree)>>,
}

impl PrintedFirstOrder {
    /// Replaces the root by the name `length`.
    pub(crate) fn with_named_length(&self, length: &Tree) -> PrintedFirstOrder {
        let root = Tree::Unary(Unary::Sqrt, Box::new(self.nominal[0].clone()));
        let named = |trees: &Vec<Tree>| trees.iter().map(|tree| tree.replaced(&root, length)).collect();
        PrintedFirstOrder { coefficients: self.coefficients.iter().map(named).collect(), ..self.clone() }
    }

    /// The reading without errors, from the length `L₀`.
    pub(crate) fn without_errors(&self, length: Tree) -> Tree {
        match &self.alternative_length {
            None => length,
            Some((sign, offset)) => {
                let mut terms = vec![(*sign < 0.0, length)];
                terms.extend(terms_of(offset));
                sum(terms)
            }
        }
    }
}
