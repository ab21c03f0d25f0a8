//! What a fit is worth: its residual against the noise, what determines its estimates, what it assumes.

use abbe_model::Diagnostic;
use abbe_model::instrument::{Checked, InstrumentKind};
use abbe_model::parameter_id::ParameterId;
use abbe_model::session::{Prior, Test};
use abbe_model::words::counted;

use super::{BIRGE_SIGNIFICANCE, Fit, assume};
use crate::identifiability::determined_by_prior;
use crate::linear::{Linearisation, is_of_interest};
use crate::noise::{NoiseSource, stated_against_repeats};
use crate::numerics::rank::Rank;
use crate::numerics::tails::chi_square_tails;
use crate::parameters::Parameter;
use crate::plausibility::Pulls;
use crate::problem::Problem;
use crate::results::{
    Assumption, AssumptionKind, AssumptionVerdict, DataRange, DeterminedBy, DeterminedByPrior, Estimate, Goodness,
    GoodnessVerdict, NotEstimated, NotJudged, Outcome,
};

/// χ²/ν below which a residual is significantly below the noise, if it is so by chance in one of a thousand sessions.
const MIN_RATIO: f64 = 0.5;
/// Ratio of the residual to the stated noise below which the unit of the readings is in doubt.
const OF_ANOTHER_UNIT: f64 = 0.1;

/// The residual of a fit against the noise.
pub fn goodness(problem: &Problem, fit: &Fit) -> Goodness {
    let chi_square_ratio = fit.birge_ratio.powi(2);
    let not_judged = if fit.degrees_of_freedom == 0 {
        Some(NotJudged::NoDegreesOfFreedom)
    } else if ratio_of_another_unit(problem, fit).is_some() || doubt_on_unit(problem).is_some() {
        Some(NotJudged::WrongUnit)
    } else if !problem.noise.source.judges() {
        Some(NotJudged::NoNoise)
    } else {
        let is_below = chi_square_ratio < MIN_RATIO && fit.p_value > 1.0 - BIRGE_SIGNIFICANCE;
        is_below.then_some(NotJudged::BelowNoise)
    };
    let verdict = match not_judged {
        Some(_) => GoodnessVerdict::NotJudged,
        None if fit.exceeds_noise() => GoodnessVerdict::Exceeds,
        None => GoodnessVerdict::Agrees,
    };
    let is_tested = !matches!(not_judged, Some(NotJudged::NoNoise | NotJudged::NoDegreesOfFreedom));
    let p_value = is_tested.then_some(fit.p_value);
    Goodness { not_judged, chi_square_ratio, p_value, ..Goodness::default() }.with_verdict(verdict)
}

/// The residual over the noise that the session states, if it is so small that the unit of the readings is in doubt. A
/// noise of repeats is in the unit of the readings and shows nothing.
pub(crate) fn ratio_of_another_unit(problem: &Problem, fit: &Fit) -> Option<f64> {
    let stated_mm = problem.session.stated_noise_mm()?;
    let ratio = fit.birge_ratio * problem.noise.sigma_mm / stated_mm;
    let free = fit.degrees_of_freedom as f64;
    let [by_chance, _] = chi_square_tails(free * ratio * ratio, free)?;
    (ratio < OF_ANOTHER_UNIT && by_chance < BIRGE_SIGNIFICANCE).then_some(ratio)
}

/// The doubt about readings without a stated noise whose size such an instrument does not have, as in another unit. Their repeats
/// are in the same unit and show nothing.
pub(crate) fn doubt_on_unit(problem: &Problem) -> Option<String> {
    if problem.session.stated_noise_mm().is_some() {
        return None;
    }
    let machine = &problem.session.machine;
    let doubt =
        |test: &Test| test.station.doubt(&Checked { machine, test: &test.name, readings: test.readings.as_deref()? });
    // What is doubtful of a line of sight is no unit.
    let has_unit = |test: &&Test| test.station.kind() != InstrumentKind::Pointing;
    problem.tests.iter().filter(has_unit).find_map(doubt)
}

