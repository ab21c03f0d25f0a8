//! Tests of sessions as plans, and of sessions that are written and read back.

use std::fs;
use std::path::{Path, PathBuf};

use abbe_files::ReadOptions;
use abbe_files::table::csv;
use abbe_model::chain::BodyErrors;
use abbe_model::document::edit::SessionText;
use abbe_model::driver::{Driver, DriverInput, Reference};
use abbe_model::effect::shape::{Curve, Harmonic, Local, Periodic, Polynomial, Power, ReversalSpike, Steps, Warmup};
use abbe_model::effect::{Component, Effect, Shape};
use abbe_model::sensitivity::TestModel;
use abbe_model::session::planned;
use abbe_model::session::readings::Readings;
use abbe_model::session::{Session, Test};

fn ready(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions").join(name)
}

fn plan(name: &str) -> Session {
    abbe_files::session(&ready(name), &ReadOptions::default()).unwrap()
}

/// The nominal reading of each row, mm.
fn nominal(session: &Session, test: &Test, readings: &Readings) -> Vec<f64> {
    let none = vec![BodyErrors::<f64>::NONE; session.machine.axes.len()];
    let mut state = Vec::new();
    (0..readings.rows())
        .map(|row| {
            readings.state(&session.machine, row, &mut state);
            test.station.read::<f64>(&session.machine, &state, &none, |_| None).channels()[0]
        })
        .collect()
}

/// A session with one test and the machine in the session file.
fn one_test(test: &str) -> Result<Session, abbe_model::Diagnostic> {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "[machine]\nchain = \"w C A b Y X Z t\"\n[machine.axis.C]\n[machine.axis.A]\ntravel_deg = [-120, 120]\n[machine.axis.X]\n\
         travel_mm = [-200, 200]\n[machine.axis.Y]\n[machine.axis.Z]\n\n[instrument]\nkind = \"ballbar\"\n\n[[test]]\n\
         name = \"T\"\nspindle_ball_mm = [0, 0, 0]\n{test}\n"
    );
    let path = folder.path().join("session.toml");
    fs::write(&path, text).unwrap();
    abbe_files::session(&path, &ReadOptions::default())
}

#[test]
fn the_three_methods_are_plans_in_which_the_bar_fits() {
    for chapter in ["chapter4.toml", "chapter5.toml", "chapter6.toml"] {
        let session = plan(&format!("hermle-c600u/{chapter}"));
        assert_eq!(session.tests.len(), 4, "{chapter}");
        assert_eq!(session.unknowns.len(), 8, "{chapter}");
        assert!(session.warnings.is_empty());
        for (test, readings) in session.tests.iter().zip(planned::planned_session(&session).unwrap()) {
            for length in nominal(&session, test, &readings) {
                let bar = if test.name.ends_with("150") { 149.9946 } else { 99.9881 };
                assert!((length - bar).abs() < 0.012, "{chapter} {}: {length}", test.name);
            }
        }
    }
}

#[test]
fn runs_alternate_direction_and_time_increases() {
    let session = plan("hermle-c600u/chapter5.toml");
    let readings = planned::planned(&session.machine, &session.tests[0]).unwrap();
    assert_eq!(readings.rows(), 4 * 361);
    assert_eq!(readings.runs().len(), 4);
    assert_eq!(readings.run.last(), Some(&4));
    let a = &readings.positions[session.machine.axis_index("A").unwrap()];
    assert_eq!(a[0], (-20.0_f64).to_radians());
    assert_eq!(a[360], 70.0_f64.to_radians());
    assert_eq!(a[361], 70.0_f64.to_radians());
    assert!(readings.time_s.windows(2).all(|pair| pair[1] > pair[0]));
    // 500 mm/min at 100 mm: 5 rad/min.
    let turn = 90.0_f64.to_radians();
    assert!((readings.time_s[360] - turn / 5.0 * 60.0).abs() < 1e-9);
    let all = planned::planned_session(&session).unwrap();
    assert!(all[1].time_s[0] > *all[0].time_s.last().unwrap());
}

