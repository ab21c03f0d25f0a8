//! NC programs, read by an interpreter of LinuxCNC and by parsers that share no code with the writer.

mod decode;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use abbe_codegen::nc::{self, NcOptions};
use abbe_files::ReadOptions;
use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::Machine;
use abbe_model::instrument::ballbar::BallBar;
use abbe_model::session::placing::balls;
use abbe_model::session::planned::planned;
use abbe_model::session::{Session, Test};
use decode::{Counting, Move, Positions, canonical, of_g_codes, of_plain_text, of_three_decimals};
use nalgebra::DVector;

use crate::tools::folder;

fn bar_of(test: &Test) -> BallBar<f64> {
    test.station.between_points().unwrap()
}

fn at(machine: &Machine, positions: &Positions) -> Vec<f64> {
    let position = |axis: &Axis| axis.kind.to_internal(positions[&axis.name.chars().next().unwrap()]);
    machine.axes.iter().map(position).collect()
}

fn distance_mm(machine: &Machine, bar: &BallBar<f64>, at: &[f64]) -> f64 {
    let (workpiece, spindle) = balls(machine, bar, at);
    (0..3).map(|i| (spindle[i] - workpiece[i]).powi(2)).sum::<f64>().sqrt()
}

/// Largest change of the distance of the balls along a measured path, mm.
fn largest_change_mm(machine: &Machine, test: &Test, moves: &[Move]) -> f64 {
    let bar = bar_of(test);
    let plan = planned(machine, test).unwrap();
    let start: Vec<f64> = plan.positions.iter().map(|column| column[0]).collect();
    let nominal = distance_mm(machine, &bar, &start);
    let points = moves.iter().filter(|own| own.run.is_some()).flat_map(|own| &own.points);
    points.map(|point| (distance_mm(machine, &bar, &at(machine, point)) - nominal).abs()).fold(0.0, f64::max)
}

/// The measured path keeps the distance of the balls within `within_mm` and passes the planned states in their order, within
/// the travel.
fn holds_the_plan(session: &Session, test: &Test, moves: &[Move], rounding: f64, within_mm: f64) {
    let machine = &*session.machine;
    let plan = planned(machine, test).unwrap();
    let state = |row: usize| -> Vec<f64> { plan.positions.iter().map(|column| column[row]).collect() };
    let runs = plan.runs();
    for point in moves.iter().flat_map(|own| &own.points) {
        let at = at(machine, point);
        for (axis, q) in machine.axes.iter().zip(&at) {
            let inside = axis.travel.is_none_or(|[low, high]| *q >= low - 1e-5 && *q <= high + 1e-5);
            assert!(inside, "{}: axis {} goes to {q}", test.name, axis.name);
        }
    }
    let off = largest_change_mm(machine, test, moves);
    assert!(off < within_mm, "{}: {off} mm", test.name);
    // Each run is one stretch of measured blocks, which begins where the block before ends.
    let mut stretches: Vec<Vec<Vec<f64>>> = Vec::new();
    for (number, own) in moves.iter().enumerate() {
        let Some(run) = own.run else { continue };
        if run == stretches.len() {
            stretches.push(moves[number - 1].points.last().map(|point| at(machine, point)).into_iter().collect());
        }
        stretches[run].extend(own.points.iter().map(|point| at(machine, point)));
    }
    assert_eq!(stretches.len(), runs.len(), "{}", test.name);
    for (stretch, run) in stretches.iter().zip(&runs) {
        let mut first = 0;
        for row in run.clone() {
            let wanted = state(row);
            let found = (first..stretch.len() - 1)
                .find(|k| apart(machine, &wanted, &stretch[*k], &stretch[*k + 1]) < 0.02 + rounding);
            assert!(found.is_some(), "{}: row {row} is not on the path", test.name);
            first = found.unwrap();
        }
    }
}

