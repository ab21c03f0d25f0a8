//! Proposed tests as documents of a session.

use abbe_model::document::of_domain;
use abbe_model::document::print::Block;
use abbe_model::document::test::Test as Document;
use abbe_model::instrument::ballbar::BAR;
use abbe_model::session::motion::Motion;
use abbe_model::session::{Session, Test};

use super::test_variations::TestVariations;

/// No proposal.
pub fn none() -> Block<Document> {
    Block { list: "test", entry: None }
}

/// The name of a proposed test; empty without one.
pub fn name(proposal: &Block<Document>) -> String {
    proposal.entry.as_ref().map_or(String::new(), |(test, _)| test.name.clone())
}

/// The proposal of a candidate test, with its description as a remark, under a name that no test of the session and no
/// proposal before it has: `C150`, `C150-2`. `taken` are the names of earlier proposals; the new name is added to them.
pub fn proposal(
    session: &Session,
    candidate: &Test,
    description: &str,
    variations: &TestVariations,
    taken: &mut Vec<String>,
) -> Option<Block<Document>> {
    let bar = candidate.station.bar()?;
    let mut test = Test { readings: None, ..candidate.clone() };
    let axis = match test.motion.as_mut()? {
        Motion::Sweep { axis, step, .. } | Motion::Follow { axis, step, .. } => {
            // Candidate tests may be evaluated at every n-th position.
            *step /= variations.thin.max(1) as f64;
            *axis
        }
        Motion::Circle { .. } | Motion::List => return None,
    };
    let stem = format!("{}{:.0}", session.machine.axes[axis].name, bar.bar);
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
    // A ball that is mounted already has the priors of its mount.
    let mounted = |of: fn(&Test) -> &str, own: &str| session.tests.iter().find(|test| of(test) == own);
    let shared = [
        (mounted(|test| &test.setup, &test.setup), 0..3),
        (mounted(|test| &test.spindle_setup, &test.spindle_setup), 3..6),
        (mounted(|test| &test.bar_setup, &test.bar_setup), BAR..BAR + 1),
    ];
    for (other, range) in shared {
        if let Some(priors) = other.and_then(|other| other.priors.get(range.clone()))
            && let Some(own) = test.priors.get_mut(range)
        {
            own.copy_from_slice(priors);
        }
    }
    test.name.clone_from(&name);
    let document = of_domain::test(&test, &session.machine)?;
    taken.push(name);
    Some(Block { list: "test", entry: Some((document, description.to_string())) })
}
