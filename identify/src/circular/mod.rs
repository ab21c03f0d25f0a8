//! Characteristics of ISO 230-4 and the diagnosis of circular ball-bar tests.
//!
//! A ball bar between spindle ball and workpiece ball measures the radius of the path, `L(θ) = R + δL(θ)`. The
//! characteristics describe the measured path. The diagnosis decomposes `δL` by least squares into the contributions of
//! the classical faults of two linear axes (module `diagnosis`). Both use the readings only: fitted errors are not
//! subtracted.

mod decomposition;
mod diagnosis;
mod faults;
mod figures;
mod names;
mod path;
mod polar;
mod results;
mod rows;
mod set_up;

pub use results::{CircularTest, Diagnosis, DirectionFigures};

use abbe_model::session::{Session, Test};

use crate::numerics::parallel;

/// The characteristics of every ball-bar test with a circular path, and of every one in which a rotary axis turns.
///
/// `noise_mm` is the standard deviation of a reading; `left_out[test][row]` marks outliers. The outliers of a circle of
/// linear axes come from its own diagnosis instead: what a fit without these faults rejects may be a reversal spike.
pub fn of_session(session: &Session, noise_mm: f64, left_out: &[Vec<bool>]) -> Vec<CircularTest> {
    let measured = session.tests.iter().filter(|test| test.readings.is_some());
    let measured: Vec<(&Test, &Vec<bool>)> = measured.zip(left_out).collect();
    let results = parallel::map(measured.len(), &|number| {
        let (test, left_out) = measured[number];
        let mut path = path::Path::of(&session.machine, test)?;
        path.left_out = diagnosis::reject_outliers(&session.machine, &path).unwrap_or_else(|| left_out.clone());
        let mut result = figures::figures(&session.machine, test, &path);
        diagnosis::add(&session.machine, &path, noise_mm, &mut result);
        Some(result)
    });
    let mut results: Vec<CircularTest> = results.into_iter().flatten().collect();
    compare_feeds(&mut results);
    results
}

/// Feeds within this factor count as equal.
const OTHER_FEED: f64 = 1.2;

/// Adds a limitation to every diagnosis: what tests at other feeds separate.
fn compare_feeds(results: &mut [CircularTest]) {
    let limitations: Vec<Option<String>> = results
        .iter()
        .map(|result| {
            if result.diagnosis.is_empty() {
                return None;
            }
            let differs = |other: &&CircularTest| match (result.feed_mm_min, other.feed_mm_min) {
                (Some(a), Some(b)) => other.axes == result.axes && a.max(b) > OTHER_FEED * a.min(b),
                _ => false,
            };
            let others: Vec<&str> = results.iter().filter(differs).map(|other| other.test.as_str()).collect();
            Some(if others.is_empty() {
                "one feed: backlash is confounded with the part of a lag that changes sign with the direction; a test at another feed \
                 separates them".into()
            } else {
                format!(
                    "backlash is confounded with lag in this test alone: compare with {} at another feed; backlash is independent of the feed, lag is \
                     proportional to it",
                    others.join(", ")
                )
            })
        })
        .collect();
    for (result, limitations) in results.iter_mut().zip(limitations) {
        result.not_identifiable.extend(limitations);
    }
}