/// Distance of a state from the straight motion between two others, mm, with angles as arcs of 100 mm.
fn apart(machine: &Machine, state: &[f64], from: &[f64], to: &[f64]) -> f64 {
    let lever = |axis: usize| if machine.axes[axis].kind == AxisKind::Rotary { 100.0 } else { 1.0 };
    let scaled = |values: &[f64]| DVector::from_fn(values.len(), |axis, _| lever(axis) * values[axis]);
    let (state, from, to) = (scaled(state), scaled(from), scaled(to));
    let along = &to - &from;
    let share = ((&state - &from).dot(&along) / along.norm_squared().max(1e-30)).clamp(0.0, 1.0);
    (state - from - along * share).norm()
}

fn session(path: &Path) -> Session {
    abbe_files::session(path, &ReadOptions { read_data: false, ..ReadOptions::default() }).unwrap()
}

/// Circles in three planes and synchronous paths of C (BK2) and A (BK1) beside the bundled plans.
fn circles(folder: &Path) -> PathBuf {
    let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions");
    std::fs::copy(sessions.join("hermle-c600u/machine.toml"), folder.join("machine.toml")).unwrap();
    let mut text = String::from(
        "[machine]\nfile = \"machine.toml\"\n[instrument]\nkind = \"ballbar\"\nnoise_um = 0.3\n[unknowns]\nerrors = [\"EC0Y\"]\n",
    );
    let circle = |plane: &str, range: &str| {
        format!(
            "[[test]]\nname = \"{plane}\"\nbar_mm = 100.0\nworkpiece_ball_mm = [0, 0, 50]\nspindle_ball_mm = [0, 0, 0]\n\
             path = {{ kind = \"circle\", plane = \"{plane}\", radius_mm = 100{range}, centre_mm = [0, 0, 0], step_deg = 0.5, \
             feed_mm_min = 1000, runs = 2, both_directions = true }}\n"
        )
    };
    text += &(circle("XY", "")
        + &circle("ZX", ", from_deg = -20, to_deg = 200")
        + &circle("YZ", ", from_deg = 10, to_deg = 170"));
    for offset in ["radial", "axial", "tangential"] {
        text += &format!(
            "[[test]]\nname = \"{offset}\"\nbar_mm = 100.0\nworkpiece_ball_mm = [0, 100, 50]\nspindle_ball_mm = [0, 0, 0]\n\
             path = {{ kind = \"follow\", axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 1, feed_deg_min = 300, \
             offset = \"{offset}\", runs = 1, both_directions = true }}\n"
        );
    }
    for offset in ["radial", "tangential"] {
        text += &format!(
            "[[test]]\nname = \"A {offset}\"\nbar_mm = 100.0\nworkpiece_ball_mm = [0, 100, 50]\nspindle_ball_mm = [0, 0, 0]\n\
             path = {{ kind = \"follow\", axis = \"A\", from_deg = -20, to_deg = 70, step_deg = 1, feed_deg_min = 300, \
             offset = \"{offset}\", runs = 1, both_directions = true }}\n"
        );
    }
    let path = folder.join("circles.toml");
    std::fs::write(&path, text).unwrap();
    path
}

const PLANS: [&str; 7] = [
    "hermle-c600u/chapter4.toml",
    "hermle-c600u/chapter5.toml",
    "hermle-c600u/chapter6.toml",
    "r-test/plan.toml",
    "self-calibration/session.toml",
    "table-and-head/session.toml",
    "tilting-head/session.toml",
];

fn plans(folder: &Path) -> Vec<PathBuf> {
    let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions");
    PLANS.iter().map(|plan| sessions.join(plan)).chain([circles(folder)]).collect()
}

