//! The result of a trace: verdict, effects, the residual before and after, parameters that changed.

use abbe::document::StatedTrace;
use abbe::identify::noise::NoiseSource;
use abbe::identify::results::{GoodnessVerdict, ModelResult, NextStep, NotJudged, TraceVerdict};
use abbe::identify::series::{spectrum, views};
use abbe::model::Diagnostic;
use abbe::model::session::Session;
use abbe::model::words::counted;
use abbe::trace::TraceOutcome;
use abbe::trace::result::{EffectResult, TraceResult};

use super::block::{KeyFigure, Level, Report, Sentence, Text};
use super::commands::{Commands, TRACED};
use super::effects::name;
use super::fit::{Figures, rank};
use super::number::{capitalised, integer, of_readings, quantity, unit, value_and_u};
use super::parameters::Estimates;
use super::quality;
use super::session;
use super::session::plots::SessionPlots;
use super::statements::{self, IDENTIFIES};
use super::table::{Cell, Table, cells, numbers, words};
use super::{conformity, confounded, effects, plausibility};

/// Effects that the opening names.
const MAX_NAMED: usize = 3;

/// The report of a trace; with `figures`, for a page.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn report(
    trace: &TraceOutcome,
    stated: &StatedTrace<'_>,
    commands: &Commands,
    figures: bool,
) -> Result<Report, Diagnostic> {
    let (result, statements) = (stated.result, &stated.statements);
    let commands = &commands.clone().with_effects(!result.effects.is_empty());
    let problem = &trace.after;
    let mut report = Report::new(format!("Trace of {}", problem.session.machine.name));
    report.warnings.clone_from(&result.warnings);
    report.method = method(result);
    report.values = values(result);
    let mut sentences = vec![Sentence::Words(verdict(result))];
    sentences.extend(effects::headline(result).map(|headline| format!("{}.", capitalised(&headline)).into()));
    sentences.extend(plausibility::headline(&result.plausibility).map(Sentence::from));
    sentences.extend(conformity::failed(result.conformity.as_ref()).map(Sentence::from));
    sentences.extend(statements::opening(statements, &problem.session, result.after.degrees_of_freedom, commands));
    sentences.push(
        format!(
            "{}, {}; {} of {} detectable.",
            counted(result.after.fit.readings, "reading"),
            noise(result, &problem.session),
            result.candidates_detectable,
            counted(result.candidates, "candidate")
        )
        .into(),
    );
    report.opening(result.verdict.to_string(), sentences);
    report.key(key_figures(trace));
    plausibility::section(&mut report, &result.plausibility);
    let estimates = Estimates::new(problem, &trace.after_fit, &result.after.parameters);
    let earlier = (!result.effects.is_empty()).then_some(result.before.parameters.as_slice());
    report.section("Values");
    estimates.errors(&mut report, result.after.outcome.goodness, earlier);
    if result.after.parameters.iter().any(|parameter| !parameter.enlarged_by.is_empty()) {
        let covers = "u covers the change of the parameter if an alias takes the place of an effect";
        report.key(Text::Note(covers.to_string()));
    }
    for presumed in presumed_by_explanations(result) {
        report.key(Text::Note(format!("{presumed}, which no reading separates from them")));
    }
    let changed = Text::List(changes(result));
    let heading =
        "Changed by more than their standard uncertainty when the effects were added (bias of the declared model):";
    report.headed(Level::Key, heading, changed);
    report.detail(statements::corrections(statements));
    estimates.set_up(&mut report, earlier);
    effects::section(&mut report, trace);
    report.section("Before and after");
    report.key(format!("Residual of the declared model: {}", result.residual_before));
    report.key(before_and_after(result));
    conformity::section(&mut report, result.conformity.as_ref());
    confounded::section(&mut report, &result.after);
    let rest = "Location errors that rest on the absence of a motion, which no reading separates from them:";
    report.headed(Level::Detail, rest, Text::List(result.presumed.clone()));
    report.section("Next");
    report.headed(Level::Key, "Tests that separate an effect from its aliases:", Text::List(measure_next(result)));
    let page = "write residuals, plots and alternatives as a page";
    report.steps(
        next(result, statements.measure.step, commands),
        (commands.command("trace", "--report trace.html"), page),
    );
    if !figures {
        return Ok(report);
    }
    let series = views(problem, &trace.after_fit, Some(&trace.before_fit.residuals))?;
    let plots = SessionPlots::new(problem, &series);
    let models = if earlier.is_none() { ["declared model"; 2] } else { ["declared model", "with the found effects"] };
    report.section("Residuals");
    session::residuals(&mut report, &plots, &spectrum::spectra(problem, &series), models);
    session::add_data(&mut report, &plots, &result.after.parameters);
    session::traces(&mut report, &plots);
    session::correlations(&mut report, problem, &trace.after_fit);
    session::model(&mut report, problem, &trace.after_fit.beta)?;
    Ok(report)
}

