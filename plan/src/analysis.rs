//! The analysis of a plan: predicted uncertainties, identifiability and efficiency before the measurement.

use abbe_model::Diagnostic;
use abbe_model::sensitivity::SlotValues;
use abbe_model::session::Session;

use super::results::{Correlation, ErrorAnalysis, LeaveOneOut, PlanAnalysis, TestSummary, VarianceInflation};
use super::{budget, collision, effects, indices, sensitivity, states};
use abbe_identify::identifiability;
use abbe_identify::linear::{Linearisation, is_of_interest};
use abbe_identify::noise::{Noise, NoiseSource};
use abbe_identify::parameter_description::parameter_meaning;
use abbe_identify::problem::Problem;

/// How a plan is analysed.
#[derive(Clone, Debug)]
pub struct PlanOptions {
    /// Standard deviation of a reading, mm. It replaces that of the session.
    pub noise_mm: Option<f64>,
    /// Whether a test with a movement is analysed at its planned states even if it has data.
    pub planned_only: bool,
    /// Whether the library's undeclared effects are screened.
    pub effects: bool,
    /// Travel of the bar's sensor in either direction, mm. A test that exceeds it causes a warning.
    pub reach_mm: f64,
}

impl Default for PlanOptions {
    /// The session's noise, its data if present, effects included, and the usual sensor travel.
    fn default() -> Self {
        PlanOptions { noise_mm: None, planned_only: false, effects: true, reach_mm: BAR_TRAVEL_MM }
    }
}

/// Travel of a ball bar's sensor in either direction.
pub(crate) const BAR_TRAVEL_MM: f64 = 1.0;
/// Variance ratio below which the loss of a test is not reported.
const MIN_REPORTED_RATIO: f64 = 1.5;

/// Analyses a plan or the states of a measured session.
///
/// # Errors
/// If a test has neither data nor a movement, if a movement leaves the travel, or if the model cannot be evaluated.
pub fn analyse(session: &Session, options: &PlanOptions) -> Result<PlanAnalysis, Diagnostic> {
    let (complete, noise) = prepared(session, options)?;
    let problem = states::problem_by_test(&complete, noise)?;
    let mut analysis = analyse_problem(&problem, options.reach_mm)?;
    analysis.warnings.extend(states::noise_warning(&problem.noise, problem.unit()));
    if options.effects {
        analysis.effects = Some(effects::effects(&problem)?);
    }
    Ok(analysis)
}

/// The complete session (see [`states::complete`]) and the noise model of the plan.
///
/// # Errors
/// If a test has neither data nor a movement, or a movement leaves the travel.
pub fn prepared(session: &Session, options: &PlanOptions) -> Result<(Session, Noise), Diagnostic> {
    let is_measured = session.tests.iter().all(|test| test.readings.is_some());
    let session = if is_measured { abbe_identify::fit::with_lever(session, 1)? } else { session.clone() };
    let noise = match options.noise_mm {
        Some(sigma) => Noise::white(sigma, NoiseSource::Stated),
        None => states::noise_of(&session)?,
    };
    Ok((states::complete(&session, options.planned_only)?, noise))
}

/// Analyses a problem whose folds are its tests (see [`states::problem_by_test`]), without effects. A test causes a
/// warning if the distance of its balls differs from the bar length by more than `travel_mm`.
///
/// # Errors
/// If the model cannot be evaluated.
fn analyse_problem(problem: &Problem, travel_mm: f64) -> Result<PlanAnalysis, Diagnostic> {
    let list = &problem.parameters.list;
    let nominal = vec![0.0; list.len()];
    let linear = Linearisation::of(problem, &nominal)?;
    let of_interest: Vec<usize> = (0..list.len()).filter(|j| is_of_interest(&list[*j])).collect();
    let found = sensitivity::sensitivities(problem, &nominal, &linear.covariance)?;
    let conditional_u = budget::conditional_u(&linear, &of_interest)?;
    let errors = of_interest
        .iter()
        .zip(conditional_u)
        .map(|(&j, conditional_u)| {
            let unit = &list[j].unit;
            let u = linear.u(j);
            ErrorAnalysis {
                id: list[j].id.to_string(),
                meaning: parameter_meaning(problem, j, None),
                unit: unit.name.clone(),
                u: u.map(|u| u * unit.display_per_internal),
                sensitivity: sensitivity::reported(problem, &found, j),
                budget: u.map_or(Vec::new(), |_| budget::budget(problem, &linear, j)),
                conditional_u: u.map(|u| conditional_u.min(u) * unit.display_per_internal),
                correlated_with: u.map_or(Vec::new(), |_| budget::correlated_with(problem, &linear, j)),
                curves: sensitivity::curves(problem, &found, j),
            }
        })
        .collect();
    let mut setups: Vec<&str> = problem.tests.iter().map(mounted).collect();
    setups.sort_unstable();
    setups.dedup();
    let tests: Vec<TestSummary> = (0..problem.tests.len()).map(|test| summary(problem, test)).collect();
    let mut warnings = problem.session.warnings.clone();
    for test in &tests {
        if let Some(reach_mm) = test.reach_mm.filter(|reach_mm| *reach_mm > travel_mm) {
            warnings.push(format!(
                "{}: the distance of the balls differs from the bar length by up to {reach_mm:.2} mm; the sensor travels ±{travel_mm} mm",
                test.name
            ));
        }
    }
    let clearances = collision::clearances(&problem.session);
    warnings.extend(collision::warnings(&problem.session, &clearances));
    Ok(PlanAnalysis {
        noise: problem.reading_noise(),
        readings: problem.readings(),
        rank: linear.rank.identifiable_basis.ncols(),
        parameter_count: list.len(),
        setup_count: setups.len(),
        moving_min: tests.iter().map(|test| test.moving_min).sum(),
        tests,
        errors,
        unidentifiable: identifiability::unidentifiable(problem, &linear.rank),
        determined_by_prior: identifiability::determined_by_prior(problem, &linear)?,
        nearly_collinear: identifiability::nearly_collinear(problem, &linear, &of_interest)?,
        correlation: correlation(problem, &linear, &of_interest),
        indices: indices::indices(&linear, &of_interest, problem.scalars(), found.g_efficiency)?,
        leave_one_out: leave_one_out(problem, &linear, &of_interest)?,
        effects: None,
        clearances,
        warnings,
    })
}

