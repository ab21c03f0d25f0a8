//! Lasers, sensors of angles, distances and pointing against the plant: the readings at large errors, the estimates over
//! many simulated sessions, and sessions of several instruments.

mod bundled;
mod layouts;
mod stands;

use abbe::identify::fit::{self, prepare};
use abbe::model::axis::AxisKind;
use abbe::model::chain::{AxisPosition, BodyErrors, Machine};
use abbe::model::files::{self, ReadOptions};
use abbe::model::instrument::angle::Angle;
use abbe::model::instrument::column::Quantity;
use abbe::model::instrument::distance::{Distance, StationFrame};
use abbe::model::instrument::laser::Laser;
use abbe::model::instrument::pointing::Pointing;
use abbe::model::instrument::{Geometry, Station};
use abbe::model::rotation_error::Body;
use abbe::model::session::Session;
use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::topologies::uniform;
use crate::plant::chain::{Chain, Link};
use crate::plant::pose::{Axis, Joint, Pose};

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
        let from_commanded =
            |[commanded, actual]: [Pose; 2]| -> UnitQuaternion<f64> { actual.turn * commanded.turn.inverse() };
        let (table, tool) = (from_commanded(self.table), from_commanded(self.tool));
        match body {
            Body::Relative => tool * table.inverse(),
            Body::Tool => tool,
            Body::Table => table,
        }
        .scaled_axis()
    }
}

