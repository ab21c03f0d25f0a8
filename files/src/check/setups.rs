//! Set-ups shared by tests.

use abbe_model::instrument::{InstrumentKind, SharedBy, Target};
use abbe_model::session::readings::Readings;
use abbe_model::session::{Prior, Test};

/// Warnings about a test that shares a mounted object with an earlier one and describes it differently.
pub(crate) fn differing(earlier: &[Test], test: &Test) -> Vec<String> {
    let unknowns = test.station.kind().unknowns();
    let mut warnings = Vec::new();
    for group in mounted_groups(test.station.kind()) {
        let Some(first) = earlier.iter().find(|other| other.group(group) == test.group(group)) else {
            continue;
        };
        let own = |test: &Test| -> (Vec<Prior>, Target<f64>) {
            let priors = unknowns.iter().zip(&test.priors);
            let priors = priors.filter(|(unknown, _)| unknown.shared_by == group);
            (priors.map(|(_, prior)| *prior).collect(), test.station.shared(group))
        };
        if own(first) != own(test) {
            warnings.push(format!(
                "tests \"{}\" and \"{}\" share the set-up \"{}\" and describe it differently; an object that is mounted \
                 once has one position",
                first.name,
                test.name,
                test.group(group)
            ));
        }
    }
    warnings
}

/// The groups of an instrument's parameters that belong to objects that a user mounts.
fn mounted_groups(kind: InstrumentKind) -> Vec<SharedBy> {
    let groups = [SharedBy::Setup, SharedBy::SpindleSetup, SharedBy::BarSetup];
    groups.into_iter().filter(|group| kind.shares(*group)).collect()
}

/// A warning for each test whose positions and readings a test has already: one file stands for two measurements.
pub(crate) fn repeated(tests: &[Test], test: &Test) -> Option<String> {
    let own = test.readings.as_deref()?;
    let is_same = |other: &&Test| {
        let same = |other: &Readings| other.positions == own.positions && other.observed == own.observed;
        other.readings.as_deref().is_some_and(same)
    };
    let other = tests.iter().find(is_same)?;
    Some(format!(
        "tests \"{}\" and \"{}\" have the same positions and readings: is one file named twice? Both count as measured",
        other.name, test.name
    ))
}
