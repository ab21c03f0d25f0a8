//! Selects poses for an instrument that measures at rest.
//!
//! Candidate poses are drawn at random within the travel of the axes and the limits of the user ([`candidates`]), and
//! brought to where the instrument measures: a tracker anywhere, a socket's ball in the socket. A
//! set is chosen greedily and exchanged ([`design`](crate::design)).
//!
//! Parameters that as many average candidates do not separate are held at nominal, as in a base parametrisation, so that
//! the covariance of the others exists. Set-up quantities are estimated within their priors.

pub mod candidates;
mod place;

use std::sync::Arc;

use abbe_identify::error;
use abbe_identify::noise::{Noise, NoiseSource, ReadingNoise};
use abbe_identify::numerics::median;
use abbe_identify::numerics::rank::Rank;
use abbe_identify::numerics::solve::Svd;
use abbe_identify::numerics::tolerances::MIN_IDENTIFIABLE;
use abbe_identify::numerics::triangle::Triangle;
use abbe_identify::problem::{Problem, RowBlock};
use abbe_model::Diagnostic;
use abbe_model::axis::AxisKind;
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};
use abbe_model::words::counted;
use candidates::{PoseLimits, states_of};
use faer::Mat;
use place::Place;
use rand::RngExt;
use rand::seq::index;
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::Serialize;

use crate::design::information::{SharedParameters, sum_of};
use crate::design::{Design, Goal, bound};
use crate::improve::NamedUncertainty;
use crate::states;

/// Options of the selection.
#[derive(Clone, Debug)]
pub struct PoseOptions {
    /// Number of poses.
    pub poses: usize,
    /// What the poses make small.
    pub goal: Goal,
    /// Number of candidate poses.
    pub candidates: usize,
    /// Seed of the candidates and of the random sets.
    pub seed: u64,
    /// Where poses may be.
    pub limits: PoseLimits,
    /// Standard deviation of a scalar reading, mm; `None`: that of the session, else the assumed one of a plan.
    pub noise_mm: Option<f64>,
}

/// The prior of every parameter, in physical sizes. It makes the covariance of few poses exist, and has a share of at most
/// 10⁻⁶ in that of poses of full rank.
const RIDGE_SIZES: f64 = 1e3;
/// Factor by which the least singular value of an estimated combination grows until the chosen poses determine all, and its
/// largest value.
const LEAST_STEP: f64 = 3.0;
const MAX_LEAST: f64 = 100.0;
/// Number of random sets with which the selection is compared.
const RANDOM_SETS: usize = 100;
/// Streams of the generator.
const CANDIDATE_STREAM: u128 = 0;
const RANDOM_SET_STREAM: u128 = 1;

/// The selected poses.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PoseSelection {
    /// The test of each pose, whose instrument measures it.
    pub tests: Vec<String>,
    /// The socket of each pose; empty for other instruments.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sockets: Vec<String>,
    /// The criterion and its unit.
    pub criterion: String,
    /// Its value for the selected poses.
    pub value: f64,
    /// A bound of the criterion: no set of as many candidates reaches a smaller value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bound: Option<f64>,
    /// Median of its values for 100 random sets of as many candidates; `null` if more than half leave an error
    /// undetermined.
    #[schemars(with = "Option<f64>")]
    pub random_median: f64,
    /// The noise of a reading.
    #[serde(flatten)]
    pub noise: ReadingNoise,
    /// Number of candidate poses.
    pub candidates: usize,
    /// Number of drawn poses at which the instrument cannot measure, or that the limits excluded.
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

/// The tests whose instruments measure the poses: that of a name; without a name the last one, or of sockets all. Empty
/// if no test has the name.
pub fn measured_by<'s>(session: &'s Session, name: Option<&str>) -> Vec<&'s Test> {
    match name {
        Some(name) => session.tests.iter().filter(|test| test.name == name).collect(),
        None if !session.instrument.entry().has_readings => session.tests.iter().collect(),
        None => session.tests.last().into_iter().collect(),
    }
}

/// The tests whose sockets have no place: neither the session states it, nor do the poses of their readings.
pub fn without_place<'t>(session: &Session, tests: &[&'t Test]) -> Vec<&'t Test> {
    let located = located(session, tests);
    let lacking = |(_, test): &(&&Test, Test)| !test.station.is_located();
    tests.iter().zip(located).filter(lacking).map(|(test, _)| *test).collect()
}

