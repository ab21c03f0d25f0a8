//! `abbe plan --improve`, `--separate`.

mod candidates;

use std::path::PathBuf;

use abbe::files::SourceMap;
use abbe::identify::problem::Problem;
use abbe::model::Diagnostic;
use abbe::plan::design::Goal;
use abbe::plan::improve::{self, ImproveOptions, Improvement};
use clap::Args;

use self::candidates::CandidateArguments;
use crate::cli::{SessionArguments, next_session, values};

/// Maximum number of proposed tests. Each one is a search over all candidate tests.
const MAX_TESTS: usize = 24;

/// The search for a next test.
#[derive(Args)]
#[command(group = clap::ArgGroup::new("next_test").args(["improve", "separate"]))]
pub struct ImproveArguments {
    /// Propose tests that most lower the largest standard uncertainty (1 µm counts as 1″); 1 test if no number is
    /// given.
    ///
    /// Example: --improve 2
    #[arg(long, value_name = "TESTS", num_args = 0..=1, default_missing_value = "1", conflicts_with = "separate")]
    improve: Option<usize>,
    /// Propose a test that separates two effects, named by their identifiers.
    ///
    /// Example: --separate EZC~C:h2,EAC~C:h1
    #[arg(long, value_name = "A,B", allow_hyphen_values = true)]
    separate: Option<String>,
    #[command(flatten)]
    pub candidates: CandidateArguments,
    /// Write the session with the result in it: the proposed tests stand at its end, with all positions.
    ///
    /// Example: --improve 2 --write next.toml
    #[arg(long, value_name = "FILE", requires = "next_test")]
    pub write: Option<PathBuf>,
}

impl ImproveArguments {
    /// Whether a next test is requested.
    pub fn asked(&self) -> bool {
        self.improve.is_some() || self.separate.is_some()
    }

    /// Refuses to write a session with other mounts or priors than the session file states.
    pub fn refuse_overrides(&self, are_given: bool) -> Result<(), Diagnostic> {
        let message = "`--write` with `--one-spindle-ball` or `--setup-um` would write a session that is not the planned one: \
                       state the mount or the uncertainties in the session file, then plan without these options";
        match self.write.is_some() && are_given {
            true => Err(Diagnostic::other(message.to_string())),
            false => Ok(()),
        }
    }

    /// Writes the session with the proposed tests, if requested.
    pub fn write(
        &self,
        found: &Improvement,
        sources: &SourceMap,
        session: &SessionArguments,
    ) -> Result<(), Diagnostic> {
        let Some(path) = &self.write else {
            return Ok(());
        };
        if found.steps.is_empty() {
            let message = format!("`--write`: no candidate test helps, so that {} is not written", path.display());
            return Err(Diagnostic::other(message));
        }
        next_session::write(path, sources, session, |text| {
            found.steps.iter().try_for_each(|step| text.add_block(&step.proposal))
        })
    }

    /// Proposes tests, if they are requested.
    pub fn run(&self, problem: &Problem) -> Result<Option<Improvement>, Diagnostic> {
        if !self.asked() {
            return Ok(None);
        }
        let (candidates, by_minute) = (self.candidates.tests()?, self.candidates.by_minute());
        if let Some(pair) = &self.separate {
            let pair = pair.split_once(',').map(|(a, b)| [a.trim(), b.trim()]).filter(|[a, b]| a != b).ok_or_else(|| {
                Diagnostic::other(format!(
                    "`--separate {pair}`: two different effects with a comma between them are expected, as in EZC~C:h2,EAC~C:h1"
                ))
            })?;
            return Ok(Some(improve::separating(problem, pair, &candidates, by_minute)?));
        }
        let tests = values::count("--improve", "tests", self.improve.unwrap_or(1), MAX_TESTS)?;
        let options = ImproveOptions { goal: Goal::WorstUncertainty, tests, by_minute };
        Ok(Some(improve::improve(problem, &candidates, &options)?))
    }
}
