//! Replays the fuzzer's corpus of errors as they are given in files. The corpus of `abbe-files` is replayed in that
//! crate.

#[path = "../../fuzz/errors.rs"]
mod harness;
#[path = "../../fuzz/replay.rs"]
mod replay;

use replay::replay;

#[test]
fn error_functions() {
    replay("functions", harness::functions);
}

#[test]
fn values() {
    replay("values", harness::values);
}
