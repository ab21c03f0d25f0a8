//! Atomic file writes.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

use abbe::files::SourceMap;
use abbe::model::Diagnostic;
use abbe::temporary::{self, TemporaryFile};

use super::failure::{command_line, unwritable};
use super::message::{Kind, tell};
use crate::printers::{csv, terminal};
use crate::report::table::Table;

/// Writes a file through a temporary one beside it, so that a reader finds the old file or the whole new one, whatever
/// happens meanwhile.
///
/// Pipes and devices (a terminal, `/dev/stdout`) are written in place. `-` is
/// standard output.
pub fn write_whole(path: &Path, contents: &[u8]) -> Result<(), Diagnostic> {
    let fault = |source| unwritable(path, source);
    if is_standard_output(path) {
        write_out(contents);
        return Ok(());
    }
    write_streaming(path, |to| to.write_all(contents).map_err(fault))
}

/// As [`write_whole`], with contents that are not in memory together.
pub fn write_streaming(
    path: &Path,
    contents: impl FnOnce(&mut dyn Write) -> Result<(), Diagnostic>,
) -> Result<(), Diagnostic> {
    let fault = |source| unwritable(path, source);
    check(path)?;
    if is_standard_output(path) {
        return contents(&mut StandardOutput);
    }
    if is_stream(path) {
        let mut stream = OpenOptions::new().append(true).open(path).map_err(fault)?;
        contents(&mut stream)?;
        return stream.flush().map_err(fault);
    }
    // A symbolic link stays one: what it leads to is replaced.
    let place = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let mut file = TemporaryFile::in_folder(folder_of(&place)).map_err(fault)?;
    contents(&mut file)?;
    if let Ok(old) = std::fs::metadata(&place) {
        file.as_file().set_permissions(old.permissions()).map_err(fault)?;
    }
    file.as_file().sync_all().map_err(fault)?;
    file.persist(&place).map_err(fault)
}

/// Whether the path is `-`, which stands for standard output.
fn is_standard_output(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Whether bytes go through what the path names rather than into it.
fn is_stream(path: &Path) -> bool {
    let descriptor = ["/dev/stdout", "/dev/stderr", "/dev/fd"];
    if is_standard_output(path) {
        return true;
    }
    let other = std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir());
    other || descriptor.iter().any(|name| path.starts_with(name))
}

/// The folder that a file lies in.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// An error where a file cannot come to lie: said before the work, not after it.
pub fn check(path: &Path) -> Result<(), Diagnostic> {
    let refused = |why: String| Err(Diagnostic::other(format!("{}: cannot be written: {why}", path.display())));
    if is_standard_output(path) {
        return Ok(());
    }
    let folder = folder_of(path);
    match std::fs::metadata(path) {
        Ok(found) if found.is_dir() => refused("this is a folder; name a file in it".into()),
        Ok(found) if found.is_file() && found.permissions().readonly() => {
            refused("the file is write-protected; take that off, or name another".into())
        }
        _ if !folder.is_dir() => {
            refused(format!("there is no folder {}; make it first, or name another", folder.display()))
        }
        _ => Ok(()),
    }
}

/// An error where the name of a page promises another format than HTML: said before the work.
pub fn check_page(path: &Path) -> Result<(), Diagnostic> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some(other) if !matches!(other, "html" | "htm") && !is_stream(path) => Err(Diagnostic::other(format!(
            "{}: the page is HTML; name a file that ends in `.html`{}",
            path.display(),
            if other == "pdf" { ", which a browser prints as PDF" } else { "" }
        ))),
        _ => Ok(()),
    }
}

/// The files that a command is to write, looked at before the work, so that nothing is lost by it.
pub struct Outputs {
    files: Vec<PathBuf>,
    quiet: bool,
}

