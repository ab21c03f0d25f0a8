//! Edits of the text of a session. Comments, the order of the keys and everything else stay.

use std::path::{Path, PathBuf};

use toml_edit::{DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::of_domain;
use super::print::{Block, document_of, number_of, table_of, value_of};
use crate::chain::Machine;
use crate::diagnostic::{Diagnostic, Location};
use crate::effect::Effect;

/// The text of a session during edits.
///
/// ```
/// use std::path::Path;
///
/// use abbe_model::chain::Machine;
/// use abbe_model::document::edit::SessionText;
/// use abbe_model::driver::Driver;
/// use abbe_model::effect::shape::Harmonic;
/// use abbe_model::effect::{Component, Effect, Shape};
///
/// let machine = Machine::from_code("wCAbYXZt")?;
/// let component = Component::parse("EZC").unwrap();
/// let effect = Effect::new(component, Driver::parse("C"), Shape::Harmonic(Harmonic { order: 2.0 }));
/// let mut text = SessionText::new("# a session\n[columns]\nJ1_rad = \"j1\"\n# end\n", Path::new("session.toml"))?;
/// text.remove(&["columns"]);
/// text.add_effects(&[effect], &machine)?;
/// assert_eq!(
///     text.to_string(),
///     "# a session\n# end\n\n[[effect]]\ncomponent = \"EZC\"\ndriver = \"C\"\nshape = \"harmonic\"\norder = 2\n"
/// );
/// # Ok::<(), abbe_model::Diagnostic>(())
/// ```
#[derive(Clone, Debug)]
pub struct SessionText {
    file: PathBuf,
    /// A remark above everything.
    remark: Option<String>,
    document: DocumentMut,
}

impl std::fmt::Display for SessionText {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(remark) = &self.remark {
            writeln!(formatter, "# {remark}")?;
        }
        self.document.fmt(formatter)
    }
}

impl SessionText {
    /// The text of a file.
    ///
    /// # Errors
    /// If it is not TOML.
    pub fn new(text: &str, file: &Path) -> Result<SessionText, Diagnostic> {
        let document = text.parse().map_err(|fault: toml_edit::TomlError| {
            Diagnostic::input(Location::file(file), format!("not valid TOML: {}", fault.message()), None)
        })?;
        Ok(SessionText { file: file.to_path_buf(), remark: None, document })
    }

    /// The text of a document that no text holds.
    ///
    /// # Errors
    /// If a value has no form in TOML.
    pub fn of_document(document: &impl serde::Serialize, file: &Path) -> Result<SessionText, Diagnostic> {
        Ok(SessionText { file: file.to_path_buf(), remark: None, document: document_of(document)? })
    }

    /// States the machine in place of its file: the tables of a machine file.
    ///
    /// # Errors
    /// If it is not TOML.
    pub fn set_machine(&mut self, text: &str) -> Result<(), Diagnostic> {
        let SessionText { document, .. } = SessionText::new(text, &self.file)?;
        let mut tables = document.into_table();
        // They follow the table that contains them.
        each_table(&mut tables, &mut |table| table.set_position(None));
        self.document.insert("machine", Item::Table(tables));
        Ok(())
    }

    /// Reads the machine from another file; a session with the machine's own tables is unchanged.
    pub fn set_machine_file(&mut self, name: &str) {
        if let Some(file) = value_in(&mut self.document, &["machine", "file"]) {
            replace(file, name);
        }
    }

    /// States a number of the instrument, such as `noise_um`.
    pub fn set_of_instrument(&mut self, key: &str, number: f64) {
        match value_in(&mut self.document, &["instrument", key]) {
            Some(value) => replace(value, number_of(number)),
            None => {
                if let Some(instrument) = self.document.get_mut("instrument").and_then(Place::of) {
                    instrument.insert_after("kind", key, number_of(number));
                }
            }
        }
    }

