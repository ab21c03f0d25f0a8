//! The command lines that a report proposes.
//!
//! What they write stands beside the session, so that its machine and its data are found. One name has one meaning: the
//! session with a further test, the session with the found effects, the folder of the next measurement.

use std::path::Path;

use serde_json::{Map, Value};

use super::provenance::quoted;

/// The session with a proposed test, which a proposed command writes.
pub const NEXT: &str = "next.toml";
/// The session with the found effects.
pub const TRACED: &str = "traced.toml";
/// The model with the found effects.
pub const TRACED_MODEL: &str = "traced-model.json";
/// The folder of what a trace proposes to measure.
pub const MEASURE: &str = "measure-next";
/// The folder of the NC programs of [`NEXT`].
pub const PROGRAMS: &str = "programs";
/// The folder of simulated readings.
pub const SIMULATED: &str = "run1";

/// The options of a plan that change the set-up of the file.
pub const OF_SET_UP: [&str; 2] = ["--setup-um", "--one-spindle-ball"];

/// How command lines name the session of a report: `abbe plan session.toml --improve`.
#[derive(Clone, Debug, Default)]
pub struct Commands {
    /// The session file; empty if it has no name.
    session: String,
    /// The options that reading it needs, quoted for a shell, each after a space.
    reading: String,
    /// The command that made the report, and its options on which the result depends.
    made_by: (&'static str, String),
    /// Whether a trace has found effects, which a plan needs.
    has_effects: bool,
}

impl Commands {
    /// Of a session file, the folder of its data if it is stated, and whether it may read files outside its folder.
    pub fn of(session: &Path, data: Option<&Path>, allow_outside: bool) -> Commands {
        let data = data.map_or(String::new(), |data| format!(" --data {}", quoted(data.display().to_string())));
        let outside = if allow_outside { " --allow-outside" } else { "" };
        let reading = format!("{data}{outside}");
        Commands { session: session.display().to_string(), reading, ..Commands::default() }
    }

    /// The same for another session, which is read with the same options.
    pub fn for_session(&self, session: &Path) -> Commands {
        Commands { session: session.display().to_string(), ..self.clone() }
    }

    /// The same for the report of a command with these options, by their long names, on which its result depends: its name
    /// in a proposed command has them too.
    pub fn made_by(self, verb: &'static str, options: &Map<String, Value>) -> Commands {
        let written = |(name, value): (&String, &Value)| {
            let option = format!(" --{}", name.replace('_', "-"));
            let one = |value: &Value| match value {
                Value::String(text) => format!("{option} {}", quoted(text.clone())),
                Value::Number(number) if !number.is_f64() => format!("{option} {number}"),
                // Without the zero after the point.
                Value::Number(number) => format!("{option} {}", number.as_f64().unwrap_or_default()),
                _ => option.clone(),
            };
            value.as_array().map_or_else(|| one(value), |several| several.iter().map(one).collect())
        };
        Commands { made_by: (verb, options.iter().map(written).collect()), ..self }
    }

    /// The same after a trace that has found effects.
    pub fn with_effects(self, has_effects: bool) -> Commands {
        Commands { has_effects, ..self }
    }

    /// A plan of what is known of the session: with the effects that a trace has found, of [`TRACED`].
    pub fn plan(&self, options: &str) -> String {
        if self.has_effects { self.on(TRACED, "plan", options) } else { self.command("plan", options) }
    }

    /// Whether a proposed plan may write a session: not with a set-up that is not that of the file.
    pub fn plan_writes(&self) -> bool {
        let is_overridden = OF_SET_UP.iter().any(|option| self.made_by.1.contains(option));
        self.made_by.0 != "plan" || !is_overridden
    }

    /// The command that writes [`TRACED`], if a trace has found effects.
    pub fn declare_effects(&self) -> Option<String> {
        self.has_effects.then(|| self.command("trace", &format!("--write {}", self.beside(TRACED))))
    }

