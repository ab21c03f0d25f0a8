//! Benchmark of printed Rust code against a kernel written by hand. The function is the chapter 5 test: value and eight
//! derivatives, one reading at a time and in columns of 1,000, which fit in the cache. A second benchmark measures the
//! time to derive and print an equation. `emitted.rs` is the printer's output; a test compares the two.
#![allow(missing_docs)]

use std::hint::black_box;
use std::path::Path;

use abbe_codegen::print::{Layout, Style};
use abbe_codegen::{Equation, Options, ToolPoint, check, language};
use abbe_files::machine;
use abbe_model::component::ErrorName;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

#[allow(clippy::all, dead_code)]
#[rustfmt::skip]
mod emitted;
mod hand;

const N: usize = 1_000;
const LENGTHS: [f64; 4] = [111.803, 100.0, 75.0, 60.0];
const ERRORS: [f64; 8] = [0.01, -0.02, 1e-4, 2e-4, 0.015, -0.01, -1e-4, 3e-4];

/// Sines and cosines of C and A.
fn axes() -> [Vec<f64>; 4] {
    let angle = |i: usize, speed: f64| i as f64 * speed;
    let column = |f: &dyn Fn(usize) -> f64| (0..N).map(f).collect::<Vec<f64>>();
    [
        column(&|i| angle(i, 0.006).sin()),
        column(&|i| angle(i, 0.006).cos()),
        column(&|i| angle(i, 0.0015).sin()),
        column(&|i| angle(i, 0.0015).cos()),
    ]
}

fn kernels(criterion: &mut Criterion) {
    let axes = axes();
    let rows: Vec<[f64; 4]> = (0..N).map(|i| [axes[0][i], axes[1][i], axes[2][i], axes[3][i]]).collect();
    let mut group = criterion.benchmark_group("value and eight derivatives");
    group.throughput(Throughput::Elements(N as u64));
    group.bench_function("by hand, one at a time", |bencher| {
        bencher.iter(|| {
            for row in &rows {
                black_box(hand::reading(black_box(&LENGTHS), black_box(row), black_box(&ERRORS)));
            }
        });
    });
    group.bench_function("printed, one at a time", |bencher| {
        bencher.iter(|| {
            for row in &rows {
                black_box(emitted::bar_length_gradient(black_box(&LENGTHS), black_box(row), black_box(&ERRORS)));
            }
        });
    });
    let columns = [&axes[0][..], &axes[1], &axes[2], &axes[3]];
    group.bench_function("by hand, columns", |bencher| {
        let mut value = vec![0.0; N];
        let mut gradient: [Vec<f64>; 8] = std::array::from_fn(|_| vec![0.0; N]);
        bencher.iter(|| {
            let slopes = gradient.each_mut().map(Vec::as_mut_slice);
            hand::columns(black_box(&LENGTHS), black_box(columns), black_box(&ERRORS), &mut value, slopes);
            black_box(&mut value);
            black_box(&mut gradient);
        });
    });
    group.bench_function("printed, columns", |bencher| {
        let mut value = vec![0.0; N];
        let mut gradient: [Vec<f64>; 8] = std::array::from_fn(|_| vec![0.0; N]);
        bencher.iter(|| {
            let mut slopes = gradient.each_mut().map(Vec::as_mut_slice);
            emitted::bar_length_gradient_columns(
                black_box(&LENGTHS),
                black_box(&columns),
                black_box(&ERRORS),
                &mut [&mut value],
                &mut slopes,
            );
            black_box(&mut value);
            black_box(&mut gradient);
        });
    });
    group.finish();
}

/// Derives the error vector of a five-axis machine with eight location errors, with derivatives, and prints it as C.
fn equations(criterion: &mut Criterion) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u/machine.toml");
    let machine = machine(&file).expect("the ready machine");
    let errors: Vec<ErrorName> = ["EY0A", "EZ0A", "EB0A", "EC0A", "EX0C", "EY0C", "EA0C", "EB0C"]
        .iter()
        .map(|name| ErrorName::parse(name).expect("an error"))
        .collect();
    let options = Options { gradient: true, ..Options::default() };
    let flat = Style { layout: Layout::Flat, ..Style::default() };
    let mut group = criterion.benchmark_group("equation");
    group.sample_size(10);
    group.bench_function("error vector with eight derivatives, as C", |bencher| {
        bencher.iter(|| {
            let equation = Equation::volumetric(black_box(&machine), &errors, &options).expect("an equation");
            let checked = check(&equation, &ToolPoint).expect("agreement");
            black_box(language("c").expect("C").print(&checked, &flat).expect("code"))
        });
    });
    group.finish();
}

criterion_group!(benches, kernels, equations);
criterion_main!(benches);