/// What LinuxCNC's interpreter prints. Its tool table is the file `.tool.mmap` of the home folder, which each start
/// empties: two that run at the same time with one home folder end with a bus error.
fn rs274(program: &Path, folder: &Path, file: &str) -> String {
    let mut yes = Command::new("yes").stdout(Stdio::piped()).spawn().unwrap();
    let input = yes.stdout.take().unwrap();
    let output =
        Command::new(program).args(["-g", file]).current_dir(folder).env("HOME", folder).stdin(input).output().unwrap();
    yes.kill().unwrap();
    yes.wait().unwrap();
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && messages.trim() == "executing", "{file}: {messages}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_interpreter_of_linuxcnc_keeps_the_bar() {
    let Some(interpreter) = test_needs::program("nc", &["rs274"], &[]) else { return };
    let place = folder("linuxcnc");
    for plan in plans(&place) {
        let session = session(&plan);
        let files = nc::files(&session, nc::control("linuxcnc").unwrap(), &NcOptions::default()).unwrap().files;
        for (name, text) in &files {
            std::fs::write(place.join(name), text).unwrap();
        }
        let mut all = 0;
        for ((name, text), test) in files[1..].iter().zip(&session.tests) {
            let moves = canonical(&rs274(&interpreter, &place, name));
            holds_the_plan(&session, test, &moves, 1e-4, 1e-3);
            // The parser of this file sees the same motions.
            let own = of_g_codes(text, Counting::Turns);
            assert_eq!(own.len(), moves.len(), "{name}");
            all += moves.len();
        }
        assert_eq!(canonical(&rs274(&interpreter, &place, &files[0].0)).len(), all, "main calls every program");
    }
    std::fs::remove_dir_all(place).unwrap();
}

#[test]
fn the_other_controls_get_the_same_motion() {
    let place = folder("controls");
    for plan in plans(&place) {
        let session = session(&plan);
        for control in nc::CONTROLS {
            let files = nc::files(&session, control, &NcOptions::default()).unwrap().files;
            assert_eq!(files.len(), session.tests.len() + 1);
            assert_eq!(files[0].0, format!("main.{}", control.extension()));
            for ((name, text), test) in files[1..].iter().zip(&session.tests) {
                // However the control counts rotary axes.
                for counting in Counting::ALL {
                    let decoded = if control.word() == "heidenhain" { of_plain_text } else { of_g_codes };
                    let increment = 0.1_f64.powi(control.decimals() as i32);
                    let within_mm = if control.word() == "fanuc" { 2e-3 } else { 1e-3 };
                    holds_the_plan(&session, test, &decoded(text, counting), increment, within_mm);
                }
                let called = name.split_once('.').unwrap().0;
                let number =
                    format!("G65 P{}", 1001 + session.tests.iter().position(|own| own.name == test.name).unwrap());
                assert!(files[0].1.contains(called) || files[0].1.contains(&number), "{}", files[0].1);
            }
        }
    }
    std::fs::remove_dir_all(place).unwrap();
}

/// A Fanuc of IS-B has an increment of 0.001 mm and 0.001°. Changes that are no whole increments add up their rounding
/// errors, segment by segment.
#[test]
fn a_fanuc_that_rounds_or_cuts_off_keeps_the_bar() {
    let place = folder("increments");
    let fanuc = nc::control("fanuc").unwrap();
    let changes = |session: &Session, options: &NcOptions, cuts: bool| -> Vec<(String, f64)> {
        let files = nc::files(session, fanuc, options).unwrap().files;
        let change = |((_, text), test): (&(String, String), &Test)| {
            let moves = of_g_codes(&of_three_decimals(text, cuts), Counting::Turns);
            (test.name.clone(), largest_change_mm(&session.machine, test, &moves))
        };
        files[1..].iter().zip(&session.tests).map(change).collect()
    };
    let mut largest = 0.0_f64;
    for plan in plans(&place) {
        let session = session(&plan);
        for cuts in [false, true] {
            for (name, off) in changes(&session, &NcOptions::default(), cuts) {
                assert!(off < 2e-3, "{}, {name}: {off} mm", plan.display());
                largest = largest.max(off);
            }
        }
    }
    println!("largest change of the distance of the balls: {largest} mm");
    // What the option is for: changes of four decimals on such a control.
    let circles = session(&place.join("circles.toml"));
    let finer = NcOptions { increment_mm: Some(1e-4), ..NcOptions::default() };
    for cuts in [false, true] {
        let off = changes(&circles, &finer, cuts).into_iter().map(|(_, off)| off).fold(0.0, f64::max);
        println!("four decimals, cut off {cuts}: {off} mm");
        assert!(off > 0.02, "{off}");
    }
    std::fs::remove_dir_all(place).unwrap();
}

