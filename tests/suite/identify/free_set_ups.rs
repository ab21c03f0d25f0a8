//! What a session does not know of its set-up is found from any start. Readings are those of rigid motions of nalgebra, which
//! share no code with the chain.

mod frames;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use abbe::files::robot::dh::{Convention, DhRow, Table};
use abbe::files::{self, ReadOptions};
use abbe::identify::fit::{FitResult, prepare, report};
use abbe::identify::noise::NoiseSource;
use abbe::identify::plausibility::{SuggestionKind, accepted};
use abbe::identify::results::Finding;
use abbe::model::Diagnostic;
use abbe::model::axis::AxisKind;
use abbe::model::session::Session;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

use crate::suite::ready;

/// Noise of a coordinate, mm, and of an angle, rad.
const NOISE_MM: f64 = 0.02;
const NOISE: f64 = 1e-4;
const POSES: usize = 60;

/// An axis on the tool side: its name, whether it turns, direction and origin, mm.
type Axis = (&'static str, bool, [f64; 3], [f64; 3]);

const UR5E: &[Axis] = &[
    ("J1", true, [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]),
    ("J2", true, [0.0, -1.0, 0.0], [0.0, 0.0, 162.5]),
    ("J3", true, [0.0, -1.0, 0.0], [-425.0, 0.0, 162.5]),
    ("J4", true, [0.0, -1.0, 0.0], [-817.2, 0.0, 162.5]),
    ("J5", true, [0.0, 0.0, -1.0], [-817.2, -133.3, 162.5]),
    ("J6", true, [0.0, -1.0, 0.0], [-817.2, -133.3, 62.8]),
];
const SCARA: &[Axis] = &[
    ("J1", true, [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]),
    ("J2", true, [0.0, 0.0, 1.0], [325.0, 0.0, 0.0]),
    ("Z", false, [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]),
    ("J4", true, [0.0, 0.0, 1.0], [600.0, 0.0, 0.0]),
];
const RAIL: &[Axis] = &[
    ("X", false, [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
    ("J1", true, [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]),
    ("J2", true, [0.0, 1.0, 0.0], [150.0, 0.0, 500.0]),
    ("J3", true, [0.0, 1.0, 0.0], [150.0, 0.0, 1200.0]),
    ("J4", true, [1.0, 0.0, 0.0], [150.0, 0.0, 1300.0]),
    ("J5", true, [0.0, 1.0, 0.0], [850.0, 0.0, 1300.0]),
];
const GIMBAL: &[Axis] =
    &[("AZ", true, [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]), ("EL", true, [0.0, -1.0, 0.0], [0.0, 0.0, 50.0])];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Tracker,
    Pose,
    Distance,
}

/// A simulated machine at random poses.
struct Simulated {
    axes: &'static [Axis],
    errors: Vec<Isometry3<f64>>,
    random: Pcg64,
}

fn vector(random: &mut Pcg64, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| size * random.sample::<f64, _>(StandardNormal))
}

fn direction(random: &mut Pcg64) -> Vector3<f64> {
    vector(random, 1.0).normalize()
}

impl Simulated {
    fn new(axes: &'static [Axis], seed: u64) -> Simulated {
        let mut random = Pcg64::seed_from_u64(seed);
        let error = |(_, turns, ..): &Axis| {
            let shift = if *turns { vector(&mut random, 0.2) } else { Vector3::zeros() };
            let turn = if *turns { vector(&mut random, 3e-4) } else { Vector3::zeros() };
            Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn))
        };
        let errors = axes.iter().map(error).collect();
        Simulated { axes, errors, random }
    }

    fn pose(&mut self) -> Vec<f64> {
        let random = &mut self.random;
        self.axes
            .iter()
            .map(|(_, turns, ..)| if *turns { 2.5 } else { 200.0 } * (2.0 * random.random::<f64>() - 1.0))
            .collect()
    }

    fn carried(&self, pose: &[f64]) -> Isometry3<f64> {
        let joints = self.axes.iter().zip(&self.errors).zip(pose);
        joints.fold(Isometry3::identity(), |frame, (((_, turns, along, origin), error), q)| {
            let (along, origin) = (Vector3::from(*along), Translation3::from(Vector3::from(*origin)));
            let moved = match turns {
                true => Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_scaled_axis(along * *q)),
                false => Isometry3::translation(along.x * q, along.y * q, along.z * q),
            };
            frame * origin * error * moved * origin.inverse()
        })
    }

    fn machine(&self) -> String {
        let names: Vec<&str> = self.axes.iter().map(|(name, ..)| *name).collect();
        let mut text = format!("name = \"m\"\nchain = \"w b {} t\"\n", names.join(" "));
        for (name, turns, along, origin) in self.axes {
            let (kind, travel) = if *turns { ("rotary", "deg") } else { ("linear", "mm") };
            let _ = writeln!(
                text,
                "[axis.{name}]\nkind = \"{kind}\"\ndirection = {along:?}\norigin_mm = {origin:?}\ntravel_{travel} = [-200, 200]"
            );
        }
        text
    }

    /// The cells of a pose, and their columns.
    fn cells(&self, pose: &[f64]) -> Vec<f64> {
        self.axes.iter().zip(pose).map(|((_, turns, ..), q)| if *turns { q.to_degrees() } else { *q }).collect()
    }

    fn columns(&self) -> Vec<String> {
        let unit = |turns: bool| if turns { "deg" } else { "mm" };
        self.axes.iter().map(|(name, turns, ..)| format!("{}_{}", name.to_lowercase(), unit(*turns))).collect()
    }

    /// Writes a session whose free points start so many mm from where they are. `reread` changes the rotation and the position
    /// that a pose is written with.
    fn write(
        &mut self,
        folder: &Path,
        kind: Kind,
        off_mm: f64,
        reread: impl Fn(Isometry3<f64>) -> ([f64; 3], [f64; 3]),
    ) -> Session {
        let mut aside = Pcg64::seed_from_u64(99);
        let tip =
            self.axes.last().map(|axis| Vector3::from(axis.3)).unwrap_or_default() + Vector3::new(30.0, -90.0, 20.0);
        let stands = Isometry3::from_parts(
            Translation3::new(2500.0, 400.0, 900.0),
            UnitQuaternion::from_scaled_axis(direction(&mut self.random) * 2.0),
        );
        let held = UnitQuaternion::from_scaled_axis(direction(&mut self.random) * 1.4);
        let errors: Vec<String> =
            self.axes.iter().filter(|axis| axis.1).map(|axis| format!("\"E?0{}\"", axis.0)).collect();
        let (word, noise) = match kind {
            Kind::Tracker => ("tracker", format!("noise_um = {}", 1e3 * NOISE_MM)),
            Kind::Pose => {
                ("pose", format!("noise_um = {}\nnoise_arcsec = {}", 1e3 * NOISE_MM, 3600.0 * NOISE.to_degrees()))
            }
            Kind::Distance => ("distance", format!("noise_um = {}", 250.0 * NOISE_MM)),
        };
        let mut text = format!(
            "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"{word}\"\n{noise}\n[unknowns]\nerrors = [{}]\n",
            errors.join(", ")
        );
        fs::write(folder.join("machine.toml"), self.machine()).unwrap();
        let count = if kind == Kind::Distance { 4 } else { 1 };
        let aside_of_tip = direction(&mut aside) * off_mm;
        for number in 0..count {
            let station =
                [[900.0, 100.0, -100.0], [-800.0, 700.0, 50.0], [200.0, -900.0, 300.0], [100.0, 300.0, 1500.0]]
                    .map(Vector3::from)[number];
            let mut columns = self.columns();
            columns.extend(
                match kind {
                    Kind::Tracker => &["px_mm", "py_mm", "pz_mm"][..],
                    Kind::Pose => &["px_mm", "py_mm", "pz_mm", "rx_deg", "ry_deg", "rz_deg"],
                    Kind::Distance => &["distance_mm"],
                }
                .iter()
                .map(ToString::to_string),
            );
            let mut csv = columns.join(",") + "\n";
            for _ in 0..POSES {
                let pose = self.pose();
                let frame = self.carried(&pose);
                let point = frame.transform_point(&Point3::from(tip)).coords;
                let mut cells = self.cells(&pose);
                let seen = stands.transform_point(&Point3::from(point)).coords + vector(&mut self.random, NOISE_MM);
                match kind {
                    Kind::Tracker => cells.extend(seen.iter()),
                    Kind::Pose => {
                        let wobble = UnitQuaternion::from_scaled_axis(vector(&mut self.random, NOISE));
                        let turn = wobble * stands.rotation * frame.rotation * held;
                        let (place, angles) = reread(Isometry3::from_parts(Translation3::from(seen), turn));
                        cells.extend(place);
                        cells.extend(angles.map(f64::to_degrees));
                    }
                    Kind::Distance => {
                        let noise = 0.25 * NOISE_MM * self.random.sample::<f64, _>(StandardNormal);
                        cells.push((point - station).norm() + 3.3 + noise);
                    }
                }
                let cells: Vec<String> = cells.iter().map(|cell| format!("{cell:.9}")).collect();
                writeln!(csv, "{}", cells.join(",")).unwrap();
            }
            fs::write(folder.join(format!("{number}.csv")), csv).unwrap();
            let shown = |point: Vector3<f64>| format!("[{:.6}, {:.6}, {:.6}]", point.x, point.y, point.z);
            let (start, place) = (shown(tip + aside_of_tip), shown(station + direction(&mut aside) * off_mm));
            let points = match kind {
                Kind::Distance => {
                    format!(
                        "reflector_mm = {start}\nreflector_u_um = inf\nstation_mm = {place}\nstation_frame = \"bed\"\nsetup = \"S{number}\""
                    )
                }
                _ => format!("target_mm = {start}\ntarget_u_um = inf"),
            };
            let path = "path = { kind = \"list\" }";
            let _ = writeln!(text, "[[test]]\nname = \"T{number}\"\ndata = \"{number}.csv\"\n{path}\n{points}");
        }
        fs::write(folder.join("session.toml"), text).unwrap();
        files::session(&folder.join("session.toml"), &ReadOptions::default()).unwrap()
    }
}

