//! Names, keys, values and lines of 100,000 characters and more: tables cut them, and messages quote 80 characters.

use std::fs;
use std::process::Output;

use crate::suite::abbe;
use crate::suite::command::faults::TestFolder;

/// Longest row that a table prints: a few cells of names.
const MAX_LINE: usize = 2000;
/// Largest message, bytes.
const MAX_MESSAGE: usize = 4000;

/// Runs the program in the folder.
fn run(place: &TestFolder, arguments: &str) -> Output {
    place.shell(&format!("abbe {arguments}"))
}

fn has_long_run(text: &str, sign: char) -> bool {
    text.contains(&sign.to_string().repeat(81))
}

/// A folder whose machine, tests, set-ups and notes have names of 100,000 characters: two sessions, a model, results.
fn long_names() -> TestFolder {
    let place = TestFolder::new();
    let name = "n".repeat(100_000);
    let session = fs::read_to_string(place.at("session.toml")).unwrap();
    let session = session
        .replace("[machine]\n", &format!("[about]\nsession_id = \"{name}\"\nserial_number = \"{name}\"\ndate = \"2026-11-23\"\noperator = \"{name}\"\n\n[machine]\nname = \"{name}\"\n"))
        .replace("\"XY\"", &format!("\"{name}\""))
        .replace("bar_mm", &format!("setup = \"{name}\"\nspindle_setup = \"{name}\"\nbar_setup = \"{name}\"\nbar_u_um = 0.5\nbar_mm"));
    place.put("session.toml", &session);
    let later = session.replace("2026-11-23", "2026-11-24").replace("session_id = \"n", "session_id = \"m");
    place.put("later.toml", &later);
    place.put("list.txt", &format!("session.toml\nlater.toml\n{name}\n"));
    place.put("positions.csv", "x_mm,y_mm\n0,0\n10,20\n");
    place
}

#[test]
fn every_table_is_printed_with_a_name_of_100_000_characters() {
    let place = long_names();
    // In this order: later lines read what earlier ones write.
    let mut printed = 0;
    for line in [
        "fit session.toml --all --save model.json --json fit.json --csv fit.csv --report fit.html --plots plots",
        "fit session.toml --monte-carlo 100",
        "trace session.toml --all --only EXY --report trace.html",
        "plan session.toml --all --report plan.html",
        "plan session.toml --improve 1",
        "plan session.toml --patterns patterns.csv",
        "simulate session.toml --out simulated",
        "compare session.toml later.toml",
        "compare model.json later.toml --csv compared.csv",
        "validate model.json later.toml --all --report validated.html",
        "compensate model.json positions.csv --out corrected.csv",
        "export model.json --as urdf --out machine.urdf",
        "nc session.toml --control linuxcnc --out programs",
        "sheet session.toml --out sheet.html",
        "paper session.toml --out paper",
        "volumetric session.toml",
        "fleet run session.toml later.toml --out results --no-trace",
        "fleet run --sessions list.txt --out listed --no-trace",
        "fleet history results --all --report history.html",
        "fleet history results --pages pages",
        "fleet history listed",
    ] {
        let output = run(&place, line);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(matches!(output.status.code(), Some(0 | 1)), "{line}: {:?}\n{stderr}", output.status);
        assert!(!stderr.contains("panicked"), "{line}: {stderr}");
        assert!(stderr.len() <= 2 * MAX_MESSAGE && !has_long_run(&stderr, 'n'), "{line}: {} bytes", stderr.len());
        let longest = stdout.lines().map(|line| line.chars().count()).max().unwrap_or(0);
        assert!(longest <= MAX_LINE, "{line}: a line of {longest} characters: {:.200}", stdout);
        println!("{line}: {:?}: {}", output.status.code(), stderr.chars().take(300).collect::<String>());
        printed += usize::from(output.status.success());
    }
    assert!(printed >= 16, "{printed} commands had a result");
}

/// A message of a few lines that quotes at most 80 of the signs.
#[track_caller]
fn assert_short(what: &str, output: &Output, sign: char) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(1 | 2)), "{what}: {:?}", output.status);
    assert!(stderr.len() < MAX_MESSAGE, "{what}: a message of {} bytes: {:.300}", stderr.len(), stderr);
    assert!(!has_long_run(&stderr, sign), "{what}: {stderr}");
    assert!(stderr.starts_with("error: "), "{what}: {stderr}");
}

