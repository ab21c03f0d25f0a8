//! The policies of the search: one for readings along runs, one for independent poses.

use abbe_identify::problem::Problem;
use abbe_model::axis::AxisKind;

use super::constants::{HIGHEST_ORDER_OF_SPECTRA, READINGS_PER_COEFFICIENT};
use crate::candidates::sampling::Sampling;

/// Where the null draws come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NullSource {
    /// Blocks of the deviations of repeats along runs.
    Repeats,
    /// The residual with a random sign for each pose.
    SignFlips,
}

/// A move of the search by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MoveName {
    /// [`super::moves::swap`].
    Swap,
    /// [`super::moves::merge`].
    Merge,
    /// [`super::moves::refine`].
    Refine,
    /// [`super::moves::pair`].
    Pair,
}

/// The numbers and choices that differ between kinds of readings.
#[derive(Clone, Copy, Debug)]
pub struct Policy {
    /// Probability that the search accepts an effect on readings without structure.
    pub significance: f64,
    /// Maximum number of effects. A larger number indicates a different cause.
    pub max_effects: usize,
    /// Where the null draws come from.
    pub null: NullSource,
    /// Whether the residual is tested for structure. For poses the residual always has structure, so that the test
    /// cannot decide.
    pub tests_structure: bool,
    /// Whether gains are divided by the residual variance instead of the noise variance.
    pub in_residual_variance: bool,
    /// Whether every addition has to lower the held-out error. P-values are unreliable for poses.
    pub every_addition_lowers_heldout: bool,
    /// Whether families of effects under one prior are proposed before single effects.
    pub families: bool,
    /// Whether the branches without a fold have the effects of the branch on all readings. Few readings without a fold
    /// often name another effect by chance, which then predicts the fold wildly.
    pub folds_follow: bool,
    /// Number of candidates that are tried in a round, one for each component and driver; the one with the lowest held-out
    /// error is added.
    pub tried: usize,
    /// Number of selected effects from which a swap no longer tunes positions and periods again.
    pub swap_tunes_below: usize,
    /// The moves after each addition, in order.
    pub after_addition: &'static [MoveName],
    /// The moves when no addition is significant, until one of them changes the selected effects.
    pub without_addition: &'static [MoveName],
    /// Whether effects that explain nothing are withdrawn at the end.
    pub withdraws: bool,
}

/// The significance level if the caller states none.
pub const SIGNIFICANCE: f64 = 0.01;

/// The policy for readings along runs.
const RUNS: Policy = Policy {
    significance: SIGNIFICANCE,
    max_effects: 12,
    null: NullSource::Repeats,
    tests_structure: true,
    in_residual_variance: false,
    every_addition_lowers_heldout: false,
    families: false,
    folds_follow: false,
    tried: 1,
    swap_tunes_below: 5,
    after_addition: &[MoveName::Swap, MoveName::Merge],
    without_addition: &[MoveName::Refine, MoveName::Pair],
    withdraws: true,
};

/// The policy for independent poses.
const POSES: Policy = Policy {
    significance: SIGNIFICANCE,
    max_effects: 200,
    null: NullSource::SignFlips,
    tests_structure: false,
    in_residual_variance: true,
    every_addition_lowers_heldout: true,
    families: true,
    folds_follow: false,
    tried: 1,
    swap_tunes_below: 0,
    after_addition: &[MoveName::Swap],
    without_addition: &[],
    withdraws: false,
};

/// Candidates that a round tries on few poses.
const TRIED_ON_FEW_POSES: usize = 8;

/// The policy for independent poses that are too few for spectra ([`has_few_poses`]).
const FEW_POSES: Policy = Policy { folds_follow: true, tried: TRIED_ON_FEW_POSES, ..POSES };

impl Policy {
    /// The policy for the readings of a problem.
    pub fn of(problem: &Problem) -> Policy {
        match problem.folds.kind.is_poses() {
            true if has_few_poses(problem) => FEW_POSES,
            true => POSES,
            false => RUNS,
        }
    }
}

/// Whether the readings are too few for the spectra of all joints that move: they cannot tell a curve of all orders from
/// the few effects that the library names.
pub fn has_few_poses(problem: &Problem) -> bool {
    let machine = &problem.session.machine;
    let moves = Sampling::of(problem).moves;
    let joints = (0..machine.axes.len()).filter(|axis| moves[*axis] && machine.axes[*axis].kind == AxisKind::Rotary);
    // Outliers count too, so that the policy is one for the whole search.
    let readings: usize = problem.models.iter().map(|model| model.rows() * model.channels().len()).sum();
    readings < READINGS_PER_COEFFICIENT * 2 * HIGHEST_ORDER_OF_SPECTRA * joints.count()
}
