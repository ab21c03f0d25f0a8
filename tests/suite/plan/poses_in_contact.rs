//! `abbe poses` for sockets and probes: every pose meets the instrument's condition by the chain of the
//! independent simulator, and simulated readings have the predicted uncertainty.

use abbe::files::{self, ReadOptions};
use abbe::identify::fit;
use abbe::model::instrument::Station;
use abbe::model::session::readings::Readings;
use abbe::model::session::{Prior, Session, Test};
use abbe::plan::design::Goal;
use abbe::plan::poses::candidates::PoseLimits;
use abbe::plan::poses::{PoseOptions, PoseSelection, measured_by, select};
use nalgebra::{DMatrix, DVector, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use serde_json::Value;

use crate::plant::pose::{Axis, Joint, Pose};
use crate::suite::{abbe, ready, text};

const DRAWS: usize = 200;
/// Largest distance from socket or surface, mm.
const CONTACT_MM: f64 = 1e-6;

fn session(name: &str) -> Session {
    let reading = ReadOptions { read_data: false, ..ReadOptions::default() };
    files::session(&ready(name), &reading).unwrap()
}

fn options(poses: usize, noise_mm: f64) -> PoseOptions {
    PoseOptions {
        poses,
        goal: Goal::WorstUncertainty,
        candidates: 1000,
        seed: 1,
        limits: PoseLimits::default(),
        noise_mm: Some(noise_mm),
    }
}

/// The motion of consecutive axes by the simulator's quaternions; positions in mm and rad.
fn chain(axes: &[(Joint, [f64; 3], [f64; 3])], positions: &[f64]) -> Pose {
    axes.iter().zip(positions).fold(Pose::identity(), |pose, ((joint, direction, origin), q)| {
        let axis = Axis { joint: *joint, direction: Vector3::from(*direction), origin_mm: Vector3::from(*origin) };
        pose.then_inner(axis.motion(*q, &[0.0; 6], &[0.0; 6]))
    })
}

/// The joints of the KUKA LBR iiwa 14 R820, from the base: 360, 420 and 400 mm between shoulder, elbow and wrist.
fn kuka_ball(joints: &[f64], ball_mm: Vector3<f64>) -> Vector3<f64> {
    let [z, y, back] = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]];
    let axes = [(z, 0.0), (y, 360.0), (z, 360.0), (back, 780.0), (z, 780.0), (y, 1180.0), (z, 1180.0)]
        .map(|(direction, height)| (Joint::Rotary, direction, [0.0, 0.0, height]));
    chain(&axes, joints).apply(ball_mm)
}

fn radians(pose: &[f64]) -> Vec<f64> {
    pose.iter().map(|q| q.to_radians()).collect()
}

/// The scatter of estimates over the predicted uncertainties, with the mean of the squares over the draws.
fn assert_predicted(squares: &[f64], found: &PoseSelection) {
    let sampling = 1.0 / (2.0 * DRAWS as f64).sqrt();
    let scatter = squares.iter().map(|square| (square / DRAWS as f64).sqrt());
    let ratios: Vec<f64> = scatter.zip(&found.uncertainties).map(|(scatter, error)| scatter / error.u).collect();
    println!("scatter over predicted u: {ratios:.3?}, sampling error {sampling:.3}");
    for (ratio, error) in ratios.iter().zip(&found.uncertainties) {
        assert!((ratio - 1.0).abs() < 4.0 * sampling, "{}: {ratio}", error.id);
    }
}

/// Adds the squares of the estimates of one draw.
fn add_squares(session: Session, found: &PoseSelection, squares: &mut [f64]) {
    let (problem, fitted) = fit::prepare(&session, 1).unwrap();
    let parameters = fit::parameters(&problem, &fitted);
    for (square, error) in squares.iter_mut().zip(&found.uncertainties) {
        let value = parameters.iter().find(|parameter| parameter.id == error.id).unwrap().value;
        *square += value * value;
    }
}

/// Holds what the selection holds, and keeps the tests with poses.
fn as_predicted(mut session: Session, found: &PoseSelection, noise_mm: f64) -> Session {
    session.unknowns.retain(|name| found.uncertainties.iter().any(|error| error.id == name.to_string()));
    session.noise_mm = Some(noise_mm);
    session.tests.retain(|test| found.tests.contains(&test.name));
    for test in &mut session.tests {
        let unknowns = test.station.kind().unknowns();
        for (prior, unknown) in test.priors.iter_mut().zip(unknowns) {
            let id = format!("{}.{}[", unknown.thing, unknown.coordinate);
            if found.held.iter().any(|held| held.starts_with(&id)) {
                *prior = Prior::Known;
            }
        }
    }
    session
}

