//! Noise from three reflectors on the flange of a robot: readings of an independent chain of rotation matrices, in a session
//! that states no noise and repeats no pose.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use abbe::apply::compare::{CompareOptions, Input, compare_inputs};
use abbe::files::{self, ReadOptions};
use abbe::identify::fit::{FitResult, base, prepare, report};
use abbe::identify::noise::NoiseSource;
use abbe::identify::results::{GoodnessVerdict, NotJudged, TraceVerdict};
use abbe::model::session::Session;
use abbe::trace::result::EffectResult;
use abbe::trace::{TraceOptions, trace};
use nalgebra::{Rotation3, Unit, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

use crate::suite::{abbe, ready, text};

/// Noise of a coordinate, mm.
const NOISE_MM: f64 = 0.03;
pub(super) const POSES: usize = 60;
/// An eccentricity of J2, rad.
const ECCENTRIC: f64 = 3e-4;
/// The reflectors with all joints at zero, mm.
pub(super) const TARGETS: [[f64; 3]; 3] = [[-1184.0, -349.0, 12.0], [-1104.0, -339.0, 42.0], [-1174.0, -359.0, 102.0]];
/// Directions and origins of the joints of the UR10 at zero, as in `sessions/ur10/machine.toml`.
const JOINTS: [([f64; 3], [f64; 3]); 6] = [
    ([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]),
    ([0.0, -1.0, 0.0], [0.0, 0.0, 127.3]),
    ([0.0, -1.0, 0.0], [-612.0, 0.0, 127.3]),
    ([0.0, -1.0, 0.0], [-1184.3, 0.0, 127.3]),
    ([0.0, 0.0, -1.0], [-1184.3, -163.941, 127.3]),
    ([0.0, -1.0, 0.0], [-1184.3, -163.941, 11.6]),
];

fn turn(about: [f64; 3], angle: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Unit::new_normalize(Vector3::from(about)), angle)
}

/// A target in R at these joint angles. Each joint has a tilt and a zero error; `eccentric` is an angular error of J2 once per
/// turn, rad, and J5 is shifted by `shift_mm` along X.
fn carried(target: [f64; 3], joints: [f64; 6], [eccentric, shift_mm]: [f64; 2]) -> Vector3<f64> {
    carried_by(target, joints, eccentric, |joint| if joint == 5 { [shift_mm, 0.0, 0.0] } else { [0.0; 3] })
}

/// The same with any shift of each joint, mm.
fn carried_by(
    target: [f64; 3],
    joints: [f64; 6],
    eccentric: f64,
    shift_mm: impl Fn(usize) -> [f64; 3],
) -> Vector3<f64> {
    let mut point = Vector3::from(target);
    for (number, (direction, origin)) in JOINTS.iter().enumerate().rev() {
        let k = number as f64;
        let origin = Vector3::from(*origin);
        let location = turn([1.0, 0.0, 0.0], 2e-4 * (1.0 + k).sin())
            * turn([0.0, 1.0, 0.0], -3e-4 * (2.0 + k).cos())
            * turn([0.0, 0.0, 1.0], 2.5e-4 * (0.5 + k).sin());
        let motion = if number == 1 {
            turn([0.0, 1.0, 0.0], eccentric * (joints[1] + 0.4).cos())
        } else {
            Rotation3::identity()
        };
        let shift = Vector3::from(shift_mm(number + 1));
        point = origin + shift + location * (motion * (turn(*direction, joints[number]) * (point - origin)));
    }
    point
}

/// A session of these reflectors, one test each.
fn session(seed: u64, targets: &[[f64; 3]], eccentric: f64) -> Session {
    session_of(POSES, seed, targets, [eccentric, 0.0])
}

/// The same with another number of poses, and a shift of J5 in mm.
fn session_of(poses: usize, seed: u64, targets: &[[f64; 3]], errors: [f64; 2]) -> Session {
    let folder = tempfile::tempdir().unwrap();
    let file = written(folder.path(), poses, seed, targets, errors);
    files::session(&file, &ReadOptions::default()).unwrap()
}

