//! Whether readings and session belong together.
//!
//! A session states directions and order of axes, places of balls, lengths of bars, units of columns. This module names
//! the statements that the readings contradict, and the mistakes that explain the contradiction. Conflicts are:
//!
//! - set-up parameters far from their stated values, each (`pulls`) and all together;
//! - a residual of a hundred times the noise in every test, or of less than a tenth of the stated noise;
//! - poses of which the model explains less than 99 % of the variance (`poses`);
//! - orientations of poses of which the model leaves more than 3°;
//! - poses that a machine explains whose links differ from the stated ones, where the stated ones fit another reading of the file;
//! - axes more than 5 % of the link beside their place, or tilted by 0.05 rad, and zero angles above 10°, of poses
//!   (`locations`).
//!
//! Mistakes are found by refits of the session with one statement changed at a time (`hypotheses`, `suggest`).

pub mod coefficients;
mod hypotheses;
mod locations;
mod poses;
mod pulls;
mod quick_fit;
mod results;
mod suggest;

use abbe_model::Diagnostic;
use abbe_model::session::Session;
use abbe_model::unit::{RAD_PER_ARCSEC, Unit};
use abbe_model::words::first_of;
pub use pulls::{Pull, Pulls};
pub use results::{Conflict, ConflictKind, Plausibility, Suggestion, SuggestionKind};

use crate::error::{self, IMPLAUSIBLE, NO_CONVERGENCE};
use crate::fit::{Fit, ratio_of_another_unit};
use crate::heldout::{rms_by_unit_mm, rms_mm};
use crate::noise::NoiseSource;
use crate::problem::Problem;

/// Share of the variance of the measured positions that a model of poses explains at least.
const MIN_EXPLAINED: f64 = 0.99;
/// Residual of the measured orientations that a model of poses leaves at most, rad: 3°.
const MAX_TURNED: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Below this share, mistakes that explain more are searched.
const WELL_EXPLAINED: f64 = 0.9999;
/// They are searched too if the nominal machine leaves more than this share of the spread of the poses: errors of 5 mm and 1° of
/// every joint leave 0.02.
const FAR_FROM_NOMINAL: f64 = 0.1;
/// The readings are those of another session if the residual of every test is this many times the noise.
const ANOTHER_SESSION: f64 = 100.0;
/// Mistakes are searched if the residual is this many times the noise.
const CHECK_ABOVE_SIGMA: f64 = 5.0;
/// Largest factor that a warning states.
const LARGEST_FACTOR: f64 = 1e9;
/// Maximum number of set-up parameters that a warning names; it counts the others.
const MAX_NAMED: usize = 3;

/// The statements that the readings contradict, and the mistakes that explain it.
pub fn examine(problem: &Problem, fit: &Fit) -> Plausibility {
    let mut found = by_instrument(problem, fit);
    found.conflicts.splice(0..0, of_another_unit(problem, fit));
    found
}

/// The same without the unit of the readings.
fn by_instrument(problem: &Problem, fit: &Fit) -> Plausibility {
    if !problem.session.instruments().iter().any(|kind| kind.is_two_sided()) {
        return of_poses(problem, fit);
    }
    let mut conflicts: Vec<Conflict> = residual(problem, fit).into_iter().collect();
    let pulls = Pulls::of(problem, fit);
    conflicts.extend(set_ups(problem, &pulls));
    let by_residual = conflicts.is_empty();
    let ratio = rms_mm(problem, &fit.residuals) / problem.noise.sigma_mm;
    if by_residual && ratio < CHECK_ABOVE_SIGMA {
        return Plausibility::default();
    }
    let suggestions = suggest::suggestions(problem, &conflicts, pulls.allowed());
    if by_residual && let Some(best) = suggestions.first() {
        let rms_um = rms_mm(problem, &fit.residuals) * 1e3;
        conflicts.push(statement(problem, "session", rms_um, best));
    }
    Plausibility { conflicts, suggestions, explained_variance: None }
}

