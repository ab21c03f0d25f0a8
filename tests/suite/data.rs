//! Where public data lie: `ABBE_DATA`, else `../shared/data` beside the workspace.

use std::path::PathBuf;

/// A file or folder of the public data. Where it is not there the test is skipped by name, except in CI, where it fails.
pub fn data(test: &str, path: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("ABBE_DATA")
        .map_or_else(|| super::workspace().join("../shared/data"), PathBuf::from);
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
