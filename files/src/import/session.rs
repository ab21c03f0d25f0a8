//! The session that reads foreign tables: a new one of a machine, or one to which tests are added.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use abbe_model::axis::AxisKind;
use abbe_model::chain::Machine;
use abbe_model::diagnostic::{Diagnostic, Location};
use abbe_model::document::edit::SessionText;
use abbe_model::document::layout::{Columns, Format};
use abbe_model::document::measurement::Test;
use abbe_model::document::node::Node;
use abbe_model::document::session::Session as Document;
use abbe_model::instrument::{Fault, InstrumentKind};
use abbe_model::session::planned::checked_plan;
use abbe_model::session::{Session, trajectory};

use super::foreign::Foreign;
use super::guess::{only_axis, unknown_set_up};
use super::{Circle, Expected, Hint, Reading, Understood, understand};
use crate::access::{self, ReadOptions};
use crate::read::{self, MachineRead};
use crate::source::{Parsed, Source as Text};
use crate::store::Store;

/// A session that will read foreign files.
#[derive(Clone)]
pub struct Draft {
    /// The session file.
    pub file: PathBuf,
    text: SessionText,
    /// The files that the session reads and that exist: by path, with their content.
    existing: BTreeMap<PathBuf, Vec<u8>>,
    /// The names of the files that the session names, in lower case, without those of this import.
    taken: BTreeSet<String>,
    /// The tests that name a file which is not there yet, and are not of this import.
    awaited: BTreeSet<String>,
    /// The files that are new, by their name beside the session.
    new: Vec<(String, Vec<u8>)>,
    /// Whether the layout of a test must be stated, since the session has one of its own.
    states_layout: bool,
    /// The key of the target or the ball, if no one has stated where it is.
    unknown_target: Option<&'static str>,
    /// Whether the session is new: the layout that all its files share is its own.
    is_new: bool,
}

/// Keys that an import states itself, with what the caller can say instead.
const OWN_KEYS: [(&str, &str); 4] = [
    ("name", "the test has the name of its file: rename the file"),
    ("data", "the data of the test are the file"),
    (
        "format",
        "separator, decimal sign and lines above are found, and a normalised copy is written where they cannot be stated",
    ),
    ("columns", "say what a column holds, such as c_deg=3 (our name, then the name or the number in the file)"),
];

/// Refuses keys of tests that an import states itself.
fn check_keys(set: &Node) -> Result<(), Diagnostic> {
    let own = |key: &str| OWN_KEYS.iter().find(|(own, _)| *own == key);
    match set.entries().iter().find_map(|entry| own(&entry.key)) {
        Some((key, help)) => Err(Diagnostic::session(
            format!("`{key}` is no key that a new test can be given: it follows from the file"),
            *help,
        )),
        None => Ok(()),
    }
}

/// Keys of a test from texts such as `bar_mm=150`; a value that is no TOML is a text.
///
/// # Errors
/// A text without a key.
pub fn keys(texts: &[String]) -> Result<Node, Fault> {
    let mut keys = Node::table::<Node>([]);
    for text in texts {
        let key =
            |text: &str| text.split_once('=').map(|(key, value)| (key.trim().to_string(), value.trim().to_string()));
        let Some((key, value)) = key(text).filter(|(key, _)| !key.is_empty()) else {
            return Err((format!("`{text}` states no key of a test"), "write KEY=VALUE, such as bar_mm=150".into()));
        };
        let source = Text::new(Path::new(""), &format!("value = {value}"));
        let node = source.parse().ok().and_then(|parsed| parsed.root.get("value").cloned());
        keys.set(&key, node.unwrap_or_else(|| Node::from(value.as_str())));
    }
    Ok(keys)
}

/// The name of the session in a new folder.
pub const SESSION_FILE: &str = "session.toml";

