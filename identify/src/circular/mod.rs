//! Ball-bar figures of ISO 230-4 and the classical diagnosis of a circle.
//!
//! A bar between spindle and workpiece ball reads the radius of the path, `L(θ) = R + δL(θ)`. Figures are taken of the path as it is;
//! the diagnosis takes `δL` apart, by least squares, into what each classical fault of two linear axes does to it (module `diagnosis`).
//! Both are of the readings alone: no error that the fit identifies is taken off first.

mod diagnosis;
mod fault;
mod figures;
mod path;
mod regression;
mod results;
mod search;
mod terms;

pub use results::{CircularTest, Diagnosis, DirectionFigures};

use abbe_model::session::Session;

/// The figures of every ball-bar test whose path is a circle, and of every one in which a rotary axis turns.
///
/// `noise_mm` is the standard deviation of a reading; `left_out[test][row]` names outliers. A circle of linear axes is judged by its own
/// diagnosis instead: what the fit of a machine without these faults calls wild may be a spike.
pub fn of_session(session: &Session, noise_mm: f64, left_out: &[Vec<bool>]) -> Vec<CircularTest> {
    let measured = session.tests.iter().filter(|test| test.readings.is_some());
    let mut results: Vec<CircularTest> = measured
        .zip(left_out)
        .filter_map(|(test, left_out)| {
            let mut path = path::Path::of(&session.machine, test)?;
            path.left_out =
                diagnosis::reject_outliers(&session.machine, &path).unwrap_or_else(|| left_out.clone());
            let mut result = figures::figures(&session.machine, test, &path);
            diagnosis::add(&session.machine, &path, noise_mm, &mut result);
            Some(result)
        })
        .collect();
    compare_feeds(&mut results);
    results
}

/// Feeds that differ by less than this factor tell nothing apart.
const OTHER_FEED: f64 = 1.2;

/// Says of every diagnosis what another feed tells or would tell.
fn compare_feeds(results: &mut [CircularTest]) {
    let told: Vec<Option<String>> = results
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
                "one feed: what of a lag changes sign with the direction is in the backlash; a test at another feed tells them apart".into()
            } else {
                format!(
                    "backlash from lag in this test alone: what stays the same at the feed of {} is backlash, what grows with it lag",
                    others.join(", ")
                )
            })
        })
        .collect();
    for (result, told) in results.iter_mut().zip(told) {
        result.not_identifiable.extend(told);
    }
}
