//! Lasers, sensors of angles, distances and pointing against the plant: the readings at large errors, the estimates over
//! many simulated sessions, and sessions of several instruments.

mod bodies;
mod bundled;
mod columns;
mod contacts;
mod diagonals;
mod layouts;
mod linear_axis;
mod noise;
mod scatter;
mod stands;

use abbe::files::{self, ReadOptions};
use abbe::identify::fit::{self, prepare};
use abbe::model::axis::AxisKind;
use abbe::model::chain::{AxisPosition, BodyErrors, Frame, Machine};
use abbe::model::instrument::angle::Angle;
use abbe::model::instrument::ballbar::BallBar;
use abbe::model::instrument::column::Quantity;
use abbe::model::instrument::distance::Distance;
use abbe::model::instrument::laser::Laser;
use abbe::model::instrument::pointing::Pointing;
use abbe::model::instrument::rtest::{RTest, Setting};
use abbe::model::instrument::{Geometry, Station, Target};
use abbe::model::rotation_error::Body;
use abbe::model::session::Session;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::plant::chain::{Chain, Link};
use crate::plant::pose::{Axis, Joint, Pose};
use crate::suite::plan::topologies::uniform;

/// An arcsecond in rad.
const ARCSECOND: f64 = std::f64::consts::PI / (180.0 * 3600.0);

/// Errors of one axis, `[EX, EY, EZ, EA, EB, EC]` in mm and rad: of location, of motion.
type Twelve = [[f64; 6]; 2];

/// The pose of the table, or of the tool, in R.
fn carried(side: &[Link], position: &dyn Fn(char) -> f64, errors: &dyn Fn(char) -> Twelve) -> Pose {
    side.iter().rev().fold(Pose::identity(), |inner, link| {
        let [location, motion] = errors(link.letter);
        link.axis.motion(position(link.letter), &location, &motion).then_inner(inner)
    })
}

/// A machine of the plant at a state: poses of table and tool, commanded and actual.
struct State {
    table: [Pose; 2],
    tool: [Pose; 2],
}

impl State {
    fn of(chain: &Chain, position: &dyn Fn(char) -> f64, errors: &dyn Fn(char) -> Twelve) -> State {
        let none = |_| [[0.0; 6]; 2];
        let both = |side: &[Link]| [carried(side, position, &none), carried(side, position, errors)];
        State { table: both(&chain.workpiece_side), tool: both(&chain.tool_side) }
    }

    /// The rotation vector of a frame in addition to the commanded one, in R.
    fn rotation(&self, body: Body) -> Vector3<f64> {
        let bed = [Pose::identity(); 2];
        match body {
            Body::Relative => rotation(self.tool, self.table),
            Body::Tool => rotation(self.tool, bed),
            Body::Table => rotation(self.table, bed),
        }
    }
}

/// The rotation vector of a body against another in addition to the commanded one, in R. Poses are commanded and actual.
fn rotation(body: [Pose; 2], against: [Pose; 2]) -> Vector3<f64> {
    let [body, against] =
        [body, against].map(|[commanded, actual]| -> UnitQuaternion<f64> { actual.turn * commanded.turn.inverse() });
    (body * against.inverse()).scaled_axis()
}

/// A laser that reads all channels.
fn laser(reflector: Target<f64>, optic: Target<f64>, frame: [[f64; 3]; 3]) -> Laser<f64> {
    let mut laser = Laser { reflector, optic, frame, channels: Vec::new(), is_beam_stated: false, datum: 0.0 };
    laser.keep_channels(&|quantity| matches!(quantity, Quantity::Channel(_)));
    laser
}

/// A machine and the plant at one state, with errors of a millimetre and a milliradian on every axis, and the instrument's
/// parameters as large.
struct Large {
    machine: Machine,
    plant: State,
    state: Vec<AxisPosition<f64>>,
    errors: Vec<BodyErrors<f64>>,
    unknowns: Vec<f64>,
    /// Every body, with its pose as commanded and actually.
    frames: Vec<(Frame, [Pose; 2])>,
}

