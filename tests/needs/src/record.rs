//! The record of skipped tests: a file for each run of `cargo test`, in the folder of the profile, a line for each test.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// The record of this run: all test programs of a run have the same parent.
pub fn here() -> PathBuf {
    #[cfg(unix)]
    let parent = std::os::unix::process::parent_id();
    #[cfg(not(unix))]
    let parent = 0;
    place(parent)
}

/// The record of the run of a process. Its time of start, where the system states it, distinguishes it from an earlier
/// process with the same number.
pub fn place(process: u32) -> PathBuf {
    let stated = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    // The twentieth word after the name of the program, which is in parentheses (proc(5)).
    let started = stated.rsplit(')').next().and_then(|words| words.split_whitespace().nth(19)).unwrap_or("0");
    // The test programs are in the folder `deps` of the profile.
    let program = std::env::current_exe().unwrap_or_default();
    let folder = program.ancestors().nth(2).unwrap_or(Path::new("."));
    folder.join("skipped-tests").join(format!("{process}-{started}"))
}

/// Adds a test to a record. Programs may write at the same time: a line is appended as a whole.
pub fn add(record: &Path, test: &str, reason: &str) {
    let written = record.parent().map_or(Ok(()), std::fs::create_dir_all).and_then(|()| {
        let mut file = std::fs::OpenOptions::new().create(true).append(true).open(record)?;
        file.write_all(format!("{test}\t{reason}\n").as_bytes())
    });
    if let Err(cause) = written {
        eprintln!("{}: {cause}", record.display());
    }
}

/// The tests of a record and the reasons, in the order in which they were skipped. The record is removed.
pub fn taken(record: &Path) -> Vec<(String, String)> {
    let text = std::fs::read_to_string(record).unwrap_or_default();
    let _ = std::fs::remove_file(record);
    let entries = text.lines().filter_map(|line| line.split_once('\t'));
    entries.map(|(test, reason)| (test.to_string(), reason.to_string())).collect()
}

/// The lines that end a run: each skipped test, then how many there were and why.
pub fn summary(skipped: &[(String, String)]) -> String {
    let distinct: BTreeSet<(&str, &str)> = skipped.iter().map(|(test, reason)| (&**test, &**reason)).collect();
    let mut text = "\n".to_string();
    let mut by_reason: BTreeMap<&str, usize> = BTreeMap::new();
    for (test, reason) in &distinct {
        let _ = writeln!(text, "skipped: {test} ({reason})");
        *by_reason.entry(reason).or_default() += 1;
    }
    let tests: BTreeSet<&str> = distinct.iter().map(|(test, _)| *test).collect();
    let _ = write!(text, "{} test{} skipped", tests.len(), if tests.len() == 1 { "" } else { "s" });
    let reasons: Vec<String> = by_reason.iter().map(|(reason, count)| format!("{count} for \"{reason}\"")).collect();
    text + if reasons.is_empty() { "" } else { ": " } + &reasons.join(", ") + "\n\n"
}
