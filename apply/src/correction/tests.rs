//! Corrected commands, judged by kinematics that share no code with the chain: products of homogeneous matrices.

use std::sync::Arc;

use abbe_files::commands::CommandFile;
use abbe_identify::model_file::errors::{EstimatedEffect, EstimatedErrors};
use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::Machine;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::driver::{Driver, Reference};
use abbe_model::effect::shape::{Harmonic, Polynomial, Shape};
use abbe_model::effect::{Component, Effect};
use abbe_model::instrument::Station;
use abbe_model::pose::reach;
use abbe_model::session::readings::Readings;
use nalgebra::{Matrix3, Matrix4, Rotation3, Unit, Vector3};
use rand::{Rng, RngExt, SeedableRng};

use super::{Aim, Correction, Pose, State};

fn translation(by: [f64; 3]) -> Matrix4<f64> {
    Matrix4::new_translation(&Vector3::from(by))
}

fn rotation(axis: [f64; 3], angle: f64) -> Matrix4<f64> {
    Rotation3::from_axis_angle(&Unit::new_normalize(Vector3::from(axis)), angle).to_homogeneous()
}

/// `Trans(x, y, z) · Rx(a) · Ry(b) · Rz(c)`.
fn motion(six: [f64; 6]) -> Matrix4<f64> {
    let [x, y, z, a, b, c] = six;
    translation([x, y, z]) * rotation([1.0, 0.0, 0.0], a) * rotation([0.0, 1.0, 0.0], b) * rotation([0.0, 0.0, 1.0], c)
}

/// Location errors and error motions of an axis at a state of all axes.
type Errors<'e> = &'e dyn Fn(usize, &[f64]) -> ([f64; 6], [f64; 6]);

/// The tool frame in the table frame.
fn tool_in_table(machine: &Machine, q: &[f64], errors: Errors<'_>) -> Matrix4<f64> {
    let axis = |index: usize| {
        let Axis { kind, direction, origin_mm, .. } = &machine.axes[index];
        let (location, varying) = errors(index, q);
        let back = translation(origin_mm.map(|o| -o));
        match kind {
            AxisKind::Rotary => {
                translation(*origin_mm) * motion(location) * motion(varying) * rotation(*direction, q[index]) * back
            }
            AxisKind::Linear => {
                let direction = Vector3::from(*direction);
                let tilted = direction + Vector3::new(location[3], location[4], location[5]).cross(&direction);
                let along = Vector3::from(*origin_mm) + tilted * q[index];
                translation(along.into()) * motion(varying) * back
            }
        }
    };
    // From the bed outwards: on the workpiece side from the last axis of the code backwards.
    let table = (0..machine.workpiece_side).rev().fold(Matrix4::<f64>::identity(), |frame, index| frame * axis(index));
    let tool = (machine.workpiece_side..machine.axes.len())
        .fold(Matrix4::<f64>::identity(), |frame, index| frame * axis(index));
    table.try_inverse().unwrap() * tool
}

fn point(frame: &Matrix4<f64>, tool_mm: [f64; 3]) -> Vector3<f64> {
    (frame * Vector3::from(tool_mm).push(1.0)).xyz()
}

fn directions(frame: &Matrix4<f64>) -> Matrix3<f64> {
    frame.fixed_view::<3, 3>(0, 0).into_owned()
}

fn effect(id: &str, driver: Driver, shape: Shape, coefficients: &[f64]) -> EstimatedEffect {
    let effect = Effect::new(Component::parse(id).unwrap(), driver, shape);
    EstimatedEffect { effect, coefficients: coefficients.to_vec() }
}

fn readings(positions: Vec<Vec<f64>>) -> Readings {
    Readings { positions, channels: 1, ..Readings::default() }
}

fn uniform(random: &mut impl Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * random.random::<f64>()
}

