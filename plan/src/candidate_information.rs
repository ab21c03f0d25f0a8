//! The information of every candidate test, evaluated once.

use super::candidates::CandidateTest;
use super::design::information::{Root, SharedParameters, sum_of};
use super::design::{Design, Goal};
use super::variations::TestVariations;
use abbe_identify::linear::Linearisation;
use abbe_identify::numerics::parallel;
use abbe_identify::numerics::triangle::Triangle;
use abbe_identify::parameters::Parameter;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::instrument::{Contact, SharedBy};
use abbe_model::parameter_id::ParameterId;
use abbe_model::session::Test;

/// The information of every candidate test on the shared parameters.
pub struct PreparedCandidates {
    /// The shared parameters.
    pub shared: SharedParameters,
    /// The information of the plan itself.
    pub base: Root,
    /// The candidate tests.
    pub candidates: Vec<CandidateInformation>,
}

/// A candidate test with its information.
pub struct CandidateInformation {
    /// The test. Its name states which ball stays mounted.
    pub test: CandidateTest,
    /// Its information.
    pub root: Root,
}

impl PreparedCandidates {
    /// Evaluates the candidate tests for a problem whose folds are its tests, at the parameter values `beta`. `targets`
    /// are the parameters of the goal.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    pub fn new(
        problem: &Problem,
        beta: &[f64],
        tests: Vec<CandidateTest>,
        variations: &TestVariations,
        targets: &[usize],
    ) -> Result<PreparedCandidates, Diagnostic> {
        let list = &problem.parameters.list;
        let kept: Vec<usize> =
            (0..list.len()).filter(|j| !targets.contains(j) && may_be_shared(problem, &list[*j])).collect();
        let shared = SharedParameters::of(problem, &kept, targets);
        let linear = Linearisation::of(problem, beta)?;
        let base = shared.root_of(problem, &linear)?;
        let ready = parallel::map(tests.len(), &|k| ready(problem, &shared, &tests[k], variations));
        let ready: Vec<Vec<CandidateInformation>> = ready.into_iter().collect::<Result<_, Diagnostic>>()?;
        Ok(PreparedCandidates { shared, base, candidates: ready.into_iter().flatten().collect() })
    }

    /// The candidate tests as those of a design. A test may be made twice.
    pub fn design<'d>(&'d self, goal: &'d Goal) -> Design<'d> {
        let rows = self.candidates.iter().map(|candidate| candidate.root.as_ref()).collect();
        Design { shared: &self.shared, base: &self.base, rows, goal, repeats: true }
    }

    /// The information `root` with a candidate test added.
    pub fn added(&self, root: &Root, candidate: usize) -> Root {
        sum_of([root.as_ref(), self.candidates[candidate].root.as_ref()].into_iter())
    }
}

/// Whether a new test can share a parameter: errors and effects, what stands on the table or beside the machine, what is
/// mounted at the tool in the last test, what all tests share.
fn may_be_shared(problem: &Problem, parameter: &Parameter) -> bool {
    let ParameterId::Setup { thing, group, .. } = &parameter.id else { return true };
    match shared_by(problem.tests.iter(), thing) {
        Some(SharedBy::Setup | SharedBy::Session) => true,
        Some(SharedBy::SpindleSetup) => problem.tests.last().is_some_and(|last| *group == last.spindle_setup),
        _ => group.is_empty(),
    }
}

/// What shares an object of the set-up, by the instruments of these tests: that of the sensors is the mount of their body.
fn shared_by<'t>(mut tests: impl Iterator<Item = &'t Test>, thing: &str) -> Option<SharedBy> {
    tests.find_map(|test| {
        let unknowns = test.station.kind().unknowns();
        let found = unknowns.iter().find(|unknown| unknown.thing == thing)?.shared_by;
        Some(if found == SharedBy::Sensors { test.station.sensors() } else { found })
    })
}

/// The information of a candidate test with a newly mounted spindle ball and, if permitted, with the spindle ball that
/// stays mounted. The readings are the same.
fn ready(
    problem: &Problem,
    shared: &SharedParameters,
    candidate: &CandidateTest,
    variations: &TestVariations,
) -> Result<Vec<CandidateInformation>, Diagnostic> {
    let mut session = abbe_model::session::Session::clone(&problem.session);
    session.tests = vec![candidate.test.clone()];
    session.effects = Vec::new();
    session.socket_distances = Vec::new();
    let mut noise = problem.noise.clone();
    noise.sigma_mm /= (variations.thin.max(1) as f64).sqrt();
    let mut alone = Problem::new(&session, noise, 0)?;
    alone.reference = problem.reference.clone();
    for effect in &problem.parameters.effects {
        alone.add_effect(effect)?;
    }
    let nominal = vec![0.0; alone.parameters.list.len()];
    let r = Triangle::new(nominal.len()).merged(&alone.triangles(&nominal)?).r();
    let mut ready = Vec::new();
    let last = problem.tests.last().filter(|last| {
        variations.keep_spindle_ball
            && last.station.kind() == candidate.test.station.kind()
            && last.spindle_setup != candidate.test.spindle_setup
            // Optics and sensors of angles are aligned anew.
            && !matches!(last.station.contact(), Contact::None)
            && last.station.tool_point() == candidate.test.station.tool_point()
    });
    if let Some(last) = last {
        let is_of_tool = |thing: &str| shared_by(alone.tests.iter(), thing) == Some(SharedBy::SpindleSetup);
        let root = shared.root_of_test(&alone, r.as_ref(), |id| match id {
            ParameterId::Setup { thing, group, .. } if *group == candidate.test.spindle_setup && is_of_tool(thing) => {
                id.clone().with_group(&last.spindle_setup)
            }
            _ => id.clone(),
        });
        let mut candidate = candidate.clone();
        candidate.test.spindle_setup = last.spindle_setup.clone();
        let mounted = last.station.points()[1].map_or("tool", |point| point.name);
        candidate.name.push_str(&format!(", {mounted} left mounted as in {}", last.name));
        ready.push(CandidateInformation { test: candidate, root });
    }
    let root = shared.root_of_test(&alone, r.as_ref(), Clone::clone);
    ready.insert(0, CandidateInformation { test: candidate.clone(), root });
    Ok(ready)
}
