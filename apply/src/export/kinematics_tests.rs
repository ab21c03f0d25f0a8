//! Tables of controls, by kinematics of the controls and rigid bodies that know nothing of their writer.

use abbe_model::Diagnostic;
use abbe_model::chain::{AxisPosition, Frame, Machine};
use abbe_model::frames::Point;
use nalgebra::{Rotation3, Vector3};
use rand::SeedableRng;

use super::frames::location_errors;
use super::kinematics::{EntryChoice, KinematicTable};
use super::tests::{model, random_errors, robot};
use super::travel::Travel;
use crate::control::control;
use abbe_identify::model_file::IdentifiedModel;

/// The position of the tool over the table as `xyzac-trt-kins` computes it from its joints, mm.
fn linuxcnc(joints: [f64; 3], a: f64, c: f64, rot_point: [f64; 3], y_offset: f64) -> [f64; 3] {
    let (y, z) = (joints[1] - y_offset - rot_point[1], joints[2] - rot_point[2]);
    let x = joints[0] - rot_point[0];
    let (tilted_y, tilted_z) = (a.cos() * y + a.sin() * z + y_offset, -a.sin() * y + a.cos() * z);
    [
        c.cos() * x + c.sin() * tilted_y + rot_point[0],
        -c.sin() * x + c.cos() * tilted_y + rot_point[1],
        tilted_z + rot_point[2],
    ]
}

/// The change of an entry, mm.
fn change(table: &KinematicTable, field: &str) -> f64 {
    table.parameters.iter().find(|parameter| parameter.field == field).unwrap().change_mm
}

/// The table of a control for a travel of ±90°, ±180° and ±150 mm.
fn entries_of(model: &IdentifiedModel, word: &str, choice: EntryChoice) -> Result<KinematicTable, Diagnostic> {
    let range = |axis: &abbe_model::axis::Axis| match (axis.kind, axis.direction[2].abs() == 1.0) {
        (abbe_model::axis::AxisKind::Linear, _) => [-150.0, 150.0],
        (_, true) => [-std::f64::consts::PI, std::f64::consts::PI],
        _ => [-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2],
    };
    let travel = Travel { ranges: model.machine.axes.iter().map(range).collect(), is_measured: false };
    control(word).unwrap().kinematic_table(model, choice, &travel, [0.0; 3])
}

#[test]
fn tables_of_controls_give_the_tool_positions_of_the_model() {
    let errors = [("EY0A", 0.031), ("EZ0A", -0.022), ("EX0C", 0.044), ("EY0C", -0.017)];
    let errors: Vec<(String, f64)> = errors.iter().map(|(id, value)| (id.to_string(), *value)).collect();
    let model = model(Machine::from_code("w C A b Y X Z t").unwrap(), &errors);
    let slots = location_errors(&model);
    let machine = &model.machine;
    let bodies = machine.body_errors(|slot| slots[slot] != 0.0, |slot| slots[slot]);
    let table_point = |joints: [f64; 3], a: f64, c: f64| {
        let q = [c, a, joints[1], joints[0], joints[2]];
        let state: Vec<AxisPosition<f64>> =
            machine.axes.iter().zip(q).map(|(axis, q)| AxisPosition::new(axis.kind, q)).collect();
        let tool = machine.in_r(Frame::Tool, &state, &bodies, Point([0.0; 3]));
        Vector3::from(machine.in_frame(Frame::Table, &state, &bodies, tool).0)
    };
    let of_linuxcnc = entries_of(&model, "linuxcnc", EntryChoice::Best).unwrap();
    let rot_point = ["x-rot-point", "y-rot-point", "z-rot-point"].map(|field| change(&of_linuxcnc, field));
    let y_offset = change(&of_linuxcnc, "y-offset");
    let of_fanuc = entries_of(&model, "fanuc", EntryChoice::Best).unwrap();
    let position = ["19700", "19701", "19702"].map(|field| change(&of_fanuc, field));
    let vector = ["19703", "19704", "19705"].map(|field| change(&of_fanuc, field));
    let origin = table_point([0.0; 3], 0.0, 0.0);
    for (joints, a, c) in
        [([100.0, -50.0, 30.0], 0.7, 1.9), ([-80.0, 20.0, 150.0], -0.4, -2.5), ([10.0, 120.0, -60.0], 1.3, 0.2)]
    {
        let expected = table_point(joints, a, c) - origin;
        let found = Vector3::from(linuxcnc(joints, a, c, rot_point, y_offset));
        assert!((found - expected).norm() < 1e-9, "{found} {expected}");
        // Fanuc: the table turns about the line through A, and what stands on it about the line through B.
        let (first, second) = (Vector3::from(position), Vector3::from(position) + Vector3::from(vector));
        let tilt = Rotation3::new(Vector3::x() * a).inverse();
        let spin = Rotation3::new(Vector3::z() * c).inverse();
        let tilted = tilt * (Vector3::from(joints) - first) + first;
        let found = spin * (tilted - second) + second;
        assert!((found - expected).norm() < 1e-9, "{found} {expected}");
    }
    assert!(entries_of(&model, "siemens", EntryChoice::Best).unwrap_err().to_string().contains("no sign is guessed"));
    assert!(entries_of(&super::tests::model(robot(), &[]), "fanuc", EntryChoice::Best).is_err());
}