#[test]
fn a_message_quotes_80_characters_of_a_long_input() {
    let long = "k".repeat(500_000);
    let place = TestFolder::new();
    let session = fs::read_to_string(place.at("session.toml")).unwrap();
    let data = fs::read_to_string(place.at("circle.csv")).unwrap();
    assert!(run(&place, "fit session.toml --save model.json").status.success());
    assert!(run(&place, "fleet run session.toml --out results --no-trace").status.success());
    let model = fs::read_to_string(place.at("model.json")).unwrap();
    let put = |name: &str, text: &str, from: &str, to: &str| {
        assert!(text.contains(from), "{name}: {from}");
        place.put(name, &text.replacen(from, to, 1));
    };
    let is_short = |what: &str, line: &str| assert_short(what, &run(&place, line), 'k');
    for (what, from, to) in [
        ("a key", "noise_um", long.clone()),
        ("a quoted key", "noise_um", format!("\"{}\"", "k ".repeat(200_000))),
        ("a value", "\"ballbar\"", format!("\"{long}\"")),
        ("a number", "0.3", long.clone()),
        ("a number with a unit", "0.3", format!("\"{long}\"")),
        ("a line", "noise_um = 0.3", format!("{long} {long}")),
        ("a line with the fault at its end", "noise_um = 0.3", format!("noise_um = [{}x]", "1,".repeat(200_000))),
        ("a comment before the fault", "noise_um = 0.3", format!("noise_um = \"x\" # {long}")),
        ("an unknown of a long name", "\"EC0Y\"", format!("\"{long}\"")),
        ("a file", "circle.csv", long.clone()),
        ("a chain", "w X b Y t", long.clone()),
        ("a chain of long parts", "w X b Y t", format!("w X b {long} t")),
        ("a coordinate", "[0, 0, 0]", format!("[0, 0, \"{long}\"]")),
        ("an axis", "axis.X", format!("axis.{long}")),
    ] {
        put("long.toml", &session, from, &to);
        is_short(what, "fit long.toml");
        is_short(what, "fleet run long.toml --out results --no-trace -q --json - | grep -q . ; abbe fit long.toml");
    }
    for (what, from, to) in [
        ("a column", "length_mm", long.clone()),
        ("a cell", "99.9995", long.clone()),
        ("a column and a cell", "length_mm", format!("length_mm,{long}")),
        ("a quoted cell", "1,", format!("\"{long},")),
        ("a run", "\n1,", format!("\n{long},")),
    ] {
        let data = data.replacen("99.999", "99.9995", 1);
        put("circle.csv", &data, if data.contains(from) { from } else { "\n1," }, &to);
        is_short(what, "fit session.toml");
    }
    put(
        "circle.csv",
        "{\"run\": 1, \"x_mm\": 1, \"y_mm\": 2, \"length_mm\": 100}\n",
        "\"length_mm\"",
        &format!("\"{long}\""),
    );
    fs::rename(place.at("circle.csv"), place.at("circle.jsonl")).unwrap();
    put("long.toml", &session, "circle.csv", "circle.jsonl");
    is_short("a key of JSON Lines", "fit long.toml");
    place.put("circle.csv", &data);
    for (what, from, to) in [
        ("a key of a model", "\"schema_version\"", format!("\"{long}\"")),
        ("a value of a model", "\"schema_version\": ", format!("\"schema_version\": \"{long}\", \"a\": ")),
        ("a model that is no JSON", "{", format!("{{ {long}")),
        ("an identifier of a model", "\"EC0Y\"", format!("\"{long}\"")),
    ] {
        put("long.json", &model, from, &to);
        is_short(what, "validate long.json session.toml");
        is_short(what, "compare long.json session.toml");
    }
    for (what, text) in [
        ("a column of compensations", format!("machine_id,{long}\nM,1\n")),
        ("a date of compensations", format!("machine_id,date,parameter,change,unit\nM,{long},EC0Y,1,um\n")),
        ("a change of compensations", format!("machine_id,date,parameter,change,unit\nM,2026-11-23,EC0Y,{long},um\n")),
    ] {
        place.put("long.csv", &text);
        is_short(what, "fleet history results --known-changes long.csv");
    }
    // A column of another program is carried over, and a row that cannot be read is marked.
    for text in [format!("x_mm,{long}\n1,2\n"), format!("x_mm,y_mm\n1,{long}\n")] {
        place.put("long.csv", &text);
        let output = run(&place, "compensate model.json long.csv --out corrected.csv");
        assert!(output.status.success());
        assert!(output.stdout.len() + output.stderr.len() < MAX_MESSAGE);
    }
    for (what, text) in [
        ("a name of --values", format!("{long} = \"1 um\"\n")),
        ("a value of --values", format!("EC0Y = \"{long}\"\n")),
    ] {
        place.put("errors.toml", &text);
        is_short(what, "simulate session.toml --out simulated --values errors.toml");
    }
}

/// The same in arguments, whatever they are for.
#[test]
fn a_message_quotes_80_characters_of_a_long_argument() {
    let long = "k".repeat(100_000);
    let place = TestFolder::new();
    let session = place.at("session.toml");
    let session = session.to_str().unwrap();
    for arguments in [
        vec![long.as_str()],
        vec!["fit", &long],
        vec!["fit", session, &long],
        vec!["fit", session, &format!("--{long}")],
        vec!["fit", session, "--monte-carlo", &long],
        vec!["fit", session, "--json", &long],
        vec!["fit", session, "--method", &long],
        vec!["trace", session, "--only", &long],
        vec!["trace", session, "--time-limit", &long],
        vec!["plan", session, "--improve", "1", "--bars-mm", &long],
        vec!["plan", session, "--separate", &long],
        vec!["plan", session, "--vary", &long],
        vec!["simulate", session, "--out", "x", "--error", &long],
        vec!["simulate", session, "--out", "x", "--error", &format!("EC0Y={long}")],
        vec!["simulate", session, "--out", "x", "--error", &format!("{long}=1um")],
        vec!["simulate", session, "--out", "x", "--effect", &long],
        vec!["equation", session, "--test", &long],
        vec!["new", "x", "--template", &long],
        vec!["new", "x", "--from-code", &long],
        vec!["volumetric", session, "--axis", &long],
        vec!["schema", &long],
        vec!["fleet", "run", session, "--out", "x", "--part", &long],
        vec!["fleet", "history", &long],
    ] {
        let output = abbe(&arguments);
        let what: Vec<String> = arguments.iter().map(|argument| argument.chars().take(20).collect()).collect();
        assert_short(&what.join(" "), &output, 'k');
    }
}
