//! `[format]` and `[columns]`: how other people's files are written.

use crate::error::ModelError;
use crate::session::document::{Table, Value};
use crate::session::table::{Format, Mapped, Theirs};

/// `[format]`: separator, decimal, header; sheet of a spreadsheet; direction in a ball-bar file.
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
        format.header = value.truth()?;
    }
    if let Some(value) = table.take("sheet") {
        format.sheet = Some(value.text()?);
    }
    if let Some(value) = table.take("anticlockwise") {
        format.anticlockwise = Some(value.text()?);
    }
    if format.decimal == format.separator
        && let Some(value) = decimal
    {
        let message = "the decimal comma is also the separator (\",\" unless declared)";
        let help = "declare what parts the columns, as `separator = \";\"`";
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
            let names: Vec<String> = known
                .iter()
                .map(|byte| format!("{:?}", char::from(*byte).to_string()))
                .collect();
            Err(value.unlike(&format!("one of {}", names.join(" "))))
        }
    }
}

/// `[columns]`: ours = theirs, by name or number.
pub(super) fn columns(mut table: Table<'_>) -> Result<Vec<Mapped>, ModelError> {
    let mut columns = Vec::new();
    for entry in table.take_all()? {
        let theirs = match entry.as_text() {
            Some(text) => Theirs::Name(text.trim().to_string()),
            None => Theirs::Number(entry.count(1, 1_000_000)?),
        };
        columns.push(Mapped {
            ours: entry.key.clone(),
            theirs,
            place: entry.source.place(entry.key_span.start..entry.span.end),
        });
    }
    Ok(columns)
}
