//! The error type of this crate.

/// Why an identification cannot be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// Something in the session.
    #[error(transparent)]
    Model(#[from] abbe_model::ModelError),
    /// A session without readings.
    #[error(
        "the session has no readings: no test names a `data` file; `abbe simulate` makes readings, `abbe plan` needs none"
    )]
    NoReadings,
    /// Nothing to identify.
    #[error(
        "the session has nothing to identify: `[unknowns] errors` is empty, no effect is declared and every set-up is known exactly"
    )]
    NoUnknowns,
    /// Something to look for that is in no identifier of the library.
    #[error(
        "no effect that the library has for this session has `{text}` in its identifier, as EZC~C:h2; `abbe trace --list` shows them all"
    )]
    NotInTheLibrary {
        /// What was looked for.
        text: String,
    },
    /// What is left out is all that was to be looked for.
    #[error(
        "nothing is left to look for: what `--only` asks for is left out by `--exclude`, or everything is"
    )]
    EverythingLeftOut,
    /// The caller asked for an end; a trace that has begun its search returns the effects found until then instead.
    #[error("interrupted before there was a result")]
    Interrupted,
    /// A declared effect that needs a column the data lack.
    #[error("effect `{effect}` follows {driver}, but the data of test `{test}` have no column `{column}`")]
    MissingDriver {
        /// The effect.
        effect: String,
        /// What it follows.
        driver: String,
        /// The test.
        test: String,
        /// The column.
        column: String,
    },
    /// An effect whose component this session's instrument does not have.
    #[error("effect `{effect}`: a {instrument} session has no component `{component}`")]
    NoSuchComponent {
        /// The effect.
        effect: String,
        /// The component.
        component: String,
        /// The instrument.
        instrument: &'static str,
    },
    /// Two unknowns of one name.
    #[error("`{id}` is an unknown twice; remove one of the two declarations")]
    RepeatedUnknown {
        /// The identifier.
        id: String,
    },
    /// The model yields a number that is not finite.
    #[error(
        "test `{test}`, reading {row}: the model yields {value}; two balls in one place or a coordinate that is not finite does this"
    )]
    NotFinite {
        /// The test.
        test: String,
        /// The row, from 1.
        row: usize,
        /// What it yields.
        value: f64,
    },
    /// Iterations that do not end.
    #[error(
        "no convergence after {iterations} iterations (the sum of squares stands at {sum_of_squares:e}); \
         the start is too far off or the readings do not belong to this machine"
    )]
    NoConvergence {
        /// How many were made.
        iterations: usize,
        /// Where it stands.
        sum_of_squares: f64,
    },
    /// Readings that contradict the session.
    #[error("{found}; {diagnosis}")]
    Contradicted {
        /// What was found.
        found: String,
        /// What may be wrong.
        diagnosis: String,
    },
    /// A decomposition that failed.
    #[error("a matrix of the least-squares problem has entries that are not finite")]
    Decomposition,
    /// A request that makes no sense.
    #[error("{0}")]
    Request(String),
}
