//! The three statements that open a report: is it good, what to correct, what to measure next.

use std::cmp::Ordering;
use std::path::Path;

use abbe::apply::compare::ComparisonStatement;
use abbe::apply::compare::results::{Comparison, Difference};
use abbe::codegen::nc::has_letters;
#[cfg(feature = "fleet")]
use abbe::fleet::history::statements::{ChangedInHistory, HistoryStatements};
use abbe::identify::results::{
    AxisCorrection, DeterminedBy, Estimate, LineQuantity, MeasureStatement, NextStep, NotJudged, ParameterChange,
    Statements,
};
use abbe::identify::tolerance::rule::Decision;
use abbe::model::chain::Machine;
use abbe::model::session::Session;
use abbe::model::words::{counted, first_of};
use abbe::plan::PlanStatement;
use abbe::plan::results::{Contribution, ErrorAnalysis, PlanAnalysis};
use abbe::trace::validate::{ModelNotJudged, MovedParameter, ValidationResult, ValidationStatement, ValidationVerdict};

use super::block::Sentence;
use super::commands::{Commands, MEASURE, NEXT, PROGRAMS, TRACED, TRACED_MODEL};
use super::number::{fixed, places, quantity, three_digits, value_and_u};
use super::parameters::PRIOR;
use super::quality::agreement;
use super::table::{Cell, Table, cells};

/// Changes that the sentence names.
const NAMED: usize = 4;
/// What a proposed test does for parameters that no reading separates.
pub const IDENTIFIES: &str = "makes the confounded parameters identifiable";
/// What a proposed test does for uncertainties.
pub const IMPROVES: &str = "most lowers the largest uncertainty";
/// Share of the noise in a variance below which more readings do not help.
const MIN_NOISE_SHARE: f64 = 0.1;
/// What to correct by differences from a model that lacks an effect.
const NOTHING_YET: &str = "What to correct: nothing yet; what the model lacks is in every difference";
/// Digits of a component of a unit vector.
const DIRECTION_PLACES: usize = 6;

/// The statements as sentences that open a report.
pub fn opening(
    statements: &Statements,
    session: &Session,
    degrees_of_freedom: usize,
    commands: &Commands,
) -> Vec<Sentence> {
    let good = good("Goodness of fit", statements, degrees_of_freedom);
    let mut sentences = vec![good.into(), correct(statements).into()];
    if statements.measure.step == NextStep::StateNoise {
        let keys = session.keys_of_noise();
        let what = match statements.good.goodness.not_judged {
            Some(NotJudged::BelowNoise) => format!("nothing before {keys} is that of the instrument"),
            _ => format!("a run once more, or state {keys}: only then can the model be judged"),
        };
        sentences.push(format!("What to measure next: {what}").into());
    } else {
        sentences.extend(measure(&statements.measure, Some(&session.machine), commands));
    }
    sentences
}

/// How the volumetric error changed, in words. A change by no more than `within_um` is none.
pub fn volumetric(before_um: f64, after_um: f64, within_um: f64) -> String {
    let [before, after] = [before_um, after_um].map(|um| fixed(um, 2));
    match before_um.total_cmp(&after_um) {
        _ if before == after => format!("the volumetric error stays at {after} µm rms"),
        _ if (after_um - before_um).abs() <= within_um => {
            format!("the volumetric error is {before} and {after} µm rms, the same within its uncertainty")
        }
        Ordering::Less => format!("the volumetric error rises from {before} to {after} µm rms"),
        _ => format!("the volumetric error falls from {before} to {after} µm rms"),
    }
}

/// Is it good: residual against noise, and limits, after what is judged. A set-up that the readings contradict may be the cause.
fn good(of: &str, statements: &Statements, degrees_of_freedom: usize) -> String {
    let good = &statements.good;
    let limits = match good.decision {
        None => "no limits are stated".to_string(),
        Some(Decision::Pass) => "all limits pass".to_string(),
        Some(Decision::Fail) => format!("fails: {}", good.failed.join(", ")),
        Some(Decision::Undecided) => format!("undecided: {}", good.undecided.join(", ")),
    };
    let or = match statements.measure.step {
        NextStep::CorrectSession if good.goodness.verdict.lacks_an_effect() => ", or the session is not as stated",
        _ => "",
    };
    format!("{of}: {}{or}; {limits}", agreement(good.goodness, degrees_of_freedom))
}