/// The path control is stated at the start of each program and given back at its end.
#[test]
fn the_path_control_is_stated_and_given_back() {
    let place = folder("path-control");
    let session = session(&circles(&place));
    for (word, stated, back) in [
        ("linuxcnc", "G64 P0.0005", "M72"),
        ("fanuc", "G64", "G#2 G#3 G#5 G#6 G#7 G#15"),
        ("siemens", "G64", "M17"),
        ("heidenhain", "CYCL DEF 32.1 T0.0005", "CYCL DEF 32.1"),
    ] {
        for (name, text) in &nc::files(&session, nc::control(word).unwrap(), &NcOptions::default()).unwrap().files[1..]
        {
            let numbered = word == "heidenhain";
            let code =
                |line: &str| if numbered { line.split_once(' ').unwrap().1.to_string() } else { line.to_string() };
            let lines: Vec<String> = text.lines().map(code).collect();
            let place = |wanted: &str| lines.iter().position(|line| line == wanted);
            if numbered {
                // A TNC moves along an arc in the plane of the table without segments.
                let arcs = lines.iter().filter(|line| line.starts_with("C ")).count();
                assert_eq!(arcs > 0, name == "XY.h", "{name}: {arcs} arcs");
            }
            let motion = |line: &&String| line.starts_with("G1 ") || line.starts_with("L ");
            let first = lines.iter().position(|line| motion(&line)).unwrap();
            let last = lines.len() - 1 - lines.iter().rev().position(|line| motion(&line)).unwrap();
            assert!(place(stated).is_some_and(|place| place < first), "{name}: {stated}");
            assert!(lines[last..].iter().any(|line| line == back), "{name}: {back}");
        }
        if word == "fanuc" {
            let numbered = NcOptions { number: Some(7000), ..NcOptions::default() };
            let files = nc::files(&session, nc::control(word).unwrap(), &numbered).unwrap().files;
            assert!(
                files[0].1.contains("O7000 (MAIN)") && files[0].1.contains("G65 P7006 (TEST TANGENTIAL)"),
                "{}",
                files[0].1
            );
            assert!(files[6].1.contains("\nO7006 (TANGENTIAL)\n#2=#4002\n"), "{}", files[6].1);
            assert!(files[1].1.contains("\n#15=#4015\n"), "{}", files[1].1);
        }
        if word == "siemens" {
            let files = nc::files(&session, nc::control(word).unwrap(), &NcOptions::default()).unwrap().files;
            assert!(files[1..].iter().all(|(_, text)| text.contains("\nG710 ") && !text.contains("G71 ")));
        }
    }
    std::fs::remove_dir_all(place).unwrap();
}

/// The positions of the manuals' examples: TNC 640 (M126, M127), Series 16i B-63534EN, 20.2.1 (ROAx with RABx 0).
#[test]
fn axes_within_one_turn_go_as_the_manuals_say() {
    for (counting, from, stated, change) in [
        (Counting::Turns, 350.0, 10.0, -340.0),
        (Counting::Line, 350.0, 10.0, -340.0),
        (Counting::Line, 10.0, 340.0, 330.0),
        (Counting::Shorter, 350.0, 10.0, 20.0),
        (Counting::Shorter, 10.0, 340.0, -30.0),
        (Counting::Shorter, 0.0, -150.0, -150.0),
        (Counting::Shorter, 210.0, 540.0, -30.0),
        (Counting::Shorter, 180.0, -620.0, -80.0),
        (Counting::Sign, 10.0, -340.0, -30.0),
        (Counting::Sign, 350.0, 10.0, 20.0),
    ] {
        let found = counting.reached(from, stated) - from;
        assert!((found - change).abs() < 1e-9, "{counting:?}: {from} to {stated} by {found}");
    }
    // A whole turn by its end is none.
    let program = "G1 C0. F1000.\nG1 C360. F1000.\n";
    let end = |counting: Counting| of_g_codes(program, counting)[1].points.last().unwrap()[&'C'];
    assert_eq!(Counting::ALL.map(end), [360.0, 0.0, 0.0, 0.0]);
}

