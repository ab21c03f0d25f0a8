//! Messages on standard error with a coloured prefix: `error:`, `warning:`, `note:`, `help:`.
//!
//! Pipes, files and terminals with `NO_COLOR` get no colour. `CLICOLOR_FORCE` enables colour everywhere.

use std::io::Write;

use abbe::model::words::{MAX_QUOTED, cut, shortened};
use clap::builder::styling::{AnsiColor, Style};
use clap::error::ContextValue;
use indicatif::{ProgressBar, ProgressStyle};

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

/// Writes a message, with what it quotes of the input cut to a readable length. An error of standard error itself is ignored.
pub fn tell(kind: Kind, text: &str) {
    let style = kind.style();
    let word = kind.word();
    let _ = writeln!(anstream::stderr(), "{style}{word}:{style:#} {}", visible(&shortened(text)));
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

/// Writes the message of a wrong command line, with the quoted arguments cut to a readable length.
pub fn print_usage(mut error: clap::Error) {
    let quoted: Vec<_> = error.context().map(|(kind, value)| (kind, value.clone())).collect();
    for (kind, value) in quoted {
        let short = |text: String| cut(&text, MAX_QUOTED).into_owned();
        let value = match value {
            ContextValue::String(text) => ContextValue::String(short(text)),
            ContextValue::Strings(texts) => ContextValue::Strings(texts.into_iter().map(short).collect()),
            other => other,
        };
        error.insert(kind, value);
    }
    let _ = write!(anstream::stderr(), "{}", shortened(&error.render().ansi().to_string()));
}

/// A bar of the progress of many units, `sessions`; none if `quiet`.
pub fn progress_bar(count: usize, units: &str, quiet: bool) -> ProgressBar {
    let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(count as u64) };
    if let Ok(style) = ProgressStyle::with_template(&format!("{{bar:40}} {{pos}} of {{len}} {units}, {{eta}} left")) {
        bar.set_style(style);
    }
    bar
}