/// The files of this session in a folder.
pub(super) fn written(folder: &Path, poses: usize, seed: u64, targets: &[[f64; 3]], errors: [f64; 2]) -> PathBuf {
    written_by(folder, poses, seed, targets, |target, joints| carried(target, joints, errors))
}

/// The same of a robot that carries a target to `place` at its joint angles.
fn written_by(
    folder: &Path,
    poses: usize,
    seed: u64,
    targets: &[[f64; 3]],
    place: impl Fn([f64; 3], [f64; 6]) -> Vector3<f64>,
) -> PathBuf {
    let mut generator = Pcg64::seed_from_u64(seed);
    fs::copy(ready("ur10/machine.toml"), folder.join("machine.toml")).unwrap();
    let reach = [2.8; 6];
    let poses: Vec<[f64; 6]> =
        (0..poses).map(|_| reach.map(|most| most * (2.0 * generator.random::<f64>() - 1.0))).collect();
    let mut toml =
        "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"tracker\"\n[unknowns]\nerrors = [\"E?0J*\"]\n"
            .to_string();
    let stands = turn([0.2, -0.3, 1.0], 0.8);
    for (number, target) in targets.iter().enumerate() {
        let mut csv = "j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,px_mm,py_mm,pz_mm\n".to_string();
        for pose in &poses {
            let seen = stands * place(*target, *pose) + Vector3::new(2500.0, 400.0, 900.0);
            let seen = seen.map(|x| x + NOISE_MM * generator.sample::<f64, _>(StandardNormal));
            let cells = pose.iter().map(|q| q.to_degrees()).chain(seen.iter().copied());
            let cells: Vec<String> = cells.map(|x| format!("{x:.9}")).collect();
            writeln!(csv, "{}", cells.join(",")).unwrap();
        }
        fs::write(folder.join(format!("{number}.csv")), csv).unwrap();
        write!(
            toml,
            "[[test]]\nname = \"T{number}\"\ndata = \"{number}.csv\"\nsetup = \"S\"\npath = {{ kind = \"list\" }}\ntarget_mm = {target:?}\n\
             target_u_um = inf\n"
        )
        .unwrap();
    }
    fs::write(folder.join("session.toml"), toml).unwrap();
    folder.join("session.toml")
}

fn fitted(session: &Session) -> FitResult {
    let (problem, fit) = prepare(session, 1).unwrap();
    report(&problem, &fit).unwrap()
}

/// Three poses of one reflector are nine numbers, and determine nine parameters: no noise is overstated, stated or not.
#[test]
fn as_many_parameters_as_readings_leave_no_degrees_of_freedom() {
    for noise_mm in [None, Some(NOISE_MM)] {
        let session = Session { noise_mm, ..session_of(3, 5, &TARGETS[..1], [0.0; 2]) };
        let found = fitted(&session);
        assert_eq!((found.model.fit.readings, found.model.rank, found.model.degrees_of_freedom), (3, 9, 0));
        let goodness = found.model.outcome.goodness;
        assert_eq!(goodness.verdict, GoodnessVerdict::NotJudged);
        assert_eq!(goodness.not_judged, Some(NotJudged::NoDegreesOfFreedom));
        assert!(!found.warnings.iter().any(|warning| warning.contains("noise")), "{:?}", found.warnings);
    }
    // More poses can be judged.
    let session = Session { noise_mm: Some(NOISE_MM), ..session_of(30, 5, &TARGETS[..1], [0.0; 2]) };
    assert_eq!(fitted(&session).model.outcome.goodness.verdict, GoodnessVerdict::Agrees);
}

