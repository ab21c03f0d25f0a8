//! Properties of readings of random tests and of their derivatives.

use std::sync::Arc;

use abbe_model::axis::AxisKind;
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::instrument::rtest::{RTest, Setting};
use abbe_model::instrument::socket::Socket;
use abbe_model::instrument::stand::Stand;
use abbe_model::instrument::tracker::Tracker;
use abbe_model::instrument::{Station, Target};
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::readings::Readings;
use abbe_model::unit::InternalUnit;
use proptest::collection::vec;
use proptest::prelude::*;

use super::machines::{Drawn, cases, machines, point};

/// A test with a few rows at random positions: all axes move simultaneously.
#[derive(Clone, Debug)]
struct DrawnTest {
    drawn: Drawn,
    station: Station<f64>,
    readings: Readings,
    values: SlotValues,
}

fn station() -> impl Strategy<Value = Station<f64>> {
    let turned = [[0.0, 1.0, 0.0], [-0.6, 0.0, 0.8], [0.8, 0.0, 0.6]];
    (point(), point(), 0_usize..5).prop_map(move |(at, tool, kind)| {
        match (kind, Target::on_table(at), Target::on_tool(tool)) {
            (0, workpiece_ball, spindle_ball) => Station::BallBar(BallBar { workpiece_ball, spindle_ball, bar: 100.0 }),
            (1, _, target) => {
                let stand = Stand { rotation: turned, origin: at };
                Station::Tracker(Tracker { target, stand, is_polar: false })
            }
            (2, _, ball) => Station::Socket(Socket { ball, socket: at, is_located: true }),
            (kind, workpiece_ball, spindle_ball) => Station::RTest(RTest {
                setting: if kind == 3 { Setting::Table } else { Setting::Spindle },
                workpiece_ball,
                spindle_ball,
                sensors: None,
            }),
        }
    })
}

fn tests() -> impl Strategy<Value = DrawnTest> {
    let places = vec(vec(-1.0..1.0, 6), 2..6);
    (machines(), station(), places, vec(-1.0..1.0, 16)).prop_map(|(drawn, station, places, own)| {
        let reach = |index: usize| match drawn.machine.axes[index].kind {
            AxisKind::Linear => 200.0,
            AxisKind::Rotary => 3.0,
        };
        let column = |axis: usize| places.iter().map(|row| reach(axis) * row[axis]).collect();
        let readings = Readings {
            positions: (0..drawn.machine.axes.len()).map(column).collect(),
            channels: station.channels().len(),
            ..Readings::default()
        };
        let mut values = SlotValues::zero(0);
        values.constant.clone_from(&drawn.errors);
        let unknowns = station.kind().unknowns().iter().zip(own);
        values.constant.extend(unknowns.map(|(unknown, size)| match unknown.unit {
            InternalUnit::Millimetre => 0.1 * size,
            InternalUnit::Radian | InternalUnit::Ratio => 1e-3 * size,
        }));
        DrawnTest { drawn, station, readings, values }
    })
}

impl DrawnTest {
    fn model(&self) -> TestModel {
        TestModel::new(Arc::new(self.drawn.machine.clone()), self.station.clone(), &self.readings)
    }
}

proptest! {
    #![proptest_config(cases(128))]

    #[test]
    fn rows_can_be_read_in_any_order(test in tests(), turn in any::<prop::sample::Index>()) {
        let mut rows: Vec<usize> = (0..test.readings.rows()).collect();
        let count = rows.len();
        rows.rotate_left(turn.index(count));
        rows.reverse();
        let mut other = test.clone();
        other.readings = test.readings.of_rows(&rows);
        let (plain, turned) = (test.model().readings(&test.values), other.model().readings(&test.values));
        let coordinates = test.readings.channels;
        for (place, row) in rows.into_iter().enumerate() {
            let of = |readings: &[f64], row: usize| readings[row * coordinates..(row + 1) * coordinates].to_vec();
            prop_assert_eq!(of(&turned, place), of(&plain, row));
        }
    }

    /// Slots are seeded in packs of eight, in the order asked for.
    #[test]
    fn derivatives_do_not_depend_on_the_order_of_slots(test in tests(), turn in any::<prop::sample::Index>()) {
        let model = test.model();
        let slots: Vec<usize> = (0..model.slots()).collect();
        let mut turned = slots.clone();
        turned.rotate_left(turn.index(slots.len()));
        let one = model.sensitivities(&test.values, &slots, 0..model.rows());
        let other = model.sensitivities(&test.values, &turned, 0..model.rows());
        for (place, slot) in turned.into_iter().enumerate() {
            for (a, b) in other.derivatives[place].iter().zip(&one.derivatives[slot]) {
                prop_assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "slot {slot}: {a} {b}");
            }
        }
        // Derivatives of a range of rows equal that range of the derivatives of all rows.
        let some = model.sensitivities(&test.values, &slots, 1..model.rows());
        let skipped = test.readings.channels;
        prop_assert_eq!(&some.readings[..], &one.readings[skipped..]);
        for (some, whole) in some.derivatives.iter().zip(&one.derivatives) {
            prop_assert_eq!(&some[..], &whole[skipped..]);
        }
    }

    #[test]
    fn ineffective_slots_do_not_change_readings(test in tests()) {
        let model = test.model();
        let effective = model.effective_slots();
        let slots: Vec<usize> = (0..model.slots()).filter(|slot| !effective.contains(slot)).collect();
        let found = model.sensitivities(&test.values, &slots, 0..model.rows());
        prop_assert!(found.derivatives.iter().flatten().all(|derivative| *derivative == 0.0));
    }

    #[test]
    fn an_effect_of_zero_size_changes_nothing(test in tests(), slot in any::<prop::sample::Index>()) {
        let model = test.model();
        let slot = slot.index(model.slots());
        let mut with = test.values.clone();
        with.varying.push((slot, vec![0.0; model.rows()]));
        // An exact zero is omitted from the chain. If it is included, it only adds zeros and multiplies by zero.
        let mut without = test.values.clone();
        without.constant[slot] = 0.0;
        with.constant[slot] = 0.0;
        for (with, without) in model.readings(&with).iter().zip(model.readings(&without)) {
            prop_assert!((with - without).abs() <= 1e-12 * without.abs().max(1.0), "{with} {without}");
        }
    }

    #[test]
    fn varying_slots_equal_constant_slots_row_by_row(test in tests(), slot in any::<prop::sample::Index>()) {
        let model = test.model();
        let slot = slot.index(model.slots());
        let mut varying = test.values.clone();
        let sizes: Vec<f64> = (0..model.rows()).map(|row| 1e-3 * row as f64).collect();
        varying.varying.push((slot, sizes.clone()));
        let found = model.readings(&varying);
        let coordinates = test.readings.channels;
        for (row, size) in sizes.into_iter().enumerate() {
            let mut constant = test.values.clone();
            constant.constant[slot] += size;
            let expected = model.readings(&constant);
            for k in row * coordinates..(row + 1) * coordinates {
                prop_assert!((found[k] - expected[k]).abs() <= 1e-12 * expected[k].abs().max(1.0));
            }
        }
    }
}
