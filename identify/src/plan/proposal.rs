//! Proposed tests as blocks of a session file.

use abbe_model::document::{of_domain, print};
use abbe_model::instrument::Station;
use abbe_model::instrument::ballbar::BAR;
use abbe_model::session::motion::Motion;
use abbe_model::session::{Session, Test};

use super::test_variations::TestVariations;

/// A proposed test with the name and the text under which a session can contain it.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// A name that no test of the session and no proposal before it has: `C150`, `C150-2`.
    pub name: String,
    /// The `[[test]]` block, with the description of the test as a comment.
    pub block: String,
}

/// The proposal of a candidate test. `taken` are the names of earlier proposals; the new name is added to them.
pub fn proposal(
    session: &Session,
    candidate: &Test,
    description: &str,
    variations: &TestVariations,
    taken: &mut Vec<String>,
) -> Option<Proposal> {
    let Station::BallBar(bar) = &candidate.station else {
        return None;
    };
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
    let block = print::block_of("test", &of_domain::test(&test, &session.machine)?, description).ok()?;
    taken.push(name.clone());
    Some(Proposal { name, block })
}