/// An entry without an identified error has no change of 0 with an uncertainty of 0: it is not in the table.
#[test]
fn entries_that_the_readings_do_not_determine_are_left_out() {
    let machine = || Machine::from_code("w C A b Y X Z t").unwrap();
    let errors = [("EX0C", 0.044), ("EY0C", -0.017), ("EZ0A", 0.0), ("EC0C", 1e-4)];
    let errors: Vec<(String, f64)> = errors.iter().map(|(id, value)| (id.to_string(), *value)).collect();
    let mut model = model(machine(), &errors);
    model.parameters[2].held = true;
    model.covariance[(2, 2)] = 0.0;
    let table = entries_of(&model, "fanuc", EntryChoice::Best).unwrap();
    let fields: Vec<&str> = table.parameters.iter().map(|parameter| parameter.field.as_str()).collect();
    assert_eq!(fields, ["19700", "19703", "19704", "19705"]);
    assert!(table.parameters.iter().all(|parameter| parameter.change_mm.is_sign_positive() || parameter.u_mm > 0.0));
    assert_eq!(
        table.left_out,
        [
            "19701: rotary table position, Y: the readings do not determine EY0A",
            "19702: rotary table position, Z: the readings do not determine EZ0A",
            "EC0C: the control's model has no entry for it",
        ]
    );
    let angle = super::tests::model(machine(), &errors[3..]);
    assert!(entries_of(&angle, "fanuc", EntryChoice::Best).unwrap_err().to_string().contains("no entry"));
}

/// The rotation of an error `Rx·Ry·Rz`.
fn tilt(six: &[f64]) -> Rotation3<f64> {
    Rotation3::new(Vector3::x() * six[0])
        * Rotation3::new(Vector3::y() * six[1])
        * Rotation3::new(Vector3::z() * six[2])
}

/// A machine with a tilting table, as rigid bodies that the chain under test did not make, and a control that turns about
/// two lines.
struct OneMachine {
    first: Vector3<f64>,
    first_origin: Vector3<f64>,
    second_origin: Vector3<f64>,
    /// Six location errors of the first axis, of the second, and the tilts of Y, X and Z.
    errors: [[f64; 6]; 5],
}

impl OneMachine {
    fn table_point(&self, joints: Vector3<f64>, first: f64, second: f64) -> Vector3<f64> {
        let [of_first, of_second, y, x, z] = &self.errors;
        // Y carries X carries Z: a tilted axis moves along its own direction.
        let along =
            |six: &[f64; 6], unit: Vector3<f64>, q: f64| (unit + Vector3::new(six[3], six[4], six[5]).cross(&unit)) * q;
        let tool =
            along(y, Vector3::y(), joints.y) + along(x, Vector3::x(), joints.x) + along(z, Vector3::z(), joints.z);
        let back = |point: Vector3<f64>, six: &[f64; 6], origin: Vector3<f64>, axis: Vector3<f64>, q: f64| {
            let shifted = point - origin - Vector3::new(six[0], six[1], six[2]);
            Rotation3::new(axis * q).inverse() * (tilt(&six[3..]).inverse() * shifted) + origin
        };
        let on_first = back(tool, of_first, self.first_origin, self.first, first);
        back(on_first, of_second, self.second_origin, Vector3::z(), second)
    }

