//! The three statements of a fit or a trace: is it good, what to correct, what to measure next.

use abbe::identify::results::{AxisCorrection, DeterminedBy, GoodStatement, LineQuantity, NextStep, Statements};
use abbe::identify::tolerance::rule::Decision;
use abbe::model::words::counted;

use super::fit::agreement;
use super::number::{fixed, places, quantity, value_and_u};
use super::parameters::PRIOR;
use super::table::{Cell, Table, cells};

/// Changes that the sentence names.
const NAMED: usize = 4;
/// Digits of a component of a unit vector.
const DIRECTION_PLACES: usize = 6;

/// Is it good: residual against noise, and limits, after what is judged.
pub fn good(of: &str, good: &GoodStatement, degrees_of_freedom: usize) -> String {
    let limits = match good.decision {
        None => "no limits are stated".to_string(),
        Some(Decision::Pass) => "all limits pass".to_string(),
        Some(Decision::Fail) => format!("fails: {}", good.failed.join(", ")),
        Some(Decision::Undecided) => format!("undecided: {}", good.undecided.join(", ")),
    };
    format!("{of}: {}; {limits}", agreement(good.goodness, degrees_of_freedom))
}

/// What to correct: the changes that exceed their expanded uncertainty, the largest first.
pub fn correct(statements: &Statements) -> String {
    let mut large: Vec<&AxisCorrection> = statements.correct.iter().filter(|change| change.exceeds_u()).collect();
    let ratio = |change: &AxisCorrection| (change.change / change.u).abs();
    large.sort_by(|a, b| ratio(b).total_cmp(&ratio(a)));
    if !statements.good.goodness.quotable {
        return "What to correct: nothing yet; the effect that the model lacks biases the estimates".to_string();
    }
    if large.is_empty() {
        return match statements.correct.is_empty() {
            true => "What to correct: no location error is identified".to_string(),
            false => "What to correct: nothing; no axis deviates by more than the uncertainty".to_string(),
        };
    }
    let named: Vec<String> = large.iter().take(NAMED).map(|change| in_short(change)).collect();
    let more = match large.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {}", counted(more, "further change")),
    };
    let by_prior = match large.iter().any(|change| change.determined_by == DeterminedBy::Prior) {
        true => format!(" ({PRIOR}: if the set-up is as stated)"),
        false => String::new(),
    };
    format!("What to correct: {}{more}{by_prior}", named.join(", "))
}

/// `C in X −36.29 ± 0.92 µm`, `A about … `.
fn in_short(change: &AxisCorrection) -> String {
    let (value, u) = value_and_u(change.change, change.u);
    let mark = if change.determined_by == DeterminedBy::Prior { PRIOR } else { "" };
    let of = match change.quantity {
        LineQuantity::Point => format!("{} in {}", change.axis, change.coordinate),
        LineQuantity::Direction => format!("direction of {} in {}", change.axis, change.coordinate),
    };
    format!("{of} {}{mark}", quantity(&format!("{value} ± {u}"), &change.unit))
}

/// What to measure next, and the commands for it. `command` gives the command line of a verb with options; `next` is the
/// session file that they write.
pub fn measure(statements: &Statements, next: &str, command: impl Fn(&str, &str) -> String) -> Vec<String> {
    let with_program = |what: String, verb: &str, options: &str| {
        vec![
            what,
            format!("  {}  writes the test,", command(verb, options)),
            format!("  abbe nc {next} --control CONTROL --out programs  its program"),
        ]
    };
    let plan = |purpose: &str| {
        with_program(
            format!("What to measure next: the test that {purpose}"),
            "plan",
            &format!("--improve --write {next}"),
        )
    };
    let one = |what: &str| vec![format!("What to measure next: {what}")];
    match statements.measure.step {
        NextStep::CorrectSession => one("nothing before the session is corrected: the readings contradict it"),
        NextStep::Trace => one(&format!("nothing before {}", command("trace", ""))),
        NextStep::StateNoise => one("a run once more, or state `noise_um`: only then can the model be judged"),
        NextStep::SeparatingTest => {
            let test = statements.measure.description.as_deref().unwrap_or_default();
            with_program(format!("What to measure next: {test}"), "trace", &format!("--write {next} --with-tests"))
        }
        NextStep::Identify => plan("makes the confounded parameters identifiable"),
        NextStep::Improve => plan("most lowers the largest uncertainty"),
        NextStep::Nothing => one("no candidate test is known for this instrument"),
    }
}

/// The line of each axis in R: nominal, identified, change.
pub fn corrections(statements: &Statements) -> Table {
    let rows = statements.correct.iter().map(|change| {
        let [value, u] = Cell::estimate(change.change, change.u);
        let digits = match change.quantity {
            // Of a point in mm, those of its change in µm and three more.
            LineQuantity::Point => places(change.u) + 3,
            LineQuantity::Direction => DIRECTION_PLACES,
        };
        let mark = match change.determined_by {
            DeterminedBy::Prior if change.exceeds_u() => PRIOR,
            _ if change.exceeds_u() && change.quotable => "*",
            _ => "",
        };
        let of = format!("{} {}", change.quantity, change.coordinate);
        let (nominal, identified) = (fixed(change.nominal, digits), fixed(change.identified, digits));
        cells![&change.axis, of, nominal, identified, value, u, super::number::unit(&change.unit), mark]
    });
    let columns = ["axis", "in R", ">nominal", ">identified", ">change", ">u", "unit", ""];
    Table::new(columns, rows).titled(
        "Axes at zero: a point of each rotary axis in mm, the direction of each axis as a unit vector, and the change to enter",
    )
}