/// `w C A b Y X Z t` with 33 errors: 21 location errors and squarenesses of up to 100 µm and 100″, and 12 error motions
/// as functions of the axes.
#[test]
fn a_five_axis_machine_is_corrected_to_a_picometre() {
    let machine = Arc::new(Machine::from_code("w C A b Y X Z t").unwrap());
    let mut random = rand_pcg::Pcg64::seed_from_u64(3);
    let mut constant = vec![0.0; machine.error_slots()];
    let mut count = 0;
    for (slot, value) in constant.iter_mut().enumerate() {
        let ErrorName { kind, freedom, axis } = machine.error_name(slot);
        let linear = machine.axes[machine.axis_index(&axis).unwrap()].kind == AxisKind::Linear;
        if kind == ErrorKind::Location && (!linear || freedom.is_angle()) {
            *value = uniform(&mut random, -1.0, 1.0) * if freedom.is_angle() { 5e-4 } else { 0.1 };
            count += 1;
        }
    }
    assert_eq!(count, 21);
    let tool_mm = [3.0, -2.0, -120.0];
    let scale = |number: f64| Shape::Polynomial(Polynomial { degree: 2, scale: number });
    let effects = vec![
        effect("EZC", Driver::Axis("C".into()), Shape::Harmonic(Harmonic { order: 2.0 }), &[0.010, -0.004]),
        effect("EAC", Driver::Axis("A".into()), Shape::Harmonic(Harmonic { order: 3.0 }), &[1e-4, 2e-4]),
        effect("EXX", Driver::Axis("X".into()), scale(100.0), &[0.02, -0.01]),
        effect("EYY", Driver::Axis("Y".into()), Shape::Backlash, &[0.006]),
    ];
    // Eight more, proportional to the position of their axis.
    let proportional: Vec<(&str, &str, f64)> = vec![
        ("EYX", "X", 0.007),
        ("EZX", "X", -0.005),
        ("ECX", "X", 4e-5),
        ("EXY", "Y", 0.006),
        ("EAY", "Y", -3e-5),
        ("EZZ", "Z", 0.009),
        ("EXZ", "Z", -0.004),
        ("EBZ", "Z", 5e-5),
    ];
    let mut effects = effects;
    effects.extend(proportional.iter().map(|(id, axis, coefficient)| {
        let line = Shape::Polynomial(Polynomial { degree: 1, scale: 100.0 });
        effect(id, Driver::Axis((*axis).to_string()), line, &[*coefficient])
    }));
    assert_eq!(count + effects.len(), 33);
    let station = Station::between([0.0; 3], tool_mm, 1.0);
    let reference = Reference::default();
    let errors =
        EstimatedErrors { machine: Arc::clone(&machine), station, reference, constant: constant.clone(), effects };
    let correction = Correction { machine: &machine, errors: &errors, tool_mm, aim: Aim::of(&machine) };
    assert_eq!(correction.aim, Aim::PositionAndAxis);
    // The direction of travel of Y is that of the commands.
    let rows = 200;
    let draw = |random: &mut rand_pcg::Pcg64, axis: &Axis| match axis.kind {
        AxisKind::Linear => uniform(random, -200.0, 200.0),
        AxisKind::Rotary if axis.name == "A" => uniform(random, 0.2, 1.5),
        AxisKind::Rotary => uniform(random, -3.0, 3.0),
    };
    let positions: Vec<Vec<f64>> =
        machine.axes.iter().map(|axis| (0..rows).map(|_| draw(&mut random, axis)).collect()).collect();
    let commanded = readings(positions);
    let y = machine.axis_index("Y").unwrap();
    let direction = |row: usize| {
        let column = &commanded.positions[y];
        if row == 0 { (column[1] - column[0]).signum() } else { (column[row] - column[row - 1]).signum() }
    };
    let (c, a, x) =
        (machine.axis_index("C").unwrap(), machine.axis_index("A").unwrap(), machine.axis_index("X").unwrap());
    for (row, found) in correction.correct(&commanded).unwrap().iter().enumerate() {
        assert_eq!(found.state, State::Corrected, "row {row}: {found:?}");
        let actual = |axis: usize, q: &[f64]| {
            let location = std::array::from_fn(|i| constant[12 * axis + i]);
            let mut varying = [0.0; 6];
            if axis == c {
                varying[2] = 0.010 * (2.0 * q[c]).cos() - 0.004 * (2.0 * q[c]).sin();
                varying[3] = 1e-4 * (3.0 * q[a]).cos() + 2e-4 * (3.0 * q[a]).sin();
            } else if axis == x {
                varying[0] = 0.02 * q[x] / 100.0 - 0.01 * (q[x] / 100.0).powi(2);
            } else if axis == y {
                // Lost motion: the axis lags behind its command by half of it.
                varying[1] = -0.5 * 0.006 * direction(row);
            }
            for (id, of, coefficient) in &proportional {
                if machine.axes[axis].name == *of {
                    let place = "XYZABC".find(&id[1..2]).unwrap();
                    varying[place] += coefficient * q[axis] / 100.0;
                }
            }
            (location, varying)
        };
        let nominal: Vec<f64> = commanded.positions.iter().map(|column| column[row]).collect();
        let wanted = tool_in_table(&machine, &nominal, &|_, _| ([0.0; 6], [0.0; 6]));
        let reached = tool_in_table(&machine, &found.positions, &actual);
        let off = (point(&reached, tool_mm) - point(&wanted, tool_mm)).norm();
        let tilt = directions(&reached).column(2).cross(&directions(&wanted).column(2)).norm();
        assert!(off <= 1e-6 && tilt <= 1e-9, "row {row}: {off:e} mm, {tilt:e} rad");
        let before = point(&tool_in_table(&machine, &nominal, &actual), tool_mm) - point(&wanted, tool_mm);
        assert!(before.norm() > 1e-3);
    }
}