/// What to correct: the changes that exceed their expanded uncertainty, the largest first.
fn correct(statements: &Statements) -> String {
    let mut large: Vec<&AxisCorrection> = statements.correct.iter().filter(|change| change.exceeds_u()).collect();
    let ratio = |change: &AxisCorrection| (change.change / change.u).abs();
    large.sort_by(|a, b| ratio(b).total_cmp(&ratio(a)));
    if !statements.good.goodness.quotable {
        return match statements.good.goodness.not_judged {
            Some(NotJudged::WrongUnit) => {
                "What to correct: nothing yet; the unit of the readings is in doubt".to_string()
            }
            _ if statements.measure.step == NextStep::CorrectSession => {
                "What to correct: nothing yet; what the readings contradict biases the estimates".to_string()
            }
            _ => "What to correct: nothing yet; the effect that the model lacks biases the estimates".to_string(),
        };
    }
    let further = || {
        let mut further: Vec<&Estimate> = statements.further.iter().collect();
        let ratio = |found: &Estimate| (found.value / found.u).abs();
        further.sort_by(|a, b| ratio(b).total_cmp(&ratio(a)));
        further.into_iter()
    };
    if large.is_empty() && statements.further.is_empty() {
        return match statements.correct.is_empty() {
            true => "What to correct: no location error is determined alone, only combinations of them".to_string(),
            false if statements.good.goodness.not_judged == Some(NotJudged::BelowNoise) => {
                "What to correct: not judged; no axis deviates by more than an uncertainty that is overstated"
                    .to_string()
            }
            false => "What to correct: nothing; no axis deviates by more than the uncertainty".to_string(),
        };
    }
    let is_by_prior = large.iter().map(|change| change.determined_by).chain(further().map(|found| found.determined_by));
    let is_by_prior = is_by_prior.into_iter().any(|by| by == DeterminedBy::Prior);
    let estimates = further().map(|found| {
        let mark = if found.determined_by == DeterminedBy::Prior { PRIOR } else { "" };
        format!("{} {}{mark}", found.id, estimate(found.value, found.u, &found.unit))
    });
    let named: Vec<String> = large.iter().map(|change| in_short(change)).chain(estimates).collect();
    let named = first_of(&named, NAMED, ", ", "further change");
    let by_prior = match is_by_prior {
        true => format!(" ({PRIOR}: if the set-up is as stated)"),
        false => String::new(),
    };
    format!("What to correct: {named}{by_prior}")
}

/// `C in X −36.29 ± 0.92 µm`, `A about … `.
fn in_short(change: &AxisCorrection) -> String {
    let (value, u) = value_and_u(change.change, change.u);
    let mark = if change.determined_by == DeterminedBy::Prior { PRIOR } else { "" };
    let of = match change.quantity {
        LineQuantity::Point => format!("{} in {}", change.axis, change.coordinate),
        LineQuantity::Direction => format!("direction of {} in {}", change.axis, change.coordinate),
        LineQuantity::Zero => format!("zero of {}", change.axis),
    };
    format!("{of} {}{mark}", quantity(&format!("{value} ± {u}"), &change.unit))
}