#[test]
fn a_circle_is_centred_on_the_workpiece_ball_anywhere() {
    let test = "bar_mm = 100\nworkpiece_ball_mm = [10, 20, 30]\n\
                path = { kind = \"circle\", plane = \"XY\", radius_mm = 100, step_deg = 0.5, feed_mm_min = 1000 }";
    let session = one_test(test).unwrap();
    let readings = planned::planned(&session.machine, &session.tests[0]).unwrap();
    assert_eq!(readings.rows(), 2 * 721);
    for length in nominal(&session, &session.tests[0], &readings) {
        assert!((length - 100.0).abs() < 1e-10, "{length}");
    }
    let position = |name: &str| readings.positions[session.machine.axis_index(name).unwrap()][0];
    assert_eq!([position("X"), position("Y"), position("Z")], [110.0, 20.0, 30.0]);
}

#[test]
fn linear_axes_follow_a_rotary_one_at_the_length_of_the_bar() {
    for axis in ["A", "C"] {
        for offset in ["radial", "tangential", "axial"] {
            let test = format!(
                "bar_mm = 100\nworkpiece_ball_mm = [0, 50, 40]\npath = {{ kind = \"follow\", axis = \"{axis}\", \
                 offset = \"{offset}\", from_deg = 0, to_deg = 90, step_deg = 1 }}"
            );
            let session = one_test(&test).unwrap();
            let readings = planned::planned(&session.machine, &session.tests[0]).unwrap();
            for length in nominal(&session, &session.tests[0], &readings) {
                assert!((length - 100.0).abs() < 1e-9, "{axis} {offset}: {length}");
            }
        }
    }
}

/// The square of the speed on a circle of 100 mm at 1000 mm/min, with central differences over steps of 0.5°: of X
/// (v sin θ · sin δ/δ)², of C, which stands, 0.
#[test]
fn the_square_of_the_speed_follows_from_the_columns() {
    let test = "bar_mm = 100\nworkpiece_ball_mm = [0, 0, 0]\n\
                path = { kind = \"circle\", plane = \"XY\", radius_mm = 100, step_deg = 0.5, feed_mm_min = 1000 }";
    let session = one_test(test).unwrap();
    let mut readings = planned::planned(&session.machine, &session.tests[0]).unwrap();
    let squares = |axis: &str, readings: &Readings| {
        let input = DriverInput {
            machine: &session.machine,
            model: &TestModel::new(session.machine.clone(), session.tests[0].station.clone(), readings),
            readings,
            reference: &Reference::default(),
            component_axis: session.machine.axis_index(axis),
            lag_s: None,
        };
        Driver::parse("speed-squared").kind().samples(&input)
    };
    let (v, step) = (1000.0 / 60.0, 0.5_f64.to_radians());
    let of_x = squares("X", &readings).unwrap();
    for (row, sample) in of_x.iter().enumerate().take(720).skip(1) {
        let expected = (v * (step * row as f64).sin() * step.sin() / step).powi(2);
        assert!((sample.value - expected).abs() < 1e-9, "{row}: {} {expected}", sample.value);
    }
    assert!(squares("C", &readings).unwrap().iter().all(|sample| sample.value == 0.0));
    assert!(squares("none", &readings).is_none());
    readings.time_s.clear();
    assert!(squares("X", &readings).is_none());
}

#[test]
fn a_plan_beyond_the_travel_is_refused() {
    let test = "bar_mm = 100\nworkpiece_ball_mm = [150, 0, 0]\n\
                path = { kind = \"circle\", plane = \"XY\", radius_mm = 100, step_deg = 1 }";
    let message = one_test(test).unwrap_err().to_string();
    assert!(message.contains("axis `X` goes to 250.000 mm; its travel is -200 to 200 mm"), "{message}");
    // 120° is no round number of radians.
    let test = "bar_mm = 100\nworkpiece_ball_mm = [0, 0, 100]\n\
                sweep = { axis = \"A\", from_deg = 0, to_deg = 150, step_deg = 10 }";
    let message = one_test(test).unwrap_err().to_string();
    assert!(message.contains("axis `A` goes to 130.000 deg; its travel is -120 to 120 deg"), "{message}");
}