fn kuka_poses() -> (Session, PoseSelection) {
    let session = session("kuka-iiwa14/session.toml");
    let found = select(&session, &measured_by(&session, None), &options(60, 0.1)).unwrap();
    (session, found)
}

#[test]
fn the_ball_is_in_a_socket_at_every_pose() {
    let (session, found) = kuka_poses();
    println!("{}: {:.3}, random {:.3}; held {:?}", found.criterion, found.value, found.random_median, found.held);
    assert!(found.value < 0.6 * found.random_median, "{} of {}", found.value, found.random_median);
    assert_eq!(found.poses.len(), 60);
    let limits = [170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 175.0];
    for ((pose, socket), test) in found.poses.iter().zip(&found.sockets).zip(&found.tests) {
        assert!(pose.iter().zip(limits).all(|(q, limit)| q.abs() <= limit), "{pose:?}");
        assert_eq!(socket, test);
        let wanted = match socket.as_str() {
            "front0" => [551.0, -26.0, 9.0],
            "front1" => [551.0, 24.0, 9.0],
            "left_back0" => [300.0, -451.0, 9.0],
            "left_back1" => [300.0, -401.0, 9.0],
            "raised_left0" => [437.0, -232.0, 506.0],
            "raised_left1" => [437.0, -232.0, 556.0],
            other => panic!("{other}"),
        };
        let ball = kuka_ball(&radians(pose), Vector3::new(0.0, 0.0, 1346.7));
        let distance = (ball - Vector3::from(wanted)).norm();
        assert!(distance < CONTACT_MM, "{socket}: {distance} mm");
    }
    let mut sockets = found.sockets.clone();
    sockets.sort();
    sockets.dedup();
    assert!(sockets.len() >= 3, "{sockets:?}");
    assert_eq!(session.tests.len(), 6);
}

/// The robot is guided until its ball is in the socket, less the noise: joints that the simulator's chain tells.
#[test]
fn socket_uncertainties_are_those_of_simulated_poses() {
    const NOISE_MM: f64 = 0.1;
    let (session, found) = kuka_poses();
    let session = as_predicted(session, &found, NOISE_MM);
    let ball = Vector3::new(0.0, 0.0, 1346.7);
    // The pseudoinverse of the simulator's differences, once per pose.
    let inverse = |joints: &[f64]| -> DMatrix<f64> {
        let step = 1e-6;
        let here = kuka_ball(joints, ball);
        let column = |k: usize| -> Vector3<f64> {
            let mut other = joints.to_vec();
            other[k] += step;
            (kuka_ball(&other, ball) - here) / step
        };
        let columns: Vec<Vector3<f64>> = (0..7).map(column).collect();
        DMatrix::from_fn(3, 7, |i, k| columns[k][i]).pseudo_inverse(1e-9).unwrap()
    };
    let known: Vec<(&String, Vec<f64>, DMatrix<f64>)> = found
        .tests
        .iter()
        .zip(&found.poses)
        .map(|(test, pose)| (test, radians(pose), inverse(&radians(pose))))
        .collect();
    let moved = |joints: &[f64], inverse: &DMatrix<f64>, by: Vector3<f64>| -> Vec<f64> {
        let goal = kuka_ball(joints, ball) + by;
        let mut q = DVector::from_column_slice(joints);
        for _ in 0..3 {
            let rest = goal - kuka_ball(q.as_slice(), ball);
            q += inverse * DVector::from_column_slice(rest.as_slice());
        }
        q.as_slice().to_vec()
    };
    let mut random = Pcg64::seed_from_u64(7);
    let mut squares = vec![0.0; found.uncertainties.len()];
    for _ in 0..DRAWS {
        let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
        let mut drawn = session.clone();
        // Distances as a caliper tells them.
        drawn.socket_distances.iter_mut().for_each(|known| known.distance_mm = 50.0 + known.u_mm * noise());
        let readings = session.tests.iter().map(|test| {
            let own = known.iter().filter(|(name, ..)| **name == test.name);
            let noisy = |(_, joints, inverse): &(&String, Vec<f64>, DMatrix<f64>)| {
                moved(joints, inverse, Vector3::from_fn(|_, _| NOISE_MM * noise()))
            };
            let poses: Vec<Vec<f64>> = own.map(noisy).collect();
            Readings {
                positions: (0..7).map(|axis| poses.iter().map(|pose| pose[axis]).collect()).collect(),
                channels: 3,
                observed: vec![0.0; 3 * poses.len()],
                ..Readings::default()
            }
        });
        let readings: Vec<Readings> = readings.collect();
        add_squares(drawn.with_readings(readings), &found, &mut squares);
    }
    assert_predicted(&squares, &found);
}

