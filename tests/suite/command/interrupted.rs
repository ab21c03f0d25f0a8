//! Ctrl-C: an interrupted trace reports the effects found until then, and every output states that it is incomplete.
#![cfg(unix)]

use abbe::identify::results::TraceVerdict;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use abbe::files::{self, ReadOptions};
use abbe::model::session::Session;
use abbe::trace::result::TraceResult;
use abbe::trace::{Progress, TraceOptions, TraceOutcome, trace};

use crate::suite::{ready, text};

/// The exit status of shells for SIGINT.
const INTERRUPTED: i32 = 130;
/// The exit status of shells for SIGTERM.
const TERMINATED: i32 = 143;

/// A command that runs the program of its next argument with the default action of SIGINT. Where a script starts the
/// tests in the background, SIGINT is ignored, and a program inherits that. `env` is that of GNU coreutils 8.31 or
/// later; systems without it (macOS) have Perl.
fn with_default_action() -> Command {
    let of_coreutils = test_needs::first(&["env"], &["--default-signal=INT", "true"]).is_some();
    let mut command = Command::new(if of_coreutils { "env" } else { "perl" });
    if of_coreutils {
        command.arg("--default-signal=INT");
    } else {
        command.args(["-e", "$SIG{INT} = 'DEFAULT'; exec @ARGV or die"]);
    }
    command
}

fn start(arguments: &[&str]) -> Child {
    with_default_action()
        .arg(env!("CARGO_BIN_EXE_abbe"))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn interrupt(child: &Child) {
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(sent.unwrap().success());
}

/// The messages of a program until its search has found the first effect, and the reader of its later messages.
fn until_the_first_effect(child: &mut Child) -> (BufReader<ChildStderr>, String) {
    let mut messages = BufReader::new(child.stderr.take().unwrap());
    let mut stderr = String::new();
    while !stderr.lines().any(|line| line.starts_with("  + ")) {
        assert!(messages.read_line(&mut stderr).unwrap() > 0, "no effect is found: {stderr}");
    }
    (messages, stderr)
}

/// Interrupts a program when its search has found the first effect. Returns exit status, standard output and messages.
fn interrupted_in_the_search(arguments: &[&str]) -> (ExitStatus, String, String) {
    let mut child = start(arguments);
    let (mut messages, mut stderr) = until_the_first_effect(&mut child);
    interrupt(&child);
    messages.read_to_string(&mut stderr).unwrap();
    let mut result = String::new();
    child.stdout.take().unwrap().read_to_string(&mut result).unwrap();
    (child.wait().unwrap(), result, stderr)
}

#[test]
fn an_interrupted_trace_exits_with_130_and_every_output_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [json, csv, next, report] = ["t.json", "t.csv", "next.toml", "t.html"].map(at);
    let session = ready("hermle-c600u/measured/session.toml");
    let (status, result, stderr) = interrupted_in_the_search(&[
        "trace",
        text(&session),
        "--json",
        text(&json),
        "--csv",
        text(&csv),
        "--write",
        text(&next),
        "--report",
        text(&report),
    ]);
    assert_eq!(status.code(), Some(INTERRUPTED), "{stderr}");
    assert!(result.starts_with("Verdict: incomplete. The search was interrupted after 1 effect. "), "{result}");
    assert!(stderr.contains("interrupted after 1 effect\n"), "{stderr}");
    let read = |path: &Path| std::fs::read_to_string(path).unwrap();
    let result: serde_json::Value = serde_json::from_str(&read(&json)).unwrap();
    assert_eq!(result["interrupted"], true);
    assert_eq!(result["verdict"], "incomplete");
    let effects = result["effects"].as_array().unwrap();
    assert_eq!(effects.len(), 1);
    assert_eq!((effects[0]["component"].as_str(), effects[0]["order"].as_f64()), (Some("EZC"), Some(2.0)));
    // The found effect is fitted: the simulated amplitude is 1.5 µm.
    let amplitude = effects[0]["parameters"][0]["value"].as_f64().unwrap();
    assert!((amplitude - 1.5).abs() < 0.1, "{amplitude}");
    assert!(read(&csv).lines().any(|line| line.starts_with("search,interrupted,")));
    assert!(read(&next).starts_with("# The trace was interrupted after 1 effect"));
    assert!(read(&report).contains("interrupted after 1 effect"));
}

