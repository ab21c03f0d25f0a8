//! Messages on standard error with a coloured prefix: `error:`, `warning:`, `note:`, `help:`.
//!
//! Pipes, files and terminals with `NO_COLOR` get no colour. `CLICOLOR_FORCE` enables colour everywhere.

use std::io::Write;

use clap::builder::styling::{AnsiColor, Style};

/// The kind of a message.
#[derive(Clone, Copy)]
pub enum Kind {
    /// The command fails.
    Error,
    /// The command succeeds, but the result may be misleading.
    Warning,
    /// Further information.
    Note,
    /// What to do about an error.
    Help,
}

impl Kind {
    fn word(self) -> &'static str {
        match self {
            Kind::Error => "error",
            Kind::Warning => "warning",
            Kind::Note => "note",
            Kind::Help => "help",
        }
    }

    /// The colours of the messages of clap.
    fn style(self) -> Style {
        let colour = match self {
            Kind::Error => AnsiColor::Red,
            Kind::Warning => AnsiColor::Yellow,
            Kind::Note => AnsiColor::Cyan,
            Kind::Help => AnsiColor::Green,
        };
        colour.on_default().bold()
    }
}

/// Writes a message. An error of standard error itself is ignored.
pub fn tell(kind: Kind, text: &str) {
    let style = kind.style();
    let word = kind.word();
    let _ = writeln!(anstream::stderr(), "{style}{word}:{style:#} {}", visible(text));
}

/// Writes lines unchanged, without their colours where colours are disabled.
pub fn lines(text: &[u8]) {
    let _ = anstream::stderr().write_all(text);
}

/// The text without control characters. Each byte of a control character becomes `?`, so that byte positions stay.
pub fn visible(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if c == '\r' {
            shown.push(' ');
        } else if c.is_control() && !matches!(c, '\n' | '\t') {
            shown.extend(std::iter::repeat_n('?', c.len_utf8()));
        } else {
            shown.push(c);
        }
    }
    shown
}

/// Writes warnings to standard error.
pub fn print_warnings(warnings: &[String]) {
    for warning in warnings {
        tell(Kind::Warning, warning);
    }
}
