//! What the sections hold: selections of the tables and figures of a plan and of a fit.

use abbe::identify::problem::Problem;
use abbe::identify::series::{paths, views};
use abbe::model::Diagnostic;
use abbe::model::words::counted;
use abbe::plan::bias::BiasTable;
use abbe::plan::results::PlanAnalysis;
use abbe::plan::structure::Structure;
use abbe::trace::SessionFit;

use super::{Part, Subject};
use crate::report::block::{Formula, Report};
use crate::report::figure::bars::{NAMED, bars};
use crate::report::figure::{Figure, Quantity, drawing, space};
use crate::report::number::{three_digits, unit, with_symbols};
use crate::report::parameters;
use crate::report::plan::{analysis as plan, indices};
use crate::report::session::plots::SessionPlots;
use crate::report::session::residuals::test_table;
use crate::report::session::{self, curves};
use crate::report::table::{Align, Column, Table, cells};

/// Tests of a drawing of set-ups.
const MAX_SET_UPS: usize = 8;
/// Figures of sensitivities and of traces.
const MAX_FIGURES: usize = 12;

/// A plan or a measured session with its results.
pub struct Study {
    /// Name of its session file.
    pub label: String,
    /// The plan as a problem whose folds are its tests.
    pub problem: Problem,
    /// Its analysis.
    pub analysis: PlanAnalysis,
    /// Its ranks and base parameters.
    pub structure: Structure,
    /// The biases by undeclared effects.
    pub bias: BiasTable,
    /// The fit, if the session has readings.
    pub fitted: Option<SessionFit>,
}

/// Chain, set-ups and tests.
pub fn set_up(study: &Study) -> Part {
    let problem = &study.problem;
    let mut report = Report::new("Machine and set-up");
    let mut set_ups = paths::set_ups(problem);
    let all = set_ups.len();
    set_ups.truncate(MAX_SET_UPS);
    let mut caption = "Parallel projection of the nominal paths of the first run in the reference frame R.".to_string();
    if all > MAX_SET_UPS {
        caption.push_str(&format!(" The first {MAX_SET_UPS} of {all} tests."));
    }
    report.figures([
        session::chain(problem),
        Figure::new("set-up", "Set-up of each test", caption, space::set_ups(&set_ups, 2, drawing::WIDTH)),
    ]);
    let rows = study.analysis.tests.iter().map(|test| {
        let minutes = test.moving_min.map_or("–".to_string(), |min| format!("{min:.1}"));
        cells![&test.name, &test.setup, test.readings.to_string(), minutes]
    });
    let tests = Table::new(["test", "set-up", ">readings", ">movement, min"], rows);
    report.key(tests.titled("Tests").named("tests"));
    Part { subject: Subject::SetUp, report }
}

/// Sensitivity curves, trace patterns, and the coefficients.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn sensitivity(study: &Study) -> Result<Part, Diagnostic> {
    let nominal = vec![0.0; study.problem.parameters.list.len()];
    let figures = match &study.fitted {
        Some(fitted) => curves::sensitivities(&fitted.problem, &fitted.fit.beta)?,
        None => curves::sensitivities(&study.problem, &nominal)?,
    };
    let mut report = Report::new("Sensitivity");
    plan::sensitivity(&mut report, &study.analysis.errors);
    report.figures(figures.into_iter().take(MAX_FIGURES));
    Ok(Part { subject: Subject::Sensitivity, report })
}

/// Predicted uncertainties and their budgets.
pub fn uncertainty(study: &Study) -> Part {
    let mut report = Report::new("Predicted uncertainty");
    plan::uncertainty(&mut report, &study.analysis.errors);
    Part { subject: Subject::Uncertainty, report }
}

/// Correlation of the errors.
pub fn correlation(study: &Study) -> Part {
    let mut report = Report::new("Correlation");
    plan::correlations(&mut report, &study.analysis);
    Part { subject: Subject::Correlation, report }
}

