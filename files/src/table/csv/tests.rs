//! Tests of limits, locations and encodings.

use super::super::encoding;
use super::super::lines::{LIMITS, Limits};
use super::super::request::Format;
use super::*;
use crate::store::Store;

fn opened(file: &Path, format: &Format, limits: Limits) -> Result<CsvRows, Diagnostic> {
    let lines = Lines::within(&Store::Disk, file, format, limits)?;
    Ok(CsvRows::new(lines, format.separator))
}

/// Reads a file with small limits; returns the number of rows, or the message.
fn read(text: &str, limits: Limits, meanwhile: impl Fn(&Path)) -> Result<usize, String> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("data.csv");
    std::fs::write(&file, text).unwrap();
    let mut rows = opened(&file, &Format::default(), limits).map_err(|fault| fault.to_string())?;
    meanwhile(&file);
    let mut count = 0;
    while rows.next_row().map_err(|fault| fault.to_string())?.is_some() {
        count += 1;
    }
    Ok(count)
}

#[test]
fn a_file_at_its_limits_is_read_and_one_beyond_them_is_refused() {
    let limits = Limits { bytes: 12, rows: 3 };
    let still = |_: &Path| {};
    assert_eq!(read("1,2\n3,4\n5,6\n", limits, still), Ok(3));
    let long = read("1,2\n3,4\n5,67\n", limits, still).unwrap_err();
    assert!(long.ends_with("a data file of 13 bytes; the limit is 12"), "{long}");
    let many = read("1\n2\n3\n4\n", limits, still).unwrap_err();
    assert!(many.ends_with("data.csv:4: more than 3 rows, which is the limit"), "{many}");
}

#[test]
fn cell_spans_are_correct_after_a_byte_order_mark_and_non_ascii_text() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("data.csv");
    let spans = |bytes: &[u8]| {
        std::fs::write(&file, bytes).unwrap();
        let mut rows = opened(&file, &Format::default(), LIMITS).unwrap();
        [(); 2].map(|()| rows.next_row().unwrap().unwrap().span(1))
    };
    assert_eq!(spans("\u{feff}0,pq\r\nµµm,7\n".as_bytes()), [Some(5..7), Some(15..16)]);
    // The whole line, because the file has two bytes where the text has four.
    assert_eq!(spans(b"0,pq\r\n\xb5\xb5m,7\n"), [Some(2..4), Some(6..11)]);
}

#[test]
fn every_encoding_gives_the_same_cells() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("data.csv");
    let cells = |bytes: &[u8], format: &Format| -> Vec<(usize, Vec<String>)> {
        std::fs::write(&file, bytes).unwrap();
        let mut rows = opened(&file, format, LIMITS).unwrap();
        std::iter::from_fn(|| rows.next_row().unwrap()).map(|row| (row.line, row.cells)).collect()
    };
    // U+0A05 and U+010A contain the byte of a line end.
    let text = "Länge,b\u{a05}\u{10a}\r\n1,2\n\n3,4";
    let expected = cells(text.as_bytes(), &Format::default());
    assert_eq!(expected.len(), 3);
    assert_eq!(expected[0].1, ["Länge", "b\u{a05}\u{10a}"]);
    assert_eq!(expected[2], (4, vec!["3".to_string(), "4".to_string()]));
    for mark in ["", "\u{feff}"] {
        let units: Vec<u16> = mark.encode_utf16().chain(text.encode_utf16()).collect();
        for of in [u16::to_le_bytes, u16::to_be_bytes] {
            let bytes: Vec<u8> = units.iter().copied().flat_map(of).collect();
            // The first letter need not be ASCII with a zero byte: the mark or the stated encoding decides.
            let stated = Format {
                encoding: encoding::of_name(if bytes[0] == 0 || bytes[0] == 0xfe { "utf-16be" } else { "utf-16" }),
                ..Format::default()
            };
            assert_eq!(cells(&bytes, &stated), expected);
        }
    }
    assert_eq!(cells(b"L\xe4nge,b\r\n1,2\n", &Format::default())[0].1, ["Länge", "b"]);
    // Lines above the table may contain anything.
    let skipping = Format { skip_lines: 2, ..Format::default() };
    let rows = cells(b"measured on \"Tuesday\r\n\nx,y\n1,2\n", &skipping);
    assert_eq!(rows[0], (3, vec!["x".to_string(), "y".to_string()]));
}

#[test]
fn a_line_that_is_not_in_the_stated_encoding_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("data.csv");
    std::fs::write(&file, b"x,y\nL\xe4nge,2\n").unwrap();
    let format = Format { encoding: encoding::of_name("utf-8"), ..Format::default() };
    let mut rows = opened(&file, &format, LIMITS).unwrap();
    rows.next_row().unwrap();
    let fault = rows.next_row().unwrap_err();
    assert!(fault.to_string().ends_with(":2: the line is not valid UTF-8"), "{fault}");
    assert!(fault.help().unwrap().contains("encoding = \"latin1\""));
}

#[test]
fn a_file_that_changes_while_it_is_read_is_refused() {
    let append = |file: &Path| {
        let mut open = std::fs::OpenOptions::new().append(true).open(file).unwrap();
        std::io::Write::write_all(&mut open, b"5,6\n").unwrap();
    };
    let changed = read("1,2\n3,4\n", LIMITS, append).unwrap_err();
    assert!(changed.ends_with("the file changed while it was read"), "{changed}");
    let cut = |file: &Path| std::fs::write(file, "1,2\n").unwrap();
    let changed = read("1,2\n3,4\n", LIMITS, cut).unwrap_err();
    assert!(changed.ends_with("the file changed while it was read"), "{changed}");
}

#[cfg(unix)]
#[test]
fn a_file_that_is_deleted_while_it_is_read_is_read_to_its_end() {
    let gone = |file: &Path| std::fs::remove_file(file).unwrap();
    assert_eq!(read("1,2\n3,4\n", LIMITS, gone), Ok(2));
}
