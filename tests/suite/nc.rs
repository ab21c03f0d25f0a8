//! `abbe nc`: a folder of programs, or a reason and no folder. The motion is judged in `codegen/tests/equations/nc.rs`.

use super::{abbe, ready, text};

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
        (
            &["--control", "mazak"][..],
            "no control is called `mazak`; the controls are linuxcnc, fanuc, siemens, heidenhain",
        ),
        (&["--control", "fanuc", "--overshoot-deg", "4000"], "the overshoot in degrees is 4000"),
        (&["--control", "linuxcnc", "--tool-point"], "linuxcnc has no function that moves the tool point"),
    ] {
        let output = run(options);
        assert_eq!(output.status.code(), Some(1));
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.contains(expected), "{message}");
        assert!(!out.exists());
    }
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
