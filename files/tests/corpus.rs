//! Replays the corpus of the fuzzer: every retained input, including those that revealed a fault.

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