/// The mounted object of a test: the workpiece ball or tracker, or the socket.
fn mounted(test: &abbe_model::session::Test) -> &str {
    test.socket.as_deref().unwrap_or(&test.setup)
}

fn summary(problem: &Problem, number: usize) -> TestSummary {
    let (test, model) = (&problem.tests[number], &problem.models[number]);
    let readings = test.readings.as_ref();
    let time = readings.map_or(&[][..], |readings| readings.time_s.as_slice());
    TestSummary {
        name: test.name.clone(),
        readings: readings.map_or(0, |readings| readings.rows()),
        moving_min: time.first().zip(time.last()).map(|(first, last)| (last - first) / 60.0),
        reach_mm: model.station().bar().map(|bar| {
            let nominal = model.readings(&SlotValues::zero(model.slots()));
            nominal.iter().fold(0.0, |most: f64, reading| most.max((reading - bar.bar).abs()))
        }),
        setup: mounted(test).to_string(),
    }
}

fn correlation(problem: &Problem, linear: &Linearisation, of_interest: &[usize]) -> Correlation {
    let both_identifiable = |i: usize, j: usize| linear.rank.is_identifiable(i) && linear.rank.is_identifiable(j);
    Correlation {
        ids: of_interest.iter().map(|j| problem.parameters.list[*j].id.to_string()).collect(),
        matrix: of_interest
            .iter()
            .map(|&i| {
                let entry = |j: usize| both_identifiable(i, j).then(|| budget::correlation(&linear.covariance, i, j));
                of_interest.iter().map(|&j| entry(j)).collect()
            })
            .collect(),
    }
}

/// Determines the uncertainties without each test in turn.
fn leave_one_out(
    problem: &Problem,
    linear: &Linearisation,
    of_interest: &[usize],
) -> Result<Vec<LeaveOneOut>, Diagnostic> {
    let list = &problem.parameters.list;
    if problem.tests.len() < 2 {
        return Ok(Vec::new());
    }
    (0..problem.tests.len())
        .map(|test| {
            let (rank, covariance) = linear.without(&[test])?;
            let variance_inflation: Vec<VarianceInflation> = of_interest
                .iter()
                .filter(|j| linear.rank.is_identifiable(**j))
                .map(|&j| {
                    let grown = covariance[(j, j)] / linear.covariance[(j, j)];
                    VarianceInflation { id: list[j].id.to_string(), factor: rank.is_identifiable(j).then_some(grown) }
                })
                .collect();
            let all: Vec<&str> = variance_inflation
                .iter()
                .filter(|inflation| inflation.factor.is_none())
                .map(|inflation| inflation.id.as_str())
                .collect();
            let much: Vec<String> = variance_inflation
                .iter()
                .filter_map(|VarianceInflation { id, factor }| {
                    factor
                        .filter(|factor| *factor >= MIN_REPORTED_RATIO)
                        .map(|factor| format!("{id} {factor:.1} times"))
                })
                .collect();
            let name = &problem.tests[test].name;
            let mut words = Vec::new();
            if !all.is_empty() {
                words.push(format!("only {name} makes {} identifiable", all.join(", ")));
            }
            if !much.is_empty() {
                words.push(format!("without {name} the variance increases: {}", much.join(", ")));
            }
            if words.is_empty() {
                words.push(format!("without {name} no variance increases by 50 %"));
            }
            Ok(LeaveOneOut { test: name.clone(), variance_inflation, why: words.join("; ") })
        })
        .collect()
}