impl Large {
    fn drawn(machine: &Machine, chain: &Chain, random: &mut Pcg64) -> Large {
        let positions: Vec<f64> = (machine.axes.iter())
            .map(|axis| uniform(random, if axis.kind == AxisKind::Rotary { 3.0 } else { 300.0 }))
            .collect();
        let sizes: Vec<Twelve> = (machine.axes.iter())
            .map(|_| {
                let mut six = || std::array::from_fn(|k| uniform(random, if k < 3 { 1.0 } else { 1e-3 }));
                [six(), six()]
            })
            .collect();
        let index = |letter: char| machine.axis_index(&letter.to_string()).unwrap();
        let plant = State::of(chain, &|letter| positions[index(letter)], &|letter| sizes[index(letter)]);
        let bed = (Frame::Bed, [Pose::identity(); 2]);
        let mut frames = vec![(Frame::Table, plant.table), (Frame::Tool, plant.tool), bed];
        for side in [&chain.workpiece_side, &chain.tool_side] {
            for (k, link) in side.iter().enumerate() {
                // The body of an axis is the last one of a shorter side.
                let shorter = Chain { workpiece_side: side[..=k].to_vec(), tool_side: Vec::new() };
                let body =
                    State::of(&shorter, &|letter| positions[index(letter)], &|letter| sizes[index(letter)]).table;
                frames.push((Frame::Axis(index(link.letter)), body));
            }
        }
        let state = machine.axes.iter().zip(&positions).map(|(axis, q)| AxisPosition::new(axis.kind, *q)).collect();
        let errors = machine.body_errors(|_| true, |slot| sizes[slot / 12][slot % 12 / 6][slot % 6]);
        let unknowns = (0..14).map(|_| uniform(random, 1e-3)).collect();
        Large { machine: machine.clone(), plant, state, errors, unknowns, frames }
    }

    /// The reading of the model.
    fn read(&self, station: &Station<f64>) -> Vec<f64> {
        station.read::<f64>(&self.machine, &self.state, &self.errors, |k| Some(self.unknowns[k])).channels().to_vec()
    }

    /// A point displaced by three parameters of the instrument.
    fn moved(&self, mm: [f64; 3], first: usize) -> Vector3<f64> {
        Vector3::from(mm) + Vector3::from_column_slice(&self.unknowns[first..first + 3])
    }
}

/// Lengths to 1e-10 mm, angles to 1e-12 rad.
fn near(found: &[f64], expected: &[f64], what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (channel, (found, expected)) in found.iter().zip(expected).enumerate() {
        let most = if expected.abs() > 0.1 { 1e-10 } else { 1e-12 };
        assert!((found - expected).abs() <= most, "{what} {channel}: {found}, not {expected}");
    }
}

