//! Content of a ball-bar file in XML: its runs, its plane, and the names of all other elements.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use abbe_model::diagnostic::{Diagnostic, Location};
use encoding_rs::Encoding;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::super::encoding;
use crate::stamp::FileStamp;
use crate::store::Store;

/// Largest file size, bytes.
const MAX_BYTES: u64 = 64 << 20;
/// Largest nesting depth of elements.
const MAX_DEPTH: usize = 100;
/// The element that contains the numbers of a run.
pub(super) const READINGS: &str = "READINGS";
const DIRECTION: &str = "RUN_DIRECTION";

/// A run in the file.
pub(super) struct Run {
    pub line: usize,
    pub direction: Option<String>,
    pub text: String,
}

/// The content of a file.
#[derive(Default)]
pub(super) struct Contents {
    pub runs: Vec<Run>,
    pub plane: Option<(String, usize)>,
    /// Number of occurrences of each element that is not interpreted.
    pub unread: BTreeMap<String, usize>,
}

/// An element that is open.
struct OpenElement {
    name: String,
    line: usize,
    text: String,
    direction: Option<String>,
    /// Whether the direction is in an element of its own and thus refers to one run.
    once: bool,
    /// Runs in the element whose direction is not known yet.
    undirected_runs: Vec<usize>,
}

/// The state of a file and its text.
fn decoded(store: &Store, file: &Path, stated: Option<&'static Encoding>) -> Result<(FileStamp, String), Diagnostic> {
    let fault = |message: String| Diagnostic::input(Location::file(file), message, "check `data` and the file");
    let unreadable = |cause: std::io::Error| fault(format!("the data file cannot be read: {cause}"));
    let mut opened = store.open(file).map_err(unreadable)?;
    let stamp = FileStamp::of(file, opened.state().map_err(unreadable)?);
    let mut bytes = Vec::new();
    opened.by_ref().take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(fault(format!("more than {MAX_BYTES} bytes, the limit of a ball-bar file in XML")));
    }
    stamp.finish(&opened)?;
    let (encoding, mark) = encoding::of_start(&bytes, stated);
    let (text, _) = encoding::decode(&bytes[mark..], encoding)
        .map_err(|encoding| fault(format!("the file is not valid {}", encoding::name_of(encoding))))?;
    let text = text.into_owned();
    Ok((stamp, text))
}

/// Reads a file.
///
/// # Errors
/// If it is not XML.
pub(super) fn parse(
    store: &Store,
    file: &Path,
    encoding: Option<&'static Encoding>,
) -> Result<(FileStamp, Contents), Diagnostic> {
    let (stamp, text) = decoded(store, file, encoding)?;
    let mut reader = Reader::from_str(&text);
    let mut contents = Contents::default();
    let mut open: Vec<OpenElement> = Vec::new();
    let (mut line, mut counted) = (1, 0);
    loop {
        let until = (reader.buffer_position() as usize).min(text.len());
        line += text.as_bytes()[counted..until].iter().filter(|byte| **byte == b'\n').count();
        counted = until;
        let broken = |cause: String| {
            Diagnostic::input(
                Location::line(file, line),
                format!("not valid XML: {cause}"),
                "a ball-bar file in XML is expected; other files need another name, such as .csv or .xlsx",
            )
        };
        match reader.read_event() {
            Err(cause) => return Err(broken(cause.to_string())),
            Ok(Event::Eof) if open.is_empty() => return Ok((stamp, contents)),
            Ok(Event::Eof) => {
                let unclosed = open.last().map_or("", |element| element.name.as_str());
                return Err(broken(format!("it ends within <{unclosed}>")));
            }
            Ok(Event::Start(_)) if open.len() == MAX_DEPTH => {
                return Err(broken(format!("elements are nested deeper than {MAX_DEPTH}")));
            }
            Ok(Event::Start(start)) => open.push(opened(&start, line, &mut contents, &broken)?),
            Ok(Event::Empty(start)) => {
                let element = opened(&start, line, &mut contents, &broken)?;
                close(element, &mut open, &mut contents);
            }
            Ok(Event::End(_)) => {
                if let Some(element) = open.pop() {
                    close(element, &mut open, &mut contents);
                }
            }
            Ok(Event::Text(piece)) => {
                let piece = piece.into_inner();
                if let Some(element) = open.last_mut() {
                    element.text.push_str(piece.as_ref());
                }
            }
            Ok(_) => {}
        }
    }
}

fn opened(
    start: &BytesStart<'_>,
    line: usize,
    contents: &mut Contents,
    broken: &impl Fn(String) -> Diagnostic,
) -> Result<OpenElement, Diagnostic> {
    let name = start.local_name().as_ref().to_string();
    let mut element =
        OpenElement { name, line, text: String::new(), direction: None, once: false, undirected_runs: Vec::new() };
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|cause| broken(cause.to_string()))?;
        let value = attribute.value.trim().to_string();
        match attribute.key.local_name().as_ref() {
            DIRECTION => element.direction = Some(value),
            "TEST_PLANE" => contents.plane = Some((value, line)),
            _ => {}
        }
    }
    Ok(element)
}

/// Passes the content of a closed element to its parent.
fn close(mut element: OpenElement, open: &mut [OpenElement], contents: &mut Contents) {
    let within = open.iter().any(|outer| outer.name == READINGS);
    if within {
        // A reading may have its own element.
        if let Some(outer) = open.last_mut() {
            outer.text.push(' ');
            outer.text.push_str(&element.text);
        }
        return;
    }
    match element.name.as_str() {
        READINGS => {
            element.undirected_runs.push(contents.runs.len());
            contents.runs.push(Run { line: element.line, direction: None, text: std::mem::take(&mut element.text) });
        }
        DIRECTION => {
            if element.direction.is_none() {
                element.direction = Some(element.text.trim().to_string()).filter(|word| !word.is_empty());
            }
            if let Some(outer) = open.last_mut() {
                outer.direction = element.direction.take();
                outer.once = true;
                assign_direction(outer, contents);
            }
            return;
        }
        "PLANE" => {}
        other => {
            if element.undirected_runs.is_empty() {
                *contents.unread.entry(other.to_string()).or_default() += 1;
            }
        }
    }
    assign_direction(&mut element, contents);
    if let Some(outer) = open.last_mut() {
        outer.undirected_runs.append(&mut element.undirected_runs);
        assign_direction(outer, contents);
    }
}

/// Assigns the direction of an element, if it has one, to the runs that wait in it.
fn assign_direction(element: &mut OpenElement, contents: &mut Contents) {
    let Some(direction) = &element.direction else {
        return;
    };
    let settled = !element.undirected_runs.is_empty();
    for run in element.undirected_runs.drain(..) {
        contents.runs[run].direction.get_or_insert_with(|| direction.clone());
    }
    if settled && element.once {
        element.direction = None;
    }
}
