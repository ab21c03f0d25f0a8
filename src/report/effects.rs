//! Effects that a trace has found, each beside its competing explanations: values, uniqueness, and the tests that separate
//! them from their aliases.

use abbe::identify::results::Estimate;
use abbe::model::parameter_id::ParameterId;
use abbe::model::words::{counted, listed, with_exponent};
use abbe::trace::TraceOutcome;
use abbe::trace::alias::CompetingEffect;
use abbe::trace::result::{
    AliasResult, EffectName, EffectResult, PriorResult, SeparatingTestResult, ShapeParameter, TraceResult,
};

use super::block::{Level, Report, Text};
use super::figure::bars::{ALIAS, NAMED, OTHER, bars};
use super::figure::lines::{Axis, Lines, Mark, Name, Series};
use super::figure::scale::{Scale, span};
use super::figure::{Figure, Quantity};
use super::number::{integer, of_readings, p_value, quantity, shape_number, unit, value_and_u};
use super::table::{Cell, Column, Table, cells};

/// Maximum number of effects that are shown unfolded.
const MAX_OPEN: usize = 4;
/// Maximum number of effects with a plot of their competing explanations.
const MAX_RANKED: usize = 12;
/// Number of additions up to which the points of the convergence plot have names.
const MAX_NAMED: usize = 8;

/// The section of found effects, rejected candidates, remaining structure and convergence of the search.
pub fn section(report: &mut Report, outcome: &TraceOutcome) {
    let result = &outcome.result;
    report.section("Effects and competing explanations");
    if result.effects.is_empty() {
        report.page("The search added no effect.");
    }
    for (number, effect) in result.effects.iter().enumerate() {
        let heading = format!("{}. {} ({})", number + 1, name(&effect.name), effect.name.meaning);
        report.key(if number < MAX_OPEN { Text::Heading(heading) } else { Text::Fold(heading) });
        report.key(values(effect, &screened(result), result.effects.len() == 1));
        alternatives(report, effect, result.candidates_detectable);
        let id = outcome.effects.get(number).map(|effect| effect.id()).unwrap_or_default();
        let competing = outcome.competing_effects.get(number).filter(|_| number < MAX_RANKED);
        report.figures((!effect.curve.is_empty()).then(|| curve(effect)));
        report.figures(competing.map(|competing| ranking(competing, &id)));
    }
    report.folded("Families of effects that were searched", Text::List(result.families.clone()));
    let rejected = Text::List(rejected(result));
    report.headed(Level::Key, "Rejected, because the held-out error does not decrease significantly:", rejected);
    if let Some(remainder) = remainder(result) {
        report.key(Text::Heading(format!("Remaining structure {remainder}")));
    }
    if !outcome.steps.is_empty() {
        report.page(Text::Heading("Convergence of the search".to_string()));
        report.figures([convergence(outcome)]);
    }
}

/// What the effect is, explains, and competes with.
fn values(effect: &EffectResult, screened: &str, is_alone: bool) -> Table {
    let mut rows = vec![cells!["estimate", estimate(effect)]];
    rows.extend(effect.prior.iter().map(|prior| cells!["prior", prior_in_words(prior)]));
    let explains = format!("{} rms ({})", of_readings(effect.rms_gain_um, effect.unit), p_value(effect.p_value));
    rows.push(cells!["explains", explains]);
    // Of a single effect it stands among the key figures.
    if !is_alone {
        rows.push(cells![
            "held-out rms",
            format!("{} with this effect", of_readings(effect.heldout_rms_um, effect.unit))
        ]);
    }
    rows.push(cells!["family", &effect.family]);
    let standing = standing(effect, screened);
    rows.push(cells!["uniqueness", format!("{standing}{}", also(&effect.variants))]);
    Table::new(["", ""], rows)
}

/// The part of an effect that a parameter is.
fn part(parameter: &Estimate) -> String {
    let id = parameter.id.parse::<ParameterId>().ok();
    id.as_ref().and_then(ParameterId::part).map(ToString::to_string).unwrap_or_default()
}