/// A laser that reads all channels.
fn laser(reflector: [f64; 3], optic: [f64; 3], frame: [[f64; 3]; 3]) -> Laser<f64> {
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
        let state = machine.axes.iter().zip(&positions).map(|(axis, q)| AxisPosition::new(axis.kind, *q)).collect();
        let errors = machine.body_errors(|_| true, |slot| sizes[slot / 12][slot % 12 / 6][slot % 6]);
        let unknowns = (0..14).map(|_| uniform(random, 1e-3)).collect();
        Large { machine: machine.clone(), plant, state, errors, unknowns }
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

            // The beam, turned towards horizontal and vertical, and the directions perpendicular to it.
            let frame = [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];
            let found = read(&Station::Laser(laser(tool_mm, table_mm, frame)));
            let [beam, horizontal, vertical] = frame.map(Vector3::from);
            let turned = (beam + horizontal * unknowns[6] + vertical * unknowns[7]).normalize();
            let across = |direction: Vector3<f64>| (direction - turned * turned.dot(&direction)).normalize();
            let from_optic = plant.tool[1].apply(moved(tool_mm, 0)) - plant.table[1].apply(moved(table_mm, 3));
            let rotation = plant.rotation(Body::Relative);
            let mut expected = [turned, across(horizontal), across(vertical)].map(|d| d.dot(&from_optic)).to_vec();
            expected.extend([horizontal, vertical, beam].map(|d| d.dot(&rotation)));
            expected.iter_mut().zip(&unknowns[8..]).for_each(|(value, zero)| *value += zero);
            near(&found, &expected, "laser");

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

            for frame in [StationFrame::Table, StationFrame::Bed] {
                let found = read(&Station::Distance(Distance { station: table_mm, reflector: tool_mm, frame }));
                let station = moved(table_mm, 0);
                let station = if frame == StationFrame::Table { plant.table[1].apply(station) } else { station };
                let expected = (plant.tool[1].apply(moved(tool_mm, 3)) - station).norm() + unknowns[6];
                near(&found, &[expected], "distance");
            }

            // Azimuth and elevation of the line of sight, from true to columns and back to channels.
            let directions = [[0.6, 0.0, 0.8], [0.0, -1.0, 0.0], [-0.8, 0.0, 0.6]];
            let pointing = Station::Pointing(Pointing { directions });
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

/// Mean and standard deviation of pulls, each within three standard errors of 0 and 1.
fn assert_standard(what: &str, pulls: &[f64]) {
    let count = pulls.len() as f64;
    let mean = pulls.iter().sum::<f64>() / count;
    let deviation = (pulls.iter().map(|pull| (pull - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
    println!("{what}: {count} pulls, mean {mean:.3}, standard deviation {deviation:.3}");
    assert!(mean.abs() < 3.0 / count.sqrt(), "{what}: mean {mean}");
    assert!((deviation - 1.0).abs() < 3.0 / (2.0 * count).sqrt(), "{what}: standard deviation {deviation}");
}

/// Number of simulated sessions of each kind, from `ABBE_STUDY`.
fn sessions() -> usize {
    std::env::var("ABBE_STUDY").ok().and_then(|text| text.parse().ok()).unwrap_or(60)
}

/// Over simulated sessions of lasers the estimates scatter about the truth as their uncertainties state.
#[test]
fn estimates_of_a_laser_scatter_as_they_state() {
    let mut random = Pcg64::seed_from_u64(230);
    let folder = Folder::new();
    let mut of_parameters = vec![Vec::new(); 5];
    for _ in 0..sessions() {
        let carriage = Carriage::drawn(&mut random);
        let data = laser_data(&carriage, [0.0, 0.0, -120.0], &mut random);
        let session = laser_session(&folder, &data, [0.0, 0.0, -120.0], &["EXX", "EBX", "EZX"]);
        let found = pulls(&session, &carriage.truth());
        of_parameters.iter_mut().zip(found).for_each(|(all, pull)| all.push(pull));
    }
    for (pulls, (id, _)) in of_parameters.iter().zip(Carriage::drawn(&mut random).truth()) {
        assert_standard(id, pulls);
    }
}

/// Four runs of a level on a carriage that pitches and rolls, each a parabola with these coefficients, read about two
/// directions: run, x, pitch, roll.
fn level_data(truth: &[f64], random: &mut Pcg64) -> String {
    let chain = Chain::from_code("wbXYZt");
    let zeros = [uniform(random, 20.0), uniform(random, 20.0)];
    let mut data = String::from("run,x_mm,angle_arcsec,angle2_arcsec\n");
    for run in 1..=4 {
        for step in 0..=30 {
            let x = if run % 2 == 1 { -300.0 + 20.0 * f64::from(step) } else { 300.0 - 20.0 * f64::from(step) };
            let t = x / 300.0;
            let parabola = |of: &[f64]| (of[0] * t + of[1] * t * t) * ARCSECOND;
            let motion = [0.0, 0.0, 0.0, parabola(&truth[2..]), parabola(&truth[..2]), 0.0];
            let position = |letter| if letter == 'X' { x } else { 0.0 };
            let errors = |letter| if letter == 'X' { [[0.0; 6], motion] } else { [[0.0; 6]; 2] };
            let rotation = State::of(&chain, &position, &errors).rotation(Body::Tool) / ARCSECOND;
            let [pitch, roll] = [rotation.y + zeros[0], rotation.x + zeros[1]].map(|x| x + 0.2 * normal(random));
            data += &format!("{run},{x},{pitch:.6},{roll:.6}\n");
        }
    }
    data
}

/// The coefficients of [`level_data`].
const OF_LEVEL: [&str; 4] = ["EBX~X:p2.1", "EBX~X:p2.2", "EAX~X:p2.1", "EAX~X:p2.2"];

/// Over simulated sessions of a level the estimates scatter about the truth as their uncertainties state.
#[test]
fn estimates_of_a_level_scatter_as_they_state() {
    let mut random = Pcg64::seed_from_u64(17);
    let folder = Folder::new();
    let mut of_parameters = vec![Vec::new(); OF_LEVEL.len()];
    for _ in 0..sessions() {
        let truth: Vec<f64> = OF_LEVEL.iter().map(|_| uniform(&mut random, 8.0)).collect();
        folder.write("level.csv", &level_data(&truth, &mut random));
        let session = folder.session(&format!(
            "{MILL}[instrument]\nkind = \"angle\"\nnoise_arcsec = 0.2\n{}[[test]]\nname = \"L\"\ndata = \"level.csv\"\n\
             about = [[0, 1, 0], [1, 0, 0]]\nbody = \"tool\"\n",
            parabolas(&["EBX", "EAX"])
        ));
        let truth: Vec<(&'static str, f64)> = OF_LEVEL.iter().copied().zip(truth.iter().copied()).collect();
        of_parameters.iter_mut().zip(pulls(&session, &truth)).for_each(|(all, pull)| all.push(pull));
    }
    for (pulls, id) in of_parameters.iter().zip(OF_LEVEL) {
        assert_standard(id, pulls);
    }
}

/// The squareness errors in these tests, and the stations of a tracking interferometer.
const SQUARENESS: [&str; 3] = ["EC0Y", "EB0Z", "EA0Z"];
const STATIONS: [[f64; 3]; 4] =
    [[-400.0, -350.0, -50.0], [420.0, -300.0, -80.0], [30.0, 430.0, -90.0], [-20.0, 10.0, -250.0]];

/// Distances from one of the stations, which stands up to 5 mm from where it is stated to stand, with an unknown dead
/// path, on a machine with these squareness errors, arcsec.
fn distance_data(stated: [f64; 3], truth: &[f64], random: &mut Pcg64) -> String {
    let chain = Chain::from_code("wbXYZt");
    let errors = |letter: char| {
        let mut location = [0.0; 6];
        match letter {
            'Y' => location[5] = truth[0] * ARCSECOND,
            'Z' => (location[4], location[3]) = (truth[1] * ARCSECOND, truth[2] * ARCSECOND),
            _ => {}
        }
        [location, [0.0; 6]]
    };
    let place = Vector3::from(stated) + Vector3::from_fn(|_, _| uniform(random, 5.0));
    let dead = uniform(random, 3.0);
    let mut data = String::from("x_mm,y_mm,z_mm,distance_mm\n");
    for k in 0..60 {
        let turn = |axis: usize| 1.0 + f64::from(k) * [0.37, 0.61, 0.83][axis];
        let [x, y, z] = [280.0 * turn(0).sin(), 180.0 * turn(1).sin(), 140.0 + 140.0 * turn(2).sin()]
            .map(|position| (position * 1e3).round() / 1e3);
        let position = |letter| match letter {
            'X' => x,
            'Y' => y,
            _ => z,
        };
        let state = State::of(&chain, &position, &errors);
        let reflector = state.tool[1].apply(Vector3::new(10.0, -20.0, 30.0));
        let distance = (reflector - place).norm() + dead + 2e-4 * normal(random);
        data += &format!("{x},{y},{z},{distance:.7}\n");
    }
    data
}

/// Distances from four stations at places that no one knows, with an unknown dead path each: squareness of three linear
/// axes.
#[test]
fn estimates_of_distances_scatter_as_they_state() {
    let mut random = Pcg64::seed_from_u64(900);
    let folder = Folder::new();
    let mut of_parameters = vec![Vec::new(); SQUARENESS.len()];
    for _ in 0..sessions() {
        let truth: Vec<f64> = SQUARENESS.iter().map(|_| uniform(&mut random, 20.0)).collect();
        let mut text =
            format!("{MILL}[instrument]\nkind = \"distance\"\nnoise_um = 0.2\n[unknowns]\nerrors = {SQUARENESS:?}\n");
        for (number, stated) in STATIONS.into_iter().enumerate() {
            folder.write(&format!("S{number}.csv"), &distance_data(stated, &truth, &mut random));
            text += &format!(
                "[[test]]\nname = \"S{number}\"\ndata = \"S{number}.csv\"\nreflector_mm = [10, -20, 30]\nstation_mm = {stated:?}\nstation_frame = \"bed\"\n"
            );
        }
        let session = folder.session(&text);
        let truth: Vec<(&'static str, f64)> = SQUARENESS.iter().copied().zip(truth.iter().copied()).collect();
        of_parameters.iter_mut().zip(pulls(&session, &truth)).for_each(|(all, pull)| all.push(pull));
    }
    for (pulls, id) in of_parameters.iter().zip(SQUARENESS) {
        assert_standard(id, pulls);
    }
}

/// Stars over the sky for a mount with index errors of minutes of arc, a tilted azimuth axis, axes that are not
/// perpendicular, and a collimation error.
#[test]
fn estimates_of_a_mount_scatter_as_they_state() {
    let mut random = Pcg64::seed_from_u64(2022);
    let folder = Folder::new();
    let link = |letter: char, direction: Vector3<f64>| Link {
        letter,
        axis: Axis { joint: Joint::Rotary, direction, origin_mm: Vector3::zeros() },
    };
    let mount =
        Chain { workpiece_side: Vec::new(), tool_side: vec![link('A', -Vector3::z()), link('E', -Vector3::y())] };
    let ids = ["EA0AZ", "EB0AZ", "EC0AZ", "EA0EL", "EB0EL", "line_of_sight.across[tool]"];
    let mut of_parameters = vec![Vec::new(); ids.len()];
    for _ in 0..sessions() {
        let truth: Vec<f64> = ids.iter().map(|_| uniform(&mut random, 200.0)).collect();
        let errors = |letter: char| {
            let mut location = [0.0; 6];
            let of_axis = if letter == 'A' { &truth[..3] } else { &truth[3..5] };
            of_axis.iter().enumerate().for_each(|(k, arcsec)| location[3 + k] = arcsec * ARCSECOND);
            [location, [0.0; 6]]
        };
        let mut data = String::from("az_deg,el_deg,true_azimuth_deg,true_elevation_deg\n");
        for star in 0..60 {
            let (azimuth, elevation) = (f64::from(star) * 137.508 % 360.0, 20.0 + f64::from(star) * 27.3 % 60.0);
            let position = |letter| if letter == 'A' { azimuth.to_radians() } else { elevation.to_radians() };
            let state = State::of(&mount, &position, &errors);
            let across = truth[5] * ARCSECOND;
            let sight = state.tool[1].turn * Vector3::new(1.0, -across, 0.0);
            // Noise across and up of the line of sight.
            let [east, up] = [-Vector3::y(), Vector3::z()].map(|direction| state.tool[0].turn * direction);
            let noise = [(); 2].map(|()| 1.5 * ARCSECOND * normal(&mut random));
            let seen = sight.normalize() + east * noise[0] + up * noise[1];
            let true_azimuth = (-seen.y).atan2(seen.x).to_degrees().rem_euclid(360.0);
            let true_elevation = seen.z.atan2(seen.x.hypot(seen.y)).to_degrees();
            data += &format!("{azimuth},{elevation},{true_azimuth:.9},{true_elevation:.9}\n");
        }
        folder.write("stars.csv", &data);
        let session = folder.session(
            "[machine]\nname = \"Mount\"\nchain = \"w b AZ EL t\"\naxis.AZ = { kind = \"rotary\", direction = [0, 0, -1] }\n\
             axis.EL = { kind = \"rotary\", direction = [0, -1, 0] }\n[instrument]\nkind = \"pointing\"\nnoise_arcsec = 1.5\n\
             [[test]]\nname = \"night\"\ndata = \"stars.csv\"\n",
        );
        let truth: Vec<(&'static str, f64)> = ids.iter().copied().zip(truth.iter().copied()).collect();
        of_parameters.iter_mut().zip(pulls(&session, &truth)).for_each(|(all, pull)| all.push(pull));
    }
    for (pulls, id) in of_parameters.iter().zip(ids) {
        assert_standard(id, pulls);
    }
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
    let truth = [("EB0Z", squareness_arcsec), ("EXX~X:p1", 6.0), ("EBX~X:p1", 8.0)];
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

/// The linear axis of the European Spallation Source: nine positions, five cycles. Its own report prints M and A.
#[test]
fn the_figures_of_a_linear_axis_are_those_of_its_report() {
    let name = "channels::the_figures_of_a_linear_axis_are_those_of_its_report";
    let Some(file) = test_needs::data(name, "linear_axis_ess/b02_x_ISO230.dat") else { return };
    let text = std::fs::read_to_string(file).unwrap();
    let mut targets = std::collections::BTreeMap::new();
    let mut rows = Vec::new();
    for (name, value) in text.lines().filter_map(|line| line.split_once('=')) {
        let Some((name, indices)) = name.split_once('[') else { continue };
        let indices: Vec<usize> = indices.trim_end_matches(']').split(',').map(|k| k.parse().unwrap()).collect();
        match (name, value.parse::<f64>(), indices.as_slice()) {
            ("TGT_DATA", Ok(value), [position]) => _ = targets.insert(*position, value),
            ("REF_DATA_FWD", Ok(value), [position, cycle]) => rows.push((2 * cycle, *position as isize, value)),
            // A backward run passes the positions in descending order.
            ("REF_DATA_BWD", Ok(value), [position, cycle]) => rows.push((2 * cycle + 1, -(*position as isize), value)),
            _ => {}
        }
    }
    rows.sort_by_key(|(run, order, _)| (*run, *order));
    assert_eq!((targets.len(), rows.len()), (9, 90));
    let mut data = String::from("run,x_mm,displacement_mm\n");
    for (run, order, value) in rows {
        data += &format!("{run},{},{value}\n", targets[&order.unsigned_abs()]);
    }
    let folder = Folder::new();
    folder.write("laser.csv", &data);
    let session = folder.session(&format!(
        "{MILL}[instrument]\nkind = \"laser\"\n{}[[test]]\nname = \"L\"\ndata = \"laser.csv\"\nbeam = [1, 0, 0]\n",
        parabolas(&["EXX"])
    ));
    let (problem, found) = prepare(&session, 1).unwrap();
    let result = fit::report(&problem, &found).unwrap();
    let [figures] = &result.positioning[..] else { panic!("{:?}", result.positioning) };
    assert_eq!((figures.axis.as_str(), figures.unit.as_str(), figures.positions.len()), ("X", "um", 9));
    assert_eq!(format!("{:.2}", figures.mean_range.unwrap()), "93.65");
    assert_eq!(format!("{:.2}", figures.accuracy.unwrap()), "135.27");
}

/// A table axis: what is read against the table falls where the axis rises. A laser along −X, a positioning error of the
/// table, and a backlash; and the angle about a rotary axis of the table.
#[test]
fn the_figures_of_an_axis_that_carries_the_table_have_the_sign_of_its_deviations() {
    let folder = Folder::new();
    // The table goes 3 µm too far at X = 100, and 1 µm less far in negative direction.
    let mut data = String::from("run,x_mm,displacement_mm\n");
    let mut angles = String::from("run,c_deg,angle_arcsec\n");
    for run in 1..=4 {
        for step in 0..=10 {
            let step = if run % 2 == 1 { step } else { 10 - step };
            let (x, c) = (f64::from(10 * step), f64::from(36 * step));
            let actual = x + 3e-3 * x / 100.0 - if run % 2 == 1 { 0.0 } else { 1e-3 };
            // Along −X, with the reflector of the tool at rest and the optic on the table at `actual`.
            data += &format!("{run},{x},{:.9}\n", actual);
            // The table turns 5″ too far at C = 360°: the tool turns back against it.
            angles += &format!("{run},{c},{:.6}\n", -5.0 * c / 360.0);
        }
    }
    folder.write("laser.csv", &data);
    folder.write("angle.csv", &angles);
    let machine = "[machine]\nname = \"Table\"\nchain = \"w C X b Z t\"\naxis.X.direction = [1, 0, 0]\naxis.Z.direction = [0, 0, 1]\n\
                   axis.C = { direction = [0, 0, 1], origin_mm = [0, 0, 0] }\n[instrument]\nkind = \"laser\"\n";
    let tests = "[[test]]\nname = \"L\"\ndata = \"laser.csv\"\nbeam = [-1, 0, 0]\n[[test]]\nname = \"A\"\nkind = \"angle\"\n\
                 data = \"angle.csv\"\nabout = [0, 0, 1]\n[[test]]\nname = \"bed\"\nkind = \"angle\"\ndata = \"angle.csv\"\nabout = [0, 0, 1]\n\
                 body = \"tool\"\n";
    let session = folder.session(&format!("{machine}{tests}"));
    let rejected: Vec<Vec<bool>> = session.tests.iter().map(|_| vec![false; 44]).collect();
    let found = abbe::identify::positioning::of_session(&session, &rejected);
    // What the axis does not move has no figures.
    let [of_x, of_c] = &found[..] else { panic!("{found:?}") };
    let mean = |test: &abbe::identify::positioning::PositioningTest, place: usize| {
        let position = &test.positions[place];
        [position.forward.unwrap().mean, position.backward.unwrap().mean]
    };
    let near = |found: [f64; 2], expected: [f64; 2]| {
        assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-3), "{found:?}, not {expected:?}");
    };
    near(mean(of_x, 10), [3.0, 2.0]);
    near(mean(of_x, 0), [0.0, -1.0]);
    assert!((of_x.mean_reversal.unwrap() - 1.0).abs() < 1e-3);
    near(mean(of_c, 10), [5.0, 5.0]);
    assert_eq!((of_c.unit.as_str(), of_c.position_unit.as_str()), ("arcsec", "deg"));
}

/// A residual of 10 µm that no effect explains: the value that was not read is no outlier beside it, and the pitch of its
/// row stays.
#[test]
fn a_value_that_was_not_read_is_no_outlier() {
    let folder = Folder::new();
    let mut random = Pcg64::seed_from_u64(3);
    let mut data = String::from("run,x_mm,deviation_um,pitch_arcsec\n");
    for row in 0..60 {
        let x = f64::from(row) * 5.0;
        let deviation = 10.0 + 0.1 * normal(&mut random) + 0.02 * x;
        let cell = if row == 10 { String::new() } else { format!("{deviation:.4}") };
        data += &format!("1,{x},{cell},{:.4}\n", 0.2 * normal(&mut random));
    }
    let session = laser_session(&folder, &data, [0.0; 3], &[]);
    let (problem, _) = prepare(&session, 1).unwrap();
    let rejected: Vec<usize> = (0..60).filter(|row| problem.rejected[0][*row]).collect();
    assert!(rejected.is_empty(), "{rejected:?}");
    assert_eq!((problem.readings(), problem.scalars()), (60, 119));
}

/// Where neither noise is stated, that of each unit follows from its own repeats: readings with 0.4 µm and 0.1″, over
/// sessions. The lever is their ratio, and the figures of each unit are its own.
#[test]
fn the_noise_of_lengths_and_angles_is_found_apart() {
    let folder = Folder::new();
    let mut random = Pcg64::seed_from_u64(19);
    let (mut lengths, mut angles, mut chi) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..20 {
        let mut data = String::from("run,x_mm,deviation_um,pitch_arcsec\n");
        for run in 1..=6 {
            for step in 0..=20 {
                let x = f64::from(if run % 2 == 1 { 10 * step } else { 200 - 10 * step });
                let (deviation, pitch) = (0.4 * normal(&mut random), 0.1 * normal(&mut random));
                data += &format!("{run},{x},{deviation:.5},{pitch:.5}\n");
            }
        }
        folder.write("laser.csv", &data);
        let session = folder.session(&format!(
            "{MILL}[instrument]\nkind = \"laser\"\n[[test]]\nname = \"L\"\ndata = \"laser.csv\"\nbeam = [1, 0, 0]\n"
        ));
        let (problem, found) = prepare(&session, 1).unwrap();
        let result = fit::report(&problem, &found).unwrap();
        lengths.push(result.noise_um);
        angles.push(result.of_angles.unwrap().noise_arcsec);
        chi.push(result.chi_square / result.degrees_of_freedom as f64);
        // A plan and a validation of this session weigh its angles alike.
        let (complete, noise) = abbe::plan::prepared(&session, &Default::default()).unwrap();
        assert!((complete.lever_mm / problem.session.lever_mm - 1.0).abs() < 1e-12);
        assert!((noise.sigma_mm * 1e3 / result.noise_um - 1.0).abs() < 1e-9);
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    // Twenty sessions of about 80 degrees of freedom a unit: 1.8 % of sampling error.
    assert!((mean(&lengths) / 0.4 - 1.0).abs() < 0.055, "{}", mean(&lengths));
    assert!((mean(&angles) / 0.1 - 1.0).abs() < 0.055, "{}", mean(&angles));
    assert!((mean(&chi) - 1.0).abs() < 0.06, "{}", mean(&chi));
}

/// Noise and resolution of a simulation hold for the columns, each unit its own, and the session that is written states
/// them.
#[test]
fn simulated_noise_and_resolution_are_those_of_each_unit() {
    use abbe::identify::simulate::{Simulation, simulate};
    let folder = Folder::new();
    let text = format!(
        "{MILL}[instrument]\nkind = \"laser\"\nnoise_um = 0.5\nnoise_arcsec = 3\nresolution_um = 0.1\nresolution_arcsec = 0.5\n[[test]]\n\
         name = \"L\"\nbeam = [1, 0, 0]\nreflector_mm = [0, 7.77777, -120.123456]\nchannels = [\"vertical\", \"pitch\"]\n\
         sweep = {{ axis = \"X\", from_mm = 0, to_mm = 1000, step_mm = 1, runs = 1, both_directions = false }}\n"
    );
    let session = folder.session(&text);
    let of = |simulation: &Simulation| -> [f64; 2] {
        let drawn = simulate(&session, simulation).unwrap();
        let observed = &drawn.readings[0].observed;
        let deviation = |place: usize, unit: f64, step: f64| {
            let values: Vec<f64> = observed.iter().skip(place).step_by(2).map(|value| value / unit).collect();
            for value in &values {
                assert!((value / step - (value / step).round()).abs() < 1e-6, "{value} is no multiple of {step}");
            }
            (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
        };
        [deviation(0, 1e-3, 0.1), deviation(1, ARCSECOND, 0.5)]
    };
    // 1001 readings: 2.2 % of sampling error.
    let [vertical, pitch] = of(&Simulation { seed: 1, ..Simulation::default() });
    assert!((vertical / 0.5 - 1.0).abs() < 0.07 && (pitch / 3.0 - 1.0).abs() < 0.07, "{vertical} {pitch}");
    let [vertical, pitch] = of(&Simulation { noise_mm: Some(2e-3), seed: 2, ..Simulation::default() });
    assert!((vertical / 2.0 - 1.0).abs() < 0.07 && (pitch / 3.0 - 1.0).abs() < 0.07, "{vertical} {pitch}");
    let [vertical, pitch] = of(&Simulation { noise_rad: Some(10.0 * ARCSECOND), seed: 3, ..Simulation::default() });
    assert!((vertical / 0.5 - 1.0).abs() < 0.07 && (pitch / 10.0 - 1.0).abs() < 0.07, "{vertical} {pitch}");
}

/// Tests of one set-up of a laser have one datum: their difference is theirs, and no datum takes it.
#[test]
fn tests_of_one_set_up_count_from_one_point() {
    let folder = Folder::new();
    let mut random = Pcg64::seed_from_u64(5);
    for (name, offset) in [("one", 0.0), ("two", 0.020)] {
        let mut data = String::from("run,x_mm,displacement_mm\n");
        for run in 1..=2 {
            for step in 0..=30 {
                let x = f64::from(if run == 1 { 10 * step } else { 300 - 10 * step });
                data += &format!("{run},{x},{:.6}\n", x + 431.7 + offset + 1e-4 * normal(&mut random));
            }
        }
        folder.write(&format!("{name}.csv"), &data);
    }
    let test =
        |name: &str| format!("[[test]]\nname = \"{name}\"\ndata = \"{name}.csv\"\nsetup = \"S\"\nbeam = [1, 0, 0]\n");
    let session = folder.session(&format!("{MILL}{LASER}{}{}", test("one"), test("two")));
    let (problem, found) = prepare(&session, 1).unwrap();
    let mean = |test: usize| found.residuals[test].iter().sum::<f64>() / found.residuals[test].len() as f64;
    assert!((mean(1) - mean(0) - 0.020).abs() < 1e-4, "{} {}", mean(0), mean(1));
    assert_eq!(problem.parameters.list.iter().filter(|one| one.id.starts_with("zero.displacement")).count(), 1);
}

/// A file that cannot be what its columns say is refused with the place and what to do.
#[test]
fn readings_in_another_unit_and_channels_without_a_value_are_refused() {
    let folder = Folder::new();
    let refused = |columns: &str, row: &dyn Fn(f64) -> String, expected: &str| {
        let rows: String = (0..=20).map(|step| row(10.0 * f64::from(step)) + "\n").collect();
        folder.write("laser.csv", &format!("run,x_mm,{columns}\n{rows}"));
        folder.write(
            "session.toml",
            &format!("{MILL}{LASER}[[test]]\nname = \"L\"\ndata = \"laser.csv\"\nbeam = [1, 0, 0]\n"),
        );
        let path = folder.0.path().join("session.toml");
        let fault = files::session(&path, &ReadOptions::default()).unwrap_err();
        let fault = format!("{fault}; {}", fault.help().unwrap_or_default());
        assert!(fault.contains(expected), "{fault}");
    };
    refused("displacement_mm", &|x| format!("1,{x},{}", x / 1000.0), "differs from the travel along the beam by");
    refused("displacement_mm", &|x| format!("1,{x},{}", -x), "differs from the travel along the beam by 100.000 mm");
    refused("pitch_deg", &|x| format!("1,{x},{}", x / 20.0), "the readings of `pitch` differ from their median");
    refused("displacement_mm,pitch_arcsec", &|x| format!("1,{x},{x},"), "no row has a value of `pitch`");
    let lacks_both = |x: f64| if x == 50.0 { format!("1,{x},,") } else { format!("1,{x},{x},0") };
    refused("displacement_mm,pitch_arcsec", &lacks_both, "no channel has a value in this row");
}

/// Deviations in mm under a name in µm are smaller than any instrument resolves: a warning.
#[test]
fn deviations_in_another_unit_are_a_warning() {
    let folder = Folder::new();
    let mut random = Pcg64::seed_from_u64(9);
    for (unit, doubts) in [(1.0, false), (1e-3, true)] {
        let mut data = String::from("run,x_mm,deviation_um\n");
        for step in 0..=30 {
            let x = f64::from(10 * step);
            data += &format!("1,{x},{:.9}\n", (0.02 * x + 0.1 * normal(&mut random)) * unit);
        }
        let session = laser_session(&folder, &data, [0.0; 3], &["EXX"]);
        let warned = session.warnings.iter().any(|warning| warning.contains("is the column in mm"));
        assert_eq!(warned, doubts, "{:?}", session.warnings);
    }
}

/// A noise of a unit in which nothing is read is named.
#[test]
fn a_noise_of_another_unit_is_a_warning() {
    let folder = Folder::new();
    folder.write("level.csv", "run,x_mm,angle_arcsec\n1,0,0.1\n1,10,0.2\n1,20,0.1\n");
    let session = folder.session(&format!(
        "{MILL}[instrument]\nkind = \"angle\"\nnoise_um = 0.2\n[[test]]\nname = \"L\"\ndata = \"level.csv\"\nabout = [0, 1, 0]\n"
    ));
    assert!(session.warnings.iter().any(|warning| warning.contains("state `noise_arcsec`")), "{:?}", session.warnings);
}