fn ur10() -> Machine {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    abbe_files::machine(&folder.join("../sessions/ur10/machine.toml")).unwrap()
}

#[test]
fn a_robot_is_corrected_in_its_whole_pose_and_reaches_poses() {
    let machine = Arc::new(ur10());
    let mut random = rand_pcg::Pcg64::seed_from_u64(5);
    let mut constant = vec![0.0; machine.error_slots()];
    for axis in 0..6 {
        for i in 0..6 {
            constant[12 * axis + i] = uniform(&mut random, -1.0, 1.0) * if i < 3 { 1.0 } else { 2e-3 };
        }
    }
    let tool_mm = [-1184.4, -349.3, 12.2];
    let own = |axis: usize| machine.axes[axis].own_freedom();
    let waves: Vec<[f64; 2]> = (0..6).map(|_| [0; 2].map(|_| uniform(&mut random, -3e-4, 3e-4))).collect();
    let effects = (0..6)
        .map(|axis| {
            let name = ErrorName { kind: ErrorKind::Motion, freedom: own(axis), axis: format!("J{}", axis + 1) };
            let driver = Driver::Axis(format!("J{}", axis + 1));
            effect(&name.to_string(), driver, Shape::Harmonic(Harmonic { order: 17.0 }), &waves[axis])
        })
        .collect();
    let station = Station::between([0.0; 3], tool_mm, 1.0);
    let reference = Reference::default();
    let errors =
        EstimatedErrors { machine: Arc::clone(&machine), station, reference, constant: constant.clone(), effects };
    let correction = Correction { machine: &machine, errors: &errors, tool_mm, aim: Aim::of(&machine) };
    assert_eq!(correction.aim, Aim::Pose);
    let positions: Vec<Vec<f64>> =
        (0..6).map(|_| (0..400).map(|_| uniform(&mut random, -3.0, 3.0)).collect()).collect();
    let commanded = readings(positions);
    let actual = |axis: usize, q: &[f64]| {
        let mut varying = [0.0; 6];
        let [cos, sin] = waves[axis];
        varying[own(axis).index()] = cos * (17.0 * q[axis]).cos() + sin * (17.0 * q[axis]).sin();
        (std::array::from_fn(|i| constant[12 * axis + i]), varying)
    };
    let none: Errors<'_> = &|_, _| ([0.0; 6], [0.0; 6]);
    let mut judged = 0;
    let mut last = vec![0.1; 6];
    for (row, found) in correction.correct(&commanded).unwrap().iter().enumerate() {
        let nominal: Vec<f64> = commanded.positions.iter().map(|column| column[row]).collect();
        let wanted = tool_in_table(&machine, &nominal, none);
        if found.state == State::Corrected {
            judged += 1;
            let reached = tool_in_table(&machine, &found.positions, &actual);
            let off = (point(&reached, tool_mm) - point(&wanted, tool_mm)).norm();
            let turn = (directions(&reached) - directions(&wanted)).norm();
            assert!(off <= 1e-6 && turn <= 2e-9, "row {row}: {off:e} mm, {turn:e} rad");
        } else {
            assert!(matches!(found.state, State::NearSingular | State::NotCorrectable | State::Reduced), "{found:?}");
        }
        if row < 20 {
            let pose = Pose { point_mm: point(&wanted, tool_mm), directions: directions(&wanted) };
            let q = reach::axis_positions(&machine, tool_mm, Aim::Pose, &pose, &last).unwrap();
            let there = tool_in_table(&machine, &q, none);
            assert!((there - wanted).norm() < 1e-6, "row {row}");
            last = q;
        }
    }
    assert!(judged > 360, "{judged}");
    let far = Pose { point_mm: Vector3::new(5000.0, 0.0, 0.0), directions: Matrix3::identity() };
    assert!(reach::axis_positions(&machine, tool_mm, Aim::Pose, &far, &last).is_none());
}