/// The stylus in the frame of the table of `w C B b Y X Z t`, and the direction `n` of R there.
fn on_table(pose: &[f64], n: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let [c, b, y, x, z] = [pose[0].to_radians(), pose[1].to_radians(), pose[2], pose[3], pose[4]];
    let turned = [(Joint::Rotary, [0.0, 1.0, 0.0], [0.0; 3]), (Joint::Rotary, [0.0, 0.0, -1.0], [0.0; 3])];
    let back = chain(&turned, &[b, c]).turn.inverse();
    (back * Vector3::new(x, y, z), back * n)
}

#[test]
fn the_probe_touches_the_cylinder_at_every_pose() {
    let session = session("self-calibration/session.toml");
    let limits = PoseLimits { height_mm: [-20.0, 10.0], ..PoseLimits::default() };
    let found = select(&session, &measured_by(&session, None), &PoseOptions { limits, ..options(12, 1e-3) }).unwrap();
    println!("{}: {:.3}, random {:.3}; held {:?}", found.criterion, found.value, found.random_median, found.held);
    assert!(found.value < 0.9 * found.random_median, "{} of {}", found.value, found.random_median);
    assert_eq!(found.columns, ["c_deg", "b_deg", "y_mm", "x_mm", "z_mm"]);
    assert!(found.tests.iter().all(|test| test == "3") && found.sockets.is_empty());
    for pose in &found.poses {
        let (stylus, _) = on_table(pose, Vector3::zeros());
        assert!((stylus.xy().norm() - 45.0).abs() < CONTACT_MM, "{stylus}");
        assert!((-20.0 - CONTACT_MM..=10.0 + CONTACT_MM).contains(&stylus.z), "{stylus}");
    }
}

/// With a stated direction the probe comes from outside, at 60° from the normal at most.
#[test]
fn the_probe_comes_from_its_direction() {
    let mut session = session("self-calibration/session.toml");
    let direction = Vector3::new(-0.6, 0.0, -0.8);
    for test in &mut session.tests {
        let Station::Probe(probe) = &mut test.station else { panic!("no probe") };
        probe.direction = Some(direction.into());
    }
    let found = select(&session, &measured_by(&session, Some("2")), &options(12, 1e-3)).unwrap();
    for pose in &found.poses {
        let (stylus, ahead) = on_table(pose, direction);
        assert!((stylus.xy().norm() - 45.0).abs() < CONTACT_MM && stylus.z.abs() < CONTACT_MM, "{stylus}");
        let cosine = -stylus.xy().dot(&ahead.xy()) / 45.0;
        assert!(cosine >= 0.5, "{cosine}");
    }
}

/// The probe reads the distance to the surface, which is nominally zero, with its noise.
#[test]
fn probe_uncertainties_are_those_of_simulated_readings() {
    const NOISE_MM: f64 = 1e-3;
    let session = session("self-calibration/session.toml");
    let found = select(&session, &measured_by(&session, None), &options(12, NOISE_MM)).unwrap();
    let session = as_predicted(session, &found, NOISE_MM);
    let kinds: Vec<bool> =
        session.machine.axes.iter().map(|axis| axis.name.len() == 1 && "ABC".contains(&axis.name)).collect();
    let positions: Vec<Vec<f64>> = (0..5)
        .map(|axis| {
            found.poses.iter().map(|pose| if kinds[axis] { pose[axis].to_radians() } else { pose[axis] }).collect()
        })
        .collect();
    let mut random = Pcg64::seed_from_u64(9);
    let mut squares = vec![0.0; found.uncertainties.len()];
    for _ in 0..DRAWS {
        let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
        let observed = found.poses.iter().map(|_| NOISE_MM * noise()).collect();
        let readings = Readings { positions: positions.clone(), channels: 1, observed, ..Readings::default() };
        add_squares(session.clone().with_readings([readings]), &found, &mut squares);
    }
    assert_predicted(&squares, &found);
}