/// What to measure next, and the commands for it: its program, if the axes of the machine have letters.
fn measure(statement: &MeasureStatement, machine: Option<&Machine>, commands: &Commands) -> Vec<Sentence> {
    let command = |verb: &str, options: &str| commands.command(verb, options);
    let plan = |purpose: &str| {
        let what = format!("What to measure next: the test that {purpose}");
        let declared = commands.declare_effects();
        let mut sentences = vec![what.into()];
        sentences.extend(declared.map(|command| Sentence::Command(command, "declares the effects,".into())));
        if !commands.plan_writes() {
            sentences.push(Sentence::Command(commands.plan("--improve"), "describes the test".into()));
            return sentences;
        }
        let written = commands.plan(&format!("--improve --write {}", commands.beside(NEXT)));
        let has_program = machine.is_some_and(has_letters);
        let words = if has_program { "writes the test," } else { "writes the test" };
        sentences.push(Sentence::Command(written, words.into()));
        if has_program {
            let options = format!("--control CONTROL --out {}", commands.beside(PROGRAMS));
            sentences.push(Sentence::Command(commands.on(NEXT, "nc", &options), "its program".into()));
        }
        sentences
    };
    let one = |what: &str| vec![format!("What to measure next: {what}").into()];
    match statement.step {
        NextStep::CorrectSession => one("nothing before the session is corrected: the readings contradict it"),
        NextStep::CheckUnit => {
            let likely = statement.description.as_ref().map_or(String::new(), |likely| format!(": {likely}"));
            one(&format!("nothing before the unit of the readings is checked{likely}"))
        }
        NextStep::Trace => one(&format!("nothing before {}", command("trace", ""))),
        NextStep::StateNoise => one("a run once more, or state the noise: only then can the model be judged"),
        NextStep::SeparatingTest => {
            let test = statement.description.as_deref().unwrap_or_default();
            let written = command("trace", &format!("--next {} --control CONTROL", commands.beside(MEASURE)));
            let what = "writes the test, its program and its sheet".to_string();
            vec![format!("What to measure next: {test}").into(), Sentence::Command(written, what)]
        }
        NextStep::Identify => plan(IDENTIFIES),
        NextStep::Improve => plan(IMPROVES),
        NextStep::AllDetermined => {
            let rank = statement.description.as_deref().unwrap_or_default();
            one(&format!("nothing new; all that this instrument can determine is determined ({rank})"))
        }
        NextStep::Nothing => one("no candidate test is known for this instrument"),
        NextStep::NoneHelps => one("no candidate test makes the confounded parameters identifiable"),
        NextStep::Refit => {
            let saved = command("trace", &format!("--save {}", commands.beside(TRACED_MODEL)));
            one(&format!("nothing before {saved}, which identifies the machine anew"))
        }
        NextStep::WidenRange => one("a session that covers the range of these readings"),
        NextStep::Repeat => one("the session once more"),
        NextStep::NextCheck => one("the next check"),
    }
}

/// `12.1 ± 1.9 µm`.
fn estimate(value: f64, u: f64, unit: &str) -> String {
    let (value, u) = value_and_u(value, u);
    quantity(&format!("{value} ± {u}"), unit)
}

/// The statements of a plan: what it identifies, what limits it.
pub fn of_plan(
    statements: &Statements<PlanStatement, Contribution>,
    analysis: &PlanAnalysis,
    machine: &Machine,
    commands: &Commands,
) -> Vec<Sentence> {
    let PlanStatement { errors, not_identifiable, determined_by_prior, .. } = &statements.good;
    let mut good = match not_identifiable.len() {
        0 if *errors == 1 => "The plan identifies its 1 error".to_string(),
        0 => format!("The plan identifies all of its {}", counted(*errors, "error")),
        _ => format!(
            "The plan does not identify {} of {}",
            first_of(not_identifiable, NAMED, ", ", "further error"),
            counted(*errors, "error")
        ),
    };
    if !determined_by_prior.is_empty() {
        good += &format!(", {} by the set-up priors only", first_of(determined_by_prior, NAMED, ", ", "further error"));
    }
    let worst = analysis.worst();
    good += &worst.map_or(String::new(), |error| format!("; {}", worst_determined(error)));
    let correct = match (statements.correct.as_slice(), worst) {
        (_, None) => "nothing; no error is identifiable".to_string(),
        ([], Some(error)) => format!(
            "nothing of the set-up; the noise limits {}: it contributes {} of the variance, more readings reduce it",
            error.id,
            percent(error.noise_share())
        ),
        (parts, Some(error)) => format!(
            "the set-up, which limits {}: {}, noise {} of the variance; {}",
            error.id,
            parts.iter().map(|part| format!("{} {}", part.source, percent(part.share))).collect::<Vec<_>>().join(", "),
            percent(error.noise_share()),
            if error.noise_share() < MIN_NOISE_SHARE {
                "more readings do not reduce it"
            } else {
                "more readings reduce only the part of the noise"
            }
        ),
    };
    let mut sentences = vec![good.into(), format!("What to correct: {correct}").into()];
    sentences.extend(measure(&statements.measure, Some(machine), commands));
    sentences
}