    /// States the data file of each named test.
    pub fn set_data(&mut self, data: &[(String, String)]) {
        for mut test in tables(&mut self.document, "test") {
            let name = test.table().get("name").and_then(Item::as_str);
            let Some((_, file)) = data.iter().find(|(test, _)| Some(test.as_str()) == name) else { continue };
            match test.table().get_mut("data").and_then(Item::as_value_mut) {
                Some(old) => replace(old, file.as_str()),
                None => test.insert_after("name", "data", file.as_str().into()),
            }
        }
    }

    /// States a key of the named test.
    ///
    /// # Errors
    /// If the value has no form in TOML.
    pub fn set_of_test(&mut self, name: &str, key: &str, value: &impl serde::Serialize) -> Result<(), Diagnostic> {
        let value = value_of(value)?;
        for mut test in tables(&mut self.document, "test") {
            if test.table().get("name").and_then(Item::as_str) == Some(name) {
                match test.table().get_mut(key).and_then(Item::as_value_mut) {
                    Some(old) => replace(old, value.clone()),
                    None => {
                        // A table of its own, `[test.columns]`, gives way to one in a line.
                        test.table().remove(key);
                        test.insert_after("data", key, value.clone());
                    }
                }
            }
        }
        Ok(())
    }

    /// Removes the tests that are not among these, effects that act in no other, and the distances between sockets, which
    /// may name others.
    pub fn keep_tests(&mut self, is_kept: &dyn Fn(&str) -> bool) {
        self.document.remove("socket_distance");
        let name_of = |test: &dyn TableLike| test.get("name").and_then(Item::as_str).map(str::to_string);
        retain(&mut self.document, "test", &|test| name_of(test).is_some_and(|name| is_kept(&name)));
        for mut effect in tables(&mut self.document, "effect") {
            if let Some(Item::Value(Value::Array(tests))) = effect.table().get_mut("tests") {
                tests.retain(|test| test.as_str().is_none_or(is_kept));
            }
        }
        let acts = |effect: &dyn TableLike| match effect.get("tests").and_then(Item::as_array) {
            Some(tests) => !tests.is_empty(),
            None => true,
        };
        retain(&mut self.document, "effect", &acts);
    }

    /// Removes keys of all tests.
    pub fn remove_of_tests(&mut self, keys: &[&str]) {
        for mut test in tables(&mut self.document, "test") {
            keys.iter().for_each(|key| _ = test.table().remove(key));
        }
    }

    /// States a table of the session, such as `[columns]`.
    ///
    /// # Errors
    /// If the value has no form in TOML.
    pub fn set_table(&mut self, name: &str, value: &impl serde::Serialize) -> Result<(), Diagnostic> {
        self.document.insert(name, Item::Table(table_of(value)?));
        Ok(())
    }

    /// Removes tables and lists of tables of these names, of the session and of its tests. Comments above a table stay.
    pub fn remove(&mut self, names: &[&str]) {
        let mut removed: Vec<Item> = Vec::new();
        for name in names {
            removed.extend(self.document.remove(name));
            for mut test in tables(&mut self.document, "test") {
                removed.extend(test.table().remove(name));
            }
        }
        // What is said of the entries of a list goes with them.
        let removed = removed.iter().filter_map(Item::as_table);
        // Later ones first: a comment goes on to the next table that stays, below those that are there already.
        let mut comments: Vec<(isize, &str)> = removed
            .filter_map(|table| Some((table.position()?, table.decor().prefix()?.as_str()?)))
            .filter(|(_, prefix)| prefix.contains('#'))
            .collect();
        comments.sort_unstable_by_key(|(position, _)| std::cmp::Reverse(*position));
        for (position, comment) in comments {
            self.put_after(position, comment);
        }
    }

