//! Effects that no entry of the library is: no confident wrong name.

use super::judging::tell;
use super::rates::Rate;
use super::sessions::{at_multiple, case, oracle, random, run, sessions, skipped, told};
use crate::plant::families::outside_library;

#[test]
fn what_the_library_lacks_gets_no_confident_name() {
    if skipped("what_the_library_lacks_gets_no_confident_name") {
        return;
    }
    let outcomes = run(0..sessions(), |number| {
        let (kind, noise) = case(number);
        let oracle = oracle(kind, noise);
        let effect = outside_library(kind, &mut random(12, number));
        (kind, noise, vec![at_multiple(&oracle, &effect, 10.0)])
    });
    let mut honest = Rate::default();
    for outcome in &outcomes {
        let result = &outcome.result;
        let curve = result.effects.iter().any(|effect| effect.name.shape == "curve");
        let open = result.verdict == "unexplained";
        honest.count(open || curve);
        if told() {
            println!("{}", tell(outcome, if open || curve { "ok" } else { "WRONG" }));
        }
    }
    println!("| outside the library at 10 times | |\n|---|---|\n| unexplained, or a curve | {honest} |");
    assert!(honest.is_consistent_with_at_least(0.90), "{honest}");
}