/// The worst determined error of a plan, with its uncertainty.
fn worst_determined(error: &ErrorAnalysis) -> String {
    let u = error.u.unwrap_or_default();
    format!(
        "{} is worst determined: u = {} (U = {})",
        error.id,
        quantity(&three_digits(u), &error.unit),
        quantity(&three_digits(2.0 * u), &error.unit)
    )
}

fn percent(share: f64) -> String {
    let percent = share * 100.0;
    if percent > 0.0 && percent < 1.0 { "< 1 %".to_string() } else { format!("{percent:.0} %") }
}

fn changed_by(change: &ParameterChange) -> String {
    estimate(change.value, change.u, &change.unit)
}

/// What has changed, what to correct and to measure after a validation.
pub fn of_validation(
    statements: &Statements<ValidationStatement, MovedParameter>,
    result: &ValidationResult,
    commands: &Commands,
) -> Vec<Sentence> {
    if let Some(own) = &result.not_judged {
        return before_validation(own, commands);
    }
    let outside = &result.outside;
    let moved = statements
        .changed
        .iter()
        .map(|MovedParameter { change, .. }| format!("{} has moved by {}", change.id, changed_by(change)));
    let mut sentences: Vec<Sentence> = Vec::new();
    if !statements.changed.is_empty() {
        let volume = match result.volumetric_rms_um[..] {
            [before, after] => format!("{}; ", volumetric(before, after, 0.0)),
            _ => String::new(),
        };
        let moved = first_of(&moved.collect::<Vec<_>>(), NAMED, ", ", "further parameter");
        sentences.push(format!("What has changed: {volume}{moved}").into());
    }
    let correct = match (statements.changed.is_empty(), statements.good.verdict) {
        (false, _) => "nothing from a change alone; a model of these readings states the errors that remain",
        (true, ValidationVerdict::Holds | ValidationVerdict::HoldsInRange) => "nothing; no parameter has moved",
        (true, ValidationVerdict::Degraded | ValidationVerdict::DoesNotHold) => {
            "no single parameter; the model lacks what these readings show"
        }
    };
    sentences.push(format!("What to correct: {correct}").into());
    match statements.measure.step {
        NextStep::WidenRange => sentences.push(
            format!(
                "What to measure next: a session to identify from that covers the range of these readings ({})",
                outside.join(", ")
            )
            .into(),
        ),
        NextStep::Nothing => sentences.push("What to measure next: nothing; the model holds".to_string().into()),
        _ => sentences.extend(measure(&statements.measure, None, commands)),
    }
    sentences
}

/// What comes before a validation of a model that itself lacks an effect.
fn before_validation(own: &ModelNotJudged, commands: &Commands) -> Vec<Sentence> {
    let of_session = commands.for_session(Path::new(&own.session));
    let (next, command, words) = match own.is_traced {
        false => (
            "nothing before a trace of the model's own session, whose model takes its place",
            of_session.command("trace", &format!("--save {}", of_session.beside(TRACED_MODEL))),
            "finds the effect behind the model",
        ),
        true => (
            "the test that separates the effects which the trace of the model's own session left open",
            of_session.command("trace", ""),
            "states what the model still lacks",
        ),
    };
    vec![
        not_judged("the model", own.birge_ratio, &own.why).into(),
        NOTHING_YET.to_string().into(),
        format!("What to measure next: {next}").into(),
        Sentence::Command(command, words.to_string()),
    ]
}

/// That no difference from a model that lacks an effect is judged.
fn not_judged(name: &str, birge_ratio: f64, why: &str) -> String {
    format!(
        "What has changed: not judged, because of {name} (χ²/ν = {}). There {why}",
        three_digits(birge_ratio.powi(2))
    )
}

