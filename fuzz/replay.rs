//! Every input that the corpus keeps, given to a target once more: without nightly, in the tests of the crate whose readers are fuzzed.

use std::path::Path;

/// Gives a target every input of its corpus; the name of the file is printed before it is read, so that a failure says which.
#[track_caller]
pub fn replay(target: &str, read: fn(&[u8])) {
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