/// The fit unchanged, or an error where the readings cannot belong to the session. The error names the mistakes that
/// may explain it.
///
/// # Errors
/// If the fit failed, or nothing is identifiable.
pub(crate) fn checked(problem: &Problem, fit: Result<Fit, Diagnostic>) -> Result<Fit, Diagnostic> {
    let mut failed = None;
    let found = match fit {
        // Noise that is stated may well be larger than anything that the tests show.
        Ok(fit)
            if fit.rank.identifiable_basis.ncols() > 0
                || problem.parameters.list.is_empty()
                || problem.noise.source == NoiseSource::Stated =>
        {
            return Ok(fit);
        }
        Ok(_) => format!(
            "none of the {} parameters is identifiable: the nominal machine leaves {:.3e} {}",
            problem.parameters.list.len(),
            problem.noise.sigma_mm * 1e3,
            problem.unit().symbol()
        ),
        // The diagnosis takes the place of the advice of this error.
        Err(error) if error.code == NO_CONVERGENCE => {
            let found = error.message.split("; ").next().unwrap_or_default().to_string();
            failed = Some(error);
            found
        }
        Err(error) => return Err(error),
    };
    let suggestions = if problem.session.instruments().iter().any(|kind| kind.is_two_sided()) {
        suggest::suggestions(problem, &[], Pulls::default().allowed())
    } else {
        poses::suggestions(problem)
    };
    match (in_words(&suggestions), failed) {
        (Some(diagnosis), _) => Err(error::contradicted(found, diagnosis)),
        (None, Some(error)) => Err(error),
        (None, None) => {
            let check = "check the units, signs and order of the columns, and whether the data belong to this machine";
            Err(error::contradicted(found, check))
        }
    }
}

/// Refuses estimates that mean nothing and have a cause that was tested: axes of a robot far beside their place, where
/// another reading of the file lowers the residual of the nominal machine at least threefold. Without such a cause they
/// remain a warning.
///
/// # Errors
/// [`IMPLAUSIBLE`] with the conflict and its cause.
pub fn accepted(found: &Plausibility) -> Result<(), Diagnostic> {
    let conflict = found.conflicts.iter().find(|conflict| conflict.kind == ConflictKind::LocationError);
    match (conflict, in_words(&found.suggestions)) {
        (Some(conflict), Some(diagnosis)) => {
            Err(Diagnostic::coded(IMPLAUSIBLE, format!("{}; {diagnosis}", conflict.words)))
        }
        _ => Ok(()),
    }
}

/// One warning per conflict; set-up parameters share one. The last also names the mistakes that explain the conflicts.
pub fn warnings(plausibility: &Plausibility) -> Vec<String> {
    let is_parameter = |conflict: &&Conflict| conflict.kind == ConflictKind::SetupParameter;
    let conflicts = &plausibility.conflicts;
    let mut told: Vec<String> =
        (conflicts.iter()).filter(|conflict| !is_parameter(conflict)).map(|conflict| conflict.words.clone()).collect();
    let parameters: Vec<&str> =
        (conflicts.iter().filter(is_parameter)).map(|conflict| conflict.words.as_str()).collect();
    if !parameters.is_empty() {
        let named = first_of(&parameters, MAX_NAMED, "; ", "");
        told.push(format!("the readings contradict the stated set-up: {named}"));
    }
    if let (Some(last), Some(words)) = (told.last_mut(), in_words(&plausibility.suggestions)) {
        *last = format!("{last}; {words}");
    }
    told
}

/// The mistakes that may explain what was found, in one sentence.
pub fn explained(plausibility: &Plausibility) -> Option<String> {
    in_words(&plausibility.suggestions)
}

/// The mistakes that may explain the conflicts, in one sentence; those of one kind share a clause.
pub(crate) fn in_words(suggestions: &[Suggestion]) -> Option<String> {
    let mut kinds: Vec<SuggestionKind> = Vec::new();
    for suggestion in suggestions {
        if !kinds.contains(&suggestion.kind) {
            kinds.push(suggestion.kind);
        }
    }
    let clauses: Vec<String> = (kinds.iter())
        .map(|kind| {
            let of_kind = suggestions.iter().filter(|suggestion| suggestion.kind == *kind);
            one_clause(&of_kind.map(|suggestion| suggestion.words.as_str()).collect::<Vec<&str>>())
        })
        .collect();
    (!clauses.is_empty()).then(|| format!("this would be explained if {}", clauses.join(", or if ")))
}