/// What has changed, what to correct and to measure after a comparison.
pub fn of_comparison(
    comparison: &Comparison,
    statements: &Statements<ComparisonStatement, Difference>,
    commands: &Commands,
) -> Vec<Sentence> {
    let last = comparison.inputs.last().map_or("", String::as_str);
    let changed =
        statements.changed.iter().map(|Difference { change, .. }| format!("{} {}", change.id, changed_by(change)));
    let single: Vec<String> = (comparison.pairs.iter().filter(|pair| pair.significant > 1))
        .flat_map(|pair| &pair.single_changes)
        .map(|one| format!("{} {} (probability {})", one.change.id, changed_by(&one.change), percent(one.probability)))
        .collect();
    let changed = match statements.changed.is_empty() {
        true => "nothing significant".to_string(),
        // Several parameters of one gauge may be one change.
        false if comparison.pairs.len() == 1 && !single.is_empty() => {
            format!(
                "one parameter explains all differences: {}",
                first_of(&single, NAMED, ", or ", "further explanation")
            )
        }
        false => first_of(&changed.collect::<Vec<_>>(), NAMED, ", ", "further difference"),
    };
    let correct =
        format!("What to correct: nothing from a change alone; the estimates of {last} state the errors that remain");
    let next = match statements.measure.step {
        NextStep::Repeat => {
            "the last session once more, mounted anew: it tells a change of the machine from one of the set-up"
        }
        NextStep::Trace => return before_comparison(comparison, commands),
        _ => "nothing before the next check",
    };
    vec![format!("What has changed: {changed}").into(), correct.into(), format!("What to measure next: {next}").into()]
}

/// What comes before a comparison of inputs of which one lacks an effect.
fn before_comparison(comparison: &Comparison, commands: &Commands) -> Vec<Sentence> {
    let mut sentences: Vec<Sentence> =
        (comparison.not_judged.iter()).map(|own| not_judged(&own.input, own.birge_ratio, &own.why).into()).collect();
    sentences.push(NOTHING_YET.to_string().into());
    sentences.push(
        "What to measure next: nothing before a trace, whose session takes the place in the comparison"
            .to_string()
            .into(),
    );
    let mut written: Vec<String> = Vec::new();
    for own in &comparison.not_judged {
        // A model has no readings.
        if !own.is_session {
            let words = "trace the session from which it was identified, save that model, and compare it instead";
            sentences.push(format!("{}: {words}", own.input).into());
            continue;
        }
        let of_session = commands.for_session(Path::new(&own.input));
        // Two sessions of one folder write two files.
        let beside = match of_session.beside(TRACED) {
            name if written.contains(&name) => {
                let stem = Path::new(&own.input).file_stem().unwrap_or_default().to_string_lossy();
                of_session.beside(&format!("{stem}-{TRACED}"))
            }
            name => name,
        };
        let command = of_session.command("trace", &format!("--write {beside}"));
        sentences.push(Sentence::Command(command, format!("finds the effect behind {}", own.input)));
        written.push(beside);
    }
    sentences
}

/// What to correct and to measure by a history; `check`, the machine whose next check is due first, and when.
#[cfg(feature = "fleet")]
pub fn of_history(
    statements: &HistoryStatements,
    check: Option<(&str, String)>,
    beyond_ten_years: bool,
    (followed, determined): (usize, usize),
) -> Vec<String> {
    let out = &statements.good.out_of_control;
    let is_unchanged = statements.correct.is_empty() && statements.changed.is_empty();
    let control = match out.len() {
        0 if is_unchanged && followed == 0 => {
            "Not judged: no parameter is determined in enough sessions to be followed".to_string()
        }
        0 if is_unchanged && followed < determined => {
            format!("No machine is out of control in the {followed} of {determined} parameters that are followed")
        }
        0 if is_unchanged => "No machine is out of control".to_string(),
        0 => "Within the limits of the control charts since the last change".to_string(),
        _ => format!("Out of control: {}", first_of(out, NAMED, ", ", "further machine")),
    };
    let several = statements.good.machines > 1;
    let in_words = |changed: &ChangedInHistory| {
        let of = if several { format!(" of {}", changed.machine_id) } else { String::new() };
        let drift = changed
            .drift_per_year
            .map(|drift| format!("drifts by {} a year", estimate(drift.value, drift.u, &changed.unit)));
        let shift =
            changed.shift.map(|shift| format!("has shifted by {}", estimate(shift.value, shift.u, &changed.unit)));
        let how = drift.into_iter().chain(shift).collect::<Vec<_>>().join(" and ");
        format!("{}{of} {how}", changed.id)
    };
    let listed = |list: &[ChangedInHistory]| {
        first_of(&list.iter().map(in_words).collect::<Vec<_>>(), NAMED, ", ", "further parameter")
    };
    let correct = match (statements.correct.is_empty(), statements.changed.is_empty()) {
        (true, true) if followed == 0 => "not judged".to_string(),
        (true, true) => "nothing; no parameter drifts or has shifted".to_string(),
        (true, false) => {
            format!("nothing. Explained by a compensation or an adjustment: {}", listed(&statements.changed))
        }
        (false, _) => listed(&statements.correct),
    };
    let next = match check {
        Some((machine, when)) => format!("{machine}, whose next check is due {when}"),
        None if beyond_ten_years => "nothing within ten years, if the drifts stay as they are".to_string(),
        None => "a further dated session of each machine: too few bound a drift, from which the next check follows"
            .to_string(),
    };
    vec![control, format!("What to correct: {correct}"), format!("What to measure next: {next}")]
}