#[test]
fn written_effects_read_back_equal() {
    let effect = |component: &str, driver: &str, shape: Shape| {
        Effect::new(Component::parse(component).unwrap(), Driver::parse(driver), shape)
    };
    let mut effects = vec![
        effect("EX0C", "time", Shape::Drift),
        effect("EZC", "C", Shape::Harmonic(Harmonic { order: 2.0 })),
        effect("EZC", "C", Shape::Harmonic(Harmonic { order: 0.5 })),
        effect("EXX", "X", Shape::Polynomial(Polynomial { degree: 3, scale: 250.0 })),
        effect("ECC", "C", Shape::Power(Power { degree: 2, scale: 1.0 })),
        effect("EXX", "X", Shape::Periodic(Periodic { period: 10.0 })),
        effect("EXC", "C", Shape::Periodic(Periodic { period: 0.1 })),
        effect("EYY", "Y", Shape::Backlash),
        effect("EYY", "Y", Shape::Lag),
        effect("EYY", "Y", Shape::ReversalSpike(ReversalSpike { width: 1.5 })),
        effect("bar", "time", Shape::Warmup(Warmup { tau_s: 1234.5 })),
        effect("workpiece_ball.z", "temperature", Shape::Polynomial(Polynomial { degree: 1, scale: 1.0 })),
        effect("EAA", "gravity", Shape::Polynomial(Polynomial { degree: 1, scale: 1.0 })),
        effect("EAA", "gravity-C", Shape::Polynomial(Polynomial { degree: 1, scale: 1.0 })),
        effect("EXX", "speed-squared", Shape::Polynomial(Polynomial { degree: 1, scale: 2.5e3 })),
        effect("EXX", "X", Shape::Steps(Steps { at: vec![-50.0, 0.1, 50.0] })),
        effect("ECC", "C", Shape::Steps(Steps { at: vec![0.3, 1.0, 2.0_f64.to_radians()] })),
        effect("EZC", "none", Shape::Constant),
        effect("trigger", "none", Shape::Constant),
    ];
    for degrees in 0..400 {
        let centre = f64::from(degrees) * 0.7;
        effects.push(effect(
            "EZC",
            "C",
            Shape::Local(Local {
                centre: if degrees % 2 == 0 { centre.to_radians() } else { centre.sqrt() },
                width: 12.0_f64.to_radians(),
                recurs: (degrees % 3 > 0).then_some(std::f64::consts::TAU),
            }),
        ));
    }
    for closed in [true, false] {
        effects.push(effect(
            "EZA",
            "A",
            Shape::Curve(Curve { from: -20.0_f64.to_radians(), to: 70.0_f64.to_radians(), intervals: 9, closed }),
        ));
    }
    effects[1].tests = vec!["C100".into(), "C150".into()];

    let path = ready("hermle-c600u/chapter5.toml");
    let original = fs::read_to_string(&path).unwrap();
    let session = plan("hermle-c600u/chapter5.toml");
    let mut text = SessionText::new(&original, &path).unwrap();
    text.add_effects(&effects, &session.machine).unwrap();
    let text = text.to_string();
    assert!(text.starts_with(&original));
    let folder = tempfile::tempdir().unwrap();
    fs::copy(ready("hermle-c600u/machine.toml"), folder.path().join("machine.toml")).unwrap();
    let written = folder.path().join("session.toml");
    std::fs::write(&written, &text).unwrap();
    let read = abbe_files::session(&written, &ReadOptions::default()).unwrap();
    assert_eq!(read.effects.len(), effects.len());
    for (read, effect) in read.effects.iter().zip(&effects) {
        assert_eq!(read, effect);
    }
}

#[test]
fn a_plan_becomes_a_measured_session() {
    let session = plan("hermle-c600u/chapter5.toml");
    let original = fs::read_to_string(ready("hermle-c600u/chapter5.toml")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut data = Vec::new();
    let plans = planned::planned_session(&session).unwrap();
    let mut measured = Vec::new();
    for (test, mut readings) in session.tests.iter().zip(plans) {
        readings.observed = nominal(&session, test, &readings);
        let name = format!("{}.csv", test.name);
        std::fs::write(folder.path().join(&name), csv::text(&session.machine, &test.station, &readings)).unwrap();
        data.push((test.name.clone(), name));
        measured.push(readings);
    }
    let written = folder.path().join("session.toml");
    let with_data = |text: &str| {
        let mut text = SessionText::new(text, &written).unwrap();
        text.set_data(&data);
        text.to_string()
    };
    let text = with_data(&original);
    assert_eq!(text.lines().count(), original.lines().count() + 4);
    // Applied again to the result, the names of the files are replaced, not added.
    assert_eq!(with_data(&text), text);
    fs::write(&written, text).unwrap();
    fs::copy(ready("hermle-c600u/machine.toml"), folder.path().join("machine.toml")).unwrap();
    let read = abbe_files::session(&written, &ReadOptions::default()).unwrap();
    for (test, before) in read.tests.iter().zip(&measured) {
        let after = test.readings.as_ref().unwrap();
        assert_eq!(after.run, before.run);
        let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-11);
        assert!(close(&after.observed, &before.observed));
        assert!(close(&after.time_s, &before.time_s));
        for (a, b) in after.positions.iter().zip(&before.positions) {
            assert!(close(a, b));
        }
    }
    // The folder contains only the requested files.
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 6);
}

