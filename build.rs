//! States the checksum of the sources that determine results (`abbe::fleet::BUILD`). The same sources have the same
//! checksum wherever they lie: names are relative, with `/`, and sorted.

use std::io;
use std::path::Path;

use sha2::{Digest, Sha256};

/// Folders with everything in them that determines the result of a session, besides the dependencies.
const SOURCES: [&str; 5] = ["files/src", "identify/src", "model/src", "src/fleet", "trace/src"];

/// Digits of the checksum that are stated.
const DIGITS: usize = 12;

fn main() -> io::Result<()> {
    // Cargo runs this in the folder of the package.
    println!("cargo::rerun-if-changed=Cargo.lock");
    let mut files = Vec::new();
    // The published package holds only its own; the checksums of the crates below are then those of its lock file.
    for source in SOURCES.into_iter().filter(|source| Path::new(source).is_dir()) {
        println!("cargo::rerun-if-changed={source}");
        collect(source, &mut files)?;
    }
    files.sort();
    let mut digest = Sha256::new_with_prefix(dependencies()?);
    for file in files {
        digest.update(format!("{file}\n"));
        digest.update(Sha256::digest(std::fs::read(file)?));
    }
    let digits: String = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    println!("cargo::rustc-env=ABBE_SOURCES={}", digits.get(..DIGITS).unwrap_or(&digits));
    Ok(())
}

/// The crates of the registry in the lock file. It names the members of the workspace too, of which an archive of the
/// sources of the Python package has fewer.
fn dependencies() -> io::Result<String> {
    let text = std::fs::read_to_string("Cargo.lock")?;
    Ok(text.split("[[package]]").filter(|package| package.contains("\nchecksum = ")).collect())
}

/// Adds the files below a folder.
fn collect(folder: &str, files: &mut Vec<String>) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?.file_name();
        let name = format!("{folder}/{}", entry.to_string_lossy());
        // Editors and file systems leave hidden files.
        if entry.as_encoded_bytes().starts_with(b".") {
            continue;
        }
        if Path::new(&name).is_dir() {
            collect(&name, files)?;
        } else {
            files.push(name);
        }
    }
    Ok(())
}