/// A table and the stem of the tool: no pose brings the stem under the table.
#[test]
fn poses_clear_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let machine = std::fs::read_to_string(ready("kuka-iiwa14/machine.toml")).unwrap();
    let bodies = "\n[[body]]\nname = \"table\"\nbox_mm = [[-900, -900, -60], [900, 900, -20]]\n\
                  [[body]]\nname = \"stem\"\naxis = \"J7\"\n\
                  capsule = { from_mm = [0, 0, 1320], to_mm = [0, 0, 1190], radius_mm = 10 }\n";
    std::fs::write(folder.path().join("machine.toml"), machine + bodies).unwrap();
    let place = folder.path().join("session.toml");
    std::fs::copy(ready("kuka-iiwa14/session.toml"), &place).unwrap();
    let reading = ReadOptions { read_data: false, ..ReadOptions::default() };
    let session = files::session(&place, &reading).unwrap();
    let tests: Vec<&Test> = measured_by(&session, Some("front0"));
    let found = select(&session, &tests, &PoseOptions { candidates: 200, ..options(40, 0.1) }).unwrap();
    let free = select(
        &self::session("kuka-iiwa14/session.toml"),
        &tests,
        &PoseOptions { candidates: 200, ..options(40, 0.1) },
    );
    assert!(found.excluded > free.unwrap().excluded);
    for pose in &found.poses {
        for along in [1320.0, 1255.0, 1190.0] {
            let point = kuka_ball(&radians(pose), Vector3::new(0.0, 0.0, along));
            let beside = point.x.abs() > 900.0 || point.y.abs() > 900.0;
            assert!(point.z > -10.0 || point.z < -70.0 && beside, "{point}");
        }
    }
}

#[test]
fn the_command_names_sockets_and_says_what_is_out_of_reach() {
    let folder = tempfile::tempdir().unwrap();
    let [csv, json, plan] = ["poses.csv", "poses.json", "session.toml"].map(|name| folder.path().join(name));
    let kuka = ready("kuka-iiwa14/session.toml");
    let few = ["--poses", "40", "--candidates", "300", "--criterion", "d", "--noise-um", "100"];
    let asked = ["poses", text(&kuka), "--out", text(&csv), "--json", text(&json)];
    let run = abbe(&[&asked[..], &few].concat());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let shown = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(shown.contains("front0") && shown.contains("socket"), "{shown}");
    let written = std::fs::read_to_string(&csv).unwrap();
    assert_eq!(written.lines().next(), Some("j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,j7_deg,socket"));
    assert_eq!(written.lines().count(), 41);
    let found: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert_eq!(found["sockets"].as_array().unwrap().len(), 40);
    assert_eq!(found["tests"], found["sockets"]);
    assert_eq!((&found["noise_um"], &found["noise_source"]), (&100.0.into(), &"stated".into()));

    // The poses are the data of a session, and their sockets have places.
    std::fs::copy(ready("kuka-iiwa14/machine.toml"), folder.path().join("machine.toml")).unwrap();
    let head =
        "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"socket\"\n[unknowns]\nerrors = [\"E?0J2\"]\n";
    let test = "[[test]]\nname = \"all\"\ndata = \"poses.csv\"\nball_mm = [0, 0, 1346.7]\nball_u_um = inf\n";
    let run = |test: &str, more: &[&str]| {
        std::fs::write(&plan, format!("{head}{test}")).unwrap();
        let output = abbe(&[&["poses", text(&plan), "--poses", "12", "--candidates", "100"][..], more].concat());
        let message = String::from_utf8_lossy(&output.stderr).replace('\n', " ");
        (output.status.code(), message.split_whitespace().collect::<Vec<_>>().join(" "))
    };
    let (code, message) = run(test, &["--noise-um", "100"]);
    assert_eq!(code, Some(0), "{message}");

    let single = "[[test]]\nname = \"one\"\ndata = \"none.csv\"\nball_mm = [0, 0, 1346.7]\n";
    for (more, expected) in [
        (
            "socket = \"a\"\nsocket_mm = [5000, 0, 0]\n",
            "none of 1000 drawn poses brings the ball into the socket at (5000.0, 0.0, 0.0) mm",
        ),
        ("socket = \"a\"\n", "test \"one\" states no `socket_mm`, and its data do not tell where its socket is"),
        ("socket_mm = [500, 0, 0]\n", "`socket_mm` without the name of the socket"),
        ("socket = \"a\"\nsocket_mm = [500, 0]\n", "socket_mm"),
        ("socket = \"a\"\nsocket_mm = [nan, 0, 0]\n", "socket_mm"),
    ] {
        let (code, message) = run(&format!("{single}{more}"), &[]);
        assert_eq!(code, Some(1), "{message}");
        assert!(message.contains(expected), "{expected}: {message}");
    }
    // Joints without travel.
    let machine = std::fs::read_to_string(ready("kuka-iiwa14/machine.toml")).unwrap();
    let kept = machine.lines().filter(|line| !line.starts_with("travel_deg"));
    std::fs::write(folder.path().join("machine.toml"), kept.map(|line| format!("{line}\n")).collect::<String>())
        .unwrap();
    // One socket of two out of reach.
    let far = "socket = \"a\"\nsocket_mm = [5000, 0, 0]\n";
    let near = "[[test]]\nname = \"two\"\ndata = \"none.csv\"\nball_mm = [0, 0, 1346.7]\n\
                socket = \"b\"\nsocket_mm = [500, 0, 300]\n";
    let (code, message) = run(&format!("{single}{far}{near}"), &[]);
    assert_eq!(code, Some(0), "{message}");
    assert!(message.contains("test `one`: no drawn pose brings the ball into the socket"), "{message}");
    assert!(message.contains("no travel is stated of `J1`, `J2`"), "{message}");
}

