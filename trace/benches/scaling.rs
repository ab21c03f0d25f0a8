//! Measures how time and memory grow with readings, parameters and candidates, and fits the exponents.
//!
//! `cargo bench -p abbe-trace --bench scaling`. Memory is the peak of the process less its value before (Linux
//! only).
#![allow(missing_docs)]

use std::hint::black_box;
use std::time::Instant;

use abbe_identify::fit::prepare;
use abbe_trace::screening::screened_effects;
use abbe_trace::{TraceOptions, trace};

#[path = "../../identify/benches/sessions/mod.rs"]
mod sessions;

/// Peak memory and present memory, MB.
fn memory_mb() -> Option<(f64, f64)> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let of = |key: &str| -> Option<f64> {
        let line = status.lines().find(|line| line.starts_with(key))?;
        Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
    };
    Some((of("VmHWM:")?, of("VmRSS:")?))
}

/// Seconds (the minimum of some rounds), and the growth of memory, MB.
fn measured(rounds: usize, work: impl Fn()) -> (f64, f64) {
    // Resets the peak memory.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    let before = memory_mb().map_or(0.0, |(_, now)| now);
    let seconds = (0..rounds).map(|_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    });
    let seconds = seconds.fold(f64::INFINITY, f64::min);
    (seconds, memory_mb().map_or(0.0, |(peak, _)| peak - before))
}

/// Prints a curve: size, seconds, memory, and the exponents over the last decade, or over the whole range if it is
/// shorter.
fn curve(name: &str, points: &[(f64, f64, f64)]) {
    println!("{name}");
    for (size, seconds, memory) in points {
        println!("  {size:>9} {seconds:>9.3} s {memory:>9.1} MB");
    }
    let Some(last) = points.last() else { return };
    let earlier = points.iter().rev().find(|point| point.0 <= last.0 / 10.0);
    let first = earlier.unwrap_or(&points[0]);
    let exponent = |first_is: f64, last_is: f64| (last_is / first_is).ln() / (last.0 / first.0).ln();
    print!("  from {} on: time {:.2}", first.0, exponent(first.1, last.1));
    // Smaller growth is lost in the memory that the allocator keeps.
    if first.2 > 5.0 {
        print!(", memory {:.2}", exponent(first.2, last.2));
    }
    println!();
}

fn main() {
    let mut points = Vec::new();
    // A test of a plan has at most a million readings.
    for readings in [1_000, 10_000, 100_000, 1_000_000, 10_000_000] {
        let session = sessions::ball_bar(12, readings);
        let rounds = if readings > 1_000_000 { 1 } else { 3 };
        let (seconds, memory) = measured(rounds, || {
            black_box(prepare(&session, 1).expect("a fit"));
        });
        points.push((readings as f64, seconds, memory));
    }
    curve("fit of twelve tests, by readings", &points);

    let mut points = Vec::new();
    for tests in [1, 4, 8, 17, 35, 70] {
        let session = sessions::ball_bar(tests, 20_000);
        let parameters = prepare(&session, 1).expect("a fit").0.parameters.list.len();
        let (seconds, memory) = measured(3, || {
            black_box(prepare(&session, 1).expect("a fit"));
        });
        points.push((parameters as f64, seconds, memory));
    }
    curve("fit of 20,000 readings, by parameters", &points);

    let mut points = Vec::new();
    for readings in [1_000, 3_000, 10_000, 30_000] {
        let session = sessions::ball_bar(4, readings);
        let (seconds, memory) = measured(1, || {
            black_box(trace(&session, &TraceOptions::default(), &|_| true).expect("a trace"));
        });
        points.push((readings as f64, seconds, memory));
    }
    curve("trace of four tests without undeclared effects, by readings", &points);

    let session = sessions::chapter_5();
    let ids: Vec<String> = screened_effects(&session, &TraceOptions::default())
        .expect("the library")
        .into_iter()
        .map(|entry| entry.id)
        .collect();
    let mut points = Vec::new();
    for wanted in [10, 100, 1_000, 5_000] {
        // Evenly over the list, so that all families are represented.
        let mut only: Vec<String> = (0..wanted).filter_map(|k| ids.get(k * ids.len() / wanted).cloned()).collect();
        only.dedup();
        let options = TraceOptions { only, ..TraceOptions::default() };
        let candidates = screened_effects(&session, &options).expect("the library").len();
        let (seconds, memory) = measured(1, || {
            black_box(trace(&session, &options, &|_| true).expect("a trace"));
        });
        points.push((candidates as f64, seconds, memory));
    }
    curve("trace of chapter 5 without undeclared effects, by candidates", &points);
}