#[test]
fn sockets_named_by_a_column_become_tests() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.toml");
    let text = "[machine]\nchain = \"w b J1 t\"\n[machine.axis.J1]\nkind = \"rotary\"\ndirection = [0, 0, 2]\n\n\
                [instrument]\nkind = \"socket\"\n\n[[test]]\nname = \"T\"\ndata = \"T.csv\"\nball_mm = [100, 0, 0]\n\
                ball_u_um = inf\n\n[[socket_distance]]\nbetween = [\"a\", \"b\"]\nmm = 50\nu_um = 100\n\n\
                [[effect]]\ncomponent = \"ECJ1\"\nshape = \"harmonic\"\norder = 1\ntests = [\"T\"]\n";
    fs::write(&path, text).unwrap();
    fs::write(folder.path().join("T.csv"), "socket,J1_rad\na,0\nb,0.5\na,0.001\n").unwrap();
    let session = abbe_files::session(&path, &ReadOptions::default()).unwrap();
    let names: Vec<&str> = session.tests.iter().map(|test| test.name.as_str()).collect();
    assert_eq!(names, ["T/a", "T/b"]);
    assert_eq!(session.effects[0].tests, ["T/a", "T/b"]);
    let readings = session.tests[0].readings.as_ref().unwrap();
    assert_eq!(readings.positions[0], [0.0, 0.001]);
    assert_eq!(readings.origin.as_ref().unwrap().line, [2, 4]);
    assert_eq!(readings.observed, [0.0; 6]);
    assert_eq!(session.machine.axes[0].direction, [0.0, 0.0, 1.0]);
    assert_eq!(session.tests[0].spindle_setup, session.tests[1].spindle_setup);
}

/// Two joints about Y, 300 mm apart: the moment of a weight of one newton at the second about the first is
/// 0.3 m · cos q of the first, whatever the second does. The second does not carry the first.
#[test]
fn a_weight_at_a_joint_has_the_moment_of_its_lever() {
    let read = |component: &str, loaded: &str| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("session.toml");
        let text = format!(
            "[machine]\nchain = \"w b J1 J2 t\"\n[machine.axis.J1]\nkind = \"rotary\"\ndirection = [0, 1, 0]\n\
             [machine.axis.J2]\nkind = \"rotary\"\ndirection = [0, 1, 0]\norigin_mm = [300, 0, 0]\n\n[instrument]\n\
             kind = \"tracker\"\n\n[[test]]\nname = \"T\"\ndata = \"T.csv\"\ntarget_mm = [500, 0, 0]\n\n\
             [[effect]]\ncomponent = \"{component}\"\ndriver = \"gravity-{loaded}\"\nshape = \"polynomial\"\norder = 1\n"
        );
        fs::write(&path, text).unwrap();
        fs::write(folder.path().join("T.csv"), "j1_rad,j2_rad,px_mm,py_mm,pz_mm\n0,1,0,0,0\n0.7,2,0,0,0\n2,0,0,0,0\n")
            .unwrap();
        abbe_files::session(&path, &ReadOptions::default())
    };
    let session = read("EBJ1", "J2").unwrap();
    let effect = &session.effects[0];
    assert_eq!(effect.driver.to_string(), "gravity-J2");
    let test = &session.tests[0];
    let readings = test.readings.as_ref().unwrap();
    let model = TestModel::new(session.machine.clone(), test.station.clone(), readings);
    let input = DriverInput {
        machine: &session.machine,
        model: &model,
        readings,
        reference: &Reference::default(),
        component_axis: effect.component.axis(&session.machine),
        lag_s: None,
    };
    let samples = effect.driver.kind().samples(&input).unwrap();
    for (sample, q) in samples.iter().zip([0.0_f64, 0.7, 2.0]) {
        assert!((sample.value - 0.3 * q.cos()).abs() < 1e-12, "{} {q}", sample.value);
    }
    let error = |component: &str, loaded: &str| read(component, loaded).unwrap_err().to_string();
    assert!(error("EBJ2", "J1").contains("axis J2 does not carry axis J1"), "{}", error("EBJ2", "J1"));
    assert!(error("EBJ1", "J7").contains("J7"), "{}", error("EBJ1", "J7"));
}