/// What determines each parameter of a problem, by index, and the errors that set-up priors determine, in words.
pub struct Determined {
    by: Vec<DeterminedBy>,
    by_prior: Vec<DeterminedByPrior>,
}

impl Determined {
    /// At the nominal machine, as a plan decides it.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn of(problem: &Problem, fit: &Fit) -> Result<Determined, Diagnostic> {
        let (list, rank) = (&problem.parameters.list, &fit.rank);
        let of_null_space = |j: usize| {
            let own: Vec<&Vec<f64>> = rank.null_combinations.iter().filter(|row| row[j] != 0.0).collect();
            match own.iter().any(|row| row.iter().filter(|share| **share != 0.0).count() > 1) {
                _ if own.is_empty() => DeterminedBy::Readings,
                true => DeterminedBy::BaseCombination,
                false => DeterminedBy::Nothing,
            }
        };
        let mut determined = Determined { by: (0..list.len()).map(of_null_space).collect(), by_prior: Vec::new() };
        let has_prior =
            |own: &Parameter| (own.id.is_setup() || own.id.is_number()) && matches!(own.prior, Prior::Gaussian(_));
        if !list.iter().any(has_prior) {
            return Ok(determined);
        }
        // Priors of families determine their coefficients. They are no statement about the set-up.
        let (problem, kept) = problem.without_families();
        let nominal = vec![0.0; kept.len()];
        // The columns of numbers and positions of shapes follow these.
        let is_fixed = !problem.parameters.has_numbers() && problem.parameters.positions().next().is_none();
        let linear = match fit.nominal.as_ref().filter(|_| is_fixed) {
            Some(triangles) => Linearisation::of_triangles(&problem, &nominal, triangles.clone())?,
            None => Linearisation::of(&problem, &nominal)?,
        };
        let alone = Rank::decide(&linear.readings, &linear.size, &linear.preference)?;
        for (k, j) in kept.iter().enumerate() {
            let of_interest = is_of_interest(&list[*j]) || list[*j].id.is_number();
            let by_prior = of_interest && linear.rank.is_identifiable(k) && !alone.is_identifiable(k);
            if by_prior && determined.by[*j] == DeterminedBy::Readings {
                determined.by[*j] = DeterminedBy::Prior;
            }
        }
        determined.by_prior = determined_by_prior(&problem, &linear)?;
        Ok(determined)
    }

    /// States what determines the estimates of a model, and whether they may be quoted.
    pub fn mark(&self, problem: &Problem, parameters: &mut [Estimate], goodness: Goodness) {
        let list = problem.parameters.list.iter();
        let by_prior: Vec<ParameterId> = (list.zip(&self.by))
            .filter(|(_, by)| **by == DeterminedBy::Prior)
            .map(|(parameter, _)| parameter.id.cosine())
            .collect();
        for parameter in parameters {
            parameter.quotable = goodness.quotable;
            if parameter.id.parse::<ParameterId>().is_ok_and(|id| by_prior.contains(&id.cosine())) {
                parameter.set_determined_by(DeterminedBy::Prior);
            }
        }
    }

    /// The parameters without an estimate of their own.
    fn not_estimated(&self, problem: &Problem) -> Vec<NotEstimated> {
        let list = problem.parameters.list.iter().zip(&self.by);
        let open = |by: DeterminedBy| matches!(by, DeterminedBy::BaseCombination | DeterminedBy::Nothing);
        list.filter(|(_, by)| open(**by))
            .map(|(parameter, by)| NotEstimated { id: parameter.id.to_string(), determined_by: *by })
            .collect()
    }
}

/// What a fit is worth.
pub(super) fn outcome(problem: &Problem, fit: &Fit, goodness: Goodness, determined: &Determined) -> Outcome {
    Outcome {
        goodness,
        determined_by_prior: determined.by_prior.clone(),
        not_estimated: determined.not_estimated(problem),
        assumptions: assumptions(problem, fit),
        ranges: ranges(problem),
    }
}