/// Clauses as one that states their common beginning and end once: "the direction of axis A or Z is reversed".
fn one_clause(clauses: &[&str]) -> String {
    let words: Vec<Vec<&str>> = (clauses.iter()).map(|clause| clause.split(' ').collect()).collect();
    let shortest = words.iter().map(Vec::len).min().unwrap_or(0);
    let first = &words[0];
    let begin = (0..shortest).take_while(|i| words.iter().all(|other| other[*i] == first[*i])).count();
    // A clause with a part of its own keeps its end.
    let has_parts = clauses.iter().any(|clause| clause.contains(','));
    let most = if has_parts { 0 } else { shortest.saturating_sub(begin + 1) };
    let end =
        (1..=most).take_while(|i| words.iter().all(|other| other[other.len() - i] == first[first.len() - i])).count();
    let middles: Vec<String> = (words.iter()).map(|words| words[begin..words.len() - end].join(" ")).collect();
    let (Some((last, others)), true) = (middles.split_last(), words.len() > 1 && begin + end > 0) else {
        return clauses.join(" or ");
    };
    let middle = match has_parts {
        true => format!("{}; or {last}", others.join("; ")),
        false => format!("{} or {last}", others.join(", ")),
    };
    let parts = [first[..begin].join(" "), middle, first[first.len() - end..].join(" ")];
    let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    parts.join(" ")
}

/// One statement changed lowers the residual, µm, that the session or the nominal machine leaves.
fn statement(problem: &Problem, left_by: &str, rms_um: f64, best: &Suggestion) -> Conflict {
    Conflict {
        kind: ConflictKind::Statement,
        subject: "session".to_string(),
        value: rms_um,
        stated: best.rms_um,
        unit: "um".to_string(),
        pull: None,
        words: format!(
            "the {left_by} leaves a residual of {}; with one statement changed it leaves {}",
            problem.unit().text(rms_um, 3),
            problem.unit().text(best.rms_um, 3)
        ),
    }
}

/// A residual of a hundred times the noise in every test.
fn residual(problem: &Problem, fit: &Fit) -> Option<Conflict> {
    let noise = problem.noise.sigma_mm;
    if problem.noise.source == NoiseSource::Residual || noise <= 0.0 {
        return None;
    }
    let of_test = |number: usize| {
        let kept = fit.residuals[number].iter().enumerate().filter(|(i, _)| problem.counts(number, *i));
        let (sum, count) = kept.fold((0.0, 0_usize), |(sum, count), (_, value)| (sum + value * value, count + 1));
        (count > 0).then(|| (sum / count as f64).sqrt())
    };
    let least = (0..problem.tests.len()).filter_map(of_test).fold(f64::INFINITY, f64::min);
    (least.is_finite() && least >= ANOTHER_SESSION * noise).then(|| Conflict {
        kind: ConflictKind::Residual,
        subject: "session".to_string(),
        value: rms_mm(problem, &fit.residuals) * 1e3,
        stated: noise * 1e3,
        unit: "um".to_string(),
        pull: None,
        words: format!(
            "the residual of every test is at least {:.0} times the noise of {:.3} µm: the readings do not belong to this session",
            least / noise,
            noise * 1e3
        ),
    })
}

/// Units in which readings are likely, in the form "mm in a column named µm", by the share that the residual is of the stated noise.
const OF_LENGTHS: [(f64, &str); 2] = [
    (1e-3, "mm in a column named µm, or m in one named mm"),
    (1.0 / 25.4, "inches in a column named mm, or thousandths of an inch in one named µm"),
];
const OF_ANGLES: [(f64, &str); 3] = [
    (1.0 / 60.0, "arcminutes in a column named arcsec, or radians in one named degrees"),
    (1.0 / 3600.0, "degrees in a column named arcsec"),
    (RAD_PER_ARCSEC, "radians in a column named arcsec"),
];

