//! Effects that a trace has found, each beside its competing explanations.

use abbe::identify::results::Estimate;
use abbe::model::parameter_id::ParameterId;
use abbe::model::words::counted;
use abbe::trace::TraceOutcome;
use abbe::trace::alias::CompetingEffect;
use abbe::trace::result::{AliasResult, EffectName, EffectResult, SeparatingTestResult, ShapeParameter};

use super::block::{Level, Report, Text};
use super::effect::name;
use super::figure::bars::{ALIAS, NAMED, OTHER, bars};
use super::figure::lines::{Axis, Lines, Mark, Name, Series};
use super::figure::scale::{Scale, span};
use super::figure::{Figure, Quantity};
use super::number::{integer, of_readings, p_value, quantity, shape_number, value_and_u};
use super::table::{Cell, Column, Table, cells};
use super::{trace as present, uniqueness};

/// Maximum number of effects that are shown unfolded.
const MAX_OPEN: usize = 4;
/// Maximum number of effects with a plot of their competing explanations.
const MAX_RANKED: usize = 12;
/// Number of additions up to which the points of the convergence plot have names.
const MAX_NAMED: usize = 8;

/// The section of found effects, rejected candidates, remaining structure and convergence of the search.
pub fn section(report: &mut Report, trace: &TraceOutcome) {
    let result = &trace.result;
    report.section("Effects and competing explanations");
    if result.effects.is_empty() {
        report.page("The search added no effect.");
    }
    for (number, effect) in result.effects.iter().enumerate() {
        let heading = format!("{}. {} ({})", number + 1, name(&effect.name), effect.name.meaning);
        report.key(if number < MAX_OPEN { Text::Heading(heading) } else { Text::Fold(heading) });
        report.key(values(effect, &uniqueness::screened(result), result.effects.len() == 1));
        alternatives(report, effect, result.candidates_detectable);
        let id = trace.effects.get(number).map(|effect| effect.id()).unwrap_or_default();
        let competing = trace.competing_effects.get(number).filter(|_| number < MAX_RANKED);
        report.figures((!effect.curve.is_empty()).then(|| curve(effect)));
        report.figures(competing.map(|competing| ranking(competing, &id)));
    }
    report.folded("Families of effects that were searched", Text::List(result.families.clone()));
    let rejected = Text::List(present::rejected(result));
    report.headed(Level::Key, "Rejected, because the held-out error does not decrease significantly:", rejected);
    if let Some(remainder) = present::remainder(result) {
        report.key(Text::Heading(format!("Remaining structure {remainder}")));
    }
    if !trace.steps.is_empty() {
        report.page(Text::Heading("Convergence of the search".to_string()));
        report.figures([convergence(trace)]);
    }
}

/// What the effect is, explains, and competes with.
fn values(effect: &EffectResult, screened: &str, is_alone: bool) -> Table {
    let mut rows = vec![cells!["estimate", estimate(effect)]];
    rows.extend(effect.prior.iter().map(|prior| cells!["prior", present::prior(prior)]));
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
    let standing = uniqueness::standing(effect, screened);
    rows.push(cells!["uniqueness", format!("{standing}{}", uniqueness::also(&effect.variants))]);
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
        let predicted = uniqueness::worse_prediction(effect, place);
        format!(
            "or {}{}  ({}); {}{}",
            alias.name.meaning,
            uniqueness::also(&alias.variants),
            name(&alias.name),
            uniqueness::likelihood(alias),
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
        let mut row =
            cells![format!("{}{} ({})", name_of.meaning, uniqueness::also(variants), name(name_of)), likelihood];
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
        row(&alias.name, &alias.variants, uniqueness::likelihood(alias), predicted, outcomes)
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
