//! The report of an analysed plan, and the sections that a paper shares with it.

use abbe::document::StatedPlan;
use abbe::identify::problem::Problem;
use abbe::identify::results::NextStep;
use abbe::model::Diagnostic;
use abbe::model::words::counted;
use abbe::plan::results::{ErrorAnalysis, PlanAnalysis};

use super::{
    budgets, clearances, correlation, effects, indices, sensitivity as sensitivities, small_plots, uncertainties,
    values,
};
use crate::report::block::{KeyFigure, Level, Report, Text};
use crate::report::commands::{Commands, SIMULATED};
use crate::report::confounded::{BY_PRIOR, by_prior};
use crate::report::figure::bars::{ALIAS, NAMED, bars};
use crate::report::figure::{Figure, Quantity};
use crate::report::number::{integer, of_readings, three_digits, unit, units, with_symbols};
use crate::report::quality::noise;
use crate::report::session::{correlation_map, model};
use crate::report::statements;

/// Maximum number of errors of a figure. The JSON result contains all errors.
const MAX_ROWS: usize = 30;
/// Errors of a correlation map.
const MAX_CORRELATED: usize = 40;

/// The report of a plan; with `figures`, for a page.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn report(
    problem: &Problem,
    stated: &StatedPlan<'_>,
    commands: &Commands,
    figures: bool,
) -> Result<Report, Diagnostic> {
    let analysis = stated.result;
    let mut report = Report::new(format!("Plan for {}", problem.session.machine.name));
    report.warnings.clone_from(&analysis.warnings);
    report.method = format!(
        "The model is linearised at the nominal machine and every planned state. The uncertainties follow from the \
         noise ({} per reading, {}) and from the priors of the set-up by the law of propagation of uncertainty (JCGM \
         100, JCGM 102).",
        of_readings(analysis.noise.value, analysis.noise.unit),
        analysis.noise.source
    );
    report.values = values(analysis);
    let statements = statements::of_plan(&stated.statements, analysis, &problem.session.machine, commands);
    report.opening("", statements.into_iter().chain([extent(analysis).into()]));
    report.key(key_figures(problem, analysis));
    report.section("Predicted uncertainty");
    uncertainty(&mut report, &analysis.errors);
    confounded(&mut report, analysis);
    report.section("Clearance");
    report.key(clearances(&analysis.clearances));
    undeclared(&mut report, analysis);
    report.section("Next");
    let all = "list sensitivities, budgets, correlations, indices, tests, effects";
    report.steps(next(stated.statements.measure.step, commands), (commands.command("plan", "--all"), all));
    let each = analysis.leave_one_out.iter().map(|without| without.why.clone());
    report.headed(Level::Detail, "Contribution of each test:", Text::List(each.collect()));
    report.section("Sensitivity");
    sensitivity(&mut report, &analysis.errors);
    report.section("Observability");
    report.detail(indices(&analysis.indices));
    report.section("Correlation");
    self::correlations(&mut report, analysis);
    if figures {
        model(&mut report, problem, &vec![0.0; problem.parameters.list.len()])?;
    } else {
        let plots = small_plots(analysis);
        if !plots.is_empty() {
            report.detail(Text::Heading(
                "Sensitivity along the first run of each test, each row to its own scale, zero at half height:".into(),
            ));
            plots.into_iter().for_each(|plot| report.detail(plot));
        }
    }
    Ok(report)
}

/// What is planned.
fn extent(analysis: &PlanAnalysis) -> String {
    let moving = analysis.moving_min.map_or(String::new(), |min| format!(", {min:.1} min of movement"));
    format!(
        "{} in {}, {}{moving}, {}; numerical rank {} of {} with set-up parameters.",
        counted(analysis.readings, "reading"),
        counted(analysis.tests.len(), "test"),
        counted(analysis.setup_count, "set-up"),
        noise(analysis.noise),
        analysis.rank,
        analysis.parameter_count
    )
}

fn key_figures(problem: &Problem, analysis: &PlanAnalysis) -> Vec<KeyFigure> {
    let identifiable = analysis.errors.iter().filter(|error| error.u.is_some()).count();
    let mut figures =
        vec![KeyFigure::new("Identifiable errors", format!("{identifiable} of {}", analysis.errors.len()), "")];
    figures.extend(worst(analysis).into_iter().map(|error| {
        let u = error.u.unwrap_or_default();
        let figure = format!("{}: u = {} {}", error.id, three_digits(u), unit(&error.unit));
        let share = error.budget.first();
        let share = share.map_or(String::new(), |part| format!("{:.0} % from {}", 100.0 * part.share, part.source));
        KeyFigure::new("Worst determined", figure, share)
    }));
    let condition = format!("{:.1}", analysis.indices.condition_number);
    figures.push(KeyFigure::new("Condition number", condition, "scaled Jacobian of the errors"));
    figures.push(KeyFigure::new(
        "Readings",
        integer(analysis.readings),
        format!(
            "{}, noise {}",
            counted(problem.tests.len(), "test"),
            of_readings(analysis.noise.value, analysis.noise.unit)
        ),
    ));
    figures
}

