//! Where instruments stand and how targets are mounted: against the motions that the readings follow from, and against a
//! closed form of `A X = Y B`.

use std::sync::Arc;

use abbe::identify::fit::frames::SetUpFrame;
use abbe::model::frames::FixedPose;
use nalgebra::{DMatrix, DVector, Matrix3};

use super::*;
use crate::suite::{abbe, text};

/// A pose drawn at random: any rotation of up to a radian about each axis, and a place within a size.
fn drawn(random: &mut Pcg64, size_mm: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(vector(random, 1.0));
    Isometry3::from_parts(Translation3::from(vector(random, size_mm)), turn)
}

/// A session of a robot without errors, the base → instrument and the tool → body transformation of its readings, and what
/// the chain commands in each pose.
struct HandEye {
    session: Session,
    stands: Isometry3<f64>,
    body: Isometry3<f64>,
    commanded: Vec<Isometry3<f64>>,
    random: Pcg64,
}

impl HandEye {
    fn new(kind: Kind, unknowns: &[&str], seed: u64) -> HandEye {
        let folder = tempfile::tempdir().unwrap();
        let mut robot = Simulated::new(UR5E, seed);
        robot.errors.fill(Isometry3::identity());
        let mut session = robot.write(folder.path(), kind, 0.0, as_it_is);
        let known = std::mem::take(&mut session.unknowns);
        session.unknowns = known
            .into_iter()
            .filter(|name| unknowns.contains(&"all") || unknowns.contains(&&*name.to_string()))
            .collect();
        let readings = session.tests[0].readings.clone().unwrap();
        let state = |row: usize| readings.positions.iter().map(|axis| axis[row]).collect::<Vec<f64>>();
        let commanded = (0..POSES).map(|row| robot.carried(&state(row))).collect();
        let mut random = Pcg64::seed_from_u64(1000 + seed);
        let (stands, body) = (drawn(&mut random, 2000.0), drawn(&mut random, 300.0));
        HandEye { session, stands, body, commanded, random }
    }

    /// What the instrument reads in each pose, with noise.
    fn read(&mut self, noise_mm: f64, noise: f64) -> Vec<Isometry3<f64>> {
        let HandEye { stands, body, commanded, random, .. } = self;
        let one = |tool: &Isometry3<f64>| {
            let exact = stands.inverse() * tool * *body;
            let wobble = UnitQuaternion::from_scaled_axis(vector(random, noise));
            let place = Translation3::from(exact.translation.vector + vector(random, noise_mm));
            Isometry3::from_parts(place, wobble * exact.rotation)
        };
        commanded.iter().map(one).collect()
    }

    /// The frames of a fit of these readings.
    fn frames(&mut self, read: &[Isometry3<f64>]) -> Vec<SetUpFrame> {
        let readings = Arc::make_mut(self.session.tests[0].readings.as_mut().unwrap());
        for (row, pose) in readings.observed.chunks_exact_mut(readings.channels).zip(read) {
            let (place, turn) = as_it_is(*pose);
            row.iter_mut().zip(place.into_iter().chain(turn)).for_each(|(cell, value)| *cell = value);
        }
        fitted(&self.session).unwrap().frames
    }
}

/// `Y` and `X` of `A X = Y B` by Kronecker products: the rotations from the singular vectors of `Σ B ⊗ A`, then the places by
/// linear least squares (M. Shah, ASME J. Mech. Robot. 5 (2013) 031007).
fn closed_form(commanded: &[Isometry3<f64>], read: &[Isometry3<f64>]) -> [Isometry3<f64>; 2] {
    let turn = |pose: &Isometry3<f64>| pose.rotation.to_rotation_matrix().into_inner();
    let mut products = DMatrix::<f64>::zeros(9, 9);
    for (a, b) in commanded.iter().zip(read) {
        products += DMatrix::from_column_slice(9, 9, turn(b).kronecker(&turn(a)).as_slice());
    }
    let svd = products.svd(true, true);
    let largest = svd.singular_values.imax();
    let rotation = |nine: Vec<f64>| {
        let found = Matrix3::from_column_slice(&nine);
        let nearest = (found * found.determinant().signum()).svd(true, true);
        UnitQuaternion::from_matrix(&(nearest.u.unwrap() * nearest.v_t.unwrap()))
    };
    let x = rotation(svd.v_t.unwrap().row(largest).iter().copied().collect());
    let y = rotation(svd.u.unwrap().column(largest).iter().copied().collect());
    let mut left = DMatrix::<f64>::zeros(3 * read.len(), 6);
    let mut right = DVector::<f64>::zeros(3 * read.len());
    for (k, (a, b)) in commanded.iter().zip(read).enumerate() {
        // R_A t_X − t_Y = R_Y t_B − t_A
        left.view_mut((3 * k, 0), (3, 3)).copy_from(&turn(a));
        left.view_mut((3 * k, 3), (3, 3)).copy_from(&-Matrix3::identity());
        right.rows_mut(3 * k, 3).copy_from(&(y * b.translation.vector - a.translation.vector));
    }
    let places = left.svd(true, true).solve(&right, 1e-12).unwrap();
    let place = |from: usize| Translation3::new(places[from], places[from + 1], places[from + 2]);
    [Isometry3::from_parts(place(3), y), Isometry3::from_parts(place(0), x)]
}

