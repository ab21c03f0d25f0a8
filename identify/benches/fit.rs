//! Measures the duration of a fit with a thousand to a million readings: four ball-bar tests, eight errors and 28
//! set-up parameters with priors. Measures a thousand Monte Carlo draws of the fit of the tests of chapter 5.
//!
//! `cargo bench -p abbe-identify --bench fit`. `identify/benches/peers.py` measures the same with other tools.
#![allow(missing_docs)]

use std::hint::black_box;
use std::time::Duration;

use abbe_identify::fit::{fit, prepare, report};
use abbe_identify::monte_carlo::MonteCarlo;
use abbe_identify::propagation::add_monte_carlo;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

mod sessions;

fn fits(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("fit");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    for readings in [1_000, 10_000, 100_000, 1_000_000] {
        let session = sessions::ball_bar(4, readings);
        let (problem, fit) = prepare(&session, 1).expect("a fit");
        assert_eq!(problem.parameters.list.len(), 36);
        assert!((problem.readings() as f64 / readings as f64 - 1.0).abs() < 0.05);
        assert!((fit.birge_ratio - 1.0).abs() < 0.1);
        drop(problem);
        group.throughput(Throughput::Elements(readings as u64));
        group.bench_function(BenchmarkId::from_parameter(readings), |bencher| {
            bencher.iter(|| black_box(prepare(black_box(&session), 1).expect("a fit")));
        });
    }
    group.finish();
}

fn monte_carlo(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("Monte Carlo");
    group.sample_size(10).measurement_time(Duration::from_secs(10));
    let session = sessions::chapter_5();
    let (problem, found) = prepare(&session, 1).expect("a fit");
    let draws = MonteCarlo { runs: 1_000, seed: 1, coverage: 0.95 };
    group.bench_function("a thousand draws of the fit of chapter 5", |bencher| {
        bencher.iter(|| {
            let mut result = report(&problem, &found).unwrap();
            add_monte_carlo(&problem, &found, black_box(&draws), &mut result).expect("draws");
            black_box(result)
        });
    });
    // For comparison: one fit, started at the result.
    group.bench_function("one fit of chapter 5", |bencher| {
        bencher.iter(|| black_box(fit(&problem, Some(black_box(&found.beta))).expect("a fit")));
    });
    group.finish();
}

criterion_group!(benches, fits, monte_carlo);
criterion_main!(benches);