/// Names that a control would execute as a comment, a command or the end of a program, one for each test of `circles`.
const HOSTILE: [&str; 8] = [
    "logopen,pwned.log",
    " py,open('pwned.log','w')",
    "abort,stop",
    "MSG,); M2\"",
    "$PATH=/_N_WKS_DIR %",
    "RET",
    "* - ~",
    "debug,#<_hal[x]> (probeopen pwned.log)",
];

/// Machine, tests and set-ups with other names.
fn renamed(session: &Session, name: impl Fn(usize) -> String) -> Session {
    let mut other = session.clone();
    let mut machine = (*other.machine).clone();
    machine.name = name(3);
    other.machine = std::sync::Arc::new(machine);
    for (number, test) in other.tests.iter_mut().enumerate() {
        (test.name, test.setup) = (name(number), name(number + 1));
    }
    other
}

/// A name is text: the program of a hostile name is that of a harmless one, character by character.
#[test]
fn a_name_is_no_command_of_a_program() {
    let place = folder("hostile");
    let session = session(&circles(&place));
    let hostile = renamed(&session, |number| HOSTILE[number % HOSTILE.len()].into());
    let letter = |c: char| if c.is_ascii_alphanumeric() || " -".contains(c) { c } else { '_' };
    let harmless = renamed(&session, |number| HOSTILE[number % HOSTILE.len()].chars().map(letter).collect());
    let ours = ["machine", "test", "positions", "and", "segments", "this", "take", "centring", "let", "lock"];
    let ours: Vec<&str> = ours
        .into_iter()
        .chain([
            "mount",
            "bring",
            "feed-in",
            "feed-out",
            "run",
            "measured",
            "stop",
            "check",
            "back",
            "the",
            "overshoot",
        ])
        .collect();
    for control in nc::CONTROLS {
        let written = |session: &Session| nc::files(session, control, &NcOptions::default()).unwrap().files;
        let files = written(&hostile);
        assert_eq!(files, written(&harmless), "{}", control.word());
        for (name, text) in &files {
            assert!(name.chars().all(|c| c.is_ascii_alphanumeric() || "_.".contains(c)), "{name}");
            for line in text.lines() {
                let comment = match control.word() {
                    "siemens" | "heidenhain" => line.split_once(';').map(|(_, comment)| comment),
                    // The number of a program of Fanuc has its name behind it.
                    _ if line.starts_with('O') => None,
                    _ => line.split_once('(').map(|(_, comment)| comment.trim_start_matches("MSG,")),
                };
                let Some(comment) = comment else { continue };
                let first = comment.trim().split([' ', ',', '.', ')']).next().unwrap().to_lowercase();
                assert!(ours.contains(&first.as_str()), "{}: {line}", control.word());
                assert!(!comment.contains(['%', '$', '~', ';', '=', '"', '<', '(']), "{}: {line}", control.word());
            }
        }
    }
    // The interpreter of LinuxCNC opens no file, and goes where it goes without these names.
    if let Some(interpreter) = test_needs::program("nc", &["rs274"], &[]) {
        let run = |session: &Session| -> Vec<String> {
            let files = nc::files(session, nc::control("linuxcnc").unwrap(), &NcOptions::default()).unwrap().files;
            files.iter().for_each(|(name, text)| std::fs::write(place.join(name), text).unwrap());
            let moves = |line: &&str| !line.contains("COMMENT") && !line.contains("MESSAGE");
            // Lines are numbered.
            let code =
                |line: &str| line.trim_start().trim_start_matches(|c: char| c.is_ascii_digit()).trim().to_string();
            rs274(&interpreter, &place, "main.ngc").lines().filter(moves).map(code).collect()
        };
        let plain = run(&session);
        assert!(plain.len() > 300);
        assert_eq!(run(&hostile), plain);
        assert!(!place.join("pwned.log").exists());
    }
    std::fs::remove_dir_all(place).unwrap();
}

