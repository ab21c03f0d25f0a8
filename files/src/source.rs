//! The text of a document: reading it, and the place of a fault in it.

use std::borrow::Cow;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use abbe_model::diagnostic::FILE_ACCESS;
use abbe_model::diagnostic::{Diagnostic, Location};
use abbe_model::document::fault::{Fault, Finding, Step};
use abbe_model::document::node::{Entry, Node, Value};
use abbe_model::document::schema;
use abbe_model::document::{LIST, from_node};
use encoding_rs::{Encoding, UTF_8};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde_json::value::RawValue;
use toml::de::DeTable;

use crate::node;
use crate::spelling::known_names;
use crate::stamp::FileStamp;
use crate::store::Store;
use crate::table::encoding;

/// Largest size of a machine or session file, bytes.
const MAX_BYTES: u64 = 8 << 20;
/// Largest nesting depth that the TOML parser accepts.
const MAX_DEPTH: usize = 80;
/// Bytes in which an XML declaration is looked for.
const MAX_DECLARATION: usize = 200;

/// The text of a file, read once: a session, a machine, a model, a study, a file of values.
#[derive(Clone, Debug)]
pub struct Source {
    /// As the user named it.
    pub file: PathBuf,
    /// The text, without a byte order mark.
    pub text: String,
    /// Length of the byte order mark before the text, bytes.
    pub skipped: usize,
    /// The state of the file when it was read; `None` for a text from no file.
    pub stamp: Option<FileStamp>,
}

impl Source {
    /// Reads a text file of UTF-8 with or without byte order mark, within the limit of its size; `what` names its content
    /// in messages.
    ///
    /// # Errors
    /// If the file cannot be read or is not such a text, with its name and what to do.
    pub fn read(store: &Store, file: &Path, what: &str) -> Result<Source, Diagnostic> {
        let (text, stamp) = text(store, file, what)?;
        Ok(Source { stamp: Some(stamp), ..Source::new(file, &text) })
    }

    /// As [`Source::read`], of a file of another program: UTF-8, UTF-16, or the encoding that its XML declaration states, and
    /// otherwise Latin-1. A declaration then states UTF-8, the encoding of the text in memory.
    ///
    /// # Errors
    /// If the file cannot be read, or is too large.
    pub fn read_foreign(store: &Store, file: &Path, what: &str) -> Result<Source, Diagnostic> {
        let (bytes, stamp) = bytes(store, file, what)?;
        let (found, mark) = encoding::of_start(&bytes, None);
        let declared = declared(&bytes[mark..]);
        let stated = found.or_else(|| std::str::from_utf8(&bytes).is_err().then_some(declared).flatten());
        let text = match encoding::decode(&bytes[mark..], stated) {
            Ok((text, encoding)) if encoding != UTF_8 => stating_utf_8(&text),
            Ok((text, _)) => text.into_owned(),
            Err(encoding) => {
                return Err(Diagnostic::input(
                    Location::file(file),
                    format!("{what} is not valid {}", encoding::name_of(encoding)),
                    "save the file as UTF-8",
                ));
            }
        };
        Ok(Source { stamp: Some(stamp), ..Source::new(file, &text) })
    }

    /// A given text of a file.
    pub fn new(file: &Path, text: &str) -> Source {
        let content = text.strip_prefix('\u{feff}').unwrap_or(text);
        Source { file: file.to_path_buf(), text: content.to_string(), skipped: text.len() - content.len(), stamp: None }
    }

    /// The document of a TOML text.
    ///
    /// # Errors
    /// If it is no TOML, with the line.
    pub fn parse(&self) -> Result<Parsed<'_>, Diagnostic> {
        let root = DeTable::parse(&self.text).map_err(|fault| {
            Diagnostic::input(
                self.location(fault.span().unwrap_or(0..0)),
                format!("not valid TOML: {}", fault.message()),
                fault
                    .message()
                    .contains("recursion")
                    .then(|| format!("tables, lists and the parts of a key may be nested {MAX_DEPTH} levels deep")),
            )
        })?;
        Ok(Parsed { source: Cow::Borrowed(self), is_json: false, root: node::of_toml(root.into_inner(), 0..0) })
    }

    /// The document of a JSON text.
    ///
    /// # Errors
    /// If it is no JSON, with the line.
    pub fn json(&self) -> Result<Parsed<'_>, Diagnostic> {
        // It limits the depth of nesting.
        let root = serde_json::from_str::<serde_json::Value>(&self.text)
            .and_then(|_| serde_json::from_str::<&RawValue>(&self.text))
            .and_then(|raw| node::of_json(raw, &self.text));
        let root = root.map_err(|cause| {
            Diagnostic::input(Location::line(&self.file, cause.line()), format!("not valid JSON: {cause}"), None)
        })?;
        Ok(Parsed { source: Cow::Borrowed(self), is_json: true, root })
    }

    /// The location of some bytes of the text.
    fn location(&self, span: Range<usize>) -> Location {
        let until = span.start.min(self.text.len());
        Location {
            file: self.file.clone(),
            line: 1 + self.text.as_bytes()[..until].iter().filter(|byte| **byte == b'\n').count(),
            span: Some(span.start + self.skipped..span.end + self.skipped),
        }
    }
}

