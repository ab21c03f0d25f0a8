//! JSON Lines: one object per line. Keys are names of columns; values are numbers, or of a socket its name.
//!
//! Every object has the keys of the first one, in any order. Empty lines and a byte order mark are accepted.

use std::fmt;
use std::path::Path;

use abbe_model::Diagnostic;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

use super::format::{Content, DataFormat, has_extension};
use super::lines::Lines;
use super::request::{ForeignColumn, Request};
use super::row::{Row, Rows};
use crate::stamp::FileStamp;
use crate::store::Store;

/// The format, recognised by the extension of the file.
pub(super) struct JsonLines;

impl DataFormat for JsonLines {
    fn reads(&self, file: &Path, _: &Store) -> bool {
        has_extension(file, &["jsonl", "ndjson"])
    }

    fn open(&self, file: &Path, request: &Request<'_>) -> Result<(FileStamp, Content), Diagnostic> {
        let lines = Lines::open(request.store, file, &request.format)?;
        let (stamp, decimal) = (lines.stamp().clone(), char::from(request.format.decimal));
        let rows = ObjectRows { lines, decimal, socket: socket_key(request), keys: Vec::new(), first: None };
        Ok((stamp, Content::Table { rows: Box::new(rows), has_header: true }))
    }
}

/// The key of the name of a socket, whose value may be a text.
fn socket_key(request: &Request<'_>) -> String {
    let mapped = request.columns.unwrap_or(&[]).iter();
    let foreign =
        mapped.filter(|entry| entry.own.eq_ignore_ascii_case("socket")).find_map(|entry| match &entry.foreign {
            ForeignColumn::Name(name) => Some(name.clone()),
            ForeignColumn::Number(_) | ForeignColumn::Traversals(_) => None,
        });
    foreign.unwrap_or("socket".into())
}

/// The rows of a text of objects. The keys of the first object are the header.
struct ObjectRows {
    lines: Lines,
    /// The decimal sign that the session states, which numbers in JSON do not have.
    decimal: char,
    socket: String,
    keys: Vec<String>,
    /// The first object, after the header.
    first: Option<Row>,
}

impl Rows for ObjectRows {
    fn next_row(&mut self) -> Result<Option<Row>, Diagnostic> {
        if let Some(row) = self.first.take() {
            return Ok(Some(row));
        }
        while let Some(line) = self.lines.next_line()? {
            if line.text.trim().is_empty() {
                continue;
            }
            let cells = self.cells(&line.text)?;
            self.lines.count_row()?;
            if !self.keys.is_empty() {
                return Ok(Some(Row::of_line(line, self.in_order(cells)?).with_keys()));
            }
            let (keys, cells): (Vec<String>, Vec<String>) = cells.into_iter().unzip();
            if keys.is_empty() {
                return Err(self.lines.fault("an object without keys".into(), OBJECT));
            }
            self.keys.clone_from(&keys);
            let header = Row::of_cells(line.number, keys).with_keys();
            self.first = Some(Row::of_line(line, cells).with_keys());
            return Ok(Some(header));
        }
        Ok(None)
    }
}

/// What a line has to be.
const OBJECT: &str = "a line is one object, such as {\"c_deg\": 0.0, \"length_mm\": 100.0012}";

impl ObjectRows {
    /// The keys of a line and their cells, in the order of the line.
    fn cells(&self, text: &str) -> Result<Vec<(String, String)>, Diagnostic> {
        let object: Object<'_> = serde_json::from_str(text).map_err(|cause| {
            let message = cause.to_string();
            let message = message.split(" at line ").next().unwrap_or_default();
            let place = cause.column();
            self.lines.fault(format!("not a JSON object: {message}, at byte {place}"), OBJECT)
        })?;
        let mut cells: Vec<(String, String)> = Vec::with_capacity(object.0.len());
        for (key, value) in object.0 {
            let key = key.trim().to_string();
            if cells.iter().any(|(other, _)| *other == key) {
                return Err(self.lines.fault(format!("key `{key}` occurs twice"), "keep one of them"));
            }
            let cell = self.cell(&key, value);
            cells.push((key, cell));
        }
        Ok(cells)
    }

    /// The text of a value, as a cell of a file with the stated decimal sign has it.
    fn cell(&self, key: &str, value: &RawValue) -> String {
        let text = value.get();
        match text.as_bytes().first() {
            Some(b'-' | b'0'..=b'9') => text.replace('.', &self.decimal.to_string()),
            Some(b'[') => "a list".into(),
            Some(b'{') => "an object".into(),
            Some(b'"') if key == self.socket => {
                serde_json::from_str(text).map_or(text.to_string(), |name: String| name.trim().to_string())
            }
            // A text keeps its quotes, so that "1.5" is not taken for a number.
            _ => text.to_string(),
        }
    }

    /// The cells in the order of the keys of the first object.
    fn in_order(&self, mut cells: Vec<(String, String)>) -> Result<Vec<String>, Diagnostic> {
        const SAME: &str = "every object has the keys of the first one; write `null` where a value is missing";
        let mut ordered = Vec::with_capacity(self.keys.len());
        for key in &self.keys {
            let Some(index) = cells.iter().position(|(other, _)| other == key) else {
                let message = format!("no key `{key}`, which the first object has");
                return Err(self.lines.fault(message, SAME));
            };
            ordered.push(cells.remove(index).1);
        }
        match cells.first() {
            None => Ok(ordered),
            Some((key, _)) => {
                let message = format!("key `{key}`, which the first object does not have");
                Err(self.lines.fault(message, SAME))
            }
        }
    }
}

/// An object with its values as they are written.
struct Object<'t>(Vec<(String, &'t RawValue)>);

impl<'de> Deserialize<'de> for Object<'de> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Entries;

        impl<'de> Visitor<'de> for Entries {
            type Value = Object<'de>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(Object(entries))
            }
        }

        from.deserialize_map(Entries)
    }
}