#[test]
fn programs_as_they_are_printed() {
    let place = folder("printed");
    let session = session(&circles(&place));
    for control in nc::CONTROLS {
        let options = NcOptions { overshoot_deg: Some(5.0), chord_error_mm: 0.01, ..NcOptions::default() };
        let files = nc::files(&session, control, &options).unwrap().files;
        // A circle in full, and the begin of a table that turns with the linear axes.
        let turning: String = files[4].1.lines().take(48).map(|line| format!("{line}\n")).collect();
        let text = format!("{}\n{}\n{turning}", files[0].1, files[2].1);
        let mut settings = insta::Settings::clone_current();
        settings.set_snapshot_path("../../../snapshots");
        settings.set_prepend_module_to_snapshot(false);
        settings.set_omit_expression(true);
        settings.bind(|| insta::assert_snapshot!(format!("codegen__nc_{}", control.word()), text));
    }
    std::fs::remove_dir_all(place).unwrap();
}

#[test]
fn what_cannot_be_a_program_is_refused() {
    let place = folder("refused");
    let session = session(&circles(&place));
    let refused = |session: &Session, word: &str, options: NcOptions, expected: &str| {
        let message = nc::files(session, nc::control(word).unwrap(), &options).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}\nexpected {expected}");
    };
    let usual = NcOptions::default();
    refused(&session, "linuxcnc", NcOptions { tool_point: true, ..usual }, "no function that moves the tool point");
    refused(&session, "fanuc", NcOptions { dwell_s: f64::NAN, ..usual }, "the dwell in s is NaN");
    refused(&session, "fanuc", NcOptions { chord_error_mm: 0.0, ..usual }, "the chord error in mm is 0");
    refused(&session, "fanuc", NcOptions { increment_mm: Some(0.002), ..usual }, "the increment in mm is 0.002");
    refused(&session, "siemens", NcOptions { number: Some(7000), ..usual }, "programs for siemens have no numbers");
    refused(&session, "fanuc", NcOptions { number: Some(9995), ..usual }, "the last test 10003");
    let mut short = session.clone();
    let mut machine = (*short.machine).clone();
    let c = machine.axis_index("C").unwrap();
    machine.axes[c].travel = Some([-0.1, std::f64::consts::TAU]);
    short.machine = std::sync::Arc::new(machine);
    refused(&short, "siemens", NcOptions { overshoot_deg: Some(90.0), ..usual }, "its travel is");
    // Without a stated overshoot the travel limits it, and the program says so.
    let files = nc::files(&short, nc::control("siemens").unwrap(), &usual).unwrap().files;
    assert!(files[4].1.contains("Overshoot 5.730 deg before and 0.000 deg after"), "{}", files[4].1);
    let mut none = session;
    none.tests[0].motion = None;
    refused(&none, "fanuc", usual, "test \"XY\" states no motion");
    assert!(nc::control("mazak").is_err());
    std::fs::remove_dir_all(place).unwrap();
}