/// A pipe without a reader blocks the program while it writes its results. The second Ctrl-C arrives then.
#[test]
fn a_second_interruption_ends_the_program_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("trace.json");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let session = ready("hermle-c600u/measured/session.toml");
    let mut child = start(&["trace", text(&session), "--json", text(&pipe)]);
    let mut messages = until_the_first_effect(&mut child).0;
    interrupt(&child);
    let mut result = BufReader::new(child.stdout.take().unwrap());
    let mut verdict = String::new();
    result.read_line(&mut verdict).unwrap();
    assert!(verdict.starts_with("Verdict: incomplete. The search was interrupted after 1 effect. "), "{verdict}");
    interrupt(&child);
    let began = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if began.elapsed() > Duration::from_secs(20) {
            child.kill().unwrap();
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let mut stderr = String::new();
    messages.read_to_string(&mut stderr).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(INTERRUPTED), "{stderr}");
    assert!(stderr.contains("interrupted; nothing more is written"), "{stderr}");
}

/// A time limit that ends before the search does leaves the declared model, with exit status 0 and a field that names
/// the limit. A limit that is long enough changes nothing.
#[test]
fn a_time_limit_ends_the_search_and_every_output_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [json, whole, next] = ["t.json", "whole.json", "next.toml"].map(at);
    let session = ready("hermle-c600u/measured/session.toml");
    let run = |limit: &str, json: &Path| {
        let arguments = ["trace", text(&session), "--only", "EZC~C:h", "--quiet", "--time-limit", limit];
        let arguments = [&arguments[..], &["--json", text(json), "--write", text(&next)]].concat();
        Command::new(env!("CARGO_BIN_EXE_abbe")).args(arguments).output().unwrap()
    };
    let output = run("1e-6", &json);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    let said = "interrupted by the time limit of 0.000001 s after 0 effects";
    assert!(stderr.contains(said), "{stderr}");
    let read =
        |path: &Path| -> serde_json::Value { serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap() };
    let result = read(&json);
    assert_eq!((&result["interrupted"], &result["verdict"]), (&true.into(), &"incomplete".into()));
    assert_eq!(result["time_limit_s"], 1e-6);
    assert_eq!(result["statements"]["measure"]["step"], "trace", "{result}");
    assert!(std::fs::read_to_string(&next).unwrap().contains(said));
    assert_eq!(run("600", &whole).status.code(), Some(0));
    let result = read(&whole);
    assert_eq!((&result["interrupted"], &result["time_limit_s"]), (&false.into(), &serde_json::Value::Null));
    assert_eq!(run("soon", &whole).status.code(), Some(2));
}

/// A fit has no partial result: the signal ends the program, and nothing is written. The sign that the fit runs: its
/// last data file, a pipe, is read.
#[test]
fn an_interrupted_fit_ends_by_the_signal() {
    let folder = tempfile::tempdir().unwrap();
    let measured = ready("hermle-c600u/measured");
    for entry in std::fs::read_dir(&measured).unwrap() {
        let file = entry.unwrap().path();
        std::fs::copy(&file, folder.path().join(file.file_name().unwrap())).unwrap();
    }
    let [session, json, pipe] = ["session.toml", "fit.json", "C150.csv"].map(|name| folder.path().join(name));
    let readings = std::fs::read(&pipe).unwrap();
    std::fs::remove_file(&pipe).unwrap();
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let mut child = start(&["fit", text(&session), "--monte-carlo", "1000000", "--json", text(&json)]);
    let writer = std::thread::spawn(move || std::fs::write(pipe, readings).unwrap());
    while !writer.is_finished() {
        assert!(child.try_wait().unwrap().is_none(), "the program ended before it read its data");
        std::thread::sleep(Duration::from_millis(1));
    }
    interrupt(&child);
    assert_eq!(child.wait().unwrap().signal(), Some(2));
    assert!(!json.exists());
}