/// Coefficients with their standard uncertainties, and chosen numbers of the shape.
pub fn estimate(effect: &EffectResult) -> String {
    if !effect.curve.is_empty() && effect.prior.is_none() {
        return "nonparametric curve, see the plot".to_string();
    }
    let values = effect.parameters.iter().map(|parameter| {
        let (value, u) = value_and_u(parameter.value, parameter.u);
        let coefficient = part(parameter);
        let separator = if coefficient.ends_with(|c: char| c.is_ascii_digit()) { ":" } else { "" };
        let value = quantity(&format!("{value} ± {u}"), &parameter.unit);
        format!("{coefficient}{separator} {value}").trim().to_string()
    });
    // Estimated numbers are among the parameters, of several positions each with its number.
    let is_fixed = |number: &&ShapeParameter| {
        let name = if number.name == "time constant" { "tau" } else { &number.name };
        let names = [name.to_string(), format!("{name}1")];
        !effect.parameters.iter().any(|parameter| names.contains(&part(parameter)))
    };
    let numbers = effect.shape_parameters.iter().filter(is_fixed).map(shape_number);
    values.chain(numbers).collect::<Vec<_>>().join(", ")
}

/// Explanations that the readings do not separate, with the separation from each that further tests achieve.
fn alternatives(report: &mut Report, effect: &EffectResult, screened: usize) {
    if effect.prior.is_some() {
        return;
    }
    if effect.unique {
        let screened = integer(screened);
        report.page(format!(
            "No other of the {screened} candidates explains the residual as well in place of this effect."
        ));
        return;
    }
    let line = |(place, alias): (usize, &AliasResult)| {
        let predicted = worse_prediction(effect, place);
        format!(
            "or {}{}  ({}); {}{}",
            alias.name.meaning,
            also(&alias.variants),
            name(&alias.name),
            likelihood(alias),
            predicted.map_or(String::new(), |words| format!("; {words}"))
        )
    };
    report.brief(Text::List(effect.aliases.iter().enumerate().map(line).collect()));
    report.detail(explanations(effect));
    let tests = effect.separating_tests.iter().enumerate();
    let tests = tests.map(|(k, test)| format!("test {}: {} ({:.0} min)", k + 1, test.test, test.duration_min));
    let mut tests: Vec<String> = tests.collect();
    match tests.is_empty() {
        true => tests.push("No proposed test separates these explanations.".into()),
        false => tests.push(
            "Separation from the selected effect in standard deviations: by the present readings → with the test. A test \
             separates from 3 σ on."
                .into(),
        ),
    }
    report.page(Text::List(tests));
}

/// The effect and its aliases: likelihood, prediction of left-out tests, and what each proposed test achieves.
fn explanations(effect: &EffectResult) -> Table {
    let predicts = effect.left_out_test_rms_um.is_some();
    let row = |name_of: &EffectName,
               variants: &[EffectName],
               likelihood: String,
               predicted: Option<f64>,
               outcomes: Vec<String>| {
        let mut row = cells![format!("{}{} ({})", name_of.meaning, also(variants), name(name_of)), likelihood];
        row.extend(predicts.then(|| Cell::or_dash(predicted.map(|um| of_readings(um, effect.unit).into()))));
        row.extend(outcomes.into_iter().map(Cell::from));
        row
    };
    let tests = &effect.separating_tests;
    let own = row(
        &effect.name,
        &effect.variants,
        "selected".into(),
        effect.left_out_test_rms_um,
        vec!["selected".into(); tests.len()],
    );
    let aliases = effect.aliases.iter().enumerate().map(|(place, alias)| {
        let predicted = effect.aliases_left_out_test_rms_um.get(place).copied().flatten();
        let outcomes = tests.iter().map(|test| separation(&alias.name, test)).collect();
        row(&alias.name, &alias.variants, likelihood(alias), predicted, outcomes)
    });
    let mut columns = ["explanation", "in place of the selected effect"].map(Column::from).to_vec();
    columns.extend(predicts.then(|| Column::from("left-out test")));
    columns.extend((1..=tests.len()).map(|number| super::table::words(format!("with test {number}"))));
    Table::new(columns, std::iter::once(own).chain(aliases))
}

/// Separation of the selected effect from an alternative by a test.
fn separation(alias: &EffectName, test: &SeparatingTestResult) -> String {
    let found = test.alternatives.iter().find(|alternative| &alternative.name == alias);
    found.map_or("separated before".to_string(), |alternative| {
        let sign = if alternative.separated { "✓" } else { "✗" };
        format!("{sign} {:.1} → {:.1} σ", alternative.before_sigma, alternative.after_sigma)
    })
}

