//! Parts of the first screens of `fit` and `trace`: the table of errors, the folded set-up parameters, what is
//! confounded, the next steps.

use std::path::Path;

use abbe::identify::fit::Fit;
use abbe::identify::parameters::{Parameter, Role};
use abbe::identify::plausibility::{Pull, Pulls};
use abbe::identify::problem::Problem;
use abbe::identify::results::{Outlier, ParameterResult, Unobservable};
use abbe::model::words::counted;

use super::{SessionArguments, table};

/// Entries of a long list that the first screen shows.
pub const MAX_LISTED: usize = 3;
/// Errors that the first screen shows.
const MAX_ERRORS: usize = 20;

/// Prints the first lines of a list and the number of the others; every line with `all`.
pub fn list(lines: &[String], indent: &str, all: bool) {
    // One line more costs no more room than the number of the others.
    let shown = if all || lines.len() <= MAX_LISTED + 1 { lines.len() } else { MAX_LISTED };
    for line in &lines[..shown] {
        say!("{indent}{line}");
    }
    if shown < lines.len() {
        say!("{indent}… {} more; --all lists them", lines.len() - shown);
    }
}

/// `identifiable` of `count` parameters, and the rank.
pub fn rank(identifiable: usize, count: usize, rank: usize) -> String {
    format!("{identifiable} of {} identifiable (numerical rank {rank})", counted(count, "parameter"))
}

/// The parameters of a fit, errors and coefficients of effects apart from set-up parameters.
pub struct Estimates<'r> {
    errors: Vec<&'r ParameterResult>,
    setup: Vec<&'r ParameterResult>,
    /// Pulls of set-up parameters, by their identifiers.
    pulls: Vec<(&'r str, Pull)>,
}

impl<'r> Estimates<'r> {
    /// Of the results of a fit, without the parameters that are printed elsewhere.
    pub fn new(
        problem: &'r Problem,
        fit: &Fit,
        parameters: &'r [ParameterResult],
        elsewhere: impl Fn(&str) -> bool,
    ) -> Estimates<'r> {
        let list = &problem.parameters.list;
        let is_setup =
            |result: &&ParameterResult| list.iter().any(|p: &Parameter| p.role == Role::Setup && p.id == result.id);
        let (setup, errors) = parameters.iter().filter(|p| !elsewhere(&p.id)).partition(is_setup);
        let pulls = Pulls::of(problem, fit).each.into_iter();
        Estimates { errors, setup, pulls: pulls.map(|pull| (list[pull.parameter].id.as_str(), pull)).collect() }
    }

    /// Prints the errors in a table and the set-up parameters in one line; the set-up parameters in a table too with
    /// `all`.
    pub fn print(&self, all: bool) {
        if !self.errors.is_empty() {
            say!(
                "\nEstimates with standard uncertainty u and expanded uncertainty U = 2u (*: significant, |value| > U):"
            );
            print_parameters(&self.shown(all));
            match self.errors.len().saturating_sub(MAX_ERRORS) {
                more if more > 0 && !all => say!("  … {more} less significant; --all lists them"),
                _ => {}
            }
        }
        if self.setup.is_empty() {
            return;
        }
        if all {
            say!("\nSet-up parameters, as deviations from their stated values:");
            self.print_setup();
        } else {
            self.print_folded_setup();
        }
    }

    /// Prints the set-up parameters in one line.
    pub fn print_folded_setup(&self) {
        if self.setup.is_empty() {
            return;
        }
        let largest = match self.largest_pull() {
            Some((id, pull)) => format!(", largest pull {:.1} ({id})", pull.pull.abs()),
            None => String::new(),
        };
        say!("  {}{largest}; --all lists them", counted(self.setup.len(), "set-up parameter"));
    }

    /// Whether this is a set-up parameter.
    pub fn is_setup(&self, id: &str) -> bool {
        self.setup.iter().any(|p| p.id == id)
    }

    /// All errors, or the most significant ones in the order of the session.
    fn shown(&self, all: bool) -> Vec<&'r ParameterResult> {
        let ratio = |p: &ParameterResult| {
            if p.u > 0.0 { (p.value / p.u).abs() } else { f64::INFINITY }
        };
        let mut order: Vec<usize> = (0..self.errors.len()).collect();
        if !all && order.len() > MAX_ERRORS {
            order.sort_by(|a, b| ratio(self.errors[*b]).total_cmp(&ratio(self.errors[*a])));
            order.truncate(MAX_ERRORS);
            order.sort_unstable();
        }
        order.into_iter().map(|k| self.errors[k]).collect()
    }

    fn print_setup(&self) {
        let rows: Vec<Vec<String>> = (self.setup.iter())
            .map(|p| {
                let (value, u) = table::value_and_u(p.value, p.u);
                let pull = self.pulls.iter().find(|(id, _)| *id == p.id);
                vec![
                    p.id.clone(),
                    value,
                    u,
                    table::unit(&p.unit),
                    pull.map_or("–".to_string(), |(_, pull)| pull_text(pull.pull)),
                    p.meaning.clone(),
                ]
            })
            .collect();
        table::print_aligned(&["parameter", "value", "u", "unit", "pull", "meaning"], &rows, &[0, 3, 5]);
    }

    /// The set-up parameter that the readings move furthest from its stated value, in standard deviations.
    fn largest_pull(&self) -> Option<&(&'r str, Pull)> {
        let largest = |a: &&(&str, Pull), b: &&(&str, Pull)| a.1.pull.abs().total_cmp(&b.1.pull.abs());
        self.pulls.iter().max_by(largest)
    }
}

