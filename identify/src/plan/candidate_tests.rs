//! The menu of ball-bar tests from which a next one is proposed: what may be varied, and which of it the machine can do.
//!
//! An entry sweeps one rotary axis while the other ball stands on that axis (at the foot of the circle or beside it, as the bar's length
//! demands), or lets the linear axes keep the bar radial, tangential or axial. A part of the range, or one direction, never sees more than
//! the whole: they are tried where gain is judged by the minute. What an axis' travel forbids, or a bar cannot reach, is not among the candidate tests.

use abbe_model::axis::AxisKind;
use abbe_model::effect::{Component, Driver, Effect, Shape};
use abbe_model::instrument::Station;
use abbe_model::session::{Session, Test};
use rayon::prelude::*;

use super::candidate_layout::{Draft, drafts};
use super::states;
use crate::error::IdentifyError;
use crate::parameters::Role;
use crate::problem::Problem;

/// What may be varied. Lengths in mm, times in min.
#[derive(Clone, Debug)]
pub struct CandidateTests {
    /// Bars of the kit, nominal lengths.
    pub bars_mm: Vec<f64>,
    /// Distances of the ball from the axis that it is mounted about.
    pub radii_mm: Vec<f64>,
    /// Heights of the ball along that axis, both ways except below the table.
    pub heights_mm: Vec<f64>,
    /// Where the other rotary axis stands.
    pub standing_deg: Vec<f64>,
    /// Feeds, as multiples of that of the session's tests; more than one where something depends on it (see [`CandidateTests::for_effects`]).
    pub feeds: Vec<f64>,
    /// Shares of the swept range, about its middle.
    pub ranges: Vec<f64>,
    /// Whether each run comes back: `true` both ways, `false` one way.
    pub both_directions: Vec<bool>,
    /// Whether linear axes may follow.
    pub follow: bool,
    /// Whether a test may leave the spindle ball mounted from the last test before it.
    pub keep_spindle_ball: bool,
    /// Travel of a bar's sensor either way.
    pub reach_mm: f64,
    /// Mounting a ball anew.
    pub setup_min: f64,
    /// Preparing a test: bar, position, feed-in.
    pub test_min: f64,
    /// Evaluate every n-th position only, its information counted n times.
    pub thin: usize,
}

impl Default for CandidateTests {
    /// A kit of 50, 100, 150 and 300 mm; a set-up takes five minutes, preparing a test one.
    fn default() -> Self {
        CandidateTests {
            bars_mm: vec![50.0, 100.0, 150.0, 300.0],
            radii_mm: vec![50.0, 75.0, 100.0, 150.0],
            heights_mm: vec![0.0, 50.0, 100.0, 200.0],
            standing_deg: vec![0.0, 90.0, -90.0, 180.0],
            feeds: vec![1.0],
            ranges: vec![1.0],
            both_directions: vec![true],
            follow: true,
            keep_spindle_ball: true,
            reach_mm: super::BAR_TRAVEL_MM,
            setup_min: 5.0,
            test_min: 1.0,
            thin: 1,
        }
    }
}

impl CandidateTests {
    /// The same menu with a second feed, if one of the effects depends on speed or time.
    pub fn for_effects<'e>(mut self, effects: impl IntoIterator<Item = &'e Effect>) -> CandidateTests {
        let depends = |effect: &Effect| {
            effect.shape == Shape::Lag
                || effect.driver == Driver::Time
                || effect.component == Component::TriggerDelay
        };
        if self.feeds.len() == 1 && effects.into_iter().any(depends) {
            self.feeds.push(SECOND_FEED);
        }
        self
    }

    /// A short menu, every fourth position: to name a test beside a result, not to choose the last per cent.
    pub fn short() -> CandidateTests {
        CandidateTests {
            radii_mm: vec![50.0, 100.0, 150.0],
            heights_mm: vec![0.0, 100.0],
            standing_deg: vec![0.0],
            keep_spindle_ball: false,
            thin: 4,
            ..CandidateTests::default()
        }
    }
}

/// The second feed, as a multiple of the first.
const SECOND_FEED: f64 = 3.0;

/// A test that can be made.
#[derive(Clone, Debug)]
pub struct Entry {
    /// In words: `C150 with the workpiece ball at radius 50 mm`.
    pub name: String,
    /// The test with its planned states.
    pub test: Test,
    /// Whether a ball has to be mounted anew.
    pub new_setup: bool,
    /// What it takes, min.
    pub minutes: f64,
}

/// Whether tests can be proposed for a problem: it has errors to identify, the instrument is a ball bar, and a rotary axis can be swept.
pub fn has_candidates(problem: &Problem<'_>) -> bool {
    let session = problem.session;
    let has_errors = problem
        .parameters
        .list
        .iter()
        .any(|parameter| parameter.role == Role::Error);
    let last = session.tests.last().map(|test| &test.station);
    has_errors
        && matches!(last, Some(Station::BallBar(_)))
        && session
            .machine
            .axes
            .iter()
            .any(|axis| axis.kind == AxisKind::Rotary)
}

/// The entries that a session's machine can do. The session is complete (see [`states::complete`]).
///
/// # Errors
/// If the instrument is no ball bar, or no rotary axis can be swept.
pub fn entries(session: &Session, menu: &CandidateTests) -> Result<Vec<Entry>, IdentifyError> {
    let Some(last) = session
        .tests
        .last()
        .filter(|test| matches!(test.station, Station::BallBar(_)))
    else {
        return Err(IdentifyError::Request(
            "a next test can be proposed for ball bars only; this session has another instrument".to_string(),
        ));
    };
    let drafts = drafts(session, menu, last);
    let entries: Vec<Entry> = drafts
        .into_par_iter()
        .filter_map(|draft| finished(session, menu, draft))
        .collect();
    if entries.is_empty() {
        return Err(IdentifyError::Request(
            "no candidate test can be made on this machine: no bar reaches, or the travel is too short"
                .to_string(),
        ));
    }
    Ok(entries)
}

/// Plans an entry's states; `None` where the travel forbids them or the bar does not reach.
fn finished(session: &Session, menu: &CandidateTests, draft: Draft) -> Option<Entry> {
    let Draft {
        mut test,
        name,
        new_setup,
    } = draft;
    let Station::BallBar(bar) = &test.station else {
        return None;
    };
    let length = bar.bar;
    let mut readings = states::planned(session, &test).ok()?;
    if readings
        .observed
        .iter()
        .any(|reading| (reading - length).abs() > menu.reach_mm)
    {
        return None;
    }
    let start = session
        .tests
        .iter()
        .filter_map(|test| test.readings.as_ref()?.time_s.last().copied());
    let start = start.fold(0.0, f64::max);
    let moving_s = readings.time_s.last().copied().unwrap_or(0.0);
    readings
        .time_s
        .iter_mut()
        .for_each(|time| *time += start + menu.test_min * 60.0);
    if session.tests.iter().any(|test| {
        test.readings
            .as_ref()
            .is_some_and(|r| !r.temperature_c.is_empty())
    }) {
        let mean = crate::drivers::Origin::of(session).temperature_c;
        readings.temperature_c = vec![mean; readings.rows()];
    }
    test.readings = Some(readings);
    let minutes = menu.test_min + moving_s / 60.0 + if new_setup { menu.setup_min } else { 0.0 };
    Some(Entry {
        name,
        test,
        new_setup,
        minutes,
    })
}