fn as_it_is(pose: Isometry3<f64>) -> ([f64; 3], [f64; 3]) {
    (pose.translation.vector.into(), pose.rotation.scaled_axis().into())
}

fn fitted(session: &Session) -> Result<FitResult, Diagnostic> {
    let (problem, fit) = prepare(session, 1)?;
    report(&problem, &fit)
}

/// Starts off by up to 500 mm end where the right one does: the same χ² to 10⁻⁶, the same location errors, and a residual that
/// agrees with the noise.
#[test]
fn any_start_gives_the_same_fit() {
    let sets: u64 = std::env::var("ABBE_STUDY").ok().and_then(|sets| sets.parse().ok()).unwrap_or(1);
    let (mut fits, mut refused, mut differ) = (0, 0, 0);
    for (number, axes) in [UR5E, SCARA, GIMBAL].into_iter().enumerate() {
        for kind in [Kind::Tracker, Kind::Pose, Kind::Distance] {
            // Two axes before stations at four places do not separate the reflector from them.
            if kind == Kind::Distance && axes.len() < 4 {
                continue;
            }
            for seed in 0..sets {
                let mut right: Option<FitResult> = None;
                for off_mm in [0.0, 0.3, 3.0, 30.0, 150.0, 500.0] {
                    let folder = tempfile::tempdir().unwrap();
                    let session =
                        Simulated::new(axes, 100 * number as u64 + seed).write(folder.path(), kind, off_mm, as_it_is);
                    fits += 1;
                    let Ok(found) = fitted(&session) else {
                        refused += 1;
                        println!("{kind:?} {number} {seed} {off_mm}: refused");
                        continue;
                    };
                    let ratio = found.model.chi_square / found.model.degrees_of_freedom as f64;
                    assert!(ratio < 1.4, "{kind:?} {number} {off_mm}: {ratio}");
                    assert!(accepted(&found.plausibility).is_ok());
                    let Some(right) = &right else {
                        right = Some(found);
                        continue;
                    };
                    let is_same = (found.model.chi_square / right.model.chi_square - 1.0).abs() < 1e-6;
                    differ += u64::from(!is_same);
                    let errors = |result: &FitResult| {
                        let errors = result.model.parameters.iter().filter(|one| one.id.starts_with('E'));
                        errors.map(|one| (one.id.clone(), one.value, one.u)).collect::<Vec<_>>()
                    };
                    for ((id, value, u), (other, expected, _)) in errors(&found).into_iter().zip(errors(right)) {
                        assert_eq!(id, other);
                        // Along parallel axes a target stays where it is stated, and positions of tilted axes refer to it.
                        let is_parallel = axes.len() == SCARA.len();
                        if is_same && !(is_parallel && id[1..3] == *"X0") {
                            let most = if is_parallel { 0.1 } else { 0.01 } * u;
                            assert!((value - expected).abs() < most, "{id}: {value} and {expected}, u = {u}");
                        }
                    }
                }
            }
        }
    }
    println!("{fits} fits: {refused} refused, {differ} with another χ²");
    assert!(refused == 0 && differ * 100 <= fits, "{refused} {differ} of {fits}");
}