/// Over 100 sets the estimate follows χ² with 3 degrees of freedom for each pose but one, and the fit agrees with it. An
/// undeclared eccentricity does not change the estimate, and exceeds it.
#[test]
fn three_reflectors_give_the_noise_and_judge_the_model() {
    const SETS: u64 = 100;
    let freedom = 3.0 * (POSES as f64 - 1.0);
    let (mut mean, mut inside, mut agree, mut exceed) = (0.0, 0, 0, 0);
    for seed in 0..SETS {
        let clean = fitted(&session(seed, &TARGETS, 0.0));
        assert_eq!(clean.model.noise.source, NoiseSource::Targets);
        let ratio = (clean.model.noise.value * 1e-3 / NOISE_MM).powi(2);
        mean += ratio / SETS as f64;
        // χ² is nearly normal with so many degrees of freedom.
        inside += u64::from((ratio - 1.0).abs() < 1.96 * (2.0 / freedom).sqrt());
        agree += u64::from(clean.model.outcome.goodness.verdict == GoodnessVerdict::Agrees);
        if seed % 10 == 0 {
            let eccentric = fitted(&session(seed, &TARGETS, ECCENTRIC));
            assert_eq!(eccentric.model.noise.source, NoiseSource::Targets);
            exceed += u64::from(eccentric.model.outcome.goodness.verdict == GoodnessVerdict::Exceeds);
            assert!(
                (eccentric.model.noise.value / clean.model.noise.value - 1.0).abs() < 0.01,
                "{}",
                eccentric.model.noise.value
            );
        }
    }
    println!(
        "{SETS} sets: mean of σ² {mean:.4} of the true one, {inside} within 95 %, {agree} agree; of 10 with an eccentricity \
         {exceed} exceed"
    );
    assert!((mean - 1.0).abs() < 4.0 * (2.0 / freedom / SETS as f64).sqrt(), "{mean}");
    assert!((88..=100).contains(&inside) && agree >= 98 && exceed == 10, "{inside} {agree} {exceed}");
}

/// One reflector leaves the noise open, so nothing is explained. Three make a verdict: over 20 sets each, without an effect
/// and with an eccentricity. The search on poses claims an effect without one in about 5 % of sets, and structure in 1 to 3 %.
#[test]
fn a_trace_is_judged_by_the_noise_of_three_reflectors() {
    const SETS: u64 = 20;
    let traced = |seed: u64, targets: &[[f64; 3]], eccentric: f64| {
        let result = trace(&session(seed, targets, eccentric), &TraceOptions::default(), &|_| true).unwrap().result;
        let name = |effect: &EffectResult| {
            format!("{} {} {:?}", effect.name.component, effect.name.shape, effect.name.order.map(|order| order as i64))
        };
        let names: Vec<String> = result.effects.iter().map(name).collect();
        println!("{seed}, {eccentric}: {:?} {names:?} p = {:.3}", result.verdict, result.remainder.p_value);
        (result.verdict, names, result.after.noise.source)
    };
    let (mut clean, mut explained) = (0, 0);
    for seed in 0..SETS {
        let (verdict, names, source) = traced(seed, &TARGETS, 0.0);
        assert_eq!(source, NoiseSource::Targets);
        clean += u64::from(verdict == TraceVerdict::Clean && names.is_empty());
        let (verdict, names, source) = traced(seed, &TARGETS, ECCENTRIC);
        assert_eq!(source, NoiseSource::Targets);
        let is_named = names.iter().any(|name| name == "EBJ2 harmonic Some(1)");
        explained += u64::from(verdict == TraceVerdict::Explained && is_named);
    }
    println!("of {SETS} sets: {clean} clean without an effect, {explained} explained with an eccentricity");
    assert!(clean >= 14 && explained >= 17, "{clean} {explained}");
    let (verdict, _, source) = traced(3, &TARGETS[..1], 0.0);
    assert_eq!((verdict, source), (TraceVerdict::NotJudged, NoiseSource::Residual));
}

