//! `plan --improve` for every instrument: a session that lacks an error gets a test that determines it, the written session
//! reads back, and its fits scatter as the plan predicts. The readings are closed forms written here, which share nothing with
//! the kinematic chain.

use std::sync::Arc;

use abbe::files::{self, ReadOptions};
use abbe::identify::fit::prepare;
use abbe::model::instrument::Station;
use abbe::model::session::planned::planned;
use abbe::model::session::{Session, Test};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;

use crate::suite::{abbe, text};

/// Simulated fits of each written session, from `ABBE_STUDY`; 60 without it.
fn fits() -> usize {
    std::env::var("ABBE_STUDY").ok().and_then(|text| text.parse().ok()).unwrap_or(60).max(2)
}

/// A millionth of a unit.
const MICRO: f64 = 1e-6;

/// An axis of a test, mm and rad, at a reading.
type At<'a> = &'a dyn Fn(&str) -> f64;
/// The readings without noise at a reading of a test, in the order of its channels, mm and rad.
type Reading = fn(&Test, At<'_>) -> Vec<f64>;

/// A session that lacks a test.
struct Case {
    chain: &'static str,
    axes: &'static str,
    session: &'static str,
    /// Names and contents of its data files.
    data: fn() -> Vec<(&'static str, String)>,
    /// Beginnings of the parameters that it does not determine, and their true values, mm and rad.
    lacks: &'static [(&'static str, f64)],
    reading: Reading,
    /// Noise of a length and of an angle, mm and rad.
    noise: [f64; 2],
    /// The channel of an azimuth, if there is one: the next is its elevation.
    azimuth: Option<usize>,
}

/// Travels of three linear axes.
const LINEAR: &str = "[axis.X]\ndirection = [1, 0, 0]\ntravel_mm = [-300, 300]\n[axis.Y]\ndirection = [0, 1, 0]\n\
                      travel_mm = [-200, 200]\n[axis.Z]\ndirection = [0, 0, 1]\ntravel_mm = [-200, 300]\n";

