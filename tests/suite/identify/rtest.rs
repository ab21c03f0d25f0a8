//! The R-test against the paper (Yamaji, Hamabata & Ihara, HPC 2014) and against the plant.

use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::Arc;

use abbe::files::{self, ReadOptions};
use abbe::identify::directions::views;
use abbe::identify::fit::prepare;
use abbe::model::axis::AxisKind;
use abbe::model::chain::Machine;
use abbe::model::component::ErrorName;
use abbe::model::frames::{Point, Rotation};
use abbe::model::instrument::rtest::{Orientation, RTest, Setting};
use abbe::model::instrument::{InstrumentKind, Station, Target};
use abbe::model::sensitivity::{SlotValues, TestModel};
use abbe::model::session::planned;
use abbe::model::session::readings::Readings;
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use crate::plant;
use crate::plant::component::{AxisName, Cartesian, Component, Freedom};
use crate::plant::machine::{Commanded, Displacement, Stated};
use crate::plant::rtest::{Nest, NestOn};
use crate::suite::plan::topologies::uniform;
use crate::suite::ready;

/// The three matrices above Eq. (1).
fn printed(omega: f64, phi: f64, theta: f64) -> [Matrix3<f64>; 3] {
    let ((sw, cw), (sp, cp), (st, ct)) = (omega.sin_cos(), phi.sin_cos(), theta.sin_cos());
    [
        Matrix3::new(1.0, 0.0, 0.0, 0.0, cw, sw, 0.0, -sw, cw),
        Matrix3::new(cp, 0.0, -sp, 0.0, 1.0, 0.0, sp, 0.0, cp),
        Matrix3::new(ct, st, 0.0, -st, ct, 0.0, 0.0, 0.0, 1.0),
    ]
}

fn near(found: [f64; 3], expected: [f64; 3], most: f64) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= most, "{found} is not {expected}");
    }
}

#[test]
fn equations_1_to_3_are_the_product_in_the_order_of_the_text_not_of_the_printed_matrices() {
    let mut random = Pcg64::seed_from_u64(1);
    let mut furthest_from_print = 0.0_f64;
    for _ in 0..100 {
        let [omega, phi, theta] = [(); 3].map(|()| uniform(&mut random, 3.0));
        let [u, v, w] = [(); 3].map(|()| uniform(&mut random, 1.0));
        let found = Orientation::new([omega, phi, theta], Rotation::Exact);
        let [about_u, about_v, about_w] = printed(omega, phi, theta);
        let product = about_v * about_w * about_u * Vector3::new(u, v, w);
        near(found.to_machine(Point([u, v, w])).0, product.into(), 1e-14);
        let ((sw, cw), (sp, cp), (st, ct)) = (omega.sin_cos(), phi.sin_cos(), theta.sin_cos());
        let expanded = [
            u * ct * cp + v * cw * cp * st + w * sw * cp * st + v * sw * sp - w * cw * sp,
            -u * st + v * cw * ct + w * sw * ct,
            u * sp * ct + v * cw * sp * st + w * sw * sp * st - v * sw * cp + w * cw * cp,
        ];
        near(found.to_machine(Point([u, v, w])).0, expanded, 1e-14);
        near(found.to_sensors(Point(expanded)).0, [u, v, w], 1e-14);
        let as_printed = about_w * about_v * about_u * Vector3::new(u, v, w);
        furthest_from_print = furthest_from_print.max((as_printed - product).norm());
    }
    assert!(furthest_from_print > 0.5, "{furthest_from_print}");
}

/// Hand calculation: sin 35.264° = 1/√3 and cos 35.264° = √(2/3) to five decimals.
#[test]
fn equations_4_to_6_have_their_constants() {
    let angles = [135.0_f64, -35.264, 0.0].map(f64::to_radians);
    let orientation = Orientation::new(angles, Rotation::Exact);
    for (sensor, expected) in [
        ([1.0, 0.0, 0.0], [0.81650, 0.0, -0.57735]),
        ([0.0, 1.0, 0.0], [-0.40825, -FRAC_1_SQRT_2, -0.57735]),
        ([0.0, 0.0, 1.0], [-0.40825, FRAC_1_SQRT_2, -0.57735]),
    ] {
        near(orientation.to_machine(Point(sensor)).0, expected, 1e-5);
    }
}

