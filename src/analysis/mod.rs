//! Analyses: from options to a result, and from the result to its document, its report and its tables.
//!
//! The command line, Python, the page and the schemas are loops over them. An analysis is one file with its options, and one
//! line of [`ANALYSES`].

mod compare;
mod fit;
mod plan;
mod trace;
mod validate;

use std::any::Any;

use abbe_identify::fit::Fit;
use abbe_identify::model_file::IdentifiedModel;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::session::Session;
pub use abbe_trace::Progress;
use abbe_trace::{SessionFit, TraceOutcome};
pub use compare::{Compared, ComparisonOptions};
pub use fit::{FitOptions, Terms};
pub use plan::{Plan, PlanningOptions, problem_of};
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
pub use trace::{Candidates, SearchOptions};
pub use validate::{Validated, ValidationOptions};

use crate::document::{Call, Document, Origin};
use crate::report::block::Report;
use crate::report::commands::Commands;
use crate::report::table::Table;

/// What is analysed.
#[derive(Clone, Copy)]
pub enum Given<'g> {
    /// A session.
    Session(&'g Session),
    /// A saved model.
    Model(&'g IdentifiedModel),
}

/// Hears what is done, and answers whether to go on.
pub type Listener<'l> = &'l (dyn Fn(Progress) -> bool + Sync);

/// An analysis.
pub trait Analysis: Found + Sized {
    /// The name of its command.
    const NAME: &'static str;

    /// Its command, if that has no arguments beside files, options and outputs.
    const COMMAND: Option<Command> = None;

    /// The options on which the result depends, by their long names on the command line.
    type Options: Arguments;

    /// The result, as the document states it.
    type Result: JsonSchema + 'static;

    /// Analyses what is given. The seed is that of all random numbers.
    ///
    /// # Errors
    /// If something else is given than the analysis takes, or it cannot be analysed.
    fn run(given: &[Given<'_>], options: &Self::Options, seed: u64, listener: Listener<'_>)
    -> Result<Self, Diagnostic>;
}

/// The command of an analysis.
pub struct Command {
    /// What it does.
    pub about: &'static str,
    /// Examples.
    pub help: &'static str,
    /// The files that it reads, in the order of their arguments.
    pub reads: &'static [Kind],
}

/// What a file holds.
#[derive(Clone, Copy)]
pub enum Kind {
    /// A session.
    Session,
    /// A saved model.
    Model,
}

/// Options as JSON objects, and on the command line.
#[cfg(feature = "command")]
pub trait Arguments: Default + Serialize + DeserializeOwned + clap::Args {}
#[cfg(feature = "command")]
impl<O: Default + Serialize + DeserializeOwned + clap::Args> Arguments for O {}

/// Options as JSON objects.
#[cfg(not(feature = "command"))]
pub trait Arguments: Default + Serialize + DeserializeOwned {}
#[cfg(not(feature = "command"))]
impl<O: Default + Serialize + DeserializeOwned> Arguments for O {}

/// What an analysis found.
pub trait Found: Any + Send + Sync {
    /// The result, as the document states it.
    ///
    /// # Errors
    /// If the result is no JSON.
    fn result(&self) -> serde_json::Result<Value>;

    /// The report: the screen, and the page with its figures if they are wanted. It proposes `commands`.
    ///
    /// # Errors
    /// If the model cannot be evaluated.
    fn report(&self, commands: &Commands, figures: bool) -> Result<Report, Diagnostic>;

    /// The tables of the figures that the result is about.
    fn tables(&self) -> Vec<Table> {
        let report = self.report(&Commands::default(), false);
        report.map_or_else(|_| Vec::new(), |report| report.tables().cloned().collect())
    }

    /// The fits: one before and one after, or one, or none. The last is that of the result.
    fn fits(&self) -> Vec<(&Problem, &Fit)> {
        Vec::new()
    }

    /// Residuals observed less model of the tests by name, mm: all coordinates of a reading together. `before` is that of
    /// the model with which the analysis began.
    fn residuals_mm(&self, before: bool) -> Vec<(&str, &[f64])> {
        let fits = self.fits();
        let Some((problem, fit)) = (if before { fits.first() } else { fits.last() }) else { return Vec::new() };
        problem.tests.iter().map(|test| test.name.as_str()).zip(fit.residuals.iter().map(Vec::as_slice)).collect()
    }

    /// Why the model of the result is not to be saved.
    fn incomplete(&self) -> Option<String> {
        None
    }
}

/// A result with the call that gives it again.
pub struct Analysed {
    /// The name of the analysis, and the options that are not those of every call.
    pub call: Call,
    /// Seed of all random numbers.
    pub seed: u64,
    /// The result.
    pub found: Box<dyn Found>,
}

/// An analysis for a caller that chooses it by name: the options are a JSON object.
pub struct Line {
    /// Its name.
    pub name: &'static str,
    /// Its command, if that needs no code of its own.
    pub command: Option<Command>,
    /// The schema of its document.
    #[cfg(feature = "fleet")]
    pub schema: fn() -> Value,
    /// Adds its options to those of a command.
    #[cfg(feature = "command")]
    pub arguments: fn(clap::Command) -> clap::Command,
    /// The options on a command line, as a JSON object.
    #[cfg(feature = "command")]
    pub options: fn(&clap::ArgMatches) -> Result<String, Diagnostic>,
    /// Runs it: the options that differ from those of a call that states none, and what it found.
    pub run: fn(&[Given<'_>], &str, u64, Listener<'_>) -> Result<(Map<String, Value>, Box<dyn Found>), Diagnostic>,
}

const fn line<A: Analysis>() -> Line {
    Line {
        name: A::NAME,
        command: A::COMMAND,
        #[cfg(feature = "fleet")]
        schema: crate::document::of::<A::Result>,
        #[cfg(feature = "command")]
        arguments: <A::Options as clap::Args>::augment_args,
        #[cfg(feature = "command")]
        options: |matches| {
            let options = <A::Options as clap::FromArgMatches>::from_arg_matches(matches);
            let options = options.map_err(|cause| Diagnostic::other(cause.to_string()))?;
            serde_json::to_string(&options).map_err(|cause| Diagnostic::other(cause.to_string()))
        },
        run: |given, options, seed, listener| {
            let unusable =
                |cause: serde_json::Error| unusable(format!("an option of `{}` cannot be used: {cause}", A::NAME), "");
            let options: A::Options = serde_json::from_str(options).map_err(unusable)?;
            let stated = stated(&options).map_err(unusable)?;
            Ok((stated, Box::new(A::run(given, &options, seed, listener)?)))
        },
    }
}

/// The analyses.
pub static ANALYSES: [Line; 5] =
    [line::<SessionFit>(), line::<TraceOutcome>(), line::<Plan>(), line::<Validated>(), line::<Compared>()];

/// The options that differ from those of a call that states none.
///
/// # Errors
/// If they are no JSON object.
pub fn stated<O: Default + Serialize>(options: &O) -> serde_json::Result<Map<String, Value>> {
    let usual = serde_json::to_value(O::default())?;
    let mut stated: Map<String, Value> = serde_json::from_value(serde_json::to_value(options)?)?;
    stated.retain(|name, value| usual.get(name.as_str()) != Some(&*value));
    Ok(stated)
}

/// Runs the analysis of a name; the options are a JSON object.
///
/// # Errors
/// If there is no such analysis or option, and as [`Analysis::run`].
pub fn run(
    name: &str,
    given: &[Given<'_>],
    options: &str,
    seed: u64,
    listener: Listener<'_>,
) -> Result<Analysed, Diagnostic> {
    let line = ANALYSES.iter().find(|line| line.name == name);
    let line = line.ok_or_else(|| Diagnostic::other(format!("there is no analysis `{name}`")))?;
    let (options, found) = (line.run)(given, options, seed, listener)?;
    Ok(Analysed { call: Call { command: name.to_string(), options }, seed, found })
}

/// An option or an input that cannot be used, and what is expected.
fn unusable(message: String, expected: &str) -> Diagnostic {
    Diagnostic::session(message, expected)
}

/// The session of an analysis that takes one.
fn session_of<'g>(given: &[Given<'g>]) -> Result<&'g Session, Diagnostic> {
    match given {
        [Given::Session(session)] => Ok(session),
        _ => Err(unusable("one session is expected".to_string(), "")),
    }
}

impl Analysed {
    /// The document of `--json`.
    ///
    /// # Errors
    /// If the result is no JSON, in words.
    pub fn document(&self, origin: Origin) -> Result<String, String> {
        Document::text(self.call.clone(), origin, Some(self.seed), self.found.result())
    }

    /// The model of `--save`.
    ///
    /// # Errors
    /// If the result has none, or it is incomplete.
    pub fn model(&self, origin: &Origin) -> Result<IdentifiedModel, Diagnostic> {
        if let Some(why) = self.found.incomplete() {
            return Err(format!("no model: {why}, and effects may be missing from it").into());
        }
        let fits = self.found.fits();
        let (problem, fit) = fits.last().ok_or_else(|| format!("a result of `{}` has no model", self.call.command))?;
        IdentifiedModel::of_fit(problem, fit, origin.provenance(self.call.clone(), self.seed))
    }
}