#[test]
fn rows_that_cannot_be_corrected_keep_their_command() {
    let machine = Arc::new(ur10());
    let mut constant = vec![0.0; machine.error_slots()];
    constant[3] = 1e-3;
    let tool_mm = [-1184.4, -349.3, 12.2];
    let station = Station::between([0.0; 3], tool_mm, 1.0);
    let errors = EstimatedErrors {
        machine: Arc::clone(&machine),
        station,
        reference: Reference::default(),
        constant,
        effects: Vec::new(),
    };
    let correction = Correction { machine: &machine, errors: &errors, tool_mm, aim: Aim::Pose };
    // The stretched arm with J5 at 0 is singular; the second row is no number.
    let commanded = readings((0..6).map(|_| vec![0.0, f64::NAN]).collect());
    let found = correction.correct(&commanded).unwrap();
    assert!(matches!(found[0].state, State::NotCorrectable | State::Reduced), "{:?}", found[0]);
    assert!(found[0].remaining_mm > 0.01 && found[0].condition.is_infinite());
    assert!(found[0].state == State::Reduced || found[0].positions == vec![0.0; 6]);
    assert_eq!(found[1].state, State::NotANumber);
}

/// Near a singularity of the wrist: where the machine with its errors reaches the pose within 4° of the command, it is
/// reached, and nowhere more remains than at the command.
#[test]
fn solutions_close_to_a_command_near_a_singularity_are_found() {
    let machine = Arc::new(ur10());
    let mut random = rand_pcg::Pcg64::seed_from_u64(21);
    let mut constant = vec![0.0; machine.error_slots()];
    for axis in 0..6 {
        for freedom in 0..6 {
            let most = if freedom < 3 { 0.3 } else { 5e-4 };
            constant[12 * axis + freedom] = uniform(&mut random, -most, most);
        }
    }
    let tool_mm = [-1184.4, -349.3, 12.2];
    let station = Station::between([0.0; 3], tool_mm, 1.0);
    let errors = EstimatedErrors {
        machine: Arc::clone(&machine),
        station,
        reference: Reference::default(),
        constant: constant.clone(),
        effects: Vec::new(),
    };
    let correction = Correction { machine: &machine, errors: &errors, tool_mm, aim: Aim::Pose };
    // A command whose corrected command is known: the pose that the machine reaches there, by the nominal machine.
    let actual = |axis: usize, _: &[f64]| (std::array::from_fn(|i| constant[12 * axis + i]), [0.0; 6]);
    let mut commands = Vec::new();
    while commands.len() < 60 {
        let mut q: Vec<f64> = (0..6).map(|_| uniform(&mut random, -2.5, 2.5)).collect();
        q[4] = uniform(&mut random, -0.02, 0.02);
        let reached = tool_in_table(&machine, &q, &actual);
        let pose = Pose { point_mm: point(&reached, tool_mm), directions: directions(&reached) };
        let Some(command) = reach::axis_positions(&machine, tool_mm, Aim::Pose, &pose, &q) else { continue };
        if q.iter().zip(&command).all(|(a, b)| (a - b).abs() < 4.0_f64.to_radians()) {
            commands.push(command);
        }
    }
    let commanded = readings((0..6).map(|axis| commands.iter().map(|own| own[axis]).collect()).collect());
    let before = correction.pose_errors(&commanded).unwrap();
    let mut exact = 0;
    for (row, found) in correction.correct(&commanded).unwrap().into_iter().enumerate() {
        let length = before[row][..3].iter().map(|mm| mm * mm).sum::<f64>().sqrt();
        assert!(found.remaining_mm <= length + 1e-9, "row {row}: {found:?} after {length}");
        exact += usize::from(found.remaining_mm < 1e-6 && found.remaining_rad < 1e-9);
    }
    println!("{exact} of {} reached", commands.len());
    assert!(exact >= commands.len() - 2, "{exact} of {}", commands.len());
}