impl Outputs {
    /// # Errors
    /// If one of them cannot be written where it is asked for, two are one, or two go to standard output.
    pub fn new<'p>(files: impl IntoIterator<Item = &'p PathBuf>) -> Result<Outputs, Diagnostic> {
        let mut outputs: Vec<PathBuf> = Vec::new();
        for file in files {
            check(file)?;
            if is_standard_output(file) && outputs.iter().any(|other| is_standard_output(other)) {
                return Err(command_line(
                    "`-` is given for two outputs, and standard output can take one; name a file for the other",
                ));
            }
            if !is_stream(file) && outputs.iter().any(|other| is_same(other, file)) {
                return Err(Diagnostic::other(format!(
                    "{}: two results would be written there; name another file for one of them",
                    file.display()
                )));
            }
            if !is_stream(file) && !outputs.iter().any(|other| folder_of(other) == folder_of(file)) {
                temporary::remove_stale(folder_of(file));
            }
            outputs.push(file.clone());
        }
        Ok(Outputs { files: outputs, quiet: false })
    }

    /// The same, without tables on standard output if `--quiet` was given.
    pub fn quieted(self, quiet: bool) -> Outputs {
        Outputs { quiet, ..self }
    }

    /// Whether tables go to standard output: neither `--quiet` was given nor does one of the outputs go there.
    pub fn tables(&self) -> bool {
        !self.quiet && !self.files.iter().any(|output| is_standard_output(output))
    }

    /// The files that are to lie in a folder.
    pub fn in_folder<'n>(folder: &Path, names: impl Iterator<Item = &'n String>) -> Outputs {
        Outputs { files: names.map(|name| folder.join(name)).collect(), quiet: false }
    }

    /// # Errors
    /// If one of them would replace the session, its machine or its data.
    pub fn refuse_overwrite_of_sources(&self, sources: &SourceMap) -> Result<(), Diagnostic> {
        self.refuse_overwrite(sources.files.iter().map(|stamp| stamp.file.as_path()))
    }

    /// # Errors
    /// If one of them would replace a file that is read.
    pub fn refuse_overwrite<'r>(&self, read: impl IntoIterator<Item = &'r Path>) -> Result<(), Diagnostic> {
        for file in read {
            if let Some(output) = self.files.iter().find(|output| !is_stream(output) && is_same(output, file)) {
                return Err(Diagnostic::other(format!(
                    "{}: cannot be written: it is one of the files that are read; name another",
                    output.display()
                )));
            }
        }
        Ok(())
    }
}

/// Whether two paths lead to one place, be anything there or not.
pub fn is_same(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| {
        path.canonicalize().ok().or_else(|| {
            let folder = folder_of(path).canonicalize().ok()?;
            Some(folder.join(path.file_name()?))
        })
    };
    a == b || place(a).is_some_and(|a| place(b) == Some(a))
}

/// Writes lines to standard output. What a long line quotes is cut to a readable length.
pub fn line(text: std::fmt::Arguments<'_>) {
    let text = text.to_string();
    whole(&text.split('\n').map(terminal::line).collect::<Vec<_>>().join("\n"));
}

/// Writes a text to standard output as it is, and a line end.
pub fn whole(text: &str) {
    write_out(format!("{text}\n").as_bytes());
}

/// Writes a help text or the version to standard output, in colours on a terminal.
pub fn help(shown: &clap::Error) {
    let text = shown.render();
    let is_plain = anstream::AutoStream::choice(&std::io::stdout()) == anstream::ColorChoice::Never;
    let text = if is_plain { text.to_string() } else { text.ansi().to_string() };
    write_out(text.as_bytes());
}

/// Writes to standard output. If the reader has closed the pipe, the program ends; if the output cannot be written, it
/// ends with an error.
fn write_out(contents: &[u8]) {
    let mut out = std::io::stdout().lock();
    if let Err(fault) = out.write_all(contents).and_then(|()| out.flush()) {
        if fault.kind() == std::io::ErrorKind::BrokenPipe {
            std::process::exit(0);
        }
        tell(Kind::Error, &format!("standard output: cannot be written: {fault}"));
        std::process::exit(1);
    }
}

/// Standard output as [`write_out`] writes to it.
struct StandardOutput;

impl Write for StandardOutput {
    fn write(&mut self, contents: &[u8]) -> std::io::Result<usize> {
        write_out(contents);
        Ok(contents.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// The table as CSV.
pub fn csv(table: &Table) -> Result<Vec<u8>, Diagnostic> {
    csv::text(table).map_err(|error| Diagnostic::other(format!("the table cannot be written as CSV: {error}")))
}