/// The line of each axis in R: nominal, identified, change.
pub fn corrections(statements: &Statements) -> Table {
    let rows = statements.correct.iter().map(|change| {
        let [value, u] = Cell::estimate(change.change, change.u);
        let digits = match change.quantity {
            // Of a point in mm, those of its change in µm and three more.
            LineQuantity::Point => places(change.u) + 3,
            LineQuantity::Direction => DIRECTION_PLACES,
            // Of degrees, those of its change in arcseconds and four more; of mm, as of a point.
            LineQuantity::Zero => places(change.u) + if change.unit == "arcsec" { 4 } else { 3 },
        };
        let mark = match change.determined_by {
            DeterminedBy::Prior if change.exceeds_u() => PRIOR,
            _ if change.exceeds_u() && change.quotable => "*",
            _ => "",
        };
        let of = match change.quantity {
            LineQuantity::Zero => change.quantity.to_string(),
            _ => format!("{} {}", change.quantity, change.coordinate),
        };
        let (nominal, identified) = (fixed(change.nominal, digits), fixed(change.identified, digits));
        cells![&change.axis, of, nominal, identified, value, u, super::number::unit(&change.unit), mark]
    });
    let columns = ["axis", "in R", ">nominal", ">identified", ">change", ">u", "unit", ""];
    Table::new(columns, rows).titled(
        "Axes at zero: a point of each rotary axis in mm, the direction of each axis as a unit vector, its zero in degrees or mm, and \
         the change to enter",
    )
}

#[cfg(test)]
mod tests {
    use abbe::identify::results::{GoodStatement, Goodness, GoodnessVerdict};

    use super::*;

    /// What is not followed is not cleared.
    #[cfg(feature = "fleet")]
    #[test]
    fn a_history_clears_what_it_follows_alone() {
        let statements = crate::fleet::history::statements::statements(&[]);
        let said = |followed: usize| of_history(&statements, None, false, (followed, 18)).join("; ");
        assert!(said(18).starts_with("No machine is out of control; What to correct: nothing"), "{}", said(18));
        assert!(said(10).starts_with("No machine is out of control in the 10 of 18 parameters"), "{}", said(10));
        assert!(said(0).starts_with("Not judged: ") && said(0).contains("correct: not judged"), "{}", said(0));
    }

    /// A residual that is taken for noise may still have structure: the unit is in doubt only where it is.
    #[test]
    fn what_keeps_from_correcting_is_why_the_estimates_are_not_quotable() {
        for (not_judged, step, why) in [
            (None, NextStep::Trace, "effect that the model lacks"),
            (None, NextStep::CorrectSession, "what the readings contradict"),
            (Some(NotJudged::NoNoise), NextStep::Trace, "effect that the model lacks"),
            (Some(NotJudged::WrongUnit), NextStep::CheckUnit, "unit of the readings"),
        ] {
            let goodness = Goodness { not_judged, ..Goodness::default() }.with_verdict(GoodnessVerdict::Structured);
            let good = GoodStatement { goodness, ..GoodStatement::default() };
            let measure = step.into();
            let statements =
                Statements { good, correct: Vec::new(), changed: Vec::new(), further: Vec::new(), measure };
            assert!(correct(&statements).contains(why), "{}", correct(&statements));
        }
    }
}
