//! Measures the duration of a trace of the tests of chapter 5.
//!
//! `cargo bench -p abbe-trace --bench trace`
#![allow(missing_docs)]

use std::hint::black_box;
use std::time::Duration;

use abbe_trace::{TraceOptions, trace};
use criterion::{Criterion, criterion_group, criterion_main};

#[path = "../../identify/benches/sessions/mod.rs"]
#[allow(dead_code, reason = "other benchmarks use the rest")]
mod sessions;

fn traces(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("trace");
    group.sample_size(10).measurement_time(Duration::from_secs(20));
    let session = sessions::chapter_5();
    group.bench_function("chapter 5, nothing to find", |bencher| {
        bencher.iter(|| black_box(trace(black_box(&session), &TraceOptions::default(), &|_| true).expect("a trace")));
    });
    group.finish();
}

criterion_group!(benches, traces);
criterion_main!(benches);
