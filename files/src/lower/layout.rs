//! The layout of the data files of other programs.

use abbe_model::diagnostic::Location;
use abbe_model::document::fault::{Fault, Within};
use abbe_model::document::from_node;
use abbe_model::document::layout as document;
use abbe_model::document::node::Value;
use abbe_model::document::value::Count;
use abbe_model::driver::column;

use crate::table::encoding;
use crate::table::request::{ColumnMapping, Format};

/// Separator, decimal, header, encoding, lines above the header; sheet of a spreadsheet; direction in a ball-bar file.
pub(super) fn format(document: &document::Format) -> Result<Format, Fault> {
    let mut format = Format::default();
    if let Some(text) = &document.separator {
        format.separator = one_of(text, b",;\t|:").within("separator")?;
    }
    if let Some(text) = &document.decimal {
        format.decimal = one_of(text, b".,").within("decimal")?;
    }
    if let Some(header) = document.header {
        format.header = header;
    }
    format.sheet.clone_from(&document.sheet);
    if let Some(node) = &document.anticlockwise {
        // Files number directions, or name one of them.
        format.anticlockwise = Some(match &node.value {
            Value::Truth(truth) => truth.to_string(),
            Value::Text(text) => text.trim().to_string(),
            _ => {
                let Count(number) = from_node::<Count<0, 1_000_000>>(node).within("anticlockwise")?;
                number.to_string()
            }
        });
    }
    if let Some(name) = &document.encoding {
        format.encoding = Some(encoding::of_name(name).ok_or_else(|| {
            let help = "common are \"utf-8\", \"latin1\", \"utf-16le\", \"utf-16be\"; others have their name in the WHATWG Encoding Standard, such as \"shift_jis\"";
            let what = format!("is \"{name}\", which is not a known encoding");
            Fault::of_key(what, help).at("encoding")
        })?);
    }
    if let Some(Count(lines)) = document.skip_lines {
        format.skip_lines = lines;
    }
    if format.decimal == format.separator && document.decimal.is_some() {
        let message = "the decimal comma is also the separator (\",\" unless declared)";
        let help = "declare the separator of the columns, such as `separator = \";\"`";
        return Err(Fault::new(message, help).at("decimal"));
    }
    Ok(format)
}

fn one_of(text: &str, known: &[u8]) -> Result<u8, Fault> {
    match text.as_bytes() {
        [one] if known.contains(one) => Ok(*one),
        _ => {
            let names: Vec<String> = known.iter().map(|byte| format!("{:?}", char::from(*byte).to_string())).collect();
            Err(Fault::unexpected(format!("one of {}", names.join(" "))))
        }
    }
}

/// Own name = foreign name or number; `place` finds the lines of the file.
pub(super) fn columns(document: &document::Columns, place: impl Fn(&[&str]) -> Location) -> Vec<ColumnMapping> {
    let own = document.own.0.iter().map(|(key, foreign)| (vec![key.as_str()], key.clone(), foreign));
    // An unquoted `driver.NAME_unit` is a table in TOML.
    let drivers = document.driver.0.iter();
    let drivers = drivers.map(|(key, foreign)| (vec!["driver", key], format!("{}{key}", column::PREFIX), foreign));
    own.chain(drivers)
        .map(|(path, own, foreign)| ColumnMapping { own, foreign: foreign.clone(), location: place(&path) })
        .collect()
}