/// The bar turns about its ball, so that its length does not show the mistake.
#[test]
fn positions_in_another_unit_are_doubted() {
    const SWEEP: &str = "sweep = { axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 10, feed_deg_min = 500 }\n";
    for (column, unit, sweep, doubt) in [
        ("c_rad", 1.0, "", Some("axis `C` goes to 20626.481 deg, 57 turns from zero")),
        ("c_deg", 1.0, SWEEP, None),
        ("c_deg", 1.0, "", None),
        (
            "c_deg",
            1.0_f64.to_radians(),
            SWEEP,
            Some("covers 6.283 deg where the session states 360.000 deg, as radians"),
        ),
        ("c_rad", 1.0_f64.to_radians(), SWEEP, None),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let rows: String = (0..37).map(|k| format!("{},100.0\n", unit * f64::from(10 * k))).collect();
        fs::write(folder.path().join("t.csv"), format!("{column},length_mm\n{rows}")).unwrap();
        let text = "[machine]\nchain = \"w C b Y X Z t\"\n[machine.axis.C]\n[machine.axis.X]\n[machine.axis.Y]\n\
                    [machine.axis.Z]\n\n[instrument]\nkind = \"ballbar\"\n\n[unknowns]\nerrors = []\n\n[[test]]\n\
                    name = \"T\"\ndata = \"t.csv\"\nbar_mm = 100\nworkpiece_ball_mm = [0, 0, 0]\n\
                    spindle_ball_mm = [0, 0, 100]\n";
        let path = folder.path().join("session.toml");
        fs::write(&path, format!("{text}{sweep}")).unwrap();
        let warnings = abbe_files::session(&path, &ReadOptions::default()).unwrap().warnings.join("\n");
        match doubt {
            Some(doubt) => assert!(warnings.contains(doubt), "{column}: {warnings}"),
            None => assert!(!warnings.contains("column of"), "{column}: {warnings}"),
        }
    }
}

/// The session states no runs; a gap in their numbers shows a run that was removed.
#[test]
fn a_gap_in_the_numbers_of_runs_is_reported() {
    let warnings_of = |runs: &[i64]| {
        let folder = tempfile::tempdir().unwrap();
        let rows: String =
            (runs.iter()).flat_map(|run| (0..4).map(move |k| format!("{run},{},100.0\n", 90 * k))).collect();
        fs::write(folder.path().join("t.csv"), format!("run,c_deg,length_mm\n{rows}")).unwrap();
        let text = "[machine]\nchain = \"w C b Y X Z t\"\n[machine.axis.C]\n[machine.axis.X]\n[machine.axis.Y]\n\
                    [machine.axis.Z]\n\n[instrument]\nkind = \"ballbar\"\n\n[unknowns]\nerrors = []\n\n[[test]]\n\
                    name = \"T\"\ndata = \"t.csv\"\nbar_mm = 100\nworkpiece_ball_mm = [100, 0, 0]\n\
                    spindle_ball_mm = [0, 0, 0]\n";
        let path = folder.path().join("session.toml");
        fs::write(&path, text).unwrap();
        abbe_files::session(&path, &ReadOptions::default()).unwrap().warnings
    };
    for complete in [&[1, 2, 3, 4][..], &[5, 6, 7], &[1, 3, 5], &[2], &[0, 100_000, 1_000_000]] {
        assert!(warnings_of(complete).is_empty(), "{complete:?}: {:?}", warnings_of(complete));
    }
    for (runs, words) in
        [(&[1, 3, 4][..], "lack run 2 between runs 1 and 4"), (&[1, 2, 5, 6, 7], "lack runs 3, 4 between runs 1 and 7")]
    {
        let warnings = warnings_of(runs);
        assert!(warnings.len() == 1 && warnings[0].contains(words), "{warnings:?}");
    }
}

