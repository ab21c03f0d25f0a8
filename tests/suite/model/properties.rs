//! Properties of the fit of every session on any machine: results depend on the measurement, not on the order of tests,
//! rows or parameters, nor on the unit or the handedness of the frame.

#[path = "../../../model/tests/properties/machines.rs"]
mod machines;

use std::collections::BTreeMap;
use std::sync::Arc;

use abbe::files::{self, ReadOptions};
use abbe::identify::fit::{FitResult, prepare, report};
use abbe::identify::noise::{Noise, NoiseSource};
use abbe::identify::problem::Problem;
use abbe::model::axis::AxisKind;
use abbe::model::component::{ErrorKind, ErrorName, Freedom};
use abbe::model::driver::Driver;
use abbe::model::effect::shape::Periodic;
use abbe::model::effect::{Component, Effect, Shape};
use abbe::model::instrument::ballbar::BallBar;
use abbe::model::instrument::rtest::{RTest, Setting};
use abbe::model::instrument::{Station, Target};
use abbe::model::sensitivity::{SlotValues, TestModel};
use abbe::model::session::expression::Length;
use abbe::model::session::readings::Readings;
use abbe::model::session::{Prior, Session, Test};
use machines::{Drawn, cases, is_angle, machines, mirror_sign, point};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;
use proptest::strategy::ValueTree;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

const NOISE_MM: f64 = 3e-4;
const TESTS: usize = 3;
const RUNS: usize = 2;
const ROWS_A_RUN: usize = 14;

/// A random session in memory: a few tests of a bar or an R-test at random positions of a random machine, with
/// readings.
fn sessions() -> impl Strategy<Value = Session> {
    let balls = vec((point(), point()), TESTS);
    (machines(), balls, any::<bool>(), any::<u64>())
        .prop_map(|(drawn, balls, bar, seed)| session(&drawn, &balls, bar, seed))
}

fn session(drawn: &Drawn, balls: &[([f64; 3], [f64; 3])], bar: bool, seed: u64) -> Session {
    let machine = &drawn.machine;
    let mut random = Pcg64::seed_from_u64(seed);
    let tests = balls.iter().enumerate().map(|(number, (table, tool))| {
        let (workpiece_ball, spindle_ball) = (Target::on_table(*table), Target::on_tool(*tool));
        let station = if bar {
            Station::BallBar(BallBar { workpiece_ball, spindle_ball, bar: 100.0 })
        } else {
            Station::RTest(RTest { setting: Setting::Table, workpiece_ball, spindle_ball, sensors: None })
        };
        let rows = RUNS * ROWS_A_RUN;
        let column = |reach: f64, random: &mut Pcg64| -> Vec<f64> {
            (0..rows).map(|_| reach * (2.0 * random.random::<f64>() - 1.0)).collect()
        };
        let mut readings = Readings {
            run: (0..rows).map(|row| (row / ROWS_A_RUN) as i64 + 1).collect(),
            positions: machine
                .axes
                .iter()
                .map(|axis| match axis.kind {
                    AxisKind::Linear => column(200.0, &mut random),
                    AxisKind::Rotary => column(3.0, &mut random),
                })
                .collect(),
            channels: station.channels().len(),
            ..Readings::default()
        };
        let model = TestModel::new(Arc::new(machine.clone()), station.clone(), &readings);
        let mut values = SlotValues::zero(model.slots());
        // A tenth of the drawn errors: 10 µm and 0.2 mrad. The location errors are applied, the error motions are not.
        for (slot, error) in drawn.errors.iter().enumerate().filter(|(slot, _)| slot % 12 < 6) {
            values.constant[slot] = 0.1 * error;
        }
        readings.observed = model.readings(&values);
        for value in &mut readings.observed {
            *value += NOISE_MM * random.sample::<f64, _>(StandardNormal);
        }
        test(number, station, readings, machine.axes.len())
    });
    let tests: Vec<Test> = tests.collect();
    let ready = crate::suite::ready("hermle-c600u/chapter5.toml");
    Session {
        machine: Arc::new(machine.clone()),
        constants: Vec::new(),
        instrument: tests[0].station.kind(),
        noise_mm: Some(NOISE_MM),
        resolution_mm: None,
        unknowns: (0..machine.error_slots())
            .filter(|slot| slot % 12 < 6)
            .map(|slot| machine.error_name(slot))
            .collect(),
        tests,
        ..files::session(&ready, &ReadOptions::default()).unwrap()
    }
}

