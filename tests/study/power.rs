//! The power of the trace as a share of that of detectors that know more, on the same readings at the same rate of false
//! claims; and p-values of selective inference beside those of the null draws.

use std::fmt::Write;

use rayon::prelude::*;

use super::judging::found;
use super::pairs::pair;
use super::rates::Rate;
use super::sessions::{TracedSession, case, oracle, random, run, sessions, skipped, verbose};
use super::single::at_multiple_of_smallest;
use crate::plant::{Detected, Driver, Injected, Scan, Shape};

/// What the detectors made of a session.
struct Compared {
    matched: bool,
    scan: Detected,
    library: Detected,
}

/// Prints the power of the trace and of the detectors, and returns their shares.
fn compare(title: &str, outcomes: &[TracedSession]) -> [f64; 4] {
    let detected = outcomes.par_iter().map(|outcome| {
        let oracle = oracle(outcome.kind, outcome.noise);
        let scan = Scan::of(&oracle, &outcome.draw, &outcome.draw.truth.effects);
        let seed = outcome.number as u64;
        let matched = scan.matches();
        Compared { matched, scan: scan.detect(seed), library: Scan::of_library(&oracle, &outcome.draw).detect(seed) }
    });
    let detected: Vec<Compared> = detected.collect();
    let by_trace = |outcome: &TracedSession| {
        let truths = &outcome.draw.truth.effects;
        truths.iter().all(|truth| found(outcome, truth).is_some())
    };
    let rates = |is_in: &dyn Fn(&[Injected]) -> bool| {
        let [mut own, mut matched, mut scanned, mut of_library] = [Rate::default(); 4];
        let of_class = outcomes.iter().zip(&detected).filter(|(outcome, _)| is_in(&outcome.draw.truth.effects));
        for (outcome, detected) in of_class {
            own.count(by_trace(outcome));
            matched.count(detected.matched);
            scanned.count(detected.scan.named);
            of_library.count(detected.library.named);
        }
        [own, matched, scanned, of_library]
    };
    let mut more = Rate::default();
    for (outcome, Compared { scan, library, .. }) in outcomes.iter().zip(&detected) {
        let truths = &outcome.draw.truth.effects;
        more.count(scan.claims > truths.len());
        if verbose() && by_trace(outcome) != library.named {
            let named = by_trace(outcome);
            println!("{} {:?}: trace {named}, {scan:?}, {library:?}, {truths:?}", outcome.number, outcome.noise);
        }
    }
    // A scan that knows the heights of steps adds what a search has to find step by step.
    let steps = |effects: &[Injected]| effects.iter().any(|effect| matches!(effect.shape, Shape::Steps { .. }));
    let slow =
        |effects: &[Injected]| effects.iter().any(|effect| matches!(effect.driver, Driver::Time | Driver::Temperature));
    let classes: [(&str, &dyn Fn(&[Injected]) -> bool); 3] = [
        ("with steps", &steps),
        ("of time or temperature", &|effects| slow(effects) && !steps(effects)),
        ("others", &|effects| !slow(effects) && !steps(effects)),
    ];
    let mut of_classes = String::new();
    for (class, is_in) in classes {
        let [own, _, scanned, of_library] = rates(is_in);
        let _ = writeln!(of_classes, "| {class}: trace; scan; scan of the library | {own}; {scanned}; {of_library} |");
    }
    let [own, matched, scanned, of_library] = rates(&|_| true);
    let shares = [own, matched, scanned, of_library].map(Rate::share);
    let over = |k: usize| shares[0] / shares[k];
    println!(
        "| {title} | |\n|---|---|\n| named by the trace | {own} |\n| significant for a detector that knows the effect | \
         {matched} |\n| named by a scan that knows noise and numbers | {scanned} |\n| named by a scan of the library that \
         knows the noise | {of_library} |\n| more than the true effects by the scan that knows numbers | {more} |\n\
         {of_classes}| trace over matched, over scan, over scan of the library | {:.3}, {:.3}, {:.3} |",
        over(1),
        over(2),
        over(3)
    );
    shares
}

#[test]
fn power_is_a_share_of_that_of_detectors_that_know_more() {
    if skipped("power_is_a_share_of_that_of_detectors_that_know_more") {
        return;
    }
    for (title, outcomes) in [
        ("one effect at twice", run(0..sessions(), |number| at_multiple_of_smallest(2.0, number))),
        ("one effect at five times", run(0..sessions(), |number| at_multiple_of_smallest(5.0, number))),
        ("two effects at five times", run(0..sessions(), pair)),
    ] {
        let [_, matched, scanned, _] = compare(title, &outcomes);
        // A detector that knows the effect misses at most what its level costs at 5.6 standard deviations.
        assert!(matched >= 0.97 && matched >= scanned - 0.01, "{title}: {matched}, {scanned}");
    }
}