/// A shift of J5 changes several base parameters. One parameter explains all of them: the shift, with its amount.
#[test]
fn one_shift_of_a_joint_is_one_change() {
    let (shift_mm, names) = (0.2, ["before", "after"].map(str::to_string).to_vec());
    let input = |seed: u64, shift: f64| {
        let session = session_of(POSES, seed, &TARGETS, [0.0, shift]);
        Input::Session(Box::new(Session { noise_mm: Some(NOISE_MM), ..session }))
    };
    let options = CompareOptions::default();
    let found = compare_inputs(names.clone(), vec![input(1, 0.0), input(2, shift_mm)], &options, 1).unwrap();
    let pair = &found.pairs[0];
    println!("{:#?}", pair.single_changes);
    assert!(pair.judged && pair.significant > 0, "{pair:?}");
    let probability = pair.single_changes[0].probability;
    let best = &pair.single_changes[0].change;
    assert_eq!(best.id, "EX0J5");
    assert!((best.value - 1e3 * shift_mm).abs() < 4.0 * best.u && best.u < 50.0, "{best:?}");
    let sum: f64 = pair.single_changes.iter().map(|one| one.probability).sum();
    assert!(probability > 0.3 && sum <= 1.0 + 1e-9, "{sum}");
    // Nothing changed: nothing is explained.
    let same = compare_inputs(names, vec![input(3, 0.0), input(4, 0.0)], &options, 1).unwrap();
    assert!(same.pairs[0].significant == 0 && same.pairs[0].single_changes.is_empty());
}