/// The identifiable error with the largest standard uncertainty in each unit.
fn worst(analysis: &PlanAnalysis) -> Vec<&ErrorAnalysis> {
    let mut worst: Vec<&ErrorAnalysis> = Vec::new();
    for error in analysis.errors.iter().filter(|error| error.u.is_some()) {
        match worst.iter_mut().find(|other| other.unit == error.unit) {
            Some(other) if error.u > other.u => *other = error,
            Some(_) => {}
            None => worst.push(error),
        }
    }
    worst
}

/// Predicted uncertainties, their budgets, and the sensitivities behind them.
pub fn uncertainty(report: &mut Report, errors: &[ErrorAnalysis]) {
    report.key(uncertainties(errors).named("uncertainty"));
    report.figures(self::figures(errors));
    report.page(
        "The budget divides the variance of an error into the shares of the noise and of each set-up parameter \
         [@jcgm100]. The conditional uncertainty is that with all other errors known. Its distance from u is the price of \
         correlation.",
    );
    report.detail(budgets(errors).named("budget"));
}

/// The change of the readings by each error.
pub fn sensitivity(report: &mut Report, errors: &[ErrorAnalysis]) {
    report.page(
        "The sensitivity of a reading to an error is the derivative of the kinematic chain. A trace pattern shows the \
         deviation that one error alone causes about the nominal circle [@jiang2014].",
    );
    report.detail(sensitivities(errors).named("sensitivity"));
}

/// Correlation of the errors.
pub fn correlations(report: &mut Report, analysis: &PlanAnalysis) {
    let count = analysis.correlation.ids.len().min(MAX_CORRELATED);
    report.page(
        "The square of a correlation coefficient is the share of the variance of one error that vanishes if the other \
         error is known.",
    );
    if count > 1 {
        let rows: Vec<_> = analysis.correlation.matrix[..count].iter().map(|row| row[..count].to_vec()).collect();
        report.figures([correlation_map(&analysis.correlation.ids[..count], &rows)]);
    }
    match correlation(analysis) {
        Some(table) => report.detail(table.named("correlation-matrix")),
        None => report
            .detail(format!("The correlation matrix of {} errors is in the JSON.", analysis.correlation.ids.len())),
    }
}

/// Figures of the predicted standard uncertainties, one for each unit.
fn figures(errors: &[ErrorAnalysis]) -> Vec<Figure> {
    let units = units(errors.iter().map(|error| error.unit.as_str())).into_iter();
    let figure = |name: &str| {
        let own = errors.iter().filter(|error| error.unit == name);
        let rows = own.filter_map(|error| Some((error, error.u?))).flat_map(|(error, u)| {
            let known = error.conditional_u.unwrap_or(u);
            [(error.id.clone(), u, NAMED), (format!("{}, conditional", error.id), known, ALIAS)]
        });
        let rows: Vec<_> = rows.take(2 * MAX_ROWS).collect();
        let labels = [(NAMED, "predicted"), (ALIAS, "conditional")];
        Figure::new(
            format!("uncertainty-{}", name.replace('/', "-per-")),
            format!("Predicted standard uncertainty, {}", unit(name)),
            "Conditional: if all other errors were known.",
            bars(&Quantity::new("u (k\u{a0}=\u{a0}1)", name), &rows, &labels),
        )
    };
    units.map(figure).collect()
}

fn confounded(report: &mut Report, analysis: &PlanAnalysis) {
    report.section("Confounding");
    let mut list = |heading: &str, lines: Vec<String>| report.headed(Level::Key, heading, Text::List(lines));
    list(
        "Confounded: null-space directions, which leave every reading unchanged:",
        analysis.unidentifiable.iter().map(|item| with_symbols(&item.why)).collect(),
    );
    list(BY_PRIOR, by_prior(&analysis.determined_by_prior));
    list("Nearly collinear:", analysis.nearly_collinear.iter().map(|item| with_symbols(&item.why)).collect());
}

/// The undeclared effects that the tests detect, and those that are confounded with the errors.
fn undeclared(report: &mut Report, analysis: &PlanAnalysis) {
    let Some(found) = &analysis.effects else { return };
    report.section("Undeclared effects");
    let counts = effects::counts(found);
    report.key(format!(
        "Undeclared effects: of {} screened, {} are detectable, {} are confounded with the errors and {} change no \
         reading of these tests.",
        found.effects.len(),
        counts.detectable,
        counts.confounded,
        counts.without_signal
    ));
    report.brief(Text::Note("detectable and confounded effects".to_string()));
    report.detail(Text::Fold("Detectable and confounded effects".to_string()));
    report.detail(effects::detectable(found));
    report.detail(effects::confounded(found));
    report.detail(effects::by_error(found));
}

/// What to do next.
fn next(step: NextStep, commands: &Commands) -> Vec<(String, String)> {
    let purpose = match step {
        NextStep::Improve => Some("propose the test that most lowers the largest uncertainty"),
        NextStep::Identify => Some("propose the test that makes the errors identifiable"),
        _ => None,
    };
    let propose = |purpose: &str| (commands.command("plan", "--improve"), purpose.to_string());
    let mut steps: Vec<(String, String)> = purpose.map(propose).into_iter().collect();
    let simulated = commands.command("simulate", &format!("--out {}", commands.beside(SIMULATED)));
    steps.push((simulated, "simulate readings of these tests".into()));
    steps
}
