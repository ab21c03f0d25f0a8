//! The error type of this crate.

/// Errors of an identification.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// The session is invalid.
    #[error(transparent)]
    Model(#[from] abbe_model::ModelError),
    /// The session has no readings.
    #[error(
        "the session has no readings: no test names a `data` file; add `data` files to the tests, or simulate readings"
    )]
    NoReadings,
    /// The session has no parameters to estimate.
    #[error(
        "the session has no parameters to estimate: `[unknowns] errors` is empty, no effect is declared and every set-up quantity is known exactly"
    )]
    NoUnknowns,
    /// A filter text matches no identifier in the effect library.
    #[error("no candidate effect of this session contains `{text}` in its identifier; identifiers look like EZC~C:h2")]
    NotInTheLibrary {
        /// The filter text.
        text: String,
    },
    /// The filters exclude every candidate effect.
    #[error("no candidate effects remain: the exclusions remove every selected effect; exclude fewer effects")]
    EverythingLeftOut,
    /// The caller interrupted the computation. A trace that has begun its search returns the effects found so far
    /// instead.
    #[error("interrupted before there was a result")]
    Interrupted,
    /// The data lack a column that a declared effect needs.
    #[error("effect `{effect}` follows {driver}, but the data of test `{test}` have no column `{column}`")]
    MissingDriver {
        /// The effect.
        effect: String,
        /// Its driver.
        driver: String,
        /// The test.
        test: String,
        /// The missing column.
        column: String,
    },
    /// The instrument of this session lacks the component of an effect.
    #[error("effect `{effect}`: a {instrument} session has no component `{component}`")]
    NoSuchComponent {
        /// The effect.
        effect: String,
        /// The component.
        component: String,
        /// The instrument.
        instrument: &'static str,
    },
    /// Two parameters have the same identifier.
    #[error("`{id}` is declared twice; remove one of the two declarations")]
    RepeatedUnknown {
        /// The identifier.
        id: String,
    },
    /// The model yields a number that is not finite.
    #[error(
        "test `{test}`, reading {row}: the model yields {value}; check for coinciding ball positions and for coordinates that are not finite"
    )]
    NotFinite {
        /// The test.
        test: String,
        /// The row, from 1.
        row: usize,
        /// The value.
        value: f64,
    },
    /// The iterations did not converge.
    #[error(
        "no convergence after {iterations} iterations (the sum of squares is {sum_of_squares:.3e}); \
         check that the readings belong to this machine and that the nominal geometry is right"
    )]
    NoConvergence {
        /// The number of iterations.
        iterations: usize,
        /// The last sum of squares.
        sum_of_squares: f64,
    },
    /// The readings contradict the session.
    #[error("{found}; {diagnosis}")]
    Contradicted {
        /// What was found.
        found: String,
        /// Possible causes.
        diagnosis: String,
    },
    /// A matrix decomposition failed.
    #[error("a matrix of the least-squares problem has entries that are not finite")]
    Decomposition,
    /// The request is invalid.
    #[error("{0}")]
    Request(String),
}