/// A noise that is not stated is that of repeats before anything is fitted, or else of the residual, where set-up quantities may
/// be collinear without their priors.
#[test]
fn a_noise_that_is_not_stated_is_that_of_repeats_or_of_the_residual() {
    for (file, source) in [
        ("hermle-c600u/measured/session.toml", NoiseSource::Repeats),
        ("table-and-head/measured/session.toml", NoiseSource::Residual),
    ] {
        let mut session = files::session(&ready(file), &ReadOptions::default()).unwrap();
        let stated = fitted(&session).unwrap();
        session.noise_mm = None;
        session.resolution_mm = None;
        let found = fitted(&session).unwrap();
        assert_eq!(found.model.noise.source, source);
        assert!((found.model.noise.value / 0.3 - 1.0).abs() < 0.06, "{file}: {}", found.model.noise.value);
        for (own, expected) in found.model.parameters.iter().zip(&stated.model.parameters) {
            assert_eq!(own.id, expected.id);
            let apart = (own.value - expected.value).abs();
            assert!(apart < 0.1 * expected.u, "{file}, {}: {} {}", own.id, own.value, expected.value);
        }
    }
}

/// A pose file in another convention is refused with that convention; the same file as it is, is not.
#[test]
fn a_convention_that_explains_poses_is_named() {
    type Written = fn(Isometry3<f64>) -> ([f64; 3], [f64; 3]);
    let written: [(&str, Written); 8] = [
        ("as it is", as_it_is),
        ("inverse ones: of the instrument", |pose| as_it_is(pose.inverse())),
        ("rotations are the inverse ones", |pose| {
            (pose.translation.vector.into(), pose.rotation.inverse().scaled_axis().into())
        }),
        ("measured positions are 1,000 times too large", |pose| {
            let (place, angles) = as_it_is(pose);
            (place.map(|mm| 1e3 * mm), angles)
        }),
        ("py and pz are exchanged, and the rotations are not", |pose| {
            let (place, angles) = as_it_is(pose);
            ([place[0], place[2], place[1]], angles)
        }),
        ("the components X and Z of the rotation are exchanged", |pose| {
            let (place, angles) = as_it_is(pose);
            (place, [angles[2], angles[1], angles[0]])
        }),
        ("roll, pitch and yaw", |pose| {
            let (roll, pitch, yaw) = pose.rotation.euler_angles();
            (pose.translation.vector.into(), [roll, pitch, yaw])
        }),
        ("A, B, C", |pose| {
            let (roll, pitch, yaw) = pose.rotation.euler_angles();
            (pose.translation.vector.into(), [yaw, pitch, roll])
        }),
    ];
    for (words, reread) in written {
        let folder = tempfile::tempdir().unwrap();
        let session = Simulated::new(UR5E, 7).write(folder.path(), Kind::Pose, 0.0, reread);
        let told = match fitted(&session) {
            Ok(found) => found.warnings.join("; "),
            Err(error) => error.to_string(),
        };
        if words == "as it is" {
            assert!(!told.contains("explained if"), "{told}");
        } else {
            assert!(told.contains(words), "{words}: {told}");
        }
    }
}

