//! Selects poses for an instrument whose states are free: a tracker, or an R-test or a ball bar at rest.
//!
//! Candidate poses are drawn at random within the travel of the axes and the limits of the user ([`candidates`]). A
//! first set is built greedily; then poses are exchanged against candidates until no exchange improves the criterion
//! (Fedorov's algorithm: Atkinson, Donev & Tobias, Optimum Experimental Designs, 2007, ch. 12).
//!
//! Parameters that as many average candidates do not separate are held at nominal, as in a base parametrisation, so that
//! the covariance of the others exists. Set-up quantities are estimated within their priors.

pub mod candidates;
mod information;

use std::sync::Arc;

use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use abbe_model::words::counted;
use rand::RngExt;
use rand::seq::index;
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::Serialize;

use crate::error::IdentifyError;
use crate::noise::{Noise, NoiseSource};
use crate::numerics::median;
use crate::numerics::triangle::Triangle;
use crate::parameters::Role;
use crate::plan::improve::NamedUncertainty;
use crate::plan::states;
use crate::problem::Problem;
use candidates::{PoseLimits, states_of};
use information::Exchange;

/// What the poses are to make small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseCriterion {
    /// The volume of the confidence ellipsoid of the errors.
    D,
    /// The mean variance of the errors, where 1 µm counts as 1″.
    A,
    /// The largest standard uncertainty of an error, where 1 µm counts as 1″.
    WorstUncertainty,
}

impl PoseCriterion {
    /// What its value is, with its unit.
    pub fn words(self) -> &'static str {
        match self {
            PoseCriterion::D => {
                "geometric mean of the standard deviations along the axes of the confidence ellipsoid, um or arcsec"
            }
            PoseCriterion::A => "root mean square standard uncertainty, um or arcsec",
            PoseCriterion::WorstUncertainty => "worst standard uncertainty, um or arcsec",
        }
    }
}

/// Options of the selection.
#[derive(Clone, Debug)]
pub struct PoseOptions {
    /// Number of poses.
    pub poses: usize,
    /// The criterion.
    pub criterion: PoseCriterion,
    /// Number of candidate poses.
    pub candidates: usize,
    /// Seed of the candidates and of the random sets.
    pub seed: u64,
    /// Where poses may be.
    pub limits: PoseLimits,
    /// Standard deviation of a scalar reading, mm; `None`: that of the session, else the assumed one of a plan.
    pub noise_mm: Option<f64>,
}

/// Number of random sets with which the selection is compared.
const RANDOM_SETS: usize = 100;
/// Streams of the generator.
const CANDIDATE_STREAM: u128 = 0;
const RANDOM_SET_STREAM: u128 = 1;

/// The selected poses.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PoseSelection {
    /// The test whose instrument measures the poses.
    pub test: String,
    /// The criterion and its unit.
    pub criterion: String,
    /// Its value for the selected poses.
    pub value: f64,
    /// Median of its values for 100 random sets of as many candidates; infinite (`null` in JSON) if more than half of
    /// them leave an error undetermined.
    #[schemars(with = "Option<f64>")]
    pub random_median: f64,
    /// Standard deviation of a scalar reading, µm.
    pub noise_um: f64,
    /// Source of `noise_um`: `stated` by the session or the user, or `assumed`.
    pub noise_source: String,
    /// Number of candidate poses.
    pub candidates: usize,
    /// Number of drawn poses that the limits excluded.
    pub excluded: usize,
    /// The errors with their standard uncertainties at the selected poses.
    pub uncertainties: Vec<NamedUncertainty>,
    /// Parameters that as many candidate poses do not separate from others. They are held at nominal.
    pub held: Vec<String>,
    /// Columns of `poses`: `j1_deg`, `x_mm`, …
    pub columns: Vec<String>,
    /// The positions of all axes at each pose, in the units of `columns`.
    pub poses: Vec<Vec<f64>>,
    /// Warnings in words.
    pub warnings: Vec<String>,
}