/// Nonparametric curve with a band of ± 2 u.
fn curve(effect: &EffectResult) -> Figure {
    let line = |multiple: f64| {
        let points = effect.curve.iter();
        points.map(|p| (p.at, p.value + multiple * p.u)).collect::<Vec<_>>()
    };
    let values = effect.curve.iter().flat_map(|p| [p.value - 2.0 * p.u, p.value + 2.0 * p.u]);
    let name = &effect.name;
    let mut series = vec![
        Series::new("curve", "after", Mark::Line, line(0.0)),
        Series::new("± 2 u", "found-line", Mark::Line, line(2.0)),
        Series::new("± 2 u", "found-line", Mark::Line, line(-2.0)),
    ];
    // A point for each value of the driver without a reading nearby.
    let extrapolated: Vec<(f64, f64)> =
        effect.curve.iter().filter(|p| p.extrapolated).map(|p| (p.at, p.value)).collect();
    let mut caption = "The curve excludes the components that are collinear with location errors.".to_string();
    if !extrapolated.is_empty() {
        caption += " Points: no reading lies nearby; the prior determines the curve.";
        series.push(Series::new("extrapolated", "dot-before", Mark::Dots, extrapolated));
    }
    let lines = Lines::new(
        Axis::new(&name.driver, &effect.curve_at_unit, Scale::over(span(effect.curve.iter().map(|p| p.at)), 8)),
        Axis::new(&name.component, &effect.curve_unit, Scale::with_zero(span(values), 6)),
        series,
    );
    Figure::new(
        format!("curve-{}-{}", name.component, name.driver),
        format!("{} over {}", name.component, name.driver),
        caption,
        lines,
    )
}

/// Held-out error after each addition of the search.
fn convergence(trace: &TraceOutcome) -> Figure {
    let (before, unit) = (trace.result.before.fit.heldout_rms_um, trace.result.reading_unit);
    let mut points = vec![(0.0, before)];
    points.extend(trace.steps.iter().enumerate().map(|(k, step)| (k as f64 + 1.0, step.heldout_um)));
    let maximum = points.iter().map(|p| p.1).fold(0.0, f64::max);
    let steps = trace.steps.len() as f64;
    let shown = trace.steps.len() <= MAX_NAMED;
    let names = trace.steps.iter().map(|step| Name {
        text: step.id.clone(),
        note: format!("{}, {}", of_readings(step.heldout_um, unit), counted(step.effects, "effect")),
        shown,
    });
    // Names need space to the right of the last point.
    let x = Scale::over([0.0, if shown { 1.5 * steps } else { steps + 0.5 }], 10);
    let mut series =
        vec![Series { names: names.collect(), ..Series::new("held-out rms", "after", Mark::Line, points) }];
    let noise = trace.result.after.noise.value;
    if noise < maximum {
        let level = x.values.map(|at| (at, noise)).to_vec();
        series.push(Series::new("noise of a reading", "found-line", Mark::Line, level));
    }
    let lines = Lines::new(
        Axis::new("additions", "", Scale { step: x.step.max(1.0), ..x }),
        Axis::new("held-out rms", unit.name(), Scale::rounded([0.0, maximum * 1.05], 5)),
        series,
    );
    Figure::new(
        "convergence",
        "Convergence of the search",
        "Held-out error after each addition. Later steps can exchange an added effect.",
        lines,
    )
}

/// Evidence of the competing explanations of an effect.
fn ranking(competing: &[CompetingEffect], id: &str) -> Figure {
    let rows = competing.iter().map(|effect| {
        let fill = match (effect.named, effect.alias) {
            (true, _) => NAMED,
            (false, true) => ALIAS,
            (false, false) => OTHER,
        };
        (effect.id.clone(), effect.evidence, fill)
    });
    let rows: Vec<_> = rows.collect();
    let labels = [(NAMED, "selected"), (ALIAS, "indistinguishable"), (OTHER, "rejected")];
    Figure::new(
        format!("ranking-{id}"),
        format!("Competing explanations of {id}"),
        "Evidence together with the rest of the model: −ln P minus the complexity penalty.",
        bars(&Quantity::new("evidence, −ln P", ""), &rows, &labels),
    )
}

/// An effect by component, driver and shape.
pub fn name(effect: &EffectName) -> String {
    let order = effect.order.map_or(String::new(), |order| format!(" order {order}"));
    let tests = if effect.tests.is_empty() { String::new() } else { format!(" in {}", effect.tests.join(", ")) };
    format!("{} over {}: {}{order}{tests}", effect.component, effect.driver, effect.shape)
}

/// Explanations named in the headline.
const MAX_EXPLANATIONS: usize = 3;
/// Effects described one by one in the headline.
const MAX_LISTED: usize = 4;