    fn control_point(&self, lines: &[f64], joints: Vector3<f64>, first: f64, second: f64) -> Vector3<f64> {
        // Across and height of the first line, along and across of the second.
        let (along, across) = if self.first.x != 0.0 { (0, 1) } else { (1, 0) };
        let (mut of_first, mut of_second) = (self.first_origin, self.second_origin);
        of_first[across] += lines[0];
        of_first.z += lines[1];
        of_second[along] += lines[2];
        of_second[across] += lines[0] + lines[3];
        let tilted = Rotation3::new(self.first * first).inverse() * (joints - of_first) + of_first;
        Rotation3::new(Vector3::z() * second).inverse() * (tilted - of_second) + of_second
    }

    /// Rms over places of the travel that are drawn, without the mean: mm.
    fn rms(&self, lines: &[f64], places: &[[f64; 5]]) -> f64 {
        let off: Vec<Vector3<f64>> = places
            .iter()
            .map(|[a, c, x, y, z]| {
                let joints = Vector3::new(*x, *y, *z);
                self.table_point(joints, *a, *c) - self.control_point(lines, joints, *a, *c)
            })
            .collect();
        let mean = off.iter().sum::<Vector3<f64>>() / off.len() as f64;
        (off.iter().map(|off| (off - mean).norm_squared()).sum::<f64>() / off.len() as f64).sqrt()
    }

    /// The least rms by a search along one coordinate after another, with steps that halve: no derivative.
    fn least(&self, places: &[[f64; 5]]) -> f64 {
        let (mut lines, mut step) = ([0.0; 4], 0.1);
        let mut best = self.rms(&lines, places);
        while step > 1e-6 {
            let before = best;
            for line in 0..4 {
                for sign in [-1.0, 1.0] {
                    let mut moved = lines;
                    moved[line] += sign * step;
                    let rms = self.rms(&moved, places);
                    if rms < best {
                        (best, lines) = (rms, moved);
                    }
                }
            }
            if best >= before {
                step *= 0.5;
            }
        }
        best
    }
}

/// Twenty machines of three layouts with all location errors: what the written entries of both controls leave is at most
/// 1.001 times what a search without derivatives leaves, over places of the travel that this test draws. The plain entries
/// leave more.
#[test]
fn no_other_entries_leave_less() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(61);
    let mut worst: [f64; 2] = [0.0, 0.0];
    for number in 0..20 {
        let code = ["w C A b Y X Z t", "w C B b Y X Z t", "w C A b Y X Z t"][number % 3];
        let mut machine = Machine::from_code(code).unwrap();
        // The third layout: the axes do not meet.
        if number % 3 == 2 {
            machine.axes[0].origin_mm = [0.0, 40.0, 0.0];
            machine.axes[1].origin_mm = [0.0, 0.0, -60.0];
        }
        let errors = random_errors(&machine, &mut random);
        let six = |axis: usize| -> [f64; 6] { std::array::from_fn(|k| 0.1 * errors[6 * axis + k].1) };
        let own = OneMachine {
            first: Vector3::from(machine.axes[1].direction),
            first_origin: Vector3::from(machine.axes[1].origin_mm),
            second_origin: Vector3::from(machine.axes[0].origin_mm),
            errors: [six(1), six(0), six(2), six(3), six(4)],
        };
        let names: Vec<(String, f64)> = errors.iter().map(|(id, value)| (id.clone(), 0.1 * value)).collect();
        let model = model(machine, &names);
        // A Latin square of the travel: every axis has its places evenly.
        let count = 1009;
        let places: Vec<[f64; 5]> = (0..count)
            .map(|k| {
                let share = |step: usize| 2.0 * ((k * step % count) as f64 + 0.5) / count as f64 - 1.0;
                let pi = std::f64::consts::PI;
                [0.5 * pi * share(1), pi * share(382), 150.0 * share(119), 150.0 * share(551), 150.0 * share(716)]
            })
            .collect();
        let least = own.least(&places);
        for word in ["linuxcnc", "fanuc"] {
            let table = entries_of(&model, word, EntryChoice::Best).unwrap();
            let lines = [&table, &entries_of(&model, word, EntryChoice::Plain).unwrap()]
                .map(|table| lines_of(table, word, own.first.x != 0.0));
            let [best, plain] = lines.map(|lines| own.rms(&lines, &places));
            worst = [worst[0].max(best / least), worst[1].max(plain / least)];
            assert!(best <= 1.001 * least, "{number} {word}: {best} {least}");
            let stated = [table.remaining.without.rms_um, table.remaining.plain.rms_um, table.remaining.written.rms_um];
            let found = [own.rms(&[0.0; 4], &places), plain, best].map(|mm| mm * 1e3);
            for (stated, found) in stated.iter().zip(found) {
                assert!((stated / found - 1.0).abs() < 0.02, "{number} {word}: {stated} {found}");
            }
            assert!(table.remaining.written.largest_um > table.remaining.written.rms_um);
        }
    }
    println!("rms over the least one: written {:.5}, plain {:.3}", worst[0], worst[1]);
    assert!(worst[1] > 1.02, "{worst:?}");
}

