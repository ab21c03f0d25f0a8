//! Limits of maps of the volumetric error and of files of errors.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use tempfile::TempDir;

use crate::suite::{abbe, ready, text};

/// The message of `abbe volumetric --map` for refused input. No map is written.
#[track_caller]
fn message_of(folder: &TempDir, functions: &Path, more: &[&str]) -> String {
    let (machine, map) = (ready("volumetric/machine.toml"), folder.path().join("map.csv"));
    let base = ["volumetric", text(&machine), "--map", text(&map), "--functions", text(functions)];
    let output = abbe(&[&base[..], more].concat());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(!map.exists());
    stderr
}

/// The output of `abbe simulate --values` with a file, and its output folder.
fn simulated(folder: &TempDir, errors: &Path) -> (Output, PathBuf) {
    let (plan, out) = (ready("hermle-c600u/chapter5.toml"), folder.path().join("out"));
    let output = abbe(&["simulate", text(&plan), "--out", text(&out), "--values", text(errors)]);
    (output, out)
}

#[test]
fn error_functions_beyond_the_largest_value() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("errors.toml");
    for (error, form, message) in [
        ("EXX", "polynomial = { um = [1e300] }", "1e300, which is too large; the limit is 1e12"),
        (
            "EXX",
            "table = { at_mm = [-1e308, 1e308], um = [0, 1] }",
            "errors.toml:3: `at_mm` is -1e308, which is too large; the limit is 1 km",
        ),
        ("EXC", "harmonic = { order = 1e300, amplitude_um = 1 }", "1e300, which is too large; the limit is 1e12"),
        ("EXX", "polynomial = { um = [nan] }", "errors.toml:3: `um` is NaN; a number is expected"),
        (
            "EXX",
            "polynomial = { scale_mm = 1e-300, um = [0, 1, 1] }",
            "the errors displace the tool by inf mm at C -180.000, A -115.000, Y -250.000, X -300.000, Z -250.000",
        ),
    ] {
        fs::write(&file, format!("[[function]]\nerror = \"{error}\"\n{form}\n")).unwrap();
        let stderr = message_of(&folder, &file, &[]);
        assert!(stderr.contains(message), "{stderr}");
    }
}

#[test]
fn arguments_of_a_map() {
    let folder = tempfile::tempdir().unwrap();
    let ready = ready("volumetric/errors.toml");
    for (more, message) in [
        (["--places", "18446744073709551615"], "a number of places from 1 to 1000000 is expected"),
        (["--places", "1000000000000"], "`--places 1000000000000`: a number of places from 1 to 1000000 is expected"),
        (["--axis", "X:1e18"], "--axis X:1e18: 1000000 places are the most"),
        (["--axis", "A=1e300"], "`--axis A=1e300`: a position in mm or degrees from -1000000 to 1000000 is expected"),
        (["--axis", "A=inf"], "`--axis A=inf`: a position in mm or degrees from -1000000 to 1000000 is expected"),
        (["--axis", "A=nan"], "write where the axis stands"),
        (["--tool-mm", "1e300,0,0"], "`--tool-mm 1e300`: a length from -1000000 to 1000000 mm is expected"),
        (["--tool-mm", "0,0,-1e9"], "`--tool-mm -1e9`: a length from -1000000 to 1000000 mm is expected"),
        (["--places", "100"], "is not in the range from 1 to 1000000 points"),
    ] {
        let stderr = message_of(&folder, &ready, &more);
        assert!(stderr.contains(message), "{stderr}");
    }
}

/// Files that the command line names have the limits of a session: they are read completely or refused, and reading
/// always ends.
#[test]
fn invalid_files_of_errors() {
    let folder = tempfile::tempdir().unwrap();
    let large = folder.path().join("large.toml");
    fs::write(&large, " ".repeat((8 << 20) + 1)).unwrap();
    let latin = folder.path().join("latin.toml");
    fs::write(&latin, b"EX0C = \"1 \xb5m\"\n").unwrap();
    let long = folder.path().join("long.toml");
    fs::write(&long, format!("EX0C = \"{}\"\n", "1".repeat(300_000))).unwrap();
    let refused = |file: &Path| {
        let (output, out) = simulated(&folder, file);
        assert_eq!(output.status.code(), Some(1));
        assert!(!out.exists());
        String::from_utf8(output.stderr).unwrap()
    };
    for (file, message) in [
        (large.as_path(), "has more than 8388608 bytes, which is the limit"),
        (latin.as_path(), "byte 11 is not UTF-8"),
        (folder.path(), "this is a folder"),
        (Path::new("/dev/zero"), "has more than 8388608 bytes"),
    ] {
        for stderr in [refused(file), message_of(&folder, file, &[])] {
            assert!(stderr.contains(message) && stderr.contains(text(file)), "{stderr}");
        }
    }
    let stderr = refused(&long);
    assert!(
        stderr.contains("`EX0C`: a number with its unit of 300000 bytes is too large; the limit is 100 bytes"),
        "{stderr}"
    );
}

/// A byte order mark and CRLF line ends have no effect.
#[test]
fn a_byte_order_mark_before_errors() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("errors.toml");
    fs::write(&file, "\u{feff}EX0C = \"3 um\"\r\nEY0C = \"-2 um\"\r\n").unwrap();
    let (output, _) = simulated(&folder, &file);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let stdout = String::from_utf8(output.stdout).unwrap();
    assert!(stdout.contains("EX0C") && stdout.contains("3.0000") && stdout.contains("-2.0000"), "{stdout}");
}
