//! The corpus of the fuzzer, replayed: errors as people give them in files. What `abbe-model` reads is replayed there.

#[path = "../../fuzz/errors.rs"]
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
fn error_functions() {
    replay("functions", harness::functions);
}

#[test]
fn values() {
    replay("values", harness::values);
}