    /// Adapts the relative names of the machine file and of data files to another folder. Absolute names are unchanged,
    /// and so are names found in `data_directory`, which the reader searches first.
    ///
    /// # Errors
    /// If one of the two folders does not exist.
    pub fn relocate(&mut self, folder: &Path, data_directory: Option<&Path>) -> Result<(), Diagnostic> {
        let own = parent(&self.file).to_path_buf();
        let adapt = |value: &mut Value| {
            let named = PathBuf::from(value.as_str().unwrap_or_default());
            if named.is_relative() {
                replace(value, relative_path(folder, &own.join(named))?);
            }
            Ok::<(), Diagnostic>(())
        };
        if let Some(file) = value_in(&mut self.document, &["machine", "file"]) {
            adapt(file)?;
        }
        for mut test in tables(&mut self.document, "test") {
            let Some(data) = test.table().get_mut("data").and_then(Item::as_value_mut) else { continue };
            let named = data.as_str().unwrap_or_default();
            if !data_directory.is_some_and(|folder| folder.join(named).exists()) {
                adapt(data)?;
            }
        }
        Ok(())
    }

    /// Adds a remark above everything.
    pub fn add_remark(&mut self, remark: &str) {
        self.remark = Some(remark.to_string());
    }

    /// Adds effects at the end.
    ///
    /// # Errors
    /// If the session states its effects as something else than a list of tables.
    pub fn add_effects(&mut self, effects: &[Effect], machine: &Machine) -> Result<(), Diagnostic> {
        effects.iter().try_for_each(|effect| self.add("effect", &of_domain::effect(effect, machine)))
    }

    /// Adds an entry of a list of tables at the end.
    ///
    /// # Errors
    /// As [`SessionText::add_effects`].
    pub fn add(&mut self, list: &str, entry: &impl serde::Serialize) -> Result<(), Diagnostic> {
        self.push(list, table_of(entry)?)
    }

    /// Adds a proposed entry with its remark at the end.
    ///
    /// # Errors
    /// As [`SessionText::add_effects`].
    pub fn add_block(&mut self, block: &Block<impl serde::Serialize>) -> Result<(), Diagnostic> {
        block.table()?.map_or(Ok(()), |table| self.push(block.list, table))
    }

    /// Puts a comment above the first table after a position, or at the end.
    fn put_after(&mut self, position: isize, comment: &str) {
        let mut next = None;
        each_table(self.document.as_table_mut(), &mut |table| {
            next = table.position().filter(|own| *own > position).into_iter().chain(next).min();
        });
        let Some(next) = next else {
            let rest = self.document.trailing().as_str().unwrap_or_default().to_string();
            return self.document.set_trailing(format!("{comment}{rest}"));
        };
        each_table(self.document.as_table_mut(), &mut |table| {
            if table.position() == Some(next) {
                let own = table.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default();
                let prefix = format!("{comment}{own}");
                table.decor_mut().set_prefix(prefix);
            }
        });
    }

    fn push(&mut self, list: &str, mut table: Table) -> Result<(), Diagnostic> {
        // What follows the last table, such as a comment, stays before the new one.
        let mut prefix = self.document.trailing().as_str().unwrap_or_default().to_string();
        self.document.set_trailing("");
        if !self.document.as_table().is_empty() || !prefix.is_empty() {
            prefix.push('\n');
        }
        prefix.push_str(table.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default());
        table.decor_mut().set_prefix(prefix);
        each_table(&mut table, &mut |table| table.set_position(Some(isize::MAX)));
        let place = self.document.entry(list).or_insert_with(|| Item::ArrayOfTables(toml_edit::ArrayOfTables::new()));
        match place {
            Item::ArrayOfTables(tables) => tables.push(table),
            Item::Value(Value::Array(items)) => items.push(table.into_inline_table()),
            _ => {
                return Err(Diagnostic::input(
                    Location::file(&self.file),
                    format!("`{list}` is not a list of tables"),
                    format!("write each entry as its own [[{list}]]"),
                ));
            }
        }
        Ok(())
    }
}

/// Changes a table and those below its own keys.
fn each_table(table: &mut Table, change: &mut impl FnMut(&mut Table)) {
    change(table);
    for (_, item) in table.iter_mut() {
        match item {
            Item::Table(inner) => each_table(inner, change),
            Item::ArrayOfTables(tables) => tables.iter_mut().for_each(|table| each_table(table, change)),
            _ => {}
        }
    }
}