/// Errors of a millimetre and of a milliradian on every axis, with the instrument's parameters as large.
#[test]
fn readings_at_large_errors_are_those_of_the_plant() {
    let mut random = Pcg64::seed_from_u64(44);
    for code in ["wCAbYXZt", "wXbYZBCt", "wbXYZt", "wYXAbZBt"] {
        let (machine, chain) = (Machine::from_code(code).unwrap(), Chain::from_code(code));
        for _ in 0..50 {
            let large = Large::drawn(&machine, &chain, &mut random);
            let Large { plant, state, unknowns, .. } = &large;
            let (read, moved) = (|station: &Station<f64>| large.read(station), |mm, first| large.moved(mm, first));
            let point = |random: &mut Pcg64| -> [f64; 3] { std::array::from_fn(|_| uniform(random, 200.0)) };
            let (tool_mm, table_mm) = (point(&mut random), point(&mut random));
            // The points are on table and tool, or on any two bodies.
            let mut any = || large.frames[random.random_range(0..large.frames.len())];
            for [(of_tool, tool), (of_table, table)] in [[large.frames[1], large.frames[0]], [any(), any()]] {
                let (on_tool, on_table) =
                    (Target { frame: of_tool, mm: tool_mm }, Target { frame: of_table, mm: table_mm });

                // The beam, turned towards horizontal and vertical, and the directions perpendicular to it.
                let frame = [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];
                let found = read(&Station::Laser(laser(on_tool, on_table, frame)));
                let [beam, horizontal, vertical] = frame.map(Vector3::from);
                let turned = (beam + horizontal * unknowns[6] + vertical * unknowns[7]).normalize();
                let across = |direction: Vector3<f64>| (direction - turned * turned.dot(&direction)).normalize();
                let from_optic = tool[1].apply(moved(tool_mm, 0)) - table[1].apply(moved(table_mm, 3));
                let rotation = rotation(tool, table);
                let mut expected = [turned, across(horizontal), across(vertical)].map(|d| d.dot(&from_optic)).to_vec();
                expected.extend([horizontal, vertical, beam].map(|d| d.dot(&rotation)));
                expected.iter_mut().zip(&unknowns[8..]).for_each(|(value, zero)| *value += zero);
                near(&found, &expected, "laser");

                let found = read(&Station::Distance(Distance { station: on_table, reflector: on_tool }));
                let apart = tool[1].apply(moved(tool_mm, 3)) - table[1].apply(moved(table_mm, 0));
                near(&found, &[apart.norm() + unknowns[6]], "distance");

                let bar = BallBar { workpiece_ball: on_table, spindle_ball: on_tool, bar: 100.0 };
                let length = apart.norm() - unknowns[6] + unknowns[7] * (apart.norm() - 100.0);
                near(&read(&Station::BallBar(bar)), &[length], "ball bar");

                for (setting, nest) in [(Setting::Table, table), (Setting::Spindle, tool)] {
                    let nominal = RTest { setting, workpiece_ball: on_table, spindle_ball: on_tool, sensors: None };
                    let found = Station::RTest(nominal)
                        .read::<f64>(&machine, state, &large.errors, |k| (k < 6).then_some(unknowns[k]));
                    let expected = nest[1].turn.inverse() * apart;
                    near(found.channels(), expected.as_slice(), "R-test");
                }
            }

            for body in [Body::Relative, Body::Tool, Body::Table] {
                let about = vec![[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]];
                let found = read(&Station::Angle(Angle { about: about.clone(), body }));
                let rotation = plant.rotation(body);
                let expected: Vec<f64> = about
                    .iter()
                    .zip(unknowns)
                    .map(|(about, zero)| Vector3::from(*about).dot(&rotation) + zero)
                    .collect();
                near(&found, &expected, "angle");
            }

            // Azimuth and elevation of the line of sight, from true to columns and back to channels.
            let directions = [[0.6, 0.0, 0.8], [0.0, -1.0, 0.0], [-0.8, 0.0, 0.6]];
            let pointing = Station::Pointing(Pointing { directions, is_free: true });
            let [sight, across, up] = directions.map(Vector3::from);
            let actual = plant.tool[1].turn * (sight + across * unknowns[0] + up * unknowns[1]);
            let mut columns = [(-actual.y).atan2(actual.x), actual.z.atan2(actual.x.hypot(actual.y))];
            pointing.channels_of_columns(&machine, state, &mut columns);
            near(&read(&pointing), &columns, "pointing");
        }
    }
}

/// Text of a session whose data are arrays in the file's folder.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.path().join(name), text).unwrap();
    }

    fn session(&self, text: &str) -> Session {
        self.write("session.toml", text);
        files::session(&self.0.path().join("session.toml"), &ReadOptions::default()).unwrap()
    }
}

/// Three linear axes on the tool side.
const MILL: &str = r#"
[machine]
name = "Mill"
chain = "w b X Y Z t"
axis.X.direction = [1, 0, 0]
axis.Y.direction = [0, 1, 0]
axis.Z.direction = [0, 0, 1]
"#;

/// The error motions of X in these tests: pitch EBX, positioning EXX and straightness EZX, each a parabola in x with its
/// coefficients at 300 mm.
struct Carriage {
    pitch_arcsec: [f64; 2],
    position_um: [f64; 2],
    straightness_um: f64,
}

impl Carriage {
    fn drawn(random: &mut Pcg64) -> Carriage {
        Carriage {
            pitch_arcsec: [uniform(random, 5.0), uniform(random, 5.0)],
            position_um: [uniform(random, 8.0), uniform(random, 8.0)],
            straightness_um: uniform(random, 4.0),
        }
    }

    /// Location errors and error motions of X at a position, mm and rad.
    fn errors(&self, x_mm: f64) -> Twelve {
        let t = x_mm / 300.0;
        let mut motion = [0.0; 6];
        motion[0] = (self.position_um[0] * t + self.position_um[1] * t * t) * 1e-3;
        motion[2] = self.straightness_um * t * t * 1e-3;
        motion[4] = (self.pitch_arcsec[0] * t + self.pitch_arcsec[1] * t * t) * ARCSECOND;
        [[0.0; 6], motion]
    }

