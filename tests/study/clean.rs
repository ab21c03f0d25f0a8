//! Sessions without an effect: the rate of false claims.

use super::judging::summary;
use super::rates::Rate;
use super::sessions::{NOISES, run, sessions, skipped, verbose};
use crate::plant::Kind;

#[test]
fn nothing_is_claimed_without_an_effect() {
    if skipped("nothing_is_claimed_without_an_effect") {
        return;
    }
    let count = sessions();
    println!("| noise | an effect claimed | verdict not clean | a candidate rejected |\n|---|---|---|---|");
    for (k, noise) in NOISES.into_iter().enumerate() {
        let outcomes =
            run(k * count..(k + 1) * count, |number| (Kind::ALL[number % Kind::ALL.len()], noise, Vec::new()));
        let (mut claimed, mut not_clean, mut rejected) = (Rate::default(), Rate::default(), Rate::default());
        for outcome in &outcomes {
            claimed.count(!outcome.result.effects.is_empty());
            not_clean.count(outcome.result.verdict != "clean");
            rejected.count(!outcome.result.rejected_candidates.is_empty());
            if verbose() {
                println!("{}", summary(outcome, if outcome.result.verdict == "clean" { "ok" } else { "CLAIM" }));
            }
        }
        println!("| {noise:?} | {claimed} | {not_clean} | {rejected} |");
        assert!(claimed.is_consistent_with_at_most(0.01), "{noise:?}: {claimed}");
    }
}