fn test(number: usize, station: Station<f64>, readings: Readings, axes: usize) -> Test {
    let unknowns = station.kind().unknowns().iter();
    Test {
        name: format!("T{number}"),
        geometry: station.map(|length| Length::Number(*length)),
        priors: unknowns
            .map(|unknown| match unknown.thing {
                "bar" => Prior::Gaussian(5e-4),
                _ => Prior::Known,
            })
            .collect(),
        station,
        setup: format!("S{number}"),
        spindle_setup: format!("S{number}"),
        bar_setup: "bar".into(),
        socket: None,
        motion: None,
        at: vec![0.0; axes],
        at_written: vec![None; axes],
        contributors: None,
        readings: Some(Arc::new(readings)),
    }
}

/// The result of a fit, in display units, without the outlier test.
fn fitted(session: &Session) -> FitResult {
    let (problem, fit) = prepare(session, 1).unwrap();
    let result = report(&problem, &fit).unwrap();
    assert!(result.model.outliers.is_empty());
    result
}

/// Asserts equal fits: every value agrees with `expected` of the other session within `within` standard uncertainties,
/// the tolerance of the iteration.
#[track_caller]
fn same(
    one: &FitResult,
    other: &FitResult,
    within: f64,
    expected: impl Fn(&str, f64) -> f64,
) -> Result<(), TestCaseError> {
    prop_assert_eq!(one.model.rank, other.model.rank);
    let of = |result: &FitResult| -> BTreeMap<String, (f64, f64)> {
        let parameters = result.model.parameters.iter();
        parameters.map(|p| (p.id.clone(), (p.value, p.u))).collect()
    };
    let (one, other) = (of(one), of(other));
    prop_assert_eq!(one.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>());
    for (id, (value, u)) in &one {
        let (other_value, other_u) = other[id];
        let (value, u) = (expected(id, *value), expected(id, *u).abs());
        prop_assert!((value - other_value).abs() <= within * u, "{id}: {value} {other_value} ± {u}");
        prop_assert!((u - other_u).abs() <= within * u, "{id}: u {u} {other_u}");
    }
    Ok(())
}

#[track_caller]
fn close(one: f64, other: f64) -> Result<(), TestCaseError> {
    prop_assert!((one - other).abs() <= 1e-4 * one.abs(), "{one} {other}");
    Ok(())
}