    /// A command on the session.
    pub fn command(&self, verb: &str, options: &str) -> String {
        let session = if self.session.is_empty() { "SESSION".to_string() } else { quoted(self.session.clone()) };
        let own = if self.made_by.0 == verb { self.made_by.1.as_str() } else { "" };
        format!("abbe {verb} {session}{}{own} {options}", self.reading).trim_end().to_string()
    }

    /// A file or folder beside the session: another one for a session of this name, and a new one for a folder that exists.
    pub fn beside(&self, name: &str) -> String {
        let session = Path::new(&self.session);
        let is_session = session.file_name().is_some_and(|own| own == name);
        let name = if is_session { format!("after-{name}") } else { name.to_string() };
        let mut place = session.with_file_name(&name);
        let mut number = 2;
        while place.extension().is_none() && place.exists() {
            place.set_file_name(format!("{}{number}", name.trim_end_matches(|digit: char| digit.is_ascii_digit())));
            number += 1;
        }
        quoted(place.display().to_string())
    }

    /// A command on a session that a proposed command writes.
    pub fn on(&self, written: &str, verb: &str, options: &str) -> String {
        format!("abbe {verb} {}{} {options}", self.beside(written), self.reading).trim_end().to_string()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn proposed_commands_are_quoted_and_write_beside_the_session() {
        let commands = Commands::of(Path::new("my session/a$b.toml"), Some(Path::new("d")), true);
        assert_eq!(commands.command("plan", ""), "abbe plan 'my session/a$b.toml' --data d --allow-outside");
        assert_eq!(commands.beside(NEXT), "'my session/next.toml'");
        assert_eq!(commands.on(NEXT, "fit", "--all"), "abbe fit 'my session/next.toml' --data d --allow-outside --all");
        let next = Commands::of(Path::new("mill/next.toml"), None, false);
        assert_eq!([NEXT, TRACED].map(|name| next.beside(name)), ["mill/after-next.toml", "mill/traced.toml"]);
        let unnamed = Commands::default();
        assert_eq!(
            (unnamed.command("trace", ""), unnamed.beside(NEXT)),
            ("abbe trace SESSION".into(), "next.toml".into())
        );
    }

    /// A folder of a first round stays: the second round has another one.
    #[test]
    fn a_folder_that_exists_is_not_proposed_again() {
        let folder = tempfile::tempdir().unwrap();
        let commands = Commands::of(&folder.path().join("s.toml"), None, false);
        let beside = |name: &str| commands.beside(name);
        let place = |name: &str| folder.path().join(name);
        assert_eq!(beside(SIMULATED), quoted(place("run1").display().to_string()));
        for name in ["run1", "run2", "programs"] {
            std::fs::create_dir(place(name)).unwrap();
        }
        assert_eq!(beside(SIMULATED), quoted(place("run3").display().to_string()));
        assert_eq!(beside(PROGRAMS), quoted(place("programs2").display().to_string()));
    }

    /// A plan with another set-up than the file's writes no session.
    #[test]
    fn a_plan_of_another_set_up_is_proposed_with_it() {
        let options = json!({"setup_um": 1.0});
        let commands = Commands::of(Path::new("s.toml"), None, false).made_by("plan", options.as_object().unwrap());
        assert_eq!(commands.command("plan", "--improve"), "abbe plan s.toml --setup-um 1 --improve");
        assert!(!commands.plan_writes() && Commands::default().plan_writes());
    }

    /// A command proposes itself with the options on which its result depends, and others without them.
    #[test]
    fn options_of_the_result_stay() {
        let options = json!({"only": ["EZC~C:h2.5 x", "EAC"], "max_effects": 2, "noise_um": 1.0, "planned": true});
        let commands = Commands::of(Path::new("s.toml"), None, false).made_by("trace", options.as_object().unwrap());
        let expected =
            "abbe trace s.toml --only 'EZC~C:h2.5 x' --only EAC --max-effects 2 --noise-um 1 --planned --all";
        assert_eq!(commands.command("trace", "--all"), expected);
        assert_eq!(commands.command("plan", "--improve"), "abbe plan s.toml --improve");
    }
}
