//! Messages on standard error: one form, colour on a terminal only, and counts that agree in number.

use std::fs;
use std::process::{Command, Output};

use abbe::model::Diagnostic;
use abbe::model::diagnostic::{FILE_ACCESS, Location};

use crate::suite::command::faults::TestFolder;

const PROGRAM: &str = env!("CARGO_BIN_EXE_abbe");

fn run(place: &TestFolder, arguments: &[&str], environment: &[(&str, &str)]) -> Output {
    Command::new(PROGRAM)
        .args(arguments)
        .current_dir(place.0.path())
        .env_remove("NO_COLOR")
        .env_remove("CLICOLOR_FORCE")
        .env_remove("CLICOLOR")
        .env("TERM", "xterm")
        .envs(environment.iter().copied())
        .output()
        .unwrap()
}

/// Sessions that are refused at a line, refused as a whole, or accepted with a warning.
fn test_folder() -> TestFolder {
    let place = TestFolder::new();
    let session = fs::read_to_string(place.at("session.toml")).unwrap();
    place.put("key.toml", &session.replace("noise_um", "noise_umm"));
    place.put("loud.toml", &session.replace("noise_um = 0.3", "noise_um = 0.03"));
    place
}

const MESSAGES: &[(&[&str], &[&str])] = &[
    (&["fit", "key.toml"], &["error: ", "help: did you mean `noise_um`?"]),
    (&["fit", "nowhere.toml"], &["error: "]),
    (&["fit", "session.toml", "--plots", "-"], &["error: "]),
    (&["fot"], &["error: "]),
    (&["fit", "loud.toml", "-q"], &["warning: "]),
];

/// Text without its colours: `ESC [ … m`.
fn plain(text: &str) -> String {
    let mut pieces = text.split('\u{1b}');
    let first = pieces.next().unwrap_or_default().to_string();
    pieces.fold(first, |all, piece| {
        let (code, rest) = piece.split_once('m').expect("a colour ends with m");
        assert!(code.starts_with('['), "{code}");
        all + rest
    })
}

#[test]
fn messages_have_one_form() {
    let place = test_folder();
    for (arguments, starts) in MESSAGES {
        let output = run(&place, arguments, &[]);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(stderr.starts_with(starts[0]), "{arguments:?}: {stderr}");
        for start in *starts {
            assert!(stderr.lines().any(|line| line.starts_with(start)), "{start}: {stderr}");
        }
        for other in ["Error:", "Help:", "Warning:"] {
            assert!(!stderr.contains(other), "{arguments:?}: {stderr}");
        }
    }
    // The message shows the line.
    let stderr = String::from_utf8(run(&place, &["fit", "key.toml"], &[]).stderr).unwrap();
    assert!(stderr.contains("key.toml:8") && stderr.contains(" 8 │ noise_umm = 0.3"), "{stderr}");
}

#[test]
fn colour_is_for_terminals_and_no_color_is_respected() {
    let place = test_folder();
    for (arguments, starts) in MESSAGES {
        let piped = String::from_utf8(run(&place, arguments, &[]).stderr).unwrap();
        assert!(!piped.contains('\u{1b}'), "{arguments:?}: {piped}");
        let forced = run(&place, arguments, &[("CLICOLOR_FORCE", "1")]);
        let forced = String::from_utf8(forced.stderr).unwrap();
        let word = starts[0].trim_end();
        let coloured = forced.lines().next().unwrap_or_default();
        assert!(coloured.starts_with('\u{1b}'), "{arguments:?}: {forced}");
        assert!(plain(coloured).starts_with(word), "{arguments:?}: {forced}");
        assert_eq!(plain(&forced), piped, "{arguments:?}");
        let off = run(&place, arguments, &[("NO_COLOR", "1")]);
        assert_eq!(String::from_utf8(off.stderr).unwrap(), piped, "{arguments:?}");
    }
}

/// `script` (util-linux) gives the program a terminal.
#[test]
#[cfg(target_os = "linux")]
fn a_terminal_has_colour() {
    let Some(script) = test_needs::program("a_terminal_has_colour", &["script"], &["--version"]) else { return };
    let place = test_folder();
    let on_terminal = |environment: &[(&str, &str)]| {
        let output = Command::new(&script)
            .args(["-qec", &format!("{PROGRAM} fit key.toml"), "/dev/null"])
            .current_dir(place.0.path())
            .env_remove("NO_COLOR")
            .env("TERM", "xterm")
            .envs(environment.iter().copied())
            .output()
            .unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    let stderr = on_terminal(&[]);
    assert!(stderr.starts_with('\u{1b}') && plain(&stderr).starts_with("error: "), "{stderr}");
    let stderr = on_terminal(&[("NO_COLOR", "1")]);
    assert!(stderr.starts_with("error: ") && !stderr.contains('\u{1b}'), "{stderr}");
}

#[test]
fn one_test_and_two_tests() {
    let place = TestFolder::new();
    let simulate = |out: &str, session: &str| {
        let output = run(&place, &["simulate", session, "--out", out], &[]);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{stderr}");
        String::from_utf8(output.stdout).unwrap()
    };
    let one = fs::read_to_string(place.at("session.toml")).unwrap();
    let test = &one[one.find("[[test]]").unwrap()..];
    place.put("two.toml", &format!("{one}\n{}", test.replace("\"XY\"", "\"again\"")));
    assert!(simulate("a", "session.toml").contains("90 readings of 1 test,"));
    assert!(simulate("b", "two.toml").contains("180 readings of 2 tests,"));
    let planned = run(&place, &["plan", "session.toml", "--no-effects"], &[]);
    let planned = String::from_utf8(planned.stdout).unwrap();
    assert!(planned.contains("\n90 readings in 1 test, 1 set-up,"), "{planned}");
    assert!(planned.contains("The plan identifies its 1 error;"), "{planned}");
}

#[test]
fn a_diagnostic_has_its_place_before_the_message_and_no_empty_help() {
    let file = std::path::Path::new("run/xy.csv");
    let found = Diagnostic::input(Location::line(file, 7), "a row of 3 cells", "");
    assert_eq!((found.to_string().as_str(), found.help()), ("run/xy.csv:7: a row of 3 cells", None));
    let whole = Diagnostic::other("cannot be read").at(Location::file(file));
    assert_eq!((whole.to_string().as_str(), whole.message.as_str()), ("run/xy.csv: cannot be read", "cannot be read"));
    assert_ne!(whole.code, Diagnostic::coded(FILE_ACCESS, "cannot be read").code);
}