/// Selects poses for tests of a session, by their instruments, priors and set-up. Readings of the session do not count,
/// but for the places of sockets that it does not state.
///
/// # Errors
/// If a socket has no place, no pose reaches where the instrument measures, the limits leave too few candidates, or the
/// model cannot be evaluated.
pub fn select(session: &Session, tests: &[&Test], options: &PoseOptions) -> Result<PoseSelection, Diagnostic> {
    if let Some(test) = without_place(session, tests).first() {
        return Err(Diagnostic::identification(format!(
            "test `{}`: the place of its socket is not known; state `socket_mm`, or give the data with poses in the socket",
            test.name
        )));
    }
    let asked = counted(options.poses, "chosen pose");
    let Found { tests, candidates, excluded, warnings } = candidates(session, tests, options)?;
    if candidates.len() < options.poses {
        let (left, drawn) = (candidates.len(), candidates.len() + excluded);
        let found = format!("{left} of {drawn} drawn poses are within the limits");
        let expected = "widen the limits or draw more candidates";
        return Err(error::not_applicable(asked, found, expected));
    }
    let problem = problem(session, &tests, &candidates, noise(session, options))?;
    let list = &problem.parameters.list;
    let nominal = vec![0.0; list.len()];
    // What as many average poses do not determine is held.
    let mut average = problem.clone();
    average.noise.sigma_mm *= (candidates.len() as f64 / options.poses as f64).sqrt();
    let information = Triangle::new(list.len()).merged(&average.triangles(&nominal)?);
    let information = information.merged([&problem.prior_triangle(&nominal)]);
    let prior = problem.prior_triangle(&nominal).r();
    let mut least = MIN_IDENTIFIABLE;
    let Chosen { rank, shared, of_targets, base, rows, prior, poses: chosen } = loop {
        let rank = problem.parameters.rank_above(&information, (least, 0))?;
        let found = chosen_with(&problem, rank, &prior, options)?;
        let ranked = Ranked { shared: &found.shared, rows: &found.rows, prior: &found.prior };
        let [rank_of_chosen, involved] = ranked.rank(&found.poses)?;
        if rank_of_chosen == involved {
            break found;
        }
        // With enough readings, more poses do not help: the layout itself hardly determines a combination.
        if options.poses * problem.channels(0) >= involved && least < MAX_LEAST {
            least *= LEAST_STEP;
            continue;
        }
        let lacking = involved - rank_of_chosen;
        let unknowns = counted(involved, "unknown");
        let found =
            format!("the readings of {} have rank {rank_of_chosen} in {unknowns}", counted(options.poses, "pose"));
        let least = options.poses + lacking.div_ceil(problem.channels(0));
        return Err(error::not_applicable(asked, found, format!("ask for at least {least} poses")));
    };
    let views = rows.iter().map(|rows| rows.as_ref()).collect();
    let design = Design { shared: &shared, base: &base, rows: views, goal: &options.goal, repeats: false };
    let ranked = Ranked { shared: &shared, rows: &rows, prior: &prior };
    let mut random = Pcg64::new(u128::from(options.seed), RANDOM_SET_STREAM);
    let value = |poses: &[usize]| options.goal.value(&shared, &design.with(poses));
    let mut values = (0..RANDOM_SETS)
        .map(|_| {
            let poses = index::sample(&mut random, candidates.len(), options.poses).into_vec();
            let [rank, involved] = ranked.rank(&poses)?;
            Ok(if rank == involved { value(&poses) } else { f64::INFINITY })
        })
        .collect::<Result<Vec<f64>, Diagnostic>>()?;
    let u = shared.uncertainties(&design.with(&chosen));
    let machine = &session.machine;
    let display = |pose: &usize| -> Vec<f64> {
        machine.axes.iter().zip(&candidates[*pose].at).map(|(axis, q)| axis.kind.to_display(*q)).collect()
    };
    let test = |pose: &usize| &tests[candidates[*pose].test];
    Ok(PoseSelection {
        tests: chosen.iter().map(|pose| test(pose).name.clone()).collect(),
        sockets: chosen.iter().filter_map(|pose| test(pose).socket.clone()).collect(),
        criterion: options.goal.words().to_string(),
        value: value(&chosen),
        bound: bound::best_value(&design, &chosen),
        random_median: median(&mut values),
        noise: problem.reading_noise(),
        candidates: candidates.len(),
        excluded,
        uncertainties: of_targets
            .iter()
            .zip(u)
            .map(|(j, u)| {
                let parameter = &list[*j];
                NamedUncertainty { id: parameter.id.to_string(), u, unit: parameter.unit.name.clone() }
            })
            .collect(),
        held: rank.pivots.iter().map(|j| list[*j].id.to_string()).collect(),
        columns: machine.axes.iter().map(|axis| axis.column("")).collect(),
        poses: chosen.iter().map(display).collect(),
        warnings: [
            session.warnings.clone(),
            warnings,
            states::noise_warning(&problem.noise, problem.unit()).into_iter().collect(),
        ]
        .concat(),
    })
}