/// A machine whose links run to the other side explains readings in which every joint has the opposite sign, with no axis beside
/// its place. The sign is named.
#[test]
fn the_opposite_sign_of_every_joint_is_named() {
    for kind in [Kind::Tracker, Kind::Pose] {
        for seed in 0..3 {
            let folder = tempfile::tempdir().unwrap();
            let mut session = Simulated::new(UR5E, seed).write(folder.path(), kind, 0.0, as_it_is);
            let machine = Arc::make_mut(&mut session.machine);
            machine.axes.iter_mut().for_each(|axis| axis.direction = axis.direction.map(|along| -along));
            let told = match fitted(&session) {
                Ok(found) => found.warnings.join("; "),
                Err(error) => error.to_string(),
            };
            let words = "explained if the positions of J1, J2, J3, J4, J5, J6 have the opposite sign";
            assert!(told.contains(words), "{kind:?}, {seed}: {told}");
        }
    }
}

/// Writes the rotation vectors of a file of poses as quaternions, of either sign as the angle happens to be.
fn with_quaternions(file: &Path) {
    let table = fs::read_to_string(file).unwrap();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let (others, angles) = cells.split_at(cells.len() - 3);
        let angles: Vec<f64> = angles.iter().map(|cell| cell.parse::<f64>().unwrap().to_radians()).collect();
        let angle = Vector3::from_column_slice(&angles).norm();
        let (sine, cosine) = (0.5 * angle).sin_cos();
        let [x, y, z] = std::array::from_fn(|k| angles[k] / angle * sine);
        format!("{},{x:.12},{y:.12},{z:.12},{cosine:.12}", others.join(","))
    };
    let rows = table.lines().skip(1).map(row);
    let header = table.lines().next().unwrap().replace("rx_deg,ry_deg,rz_deg", "qx,qy,qz,qw");
    fs::write(file, std::iter::once(header).chain(rows).collect::<Vec<_>>().join("\n")).unwrap();
}

