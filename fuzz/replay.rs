//! Replays the corpus through a target without nightly, in the tests of the crate whose readers are fuzzed.

use std::path::Path;

/// Passes every input of its corpus to a target. The name of each file is printed first, so that a failure shows it.
#[track_caller]
pub fn replay(target: &str, read: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus").join(target);
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty(), "{}", folder.display());
    for file in files {
        println!("{}", file.display());
        read(&std::fs::read(&file).unwrap());
    }
}
