//! Benchmark of the generic chain over columns, against a kernel written by hand and against the chain over num-dual
//! numbers, one reading at a time: value and eight derivatives of the chapter 5 tests; value and all sensitivities of a
//! five-axis machine.
//!
//! `cargo bench -p abbe-model --bench chain`
#![allow(missing_docs)]

use std::hint::black_box;
use std::sync::Arc;

use abbe_model::chain::{AxisPosition, Machine};
use abbe_model::component::ErrorName;
use abbe_model::frames::Rotation;
use abbe_model::instrument::Station;
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::readings::Readings;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use num_dual::{Derivative, DualSVec64};

#[path = "../../codegen/benches/hand.rs"]
mod hand;

const LENGTHS: [f64; 4] = [111.803, 100.0, 75.0, 60.0];
const ERRORS: [f64; 8] = [0.01, -0.02, 1e-4, 2e-4, 0.015, -0.01, -1e-4, 3e-4];
const NAMES: [&str; 8] = ["EY0A", "EZ0A", "EB0A", "EC0A", "EX0C", "EY0C", "EA0C", "EB0C"];

fn angles(rows: usize, speed: f64) -> Vec<f64> {
    (0..rows).map(|i| (i % 1_000) as f64 * speed).collect()
}

fn readings(rows: usize) -> Readings {
    let still = |value: f64| vec![value; rows];
    Readings {
        positions: vec![angles(rows, 0.006), angles(rows, 0.0015), still(0.0), still(-LENGTHS[0]), still(0.0)],
        ..Readings::default()
    }
}

fn machine() -> Machine {
    let mut machine = Machine::from_code("w C A b Y X Z t").expect("a structural code");
    machine.rotation = Rotation::SmallAngle;
    machine
}

fn station() -> Station<f64> {
    Station::between([0.0, LENGTHS[1], LENGTHS[2] - LENGTHS[3]], [0.0; 3], 150.0)
}

fn eight(machine: &Machine) -> Vec<usize> {
    let slot = |name: &&str| machine.error_slot(&ErrorName::parse(name).expect("the name of an error"));
    NAMES.iter().map(|name| slot(name).expect("an error of this machine")).collect()
}

fn chain(criterion: &mut Criterion) {
    let machine = machine();
    let slots = eight(&machine);
    for (rows, cache) in [(1_000, "in cache"), (1_000_000, "streaming")] {
        let mut group = criterion.benchmark_group(format!("value and eight derivatives, {cache}"));
        group.throughput(Throughput::Elements(rows as u64)).sample_size(20);
        let (c, a) = (angles(rows, 0.006), angles(rows, 0.0015));
        let columns = [&c, &c, &a, &a];
        let axes: Vec<Vec<f64>> = columns
            .iter()
            .enumerate()
            .map(|(i, column)| column.iter().map(|q| if i % 2 == 0 { q.sin() } else { q.cos() }).collect())
            .collect();
        group.bench_function("by hand", |bencher| {
            let mut value = vec![0.0; rows];
            let mut gradient: [Vec<f64>; 8] = std::array::from_fn(|_| vec![0.0; rows]);
            bencher.iter(|| {
                let slopes = gradient.each_mut().map(Vec::as_mut_slice);
                let columns = [&axes[0][..], &axes[1], &axes[2], &axes[3]];
                hand::columns(black_box(&LENGTHS), black_box(columns), black_box(&ERRORS), &mut value, slopes);
                black_box(&mut value);
            });
        });
        let readings = readings(rows);
        let model = TestModel::new(Arc::new(machine.clone()), station(), &readings);
        let mut values = SlotValues::zero(model.slots());
        for (slot, error) in slots.iter().zip(ERRORS) {
            values.constant[*slot] = error;
        }
        group.bench_function("generic chain", |bencher| {
            let mut outputs: [Vec<f64>; 9] = std::array::from_fn(|_| vec![0.0; rows]);
            bencher.iter(|| {
                model.sweep(black_box(&values), &slots, 0..rows, |output, start, column| {
                    outputs[output][start..start + column.len()].copy_from_slice(column);
                });
                black_box(&mut outputs);
            });
        });
        if rows > 1_000 {
            group.finish();
            continue;
        }
        group.bench_function("generic chain over num-dual, one at a time", |bencher| {
            let states: Vec<Vec<AxisPosition<f64>>> = (0..rows).map(|row| model.state(row)).collect();
            let station = station();
            let dual = |slot: usize| {
                let place = slots.iter().position(|seed| *seed == slot)?;
                let mut unit = nalgebra::SVector::<f64, 8>::zeros();
                unit[place] = 1.0;
                Some(DualSVec64::<8>::new(ERRORS[place], Derivative::some(unit)))
            };
            let bodies = machine.body_errors(|slot| dual(slot).is_some(), |slot| dual(slot).unwrap_or(0.0.into()));
            bencher.iter(|| {
                for state in &states {
                    black_box(station.read(&machine, black_box(state), &bodies, |_| None));
                }
            });
        });
        group.finish();
    }
}

fn all_components(criterion: &mut Criterion) {
    let mut machine = machine();
    machine.rotation = Rotation::Exact;
    let rows = 1_000;
    let model = TestModel::new(Arc::new(machine.clone()), station(), &readings(rows));
    // Six error motions per axis, both balls and the bar.
    let motions = (0..machine.error_slots()).filter(|slot| slot % 12 >= 6);
    let slots: Vec<usize> = motions.chain(machine.error_slots()..machine.error_slots() + 7).collect();
    let values = SlotValues::zero(model.slots());
    let mut group = criterion.benchmark_group("value and all components of a five-axis machine");
    group.throughput(Throughput::Elements(rows as u64));
    group.bench_function(format!("{} components", slots.len()), |bencher| {
        // A fit also processes them block by block, into a matrix that stays in the cache.
        let mut outputs = vec![vec![0.0; rows]; 1 + slots.len()];
        bencher.iter(|| {
            model.sweep(black_box(&values), &slots, 0..rows, |output, start, column| {
                outputs[output][start..start + column.len()].copy_from_slice(column);
            });
            black_box(&mut outputs);
        });
    });
    group.finish();
}

criterion_group!(benches, chain, all_components);
criterion_main!(benches);