/// The unit in which readings are likely whose residual is this share of the stated noise.
pub(crate) fn likely_unit(share: f64, unit: Unit) -> &'static str {
    let known: &[(f64, &str)] = if unit.is_micrometre() { &OF_LENGTHS } else { &OF_ANGLES };
    let away = |factor: f64| (share.max(f64::MIN_POSITIVE) / factor).ln().abs();
    known.iter().min_by(|a, b| away(a.0).total_cmp(&away(b.0))).map_or("", |(_, words)| words)
}

/// A residual of less than a tenth of the stated noise.
fn of_another_unit(problem: &Problem, fit: &Fit) -> Option<Conflict> {
    let ratio = ratio_of_another_unit(problem, fit)?;
    let (stated_mm, unit) = (problem.session.stated_noise_mm()?, problem.unit());
    Some(Conflict {
        kind: ConflictKind::Unit,
        subject: "session".to_string(),
        value: ratio * stated_mm * 1e3,
        stated: stated_mm * 1e3,
        unit: unit.name().to_string(),
        pull: None,
        words: format!(
            "the residual is {:.0} times smaller than the stated noise of {}: the readings are probably in another unit than \
             the name of their column states (possibly {}), or were divided before; check them, or `noise_{unit}`",
            ratio.max(f64::MIN_POSITIVE).recip().min(LARGEST_FACTOR),
            unit.text(stated_mm * 1e3, 3),
            likely_unit(ratio, unit),
        ),
    })
}

/// Set-up parameters that contradict their statements, or all of them together.
fn set_ups(problem: &Problem, pulls: &Pulls) -> Vec<Conflict> {
    let conflicts: Vec<Conflict> = (pulls.contradicted().into_iter())
        .map(|pull| {
            let parameter = &problem.parameters.list[pull.parameter];
            let outside = |value: f64| value * parameter.unit.display_per_internal;
            Conflict {
                kind: ConflictKind::SetupParameter,
                subject: parameter.id.to_string(),
                value: outside(pull.estimate),
                stated: outside(pull.stated_u),
                unit: parameter.unit.name.clone(),
                pull: Some(pull.pull),
                words: format!(
                    "{} is {:.1} {} off where u = {} {} is stated ({:.1} standard deviations)",
                    parameter.id,
                    outside(pull.estimate),
                    parameter.unit.symbol(),
                    outside(pull.stated_u),
                    parameter.unit.symbol(),
                    pull.pull.abs()
                ),
            }
        })
        .collect();
    if !conflicts.is_empty() || !pulls.contradicted_together() {
        return conflicts;
    }
    vec![Conflict {
        kind: ConflictKind::Setups,
        subject: "session".to_string(),
        value: pulls.together,
        stated: pulls.freedom as f64,
        unit: "1".to_string(),
        pull: None,
        words: format!(
            "the set-up parameters together lie too far from their stated values (χ² = {:.1} with {} degrees of freedom)",
            pulls.together, pulls.freedom
        ),
    }]
}

/// What the nominal machine leaves of the spread (mm²) of poses where the iterations start: with the set-up that is found before
/// them. A fit of the set-up leaves no more.
fn share_at_start(problem: &Problem, spread_mm2: f64) -> f64 {
    let start = problem.residuals(&vec![0.0; problem.parameters.list.len()]);
    let [lengths_mm, angles_mm] = rms_by_unit_mm(problem, &start).map(|rms| rms.unwrap_or(0.0));
    (lengths_mm / spread_mm2.sqrt()).hypot(angles_mm / problem.session.lever_mm)
}