/// Sessions without an effect, and with one at twice the smallest size.
fn without_and_at_twice() -> [(&'static str, Vec<TracedSession>); 2] {
    let null = run(0..sessions(), |number| {
        let (kind, noise) = case(number);
        (kind, noise, Vec::new())
    });
    let twice = run(0..sessions(), |number| at_multiple_of_smallest(2.0, number));
    [("no effect", null), ("one effect at twice", twice)]
}

/// The scan of a session; one without an effect is searched for the entries that belong to a random effect.
fn scan(outcome: &TracedSession) -> Scan {
    let oracle = oracle(outcome.kind, outcome.noise);
    let truths = &outcome.draw.truth.effects;
    let like = match truths.is_empty() {
        true => vec![oracle.random_detectable(1.0, &mut random(2, outcome.number))],
        false => truths.clone(),
    };
    Scan::of(&oracle, &outcome.draw, &like)
}

/// `fsInf` and `forwardStop` of R on the sessions of [`selective_inference_beside_null_draws`]: the p-value of their first
/// step against [`Scan::selective_p_value`], which integrates along the found direction, and their claims beside those of
/// the trace.
#[test]
fn selective_inference_of_r() {
    if skipped("selective_inference_of_r") {
        return;
    }
    // Debian does not package it.
    if test_needs::first(&["Rscript"], &["-e", "library(selectiveInference)"]).is_none() {
        test_needs::skip_in_ci_too("selective_inference_of_r", "no Rscript with the package selectiveInference");
        return;
    }
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/study/stepwise.R");
    let folder = tempfile::tempdir().unwrap();
    for (title, outcomes) in without_and_at_twice() {
        let judged: Vec<_> = outcomes
            .par_iter()
            .map(|outcome| {
                let scan = scan(outcome).of_columns();
                let file = folder.path().join(format!("{}.csv", outcome.number));
                std::fs::write(&file, scan.csv()).unwrap();
                let run = std::process::Command::new("Rscript").arg(script).arg(&file).output().unwrap();
                assert!(run.status.success(), "{}: {}", run.status, String::from_utf8_lossy(&run.stderr));
                std::fs::remove_file(file).unwrap();
                let text = String::from_utf8(run.stdout).unwrap();
                let numbers: Vec<f64> = text.split_whitespace().map(|word| word.parse().unwrap()).collect();
                (numbers[0], numbers[5] as usize, scan.selective_p_value().0)
            })
            .collect();
        let rate = |hit: &dyn Fn(usize) -> bool| {
            let mut rate = Rate::default();
            (0..outcomes.len()).for_each(|k| rate.count(hit(k)));
            rate
        };
        println!("| {title}, `fsInf` with the known noise | |\n|---|---|");
        for level in [0.01, 0.05, 0.1, 0.5] {
            println!("| first p-value at most {level} | {} |", rate(&|k| judged[k].0 <= level));
        }
        println!("| `forwardStop` at 0.01 claims a step | {} |", rate(&|k| judged[k].1 > 0));
        println!("| `forwardStop` at 0.01 claims several | {} |", rate(&|k| judged[k].1 > 1));
        println!("| claimed by the trace | {} |", rate(&|k| !outcomes[k].result.effects.is_empty()));
        let apart = judged.iter().map(|(r, _, own)| (r - own).abs()).fold(0.0, f64::max);
        println!("| largest difference of first p-values from ours | {apart:.1e} |");
        assert!(apart < 0.02, "{title}: {judged:?}");
        if title == "no effect" {
            assert!(rate(&|k| judged[k].0 <= 0.05).is_consistent_with_at_most(0.05), "{judged:?}");
        }
    }
}

/// Without an effect, and with one at twice the smallest size: claims at 1 % by the p-value of selective inference, by
/// the null distribution of the scan, and by the trace.
#[test]
fn selective_inference_beside_null_draws() {
    if skipped("selective_inference_beside_null_draws") {
        return;
    }
    for (title, outcomes) in without_and_at_twice() {
        let judged: Vec<_> = outcomes
            .par_iter()
            .map(|outcome| {
                let scan = scan(outcome);
                let (p_value, named) = scan.selective_p_value();
                (p_value, named, scan.detect(outcome.number as u64))
            })
            .collect();
        let rate = |hit: &dyn Fn(usize) -> bool| {
            let mut rate = Rate::default();
            (0..outcomes.len()).for_each(|k| rate.count(hit(k)));
            rate
        };
        let below = |level: f64| rate(&|k| judged[k].0 <= level);
        println!("| {title} | |\n|---|---|");
        for level in [0.01, 0.05, 0.1, 0.5] {
            println!("| selective p-value at most {level} | {} |", below(level));
        }
        println!("| the same at most 0.01, and the truth named | {} |", rate(&|k| judged[k].0 <= 0.01 && judged[k].1));
        println!("| claimed by the scan with null draws | {} |", rate(&|k| judged[k].2.claims > 0));
        println!("| claimed by the trace | {} |", rate(&|k| !outcomes[k].result.effects.is_empty()));
        if title == "no effect" {
            for level in [0.05, 0.5] {
                let (found, slack) = (below(level), 3.0 * (level * (1.0 - level) / outcomes.len() as f64).sqrt());
                assert!((found.share() - level).abs() <= slack + 0.5 / outcomes.len() as f64, "{level}: {found}");
            }
        }
    }
}
