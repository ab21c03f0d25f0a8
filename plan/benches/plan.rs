//! Measures the duration of a plan: the analysis of a large plan, and the selection from a thousand candidate tests.
//!
//! `cargo bench -p abbe-identify --bench plan`

use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use abbe_files::{ReadOptions, session as read};
use abbe_model::session::Session;
use abbe_plan::design::Goal;
use abbe_plan::improve::{ImproveOptions, improve};
use abbe_plan::variations::TestVariations;
use abbe_plan::{PlanOptions, analyse, prepared, states};
use criterion::{Criterion, criterion_group, criterion_main};

fn sessions() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions/hermle-c600u")
}

/// Ten tests of a thousand readings, 62 parameters.
fn large_plan() -> Session {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let machine = sessions().join("machine.toml");
    let mut text = format!(
        "[machine]\nfile = {:?}\n[instrument]\nkind = \"ballbar\"\nnoise_um = 0.3\n",
        machine.canonicalize().expect("the ready machine")
    );
    for number in 0..10 {
        let setup = number % 2;
        let height = 50 * setup;
        let above = 60 + 4 * number;
        let bar = 100.0_f64.hypot(f64::from(above));
        let _ = write!(
            text,
            "[[test]]\nname = \"T{number}\"\nbar_mm = {bar}\nworkpiece_ball_mm = [0, 100, {height}]\n\
             spindle_ball_mm = [0, 0, 0]\nat = {{ z_mm = {} }}\nsetup = \"P{setup}\"\nspindle_setup = \"S{setup}\"\n\
             workpiece_ball_u_um = [2, 2, 2]\nspindle_ball_u_um = [1, 1, 1]\nbar_u_um = 0.5\n\
             sweep = {{ axis = \"C\", from_deg = 0, to_deg = 359.28, step_deg = 0.72, runs = 1, both_directions = true }}\n",
            height + above,
        );
    }
    for component in ["EXC", "EYC", "EZC", "ECC"] {
        for order in 1..=4 {
            let _ = write!(
                text,
                "[[effect]]\ncomponent = \"{component}\"\ndriver = \"C\"\nshape = \"harmonic\"\norder = {order}\n"
            );
        }
    }
    let file = folder.path().join("session.toml");
    std::fs::write(&file, text).expect("a file in a temporary folder");
    let options = ReadOptions { allow_outside: true, ..ReadOptions::default() };
    read(&file, &options).expect("a valid session")
}

fn plans(criterion: &mut Criterion) {
    let large = large_plan();
    let mut options = PlanOptions { effects: false, ..PlanOptions::default() };
    let found = analyse(&large, &options).expect("an analysis");
    assert_eq!((found.tests.len(), found.readings, found.parameter_count), (10, 10_000, 62));
    let mut group = criterion.benchmark_group("plan");
    group.sample_size(10).measurement_time(Duration::from_secs(10));
    for effects in [false, true] {
        options.effects = effects;
        let words = if effects { "with" } else { "without" };
        group.bench_function(format!("analyse/10x1000x62 {words} effects"), |bench| {
            bench.iter(|| analyse(black_box(&large), &options).expect("an analysis"));
        });
    }

    let chapter5 = read(&sessions().join("chapter5.toml"), &ReadOptions::default()).expect("the ready session");
    group.bench_function("analyse/chapter5 with effects", |bench| {
        bench.iter(|| analyse(black_box(&chapter5), &options).expect("an analysis"));
    });
    let (complete, noise) = prepared(&chapter5, &options).expect("a plan");
    let problem = states::problem_by_test(&complete, noise).expect("a problem");
    let next = ImproveOptions { goal: Goal::WorstUncertainty, tests: 1, by_minute: false };
    let variations = TestVariations::default();
    let entries = improve(&problem, &variations, &next).expect("a proposal").candidate_tests;
    group.bench_function(format!("improve/{entries} entries"), |bench| {
        bench.iter(|| improve(black_box(&problem), &variations, &next).expect("a proposal"));
    });
    group.finish();
}

criterion_group!(benches, plans);
criterion_main!(benches);