impl Draft {
    /// A new session of a machine file, with a test of each name; `set` has further keys of the tests.
    ///
    /// # Errors
    /// If the machine cannot be read, a test lacks a key of its set-up, or `set` has a key that follows from the file.
    pub fn of_machine(
        file: &Path,
        options: &ReadOptions,
        kind: InstrumentKind,
        tests: &[String],
        set: &Node,
    ) -> Result<Draft, Diagnostic> {
        check_keys(set)?;
        let MachineRead { source, bodies, .. } = read::machine_with_bodies(file, options)?;
        let text = format!("[machine]\nfile = \"machine.toml\"\n\n[instrument]\nkind = \"{}\"\n", kind.word());
        let session = PathBuf::from(SESSION_FILE);
        let mut new = vec![("machine.toml".to_string(), source.text.into_bytes())];
        new.extend(bodies.into_iter().map(|body| (body.name, body.contents.to_vec())));
        let mut draft = Draft {
            text: SessionText::new(&text, &session)?,
            file: session,
            existing: BTreeMap::new(),
            taken: BTreeSet::new(),
            awaited: BTreeSet::new(),
            new,
            states_layout: false,
            unknown_target: unknown_set_up(kind)
                .and_then(|keys| Some(keys.first()?.0))
                .filter(|key| set.get(key).is_none()),
            is_new: true,
        };
        for name in tests {
            let mut keys = Node::table([("name".to_string(), Node::from(name.as_str()))]);
            keys.set("data", placeholder(name).as_str());
            for (key, node) in unknown_set_up(kind).into_iter().flatten() {
                keys.set(key, node);
            }
            for entry in set.entries() {
                keys.set(&entry.key, entry.node.clone());
            }
            draft.text.add("test", &test_of(&keys)?)?;
        }
        Ok(draft)
    }

