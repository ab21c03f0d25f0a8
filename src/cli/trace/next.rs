//! `abbe trace --next FOLDER`: what the search proposes to measure next, as a session of its own with programs and sheet.

use std::path::{Path, PathBuf};

use abbe::codegen::nc::Control;
use abbe::files::{self, ReadOptions, SourceMap};
use abbe::model::Diagnostic;
use abbe::model::document::edit::SessionText;
use abbe::model::effect::Effect;
use abbe::model::session::Session;
use abbe::trace::TraceOutcome;
use clap::Args;

use crate::cli::message::{Kind, tell};
use crate::cli::nc::motion;
use crate::cli::next_session::proposals;
use crate::cli::{again, folder};

/// The next measurement.
#[derive(Args)]
pub struct NextArguments {
    /// Write what to measure next into a new folder: a session that holds only the tests that separate the found effects
    /// from their aliases, their NC programs and their set-up sheets.
    ///
    /// Example: --next next --control siemens
    #[arg(long, value_name = "DIR")]
    next: Option<PathBuf>,
    /// The control of the NC programs: they are written beside the session.
    ///
    /// Example: --next next --control fanuc
    #[arg(long, value_name = "CONTROL", value_parser = motion::controls(), requires = "next")]
    control: Option<&'static dyn Control>,
}

/// The name of the session in the folder.
const SESSION: &str = "session.toml";
/// The folder of the programs in it.
const PROGRAMS: &str = "programs";
/// The sheets in it.
const SHEETS: &str = "sheets.html";

impl NextArguments {
    /// Refuses a folder that cannot be written before the search.
    pub fn check(&self, force: bool) -> Result<(), Diagnostic> {
        self.next.as_ref().map_or(Ok(()), |folder| folder::check(folder, force).map(|_| ()))
    }

    /// Writes the folder, if it is asked for.
    pub fn run(
        &self,
        session: &Session,
        sources: &SourceMap,
        trace: &TraceOutcome,
        (quiet, force): (bool, bool),
    ) -> Result<(), Diagnostic> {
        let Some(out) = &self.next else { return Ok(()) };
        let proposed = proposals(&trace.result);
        if proposed.is_empty() {
            tell(Kind::Note, "the search proposes no further test: nothing is written");
            return Ok(());
        }
        let mut text = sources.text.clone();
        // What was measured stays where it is.
        text.remove(&["test", "socket_distance", "format", "columns", "effect"]);
        let of_all = |effect: &&Effect| effect.tests.is_empty();
        let effects: Vec<Effect> = session.effects.iter().chain(&trace.effects).filter(of_all).cloned().collect();
        text.add_effects(&effects, &session.machine)?;
        proposed.into_iter().try_for_each(|block| text.add_block(block))?;
        folder::write(out, &files_of(text, sources)?, force, |made| {
            files::session(&made.join(SESSION), &ReadOptions { read_data: false, ..ReadOptions::default() })?;
            self.documents(made)
        })?;
        if !quiet {
            let at = |name: &str| out.join(name).display().to_string();
            say!("{}: the tests to measure next", at(SESSION));
            if let Some(control) = self.control {
                say!("{}: their programs for {}", at(PROGRAMS), control.word());
            }
            say!("{}: their set-up sheets", at(SHEETS));
        }
        Ok(())
    }

    /// The programs and the sheets of the session in a folder that is not in its place yet.
    fn documents(&self, made: &Path) -> Result<(), Diagnostic> {
        let [session, programs, sheets] = [SESSION, PROGRAMS, SHEETS].map(|name| made.join(name).display().to_string());
        let control: Vec<&str> = self.control.iter().flat_map(|control| ["--control", control.word()]).collect();
        if !control.is_empty() {
            again(&[&["nc", &session, "--out", &programs], &control[..]].concat(), true)?;
        }
        again(&[&["sheet", &session, "--out", &sheets], &control[..]].concat(), true)
    }
}

/// The session with its machine and the bodies of it.
fn files_of(mut text: SessionText, sources: &SourceMap) -> Result<Vec<(String, Vec<u8>)>, Diagnostic> {
    let mut files = Vec::new();
    if let Some(machine) = &sources.machine_text {
        files.push(("machine.toml".to_string(), machine.clone().into_bytes()));
        text.set_machine_file("machine.toml");
    }
    files.extend(sources.bodies.iter().map(|body| (body.name.clone(), body.contents.to_vec())));
    files.push((SESSION.to_string(), text.to_string().into_bytes()));
    Ok(files)
}