fn isometry(frame: &SetUpFrame) -> Isometry3<f64> {
    let m = Matrix3::from_fn(|i, j| frame.matrix[i][j]);
    let place = Translation3::new(frame.matrix[0][3], frame.matrix[1][3], frame.matrix[2][3]);
    Isometry3::from_parts(place, UnitQuaternion::from_matrix(&m))
}

fn apart(found: &Isometry3<f64>, expected: &Isometry3<f64>) -> [f64; 2] {
    let between = (found.translation.vector - expected.translation.vector).norm();
    [between, found.rotation.angle_to(&expected.rotation)]
}

/// 20 sets without noise: both transformations, by the matrix, the quaternion and roll, pitch, yaw, in the frame of the flange
/// that the machine states.
#[test]
fn hand_eye_and_base_world_are_those_of_the_readings_and_of_a_closed_form() {
    for seed in 0..20 {
        let mut set = HandEye::new(Kind::Pose, &[], seed);
        let flange = FixedPose { xyz_mm: [-817.2, -233.1, 62.8], rpy_deg: [90.0, -20.0, 10.0] };
        let of_flange = Isometry3::from_parts(
            Translation3::from(Vector3::from(flange.xyz_mm)),
            UnitQuaternion::from_euler_angles(90_f64.to_radians(), -20_f64.to_radians(), 10_f64.to_radians()),
        );
        Arc::make_mut(&mut set.session.machine).flange = (seed % 2 == 1).then_some(flange);
        let in_tool = if seed % 2 == 1 { of_flange.inverse() } else { Isometry3::identity() };
        let read = set.read(0.0, 0.0);
        let found = set.frames(&read);
        let [y, x] = closed_form(&set.commanded, &read);
        let expected = [
            ("base", "instrument", set.stands, y),
            (["tool", "flange"][seed as usize % 2], "body", in_tool * set.body, in_tool * x),
        ];
        assert_eq!(found.len(), 2);
        for (frame, (parent, child, truth, closed)) in found.iter().zip(expected) {
            assert_eq!((frame.parent.as_str(), frame.child.as_str()), (parent, child));
            let pose = isometry(frame);
            let [mm, rad] = apart(&pose, &truth);
            assert!(mm < 1e-6 && rad < 1e-9, "{seed}, {child}: {mm:e} mm, {rad:e} rad");
            let [mm, rad] = apart(&pose, &closed);
            assert!(mm < 1e-6 && rad < 1e-9, "{seed}, {child}, closed form: {mm:e} mm, {rad:e} rad");
            let [i, j, k, w] = frame.quaternion_xyzw;
            let quaternion = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k));
            let [roll, pitch, yaw] = frame.rpy_deg.map(f64::to_radians);
            let by_angles = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
            assert!(
                w >= 0.0 && quaternion.angle_to(&truth.rotation) < 1e-9 && by_angles.angle_to(&truth.rotation) < 1e-9
            );
            assert_eq!(frame.xyz_mm, [0, 1, 2].map(|row| frame.matrix[row][3]));
        }
    }
}