    /// A session that exists. Each name is a test of it without data, or becomes a test with the set-up of the test
    /// `like`, by default of all tests if theirs are the same; `set` has further keys of the new tests. Returns the names
    /// of the tests.
    ///
    /// # Errors
    /// If the session cannot be read, it is not clear which set-up a new test has, or `like` or `set` are given for a test
    /// that the session plans.
    pub fn of_session(
        file: &Path,
        options: &ReadOptions,
        names: &[String],
        like: Option<&str>,
        set: &Node,
    ) -> Result<(Draft, Vec<String>), Diagnostic> {
        check_keys(set)?;
        let source = Text::read(&options.store, file, "the session file")?;
        let parsed = source.parse()?;
        let document: Document = parsed.document()?;
        // A test whose file is not there is planned, such as those of sockets.
        let folders = [options.data_directory.as_deref(), Some(access::folder(file))];
        let is_there =
            |data: &str| folders.iter().flatten().any(|folder| options.store.open(&folder.join(data)).is_ok());
        let lacking: BTreeSet<String> = (document.parts.test.iter())
            .filter(|test| test.data.as_deref().is_some_and(|data| !is_there(data)))
            .map(|test| test.name.clone())
            .collect();
        let text = SessionText::new(&source.text, file)?;
        let planned = ReadOptions { read_data: false, ..options.clone() };
        let mut stamps = read::session_of(&source, &planned)?.1.files;
        if lacking.is_empty() {
            stamps.extend(read::session_of(&source, options)?.1.files);
        } else if lacking.len() < document.parts.test.len() {
            let mut present = text.clone();
            present.keep_tests(&|name| !lacking.contains(name));
            stamps.extend(read::session_of(&Text::new(file, &present.to_string()), options)?.1.files);
        }
        let mut existing = BTreeMap::new();
        for stamp in &stamps {
            let contents = options.store.read(&stamp.file).map_err(|cause| unreadable(&stamp.file, &cause))?;
            existing.insert(stamp.file.clone(), contents);
        }
        let is_new = |name: &String| names.iter().any(|own| own.to_lowercase() == name.to_lowercase());
        let (imported, awaited): (BTreeSet<String>, BTreeSet<String>) = lacking.into_iter().partition(is_new);
        let of_stamps =
            existing.keys().filter_map(|path: &PathBuf| Some(path.file_name()?.to_string_lossy().to_lowercase()));
        let others = document.parts.test.iter().filter(|test| !imported.contains(&test.name));
        let of_tests = others.filter_map(|test| Some(test.data.as_ref()?.to_lowercase()));
        let taken = of_stamps.chain(of_tests).collect();
        let mut draft = Draft {
            file: file.to_path_buf(),
            text,
            existing,
            taken,
            awaited,
            new: Vec::new(),
            states_layout: document.parts.format.is_some() || document.parts.columns.is_some(),
            unknown_target: None,
            is_new: false,
        };
        let mut tests = Vec::new();
        for name in names {
            let same = |test: &&Test| test.name.to_lowercase() == name.to_lowercase();
            match document.parts.test.iter().find(same) {
                Some(planned) if planned.data.is_none() || imported.contains(&planned.name) => {
                    if like.is_some() || !set.entries().is_empty() {
                        let message =
                            format!("test \"{}\" is planned in the session with its own set-up", planned.name);
                        let help = "state no key and no other test for it: edit its keys in the session, and import the other files by \
                                    themselves";
                        return Err(draft.fault(message, help));
                    }
                    draft.text.set_data(&[(planned.name.clone(), placeholder(name))]);
                    tests.push(planned.name.clone());
                }
                Some(measured) => {
                    let message = format!("test \"{}\" of the session has data already", measured.name);
                    return Err(draft.fault(message, "rename the file: its name is that of the test"));
                }
                None => {
                    let item = draft.set_up_of(&document, name, like)?;
                    let mut keys = Node::table([("name".to_string(), Node::from(name.as_str()))]);
                    keys.set("data", placeholder(name).as_str());
                    let kept = parsed.root.get("test").map_or(&[][..], Node::items).get(item);
                    for entry in kept.into_iter().flat_map(Node::entries).chain(set.entries()) {
                        if !OWN_KEYS.iter().any(|(own, _)| *own == entry.key) {
                            keys.set(&entry.key, entry.node.clone());
                        }
                    }
                    draft.text.add("test", &test_of(&keys)?)?;
                    tests.push(name.clone());
                }
            }
        }
        Ok((draft, tests))
    }

    fn fault(&self, message: String, help: &str) -> Diagnostic {
        Diagnostic::input(Location::file(&self.file), message, help)
    }

    /// The test whose set-up a new one has, by its number.
    fn set_up_of(&self, document: &Document, name: &str, like: Option<&str>) -> Result<usize, Diagnostic> {
        if let Some(like) = like {
            return document.parts.test.iter().position(|test| test.name == like).ok_or_else(|| {
                let names: Vec<&str> = document.parts.test.iter().map(|test| test.name.as_str()).collect();
                self.fault(
                    format!("the session has no test \"{like}\""),
                    &format!("its tests are {}", names.join(", ")),
                )
            });
        }
        let [first, others @ ..] = &document.parts.test[..] else {
            return Err(self.fault("a session without tests".into(), "import with the machine alone"));
        };
        let same = |other: &Test| other.set_up == first.set_up && other.kind == first.kind && other.at == first.at;
        if others.iter().all(same) {
            return Ok(0);
        }
        let names: Vec<&str> = document.parts.test.iter().map(|test| test.name.as_str()).collect();
        let help = format!(
            "name the file as a planned test without data, or say which test has the same set-up: {}",
            names.join(", ")
        );
        Err(self
            .fault(format!("no test of the session is named \"{name}\", and its tests differ in their set-up"), &help))
    }

    /// The session as it is planned, without readings.
    ///
    /// # Errors
    /// If the text is no session.
    pub fn planned(&self) -> Result<Session, Diagnostic> {
        self.read_tests(&ReadOptions { read_data: false, ..self.options() }, None)
    }

