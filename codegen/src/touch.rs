//! Quantities of a probe's reading: the stylus `v` and a step `u` in the probing direction, both perpendicular to the
//! artefact's axis, and the radius.
//!
//! ```text
//! a = u·u,   b = v·u,   c = v·v − r²,   d = −l_n·(b + √(b² − a·c))/a
//! ```
//!
//! `l_n` is the length of the step in R; it is 1 for a stated direction. The sign of the root selects the nearer of the
//! two intersections for every artefact that is hit, so that no case distinction is necessary.

use abbe_model::instrument::probe::ProbeGeometry;

use crate::program::Label;
use crate::symbol::{NodeId, Operand, Symbol};
use crate::vectors::NamedVector;

/// The named quantities between the vectors of a probe and its reading.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeTerms {
    /// `a`, `b`, `c`.
    pub quadratic: [Operand; 3],
    /// `r`: the radius of the artefact including the stylus radius and its errors.
    pub radius: Operand,
    /// `l_n`.
    pub step_length: Option<Operand>,
    /// The step in R, which has the length `l_n`.
    pub step: Option<NamedVector>,
}

/// The length of a step, named alike in every language.
pub(crate) const STEP_LENGTH: Label = Label::Scalar("l_n");
/// The coefficients of the quadratic equation.
pub(crate) const QUADRATIC: [Label; 3] = [Label::Scalar("a"), Label::Scalar("b"), Label::Scalar("c")];

impl ProbeTerms {
    /// From stylus and step in the frame of the artefact, and the intermediate vectors.
    pub(crate) fn of(geometry: &ProbeGeometry<Symbol<'_>>, vectors: &[NamedVector]) -> Self {
        ProbeTerms {
            quadratic: geometry.quadratic().map(Symbol::operand),
            radius: geometry.radius.operand(),
            step_length: geometry.step_length.map(Symbol::operand),
            step: vectors.iter().find(|vector| vector.letter == "n").cloned(),
        }
    }

    /// The names of the computed quantities.
    pub(crate) fn labels(&self) -> impl Iterator<Item = (NodeId, Label)> {
        let step = self.step_length.map(|length| (length, STEP_LENGTH));
        let named = self.quadratic.into_iter().zip(QUADRATIC).chain(step);
        named.filter_map(|(operand, label)| match operand {
            Operand::Node(id) => Some((id, label)),
            Operand::Constant(_) => None,
        })
    }
}