/// A value by its keys.
fn value_in<'d>(document: &'d mut DocumentMut, keys: &[&str]) -> Option<&'d mut Value> {
    let mut item = document.as_item_mut();
    for key in keys {
        item = item.as_table_like_mut()?.get_mut(key)?;
    }
    item.as_value_mut()
}

/// A table under a header or in a line.
enum Place<'d> {
    Header(&'d mut Table),
    Line(&'d mut InlineTable),
}

impl<'d> Place<'d> {
    fn of(item: &'d mut Item) -> Option<Place<'d>> {
        match item {
            Item::Table(table) => Some(Place::Header(table)),
            Item::Value(Value::InlineTable(table)) => Some(Place::Line(table)),
            _ => None,
        }
    }

    fn table(&mut self) -> &mut dyn TableLike {
        match self {
            Place::Header(table) => *table,
            Place::Line(table) => *table,
        }
    }

    /// Inserts a key after another one.
    fn insert_after(mut self, after: &str, key: &str, value: Value) {
        let mut order: Vec<String> = self.table().iter().map(|(key, _)| key.to_string()).collect();
        let place = order.iter().position(|own| own == after).map_or(order.len(), |place| place + 1);
        order.insert(place, key.to_string());
        self.table().insert(key, Item::Value(value));
        let rank = |key: &str| order.iter().position(|own| own == key);
        match self {
            Place::Header(table) => table.sort_values_by(|a, _, b, _| rank(a.get()).cmp(&rank(b.get()))),
            Place::Line(table) => {
                table.sort_values_by(|a, _, b, _| rank(a.get()).cmp(&rank(b.get())));
                table.fmt();
            }
        }
    }
}

/// The tables of a list.
fn tables<'d>(document: &'d mut DocumentMut, list: &str) -> Vec<Place<'d>> {
    match document.get_mut(list) {
        Some(Item::ArrayOfTables(tables)) => tables.iter_mut().map(Place::Header).collect(),
        Some(Item::Value(Value::Array(items))) => {
            items.iter_mut().filter_map(Value::as_inline_table_mut).map(Place::Line).collect()
        }
        _ => Vec::new(),
    }
}

/// Keeps some tables of a list.
fn retain(document: &mut DocumentMut, list: &str, is_kept: &dyn Fn(&dyn TableLike) -> bool) {
    match document.get_mut(list) {
        Some(Item::ArrayOfTables(tables)) => tables.retain(|table| is_kept(table)),
        Some(Item::Value(Value::Array(items))) => {
            items.retain(|item| item.as_inline_table().is_some_and(|table| is_kept(table)));
        }
        _ => {}
    }
}

/// Replaces a value; the space and the comment around it stay.
fn replace(value: &mut Value, new: impl Into<Value>) {
    let decor = value.decor().clone();
    *value = new.into();
    *value.decor_mut() = decor;
}

