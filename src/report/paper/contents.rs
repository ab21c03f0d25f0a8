//! What the sections hold: the text of the methods, selections of the tables and figures of a plan and of a fit, several plans
//! side by side.

use abbe::identify::noise::NoiseSource;
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
use crate::report::number::{of_readings, three_digits, unit, with_symbols};
use crate::report::parameters;
use crate::report::plan::{analysis as plan, indices};
use crate::report::session::plots::SessionPlots;
use crate::report::session::{self, curves};
use crate::report::table::{Align, Cell, Column, Table, cells};

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
    let residuals = session::test_table(&plots, models).titled("Root mean square residual of each test");
    report.key(residuals.named("residuals"));
    let figures = plots.tests().flat_map(|(number, _)| match plots.polar_residuals(number, models) {
        Some(polar) => polar,
        None => plots.residuals(number),
    });
    report.figures(figures.take(MAX_FIGURES));
    Ok(Some(Part { subject: Subject::Trace, report }))
}

/// Machine, tests, parameters, estimation and uncertainty in words, every number from the result.
pub fn methods(study: &Study) -> Part {
    let mut report = Report::new("Methods");
    [measured(study), estimation(study), propagation(study)].into_iter().for_each(|text| report.key(text));
    if let Some(fitted) = &study.fitted {
        let model = &fitted.result.model;
        let enlarged = if model.fit.u_enlargement > 1.0 {
            format!(
                " The residual exceeds the noise significantly, so that all uncertainties are enlarged by {:.2}.",
                model.fit.u_enlargement
            )
        } else {
            String::new()
        };
        let source = match model.noise.source {
            NoiseSource::Stated => "is that of the instrument",
            NoiseSource::Repeats => "is estimated from repeated readings",
            NoiseSource::Targets => "is estimated from the distances between the targets at each pose",
            _ => "is estimated from the residual",
        };
        let coefficients: Vec<String> =
            model.noise_ar_coefficients.iter().map(|coefficient| format!("{coefficient:.2}")).collect();
        let along_runs = match coefficients.len() {
            0 => String::new(),
            order => format!(
                " Along a run the noise is an autoregression of order {order} ({}), from repeated readings.",
                coefficients.join(", ")
            ),
        };
        report.key(format!(
            "The fit of {} has a root mean square residual of {} and of {} for held-out readings ({} left out in turn). \
             The noise standard deviation of {} {source}.{along_runs} χ² is {:.0} for {} degrees of freedom (Birge ratio {:.2}).{enlarged}",
            counted(model.fit.readings, "reading"),
            of_readings(model.fit.rms_um, model.noise.unit),
            of_readings(model.fit.heldout_rms_um, model.noise.unit),
            model.heldout_by,
            of_readings(model.noise.value, model.noise.unit),
            model.chi_square,
            model.degrees_of_freedom,
            model.birge_ratio,
        ));
    }
    Part { subject: Subject::Methods, report }
}

fn measured(study: &Study) -> String {
    let (session, analysis) = (&study.problem.session, &study.analysis);
    let instrument = session.instrument.entry().phrase;
    let moving = analysis.moving_min.map_or(String::new(), |min| format!(" and {min:.1} min of movement"));
    format!(
        "The machine {} has the structural code {} (from workpiece to tool, b is the bed). It is measured with {instrument} \
         in {} with {}{moving}, from {}. Errors are named by ISO 230-1 [@iso230].",
        session.machine.name,
        session.machine.code(),
        counted(analysis.tests.len(), "test"),
        counted(analysis.readings, "reading"),
        counted(analysis.setup_count, "set-up"),
    )
}