fn run(arguments: &[&str]) {
    let output = abbe(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn parsed(file: &std::path::Path) -> Value {
    serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap()
}

/// The standard uncertainty of each named error of a list, in its unit; infinite where there is none.
fn uncertainties(list: &Value) -> Vec<(String, f64)> {
    let of = |item: &Value| (item["id"].as_str().unwrap().to_string(), item["u"].as_f64().unwrap_or(f64::INFINITY));
    list.as_array().unwrap().iter().map(of).collect()
}

/// The session with readings of its planned states.
fn measured(plan: &Session, case: &Case, seed: u64) -> Session {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut session = plan.clone();
    for test in &mut session.tests {
        let mut readings = planned(&plan.machine, test).unwrap();
        let angles: Vec<bool> = test.station.channels().iter().map(|channel| channel.is_angle()).collect();
        let mut observed = Vec::new();
        for row in 0..readings.rows() {
            let at = |name: &str| {
                let axis = plan.machine.axes.iter().position(|axis| axis.name == name).unwrap();
                readings.positions[axis][row]
            };
            let values = (case.reading)(test, &at);
            assert_eq!(values.len(), angles.len(), "{}", test.name);
            for (channel, is_angle) in angles.iter().enumerate() {
                let normal: f64 = StandardNormal.sample(&mut random);
                // The noise of an azimuth is that across the line of sight.
                let is_azimuth = case.azimuth == Some(channel);
                let narrowed = if is_azimuth { values[channel + 1].cos() } else { 1.0 };
                observed.push(values[channel] + normal * case.noise[usize::from(*is_angle)] / narrowed);
            }
        }
        readings.observed = observed;
        test.readings = Some(Arc::new(readings));
    }
    session
}

fn check(case: &Case) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [machine, session, next, found, again] =
        ["machine.toml", "session.toml", "next.toml", "found.json", "again.json"].map(at);
    let linear = if case.chain.contains('X') { LINEAR } else { "" };
    let head = format!("name = \"Machine\"\nchain = \"{}\"\n{}{linear}", case.chain, case.axes);
    std::fs::write(&machine, head).unwrap();
    std::fs::write(&session, format!("[machine]\nfile = \"machine.toml\"\n\n{}", case.session)).unwrap();
    for (name, content) in (case.data)() {
        std::fs::write(at(name), content).unwrap();
    }
    // A proposal that determines what the session lacks.
    run(&["plan", text(&session), "--improve", "--write", text(&next), "--json", text(&found), "--quiet"]);
    let improvement = parsed(&found)["improvement"].clone();
    let step = &improvement["steps"][0];
    println!("{}", step["test"].as_str().unwrap());
    let before = uncertainties(&improvement["uncertainties_before"]);
    let with = uncertainties(&step["uncertainties"]);
    let of = |list: &[(String, f64)], begin: &str| {
        let own = list.iter().find(|(id, _)| id.starts_with(begin));
        own.unwrap_or_else(|| panic!("{begin}: {list:?}")).clone()
    };
    for (begin, _) in case.lacks {
        assert!(of(&before, begin).1.is_infinite(), "{before:?}");
        assert!(of(&with, begin).1.is_finite(), "{with:?}");
    }
    // The written session reads back, and its plan has the same uncertainties.
    assert!(std::fs::read_to_string(&next).unwrap().contains(step["session_toml"].as_str().unwrap()));
    run(&["plan", text(&next), "--no-effects", "--json", text(&again), "--quiet"]);
    let planned = uncertainties(&parsed(&again)["errors"]);
    for (id, u) in &with {
        let (_, own) = of(&planned, id);
        assert!((own / u - 1.0).abs() < 0.01, "{id}: {own} planned, {u} promised");
    }
    // Fits of its simulated readings scatter as promised, about the truth.
    let plan = files::session(&next, &ReadOptions::default()).unwrap();
    let mut pulls = vec![Vec::new(); case.lacks.len()];
    for seed in 0..fits() {
        let (problem, fit) = prepare(&measured(&plan, case, seed as u64), 1).unwrap();
        for ((begin, truth), pulls) in case.lacks.iter().zip(&mut pulls) {
            let (id, u) = of(&with, begin);
            let place = problem.parameters.list.iter().position(|parameter| parameter.id.to_string() == id).unwrap();
            let u = u / problem.parameters.list[place].unit.display_per_internal;
            pulls.push((fit.beta[place] - truth) / u);
        }
    }
    for ((begin, _), pulls) in case.lacks.iter().zip(&pulls) {
        let count = pulls.len() as f64;
        let mean = pulls.iter().sum::<f64>() / count;
        let rms = (pulls.iter().map(|pull| pull * pull).sum::<f64>() / count).sqrt();
        println!("{begin}: {count} fits, mean pull {mean:.2}, rms {rms:.2}");
        // Four standard deviations of the mean and of the rms.
        assert!(mean.abs() < 4.0 / count.sqrt(), "{begin}: mean {mean}");
        assert!((rms - 1.0).abs() < 4.0 / (2.0 * count).sqrt(), "{begin}: rms {rms}");
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

/// A turn about Z.
fn turned(angle: f64, [x, y, z]: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = angle.sin_cos();
    [cos * x - sin * y, sin * x + cos * y, z]
}

/// A laser along X alone says nothing of the scale of Y.
#[test]
fn a_laser_is_aligned_with_the_axis_that_no_test_moves() {
    check(&Case {
        chain: "w b X Y Z t",
        axes: "",
        session: "[instrument]\nkind = \"laser\"\nnoise_um = 0.5\n\n\
                  [[effect]]\ncomponent = \"EXX\"\ndriver = \"X\"\nshape = \"polynomial\"\norder = 1\nscale_mm = 300\n\n\
                  [[effect]]\ncomponent = \"EYY\"\ndriver = \"Y\"\nshape = \"polynomial\"\norder = 1\nscale_mm = 200\n\n\
                  [[test]]\nname = \"LX\"\nbeam = [1, 0, 0]\n\
                  sweep = { axis = \"X\", from_mm = -300, to_mm = 300, step_mm = 30 }\n",
        data: Vec::new,
        lacks: &[("EYY~Y", 4e-3)],
        reading: |test, at| {
            let Station::Laser(laser) = &test.station else { panic!("a laser") };
            assert_eq!(laser.channels.len(), 1);
            let (x, y) = (at("X"), at("Y"));
            vec![dot(laser.frame[0], [x + 7e-3 * x / 300.0, y + 4e-3 * y / 200.0, at("Z")])]
        },
        noise: [5e-4, 0.0],
        azimuth: None,
    });
}

/// A level on X alone says nothing of the pitch of Y.
#[test]
fn a_level_reads_across_the_axis_that_no_test_moves() {
    check(&Case {
        chain: "w b X Y Z t",
        axes: "",
        session: "[instrument]\nkind = \"angle\"\nnoise_arcsec = 0.2\n\n\
                  [[effect]]\ncomponent = \"EBX\"\ndriver = \"X\"\nshape = \"polynomial\"\norder = 1\nscale_mm = 300\n\n\
                  [[effect]]\ncomponent = \"EAY\"\ndriver = \"Y\"\nshape = \"polynomial\"\norder = 1\nscale_mm = 200\n\n\
                  [[test]]\nname = \"level\"\nabout = [[0, 1, 0], [1, 0, 0]]\nbody = \"tool\"\n\
                  sweep = { axis = \"X\", from_mm = -300, to_mm = 300, step_mm = 30 }\n",
        data: Vec::new,
        lacks: &[("EAY~Y", 30.0 * MICRO)],
        reading: |test, at| {
            let Station::Angle(level) = &test.station else { panic!("a level") };
            // A level does not read about the vertical.
            assert!(level.about.iter().all(|about| about[2] == 0.0));
            let turned = [30.0 * MICRO * at("Y") / 200.0, -20.0 * MICRO * at("X") / 300.0, 0.0];
            level.about.iter().map(|about| dot(*about, turned)).collect()
        },
        noise: [0.0, 0.2 / 3600.0 * std::f64::consts::PI / 180.0],
        azimuth: None,
    });
}

/// Lines along X and Y say nothing of the squareness of Z.
#[test]
fn a_tracker_sees_the_axis_that_no_test_moves() {
    check(&Case {
        chain: "w b X Y Z t",
        axes: "",
        session: "[instrument]\nkind = \"tracker\"\nnoise_um = 8\n\n[unknowns]\nerrors = [\"EC0Y\", \"EA0Z\", \"EB0Z\"]\n\n\
                  [[test]]\nname = \"X\"\nsetup = \"T\"\nspindle_setup = \"S\"\ntarget_mm = [0, 0, 0]\n\
                  sweep = { axis = \"X\", from_mm = -300, to_mm = 300, step_mm = 30 }\n\n\
                  [[test]]\nname = \"Y\"\nsetup = \"T\"\nspindle_setup = \"S\"\ntarget_mm = [0, 0, 0]\n\
                  sweep = { axis = \"Y\", from_mm = -200, to_mm = 200, step_mm = 20 }\n",
        data: Vec::new,
        lacks: &[("EA0Z", 40.0 * MICRO), ("EB0Z", -60.0 * MICRO)],
        reading: |_, at| {
            let seen = turned(0.5, leant(at("X"), at("Y"), at("Z")));
            vec![seen[0] + 800.0, seen[1] - 1500.0, seen[2] + 200.0]
        },
        noise: [8e-3, 0.0],
        azimuth: None,
    });
}

/// Where a tracker that leans by 20° sees a point: a turn about X, then about Z, then a shift.
fn leaning(point: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = 20.0_f64.to_radians().sin_cos();
    let seen = turned(0.5, [point[0], cos * point[1] - sin * point[2], sin * point[1] + cos * point[2]]);
    [seen[0] + 800.0, seen[1] - 1500.0, seen[2] + 200.0]
}

/// Range, azimuth and elevation of a point.
fn polar([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x.hypot(y).hypot(z), y.atan2(x), z.atan2(x.hypot(y))]
}

/// A point of the tool of a machine whose Y leans towards −X by EC0Y, and Z towards X by EB0Z and towards −Y by EA0Z.
fn leant(x: f64, y: f64, z: f64) -> [f64; 3] {
    [x - 25.0 * MICRO * y - 60.0 * MICRO * z, y - 40.0 * MICRO * z, z]
}

/// Data along X and Y of a tracker that leans say nothing of the squareness of Z. The tracker stays where it stands.
#[test]
fn a_tracker_with_data_stays_where_it_stands() {
    let data = || {
        let file = |axis: usize, to: f64| {
            let row = |k: i32| {
                let mut at = [0.0; 3];
                at[axis] = to * f64::from(k) / 10.0;
                let [range, azimuth, elevation] = polar(leaning(leant(at[0], at[1], at[2])));
                let [azimuth, elevation] = [azimuth, elevation].map(f64::to_degrees);
                format!("{},{},{},{range:.6},{azimuth:.9},{elevation:.9}\n", at[0], at[1], at[2])
            };
            let rows: String = (-10..=10).map(row).collect();
            format!("x_mm,y_mm,z_mm,range_mm,azimuth_deg,elevation_deg\n{rows}")
        };
        vec![("X.csv", file(0, 300.0)), ("Y.csv", file(1, 200.0))]
    };
    check(&Case {
        chain: "w b X Y Z t",
        axes: "",
        session: "[instrument]\nkind = \"tracker\"\nnoise_um = 1\nnoise_arcsec = 2\n\n\
                  [unknowns]\nerrors = [\"EC0Y\", \"EA0Z\", \"EB0Z\"]\n\n\
                  [[test]]\nname = \"X\"\nsetup = \"T\"\nspindle_setup = \"S\"\ntarget_mm = [0, 0, 0]\ndata = \"X.csv\"\n\n\
                  [[test]]\nname = \"Y\"\nsetup = \"T\"\nspindle_setup = \"S\"\ntarget_mm = [0, 0, 0]\ndata = \"Y.csv\"\n",
        data,
        lacks: &[("EA0Z", 40.0 * MICRO), ("EB0Z", -60.0 * MICRO)],
        reading: |_, at| polar(leaning(leant(at("X"), at("Y"), at("Z")))).to_vec(),
        noise: [1e-3, 2.0 / 3600.0 * std::f64::consts::PI / 180.0],
        azimuth: Some(1),
    });
}

/// Lines along X and Y say nothing of the squareness of Z.
#[test]
fn a_camera_system_sees_the_axis_that_no_test_moves() {
    check(&Case {
        chain: "w b X Y Z t",
        axes: "",
        session: "[instrument]\nkind = \"pose\"\nnoise_um = 20\nnoise_arcsec = 10\n\n\
                  [unknowns]\nerrors = [\"EC0Y\", \"EA0Z\", \"EB0Z\"]\n\n\
                  [[test]]\nname = \"X\"\nsetup = \"T\"\nspindle_setup = \"S\"\ntarget_mm = [0, 0, 0]\n\
                  sweep = { axis = \"X\", from_mm = -300, to_mm = 300, step_mm = 30 }\n\n\
                  [[test]]\nname = \"Y\"\nsetup = \"T\"\nspindle_setup = \"S\"\ntarget_mm = [0, 0, 0]\n\
                  sweep = { axis = \"Y\", from_mm = -200, to_mm = 200, step_mm = 20 }\n",
        data: Vec::new,
        lacks: &[("EA0Z", 40.0 * MICRO), ("EB0Z", -60.0 * MICRO)],
        reading: |_, at| {
            let seen = turned(0.5, leant(at("X"), at("Y"), at("Z")));
            vec![seen[0] + 800.0, seen[1] - 1500.0, seen[2] + 200.0, 0.0, 0.0, 0.5]
        },
        noise: [2e-2, 10.0 / 3600.0 * std::f64::consts::PI / 180.0],
        azimuth: None,
    });
}

/// Lines along X and Y from a known station say nothing of the squareness of Z towards X.
#[test]
fn a_station_of_distances_follows_the_axis_that_no_test_moves() {
    check(&Case {
        chain: "w b X Y Z t",
        axes: "",
        session: "[instrument]\nkind = \"distance\"\nnoise_um = 0.2\n\n\
                  [unknowns]\nerrors = [\"EC0Y\", \"EB0Z\"]\n\n\
                  [[test]]\nname = \"X\"\nsetup = \"T\"\nreflector_mm = [0, 0, 0]\nstation_mm = [-900, -600, 100]\nstation_u_um = 0\n\
                  station_frame = \"bed\"\nsweep = { axis = \"X\", from_mm = -300, to_mm = 300, step_mm = 30 }\n\n\
                  [[test]]\nname = \"Y\"\nsetup = \"T\"\nreflector_mm = [0, 0, 0]\nstation_mm = [-900, -600, 100]\nstation_u_um = 0\n\
                  station_frame = \"bed\"\nsweep = { axis = \"Y\", from_mm = -200, to_mm = 200, step_mm = 20 }\n",
        data: Vec::new,
        lacks: &[("EB0Z", -60.0 * MICRO)],
        reading: |_, at| {
            let (x, y, z) = (at("X"), at("Y"), at("Z"));
            let point = [x - 25.0 * MICRO * y - 60.0 * MICRO * z, y, z];
            let [x, y, z] = [point[0] + 900.0, point[1] + 600.0, point[2] - 100.0];
            // A dead path too.
            vec![x.hypot(y).hypot(z) + 2.5]
        },
        noise: [2e-4, 0.0],
        azimuth: None,
    });
}

/// Stars at one elevation tell index error, collimation and the angle between the axes only together.
#[test]
fn a_mount_turns_about_the_axis_that_no_test_moves() {
    check(&Case {
        chain: "w b AZ EL t",
        axes: "[axis.AZ]\nkind = \"rotary\"\ndirection = [0, 0, -1]\ntravel_deg = [-170, 170]\n[axis.EL]\nkind = \"rotary\"\n\
               direction = [0, -1, 0]\ntravel_deg = [10, 80]\n",
        session: "[instrument]\nkind = \"pointing\"\nnoise_arcsec = 1.5\n\n[unknowns]\nerrors = [\"EC0AZ\", \"EA0EL\"]\n\n\
                  [[test]]\nname = \"AZ\"\nat = { el_deg = 30 }\n\
                  sweep = { axis = \"AZ\", from_deg = -160, to_deg = 160, step_deg = 20 }\n",
        data: Vec::new,
        lacks: &[("EC0AZ", 100.0 * MICRO), ("EA0EL", -150.0 * MICRO)],
        reading: |_, at| {
            let (sin, cos) = at("EL").sin_cos();
            let tilt = -150.0 * MICRO;
            // The mount turns back from west.
            let [x, y, z] = turned(100.0 * MICRO - at("AZ"), [cos, -tilt.sin() * sin, tilt.cos() * sin]);
            vec![(-y).atan2(x), z.asin()]
        },
        noise: [0.0, 1.5 / 3600.0 * std::f64::consts::PI / 180.0],
        azimuth: Some(0),
    });
}

/// A nest that no test turns says nothing of the axis of the table.
#[test]
fn an_r_test_follows_the_axis_that_no_test_moves() {
    check(&Case {
        chain: "w C b X Y Z t",
        axes: "[axis.C]\ndirection = [0, 0, 1]\ntravel_deg = [-180, 180]\n",
        session: "[instrument]\nkind = \"r-test\"\nnoise_um = 0.5\n\n[unknowns]\nerrors = [\"EX0C\", \"EY0C\"]\n\n\
                  [[test]]\nname = \"X\"\nsetting = \"E\"\nworkpiece_ball_mm = [80, 0, 60]\nworkpiece_ball_u_um = inf\n\
                  spindle_ball_mm = [0, 0, 0]\nsetup = \"N\"\nspindle_setup = \"S\"\nat = { x_mm = 80, z_mm = 60 }\n\
                  sweep = { axis = \"X\", from_mm = 78, to_mm = 82, step_mm = 0.5 }\n",
        data: Vec::new,
        lacks: &[("EX0C", 12e-3), ("EY0C", -8e-3)],
        reading: |test, at| {
            let Station::RTest(nest) = &test.station else { panic!("an R-test") };
            let spindle: [f64; 3] = [at("X"), at("Y"), at("Z")];
            let from_axis = [spindle[0] - 12e-3, spindle[1] + 8e-3, spindle[2]];
            let in_table = turned(-at("C"), from_axis);
            (0..3).map(|i| in_table[i] + nest.spindle_ball.mm[i] - nest.workpiece_ball.mm[i]).collect()
        },
        noise: [5e-4, 0.0],
        azimuth: None,
    });
}

/// A probe around a cylinder that does not turn says nothing of the axis of the table.
#[test]
fn a_probe_touches_while_the_axis_turns_that_no_test_moves() {
    check(&Case {
        chain: "w C b X Y Z t",
        axes: "[axis.C]\ndirection = [0, 0, 1]\ntravel_deg = [-180, 180]\n",
        session: "[instrument]\nkind = \"probe\"\nnoise_um = 1\n\n[unknowns]\nerrors = [\"EX0C\", \"EY0C\"]\n\n\
                  [[test]]\nname = \"round\"\nradius_mm = 45\nradius_u_um = inf\nartefact_mm = [0, 0, 0]\n\
                  artefact_u_um = [inf, inf, 0]\nstylus_mm = [0, 0, 0]\nsetup = \"cylinder\"\nspindle_setup = \"stylus\"\n\
                  path = { kind = \"circle\", plane = \"XY\", radius_mm = 45, step_deg = 15, both_directions = false }\n",
        data: Vec::new,
        lacks: &[("EX0C", 12e-3), ("EY0C", -8e-3)],
        reading: |test, at| {
            let Station::Probe(probe) = &test.station else { panic!("a probe") };
            let stylus: [f64; 3] = std::array::from_fn(|i| at(["X", "Y", "Z"][i]) + probe.stylus.mm[i]);
            let nominal = turned(at("C"), probe.artefact.mm);
            let centre = [nominal[0] + 12e-3, nominal[1] - 8e-3];
            let (dx, dy) = (nominal[0] - stylus[0], nominal[1] - stylus[1]);
            let ahead = [dx / dx.hypot(dy), dy / dx.hypot(dy)];
            let from = [stylus[0] - centre[0], stylus[1] - centre[1]];
            let along = from[0] * ahead[0] + from[1] * ahead[1];
            let square = from[0] * from[0] + from[1] * from[1] - probe.radius * probe.radius;
            vec![-along - (along * along - square).sqrt()]
        },
        noise: [1e-3, 0.0],
        azimuth: None,
    });
}

/// The slope of a straightness over X and the direction of the beam are one in every reading of one beam, wherever the
/// other axes stand.
#[test]
fn nothing_is_proposed_for_what_no_candidate_determines() {
    let folder = tempfile::tempdir().unwrap();
    let (next, found) = (folder.path().join("next.toml"), folder.path().join("found.json"));
    let plan = crate::suite::ready("laser/plan.toml");
    run(&["plan", text(&plan), "--improve", "--json", text(&found), "--quiet"]);
    let improvement = parsed(&found)["improvement"].clone();
    assert_eq!(improvement["steps"], serde_json::json!([]));
    assert_eq!(improvement["alternatives"], serde_json::json!([]));
    let said = String::from_utf8(abbe(&["plan", text(&plan), "--improve"]).stdout).unwrap();
    assert!(said.contains("candidate tests makes EZX~X:p2.1 identifiable"), "{said}");
    let output = abbe(&["plan", text(&plan), "--improve", "--write", text(&next)]);
    let refused = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && refused.contains("no candidate test helps") && !next.exists(), "{refused}");
}

/// A choice among feeds and directions is one for every instrument, and what is too much is counted and refused.
#[test]
fn feeds_directions_and_limits_hold_without_a_bar() {
    let plan = crate::suite::ready("r-test/plan.toml");
    let said = |more: &[&str]| {
        let output = abbe(&[&["plan", text(&plan), "--improve"], more].concat());
        (output.status.success(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
    };
    let (_, usual) = said(&[]);
    let (_, without) = said(&["--no-follow"]);
    assert!(usual.contains("the linear axes follow") && !without.contains("the linear axes follow"), "{without}");
    let (_, one) = said(&["--directions", "one", "--feeds", "0.5"]);
    assert!(one.contains("in one direction at 0.5 times the feed"), "{one}");
    let many = (1..=400).map(|k| k.to_string()).collect::<Vec<_>>().join(",");
    let (is_done, refused) = said(&["--radii-mm", &many, "--heights-mm", &many]);
    assert!(!is_done && refused.contains("the limit is 100000"), "{refused}");
}

/// Straightness is a declared effect, and there are moves that read it.
#[test]
fn a_plan_of_effects_has_candidates() {
    let output = abbe(&["plan", text(&crate::suite::ready("laser/plan.toml"))]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(!said.contains("no candidate test is known"), "{said}");
}
