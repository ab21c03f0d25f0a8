//! The command lines that a report proposes.

use std::path::Path;

use super::provenance::quoted;

/// The session file that proposed commands write.
const NEXT: &str = "next.toml";

/// How command lines name the session of a report: `abbe plan session.toml --improve`.
#[derive(Clone, Debug)]
pub struct Commands {
    /// The session file and the options that reading it needs, quoted for a shell.
    session: String,
    /// The session file that a proposed command writes.
    next: &'static str,
}

impl Default for Commands {
    fn default() -> Commands {
        Commands { session: "SESSION".to_string(), next: NEXT }
    }
}

impl Commands {
    /// Of a session file, the folder of its data if it is stated, and whether it may read files outside its folder.
    pub fn of(session: &Path, data: Option<&Path>, allow_outside: bool) -> Commands {
        let quoted = |path: &Path| quoted(path.display().to_string());
        let data = data.map_or(String::new(), |data| format!(" --data {}", quoted(data)));
        let outside = if allow_outside { " --allow-outside" } else { "" };
        let is_next = session.file_name().is_some_and(|name| name == NEXT);
        let next = if is_next { "after-next.toml" } else { NEXT };
        Commands { session: format!("{}{data}{outside}", quoted(session)), next }
    }

    /// The session file that a proposed command writes: another one for a session of this name.
    pub fn next_session(&self) -> &'static str {
        self.next
    }

    /// A command on the session.
    pub fn command(&self, verb: &str, options: &str) -> String {
        format!("abbe {verb} {} {options}", self.session).trim_end().to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn proposed_commands_are_quoted_and_write_another_session() {
        let commands = Commands::of(Path::new("my session/a$b.toml"), Some(Path::new("d")), true);
        assert_eq!(commands.command("plan", ""), "abbe plan 'my session/a$b.toml' --data d --allow-outside");
        assert_eq!(commands.next_session(), "next.toml");
        let next = Commands::of(Path::new("my session/next.toml"), None, false);
        assert_eq!(next.next_session(), "after-next.toml");
    }
}