/// What the location errors of axes that precess by an explanation of the readings presume.
fn presumed_by_explanations(result: &TraceResult) -> impl Iterator<Item = &String> {
    let explanations = result.effects.iter().flat_map(|effect| {
        let of_aliases = effect.aliases.iter().flat_map(|alias| std::iter::once(&alias.name).chain(&alias.variants));
        std::iter::once(&effect.name).chain(&effect.variants).chain(of_aliases)
    });
    let precessing = explanations.filter(|name| name.shape == "precession");
    let motions: Vec<String> = precessing.map(|name| format!(" {}~{}:", name.component, name.driver)).collect();
    result.presumed.iter().filter(move |presumed| motions.iter().any(|motion| presumed.contains(motion)))
}

fn method(result: &TraceResult) -> String {
    format!(
        "The search screens {} candidate effects of the library against the residual of the declared model. {} of them \
         are detectable in these readings. An effect is added if the same search rarely finds an effect as good in \
         readings without structure. All parameters are then refitted together. {}. Held-out error: each fold leaves \
         out {}; the search is repeated in each fold.",
        integer(result.candidates),
        integer(result.candidates_detectable),
        quality::noise_sentence_of_model(&result.after),
        result.after.heldout_by
    )
}

/// The verdict in a sentence that names the effects with their values.
fn verdict(result: &TraceResult) -> String {
    let subject = match result.effects.len() {
        1 => "1 effect explains".to_string(),
        n => format!("{n} effects explain"),
    };
    let found = named(&result.effects);
    match result.verdict {
        TraceVerdict::Clean => "The residual of the declared model agrees with noise.".to_string(),
        TraceVerdict::Incomplete if result.effects.is_empty() => {
            format!("The search was {}. Effects may be missing.", result.interruption())
        }
        TraceVerdict::Incomplete => {
            format!("The search was {}. Effects may be missing. Found: {found}.", result.interruption())
        }
        TraceVerdict::Explained => format!("{subject} the residual of the declared model: {found}."),
        TraceVerdict::PartlyExplained => {
            format!("{subject} a part of the residual of the declared model: {found}. {}", remains(result))
        }
        TraceVerdict::NotJudged => format!(
            "{} {}, so that whether the remaining residual is noise cannot be judged.",
            match result.effects.len() {
                0 => "The search finds no effect.".to_string(),
                _ => format!("{subject} a part of the residual of the declared model: {found}."),
            },
            match result.after.outcome.goodness.not_judged {
                Some(NotJudged::BelowNoise) => "The residual is far below the noise",
                Some(NotJudged::WrongUnit) => "The unit of the readings is in doubt",
                Some(NotJudged::NoDegreesOfFreedom) => "The parameters are as many as the readings",
                Some(NotJudged::NoNoise) | None => "No noise is stated or follows from repeats",
            }
        ),
        TraceVerdict::Unexplained => format!("No effect of the library explains the residual. {}", remains(result)),
    }
}

/// What remains of the residual.
fn remains(result: &TraceResult) -> &'static str {
    match result.after.outcome.goodness.verdict {
        GoodnessVerdict::Exceeds if !result.remainder.structured => {
            "The residual exceeds the noise: the model lacks an effect, and its estimates are not to be quoted."
        }
        _ => "Structure remains: the model lacks an effect, and its estimates are not to be quoted.",
    }
}

/// The effects that explain most with their values, and the number of the others.
fn named(found: &[EffectResult]) -> String {
    let one = |effect: &&EffectResult| match effects::estimate(effect) {
        value if value.is_empty() => effect.name.meaning.clone(),
        value => format!("{}, {value}", effect.name.meaning),
    };
    let mut ranked: Vec<&EffectResult> = found.iter().collect();
    ranked.sort_by(|a, b| b.rms_gain_um.total_cmp(&a.rms_gain_um));
    let mut named: Vec<String> = ranked.iter().take(MAX_NAMED).map(one).collect();
    if found.len() > MAX_NAMED {
        named.push(format!("{} more", found.len() - MAX_NAMED));
    }
    named.join("; ")
}

fn key_figures(trace: &TraceOutcome) -> Vec<KeyFigure> {
    let result = &trace.result;
    let mut figures = quality::key_figures(&result.after, Some(&result.before));
    // Members of a family under a prior are compared with nothing.
    let compared: Vec<&EffectResult> = result.effects.iter().filter(|effect| effect.prior.is_none()).collect();
    let unique = compared.iter().filter(|effect| effect.unique).count();
    match (compared.as_slice(), result.effects.len()) {
        ([], _) => {}
        ([one], 1) if one.unique => {
            figures.push(KeyFigure::new("Uniqueness", "unique", format!("among {}", effects::screened(result))));
        }
        ([one], 1) => {
            let count = format!("1 of {}", one.explanation_count);
            figures.push(KeyFigure::new("Uniqueness", count, "indistinguishable explanations"));
        }
        (some, all) => {
            let which = if some.len() == all { "effects are unique" } else { "compared effects are unique" };
            figures.push(KeyFigure::new("Uniqueness", format!("{unique} of {}", some.len()), which));
        }
    }
    let structure = if result.remainder.structured { "significant" } else { "not significant" };
    figures.push(KeyFigure::new("Remaining structure", structure, format!("p = {:.3}", result.remainder.p_value)));
    figures.push(quality::readings(&trace.after, &result.after));
    figures
}

