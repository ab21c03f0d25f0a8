//! The candidate tests for the next measurement: the permitted variations, and those that the machine can perform.
//!
//! Those of an instrument without a bar are motions of the axes that it reads (`candidate_motions`). A candidate test of a
//! ball bar sweeps one rotary axis. The other ball is on that axis, in the plane of the circle or beside it, as
//! the bar length requires. Alternatively the linear axes keep the bar radial, tangential or axial. A part of the
//! range, or one direction, never gives more information than the whole. Such tests are candidates only if the gain per
//! minute decides. Tests beyond the travel of an axis or the reach of the bar are not candidates.

use std::sync::Arc;

use abbe_model::Diagnostic;
use abbe_model::instrument::InstrumentKind;
use abbe_model::session::{Session, Test, planned};
use abbe_model::words::number;

use super::candidate_layout::{Draft, MAX_DRAFTS, draft_count, drafts, too_many};
use super::candidate_motions;
use super::collision::{Bodies, Parts};
use super::states;
use super::variations::TestVariations;
use crate::error::NO_CANDIDATE_TEST;
use abbe_identify::numerics::parallel;

/// A candidate test.
#[derive(Clone, Debug)]
pub struct CandidateTest {
    /// Description, for example `C150 with the workpiece ball at radius 50 mm`.
    pub name: String,
    /// The test with its planned states.
    pub test: Test,
    /// Whether a ball has to be mounted for it.
    pub new_setup: bool,
    /// Duration, min.
    pub minutes: f64,
}

/// The candidate tests that a session's machine can perform. The session is complete (see [`states::complete`]).
///
/// # Errors
/// If there are too many, or none that the machine can perform.
pub fn candidate_tests(session: &Session, variations: &TestVariations) -> Result<Vec<CandidateTest>, Diagnostic> {
    let mut kinds: Vec<InstrumentKind> = session.tests.iter().map(|test| test.station.kind()).collect();
    kinds.sort_by_key(|kind| kind.word());
    kinds.dedup();
    let mut drafts = Vec::new();
    for kind in kinds {
        let last = session.tests.iter().rev().find(|test| test.station.kind() == kind);
        match last.filter(|last| last.station.bar().is_some()) {
            Some(last) => drafts.extend(with_bar(session, variations, last)?),
            None => drafts.extend(candidate_motions::drafts(session, variations, kind)?),
        }
    }
    let bodies = Bodies::of(&session.machine);
    let finished = parallel::map(drafts.len(), &|k| finished(session, &bodies, variations, drafts[k].clone()));
    let tests: Vec<CandidateTest> = finished.into_iter().flatten().collect();
    if tests.is_empty() {
        let found = "no candidate test is feasible on this machine: the instrument reads no motion of its axes, no bar \
                     reaches, the travel is too short, or no test clears the bodies of the machine";
        return Err(Diagnostic::coded(NO_CANDIDATE_TEST, found));
    }
    Ok(tests)
}

/// The candidates of a ball bar.
fn with_bar(session: &Session, variations: &TestVariations, last: &Test) -> Result<Vec<Draft>, Diagnostic> {
    let count = draft_count(session, variations);
    if count > MAX_DRAFTS as f64 {
        return Err(too_many(format!("up to {} candidate tests", number(count)), variations, true));
    }
    Ok(drafts(session, variations, last))
}

/// Plans the states of a candidate test. `None` if the travel forbids them or the bar does not reach.
fn finished(session: &Session, bodies: &Bodies, variations: &TestVariations, draft: Draft) -> Option<CandidateTest> {
    let Draft { mut test, name, new_setup } = draft;
    if test.station.bar().is_none() {
        planned::feasible(&session.machine, &test)?;
    }
    let mut readings = states::planned(session, &test, &test.station).ok()?;
    let beyond = |length: f64| readings.observed.iter().any(|reading| (reading - length).abs() > variations.reach_mm);
    if test.station.bar().is_some_and(|bar| beyond(bar.bar)) {
        return None;
    }
    // Only tests that clear are proposed.
    if Parts::of(session, bodies, &test).is_some_and(|parts| !parts.clears_all(&readings)) {
        return None;
    }
    let start = session.tests.iter().filter_map(|test| test.readings.as_ref()?.time_s.last().copied());
    let start = start.fold(0.0, f64::max);
    let moving_s = readings.time_s.last().copied().unwrap_or(0.0);
    readings.time_s.iter_mut().for_each(|time| *time += start + variations.test_min * 60.0);
    let rows = readings.rows();
    let means = session.reference().means.into_iter();
    readings.drivers = means.map(|(name, mean)| (name, vec![mean; rows])).collect();
    test.readings = Some(Arc::new(readings));
    let minutes = variations.test_min + moving_s / 60.0 + if new_setup { variations.setup_min } else { 0.0 };
    Some(CandidateTest { name, test, new_setup, minutes })
}