    /// The true values by their identifiers.
    fn truth(&self) -> Vec<(&'static str, f64)> {
        vec![
            ("EBX~X:p2.1", self.pitch_arcsec[0]),
            ("EBX~X:p2.2", self.pitch_arcsec[1]),
            ("EXX~X:p2.1", self.position_um[0]),
            ("EXX~X:p2.2", self.position_um[1]),
            ("EZX~X:p2.2", self.straightness_um),
        ]
    }
}

/// Declared parabolas over X.
fn parabolas(components: &[&str]) -> String {
    let of = |component: &&str| {
        format!(
            "[[effect]]\ncomponent = \"{component}\"\ndriver = \"X\"\nshape = \"polynomial\"\norder = 2\nscale_mm = 300\n"
        )
    };
    components.iter().map(of).collect()
}

fn normal(random: &mut Pcg64) -> f64 {
    StandardNormal.sample(random)
}

/// A carriage with pitch and a reflector 120 mm below its scale, read by a laser: run, x, displacement, vertical
/// straightness, pitch.
fn laser_data(carriage: &Carriage, reflector_mm: [f64; 3], random: &mut Pcg64) -> String {
    let chain = Chain::from_code("wbXYZt");
    let mut text = String::from("run,x_mm,displacement_mm,vertical_um,pitch_arcsec\n");
    for run in 1..=4 {
        for step in 0..=30 {
            let x = if run % 2 == 1 { -300.0 + 20.0 * f64::from(step) } else { 300.0 - 20.0 * f64::from(step) };
            let position = |letter| if letter == 'X' { x } else { 0.0 };
            let errors = |letter| if letter == 'X' { carriage.errors(x) } else { [[0.0; 6]; 2] };
            let state = State::of(&chain, &position, &errors);
            let reflector = state.tool[1].apply(Vector3::from(reflector_mm));
            let displacement = reflector.x + 1e-4 * normal(random);
            let vertical = (reflector.z - reflector_mm[2]) * 1e3 + 0.1 * normal(random);
            let pitch = state.rotation(Body::Relative).y / ARCSECOND + 0.2 * normal(random);
            // A slope of the straightness and zeros of all channels are the set-up's.
            let (displacement, vertical, pitch) = (displacement + 17.25, vertical + 0.01 * x - 4.0, pitch + 2.0);
            text += &format!("{run},{x},{displacement:.9},{vertical:.6},{pitch:.6}\n");
        }
    }
    text
}