/// A document with its text, which is empty if no text holds it.
pub struct Parsed<'s> {
    source: Cow<'s, Source>,
    /// Whether the text is JSON, whose tables have no headers: messages name paths of keys.
    is_json: bool,
    /// The tree of values.
    pub(crate) root: Node,
}

impl Parsed<'_> {
    /// A document that no text holds. Messages about it have no place.
    pub(crate) fn of_node(root: Node) -> Parsed<'static> {
        Parsed { source: Cow::Owned(Source::new(Path::new(""), "")), is_json: false, root }
    }

    /// The document as typed values. A key that is absent is explained by its documentation.
    ///
    /// # Errors
    /// What is wrong, with its place.
    pub fn document<T: DeserializeOwned + JsonSchema>(&self) -> Result<T, Diagnostic> {
        from_node(&self.root).map_err(|fault| {
            let path: Vec<Step> = fault.path.iter().rev().cloned().collect();
            self.error_of(fault.explained(|key| schema::meaning(&schema::of::<T>(""), &path, key)))
        })
    }

    /// The comment behind the value of a path, up to the first semicolon.
    pub(crate) fn comment(&self, path: &[&str]) -> Option<String> {
        let steps: Vec<Step> = path.iter().map(|key| Step::Key((*key).to_string())).collect();
        let (node, _) = self.root.follow(steps.iter());
        let rest = self.source.text.get(node.span.end..)?.lines().next()?;
        let comment = rest.trim_start().strip_prefix('#')?;
        let text = comment.split(';').next()?.trim();
        let usable = !text.is_empty() && !text.chars().any(char::is_control);
        usable.then(|| text.to_string())
    }

    /// The location of a key with its value.
    pub(crate) fn location_of(&self, path: &[Step]) -> Location {
        let (node, entry) = self.root.follow(path.iter());
        self.source.location(entry.map_or(node.span.start, |entry| entry.key_span.start)..node.span.end)
    }

    /// The error of a fault, with its place, what was found and what to do.
    pub fn error_of(&self, fault: Fault) -> Diagnostic {
        let path: Vec<Step> = fault.path.into_iter().rev().collect();
        let (node, entry) = self.root.follow(path.iter());
        let quoted = || match entry {
            _ if self.is_json && !path.is_empty() => format!("`{}`", dotted(&path)),
            Some(entry) => format!("`{}`", entry.key),
            None => "the file".to_string(),
        };
        let mut span =
            if fault.on_key { entry.map_or(0..0, |entry| entry.key_span.clone()) } else { place(node, entry) };
        let (message, help) = match fault.finding {
            Finding::Other(error) => return *error,
            Finding::File { message, help } if self.source.text.is_empty() => {
                return Diagnostic::session(message, help);
            }
            Finding::File { message, help } => {
                let found = Diagnostic::input(self.source.location(span), message, help);
                return Diagnostic { code: FILE_ACCESS, ..found };
            }
            Finding::Said { message, help } if self.is_json && !path.is_empty() => {
                (format!("{}: {message}", quoted()), help)
            }
            Finding::Said { message, help } => (message, help),
            Finding::OfKey { what, help } => (format!("{} {what}", quoted()), help),
            Finding::OfTable { what, help } => (format!("{} {what}", self.name(&path)), help),
            Finding::Unexpected(expected) => {
                let help = match (&node.value, entry) {
                    (Value::Table(_), Some(entry)) if expected == LIST && !self.is_json => {
                        Some(format!("write [[{}]]", entry.key))
                    }
                    _ => None,
                };
                (format!("{} is {}; {expected} is expected", quoted(), node.found()), help)
            }
            Finding::UnknownKey { key, mut known } => {
                span = node.entry(&key).map_or(span, |entry| entry.key_span.clone());
                known.retain(|name| !name.starts_with('$'));
                known.sort_unstable();
                known.dedup();
                let known: Vec<&str> = known.iter().map(String::as_str).collect();
                (format!("{} has the unknown key `{key}`", self.name(&path)), Some(known_names(&key, &known)))
            }
            Finding::MissingKey { key, what } => {
                let what = what
                    .or_else(|| schema::meaning(&schema::session(), &path, &key))
                    .map_or(String::new(), |what| format!(": {what}"));
                (format!("{} has no `{key}`", self.name(&path)), Some(format!("add `{key}`{what}")))
            }
        };
        if self.source.text.is_empty() && self.source.file.as_os_str().is_empty() {
            return Diagnostic::session(message, help);
        }
        Diagnostic::input(self.source.location(span), message, help)
    }

    /// The name of a table in messages: `[instrument]`, `test "A100"`.
    fn name(&self, path: &[Step]) -> String {
        let (node, _) = self.root.follow(path.iter());
        let named = |key: &str| path.len() > 1 && matches!(&path[0], Step::Key(first) if first == key);
        let inner = |path: &[Step]| match path
            .iter()
            .rev()
            .find_map(|step| if let Step::Key(key) = step { Some(key) } else { None })
        {
            Some(key) => format!("`{key}`"),
            None => "the file".to_string(),
        };
        if named("test")
            && let [_, Step::Item(item), rest @ ..] = path
        {
            let (test, _) = self.root.follow(path[..2].iter());
            let called = test.get("name").and_then(Node::as_text);
            return match (rest, called) {
                ([], Some(name)) => format!("test \"{name}\""),
                ([], None) => format!("test {}", item + 1),
                ([Step::Key(key)], Some(name)) if key == "format" || key == "columns" => {
                    format!("[test.{key}] of \"{name}\"")
                }
                _ => inner(rest),
            };
        }
        if named("constants")
            && let Step::Key(name) = &path[1]
        {
            return format!("the constant `{name}`");
        }
        let in_line = self.source.text.get(node.span.start..).is_some_and(|rest| rest.starts_with('{'));
        match path {
            [] => "the file".to_string(),
            _ if self.is_json => format!("`{}`", dotted(path)),
            _ if in_line && path.len() > 1 => inner(path),
            [keys @ .., Step::Item(_)] => format!("[[{}]]", header(keys)),
            keys => format!("[{}]", header(keys)),
        }
    }
}

