//! Two undeclared effects, each at 5 times the smallest amplitude that is significant for the oracle.

use super::judging::{found, summary};
use super::rates::Rate;
use super::sessions::{TracedSession, at_multiple, case, oracle, random, run, sessions, skipped, verbose};
use crate::plant::{Injected, Kind, Noise};

/// Kind, noise and both effects of a session.
pub fn pair(number: usize) -> (Kind, Noise, Vec<Injected>) {
    let (kind, noise) = case(number);
    let oracle = oracle(kind, noise);
    let pair = oracle.random_pair(1.0, &mut random(11, number));
    let pair = pair.map(|effect| at_multiple(&oracle, &effect, 5.0));
    (kind, noise, pair.to_vec())
}

fn hits(outcome: &TracedSession) -> usize {
    let truths = &outcome.draw.truth.effects;
    truths.iter().filter(|truth| found(outcome, truth).is_some()).count()
}

#[test]
fn both_of_a_pair_are_found() {
    if skipped("both_of_a_pair_are_found") {
        return;
    }
    let outcomes = run(0..sessions(), pair);
    let (mut both, mut one, mut more) = (Rate::default(), Rate::default(), Rate::default());
    for outcome in &outcomes {
        let hits = hits(outcome);
        both.count(hits == 2);
        one.count(hits >= 1);
        more.count(outcome.result.effects.len() > 2);
        if verbose() {
            println!("{}", summary(outcome, ["NONE", "ONE", "ok"][hits]));
        }
    }
    println!(
        "| pairs at 5 times | |\n|---|---|\n| both found | {both} |\n| at least one | {one} |\n| more than two claimed | {more} |"
    );
    assert!(both.is_consistent_with_at_least(0.90), "{both}");
}

/// Two compliances that partly cancel each other have little gain individually (session 43). A drifting ball leaves a
/// different cycle in every run, which is structure and no autocorrelation of the noise (session 60).
#[test]
fn pairs_that_partly_cancel_or_resemble_autocorrelation_are_found() {
    for number in [43, 60] {
        for outcome in &run(number..number + 1, pair) {
            assert_eq!(hits(outcome), 2, "{}", summary(outcome, "HIDDEN"));
        }
    }
}