/// A robot has no linear axes that place the balls or the stylus: its joints do.
#[test]
fn robots_hold_a_bar_and_touch_a_cylinder() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(ready("ur10/machine.toml"), folder.path().join("machine.toml")).unwrap();
    let place = folder.path().join("session.toml");
    let head = "[machine]\nfile = \"machine.toml\"\n[unknowns]\nerrors = [\"EB0J2\", \"EX0J2\", \"EB0J3\"]\n";
    let bar = "kind = \"ballbar\"\n[[test]]\nname = \"A\"\ndata = \"A.csv\"\nbar_mm = 200\n\
               workpiece_ball_mm = [500, 200, 200]\nspindle_ball_mm = [0, 0, 100]\n";
    let probe = "kind = \"probe\"\n[[test]]\nname = \"A\"\ndata = \"A.csv\"\nradius_mm = 50\n\
                 artefact_mm = [500, 200, 200]\nstylus_mm = [0, 0, 100]\n";
    for (instrument, length, is_probe) in [(bar, 200.0, false), (probe, 50.0, true)] {
        std::fs::write(&place, format!("{head}[instrument]\n{instrument}")).unwrap();
        let reading = ReadOptions { read_data: false, ..ReadOptions::default() };
        let session = files::session(&place, &reading).unwrap();
        let joints: Vec<(Joint, [f64; 3], [f64; 3])> =
            session.machine.axes.iter().map(|axis| (Joint::Rotary, axis.direction, axis.origin_mm)).collect();
        let found = select(&session, &measured_by(&session, None), &options(20, 0.02)).unwrap();
        for pose in &found.poses {
            let tool = chain(&joints, &radians(pose)).apply(Vector3::new(0.0, 0.0, 100.0));
            let mut apart = tool - Vector3::new(500.0, 200.0, 200.0);
            if is_probe {
                assert!(apart.z.abs() < CONTACT_MM, "{apart}");
                apart.z = 0.0;
            }
            assert!((apart.norm() - length).abs() < CONTACT_MM, "{apart}");
        }
    }
    // Out of reach.
    std::fs::write(&place, format!("{head}[instrument]\n{}", probe.replace("500, 200", "5000, 200"))).unwrap();
    let output = abbe(&["poses", text(&place), "--poses", "5"]);
    let message = String::from_utf8_lossy(&output.stderr).replace('\n', " ");
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("none of 1000 drawn poses makes the probe touch the cylinder"), "{message}");
}
