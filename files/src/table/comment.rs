//! Lines that are comments.

/// What spreadsheet programs write into a cell whose value they cannot calculate, in English and German.
const CELL_ERRORS: [&str; 15] = [
    "#REF!", "#N/A", "#NA", "#VALUE!", "#DIV/0!", "#NAME?", "#NUM!", "#NULL!", "#SPILL!", "#CALC!", "#BEZUG!", "#NV",
    "#WERT!", "#ZAHL!", "#ERR",
];

/// Whether a line, or a row by its first cell, is a comment: it begins with `#`, and not with the error of a cell, which
/// is a row that lacks a value.
pub(crate) fn is_comment(text: &str) -> bool {
    let text = text.trim_start();
    let is_error = |error: &&str| {
        let start = text.get(..error.len()).filter(|start| start.eq_ignore_ascii_case(error));
        let rest =
            start.map(|_| text[error.len()..].trim_start_matches(':').trim_start_matches(|c: char| c.is_ascii_digit()));
        let next_is_number = |rest: &str| {
            rest.split_whitespace().next().is_some_and(|word| word.replace(',', ".").parse::<f64>().is_ok())
        };
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with([',', ';', '\t', '|']) || next_is_number(rest))
    };
    text.starts_with('#') && !CELL_ERRORS.iter().any(is_error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_cell_is_no_comment() {
        for row in ["#REF!,1,2", " #N/A;1,5", "#NV\t3", "#BEZUG!", "#DIV/0!,0", "#n/a 1,5 2", "#ERR:502,1"] {
            assert!(!is_comment(row), "{row}");
        }
        for comment in ["# text", "#1.0,2.0", "#REFERENCE,1", "#", "#NAMES,of,columns", "#N/A means no value", "#x,y"] {
            assert!(is_comment(comment), "{comment}");
        }
        assert!(!is_comment("1,2"));
    }
}
