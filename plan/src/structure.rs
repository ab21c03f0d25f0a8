//! Structural beside numerical identifiability: ranks, singular values and base parameters.
//!
//! | rank | geometry | noise | priors |
//! |---|---|---|---|
//! | structural | generic: random origins of axes, points of the instrument and fixed positions of axes | none | none |
//! | of the readings | of the plan | none | none |
//! | numerical, readings | of the plan | of the plan | none |
//! | numerical | of the plan | of the plan | of the plan |
//!
//! The structural rank is the maximum over the lengths of the set-up (Bellman & Åström, Math. Biosci. 7 (1970) 329). It
//! is that of almost every geometry, so a few random ones decide it. A plan whose rank is lower has a special geometry:
//! a ball on an axis, two axes that intersect.
//!
//! A base parameter is an identifiable combination. Where the null space has the combination `Σ n_j β_j` with pivot `p`
//! and `n_p = 1`, the parameters `β_j − n_j β_p` are identifiable (Khalil & Gautier, Proc. IFAC Identification (1991)
//! 576).

use std::collections::HashMap;
use std::sync::Arc;

use abbe_identify::linear::{Linearisation, is_of_interest};
use abbe_identify::numerics::rank::Rank;
use abbe_identify::numerics::solve::Svd;
use abbe_identify::numerics::triangle::Triangle;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::instrument::SharedBy;
use abbe_model::session::{Session, Test};
use faer::Mat;
use rand::RngExt;
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::Serialize;

use super::states;

/// Number of random geometries.
const GEOMETRIES: u64 = 3;
/// Largest change of a length, mm.
const CHANGE_MM: f64 = 50.0;
/// Shares below this value, relative to the largest of a combination, are rounding errors.
const NEGLIGIBLE: f64 = 1e-5;

/// Ranks, singular values and base parameters of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Structure {
    /// Number of parameters, set-up parameters included.
    pub parameter_count: usize,
    /// Rank of noise-free readings at a generic geometry; `null` where no random geometry can be evaluated.
    pub structural_rank: Option<usize>,
    /// Rank of noise-free readings at the geometry of the plan.
    pub rank_of_readings: usize,
    /// Rank of the readings against their noise, without priors.
    pub rank_without_priors: usize,
    /// Rank of readings and priors against the noise.
    pub rank: usize,
    /// Singular values of readings and priors in descending order, standard deviations per physical size (1 mm,
    /// 0.01 rad).
    pub singular_values: Vec<f64>,
    /// The base parameters: identifiable combinations of the errors.
    pub base: Vec<BaseParameter>,
    /// The parameters that the base parametrisation holds at nominal.
    pub held_at_nominal: Vec<String>,
}

/// An identifiable combination: an error plus multiples of errors that are held at nominal.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct BaseParameter {
    /// The leading error.
    pub id: String,
    /// Unit of the error and of `u`.
    pub unit: String,
    /// The further terms: parameter and coefficient, in the display units of both.
    pub terms: Vec<(String, f64)>,
    /// Predicted standard uncertainty of the combination, in `unit`.
    pub u: f64,
}

/// The structure of a plan. The folds of the problem are its tests.
///
/// # Errors
/// If the model cannot be evaluated at the geometry of the plan.
pub fn structure(problem: &Problem) -> Result<Structure, Diagnostic> {
    let list = &problem.parameters.list;
    let linear = Linearisation::of(problem, &vec![0.0; list.len()])?;
    let alone = Rank::decide(&linear.readings, &linear.size, &linear.preference)?;
    Ok(Structure {
        parameter_count: list.len(),
        structural_rank: (0..GEOMETRIES).filter_map(|draw| rank_at_random(problem, draw)).max(),
        rank_of_readings: rank_of(&linear.readings, &linear.size)?,
        rank_without_priors: alone.identifiable_basis.ncols(),
        rank: linear.rank.identifiable_basis.ncols(),
        singular_values: linear.rank.singular_values.clone(),
        base: base(problem, &linear),
        held_at_nominal: linear.rank.pivots.iter().map(|pivot| list[*pivot].id.to_string()).collect(),
    })
}

/// The rank of noise-free readings.
fn rank_of(readings: &Triangle, size: &[f64]) -> Result<usize, Diagnostic> {
    let r = readings.r();
    Ok(Svd::of(Mat::from_fn(r.nrows(), r.ncols(), |i, j| r[(i, j)] * size[j]).as_ref())?.numerical_rank())
}

/// The rank at a random geometry; `None` if the model cannot be evaluated there.
fn rank_at_random(problem: &Problem, draw: u64) -> Option<usize> {
    let session = random_geometry(&problem.session, &problem.tests, draw);
    let generic = states::problem_by_test(&session, problem.noise.clone()).ok()?;
    let linear = Linearisation::of(&generic, &vec![0.0; generic.parameters.list.len()]).ok()?;
    rank_of(&linear.readings, &linear.size).ok()
}

