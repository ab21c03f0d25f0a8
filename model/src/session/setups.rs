//! Set-ups shared by tests.

use super::{Prior, Test};
use crate::instrument::{InstrumentParameter, SharedBy, Station};

/// Warnings about a test that shares a mounted object with an earlier one and describes it differently.
pub(crate) fn differing(earlier: &[Test], test: &Test) -> Vec<String> {
    let unknowns = test.station.kind().unknowns();
    let mut warnings = Vec::new();
    for group in mounted_groups(unknowns) {
        let Some(first) = earlier.iter().find(|other| other.group(group) == test.group(group)) else {
            continue;
        };
        let own = |test: &Test| -> (Vec<Prior>, [f64; 3]) {
            let priors = unknowns.iter().zip(&test.priors);
            let priors = priors.filter(|(unknown, _)| unknown.shared_by == group);
            (priors.map(|(_, prior)| *prior).collect(), nominal(&test.station, group))
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
fn mounted_groups(unknowns: &[InstrumentParameter]) -> Vec<SharedBy> {
    [SharedBy::Setup, SharedBy::SpindleSetup, SharedBy::BarSetup]
        .into_iter()
        .filter(|group| unknowns.iter().any(|unknown| unknown.shared_by == *group))
        .collect()
}

/// Nominal position of the object that a group shares.
fn nominal(station: &Station<f64>, group: SharedBy) -> [f64; 3] {
    match (station, group) {
        (Station::BallBar(bar), SharedBy::Setup) => bar.workpiece_ball,
        (Station::BallBar(bar), SharedBy::BarSetup) => [bar.bar, 0.0, 0.0],
        (Station::Tracker(_), SharedBy::Setup) => [0.0; 3],
        (Station::Probe(probe), SharedBy::Setup) => probe.artefact,
        (Station::RTest(rtest), SharedBy::Setup) => rtest.workpiece_ball,
        (station, _) => station.tool_point_mm(),
    }
}
