//! `abbe nc`: a folder of programs, or a reason and no folder. The motion is judged in `codegen/tests/equations/nc.rs`.

use crate::suite::{abbe, ready, text};

#[test]
fn programs_are_written_together_or_not_at_all() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("programs");
    let plan = ready("hermle-c600u/chapter5.toml");
    let run = |options: &[&str]| {
        let fixed = ["nc", text(&plan), "--out", text(&out)];
        abbe(&fixed.iter().chain(options).copied().collect::<Vec<_>>())
    };
    for (options, expected) in [
        (&["--control", "fanuc", "--overshoot-deg", "4000"][..], "the overshoot in degrees is 4000"),
        (&["--control", "fanuc", "--increment-mm", "0.002"], "the increment in mm is 0.002"),
        (&["--control", "heidenhain", "--program-number", "7000"], "programs for heidenhain have no numbers"),
        (&["--control", "linuxcnc", "--tool-point"], "linuxcnc has no function that moves the tool point"),
    ] {
        let output = run(options);
        assert_eq!(output.status.code(), Some(1));
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.contains(expected), "{message}");
        assert!(!out.exists());
    }
    let unknown = run(&["--control", "mazak"]);
    let message = String::from_utf8_lossy(&unknown.stderr).into_owned();
    let controls = "[possible values: linuxcnc, fanuc, siemens, heidenhain]";
    assert!(unknown.status.code() == Some(2) && message.contains(controls) && !out.exists(), "{message}");
    let robot = abbe(&["nc", text(&ready("ur10/session.toml")), "--control", "siemens", "--out", text(&out)]);
    let message = String::from_utf8_lossy(&robot.stderr).into_owned();
    assert!(message.contains("axis `J1` has no letter of NC programs"), "{message}");
    assert!(!out.exists());
    let output = run(&["--control", "heidenhain"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let mut names: Vec<String> =
        std::fs::read_dir(&out).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, ["A100.h", "A150.h", "C100.h", "C150.h", "main.h"]);
    assert!(String::from_utf8_lossy(&output.stdout).contains("has not been run on a control"));
}

/// A path at the surface is nothing for a touch probe.
#[test]
fn a_probe_has_to_be_one_that_scans() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("programs");
    let plan = ready("self-calibration/session.toml");
    let output = abbe(&["nc", text(&plan), "--control", "fanuc", "--out", text(&out), "--quiet"]);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{message}");
    assert!(message.contains("warning: test \"1a\": The stylus stays at the surface"), "{message}");
    let program = std::fs::read_to_string(out.join("1a.nc")).unwrap();
    assert!(program.contains("(THE STYLUS STAYS AT THE SURFACE"), "{program}");
    assert!(program.contains("TAKE THE STYLUS OFF. MOVE"), "{program}");
}

/// A laser and a level read at rest: the axes stop at each target, on the way there and back, and the remarks have the words of
/// the instrument. A ball bar reads along the motion.
#[test]
fn instruments_that_read_at_rest_have_a_stop_at_each_target() {
    let place = tempfile::tempdir().unwrap();
    for (plan, rests) in [("laser/plan.toml", true), ("angle/plan.toml", true), ("hermle-c600u/chapter5.toml", false)] {
        let out = place.path().join(plan.replace('/', "-"));
        let run = abbe(&["nc", text(&ready(plan)), "--control", "linuxcnc", "--out", text(&out), "--dwell-s", "4"]);
        let message = String::from_utf8_lossy(&run.stderr).into_owned();
        assert!(run.status.success(), "{message}");
        assert_eq!(message.contains("rest for 4 s at each of"), rests, "{message}");
        for file in
            std::fs::read_dir(&out).unwrap().map(|file| file.unwrap().path()).filter(|file| !file.ends_with("main.ngc"))
        {
            let program = std::fs::read_to_string(&file).unwrap();
            assert_eq!(program.contains("the bar"), !rests, "{program}");
            for path in program.split("(Measured path begins)").skip(1) {
                let path = path.split("(Measured path ends)").next().unwrap();
                let [moves, stops] =
                    ["G1 ", "G4 P4"].map(|word| path.lines().filter(|line| line.contains(word)).count());
                // One more target than ways between them.
                assert_eq!(stops, if rests { moves + 1 } else { 0 }, "{}: {path}", file.display());
                assert!(!rests || moves > 1, "{path}");
            }
        }
    }
}

