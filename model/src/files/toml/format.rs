//! Reader of `[format]` and `[columns]`: the layout of foreign files.

use crate::driver::column;
use crate::error::ModelError;
use crate::files::table::encoding;
use crate::files::table::request::{ColumnMapping, ForeignColumn, Format};
use crate::files::toml::document::{Table, Value};

/// Reads `[format]`: separator, decimal, header, encoding, lines above the header; sheet of a spreadsheet; direction in
/// a ball-bar file.
pub(super) fn format(mut table: Table<'_>) -> Result<Format, ModelError> {
    let mut format = Format::default();
    if let Some(value) = table.take("separator") {
        format.separator = one_of(&value, b",;\t|:")?;
    }
    let decimal = table.take("decimal");
    if let Some(value) = &decimal {
        format.decimal = one_of(value, b".,")?;
    }
    if let Some(value) = table.take("header") {
        format.header = value.boolean()?;
    }
    if let Some(value) = table.take("sheet") {
        format.sheet = Some(value.text()?);
    }
    if let Some(value) = table.take("anticlockwise") {
        // Files number directions, or name one of them.
        format.anticlockwise = Some(match value.boolean() {
            Ok(truth) => truth.to_string(),
            Err(_) if value.as_text().is_none() => value.count(0, 1_000_000)?.to_string(),
            Err(_) => value.text()?.trim().to_string(),
        });
    }
    if let Some(value) = table.take("encoding") {
        let name = value.text()?;
        let Some(encoding) = encoding::of_name(&name) else {
            let message = format!("`encoding` is \"{name}\", which is not a known encoding");
            let help = "common are \"utf-8\", \"latin1\", \"utf-16le\", \"utf-16be\"; others have their name in the WHATWG Encoding Standard, such as \"shift_jis\"";
            return Err(value.error(message, Some(help.into())));
        };
        format.encoding = Some(encoding);
    }
    if let Some(value) = table.take("skip_lines") {
        format.skip_lines = value.count(0, 1_000_000)?;
    }
    if format.decimal == format.separator
        && let Some(value) = decimal
    {
        let message = "the decimal comma is also the separator (\",\" unless declared)";
        let help = "declare the separator of the columns, such as `separator = \";\"`";
        return Err(value.error(message, Some(help.into())));
    }
    table.finish()?;
    Ok(format)
}

fn one_of(value: &Value<'_>, known: &[u8]) -> Result<u8, ModelError> {
    let text = value.text()?;
    match text.as_bytes() {
        [one] if known.contains(one) => Ok(*one),
        _ => {
            let names: Vec<String> = known.iter().map(|byte| format!("{:?}", char::from(*byte).to_string())).collect();
            Err(value.unexpected(&format!("one of {}", names.join(" "))))
        }
    }
}

/// Reads `[columns]`: own name = foreign name or number.
pub(super) fn columns(mut table: Table<'_>) -> Result<Vec<ColumnMapping>, ModelError> {
    let mut columns = Vec::new();
    let mut entries = Vec::new();
    for entry in table.remaining_values()? {
        if format!("{}.", entry.key) != column::PREFIX {
            entries.push((entry.key.clone(), entry));
            continue;
        }
        // An unquoted `driver.NAME_unit` is a table in TOML.
        let own = entry.table("[columns.driver]".into())?.remaining_values()?;
        entries.extend(own.into_iter().map(|entry| (format!("{}{}", column::PREFIX, entry.key), entry)));
    }
    for (own, entry) in entries {
        let foreign = match entry.as_text() {
            Some(text) => ForeignColumn::Name(text.trim().to_string()),
            None => ForeignColumn::Number(entry.count(1, 1_000_000)?),
        };
        columns.push(ColumnMapping {
            own,
            foreign,
            location: entry.source.location(entry.key_span.start..entry.span.end),
        });
    }
    Ok(columns)
}