/// The folder of a file.
fn parent(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The name of a file relative to a folder; the absolute name if they share only the root.
fn relative_path(folder: &Path, file: &Path) -> Result<String, Diagnostic> {
    let whole = |path: &Path| {
        path.canonicalize()
            .map_err(|cause| Diagnostic::session(format!("cannot be written: {cause}"), None).at(Location::file(path)))
    };
    let (from, to) = (whole(folder)?, whole(parent(file))?);
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let name = file.file_name().unwrap_or_default();
    if shared <= 1 {
        return Ok(to.join(name).display().to_string());
    }
    let up = from.components().skip(shared).map(|_| "..".into());
    let down = to.components().skip(shared).map(|part| part.as_os_str().to_string_lossy());
    let parts: Vec<_> = up.chain(down).chain([name.to_string_lossy()]).collect();
    Ok(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SESSION: &str =
        "[machine]\nfile = \"../machine.toml\" # ours\n\n[instrument]\nkind = \"ballbar\"   # Renishaw\n";

    fn edited(text: &str, edit: impl FnOnce(&mut SessionText)) -> String {
        let mut text = SessionText::new(text, Path::new("session.toml")).unwrap();
        edit(&mut text);
        text.to_string()
    }

    #[test]
    fn other_text_is_unchanged() {
        let text = edited(SESSION, |text| text.set_machine_file("machine.toml"));
        assert_eq!(text, SESSION.replace("../machine.toml", "machine.toml"));
        let text = edited(SESSION, |text| text.set_of_instrument("noise_um", 0.25));
        assert_eq!(text, SESSION.replace("# Renishaw\n", "# Renishaw\nnoise_um = 0.25\n"));
        let text = edited(&text, |text| text.set_of_instrument("noise_um", 0.0));
        assert!(text.ends_with("\nnoise_um = 0\n"), "{text}");
        let inline = edited("instrument = { kind = \"ballbar\" }\n", |text| text.set_of_instrument("noise_um", 1.5));
        assert_eq!(inline, "instrument = { kind = \"ballbar\", noise_um = 1.5 }\n");
    }

    #[test]
    fn file_names_are_adapted_to_another_folder() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        for folder in ["ours/data", "ours/elsewhere", "theirs/next"] {
            std::fs::create_dir_all(at(folder)).unwrap();
        }
        std::fs::write(at("ours/elsewhere/b.csv"), "").unwrap();
        let session = "[machine]\nfile = \"../machine.toml\" # ours\n\n[[test]]\nname = \"A\"\ndata = \"data/a.csv\"\n\n\
                       [[test]]\nname = \"B\"\ndata = \"b.csv\"\n\n[[test]]\nname = \"C\"\ndata = \"/c.csv\"\n";
        let elsewhere = at("ours/elsewhere");
        let relocated_to = |folder: &str| {
            let mut text = SessionText::new(session, &at("ours/session.toml")).unwrap();
            text.relocate(&at(folder), Some(&elsewhere)).unwrap();
            text.to_string()
        };
        let there =
            session.replace("../machine.toml", "../../machine.toml").replace("data/a.csv", "../../ours/data/a.csv");
        assert_eq!(relocated_to("theirs/next"), there);
        assert_eq!(relocated_to("ours"), session);
        assert_eq!(relocated_to("ours/data"), session.replace("../", "../../").replace("data/a", "a"));
    }

    #[test]
    fn layouts_go_from_the_session_and_from_its_tests() {
        let text = "# head\n[format]\nheader = false\n\n[[test]] # first\nname = \"A\"\ncolumns = { x_mm = 1 }\n\
                    [test.format]\nheader = true\n# end\n";
        let kept = edited(text, |text| text.remove(&["format", "columns"]));
        assert_eq!(kept, "# head\n\n[[test]] # first\nname = \"A\"\n# end\n");
        let text = "# a\n[format]\n\n# b\n[columns]\n\n# c\n[[test]]\n# d\n[test.format]\n";
        let kept = edited(text, |text| text.remove(&["format", "columns"]));
        assert_eq!(kept, "# a\n\n# b\n\n# c\n[[test]]\n# d\n");
    }

    #[test]
    fn the_tables_of_a_machine_stand_in_place_of_its_file() {
        let machine = "# ours\nchain = \"w X b Y t\" # two axes\n\n[axis.X]\ntravel_mm = [0, 1]\n";
        let text = edited(SESSION, |text| text.set_machine(machine).unwrap());
        let expected =
            "[machine]\n# ours\nchain = \"w X b Y t\" # two axes\n\n[machine.axis.X]\ntravel_mm = [0, 1]\n\n";
        assert_eq!(text, format!("{expected}{}", &SESSION[SESSION.find("[instrument]").unwrap()..]));
    }

    #[test]
    fn tests_are_left_out_of_a_line_as_of_tables() {
        let inline = "test = [{ name = \"A\" }, { name = \"B\" }]\n";
        let tables = "[[test]]\nname = \"A\"\n[[test]]\nname = \"B\"\n";
        for text in [inline, tables] {
            let kept = edited(text, |text| text.keep_tests(&|name| name == "B"));
            assert!(kept.contains("\"B\"") && !kept.contains("\"A\""), "{kept}");
        }
    }
}