/// One column of poses has the opposite sign: of the position, or of the rotation, as a rotation vector or as a quaternion. It
/// is named first, as a sign, and alone. The poses as they are contradict nothing.
#[test]
fn a_column_of_poses_with_the_opposite_sign_is_named() {
    let sets: u64 = std::env::var("ABBE_STUDY").ok().and_then(|sets| sets.parse().ok()).unwrap_or(1);
    let (mut count, mut missed) = (0, Vec::new());
    for (number, axes) in [UR5E, SCARA, RAIL].into_iter().enumerate() {
        for (seed, column) in (0..sets).flat_map(|seed| (0..7).map(move |column| (seed, column))) {
            let negated = |pose| {
                let (mut place, mut angles) = as_it_is(pose);
                if let Some(cell) = place.iter_mut().chain(&mut angles).nth(column) {
                    *cell = -*cell;
                }
                (place, angles)
            };
            let folder = tempfile::tempdir().unwrap();
            let session =
                Simulated::new(axes, 300 + 10 * number as u64 + seed).write(folder.path(), Kind::Pose, 0.0, negated);
            let mut sessions = vec![session];
            if column > 2 {
                with_quaternions(&folder.path().join("0.csv"));
                sessions.push(files::session(&folder.path().join("session.toml"), &ReadOptions::default()).unwrap());
            }
            let letter = ["X", "Y", "Z"][column % 3];
            let words = match column {
                0..3 => format!("explained if p{} has the opposite sign", letter.to_lowercase()),
                3..6 => format!("explained if the component {letter} of the rotation has the opposite sign"),
                _ => String::new(),
            };
            for session in sessions {
                let told = match fitted(&session) {
                    Ok(found) => {
                        let suggested = &found.plausibility.suggestions;
                        assert!(suggested.iter().all(|one| one.kind == SuggestionKind::ColumnSign), "{suggested:?}");
                        found.warnings.join("; ")
                    }
                    Err(error) => error.to_string(),
                };
                count += 1;
                let is_named = told.contains(&words) && !told.contains(", or if ");
                if !is_named || words.is_empty() && told.contains("explained if") {
                    missed.push(format!("robot {number}, {seed}, column {column}: {told}"));
                }
            }
        }
    }
    println!("{} of {count} are not named", missed.len());
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

/// A table of a UR5e in one convention, read in the other one, gives a machine of other axes. The readings are of the right
/// machine, and the convention is named.
#[test]
fn the_other_convention_of_a_table_is_named() {
    let d = [162.5, 0.0, 0.0, 133.3, 99.7, 99.6];
    let standard = ([0.0, -425.0, -392.2, 0.0, 0.0, 0.0], [90.0, 0.0, 0.0, 90.0, -90.0, 0.0]);
    let modified = ([0.0, 0.0, -425.0, -392.2, 0.0, 0.0], [0.0, 90.0, 0.0, 0.0, 90.0, -90.0]);
    for kind in [Kind::Tracker, Kind::Pose] {
        for ((a, alpha), other, words) in [
            (standard, Convention::Modified, "read as modified, which is standard"),
            (modified, Convention::Standard, "read as standard, which is modified"),
        ] {
            let row = |k: usize| {
                let (a, alpha, d, kind) = (a[k], f64::to_radians(alpha[k]), d[k], Some(AxisKind::Rotary));
                DhRow { name: format!("J{}", k + 1), a, alpha, d, kind, ..DhRow::default() }
            };
            let table = Table { convention: other, rows: (0..6).map(row).collect(), assumed: Vec::new() };
            let folder = tempfile::tempdir().unwrap();
            let mut session = Simulated::new(UR5E, 7).write(folder.path(), kind, 0.0, as_it_is);
            let machine = Arc::make_mut(&mut session.machine);
            for (axis, joint) in machine.axes.iter_mut().zip(table.chain("m").joints) {
                axis.direction = (joint.pose.rotation * Vector3::z()).into();
                axis.origin_mm = joint.pose.translation.vector.into();
            }
            let told = match fitted(&session) {
                Ok(found) => accepted(&found.plausibility).unwrap_err().to_string(),
                Err(error) => error.to_string(),
            };
            assert!(told.contains(words), "{kind:?}, {words}: {told}");
        }
    }
}

/// Readings of three poses determine few combinations; none of them is said to leave every reading unchanged that changes
/// them by less than the noise.
#[test]
fn a_weak_combination_is_not_called_confounded() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = Simulated::new(UR5E, 3).write(folder.path(), Kind::Tracker, 0.0, as_it_is);
    let exact = fitted(&session).unwrap();
    assert!(exact.model.unobservable.iter().all(|one| one.finding == Finding::Structural));
    session.noise_mm = Some(30.0);
    let noisy = fitted(&session).unwrap();
    let weak = noisy.model.unobservable.iter().filter(|one| one.finding == Finding::Weak).count();
    assert!(weak > 0 && noisy.model.unobservable.len() > exact.model.unobservable.len());
    for one in noisy.model.unobservable.iter().filter(|one| one.finding == Finding::Weak) {
        assert!(one.why.contains("weakly determined") && !one.why.contains("unchanged"), "{}", one.why);
    }
}