/// What is said of an effect of a family.
const NOT_COMPARED: &str = "competing explanations are not compared";

/// What was compared: `27 families with 4098 candidates screened`.
pub fn screened(result: &TraceResult) -> String {
    let candidates = format!("{} candidates screened", result.candidates_detectable);
    match result.families.len() {
        0 => candidates,
        several => format!("{} with {candidates}", counted(several, "family")),
    }
}

/// The uniqueness of all effects in one line; `None` without an effect.
pub fn headline(result: &TraceResult) -> Option<String> {
    let screened = &screened(result);
    match result.effects.as_slice() {
        [] => None,
        all if all.iter().any(|effect| effect.prior.is_some()) => {
            let of_families = all.iter().filter(|effect| effect.prior.is_some()).count();
            Some(format!("{of_families} of the effects are members of families under a prior: {NOT_COMPARED}"))
        }
        [one] => Some(format!("{}: {}", standing(one, screened), in_short(one))),
        all if all.iter().all(|effect| effect.unique) => {
            Some(format!("{} effects, each unique among {screened}", all.len()))
        }
        few if few.len() <= MAX_LISTED => {
            let each = few.iter().enumerate();
            let each: Vec<String> =
                each.map(|(k, effect)| format!("effect {} is {}", k + 1, standing(effect, screened))).collect();
            Some(each.join("; "))
        }
        many => {
            let alike: Vec<usize> =
                many.iter().map(|effect| effect.explanation_count).filter(|count| *count > 1).collect();
            let unique = many.len() - alike.len();
            let most = alike.iter().copied().max().unwrap_or(1);
            Some(format!(
                "{} effects: {unique} unique among {screened}, {} with up to {most} indistinguishable explanations",
                many.len(),
                alike.len()
            ))
        }
    }
}

/// `1 of 9 indistinguishable explanations`, or `unique among 27 families with 4098 candidates screened`.
pub fn standing(effect: &EffectResult, screened: &str) -> String {
    if effect.prior.is_some() {
        format!("member of a family: {NOT_COMPARED}")
    } else if effect.unique {
        format!("unique among {screened}")
    } else {
        format!("1 of {} indistinguishable explanations", effect.explanation_count)
    }
}

/// Ratio of the left-out-test errors from which an alias is said to predict worse.
const WORSE: f64 = 1.01;

/// How an alias predicts left-out tests, if clearly worse than the effect: `left-out test 0.351 µm, with the effect
/// 0.305 µm`. `alias` is its index.
pub fn worse_prediction(effect: &EffectResult, alias: usize) -> Option<String> {
    let of_effect = effect.left_out_test_rms_um?;
    let of_alias = effect.aliases_left_out_test_rms_um.get(alias).copied().flatten()?;
    let [alias, own] = [of_alias, of_effect].map(|rms| of_readings(rms, effect.unit));
    let words = || format!("left-out test {alias}, with the effect {own}");
    (of_alias > WORSE * of_effect).then(words)
}

/// The variants of an explanation, in words: ` (also: tilt about Y, repeating every 356.7°)`.
pub fn also(variants: &[EffectName]) -> String {
    let what = |variant: &EffectName| {
        variant.meaning.split_once(": ").map_or(variant.meaning.as_str(), |(_, what)| what).to_string()
    };
    match variants {
        [] => String::new(),
        _ => format!(" (also: {})", listed(&variants.iter().map(what).collect::<Vec<_>>(), "or")),
    }
}

/// How equal an alias is: `Δχ² 1.3, likelihood ratio 0.52, probability ratio 0.19`. The probability also counts what the
/// effect costs to describe and how plausible it is mechanically.
pub fn likelihood(alias: &AliasResult) -> String {
    let shown = |ratio: f64| match (0.01..1000.0).contains(&ratio) {
        true => format!("{ratio:.2}"),
        false => with_exponent(ratio, 0),
    };
    // A difference of rounding is none.
    let delta = if alias.delta_chi2.abs() < 0.05 { 0.0 } else { alias.delta_chi2 };
    let probability = match alias.prior_cost == 0.0 {
        true => String::new(),
        false => format!(", probability ratio {}", shown(alias.probability_ratio)),
    };
    format!("Δχ² {delta:.1}, likelihood ratio {}{probability}", shown(alias.likelihood_ratio)).replace('-', "−")
}

