//! Messages on standard error in one form, `error:`, `warning:`, `note:`, `help:`, in colour on a terminal.
//!
//! Pipes and files get no colour, nor does a terminal where `NO_COLOR` is set; `CLICOLOR_FORCE` asks for it elsewhere.

use std::io::Write;

use clap::builder::styling::{AnsiColor, Style};

/// What a message is.
#[derive(Clone, Copy)]
pub enum Kind {
    /// The work cannot be done.
    Error,
    /// The work is done; the result may not be what it seems.
    Warning,
    /// What else is useful to know.
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

    /// The same colours as the messages of the command line's parser.
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

/// Writes a message. If standard error cannot be written to, there is nobody to tell.
pub fn tell(kind: Kind, text: &str) {
    let style = kind.style();
    let word = kind.word();
    let _ = writeln!(anstream::stderr(), "{style}{word}:{style:#} {}", visible(text));
}

/// Writes lines as they are; colours in them are taken out where none are wanted.
pub fn lines(text: &[u8]) {
    let _ = anstream::stderr().write_all(text);
}

/// The text without what would steer a terminal: of a control character `?` is shown, one for each of its bytes, so that places stay.
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
