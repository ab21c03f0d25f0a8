//! `abbe fit SESSION --repeat …`: Type A evaluation over repeated sessions beside the Type B evaluation of each fit.

use std::path::{Path, PathBuf};

use abbe::identify::repeated::{self, Repeated};
use abbe::model::words::counted;

use super::failure::Failure;
use super::json::{self, Origin};
use super::output::{self, Outputs};
use super::{CommonArguments, SessionArguments, message, read_session};
use crate::report::repeated as present;

/// Fits each session separately and compares the fits.
pub fn run(
    first: &SessionArguments,
    repeat: &[PathBuf],
    common: &CommonArguments,
    outputs: &Outputs,
) -> Result<(), Failure> {
    let all: Vec<&Path> = std::iter::once(&first.session).chain(repeat).map(PathBuf::as_path).collect();
    let mut sessions = Vec::with_capacity(all.len());
    let mut origin = Origin::default();
    for (place, path) in all.iter().enumerate() {
        let twice = all[..place].iter().any(|earlier| output::is_same(earlier, path));
        if twice {
            return Err(Failure::Other(format!("{} is named twice; name each repeated session once", path.display())));
        }
        let arguments = SessionArguments { session: path.to_path_buf(), ..first.clone() };
        let (session, sources) = read_session(&arguments, outputs)?;
        if common.json.is_some() {
            origin.add(Origin::of_session(&sources));
        }
        let (problem, fit) = abbe::identify::fit::prepare(&session, common.seed)?;
        let report = abbe::identify::fit::report(&problem, &fit)?;
        let named: Vec<String> =
            report.warnings.iter().map(|warning| format!("{}: {warning}", path.display())).collect();
        message::print_warnings(&named);
        sessions.push(repeated::Session::new(&path.display().to_string(), &problem, &fit));
    }
    let result = repeated::compare(&sessions)?;
    if outputs.tables(common.quiet) {
        print(&result);
    }
    if let Some(path) = &common.json {
        json::write(path, origin, Some(common.seed), &result)?;
    }
    Ok(())
}

fn print(result: &Repeated) {
    say!("{} of one plan, each fitted separately\n", counted(result.sessions.len(), "session"));
    output::print(&present::parameters(result));
    say!(
        "\nType A: from the scatter of the sessions, s/√n of their mean, s of one session. Type B: standard uncertainty u of one fit.\n\
         p: probability of such a ratio s/u by chance."
    );
    if !result.deviating.is_empty() {
        output::print(&present::deviating(result));
    } else if result.sessions.len() > 2 {
        say!("No session deviates significantly from the others.");
    }
}
