//! Edits of a session's text that preserve comments and everything else, as a simulation needs them.

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::document::{Source, Value};
use super::quoted::quoted;
use crate::error::ModelError;

/// The text with its machine read from another file; a text with the machine's own tables is unchanged.
///
/// # Errors
/// If the text is not a session.
pub fn with_machine_file(original: &str, file: &Path, machine: &str) -> Result<String, ModelError> {
    let source = Source::new(file, original);
    let span = match source.parse()?.take("machine") {
        Some(value) => value.table("[machine]".into())?.take("file").map(|value| value.span),
        None => None,
    };
    Ok(match span {
        Some(span) => replaced(&source.text, span, &format!("\"{machine}\"")),
        None => source.text,
    })
}

/// The text with `noise_um` of its instrument set.
///
/// # Errors
/// If the text is not a session.
pub fn with_noise(original: &str, file: &Path, noise_um: f64) -> Result<String, ModelError> {
    let source = Source::new(file, original);
    let Some(instrument) = source.parse()?.take("instrument") else {
        return Ok(source.text);
    };
    let mut table = instrument.table("[instrument]".into())?;
    let (noise, kind) = (table.take("noise_um"), table.take("kind"));
    let text = match (noise, kind) {
        (Some(noise), _) => replaced(&source.text, noise.span, &noise_um.to_string()),
        (None, Some(kind)) => insert_after(&source.text, &kind, &format!("noise_um = {noise_um}")),
        (None, None) => source.text.clone(),
    };
    Ok(text)
}

/// The text of session `file` for use in `folder`: relative names of the machine file and of data files are adapted.
/// Absolute names are unchanged, and so are names found in `data_directory`, which the reader searches first.
///
/// # Errors
/// If the text is not a session, or if one of the two folders does not exist.
pub fn relocated(
    original: &str,
    file: &Path,
    folder: &Path,
    data_directory: Option<&Path>,
) -> Result<String, ModelError> {
    let source = Source::new(file, original);
    let mut root = source.parse()?;
    let mut names = Vec::new();
    if let Some(machine) = root.take("machine") {
        names.extend(machine.table("[machine]".into())?.take("file"));
    }
    if let Some(tests) = root.take("test") {
        for test in tests.list("tables [[test]]")? {
            let data = test.table("[[test]]".into())?.take("data");
            let elsewhere = |data: &Value<'_>| {
                let named = data.as_text().unwrap_or_default();
                data_directory.is_some_and(|folder| folder.join(named).exists())
            };
            names.extend(data.filter(|data| !elsewhere(data)));
        }
    }
    let mut edits = Vec::new();
    for name in names {
        let named = PathBuf::from(name.text()?);
        if named.is_relative() {
            let target = parent(file).join(named);
            edits.push((name.span.clone(), quoted(&relative_path(folder, &target)?)));
        }
    }
    edits.sort_by_key(|(span, _)| span.start);
    let mut text = source.text.clone();
    for (span, new) in edits.into_iter().rev() {
        text.replace_range(span, &new);
    }
    Ok(text)
}

