//! The constants of the search, with their provenance. `docs/guide/trace.md` describes the search.

/// Difference in `−ln P` below which two candidates are confounded. It corresponds to 2 σ for one column.
pub const INDISTINGUISHABLE: f64 = 2.0;
/// Highest order of the spectra of joints, as of the harmonics of poses.
pub const HIGHEST_ORDER_OF_SPECTRA: usize = 40;
/// Least number of scalar readings for each coefficient of the spectra of all joints.
pub const READINGS_PER_COEFFICIENT: usize = 2;
/// Least effective number of parameters of a family. The readings hardly depend on a family with fewer, such as the
/// spectrum of a last joint whose axis passes close to the target.
pub const MIN_EFFECTIVE: f64 = 1.0;
/// The same of one member of a family.
pub const MIN_EFFECTIVE_OF_MEMBER: f64 = 0.5;
/// Single effects whose held-out error is computed beside the families, in each round.
pub const LINES_TRIED: usize = 8;
/// Single effects that may take the place of the spectra of all joints. More of them would be a curve in pieces.
pub const MAX_IN_PLACE_OF_FAMILIES: usize = 8;
/// Relative difference of scores below which two candidates count as equivalent.
pub const EQUIVALENT: f64 = 1e-6;
/// Least detectability of a searched effect. An effect of the largest plausible size has to change the readings by this
/// many standard deviations in total, beyond what the model absorbs.
pub const MIN_PLAUSIBLE_SIGMA: f64 = 3.0;
/// Significance level of the test of the remaining structure.
pub const STRUCTURED: f64 = 0.01;
/// Share of the structure's excess over noise that may remain for the found effects to count as the explanation.
pub const EXPLAINED_SHARE: f64 = 0.5;
/// Sampling scatter of an estimated AR coefficient, and relative scatter of an estimated noise standard deviation.
pub const SCATTER: f64 = 0.02;

/// Degrees of freedom of repeats from which their standard deviation replaces a stated one. With fewer it is uncertain by
/// more than 7 %.
pub const MIN_AGAINST_STATED: usize = 100;
/// Ratio to a stated standard deviation beyond which that of few repeats replaces it. In short runs slow noise, of which
/// trends take the most, reduces that of repeats by up to a half.
pub const FAR_FROM_STATED: f64 = 5.0;

/// Consecutive additions that may fail to lower the held-out error before they are withdrawn. Of two effects that
/// partly cancel each other, the first alone explains little.
pub const MAX_REJECTED_IN_A_ROW: usize = 2;
/// Up to this number of effects, exchanges are tried after each addition. Beyond it they are tried after every
/// [`SWAP_EVERY`]-th: each exchange trains one model per effect, and with many effects the gain is small.
pub const SWAP_EVERY_ROUND_UP_TO: usize = 14;
/// See [`SWAP_EVERY_ROUND_UP_TO`].
pub const SWAP_EVERY: usize = 8;
/// Maximum number of selected effects for which sets of effects are compared.
pub const MAX_COMPARED: usize = 3;

/// Share of the gain of a found effect that a candidate needs on the grid of the library to be tuned in its place. Between
/// two grid points a feature keeps more than half of its gain.
pub const MIN_SHARE_ON_GRID: f64 = 0.5;
/// Maximum number of candidates that are tuned in the place of one found effect.
pub const MAX_TUNED_ALIASES: usize = 64;
/// Share of the best evidence that a candidate needs on the grid to be tuned. A local feature between two grid points
/// loses a third of its evidence.
pub const MIN_EVIDENCE_SHARE: f64 = 0.5;
/// Evidence by which a step table may fall short of the best and still be reported as an alternative.
pub const MAX_EVIDENCE_DEFICIT: f64 = 4.0;
/// Score by which an explanation may fall short of the selected effect and still be averaged into a prediction. Its weight
/// is then 2 % of that of the effect.
pub const MAX_SCORE_DEFICIT: f64 = 4.0;
/// Maximum number of explanations over which the prediction of a fold is averaged.
pub const MAX_AVERAGED: usize = 13;
/// Numbers of intervals of the nonparametric curves that effects along one axis are compared with.
pub const INTERVALS: [usize; 3] = [8, 16, 32];

/// Least cosine between the signature of the found effect and the column space of an alias, which then reproduces at
/// least half of the squared signature. The evidence alone does not suffice: a candidate may explain as much of a
/// different structure.
pub const MIN_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Rms difference of the fitted readings, in standard deviations of the noise, below which two shapes of one component over
/// one driver are one explanation.
pub const SAME_READINGS: f64 = 0.1;
/// `ln` of the probability ratio above which an alias takes the place of the found effect: 3, below which evidence is "barely
/// worth mentioning" (H. Jeffreys, *Theory of Probability*, 1961, App. B) and another repeat names another effect.
pub const MORE_PROBABLE: f64 = 1.1;
/// Maximum number of competing explanations of a found effect.
pub const MAX_COMPETING: usize = 16;

/// Maximum number of aliases of a found effect that predict left-out tests, the nearest first.
pub const MAX_PREDICTING: usize = 24;

/// Readings per block of a null draw for the search. A block keeps intermittent structure, so that the search does not
/// accept it as an effect.
pub const BLOCK: usize = 20;
/// Readings per block of a null draw for the test of the remaining structure. Single readings leave only noise with the
/// estimated autocorrelation.
pub const SINGLE: usize = 1;
/// Largest sum of the AR coefficients of a draw.
pub const MAX_AR_SUM: f64 = 0.98;
/// Least number of deviations to draw from. With fewer, Gaussian noise is drawn.
pub const MIN_POOL: usize = 200;
/// Readings on either side of the running median that removes structure from a residual without repeats.
pub const SMOOTHING: usize = 7;
/// Number of scalar readings up to which the structure test and the products of the search are formed at the same time. With
/// more readings either keeps all cores busy, and their memory does not add up.
pub const MAX_AT_THE_SAME_TIME: usize = 20_000;

/// How many candidates the steps of a branch try.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Iterations of a line search, each reducing the interval to 0.62.
    pub line_search: usize,
    /// Maximum number of candidates that are tuned at a time.
    pub tuned: usize,
    /// Maximum number of candidates with one identifier from which it is tuned.
    pub starts: usize,
    /// Candidates tried together with an effect that is tuned again.
    pub tried: usize,
    /// Candidates tried as the first of a pair in place of two effects.
    pub first_of_two: usize,
    /// Candidates tried as the first of a pair in place of one effect.
    pub first_of_one: usize,
}

/// Effort of the branch on all readings.
pub const ON_ALL: Effort =
    Effort { line_search: 12, tuned: 10, starts: 3, tried: 6, first_of_two: 32, first_of_one: 8 };
/// Effort of a branch without one fold. It only predicts that fold, and needs no best name.
pub const ON_FOLDS: Effort = Effort { line_search: 6, tuned: 2, starts: 2, tried: 2, first_of_two: 8, first_of_one: 8 };
