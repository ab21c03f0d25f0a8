//! The parts of a paper of sessions.

use std::path::{Path, PathBuf};

use abbe::analysis::problem_of;
use abbe::identify::problem::Problem;
use abbe::model::Diagnostic;
use abbe::model::effect::Effect;
use abbe::model::session::Session;
use abbe::plan::bias::{bias_table, usual_effects};
use abbe::plan::structure::structure;
use abbe::plan::{self, PlanOptions};
use abbe::trace::SessionFit;
use abbe::trace::candidates::named::effect;

use super::PaperArguments;
use crate::cli::failure::command_line;
use crate::report::paper::contents::{self, Study};
use crate::report::paper::{Part, SUBJECTS, Subject, equations};

/// Effects of the bias table where none are named.
const BIASING_EFFECTS: usize = 12;

/// A session with its results.
pub fn study(arguments: &PaperArguments, label: String, session: &Session) -> Result<Study, Diagnostic> {
    let options = PlanOptions { effects: false, ..PlanOptions::default() };
    let analysis = plan::analyse(session, &options)?;
    let problem = problem_of(session, &options)?;
    let bias = if arguments.effects.is_empty() {
        bias_table(&problem, &usual_effects(&problem)?)?.largest(BIASING_EFFECTS)
    } else {
        bias_table(&problem, &named(&problem, &arguments.effects)?)?
    };
    let structure = structure(&problem)?;
    let measured = session.tests.iter().all(|test| test.readings.is_some());
    let fitted = if measured { Some(SessionFit::of(session, arguments.seed)?) } else { None };
    Ok(Study { label, problem, analysis, structure, bias, fitted })
}

fn named(problem: &Problem, ids: &[String]) -> Result<Vec<Effect>, Diagnostic> {
    ids.iter().map(|id| effect(problem, id)).collect()
}

/// The requested parts that the sessions have.
pub fn parts(arguments: &PaperArguments, studies: &[Study]) -> Result<Vec<Part>, Diagnostic> {
    let study = &studies[0];
    let mut sections = Vec::new();
    for (word, subject) in SUBJECTS {
        let is_named = arguments.parts.contains(subject);
        if !arguments.parts.is_empty() && !is_named {
            continue;
        }
        let section = match subject {
            Subject::Methods => Some(contents::methods(study)),
            Subject::SetUp => Some(contents::set_up(study)),
            Subject::Equations => Some(equations::part(study, arguments.two_column)?),
            Subject::Sensitivity => Some(contents::sensitivity(study)?),
            Subject::Uncertainty => Some(contents::uncertainty(study)),
            Subject::Correlation => Some(contents::correlation(study)),
            Subject::Identifiability => Some(contents::identifiability(study)),
            Subject::Bias => Some(contents::bias(study)),
            Subject::Comparison => (studies.len() > 1).then(|| contents::comparison(studies)),
            Subject::Trace => contents::trace(study)?,
        };
        match section {
            Some(section) => sections.push(section.with_set_up_in_words(&study.problem)),
            None if is_named && *subject == Subject::Comparison => {
                return Err(command_line("`--parts comparison` needs at least two sessions; name another"));
            }
            None if is_named => {
                return Err(Diagnostic::other(format!(
                    "`--parts {word}`: {} has no readings; name a measured session, or leave the part out",
                    arguments.sessions[0].display()
                )));
            }
            None => {}
        }
    }
    Ok(sections)
}

/// The name of a session in tables: that of its file, or of its folder if several have the same name.
pub fn label(sessions: &[PathBuf], path: &Path) -> String {
    let stem = |path: &Path| path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    let own = stem(path);
    if sessions.iter().filter(|other| stem(other) == own).count() == 1 {
        return own;
    }
    path.with_extension("").display().to_string()
}
