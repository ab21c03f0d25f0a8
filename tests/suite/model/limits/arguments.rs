//! Limits of plans and of command-line arguments.

use std::fs;

use tempfile::TempDir;

use super::{Case, folder, refused};
use crate::suite::{abbe, text};

fn plan() -> TempDir {
    let case = Case { more: "sweep = { axis = \"C\", from_deg = 0, to_deg = 360, step_deg = 10 }", ..Case::default() };
    folder(&case.session().replace("data = \"C.csv\"\n", ""), "")
}

#[test]
fn arguments_at_their_limits() {
    let folder = plan();
    let out = folder.path().join("out");
    for (command, more, message) in [
        ("plan", &["--noise-um", "1e-300"][..], "`--noise-um 1e-300`: a number of µm from 1e-6 to 1e12 is expected"),
        ("plan", &["--noise-um", "inf"], "a number of µm from 1e-6 to 1e12 is expected"),
        ("plan", &["--setup-um", "1e300"], "a number of µm from 1e-6 to 1e12 is expected"),
        ("simulate", &["--noise-um", "1e300"], "a standard deviation in µm is expected: 0, or 1e-6 to 1e12"),
        ("simulate", &["--noise-um", "1e-300"], "a standard deviation in µm is expected: 0, or 1e-6 to 1e12"),
        ("simulate", &["--error", "EX0C=1e300um"], "1e300 is too large; the limit is 1e12"),
        ("simulate", &["--error", "EX0C=1e10um"], "`EX0C=1e10um`: 1e10 um is too large; the limit is 1 km"),
        (
            "plan",
            &["--improve", "--radii-mm", "1e300"],
            "`--radii-mm 1e300`: a length from 1 to 1000000 mm is expected",
        ),
        (
            "plan",
            &["--improve", "--heights-mm", "1e7"],
            "`--heights-mm 1e7`: a length from 0 to 1000000 mm is expected",
        ),
        (
            "plan",
            &["--improve", "--feeds", "1e300"],
            "`--feeds 1e300`: a multiple of the feed above 0 and at most 1000",
        ),
        (
            "plan",
            &["--improve", "--sweep-shares", "2"],
            "`--sweep-shares 2`: a share of the range above 0 and at most 1",
        ),
        ("plan", &["--improve", "--setup-min", "1e300"], "`--setup-min 1e300`: a number of minutes from 0 to 10000"),
        ("plan", &["--reach-mm", "1e300"], "`--reach-mm 1e300`: a length from 0 to 1000000 mm is expected"),
        ("poses", &["--poses", "5", "--box-mm=-1e300,1e300,-1,1,-1,1"], "`--box-mm -1e300`: a length from -1000000"),
        ("poses", &["--poses", "5", "--height-mm=0,1e300"], "`--height-mm"),
        ("poses", &["--poses", "5", "--tracker-mm=0,1e300,0"], "`--tracker-mm 1e300`: a length from -1000000"),
        ("plan", &["--device-mm", "80,320,60,80,150,1e300"], "`--device-mm 1e300`: a length above 0 and at most"),
        ("plan", &["--global", "--vary", "EZC~C:h2=-1um"], "`--vary EZC~C:h2=-1um`: half the range"),
        ("plan", &["--global", "--vary", "bar=0um"], "`--vary bar=0um`: half the range or a standard deviation"),
    ] {
        let mut arguments = more.to_vec();
        if command == "simulate" {
            arguments.extend(["--out", text(&out)]);
        }
        refused(folder.path(), command, &arguments, &[message]);
        assert!(!out.exists());
    }
}

/// A sweep with steps that are too small for any machine, and a sweep with more readings than memory.
#[test]
fn steps_without_end() {
    for step in ["1e-300", "1e-6"] {
        let folder = plan();
        let path = folder.path().join("session.toml");
        let session = fs::read_to_string(&path).unwrap().replace("step_deg = 10", &format!("step_deg = {step}"));
        fs::write(&path, session).unwrap();
        refused(
            folder.path(),
            "plan",
            &["--no-effects"],
            &["session.toml:16", "the limit is 1000000 readings", "use a larger step"],
        );
    }
}

/// A denormal error gives the same readings as none.
#[test]
fn a_denormal_error() {
    let folder = plan();
    let session = folder.path().join("session.toml");
    let simulated = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let output = abbe(&[&["simulate", text(&session), "--out", text(&out), "--noise-um", "0"], more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        fs::read_to_string(out.join("C.csv")).unwrap()
    };
    let plain = simulated("plain", &[]);
    assert_eq!(simulated("small", &["--error", "EX0C=5e-324um"]), plain);
    assert_ne!(simulated("large", &["--error", "EX0C=1um"]), plain);
}
