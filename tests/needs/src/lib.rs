//! What tests need beyond Rust: programs, Python modules, public data.
//!
//! A test that lacks one of them says `skipped: TEST (REASON)` and ends. Where the environment variable `CI` is set, it
//! fails instead. Each skipped test is recorded, and the last test program of `cargo test --workspace`
//! (`tests/skipped.rs` of this package) prints how many there were and why.

mod record;

use std::path::{Path, PathBuf};
use std::process::Command;

pub use record::{here, summary, taken};

/// Whether tests run on a build server, which has to have whatever a test needs.
fn in_ci() -> bool {
    std::env::var("CI").is_ok_and(|value| !matches!(value.as_str(), "" | "0" | "false"))
}

/// Records that a test is skipped.
///
/// # Panics
///
/// Where `CI` is set.
pub fn skip(test: &str, reason: &str) {
    assert!(!in_ci(), "{test}: {reason}, and CI needs it");
    skip_in_ci_too(test, reason);
}

/// Records that a test is skipped, in CI too. Only for what a build server cannot install: Debian packages Julia in some
/// releases only.
pub fn skip_in_ci_too(test: &str, reason: &str) {
    println!("skipped: {test} ({reason})");
    record::add(&here(), test, reason);
}

/// The first of these programs that exits with status 0 when it has these arguments; empty names are passed over.
pub fn first(programs: &[&str], probe: &[&str]) -> Option<PathBuf> {
    let mut named = programs.iter().filter(|program| !program.is_empty());
    let runs = |program: &&&str| Command::new(program).args(probe).output().is_ok_and(|ran| ran.status.success());
    named.find(runs).map(PathBuf::from)
}

/// As [`first`]; without one of the programs the test is skipped.
pub fn program(test: &str, programs: &[&str], probe: &[&str]) -> Option<PathBuf> {
    let found = first(programs, probe);
    if found.is_none() {
        let named: Vec<&str> = programs.iter().copied().filter(|program| !program.is_empty()).collect();
        skip(test, &format!("no {}", named.join(" or ")));
    }
    found
}

/// A browser that opens pages without a screen.
pub fn browser(test: &str) -> Option<PathBuf> {
    program(test, &["chromium", "chromium-browser", "google-chrome"], &["--version"])
}

/// A Python that has these modules, separated by commas: that of `ABBE_PYTHON`, otherwise that of the system.
pub fn python(test: &str, modules: &str) -> Option<PathBuf> {
    let own = std::env::var("ABBE_PYTHON").unwrap_or_default();
    let found = first(&[&own, "python3", "/usr/bin/python3"], &["-c", &format!("import {modules}")]);
    if found.is_none() {
        skip(test, &format!("no Python with {modules}; set ABBE_PYTHON"));
    }
    found
}

/// The folder of the public data: `ABBE_DATA`, otherwise `../shared/data` beside the workspace.
pub fn data_folder() -> PathBuf {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    std::env::var_os("ABBE_DATA").map_or_else(beside, PathBuf::from)
}

/// A file or folder of the public data; `../sample` has the samples of another simulator.
pub fn data(test: &str, path: &str) -> Option<PathBuf> {
    let found = data_folder().join(path);
    if found.exists() {
        return Some(found);
    }
    skip(test, "no public data; set ABBE_DATA");
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A test that needs what no machine has. The test below runs it as a child.
    #[test]
    #[ignore = "a child of `a_missing_program_skips_a_test_and_fails_it_in_ci`"]
    fn child() {
        assert!(program("child", &["", "abbe-has-no-such-program", "abbe-has-no-other"], &[]).is_none());
        assert!(data("child", "no-such-folder").is_none());
        assert!(python("child", "no_such_module_of_abbe").is_none());
        skip_in_ci_too("child", "no Julia");
    }

    #[test]
    fn a_missing_program_skips_a_test_and_fails_it_in_ci() {
        let run = |ci: Option<&str>| {
            let mut command = Command::new(std::env::current_exe().unwrap());
            command.args(["--exact", "tests::child", "--ignored", "--nocapture"]).env_remove("CI");
            let ran = command.envs(ci.map(|value| ("CI", value))).output().unwrap();
            let said = String::from_utf8(ran.stdout).unwrap() + &String::from_utf8(ran.stderr).unwrap();
            (ran.status.success(), said)
        };
        let reasons = [
            "no abbe-has-no-such-program or abbe-has-no-other",
            "no public data; set ABBE_DATA",
            "no Python with no_such_module_of_abbe; set ABBE_PYTHON",
            "no Julia",
        ];
        for ci in [None, Some(""), Some("false")] {
            let (passed, said) = run(ci);
            assert!(passed, "{said}");
            for reason in reasons {
                assert!(said.contains(&format!("skipped: child ({reason})\n")), "{reason}: {said}");
            }
            // A child records under this process, which is its parent.
            let recorded = taken(&record::place(std::process::id()));
            assert_eq!(recorded, reasons.map(|reason| ("child".to_string(), reason.to_string())));
        }
        for ci in ["true", "1"] {
            let (passed, said) = run(Some(ci));
            assert!(!passed && said.contains(&format!("child: {}, and CI needs it", reasons[0])), "{said}");
        }
        assert_eq!(taken(&record::place(std::process::id())), []);
    }

    #[test]
    fn the_summary_ends_with_the_count_and_the_reasons() {
        let of = |entries: &[(&str, &str)]| {
            summary(&entries.iter().map(|(test, reason)| (test.to_string(), reason.to_string())).collect::<Vec<_>>())
        };
        assert_eq!(of(&[]), "\n0 tests skipped\n\n");
        assert_eq!(
            of(&[("b", "no data"), ("c", "no octave"), ("a", "no data"), ("b", "no data")]),
            "\nskipped: a (no data)\nskipped: b (no data)\nskipped: c (no octave)\n\
             3 tests skipped: 2 for \"no data\", 1 for \"no octave\"\n\n"
        );
        assert_eq!(of(&[("a", "no data")]), "\nskipped: a (no data)\n1 test skipped: 1 for \"no data\"\n\n");
    }
}