/// Lost motion follows the direction of travel, which a block takes over from the block before.
#[test]
fn blocks_of_a_file_continue_the_travel() {
    let machine = Arc::new(Machine::from_code("w C A b Y X Z t").unwrap());
    let mut random = rand_pcg::Pcg64::seed_from_u64(11);
    let effects = vec![effect("EXX", Driver::Axis("X".into()), Shape::Backlash, &[0.01])];
    let station = Station::between([0.0; 3], [0.0; 3], 1.0);
    let reference = Reference::default();
    let constant = vec![0.0; machine.error_slots()];
    let errors = EstimatedErrors { machine: Arc::clone(&machine), station, reference, constant, effects };
    let correction = Correction { machine: &machine, errors: &errors, tool_mm: [0.0; 3], aim: Aim::of(&machine) };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("commands.csv");
    // Stretches at rest are longer than a block: the direction of travel is that of the last motion.
    let rests = (0..60).flat_map(|_| [random.random_range(-9..9); 10]);
    // A block that begins at rest with nothing before it knows no direction: the file begins with a motion.
    let positions: Vec<i32> = [-20, -10].into_iter().chain(rests).collect();
    let lines: Vec<String> = positions.iter().map(|mm| format!("{mm}\n")).collect();
    std::fs::write(&path, format!("x_mm\n{}", lines.concat())).unwrap();
    let x_mm = |most: usize| -> Vec<f64> {
        let mut file = CommandFile::open(&path, &machine, vec![0.0; 5]).unwrap();
        let blocks = std::iter::from_fn(|| file.next_block(&machine, most).unwrap());
        blocks.flat_map(|block| correction.pose_errors(&block.rows).unwrap()).map(|error| error[0]).collect()
    };
    let whole = x_mm(1000);
    assert!(whole == x_mm(7));
    // Half of it behind the motion.
    let mut direction = 0;
    for (row, pair) in positions.windows(2).enumerate() {
        direction = if pair[1] == pair[0] { direction } else { (pair[1] - pair[0]).signum() };
        if direction != 0 {
            assert!((whole[row + 1] + 0.005 * f64::from(direction)).abs() < 1e-12, "row {row}: {}", whole[row + 1]);
        }
    }
}

/// Three linear axes put the tool where it belongs and leave its tilt as it is: the tilt remains, and is stated.
#[test]
fn an_orientation_that_linear_axes_leave_is_stated() {
    let machine = Arc::new(Machine::from_code("w b Y X Z t").unwrap());
    let tilt = Shape::Polynomial(Polynomial { degree: 1, scale: 100.0 });
    let effects = vec![effect("EBX", Driver::Axis("X".into()), tilt, &[5e-5])];
    let tool_mm = [0.0, 0.0, -150.0];
    let station = Station::between([0.0; 3], tool_mm, 1.0);
    let reference = Reference::default();
    let constant = vec![0.0; machine.error_slots()];
    let errors = EstimatedErrors { machine: Arc::clone(&machine), station, reference, constant, effects };
    let correction = Correction { machine: &machine, errors: &errors, tool_mm, aim: Aim::of(&machine) };
    assert_eq!(correction.aim, Aim::Position);
    let found = correction.correct(&readings(vec![vec![10.0], vec![-80.0], vec![30.0]])).unwrap();
    assert_eq!(found[0].state, State::Corrected);
    assert!(found[0].remaining_mm < 1e-9);
    assert!((found[0].remaining_rad / (5e-5 * 0.8) - 1.0).abs() < 1e-3, "{:e}", found[0].remaining_rad);
}
