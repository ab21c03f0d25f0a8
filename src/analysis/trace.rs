//! The search for the effect behind the residual of a session, and for tests that separate it from its aliases.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use abbe_identify::fit::Fit;
use abbe_identify::plausibility::accepted;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_plan::aliases::separate_aliases;
use abbe_plan::attainable;
use abbe_plan::variations::TestVariations;
use abbe_trace::{Progress, TraceOptions, TraceOutcome, trace};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::fit::estimates;
use super::{Analysis, Found, Given, Listener, session_of, unusable};
use crate::document::{Stated, StatedTrace, json};
use crate::report;
use crate::report::block::Report;
use crate::report::commands::Commands;
use crate::report::table::Table;

/// Which effects a search considers, and how many it adds.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default)]
pub struct Candidates {
    /// Maximum number of effects of a session (default: until the held-out error stops improving).
    ///
    /// Example: --max-effects 2
    #[cfg_attr(feature = "command", arg(long, value_name = "N"))]
    pub max_effects: Option<usize>,
    /// Search only effects whose identifier contains this text; may be repeated.
    ///
    /// Example: --only EZC --only ~time --only :h2
    #[cfg_attr(feature = "command", arg(long, value_name = "TEXT", allow_hyphen_values = true))]
    pub only: Vec<String>,
    /// Do not search effects whose identifier contains this text; may be repeated.
    ///
    /// Example: --exclude :spline --exclude ~time
    #[cfg_attr(feature = "command", arg(long, value_name = "TEXT", allow_hyphen_values = true))]
    pub exclude: Vec<String>,
}

/// The options of a search.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(from = "Named")]
pub struct SearchOptions {
    /// Which effects.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub candidates: Candidates,
    /// Explanation that is accepted on the user's word: a found effect, or one of its aliases, which then takes its place.
    /// Uncertainties do not cover the others; every output says so. May be repeated.
    ///
    /// Example: --assume EAC~C:h1
    #[cfg_attr(feature = "command", arg(long, value_name = "EFFECT", allow_hyphen_values = true))]
    pub assume: Vec<String>,
    /// Accept readings that contradict the machine, such as axes more than 5 % of a link beside their place. Without it they
    /// are refused where another reading of the file explains them.
    #[cfg_attr(feature = "command", arg(long))]
    pub allow_implausible: bool,
    /// Seconds after which the search ends with the effects found so far. A time beyond what a clock can hold is no limit.
    #[cfg_attr(feature = "command", arg(skip))]
    pub time_limit: Option<f64>,
}

/// The options by their names. A struct within another one would not refuse a name that it does not know.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Named {
    max_effects: Option<usize>,
    only: Vec<String>,
    exclude: Vec<String>,
    assume: Vec<String>,
    allow_implausible: bool,
    time_limit: Option<f64>,
}

impl From<Named> for SearchOptions {
    fn from(named: Named) -> SearchOptions {
        let Named { max_effects, only, exclude, assume, allow_implausible, time_limit } = named;
        SearchOptions { candidates: Candidates { max_effects, only, exclude }, assume, allow_implausible, time_limit }
    }
}

impl SearchOptions {
    /// The same for the library.
    pub fn with_seed(&self, seed: u64) -> TraceOptions {
        let SearchOptions { candidates: Candidates { max_effects, only, exclude }, assume, .. } = self.clone();
        TraceOptions { seed, max_effects, only, exclude, assume, ..TraceOptions::default() }
    }
}

impl Analysis for TraceOutcome {
    const NAME: &'static str = "trace";
    type Options = SearchOptions;
    type Result = StatedTrace<'static>;

    fn run(
        given: &[Given<'_>],
        options: &SearchOptions,
        seed: u64,
        listener: Listener<'_>,
    ) -> Result<Self, Diagnostic> {
        if let Some(seconds) = options.time_limit.filter(|seconds| !(*seconds > 0.0 && seconds.is_finite())) {
            return Err(unusable(format!("`time_limit` is {seconds}"), "a positive number of seconds is expected"));
        }
        let limit = options.time_limit.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        let end = limit.and_then(|limit| Instant::now().checked_add(limit));
        let refused: Mutex<Option<Diagnostic>> = Mutex::new(None);
        let stopped = AtomicBool::new(false);
        let report = |progress: Progress| {
            if let Progress::Contradicted(found) = &progress
                && !options.allow_implausible
                && let Err(error) = accepted(found)
                && let Ok(mut refused) = refused.lock()
            {
                *refused = Some(error);
                return false;
            }
            let goes_on = listener(progress);
            stopped.fetch_or(!goes_on, Ordering::Relaxed);
            goes_on && end.is_none_or(|end| Instant::now() < end)
        };
        let mut found = trace(session_of(given)?, &options.with_seed(seed), &report)?;
        if let Some(error) = refused.lock().ok().and_then(|mut refused| refused.take()) {
            return Err(error);
        }
        report(Progress::ComparingTests);
        separate_aliases(&mut found, &TestVariations::short(), &report)?;
        if let Some(seconds) = options.time_limit.filter(|_| !stopped.load(Ordering::Relaxed)) {
            found.result.mark_time_limit(seconds);
        }
        Ok(found)
    }
}

impl Found for TraceOutcome {
    fn result(&self) -> serde_json::Result<Value> {
        json(&stated(self))
    }

    fn report(&self, commands: &Commands, figures: bool) -> Result<Report, Diagnostic> {
        report::trace::report(self, &stated(self), commands, figures)
    }

    fn tables(&self) -> Vec<Table> {
        let after = estimates(&self.after, &self.after_fit, &self.result.after.parameters);
        std::iter::once(report::trace::before_and_after(&self.result)).chain(after).collect()
    }

    fn fits(&self) -> Vec<(&Problem, &Fit)> {
        vec![(&self.before, &self.before_fit), (&self.after, &self.after_fit)]
    }

    fn incomplete(&self) -> Option<String> {
        self.result.interrupted.then(|| format!("the trace was {}", self.result.interruption()))
    }
}

fn stated(found: &TraceOutcome) -> StatedTrace<'_> {
    let mut statements = abbe_trace::statements::of_trace(&found.after, &found.result);
    statements.measure.step = attainable(&found.after, statements.measure.step);
    Stated { statements, result: &found.result }
}