/// The tests that separate effects from their aliases.
fn measure_next(result: &TraceResult) -> Vec<String> {
    let sentences = result.effects.iter().enumerate().flat_map(|(k, effect)| {
        let about = if result.effects.len() > 1 { format!("Effect {}: ", k + 1) } else { String::new() };
        effects::tests(effect, name).into_iter().map(move |sentence| format!("{about}{sentence}"))
    });
    sentences.collect()
}

/// What to do next.
fn next(result: &TraceResult, measure: NextStep, commands: &Commands) -> Vec<(String, String)> {
    let mut steps: Vec<(String, String)> = Vec::new();
    let mut step = |step: String, purpose: &str| steps.push((step, purpose.to_string()));
    if !result.plausibility.conflicts.is_empty() {
        step("correct the session".into(), "the readings contradict it");
    }
    if result.interrupted {
        step(commands.command("trace", ""), "search to the end");
    } else if let Some(declared) = commands.declare_effects() {
        let purpose = format!("declare the effects in a session, which `{}` fits", commands.on(TRACED, "fit", ""));
        step(declared, &purpose);
    }
    if measure == NextStep::Identify {
        step(commands.plan("--improve"), &format!("propose the test that {IDENTIFIES}"));
    }
    steps
}

/// The noise and its source in words. A residual is not called noise. Many repeats, or a few that contradict it, take the place
/// of a stated noise in a trace, and not in a fit.
fn noise(result: &TraceResult, session: &Session) -> String {
    if result.after.noise.source.judges() || result.effects.is_empty() {
        let stated_um = session.stated_noise_mm().map(|mm| mm * 1e3).filter(|_| result.reading_unit.is_micrometre());
        let stated = match (result.after.noise.source, stated_um) {
            (NoiseSource::Repeats, Some(um)) => format!("; stated {}", of_readings(um, result.reading_unit)),
            _ => String::new(),
        };
        return quality::noise_of_model(&result.after) + &stated;
    }
    format!(
        "residual of the declared model {}, with the effects {} (no noise stated, no repeats)",
        of_readings(result.before.noise.value, result.reading_unit),
        of_readings(result.after.noise.value, result.reading_unit)
    )
}

/// The residual of the declared model, and with the effects.
pub fn before_and_after(result: &TraceResult) -> Table {
    // The residual itself is no measure of the noise.
    let judges = result.after.noise.source.judges();
    let row = |name: &str, model: &ModelResult| {
        let mut cells = cells![name, Cell::fixed(model.fit.rms_um, 3), Cell::fixed(model.fit.heldout_rms_um, 3)];
        if let (Some(rms), Some(held)) = (model.rms_3d_um, model.heldout_rms_3d_um) {
            cells.extend([rms, held].map(|um| Cell::fixed(um, 1)));
        }
        if judges {
            cells.push(Cell::fixed(model.chi_square / model.degrees_of_freedom.max(1) as f64, 2));
        }
        cells.push(rank(model).into());
        cells
    };
    let residual = format!("residual, {}", unit(result.reading_unit.name()));
    let mut columns = vec![words(residual), numbers("rms"), numbers("held out")];
    if result.before.rms_3d_um.is_some() {
        columns.extend(["3-vector", "held out"].map(numbers));
    }
    if judges {
        columns.push(numbers("χ²/ν"));
    }
    columns.push(words(""));
    let mut table = Table::new(columns, [row("before", &result.before), row("after", &result.after)]);
    table.notes.extend(quality::held_out_sentences(&result.after, Some(&result.before)));
    table
}

/// Parameters that changed by more than their uncertainty when the effects were added.
fn changes(result: &TraceResult) -> Vec<String> {
    let changes = result.changed_parameters.iter().map(|changed| {
        let (change, u) = value_and_u(changed.value, changed.u);
        format!("{}  {} (u {u})", changed.id, quantity(&change, &changed.unit))
    });
    changes.collect()
}

/// Every figure with all its digits, one row per figure.
fn values(result: &TraceResult) -> Table {
    let mut figures = Figures::default();
    if result.interrupted {
        figures.statement("search", "interrupted", &format!("{}: the result is incomplete", result.interruption()));
    }
    for (name, model) in [("before", &result.before), ("after", &result.after)] {
        figures.residual(name, model);
        figures.parameters(name, &model.parameters);
    }
    for (index, effect) in result.effects.iter().enumerate() {
        let section = format!("effect {}", index + 1);
        for number in &effect.shape_parameters {
            for value in &number.values {
                figures.figure(&section, &number.name, "", *value, &number.unit);
            }
            for end in number.intervals_95.iter().flatten().flatten() {
                figures.figure(&section, &format!("{}, end of the 95 % interval", number.name), "", *end, &number.unit);
            }
        }
        figures.parameters(&section, &effect.parameters);
        if let Some(prior) = &effect.prior {
            figures.figure(&section, "prior standard deviation", "", prior.scale, &prior.unit);
            figures.figure(&section, "effective number of parameters", "", prior.effective_parameters, "");
        }
    }
    figures.table()
}
