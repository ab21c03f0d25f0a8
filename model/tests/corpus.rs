//! The corpus of the fuzzer, replayed: every input that it keeps, among them every one that once did harm.

#[path = "../../fuzz/harness.rs"]
mod harness;

use std::path::Path;

#[track_caller]
fn replay(target: &str, read: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../fuzz/corpus")
        .join(target);
    let mut files: Vec<_> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    assert!(!files.is_empty(), "{}", folder.display());
    for file in files {
        println!("{}", file.display());
        read(&std::fs::read(&file).unwrap());
    }
}

#[test]
fn machines() {
    replay("machine", harness::machine);
}

#[test]
fn sessions() {
    replay("session", harness::session);
}

#[test]
fn tables() {
    replay("table", harness::table);
}

#[test]
fn foreign_tables() {
    replay("foreign", harness::foreign);
}

#[test]
fn ball_bar_files() {
    replay("xml", harness::xml);
}

#[test]
fn spreadsheets() {
    replay("sheet", harness::sheet);
}
