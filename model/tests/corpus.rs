//! The corpus of the fuzzer, replayed: every input that it keeps, among them every one that once did harm.

#[path = "../../fuzz/harness.rs"]
mod harness;
#[path = "../../fuzz/replay.rs"]
mod replay;

use replay::replay;

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
