//! A candidate: an effect that may be added to a model, with its columns and its cost.

use abbe_model::effect::Effect;

use super::columns::EffectColumns;
use super::library::LibraryEffect;

/// A candidate effect.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    /// The effect.
    pub effect: Effect,
    /// Its columns.
    pub columns: EffectColumns,
    /// Index of its family; `usize::MAX` for a curve of one test, which belongs to none.
    pub family: usize,
    /// Cost in the score in addition to its degrees of freedom, in natural-logarithm units.
    pub cost: f64,
    /// Selection penalty: the reduction of the evidence for the selection of several positions. 0 for an effect of the
    /// library.
    pub selection_penalty: f64,
    /// Whether it is searched only if no simpler candidate is significant and structure remains.
    pub last_resort: bool,
    /// Whether it only serves other candidates: a dictionary of positions for step tables, or a curve of one test.
    pub dictionary: bool,
    /// Spacing of the library's members in the first tunable shape number, in the driver's unit; 0 if there is none.
    pub grid: f64,
    /// The folds on which its shape numbers and positions were tuned. Empty for an effect of the library.
    pub tuned_on: Vec<usize>,
    /// Whether the readings would show it at its largest plausible size.
    pub detectable: bool,
    /// Whether the search has excluded it.
    pub forbidden: bool,
}

impl Candidate {
    /// An effect of the library with its columns.
    pub fn of(member: LibraryEffect, columns: EffectColumns) -> Candidate {
        let LibraryEffect { effect, family, cost, last_resort, dictionary, grid } = member;
        Candidate {
            effect,
            columns,
            family,
            cost,
            selection_penalty: 0.0,
            last_resort,
            dictionary,
            grid,
            tuned_on: Vec::new(),
            detectable: true,
            forbidden: false,
        }
    }

    /// A curve without a component. It serves for comparison with effects and is not searched itself.
    pub fn test_curve(effect: Effect, columns: EffectColumns) -> Candidate {
        let family = usize::MAX;
        let member = LibraryEffect { effect, family, cost: 0.0, last_resort: false, dictionary: true, grid: 0.0 };
        Candidate::of(member, columns)
    }

    /// The interval between its neighbours on the grid, for each shape number that can be tuned.
    pub fn brackets(&self) -> Vec<[f64; 2]> {
        self.effect.shape.brackets(self.grid)
    }

    /// Description length. The simplest candidate has the shortest description.
    pub fn description_length(&self) -> f64 {
        self.cost + self.selection_penalty
    }
}
