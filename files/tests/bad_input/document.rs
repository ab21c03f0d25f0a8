//! Tests of faults that any file can have: missing file, no text, no TOML, unknown keys, invalid numbers.

use std::fs;
use std::path::Path;

use abbe_files::ReadOptions;

use super::{DATA, MACHINE, SESSION, assert_contains, error_text, session, with_data, with_machine, with_session};

#[test]
fn missing_and_invalid_files() {
    let folder = tempfile::tempdir().unwrap();
    let read = |path: &Path| error_text(abbe_files::session(path, &ReadOptions::default()));
    assert_contains(&read(folder.path()), &["this is a folder"]);
    assert_contains(&read(&folder.path().join("no.toml")), &["the session file cannot be read"]);
    let latin = folder.path().join("latin.toml");
    fs::write(&latin, b"name = \"\xe4\"").unwrap();
    assert_contains(&read(&latin), &["byte 9 is not UTF-8"]);
}

#[test]
fn invalid_toml() {
    assert_contains(&with_session("kind = ", "kind "), &["session.toml:5", "not valid TOML"]);
    assert_contains(&with_session("100.0", "\"a\" 1"), &["session.toml:11", "not valid TOML"]);
}

#[test]
fn unknown_keys() {
    assert_contains(
        &with_session("bar_mm", "bar_length = 1\nbar_mm"),
        &["session.toml:11", "test \"C100\" has the unknown key `bar_length`"],
    );
    assert_contains(
        &with_session("noise_um", "nois_um"),
        &["session.toml:6", "[instrument] has the unknown key `nois_um`", "did you mean `noise_um`?"],
    );
    assert_contains(
        &with_session("[instrument]", "[instruments]"),
        &["session.toml:4", "the file has the unknown key `instruments`", "did you mean `instrument`?"],
    );
    assert_contains(
        &with_session("[instrument]\nkind = \"ballbar\"\nnoise_um = 0.3\n", ""),
        &["the file has no `instrument`", "add `instrument`: the instrument: [instrument] with `kind"],
    );
    assert_contains(
        &with_session("[machine]", "extra = 1\n[machine]"),
        &["session.toml:1", "the file has the unknown key `extra`"],
    );
    assert_contains(
        &with_machine("direction = [1, 0, 0]", "directon = [1, 0, 0]"),
        &["machine.toml:8", "has the unknown key `directon`", "did you mean `direction`?"],
    );
}

#[test]
fn words_and_tables_are_not_each_other() {
    assert_contains(
        &with_session("bar_mm", "path = \"list\"\nbar_mm"),
        &["session.toml:11", "`path` is the text \"list\"; a table such as { kind = \"list\" } is expected"],
    );
    assert_contains(
        &with_machine("name = ", "rotation = { kind = \"exact\" }\nname = "),
        &["machine.toml:1", "`rotation` is a table; a word in quotes is expected"],
    );
    assert_contains(
        &with_session("kind = \"ballbar\"\n", ""),
        &["session.toml:4", "[instrument] has no `kind`", "\"ballbar\", \"r-test\""],
    );
    assert_contains(
        &with_session("[[test]]", "[[socket_distance]]\nbetween = [\"0\", \"1\"]\n\n[[test]]"),
        &["session.toml:8", "[[socket_distance]] in a session whose instrument is a ballbar"],
    );
}

#[test]
fn invalid_numbers() {
    assert_contains(&with_data(&DATA.replace("100.0010", "NaN")), &["C100.csv:3", "column 4", "NaN"]);
    assert_contains(&with_data(&DATA.replace("100.0010", "inf")), &["C100.csv:3", "column 4", "infinite"]);
    assert_contains(&with_session("100.0", "nan"), &["session.toml:11", "`bar_mm` is NaN"]);
    assert_contains(&with_machine("[1, 0, 0]", "[nan, 0, 0]"), &["machine.toml:8", "`direction` is NaN"]);
    assert_contains(&with_machine("[1, 0, 0]", "[0, 0, 0]"), &["machine.toml:8", "is zero"]);
}

#[test]
fn spans_count_the_byte_order_mark() {
    let marked = format!("\u{feff}{}", SESSION.replace("100.0", "nan"));
    let fault = session(MACHINE, &marked, Some(DATA)).unwrap_err();
    let span = fault.location().unwrap().span.clone().unwrap();
    assert_eq!(&marked[span], "nan");
}

#[test]
fn torn_and_garbled_files_are_refused_or_read_and_never_panic() {
    for cut in 0..SESSION.len() {
        let _ = session(MACHINE, &SESSION[..cut], Some(DATA));
    }
    for cut in 0..MACHINE.len() {
        let _ = session(&MACHINE[..cut], SESSION, Some(DATA));
    }
    for cut in 0..DATA.len() {
        let _ = session(MACHINE, SESSION, Some(&DATA[..cut]));
        for garbage in ["\"", ",", "\n", "-", "é", "\0", "1e999"] {
            let garbled = format!("{}{garbage}{}", &DATA[..cut], &DATA[cut..]);
            let _ = session(MACHINE, SESSION, Some(&garbled));
        }
    }
    let nested = format!("x = {}", "[".repeat(100_000));
    assert_contains(&error_text(session(MACHINE, &nested, None)), &["session.toml:1", "not valid TOML"]);
}