/// Selects poses for one test of a session: its instrument, its priors and its set-up. Readings of the session do not
/// count.
///
/// # Errors
/// If the instrument has no free states, the limits leave too few candidates, or the model cannot be evaluated.
pub fn select(session: &Session, test: &Test, options: &PoseOptions) -> Result<PoseSelection, IdentifyError> {
    let mut random = Pcg64::new(u128::from(options.seed), CANDIDATE_STREAM);
    let found = candidates::draw(session, test, &options.limits, options.candidates, &mut random)?;
    if found.states.len() < options.poses {
        return Err(IdentifyError::Request(format!(
            "{} of {} drawn poses are within the limits, and {} are asked for; widen the limits or draw more candidates",
            found.states.len(),
            found.states.len() + found.excluded,
            options.poses
        )));
    }
    let problem = problem(session, test, &found.states, noise(session, options))?;
    let list = &problem.parameters.list;
    let nominal = vec![0.0; list.len()];
    // What as many average poses do not determine is held.
    let mut average = problem.clone();
    average.noise.sigma_mm *= (found.states.len() as f64 / options.poses as f64).sqrt();
    let information = Triangle::new(list.len()).merged(&average.triangles(&nominal)?);
    let rank = problem.parameters.rank(&information.merged([&problem.prior_triangle(&nominal)]))?;
    let kept: Vec<usize> = (0..list.len()).filter(|j| !rank.pivots.contains(j)).collect();
    let targets: Vec<usize> = (0..kept.len()).filter(|k| list[kept[*k]].role != Role::Setup).collect();
    if targets.is_empty() {
        return Err(IdentifyError::NoUnknowns);
    }
    let exchange = Exchange::new(&problem, &kept, &targets, options.criterion)?;
    let chosen = exchange.run(options.poses);
    let rank_of_chosen = exchange.rank(&chosen)?;
    if rank_of_chosen < kept.len() {
        let lacking = kept.len() - rank_of_chosen;
        return Err(IdentifyError::Request(format!(
            "the readings of {} have rank {rank_of_chosen} in {}; ask for at least {} poses",
            counted(options.poses, "pose"),
            counted(kept.len(), "unknown"),
            options.poses + lacking.div_ceil(problem.coordinates())
        )));
    }
    let mut random = Pcg64::new(u128::from(options.seed), RANDOM_SET_STREAM);
    let mut values = (0..RANDOM_SETS)
        .map(|_| {
            let poses = index::sample(&mut random, found.states.len(), options.poses).into_vec();
            Ok(if exchange.rank(&poses)? == kept.len() { exchange.value(&poses) } else { f64::INFINITY })
        })
        .collect::<Result<Vec<f64>, IdentifyError>>()?;
    let u = exchange.uncertainties(&chosen);
    let machine = &session.machine;
    let display = |pose: &usize| -> Vec<f64> {
        machine.axes.iter().zip(&found.states[*pose]).map(|(axis, q)| axis.kind.to_display(*q)).collect()
    };
    Ok(PoseSelection {
        test: test.name.clone(),
        criterion: options.criterion.words().to_string(),
        value: exchange.value(&chosen),
        random_median: median(&mut values),
        noise_um: problem.noise.sigma_mm * 1e3,
        noise_source: problem.noise.source.word().to_string(),
        candidates: found.states.len(),
        excluded: found.excluded,
        uncertainties: targets
            .iter()
            .zip(u)
            .map(|(k, u)| {
                let parameter = &list[kept[*k]];
                NamedUncertainty { id: parameter.id.clone(), u, unit: parameter.unit.name.clone() }
            })
            .collect(),
        held: rank.pivots.iter().map(|j| list[*j].id.clone()).collect(),
        columns: machine.axes.iter().map(|axis| axis.column("")).collect(),
        poses: chosen.iter().map(display).collect(),
        warnings: session.warnings.iter().cloned().chain(states::noise_warning(&problem.noise)).collect(),
    })
}

/// The problem of a session with one test, which has a reading at every candidate pose.
fn problem(session: &Session, test: &Test, poses: &[Vec<f64>], noise: Noise) -> Result<Problem, IdentifyError> {
    let mut readings: Readings = states_of(&session.machine, poses, test.station.kind().coordinates());
    let model = TestModel::new(Arc::clone(&session.machine), test.station.clone(), &readings);
    readings.observed = model.readings_mm(&SlotValues::zero(model.slots()));
    let means = session.reference().means.into_iter();
    readings.drivers = means.map(|(name, mean)| (name, vec![mean; poses.len()])).collect();
    let alone = Test { readings: Some(Arc::new(readings)), ..test.clone() };
    let session = Session { tests: vec![alone], socket_distances: Vec::new(), ..session.clone() };
    states::problem_by_test(&session, noise)
}

/// The noise of a reading: that of the options, else that of the session, else the assumed one.
fn noise(session: &Session, options: &PoseOptions) -> Noise {
    let stated = options.noise_mm.or(session.noise_mm).filter(|sigma| *sigma > 0.0);
    stated.map_or_else(states::assumed_noise, |sigma| Noise::white(sigma, NoiseSource::Stated))
}

/// A number between two limits.
fn between(random: &mut Pcg64, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * random.random::<f64>()
}
