//! Instruments that stand beside the machine, tracker and camera system: readings at large errors, and the estimates over
//! simulated sessions of a robot.

use abbe::model::instrument::pose::Pose as PoseStation;
use abbe::model::instrument::stand::Stand;
use abbe::model::instrument::tracker::Tracker;

use super::scatter::assert_standard;
use super::*;
use crate::plant::pose::turn_about;

/// A pose with any rotation and a position within a size.
fn any_pose(random: &mut Pcg64, size_mm: f64) -> Pose {
    let vector = Vector3::from_fn(|_, _| uniform(random, 1.5));
    Pose { turn: UnitQuaternion::from_scaled_axis(vector), shift_mm: Vector3::from_fn(|_, _| uniform(random, size_mm)) }
}

/// Azimuth and elevation of a point.
fn angles(point: Vector3<f64>) -> [f64; 2] {
    [point.y.atan2(point.x), point.z.atan2(point.x.hypot(point.y))]
}

/// Errors of a millimetre and of a milliradian on every axis and on the set-up, read in a frame that is turned by any
/// rotation.
#[test]
fn readings_beside_the_machine_are_those_of_the_plant() {
    let mut random = Pcg64::seed_from_u64(45);
    for code in ["wCAbYXZt", "wXbYZBCt", "wbXYZt", "wYXAbZBt"] {
        let (machine, chain) = (Machine::from_code(code).unwrap(), Chain::from_code(code));
        for _ in 0..50 {
            let large = Large::drawn(&machine, &chain, &mut random);
            let stand = any_pose(&mut random, 500.0);
            // A few metres away, so that the line of sight is never vertical.
            let stand = Pose { shift_mm: stand.shift_mm + Vector3::new(4000.0, 0.0, 0.0), ..stand };
            let target: [f64; 3] = std::array::from_fn(|_| uniform(&mut random, 200.0));
            // On any body of the machine.
            let (frame, carrier) = large.frames[random.random_range(0..large.frames.len())];
            let model = Stand {
                rotation: std::array::from_fn(|i| std::array::from_fn(|j| stand.turn.to_rotation_matrix()[(i, j)])),
                origin: stand.shift_mm.into(),
            };
            let off = Pose::displaced(&std::array::from_fn(|k| large.unknowns[k]));
            let tool = stand.then_inner(off).then_inner(carrier[1]);
            let seen = tool.apply(large.moved(target, 6));
            let target = Target { frame, mm: target };
            let tracker = |is_polar| Station::Tracker(Tracker { target, stand: model.clone(), is_polar });
            near(&large.read(&tracker(false)), seen.as_slice(), "tracker");

            let polar = tracker(true);
            let mut columns = vec![seen.norm()];
            columns.extend(angles(seen));
            polar.channels_of_columns(&machine, &large.state, &mut columns);
            near(&large.read(&polar), &columns, "polar tracker");
            polar.columns_of_channels(&machine, &large.state, &mut columns);
            let back = columns[0]
                * Vector3::new(
                    columns[2].cos() * columns[1].cos(),
                    columns[2].cos() * columns[1].sin(),
                    columns[2].sin(),
                );
            assert!((back - seen).norm() < 1e-9, "{back} {seen}");

            // The orientation of the body at the tool is no part of its reading.
            let turn = any_pose(&mut random, 0.0).turn;
            let pose = Station::Pose(PoseStation { target, stand: model, turn: Some(turn) });
            let about = |direction: Vector3<f64>, k: usize| turn_about(direction, large.unknowns[9 + k]);
            let small = about(Vector3::x(), 0) * about(Vector3::y(), 1) * about(Vector3::z(), 2);
            let observed = tool.turn * small * turn;
            let mut columns = seen.as_slice().to_vec();
            columns.extend(observed.scaled_axis().as_slice());
            pose.channels_of_columns(&machine, &large.state, &mut columns);
            near(&large.read(&pose), &columns, "pose");
            pose.columns_of_channels(&machine, &large.state, &mut columns);
            let back = UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(&columns[3..]));
            assert!(back.angle_to(&observed) < 1e-7);
        }
    }
}