/// Ranks, singular values, null space, base parameters and observability indices.
pub fn identifiability(study: &Study) -> Part {
    let (analysis, structure) = (&study.analysis, &study.structure);
    let mut report = Report::new("Identifiability");
    report.key(format!(
            "The structural rank is that of noise-free readings at a generic geometry of the set-up [@bellman1970]. The \
             numerical rank counts the directions that the readings of this plan determine against their noise of {:.2} µm. \
             Singular values are those of the whitened Jacobian, in standard deviations per 1 mm or 0.01 rad.",
            analysis.noise.value
    ));
    report.key(ranks(structure).named("ranks"));
    report.figures(singular_values(structure));
    let null: Vec<_> = analysis.unidentifiable.iter().map(|item| ("unidentifiable", with_symbols(&item.why))).collect();
    let prior = analysis.determined_by_prior.iter().map(|item| ("determined by a prior only", with_symbols(&item.why)));
    let near = analysis.nearly_collinear.iter().map(|item| ("nearly collinear", with_symbols(&item.why)));
    let rows: Vec<_> = null.into_iter().chain(prior).chain(near).collect();
    if !rows.is_empty() {
        let rows = rows.into_iter().map(|(kind, why)| cells![kind, why]);
        let caption = "Combinations that the readings do not separate, with their proportion in display units";
        report.key("Near collinearity is judged by the condition index [@belsley1980].");
        report.key(Table::new(["kind", "combination"], rows).titled(caption).named("null-space"));
    }
    report.key(base_words(structure));
    report.key(base(structure).named("base-parameters"));
    report.key(
        "The observability indices refer to the m singular values of the information on the errors, with the set-up \
         parameters estimated within their priors, and to n scalar readings: O1 [@borm1991], O2 [@driels1990], O3 \
         [@nahvi1994], O4 [@nahvi1996] and O5 [@sun2008].",
    );
    report.key(Formula::new(
r"O_1 = \frac{(\sigma_1 \cdots \sigma_m)^{1/m}}{\sqrt{n}}, \quad O_2 = \frac{\sigma_m}{\sigma_1}, \quad O_3 = \sigma_m",
r#"O_1 = (sigma_1 dots.c sigma_m)^(1 slash m) / sqrt(n), quad O_2 = sigma_m / sigma_1, quad O_3 = sigma_m"#,
"O1 = (σ1 ⋯ σm)^(1/m) / √n,  O2 = σm / σ1,  O3 = σm",
));
    report.key(Formula::new(
r"O_4 = \frac{\sigma_m^2}{\sigma_1}, \quad O_5 = \Bigl(\frac{1}{\sigma_1} + \cdots + \frac{1}{\sigma_m}\Bigr)^{-1}",
r#"O_4 = sigma_m^2 / sigma_1, quad O_5 = (1 / sigma_1 + dots.c + 1 / sigma_m)^(-1)"#,
"O4 = σm² / σ1,  O5 = (1/σ1 + ⋯ + 1/σm)⁻¹",
));
    report.key(indices(&analysis.indices).named("observability"));
    Part { subject: Subject::Identifiability, report }
}

fn ranks(structure: &Structure) -> Table {
    let row = |name: &str, rank: Option<usize>| cells![name, rank.map_or("–".to_string(), |rank| rank.to_string())];
    let rows = [
        row("structural rank: generic geometry, no noise, no priors", structure.structural_rank),
        row("readings at the geometry of the plan, no noise", Some(structure.rank_of_readings)),
        row("readings against their noise", Some(structure.rank_without_priors)),
        row("readings and priors against the noise", Some(structure.rank)),
        row("parameters", Some(structure.parameter_count)),
    ];
    Table::new(["rank", ">value"], rows).titled("Structural and numerical rank")
}

fn singular_values(structure: &Structure) -> Option<Figure> {
    const MAX: usize = 40;
    let rows: Vec<(String, f64, &str)> = structure
        .singular_values
        .iter()
        .enumerate()
        .filter(|(_, value)| **value > 0.0)
        .skip(structure.singular_values.len().saturating_sub(MAX))
        .map(|(k, value)| (format!("σ{}", k + 1), value.log10(), NAMED))
        .collect();
    (!rows.is_empty()).then(|| {
        Figure::new(
            "singular-values",
            "Singular values of readings and priors",
            "Logarithm to base 10. Values below 0 are not identifiable. The smallest 40 at most.",
            bars(&Quantity::new("lg σ", ""), &rows, &[]),
        )
    })
}