    /// The session with its readings, without the tests whose files are not there yet.
    ///
    /// # Errors
    /// If the readings cannot be used.
    pub fn read(&self) -> Result<Session, Diagnostic> {
        let is_there = |name: &str| !self.awaited.contains(name);
        let kept: &dyn Fn(&str) -> bool = &is_there;
        self.read_tests(&self.options(), (!self.awaited.is_empty()).then_some(kept))
    }

    /// As [`Draft::read`], with one test. The files of the others need not be known yet.
    ///
    /// # Errors
    /// If the readings cannot be used.
    pub fn read_alone(&self, test: &str) -> Result<Session, Diagnostic> {
        self.read_tests(&self.options(), Some(&|name: &str| name == test))
    }

    fn read_tests(&self, options: &ReadOptions, kept: Option<&dyn Fn(&str) -> bool>) -> Result<Session, Diagnostic> {
        let mut text = self.text.clone();
        if let Some(kept) = kept {
            text.keep_tests(kept);
        }
        read::session_of(&Text::new(&self.file, &text.to_string()), options).map(|(session, _)| session)
    }

    fn options(&self) -> ReadOptions {
        let beside = self.file.parent().unwrap_or(Path::new(""));
        let new = self.new.iter().map(|(name, contents)| (beside.join(name), contents.clone()));
        let existing = self.existing.iter().map(|(path, contents)| (path.clone(), contents.clone()));
        let store = Store::in_memory(existing.chain(new));
        ReadOptions { allow_outside: true, store, ..ReadOptions::default() }
    }

    /// A file as readings of a test of the planned session.
    ///
    /// # Errors
    /// If the file cannot be used: what was found, and what to do.
    pub fn understand(
        &self,
        planned: &Session,
        test: &str,
        file: &Foreign,
        hints: &[Hint],
    ) -> Result<Understood, Fault> {
        let Some(own) = planned.tests.iter().find(|own| own.name == test) else {
            return Err((format!("the session has no test \"{test}\""), String::new()));
        };
        let circle = trajectory::circle_of(&planned.machine, own);
        let expected = Expected {
            machine: &planned.machine,
            station: &own.station,
            circle: circle.map(|(axes, centre_mm, amplitude_mm)| Circle { axes, centre_mm, amplitude_mm }),
            moved: moved(&planned.machine, own),
            planned: ranges(&planned.machine, own),
            hints,
        };
        understand(&file.name, &file.bytes, &expected)
    }

    /// Lets a test read a file in one way. Returns the name of the file that the session reads.
    ///
    /// # Errors
    /// If the text of the session cannot be edited.
    pub fn apply(&mut self, test: &str, file: &Foreign, reading: &Reading) -> Result<String, Diagnostic> {
        let name = self.data_name(file, reading.copy.is_some());
        let mut format = reading.format.clone();
        if reading.copy.is_some() {
            format.separator = self.states_layout.then(|| ",".into());
        }
        let contents = reading.copy.as_ref().map_or(&file.bytes[..], |copy| copy.as_bytes());
        self.new.push((name.clone(), contents.to_vec()));
        self.text.set_data(&[(test.to_string(), name.clone())]);
        // An empty table maps no column: the file has the default names.
        if self.states_layout || format != Format::default() {
            self.text.set_of_test(test, "format", &format)?;
        }
        if self.states_layout || reading.own_columns != Columns::default() {
            self.text.set_of_test(test, "columns", &reading.own_columns)?;
        }
        Ok(name)
    }

    /// The tests whose target or ball no one has stated: states where it was found, mm.
    ///
    /// # Errors
    /// If the text of the session cannot be edited.
    pub fn set_targets(&mut self, found: &Session) -> Result<Option<[f64; 3]>, Diagnostic> {
        let Some(key) = self.unknown_target else { return Ok(None) };
        let mut stated = None;
        for test in &found.tests {
            // The start of a fit needs no more.
            let point = test.station.tool_point().mm.map(|x| (x * 10.0).round() / 10.0);
            let name = test.name.split('/').next().unwrap_or_default();
            self.text.set_of_test(name, key, &Node::from_iter(point))?;
            stated = Some(point);
        }
        Ok(stated)
    }