#[test]
fn missing_runs_are_reported() {
    let sweep = "sweep = { axis = \"C\", from_deg = 0, to_deg = 270, step_deg = 90, runs = 2, both_directions = true }";
    let circle = "path = { kind = \"circle\", plane = \"XY\", radius_mm = 100, step_deg = 90, runs = 2, both_directions = true }";
    for (movement, columns) in [(sweep, "c_deg"), (circle, "x_mm,y_mm")] {
        let warnings_of = |movement: &str, runs: &[bool], apart: bool| {
            let folder = tempfile::tempdir().unwrap();
            let mut data = format!("run,{columns},length_mm\n");
            for (run, forward) in runs.iter().enumerate() {
                for k in 0..4 {
                    let k = if *forward { k } else { 3 - k };
                    let at = match columns {
                        "c_deg" => (90 * k).to_string(),
                        _ => ["100,0", "0,100", "-100,0", "0,-100"][k].to_string(),
                    };
                    data += &format!("{},{at},100\n", if apart { run + 1 } else { 1 });
                }
            }
            fs::write(folder.path().join("t.csv"), data).unwrap();
            let ball = if columns == "c_deg" { "[100, 0, 0]" } else { "[0, 0, 0]" };
            let text = format!(
                "[machine]\nchain = \"w C b Y X Z t\"\n[machine.axis.C]\n[machine.axis.X]\n[machine.axis.Y]\n[machine.axis.Z]\n\n\
                 [instrument]\nkind = \"ballbar\"\n\n[unknowns]\nerrors = []\n\n[[test]]\nname = \"T\"\ndata = \"t.csv\"\n\
                 bar_mm = 100\nworkpiece_ball_mm = {ball}\nspindle_ball_mm = [0, 0, 0]\n{movement}\n"
            );
            let path = folder.path().join("session.toml");
            fs::write(&path, text).unwrap();
            abbe_files::session(&path, &ReadOptions::default()).unwrap().warnings
        };
        let forward_only = movement.replace("both_directions = true", "both_directions = false");
        let reported = |runs: &[bool]| warnings_of(movement, runs, true);
        let one_way = |runs: &[bool]| warnings_of(&forward_only, runs, true);
        let unseparated = || warnings_of(movement, &[true, false], false);
        assert!(reported(&[true, false, true, false]).is_empty(), "{movement}");
        // One direction is stated, but the other one was run as well, or instead.
        for (runs, found) in [
            (&[true, true, false][..], "2 runs forward and 1 backward"),
            (&[false, false][..], "0 runs forward and 2 backward"),
        ] {
            let warnings = one_way(runs);
            assert_eq!(warnings.len(), 1, "{movement}: {warnings:?}");
            assert!(warnings[0].contains(found) && warnings[0].contains("both_directions = false"), "{warnings:?}");
        }
        assert!(one_way(&[true, true]).is_empty());
        // Runs without run numbers are not counted as zero.
        let warnings = unseparated();
        assert_eq!(warnings.len(), 1, "{movement}: {warnings:?}");
        assert!(warnings[0].contains("run 1 goes forward and backward under one number"), "{warnings:?}");
        for (runs, found) in [
            (&[true, false, true][..], "2 runs forward and 1 backward"),
            (&[true, true, true, true][..], "4 runs forward and 0 backward"),
            (&[false][..], "0 runs forward and 1 backward"),
        ] {
            let warnings = reported(runs);
            assert_eq!(warnings.len(), 1, "{warnings:?}");
            assert!(warnings[0].starts_with("test \"T\": "), "{warnings:?}");
            assert!(warnings[0].contains(found), "{warnings:?}");
        }
    }
}

/// Rounding to a step spreads a reading evenly over the step: its standard deviation is the step over the root of 12.
#[test]
fn a_resolution_is_noise_of_an_even_distribution() {
    let file = ready("hermle-c600u/chapter5.toml");
    let options = ReadOptions { read_data: false, ..ReadOptions::default() };
    let mut session = abbe_files::session(&file, &options).unwrap();
    session.resolution_mm = Some(1e-3);
    assert!((session.resolution_noise_mm() - 0.288_675_134_6e-3).abs() < 1e-12);
    session.resolution_mm = None;
    assert_eq!(session.resolution_noise_mm(), 0.0);
}
