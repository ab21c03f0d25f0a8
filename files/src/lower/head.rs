//! What a session states before its tests: notes, constants, instrument, the errors to estimate; and the distances of
//! sockets.

use abbe_model::chain::Machine;
use abbe_model::component::ErrorName;
use abbe_model::document::fault::{Fault, Within};
use abbe_model::document::from_node;
use abbe_model::document::node::{Entries, Named, Node, Value};
use abbe_model::document::session as document;
use abbe_model::document::value::{NotNegative, Note};
use abbe_model::instrument::{InstrumentKind, SharedBy};
use abbe_model::pattern;
use abbe_model::session::expression::Constant;
use abbe_model::session::{SocketDistance, Test, limits};
use abbe_model::unit::{MM_PER_UM, Unit};
use abbe_model::words::with_article;

use crate::axes;

/// Notes that reports repeat.
pub(super) fn about(notes: &Named<Note>) -> Result<Vec<(String, String)>, Fault> {
    let note = |(key, Note(text)): &(String, Note)| {
        if key.chars().any(char::is_control) || key.trim().is_empty() {
            let help = "use names such as `serial_number`, `operator`, `date`, `comment`";
            let message = "a note of [about] has a name that cannot be displayed";
            return Err(Fault::new(message, help).on_key().at(key));
        }
        Ok((key.clone(), text.clone()))
    };
    notes.0.iter().map(note).collect()
}

/// The constants, in the order of the file. Without `means`, the comment behind the value is its meaning.
pub(super) fn constants(entries: &Entries, comment: impl Fn(&str) -> Option<String>) -> Result<Vec<Constant>, Fault> {
    let constant = |(name, node): &(String, _)| {
        let node: &Node = node;
        let mut letters = name.chars();
        let valid = letters.next().is_some_and(|c| c.is_alphabetic() || c == '_')
            && letters.all(|c| c.is_alphanumeric() || c == '_')
            && name != "sqrt";
        if !valid {
            let help = "a name is a letter followed by letters, digits and `_`; `sqrt` is reserved";
            let message = format!("a constant cannot have the name `{name}`");
            return Err(Fault::new(message, help).on_key().at(name));
        }
        if !matches!(node.value, Value::Table(_)) {
            return Ok(Constant { name: name.clone(), mm: from_node(node).within(name)?, means: comment(name) });
        }
        let document::Constant { mm, means } = from_node(node).within(name)?;
        let means = match means {
            Some(text) => Some(text.trim().to_string()).filter(|text| !text.is_empty()),
            None => comment(name),
        };
        Ok(Constant { name: name.clone(), mm, means })
    };
    entries.0.iter().map(constant).collect()
}

/// The noise of lengths and of angles, then their resolutions, mm and rad.
pub(super) fn noise(document: &document::Instrument) -> Result<[Option<f64>; 4], Fault> {
    let internal = |stated: Option<NotNegative>, unit: Unit, key: &str| {
        let checked = |NotNegative(number)| limits::too_small_um(number).map_or(Ok(unit.to_internal(number)), Err);
        stated.map(checked).transpose().within(key)
    };
    let is_stepped = |step: &f64| *step > 0.0;
    Ok([
        internal(document.noise_um, Unit::Micrometre, "noise_um")?,
        internal(document.noise_arcsec, Unit::Arcsecond, "noise_arcsec")?,
        internal(document.resolution_um, Unit::Micrometre, "resolution_um")?.filter(is_stepped),
        internal(document.resolution_arcsec, Unit::Arcsecond, "resolution_arcsec")?.filter(is_stepped),
    ])
}

/// The errors to be estimated: those stated, or the defaults of the instrument.
pub(super) fn unknowns(
    machine: &Machine,
    kind: InstrumentKind,
    document: &document::Unknowns,
) -> Result<Vec<ErrorName>, Fault> {
    let Some(errors) = &document.errors else {
        return Ok(kind.default_errors(machine));
    };
    let mut unknowns: Vec<ErrorName> = Vec::new();
    // A pattern may include errors that are named already; each error is estimated once.
    let mut by_pattern: Vec<ErrorName> = Vec::new();
    for (item, text) in errors.iter().enumerate() {
        if pattern::is_pattern(text) {
            by_pattern.extend(matching(machine, text).within_item(item)?);
            for name in &by_pattern {
                if !unknowns.contains(name) {
                    unknowns.push(name.clone());
                }
            }
            continue;
        }
        let name = error_name(machine, text).within_item(item)?;
        if by_pattern.contains(&name) {
            continue;
        }
        if unknowns.contains(&name) {
            return Err(Fault::new(format!("`{name}` occurs twice in `errors`"), None).at_item(item));
        }
        unknowns.push(name);
    }
    Ok(unknowns)
}

/// The errors that a pattern matches.
fn matching(machine: &Machine, text: &str) -> Result<Vec<ErrorName>, Fault> {
    let found = pattern::matching(machine, text);
    if found.is_empty() {
        let axes: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
        let help = format!(
            "`?` matches one character and `*` any number of them: \"E?0C\" for the location errors of C, \"E?0J*\" for those of all joints; the axes are {}",
            axes.join(", ")
        );
        return Err(Fault::new(format!("\"{text}\" matches no error of the machine"), help));
    }
    Ok(found)
}

/// An error of the machine by its name.
fn error_name(machine: &Machine, text: &str) -> Result<ErrorName, Fault> {
    let Some(mut name) = ErrorName::parse(text) else {
        let help = "ISO 230-1 names such as \"EY0A\" (location) and \"EYA\" (motion), or `e_y0a`, `θ_z0c`";
        return Err(Fault::new(format!("\"{text}\" is not the name of an error"), help));
    };
    let index = axes::axis(machine, &name.axis)
        .map_err(|(message, help)| Fault::new(format!("\"{text}\": {message}"), help))?;
    name.axis.clone_from(&machine.axes[index].name);
    Ok(name)
}

/// Sockets at known distances; `read` says whether all sockets are known.
pub(super) fn socket_distances(
    kind: InstrumentKind,
    tests: &[Test],
    documents: &[Node],
    read: bool,
) -> Result<Vec<SocketDistance>, Fault> {
    if !documents.is_empty() && !kind.shares(SharedBy::Socket) {
        let message = format!("[[socket_distance]] in a session whose instrument is {}", with_article(kind.word()));
        return Err(Fault::new(message, None).on_key());
    }
    let distance = |node: &Node| {
        // Another instrument has no such table, whatever is in it.
        let document: document::SocketDistance = from_node(node)?;
        for (item, socket) in document.between.iter().enumerate() {
            // Sockets named by a column are known after the data are read.
            if read && !tests.iter().any(|test| test.socket.as_ref() == Some(socket)) {
                let mut known: Vec<&str> = tests.iter().filter_map(|test| test.socket.as_deref()).collect();
                known.dedup();
                let help = format!("sockets here: {}", known.join(", "));
                let message = format!("no test has the socket \"{socket}\"");
                return Err(Fault::new(message, help).at_item(item).at("between"));
            }
        }
        let between = <[String; 2]>::try_from(document.between)
            .map_err(|_| Fault::of_key("needs two sockets", None).at("between"))?;
        if between[0] == between[1] {
            return Err(Fault::of_key("needs two different sockets", None).at("between"));
        }
        let u_um = document.u_um.unwrap_or_default().0;
        Ok(SocketDistance { between, distance_mm: document.mm.0, u_mm: u_um * MM_PER_UM })
    };
    documents.iter().enumerate().map(|(item, document)| distance(document).within_item(item)).collect()
}