/// Across and height of the first line, along and across of the second, by the entries of a control.
fn lines_of(table: &KinematicTable, word: &str, first_is_a: bool) -> Vec<f64> {
    let of = |field: &str| change(table, field);
    match (word, first_is_a) {
        ("linuxcnc", true) => {
            vec![of("y-rot-point") + of("y-offset"), of("z-rot-point"), of("x-rot-point"), -of("y-offset")]
        }
        ("linuxcnc", false) => {
            vec![of("x-rot-point") + of("x-offset"), of("z-rot-point"), of("y-rot-point"), -of("x-offset")]
        }
        (_, true) => vec![of("19701"), of("19702"), of("19700") + of("19703"), of("19704")],
        (_, false) => vec![of("19700"), of("19702"), of("19701") + of("19704"), of("19703")],
    }
}

/// Axes that do not meet and are tilted against each other: no line has a position error, and displaced lines still
/// describe a part of what the tilts do.
#[test]
fn tilted_axes_that_do_not_meet_have_entries() {
    let mut machine = Machine::from_code("w C A b Y X Z t").unwrap();
    machine.axes[1].origin_mm = [0.0, 0.0, -50.0];
    let arcsec = std::f64::consts::PI / 648_000.0;
    let zero = ["EY0A", "EZ0A", "EX0C", "EY0C"].map(|id| (id.to_string(), 0.0));
    let tilts = [("EB0A".to_string(), 20.0 * arcsec), ("EB0C".to_string(), -20.0 * arcsec)];
    let model = model(machine, &[&zero[..], &tilts].concat());
    let best = entries_of(&model, "linuxcnc", EntryChoice::Best).unwrap();
    let plain = entries_of(&model, "linuxcnc", EntryChoice::Plain).unwrap();
    assert!(plain.parameters.iter().all(|parameter| parameter.change_mm == 0.0), "{plain:?}");
    assert_eq!(plain.remaining.written, plain.remaining.without);
    // Least squares over midpoints in Python (NumPy, rigid bodies of its own): 12.18 µm, 10.23 µm and 6.61 µm.
    let found = [best.remaining.plain.rms_um, best.remaining.written.rms_um, 1e3 * change(&best, "x-rot-point")];
    for (found, expected) in found.iter().zip([12.175, 10.226, 6.608]) {
        assert!((found / expected - 1.0).abs() < 0.005, "{found} {expected}");
    }
    // Both tilts bring uncertainty into the line of C in X, which alone moves.
    assert!(best.parameters[0].u_mm > plain.parameters[0].u_mm, "{best:?}");
    let ids: Vec<&str> = best.not_represented.iter().map(|one| one.id.as_str()).collect();
    assert_eq!(ids.len(), 2, "{ids:?}");
    assert!(ids.contains(&"EB0A") && ids.contains(&"EB0C"));
}