/// A robot of six joints.
const ROBOT: &str = r#"
[machine]
name = "Robot"
chain = "w b J1 J2 J3 J4 J5 J6 t"
axis.J1 = { kind = "rotary", direction = [0, 0, 1], origin_mm = [0, 0, 0] }
axis.J2 = { kind = "rotary", direction = [0, 1, 0], origin_mm = [150, 0, 500] }
axis.J3 = { kind = "rotary", direction = [0, 1, 0], origin_mm = [150, 0, 1200] }
axis.J4 = { kind = "rotary", direction = [1, 0, 0], origin_mm = [150, 0, 1300] }
axis.J5 = { kind = "rotary", direction = [0, 1, 0], origin_mm = [850, 0, 1300] }
axis.J6 = { kind = "rotary", direction = [1, 0, 0], origin_mm = [950, 0, 1300] }
"#;

fn robot() -> Chain {
    let link = |(letter, direction, origin_mm): (char, Vector3<f64>, [f64; 3])| Link {
        letter,
        axis: Axis { joint: Joint::Rotary, direction, origin_mm: Vector3::from(origin_mm) },
    };
    let links = [
        ('1', Vector3::z(), [0.0, 0.0, 0.0]),
        ('2', Vector3::y(), [150.0, 0.0, 500.0]),
        ('3', Vector3::y(), [150.0, 0.0, 1200.0]),
        ('4', Vector3::x(), [150.0, 0.0, 1300.0]),
        ('5', Vector3::y(), [850.0, 0.0, 1300.0]),
        ('6', Vector3::x(), [950.0, 0.0, 1300.0]),
    ];
    Chain { workpiece_side: Vec::new(), tool_side: links.into_iter().map(link).collect() }
}

/// The errors of the robot in these tests, with their sizes: index errors of joints in minutes of arc, a link that is
/// half a millimetre too long.
const OF_ROBOT: [(&str, f64); 5] =
    [("EB0J2", 300.0), ("EB0J3", 300.0), ("EA0J4", 300.0), ("EB0J5", 300.0), ("EZ0J3", 500.0)];

/// Poses of the robot and what an instrument anywhere reads of a body at its tool, by a writer of one row.
fn robot_data(
    random: &mut Pcg64,
    header: &str,
    row: impl Fn(Pose, UnitQuaternion<f64>, &mut Pcg64) -> String,
) -> (String, Vec<(&'static str, f64)>) {
    let chain = robot();
    let truth: Vec<(&'static str, f64)> = OF_ROBOT.iter().map(|(id, size)| (*id, uniform(random, *size))).collect();
    let errors = |letter: char| {
        let mut location = [0.0; 6];
        let on = |id: &str| truth.iter().find(|(other, _)| *other == id).map_or(0.0, |(_, value)| *value);
        match letter {
            '2' => location[4] = on("EB0J2") * ARCSECOND,
            '3' => (location[2], location[4]) = (on("EZ0J3") * 1e-3, on("EB0J3") * ARCSECOND),
            '4' => location[3] = on("EA0J4") * ARCSECOND,
            '5' => location[4] = on("EB0J5") * ARCSECOND,
            _ => {}
        }
        [location, [0.0; 6]]
    };
    let (stand, body) = (any_pose(random, 300.0), any_pose(random, 0.0).turn);
    let stand = Pose { shift_mm: stand.shift_mm + stand.turn * Vector3::new(-3500.0, 400.0, -600.0), ..stand };
    let mut data = format!("j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,{header}\n");
    for _ in 0..50 {
        let joints: Vec<f64> = [90.0, 40.0, 40.0, 120.0, 90.0, 170.0]
            .iter()
            .map(|most| (uniform(random, *most) * 1e4).round() / 1e4)
            .collect();
        let position = |letter: char| joints[letter as usize - '1' as usize].to_radians();
        let tool = stand.then_inner(State::of(&chain, &position, &errors).tool[1]);
        let cells: Vec<String> = joints.iter().map(f64::to_string).collect();
        data += &format!("{},{}\n", cells.join(","), row(tool, body, random));
    }
    (data, truth)
}

/// Noise of an orientation: a small rotation about a random axis.
fn jittered(turn: UnitQuaternion<f64>, arcsec: f64, random: &mut Pcg64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| arcsec * ARCSECOND * normal(random))) * turn
}