proptest! {
    #![proptest_config(cases(48))]

    #[test]
    fn the_order_of_tests_and_of_rows_in_a_run_has_no_influence(session in sessions(), turn in any::<Index>(), seed in any::<u64>()) {
        let mut other = session.clone();
        other.tests.rotate_left(turn.index(TESTS));
        let mut random = Pcg64::seed_from_u64(seed);
        for test in &mut other.tests {
            let readings = test.readings.as_ref().unwrap();
            let mut rows = Vec::new();
            for run in readings.runs() {
                let mut run: Vec<usize> = run.collect();
                rand::seq::SliceRandom::shuffle(&mut run[..], &mut random);
                rows.extend(run);
            }
            test.readings = Some(Arc::new(readings.of_rows(&rows)));
        }
        let (one, other) = (fitted(&session), fitted(&other));
        same(&one, &other, 1e-4, |_, value| value)?;
        close(one.model.fit.rms_um, other.model.fit.rms_um)?;
        close(one.model.fit.heldout_rms_um, other.model.fit.heldout_rms_um)?;
    }

    #[test]
    fn the_order_of_parameters_has_no_influence(session in sessions(), turn in any::<Index>()) {
        let mut other = session.clone();
        other.unknowns.rotate_left(turn.index(session.unknowns.len()));
        other.unknowns.reverse();
        let (one, other) = (fitted(&session), fitted(&other));
        same(&one, &other, 1e-4, |_, value| value)?;
        close(one.model.fit.rms_um, other.model.fit.rms_um)?;
        close(one.model.fit.heldout_rms_um, other.model.fit.heldout_rms_um)?;
    }

    #[test]
    fn mirrored_machines_give_mirrored_errors(session in sessions(), coordinate in 0_usize..3) {
        let mut other = session.clone();
        other.machine = Arc::new(machines::mirrored(&session.machine, coordinate));
        for test in &mut other.tests {
            let mirror = |point: &mut Target<f64>| point.mm[coordinate] *= -1.0;
            match &mut test.station {
                Station::BallBar(bar) => {
                    mirror(&mut bar.workpiece_ball);
                    mirror(&mut bar.spindle_ball);
                }
                Station::RTest(rtest) => {
                    mirror(&mut rtest.workpiece_ball);
                    mirror(&mut rtest.spindle_ball);
                    let observed = &mut Arc::make_mut(test.readings.as_mut().unwrap()).observed;
                    observed.iter_mut().skip(coordinate).step_by(3).for_each(|value| *value = -*value);
                }
                _ => {}
            }
        }
        let (one, other) = (fitted(&session), fitted(&other));
        let sign = |id: &str| ErrorName::parse(id).map_or(1.0, |name| mirror_sign(name.freedom.index(), coordinate));
        same(&one, &other, 1e-4, |id, value| sign(id) * value)?;
        close(one.model.fit.heldout_rms_um, other.model.fit.heldout_rms_um)?;
    }

    /// An effect with zero coefficients, or on a test that does not exist, changes no reading.
    #[test]
    fn an_effect_of_zero_size_changes_nothing(session in sessions(), axis in any::<Index>(), freedom in 0_usize..6) {
        let axis = &session.machine.axes[axis.index(session.machine.axes.len())];
        let effect = Effect::new(Component::Axis(ErrorName {
                kind: ErrorKind::Motion,
                freedom: Freedom::ALL[freedom],
                axis: axis.name.clone(),
            }), Driver::Axis(axis.name.clone()), Shape::Periodic(Periodic { period: 0.7 }));
        let mut with = session.clone();
        with.effects.push(effect.clone());
        let noise = || Noise::white(NOISE_MM, NoiseSource::Stated);
        let (one, other) = (Problem::new(&session, noise(), 1).unwrap(), Problem::new(&with, noise(), 1).unwrap());
        let beta: Vec<f64> = (0..one.parameters.list.len()).map(|j| 1e-5 * (j as f64 + 1.0)).collect();
        let mut wider = beta.clone();
        wider.resize(other.parameters.list.len(), 0.0);
        prop_assert_eq!(wider.len(), beta.len() + 2);
        for (a, b) in one.residuals(&beta).iter().flatten().zip(other.residuals(&wider).iter().flatten()) {
            // The effect is absent from the chain, or present with zero coefficients.
            prop_assert!((a - b).abs() <= 1e-10, "{a} {b}");
        }
        let mut elsewhere = session.clone();
        elsewhere.effects.push(Effect { tests: vec!["elsewhere".into()], ..effect });
        same(&fitted(&session), &fitted(&elsewhere), 1e-4, |_, value| value)?;
    }
}

#[test]
fn the_drawn_errors_are_recovered() {
    // The fits of the properties above find the errors: the pulls of the identifiable parameters of a few sessions have
    // unit variance.
    let mut runner = proptest::test_runner::TestRunner::new(cases(1));
    let (mut square, mut count) = (0.0, 0);
    for _ in 0..40 {
        let drawn = machines().new_tree(&mut runner).unwrap().current();
        let balls = vec((point(), point()), TESTS).new_tree(&mut runner).unwrap().current();
        let session = session(&drawn, &balls, true, 5);
        for parameter in fitted(&session).model.parameters {
            let Some(slot) = ErrorName::parse(&parameter.id).and_then(|name| session.machine.error_slot(&name)) else {
                continue;
            };
            let outside = if is_angle(slot) { 3600.0 * 180.0 / std::f64::consts::PI } else { 1e3 };
            square += ((parameter.value - 0.1 * drawn.errors[slot] * outside) / parameter.u).powi(2);
            count += 1;
        }
    }
    let variance = square / f64::from(count);
    println!("{count} errors, mean square of pulls {variance:.3}");
    assert!(count > 100);
    // Pulls of one session are correlated, so the tolerance is five standard deviations of independent pulls.
    assert!((variance - 1.0).abs() < 5.0 * (2.0 / f64::from(count)).sqrt(), "{variance}");
}
