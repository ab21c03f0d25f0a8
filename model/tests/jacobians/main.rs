//! Tests of the derivatives of the recorded chain against dual numbers, central differences and the closed form of
//! first order, over every topology.

mod topologies;

use abbe_model::axis::AxisKind;
use abbe_model::chain::{ERRORS_PER_AXIS, Frame, Machine};
use abbe_model::component::ErrorName;
use abbe_model::document::composed as document;
use abbe_model::document::session::Parts;
use abbe_model::document::value::{Direction, Length, Three, Uncertainty};
use abbe_model::frames::Rotation;
use abbe_model::instrument::angle::Angle;
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::instrument::column::Quantity;
use abbe_model::instrument::composed;
use abbe_model::instrument::distance::Distance;
use abbe_model::instrument::laser::Laser;
use abbe_model::instrument::pointing::Pointing;
use abbe_model::instrument::pose::Pose;
use abbe_model::instrument::probe::Probe;
use abbe_model::instrument::rtest::{RTest, Setting};
use abbe_model::instrument::stand::Stand;
use abbe_model::instrument::tracker::Tracker;
use abbe_model::instrument::{Geometry, InstrumentKind, Station, Target};
use abbe_model::rotation_error::Body;
use abbe_model::sensitivity::{SlotValues, TestModel};
use abbe_model::session::readings::Readings;
use abbe_model::unit::InternalUnit;
use num_dual::Dual64;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use topologies::uniform;

fn ball_bar(workpiece_ball: Target<f64>, spindle_ball: Target<f64>) -> Station<f64> {
    Station::BallBar(BallBar { workpiece_ball, spindle_ball, bar: 100.0 })
}

/// An instrument beside the machine.
fn stand() -> Stand<f64> {
    Stand { rotation: [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], origin: [1000.0, -2500.0, 300.0] }
}

/// A stylus in a cylinder wide enough to be hit from any position.
fn probe(artefact: Target<f64>, stylus: Target<f64>) -> Station<f64> {
    Station::Probe(Probe { artefact, axis: [0.6, 0.0, 0.8], radius: 5000.0, stylus, direction: None })
}

/// Sensors in three directions, far from the other point.
fn r_test(setting: Setting, workpiece_ball: Target<f64>, spindle_ball: Target<f64>) -> Station<f64> {
    Station::RTest(RTest {
        setting,
        workpiece_ball,
        spindle_ball,
        sensors: Some([[0.8, 0.0, -0.6], [0.0, -1.0, 0.0], [0.36, 0.48, 0.8]]),
    })
}

/// A laser along a slanted beam that reads all six channels.
fn laser(optic: Target<f64>, reflector: Target<f64>) -> Station<f64> {
    let frame = [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];
    let mut laser = Laser { reflector, optic, frame, channels: Vec::new(), is_beam_stated: false, datum: 0.0 };
    laser.keep_channels(&|quantity| matches!(quantity, Quantity::Channel(_)));
    Station::Laser(laser)
}

/// Every instrument between two points.
fn every_station(table: [f64; 3], tool: [f64; 3]) -> [Station<f64>; 16] {
    let (on_bed, on_last) = (Target { frame: Frame::Bed, mm: table }, Target { frame: Frame::Axis(0), mm: tool });
    let (table, tool) = (Target::on_table(table), Target::on_tool(tool));
    let angle = |body| Station::Angle(Angle { about: vec![[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]], body });
    let distance = |station| Station::Distance(Distance { station, reflector: tool });
    let directions = [[0.6, 0.0, 0.8], [0.0, -1.0, 0.0], [-0.8, 0.0, 0.6]];
    let tracker = |is_polar| Station::Tracker(Tracker { target: tool, stand: stand(), is_polar });
    [
        ball_bar(table, tool),
        tracker(false),
        tracker(true),
        Station::Pose(Pose { target: tool, stand: stand(), turn: None }),
        probe(table, tool),
        r_test(Setting::Table, table, tool),
        r_test(Setting::Spindle, table, tool),
        laser(table, tool),
        angle(Body::Relative),
        angle(Body::Table),
        distance(table),
        distance(on_bed),
        ball_bar(on_bed, on_last),
        Station::Tracker(Tracker { target: table, stand: stand(), is_polar: false }),
        laser(on_last, tool),
        Station::Pointing(Pointing { directions, is_free: true }),
    ]
}