/// Eqs. (7) to (9) omit half the squares of the angles times the coordinate itself, and terms of third order.
#[test]
fn equations_7_to_9_are_the_small_angle_form_and_omit_only_the_squares() {
    let [x, y, z] = [0.7, -0.4, 0.9];
    for size in [1e-2, 1e-3] {
        let [omega, phi, theta] = [0.6, -1.0, 0.8].map(|angle| angle * size);
        let printed = [
            x + y * theta + z * omega * theta + y * omega * phi - z * phi,
            -x * theta + y + z * omega,
            x * phi + y * phi * theta + z * omega * phi * theta - y * omega + z,
        ];
        let at = |rotation| Orientation::new([omega, phi, theta], rotation).to_machine(Point([x, y, z])).0;
        near(at(Rotation::SmallAngle), printed, 1e-15);
        let half = |a: f64, b: f64| 0.5 * (a * a + b * b);
        let exact = at(Rotation::Exact);
        let squares = [x * half(phi, theta), y * half(theta, omega), z * half(phi, omega)];
        let rest: [f64; 3] = std::array::from_fn(|i| exact[i] - printed[i] + squares[i]);
        near(rest, [0.0; 3], 2.0 * size.powi(3));
        // The difference has the order of the omitted terms.
        assert!((exact[0] - printed[0]).abs() > 0.3 * size * size);
    }
}

/// All errors drawn up to 0.1 mm and 0.5 mrad, for the plant and for the slots of the model.
fn everything(machine: &Machine, random: &mut Pcg64) -> (Displacement, SlotValues) {
    let unknowns = InstrumentKind::RTest.unknowns().len();
    let mut slots = SlotValues::zero(machine.error_slots() + unknowns);
    let mut displacement = Displacement::default();
    for axis in AxisName::ALL {
        for freedom in Freedom::ALL {
            for component in [Component::Motion(freedom, axis), Component::Location(freedom, axis)] {
                let value = uniform(random, if freedom.is_angle() { 5e-4 } else { 0.1 });
                displacement.add(component, value);
                let name = ErrorName::parse(&component.to_string()).unwrap();
                slots.constant[machine.error_slot(&name).unwrap()] = value;
            }
        }
    }
    for i in 0..3 {
        let [workpiece, spindle] = [(); 2].map(|()| uniform(random, 0.1));
        displacement.add(Component::WorkpieceBall(Cartesian(i)), workpiece);
        displacement.add(Component::SpindleBall(Cartesian(i)), spindle);
        slots.constant[machine.error_slots() + i] = workpiece;
        slots.constant[machine.error_slots() + 3 + i] = spindle;
    }
    (displacement, slots)
}

#[test]
fn both_settings_agree_with_the_plant() {
    let machine = Machine::from_code("w C A b Y X Z t").unwrap();
    let mut random = Pcg64::seed_from_u64(2);
    for case in 0..200 {
        let on = [NestOn::Table, NestOn::Spindle][case % 2];
        let [workpiece_ball_mm, spindle_ball_mm] = [(); 2].map(|()| [(); 3].map(|()| uniform(&mut random, 200.0)));
        let raw = case % 4 < 2;
        let mut nest = Nest::along_the_axes(on);
        if raw {
            nest.directions = [(); 3].map(|()| Vector3::from([(); 3].map(|()| uniform(&mut random, 1.0))).normalize());
        }
        nest.misaligned = [(); 3].map(|()| uniform(&mut random, 0.02));
        let (displacement, mut slots) = everything(&machine, &mut random);
        for (i, angle) in nest.misaligned.into_iter().enumerate() {
            slots.constant[machine.error_slots() + 6 + i] = angle;
        }
        let position: [f64; 5] =
            std::array::from_fn(|i| uniform(&mut random, if AxisName::ALL[i].is_rotary() { 3.0 } else { 250.0 }));
        let stated = Stated { workpiece_ball_mm, workpiece_ball_on: AxisName::C, spindle_ball_mm, bar_mm: 0.0 };
        let commanded = Commanded { position, velocity: [0.0; 5] };
        let plant = plant::machine::Machine::default();
        let expected = plant::rtest::reading_mm(&plant, &nest, &commanded, &stated, &displacement);
        let station = Station::RTest(RTest {
            setting: match on {
                NestOn::Table => Setting::Table,
                NestOn::Spindle => Setting::Spindle,
            },
            workpiece_ball: Target::on_table(workpiece_ball_mm),
            spindle_ball: Target::on_tool(spindle_ball_mm),
            sensors: raw.then(|| nest.directions.map(|direction| direction.into())),
        });
        let of_axis = |name: &str| AxisName::ALL.iter().position(|axis| format!("{axis:?}") == name).unwrap();
        let readings = Readings {
            positions: machine.axes.iter().map(|axis| vec![position[of_axis(&axis.name)]]).collect(),
            ..Readings::default()
        };
        let model = TestModel::new(Arc::new(machine.clone()), station, &readings);
        let found = model.readings(&slots);
        near([found[0], found[1], found[2]], expected, 1e-10);
    }
}

