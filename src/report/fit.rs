//! The result of a fit: goodness of fit, both propagations of uncertainty, all figures for a spreadsheet.

use abbe::document::StatedFit;
use abbe::identify::circular::CircularTest;
use abbe::identify::figure::{Definition, Figure};
use abbe::identify::fit::frames::SetUpFrame;
use abbe::identify::fit::{Fit, FitResult};
use abbe::identify::problem::Problem;
use abbe::identify::propagation::{FitMonteCarlo, Verdict};
use abbe::identify::results::{Estimate, ModelResult, NextStep};
use abbe::identify::series::{spectrum, views};
use abbe::identify::statements::has_candidates;
use abbe::identify::tolerance::Conformity;
use abbe::model::Diagnostic;
use abbe::model::parameter_id::ParameterId;
use abbe::model::words::counted;

use super::block::{Level, Report, Sentence, Text};
use super::commands::Commands;
use super::number::{fixed, places, unit};
use super::parameters::Estimates;
use super::quality;
use super::session;
use super::session::plots::SessionPlots;
use super::statements::{self, IDENTIFIES, IMPROVES};
use super::table::{Cell, Column, Table, cells, numbers, words};
use super::{conformity, confounded, frames, parameters, plausibility, standards};

/// The report of a fit; with `figures`, for a page.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn report(
    problem: &Problem,
    fit: &Fit,
    stated: &StatedFit<'_>,
    commands: &Commands,
    figures: bool,
) -> Result<Report, Diagnostic> {
    let (result, statements) = (stated.result, &stated.statements);
    let model = &result.model;
    let mut report = Report::new(format!("Fit of {}", problem.session.machine.name));
    report.warnings.clone_from(&result.warnings);
    report.method = method(model);
    let opening = statements::opening(statements, &problem.session, model.degrees_of_freedom, commands);
    let noise = quality::noise_of_model(model);
    let extent = format!("{}, {noise}; {}.", counted(model.fit.readings, "reading"), rank(model));
    let failed = conformity::failed(result.conformity.as_ref());
    let contradicted = plausibility::headline(&result.plausibility);
    report
        .opening("", contradicted.into_iter().chain(failed).map(Sentence::from).chain(opening).chain([extent.into()]));
    report.values = Figures::of_fit(result);
    frames::section(&mut report, &result.frames);
    let mut figures_of_quality = quality::key_figures(model, None);
    figures_of_quality.push(quality::readings(problem, model));
    report.key(figures_of_quality);
    plausibility::section(&mut report, &result.plausibility);
    let estimates = Estimates::new(problem, fit, &model.parameters);
    report.section("Values");
    if let Some(drawn) = &result.monte_carlo {
        report.key(propagations(drawn));
        report.key(agreement_of_propagations(drawn));
    }
    estimates.errors(&mut report, model.outcome.goodness, None);
    if let Some(base) = &result.base {
        report.headed(Level::Key, "Base parameters", parameters::base(base));
        report.key(parameters::base_statement(base));
    }
    if let Some(terms) = &result.tpoint {
        report.headed(Level::Key, "Terms of TPOINT", parameters::pointing(terms));
        report.key(parameters::pointing_statement(terms));
    }
    report.detail(statements::corrections(statements));
    estimates.set_up(&mut report, None);
    conformity::section(&mut report, result.conformity.as_ref());
    confounded::section(&mut report, model);
    standards::circular(&mut report, &result.circular);
    standards::positioning(&mut report, &result.positioning);
    standards::diagonals(&mut report, &result.diagonals, &result.largest_of_diagonals);
    standards::straightness(&mut report, &result.straightness);
    report.section("Next");
    let steps = next(problem, result, statements.measure.step, commands);
    let page = commands.command("fit", "--report fit.html");
    report.steps(steps, (page, "write residuals, plots and sliders as a page"));
    report.section("Residuals");
    report.detail(Text::List(quality::held_out_sentences(model, None)));
    if !figures {
        return Ok(report);
    }
    let series = views(problem, fit, None)?;
    let plots = SessionPlots::new(problem, &series);
    let before = if plots.is_polar() { "nominal machine and set-up" } else { "nominal machine, fitted set-up" };
    session::residuals(&mut report, &plots, &spectrum::spectra(problem, &series), [before, "fit"]);
    session::add_data(&mut report, &plots, &model.parameters);
    session::traces(&mut report, &plots);
    session::correlations(&mut report, problem, fit);
    session::model(&mut report, problem, &fit.beta)?;
    Ok(report)
}

fn method(model: &ModelResult) -> String {
    format!(
        "Least squares on the kinematic chain. All parameters are estimated together in the identifiable subspace. The \
         covariance follows from the law of propagation of uncertainty (JCGM 100, JCGM 102). {}. Held-out error: each \
         fold leaves out {}.",
        quality::noise_sentence_of_model(model),
        model.heldout_by
    )
}