/// Random states within reach.
fn states(machine: &Machine, rows: usize, random: &mut impl Rng) -> Readings {
    let positions = machine.axes.iter().map(|axis| {
        let most = match axis.kind {
            AxisKind::Linear => 250.0,
            AxisKind::Rotary => std::f64::consts::PI,
        };
        (0..rows).map(|_| uniform(random, most)).collect()
    });
    Readings { positions: positions.collect(), ..Readings::default() }
}

/// A tenth of a millimetre and a tenth of a degree: large enough that second derivatives matter.
fn errors(slots: usize, machine: &Machine, kind: InstrumentKind, random: &mut impl Rng) -> SlotValues {
    let mut values = SlotValues::zero(slots);
    for (slot, value) in values.constant.iter_mut().enumerate() {
        *value = uniform(random, if is_angle(machine, kind, slot) { 2e-3 } else { 0.1 });
    }
    values
}

/// Whether a slot of a machine or of its instrument is an angle; a ball bar's gain is varied as a length.
fn is_angle(machine: &Machine, kind: InstrumentKind, slot: usize) -> bool {
    match slot.checked_sub(machine.error_slots()) {
        None => slot % ERRORS_PER_AXIS % 6 >= 3,
        Some(place) => kind.unknowns()[place].unit == InternalUnit::Radian,
    }
}

/// The largest relative difference between the derivatives of the recorded chain and central differences.
fn worst(machine: &Machine, station: Station<f64>, random: &mut impl Rng) -> f64 {
    let readings = states(machine, 6, random);
    let kind = station.kind();
    let model = TestModel::new(machine.clone(), station, &readings);
    let slots: Vec<usize> = (0..model.slots()).collect();
    let values = errors(model.slots(), machine, kind, random);
    let found = model.sensitivities(&values, &slots, 0..model.rows());
    assert_eq!(found.readings.len(), model.rows() * model.channels().len());
    for (found, plain) in found.readings.iter().zip(model.readings(&values)) {
        assert!((found - plain).abs() <= 1e-12 * plain.abs(), "{found} {plain}");
    }
    let mut worst = 0.0_f64;
    for slot in slots {
        let (step, least) = if is_angle(machine, kind, slot) { (1e-4, 1.0) } else { (1e-2, 1e-2) };
        let at = |value: f64| {
            let mut moved = values.clone();
            moved.constant[slot] += value;
            model.readings(&moved)
        };
        for ((above, below), derivative) in at(step).iter().zip(&at(-step)).zip(&found.derivatives[slot]) {
            let difference = (above - below) / (2.0 * step);
            let relative = (derivative - difference).abs() / difference.abs().max(least);
            worst = worst.max(relative);
        }
    }
    worst
}

#[test]
fn derivatives_agree_with_central_differences_on_every_topology() {
    let mut random = Pcg64::seed_from_u64(1);
    let mut all = 0.0_f64;
    for _ in 0..4 {
        for machine in topologies::all(&mut random) {
            let mut point = || [(); 3].map(|()| uniform(&mut random, 300.0));
            let (table, tool) = (point(), point());
            for station in every_station(table, tool) {
                let kind = station.kind();
                let worst = worst(&machine, station, &mut random);
                // Differences over 1e-4 rad deviate by its square times the lever arm: 5 m of a cylinder instead of 300
                // mm.
                let most = if kind == InstrumentKind::Probe { 1e-5 } else { 1e-6 };
                assert!(worst < most, "{} with a {}: {worst:e}", machine.name, kind.word());
                all = all.max(worst);
            }
        }
    }
    println!("worst relative difference {all:.1e}");
}

