//! The command lines that a report proposes.

use std::path::Path;

/// The session file that proposed commands write.
const NEXT: &str = "next.toml";

/// How command lines name the session of a report: `abbe plan session.toml --improve`.
#[derive(Clone, Debug)]
pub struct Commands {
    /// The session file and the options that reading it needs.
    session: String,
}

impl Default for Commands {
    fn default() -> Commands {
        Commands { session: "SESSION".to_string() }
    }
}

impl Commands {
    /// Of a session file, the folder of its data if it is stated, and whether it may read files outside its folder.
    pub fn of(session: &Path, data: Option<&Path>, allow_outside: bool) -> Commands {
        let quoted = |path: &Path| {
            let path = path.display().to_string();
            if path.contains(char::is_whitespace) { format!("\"{path}\"") } else { path }
        };
        let data = data.map_or(String::new(), |data| format!(" --data {}", quoted(data)));
        let outside = if allow_outside { " --allow-outside" } else { "" };
        Commands { session: format!("{}{data}{outside}", quoted(session)) }
    }

    /// The session file that a proposed command writes: another one for a session of this name.
    pub fn next_session(&self) -> &'static str {
        let file = self.session.split_whitespace().next().unwrap_or_default().trim_matches('"');
        let is_next = Path::new(file).file_name().is_some_and(|name| name == NEXT);
        if is_next { "after-next.toml" } else { NEXT }
    }

    /// A command on the session.
    pub fn command(&self, verb: &str, options: &str) -> String {
        format!("abbe {verb} {} {options}", self.session).trim_end().to_string()
    }
}