/// The session with random changes of all lengths. What several tests share stays common to them.
fn random_geometry(session: &Session, tests: &[Test], draw: u64) -> Session {
    let mut random = Pcg64::new(u128::from(draw), 0);
    let mut machine = (*session.machine).clone();
    let mut change = || random.random_range(-CHANGE_MM..CHANGE_MM);
    machine.axes.iter_mut().flat_map(|axis| &mut axis.origin_mm).for_each(|length| *length += change());
    let mut changes: HashMap<(SharedBy, String), [f64; 3]> = HashMap::new();
    let mut tests = tests.to_vec();
    for test in &mut tests {
        let groups = [SharedBy::Setup, SharedBy::SpindleSetup].map(|by| (by, test.group(by).to_string()));
        let [at_workpiece, at_tool] =
            groups.map(|group| *changes.entry(group).or_insert_with(|| std::array::from_fn(|_| change())));
        let add = |point: &mut [f64; 3], by: [f64; 3]| point.iter_mut().zip(by).for_each(|(x, by)| *x += by);
        for (point, by) in test.station.points_mut().into_iter().zip([at_workpiece, at_tool]) {
            if let Some(point) = point {
                add(&mut point.mm, by);
            }
        }
        let Some(readings) = &mut test.readings else { continue };
        for (axis, positions) in machine.axes.iter().zip(&mut Arc::make_mut(readings).positions) {
            let fixed = positions.iter().all(|position| *position == positions[0]);
            if fixed && axis.kind == abbe_model::axis::AxisKind::Linear {
                let by = change();
                positions.iter_mut().for_each(|position| *position += by);
            }
        }
    }
    Session { machine: Arc::new(machine), tests, ..session.clone() }
}

/// The identifiable combinations of the errors.
fn base(problem: &Problem, linear: &Linearisation) -> Vec<BaseParameter> {
    let list = &problem.parameters.list;
    let rank = &linear.rank;
    let display = |j: usize| list[j].unit.display_per_internal;
    (0..list.len())
        .filter(|j| is_of_interest(&list[*j]) && !rank.pivots.contains(j))
        .map(|j| {
            let mut internal = vec![(j, 1.0)];
            for (row, pivot) in rank.null_combinations.iter().zip(&rank.pivots) {
                let largest = row.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
                if row[j].abs() > NEGLIGIBLE * largest {
                    internal.push((*pivot, -row[j] * linear.size[j] / linear.size[*pivot]));
                }
            }
            let variance: f64 = internal
                .iter()
                .flat_map(|(a, x)| internal.iter().map(move |(b, y)| x * y * linear.covariance[(*a, *b)]))
                .sum();
            let terms =
                internal[1..].iter().map(|(p, share)| (list[*p].id.to_string(), share * display(j) / display(*p)));
            BaseParameter {
                id: list[j].id.to_string(),
                unit: list[j].unit.name.clone(),
                terms: terms.collect(),
                u: variance.max(0.0).sqrt() * display(j),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use abbe_files::ReadOptions;
    use abbe_identify::noise::{Noise, NoiseSource};
    use abbe_model::component::ErrorName;

    use super::*;

    fn problem_of(name: &str, change: impl Fn(&mut Session)) -> Problem {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions").join(name);
        let mut session = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        change(&mut session);
        let plan = states::complete(&session, true).unwrap();
        states::problem_by_test(&plan, Noise::white(3e-4, NoiseSource::Stated)).unwrap()
    }

    /// A test of A alone with known balls. `L²` is a constant, a cosine and a sine of A whatever the errors of A, so
    /// that no geometry has more than three identifiable combinations. With the bar in the plane of the circle (D = 0),
    /// Eq. 3.20 of Jiang (2014) has no angle of A to first order, and two positions remain.
    #[test]
    fn a_special_geometry_has_a_lower_rank_than_a_generic_one() {
        let only = |session: &mut Session| {
            session.tests.truncate(1);
            session.tests[0].priors.iter_mut().for_each(|prior| *prior = abbe_model::session::Prior::Known);
            session.unknowns = ["EY0A", "EZ0A", "EB0A", "EC0A"].map(|name| ErrorName::parse(name).unwrap()).to_vec();
        };
        let found = structure(&problem_of("hermle-c600u/chapter5.toml", only)).unwrap();
        assert_eq!((found.rank_of_readings, found.structural_rank, found.parameter_count), (2, Some(3), 4));
        assert_eq!(found.rank, 2);
        assert_eq!(found.singular_values.len(), 4);
    }

    /// Along every base parameter's null directions nothing changes: a base parameter applied to a null combination is
    /// zero. Its uncertainty is finite.
    #[test]
    fn base_parameters_do_not_change_along_the_null_space() {
        let all = |session: &mut Session| {
            let names = ["X", "Y", "Z", "A", "B", "C"].into_iter();
            let names = names.flat_map(|freedom| ["A", "C"].map(|axis| format!("E{freedom}0{axis}")));
            session.unknowns = names.filter_map(|name| ErrorName::parse(&name)).collect();
        };
        let problem = problem_of("hermle-c600u/chapter5.toml", all);
        let found = structure(&problem).unwrap();
        let linear = Linearisation::of(&problem, &vec![0.0; problem.parameters.list.len()]).unwrap();
        let null = abbe_identify::identifiability::unidentifiable(&problem, &linear.rank);
        assert!(!null.is_empty() && found.held_at_nominal.len() == null.len());
        assert!(found.base.iter().any(|base| !base.terms.is_empty()));
        for direction in &null {
            let at = |id: &str| direction.combination.get(id).copied().unwrap_or(0.0);
            for base in &found.base {
                let value = at(&base.id) + base.terms.iter().map(|(id, share)| share * at(id)).sum::<f64>();
                assert!(value.abs() < 1e-6, "{} along {:?}: {value}", base.id, direction.combination);
                assert!(base.u > 0.0 && base.u.is_finite());
            }
        }
        assert!(found.structural_rank >= Some(found.rank_of_readings));
        assert!(found.rank_of_readings >= found.rank_without_priors);
    }
}