/// The folder of a file.
fn parent(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The name of a file relative to a folder; the absolute name if they share only the root.
fn relative_path(folder: &Path, file: &Path) -> Result<String, ModelError> {
    let whole = |path: &Path| {
        path.canonicalize().map_err(|cause| ModelError::Output { file: path.to_path_buf(), cause: cause.to_string() })
    };
    let (from, to) = (whole(folder)?, whole(parent(file))?);
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let name = file.file_name().unwrap_or_default();
    if shared <= 1 {
        return Ok(to.join(name).display().to_string());
    }
    let up = from.components().skip(shared).map(|_| "..".into());
    let down = to.components().skip(shared).map(|part| part.as_os_str().to_string_lossy());
    let parts: Vec<_> = up.chain(down).chain([name.to_string_lossy()]).collect();
    Ok(parts.join("/"))
}

/// The text without the tables of these names: `[name]`, `[[name]]` and their content.
///
/// ```
/// use abbe_model::files::toml::rewrite::without_tables;
///
/// let text = "[columns]\nJ1_rad = \"j1\"\n\n[[test]]\nname = \"A\"\n\n[[effect]]\nshape = \"lag\"\n";
/// assert_eq!(without_tables(text, &["columns", "effect"]), "[[test]]\nname = \"A\"\n\n");
/// ```
pub fn without_tables(original: &str, names: &[&str]) -> String {
    let mut kept = String::with_capacity(original.len());
    let mut dropping = false;
    for line in original.split_inclusive('\n') {
        if let Some(header) = line.trim_start().strip_prefix('[') {
            let header = header.trim_start_matches('[').trim_start();
            let name: String =
                header.chars().take_while(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.')).collect();
            let closes = header[name.len()..].trim_start().starts_with(']');
            if closes {
                dropping = names.iter().any(|dropped| name == *dropped || name.starts_with(&format!("{dropped}.")));
            }
        }
        if !dropping {
            kept.push_str(line);
        }
    }
    kept
}

fn replaced(text: &str, span: Range<usize>, new: &str) -> String {
    let mut text = text.to_string();
    text.replace_range(span, new);
    text
}

/// Inserts a new key after a value: on its own line, or after a comma in an inline table.
fn insert_after(text: &str, value: &Value<'_>, new: &str) -> String {
    let end = value.span.end;
    let line_end = end + text[end..].find('\n').unwrap_or(text.len() - end);
    let rest = text[end..line_end].trim_start();
    if rest.is_empty() || rest.starts_with('#') {
        replaced(text, line_end..line_end, &format!("\n{new}"))
    } else {
        replaced(text, end..end, &format!(", {new}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SESSION: &str =
        "[machine]\nfile = \"../machine.toml\" # ours\n\n[instrument]\nkind = \"ballbar\"   # Renishaw\n";

    #[test]
    fn other_text_is_unchanged() {
        let file = Path::new("session.toml");
        let text = with_machine_file(SESSION, file, "machine.toml").unwrap();
        assert_eq!(text, SESSION.replace("../machine.toml", "machine.toml"));
        let text = with_noise(SESSION, file, 0.25).unwrap();
        assert_eq!(text, SESSION.replace("# Renishaw\n", "# Renishaw\nnoise_um = 0.25\n"));
        let text = with_noise(&text, file, 0.0).unwrap();
        assert!(text.ends_with("\nnoise_um = 0\n"), "{text}");
        let inline = with_noise("instrument = { kind = \"ballbar\" }\n", file, 1.5).unwrap();
        assert_eq!(inline, "instrument = { kind = \"ballbar\", noise_um = 1.5 }\n");
    }

    #[test]
    fn file_names_are_adapted_to_another_folder() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        for folder in ["ours/data", "ours/elsewhere", "theirs/next"] {
            std::fs::create_dir_all(at(folder)).unwrap();
        }
        std::fs::write(at("ours/elsewhere/b.csv"), "").unwrap();
        let session = "[machine]\nfile = \"../machine.toml\" # ours\n\n[[test]]\nname = \"A\"\ndata = \"data/a.csv\"\n\n\
                       [[test]]\nname = \"B\"\ndata = \"b.csv\"\n\n[[test]]\nname = \"C\"\ndata = \"/c.csv\"\n";
        let file = at("ours/session.toml");
        let elsewhere = at("ours/elsewhere");
        let relocated_to = |folder: &str| relocated(session, &file, &at(folder), Some(&elsewhere)).unwrap();
        let there =
            session.replace("../machine.toml", "../../machine.toml").replace("data/a.csv", "../../ours/data/a.csv");
        assert_eq!(relocated_to("theirs/next"), there);
        assert_eq!(relocated_to("ours"), session);
        assert_eq!(relocated_to("ours/data"), session.replace("../", "../../").replace("data/a", "a"));
    }
}
