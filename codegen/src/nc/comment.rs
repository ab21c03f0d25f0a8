//! Names of machines, tests and set-ups in a program, where a control reads text.
//!
//! Some comments are commands. LinuxCNC opens files at `(LOGOPEN, …)` and runs Python at `(PY, …)`; SINUMERIK takes the
//! folder of a file from `;$PATH=…`; Fanuc ends a tape at `%`; the TNC continues a block after `~`. A name is therefore
//! reduced to characters that no control gives a meaning, and stands behind a word of ours.

/// Longest part of a name, characters: a line of LinuxCNC has 255.
const LONGEST: usize = 60;

fn reduced(name: &str, permitted: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() || permitted.contains(c) { c } else { '_' };
    name.chars().take(LONGEST).map(letter).collect()
}

/// A name in the name of a program: letters, digits, and an underscore in place of each other character.
pub(super) fn simple(name: &str) -> String {
    reduced(name, "")
}

/// A name in a comment: letters, digits, space, dash, and an underscore in place of each other character.
pub(super) fn name(name: &str) -> String {
    reduced(name, " -")
}

/// A comment that names a test.
pub(super) fn test_of(test: &str) -> String {
    format!("test {}", name(test))
}

/// A text of ours, which begins with a word of ours, without the characters that end a comment or have a meaning in it.
pub(super) fn plain(text: &str) -> String {
    let text = text.replace('°', " deg").replace('µ', "u");
    text.chars().filter(|c| c.is_ascii_alphanumeric() || " -_.,:/+#'".contains(*c)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_is_more_than_a_name() {
        assert_eq!(simple("C 150-µ"), "C_150__");
        assert_eq!(name("logopen,/tmp/a.log"), "logopen__tmp_a_log");
        assert_eq!(test_of(" py,print(1) %~$"), "test  py_print_1_ ___");
        assert_eq!(plain("A (90°, 5 µm) [x]; \"é\""), "A 90 deg, 5 um x ");
        assert_eq!((name(&"a".repeat(400)).len(), simple(&"µ".repeat(400)).len()), (60, 60));
    }
}