/// What to do next: the step of the opening, as a command.
fn next(problem: &Problem, result: &FitResult, step: NextStep, commands: &Commands) -> Vec<(String, String)> {
    let mut steps: Vec<(String, String)> = Vec::new();
    let mut add = |step: String, purpose: &str| steps.push((step, purpose.to_string()));
    let test = |purpose: &str| format!("propose the test that {purpose}");
    match step {
        NextStep::CorrectSession => {
            add("correct the session".into(), "remove what the readings contradict");
            if result.model.outcome.goodness.verdict.lacks_an_effect() {
                add(commands.command("trace", ""), "or find an effect that explains the contradiction");
            }
        }
        NextStep::CheckUnit => add("check the unit of the readings".into(), "compare it with the name of their column"),
        NextStep::StateNoise => {
            add(format!("state {} or repeat a run", problem.session.keys_of_noise()), "have χ² judge the model");
        }
        NextStep::Improve => add(commands.command("plan", "--improve"), &test(IMPROVES)),
        NextStep::Identify => add(commands.command("plan", "--improve"), &test(IDENTIFIES)),
        _ => {}
    }
    // A model that is not judged may lack an effect too.
    if matches!(step, NextStep::Trace | NextStep::StateNoise) {
        add(commands.command("trace", ""), "find the unmodelled effect behind the residual");
    }
    if !result.model.unobservable.is_empty() && (step == NextStep::NoneHelps || !has_candidates(problem)) {
        add("measure a further test".into(), "move axes that these tests leave at rest");
    }
    steps
}

/// How many parameters are identifiable, and the rank.
pub fn rank(model: &ModelResult) -> String {
    let ModelResult { identifiable, parameter_count, rank, .. } = model;
    format!("{} of {} identifiable (numerical rank {rank})", identifiable.len(), counted(*parameter_count, "parameter"))
}

/// Both propagations side by side, with the quoted interval; without `--all`, of the parameters that are no set-up.
fn propagations(drawn: &FitMonteCarlo) -> Table {
    let is_setup = |id: &str| id.parse::<ParameterId>().is_ok_and(|id| id.is_setup());
    let key_rows = (0..drawn.parameters.len()).filter(|k| !is_setup(&drawn.parameters[*k].id)).collect();
    let rows = drawn.parameters.iter().map(|parameter| {
        let [value, gum_u] = Cell::estimate(parameter.value, parameter.gum_u);
        let u = Cell::fixed(parameter.u, places(parameter.u));
        let (quoted, source) = match parameter.verdict {
            Verdict::Agree => (&parameter.gum_interval, "GUM"),
            Verdict::Differ => (&parameter.symmetric_interval, "Monte Carlo"),
            Verdict::Undecided => (&parameter.symmetric_interval, "Monte Carlo (too few runs to compare)"),
        };
        let [low, high] = [quoted.low, quoted.high].map(|end| fixed(end, places(parameter.u)));
        cells![&parameter.id, value, gum_u, u, format!("{low} to {high}"), unit(&parameter.unit), source]
    });
    let interval = numbers(format!("{} %", drawn.draws.coverage * 100.0));
    let mut columns = ["parameter", ">value", ">u GUM", ">u MC", "unit", "quoted"].map(Column::from).to_vec();
    columns.insert(4, interval);
    Table { key_rows: Some(key_rows), ..Table::new(columns, rows) }
        .titled("Estimates with standard uncertainty u by GUM and by Monte Carlo, and the quoted coverage interval")
}

/// The parameters whose propagations agree.
fn agreement_of_propagations(drawn: &FitMonteCarlo) -> String {
    let count = |verdict: Verdict| drawn.parameters.iter().filter(|p| p.verdict == verdict).count();
    format!(
        "Monte Carlo, {}, seed {}: {} of {} agree with the GUM within the tolerance of JCGM 101, 8.1; {} differ",
        counted(drawn.draws.runs, "run"),
        drawn.draws.seed,
        count(Verdict::Agree),
        counted(drawn.parameters.len(), "parameter"),
        count(Verdict::Differ)
    )
}

/// How the signs of figures are meant: a comment in front of them.
const CONVENTION: &str = "Errors by their names of ISO 230-1: EX0C is a location error, EXC an error motion. Value = actual less nominal: the body that the axis\n\
carries is displaced along +X, +Y, +Z of R and turned about them by the right-hand rule, E = Trans(EX, EY, EZ) Rx(EA) Ry(EB) Rz(EC), whatever\n\
the axis' own direction. A correction has the opposite sign. u is one standard uncertainty.";

/// Every figure of a result with all its digits, one row per figure.
pub struct Figures(Table);

impl Default for Figures {
    fn default() -> Figures {
        let headings = ["section", "id", "meaning", "value", "u", "unit"];
        Figures(Table::new(headings.map(words), []).titled(CONVENTION))
    }
}