/// The largest difference between the recorded chain and the chain over dual numbers, relative to the largest value or
/// derivative. Errors are 10 mm and 0.1 rad; some of them vary between rows. The test has more rows than one block.
fn worst_against_duals(machine: &Machine, station: Station<f64>, random: &mut impl Rng) -> f64 {
    let rows = 131;
    let mut readings = states(machine, rows, random);
    // An axis that does not move is a constant of the recording.
    readings.positions[machine.axes.len() - 1].fill(0.3);
    let kind = station.kind();
    let model = TestModel::new(machine.clone(), station.clone(), &readings);
    let size = |slot: usize| if is_angle(machine, kind, slot) { 0.1 } else { 10.0 };
    let mut values = SlotValues::zero(model.slots());
    for slot in 0..model.slots() {
        match slot % 5 {
            0 => {}
            1 => {
                let column = (0..rows).map(|_| uniform(random, size(slot))).collect();
                values.varying.push((slot, column));
            }
            _ => values.constant[slot] = uniform(random, size(slot)),
        }
    }
    let requested: Vec<usize> = (0..model.slots()).filter(|slot| slot % 7 != 3).collect();
    let range = 3..rows;
    let found = model.sensitivities(&values, &requested, range.clone());
    let mut worst = 0.0_f64;
    for row in range.clone() {
        let state = model.state(row);
        let value = |slot: usize| {
            let varying = values.varying.iter().find(|(varied, _)| *varied == slot);
            values.constant[slot] + varying.map_or(0.0, |(_, column)| column[row])
        };
        for (place, seed) in requested.iter().enumerate() {
            let dual = |slot: usize| Dual64::new(value(slot), if slot == *seed { 1.0 } else { 0.0 });
            let bodies = machine.body_errors(|_| true, dual);
            let reading = station.read(machine, &state, &bodies, |unknown| Some(dual(machine.error_slots() + unknown)));
            for (coordinate, expected) in reading.channels().iter().enumerate() {
                let scalar = (row - range.start) * model.channels().len() + coordinate;
                let off = (found.derivatives[place][scalar] - expected.eps).abs() / expected.eps.abs().max(1.0);
                let value_off = (found.readings[scalar] - expected.re).abs() / expected.re.abs().max(1.0);
                worst = worst.max(off).max(value_off);
            }
        }
    }
    worst
}

#[test]
fn the_recorded_chain_is_the_chain_over_dual_numbers_at_large_errors() {
    let mut random = Pcg64::seed_from_u64(3);
    for mut machine in topologies::all(&mut random) {
        for rotation in [Rotation::Exact, Rotation::SmallAngle] {
            machine.rotation = rotation;
            let mut point = || [(); 3].map(|()| uniform(&mut random, 300.0));
            let (table, tool) = (point(), point());
            for station in every_station(table, tool) {
                let kind = station.kind();
                let worst = worst_against_duals(&machine, station, &mut random);
                // Errors of 10 mm and 0.1 rad can turn the normal of a cylinder far. The larger tolerance allows for
                // cancellation.
                let most = if kind == InstrumentKind::Probe { 1e-9 } else { 1e-11 };
                assert!(worst < most, "{} with a {}: {worst:e}", machine.name, kind.word());
            }
        }
    }
}

