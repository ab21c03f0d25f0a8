//! The error type of this crate.

use std::io;

use abbe_files::spelling::suggestion;
use abbe_model::chain::Machine;
use abbe_model::instrument::InstrumentKind;
use abbe_model::words::{cut, number};

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
    #[error("`{id}` is given twice; remove one of the two")]
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
        "no convergence after {iterations} iterations (the sum of squares is {sum_of_squares:.3e}){along}; check that the \
         readings belong to this machine and that the nominal geometry is right"
    )]
    NoConvergence {
        /// The number of iterations.
        iterations: usize,
        /// The last sum of squares.
        sum_of_squares: f64,
        /// The next step.
        step: Vec<f64>,
        /// The parameters along which the iterations still move, in words.
        along: String,
    },
    /// Estimates mean nothing, and a cause is found.
    #[error("{found}; {diagnosis}")]
    Implausible {
        /// What was found.
        found: String,
        /// The cause.
        diagnosis: String,
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
    #[error(
        "a matrix of the least-squares problem has entries that are not finite, or its decomposition does not converge; check readings and set-up for values that are far too large"
    )]
    Decomposition,
    /// A value is not written as name, number and unit.
    #[error("`{text}` {fault}; write name, number and unit as in `EY0A=35.3um`")]
    NotAQuantity {
        /// The value as given.
        text: String,
        /// What is wrong with it.
        fault: &'static str,
    },
    /// The unit of a value is that of another quantity.
    #[error("`{name}` has the unit `{unit}`; a unit such as `{expected}` is expected")]
    OtherUnit {
        /// The name of the value.
        name: String,
        /// Its unit.
        unit: String,
        /// A unit that fits.
        expected: String,
    },
    /// A value is beyond a limit.
    #[error("`{name}`: {found} is too large; the limit is {limit}")]
    TooLarge {
        /// The name of the value.
        name: String,
        /// The value, with its unit.
        found: String,
        /// The largest value, with its unit.
        limit: String,
    },
    /// A value is outside its range.
    #[error("{name}: {} is not in the range from {} to {} {unit}", number(*found), number(range[0]), number(range[1]))]
    OutOfRange {
        /// The name of the value.
        name: String,
        /// The value.
        found: f64,
        /// The least and the largest value.
        range: [f64; 2],
        /// The unit of all three.
        unit: &'static str,
    },
    /// Fewer inputs than a computation needs.
    #[error("{purpose} needs at least {least} {what}; given: {found}")]
    TooFew {
        /// The computation.
        purpose: &'static str,
        /// The inputs.
        what: &'static str,
        /// Their least number.
        least: usize,
        /// Their number.
        found: usize,
    },
    /// A name that does not exist.
    #[error("{of} has no {what} `{}`; {these} {}", cut(name, 80), known_names(name, known))]
    Unknown {
        /// What holds such names.
        of: String,
        /// What has such a name.
        what: &'static str,
        /// The name as given.
        name: String,
        /// The begin of the list of names that exist: `its axes are`.
        these: &'static str,
        /// The names that exist.
        known: Vec<String>,
    },
    /// Something necessary is missing.
    #[error("{of} has no {what}; {remedy}")]
    Missing {
        /// What lacks it.
        of: String,
        /// What is missing.
        what: String,
        /// What to do.
        remedy: String,
    },
    /// Two inputs exclude each other.
    #[error("{one} and {other} contradict each other; {remedy}")]
    Contradictory {
        /// One input.
        one: String,
        /// The other.
        other: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A method does not apply to the instrument of a test.
    #[error("{method}: a test has the instrument `{}`, not `{}`", found.word(), expected.word())]
    OtherInstrument {
        /// The method.
        method: &'static str,
        /// The instrument of the test.
        found: InstrumentKind,
        /// The instrument of the method.
        expected: InstrumentKind,
    },
    /// A method does not apply to the input.
    #[error("{method}: {found}; {expected}")]
    NotApplicable {
        /// The method or the input that it concerns.
        method: String,
        /// What was found.
        found: String,
        /// What the method needs, or what to do.
        expected: String,
    },
    /// Two inputs do not belong together.
    #[error("{one} is not {relation} {other}: {difference}")]
    Unlike {
        /// One input.
        one: String,
        /// What it should be of the other.
        relation: &'static str,
        /// The other.
        other: String,
        /// What differs.
        difference: String,
    },
    /// The readings determine no parameter.
    #[error("no parameter is identifiable from these readings, so there is {lacking}")]
    NothingIdentifiable {
        /// What does not exist therefore.
        lacking: &'static str,
    },
    /// The result of a fit justifies no certificate.
    #[error("there is no certificate: {why}")]
    NoCertificate {
        /// What forbids it.
        why: &'static str,
    },
    /// An output cannot be written.
    #[error("{what} cannot be written: {cause}")]
    Write {
        /// The output.
        what: &'static str,
        /// The cause.
        cause: io::Error,
    },
    /// The compiled library of effects is damaged.
    #[error("the library of effects cannot be read: {0}")]
    Library(Box<toml::de::Error>),
}

impl IdentifyError {
    /// [`IdentifyError::NotApplicable`] of its three parts.
    pub fn not_applicable(
        method: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> IdentifyError {
        IdentifyError::NotApplicable { method: method.into(), found: found.into(), expected: expected.into() }
    }

    /// [`IdentifyError::Unknown`] of its parts.
    pub fn unknown(
        of: impl Into<String>,
        what: &'static str,
        name: impl Into<String>,
        these: &'static str,
        known: impl IntoIterator<Item: Into<String>>,
    ) -> IdentifyError {
        let known = known.into_iter().map(Into::into).collect();
        IdentifyError::Unknown { of: of.into(), what, name: name.into(), these, known }
    }

    /// [`IdentifyError::Unknown`] for an axis, behind the name that contains it.
    pub fn no_axis(machine: &Machine, behind: &str, axis: &str) -> IdentifyError {
        let of = format!("{behind}the machine \"{}\"", machine.name);
        IdentifyError::unknown(of, "axis", axis, "its axes are", machine.axes.iter().map(|axis| &axis.name))
    }
}

/// The names that exist, and the one that may be meant. A single letter resembles every other.
fn known_names(name: &str, known: &[String]) -> String {
    let near = if name.len() > 1 { suggestion(name, known) } else { String::new() };
    let list = if known.is_empty() { "none".to_string() } else { known.join(", ") };
    if near.is_empty() { list } else { format!("{list}; {}", near.trim_end()) }
}