/// What a fit assumes, each with its test by the readings.
fn assumptions(problem: &Problem, fit: &Fit) -> Vec<Assumption> {
    let mut list = vec![noise(problem, stated_against_repeats(problem, fit))];
    list.extend(priors(problem, fit));
    let excluded = problem.rejected.iter().flatten().filter(|rejected| **rejected).count();
    if excluded > 0 {
        let share = excluded as f64 / (problem.readings() + excluded) as f64;
        list.push(Assumption {
            kind: AssumptionKind::ExcludedReadings,
            statement: format!("{} as outliers do not count", counted(excluded, "reading")),
            verdict: AssumptionVerdict::Agrees,
            test: format!("each is too far from the model for the noise; {:.2} % of the readings", 100.0 * share),
        });
    }
    list.extend(assume::statements(problem).into_iter().map(|statement| Assumption {
        kind: AssumptionKind::Explanation,
        statement,
        verdict: AssumptionVerdict::NotTested,
        test: "the readings explain both equally well".to_string(),
    }));
    list
}

fn noise(problem: &Problem, contradicted: Option<String>) -> Assumption {
    let figure = format!("noise of {}", problem.unit().text(problem.noise.sigma_mm * 1e3, 3));
    let (statement, verdict, test) = match (problem.noise.source, contradicted) {
        (_, Some(why)) => (format!("{figure}, as stated"), AssumptionVerdict::Contradicted, why),
        (NoiseSource::Stated, None) => (
            format!("{figure}, as stated"),
            AssumptionVerdict::Agrees,
            "repeats, if there are any, do not contradict it".to_string(),
        ),
        (NoiseSource::Repeats, None) => {
            (format!("{figure}, from repeats"), AssumptionVerdict::Agrees, "pure error of the repeats".to_string())
        }
        (NoiseSource::Targets, None) => (
            format!("{figure}, from several targets at each pose"),
            AssumptionVerdict::Agrees,
            "distances between the targets, which a pose does not change".to_string(),
        ),
        (_, None) => (
            format!("{figure}, from the residual of the model"),
            AssumptionVerdict::NotTested,
            "no noise is stated or follows from repeats".to_string(),
        ),
    };
    Assumption { kind: AssumptionKind::Noise, statement, verdict, test }
}

/// The stated values of the set-up against their estimates.
fn priors(problem: &Problem, fit: &Fit) -> Option<Assumption> {
    let list = &problem.parameters.list;
    let stated = |prior: Prior| matches!(prior, Prior::Gaussian(_));
    let count = list.iter().filter(|parameter| parameter.id.is_setup() && stated(parameter.prior)).count();
    if count == 0 {
        return None;
    }
    let pulls = Pulls::of(problem, fit);
    let largest = pulls.each.iter().max_by(|a, b| a.pull.abs().total_cmp(&b.pull.abs()));
    let (verdict, test) = match largest {
        None => (AssumptionVerdict::NotTested, "the readings contain no information about them".to_string()),
        Some(pull) => {
            let contradicted = !pulls.contradicted().is_empty();
            let verdict = if contradicted { AssumptionVerdict::Contradicted } else { AssumptionVerdict::Agrees };
            let id = &list[pull.parameter].id;
            (verdict, format!("largest pull {:.1} ({id}), limit {:.1}", pull.pull.abs(), pulls.limit))
        }
    };
    let statement = format!("{} with their stated uncertainties", counted(count, "set-up parameter"));
    Some(Assumption { kind: AssumptionKind::Priors, statement, verdict, test })
}

/// The range of the readings along each axis that moves.
fn ranges(problem: &Problem) -> Vec<DataRange> {
    let machine = &problem.session.machine;
    let mut ranges = Vec::new();
    for (index, axis) in machine.axes.iter().enumerate() {
        let positions = (problem.tests.iter()).filter_map(|test| test.readings.as_ref()?.positions.get(index));
        let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
        for position in positions.flatten() {
            (least, greatest) = (least.min(*position), greatest.max(*position));
        }
        if least < greatest {
            let range = [least, greatest].map(|position| axis.kind.to_display(position));
            ranges.push(DataRange { axis: axis.name.clone(), range, unit: axis.kind.unit().to_string() });
        }
    }
    ranges
}
