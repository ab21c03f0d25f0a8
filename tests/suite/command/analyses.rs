//! An analysis that is called by its name, with its options as JSON, is that of the command.

use abbe::analysis::{self, Analysed, Given};
use abbe::document::Origin;
use abbe::files::{ReadOptions, session_with_sources};
use abbe::model::Diagnostic;
use abbe::model::session::Session;

use crate::suite::{abbe, ready, text};

fn run(name: &str, session: &Session, options: &str) -> Result<Analysed, Diagnostic> {
    analysis::run(name, &[Given::Session(session)], options, 1, &|_| true)
}

#[test]
fn documents_are_those_of_the_command() {
    for (name, file, options, words) in [
        ("plan", "chapter5.toml", r#"{"no_effects": true, "noise_um": 0.5}"#, "--noise-um 0.5 --no-effects"),
        ("fit", "measured/session.toml", r#"{"allow_implausible": true, "assume": []}"#, "--allow-implausible"),
    ] {
        let file = ready("hermle-c600u").join(file);
        let (session, sources) = session_with_sources(&file, &ReadOptions::default()).unwrap();
        let found = run(name, &session, options).unwrap();
        let words: Vec<&str> = words.split(' ').collect();
        let said = abbe(&[&[name, text(&file), "--json", "-"], &words[..]].concat());
        assert_eq!(found.document(Origin::of_session(&sources)).unwrap(), String::from_utf8(said.stdout).unwrap());
        assert_eq!(found.found.fits().len(), usize::from(name == "fit"));
    }
}

#[test]
fn what_cannot_be_analysed_is_refused_with_its_name() {
    let session = abbe::files::session(&ready("hermle-c600u/chapter5.toml"), &ReadOptions::default()).unwrap();
    for (name, options, expected) in [
        ("count", "{}", "there is no analysis `count`"),
        ("plan", r#"{"noise": 1}"#, "an option of `plan` cannot be used: unknown field `noise`"),
        ("plan", r#"{"noise_um": 0}"#, "`noise_um` is 0; a number of µm from 1e-6 to 1e12 is expected"),
        ("trace", r#"{"time_limit": -1}"#, "`time_limit` is -1"),
        ("trace", r#"{"max_effect": 1}"#, "an option of `trace` cannot be used: unknown field `max_effect`"),
        ("validate", "{}", "a model and a session are expected"),
        ("compare", r#"{"names": ["a"]}"#, "at least two inputs, each with its name, are expected"),
    ] {
        let fault = run(name, &session, options).map(|_| ()).unwrap_err().to_string();
        assert!(fault.starts_with(expected), "{name}: {fault}");
    }
}