/// Poses that are chosen with some parameters held.
struct Chosen {
    /// Its pivots are held.
    rank: Rank,
    /// The others, those of interest last.
    shared: SharedParameters,
    /// The parameters of interest.
    of_targets: Vec<usize>,
    /// Information of the priors.
    base: Mat<f64>,
    /// Whitened rows of each candidate.
    rows: Vec<Mat<f64>>,
    /// Whitened rows of the priors.
    prior: Mat<f64>,
    /// The poses among the candidates.
    poses: Vec<usize>,
}

/// Chooses poses with the pivots of a rank held at nominal.
fn chosen_with(problem: &Problem, rank: Rank, prior: &Mat<f64>, options: &PoseOptions) -> Result<Chosen, Diagnostic> {
    let list = &problem.parameters.list;
    let kept: Vec<usize> = (0..list.len()).filter(|j| !rank.pivots.contains(j)).collect();
    let (others, of_targets): (Vec<usize>, Vec<usize>) = kept.into_iter().partition(|j| list[*j].id.is_setup());
    if of_targets.is_empty() {
        return Err(error::no_unknowns());
    }
    let shared = SharedParameters::of(problem, &others, &of_targets);
    let columns = [others, of_targets.clone()].concat();
    let prior = Mat::from_fn(prior.nrows(), columns.len(), |i, k| prior[(i, columns[k])]);
    let rows = whitened(problem, &columns)?;
    let base = shared.regularised(prior.as_ref(), RIDGE_SIZES);
    let views = rows.iter().map(|rows| rows.as_ref()).collect();
    let poses =
        Design { shared: &shared, base: &base, rows: views, goal: &options.goal, repeats: false }.run(options.poses);
    Ok(Chosen { rank, shared, of_targets, base, rows, prior, poses })
}

/// Copies of tests of a session, with the places of sockets that only their readings tell.
fn located(session: &Session, tests: &[&Test]) -> Vec<Test> {
    let stations = abbe_identify::start::stations(session, &session.tests);
    let of = |test: &&Test| {
        let place = session.tests.iter().position(|own| own.name == test.name);
        let station = match (&test.station, place.map(|place| &stations[place])) {
            (own, Some(found)) if !own.is_located() => found.clone(),
            (own, _) => own.clone(),
        };
        Test { station, ..(*test).clone() }
    };
    tests.iter().map(of).collect()
}

/// A candidate pose.
struct Candidate {
    /// Index of its test.
    test: usize,
    /// Positions of all axes, mm or rad.
    at: Vec<f64>,
}

/// The tests with candidates, and their candidates in the order of the tests.
struct Found {
    tests: Vec<Test>,
    candidates: Vec<Candidate>,
    excluded: usize,
    warnings: Vec<String>,
}

/// Candidates of all tests, as many of each. A test without any is left out with a warning unless all are.
fn candidates(session: &Session, tests: &[&Test], options: &PoseOptions) -> Result<Found, Diagnostic> {
    let mut random = Pcg64::new(u128::from(options.seed), CANDIDATE_STREAM);
    let mut found = Found { tests: Vec::new(), candidates: Vec::new(), excluded: 0, warnings: untravelled(session) };
    let mut unmet = None;
    for (number, test) in located(session, tests).into_iter().enumerate() {
        let share = options.candidates / tests.len() + usize::from(number < options.candidates % tests.len());
        let drawn = candidates::draw(session, &test, &options.limits, share, &mut random)?;
        found.excluded += drawn.excluded;
        if drawn.states.is_empty() && drawn.unmet > 0 && drawn.unmet == drawn.excluded {
            let (goal, check) = Place::words(&test.station);
            found.warnings.push(format!("test `{}`: no drawn pose {goal}; it is left out", test.name));
            unmet.get_or_insert(Diagnostic::identification(format!(
                "test `{}`: none of {} drawn poses {goal} within the travel of the axes; check {check}",
                test.name, drawn.unmet
            )));
            continue;
        }
        let number = found.tests.len();
        found.candidates.extend(drawn.states.into_iter().map(|at| Candidate { test: number, at }));
        found.tests.push(test);
    }
    match unmet {
        Some(error) if found.candidates.is_empty() => Err(error),
        _ => Ok(found),
    }
}