fn estimation(study: &Study) -> String {
    let list = &study.problem.parameters.list;
    let setups = list.iter().filter(|parameter| parameter.id.is_setup()).count();
    let errors = list.len() - setups;
    let analysis = &study.analysis;
    let rank = if analysis.rank == list.len() {
        "all parameters are identifiable".to_string()
    } else {
        let indices = &analysis.indices;
        format!("{} of {} are identifiable", indices.identifiable_count, counted(indices.error_count, "error"))
    };
    format!(
        "A reading is computed by the kinematic chain with exact derivatives. The {} and {} are estimated together by \
         least squares with the Gauss-Newton method. Each linearisation is reduced by orthogonal transformations to a \
         triangular factor [@demmel2012], so that no information is lost by squaring. The numerical rank is {} of {}: {rank}. \
         A direction counts as identifiable if a change by 1 mm or 0.01 rad along it changes the readings by at least one \
         standard deviation in total. Combinations that are not identifiable keep their nominal values.",
        counted(errors, "error"),
        counted(setups, "set-up parameter"),
        analysis.rank,
        list.len(),
    )
}

fn propagation(study: &Study) -> String {
    format!(
        "The covariance of the estimates follows from the noise of a reading ({}) and from the priors of the set-up by the \
         law of propagation of uncertainty [@jcgm100;@jcgm102]. Stated uncertainties are standard uncertainties.",
        of_readings(study.analysis.noise.value, study.analysis.noise.unit)
    )
}

/// Predicted uncertainties, ranks and observability indices of two plans or more side by side.
pub fn comparison(studies: &[Study]) -> Part {
    let text = "The predicted standard uncertainties of the plans, the ranks of their parameters and their observability \
                indices are compared. A dash marks an error that a plan does not identify. The indices refer to the errors \
                that each plan identifies, so that they compare only plans of the same errors.";
    let mut report = Report::new("Comparison of plans");
    report.key(text);
    report.key(uncertainties(studies).named("comparison-uncertainty"));
    report.key(indices_of(studies).named("comparison-indices"));
    Part { subject: Subject::Comparison, report }
}

fn column(study: &Study) -> Column {
    Column { heading: study.label.clone(), align: Align::Right }
}

fn uncertainties(studies: &[Study]) -> Table {
    let mut errors: Vec<(&str, &str)> = Vec::new();
    for error in studies.iter().flat_map(|study| &study.analysis.errors) {
        if !errors.contains(&(&error.id, &error.unit)) {
            errors.push((&error.id, &error.unit));
        }
    }
    let rows = errors.iter().map(|(id, name)| {
        let mut row = cells![*id, unit(name)];
        row.extend(studies.iter().map(|study| {
            let error = study.analysis.errors.iter().find(|error| error.id == *id);
            Cell::from(error.and_then(|error| error.u).map_or("–".to_string(), three_digits))
        }));
        row
    });
    let columns = ["error", "unit"].map(Column::from).into_iter().chain(studies.iter().map(column));
    Table::new(columns, rows).titled("Predicted standard uncertainty of each error by each plan")
}

fn indices_of(studies: &[Study]) -> Table {
    let figure = |name: &str, of: &dyn Fn(&Study) -> String| {
        let mut row = cells![name];
        row.extend(studies.iter().map(|study| Cell::from(of(study))));
        row
    };
    let rows = [
        figure("tests", &|study| study.analysis.tests.len().to_string()),
        figure("readings", &|study| study.analysis.readings.to_string()),
        figure("set-ups", &|study| study.analysis.setup_count.to_string()),
        figure("parameters", &|study| study.structure.parameter_count.to_string()),
        figure("rank", &|study| study.structure.rank.to_string()),
        figure("identifiable errors", &|study| study.analysis.indices.identifiable_count.to_string()),
        figure("condition number", &|study| three_digits(study.analysis.indices.condition_number)),
        figure("O1", &|study| three_digits(study.analysis.indices.o1)),
        figure("O2", &|study| three_digits(study.analysis.indices.o2)),
        figure("O3", &|study| three_digits(study.analysis.indices.o3)),
        figure("O4", &|study| three_digits(study.analysis.indices.o4)),
        figure("O5", &|study| three_digits(study.analysis.indices.o5)),
        figure("D-efficiency", &|study| three_digits(study.analysis.indices.d_efficiency)),
    ];
    let columns = [Column::from("figure")].into_iter().chain(studies.iter().map(column));
    Table::new(columns, rows).titled("Ranks and observability indices of the plans")
}