fn base_words(structure: &Structure) -> String {
    let held = &structure.held_at_nominal;
    if held.is_empty() {
        return "Every parameter is identifiable, so that each error is a base parameter [@khalil1991].".into();
    }
    format!(
        "Base parameters are identifiable combinations [@khalil1991]. {} held at nominal: {}. The base parameters then \
         absorb them with the stated coefficients.",
        if held.len() == 1 {
            "1 parameter is".to_string()
        } else {
            format!("{} are", counted(held.len(), "parameter"))
        },
        held.join(", ")
    )
}

fn base(structure: &Structure) -> Table {
    let rows = structure.base.iter().map(|base| {
        let term = |(id, share): &(String, f64)| {
            format!(" {} {} {id}", if *share < 0.0 { '−' } else { '+' }, three_digits(share.abs()))
        };
        let combination = base.id.clone() + &base.terms.iter().map(term).collect::<String>();
        cells![&base.id, combination, three_digits(base.u), unit(&base.unit)]
    });
    Table::new(["error", "base parameter", ">u", "unit"], rows)
        .titled("Base parameters with their predicted standard uncertainty")
}

/// Bias of each error by undeclared effects.
pub fn bias(study: &Study) -> Part {
    let found = &study.bias;
    let number = |value: f64| if value.abs() < 5e-6 { "0".to_string() } else { three_digits(value) };
    let rows = found.rows.iter().map(|row| {
        let mut cells = cells![format!("{}, {}", row.id, unit(&row.unit))];
        cells.extend(row.bias.iter().map(|bias| number(*bias).into()));
        cells.extend([row.signal_um, row.residual_um].map(|um| number(um).into()));
        cells
    });
    let right = |heading: String| Column { heading, align: Align::Right };
    let errors = found.errors.iter().map(|error| right(format!("{}, {}", error.id, unit(&error.unit))));
    let last = ["signal, µm", "remains, µm"].map(|heading| right(heading.to_string()));
    let columns = [Column::from("effect, per unit")].into_iter().chain(errors).chain(last);
    let mut report = Report::new("Bias by undeclared effects");
    report.key(
        "An undeclared effect changes the readings by c per unit of its coefficient. With the Jacobian J of the \
         estimated parameters, the weights W and the information P of the priors, it biases the estimates by b and \
         leaves e in the residual [@jcgm102]:",
    );
    report.key(Formula::new(
        r"b = (J^\mathsf{T} W J + P)^{-1} J^\mathsf{T} W c, \quad e = c - J b",
        r#"b = (J^sans(T) W J + P)^(-1) J^sans(T) W c, quad e = c - J b"#,
        "b = (JᵀWJ + P)⁻¹ JᵀW c,  e = c − J b",
    ));
    let caption = "Bias of each error per unit of an undeclared effect; root mean square of the signal in the readings and of \
                   what remains of it in the residual";
    report.key(Table::new(columns, rows).titled(caption).named("bias"));
    Part { subject: Subject::Bias, report }
}

/// Estimates, and traces before and after. `None` without readings.
///
/// # Errors
/// If the model cannot be evaluated.
pub fn trace(study: &Study) -> Result<Option<Part>, Diagnostic> {
    let Some(fitted) = &study.fitted else { return Ok(None) };
    let series = views(&fitted.problem, &fitted.fit, None)?;
    let plots = SessionPlots::new(&fitted.problem, &series);
    let models = ["nominal machine", "fit"];
    let mut report = Report::new("Estimates and residuals");
    let all: Vec<_> = fitted.result.model.parameters.iter().collect();
    report.key(parameters::table(&all, None).named("estimates"));
    let residuals = test_table(&plots, models).titled("Root mean square residual of each test");
    report.key(residuals.named("residuals"));
    let figures = plots.tests().flat_map(|(number, _)| match plots.polar_residuals(number, models) {
        Some(polar) => polar,
        None => plots.residuals(number),
    });
    report.figures(figures.take(MAX_FIGURES));
    Ok(Some(Part { subject: Subject::Trace, report }))
}