/// The first explanations and the number of the others. A part of the machine is named once where it repeats.
fn in_short(effect: &EffectResult) -> String {
    let others = effect.aliases.iter().map(|alias| alias.name.meaning.as_str());
    let mut part = "";
    let mut named: Vec<String> = Vec::new();
    for meaning in std::iter::once(effect.name.meaning.as_str()).chain(others).take(MAX_EXPLANATIONS) {
        match meaning.split_once(": ") {
            Some((same, what)) if same == part => named.push(what.to_string()),
            split => {
                part = split.map_or("", |(part, _)| part);
                named.push(meaning.to_string());
            }
        }
    }
    match effect.explanation_count.saturating_sub(MAX_EXPLANATIONS) {
        0 => {}
        1 => named.push("1 other".to_string()),
        more => named.push(format!("{more} others")),
    }
    named.join(", or ")
}

/// One sentence per proposed test, with the aliases that it separates; then the aliases that no proposed test
/// separates.
pub fn tests(effect: &EffectResult, name: impl Fn(&EffectName) -> String) -> Vec<String> {
    let mut sentences: Vec<String> =
        (effect.separating_tests.iter().enumerate()).map(|(k, test)| sentence(test, k > 0)).collect();
    if let Some(last) = effect.separating_tests.last() {
        let remaining: Vec<String> = (last.alternatives.iter())
            .filter(|alternative| !alternative.separated)
            .map(|alternative| name(&alternative.name))
            .collect();
        if !remaining.is_empty() {
            sentences.push(format!("no proposed test separates it from {}", remaining.join("; ")));
        }
    } else if !effect.unique {
        sentences.push("no test is proposed that separates it from its aliases".to_string());
    }
    sentences
}

/// A proposed test and the aliases that it separates; a `further` one, those that the tests before it leave.
fn sentence(test: &SeparatingTestResult, further: bool) -> String {
    let (then, remaining) = if further { ("then ", "remaining ") } else { ("", "") };
    let aliases = match (test.separated_count, test.alternative_count) {
        (_, 1) => format!("the {remaining}alias"),
        (separates, of) if separates == of => format!("all {of} {remaining}aliases"),
        (separates, of) => format!("{separates} of {of} {remaining}aliases"),
    };
    let separated = || test.alternatives.iter().filter(|alternative| alternative.separated);
    let after = separated().map(|alternative| alternative.after_sigma).fold(f64::INFINITY, f64::min);
    let before = separated().map(|alternative| alternative.before_sigma).fold(0.0, f64::max);
    format!(
        "{then}{} separates it from {aliases} in {:.0} min: by at least {after:.1} standard deviations, without the test by at most {before:.1}",
        test.test, test.duration_min
    )
}

/// Probability below which an order of a spectrum stands out of the others.
const OUTSTANDING: f64 = 0.05;

/// Candidates that do not lower the held-out error significantly, one sentence each.
fn rejected(result: &TraceResult) -> Vec<String> {
    let rejected = result.rejected_candidates.iter().map(|candidate| {
        let (decrease, u) = value_and_u(candidate.heldout_decrease_um, candidate.u_heldout_decrease_um);
        format!(
            "{} ({}): the held-out rms decreases by {decrease} {of}, with a standard error of {u} {of}",
            name(&candidate.name),
            p_value(candidate.p_value),
            of = unit(result.reading_unit.name())
        )
    });
    rejected.collect()
}

/// The structure that remains, and its significance; `None` without one.
fn remainder(result: &TraceResult) -> Option<String> {
    let place = result.remainder.place.as_deref().unwrap_or("");
    result.remainder.structured.then(|| format!("({}): {place}", p_value(result.remainder.p_value)))
}

/// The prior of an effect's coefficients in words: `prior of 9.3″ for each of 80 coefficients, estimated for …`.
fn prior_in_words(prior: &PriorResult) -> String {
    let source = match &prior.family {
        Some(family) => format!("estimated for the family {family}"),
        None => "stated".to_string(),
    };
    let line = prior.largest_order.as_ref().map_or_else(String::new, |line| {
        let amplitude = quantity(&format!("{:.3}", line.amplitude), &prior.unit);
        let verdict = if line.p_value < OUTSTANDING { "stands out" } else { "does not stand out" };
        let order = line.order;
        format!("; order {order} has the largest amplitude, {amplitude}, and {verdict} ({})", p_value(line.p_value))
    });
    format!(
        "prior standard deviation {} ({source}); the readings determine {:.1} of {}{line}",
        quantity(&format!("{:.3}", prior.scale), &prior.unit),
        prior.effective_parameters,
        counted(prior.coefficients, "coefficient")
    )
}