/// A radial bar that turns with the table: the spindle ball stays at one place of the table.
#[test]
fn the_tool_point_stays_over_its_place_of_the_table() {
    let place = folder("tool-point");
    let session = session(&circles(&place));
    let options = NcOptions { tool_point: true, ..NcOptions::default() };
    for (word, first, last) in [
        ("siemens", "TRAORI", "TRAFOOF"),
        ("fanuc", "G43.4 H#4111", "G49"),
        ("heidenhain", "FUNCTION TCPM F CONT AXIS POS PATHCTRL AXIS", "FUNCTION RESET TCPM"),
    ] {
        let files = nc::files(&session, nc::control(word).unwrap(), &options).unwrap().files;
        let (name, text) = &files[4];
        assert!(name.to_lowercase().contains("radial"), "{name}");
        // Lines of the TNC begin with their number.
        let is = |line: &&str, code: &str| *line == code || line.split_once(' ').is_some_and(|(_, own)| own == code);
        let inside: Vec<&str> =
            text.lines().skip_while(|line| !is(line, first)).take_while(|line| !is(line, last)).collect();
        let motion = inside.iter().find(|line| line.contains(" X")).unwrap().replace('+', "");
        let positions = if word == "fanuc" { [" X0.", " Y0.", " Z0."] } else { [" X0.", " Y200.", " Z50."] };
        for position in positions {
            assert!(motion.contains(position), "{word}: {motion}");
        }
        let count = |code: &str| text.lines().filter(|line| is(line, code)).count();
        // Once for each run, and not between overshoot and measured path: there stand remarks and motions alone.
        assert_eq!([count(first), count(last)], [2, 2]);
        let lower = text.to_lowercase();
        let lines: Vec<&str> = lower.lines().collect();
        for (place, line) in lines.iter().enumerate() {
            if line.contains("measured path begins") {
                assert!(lines[place - 1].contains(" x"), "{word}: {}", lines[place - 1]);
                assert!(lines[place + 1].contains(" x"), "{word}: {}", lines[place + 1]);
            }
        }
    }
    std::fs::remove_dir_all(place).unwrap();
}

/// A laser along a body diagonal: the axes move together, or one after the other at each step.
#[test]
fn axes_move_along_a_diagonal_together_or_in_turn() {
    let place = folder("diagonals");
    let linear = ["X", "Y", "Z"].iter().zip(["[1, 0, 0]", "[0, 1, 0]", "[0, 0, 1]"]);
    // X ends where the diagonal does, or half a millimetre farther, and Y a millimetre farther.
    for end in [300.0, 300.5] {
        diagonals(&place, linear.clone().zip([end, 101.0, 400.0]), end);
    }
    std::fs::remove_dir_all(place).unwrap();
}

/// The tool goes along a diagonal, and beyond it as far as X goes, at `last_mm`.
fn diagonals<'a>(place: &Path, axes: impl Iterator<Item = ((&'a &'a str, &'a str), f64)>, last_mm: f64) {
    let axes: String = axes
        .map(|((axis, way), end)| format!("axis.{axis} = {{ direction = {way}, travel_mm = [-{end}, {end}] }}\n"))
        .collect();
    let mut text = format!(
        "[machine]\nname = \"Mill\"\nchain = \"w b X Y Z t\"\n{axes}[instrument]\nkind = \"laser\"\nnoise_um = 0.1\n"
    );
    for (name, in_turn) in [("PNP", false), ("steps", true)] {
        text += &format!(
            "[[test]]\nname = \"{name}\"\nbeam = [6, -2, 3]\npath = {{ kind = \"line\", from = {{ x_mm = -300, y_mm = 100, z_mm = 0 }}, \
             to = {{ x_mm = 300, y_mm = -100, z_mm = 300 }}, step_mm = 70, runs = 2, in_turn = {in_turn} }}\n"
        );
    }
    let plan = place.join("plan.toml");
    std::fs::write(&plan, text).unwrap();
    let session = session(&plan);
    for control in nc::CONTROLS {
        let files = nc::files(&session, control, &NcOptions::default()).unwrap().files;
        for ((_, text), test) in files[1..].iter().zip(&session.tests) {
            let decoded = if control.word() == "heidenhain" { of_plain_text } else { of_g_codes };
            let moves = decoded(text, Counting::Turns);
            holds_the_plan(&session, test, &moves, 0.1_f64.powi(control.decimals() as i32), f64::INFINITY);
            // A stop at each target. Together: one block for each of ten steps of four traversals; in turn: three.
            let measured = moves.iter().filter(|own| own.run.is_some()).count();
            assert_eq!(measured, if test.name == "steps" { 4 * 30 } else { 4 * 10 }, "{}", control.word());
            let reached = moves.iter().flat_map(|own| &own.points).map(|point| point[&'X'].abs()).fold(0.0, f64::max);
            assert!((reached - last_mm).abs() < 0.01, "{}: {reached}", control.word());
        }
    }
}