/// A plan of a ball bar, a level and a laser: each program has the word of its own instrument, and the two that read at rest
/// have a stop at each target, in the words of every control.
#[test]
fn a_plan_of_several_instruments_has_the_program_of_each() {
    let place = tempfile::tempdir().unwrap();
    let machine = "chain = \"w b X Y Z t\"\n[axis.X]\ntravel_mm = [-400, 400]\n[axis.Y]\ntravel_mm = [-400, 400]\n[axis.Z]\n\
                   travel_mm = [-400, 400]\n";
    let sweep =
        "sweep = { axis = \"X\", from_mm = -200, to_mm = 200, step_mm = 40, runs = 3, both_directions = true }\n";
    let plan = format!(
        "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"ballbar\"\n[unknowns]\nerrors = [\"EC0Y\"]\n\
         [[test]]\nname = \"XY\"\nbar_mm = 100\nworkpiece_ball_mm = [0, 0, 0]\nspindle_ball_mm = [0, 0, 0]\n\
         path = {{ kind = \"circle\", plane = \"XY\", radius_mm = 100, step_deg = 2 }}\n\
         [[test]]\nname = \"LV\"\nkind = \"angle\"\nabout = [0, 1, 0]\nbody = \"tool\"\n{sweep}\
         [[test]]\nname = \"LX\"\nkind = \"laser\"\nbeam = [1, 0, 0]\nchannels = [\"displacement\"]\n{sweep}"
    );
    std::fs::write(place.path().join("machine.toml"), machine).unwrap();
    std::fs::write(place.path().join("plan.toml"), plan).unwrap();
    for (control, dwell) in
        [("siemens", "G4 F4"), ("heidenhain", "DWELL 4"), ("fanuc", "G4 X4.000"), ("linuxcnc", "G4 P4")]
    {
        let out = place.path().join(control);
        let session = place.path().join("plan.toml");
        let run = abbe(&["nc", text(&session), "--control", control, "--out", text(&out), "--dwell-s", "4", "--quiet"]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let programs: Vec<String> = std::fs::read_dir(&out)
            .unwrap()
            .map(|file| std::fs::read_to_string(file.unwrap().path()).unwrap().to_uppercase())
            .collect();
        // Eleven targets, there and back, three times.
        for (test, instrument, stops) in [("XY", "ballbar", 0), ("LV", "angle", 66), ("LX", "laser", 66)] {
            let named = format!("TEST {test}, {}", instrument.to_uppercase());
            let own: Vec<&String> = programs.iter().filter(|program| program.contains(&named)).collect();
            let [program] = own[..] else { panic!("{control}: {} programs say `{named}`", own.len()) };
            let measured = program.split("MEASURED PATH BEGINS").skip(1);
            let measured = measured.map(|path| path.split("MEASURED PATH ENDS").next().unwrap_or(path));
            let found: usize = measured.map(|path| path.matches(dwell).count()).sum();
            assert_eq!(found, stops, "{control}, {test}: {program}");
            assert_eq!(program.contains("BALL"), instrument == "ballbar", "{control}, {test}: {program}");
        }
    }
}

/// What the programs only remark, the terminal says too: an overshoot that the travel cuts short, a ball that no axis
/// reaches, a start without room above it.
#[test]
fn remarks_of_the_programs_are_warnings() {
    let place = tempfile::tempdir().unwrap();
    let machine = "name = \"short\"\nchain = \"w C A b Y X Z t\"\n[axis.C]\ntravel_deg = [-360, 360]\n\
                   [axis.A]\ntravel_deg = [-21, 100]\n[axis.X]\ntravel_mm = [-300, 300]\n\
                   [axis.Y]\ntravel_mm = [-300, 300]\n[axis.Z]\ntravel_mm = [-300, 10]\n";
    let session = "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"ballbar\"\n[[test]]\nname = \"A\"\n\
                   bar_mm = 150\nworkpiece_ball_mm = [0, 0, 0]\nspindle_ball_mm = [0, 0, 0]\nat = { x_mm = 150 }\n\
                   sweep = { axis = \"A\", from_deg = -20, to_deg = 70, step_deg = 1 }\n";
    std::fs::write(place.path().join("machine.toml"), machine).unwrap();
    let plan = place.path().join("plan.toml");
    std::fs::write(&plan, session).unwrap();
    let out = place.path().join("programs");
    let output = abbe(&["nc", text(&plan), "--control", "linuxcnc", "--out", text(&out), "--quiet"]);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{message}");
    for expected in [
        "warning: test \"A\": Overshoot 1.000 deg before and 2.000 deg after the measured path: the travel ends there",
        "warning: test \"A\": The centre of the workpiece ball, setup A, cannot be reached",
        "warning: test \"A\": The start cannot be approached along the tool within the travel",
        "warning: test \"A\": Retreat along the tool by hand",
    ] {
        assert!(message.contains(expected), "{message}");
    }
    let program = std::fs::read_to_string(out.join("a.ngc")).unwrap();
    assert!(program.contains("The start cannot be approached along the tool"), "{program}");
}

/// The programs of a fanuc have the numbers and the increments that are asked for.
#[test]
fn numbers_and_increments_of_a_fanuc() {
    let place = tempfile::tempdir().unwrap();
    let plan = ready("hermle-c600u/chapter5.toml");
    for (name, options, decimals) in [("usual", &[][..], 3), ("finer", &["--increment-mm", "0.0001"][..], 4)] {
        let out = place.path().join(name);
        let fixed =
            ["nc", text(&plan), "--control", "fanuc", "--program-number", "7000", "--out", text(&out), "--quiet"];
        let output = abbe(&[&fixed[..], options].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let main = std::fs::read_to_string(out.join("main.nc")).unwrap();
        assert!(main.contains("O7000 (MAIN)\nG65 P7001 (TEST A100)\nG65 P7002 (TEST A150)"), "{main}");
        let program = std::fs::read_to_string(out.join("A150.nc")).unwrap();
        assert!(program.contains("O7002 (A150)"), "{program}");
        let motions = program.lines().filter(|line| line.starts_with("G1 ") || line.starts_with("G91 G1 "));
        let words = motions.flat_map(|line| line.split(' ')).filter(|word| word.starts_with(['X', 'Y', 'Z', 'A', 'C']));
        let longest = words.filter_map(|word| Some(word.split_once('.')?.1.len())).max();
        assert_eq!(longest, Some(decimals), "{program}");
    }
}

/// A plan may be eccentric; a program that pulls the bar apart at some position is not written.
#[test]
fn a_position_that_the_bar_cannot_reach_is_named() {
    let place = tempfile::tempdir().unwrap();
    let machine = "name = \"tilting\"\nchain = \"w C A b Y X Z t\"\n[axis.C]\n[axis.A]\n[axis.X]\n[axis.Y]\n[axis.Z]\n";
    let session = "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"ballbar\"\n[[test]]\nname = \"A\"\n\
                   bar_mm = 100\nworkpiece_ball_mm = [0, 110, 0]\nspindle_ball_mm = [0, 10, 0]\n\
                   sweep = { axis = \"A\", from_deg = 0, to_deg = 60, step_deg = 5 }\n";
    std::fs::write(place.path().join("machine.toml"), machine).unwrap();
    let plan = place.path().join("plan.toml");
    std::fs::write(&plan, session).unwrap();
    let out = place.path().join("programs");
    let output = abbe(&["nc", text(&plan), "--control", "fanuc", "--out", text(&out)]);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{message}");
    for expected in
        ["test \"A\": a bar of 100.0000 mm cannot reach between its balls at a_deg = 60,", "105.357 mm apart"]
    {
        assert!(message.contains(expected), "{message}");
    }
    assert!(!out.exists());
}
