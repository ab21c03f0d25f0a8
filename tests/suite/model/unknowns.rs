//! The errors that a session estimates: by name, by pattern and by default.

use std::fs;
use std::path::Path;

use abbe::files::{self, ReadOptions};
use abbe::model::session::Session;

use crate::suite::{abbe, ready, text, workspace};

const POSES: &str = "[[test]]\nname = \"T\"\npath = { kind = \"list\" }\ndata = \"none.csv\"\n";
const TARGET: &str = "target_mm = [10, 20, 30]\n";
const BALL: &str = "socket = \"1\"\nball_mm = [10, 20, 30]\n";
const BAR: &str = "bar_mm = 100.0\nworkpiece_ball_mm = [0, 100, 0]\nspindle_ball_mm = [0, 0, 0]\nsweep = { axis = \"C\", from_deg = 0, to_deg = 90, step_deg = 1 }\n";

fn read(folder: &Path, machine: &str, instrument: &str, unknowns: &str, test: &str) -> Result<Session, String> {
    let test = if test == BAR { format!("[[test]]\nname = \"T\"\n{BAR}") } else { format!("{POSES}{test}") };
    let session = format!("{machine}\n[instrument]\nkind = \"{instrument}\"\nnoise_um = 1\n\n{unknowns}\n{test}");
    fs::write(folder.join("session.toml"), session).unwrap();
    let options = ReadOptions { read_data: false, ..ReadOptions::default() };
    files::session(&folder.join("session.toml"), &options).map_err(|fault| fault.to_string())
}

fn names(session: &Session) -> Vec<String> {
    session.unknowns.iter().map(ToString::to_string).collect()
}

/// The six location errors of each axis: `EX0J1` to `EC0J1`, `EX0J2` and so on.
fn six_each(axes: &[&str]) -> Vec<String> {
    let of = |axis: &&str| "XYZABC".chars().map(|letter| format!("E{letter}0{axis}")).collect::<Vec<_>>();
    axes.iter().flat_map(of).collect()
}

fn robot(name: &str) -> String {
    let file = ready(&format!("{name}/machine.toml"));
    // The session contains its machine.
    let machine = fs::read_to_string(file).unwrap().replace("[axis.", "[machine.axis.");
    format!("[machine]\n{machine}")
}

const TABLE: &str = "[machine]\nchain = \"w C b X t\"\n[machine.axis.C]\n[machine.axis.X]\n";

#[test]
fn by_default_a_robot_has_all_location_errors_of_all_joints() {
    let folder = tempfile::tempdir().unwrap();
    let ur10 = ["J1", "J2", "J3", "J4", "J5", "J6"];
    for (machine, instrument, test, joints) in [
        ("ur10", "tracker", TARGET, &ur10[..]),
        ("kuka-iiwa14", "socket", BALL, &["J1", "J2", "J3", "J4", "J5", "J6", "J7"]),
    ] {
        let machine = robot(machine);
        for unknowns in ["", "[unknowns]\n"] {
            let session = read(folder.path(), &machine, instrument, unknowns, test).unwrap();
            assert_eq!(names(&session), six_each(joints));
        }
        // An empty list estimates none.
        let none = read(folder.path(), &machine, instrument, "[unknowns]\nerrors = []\n", test).unwrap();
        assert_eq!(none.unknowns, []);
    }
    // A linear axis has squarenesses; a rotation about its own direction changes no reading.
    let mixed = read(folder.path(), TABLE, "tracker", "", TARGET).unwrap();
    let mut expected = six_each(&["C"]);
    expected.extend(["EB0X", "EC0X"].map(String::from));
    assert_eq!(names(&mixed), expected);
    // A ball bar estimates the position and orientation errors of rotary axes.
    let bar = read(folder.path(), TABLE, "ballbar", "", BAR).unwrap();
    assert_eq!(names(&bar), ["EX0C", "EY0C", "EA0C", "EB0C"]);
}

#[test]
fn the_bundled_robots_list_their_errors_by_a_pattern() {
    let ur10 = ["J1", "J2", "J3", "J4", "J5", "J6"];
    let options = ReadOptions { read_data: false, ..ReadOptions::default() };
    let session = files::session(&ready("ur10/session.toml"), &options).unwrap();
    assert_eq!(names(&session), six_each(&ur10));
    for file in ["ur10/session.toml", "kuka-iiwa14/session.toml"] {
        let text = fs::read_to_string(ready(file)).unwrap();
        assert!(text.contains("errors = [\"E?0J*\"]"), "{file}");
    }
}

#[test]
fn a_pattern_selects_the_errors_that_it_matches() {
    let folder = tempfile::tempdir().unwrap();
    let asked = |errors: &str| {
        let unknowns = format!("[unknowns]\nerrors = [{errors}]\n");
        read(folder.path(), TABLE, "ballbar", &unknowns, BAR)
    };
    for (errors, expected) in [
        ("\"E?0C\"", &["EX0C", "EY0C", "EZ0C", "EA0C", "EB0C", "EC0C"][..]),
        ("\"e_?0c\"", &["EX0C", "EY0C", "EZ0C"]),
        ("\"E?X\"", &["EXX", "EYX", "EZX", "EAX", "EBX", "ECX"]),
        ("\"E?0X\"", &["EA0X", "EB0X", "EC0X"]),
        // An error that is listed twice is estimated once.
        ("\"EC0X\", \"E?0X\", \"EB0X\", \"EB*X\"", &["EC0X", "EA0X", "EB0X", "EBX"]),
    ] {
        assert_eq!(names(&asked(errors).unwrap()), expected, "{errors}");
    }
    assert!(asked("\"EX0C\", \"EX0C\"").unwrap_err().contains("occurs twice"));
    for nothing in ["E?0B", "?0C", "EX0?C", "E?1C"] {
        let fault = asked(&format!("\"EX0C\",\n  \"{nothing}\"")).unwrap_err();
        for part in ["session.toml:12", &format!("\"{nothing}\" matches no error of the machine")] {
            assert!(fault.contains(part), "`{part}` is not in\n{fault}");
        }
    }
}

#[test]
fn an_equation_accepts_the_same_patterns() {
    let session = workspace().join("sessions/hermle-c600u/chapter5.toml");
    let machine = workspace().join("sessions/hermle-c600u/machine.toml");
    let of = |errors: &str| {
        let [first, second] = [
            &["equation", text(&session), "--test", "C150", "--order", "first", "--errors", errors][..],
            &["volumetric", text(&machine), "--order", "first", "--errors", errors],
        ]
        .map(|arguments| {
            let output = abbe(arguments);
            (output.status.code(), output.stdout, String::from_utf8(output.stderr).unwrap())
        });
        assert_eq!(first.0, second.0);
        (first, second)
    };
    assert_eq!(of("E?0C"), of("EX0C,EY0C,EZ0C,EA0C,EB0C,EC0C"));
    let ((status, _, stderr), _) = of("E?0B");
    assert_eq!(status, Some(1));
    assert!(stderr.contains("`E?0B` matches no error of the machine"), "{stderr}");
}