/// A pull with one decimal. A pull that rounds to zero has no sign.
fn pull_text(pull: f64) -> String {
    format!("{:.1}", (pull * 10.0).round() / 10.0 + 0.0)
}

/// A table of parameters with u, U, significance and meaning.
pub fn print_parameters(parameters: &[&ParameterResult]) {
    let rows: Vec<Vec<String>> = parameters
        .iter()
        .map(|p| {
            let (value, u) = table::value_and_u(p.value, p.u);
            // Rounded to the same place.
            let (expanded, _) = table::value_and_u(p.expanded_u, p.u);
            let mark = if p.significant { "*" } else { "" };
            vec![p.id.clone(), value, u, expanded, table::unit(&p.unit), mark.to_string(), p.meaning.clone()]
        })
        .collect();
    table::print_aligned(&["parameter", "value", "u", "U", "unit", "", "meaning"], &rows, &[0, 4, 5, 6]);
}

/// Prints what the readings leave open: null-space directions, then outliers. One line where there is nothing.
pub fn print_missing(null_space: &[Unobservable], outliers: &[Outlier], all: bool) {
    if null_space.is_empty() && outliers.is_empty() {
        say!("\nNo parameters are confounded. No reading is an outlier.");
        return;
    }
    if null_space.is_empty() {
        say!("\nNo parameters are confounded.");
    } else {
        let directions = counted(null_space.len(), "null-space direction");
        say!("\nConfounded: {directions} (a combination that leaves every reading unchanged)");
        let lines: Vec<String> = null_space.iter().map(|item| table::with_symbols(&item.why)).collect();
        list(&lines, "  ", all);
    }
    if outliers.is_empty() {
        return;
    }
    let line = |reading: &Outlier| {
        format!(
            "{}  {}:{}  residual {}",
            reading.test,
            reading.file,
            reading.line,
            table::micrometres(reading.residual_um)
        )
    };
    let is_are = if outliers.len() == 1 { "is" } else { "are" };
    say!("{} {is_are} excluded as outliers:", counted(outliers.len(), "reading"));
    let mut sorted: Vec<&Outlier> = outliers.iter().collect();
    if !all {
        sorted.sort_by(|a, b| b.residual_um.abs().total_cmp(&a.residual_um.abs()));
    }
    list(&sorted.into_iter().map(line).collect::<Vec<_>>(), "  ", all);
}

/// A next step: what to type or to do, and what it is for.
pub type Step = (String, String);

/// Prints what to do next.
pub fn print_next(steps: &[Step]) {
    if steps.is_empty() {
        return;
    }
    say!("\nNext:");
    let width = steps.iter().map(|(step, _)| step.chars().count()).max().unwrap_or(0);
    for (step, purpose) in steps {
        let padding = " ".repeat(width - step.chars().count());
        say!("  {step}{padding}  {purpose}");
    }
}

/// A command line of `abbe` on a session.
pub fn command(verb: &str, session: &SessionArguments, options: &str) -> String {
    let quoted = |path: &Path| {
        let path = path.display().to_string();
        if path.contains(char::is_whitespace) { format!("\"{path}\"") } else { path }
    };
    let mut words = vec!["abbe".to_string(), verb.to_string(), quoted(&session.session)];
    if let Some(data) = &session.data {
        words.push(format!("--data {}", quoted(data)));
    }
    if session.allow_outside {
        words.push("--allow-outside".to_string());
    }
    if !options.is_empty() {
        words.push(options.to_string());
    }
    words.join(" ")
}

/// The noise and its source in words. A residual is not called noise.
pub fn noise(noise_um: f64, source: &str) -> String {
    let figure = table::micrometres(noise_um);
    match source {
        "residual" => format!("residual of the declared model {figure} (no noise stated, no repeats)"),
        other => format!("noise {figure} ({other})"),
    }
}