impl Figures {
    /// The figures of a fit.
    fn of_fit(result: &FitResult) -> Table {
        let mut figures = Figures::default();
        figures.residual("residual", &result.model);
        figures.parameters("parameters", &result.model.parameters);
        result.frames.iter().for_each(|frame| figures.frame(frame));
        result.circular.iter().for_each(|test| figures.circular(test));
        for test in &result.positioning {
            figures.standard(&format!("positioning {}", test.test), "", &test.read.figures);
        }
        for test in &result.diagonals {
            figures.standard(&format!("diagonal {}", test.test), "", &test.read.figures);
        }
        for test in &result.straightness {
            figures.standard(&format!("straightness {} {}", test.test, test.channel), "", &test.figures);
        }
        figures.conformity(result.conformity.as_ref());
        figures.0
    }

    /// The residual, the deciding held-out error, and those by what is held out.
    pub fn residual(&mut self, section: &str, model: &ModelResult) {
        self.figure(section, "rms", "", model.fit.rms_um, model.noise.unit.name());
        self.figure(section, "held out", "", model.fit.heldout_rms_um, model.noise.unit.name());
        for figure in quality::held_out(model) {
            self.figure(section, figure.name, "", figure.rms_um, figure.unit.name());
        }
    }

    /// The table.
    pub fn table(self) -> Table {
        self.0
    }

    /// A row that is no number.
    pub fn statement(&mut self, section: &str, id: &str, meaning: &str) {
        self.0.rows.push(cells![section, id, meaning, "", "", ""]);
    }

    /// A figure without uncertainty.
    pub fn figure(&mut self, section: &str, id: &str, meaning: &str, value: f64, unit: &str) {
        self.0.rows.push(cells![section, id, meaning, Cell::exact(value), "", unit]);
    }

    /// An estimate with its uncertainty, if there is one.
    pub fn estimate(&mut self, section: &str, id: &str, meaning: &str, found: Option<(f64, f64)>, unit: &str) {
        let cells = |(value, u)| cells![section, id, meaning, Cell::exact(value), Cell::exact(u), unit];
        self.0.rows.extend(found.map(cells));
    }

    /// Parameters with their uncertainties.
    pub fn parameters(&mut self, section: &str, parameters: &[Estimate]) {
        self.0.rows.extend(
            parameters
                .iter()
                .map(|p| cells![section, &p.id, &p.meaning, Cell::exact(p.value), Cell::exact(p.u), &p.unit]),
        );
    }

    /// Position and rotation of a frame of the set-up.
    fn frame(&mut self, frame: &SetUpFrame) {
        let (section, names) =
            (format!("frame {} {}", frame.parent, frame.child), ["x", "y", "z", "roll", "pitch", "yaw"]);
        let values = frame.xyz_mm.into_iter().zip(frame.u_xyz_mm).map(|pair| (pair, "mm"));
        let angles = frame.rpy_deg.into_iter().zip(frame.u_rpy_deg).map(|pair| (pair, "deg"));
        for (name, ((value, u), unit)) in names.into_iter().zip(values.chain(angles)) {
            self.estimate(&section, name, &frame.meaning, u.map(|u| (value, u)), unit);
        }
    }

    /// The decision about each item; its value is the probability that it is within its limits.
    pub fn conformity(&mut self, conformity: Option<&Conformity>) {
        for item in conformity.iter().flat_map(|conformity| &conformity.items) {
            let probability = item.conformance_probability.map_or("".into(), Cell::exact);
            self.0.rows.push(cells!["conformity", &item.id, item.decision.word(), probability, "", ""]);
        }
    }

    /// Figures of a standard, by their symbols or identifiers with what they are figures of.
    fn standard(&mut self, section: &str, of: &str, figures: &[Figure]) {
        for figure in figures {
            let Definition { id, symbol, name, .. } = figure.definition;
            let id = if symbol.is_empty() { (*id).to_string() } else { symbol.replace(' ', "") };
            let u = figure.u.map_or("".into(), Cell::exact);
            self.0.rows.push(cells![section, format!("{id}{of}"), *name, Cell::exact(figure.value), u, &figure.unit]);
        }
    }

    fn circular(&mut self, test: &CircularTest) {
        let section = format!("circle {}", test.test);
        for direction in &test.directions {
            self.standard(&section, &format!("({}{})", test.axes, direction.direction), &direction.figures);
        }
        self.standard(&section, "", &test.figures);
        for fault in &test.diagnosis {
            let meaning = format!("{} of {}, {:.1} % of the path", fault.fault, fault.axes, fault.share_percent);
            self.0.rows.extend(fault.values.iter().map(|value| {
                let u = if value.u > 0.0 { Cell::exact(value.u) } else { "".into() };
                let id = format!("{} {}", fault.fault, value.id);
                cells![&section, id, &meaning, Cell::exact(value.value), u, &value.unit]
            }));
        }
    }
}