/// The keys of a path, as a header of TOML has them.
fn header(path: &[Step]) -> String {
    let keys = path.iter().filter_map(|step| if let Step::Key(key) = step { Some(key.as_str()) } else { None });
    keys.collect::<Vec<_>>().join(".")
}

/// A path with its items: `parameters[3].value`.
fn dotted(path: &[Step]) -> String {
    let steps = path.iter().map(|step| match step {
        Step::Key(key) => format!(".{key}"),
        Step::Item(item) => format!("[{item}]"),
    });
    steps.collect::<String>().trim_start_matches('.').to_string()
}

/// Messages about a table point at its header `[name]`.
fn place(node: &Node, entry: Option<&Entry>) -> Range<usize> {
    match (&node.value, entry) {
        (Value::Table(_), Some(entry)) if std::ptr::eq(&entry.node, node) && entry.key_span.start < node.span.start => {
            entry.key_span.clone()
        }
        _ => node.span.clone(),
    }
}

/// The place of the encoding in the XML declaration of a text, if it has one.
fn place_of_encoding(text: &str) -> Option<Range<usize>> {
    let declaration = text.strip_prefix("<?xml").and_then(|rest| rest.split("?>").next())?;
    let key = "<?xml".len() + declaration.find("encoding")? + "encoding".len();
    let start = key + text[key..].find(['"', '\''])? + 1;
    let quote = text[..start].chars().next_back()?;
    (start < "<?xml".len() + declaration.len()).then_some(start..start + text[start..].find(quote)?)
}

/// The encoding that the XML declaration of bytes states.
fn declared(bytes: &[u8]) -> Option<&'static Encoding> {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(MAX_DECLARATION)]);
    encoding::of_name(&start[place_of_encoding(&start)?])
}

/// The text with UTF-8 as the encoding of its XML declaration.
fn stating_utf_8(text: &str) -> String {
    let mut text = text.to_string();
    if let Some(place) = place_of_encoding(&text) {
        text.replace_range(place, "UTF-8");
    }
    text
}

/// Reads a text file: UTF-8 with or without byte order mark, of a limited size, unchanged while it is read. `what` names
/// its content in messages.
pub(crate) fn text(store: &Store, file: &Path, what: &str) -> Result<(String, FileStamp), Diagnostic> {
    let (bytes, stamp) = bytes(store, file, what)?;
    let text = String::from_utf8(bytes).map_err(|cause| {
        Diagnostic::input(
            Location::file(file),
            format!("byte {} is not UTF-8, the encoding of TOML", cause.utf8_error().valid_up_to() + 1),
            "save the file as UTF-8",
        )
    })?;
    Ok((text, stamp))
}

/// The bytes of a file of a limited size, unchanged while it is read.
fn bytes(store: &Store, file: &Path, what: &str) -> Result<(Vec<u8>, FileStamp), Diagnostic> {
    let fault = |message: String, help: &str| Diagnostic::input(Location::file(file), message, help);
    if store.state(file).is_ok_and(|found| found.folder) {
        return Err(fault(format!("this is a folder; {what} must be a file"), "name the .toml file in it"));
    }
    let unreadable = |cause: std::io::Error| {
        let help =
            "check the name; a relative name starts from the file that contains it, or from the working directory";
        fault(format!("{what} cannot be read: {cause}"), help)
    };
    let mut opened = store.open(file).map_err(unreadable)?;
    let stamp = FileStamp::of(file, opened.state().map_err(unreadable)?);
    let mut bytes = Vec::new();
    // The length of a pipe is unknown in advance.
    opened.by_ref().take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(fault(
            format!("{what} has more than {MAX_BYTES} bytes, which is the limit"),
            "readings belong in CSV files named by `data`",
        ));
    }
    stamp.finish(&opened)?;
    Ok((bytes, stamp))
}