/// With C under the nest and the nest at +X, the two views are Eqs. (10) and (11), in both settings.
#[test]
fn radial_and_tangential_are_equations_10_and_11() {
    for on in [NestOn::Table, NestOn::Spindle] {
        let folder = tempfile::tempdir().unwrap();
        crate::suite::identify::rtest_findings::bk2_without_effects(on).write(folder.path()).unwrap();
        let session = files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap();
        let (problem, fit) = prepare(&session, 1).unwrap();
        let all = views(&problem, &fit).unwrap();
        let readings = session.tests[0].readings.as_ref().unwrap();
        let angles = &readings.positions[session.machine.axis_index("C").unwrap()];
        assert_eq!(all[0].len(), readings.rows());
        for (row, viewed) in all[0].iter().enumerate() {
            let (sin, cos) = angles[row].sin_cos();
            let [x, y, z] = viewed.reading.wise;
            let [radial, tangential, axial] = viewed.reading.turning.unwrap();
            near([radial, tangential, axial], [x * cos + y * sin, -x * sin + y * cos, z], 1e-12);
            // The readings: with sensors on the table they rotate with C, with sensors in the spindle they do not.
            let read = &readings.observed[3 * row..3 * row + 3];
            let expected = match on {
                NestOn::Table => [radial, tangential, axial],
                NestOn::Spindle => [x, y, z],
            };
            near(expected, [read[0], read[1], read[2]], 1e-12);
        }
    }
}

/// Eq. (12): if a control counts a degree as a millimetre, the length of one turn is the diagonal of 2πR mm and 360°.
#[test]
fn a_programmed_feed_takes_the_time_of_the_diagonal() {
    let session = files::session(&ready("r-test/plan.toml"), &ReadOptions::default()).unwrap();
    let bk2 = session.tests.iter().find(|test| test.name == "BK2").unwrap();
    let planned = planned::planned(&session.machine, bk2).unwrap();
    let first = planned.runs()[0].clone();
    let taken_s = planned.time_s[first.end - 1] - planned.time_s[first.start];
    let diagonal = (std::f64::consts::TAU * 100.0).hypot(360.0);
    assert!((taken_s - diagonal / 1000.0 * 60.0).abs() < 1e-9 * taken_s, "{taken_s}");
}

/// BK1 and BK2: the ball stays in the nest, nominally.
#[test]
fn linear_axes_that_follow_keep_the_ball_in_the_nest() {
    for (file, tests) in [("r-test/plan.toml", 3), ("r-test/machine-b.toml", 3)] {
        let session = files::session(&ready(file), &ReadOptions::default()).unwrap();
        assert_eq!(session.tests.len(), tests);
        for test in &session.tests {
            let planned = planned::planned(&session.machine, test).unwrap();
            let moving = session
                .machine
                .axes
                .iter()
                .zip(&planned.positions)
                .filter(|(axis, column)| {
                    axis.kind == AxisKind::Linear && column.iter().any(|q| (q - column[0]).abs() > 1.0)
                })
                .count();
            assert_eq!(moving, if test.name == "C-alone" { 0 } else { 2 }, "{}", test.name);
            let model = TestModel::new(session.machine.clone(), test.station.clone(), &planned);
            let nominal = model.readings(&SlotValues::zero(model.slots()));
            assert!(nominal.iter().all(|reading| reading.abs() < 1e-9), "{}", test.name);
        }
    }
}
