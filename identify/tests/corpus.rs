//! The corpus of the fuzzer, replayed: errors as people give them in files. What `abbe-model` reads is replayed there.

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