/// Every channel of a composed measurement, between any bodies.
fn composed_station(machine: &Machine, points: [[f64; 3]; 2]) -> Station<f64> {
    let mm = |[x, y, z]: [f64; 3]| Some(Three([x, y, z].map(Length::Number)));
    let target = |name: &str, frame: Frame| document::Target {
        name: name.into(),
        frame: Some(frame.word(machine)),
        ..document::Target::default()
    };
    let texts = |names: &[&str]| names.iter().map(ToString::to_string).collect::<Vec<_>>();
    let channel = |name: &str| document::Channel { name: name.into(), ..document::Channel::default() };
    let parts = Parts {
        target: vec![
            document::Target { point_mm: mm(points[0]), ..target("stylus", Frame::Tool) },
            document::Target { point_mm: mm(points[1]), ..target("sphere", Frame::Axis(0)) },
            document::Target { direction: Some(Direction([0.6, 0.0, 0.8])), ..target("normal", Frame::Table) },
            document::Target { length_mm: Some(Length::Number(15.5)), frame: None, ..target("R", Frame::Bed) },
        ],
        channel: vec![
            document::Channel {
                distance: Some(texts(&["stylus", "sphere"])),
                less: texts(&["R"]),
                reading: Some(0.0),
                ..channel("contact")
            },
            document::Channel {
                along: Some(texts(&["stylus", "sphere", "normal"])),
                column: Some("height_um".into()),
                zero_u_um: Some(Uncertainty::unknown()),
                ..channel("height")
            },
            document::Channel {
                rotation: Some(texts(&["tool", "table", "normal"])),
                column: Some("turn_arcsec".into()),
                zero_u_arcsec: Some(Uncertainty(1.0)),
                ..channel("turn")
            },
        ],
        ..Parts::default()
    };
    let (kind, keys) = composed::composed("composed".parse().unwrap(), &parts, machine).unwrap();
    assert_eq!(kind.unknowns().len(), 3 + 3 + 2 + 1 + 1 + 1);
    kind.set_up(&keys, &[], machine).unwrap().station.map(|length| length.mm)
}

#[test]
fn composed_measurements_are_the_chain_over_dual_numbers() {
    let mut random = Pcg64::seed_from_u64(4);
    for mut machine in topologies::all(&mut random) {
        for rotation in [Rotation::Exact, Rotation::SmallAngle] {
            machine.rotation = rotation;
            let points = [(); 2].map(|()| [(); 3].map(|()| uniform(&mut random, 300.0)));
            let worst = worst_against_duals(&machine, composed_station(&machine, points), &mut random);
            assert!(worst < 1e-11, "{}: {worst:e}", machine.name);
        }
    }
}

#[test]
fn the_first_order_of_the_bar_is_the_closed_form() {
    let machine = Machine::from_code("[wCAbYXZt]").unwrap();
    let mut random = Pcg64::seed_from_u64(2);
    let slot = |name: &str| machine.error_slot(&ErrorName::parse(name).unwrap()).unwrap();
    let names = ["e_y0a", "θ_z0a", "e_z0a", "θ_y0a", "e_x0c", "e_y0c", "θ_y0c", "θ_x0c"];
    let slots = names.map(slot);
    for _ in 0..50 {
        let [r, h, d] = [(); 3].map(|()| uniform(&mut random, 150.0));
        let mut readings = states(&machine, 20, &mut random);
        for axis in ["X", "Y", "Z"] {
            readings.positions[machine.axis_index(axis).unwrap()].fill(0.0);
        }
        let station = Station::between([0.0, r, h], [-d, 0.0, 0.0], 100.0);
        let model = TestModel::new(machine.clone(), station, &readings);
        let found = model.sensitivities(&SlotValues::zero(model.slots()), &slots, 0..model.rows());
        for row in 0..model.rows() {
            let (sc, cc) = readings.positions[machine.axis_index("C").unwrap()][row].sin_cos();
            let (sa, ca) = readings.positions[machine.axis_index("A").unwrap()][row].sin_cos();
            let length = (r * r + d * d + h * h - 2.0 * r * d * sc).sqrt();
            assert!((found.readings[row] - length).abs() < 1e-10 * length.max(1.0));
            let (y, z) = (r * cc * ca - h * sa, r * cc * sa + h * ca);
            let closed = [y, -d * y, z, d * z, d - r * sc, r * cc, d * h, 0.0].map(|term| term / length);
            for ((name, closed), derivatives) in names.iter().zip(closed).zip(&found.derivatives) {
                let difference = (derivatives[row] - closed).abs();
                assert!(difference < 1e-10 * closed.abs().max(1.0), "{name}: {} {closed}", derivatives[row]);
            }
        }
    }
}
