//! Effects that no entry of the library is: no confident wrong name.

use super::judging::tell;
use super::rates::Rate;
use super::sessions::{Outcome, at_multiple, case, oracle, random, run, sessions, skipped, told};
use crate::plant::families::outside_library;
use crate::plant::{Injected, Kind, Noise};

fn strange(number: usize) -> (Kind, Noise, Vec<Injected>) {
    let (kind, noise) = case(number);
    let oracle = oracle(kind, noise);
    let effect = outside_library(kind, &mut random(12, number));
    (kind, noise, vec![at_multiple(&oracle, &effect, 10.0)])
}

/// Whether a result says that it has no name for what is there.
fn is_honest(outcome: &Outcome) -> bool {
    let result = &outcome.result;
    let curve = result.effects.iter().any(|effect| effect.name.shape == "curve");
    curve || result.verdict == "unexplained"
}

#[test]
fn what_the_library_lacks_gets_no_confident_name() {
    if skipped("what_the_library_lacks_gets_no_confident_name") {
        return;
    }
    let outcomes = run(0..sessions(), strange);
    let mut honest = Rate::default();
    for outcome in &outcomes {
        let is_honest = is_honest(outcome);
        honest.count(is_honest);
        if told() {
            println!("{}", tell(outcome, if is_honest { "ok" } else { "WRONG" }));
        }
    }
    println!("| outside the library at 10 times | |\n|---|---|\n| unexplained, or a curve | {honest} |");
    assert!(honest.is_consistent_with_at_least(0.90), "{honest}");
}

/// A wave whose size swells and fades is a hump in the spectrum of what repeats differ by, not noise with a memory (session 41: sixth order under white noise with
/// outliers).
#[test]
fn a_wave_that_swells_and_fades_is_not_taken_for_noise() {
    for outcome in &run(41..42, strange) {
        assert!(is_honest(outcome), "{}", tell(outcome, "WRONG"));
        // 0.3 µm were put in.
        assert!(outcome.result.noise_um < 0.35, "{}", tell(outcome, "NOISE"));
    }
}