/// A script starts its background jobs with SIGINT ignored.
#[test]
fn signals_are_tested_in_the_background_too() {
    let here = std::env::current_exe().unwrap();
    let name = "suite::command::interrupted::an_interrupted_fit_ends_by_the_signal";
    let run = Command::new("sh")
        .args(["-c", "trap '' INT; exec \"$0\" --exact \"$1\""])
        .args([text(&here), name])
        .current_dir(crate::suite::workspace())
        .output()
        .unwrap();
    let printed = String::from_utf8_lossy(&run.stdout);
    assert!(run.status.success() && printed.contains("1 passed"), "{printed}");
}

/// Runs a trace that is interrupted at the `until`-th query. Returns the number of queries.
fn traced(session: &Session, until: usize) -> (TraceOutcome, usize) {
    let asked = AtomicUsize::new(0);
    let progress = |progress: Progress| match progress {
        Progress::Working => asked.fetch_add(1, Ordering::Relaxed) < until,
        _ => asked.load(Ordering::Relaxed) <= until,
    };
    let options = TraceOptions {
        only: ["EZC~C:h", "EAC~C:h", "EZC~C:steps"].map(String::from).to_vec(),
        ..TraceOptions::default()
    };
    let found = trace(session, &options, &progress).unwrap();
    (found, asked.into_inner())
}

fn ids(trace: &TraceOutcome) -> Vec<String> {
    trace.effects.iter().map(|effect| effect.id()).collect()
}

/// A trace that is interrupted at any point ends soon, and its result is consistent.
#[test]
fn a_trace_can_be_interrupted_anywhere() {
    let file = ready("hermle-c600u/measured/session.toml");
    let session = files::session(&file, &ReadOptions::default()).unwrap();
    let (whole, asked) = traced(&session, usize::MAX);
    assert!(!whole.result.interrupted && asked > 20, "{asked}");
    assert_eq!(ids(&whole), ["EZC~C:h2"]);
    let mut effects = Vec::new();
    for until in [0, 1, 2, 3, 4, asked / 4, asked / 2, 3 * asked / 4, asked - 1] {
        let (found, asked) = traced(&session, until);
        // Models that are trained in parallel may query at the same time.
        assert!(asked <= until + 16, "asked {} times more", asked - until);
        let result: &TraceResult = &found.result;
        assert!(result.interrupted && result.verdict == TraceVerdict::Incomplete, "{until}: {}", result.verdict);
        assert_eq!(result.effects.len(), found.effects.len());
        assert_eq!(
            result.interruption(),
            format!(
                "interrupted after {} effect{}",
                found.effects.len(),
                if found.effects.len() == 1 { "" } else { "s" }
            )
        );
        assert!(result.warnings.iter().any(|warning| warning.contains("interrupted")));
        assert_eq!(found.after.parameters.effects, found.effects);
        // The session states its noise of 0.3 µm; the residual is 0.55 µm until the effect is found.
        let found_it = ids(&found) == ["EZC~C:h2"];
        assert!(found_it || found.effects.is_empty(), "{:?}", ids(&found));
        assert_eq!(result.after.fit.rms_um < 0.31, found_it, "{until}: {}", result.after.fit.rms_um);
        effects.push(found.effects.len());
    }
    assert!(effects.is_sorted() && effects.contains(&0) && effects.contains(&1), "{effects:?}");
}

