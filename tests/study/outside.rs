//! Effects outside the library: trace must not claim a wrong name.

use super::judging::summary;
use super::rates::Rate;
use super::sessions::{TracedSession, at_multiple, case, oracle, random, run, sessions, skipped, verbose};
use crate::plant::families::outside_library;
use crate::plant::{Injected, Kind, Noise};
use abbe::identify::results::TraceVerdict;

fn outside_case(number: usize) -> (Kind, Noise, Vec<Injected>) {
    let (kind, noise) = case(number);
    let oracle = oracle(kind, noise);
    let effect = outside_library(kind, &mut random(12, number));
    (kind, noise, vec![at_multiple(&oracle, &effect, 10.0)])
}

/// Whether a result states that the library does not explain the structure.
fn is_honest(outcome: &TracedSession) -> bool {
    let result = &outcome.result;
    let curve = result.effects.iter().any(|effect| effect.name.shape == "curve");
    curve || result.verdict == TraceVerdict::Unexplained
}

#[test]
fn an_effect_that_the_library_lacks_gets_no_wrong_name() {
    if skipped("an_effect_that_the_library_lacks_gets_no_wrong_name") {
        return;
    }
    let outcomes = run(0..sessions(), outside_case);
    let mut honest = Rate::default();
    for outcome in &outcomes {
        let is_honest = is_honest(outcome);
        honest.count(is_honest);
        if verbose() {
            println!("{}", summary(outcome, if is_honest { "ok" } else { "WRONG" }));
        }
    }
    println!("| outside the library at 10 times | |\n|---|---|\n| unexplained, or a curve | {honest} |");
    assert!(honest.is_consistent_with_at_least(0.90), "{honest}");
}

/// A harmonic whose amplitude varies with time gives a peak in the spectrum of the differences of repeats. It is no
/// autocorrelation of the noise (session 41: sixth order, white noise with outliers).
#[test]
fn a_harmonic_of_varying_amplitude_is_not_attributed_to_noise() {
    for outcome in &run(41..42, outside_case) {
        assert!(is_honest(outcome), "{}", summary(outcome, "WRONG"));
        // The simulated noise is 0.3 µm.
        assert!(outcome.result.after.noise.value < 0.35, "{}", summary(outcome, "NOISE"));
    }
}