const TARGET_MM: [f64; 3] = [1000.0, 40.0, 1250.0];

/// The session of a robot with this instrument.
fn robot_session(folder: &Folder, data: &str, instrument: &str) -> Session {
    folder.write("robot.csv", data);
    let unknowns: Vec<&str> = OF_ROBOT.iter().map(|(id, _)| *id).collect();
    folder.session(&format!(
        "{ROBOT}[instrument]\n{instrument}\n[unknowns]\nerrors = {unknowns:?}\n[[test]]\nname = \"T\"\ndata = \"robot.csv\"\ntarget_mm = {TARGET_MM:?}\n"
    ))
}

fn assert_scatter(of_parameters: &[Vec<f64>]) {
    for (pulls, (id, _)) in of_parameters.iter().zip(OF_ROBOT) {
        assert_standard(id, pulls);
    }
}

/// Poses of the robot as a camera system reads them, with 20 µm and 10″, as quaternions or rotation vectors.
pub fn pose_data(by_quaternion: bool, random: &mut Pcg64) -> (String, Vec<(&'static str, f64)>) {
    let header = if by_quaternion { "px_mm,py_mm,pz_mm,qx,qy,qz,qw" } else { "px_mm,py_mm,pz_mm,rx_deg,ry_deg,rz_deg" };
    robot_data(random, header, |tool, body, random| {
        let seen = tool.apply(Vector3::from(TARGET_MM)) + Vector3::from_fn(|_, _| 0.02 * normal(random));
        let turn = jittered(tool.turn * body, 10.0, random);
        let orientation: Vec<String> = match by_quaternion {
            true => turn.coords.iter().map(|component| format!("{component:.9}")).collect(),
            false => turn.scaled_axis().iter().map(|x| format!("{:.7}", x.to_degrees())).collect(),
        };
        format!("{:.6},{:.6},{:.6},{}", seen.x, seen.y, seen.z, orientation.join(","))
    })
}

/// Range and angles of a target of the robot as a tracker reads them, with 5 µm and 2″.
pub fn polar_data(random: &mut Pcg64) -> (String, Vec<(&'static str, f64)>) {
    robot_data(random, "range_mm,azimuth_deg,elevation_deg", |tool, _, random| {
        let seen = tool.apply(Vector3::from(TARGET_MM));
        let [azimuth, elevation] = angles(seen);
        let range = seen.norm() + 0.005 * normal(random);
        // A noise of the azimuth that is that of the direction.
        let azimuth = azimuth + 2.0 * ARCSECOND * normal(random) / elevation.cos();
        let elevation = elevation + 2.0 * ARCSECOND * normal(random);
        format!("{range:.6},{:.8},{:.8}", azimuth.to_degrees(), elevation.to_degrees())
    })
}

/// A camera system that stands anywhere and reads a body that is mounted in any orientation: quaternions and rotation
/// vectors in turn.
#[test]
fn estimates_of_poses_scatter_as_they_state() {
    let mut random = Pcg64::seed_from_u64(6);
    let folder = Folder::new();
    let mut of_parameters = vec![Vec::new(); OF_ROBOT.len()];
    for number in 0..sessions() {
        let (data, truth) = pose_data(number % 2 == 0, &mut random);
        let session = robot_session(&folder, &data, "kind = \"pose\"\nnoise_um = 20\nnoise_arcsec = 10");
        of_parameters.iter_mut().zip(pulls(&session, &truth)).for_each(|(all, pull)| all.push(pull));
    }
    assert_scatter(&of_parameters);
}

/// A tracker that reads range and two angles, each with its noise.
#[test]
fn estimates_of_ranges_and_angles_scatter_as_they_state() {
    let mut random = Pcg64::seed_from_u64(7);
    let folder = Folder::new();
    let mut of_parameters = vec![Vec::new(); OF_ROBOT.len()];
    for _ in 0..sessions() {
        let (data, truth) = polar_data(&mut random);
        let session = robot_session(&folder, &data, "kind = \"tracker\"\nnoise_um = 5\nnoise_arcsec = 2");
        assert!(session.units().angles && session.units().lengths);
        of_parameters.iter_mut().zip(pulls(&session, &truth)).for_each(|(all, pull)| all.push(pull));
    }
    assert_scatter(&of_parameters);
}

/// A row may lack the orientation, and its position stays.
#[test]
fn a_pose_may_lack_its_orientation() {
    let mut random = Pcg64::seed_from_u64(8);
    let folder = Folder::new();
    let (data, truth) = robot_data(&mut random, "px_mm,py_mm,pz_mm,qx,qy,qz,qw", |tool, body, random| {
        let seen = tool.apply(Vector3::from(TARGET_MM)) + Vector3::from_fn(|_, _| 0.02 * normal(random));
        let turn = jittered(tool.turn * body, 10.0, random).coords;
        let lacks = uniform(random, 1.0) < -0.6;
        let orientation = if lacks { ",,,".into() } else { format!("{},{},{},{}", turn.x, turn.y, turn.z, turn.w) };
        format!("{},{},{},{orientation}", seen.x, seen.y, seen.z)
    });
    let missing = data.matches(",,,").count();
    let session = robot_session(&folder, &data, "kind = \"pose\"\nnoise_um = 20\nnoise_arcsec = 10");
    let (problem, _) = prepare(&session, 1).unwrap();
    assert!(missing > 3);
    assert_eq!((problem.readings(), problem.scalars()), (50, 6 * 50 - 3 * missing));
    for pull in pulls(&session, &truth) {
        assert!(pull.abs() < 4.0, "{pull}");
    }
}

/// What cannot be a quaternion, a range or an elevation is refused with its place, and what may be missing is named.
#[test]
fn columns_of_poses_that_cannot_be_are_refused() {
    let folder = Folder::new();
    let refused = |kind: &str, columns: &str, cells: &str, expected: &str| {
        let rows: String = (0..8).map(|k| format!("{},0,0,{cells}\n", 10 * k)).collect();
        folder.write("pose.csv", &format!("x_mm,y_mm,z_mm,{columns}\n{rows}"));
        let text = format!(
            "{MILL}[instrument]\nkind = \"{kind}\"\n[[test]]\nname = \"P\"\ndata = \"pose.csv\"\ntarget_mm = [0, 0, 0]\n"
        );
        folder.write("session.toml", &text);
        let fault = files::session(&folder.0.path().join("session.toml"), &ReadOptions::default()).unwrap_err();
        let fault = format!("{fault}; {}", fault.help().unwrap_or_default());
        assert!(fault.contains(expected), "{fault}");
    };
    refused("pose", "px_mm,py_mm,pz_mm,qx,qy,qz,qw", "0,0,0,1,1,0,0", "the quaternion has the norm 1.41");
    refused("pose", "px_mm,py_mm,pz_mm,qx,qy,qz", "0,0,0,1,0,0", "no column `qw`");
    refused("pose", "px_mm,py_mm,pz_mm", "0,0,0", "no column `rx_deg`");
    refused(
        "pose",
        "px_mm,py_mm,pz_mm,rx_deg,ry_deg,rz_deg,qx,qy,qz,qw",
        "0,0,0,0,0,0,0,0,0,1",
        "have the same meaning",
    );
    refused("tracker", "range_mm,azimuth_deg", "900,10", "no column `elevation_deg`");
    refused("tracker", "px_mm,py_mm,pz_mm,range_mm", "1,2,3,900", "have the same meaning");
    refused("tracker", "range_mm,azimuth_deg,elevation_deg", "-3,10,10", "the range is -3.000 mm");
    refused("tracker", "range_mm,azimuth_deg,elevation_deg", "900,10,95", "from the vertical");
}
