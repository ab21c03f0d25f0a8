//! What this crate and those above it refuse, in words.

use std::fmt::Display;

use abbe_files::spelling::suggestion;
use abbe_model::Diagnostic;
use abbe_model::chain::Machine;
use abbe_model::diagnostic::{Area, Code};
use abbe_model::instrument::InstrumentKind;
use abbe_model::words::{cut, number};

const fn code(word: &'static str) -> Code {
    Code { area: Area::Identification, word }
}

/// The caller interrupted the computation. A trace that has begun its search returns the effects found so far instead.
pub const INTERRUPTED: Code = code("interrupted");
/// The iterations did not converge.
pub const NO_CONVERGENCE: Code = code("no-convergence");
/// The readings contradict the session.
pub const CONTRADICTED: Code = code("contradicted");
/// Estimates mean nothing, and a cause is found.
pub const IMPLAUSIBLE: Code = code("implausible");
/// A method does not apply to the input.
pub const NOT_APPLICABLE: Code = code("not-applicable");
/// A filter text matches no identifier in the effect library.
pub const NOT_IN_THE_LIBRARY: Code = code("not-in-the-library");

/// [`INTERRUPTED`] in words.
pub fn interrupted() -> Diagnostic {
    Diagnostic::coded(INTERRUPTED, "interrupted before there was a result")
}

/// The session has no readings.
pub fn no_readings() -> Diagnostic {
    let message = "the session has no readings: no test names a `data` file; add `data` files to the tests, or simulate \
                   readings";
    Diagnostic::identification(message)
}

/// The session has no parameters to estimate.
pub fn no_unknowns() -> Diagnostic {
    Diagnostic::identification(
        "the session has no parameters to estimate: `[unknowns] errors` is empty, no effect is declared and every set-up \
         quantity is known exactly",
    )
}

/// A matrix decomposition failed.
pub fn decomposition() -> Diagnostic {
    let message = "a matrix of the least-squares problem has entries that are not finite, or its decomposition does not \
                   converge; check readings and set-up for values that are far too large";
    Diagnostic::identification(message)
}

/// The data of a test lack a column that an effect needs.
pub fn missing_driver(
    effect: impl Display,
    driver: impl Display,
    test: impl Display,
    column: impl Display,
) -> Diagnostic {
    Diagnostic::identification(format!(
        "effect `{effect}` follows {driver}, but the data of test `{test}` have no column `{column}`"
    ))
}

/// Two parameters have one identifier.
pub fn repeated_unknown(id: impl Display) -> Diagnostic {
    Diagnostic::identification(format!("`{id}` is given twice; remove one of the two"))
}

/// The model yields a number that is not finite; `row` from 1.
pub fn not_finite(test: impl Display, row: usize, value: f64) -> Diagnostic {
    Diagnostic::identification(format!(
        "test `{test}`, reading {row}: the model yields {value}; check for coinciding ball positions and for coordinates \
         that are not finite"
    ))
}

/// [`CONTRADICTED`] with what was found and its cause.
pub fn contradicted(found: impl Display, diagnosis: impl Display) -> Diagnostic {
    Diagnostic::coded(CONTRADICTED, format!("{found}; {diagnosis}"))
}

/// A value is outside its range.
pub fn out_of_range(name: impl Display, found: f64, [least, most]: [f64; 2], unit: impl Display) -> Diagnostic {
    let [found, least, most] = [found, least, most].map(number);
    Diagnostic::identification(format!("{name}: {found} is not in the range from {least} to {most} {unit}"))
}

/// A computation has fewer inputs than it needs.
pub fn too_few(purpose: impl Display, what: impl Display, least: usize, found: usize) -> Diagnostic {
    Diagnostic::identification(format!("{purpose} needs at least {least} {what}; given: {found}"))
}

/// A name that does not exist. `holder` holds such names, `what` has one, and `these` begins the list of those that
/// exist: `its axes are`.
pub fn unknown(
    holder: impl Display,
    what: impl Display,
    name: impl Display,
    these: impl Display,
    known: impl IntoIterator<Item: Into<String>>,
) -> Diagnostic {
    let known: Vec<String> = known.into_iter().map(Into::into).collect();
    let name = name.to_string();
    // A single letter resembles every other.
    let near = if name.len() > 1 { suggestion(&name, &known) } else { String::new() };
    let list = if known.is_empty() { "none".to_string() } else { known.join(", ") };
    let list = if near.is_empty() { list } else { format!("{list}; {}", near.trim_end()) };
    Diagnostic::identification(format!("{holder} has no {what} `{}`; {these} {list}", cut(&name, 80)))
}

/// [`unknown`] for an axis, behind the name that contains it.
pub fn no_axis(machine: &Machine, behind: impl Display, axis: impl Display) -> Diagnostic {
    let holder = format!("{behind}the machine \"{}\"", machine.name);
    unknown(holder, "axis", axis, "its axes are", machine.axes.iter().map(|axis| &axis.name))
}

/// Something necessary is missing.
pub fn missing(holder: impl Display, what: impl Display, remedy: impl Display) -> Diagnostic {
    Diagnostic::identification(format!("{holder} has no {what}; {remedy}"))
}

/// Two inputs exclude each other.
pub fn contradictory(one: impl Display, other: impl Display, remedy: impl Display) -> Diagnostic {
    Diagnostic::identification(format!("{one} and {other} contradict each other; {remedy}"))
}

/// A method does not apply to the instrument of a test.
pub fn other_instrument(method: impl Display, found: InstrumentKind, expected: InstrumentKind) -> Diagnostic {
    let [found, expected] = [found, expected].map(InstrumentKind::word);
    Diagnostic::identification(format!("{method}: a test has the instrument `{found}`, not `{expected}`"))
}

/// [`NOT_APPLICABLE`] with the method or its input, what was found, and what the method needs or what to do.
pub fn not_applicable(method: impl Display, found: impl Display, expected: impl Display) -> Diagnostic {
    Diagnostic::coded(NOT_APPLICABLE, format!("{method}: {found}; {expected}"))
}

/// Two inputs do not belong together: one should be this relation of the other.
pub fn unlike(one: impl Display, relation: impl Display, other: impl Display, difference: impl Display) -> Diagnostic {
    Diagnostic::identification(format!("{one} is not {relation} {other}: {difference}"))
}

/// The readings determine no parameter, so there is this.
pub fn nothing_identifiable(lacking: impl Display) -> Diagnostic {
    Diagnostic::identification(format!("no parameter is identifiable from these readings, so there is {lacking}"))
}

/// An output cannot be written.
pub fn not_written(what: impl Display, cause: impl Display) -> Diagnostic {
    Diagnostic::identification(format!("{what} cannot be written: {cause}"))
}