/// The screen of a comparison opens with the shift of one joint, also where several base parameters change with it: no second
/// joint is said to have changed beside it.
#[test]
fn the_comparison_of_a_robot_opens_with_the_joint_that_moved() {
    for (id, joint, shift_mm) in [("EX0J5", 5, [-0.25, 0.0, 0.0]), ("EX0J3", 3, [0.15, 0.0, 0.0])] {
        let folder = tempfile::tempdir().unwrap();
        let sessions = [("before", 5, [0.0; 3]), ("after", 6, shift_mm)].map(|(name, seed, shift_mm)| {
            let own = folder.path().join(name);
            fs::create_dir(&own).unwrap();
            let moved = |target, joints| {
                carried_by(target, joints, 0.0, |number| if number == joint { shift_mm } else { [0.0; 3] })
            };
            let file = written_by(&own, POSES, seed, &TARGETS, moved);
            let stated = format!("kind = \"tracker\"\nnoise_um = {}", 1e3 * NOISE_MM);
            let text = fs::read_to_string(&file).unwrap().replace("kind = \"tracker\"", &stated);
            fs::write(&file, text).unwrap();
            file
        });
        let json = folder.path().join("compared.json");
        let run = abbe(&["compare", text(&sessions[0]), text(&sessions[1]), "--json", text(&json)]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let screen = String::from_utf8(run.stdout).unwrap();
        let found: serde_json::Value = serde_json::from_slice(&fs::read(&json).unwrap()).unwrap();
        let pair = &found["pairs"][0];
        let single = pair["single_changes"].as_array().unwrap();
        let truth = single.iter().find(|one| one["id"] == id).unwrap_or_else(|| panic!("{id}: {screen}"));
        let [value, u, probability] = ["value", "u", "probability"].map(|key| truth[key].as_f64().unwrap());
        let truth_um = 1e3 * shift_mm[0];
        assert!((value - truth_um).abs() < 4.0 * u && probability > 0.3, "{truth}");
        let changed = screen.lines().find(|line| line.starts_with("What has changed: ")).unwrap();
        let named = match pair["significant"].as_u64().unwrap() {
            1 => format!("What has changed: {id} "),
            _ => format!("What has changed: one parameter explains all differences: {id} "),
        };
        assert!(changed.starts_with(&named), "{changed}");
        let sum: f64 = single.iter().map(|one| one["probability"].as_f64().unwrap()).sum();
        assert!(sum <= 1.0 + 1e-9, "{sum}");
    }
}

/// Corrected commands say that the fit placed the tool point, in lengths. A stated point, and a body of which the fit found the
/// orientation alone, need no warning.
#[test]
fn a_tool_point_that_the_fit_placed_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let free = written(folder.path(), POSES, 1, &TARGETS[..1], [0.0; 2]);
    let [model, commands, out] = ["model.json", "commands.csv", "out.csv"].map(|name| folder.path().join(name));
    fs::write(&commands, "j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n10,20,-10,30,40,5\n").unwrap();
    let tool = ["--tool-mm", "-1184,-349,12"];
    for (session, tool, placed) in
        [(&free, &[][..], true), (&free, &tool[..], false), (&ready("pose/session.toml"), &[][..], false)]
    {
        let run = abbe(&["fit", text(session), "--save", text(&model), "--quiet"]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let fixed = ["compensate", text(&model), text(&commands), "--out", text(&out), "--force"];
        let run = abbe(&[&fixed[..], tool].concat());
        let said = String::from_utf8_lossy(&run.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(run.status.success(), "{said}");
        assert_eq!(said.contains("which the fit placed (target.x[T0] by "), placed, "{said}");
        assert!(!said.contains("target.a"), "{said}");
    }
}

/// The history and its screen of ten sessions between which J5 moves by 40 µm; `changed` changes the file of a session.
fn history_of_a_drift(place: &Path, changed: impl Fn(u64, &str) -> String) -> (serde_json::Value, String) {
    let folder = place.join("fleet");
    for k in 0..10 {
        let session = folder.join(format!("{k:02}"));
        fs::create_dir_all(&session).unwrap();
        let file = written(&session, 40, 100 + k, &TARGETS, [0.0, 0.04 * k as f64]);
        let session = changed(k, &fs::read_to_string(&file).unwrap());
        let about = format!("[about]\nserial_number = \"R\"\ndate = 2026-{:02}-05\n", k + 1);
        fs::write(&file, about + &session).unwrap();
    }
    let [results, json] = ["results", "history.json"].map(|name| place.join(name));
    let run = abbe(&["fleet", "run", text(&folder), "--out", text(&results), "--no-trace", "--quiet"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let run = abbe(&["fleet", "history", text(&results), "--json", text(&json)]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let screen = String::from_utf8(run.stdout).unwrap();
    (serde_json::from_str(&fs::read_to_string(&json).unwrap()).unwrap(), screen)
}

/// J5 moves by 40 µm from session to session. No parameter that it changes is identifiable by itself: the history follows
/// base parameters, all that the sessions determine, and finds the drift.
#[test]
fn a_joint_that_moves_in_confounded_parameters_is_found() {
    let place = tempfile::tempdir().unwrap();
    let (found, screen) = history_of_a_drift(place.path(), |_, session| session.to_string());
    let machine = &found["machines"][0];
    let determined = machine["determined"].as_u64().unwrap();
    assert!(machine["followed"].as_u64().unwrap() == determined && determined > 15, "{machine:#}");
    assert!(!machine["held_at_nominal"].as_array().unwrap().is_empty());
    assert!(!found["statements"]["correct"].as_array().unwrap().is_empty(), "{screen}");
    assert!(!screen.contains("No machine is out of control"), "{screen}");
    assert!(screen.contains("drifts by") || screen.contains("has shifted by"), "{screen}");
    assert!(screen.contains(&format!("{determined} of {determined} determined parameters are followed")), "{screen}");
}

/// One session leaves J6 as it is, so that its base is another: the history follows what the sessions identify one by one, and
/// states the share. A chain of six joints has 4·6 + 6 parameters between its base and its flange; the free pose of the
/// tracker takes six of them, and the free targets on the flange six more.
#[test]
fn the_share_of_the_determined_parameters_that_is_followed_is_stated() {
    let place = tempfile::tempdir().unwrap();
    let fewer = (1..=5).map(|joint| format!("\"E?0J{joint}\"")).collect::<Vec<_>>().join(", ");
    let (found, screen) = history_of_a_drift(place.path(), |k, session| match k {
        2 => session.replace("\"E?0J*\"", &fewer),
        _ => session.to_string(),
    });
    let last = files::session(&place.path().join("fleet/09/session.toml"), &ReadOptions::default()).unwrap();
    let followed = fitted(&last).model.parameters.iter().filter(|free| free.id.starts_with('E')).count();
    let machine = &found["machines"][0];
    assert_eq!((machine["followed"].as_u64(), machine["determined"].as_u64()), (Some(followed as u64), Some(18)));
    assert!(followed > 0 && followed < 18 && machine["held_at_nominal"].is_null(), "{machine:#}");
    let share = format!("R: {followed} of 18 determined parameters are followed, {} %", 100 * followed / 18);
    assert!(screen.contains(&share), "{share}\n{screen}");
    // 0.36 mm in the 273 days from the first session to the last.
    let drift = &found["statements"]["correct"][0];
    let [value, u] = ["value", "u"].map(|key| drift["drift_per_year"][key].as_f64().unwrap());
    assert!(drift["id"] == "EX0J5" && (value - 360.0 * 365.25 / 273.0).abs() < 4.0 * u, "{drift:#}");
}

/// A zero angle and an offset of some joints along their own axes, and no other error: the base parameters are these.
#[test]
fn the_own_angle_and_offset_of_a_joint_are_base_parameters() {
    // By joint: the zero angle about its direction, ″, and the offset along it, mm.
    let truth = [[0.0; 2], [-120.0, 0.0], [0.0; 2], [469.0, 0.3], [0.0, -0.2], [0.0; 2]];
    let place = |target: [f64; 3], joints: [f64; 6]| {
        JOINTS.iter().enumerate().rev().fold(Vector3::from(target), |point, (number, (direction, origin))| {
            let ([arcsec, mm], origin) = (truth[number], Vector3::from(*origin));
            let zero = (arcsec / 3600.0_f64).to_radians();
            origin + Vector3::from(*direction) * mm + turn(*direction, joints[number] + zero) * (point - origin)
        })
    };
    // J2 to J4 turn about −Y, J5 about −Z. The offsets of J2 to J4 are along one line, and only one of them is free.
    let wanted = [("EB0J2", 120.0), ("EB0J3", 0.0), ("EB0J4", -469.0), ("EY0J4", -300.0), ("EZ0J5", 200.0)];
    let folder = tempfile::tempdir().unwrap();
    let file = written_by(folder.path(), POSES, 1, &TARGETS, place);
    let session = files::session(&file, &ReadOptions::default()).unwrap();
    let (problem, fit) = prepare(&session, 1).unwrap();
    let found = base::report(&problem, &fit).unwrap();
    for (id, _) in wanted {
        let held = &found.held_at_nominal;
        assert!(found.parameters.iter().any(|free| free.id == id), "{id} is not free; held: {held:?}");
    }
    for free in found.parameters.iter().filter(|free| free.id.starts_with('E')) {
        let value = wanted.iter().find(|(id, _)| free.id == *id).map_or(0.0, |(_, value)| *value);
        assert!((free.value - value).abs() < 4.0 * free.u && free.u < 20.0, "{value} expected: {free:?}");
    }
}

/// Rounding in the direction of an axis, as a URDF has it, makes no other base parameters: a joint's own angle and offset are
/// held last, so that the angles of the middle joints stay free.
#[test]
fn rounding_in_a_direction_holds_no_other_parameters() {
    let folder = tempfile::tempdir().unwrap();
    let file = written(folder.path(), POSES, 1, &TARGETS, [0.0; 2]);
    let held = || {
        let session = files::session(&file, &ReadOptions::default()).unwrap();
        let (problem, fit) = prepare(&session, 1).unwrap();
        base::report(&problem, &fit).unwrap().held_at_nominal
    };
    let exact = held();
    let machine = folder.path().join("machine.toml");
    let stated = fs::read_to_string(&machine).unwrap();
    let rounded = stated.replace("[0, -1, 0]", "[0, -1, 0.000000000205]");
    assert_ne!(stated, rounded);
    fs::write(&machine, rounded).unwrap();
    assert_eq!(held(), exact);
    for own in ["EB0J2", "EB0J3", "EB0J4"] {
        assert!(!exact.iter().any(|id| id == own), "{own} in {exact:?}");
    }
}