/// Estimates over their uncertainties: the errors of the named parameters.
fn pulls(session: &Session, truth: &[(&'static str, f64)]) -> Vec<f64> {
    let (problem, found) = prepare(session, 1).unwrap();
    let parameters = fit::parameters(&problem, &found);
    let pull = |(id, value): &(&str, f64)| {
        let found = parameters.iter().find(|parameter| parameter.id == *id);
        let found = found.unwrap_or_else(|| panic!("{id} is not identified"));
        (found.value - value) / found.u
    };
    truth.iter().map(pull).collect()
}

const LASER: &str = r#"
[instrument]
kind = "laser"
noise_um = 0.1
noise_arcsec = 0.2
"#;

/// The session of a laser that reads these columns of its data.
fn laser_session(folder: &Folder, data: &str, reflector_mm: [f64; 3], effects: &[&str]) -> Session {
    folder.write("laser.csv", data);
    let test =
        format!("[[test]]\nname = \"L\"\ndata = \"laser.csv\"\nbeam = [1, 0, 0]\nreflector_mm = {reflector_mm:?}\n");
    folder.session(&format!("{MILL}{LASER}{}{test}", parabolas(effects)))
}

/// The columns of a table of numbers that are named.
fn chosen(data: &str, columns: &[&str]) -> String {
    let names: Vec<&str> = data.lines().next().unwrap().split(',').collect();
    let place = |column: &&str| names.iter().position(|name| name == column).unwrap();
    let places: Vec<usize> = columns.iter().map(place).collect();
    let line = |line: &str| -> String {
        let cells: Vec<&str> = line.split(',').collect();
        places.iter().map(|place| cells[*place]).collect::<Vec<_>>().join(",") + "\n"
    };
    data.lines().map(line).collect()
}

/// A carriage with pitch and a reflector 120 mm below its scale. Displacement, straightness and pitch in one fit tell
/// positioning and pitch apart; the displacement alone does not, and the confounding is named.
#[test]
fn an_abbe_offset_is_seen_as_one() {
    let mut random = Pcg64::seed_from_u64(120);
    let carriage = Carriage { pitch_arcsec: [6.0, -4.0], position_um: [5.0, 3.0], straightness_um: 2.5 };
    let reflector_mm = [0.0, 0.0, -120.0];
    let data = laser_data(&carriage, reflector_mm, &mut random);
    let folder = Folder::new();
    let whole = laser_session(&folder, &data, reflector_mm, &["EXX", "EBX", "EZX"]);
    assert_eq!(whole.tests[0].station.channels().len(), 3);
    for ((id, _), pull) in carriage.truth().iter().zip(pulls(&whole, &carriage.truth())) {
        assert!(pull.abs() < 3.0, "{id}: {pull}");
    }

    let alone = chosen(&data, &["run", "x_mm", "displacement_mm"]);
    let session = laser_session(&folder, &alone, reflector_mm, &["EXX", "EBX"]);
    let (problem, found) = prepare(&session, 1).unwrap();
    let confounded = fit::unobservable(&problem, &found.rank);
    for coefficient in ["p2.1", "p2.2"] {
        let both = [format!("EXX~X:{coefficient}"), format!("EBX~X:{coefficient}")];
        let named = confounded.iter().any(|one| both.iter().all(|id| one.combination.contains_key(id.as_str())));
        assert!(named, "{both:?} in {:?}", confounded.iter().map(|one| &one.combination).collect::<Vec<_>>());
    }
}

/// A missing value of one channel is no reading, and the others of its row stay.
#[test]
fn a_row_may_lack_a_channel() {
    let mut random = Pcg64::seed_from_u64(7);
    let carriage = Carriage::drawn(&mut random);
    let data = laser_data(&carriage, [0.0, 0.0, -120.0], &mut random);
    let mut lacking = String::new();
    for (number, line) in data.lines().enumerate() {
        let mut cells: Vec<&str> = line.split(',').collect();
        match number {
            5 | 40 => cells[4] = "",
            17 => cells[2] = "NaN",
            _ => {}
        }
        lacking += &(cells.join(",") + "\n");
    }
    let folder = Folder::new();
    let session = laser_session(&folder, &lacking, [0.0, 0.0, -120.0], &["EXX", "EBX", "EZX"]);
    let (problem, found) = prepare(&session, 1).unwrap();
    assert_eq!((problem.readings(), problem.scalars()), (124, 3 * 124 - 3));
    assert_eq!(found.degrees_of_freedom, 3 * 124 - 3 - found.rank.identifiable_basis.ncols());
    for pull in pulls(&session, &carriage.truth()) {
        assert!(pull.abs() < 4.0, "{pull}");
    }
    // The only channel of a laser cannot be missing.
    let alone = chosen(&lacking, &["run", "x_mm", "displacement_mm"]);
    folder.write("laser.csv", &alone);
    let path = folder.0.path().join("session.toml");
    let fault = files::session(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(fault.contains("laser.csv:18"), "{fault}");
}

/// Number of simulated sessions of each kind, from `ABBE_STUDY`.
fn sessions() -> usize {
    std::env::var("ABBE_STUDY").ok().and_then(|text| text.parse().ok()).unwrap_or(60)
}

/// A ball bar over a short arc of XZ, a laser along X and a level on the carriage are one machine: squareness of Z, pitch
/// and scale of X, of which the bar alone separates none and the others lack the squareness.
#[test]
fn a_bar_a_laser_and_a_level_in_one_session() {
    let mut random = Pcg64::seed_from_u64(31);
    let chain = Chain::from_code("wbXYZt");
    let carriage = Carriage { pitch_arcsec: [8.0, 0.0], position_um: [6.0, 0.0], straightness_um: 0.0 };
    let squareness_arcsec = 12.0;
    let errors = |x: f64| {
        let carriage = &carriage;
        move |letter: char| match letter {
            'X' => carriage.errors(x),
            'Z' => [[0.0, 0.0, 0.0, 0.0, squareness_arcsec * ARCSECOND, 0.0], [0.0; 6]],
            _ => [[0.0; 6]; 2],
        }
    };
    let state = |x: f64, z: f64| {
        let position = |letter| match letter {
            'X' => x,
            'Z' => z,
            _ => 0.0,
        };
        State::of(&chain, &position, &errors(x))
    };
    let folder = Folder::new();
    let mut bar = String::from("run,x_mm,z_mm,deviation_um\n");
    for run in 1..=2 {
        for step in 0..=30 {
            let degrees = if run == 1 { 30.0 + f64::from(step) } else { 60.0 - f64::from(step) };
            let (sin, cos) = degrees.to_radians().sin_cos();
            let ball = state(150.0 * cos, 150.0 * sin).tool[1].apply(Vector3::zeros());
            let deviation = (ball.norm() - 150.0) * 1e3 + 0.1 * normal(&mut random);
            bar += &format!("{run},{},{},{deviation:.6}\n", 150.0 * cos, 150.0 * sin);
        }
    }
    let (mut laser, mut level) = (String::from("run,x_mm,deviation_um\n"), String::from("run,x_mm,angle_arcsec\n"));
    for run in 1..=2 {
        for step in 0..=30 {
            let x = if run == 1 { -300.0 + 20.0 * f64::from(step) } else { 300.0 - 20.0 * f64::from(step) };
            let state = state(x, 0.0);
            let displacement = state.tool[1].apply(Vector3::zeros()).x - x;
            laser += &format!("{run},{x},{:.6}\n", displacement * 1e3 + 0.1 * normal(&mut random));
            let pitch = state.rotation(Body::Tool).y / ARCSECOND;
            level += &format!("{run},{x},{:.6}\n", pitch + 3.0 + 0.1 * normal(&mut random));
        }
    }
    folder.write("bar.csv", &bar);
    folder.write("laser.csv", &laser);
    folder.write("level.csv", &level);
    let head = format!(
        "{MILL}[instrument]\nkind = \"ballbar\"\nnoise_um = 0.1\nnoise_arcsec = 0.1\n[unknowns]\nerrors = [\"EB0Z\"]\n{}",
        parabolas(&["EXX", "EBX"]).replace("order = 2", "order = 1")
    );
    let of_bar = "[[test]]\nname = \"XZ\"\ndata = \"bar.csv\"\nbar_mm = 150\nbar_u_um = 2\nworkpiece_ball_mm = [0, 0, 0]\n\
                  workpiece_ball_u_um = 10\nspindle_ball_mm = [0, 0, 0]\n";
    let of_laser = "[[test]]\nname = \"laser\"\nkind = \"laser\"\ndata = \"laser.csv\"\nbeam = [1, 0, 0]\n";
    let of_level =
        "[[test]]\nname = \"level\"\nkind = \"angle\"\ndata = \"level.csv\"\nabout = [0, 1, 0]\nbody = \"tool\"\n";
    let truth = [("EB0Z", squareness_arcsec), ("EXX~X:power1", 20.0), ("EBX~X:power1", 8.0 / 0.3)];
    let u = |session: &Session| -> Vec<f64> {
        let (problem, found) = prepare(session, 1).unwrap();
        let parameters = fit::parameters(&problem, &found);
        let of = |id: &str| parameters.iter().find(|parameter| parameter.id == id).map(|parameter| parameter.u);
        truth.iter().map(|(id, _)| of(id).unwrap_or(f64::INFINITY)).collect()
    };
    let together = folder.session(&format!("{head}{of_bar}{of_laser}{of_level}"));
    for ((id, _), pull) in truth.iter().zip(pulls(&together, &truth)) {
        assert!(pull.abs() < 3.0, "{id}: {pull}");
    }
    let all = u(&together);
    let of_bar = u(&folder.session(&format!("{head}{of_bar}")));
    println!("u together {all:?}, of the bar {of_bar:?}");
    assert!(of_bar[0] > 5.0 * all[0], "{of_bar:?} {all:?}");
}