    /// States the layout once for all files of a new session, if they share it.
    ///
    /// # Errors
    /// If the text of the session cannot be edited.
    pub fn share_layout(&mut self, readings: &[&Reading]) -> Result<(), Diagnostic> {
        let Some(first) = readings.first() else { return Ok(()) };
        let is_shared = |other: &&Reading| {
            other.copy.is_none() && (&other.format, &other.own_columns) == (&first.format, &first.own_columns)
        };
        if !self.is_new || !readings.iter().all(is_shared) {
            return Ok(());
        }
        self.text.remove_of_tests(&["format", "columns"]);
        if first.format != Format::default() {
            self.text.set_table("format", &first.format)?;
        }
        self.text.set_table("columns", &first.own_columns)
    }

    /// A name beside the session that no file of the session has, planned ones among them, in any case of letters.
    fn data_name(&self, file: &Foreign, is_changed: bool) -> String {
        let (stem, extension) = match (is_changed, file.name.rsplit_once('.')) {
            (false, Some((stem, extension))) => (stem.to_string(), format!(".{extension}")),
            (false, None) => (file.name.clone(), String::new()),
            (true, _) => (format!("{}-normalised", file.stem()), ".csv".to_string()),
        };
        let own = self.file.file_name().map(|name| name.to_string_lossy().to_lowercase());
        let is_taken = |name: &str| {
            let name = name.to_lowercase();
            own.as_deref() == Some(name.as_str())
                || self.taken.contains(&name)
                || self.new.iter().any(|(new, _)| new.to_lowercase() == name)
        };
        let names = std::iter::once(format!("{stem}{extension}"))
            .chain((2_u32..).map(|number| format!("{stem}-{number}{extension}")));
        names.into_iter().find(|name| !is_taken(name)).unwrap_or_default()
    }

    /// The files to write, by their names beside the session; the session is the last.
    pub fn files(&self) -> Vec<(String, Vec<u8>)> {
        let session =
            self.file.file_name().map_or_else(|| SESSION_FILE.into(), |name| name.to_string_lossy().into_owned());
        self.new.iter().cloned().chain([(session, self.text.to_string().into_bytes())]).collect()
    }
}

/// The axis that alone moves in a test, or that a machine alone has; of a machine with one rotary axis that one.
fn moved(machine: &Machine, test: &abbe_model::session::Test) -> Option<usize> {
    match &test.motion {
        Some(motion) => motion.axis(),
        None => only_axis(machine).or_else(|| {
            let mut rotary = (0..machine.axes.len()).filter(|k| machine.axes[*k].kind == AxisKind::Rotary);
            rotary.next().filter(|_| rotary.next().is_none())
        }),
    }
}

/// The range of the planned positions of each axis, mm and rad.
fn ranges(machine: &Machine, test: &abbe_model::session::Test) -> Option<Vec<[f64; 2]>> {
    let readings = checked_plan(machine, test).ok().filter(|_| test.motion.is_some())?;
    let range = |column: &Vec<f64>| {
        column.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| [low.min(*q), high.max(*q)])
    };
    Some(readings.positions.iter().map(range).collect())
}

/// The name of a file that is not there yet.
fn placeholder(name: &str) -> String {
    format!("{name}.csv")
}

fn test_of(keys: &Node) -> Result<Test, Diagnostic> {
    Parsed::of_node(keys.clone()).document()
}

fn unreadable(file: &Path, cause: &std::io::Error) -> Diagnostic {
    Diagnostic::input(Location::file(file), format!("cannot be read: {cause}"), None)
}
