//! The folder of the public data: `ABBE_DATA`, otherwise `../shared/data` beside the workspace.

use std::path::PathBuf;

/// A file or folder of the public data. If it does not exist, the test prints that it is skipped; in CI it fails.
pub fn data(test: &str, path: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("ABBE_DATA").map_or_else(|| super::workspace().join("../shared/data"), PathBuf::from);
    let found = folder.join(path);
    if found.exists() {
        return Some(found);
    }
    assert!(
        std::env::var("CI").as_deref() != Ok("true"),
        "{test}: no data folder ({} is not there), and CI needs it",
        found.display()
    );
    println!("skipped: {test} (no data folder)");
    None
}