/// SIGTERM, which a scheduler sends, ends a command while it writes, or computes, or searches: exit status 143, no
/// temporary file, the old outputs.
#[test]
fn a_terminated_program_leaves_no_temporary_file() {
    let place = crate::suite::command::faults::TestFolder::new();
    let rows = "1\n".repeat(4_000_000);
    place.put("commands.csv", &format!("x_mm\n{rows}"));
    assert!(place.shell("abbe fit session.toml --save model.json --quiet").status.success());
    let before = place.names();
    // A command that handles Ctrl-C itself.
    let output = place.shell(
        "abbe compensate model.json commands.csv --out out.csv & \
         until ls -A | grep -q '^.abbe-'; do :; done; kill -TERM $!; wait $!",
    );
    assert_eq!(output.status.code(), Some(TERMINATED), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(place.names(), before);
    // Commands that do not: the pipe without a reader holds them after the first output.
    place.put("old.json", "old");
    let before = place.names();
    let output = place.shell(
        "mkfifo pipe; abbe simulate session.toml --out new --json pipe --quiet & \
         until test -d new; do sleep 0.01; done; kill -TERM $!; wait $!; code=$?; rm -r pipe new; exit $code",
    );
    assert_eq!(output.status.code(), Some(TERMINATED), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(place.names(), before);
    // At any time, by a scheduler, by Ctrl-C or by the end of a terminal. A script ignores Ctrl-C in what it starts in the
    // background.
    let signals = [("TERM", TERMINATED), ("INT", INTERRUPTED), ("HUP", 129)];
    for (number, (signal, code)) in (0..24).zip(signals.into_iter().cycle()) {
        let delay = 0.003 * f64::from(number);
        let line = format!(
            "env --default-signal=INT abbe fit session.toml --json new.json --plots plots{number} -q & \
             sleep {delay}; kill -{signal} $!; wait $!"
        );
        let output = place.shell(&line);
        assert!(output.status.code().is_some_and(|found| found == 0 || found == code), "{signal}: {:?}", output.status);
        for name in place.names() {
            assert!(!name.starts_with(".abbe-"), "{name} is left");
        }
    }
}

/// A search that SIGTERM ends reports the effects found until then, as after Ctrl-C.
#[test]
fn a_terminated_trace_reports_what_it_has_found() {
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("t.json");
    let session = ready("hermle-c600u/measured/session.toml");
    let mut child = start(&["trace", text(&session), "--json", text(&json)]);
    let (mut messages, mut stderr) = until_the_first_effect(&mut child);
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    messages.read_to_string(&mut stderr).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(TERMINATED), "{stderr}");
    let result: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    assert_eq!((&result["interrupted"], result["effects"].as_array().unwrap().len()), (&true.into(), 1));
}

/// What a killed program has left is removed by the next command that writes there; what a living one holds stays.
#[test]
fn a_later_command_removes_stale_temporary_files() {
    let place = crate::suite::command::faults::TestFolder::new();
    place.put(".abbe-aBcD12aBcD12aBcD.tmp", "half of an output");
    std::fs::create_dir_all(place.at(".abbe-eFgH34eFgH34eFgH/whole")).unwrap();
    place.put(".abbe-eFgH34eFgH34eFgH/lock", "");
    place.put(".abbe-eFgH34eFgH34eFgH/whole/session.toml", "half of a folder");
    place.put(".abbe-iJkL56iJkL56iJkL.tmp", "written by another process");
    let held = std::fs::File::open(place.at(".abbe-iJkL56iJkL56iJkL.tmp")).unwrap();
    held.lock().unwrap();
    assert!(place.shell("abbe fit session.toml --json out.json --quiet").status.success());
    assert_eq!(place.names(), [".abbe-iJkL56iJkL56iJkL.tmp", "circle.csv", "out.json", "session.toml"]);
    drop(held);
    assert!(place.shell("abbe simulate session.toml --out new --quiet").status.success());
    assert_eq!(place.names(), ["circle.csv", "new", "out.json", "session.toml"]);
}