/// The warning about rotary axes without travel.
fn untravelled(session: &Session) -> Vec<String> {
    let axes = session.machine.axes.iter().filter(|axis| axis.kind == AxisKind::Rotary && axis.travel.is_none());
    let names: Vec<String> = axes.map(|axis| format!("`{}`", axis.name)).collect();
    let sentence = format!("no travel is stated of {}: poses may turn them from -180 to 180 deg", names.join(", "));
    if names.is_empty() { Vec::new() } else { vec![sentence] }
}

/// The problem of a session with these tests, which have a reading at every candidate pose.
fn problem(session: &Session, tests: &[Test], candidates: &[Candidate], noise: Noise) -> Result<Problem, Diagnostic> {
    let means = session.reference().means;
    let with_readings = |(number, test): (usize, &Test)| {
        let poses: Vec<&[f64]> =
            candidates.iter().filter(|pose| pose.test == number).map(|pose| pose.at.as_slice()).collect();
        let mut readings: Readings = states_of(&session.machine, &poses, &test.station);
        let model = TestModel::new(Arc::clone(&session.machine), test.station.clone(), &readings);
        readings.observed = model.readings(&SlotValues::zero(model.slots()));
        readings.channels_to_columns(&session.machine, &test.station);
        let means = means.iter();
        readings.drivers = means.map(|(name, mean)| (name.clone(), vec![*mean; poses.len()])).collect();
        Test { readings: Some(Arc::new(readings)), ..test.clone() }
    };
    let tests = tests.iter().enumerate().map(with_readings).collect();
    states::problem_by_test(&Session { tests, ..session.clone() }, noise)
}

/// The whitened rows of each candidate pose, in the order of the tests.
fn whitened(problem: &Problem, columns: &[usize]) -> Result<Vec<Mat<f64>>, Diagnostic> {
    let values = problem.slot_values(&vec![0.0; problem.parameters.list.len()]);
    let sigma = problem.noise.sigma_mm;
    let mut rows = Vec::new();
    for (test, model) in problem.models.iter().enumerate() {
        let channels = problem.channels(test);
        let whole = problem.rows(&values, &RowBlock { test, rows: 0..model.rows() })?;
        rows.extend((0..model.rows()).map(|pose| {
            Mat::from_fn(channels, columns.len(), |i, k| whole[(pose * channels + i, columns[k])] / sigma)
        }));
    }
    Ok(rows)
}

/// The noise of a reading: that of the options, else that of the session, else the assumed one.
fn noise(session: &Session, options: &PoseOptions) -> Noise {
    let stated = options.noise_mm.or(session.stated_noise_mm()).filter(|sigma| *sigma > 0.0);
    stated.map_or_else(states::assumed_noise, |sigma| Noise::white(sigma, NoiseSource::Stated))
}

/// A number between two limits.
fn between(random: &mut Pcg64, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * random.random::<f64>()
}

/// The readings of candidate poses and the priors, without regularisation.
struct Ranked<'r> {
    /// The parameters, the targets last.
    pub shared: &'r SharedParameters,
    /// Whitened rows of each candidate.
    pub rows: &'r [Mat<f64>],
    /// Whitened rows of the priors.
    pub prior: &'r Mat<f64>,
}

impl Ranked<'_> {
    /// Numerical rank of the readings of some poses with the priors, and the number of parameters that they involve: the
    /// place of a socket without a pose is none of them.
    pub fn rank(&self, poses: &[usize]) -> Result<[usize; 2], Diagnostic> {
        let (count, size) = (self.shared.ids.len(), &self.shared.size);
        let first = count - self.shared.targets;
        let involved =
            |k: &usize| *k >= first || poses.iter().any(|pose| self.rows[*pose].col(*k).iter().any(|x| *x != 0.0));
        let (own, others): (Vec<usize>, Vec<usize>) = (0..count).partition(involved);
        // A prior that connects a parameter with one that is not involved tells nothing of it.
        let is_own = |row: &usize| others.iter().all(|k| self.prior[(*row, *k)] == 0.0);
        let prior_rows: Vec<usize> = (0..self.prior.nrows()).filter(is_own).collect();
        let scaled = |rows: &Mat<f64>, of: &[usize]| {
            Mat::from_fn(of.len(), own.len(), |i, k| rows[(of[i], own[k])] * size[own[k]])
        };
        let mut parts = vec![scaled(self.prior, &prior_rows)];
        parts.extend(poses.iter().map(|pose| {
            let rows = &self.rows[*pose];
            scaled(rows, &(0..rows.nrows()).collect::<Vec<_>>())
        }));
        let root = sum_of(parts.iter().map(|part| part.as_ref()));
        Ok([Svd::of(root.as_ref())?.identifiable_rank(), own.len()])
    }
}