/// Poses: what the model explains of the spread of the measured positions.
fn of_poses(problem: &Problem, fit: &Fit) -> Plausibility {
    let channels = problem.channels(0) as f64;
    let Some(spread) = poses::spread_mm2(problem) else {
        return Plausibility::default();
    };
    let left = channels * rms_mm(problem, &fit.residuals).powi(2);
    let explained = 1.0 - left / spread;
    // Links that shrink to nothing explain positions in another unit, too.
    let locations = locations::conflicts(problem, fit);
    let of_angles = rms_by_unit_mm(problem, &fit.residuals)[1].map(|mm| mm / problem.session.lever_mm);
    let turned = of_angles.filter(|rad| *rad > MAX_TURNED);
    let is_contradicted = explained < WELL_EXPLAINED || turned.is_some() || !locations.is_empty();
    // Links of another shape may explain all, as where every joint has the opposite sign.
    let is_far = |left: &poses::Left| left.share > FAR_FROM_NOMINAL;
    let is_tried = !is_contradicted && share_at_start(problem, spread) > FAR_FROM_NOMINAL;
    let nominal = if is_tried { poses::left_by_nominal(problem).filter(is_far) } else { None };
    let is_searched = is_contradicted || nominal.is_some();
    let suggestions = if is_searched { poses::suggestions(problem) } else { Vec::new() };
    let little = explained < MIN_EXPLAINED;
    let mut conflicts = if let (Some(nominal), Some(best)) = (nominal, suggestions.first()) {
        vec![statement(problem, "nominal machine", nominal.rms_mm * 1e3, best)]
    } else if little || !suggestions.is_empty() {
        vec![Conflict {
            kind: ConflictKind::ExplainedVariance,
            subject: "session".to_string(),
            value: explained,
            stated: MIN_EXPLAINED,
            unit: "1".to_string(),
            pull: None,
            words: format!(
                "the model explains {:.2} % of the variance of the measured positions: the 3-vector residual is {:.3} mm, the positions scatter by {:.3} mm",
                100.0 * explained,
                left.sqrt(),
                spread.sqrt()
            ),
        }]
    } else {
        Vec::new()
    };
    conflicts.extend(turned.map(|rad| Conflict {
        kind: ConflictKind::Orientations,
        subject: "session".to_string(),
        value: rad.to_degrees(),
        stated: MAX_TURNED.to_degrees(),
        unit: "deg".to_string(),
        pull: None,
        words: format!("the model leaves a residual of {:.1}° in the measured angles", rad.to_degrees()),
    }));
    conflicts.extend(locations);
    Plausibility { conflicts, suggestions, explained_variance: Some(explained) }
}

/// What the nominal machine leaves of the readings with the set-up alone estimated: for poses the share of their spread, for
/// others the residual, mm. Ways to read one file are compared by it. `None` if the set-up cannot be estimated.
pub fn nominal_misfit(session: &Session) -> Option<f64> {
    poses::nominal_misfit(session)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;

    use super::{ANOTHER_SESSION, ConflictKind, one_clause, residual};
    use crate::fit::prepare;

    /// The test with the least residual decides: 99 times its noise is an effect, 101 times another session.
    #[test]
    fn readings_of_another_session_leave_a_residual_in_every_test() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/measured/session.toml");
        let (mut problem, fit) = prepare(&abbe_files::session(&file, &ReadOptions::default()).unwrap(), 1).unwrap();
        let rms = |residuals: &Vec<f64>| {
            (residuals.iter().map(|value| value * value).sum::<f64>() / residuals.len() as f64).sqrt()
        };
        let least = fit.residuals.iter().map(rms).fold(f64::INFINITY, f64::min);
        assert!(problem.rejected.iter().flatten().all(|rejected| !rejected), "no outliers");
        for (times, is_another) in [(0.99, false), (1.01, true)] {
            problem.noise.sigma_mm = least / (times * ANOTHER_SESSION);
            let found = residual(&problem, &fit);
            assert_eq!(found.map(|conflict| conflict.kind), is_another.then_some(ConflictKind::Residual), "{times}");
        }
    }

    #[test]
    fn clauses_of_one_kind_share_their_words() {
        let axis = |name: &str| format!("the direction of axis {name} is reversed");
        assert_eq!(one_clause(&[&axis("A")]), axis("A"));
        assert_eq!(one_clause(&[&axis("A"), &axis("Z")]), axis("A or Z"));
        assert_eq!(
            one_clause(&[
                "the bar of C150 is not as it is stated",
                "the spindle ball of C150 is not as it is stated",
                "the workpiece ball of P1 is not as it is stated",
            ]),
            "the bar of C150, spindle ball of C150 or workpiece ball of P1 is not as it is stated"
        );
        assert_eq!(one_clause(&["one", "another case"]), "one or another case");
        assert_eq!(
            one_clause(&[
                "P was moved before B",
                "P was moved before A, for B and C too",
                "P was moved before B, for C too"
            ]),
            "P was moved before B; A, for B and C too; or B, for C too"
        );
    }
}
