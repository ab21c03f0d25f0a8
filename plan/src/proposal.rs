//! Proposed tests as documents of a session.

use abbe_model::document::measurement::Test as Document;
use abbe_model::document::of_domain;
use abbe_model::document::print::Block;
use abbe_model::instrument::SharedBy;
use abbe_model::session::{Session, Test};

use super::variations::TestVariations;

/// No proposal.
pub fn none() -> Block<Document> {
    Block { list: "test", entry: None }
}

/// The name of a proposed test; empty without one.
pub fn name(proposal: &Block<Document>) -> String {
    proposal.entry.as_ref().map_or(String::new(), |(test, _)| test.name.clone())
}

/// The proposal of a candidate test, with its description as a remark, under a name that no test of the session and no
/// proposal before it has: `C150`, `C150-2`, `X` of an instrument without a bar. `taken` are the names of earlier proposals; the new name is added to them.
pub fn proposal(
    session: &Session,
    candidate: &Test,
    description: &str,
    variations: &TestVariations,
    taken: &mut Vec<String>,
) -> Option<Block<Document>> {
    let mut test = Test { readings: None, ..candidate.clone() };
    // Candidate tests may be evaluated at every n-th position.
    let thin = variations.thin.max(1) as f64;
    let motion = test.motion.as_mut()?;
    motion.course.step /= thin;
    let moved: String = motion.axes().iter().map(|axis| session.machine.axes[*axis].name.as_str()).collect();
    let stem = match candidate.station.bar() {
        Some(bar) => format!("{moved}{:.0}", bar.bar),
        None => moved,
    };
    // A set-up of the same name would be shared with the test that has it.
    let names = |test: &Test| [&test.name, &test.setup, &test.spindle_setup, &test.bar_setup].map(String::clone);
    let is_taken = |name: &String| taken.contains(name) || session.tests.iter().any(|test| names(test).contains(name));
    let name = std::iter::once(stem.clone())
        .chain((2..).map(|number| format!("{stem}-{number}")))
        .find(|name| !is_taken(name))?;
    for setup in [&mut test.setup, &mut test.spindle_setup, &mut test.bar_setup] {
        if *setup == candidate.name {
            setup.clone_from(&name);
        }
    }
    // What is mounted already has the priors of its mount.
    let unknowns = test.station.kind().unknowns();
    for (place, unknown) in unknowns.iter().enumerate() {
        let is_of_mount = matches!(unknown.shared_by, SharedBy::Setup | SharedBy::SpindleSetup | SharedBy::BarSetup);
        let same = |other: &&Test| {
            other.station.kind() == test.station.kind()
                && other.group(unknown.shared_by) == test.group(unknown.shared_by)
        };
        let mounted = session.tests.iter().filter(|_| is_of_mount).find(same);
        if let Some(prior) = mounted.and_then(|other| other.priors.get(place)) {
            test.priors[place] = *prior;
        }
    }
    test.name.clone_from(&name);
    let document = of_domain::test(&test, &session.machine, session.instrument)?;
    taken.push(name);
    Some(Block { list: "test", entry: Some((document, description.to_string())) })
}