/// The standard uncertainties are the scatter of the estimates over draws of the noise: of an instrument that reads poses and of
/// a tracker, with no error of the joints, with some and with all. With all of them the poses are relative to the held ones.
#[test]
fn the_uncertainty_of_a_frame_is_the_scatter_of_its_estimates() {
    const DRAWS: usize = 400;
    let some: &[&str] = &["EB0J2", "EB0J3", "EB0J4", "EC0J5", "EZ0J3"];
    for (kind, unknowns) in [(Kind::Pose, &[][..]), (Kind::Pose, some), (Kind::Tracker, some), (Kind::Pose, &["all"])] {
        let mut set = HandEye::new(kind, unknowns, 3);
        let read = set.read(0.0, 0.0);
        let exact = set.frames(&read);
        let mut squares = vec![[0.0; 9]; exact.len()];
        for _ in 0..DRAWS {
            let read = set.read(NOISE_MM, NOISE);
            for ((sum, frame), exact) in squares.iter_mut().zip(set.frames(&read)).zip(&exact) {
                let (found, expected) = (isometry(&frame), isometry(exact));
                let shift = found.translation.vector - expected.translation.vector;
                let turn = (found.rotation * expected.rotation.inverse()).scaled_axis().map(f64::to_degrees);
                for k in 0..3 {
                    let angle = frame.rpy_deg[k] - exact.rpy_deg[k];
                    for (place, change) in [(k, shift[k]), (3 + k, turn[k]), (6 + k, angle)] {
                        sum[place] += change * change / DRAWS as f64;
                    }
                }
            }
        }
        let mut ratios = Vec::new();
        for (sum, frame) in squares.iter().zip(&exact) {
            let all = [frame.u_xyz_mm, frame.u_rotation_deg, frame.u_rpy_deg].concat();
            let known = all.iter().zip(sum).filter_map(|(u, square)| Some((*u)? / square.sqrt()));
            ratios.extend(known);
            let relative = frame.relative_to.join(" ");
            println!("{kind:?} {unknowns:?} {} {}: {relative}", frame.parent, frame.child);
            assert_eq!(relative.contains("J1") || relative.contains("J6"), unknowns.contains(&"all"), "{relative}");
        }
        println!("{kind:?} {unknowns:?}: {ratios:.3?}");
        assert_eq!(ratios.len(), if kind == Kind::Tracker { 12 } else { 18 });
        // The scatter of 400 draws is known to 3.5 %.
        assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.12), "{kind:?} {unknowns:?}: {ratios:.3?}");
        for three in ratios.chunks(3) {
            let pooled = (three.iter().map(|ratio| ratio * ratio).sum::<f64>() / 3.0).sqrt();
            assert!((pooled - 1.0).abs() < 0.1, "{kind:?} {unknowns:?}: {ratios:.3?}");
        }
    }
}

/// A target on the axis of the last joint, which alone turns: no reading depends on where on the axis it is, or on how the
/// instrument stands about it. There is no value then.
#[test]
fn what_the_readings_leave_open_has_no_uncertainty() {
    let mut set = HandEye::new(Kind::Pose, &[], 5);
    let readings = Arc::make_mut(set.session.tests[0].readings.as_mut().unwrap());
    for axis in &mut readings.positions[..5] {
        axis.fill(0.3);
    }
    let state = |row: usize| readings.positions.iter().map(|axis| axis[row]).collect::<Vec<f64>>();
    let robot = {
        let mut robot = Simulated::new(UR5E, 5);
        robot.errors.fill(Isometry3::identity());
        robot
    };
    set.commanded = (0..POSES).map(|row| robot.carried(&state(row))).collect();
    let read = set.read(0.0, 0.0);
    for frame in set.frames(&read) {
        assert!(frame.u_xyz_mm.contains(&None) && frame.u_rotation_deg.contains(&None), "{frame:?}");
    }
}

fn success(arguments: &[&str]) -> String {
    let done = abbe(arguments);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).unwrap()
}

/// The command: the frames are in the first lines, and the static transform is that of the matrix.
#[test]
fn a_fit_opens_with_the_frames_and_exports_them_for_ros() {
    let folder = tempfile::tempdir().unwrap();
    let [model, json, out] = ["model.json", "fit.json", "frames.sh"].map(|name| folder.path().join(name));
    let session = ready("pose/session.toml");
    let shown = success(&["fit", text(&session), "--save", text(&model), "--json", text(&json)]);
    let line = shown.lines().position(|line| line.contains("base → instrument")).unwrap();
    assert!(line < 12, "{shown}");
    success(&["export", text(&model), "--as", "ros", "--out", text(&out)]);
    let result: serde_json::Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    let exported = fs::read_to_string(out).unwrap();
    let commands: Vec<&str> = exported.lines().filter(|line| line.starts_with("ros2")).collect();
    let frames = result["frames"].as_array().unwrap();
    assert_eq!((commands.len(), frames.len()), (2, 2));
    for (command, frame) in commands.iter().zip(frames) {
        let value = |option: &str| {
            let mut words = command.split(' ').skip_while(|word| *word != option);
            words.nth(1).unwrap().to_string()
        };
        let number = |option: &str| value(option).parse::<f64>().unwrap();
        let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            number("--qw"),
            number("--qx"),
            number("--qy"),
            number("--qz"),
        ));
        let turn = turn.to_rotation_matrix();
        for i in 0..3 {
            let row = |j: usize| frame["matrix"][i][j].as_f64().unwrap();
            assert!((1e3 * number(["--x", "--y", "--z"][i]) - row(3)).abs() < 1e-6);
            assert!((0..3).all(|j| (turn[(i, j)] - row(j)).abs() < 1e-10));
        }
        assert_eq!(
            (value("--frame-id"), value("--child-frame-id")),
            (frame["parent"].as_str().unwrap().into(), frame["child"].as_str().unwrap().into())
        );
    }
}
